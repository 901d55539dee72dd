//! The radius of every point's neighborhood.

mod given;

use super::candidates::Candidates;
use super::cell_index::CellIndex;
use super::cells::Search;
use super::census::Census;
use super::growth::Growth;
use super::lines;
use super::rule::{self, AUTO_NEIGHBORS, FEWEST_NEIGHBORS, FEWEST_POINTS};
use crate::parallel::{self, CHUNK};
use crate::{Real, vector};
pub(crate) use given::hold;
pub use given::{Radii, with_lines, with_radii};

/// Share of a neighborhood whose own must reach back to the sample, or the sample is isolated.
pub(super) const SMALLEST_MUTUAL_SHARE: f64 = 0.125;

/// How large a neighborhood is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Radius {
    /// 1.001 times the mean of the distance to the 24th sample over the middle half of the points, those with neither the
    /// smallest nor the largest distances. Where samples lie along lines, as those of scanners or of structured meshes, to that
    /// of a larger number, which reaches 1.3 times the distance of the lines. Independent of the order of the points; continuous
    /// in them unless 24 come to lie in one place, or the number changes. With it alone, normals are [refined](crate::refine).
    #[default]
    Auto,
    /// This length, in the unit of the points.
    Fixed(f64),
    /// This length, and weights of normals that end at it with a jump, as the paper's do. A normal then jumps where a
    /// sample enters or leaves its neighborhood.
    Cut(f64),
}

/// Why there are no neighborhoods.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// Too few points to bound a volume.
    #[error(
        "{points} points cannot bound a volume; give at least {FEWEST_POINTS}, and hundreds for a useful surface"
    )]
    TooFew {
        /// Number of points.
        points: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {index} is not finite; remove it or mend it")]
    NotFinite {
        /// Index of the first such point, from 0.
        index: usize,
    },
    /// The radius given is not a positive number.
    #[error(
        "a neighborhood radius of {radius} cannot be used; give a positive length in the unit of the points, or leave it automatic"
    )]
    Radius {
        /// The radius.
        radius: f64,
    },
    /// Every point is the same.
    #[error("all {points} points are equal; check that the right columns were read as coordinates")]
    AllEqual {
        /// Number of points.
        points: usize,
    },
    /// Squares of distances would overflow or vanish.
    #[error(
        "the cloud extends over {extent:e}, whose square {type_name} cannot hold; use a unit in which it is nearer to 1, or f64"
    )]
    Extent {
        /// Longest side of the cloud's box.
        extent: f64,
        /// The number type of the points.
        type_name: &'static str,
    },
}

/// The neighborhood of every point of a cloud, and the index that finds its members.
#[derive(Clone, Debug, Default)]
pub struct Neighborhoods<T> {
    /// The points, sorted into cells.
    pub index: CellIndex<T>,
    /// How the radius was chosen.
    pub rule: Radius,
    /// `R`: the radius of every point that has enough neighbors within it.
    pub common_radius: T,
    /// `(N,)` the radius `R_i` of each point, in input order; at least [`Self::common_radius`].
    pub radius: Vec<T>,
    /// `(N,)` number of samples within `R_i`, the point itself included, in input order.
    pub count: Vec<u32>,
    /// `(N,)` whether the sample is an outlier: its radius has grown so far that fewer than 1 in 8 of the
    /// samples within it have it within their own. Samples of a sparse part of a surface have each
    /// other; outliers have only samples that are closer to one another. A clump of outliers is not told
    /// from a sparse surface.
    pub isolated: Vec<bool>,
    /// `(N,)` `Σ_j (1 − r_j²/R_i²)²` over the neighborhood, in input order.
    pub(crate) crowd: Vec<T>,
    /// See [`Self::neighbors`].
    pub(super) lines: Option<usize>,
    /// The automatic radius, also where another is given.
    pub(super) automatic: T,
    /// See [`Self::spacing`].
    spacing: T,
    /// Squares of the distances to the last of [`Self::neighbors`], in sorted order.
    pub(super) reach: Vec<T>,
    /// The least and the largest of them that the automatic radius depends on.
    pub(super) middle: Option<[T; 2]>,
    /// In sorted order: scratch.
    sorted: Vec<Found<T, ()>>,
    /// Input index → sorted position.
    position: Vec<u32>,
}

/// Result of the search around one point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found<T, U> {
    radius: T,
    census: Census<T>,
    /// A sum over the samples, by the caller.
    pub(crate) sum: U,
}

impl<T: Real, U> Found<T, U> {
    /// The sum alone.
    pub(crate) fn only(sum: U) -> Self {
        Self {
            radius: T::zero(),
            census: Census::default(),
            sum,
        }
    }
}

impl<T: Real> Neighborhoods<T> {
    /// Bytes of what pullbacks need, and of work space.
    pub(crate) fn bytes(&self) -> [usize; 2] {
        let [tree, work] = self.index.bytes();
        let needed = size_of_val(self.radius.as_slice())
            + size_of_val(self.count.as_slice())
            + size_of_val(self.crowd.as_slice())
            + size_of_val(self.reach.as_slice())
            + size_of_val(self.isolated.as_slice())
            + size_of_val(self.position.as_slice());
        [tree + needed, work + size_of_val(self.sorted.as_slice())]
    }

    pub(crate) fn free_scratch(&mut self) {
        self.sorted = Vec::new();
        self.index.free_scratch();
    }

    /// Typical distance between neighboring samples, in the unit of the points: the side of the square
    /// that one sample has to itself on the surface, in the middle, `√(π/24)` of the automatic radius.
    pub fn spacing(&self) -> T {
        self.spacing
    }

    /// Number of samples that the automatic radius holds in the middle, the center included: 24, or more where samples lie along
    /// lines.
    pub fn neighbors(&self) -> usize {
        self.lines.unwrap_or(AUTO_NEIGHBORS)
    }

    /// The [number of neighbors](Self::neighbors) where samples lie along lines.
    pub fn lines(&self) -> Option<usize> {
        self.lines
    }

    /// Number of points whose radius has grown beyond the common one.
    pub fn grown(&self) -> usize {
        self.radius
            .iter()
            .filter(|&&r| r > self.common_radius)
            .count()
    }

    /// Writes counts and crowds in input order.
    fn spread_census<U: Sync>(&mut self, sorted: &[Found<T, U>]) {
        parallel::resize(&mut self.count, sorted.len(), 0);
        parallel::resize(&mut self.crowd, sorted.len(), T::zero());
        let chunks = self.count.chunks_mut(CHUNK);
        let chunks = chunks.zip(self.crowd.chunks_mut(CHUNK));
        let chunks = chunks.zip(self.position.chunks(CHUNK));
        parallel::each(chunks, |_, ((counts, crowds), positions)| {
            for ((count, crowd), &position) in counts.iter_mut().zip(crowds).zip(positions) {
                let census = &sorted[position as usize].census;
                (*count, *crowd) = (census.count, census.crowd);
            }
        });
    }

    /// Input index → sorted position in [`Self::index`].
    pub(crate) fn position(&self) -> &[u32] {
        &self.position
    }

    /// Fills `out`, which has a place for each point in sorted order, in parallel:
    /// `fill(i, point, R_i, candidates)`, where `i` is its input index and the candidates hold all of `N_i`, each with its
    /// `values`, arrays in sorted order.
    pub(crate) fn for_each_neighborhood<const M: usize, U: Send>(
        &self,
        values: [&[T]; M],
        out: &mut [U],
        fill: &(impl Fn(usize, [T; 3], T, &Candidates<T, M>) -> U + Sync),
    ) {
        let index = &self.index;
        index.for_each_cell(self.common_radius, values, out, &|cell, candidates, out| {
            let mut own = None;
            for (position, out) in cell.zip(out) {
                let i = index.order()[position] as usize;
                let (point, radius) = (index.point(position), self.radius[i]);
                *out = if radius <= self.common_radius {
                    fill(i, point, radius, candidates)
                } else {
                    let own = own.get_or_insert_with(Candidates::default);
                    index.candidates(point, Search { radius, values }, own);
                    fill(i, point, radius, own)
                };
            }
        });
    }
}

/// Finds the neighborhood of every one of the `(N, 3)` points, into `out` (whose memory is used again).
///
/// # Errors
/// Fewer than 4 points, a point that is not finite, all points equal, a radius that is not positive, or
/// an extent whose square the number type cannot hold.
pub fn forward<T: Real>(
    points: &[[T; 3]],
    radius: Radius,
    out: &mut Neighborhoods<T>,
) -> Result<(), Error> {
    given::find(points, radius, lines::neighbors, out)
}

/// Like [`forward`], and writes `sum(point, R_i, candidates)` of every neighborhood in sorted order; the candidates
/// include all of `N_i`. One walk serves both, because gathering the candidates takes longer than summing over them.
///
/// # Errors
/// As [`forward`].
pub(crate) fn forward_with<T: Real, U: Copy + Default + Send + Sync>(
    points: &[[T; 3]],
    radius: Radius,
    out: &mut Neighborhoods<T>,
    sorted: &mut Vec<Found<T, U>>,
    sum: &(impl Fn([T; 3], T, &Candidates<T>) -> U + Sync),
) -> Result<(), Error> {
    find_automatic(points, lines::neighbors, out)?;
    finish(radius, out, sorted, sum)
}

/// All that follows from the automatic radius.
fn finish<T: Real, U: Copy + Default + Send + Sync>(
    radius: Radius,
    out: &mut Neighborhoods<T>,
    sorted: &mut Vec<Found<T, U>>,
    sum: &(impl Fn([T; 3], T, &Candidates<T>) -> U + Sync),
) -> Result<(), Error> {
    out.spacing = rule::spacing(out.automatic, out.neighbors(), out.index.len());
    out.rule = radius;
    out.common_radius = rule::common(radius, out.automatic)?;
    grow(out, sorted, sum);
    find_isolated(out);
    Ok(())
}

fn check<T: Real>(points: &[[T; 3]]) -> Result<(), Error> {
    if points.len() < FEWEST_POINTS {
        return Err(Error::TooFew {
            points: points.len(),
        });
    }
    match points.iter().position(|&p| !vector::is_finite(p)) {
        Some(index) => Err(Error::NotFinite { index }),
        None => Ok(()),
    }
}

fn check_extent<T: Real>(index: &CellIndex<T>) -> Result<(), Error> {
    rule::check_extent(index.len(), index.bounds().into())
}

/// Index, [lines](Neighborhoods::lines), distances to the last neighbor, and automatic radius.
pub(super) fn find_automatic<T: Real>(
    points: &[[T; 3]],
    lines: impl FnOnce(&CellIndex<T>) -> Option<usize>,
    out: &mut Neighborhoods<T>,
) -> Result<(), Error> {
    check(points)?;
    out.index.rebuild(points);
    check_extent(&out.index)?;
    out.lines = lines(&out.index);
    out.automatic = automatic_radius(out);
    Ok(())
}

/// By the distances to the last neighbor, which stay in `out`.
fn automatic_radius<T: Real>(out: &mut Neighborhoods<T>) -> T {
    let neighbors = out.neighbors();
    let Neighborhoods {
        index,
        reach: squares,
        crowd: scratch,
        ..
    } = out;
    let n = index.len();
    parallel::resize(squares, n, T::zero());
    index.reaches_squared(neighbors, squares);
    let found = rule::middle_half(squares, scratch);
    out.middle = found.map(|(middle, _)| middle);
    rule::automatic(found.map(|(_, mean)| mean), n, out.index.bounds().into())
}

/// Writes radius, census and sum of every point: the common radius where it holds enough samples.
fn grow<T: Real, U: Copy + Default + Send + Sync>(
    out: &mut Neighborhoods<T>,
    sorted: &mut Vec<Found<T, U>>,
    sum: &(impl Fn([T; 3], T, &Candidates<T>) -> U + Sync),
) {
    let n = out.index.len();
    let (index, common, arch) = (&out.index, out.common_radius, pulp::Arch::new());
    let along_lines = out.along_lines();
    parallel::resize_large(sorted, n, Found::default());
    index.for_each_cell(common, [], sorted, &|cell, candidates, sorted| {
        let (mut nearest, mut wide) = (Vec::new(), Candidates::default());
        for (position, found) in cell.zip(sorted) {
            let point = index.point(position);
            let census = Census::of(arch, point, common, candidates);
            let is_enough = census.well_within as usize >= FEWEST_NEIGHBORS.min(n);
            let radius = match is_enough && along_lines.is_none() {
                true => common,
                false => Growth::of(index, position, along_lines, &mut nearest).radius,
            };
            *found = if radius <= common {
                Found {
                    radius: common,
                    census,
                    sum: sum(point, common, candidates),
                }
            } else {
                grown(index, point, radius, &mut wide, sum)
            };
        }
    });
    find_positions(out);
    let position = &out.position;
    parallel::fill(&mut out.radius, position.len(), |i| {
        sorted[position[i] as usize].radius
    });
    out.spread_census(sorted);
}

fn find_positions<T: Real>(out: &mut Neighborhoods<T>) {
    parallel::resize(&mut out.position, out.index.len(), 0);
    for (position, &i) in (0u32..).zip(out.index.order()) {
        out.position[i as usize] = position;
    }
}

/// Census and sum within a radius beyond the common one.
fn grown<T: Real, U>(
    index: &CellIndex<T>,
    point: [T; 3],
    radius: T,
    candidates: &mut Candidates<T>,
    sum: &impl Fn([T; 3], T, &Candidates<T>) -> U,
) -> Found<T, U> {
    let values = [];
    index.candidates(point, Search { radius, values }, candidates);
    Found {
        radius,
        census: Census::of(pulp::Arch::new(), point, radius, candidates),
        sum: sum(point, radius, candidates),
    }
}

/// Marks the samples that are not neighbors of their neighbors.
fn find_isolated<T: Real>(out: &mut Neighborhoods<T>) {
    let (index, position, radius) = (&out.index, &out.position, &out.radius);
    let common = out.common_radius;
    let isolated = |i: usize| {
        let grown = radius[i] > common;
        grown && mutual_share(index, radius, i, position[i] as usize) < SMALLEST_MUTUAL_SHARE
    };
    parallel::fill(&mut out.isolated, radius.len(), isolated);
}

/// Share of the neighbors of sample `i` that have `i` among theirs.
fn mutual_share<T: Real>(index: &CellIndex<T>, radius: &[T], i: usize, position: usize) -> f64 {
    let (mut all, mut mutual) = (0u32, 0u32);
    index.for_each_within(index.point(position), radius[i], |j, d2| {
        if j != i {
            all += 1;
            mutual += u32::from(d2 <= radius[j] * radius[j]);
        }
    });
    f64::from(mutual) / f64::from(all.max(1))
}
