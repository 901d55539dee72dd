//! Wrong signs of the automatic method on clouds whose normals are known. `cargo test -p isograd-benches orientation --
//! --nocapture` prints them.

use isograd::Stage;
use isograd::neighbors::Radius;
use isograd::orient::Method;

use super::measure::{Signs, cloud, plan};
use super::suite::by_name;

/// Largest share of wrong signs, in percent.
const LIMIT: f64 = 0.5;

/// Evaluates clouds of the suite, prints the errors, and returns those above the limit.
fn too_many_wrong(names: &[&str]) -> Vec<String> {
    let mut failed = Vec::new();
    for name in names {
        let body = by_name(name).expect("in the suite").body();
        let mut plan = plan(Radius::Auto, Method::Auto);
        let out = plan.orient(&cloud(&body.points)).expect("signs");
        let (wrong, doubtful) = (Signs::new(&body, out).percent(), 100.0 * out.doubtful());
        let seconds = plan.report().seconds.of(Stage::Orient);
        println!(
            "{name:20} {:6} points  wrong {wrong:5.2} %  doubtful {doubtful:5.2} %  {seconds:.3} s",
            body.points.len()
        );
        if !(wrong <= LIMIT) {
            failed.push(format!("{name}: {wrong:.2} % > {LIMIT} %"));
        }
    }
    failed
}

#[test]
fn nested_touching_and_knotted_bodies_and_outliers_are_right() {
    let failed = too_many_wrong(&[
        "nested",
        "nested ball",
        "boxes face",
        "boxes edge",
        "boxes corner",
        "knot",
        "outliers 1%",
    ]);
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn thin_walls_plates_and_gaps_of_two_spacings_are_right() {
    let failed = too_many_wrong(&[
        "shell 2",
        "box shell 2",
        "plate 2",
        "gap 2",
        "boxes apart 2",
    ]);
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn noise_that_is_small_beside_the_body_turns_few_signs() {
    let failed = too_many_wrong(&["torus noise 0.01", "knot noise 0.01", "car noise 0.005"]);
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn patches_beside_holes_and_narrow_faces_are_right() {
    let failed = too_many_wrong(&[
        "bracket 1 holes",
        "bracket 4 holes",
        "tubes 0.01",
        "grating 0.02",
        "discs 0.02",
        "stack 0.02",
    ]);
    assert!(failed.is_empty(), "{failed:?}");
}
