//! Area, volume, components and topology of a triangle mesh.

pub(crate) mod pieces;

use crate::data::Mesh;
use crate::parallel::{CHUNK, sum_array};
use crate::{Real, parallel, union_find, vector};

/// Area, volume and topology of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Number of vertices used by faces.
    pub vertices: usize,
    /// Number of different edges.
    pub edges: usize,
    /// Number of faces.
    pub faces: usize,
    /// Sum of the areas of the faces, in unit length².
    pub area: f64,
    /// Enclosed volume by the divergence theorem, in unit length³; positive where faces are
    /// counter-clockwise seen from outside. For an open mesh it is the volume of the cone
    /// from the center of its bounding box, and not meaningful.
    pub volume: f64,
    /// Number of connected components; faces that share a vertex belong to one.
    pub components: usize,
    /// `V − E + F`: for a closed manifold 2 for each sphere, 0 for each torus, `2 − 2g` for genus `g`.
    pub euler: i64,
    /// Whether there are faces and each edge is in exactly two of them, with opposite directions.
    pub closed: bool,
    /// Edges of one face only.
    pub boundary_edges: usize,
    /// Edges of two faces that run through it in the same direction: neighbors wound against each other.
    pub misaligned_edges: usize,
    /// Edges of three faces or more.
    pub crowded_edges: usize,
}

/// Scratch buffers of [`measure`] reused between calls: about 40 bytes per face.
#[derive(Debug, Default)]
pub struct Scratch {
    parent: Vec<u32>,
    /// Uses of edges, sorted by the lower vertex; `start[v]` is where those of vertex `v` begin.
    start: Vec<usize>,
    uses: Vec<u64>,
}

/// Measures a mesh. Sums run in double precision relative to the center of the mesh and in a fixed order: the position
/// of the mesh does not reduce the accuracy, and the number of threads does not change a bit.
///
/// A face that names a vertex twice has two edges that close on each other and one from the vertex to
/// itself, which counts as a boundary edge: such a mesh is not closed.
///
/// # Pullback
/// [`measure_pullback`](super::measure_pullback), of area and volume; all other quantities are counts.
pub fn measure<T: Real>(mesh: &Mesh<T>, scratch: &mut Scratch) -> Measures {
    let [area, volume] = integrals(mesh);
    let (vertices, components) = scratch.components(mesh);
    scratch.sort_edges(mesh);
    let edges = scratch.count_edges(mesh.vertices().len());
    let faces = mesh.faces().len();
    Measures {
        vertices,
        edges: edges.all,
        faces,
        area,
        volume,
        components,
        euler: vertices as i64 - edges.all as i64 + faces as i64,
        closed: faces > 0 && edges.boundary + edges.misaligned + edges.crowded == 0,
        boundary_edges: edges.boundary,
        misaligned_edges: edges.misaligned,
        crowded_edges: edges.crowded,
    }
}

impl Measures {
    /// [`measure`] with new scratch buffers.
    pub fn of<T: Real>(mesh: &Mesh<T>) -> Self {
        measure(mesh, &mut Scratch::default())
    }
}

/// `[area, volume]`.
fn integrals<T: Real>(mesh: &Mesh<T>) -> [f64; 2] {
    let origin = center(mesh.vertices());
    let twice_and_six = sum_array(mesh.faces().len(), |f| {
        let [a, b, c] = mesh
            .corners(f)
            .map(|p| vector::sub(vector::to_f64(p), origin));
        let normal = vector::cross(vector::sub(b, a), vector::sub(c, a));
        [vector::norm(normal), vector::dot(a, normal)]
    });
    [twice_and_six[0] / 2.0, twice_and_six[1] / 6.0]
}

/// Center of the bounding box; the origin where there are no vertices.
pub(super) fn center<T: Real>(vertices: &[[T; 3]]) -> [f64; 3] {
    let bounds = crate::data::bounds(vertices);
    bounds.map_or([0.0; 3], |(low, high)| {
        std::array::from_fn(|a| 0.5 * low[a].f64() + 0.5 * high[a].f64())
    })
}

#[derive(Clone, Copy, Default)]
struct EdgeCounts {
    all: usize,
    boundary: usize,
    misaligned: usize,
    crowded: usize,
}

impl EdgeCounts {
    fn add(self, other: Self) -> Self {
        Self {
            all: self.all + other.all,
            boundary: self.boundary + other.boundary,
            misaligned: self.misaligned + other.misaligned,
            crowded: self.crowded + other.crowded,
        }
    }

    /// Counts the edge whose uses these are: the lowest bit of each is its direction.
    fn count(&mut self, uses: &[u64]) {
        self.all += 1;
        match uses {
            [_] => self.boundary += 1,
            [a, b] => self.misaligned += usize::from(a == b),
            _ => self.crowded += 1,
        }
    }
}

/// The three directed edges of a face.
fn directed(face: &[u32; 3]) -> [[u32; 2]; 3] {
    let &[a, b, c] = face;
    [[a, b], [b, c], [c, a]]
}

impl Scratch {
    /// Number of vertices used by faces, and of connected components.
    fn components<T: Real>(&mut self, mesh: &Mesh<T>) -> (usize, usize) {
        // A vertex is its own root from the moment that a face names it.
        const UNUSED: u32 = u32::MAX;
        self.parent.clear();
        self.parent.resize(mesh.vertices().len(), UNUSED);
        let parent = &mut self.parent;
        let (mut used, mut pieces) = (0, 0);
        for face in mesh.faces() {
            for &v in face {
                if parent[v as usize] == UNUSED {
                    parent[v as usize] = v;
                    used += 1;
                    pieces += 1;
                }
            }
            let mut root = union_find::root(parent, face[0]);
            for &v in &face[1..] {
                let other = union_find::root(parent, v);
                if other != root {
                    // The lower number wins: the trees do not depend on the order of a face's corners.
                    let (low, high) = (root.min(other), root.max(other));
                    parent[high as usize] = low;
                    root = low;
                    pieces -= 1;
                }
            }
        }
        (used, pieces)
    }

    /// Writes down every use of an edge by a face, as `other vertex · 2 + direction`, in the bucket of
    /// the edge's lower vertex.
    fn sort_edges<T: Real>(&mut self, mesh: &Mesh<T>) {
        self.start.clear();
        self.start.resize(mesh.vertices().len() + 1, 0);
        for [a, b] in mesh.faces().iter().flat_map(directed) {
            self.start[a.min(b) as usize] += 1;
        }
        let mut end = 0;
        for start in &mut self.start {
            end += *start;
            *start = end;
        }
        self.uses.resize(end, 0);
        // Filled from the end, so that each start comes to where it belongs.
        for [a, b] in mesh.faces().iter().flat_map(directed) {
            let place = &mut self.start[a.min(b) as usize];
            *place -= 1;
            self.uses[*place] = u64::from(a.max(b)) << 1 | u64::from(a > b);
        }
    }

    fn count_edges(&mut self, vertices: usize) -> EdgeCounts {
        let mut pieces = Vec::with_capacity(vertices.div_ceil(CHUNK));
        let mut rest = &mut self.uses[..];
        let mut begin = 0;
        for first in (0..vertices).step_by(CHUNK) {
            let last = (first + CHUNK).min(vertices);
            let (piece, after) = std::mem::take(&mut rest).split_at_mut(self.start[last] - begin);
            pieces.push((&self.start[first..=last], piece));
            begin = self.start[last];
            rest = after;
        }
        let counts = parallel::map_each(pieces, |_, (start, uses)| count_piece(start, uses));
        counts
            .into_iter()
            .fold(EdgeCounts::default(), EdgeCounts::add)
    }
}

/// Counts the edges in the buckets of some vertices, which begin at `start[0]`.
fn count_piece(start: &[usize], uses: &mut [u64]) -> EdgeCounts {
    let mut counts = EdgeCounts::default();
    for pair in start.windows(2) {
        let bucket = &mut uses[pair[0] - start[0]..pair[1] - start[0]];
        bucket.sort_unstable();
        for edge in bucket.chunk_by(|a, b| a >> 1 == b >> 1) {
            counts.count(edge);
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn corner_tetrahedron(at: [f64; 3], size: f64) -> Vec<[f64; 3]> {
        let unit = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        unit.map(|p| vector::add(at, vector::scale(p, size)))
            .to_vec()
    }

    #[test]
    fn a_tetrahedron_has_its_area_and_volume_wherever_it_lies() {
        for at in [[0.0; 3], [1e6, -2e6, 3e6]] {
            let mesh = Mesh::new(corner_tetrahedron(at, 2.0), TETRAHEDRON.to_vec()).expect("valid");
            let m = Measures::of(&mesh);
            // Coordinates of 1e6 are exact to 1e-10.
            assert!((m.volume - 8.0 / 6.0).abs() < 1e-9, "{m:?}");
            assert!((m.area - (6.0 + 12.0f64.sqrt())).abs() < 1e-9, "{m:?}");
            assert_eq!((m.vertices, m.edges, m.faces), (4, 6, 4));
            assert_eq!((m.components, m.euler, m.closed), (1, 2, true));
        }
    }

    #[test]
    fn a_flipped_face_a_missing_face_and_a_doubled_face_each_break_closedness() {
        let of = |faces: Vec<[u32; 3]>| {
            Measures::of(&Mesh::new(corner_tetrahedron([0.0; 3], 1.0), faces).expect("valid"))
        };
        let defects = |faces| {
            let m = of(faces);
            assert!(!m.closed);
            [m.boundary_edges, m.misaligned_edges, m.crowded_edges]
        };
        let mut flipped = TETRAHEDRON.to_vec();
        flipped[1] = [1, 0, 3];
        assert_eq!(defects(flipped), [0, 3, 0]);
        assert_eq!(defects(TETRAHEDRON[..3].to_vec()), [3, 0, 0]);
        let mut doubled = TETRAHEDRON.to_vec();
        doubled.push(doubled[0]);
        assert_eq!(defects(doubled), [0, 0, 3]);
        let m = of(vec![[1, 1, 2]]);
        assert_eq!((m.closed, m.boundary_edges, m.vertices), (false, 1, 2));
    }

    #[test]
    fn vertices_that_no_face_names_do_not_count() {
        let mut vertices = corner_tetrahedron([0.0; 3], 1.0);
        vertices.extend(corner_tetrahedron([5.0; 3], 1.0));
        let lone = Measures::of(&Mesh::new(vertices.clone(), TETRAHEDRON.to_vec()).expect("valid"));
        assert_eq!((lone.vertices, lone.components, lone.euler), (4, 1, 2));
        let mut faces = TETRAHEDRON.to_vec();
        faces.extend(TETRAHEDRON.map(|f| f.map(|v| v + 4)));
        let two = Measures::of(&Mesh::new(vertices, faces).expect("valid"));
        assert_eq!((two.components, two.euler, two.closed), (2, 4, true));
    }

    #[test]
    fn an_empty_mesh_measures_nothing() {
        let m = Measures::of(&Mesh::<f32>::default());
        assert_eq!(m, Measures::default());
    }
}
