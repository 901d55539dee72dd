//! Whether the winding number of a mesh is a whole number everywhere.

use std::cmp::Ordering;

use rayon::slice::ParallelSliceMut;

use crate::{Mesh, Real, parallel};

/// Whether faces run through each edge as often in one direction as in the other. Vertices at one place count as one.
pub(in crate::distance) fn is_closed<T: Real>(mesh: &Mesh<T>) -> bool {
    let named = |v: u32| v;
    is_balanced(mesh, named) || {
        let first = first_at_place(mesh.vertices());
        is_balanced(mesh, |v| first[v as usize])
    }
}

/// Whether each edge is balanced, if `name` gives the name of a vertex.
fn is_balanced<T: Real>(mesh: &Mesh<T>, name: impl Fn(u32) -> u32 + Sync) -> bool {
    let faces = mesh.faces();
    let mut uses = parallel::flat_map(3 * faces.len(), |side| {
        let (face, k) = (faces[side / 3], side % 3);
        let [p, q] = [face[k], face[(k + 1) % 3]].map(&name);
        (p != q).then_some((p.min(q), p.max(q), p < q))
    });
    uses.par_sort_unstable();
    uses.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)).all(|edge| {
        let forward = edge.partition_point(|&(_, _, forward)| !forward);
        2 * forward == edge.len()
    })
}

/// The first vertex at the place of each.
fn first_at_place<T: Real>(vertices: &[[T; 3]]) -> Vec<u32> {
    let place = |&v: &u32| vertices[v as usize];
    let compare = |a: &u32, b: &u32| place(a).partial_cmp(&place(b)).unwrap_or(Ordering::Equal);
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.par_sort_unstable_by(|a, b| compare(a, b).then(a.cmp(b)));
    let mut first = vec![0; vertices.len()];
    for same in order.chunk_by(|a, b| place(a) == place(b)) {
        for &v in same {
            first[v as usize] = same[0];
        }
    }
    first
}
