//! A quadric fitted to the samples around one of them, and its pullback, in the notation of `isograd::refine`. All lengths
//! are in units of the radius of the neighborhood.

#[cfg(cube)]
use cubecl::prelude::*;

use super::eigen::perpendicular;
use super::fit::{factors, solved};
use super::vector3::Vector3;
use super::{Element, plane, select};

/// One number for each of `u = (1, x, y)` and `v = (x², xy, y²)`.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug)]
pub struct Pair<F: Element> {
    /// The numbers of `u`.
    pub u: Vector3<F>,
    /// The numbers of `v`.
    pub v: Vector3<F>,
}

#[cfg_attr(cube, cube)]
impl<F: Element> Pair<F> {
    /// `(u, v) · self` for a place `(x, y)`.
    #[inline(always)]
    pub fn at(self, x: F, y: F) -> F {
        self.u.x + (self.u.y + self.v.x * x + self.v.y * y) * x + (self.u.z + self.v.z * y) * y
    }
}

/// Sums over a neighborhood, with the weight `w` and the height `z` of each sample.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug)]
pub struct Sums<F: Element> {
    /// `Σ w u`.
    pub first: Vector3<F>,
    /// `Σ w v`.
    pub second: Vector3<F>,
    /// `Σ w x v`.
    pub by_x: Vector3<F>,
    /// `Σ w y v`.
    pub by_y: Vector3<F>,
    /// `Σ w x² v`.
    pub by_xx: Vector3<F>,
    /// `Σ w x y v`.
    pub by_xy: Vector3<F>,
    /// `Σ w y² v`.
    pub by_yy: Vector3<F>,
    /// `Σ w z (u, v)`.
    pub heights: Pair<F>,
    /// `Σ w z²`.
    pub squares: F,
}

/// Number of sums.
pub const SUMS: usize = 28;

/// The terms of one sample.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn terms<F: Element>(x: F, y: F, z: F, w: F) -> Sums<F> {
    let u = Vector3::<F>::of(w, w * x, w * y);
    let v = Vector3::<F>::of(u.y * x, u.y * y, u.z * y);
    Sums::<F> {
        first: u,
        second: v,
        by_x: v.scale(x),
        by_y: v.scale(y),
        by_xx: v.scale(x * x),
        by_xy: v.scale(x * y),
        by_yy: v.scale(y * y),
        heights: Pair::<F> {
            u: u.scale(z),
            v: v.scale(z),
        },
        squares: w * z * z,
    }
}

/// Weight of a sample at an offset of length `r` whose normal is at the cosine `agreement` to that of the center.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn weight<F: Element>(r: F, agreement: F, epsilon: F, steepness: F) -> F {
    plane::weight::<F>(r, epsilon, steepness) * not_negative::<F>(agreement)
}

/// `ρ`: ridge of the slopes and curvatures, as a share of the weight.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn ridge<F: Element>() -> F {
    F::new(3.0) / F::new(10_000.0)
}

/// Mean square of the heights, below which a neighborhood is as good as plane.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn flat<F: Element>() -> F {
    F::new(1.0) / F::new(100_000.0)
}

/// `(Σ w (u, v)(u, v)ᵀ + W ρ D)⁻¹ right`, with the penalty `pᵀ D p`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn solve<F: Element>(sums: Sums<F>, right: Pair<F>) -> Pair<F> {
    let weight = sums.first.x;
    let ridge = weight * ridge::<F>();
    let first = factors::<F>(
        weight,
        sums.second.x + ridge,
        sums.second.z + ridge,
        sums.second.y,
        sums.first.z,
        sums.first.y,
    );
    let b0 = Vector3::<F>::of(sums.second.x, sums.by_x.x, sums.by_y.x);
    let b1 = Vector3::<F>::of(sums.second.y, sums.by_x.y, sums.by_y.y);
    let b2 = Vector3::<F>::of(sums.second.z, sums.by_x.z, sums.by_y.z);
    let c0 = solved::<F>(first, b0);
    let c1 = solved::<F>(first, b1);
    let c2 = solved::<F>(first, b2);
    let rest = factors::<F>(
        sums.by_xx.x + ridge - b0.dot(c0),
        sums.by_xy.y + ridge / F::new(2.0) - b1.dot(c1),
        sums.by_yy.z + ridge - b2.dot(c2),
        sums.by_xy.z - b1.dot(c2),
        sums.by_xx.z - b0.dot(c2),
        sums.by_xx.y - b0.dot(c1),
    );
    let of_rest = Vector3::<F>::of(c0.dot(right.u), c1.dot(right.u), c2.dot(right.u));
    let v = solved::<F>(rest, right.v.sub(of_rest));
    let u = solved::<F>(first, right.u)
        .sub(c0.scale(v.x))
        .sub(c1.scale(v.y))
        .sub(c2.scale(v.z));
    Pair::<F> { u, v }
}

/// `aᵀ D b`: product of slopes and curvatures, the same whichever way the tangents are turned.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn penalty<F: Element>(a: Pair<F>, b: Pair<F>) -> F {
    let slopes = a.u.y * b.u.y + a.u.z * b.u.z;
    slopes + a.v.x * b.v.x + a.v.y * b.v.y / F::new(2.0) + a.v.z * b.v.z
}

/// The quadric of a neighborhood.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug)]
pub struct Fit<F: Element> {
    /// `p`: its coefficients.
    pub p: Pair<F>,
    /// `W`.
    pub weight: F,
    /// `z̄`: mean height.
    pub mean: F,
    /// `S₂`: mean square of the heights over the quadric, the ridge included.
    pub of_quadric: F,
    /// `ρ |D p|²`: part of it that is the ridge.
    pub of_ridge: F,
    /// `S₀`: variance of the heights.
    pub of_plane: F,
    /// `(S₂ + f)/(S₀ + f)`.
    pub quotient: F,
    /// `σ`: share of its slope that is taken.
    pub share: F,
}

/// The quadric of a neighborhood with these sums. `gain` is the quotient of the mean squares up to which all of its slope is
/// taken, and that from which nothing is.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn fit<F: Element>(sums: Sums<F>, gain_from: F, gain_to: F) -> Fit<F> {
    let p = solve::<F>(sums, sums.heights);
    let weight = sums.first.x;
    let mean = sums.heights.u.x / weight;
    let square = sums.squares / weight;
    let of_fit = (p.u.dot(sums.heights.u) + p.v.dot(sums.heights.v)) / weight;
    let of_quadric = not_negative::<F>(square - of_fit);
    let of_plane = not_negative::<F>(square - mean * mean);
    let quotient = (of_quadric + flat::<F>()) / (of_plane + flat::<F>());
    Fit::<F> {
        p,
        weight,
        mean,
        of_quadric,
        of_ridge: ridge::<F>() * penalty::<F>(p, p),
        of_plane,
        quotient,
        share: plane::falling::<F>(quotient, gain_from, gain_to),
    }
}

#[cfg_attr(cube, cube)]
#[inline(always)]
fn not_negative<F: Element>(x: F) -> F {
    select(x > F::new(0.0), x, F::new(0.0))
}

/// `n − σ (p_x t + p_y b)`, the refined normal before it is normalized.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn refined<F: Element>(n: Vector3<F>, t: Vector3<F>, fit: Fit<F>) -> Vector3<F> {
    let b = n.cross(t);
    n.sub(t.scale(fit.share * fit.p.u.y))
        .sub(b.scale(fit.share * fit.p.u.z))
}

/// A sample as the center of its neighborhood, for the pullback.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug)]
pub struct Center<F: Element> {
    /// Its normal before refinement.
    pub n: Vector3<F>,
    /// The first of the tangents; the other is `b = n × t`.
    pub t: Vector3<F>,
    /// `p`.
    pub p: Pair<F>,
    /// `λ`: the cotangents of `p`, multiplied by the inverse matrix.
    pub lambda: Pair<F>,
    /// `z̄`.
    pub mean: F,
    /// `S̄₂/W`.
    pub of_quadric: F,
    /// `S̄₀/W`.
    pub of_plane: F,
    /// `κ`: what every weight has in common in its cotangent.
    pub common: F,
}

/// Numbers of a [`Center`].
pub const CENTER: usize = 22;

/// A center, and the cotangent of its normal that does not come through its neighbors.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug)]
pub struct Pulled<F: Element> {
    /// The center.
    pub center: Center<F>,
    /// Its cotangent.
    pub normal_bar: Vector3<F>,
}

/// From the cotangent of a refined, normalized normal.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn pull<F: Element>(
    n: Vector3<F>,
    sums: Sums<F>,
    bar: Vector3<F>,
    gain_from: F,
    gain_to: F,
) -> Pulled<F> {
    let t = perpendicular::<F>(n);
    let b = n.cross(t);
    let fit = fit::<F>(sums, gain_from, gain_to);
    let long = refined::<F>(n, t, fit);
    let inverse = F::new(1.0) / F::sqrt(long.dot(long));
    let unit = long.scale(inverse);
    let bar = bar.sub(unit.scale(unit.dot(bar))).scale(inverse);
    let x = t.dot(bar);
    let y = b.dot(bar);
    let zero = F::new(0.0);
    let right = Pair::<F> {
        u: Vector3::<F>::of(zero, -fit.share * x, -fit.share * y),
        v: Vector3::<F>::of(zero, zero, zero),
    };
    let lambda = solve::<F>(sums, right);
    let is_between = fit.quotient > gain_from && fit.quotient < gain_to;
    let share_bar = -(fit.p.u.y * x + fit.p.u.z * y);
    let quotient_bar = select(is_between, -share_bar / (gain_to - gain_from), F::new(0.0));
    let of_quadric = quotient_bar / (fit.weight * (fit.of_plane + flat::<F>()));
    let of_plane = -of_quadric * fit.quotient;
    let ridge = ridge::<F>() * penalty::<F>(lambda, fit.p);
    let slopes = t
        .scale(fit.p.u.y)
        .add(b.scale(fit.p.u.z))
        .scale(fit.share * n.dot(bar));
    Pulled::<F> {
        center: Center::<F> {
            n,
            t,
            p: fit.p,
            lambda,
            mean: fit.mean,
            of_quadric,
            of_plane,
            common: ridge + of_quadric * (fit.of_quadric - fit.of_ridge) + of_plane * fit.of_plane,
        },
        normal_bar: bar.add(slopes),
    }
}

/// Cotangents through one neighbor of a center.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug)]
pub struct PairBar<F: Element> {
    /// Of its offset.
    pub offset: Vector3<F>,
    /// Of the normal of the center.
    pub center: Vector3<F>,
    /// Of the normal of the neighbor.
    pub neighbor: Vector3<F>,
}

#[cfg_attr(cube, cube)]
impl<F: Element> Center<F> {
    /// Through a neighbor at the offset `d` with the `normal`.
    #[inline(always)]
    pub fn pair_bar(
        self,
        d: Vector3<F>,
        normal: Vector3<F>,
        epsilon: F,
        steepness: F,
    ) -> PairBar<F> {
        let b = self.n.cross(self.t);
        let x = d.dot(self.t);
        let y = d.dot(b);
        let z = d.dot(self.n);
        let r = F::sqrt(d.dot(d));
        let agreement = self.n.dot(normal);
        let w = weight::<F>(r, agreement, epsilon, steepness);
        let above = z - self.p.at(x, y);
        let lambda = self.lambda.at(x, y);
        let two = F::new(2.0);
        let from_mean = z - self.mean;
        let of_fit = lambda + two * self.of_quadric * above;
        let z_bar = w * (of_fit + two * self.of_plane * from_mean);
        let u_bar = (self.lambda.u.scale(above).sub(self.p.u.scale(of_fit))).scale(w);
        let v_bar = (self.lambda.v.scale(above).sub(self.p.v.scale(of_fit))).scale(w);
        let x_bar = u_bar.y + two * x * v_bar.x + y * v_bar.y;
        let y_bar = u_bar.z + x * v_bar.y + two * y * v_bar.z;
        let w_bar = above * (lambda + self.of_quadric * above)
            + self.of_plane * from_mean * from_mean
            - self.common;
        let fall = plane::weight_fall::<F>(r, epsilon, steepness);
        let of_distance = w_bar * not_negative::<F>(agreement) * fall;
        let radial = select(r > F::new(0.0), of_distance / r, F::new(0.0));
        let of_agreement = w_bar * plane::weight::<F>(r, epsilon, steepness);
        let agreement_bar = select(agreement > F::new(0.0), of_agreement, F::new(0.0));
        let aside = self.t.scale(x_bar).add(b.scale(y_bar));
        let tilt = self
            .t
            .scale(x)
            .add(b.scale(y))
            .scale(z_bar)
            .sub(aside.scale(z));
        PairBar::<F> {
            offset: aside.add(self.n.scale(z_bar)).sub(d.scale(radial)),
            center: tilt.add(normal.scale(agreement_bar)),
            neighbor: self.n.scale(agreement_bar),
        }
    }
}

#[cfg(not(cube))]
impl<F: Element> Sums<F> {
    /// The sums, one after the other.
    #[inline(always)]
    pub fn to_array(self) -> [F; SUMS] {
        let [a, b, c, d, e, f, g, h, i] = [
            self.first,
            self.second,
            self.by_x,
            self.by_y,
            self.by_xx,
            self.by_xy,
            self.by_yy,
            self.heights.u,
            self.heights.v,
        ];
        [
            a.x,
            a.y,
            a.z,
            b.x,
            b.y,
            b.z,
            c.x,
            c.y,
            c.z,
            d.x,
            d.y,
            d.z,
            e.x,
            e.y,
            e.z,
            f.x,
            f.y,
            f.z,
            g.x,
            g.y,
            g.z,
            h.x,
            h.y,
            h.z,
            i.x,
            i.y,
            i.z,
            self.squares,
        ]
    }

    /// The sums of [`to_array`](Self::to_array).
    pub fn from_array(numbers: [F; SUMS]) -> Self {
        let at = |k: usize| Vector3::of(numbers[k], numbers[k + 1], numbers[k + 2]);
        Self {
            first: at(0),
            second: at(3),
            by_x: at(6),
            by_y: at(9),
            by_xx: at(12),
            by_xy: at(15),
            by_yy: at(18),
            heights: Pair {
                u: at(21),
                v: at(24),
            },
            squares: numbers[27],
        }
    }
}

#[cfg(not(cube))]
impl<F: Element> Center<F> {
    /// Its numbers, one after the other; the normal is first.
    pub fn to_array(self) -> [F; CENTER] {
        let [n, t, a, b, c, d] = [
            self.n,
            self.t,
            self.p.u,
            self.p.v,
            self.lambda.u,
            self.lambda.v,
        ];
        let [e, f, g, h] = [self.mean, self.of_quadric, self.of_plane, self.common];
        [
            n.x, n.y, n.z, t.x, t.y, t.z, a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, d.x, d.y,
            d.z, e, f, g, h,
        ]
    }

    /// The center of [`to_array`](Self::to_array).
    #[inline(always)]
    pub fn from_array(numbers: &[F; CENTER]) -> Self {
        let [
            nx,
            ny,
            nz,
            tx,
            ty,
            tz,
            ax,
            ay,
            az,
            bx,
            by,
            bz,
            cx,
            cy,
            cz,
            dx,
            dy,
            dz,
            mean,
            of_quadric,
            of_plane,
            common,
        ] = *numbers;
        Self {
            n: Vector3::of(nx, ny, nz),
            t: Vector3::of(tx, ty, tz),
            p: Pair {
                u: Vector3::of(ax, ay, az),
                v: Vector3::of(bx, by, bz),
            },
            lambda: Pair {
                u: Vector3::of(cx, cy, cz),
                v: Vector3::of(dx, dy, dz),
            },
            mean,
            of_quadric,
            of_plane,
            common,
        }
    }
}
