//! The winding number of samples, and its slope, as sums over clusters of them.
//!
//! A cluster far from a place acts as one sample with the sum of all moments. Samples nearby are summed one by one.
//!
//! Source: J. Barnes, P. Hut, "A hierarchical O(N log N) force-calculation algorithm" (1986), for the clusters.

use std::f32::consts::PI;

use crate::{parallel, vector};

/// A sample nearer than this share of the spacing counts as if it were so far: it lies on the same sheet, and
/// only its noise would speak.
const SOFT: f32 = 0.3;

/// This distance for slopes, which vary more.
const SMOOTH: f32 = 1.0;

/// A sample as a piece of surface; lengths in sample spacings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::orient) struct Dipole {
    position: [f32; 3],
    /// Area times normal over 4π.
    moment: [f32; 3],
}

impl Dipole {
    /// A sample with its outward unit normal.
    pub(in crate::orient) fn new(position: [f32; 3], normal: [f32; 3], area: f32) -> Self {
        Self {
            position,
            moment: normal.map(|n| n * area / (4.0 * PI)),
        }
    }
}

/// Samples that are summed side by side.
const WIDTH: usize = 16;

/// Positions and moments of some samples, coordinate by coordinate; moments of 0 fill it up.
type Block = [[f32; WIDTH]; 6];

/// Samples of the smallest clusters, at most.
const LEAF: usize = 4 * WIDTH;

/// The halves of more samples are worth a task each.
const MANY: usize = 1 << 17;

/// A cluster acts as one sample from this many times its radius on.
const FAR: f32 = 4.0;

/// A cluster of samples, and the one that stands for them from afar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cluster {
    whole: Dipole,
    /// Square of the distance from which on it stands for them.
    far: f32,
    /// Its blocks, from the first to before the last; none, if its parts come after it.
    blocks: [u32; 2],
    /// The cluster after it and its parts.
    next: u32,
}

/// The samples of a domain: clusters, each before its two halves.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::orient) struct Tree {
    blocks: Vec<Block>,
    clusters: Vec<Cluster>,
}

impl Tree {
    /// The tree of samples, in any order.
    pub(in crate::orient) fn new(mut dipoles: Vec<Dipole>) -> Self {
        Self::of(&mut dipoles, MANY)
    }

    /// The tree of `count` samples.
    pub(in crate::orient) fn of_each(
        count: usize,
        dipole: &(dyn Fn(usize) -> Dipole + Sync),
    ) -> Self {
        let mut dipoles = Vec::new();
        parallel::fill_large(&mut dipoles, count, dipole);
        Self::new(dipoles)
    }

    /// [`Self::new`]; the halves of more than `many` samples are built side by side.
    fn of(dipoles: &mut [Dipole], many: usize) -> Self {
        let size = Size::of(dipoles.len());
        let mut tree = Self {
            blocks: vec![[[0.0; WIDTH]; 6]; size.blocks],
            clusters: vec![Cluster::default(); size.clusters],
        };
        let (blocks, clusters) = (&mut tree.blocks[..], &mut tree.clusters[..]);
        build(dipoles, Part { blocks, clusters }, Size::default(), many);
        tree
    }

    /// The winding number at a place; off by up to 1 % where clusters stand for their samples.
    #[inline(always)]
    pub(super) fn winding_number(&self, at: [f32; 3]) -> f64 {
        self.sum(
            at,
            #[inline(always)]
            |offset, moment| {
                let square = softened(offset, SOFT);
                share(vector::dot(offset, moment), square)
            },
        )
    }

    /// How steeply the winding number falls at a place, along a unit vector: its derivative, with the opposite sign, per
    /// spacing.
    #[inline(always)]
    pub(in crate::orient) fn slope(&self, at: [f32; 3], along: [f32; 3]) -> f64 {
        self.sum(
            at,
            #[inline(always)]
            |offset, moment| {
                let square = softened(offset, SMOOTH);
                let both = 3.0 * vector::dot(offset, moment) * vector::dot(offset, along) / square;
                share(vector::dot(along, moment) - both, square)
            },
        )
    }

    /// The sum over all samples of a function of their offset from a place, and of their moment.
    #[inline(always)]
    fn sum(&self, at: [f32; 3], of: impl Fn([f32; 3], [f32; 3]) -> f32) -> f64 {
        let mut total = 0.0;
        let mut c = 0;
        while let Some(cluster) = self.clusters.get(c) {
            let offset = [0, 1, 2].map(|a| cluster.whole.position[a] - at[a]);
            if vector::norm_squared(offset) > cluster.far {
                total += f64::from(of(offset, cluster.whole.moment));
                c = cluster.next as usize;
                continue;
            }
            let [first, last] = cluster.blocks.map(|b| b as usize);
            total += near(&self.blocks[first..last], at, &of);
            c += 1;
        }
        total
    }
}

/// Number of blocks and of clusters.
#[derive(Clone, Copy, Debug, Default)]
struct Size {
    blocks: usize,
    clusters: usize,
}

impl Size {
    /// Size of the tree of a number of samples.
    fn of(samples: usize) -> Self {
        if samples <= LEAF {
            return Self {
                blocks: samples.div_ceil(WIDTH),
                clusters: samples.min(1),
            };
        }
        let (low, high) = (Self::of(samples / 2), Self::of(samples.div_ceil(2)));
        Self {
            blocks: low.blocks + high.blocks,
            clusters: 1 + low.clusters + high.clusters,
        }
    }
}

/// The blocks and clusters of some samples, those of a tree one after the other.
struct Part<'a> {
    blocks: &'a mut [Block],
    clusters: &'a mut [Cluster],
}

/// Builds the cluster of some samples, if there are any, and its parts. `before` is the size of the tree before it.
fn build(dipoles: &mut [Dipole], part: Part<'_>, before: Size, many: usize) {
    let Some((cluster, clusters)) = part.clusters.split_first_mut() else {
        return;
    };
    let (whole, radius) = combined(dipoles);
    let first = before.blocks as u32;
    *cluster = Cluster {
        whole,
        far: (FAR * radius).powi(2),
        blocks: [first; 2],
        next: (before.clusters + 1 + clusters.len()) as u32,
    };
    if dipoles.len() <= LEAF {
        cluster.blocks[1] += part.blocks.len() as u32;
        fill_blocks(dipoles, part.blocks);
        return;
    }
    let is_large = dipoles.len() > many;
    let (low, high) = halves(dipoles);
    let size = Size::of(low.len());
    let blocks = part.blocks.split_at_mut(size.blocks);
    let clusters = clusters.split_at_mut(size.clusters);
    let of = |blocks, clusters| Part { blocks, clusters };
    let (part_low, part_high) = (of(blocks.0, clusters.0), of(blocks.1, clusters.1));
    let before_low = Size {
        clusters: before.clusters + 1,
        ..before
    };
    let before_high = Size {
        blocks: before.blocks + size.blocks,
        clusters: before_low.clusters + size.clusters,
    };
    let build_low = || build(low, part_low, before_low, many);
    let build_high = || build(high, part_high, before_high, many);
    if is_large {
        parallel::join(build_low, build_high);
    } else {
        build_low();
        build_high();
    }
}

/// The lower and the upper half of samples, along the axis in which they extend furthest.
fn halves(dipoles: &mut [Dipole]) -> (&mut [Dipole], &mut [Dipole]) {
    let extent = |a: usize| {
        let places = dipoles.iter().map(|d| d.position[a]);
        let (low, high) = places.fold((f32::MAX, f32::MIN), |(l, h), x| (l.min(x), h.max(x)));
        high - low
    };
    let extents = [0, 1, 2].map(extent);
    let axis = (0..3).max_by(|&a, &b| extents[a].total_cmp(&extents[b]));
    let (axis, middle) = (axis.unwrap_or(0), dipoles.len() / 2);
    dipoles.select_nth_unstable_by(middle, |a, b| a.position[axis].total_cmp(&b.position[axis]));
    dipoles.split_at_mut(middle)
}

/// The sum of the moments, at the mean of the positions weighted by them, and how far the farthest sample is from there.
fn combined(dipoles: &[Dipole]) -> (Dipole, f32) {
    let (mut moment, mut position, mut total) = ([0.0; 3], [0.0; 3], 0.0);
    for dipole in dipoles {
        let size = vector::norm(vector::to_f64(dipole.moment));
        moment = vector::add(moment, vector::to_f64(dipole.moment));
        position = vector::add(
            position,
            vector::scale(vector::to_f64(dipole.position), size),
        );
        total += size;
    }
    // Without moments any place will do.
    let start = vector::to_f64(dipoles[0].position);
    let position = if total > 0.0 {
        vector::scale(position, 1.0 / total)
    } else {
        start
    };
    let offsets = dipoles
        .iter()
        .map(|d| vector::sub(vector::to_f64(d.position), position));
    let radius = offsets.map(vector::norm).fold(0.0, f64::max);
    let whole = Dipole {
        position: vector::of_f64(position),
        moment: vector::of_f64(moment),
    };
    (whole, radius as f32)
}

/// Writes samples into blocks that are 0.
fn fill_blocks(dipoles: &[Dipole], blocks: &mut [Block]) {
    for (block, chunk) in blocks.iter_mut().zip(dipoles.chunks(WIDTH)) {
        for (l, dipole) in chunk.iter().enumerate() {
            for a in 0..3 {
                block[a][l] = dipole.position[a];
                block[3 + a][l] = dipole.moment[a];
            }
        }
    }
}

/// The sum over all samples of some blocks.
#[inline(always)]
fn near(blocks: &[Block], at: [f32; 3], of: impl Fn([f32; 3], [f32; 3]) -> f32) -> f64 {
    let mut sums = [0.0f32; WIDTH];
    for [px, py, pz, mx, my, mz] in blocks {
        for l in 0..WIDTH {
            let offset = [px[l] - at[0], py[l] - at[1], pz[l] - at[2]];
            sums[l] += of(offset, [mx[l], my[l], mz[l]]);
        }
    }
    sums.iter().map(|&s| f64::from(s)).sum()
}

/// The square of the distance that counts, in squares of the spacing.
#[inline(always)]
fn softened(offset: [f32; 3], by: f32) -> f32 {
    vector::norm_squared(offset) + by * by
}

/// `along` over the third power of the distance with this square.
#[inline(always)]
fn share(along: f32, square: f32) -> f32 {
    along / (square * square.sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::super::shapes::sphere;
    use super::*;

    /// Samples of a sphere of radius 9.
    fn ball(samples: usize) -> Vec<Dipole> {
        let (points, normals) = sphere(samples, [1.0, 2.0, 3.0], 9.0, 5);
        let samples = points.iter().zip(&normals);
        let dipole = |(&x, &n): (&[f64; 3], &[f64; 3])| {
            Dipole::new(vector::of_f64(x), vector::of_f64(n), 1.0)
        };
        samples.map(dipole).collect()
    }

    #[test]
    fn halves_built_side_by_side_make_the_same_tree() {
        let ball = ball(3001);
        let build = |many: usize| Tree::of(&mut ball.clone(), many);
        let whole = build(usize::MAX);
        for many in [LEAF, 500, 2000] {
            assert_eq!(build(many), whole);
        }
    }

    #[test]
    fn the_sums_are_those_of_one_sample_after_the_other() {
        let ball = ball(1003);
        let one = |d: &Dipole, at: [f32; 3]| {
            let r = vector::to_f64(vector::sub(d.position, at));
            let square = vector::norm_squared(r) + f64::from(SOFT * SOFT);
            vector::dot(r, vector::to_f64(d.moment)) / square.powf(1.5)
        };
        // Inside, outside, close to the surface.
        for at in [
            [1.0, 2.0, 3.0],
            [3.0, -1.0, 4.0],
            [1.0, 2.0, 11.9],
            [30.0, 0.0, 0.0f32],
        ] {
            let plain: f64 = ball.iter().map(|d| one(d, at)).sum();
            let sum = Tree::new(ball.clone()).winding_number(at);
            // Clusters of at most a quarter of their distance, in single precision.
            assert!(
                (sum - plain).abs() < 0.01 * plain.abs() + 1e-3,
                "{sum} {plain}"
            );
            // One cluster, whose samples are summed one by one.
            let few = &ball[..LEAF];
            let plain: f64 = few.iter().map(|d| one(d, at)).sum();
            let sum = Tree::new(few.to_vec()).winding_number(at);
            let is_far = at[0] > 20.0;
            assert!(
                (sum - plain).abs() < if is_far { 1e-3 } else { 1e-5 },
                "{sum} {plain}"
            );
        }
    }

    #[test]
    fn slopes_are_differences_of_the_winding_number() {
        let ball = ball(1003);
        let tree = Tree::new(ball.clone());
        let smooth = |at: [f64; 3]| -> f64 {
            let one = |d: &Dipole| {
                let r = vector::sub(vector::to_f64(d.position), at);
                let square = vector::norm_squared(r) + f64::from(SMOOTH * SMOOTH);
                vector::dot(r, vector::to_f64(d.moment)) / square.powf(1.5)
            };
            ball.iter().map(one).sum()
        };
        let along = [0.6, 0.0, -0.8f32];
        for at in [
            [2.0, 3.0, 1.0],
            [1.0, 2.0, 11.9],
            [1.0, -7.0, 3.0],
            [14.0, 9.0, 1.0f32],
        ] {
            let step = vector::scale(vector::to_f64(along), 1e-4);
            let ends = [vector::sub, vector::add].map(|by| smooth(by(vector::to_f64(at), step)));
            let expected = (ends[0] - ends[1]) / 2e-4;
            let slope = tree.slope(at, along);
            assert!(
                (slope - expected).abs() < 0.01 * expected.abs() + 1e-3,
                "{slope} {expected}"
            );
        }
        // From 1 to 0 across the surface, half of it by the sample's own sheet.
        let at = ball[0].position;
        let outward = vector::scale(ball[0].moment, 4.0 * PI);
        assert!((tree.slope(at, outward) - 0.5).abs() < 0.1);
        assert!((tree.slope(at, outward.map(|x| -x)) + 0.5).abs() < 0.1);
    }
}
