//! Generalized winding number, which decides between domains.
//!
//! With outward normals, the winding number of a closed surface is 0 outside, 1 inside and ½ on the
//! surface itself, however deep bodies and cavities are nested. It is a sum over samples: that of domains
//! `a` which still have to choose their signs `s_a` is `Σ_a s_a w_a`. So the right signs are those that
//! bring it closest to ½ at the samples, and how close tells one solution from another. Clusters of samples far from such a
//! place are summed as one ([`tree`]), so that the sum of all grows with log N.
//!
//! Source: G. Barill et al., "Fast winding numbers for soups and clouds" (2018), for the sum over samples;
//! S. Lin et al., "Surface reconstruction from point clouds without normals by parametrizing the Gauss
//! formula" (2022), for the ½.

use super::graph::Graph;
use super::signs::{Domains, Place};
use crate::{parallel, simd, vector};
use tree::{Dipole, Tree};

pub(super) mod tree;

/// Number of samples at which the winding number is computed, and the fewest in one domain.
const PROBES: usize = 2048;
const FEWEST_PROBES: usize = 4;

/// Weight of a sample with air on both sides. The winding number of an open sheet is ½ nowhere: that of a bulge comes closer
/// to it if the bulge is turned outward, whatever the sheet around it is.
const EXPOSED: f64 = 0.1;

/// `(probes, domains)` the winding number that each domain, with these `members` and signs of all axes, gives at each of the
/// `probes`.
fn numbers(
    graph: &Graph,
    place: &impl Place,
    (members, sign): (&[Vec<u32>], &[f32]),
    probes: &[u32],
) -> Vec<f64> {
    let trees = parallel::map_each(members, |_, members| {
        Tree::of_each(members.len(), &|k| {
            let p = members[k] as usize;
            dipole(graph, place, p, sign[p])
        })
    });
    let arch = pulp::Arch::new();
    let at_probe = |k: usize| -> Vec<f64> {
        let at = place.in_spacings(probes[k] as usize);
        let winding = |tree: &Tree| simd::vectorized!(arch, tree.winding_number(at));
        trees.iter().map(winding).collect()
    };
    parallel::map(probes.len(), at_probe).concat()
}

/// Cost of signs: the sum over all samples, weighted less where they are [exposed](Graph::exposed), of the squared distance
/// of the winding number from ½, which is
/// `Σ_ab gram[a][b] s_a s_b − Σ_a pull[a] s_a` and a constant.
#[derive(Clone, Debug, Default)]
pub(super) struct Misfit {
    /// `(domains · domains,)`, symmetric.
    pub gram: Vec<f64>,
    /// `(domains,)`.
    pub pull: Vec<f64>,
    constant: f64,
}

impl Misfit {
    /// The cost of domains, with the signs that their samples have relative to each other.
    pub(super) fn new(graph: &Graph, place: &impl Place, domains: &Domains<'_>) -> Self {
        let members = domains.members();
        let in_one = members.iter().map(Vec::len).sum();
        let (probes, mut weights) = probes(&members, in_one);
        for (weight, &p) in weights.iter_mut().zip(&probes) {
            *weight *= 1.0 - (1.0 - EXPOSED) * f64::from(graph.exposed[p as usize]);
        }
        let windings = numbers(graph, place, (&members, domains.sign), &probes);
        let count = domains.count;
        let weighted = || weights.iter().zip(windings.chunks_exact(count.max(1)));
        let mut pull = vec![0.0; count];
        for (weight, winding) in weighted() {
            for a in 0..count {
                pull[a] += weight * winding[a];
            }
        }
        let mut gram = vec![0.0; count * count];
        let rows = gram.chunks_mut((ROWS * count).max(1));
        let arch = pulp::Arch::new();
        parallel::each(rows, |chunk, rows| {
            simd::vectorized!(arch, {
                for (weight, winding) in weighted() {
                    for (a, row) in (chunk * ROWS..).zip(rows.chunks_exact_mut(count)) {
                        let own = weight * winding[a];
                        for (sum, other) in row[..=a].iter_mut().zip(winding) {
                            *sum += own * other;
                        }
                    }
                }
            });
        });
        for a in 0..count {
            for b in 0..a {
                gram[b * count + a] = gram[a * count + b];
            }
        }
        Self {
            gram,
            pull,
            constant: 0.25 * weights.iter().sum::<f64>(),
        }
    }

    /// The cost with the signs as they are.
    pub(super) fn total(&self) -> f64 {
        self.gram.iter().sum::<f64>() - self.pull.iter().sum::<f64>() + self.constant
    }
}

/// Samples at which the winding number is computed, spread evenly over each domain, and the number of samples that each
/// represents.
fn probes(members: &[Vec<u32>], samples: usize) -> (Vec<u32>, Vec<f64>) {
    let (mut probes, mut weights) = (Vec::new(), Vec::new());
    for members in members {
        let n = members.len();
        let share = (PROBES * n / samples.max(1)).max(FEWEST_PROBES).min(n);
        probes.extend(spread_evenly(members, share));
        weights.extend((0..share).map(|_| n as f64 / share as f64));
    }
    (probes, weights)
}

/// So many of some samples, spread evenly over them.
pub(super) fn spread_evenly(members: &[u32], share: usize) -> impl Iterator<Item = u32> + '_ {
    (0..share).map(move |k| members[(2 * k + 1) * members.len() / (2 * share)])
}

/// A sample with this sign of its axis; lengths in spacings.
pub(super) fn dipole(graph: &Graph, place: &impl Place, p: usize, sign: f32) -> Dipole {
    let normal = vector::scale(graph.axis[p], sign);
    Dipole::new(place.in_spacings(p), normal, graph.area[p])
}

/// Rows of the matrix of a cost that one task computes.
const ROWS: usize = 16;

#[cfg(test)]
mod tests {
    use super::super::shapes::{Sampled, inside_out, join, sphere};
    use super::*;

    /// Samples in units of their spacing, each of which stands for an area of 1.
    struct Body {
        graph: Graph,
        points: Vec<[f64; 3]>,
    }

    impl Place for Body {
        fn user(&self, p: usize) -> [f64; 3] {
            self.points[p]
        }

        fn spacing(&self) -> f64 {
            1.0
        }
    }

    impl Body {
        fn of((points, normals): Sampled) -> Self {
            let graph = Graph {
                axis: normals.iter().map(|&n| vector::of_f64(n)).collect(),
                area: vec![1.0; points.len()],
                exposed: vec![0.0; points.len()],
                ..Graph::default()
            };
            Self { graph, points }
        }

        /// Cost with the first samples in one domain, and the others in another.
        fn misfit(&self, first: usize) -> Misfit {
            let n = self.points.len();
            let domain: Vec<u32> = (0..n).map(|p| u32::from(p >= first)).collect();
            let domains = Domains {
                domain: &domain,
                sign: &vec![1.0; n],
                count: if first < n { 2 } else { 1 },
            };
            Misfit::new(&self.graph, self, &domains)
        }

        fn dipoles(&self) -> Vec<Dipole> {
            let dipole = |p| Dipole::new(self.in_spacings(p), self.graph.axis[p], 1.0);
            (0..self.points.len()).map(dipole).collect()
        }
    }

    /// `n` samples, one for each unit of area.
    fn radius(n: usize) -> f64 {
        (n as f64 / (4.0 * std::f64::consts::PI)).sqrt()
    }

    #[test]
    fn it_is_one_inside_nothing_outside_and_a_half_on_the_surface() {
        let r = radius(4000);
        let ball = Body::of(sphere(4000, [0.0; 3], r, 3));
        let tree = Tree::new(ball.dipoles());
        let first = ball.points[0];
        let at = |x: f64| tree.winding_number(vector::of_f64(vector::sub([x, 0.0, 0.0], first)));
        // Random samples: a per cent or two.
        assert!((at(0.0) - 1.0).abs() < 0.01, "{}", at(0.0));
        assert!((at(0.5 * r) - 1.0).abs() < 0.02, "{}", at(0.5 * r));
        assert!(at(1.5 * r).abs() < 0.02, "{}", at(1.5 * r));
        let mean = ball.misfit(4000).pull[0] / 4000.0;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }

    #[test]
    fn a_hollow_ball_fits_best_with_its_inner_wall_turned_inward() {
        let (r, inner) = (radius(4000), radius(2000));
        let outer = sphere(4000, [0.0; 3], r, 3);
        let wall = sphere(2000, [0.0; 3], inner, 4);
        let with = |wall: Sampled| Body::of(join(outer.clone(), wall));
        let cost = |wall: Sampled| with(wall).misfit(4000).total();
        let (right, wrong) = (cost(inside_out(wall.clone())), cost(wall.clone()));
        // Wrong, the winding number is 3/2 on the wall and right on the outside.
        assert!(right < 0.01 * 6000.0, "{right}");
        assert!((wrong - 2000.0).abs() < 0.1 * 2000.0, "{wrong}");
        let both = with(wall).misfit(4000);
        assert!(both.gram[1] > 0.0, "their signs should differ");
        assert_eq!(both.total(), wrong);
    }
}
