//! Stray samples, as those of a scan in mid-air: they lie apart from the surface and, where they are near to one another, fill
//! a volume.
//!
//! A sample lies apart if its 24th nearest is more than twice the automatic radius away. Where samples lie along lines, the number
//! is larger, as it is for that radius. A sample is off the surface if the nearest 10
//! fill a volume, or if it is among the 24 nearest of few of its own. Samples of a sparse part of a surface lie apart too, but most
//! of them in a plane, and each is near to its neighbors; and a sparse part goes on in a dense one. So whole groups are told, of
//! samples apart that are among each other's 24 nearest, directly or by way of others. A group is stray if
//!
//! - half of it is off the surface, or it is smaller than a neighborhood,
//! - samples that do not lie apart are few among its neighbors, and
//! - half of all samples that are at least half as far apart as it are off: parts of a sparse surface that are hardly thicker than
//!   its samples are apart fill a volume too, but then the rest of that surface does not.
//!
//! Strays in a sheet, and more than a tenth of the cloud, are not told from a surface.

use super::radius::{Error, Neighborhoods, SMALLEST_MUTUAL_SHARE, find_automatic};
use super::{lines, rule};
use crate::{Real, parallel, union_find, vector};

/// Samples, the nearest and itself, that show whether those around it fill a volume. More would also be of the other side of a
/// part that is three samples thick.
const CLOSE: usize = 10;
/// Quotients `λ₁/λ₂` and `λ₁/λ₃` of their covariance from which they do: below the first they lie in a plane, below the second on
/// a line. Three in four of uniform random points of a volume have larger ones.
const FILLED: [f64; 2] = [0.3, 0.1];
/// Share of the neighbors of a group that may be samples of the surface which have it among theirs.
const MOST_CONNECTED: f64 = 0.05;
/// Distance between samples, in that of a group, from which others are compared with it.
const AS_COARSE: f64 = 0.5;
/// Largest share of a cloud that is stray.
const MOST: f64 = 0.1;

/// A sample that lies apart.
#[derive(Clone, Default)]
pub(crate) struct Apart<T> {
    /// Its position in sorted order.
    position: u32,
    /// Its input index.
    pub(crate) index: u32,
    /// Whether it is off the surface.
    pub(crate) is_off: bool,
    /// Square of the distance to its 24th nearest.
    reach: T,
    /// Neighbors that do not lie apart, and have it among theirs.
    connected: u32,
    /// Positions of those that lie apart, and have it among theirs.
    mutual: Vec<u32>,
}

/// A group of samples apart, each among the nearest of others.
struct Group<T> {
    members: usize,
    off: usize,
    connected: u32,
    /// Median of the squares.
    reach: T,
}

/// [`Neighborhoods::strays`] of `(N, 3)` points whose neighborhoods are on another device.
///
/// # Errors
/// As [`forward`](super::forward).
pub fn strays<T: Real>(points: &[[T; 3]]) -> Result<Vec<u32>, Error> {
    let mut found = Neighborhoods::default();
    find_automatic(points, lines::neighbors, &mut found)?;
    Ok(found.strays())
}

impl<T: Real> Neighborhoods<T> {
    /// Whether there are samples that lie apart, as all strays do.
    pub fn has_apart(&self) -> bool {
        self.middle.is_some()
            && parallel::first(self.reach.len(), |position| self.is_apart(position)).is_some()
    }

    fn is_apart(&self, position: usize) -> bool {
        rule::is_apart(self.reach[position], self.automatic)
    }

    /// Indices of the samples that lie apart from the surface and from one another, ascending. Independent of the order, position
    /// and scale of the points. None with radii that were found elsewhere.
    pub fn strays(&self) -> Vec<u32> {
        let apart = self.apart();
        let group = groups(&apart);
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); apart.len()];
        for (k, &group) in group.iter().enumerate() {
            members[group as usize].push(k);
        }
        let off_beyond = OffBeyond::new(&apart);
        let mut strays = Vec::new();
        for members in members.iter().filter(|members| !members.is_empty()) {
            let group = Group::of(members, &apart);
            if group.is_stray(self.neighbors())
                && off_beyond.most_are(T::of(AS_COARSE * AS_COARSE) * group.reach)
            {
                strays.extend(members.iter().map(|&k| apart[k].index));
            }
        }
        if strays.len() as f64 > MOST * self.reach.len() as f64 {
            return Vec::new();
        }
        strays.sort_unstable();
        strays
    }

    /// The samples that lie apart, in sorted order.
    pub(crate) fn apart(&self) -> Vec<Apart<T>> {
        if self.middle.is_none() {
            return Vec::new();
        }
        parallel::flat_map(self.reach.len(), |position| {
            (self.is_apart(position)).then(|| self.look_round(position))
        })
    }

    /// Classifies a sample by its 24 nearest.
    fn look_round(&self, position: usize) -> Apart<T> {
        let mut nearest = Vec::with_capacity(self.neighbors());
        let center = self.index.point(position);
        (self.index).nearest_positions(center, self.neighbors(), &mut nearest);
        let mut apart = Apart {
            position: position as u32,
            index: self.index.order()[position],
            reach: self.reach[position],
            ..Apart::default()
        };
        for &(other, square) in &nearest {
            let at = other as usize;
            if at == position || square > self.reach[at] {
                continue;
            }
            match self.is_apart(at) {
                true => apart.mutual.push(other),
                false => apart.connected += 1,
            }
        }
        let mutual = f64::from(apart.connected) + apart.mutual.len() as f64;
        let offset = |&(other, _): &(u32, T)| {
            vector::to_f64(vector::sub(self.index.point(other as usize), center))
        };
        let close: Vec<[f64; 3]> = nearest.iter().take(CLOSE).map(offset).collect();
        apart.is_off =
            mutual < SMALLEST_MUTUAL_SHARE * (self.neighbors() - 1) as f64 || fill_a_volume(&close);
        apart
    }
}

impl<T: Real> Group<T> {
    fn of(members: &[usize], apart: &[Apart<T>]) -> Self {
        let mut reaches: Vec<T> = members.iter().map(|&k| apart[k].reach).collect();
        let middle = reaches.len() / 2;
        let order = |a: &T, b: &T| a.f64().total_cmp(&b.f64());
        Self {
            members: members.len(),
            off: members.iter().filter(|&&k| apart[k].is_off).count(),
            connected: members.iter().map(|&k| apart[k].connected).sum(),
            reach: *reaches.select_nth_unstable_by(middle, order).1,
        }
    }

    /// Where a neighborhood has so many samples.
    fn is_stray(&self, neighbors: usize) -> bool {
        let is_off = 2 * self.off >= self.members || self.members < neighbors;
        let others = ((neighbors - 1) * self.members) as f64;
        is_off && f64::from(self.connected) < MOST_CONNECTED * others
    }
}

/// How many of the samples are off the surface, of those that are farthest apart.
struct OffBeyond<T> {
    /// Squares of the distances to the 24th nearest, the largest first.
    reaches: Vec<T>,
    /// Number of samples off the surface up to each, itself included.
    off: Vec<usize>,
}

impl<T: Real> OffBeyond<T> {
    fn new(apart: &[Apart<T>]) -> Self {
        let mut sorted: Vec<(T, bool)> = apart.iter().map(|a| (a.reach, a.is_off)).collect();
        sorted.sort_unstable_by(|a, b| b.0.f64().total_cmp(&a.0.f64()));
        let mut count = 0;
        let off = sorted.iter().map(|&(_, is_off)| {
            count += usize::from(is_off);
            count
        });
        Self {
            off: off.collect(),
            reaches: sorted.into_iter().map(|(reach, _)| reach).collect(),
        }
    }

    /// Whether half of the samples with such squares or larger ones are off.
    fn most_are(&self, least: T) -> bool {
        match self.reaches.partition_point(|&reach| reach >= least) {
            0 => false,
            samples => 2 * self.off[samples - 1] >= samples,
        }
    }
}

/// The group of each sample: the number of one of its members.
fn groups<T: Sync>(apart: &[Apart<T>]) -> Vec<u32> {
    let mut group = Vec::new();
    union_find::find(&mut group, apart.len(), |k| {
        apart[k].mutual.iter().filter_map(|position| {
            let found = apart.binary_search_by_key(position, |other| other.position);
            found.ok().map(|other| other as u32)
        })
    });
    group
}

/// Whether places, given by their offsets from one of them, fill a volume rather than lie in a plane or on a line.
fn fill_a_volume(offsets: &[[f64; 3]]) -> bool {
    let per_sample = 1.0 / offsets.len() as f64;
    let sum = offsets.iter().fold([0.0; 3], |sum, &d| vector::add(sum, d));
    let mean = vector::scale(sum, per_sample);
    let from_mean = offsets.iter().map(|&offset| vector::sub(offset, mean));
    let [first, second, third]: [f64; 3] = lines::principal(from_mean).values.into();
    first > FILLED[0] * second && first > FILLED[1] * third
}
