//! The triangles of a loop with midpoints between its vertices.

use crate::isosurface::tables::TIE;
use crate::vector::{cross, dot, sub};

/// Most corners: a loop has seven vertices at most.
const MOST: usize = 14;

/// A vertex or a midpoint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Its number in the mesh.
    pub vertex: u32,
    /// In the cube, from 0 to 1.
    pub place: [f64; 3],
    /// The faces of the cube that it lies on, as bits.
    pub faces: u8,
}

/// Corners, counter-clockwise seen from outside the surface.
pub(super) struct Polygon {
    pub corners: Vec<Corner>,
}

impl Polygon {
    /// Adds the triangulation that encloses the most of those without a diagonal within a face of the cube. Volumes that
    /// differ by no more than [`TIE`] roundings `epsilon` are the same.
    pub(super) fn triangulate(&self, epsilon: f64, faces: &mut Vec<[u32; 3]>) {
        let last = self.corners.len() - 1;
        // Of the part between two corners: the third corner of its triangle on their diagonal, and what it encloses.
        let mut apexes = [[0; MOST]; MOST];
        let mut volumes = [[0.0; MOST]; MOST];
        for length in 2..=last {
            for i in 0..=last - length {
                let j = i + length;
                volumes[i][j] = f64::NEG_INFINITY;
                let is_whole = length == last;
                if !is_whole && self.corners[i].faces & self.corners[j].faces != 0 {
                    continue;
                }
                for k in i + 1..j {
                    let volume = volumes[i][k] + volumes[k][j] + self.volume([i, k, j]);
                    if volume > volumes[i][j] + TIE * epsilon {
                        (apexes[i][j], volumes[i][j]) = (k, volume);
                    }
                }
            }
        }
        self.add(&apexes, [0, last], faces);
    }

    /// Adds the triangles of the part between two corners.
    fn add(&self, apexes: &[[usize; MOST]; MOST], [i, j]: [usize; 2], faces: &mut Vec<[u32; 3]>) {
        if j > i + 1 {
            let k = apexes[i][j];
            faces.push([i, k, j].map(|corner| self.corners[corner].vertex));
            self.add(apexes, [i, k], faces);
            self.add(apexes, [k, j], faces);
        }
    }

    /// Six times the volume between a triangle and the first corner.
    fn volume(&self, triangle: [usize; 3]) -> f64 {
        let [a, b, c] =
            triangle.map(|corner| sub(self.corners[corner].place, self.corners[0].place));
        dot(a, cross(b, c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isosurface::tables;
    use crate::neighbors::tests::Random;

    /// All triangulations of the part between two corners without a diagonal in a face, plainly.
    fn cover(corners: &[Corner], i: usize, j: usize) -> Vec<Vec<[usize; 3]>> {
        let is_whole = i == 0 && j + 1 == corners.len();
        if j == i + 1 {
            return vec![Vec::new()];
        }
        if !is_whole && corners[i].faces & corners[j].faces != 0 {
            return Vec::new();
        }
        let mut all = Vec::new();
        for k in i + 1..j {
            for left in cover(corners, i, k) {
                for right in cover(corners, k, j) {
                    all.push([&[[i, k, j]], left.as_slice(), right.as_slice()].concat());
                }
            }
        }
        all
    }

    /// A loop with vertices anywhere on their edges, and midpoints in the segments whose bit of `split` is set.
    fn polygon(cycle: &[u8], split: u32, random: &mut Random) -> Polygon {
        let mut corners: Vec<Corner> = Vec::new();
        for (n, &edge) in cycle.iter().enumerate() {
            corners.push(Corner {
                vertex: corners.len() as u32,
                place: tables::vertex(edge, random.uniform()),
                faces: tables::faces_of(edge),
            });
            if split >> n & 1 == 1 {
                let next = cycle[(n + 1) % cycle.len()];
                let face = tables::faces_of(edge) & tables::faces_of(next);
                assert_eq!(face.count_ones(), 1);
                let (axis, high) = (face.trailing_zeros() / 2, face.trailing_zeros() % 2);
                let mut place = [0; 3].map(|_| random.uniform());
                place[axis as usize] = f64::from(high);
                corners.push(Corner {
                    vertex: corners.len() as u32,
                    place,
                    faces: face,
                });
            }
        }
        Polygon { corners }
    }

    fn volume(polygon: &Polygon, triangles: &[[usize; 3]]) -> f64 {
        triangles.iter().map(|&t| polygon.volume(t)).sum()
    }

    #[test]
    fn the_triangulation_encloses_the_most_of_all_without_a_diagonal_in_a_face() {
        let mut random = Random::new(3);
        let mut largest = 0;
        for case in 0..=255 {
            for of in tables::loops_of(case) {
                let cycle = of.cycle();
                for split in 0..1 << cycle.len() {
                    let polygon = polygon(cycle, split, &mut random);
                    let mut faces = Vec::new();
                    polygon.triangulate(f64::EPSILON, &mut faces);
                    let corners = &polygon.corners;
                    assert_eq!(
                        faces.len(),
                        corners.len() - 2,
                        "{case}: {cycle:?} {split:b}"
                    );
                    let own: Vec<[usize; 3]> =
                        faces.iter().map(|face| face.map(|v| v as usize)).collect();
                    if corners.len() <= 8 {
                        let all = cover(corners, 0, corners.len() - 1);
                        let volumes = all.iter().map(|triangles| volume(&polygon, triangles));
                        let most = volumes.fold(f64::NEG_INFINITY, f64::max);
                        assert!(volume(&polygon, &own) > most - 1e-12);
                        largest = largest.max(all.len());
                        assert!(all.iter().any(|triangles| {
                            let mut sorted = [triangles.clone(), own.clone()];
                            sorted.iter_mut().for_each(|triangles| triangles.sort());
                            sorted[0] == sorted[1]
                        }));
                    }
                }
            }
        }
        assert!(largest > 50, "{largest}");
    }
}
