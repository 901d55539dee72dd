//! Scatters turned into gathers: each output adds up its own terms, in one fixed order.

use crate::parallel::{self, CHUNK};
use crate::{Mesh, Real, vector};

/// Items by key, those of one key in ascending order: a stable counting sort.
#[derive(Clone, Debug, Default)]
pub(crate) struct Buckets {
    /// Where the items of each key begin, and the end of the last.
    start: Vec<usize>,
    items: Vec<u32>,
}

impl Buckets {
    /// Sorts the items `0..items` by their keys, any number each and all below `buckets`, reusing the memory.
    pub(crate) fn fill<K: IntoIterator<Item = u32>>(
        &mut self,
        buckets: usize,
        items: usize,
        keys: impl Fn(usize) -> K,
    ) {
        self.start.clear();
        self.start.resize(buckets + 1, 0);
        for item in 0..items {
            for key in keys(item) {
                self.start[key as usize] += 1;
            }
        }
        let mut end = 0;
        for start in &mut self.start {
            end += *start;
            *start = end;
        }
        // Every place is written below.
        self.items.resize(end, 0);
        // Filled from the end, so that each start comes to where it belongs.
        for item in (0..items).rev() {
            for key in keys(item) {
                let place = &mut self.start[key as usize];
                *place -= 1;
                self.items[*place] = item as u32;
            }
        }
    }

    /// The faces of each vertex of a mesh.
    pub(crate) fn fill_with_faces<T: Real>(&mut self, mesh: &Mesh<T>) {
        let faces = mesh.faces();
        self.fill(mesh.vertices().len(), faces.len(), |face| faces[face]);
    }

    /// The items of one key.
    #[inline(always)]
    pub(crate) fn of(&self, key: usize) -> &[u32] {
        &self.items[self.start[key]..self.start[key + 1]]
    }

    /// Calls `visit(face, corner)` for every corner that is `vertex`, of buckets filled by
    /// [`Self::fill_with_faces`].
    #[inline(always)]
    pub(crate) fn for_each_corner(
        &self,
        faces: &[[u32; 3]],
        vertex: usize,
        mut visit: impl FnMut(usize, usize),
    ) {
        let mut last = None;
        for &face in self.of(vertex) {
            // A face that names the vertex twice is in the bucket twice.
            if last.replace(face) == Some(face) {
                continue;
            }
            for (corner, &named) in faces[face as usize].iter().enumerate() {
                if named as usize == vertex {
                    visit(face as usize, corner);
                }
            }
        }
    }
}

/// The nearest number of type `T`; 0 where it is not finite, which increments `guarded`.
#[inline(always)]
pub(crate) fn bounded<T: Real>(x: f64, guarded: &mut usize) -> T {
    let x = T::of(x);
    if x.is_finite() {
        return x;
    }
    *guarded += 1;
    T::zero()
}

/// Adds `term(i)` to each entry. Returns the number of values out of range, which are left out.
pub(crate) fn add_to<T: Real>(
    out: &mut [[T; 3]],
    term: impl Fn(usize) -> [f64; 3] + Sync,
) -> usize {
    let guarded = parallel::map_each(out.chunks_mut(CHUNK), |chunk, out| {
        let mut guarded = 0;
        for (k, out) in out.iter_mut().enumerate() {
            let sum = term(chunk * CHUNK + k);
            *out = vector::add(*out, sum.map(|x| bounded(x, &mut guarded)));
        }
        guarded
    });
    guarded.into_iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_of_a_key_come_in_their_order_and_all_of_them() {
        let keys = |i: usize| [(i * i % 7) as u32, (3 * i % 5) as u32];
        let mut buckets = Buckets::default();
        for items in [100, 0, 31] {
            buckets.fill(8, items, keys);
            for key in 0..8 {
                let expected: Vec<u32> = (0..items)
                    .flat_map(|i| {
                        keys(i)
                            .into_iter()
                            .filter(|&k| k == key)
                            .map(move |_| i as u32)
                    })
                    .collect();
                assert_eq!(buckets.of(key as usize), expected);
            }
        }
    }

    #[test]
    fn each_corner_of_a_vertex_is_visited_once() {
        let vertices = vec![[0.0f64; 3]; 4];
        let faces = vec![[0, 1, 2], [2, 2, 1], [3, 3, 3]];
        let mesh = Mesh::new(vertices, faces).expect("valid");
        let mut buckets = Buckets::default();
        buckets.fill_with_faces(&mesh);
        let corners = |vertex| {
            let mut found = Vec::new();
            buckets.for_each_corner(mesh.faces(), vertex, |f, k| found.push((f, k)));
            found
        };
        assert_eq!(corners(0), [(0, 0)]);
        assert_eq!(corners(1), [(0, 1), (1, 2)]);
        assert_eq!(corners(2), [(0, 2), (1, 0), (1, 1)]);
        assert_eq!(corners(3), [(2, 0), (2, 1), (2, 2)]);
    }

    #[test]
    fn numbers_out_of_range_become_zero_and_are_counted() {
        let mut guarded = 0;
        assert_eq!(bounded::<f32>(1.5, &mut guarded), 1.5);
        assert_eq!(bounded::<f32>(1e300, &mut guarded), 0.0);
        assert_eq!(bounded::<f64>(1e300, &mut guarded), 1e300);
        assert_eq!(bounded::<f64>(f64::NAN, &mut guarded), 0.0);
        assert_eq!(guarded, 2);
    }
}
