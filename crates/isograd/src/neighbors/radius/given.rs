//! Neighborhoods of which something was found elsewhere.

use super::{
    Census, Error, Found, Neighborhoods, Radius, check, check_extent, find_automatic,
    find_isolated, find_positions, finish,
};
use crate::Real;
use crate::neighbors::CellIndex;

/// Radii that were found elsewhere, in the unit of the points.
#[derive(Clone, Copy, Debug)]
pub struct Radii<'a, T> {
    /// `(N,)` the radius of each point; at least [`Self::common`].
    pub each: &'a [T],
    /// The radius of every point that has enough neighbors within it.
    pub common: T,
    /// See [`Neighborhoods::spacing`].
    pub spacing: T,
}

/// The neighborhoods of moved points, with as many neighbors in the automatic radius as in `held` and the samples isolated
/// that were isolated there: what pullbacks hold constant.
///
/// # Errors
/// As [`forward`](super::forward), and [`Error::TooFew`] where there are fewer points than before.
pub(crate) fn hold<T: Real>(
    points: &[[T; 3]],
    held: &Neighborhoods<T>,
    out: &mut Neighborhoods<T>,
) -> Result<(), Error> {
    if points.len() < held.radius.len() {
        return Err(Error::TooFew {
            points: points.len(),
        });
    }
    with_lines(points, held.rule, held.lines, out)?;
    out.isolated.clone_from(&held.isolated);
    Ok(())
}

/// [`forward`](super::forward) of points of which it is known [whether they lie along lines](Neighborhoods::lines).
///
/// # Errors
/// As [`forward`](super::forward).
pub fn with_lines<T: Real>(
    points: &[[T; 3]],
    radius: Radius,
    lines: Option<usize>,
    out: &mut Neighborhoods<T>,
) -> Result<(), Error> {
    find(points, radius, |_| lines, out)
}

/// [`forward`](super::forward) with the [lines](Neighborhoods::lines) that `lines` finds.
pub(super) fn find<T: Real>(
    points: &[[T; 3]],
    radius: Radius,
    lines: impl FnOnce(&CellIndex<T>) -> Option<usize>,
    out: &mut Neighborhoods<T>,
) -> Result<(), Error> {
    find_automatic(points, lines, out)?;
    let mut sorted = std::mem::take(&mut out.sorted);
    let done = finish(radius, out, &mut sorted, &|_, _, _| ());
    out.sorted = sorted;
    done
}

/// The neighborhoods of `(N, 3)` points with radii that were found elsewhere.
///
/// # Errors
/// As [`forward`](super::forward), and [`Error::TooFew`] where there are not as many points as radii.
pub fn with_radii<T: Real>(
    points: &[[T; 3]],
    radii: Radii<'_, T>,
    out: &mut Neighborhoods<T>,
) -> Result<(), Error> {
    count_within(points, radii, out)?;
    find_isolated(out);
    Ok(())
}

fn count_within<T: Real>(
    points: &[[T; 3]],
    radii: Radii<'_, T>,
    out: &mut Neighborhoods<T>,
) -> Result<(), Error> {
    check(points)?;
    if points.len() != radii.each.len() {
        return Err(Error::TooFew {
            points: points.len(),
        });
    }
    out.index.rebuild(points);
    check_extent(&out.index)?;
    out.common_radius = radii.common;
    out.spacing = radii.spacing;
    out.lines = None;
    out.middle = None;
    out.radius.clear();
    out.radius.extend_from_slice(radii.each);
    find_positions(out);
    let mut sorted = std::mem::take(&mut out.sorted);
    sorted.resize(points.len(), Found::default());
    let arch = pulp::Arch::new();
    out.for_each_neighborhood([], &mut sorted, &|_, point, radius, candidates| Found {
        radius,
        census: Census::of(arch, point, radius, candidates),
        sum: (),
    });
    out.spread_census(&sorted);
    out.sorted = sorted;
    Ok(())
}
