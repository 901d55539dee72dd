//! The whole stage against a plain version of it, and against what a closed surface must satisfy.

use std::collections::{BTreeMap, BTreeSet};

use super::tables::{loops, triangulations};
use super::*;
use crate::data::{Field, Grid, LatticeEdge, Mesh};
use crate::{Real, vector};

/// A reproducible stream of numbers in [−1, 1).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A field of the function `f` of the cell center, in the user's unit.
fn field<T: Real>(grid: Grid<T>, f: impl Fn([f64; 3]) -> f64) -> Field<T> {
    let values = (0..grid.cells()).map(|at| T::of(f(grid.center_f64(grid.cell(at)))));
    Field::new(grid, values.collect()).expect("one value a cell")
}

/// `n` cells over [−1, 1] along x, about as many along the other axes.
fn cube(n: usize) -> Grid<f64> {
    Grid::new([-1.0, -1.0, -1.0], 2.0 / n as f64, [n, n + 1, n + 2]).expect("valid")
}

/// Noise with some values exactly at the level 0.
fn open_noise(shape: [usize; 3], seed: u64) -> Field<f64> {
    let grid = Grid::new([0.3, -0.2, 10.0], 0.1, shape).expect("valid");
    let mut stream = Noise(seed);
    let values = (0..grid.cells()).map(|_| match stream.next() {
        v if v.abs() < 0.1 => 0.0,
        v => v,
    });
    Field::new(grid, values.collect()).expect("one value a cell")
}

/// Noise that is outside at the walls.
fn noise(shape: [usize; 3], seed: u64) -> Field<f64> {
    let mut field = open_noise(shape, seed);
    for at in 0..field.grid().cells() {
        let cell = field.grid().cell(at);
        if (0..3).any(|a| cell[a] == 0 || cell[a] + 1 == shape[a]) {
            field.values_mut()[at] = 1.0;
        }
    }
    field
}

fn surface<T: Real>(chi: &Field<T>, level: T) -> (Mesh<T>, Report) {
    let mut mesh = Mesh::default();
    let report = forward(chi, level, &mut Scratch::default(), &mut mesh).expect("a surface");
    (mesh, report)
}

/// Cube by cube, each vertex looked up by its edge.
fn plain(
    chi: &Field<f64>,
    level: f64,
) -> (BTreeMap<LatticeEdge, [f64; 3]>, BTreeSet<[LatticeEdge; 3]>) {
    let (grid, shape) = (chi.grid(), chi.grid().shape());
    let mut vertices = BTreeMap::new();
    let mut faces = BTreeSet::new();
    for at in 0..grid.cells() {
        let cell = grid.cell(at);
        if (0..3).any(|a| cell[a] + 1 == shape[a]) {
            continue;
        }
        let corner = |c: usize| {
            [
                cell[0] + (c >> 2),
                cell[1] + (c >> 1 & 1),
                cell[2] + (c & 1),
            ]
        };
        let case = (0..8)
            .filter(|&c| chi.at(corner(c)) < level)
            .fold(0u8, |s, c| s | 1 << c);
        let mut vertex = |e: u8| {
            let (axis, u, v) = (e as usize / 4, e as usize >> 1 & 1, e as usize & 1);
            let start = [[0, u, v], [u, 0, v], [u, v, 0]][axis];
            let start: [usize; 3] = std::array::from_fn(|a| cell[a] + start[a]);
            let end: [usize; 3] = std::array::from_fn(|a| start[a] + usize::from(a == axis));
            let edge = LatticeEdge::new(grid.index(start), axis);
            let (p, q) = (chi.at(start), chi.at(end));
            let eta = (level - p) / (q - p);
            let y = std::array::from_fn(|a| {
                (1.0 - eta) * grid.center(start)[a] + eta * grid.center(end)[a]
            });
            vertices.insert(edge, y);
            (edge, y)
        };
        for cycle in loops(case) {
            let (_, first) = vertex(cycle[0]);
            let mut largest = (f64::NEG_INFINITY, Vec::new());
            for triangles in triangulations(&cycle) {
                let corners: Vec<_> = triangles.iter().map(|t| t.map(&mut vertex)).collect();
                let around = corners
                    .iter()
                    .map(|t| t.map(|(_, y)| vector::sub(y, first)));
                let volume: f64 = around.map(enclosed).sum();
                // Cells are 0.1 wide; sums of volumes that are the same differ by 1e-17.
                if volume > largest.0 + 1e-15 {
                    largest = (volume, corners);
                }
            }
            faces.extend(largest.1.into_iter().map(|t| t.map(|(edge, _)| edge)));
        }
    }
    (vertices, faces)
}

/// Volume between the origin and a triangle.
fn enclosed([a, b, c]: [[f64; 3]; 3]) -> f64 {
    vector::dot(a, vector::cross(b, c)) / 6.0
}

#[test]
fn noise_gives_the_same_surface_as_the_plain_version() {
    for (shape, seed) in [
        ([9, 7, 12], 11),
        ([5, 6, 65], 12),
        ([4, 4, 131], 13),
        ([20, 3, 64], 14),
        ([2, 2, 3], 15),
    ] {
        let chi = open_noise(shape, seed);
        let (mesh, _) = surface(&chi, 0.0);
        let (vertices, faces) = plain(&chi, 0.0);
        let edges: Vec<_> = vertices.keys().copied().collect();
        assert_eq!(mesh.edges(), edges, "in the order of edges, seed {seed}");
        for (v, y) in vertices.values().zip(mesh.vertices()) {
            // Two ways to round the same point, coordinates below 30.
            assert!(vector::norm(vector::sub(*v, *y)) < 1e-13, "{v:?} {y:?}");
        }
        let named: BTreeSet<_> = mesh
            .faces()
            .iter()
            .map(|f| f.map(|v| mesh.edges()[v as usize]))
            .collect();
        assert_eq!(mesh.faces().len(), named.len());
        assert_eq!(named, faces, "seed {seed}");
    }
}

/// Whether the faces around each vertex form a single ring.
fn vertices_have_one_ring(mesh: &Mesh<f64>) -> bool {
    let mut after: Vec<BTreeMap<u32, u32>> = vec![BTreeMap::new(); mesh.vertices().len()];
    for &[a, b, c] in mesh.faces() {
        for (v, p, q) in [(a, b, c), (b, c, a), (c, a, b)] {
            after[v as usize].insert(p, q);
        }
    }
    after.iter().all(|ring| {
        let Some((&first, _)) = ring.first_key_value() else {
            return false;
        };
        let mut v = first;
        for step in 1..=ring.len() {
            v = ring[&v];
            if v == first {
                return step == ring.len();
            }
        }
        false
    })
}

#[test]
fn surfaces_of_noise_are_closed_manifolds() {
    for seed in 1..20 {
        let (mesh, report) = surface(&noise([13, 11, 12], seed), 0.0);
        let m = Measures::of(&mesh);
        assert!(m.closed, "seed {seed}: {m:?}");
        assert!(vertices_have_one_ring(&mesh), "seed {seed}");
        assert!(m.volume > 0.0, "seed {seed}: {m:?}");
        assert!(!report.touches_wall);
    }
}

#[test]
fn every_vertex_lies_on_its_edge() {
    // Far from the origin, so that rounding to f32 matters.
    let grid = Grid::new([1000.0f32, -2000.0, 0.1], 1e-2, [14, 15, 16]).expect("valid");
    let mut stream = Noise(5);
    let values = (0..grid.cells()).map(|_| stream.next() as f32).collect();
    let (mesh, _) = surface(&Field::new(grid, values).expect("one value a cell"), 0.05);
    for (y, edge) in mesh.vertices().iter().zip(mesh.edges()) {
        let p = grid.cell(edge.cell());
        let q = std::array::from_fn(|a| p[a] + usize::from(a == edge.axis()));
        for a in 0..3 {
            assert!(
                grid.center(p)[a] <= y[a] && y[a] <= grid.center(q)[a],
                "{y:?} off {edge:?}"
            );
        }
    }
}

#[test]
fn the_crossing_is_between_the_ends_for_any_two_finite_values() {
    let tiny = f64::from_bits(1);
    let cases = [
        (-1.0, 1.0, 0.0, 0.5),
        (-f64::MAX, f64::MAX, 0.0, 0.5),
        (-tiny, 0.0, 0.0, 1.0),
        (0.0, -tiny, 0.0, 0.0),
        (-tiny, tiny, 0.0, 0.5),
        (f64::MAX, -f64::MAX, -f64::MAX / 2.0, 0.75),
    ];
    for (p, q, level, expected) in cases {
        assert_eq!(crossing(p, q, level), expected, "{p:e} {q:e} {level:e}");
    }
    assert_eq!(crossing(-f32::MAX, f32::MAX, 0.0), 0.5);
}

#[test]
fn values_at_the_level_are_outside() {
    let grid = Grid::new([0.0; 3], 1.0, [5, 5, 5]).expect("valid");
    let mut chi = Field::new(grid, vec![2.0; 125]).expect("one value a cell");
    let center = grid.index([2, 2, 2]);
    chi.values_mut()[center] = 1.0;
    let refused = forward(&chi, 1.0, &mut Scratch::default(), &mut Mesh::default());
    assert!(matches!(refused, Err(Error::NothingInside { .. })));
    // All neighbors at the level: the vertices lie exactly on them, and the octahedron is closed.
    chi.values_mut().fill(1.0);
    chi.values_mut()[center] = 0.0;
    let (mesh, report) = surface(&chi, 1.0);
    let m = Measures::of(&mesh);
    assert!(m.closed && m.euler == 2 && m.faces == 8 && report.inside == 1);
    // Six vertices at distance 1: an octahedron of volume 4/3.
    assert!((m.volume - 4.0 / 3.0).abs() < 1e-15);
}

#[test]
fn area_and_volume_of_a_sphere_converge_at_second_order() {
    let r = 0.7;
    let error = |n: usize| {
        let (mesh, _) = surface(&field(cube(n), |x| vector::norm(x) - r), 0.0);
        let m = Measures::of(&mesh);
        assert!(m.closed && m.euler == 2 && m.components == 1, "{m:?}");
        let area = 4.0 * std::f64::consts::PI * r * r;
        [(m.area - area).abs(), (m.volume - area * r / 3.0).abs()]
    };
    let (coarse, fine) = (error(24), error(96));
    for (a, b) in coarse.iter().zip(fine) {
        let order = (a / b).log2() / 2.0;
        // The order at these two sizes is 2 up to how the sphere falls on the lattice.
        assert!(
            (order - 2.0).abs() < 0.2,
            "order {order}, errors {a:e} {b:e}"
        );
    }
}

#[test]
fn genus_and_pieces_are_right() {
    let torus = field(cube(40), |[x, y, z]| {
        ((x * x + y * y).sqrt() - 0.55).hypot(z) - 0.25
    });
    let m = Measures::of(&surface(&torus, 0.0).0);
    assert!(m.closed && m.euler == 0 && m.components == 1, "{m:?}");
    let two = field(cube(40), |[x, y, z]| {
        (x.abs() - 0.45).hypot(y).hypot(z) - 0.3
    });
    let m = Measures::of(&surface(&two, 0.0).0);
    assert!(m.closed && m.euler == 4 && m.components == 2, "{m:?}");
}

#[test]
fn a_body_at_the_wall_is_reported_and_left_open() {
    let open = field(cube(20), |x| {
        vector::norm(vector::sub(x, [-1.0, 0.0, 0.0])) - 0.5
    });
    let (mesh, report) = surface(&open, 0.0);
    assert!(report.touches_wall);
    assert_eq!(report.walls, [[true, false], [false; 2], [false; 2]]);
    let m = Measures::of(&mesh);
    assert!(
        !m.closed && m.boundary_edges > 0 && m.misaligned_edges + m.crowded_edges == 0,
        "{m:?}"
    );
    let (_, report) = surface(&field(cube(20), |x| 0.5 - vector::norm(x)), 0.0);
    assert_eq!(report.walls, [[true; 2]; 3]);
}

#[test]
fn bad_input_is_refused_with_the_place_and_a_remedy() {
    let sphere = field(cube(12), |x| vector::norm(x) - 0.5);
    let refused = |chi: &Field<f64>, level: f64| {
        let mut mesh = surface(&sphere, 0.0).0;
        let error = forward(chi, level, &mut Scratch::default(), &mut mesh).expect_err("refused");
        assert_eq!(
            mesh,
            Mesh::default(),
            "nothing of an earlier surface is left"
        );
        error.to_string()
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for cell in [[3, 4, 5], [11, 12, 13]] {
            let mut chi = sphere.clone();
            let at = chi.grid().index(cell);
            chi.values_mut()[at] = bad;
            assert!(refused(&chi, 0.0).contains(&format!("{cell:?}")));
        }
        assert!(refused(&sphere, bad).contains("finite"));
    }
    assert!(refused(&sphere, -2.0).contains("no cell"));
    assert!(refused(&sphere, 5.0).contains("every cell"));
}

#[test]
fn the_smallest_grid_works() {
    let grid = Grid::new([0.0f32; 3], 1.0, [2, 2, 2]).expect("valid");
    let mut chi = Field::new(grid, vec![1.0; 8]).expect("one value a cell");
    chi.values_mut()[0] = -1.0;
    let (mesh, report) = surface(&chi, 0.0);
    assert_eq!((mesh.faces().len(), mesh.vertices().len()), (1, 3));
    assert!(report.touches_wall);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let chi = noise([30, 20, 70], 3);
    crate::testing::assert_same_bits(|| {
        let mesh = surface(&chi, 0.0).0;
        let measures = Measures::of(&mesh);
        (mesh, measures)
    });
}

#[test]
fn a_second_call_uses_the_same_memory_and_forgets_the_first() {
    let (mut scratch, mut mesh) = (Scratch::default(), Mesh::default());
    let large = noise([20, 20, 70], 8);
    let small = noise([12, 9, 10], 9);
    forward(&large, 0.0, &mut scratch, &mut mesh).expect("a surface");
    let places = (
        mesh.vertices().as_ptr(),
        mesh.faces().as_ptr(),
        mesh.edges().as_ptr(),
    );
    forward(&small, 0.0, &mut scratch, &mut mesh).expect("a surface");
    assert_eq!(mesh, surface(&small, 0.0).0);
    forward(&large, 0.0, &mut scratch, &mut mesh).expect("a surface");
    assert_eq!(mesh, surface(&large, 0.0).0);
    assert_eq!(
        places,
        (
            mesh.vertices().as_ptr(),
            mesh.faces().as_ptr(),
            mesh.edges().as_ptr()
        )
    );
}
