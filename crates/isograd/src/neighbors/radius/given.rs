//! Neighborhoods with radii that were found elsewhere.

use super::{
    Census, Error, Found, Neighborhoods, check, check_extent, find_isolated, find_positions,
};
use crate::Real;

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
    out.middle = None;
    out.radius.clear();
    out.radius.extend_from_slice(radii.each);
    find_positions(out);
    let mut sorted = std::mem::take(&mut out.sorted);
    sorted.resize(points.len(), Found::default());
    let arch = pulp::Arch::new();
    out.for_each_neighborhood(&mut sorted, &|_, point, radius, candidates| Found {
        radius,
        census: Census::of(arch, point, radius, candidates),
        sum: (),
    });
    out.spread_census(&sorted);
    out.sorted = sorted;
    Ok(())
}
