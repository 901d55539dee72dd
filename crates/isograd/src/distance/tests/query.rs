use super::{Random, brute_force, soup, torus};
use crate::distance::{Distance, Error, NO_TRIANGLE, Query};
use crate::vector::{add, cross, dot, norm, of_f64, scale, sub, to_f64};
use crate::{Field, Grid, Mesh, Real};

fn points<T: Real>(n: usize, size: f64, seed: u64) -> Vec<[T; 3]> {
    let mut random = Random::new(seed);
    (0..n)
        .map(|_| of_f64(random.near([0.0; 3], size)))
        .collect()
}

fn assert_exact<T: Distance>(mesh: Mesh<T>, points: &[[T; 3]], tolerance: f64) {
    let query = Query::new(mesh).expect("a mesh");
    let hits = query.query(points, None);
    assert_eq!(hits.len(), points.len());
    for (&q, hit) in points.iter().zip(&hits) {
        let (_, found) = brute_force(query.mesh(), to_f64(q));
        let error = (hit.distance.f64().abs() - found.distance).abs();
        assert!(
            error <= tolerance * found.distance,
            "{q:?}: {hit:?}, not {found:?}"
        );
        let corners = query.mesh().corners(hit.triangle as usize).map(to_f64);
        let point = (0..3).fold([0.0; 3], |sum, k| {
            add(sum, scale(corners[k], hit.barycentric[k].f64()))
        });
        // Weights and point are each rounded to T; coordinates are up to 3.
        assert!(norm(sub(point, to_f64(hit.point))) < 20.0 * T::epsilon().f64());
        let length = norm(to_f64(hit.gradient));
        assert!(
            (length - 1.0).abs() < 4.0 * T::epsilon().f64(),
            "{q:?}: {length} {hit:?} {found:?}"
        );
    }
}

#[test]
fn distance_is_that_of_all_triangles_tried() {
    for (seed, triangles) in [(1, 1), (2, 3), (3, 33), (4, 500)] {
        for (n, size) in [(1, 1.0), (7, 2.0), (300, 1.2), (64, 30.0), (64, 0.05)] {
            assert_exact(
                soup::<f64>(triangles, seed),
                &points(n, size, seed + 100),
                1e-12,
            );
            assert_exact(
                soup::<f32>(triangles, seed),
                &points(n, size, seed + 100),
                1e-6,
            );
        }
    }
    assert_exact(torus::<f64>(40, 15), &points(500, 1.1, 9), 1e-12);
    // Large: frames are made as they are needed.
    assert_exact(torus::<f64>(60, 31), &points(300, 1.1, 10), 1e-12);
    assert_exact(soup::<f32>(3300, 5), &points(100, 2.0, 11), 1e-6);
}

#[test]
fn no_points_are_no_hits() {
    let query = Query::new(torus::<f32>(9, 5)).expect("a mesh");
    assert!(query.query(&[], None).is_empty());
}

/// A tetrahedron of random corners, its faces counter-clockwise from outside.
fn tetrahedron(random: &mut Random) -> Mesh<f64> {
    let mut v = [(); 4].map(|()| random.point());
    if dot(sub(v[3], v[0]), cross(sub(v[1], v[0]), sub(v[2], v[0]))) > 0.0 {
        v.swap(1, 2);
    }
    Mesh::new(v.to_vec(), vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]).expect("finite")
}

#[test]
fn sign_is_right_beside_the_sharpest_edges_and_corners() {
    let mut inside_found = 0;
    for seed in 0..200 {
        let mut random = Random::new(seed);
        let query = Query::new(tetrahedron(&mut random)).expect("a mesh");
        let near: Vec<_> = (0..40)
            .map(|k| match k % 4 {
                0 => random.point(),
                // Round the corners, where a plain sum of normals goes wrong.
                _ => random.near(query.mesh().vertices()[k % 4], 0.05),
            })
            .collect();
        for (&q, hit) in near.iter().zip(query.query(&near, None)) {
            let inside = (0..4).all(|face| {
                let [a, b, c] = query.mesh().corners(face);
                dot(sub(q, a), cross(sub(b, a), sub(c, a))) < 0.0
            });
            assert_eq!(hit.distance < 0.0, inside, "seed {seed}: {q:?} {hit:?}");
            inside_found += usize::from(inside);
        }
    }
    assert!(inside_found > 200, "{inside_found} points inside");
}

#[test]
fn gradient_is_the_slope_of_the_distance() {
    let query = Query::new(torus::<f64>(60, 21)).expect("a mesh");
    let at = |q: [f64; 3]| query.query(&[q], None)[0];
    let step = 1e-6;
    for q in points::<f64>(200, 1.0, 5) {
        let hit = at(q);
        let axis_distance = (q[0].hypot(q[1]) - 0.7).hypot(q[2]);
        if hit.distance.abs() < 0.01 || axis_distance < 0.05 || q[0].hypot(q[1]) < 0.05 {
            continue; // The surface itself and the medial axis, where it is not differentiable.
        }
        for a in 0..3 {
            let mut ends = [q; 2];
            ends[0][a] -= step;
            ends[1][a] += step;
            let slope = (at(ends[1]).distance - at(ends[0]).distance) / (2.0 * step);
            // The second derivative is below 1/0.01, and jumps where the closest feature changes.
            assert!(
                (slope - hit.gradient[a]).abs() < 1e-3,
                "{q:?} axis {a}: {slope} {hit:?}"
            );
        }
    }
}

#[test]
fn gradient_on_the_surface_is_the_normal_of_the_face() {
    let mesh = Mesh::new(
        vec![[0.0f32, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0]],
        vec![[0, 1, 2]],
    );
    let query = Query::new(mesh.expect("finite")).expect("a mesh");
    for q in [[0.5, 0.5, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]] {
        let hit = query.query(&[q], None)[0];
        assert_eq!((hit.distance, hit.gradient), (0.0, [0.0, 0.0, 1.0]));
    }
    let below = query.query(&[[0.5, 0.5, 0.75]], None)[0];
    assert_eq!((below.distance, below.gradient), (-0.25, [0.0, 0.0, 1.0]));
}

#[test]
fn lattice_gives_the_sign_where_its_cells_agree() {
    let mesh = Mesh::new(
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2]],
    );
    let query = Query::new(mesh.expect("finite")).expect("a mesh");
    let grid = Grid::new([-2.0f64; 3], 0.5, [8; 3]).expect("valid");
    let values = (0..grid.cells())
        .map(|i| 0.1 - grid.center(grid.cell(i))[0])
        .collect();
    let field = Field::new(grid, values).expect("as many values as cells");
    let sign = |q| query.query(&[q], Some(&field))[0].distance < 0.0;
    // The field is negative where x > 0.1, the triangle has its inside below.
    assert!(sign([0.9, 0.3, 0.5]) && sign([0.9, 0.3, -0.5]));
    assert!(!sign([-0.9, 0.3, 0.5]) && !sign([-0.9, 0.3, -0.5]));
    assert!(
        !sign([0.1, 0.1, 0.5]) && sign([0.1, 0.1, -0.5]),
        "between cells that differ"
    );
    assert!(
        !sign([1.9, 0.3, 0.5]) && sign([1.9, 0.3, -0.5]),
        "beyond the centers of the cells"
    );
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let query = Query::new(torus::<f32>(80, 30)).expect("a mesh");
    let points = points(2000, 1.1, 3);
    crate::testing::assert_same_bits(|| query.query(&points, None));
}

#[test]
fn points_that_are_not_numbers_hit_nothing_and_harm_no_one() {
    let query = Query::new(torus::<f64>(20, 9)).expect("a mesh");
    let good = points::<f64>(30, 1.0, 4);
    let mut mixed = good.clone();
    mixed.extend([
        [f64::NAN, 0.0, 0.0],
        [f64::NAN; 3],
        [0.0, f64::NEG_INFINITY, f64::NAN],
        [0.0, f64::INFINITY, 0.0],
        [1e200, 0.0, 0.0],
    ]);
    let hits = query.query(&mixed, None);
    for hit in &hits[30..] {
        assert!(hit.distance.is_nan() && hit.triangle == NO_TRIANGLE);
    }
    for (hit, alone) in hits.iter().zip(query.query(&good, None)) {
        assert_eq!(hit.distance, alone.distance);
    }
}

#[test]
fn empty_mesh_is_refused() {
    let none = Mesh::<f32>::new(Vec::new(), Vec::new()).expect("empty");
    assert_eq!(Query::new(none).err(), Some(Error::Empty));
}

#[test]
fn mesh_without_any_area_gives_a_distance_and_no_nan() {
    let mesh = Mesh::new(vec![[1.0f64; 3], [2.0; 3]], vec![[0, 1, 1], [0, 0, 0]]).expect("finite");
    let query = Query::new(mesh).expect("a mesh");
    for q in [[1.0; 3], [1.5; 3], [0.0, 1.0, 5.0]] {
        let hit = query.query(&[q], None)[0];
        assert!(
            hit.distance.is_finite() && hit.gradient.iter().all(|g| g.is_finite()),
            "{hit:?}"
        );
    }
}
