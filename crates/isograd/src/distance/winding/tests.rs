use super::super::tests::{Random, soup, torus};
use super::*;
use crate::vector::{dot, to_f64};

/// The sum of the solid angles of all triangles, one after the other.
fn plain<T: Real>(mesh: &Mesh<T>, q: [f64; 3]) -> f64 {
    let solid_angle = |face: usize| {
        let [a, b, c] = mesh.corners(face).map(|corner| sub(to_f64(corner), q));
        let [la, lb, lc] = [a, b, c].map(norm);
        let y = dot(a, cross(b, c));
        let x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
        2.0 * y.atan2(x)
    };
    let sum: f64 = (0..mesh.faces().len()).map(solid_angle).sum();
    sum / (4.0 * std::f64::consts::PI)
}

/// Largest difference from the plain sum at random points, in packets within `size` of a center.
fn largest_error<T: Real>(mesh: &Mesh<T>, size: f64, seed: u64) -> f64 {
    let mut bvh = Bvh::default();
    bvh.rebuild(mesh).expect("a mesh");
    let winding = Winding::new(mesh, &bvh);
    let mut random = Random::new(seed);
    let mut sources = Sources::default();
    let mut worst: f64 = 0.0;
    for _ in 0..40 {
        let center = random.near([0.0; 3], 1.3);
        let points: [[f64; 3]; LANES] = std::array::from_fn(|_| random.near(center, size));
        let local = points.map(|p| winding.to_local(p));
        let middle = winding.to_local(center);
        let radius = local
            .iter()
            .map(|&p| norm(sub(p, middle)))
            .fold(0.0, f64::max);
        winding.collect(middle, radius, &mut sources);
        let packet = std::array::from_fn(|a| std::array::from_fn(|l| local[l][a]));
        for (number, point) in sources.winding_numbers(&packet).into_iter().zip(points) {
            worst = worst.max((number - plain(mesh, point)).abs());
        }
    }
    worst
}

#[test]
fn winding_number_is_the_sum_of_all_solid_angles() {
    for seed in 1..6 {
        // Few triangles: all are near the origin or each other, and hardly any cluster is far.
        assert!(largest_error(&soup::<f64>(3, seed), 1e-9, seed) < 1e-2);
        for size in [1e-3, 0.3] {
            // Clusters at twice their radius; second moments are left out.
            let error = largest_error(&soup::<f64>(400, seed), size, seed);
            assert!(error < 0.03, "{error}");
            let error = largest_error(&torus::<f32>(60, 20), size, seed);
            assert!(error < 1e-2, "{error}");
        }
    }
}

#[test]
fn triangles_one_inside_another_add_their_turns() {
    // A point inside twenty nested tetrahedra has the winding number 20.
    let corners = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    let scaled = |k: u32| corners.map(|c| scale(c, 1.0 + 0.01 * f64::from(k)));
    let vertices: Vec<[f64; 3]> = (0..20).flat_map(scaled).collect();
    let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    let all = (0..20).flat_map(|k| faces.map(|face| face.map(|v| v + 4 * k)));
    let mesh = Mesh::new(vertices, all.collect()).expect("finite");
    assert!((plain(&mesh, [0.1, 0.2, -0.1]).abs() - 20.0).abs() < 1e-9);
    let mut bvh = Bvh::default();
    bvh.rebuild(&mesh).expect("a mesh");
    let winding = Winding::new(&mesh, &bvh);
    let mut sources = Sources::default();
    let at = winding.to_local([0.1, 0.2, -0.1]);
    winding.collect(at, 0.0, &mut sources);
    let [number, ..] = sources.winding_numbers(&at.map(|x| [x; LANES]));
    assert!(
        (number - plain(&mesh, [0.1, 0.2, -0.1])).abs() < 1e-9,
        "{number}"
    );
}

#[test]
fn closed_meshes_are_recognized_with_and_without_shared_vertices() {
    let closed = torus::<f64>(12, 7);
    assert!(is_closed(&closed));
    let corners: Vec<[f64; 3]> = (0..closed.faces().len())
        .flat_map(|f| closed.corners(f))
        .collect();
    let count = corners.len() as u32;
    let faces: Vec<[u32; 3]> = (0..count / 3)
        .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
        .collect();
    let apart = Mesh::new(corners.clone(), faces.clone()).expect("finite");
    assert!(is_closed(&apart));
    let open = Mesh::new(corners.clone(), faces[1..].to_vec()).expect("finite");
    assert!(!is_closed(&open));
    let mut turned = faces;
    turned[5].swap(0, 1);
    assert!(!is_closed(&Mesh::new(corners, turned).expect("finite")));
    // A face without area closes on itself.
    let line = Mesh::new(vec![[0.0; 3], [1.0; 3]], vec![[0, 0, 1]]).expect("finite");
    assert!(is_closed(&line));
}
