//! The generalised winding number as an arbiter.
//!
//! With outward normals, the winding number of a closed surface is 0 outside, 1 inside and ½ on the
//! surface itself, however deep bodies and cavities are nested. It is a sum over samples: that of domains
//! `a` which still have to choose their signs `s_a` is `Σ_a s_a w_a`. So the right signs are those that
//! bring it closest to ½ at the samples, and how close tells one solution from another.
//!
//! Source: G. Barill et al., "Fast winding numbers for soups and clouds" (2018), for the sum over samples;
//! S. Lin et al., "Surface reconstruction from point clouds without normals by parametrizing the Gauss
//! formula" (2022), for the ½.

use std::f32::consts::PI;

use rayon::prelude::*;

/// Samples at which the winding number is asked, and the fewest in one domain.
const PROBES: usize = 2048;
const FEWEST_PROBES: usize = 4;

/// A sample nearer than this share of the spacing counts as if it were so far: it lies on the same sheet, and
/// only its noise would speak.
const SOFT: f32 = 0.3;

/// A sample as a piece of surface; lengths in sample spacings.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Dipole {
    position: [f32; 3],
    /// Area times normal over 4π.
    moment: [f32; 3],
}

impl Dipole {
    pub(super) fn new(position: [f32; 3], normal: [f32; 3], area: f32) -> Self {
        Self {
            position,
            moment: normal.map(|n| n * area / (4.0 * PI)),
        }
    }
}

/// What signs cost: the sum over all samples of the squared distance of the winding number from ½, which is
/// `Σ_ab gram[a][b] s_a s_b − Σ_a pull[a] s_a + samples/4`.
#[derive(Clone, Debug, Default)]
pub(super) struct Misfit {
    /// `(domains · domains,)`, symmetric.
    pub gram: Vec<f64>,
    /// `(domains,)`.
    pub pull: Vec<f64>,
    samples: usize,
}

impl Misfit {
    /// `domains[a]` are the samples of a domain, with the signs that they have relative to each other.
    pub(super) fn of(domains: &[Vec<Dipole>]) -> Self {
        let (count, samples) = (domains.len(), domains.iter().map(Vec::len).sum());
        let blocks: Vec<Vec<Block>> = domains.iter().map(|d| blocks(d)).collect();
        let probes = probes(domains, samples);
        let arch = pulp::Arch::new();
        let ask = |&(at, _): &([f32; 3], f64)| -> Vec<f64> {
            let winding = |blocks: &Vec<Block>| {
                crate::simd::dispatch(
                    arch,
                    #[inline(always)]
                    || winding_number(blocks, at),
                )
            };
            blocks.iter().map(winding).collect()
        };
        let windings: Vec<Vec<f64>> = probes.par_iter().map(ask).collect();
        let (mut gram, mut pull) = (vec![0.0; count * count], vec![0.0; count]);
        for (&(_, weight), winding) in probes.iter().zip(&windings) {
            for a in 0..count {
                pull[a] += weight * winding[a];
                for b in 0..count {
                    gram[a * count + b] += weight * winding[a] * winding[b];
                }
            }
        }
        Self {
            gram,
            pull,
            samples,
        }
    }

    /// The cost with the signs as they are.
    pub(super) fn total(&self) -> f64 {
        self.gram.iter().sum::<f64>() - self.pull.iter().sum::<f64>() + 0.25 * self.samples as f64
    }
}

/// Places to ask at, and how many samples each stands for: spread evenly over the samples of each domain.
fn probes(domains: &[Vec<Dipole>], samples: usize) -> Vec<([f32; 3], f64)> {
    let mut probes = Vec::new();
    for dipoles in domains {
        let n = dipoles.len();
        let share = (PROBES * n / samples.max(1)).max(FEWEST_PROBES).min(n);
        let place = |k: usize| dipoles[(2 * k + 1) * n / (2 * share)].position;
        let weight = n as f64 / share as f64;
        probes.extend((0..share).map(|k| (place(k), weight)));
    }
    probes
}

/// Samples that are summed side by side, and blocks that are summed in single precision.
const WIDTH: usize = 16;
const RUN: usize = 64;

/// Positions and moments of some samples, coordinate by coordinate; moments of 0 fill it up.
type Block = [[f32; WIDTH]; 6];

fn blocks(dipoles: &[Dipole]) -> Vec<Block> {
    let block = |chunk: &[Dipole]| {
        let mut block = [[0.0; WIDTH]; 6];
        for (l, dipole) in chunk.iter().enumerate() {
            for a in 0..3 {
                block[a][l] = dipole.position[a];
                block[3 + a][l] = dipole.moment[a];
            }
        }
        block
    };
    dipoles.chunks(WIDTH).map(block).collect()
}

#[inline(always)]
fn winding_number(blocks: &[Block], at: [f32; 3]) -> f64 {
    let mut total = 0.0;
    for run in blocks.chunks(RUN) {
        let mut sums = [0.0f32; WIDTH];
        for [px, py, pz, mx, my, mz] in run {
            for l in 0..WIDTH {
                let (x, y, z) = (px[l] - at[0], py[l] - at[1], pz[l] - at[2]);
                let square = x * x + y * y + z * z + SOFT * SOFT;
                sums[l] += (x * mx[l] + y * my[l] + z * mz[l]) / (square * square.sqrt());
            }
        }
        total += sums.iter().map(|&s| f64::from(s)).sum::<f64>();
    }
    total
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Sampled, inside_out, sphere};
    use super::*;
    use crate::vector;

    /// Samples of a sphere in units of their spacing, which is then 1.
    fn dipoles((points, normals): &Sampled) -> Vec<Dipole> {
        let pairs = points.iter().zip(normals);
        pairs
            .map(|(&x, &n)| Dipole::new(vector::of_f64(x), vector::of_f64(n), 1.0))
            .collect()
    }

    /// `n` samples, one for each unit of area.
    fn radius(n: usize) -> f64 {
        (n as f64 / (4.0 * std::f64::consts::PI)).sqrt()
    }

    #[test]
    fn it_is_one_inside_nothing_outside_and_a_half_on_the_surface() {
        let r = radius(4000);
        let ball = dipoles(&sphere(4000, [0.0; 3], r, 3));
        let at = |x: f64| winding_number(&blocks(&ball), [x as f32, 0.0, 0.0]);
        // Random samples: a per cent or two.
        assert!((at(0.0) - 1.0).abs() < 1e-3, "{}", at(0.0));
        assert!((at(0.5 * r) - 1.0).abs() < 0.02, "{}", at(0.5 * r));
        assert!(at(1.5 * r).abs() < 0.02, "{}", at(1.5 * r));
        let mean = Misfit::of(&[ball]).pull[0] / 4000.0;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }

    #[test]
    fn the_sums_are_those_of_one_sample_after_the_other() {
        let ball = dipoles(&sphere(1003, [1.0, 2.0, 3.0], 9.0, 5));
        let at = [3.0, -1.0, 4.0f32];
        let one = |d: &Dipole| {
            let r = vector::to_f64(vector::sub(d.position, at));
            let square = vector::norm_squared(r) + f64::from(SOFT * SOFT);
            vector::dot(r, vector::to_f64(d.moment)) / square.powf(1.5)
        };
        let plain: f64 = ball.iter().map(one).sum();
        let sum = winding_number(&blocks(&ball), at);
        // A thousand terms below 0.1, in single precision.
        assert!((sum - plain).abs() < 1e-5, "{sum} {plain}");
    }

    #[test]
    fn a_hollow_ball_fits_best_with_its_inner_wall_turned_inward() {
        let (r, inner) = (radius(4000), radius(2000));
        let outer = dipoles(&sphere(4000, [0.0; 3], r, 3));
        let wall = sphere(2000, [0.0; 3], inner, 4);
        let cost = |wall: &Sampled| Misfit::of(&[outer.clone(), dipoles(wall)]).total();
        let (right, wrong) = (cost(&inside_out(wall.clone())), cost(&wall));
        // Wrong, the winding number is 3/2 on the wall and right on the outside.
        assert!(right < 0.01 * 6000.0, "{right}");
        assert!((wrong - 2000.0).abs() < 0.1 * 2000.0, "{wrong}");
        let both = Misfit::of(&[outer, dipoles(&wall)]);
        assert!(both.gram[1] > 0.0, "their signs should differ");
        assert!((both.total() - wrong).abs() < 1e-9 * wrong);
    }
}
