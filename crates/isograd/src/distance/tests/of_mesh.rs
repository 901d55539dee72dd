use super::{Random, brute_force, soup, sphere, torus};
use crate::distance::lattice::{Band, PullbackScratch, Scratch, Sign, forward_of_mesh, pullback};
use crate::distance::{Distance, Error, NO_TRIANGLE, Query};
use crate::vector::{add, cross, dot, norm, scale, sub, to_f64};
use crate::{Field, Grid, Mesh, Real};

fn solve<T: Distance>(mesh: &Mesh<T>, grid: Grid<T>, band: Band) -> (Field<T>, Vec<u32>, Sign) {
    let mut phi = Field::zeros(grid);
    let mut closest = Vec::new();
    let scratch = &mut Scratch::default();
    let sign = forward_of_mesh(mesh, band, scratch, &mut phi, &mut closest).expect("a mesh");
    (phi, closest, sign)
}

fn grid<T: Real>() -> Grid<T> {
    let lower = [-1.3, -1.2, -1.1].map(T::of);
    Grid::new(lower, T::of(0.1), [26, 23, 19]).expect("valid")
}

fn transformed(mesh: &Mesh<f64>, r: f64, to: [f64; 3], turn: bool) -> Mesh<f64> {
    let vertices = mesh
        .vertices()
        .iter()
        .map(|&v| add(scale(v, r), to))
        .collect();
    let face = |&[a, b, c]: &[u32; 3]| if turn { [b, a, c] } else { [a, b, c] };
    Mesh::new(vertices, mesh.faces().iter().map(face).collect()).expect("finite")
}

fn joined(meshes: &[Mesh<f64>]) -> Mesh<f64> {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = vertices.len() as u32;
        vertices.extend_from_slice(mesh.vertices());
        faces.extend(mesh.faces().iter().map(|face| face.map(|v| v + first)));
    }
    Mesh::new(vertices, faces).expect("finite")
}

/// The generalized winding number, from one triangle after the other.
fn winding_number<T: Real>(mesh: &Mesh<T>, q: [f64; 3]) -> f64 {
    let turn = |face: usize| {
        let [a, b, c] = mesh.corners(face).map(|corner| sub(to_f64(corner), q));
        let [la, lb, lc] = [a, b, c].map(norm);
        let x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
        dot(a, cross(b, c)).atan2(x) / std::f64::consts::TAU
    };
    (0..mesh.faces().len()).map(turn).sum()
}

/// Distance and sign of every `step`-th cell against all triangles. Returns the number of cells inside.
fn assert_right<T: Distance>(mesh: &Mesh<T>, grid: Grid<T>, expected: Sign, step: usize) -> usize {
    let (phi, closest, sign) = solve(mesh, grid, Band::Full);
    assert_eq!(sign, expected);
    let mut inside = 0;
    for index in (0..grid.cells()).step_by(step) {
        let q = grid.center_f64(grid.cell(index));
        let (_, found) = brute_force(mesh, q);
        let value = phi.values()[index].f64();
        // Coordinates are up to 1.5.
        let tolerance = 4.0 * T::epsilon().f64() * (found.distance + 1.5);
        assert!(
            (value.abs() - found.distance).abs() <= tolerance,
            "{value} {found:?}"
        );
        assert!((closest[index] as usize) < mesh.faces().len());
        let number = winding_number(mesh, q).abs();
        // The sums of far triangles have an error; see the tests of the winding number.
        if (number - 0.5).abs() > 0.03 {
            assert_eq!(value < 0.0, number > 0.5, "{number} at {q:?}");
        }
        inside += usize::from(value < 0.0);
    }
    inside
}

#[test]
fn field_is_that_of_all_triangles_tried() {
    assert!(assert_right(&torus::<f64>(60, 21), grid(), Sign::Closed, 7) > 20);
    assert!(assert_right(&torus::<f32>(60, 21), grid(), Sign::Closed, 11) > 20);
    for seed in 0..4 {
        assert_right(&soup::<f64>(50, seed), grid(), Sign::WindingNumber, 13);
        assert_right(&soup::<f32>(700, seed), grid(), Sign::WindingNumber, 31);
    }
    // A ball without a cap.
    let ball = sphere::<f64>(12, 1.0);
    let below = |f: &usize| ball.corners(*f).iter().all(|v| v[2] < 0.6);
    let kept = (0..ball.faces().len())
        .filter(below)
        .map(|f| ball.faces()[f]);
    let open = Mesh::new(ball.vertices().to_vec(), kept.collect()).expect("finite");
    assert!(assert_right(&open, grid(), Sign::WindingNumber, 7) > 200);
}

#[test]
fn sign_of_a_closed_mesh_is_that_of_its_pseudonormals() {
    let mesh = torus::<f64>(40, 17);
    let (phi, _, _) = solve(&mesh, grid(), Band::Full);
    let cells = (0..phi.values().len()).map(|index| phi.grid().cell(index));
    let centers: Vec<[f64; 3]> = cells.map(|cell| phi.grid().center_f64(cell)).collect();
    let hits = Query::new(mesh).expect("a mesh").query(&centers, None);
    for (value, hit) in phi.values().iter().zip(hits) {
        assert_eq!(*value < 0.0, hit.distance < 0.0);
    }
}

#[test]
fn bodies_may_intersect_and_have_cavities_and_any_winding() {
    let ball = sphere::<f64>(10, 1.0);
    let outer = transformed(&ball, 0.9, [-0.2, 0.0, 0.0], false);
    let cavity = transformed(&ball, 0.5, [-0.2, 0.0, 0.0], true);
    let other = transformed(&ball, 0.4, [0.7, 0.1, 0.0], false);
    let is_in = |q: [f64; 3], center: [f64; 3], r: f64| norm(sub(q, center)) < r;
    let mesh = joined(&[outer, cavity, other]);
    let mut expected = 0;
    for turned in [false, true] {
        let mesh = transformed(&mesh, 1.0, [0.0; 3], turned);
        let (phi, _, sign) = solve(&mesh, grid(), Band::Full);
        assert_eq!(sign, Sign::Closed);
        for (index, &value) in phi.values().iter().enumerate() {
            // Triangles lie up to 1 % inside the spheres.
            if value.abs() < 0.03 {
                continue;
            }
            let q = grid::<f64>().center_f64(phi.grid().cell(index));
            let body = is_in(q, [-0.2, 0.0, 0.0], 0.9) && !is_in(q, [-0.2, 0.0, 0.0], 0.5);
            let inside = body || is_in(q, [0.7, 0.1, 0.0], 0.4);
            assert_eq!(value < 0.0, inside, "{q:?}");
            expected += usize::from(inside);
        }
    }
    assert!(expected > 1000, "{expected}");
}

#[test]
fn unshared_vertices_change_nothing() {
    let mesh = torus::<f32>(40, 17);
    let corners = (0..mesh.faces().len())
        .flat_map(|f| mesh.corners(f))
        .collect();
    let faces = (0..mesh.faces().len() as u32)
        .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
        .collect();
    let apart = Mesh::new(corners, faces).expect("finite");
    assert_eq!(
        solve(&mesh, grid(), Band::Full),
        solve(&apart, grid(), Band::Full)
    );
}

#[test]
fn band_has_the_signs_of_the_full_field() {
    let open = {
        let mesh = torus::<f64>(40, 17);
        Mesh::new(mesh.vertices().to_vec(), mesh.faces()[60..].to_vec()).expect("finite")
    };
    for mesh in [torus::<f64>(40, 17), open] {
        let (full, _, _) = solve(&mesh, grid(), Band::Full);
        for width in [0.02, 0.06, 0.25] {
            let (band, closest, _) = solve(&mesh, grid(), Band::Within(width));
            for ((&value, &whole), &face) in band.values().iter().zip(full.values()).zip(&closest) {
                assert_eq!(face == NO_TRIANGLE, whole.abs() > width);
                assert!(
                    (value - whole.clamp(-width, width)).abs() < 1e-14,
                    "{value} {whole}"
                );
            }
        }
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let mesh = soup::<f32>(500, 3);
    crate::testing::assert_same_bits(|| solve(&mesh, grid(), Band::Full));
}

#[test]
fn pullback_is_the_transpose_of_the_derivative() {
    let mut random = Random::new(7);
    // No triangles without area: their closest feature changes within any step.
    let vertices = (0..36).map(|_| random.point()).collect();
    let faces = (0..12).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let mesh = Mesh::new(vertices, faces).expect("finite");
    let (phi, closest, _) = solve(&mesh, grid(), Band::Full);
    let mut bar: Vec<f64> = phi.values().iter().map(|_| random.signed()).collect();
    let step = 1e-8;
    let direction: Vec<[f64; 3]> = mesh.vertices().iter().map(|_| random.point()).collect();
    let (shift, growth) = (random.point(), random.signed());
    let moved = |t: f64| {
        let vertices = mesh.vertices().iter().zip(&direction);
        let vertices = vertices.map(|(&v, &d)| add(v, scale(d, t))).collect();
        let mesh = Mesh::new(vertices, mesh.faces().to_vec()).expect("finite");
        let from = grid::<f64>();
        let lower = add(from.lower(), scale(shift, t));
        let grid = Grid::new(lower, from.spacing() + growth * t, from.shape()).expect("valid");
        solve(&mesh, grid, Band::Full).0
    };
    let (before, after) = (moved(-step), moved(step));
    let mut slope = 0.0;
    for (index, bar) in bar.iter_mut().enumerate() {
        let ends = [before.values()[index], after.values()[index]];
        // The generalized winding number of a soup passes ½ away from the triangles: a jump.
        if ends[0].signum() != ends[1].signum() {
            *bar = 0.0;
        }
        slope += *bar * (ends[1] - ends[0]) / (2.0 * step);
    }
    let mut vertices_bar = vec![[0.0; 3]; mesh.vertices().len()];
    let scratch = &mut PullbackScratch::default();
    let grid_bar = pullback(&mesh, &phi, &closest, &bar, scratch, &mut vertices_bar);
    let pulled: f64 = vertices_bar
        .iter()
        .zip(&direction)
        .map(|(&b, &d)| dot(b, d))
        .sum();
    let pulled = pulled + dot(grid_bar.lower, shift) + grid_bar.spacing * growth;
    // Closest features change within the step at a few of the cells.
    assert!(
        (slope - pulled).abs() < 1e-3 * pulled.abs().max(10.0),
        "{slope} {pulled}"
    );
}

#[test]
fn meshes_without_area_or_faces_do_not_fail() {
    let point = Mesh::new(vec![[0.3, 0.4, 0.5]], vec![[0, 0, 0]; 9]).expect("finite");
    let (phi, _, _) = solve(&point, grid(), Band::Full);
    assert!(phi.values().iter().all(|&value| value > 0.0 && value < 9.0));
    let empty = Mesh::<f64>::new(vec![[0.0; 3]], Vec::new()).expect("finite");
    let mut phi = Field::zeros(grid());
    let mut refused = |mesh: &Mesh<f64>, band| {
        let scratch = &mut Scratch::default();
        forward_of_mesh(mesh, band, scratch, &mut phi, &mut Vec::new()).expect_err("refused")
    };
    assert_eq!(refused(&empty, Band::Full), Error::Empty);
    let band = refused(&point, Band::Within(-1.0));
    assert_eq!(band, Error::Band { width: -1.0 });
    let huge = Mesh::new(vec![[1e200; 3]], vec![[0, 0, 0]]).expect("finite");
    assert!(matches!(refused(&huge, Band::Full), Error::Range { .. }));
}
