//! The pullback of the fits to the vertices, and the records of it that the samples gather.

use cubecl::prelude::*;
use isograd::distance::extend::rule::{MARGIN, REACH};

use super::FIT;
use super::checks::Given;
use super::fits::{covariance, in_frame, ridge, solve};
use super::neighbor::{
    Fitted, Neighbor, SampleArrays, Sorted, contract, neighbor, sum_moments, write_bounded,
};
use crate::device::{argument, launch};
use crate::element::fit;
use crate::neighbors::{
    self, NeighborhoodArrays, Neighborhoods, end_of_leaf, first_of_leaf, next_leaf,
};
use crate::normals::fit as plane_of;
use crate::primitives::fill::own_zeros;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Numbers of an [`Adjoint`] in memory.
const ADJOINT: usize = 15;

/// The fits, as the samples see them.
pub(super) struct Adjoints<T> {
    /// The vertices, with `R_v` where `ū_v` is not zero, and else 0: no sample is that near.
    pub near: Neighborhoods<T>,
    /// `(V, 15)` in their order.
    pub records: Buffer<T>,
    /// `(V, 2, components)` `ū_v` and `u_v` in their order.
    pub bars: Buffer<T>,
    /// `(V,)` the sample whose distance a radius is a multiple of, and `R_v R̄_v`, where it has grown; else 0.
    pub last: Buffer<u32>,
    pub grown: Buffer<T>,
    /// `(V,)` `R R̄` of the least radius where it is that, else 0.
    pub least: Buffer<T>,
    /// `(V,)` how often something was bounded.
    pub guarded: Buffer<u32>,
}

/// [`Adjoints`] in kernels.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct AdjointArrays<F: Float + CubeElement> {
    pub records: Array<F>,
    pub bars: Array<F>,
    pub last: Array<u32>,
    pub grown: Array<F>,
    pub least: Array<F>,
    pub guarded: Array<u32>,
}

argument!(
    Adjoints<T> => AdjointArraysLaunch<T, R>:
    |of| of.records.arg(), of.bars.arg(), of.last.arg(), of.grown.arg(), of.least.arg(),
        of.guarded.arg()
);

/// Pulls `bars` `(V, components)` of the values at the vertices back to the vertices themselves: adds to
/// `vertices_bar` `(V, 3)`, and bounds that. There is at least one vertex; `radius` is the least.
pub(super) fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    sorted: &Sorted<T>,
    vertices: &Buffer<T>,
    given: &Given<'_, T>,
    radius: T,
    bars: &Buffer<T>,
    vertices_bar: &Buffer<T>,
) -> Result<Adjoints<T>, Error> {
    let (fits, values) = (&given.residual.fits, &given.extension.vertices);
    let count = vertices.len() / 3;
    let components = bars.len() / count;
    let radii = device.empty(count)?;
    launch!(device, count => mask_radii<T>(fits, bars, radii, components as u32));
    let near = neighbors::forward(device, vertices, &radii)?;
    let found = Adjoints {
        records: device.empty(ADJOINT * count)?,
        bars: device.empty(2 * bars.len())?,
        last: device.empty(count)?,
        grown: device.empty(count)?,
        least: device.empty(count)?,
        guarded: device.empty(count)?,
        near,
    };
    launch!(device, bars.len() => pair_values<T>(
        bars, values, found.near.places, found.bars, components as u32,
    ));
    launch!(device, count => pull_fits<T>(
        sorted, found.near, fits, found, vertices_bar, radius, T::of(REACH), T::of(MARGIN),
    ));
    Ok(found)
}

/// `R_v` where any component of `ū_v` is not zero, else 0.
#[cube(launch)]
fn mask_radii<F: Float>(fits: &Array<F>, bars: &Array<F>, radii: &mut Array<F>, components: u32) {
    if ABSOLUTE_POS < radii.len() {
        let mut radius = F::new(0.0);
        for c in 0..components as usize {
            if bars[ABSOLUTE_POS * components as usize + c] != F::new(0.0) {
                radius = fits[FIT * ABSOLUTE_POS];
            }
        }
        radii[ABSOLUTE_POS] = radius;
    }
}

/// `ū` and `u` of each vertex, in the order of the vertices' tree.
#[cube(launch)]
fn pair_values<F: Float>(
    bars: &Array<F>,
    values: &Array<F>,
    places: &Array<u32>,
    pairs: &mut Array<F>,
    components: u32,
) {
    if ABSOLUTE_POS < bars.len() {
        let components = components as usize;
        let (k, c) = (ABSOLUTE_POS / components, ABSOLUTE_POS % components);
        let from = places[k] as usize * components + c;
        pairs[2 * k * components + c] = bars[from];
        pairs[(2 * k + 1) * components + c] = values[from];
    }
}

/// The pullback of one fit; its letters are those of the head of the stage, in units of `R_v`.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Adjoint<F: Float> {
    /// `W`, `m` and `s`.
    pub weight: F,
    pub mean: Vector3<F>,
    pub tilt: Vector3<F>,
    /// `g`.
    pub slope: Vector3<F>,
    /// Factors of `m` and of `e_j` in the pullback of `ε`.
    pub of_mean: F,
    pub of_offset: F,
    /// `t_j + s·e_j`: 1 but for what rounding has left of `Σ_k p_k e_k`, so that `Σ_k p_k t_k = 1`.
    pub level: F,
    /// `ρ_j + g·e_j` is `ū·(v_j − u)` less this, so that `Σ_k p_k ρ_k = 0`.
    pub middle: F,
    /// `Σ_k p_k D_k`.
    pub mean_pull: F,
}

/// `R R̄ d/|d|²`, the cotangent of the sample whose distance the radius is a multiple of; `offset` is `d/R`, `unit` is `1/R`.
#[cube]
pub(super) fn share_of_last<F: Float>(offset: Vector3<F>, radius_bar: F, unit: F) -> Vector3<F> {
    let square = offset.dot(offset);
    let exists = square > F::new(0.0);
    let factor = radius_bar * unit / select(exists, square, F::new(1.0));
    offset.scale(factor)
}

/// The sample whose distance from the vertex at `y` times `reach` or `margin` is the radius.
#[cube]
fn last_within<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    y: Vector3<F>,
    of: Fitted<F>,
    reach: F,
    margin: F,
) -> u32 {
    let one = F::new(1.0);
    let mut last = 0u32.runtime();
    let mut least = F::new(1.0);
    let mut node = next_leaf::<F>(&samples.tree, y, of.radius, 0usize, false);
    while node < samples.tree.links.len() {
        let first = first_of_leaf(&samples.tree.links, node);
        for j in first..end_of_leaf(first, samples.areas.len()) {
            let d = Vector3::<F>::at(&samples.tree.points, j)
                .sub(y)
                .scale(of.unit);
            let length = F::sqrt(d.dot(d));
            let error = min(F::abs(reach * length - one), F::abs(margin * length - one));
            last = select(error < least, j as u32, last);
            least = min(error, least);
        }
        node = next_leaf::<F>(&samples.tree, y, of.radius, node + 1, false);
    }
    last
}

/// A sample as an adjoint sees it.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Seen<F: Float> {
    /// `d_j` and `e_j`.
    d: Vector3<F>,
    e: Vector3<F>,
    /// `p_j`, `t_j`, `ρ_j` and `D_j`.
    pub p: F,
    pub t: F,
    rho: F,
    pub pull: F,
}

#[cube]
impl<F: Float> Adjoint<F> {
    pub fn at(records: &Array<F>, k: usize) -> Self {
        let at = ADJOINT * k;
        Adjoint::<F> {
            weight: records[at],
            mean: Vector3::<F>::load(records, at + 1),
            tilt: Vector3::<F>::load(records, at + 4),
            slope: Vector3::<F>::load(records, at + 7),
            of_mean: records[at + 10],
            of_offset: records[at + 11],
            middle: records[at + 12],
            mean_pull: records[at + 13],
            level: records[at + 14],
        }
    }

    /// With `Σ_k p_k D_k`, which takes the rest of it to find.
    fn write(self, records: &mut Array<F>, k: usize, mean_pull: F) {
        let at = ADJOINT * k;
        records[at] = self.weight;
        self.mean.store(records, at + 1);
        self.tilt.store(records, at + 4);
        self.slope.store(records, at + 7);
        records[at + 10] = self.of_mean;
        records[at + 11] = self.of_offset;
        records[at + 12] = self.middle;
        records[at + 13] = mean_pull;
        records[at + 14] = self.level;
    }

    /// A neighbor with `ū·(v_j − u)`.
    pub fn see(self, n: Neighbor<F>, contracted: F) -> Seen<F> {
        let e = n.offset.sub(self.mean);
        let t = self.level - self.tilt.dot(e);
        let rho = contracted - self.middle - self.slope.dot(e);
        let (ee, me) = (e.dot(e), self.mean.dot(e));
        Seen::<F> {
            d: n.offset,
            e,
            p: n.weight / self.weight,
            t,
            rho,
            pull: fit::pull::<F>(rho, t, ee, me, self.of_offset, self.of_mean),
        }
    }

    /// The part of `d̄_j` through the fit.
    fn through_fit(self, s: Seen<F>) -> Vector3<F> {
        let (m, e) = (self.mean, s.e);
        let (a, b) = (self.of_mean, self.of_offset);
        let x = fit::ridge_bar::<F>(m.x, a, e.x, b);
        let y = fit::ridge_bar::<F>(m.y, a, e.y, b);
        let z = fit::ridge_bar::<F>(m.z, a, e.z, b);
        let bar = Vector3::<F> {
            x: fit::fit_bar::<F>(self.slope.x, s.t, self.tilt.x, s.rho, x),
            y: fit::fit_bar::<F>(self.slope.y, s.t, self.tilt.y, s.rho, y),
            z: fit::fit_bar::<F>(self.slope.z, s.t, self.tilt.z, s.rho, z),
        };
        bar.scale(s.p)
    }

    /// `w̄_j`.
    pub fn weight_bar(self, s: Seen<F>) -> F {
        (s.pull - self.mean_pull) / self.weight
    }

    /// `d̄_j`, times `R_v`.
    pub fn offset_bar(self, s: Seen<F>, rest: F, area: F) -> Vector3<F> {
        let radial = fit::radial::<F>(self.weight_bar(s), area, rest);
        self.through_fit(s).add(s.d.scale(radial))
    }
}

/// One unit takes one vertex, in the order of the vertices' tree: its adjoint, `−Σ_j d̄_j` for itself, and `R_v R̄_v`. The
/// radius is the least, or `reach` or `margin` times the distance to a sample.
#[cube(launch)]
fn pull_fits<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    near: &NeighborhoodArrays<F>,
    fits: &Array<F>,
    adjoints: &mut AdjointArrays<F>,
    vertices_bar: &mut Array<F>,
    least_radius: F,
    reach: F,
    margin: F,
) {
    let k = ABSOLUTE_POS;
    if k < near.radii.len() {
        let vertex = near.places[k] as usize;
        let through_surface = Vector3::<F>::at(vertices_bar, vertex);
        let mut sums = Array::<F>::new(3usize);
        through_surface.store(&mut sums, 0usize);
        let mut bounded = 0u32.runtime();
        adjoints.last[k] = 0u32;
        adjoints.grown[k] = F::new(0.0);
        adjoints.least[k] = F::new(0.0);
        if near.radii[k] > F::new(0.0) {
            let y = Vector3::<F>::at(&near.tree.points, k);
            let of = Fitted::<F>::at(fits, vertex);
            let moments = sum_moments::<F>(samples, y, of.radius);
            let axes = plane_of::<F>(&moments, 0usize, 1usize).eigen;
            let c = covariance::<F>(samples, y, of, axes);
            let ridge = ridge::<F>(c, of.mean);

            // Σ p, Σ p q, Σ p e, Σ p e q and Σ p s·e, with q = ū·(v − u).
            let mut found = own_zeros::<F>(9usize);
            let mut node = next_leaf::<F>(&samples.tree, y, of.radius, 0usize, false);
            while node < samples.tree.links.len() {
                let first = first_of_leaf(&samples.tree.links, node);
                for j in first..end_of_leaf(first, samples.areas.len()) {
                    let d = Vector3::<F>::at(&samples.tree.points, j).sub(y);
                    let n = neighbor::<F>(d, of.unit, samples.areas[j]);
                    if n.weight > F::new(0.0) {
                        let p = n.weight / of.weight;
                        let q = p * contract::<F>(&adjoints.bars, k, samples, j);
                        let offset = n.offset.sub(of.mean);
                        let e = in_frame::<F>(axes, offset);
                        found[8] += p * of.tilt.dot(offset);
                        found[0] += p;
                        found[1] += q;
                        e.scale(p).add_to(&mut found, 2usize);
                        e.scale(q).add_to(&mut found, 5usize);
                    }
                }
                node = next_leaf::<F>(&samples.tree, y, of.radius, node + 1, false);
            }
            let middle = found[1] / found[0];
            let drift = Vector3::<F>::load(&found, 2usize).scale(middle);
            let moment = Vector3::<F>::load(&found, 5usize).sub(drift);
            let slope = solve::<F>(ridge, axes, moment);
            let along = slope.dot(of.tilt);
            let rest = Vector3::<F>::load(&found, 2usize).scale(F::new(1.0) / found[0]);
            let level = (F::new(1.0) + found[8]) / found[0];
            let middle = middle - in_frame::<F>(axes, slope).dot(rest);
            let without_mean = Adjoint::<F> {
                weight: of.weight,
                mean: of.mean,
                tilt: of.tilt,
                slope,
                of_mean: fit::ridge_of_mean::<F>(ridge.tau, along),
                of_offset: fit::ridge_of_offset::<F>(ridge.tau, along),
                level,
                middle,
                mean_pull: F::new(0.0),
            };

            // Σ p D; Σ d̄ through the weights without that in w̄; and what that is multiplied by. Σ d̄·d of the same, with
            // that through the fit.
            let mut shares = own_zeros::<F>(9usize);
            let mut node = next_leaf::<F>(&samples.tree, y, of.radius, 0usize, false);
            while node < samples.tree.links.len() {
                let first = first_of_leaf(&samples.tree.links, node);
                for j in first..end_of_leaf(first, samples.areas.len()) {
                    let d = Vector3::<F>::at(&samples.tree.points, j).sub(y);
                    let n = neighbor::<F>(d, of.unit, samples.areas[j]);
                    if n.weight > F::new(0.0) {
                        let q = contract::<F>(&adjoints.bars, k, samples, j);
                        let seen = without_mean.see(n, q);
                        let radial =
                            fit::radial::<F>(F::new(1.0) / of.weight, samples.areas[j], n.rest);
                        shares[0] += seen.p * seen.pull;
                        n.offset
                            .scale(radial * seen.pull)
                            .add_to(&mut shares, 1usize);
                        n.offset.scale(radial).add_to(&mut shares, 4usize);
                        let square = n.offset.dot(n.offset);
                        shares[7] += radial * seen.pull * square
                            + without_mean.through_fit(seen).dot(n.offset);
                        shares[8] += radial * square;
                    }
                }
                node = next_leaf::<F>(&samples.tree, y, of.radius, node + 1, false);
            }
            without_mean.write(&mut adjoints.records, k, shares[0]);
            let of_mean = Vector3::<F>::load(&shares, 4usize).scale(shares[0]);
            let through_weights = Vector3::<F>::load(&shares, 1usize).sub(of_mean);
            // Σ p t = 1, Σ p ρ = 0 and Σ p e = 0: s may be so large that their rounding would count.
            let through_fit = of.mean.scale(without_mean.of_mean).sub(slope);
            let total = through_weights.add(through_fit);
            total.scale(-of.unit).add_to(&mut sums, 0usize);
            let radius_bar = shares[0] * shares[8] - shares[7];
            if of.radius > least_radius {
                let last = last_within::<F>(samples, y, of, reach, margin);
                adjoints.last[k] = last;
                adjoints.grown[k] = radius_bar;
                let d = Vector3::<F>::at(&samples.tree.points, last as usize).sub(y);
                let bar = share_of_last::<F>(d.scale(of.unit), radius_bar, of.unit);
                bar.scale(F::new(-1.0)).add_to(&mut sums, 0usize);
            } else {
                adjoints.least[k] = radius_bar;
            }
            bounded += select(ridge.coincide, 1u32, 0u32);
        }
        #[unroll]
        for axis in 0..3usize {
            bounded += write_bounded::<F>(vertices_bar, 3 * vertex + axis, sums[axis]);
        }
        adjoints.guarded[k] = bounded;
    }
}
