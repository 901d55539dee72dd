//! Signs from sensors, and from the call before.

use super::shapes::{Random, Sampled, cuboid, cut, inside_out, join, sphere, torus};
use super::*;
use crate::neighbors::{self, Radius};
use crate::vector::{add, dot, scale, sub};
use crate::{PointCloud, PointCloudError, normals};

const ORIGIN: [f64; 3] = [0.0; 3];

/// Orients a cloud, in a scratch that may hold the call before.
fn run(
    points: &[[f64; 3]],
    sensors: Option<&Sensors<f64>>,
    method: Method,
    scratch: &mut Scratch,
) -> Result<Orientation<f64>, Error> {
    let mut neighborhoods = Neighborhoods::default();
    neighbors::forward(points, Radius::Auto, &mut neighborhoods).unwrap();
    let mut axes = normals::Residual::default();
    normals::forward(&neighborhoods, &mut axes);
    let known = Known {
        normals: None,
        sensors,
    };
    let mut out = Orientation::default();
    forward(
        points,
        &axes.normals,
        &neighborhoods,
        known,
        &method,
        scratch,
        &mut out,
    )
    .map(|()| out)
}

/// Wrong signs, and axes within 60 degrees of the truth.
fn judge(out: &Orientation<f64>, truth: &[[f64; 3]]) -> (usize, usize) {
    let cosines = out.normals.iter().zip(truth).map(|(&n, &t)| dot(n, t));
    let judged: Vec<f64> = cosines.filter(|c| c.abs() > 0.5).collect();
    (judged.iter().filter(|&&c| c < 0.0).count(), judged.len())
}

fn seen(sampled: &Sampled, sensors: Sensors<f64>) -> Orientation<f64> {
    let scratch = &mut Scratch::default();
    run(&sampled.0, Some(&sensors), Method::Sensors, scratch).unwrap()
}

#[test]
fn a_sensor_for_each_point_settles_what_the_points_alone_do_not() {
    // A plate of one spacing (20,000 samples on 2 × 2 × 2: 0.02), each side seen slantwise from afar.
    let plate = cuboid(20_000, [1.0, 1.0, 0.01], 3);
    let mut random = Random(4);
    let mut slant = || scale(random.direction(), 0.7);
    let positions = plate.0.iter().zip(&plate.1);
    let positions = positions.map(|(&x, &n)| add(x, scale(add(n, slant()), 3.0)));
    let out = seen(&plate, Sensors::Each(positions.collect()));
    let (wrong, judged) = judge(&out, &plate.1);
    // An axis that is 50 degrees askew, seen 45 degrees off the other way.
    assert!(wrong <= 20, "{wrong}");
    assert!(judged > 19_000);
    assert!(out.decided.given > 19_000 && out.method == MethodUsed::Sensors);
}

#[test]
fn what_one_sensor_sees_of_a_ball_is_right_up_to_the_grazing_views() {
    let ball = sphere(20_000, ORIGIN, 1.0, 5);
    for distance in [1.5, 20.0] {
        let eye = [0.0, 0.0, distance];
        let visible = ball.0.iter().zip(&ball.1);
        let visible: Sampled = visible
            .filter(|&(&x, &n)| dot(n, sub(eye, x)) > 0.0)
            .unzip();
        let out = seen(&visible, Sensors::Any(vec![eye]));
        assert_eq!(judge(&out, &visible.1).0, 0, "{distance}");
        let grazing = visible.0.len() - out.decided.given;
        assert!(grazing > 0, "{distance}");
    }
}

#[test]
fn a_room_is_seen_from_within_and_a_flat_sheet_from_its_side() {
    let room = inside_out(cuboid(20_000, [1.0, 0.8, 0.5], 6));
    let inside = [[0.3, 0.2, 0.1], [-0.6, -0.5, -0.2]];
    for sensors in [&inside[..1], &inside[..]] {
        let out = seen(&room, Sensors::Any(sensors.to_vec()));
        let (wrong, _) = judge(&out, &room.1);
        // At an edge an axis may belong to either wall.
        assert!(wrong <= 5, "{} sensors: {wrong}", sensors.len());
    }
    let mut random = Random(7);
    let sheet: Sampled = (0..3000)
        .map(|_| ([random.unit(), random.unit(), 0.0], [0.0, 0.0, -1.0]))
        .unzip();
    let out = seen(&sheet, Sensors::Any(vec![[0.5, 0.5, -0.4]]));
    assert_eq!(judge(&out, &sheet.1), (0, 3000));
}

#[test]
fn sensors_that_disagree_leave_a_point_to_enclosure() {
    let ball = torus(20_000, 8);
    let round = vec![[4.0, 0.0, 0.5], [-2.0, 3.4, 0.5], [-2.0, -3.4, -0.5]];
    let out = seen(&ball, Sensors::Any(round));
    assert_eq!(judge(&out, &ball.1).0, 0);
    assert!(out.decided.evidence > 5_000, "{:?}", out.decided);
}

#[test]
fn sensors_that_cannot_be_used_are_refused() {
    let (points, _) = sphere(300, ORIGIN, 1.0, 9);
    let ask = |sensors: Option<Sensors<f64>>| {
        let scratch = &mut Scratch::default();
        run(&points, sensors.as_ref(), Method::Sensors, scratch).unwrap_err()
    };
    assert_eq!(ask(None), Error::NoSensors);
    assert_eq!(ask(Some(Sensors::Any(Vec::new()))), Error::NoSensors);
    let far = vec![[9.0; 3]; 299];
    assert!(matches!(
        ask(Some(Sensors::Each(far.clone()))),
        Error::Count { vectors: 299, .. }
    ));
    let on_point = vec![[9.0; 3], points[7]];
    let index = 7;
    assert_eq!(
        ask(Some(Sensors::Any(on_point))),
        Error::SensorOnPoint { index }
    );
    let cloud = |sensors| {
        PointCloud::new(points.clone())
            .unwrap()
            .with_sensors(sensors)
    };
    let count = |sensors| PointCloudError::SensorCount {
        points: 300,
        sensors,
    };
    assert_eq!(cloud(Sensors::Each(far.clone())), Err(count(299)));
    assert_eq!(cloud(Sensors::Any(Vec::new())), Err(count(0)));
    let broken = vec![[1.0; 3], [1.0, f64::NAN, 0.0]];
    assert_eq!(
        cloud(Sensors::Any(broken)),
        Err(PointCloudError::SensorNotFinite { index: 1 })
    );
    let kept = cloud(Sensors::Any(far.clone())).unwrap();
    assert_eq!(kept.sensors(), Some(&Sensors::Any(far)));
}

/// A cloud turned about a slanted axis.
fn turned((points, truth): &Sampled, angle: f64) -> Sampled {
    let axis = vector::normalized([0.3, 1.0, -0.5]).unwrap();
    let (sin, cos) = angle.sin_cos();
    // Rodrigues' formula.
    let turn = |&x: &[f64; 3]| {
        let along = scale(axis, (1.0 - cos) * dot(axis, x));
        add(
            add(scale(x, cos), scale(vector::cross(axis, x), sin)),
            along,
        )
    };
    (
        points.iter().map(turn).collect(),
        truth.iter().map(turn).collect(),
    )
}

#[test]
fn a_turning_body_keeps_its_signs_through_every_step() {
    let ring = torus(4_000, 4);
    let apart = ring.0.iter().map(|&x| add(x, [3.0, 0.0, 0.0])).collect();
    let blocks = join(cuboid(6_000, [1.0, 0.7, 0.5], 3), (apart, ring.1));
    let mut scratch = Scratch::default();
    for step in 0..12 {
        let now = turned(&blocks, 0.6 * f64::from(step));
        let out = run(&now.0, None, Method::Previous, &mut scratch).unwrap();
        // An axis at an edge of the block may be taken for that of another face.
        let (wrong, _) = judge(&out, &now.1);
        assert!(wrong <= 3, "step {step}: {wrong}");
        match out.method {
            // A turn of 34 degrees is nothing new to a ball, but the first step is.
            MethodUsed::Auto => assert_eq!(step, 0),
            MethodUsed::Previous { turned } => assert_eq!(out.decided.neighbors, turned),
            other => panic!("{other:?}"),
        }
        let all = out.decided.given + out.decided.neighbors + out.decided.evidence;
        assert_eq!(all + out.decided.rule, now.0.len());
    }
}

#[test]
fn axes_that_have_turned_far_follow_their_neighbors() {
    let block = cuboid(10_000, [1.0, 0.7, 0.5], 3);
    let mut scratch = Scratch::default();
    let first = run(&block.0, None, Method::Previous, &mut scratch).unwrap();
    // Two in a hundred points were elsewhere before: on another face, as far as their normals tell.
    let mut moved = block.clone();
    for i in (0..10_000).step_by(50) {
        moved.0.swap(i, (i + 5_001) % 10_000);
        moved.1.swap(i, (i + 5_001) % 10_000);
    }
    let out = run(&moved.0, None, Method::Previous, &mut scratch).unwrap();
    let MethodUsed::Previous { turned } = out.method else {
        panic!("{:?}", out.method);
    };
    assert!((50..=300).contains(&turned), "{turned}");
    // Swapped points on opposite faces have turned by 180 degrees, which nobody can see.
    let opposite = moved.1.iter().zip(&first.normals);
    let opposite = opposite.filter(|&(&now, &before)| dot(now, before) < -0.5);
    let (wrong, _) = judge(&out, &moved.1);
    // Nor a few whose axis, at an edge, is less than 60 degrees from either of two opposite sides.
    assert!(wrong.abs_diff(opposite.count()) <= 8, "{wrong}");
}

#[test]
fn other_points_are_oriented_anew() {
    let ball = sphere(4_000, ORIGIN, 1.0, 5);
    let mut scratch = Scratch::default();
    let mut ask = |points: &[[f64; 3]]| {
        let out = run(points, None, Method::Previous, &mut scratch).unwrap();
        out.method
    };
    assert_eq!(ask(&ball.0), MethodUsed::Auto);
    assert_eq!(ask(&ball.0), MethodUsed::Previous { turned: 0 });
    assert_eq!(ask(&ball.0[1..]), MethodUsed::Auto);
    let mut shuffled = ball.0[1..].to_vec();
    shuffled.rotate_left(1234);
    assert_eq!(ask(&shuffled), MethodUsed::Auto);
    assert_eq!(ask(&shuffled), MethodUsed::Previous { turned: 0 });
}

#[test]
fn a_doubt_stays_until_the_signs_are_searched_for_again() {
    let bowl = cut(sphere(6_000, ORIGIN, 1.0, 5), |x| x[2] < 0.3);
    let mut scratch = Scratch::default();
    let auto = run(&bowl.0, None, Method::Previous, &mut scratch).unwrap();
    for _ in 0..3 {
        let after = run(&bowl.0, None, Method::Previous, &mut scratch).unwrap();
        assert_eq!(after.normals, auto.normals);
        for (a, b) in after.confidence.iter().zip(&auto.confidence) {
            // Kept in single precision.
            assert!((a - b).abs() < 1e-6);
        }
        assert_eq!(after.flipped, auto.flipped);
    }
}
