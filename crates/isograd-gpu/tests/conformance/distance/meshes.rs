//! Meshes to be far from.

use isograd::{Mesh, Real};
use isograd_shapes::SurfaceCoordinate;

use crate::devices::Numbers;

/// Quads of a closed strip of closed strips, each cut in two.
fn quads(rows: usize, columns: usize, closed: bool) -> Vec<[u32; 3]> {
    let (long, wide) = if closed {
        (rows, columns)
    } else {
        (rows - 1, columns - 1)
    };
    let id = |i: usize, j: usize| ((i % rows) * columns + j % columns) as u32;
    let cut = |i, j| {
        let (a, b, c, d) = (id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
        [[a, b, c], [a, c, d]]
    };
    (0..long * wide)
        .flat_map(|quad| cut(quad / wide, quad % wide))
        .collect()
}

/// A closed torus around the z axis, normals outward.
pub fn torus<T: Real>(around: usize, across: usize) -> Mesh<T> {
    let turn = |i: usize, n: usize| std::f64::consts::TAU * i as f64 / n as f64;
    let vertex = |index: usize| {
        let (s, t) = (turn(index / across, around), turn(index % across, across));
        let r = 0.7 + 0.25 * t.cos();
        [r * s.cos(), r * s.sin(), 0.25 * t.sin()].map(T::of)
    };
    let vertices = (0..around * across).map(vertex).collect();
    Mesh::new(vertices, quads(around, across, true)).unwrap()
}

/// The sphere of radius 0.9: all of it is closest to its center.
pub fn sphere<T: Real>(rows: usize, columns: usize) -> Mesh<T> {
    let vertex = |index: usize| {
        let polar = std::f64::consts::PI * (index / columns) as f64 / (rows - 1) as f64;
        let turn = std::f64::consts::TAU * (index % columns) as f64 / (columns - 1) as f64;
        let r = 0.9 * polar.sin();
        [r * turn.cos(), r * turn.sin(), 0.9 * polar.cos()].map(T::of)
    };
    let vertices = (0..rows * columns).map(vertex).collect();
    Mesh::new(vertices, quads(rows, columns, false)).unwrap()
}

/// The fish, patch by patch: fins go through the body, and edges are as thin as fins end.
pub fn fish<T: Real>(cells: usize) -> Mesh<T> {
    let shape = isograd_shapes::by_name("fish").unwrap();
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for patch in 0..shape.patches() as u32 {
        let first = vertices.len() as u32;
        for index in 0..cells * cells {
            let at = |k: usize| (k as f64 + 0.5) / cells as f64;
            let (u, v) = (at(index / cells), at(index % cells));
            let place = shape.at(SurfaceCoordinate { patch, u, v }).unwrap();
            vertices.push(place.position.map(T::of));
        }
        let of_patch = quads(cells, cells, false).into_iter();
        faces.extend(of_patch.map(|face| face.map(|v| v + first)));
    }
    Mesh::new(vertices, faces).unwrap()
}

/// A triangle of any kind: well shaped, huge, tiny, a sliver, a needle, a segment, a point.
fn triangle(numbers: &mut Numbers) -> [[f64; 3]; 3] {
    let center = [(); 3].map(|()| numbers.signed());
    let kind = numbers.bits() as usize % 8;
    let size = [0.1, 0.1, 2.0, 1e-3, 0.3, 0.3, 0.3, 0.0][kind];
    let mut near = |p: [f64; 3], size: f64| p.map(|x| x + size * numbers.signed());
    let [a, b, c] = [(); 3].map(|()| near(center, size));
    let on_edge: [f64; 3] = std::array::from_fn(|k| a[k] + 0.3 * (b[k] - a[k]));
    match kind {
        4 => [a, b, near(on_edge, 1e-4)],
        5 => [a, b, near(a, 1e-5)],
        6 => [a, b, [on_edge, a, b][numbers.bits() as usize % 3]],
        _ => [a, b, c],
    }
}

/// Unconnected triangles of every kind.
pub fn soup<T: Real>(triangles: usize, seed: u64) -> Mesh<T> {
    let mut numbers = Numbers(seed);
    let corners = (0..triangles).flat_map(|_| triangle(&mut numbers));
    let vertices = corners.map(|p| p.map(T::of)).collect();
    let faces = (0..triangles as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
    Mesh::new(vertices, faces.collect()).unwrap()
}

/// A line, with a point on it.
pub fn line<T: Real>() -> Mesh<T> {
    let vertices = [[-0.53, -0.53, 0.01], [0.22, 0.22, 0.01], [0.97, 0.97, 0.01]];
    let vertices = vertices.map(|p| p.map(T::of)).to_vec();
    Mesh::new(vertices, vec![[0, 1, 2], [1, 1, 1]]).unwrap()
}

/// One point, named by several faces.
pub fn point<T: Real>(faces: usize) -> Mesh<T> {
    Mesh::new(vec![[0.3, 0.4, 0.5].map(T::of)], vec![[0, 0, 0]; faces]).unwrap()
}

/// One triangle, named by several faces. No cell center of the tests is on it: there `φ` has no derivative.
pub fn copies<T: Real>(faces: usize) -> Mesh<T> {
    let vertices = [
        [-0.413, -0.207, 0.111],
        [0.719, 0.103, -0.221],
        [0.127, 0.631, 0.409],
    ];
    Mesh::new(
        vertices.map(|p| p.map(T::of)).to_vec(),
        vec![[0, 1, 2]; faces],
    )
    .unwrap()
}

/// Triangles around one vertex.
pub fn fan<T: Real>(triangles: usize) -> Mesh<T> {
    let on_circle = |i: usize| {
        let turn = std::f64::consts::TAU * i as f64 / triangles as f64;
        [0.8 * turn.cos(), 0.8 * turn.sin(), -0.3].map(T::of)
    };
    let mut vertices = vec![[0.1, 0.05, 0.4].map(T::of)];
    vertices.extend((0..triangles).map(on_circle));
    let n = triangles as u32;
    let faces = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
    Mesh::new(vertices, faces).unwrap()
}
