//! Weight of a sample and shift of the surface there, from the thickness of the body. See
//! [`isograd::isosurface::local_level::Step`].

use cubecl::prelude::*;
use isograd::isosurface::local_level::{LEAST_THICKNESS, Step};

use crate::Scalar;
use crate::device::Ready;
use crate::element::plate;

/// The step of `χ` through the surface of a thick body.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
pub(super) struct Usual<F: Float + CubeElement> {
    /// `U` and `w`.
    pub slope: F,
    pub width: F,
    /// Thicknesses between which `ω` goes from 0 to 1.
    pub low: F,
    pub high: F,
    /// The depth at the faces of a plate of the least thickness.
    pub least_depth: F,
    /// The greatest share of the slope at which a body counts as thin.
    pub steepest: F,
    /// `ln 2`.
    pub doubling: F,
}

/// A step as an argument of a kernel.
pub(super) fn arg<R: Runtime, T: Scalar>(step: &Step, steepest: f64) -> Ready<UsualLaunch<T, R>> {
    let [low, high] = step.range();
    Ready::new(UsualLaunch::new(
        T::of(step.usual),
        T::of(step.width),
        T::of(low),
        T::of(high),
        T::of(step.depth(LEAST_THICKNESS)),
        T::of(steepest),
        T::of(std::f64::consts::LN_2),
    ))
}

/// Thickness of the body at a sample, from the slope of `χ`.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Plate<F: Float> {
    /// `q`: the slope over that of a thick body.
    pub share: F,
    /// `t`, in cells.
    pub thickness: F,
    /// `exp(−t²/8w²)`.
    pub depth: F,
    /// From 0 to 1 as `ω` does.
    pub followed: F,
}

/// The plate on whose faces `χ` has the slope `slope`: `q = 1 − exp(−t²/2w²)`. What is not a number counts as flat.
#[cube]
pub(super) fn plate_of<F: Float + CubeElement>(slope: F, usual: &Usual<F>) -> Plate<F> {
    let zero = F::new(0.0);
    let mut share = zero;
    if slope > zero && usual.slope > zero {
        share = min(slope / usual.slope, usual.steepest);
    }
    let ends = ln_of_rest::<F>(share, usual.doubling);
    let thickness = usual.width * F::sqrt(F::new(-2.0) * ends);
    Plate::<F> {
        share,
        thickness,
        depth: F::sqrt(F::sqrt(F::new(1.0) - share)),
        followed: plate::followed::<F>(thickness, usual.low, usual.high),
    }
}

/// `ln(1 − q)` for `q` from 0 to 0.999, to rounding, also where `q` is small: by hand, as devices have no logarithm in
/// double precision.
#[cube]
fn ln_of_rest<F: Float>(q: F, doubling: F) -> F {
    let one = F::new(1.0);
    let mut z = -q / (F::new(2.0) - q);
    let mut doublings = F::new(0.0);
    if q > F::new(0.25) {
        let mut rest = one - q;
        while rest < F::new(0.75) {
            rest += rest;
            doublings += one;
        }
        z = (rest - one) / (rest + one);
    }
    // 2 artanh z: |z| is at most 0.2.
    let square = z * z;
    let mut sum = F::new(0.0);
    let mut odd = F::new(25.0);
    while odd > F::new(0.0) {
        sum = sum * square + one / odd;
        odd -= F::new(2.0);
    }
    F::new(2.0) * z * sum - doublings * doubling
}

/// `δ`: how much more `χ` is at the faces of a plate of the least thickness than at those of this one.
#[cube]
pub(super) fn shift<F: Float + CubeElement>(of: Plate<F>, usual: &Usual<F>) -> F {
    usual.slope * of.thickness * plate::rise::<F>(of.depth, usual.least_depth)
}

/// Cotangents of the inputs of a plate.
#[derive(CubeType, Clone, Copy)]
pub(super) struct PlateBar<F: Float> {
    /// Of the slope at the sample.
    pub slope: F,
    /// Of `U`.
    pub usual: F,
    /// Of `w`.
    pub width: F,
}

/// For cotangents of `ω` and `δ`.
#[cube]
pub(super) fn pull_plate<F: Float + CubeElement>(
    of: Plate<F>,
    usual: &Usual<F>,
    trust_bar: F,
    shift_bar: F,
    #[comptime] thin: bool,
) -> PlateBar<F> {
    let zero = F::new(0.0);
    let mut bar = PlateBar::<F> {
        slope: zero,
        usual: zero,
        width: zero,
    };
    if of.share > zero && of.share < usual.steepest {
        let (t, w) = (of.thickness, usual.width);
        let mut thickness_bar =
            plate::trust_pullback::<F>(trust_bar, of.followed, usual.low, usual.high);
        if comptime!(thin) {
            let rise = plate::rise::<F>(of.depth, usual.least_depth);
            if rise > zero {
                let growth = plate::growth::<F>(t, w, of.depth);
                // LEAST_THICKNESS is 1.
                let least = plate::growth::<F>(F::new(1.0), w, usual.least_depth);
                thickness_bar += shift_bar * usual.slope * (rise - growth);
                bar.usual += shift_bar * t * rise;
                bar.width += shift_bar * usual.slope * t * (growth - least) / w;
            }
        }
        bar.width += thickness_bar * t / w;
        let share_bar = plate::share_pullback::<F>(thickness_bar, t, w, of.share);
        bar.slope = share_bar / usual.slope;
        bar.usual -= share_bar * of.share / usual.slope;
    }
    bar
}
