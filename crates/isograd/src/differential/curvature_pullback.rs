//! The pullback of the mean curvature.

use pulp::Arch;

use super::columns::{Column, Strided, add_across, add_along, same};
use super::curvature::{Buffers, smooth};
use super::mean_curvature as element;
use super::pullback::{PullbackScratch, add_finite, check_cells};
use super::rows::{self, Order, Rows};
use super::{Error, Options};
use crate::data::Field;
use crate::{Real, parallel, vector};

/// Adds the cotangent of `φ` for that of its [`mean_curvature`](super::mean_curvature) with the same options:
/// `bar` and `phi_bar` are `(cells,)`, in memory order. Smoothing and the one-sided differences at the walls are
/// transposed exactly. The cell size is held constant. Returns how many cells are guarded: where the gradient
/// is 0 or the curvature is at its bound, a cotangent that is not 0 is left out.
///
/// # Errors
/// [`Error::Mismatch`]; nothing is then written.
pub fn mean_curvature_pullback<T: Real>(
    phi: &Field<T>,
    options: &Options,
    bar: &[T],
    scratch: &mut PullbackScratch<T>,
    phi_bar: &mut [T],
) -> Result<usize, Error> {
    check_cells(phi, "the cotangent of the curvature", bar.len())?;
    check_cells(phi, "the cotangent of the field", phi_bar.len())?;
    let (passes, shape) = (options.smoothing, phi.grid().shape());
    let PullbackScratch {
        smoothing,
        once,
        twice,
        rest,
        ..
    } = scratch;
    let rows = if passes == 0 {
        Rows::of(phi)
    } else {
        smooth(phi, passes, smoothing);
        Rows::new(&smoothing.smooth, phi)
    };
    let per_length = phi.grid().spacing().recip();
    let guarded = within_planes(&rows, per_length, bar, [once, twice, rest]);
    across_planes(shape, once, twice, rest);
    for axis in (0..passes).flat_map(|_| (0..3).rev()) {
        smoothing.other.resize(rest.len(), T::zero());
        sweep_back(rest, &mut smoothing.other, shape, axis);
        std::mem::swap(rest, &mut smoothing.other);
    }
    let row = shape[2];
    let rows = phi_bar.chunks_exact_mut(row).zip(rest.chunks_exact(row));
    let out_of_range = parallel::map_each(rows, |_, (out, rest)| add_finite(rest, per_length, out));
    Ok(guarded + out_of_range.into_iter().sum::<usize>())
}

/// Cotangents of the gradient and of the Hessian `[xx, yy, zz, xy, xz, yz]` for that of
/// [`curvature`](super::curvature::curvature); none where that has no derivative and `bar` is not 0.
#[inline(always)]
fn pull<T: Real>(g: [T; 3], h: [T; 6], bar: T) -> Option<([T; 3], [T; 6])> {
    let zero = T::zero();
    if bar == zero {
        return Some(([zero; 3], [zero; 6]));
    }
    let two = T::one() + T::one();
    let kappa = super::curvature::curvature(g, h);
    let squared = vector::norm_squared(g);
    if !(squared > zero) || !squared.is_finite() || !(kappa.abs() < two) {
        return None;
    }
    let length = squared.sqrt();
    let n = g.map(|x| x / length);
    let per_length = bar / length;
    let along = [
        h[0] * n[0] + h[3] * n[1] + h[4] * n[2],
        h[3] * n[0] + h[1] * n[1] + h[5] * n[2],
        h[4] * n[0] + h[5] * n[1] + h[2] * n[2],
    ];
    let trace = h[0] + h[1] + h[2];
    let of_gradient =
        |a: usize| element::gradient_bar(per_length, n[a], trace, along[a], length, kappa);
    let plain = |a: usize| element::plain_bar(per_length, n[a]);
    let mixed = |a: usize, b: usize| element::mixed_bar(per_length, n[a], n[b]);
    let gradient = [0, 1, 2].map(of_gradient);
    let [xx, yy, zz] = [0, 1, 2].map(plain);
    let hessian = [xx, yy, zz, mixed(0, 1), mixed(0, 2), mixed(1, 2)];
    let finite = vector::is_finite(gradient) && hessian.iter().all(|x| x.is_finite());
    finite.then_some((gradient, hessian))
}

/// Cotangents of one plane of derivatives.
struct Plane<T> {
    /// Cotangents of values differenced along y: once, twice, and once after x.
    once: Vec<T>,
    twice: Vec<T>,
    mixed: Vec<T>,
    /// One row: of the gradient and the Hessian.
    first: [Vec<T>; 3],
    second: [Vec<T>; 6],
    derivatives: Buffers<T>,
}

impl<T: Real> Plane<T> {
    fn new([_, ny, nz]: [usize; 3]) -> Self {
        let [once, twice, mixed] = rows::buffers(ny * nz);
        Self {
            once,
            twice,
            mixed,
            first: rows::buffers(nz),
            second: rows::buffers(nz),
            derivatives: Buffers::new(nz),
        }
    }

    /// Fills the cotangents of a row of derivatives; returns how many cells are guarded.
    #[inline(always)]
    fn fill_row(&mut self, rows: &Rows<T>, at: [usize; 2], per_length: T, bar: &[T]) -> usize {
        self.derivatives.fill(rows, at);
        let mut guarded = 0;
        for (k, &bar) in bar.iter().enumerate() {
            let (g, h) = (self.derivatives.gradient(k), self.derivatives.hessian(k));
            let pulled = pull(g, h, per_length * bar);
            guarded += usize::from(pulled.is_none());
            let (first, second) = pulled.unwrap_or_default();
            for a in 0..3 {
                self.first[a][k] = first[a];
            }
            for a in 0..6 {
                self.second[a][k] = second[a];
            }
        }
        guarded
    }

    /// Transposes the differences along z of the row that was filled, and puts off those along y and x.
    #[inline(always)]
    fn spread_row(&mut self, j: usize, [once, twice, rest]: [&mut [T]; 3]) {
        let nz = rest.len();
        let one = T::one();
        let own = j * nz..(j + 1) * nz;
        let [gx, gy, gz] = &self.first;
        let [xx, yy, zz, xy, xz, yz] = &self.second;
        once.copy_from_slice(gx);
        add_along(Order::First, one, xz, same, once);
        twice.copy_from_slice(xx);
        rest.fill(T::zero());
        add_along(Order::First, one, gz, same, rest);
        add_along(Order::Second, one, zz, same, rest);
        let along_y = &mut self.once[own.clone()];
        along_y.copy_from_slice(gy);
        add_along(Order::First, one, yz, same, along_y);
        self.twice[own.clone()].copy_from_slice(yy);
        self.mixed[own].copy_from_slice(xy);
    }

    /// Transposes the differences along y, for one row.
    #[inline(always)]
    fn add_row(&self, ny: usize, j: usize, once: &mut [T], rest: &mut [T]) {
        let (nz, one) = (rest.len(), T::one());
        let rows = |values| Strided {
            values,
            start: 0,
            stride: nz,
        };
        let column = Column::new(Order::First, ny, j);
        add_across(&column, one, rows(&self.mixed[..]), same, once);
        add_across(&column, one, rows(&self.once[..]), same, rest);
        let column = Column::new(Order::Second, ny, j);
        add_across(&column, one, rows(&self.twice[..]), same, rest);
    }
}

/// All but the differences along x, plane by plane. `out` is the cotangent of values differenced along x once, twice and not at
/// all, in units of cells; overwritten. Returns the number of guarded cells.
fn within_planes<T: Real>(
    rows: &Rows<T>,
    per_length: T,
    bar: &[T],
    [once, twice, rest]: [&mut Vec<T>; 3],
) -> usize {
    let [_, ny, nz] = rows.shape;
    for out in [&mut *once, &mut *twice, &mut *rest] {
        // Every place is written below.
        out.resize(bar.len(), T::zero());
    }
    let planes = once
        .chunks_exact_mut(ny * nz)
        .zip(twice.chunks_exact_mut(ny * nz))
        .zip(rest.chunks_exact_mut(ny * nz))
        .zip(bar.chunks_exact(ny * nz));
    let guarded = parallel::map_each_with(
        || Plane::new(rows.shape),
        planes,
        |plane, i, (((once, twice), rest), bar)| {
            let mut guarded = 0;
            crate::simd::vectorized!(Arch::new(), {
                for j in 0..ny {
                    let own = j * nz..(j + 1) * nz;
                    let bar = &bar[own.clone()];
                    guarded += plane.fill_row(rows, [i, j], per_length, bar);
                    let (once, twice) = (&mut once[own.clone()], &mut twice[own.clone()]);
                    plane.spread_row(j, [once, twice, &mut rest[own]]);
                }
                for j in 0..ny {
                    let own = j * nz..(j + 1) * nz;
                    plane.add_row(ny, j, &mut once[own.clone()], &mut rest[own]);
                }
            });
            guarded
        },
    );
    guarded.into_iter().sum()
}

/// Adds the transposed differences along x to the rest.
fn across_planes<T: Real>([nx, ny, nz]: [usize; 3], once: &[T], twice: &[T], rest: &mut [T]) {
    let plane = ny * nz;
    parallel::each(rest.chunks_exact_mut(plane), |i, rest| {
        crate::simd::vectorized!(Arch::new(), {
            for (order, from) in [(Order::First, once), (Order::Second, twice)] {
                let column = Column::new(order, nx, i);
                let rows = Strided {
                    values: from,
                    start: 0,
                    stride: plane,
                };
                add_across(&column, T::one(), rows, same, rest);
            }
        });
    });
}

/// The transpose of one pass of smoothing along one axis.
fn sweep_back<T: Real>(values: &[T], out: &mut [T], shape: [usize; 3], axis: usize) {
    let [_, ny, nz] = shape;
    parallel::each(out.chunks_exact_mut(ny * nz), |i, plane| {
        crate::simd::vectorized!(Arch::new(), {
            for (j, out) in plane.chunks_exact_mut(nz).enumerate() {
                sweep_row(values, shape, axis, [i, j], out);
            }
        });
    });
}

#[inline(always)]
fn sweep_row<T: Real>(
    values: &[T],
    shape: [usize; 3],
    axis: usize,
    [i, j]: [usize; 2],
    out: &mut [T],
) {
    let (quarter, [_, ny, nz]) = (T::of(0.25), shape);
    let own = &values[(i * ny + j) * nz..][..nz];
    out.copy_from_slice(own);
    if axis == 2 {
        add_along(Order::Second, quarter, own, same, out);
        return;
    }
    let (start, stride) = [(j * nz, ny * nz), (i * ny * nz, nz)][axis];
    let rows = Strided {
        values,
        start,
        stride,
    };
    let column = Column::new(Order::Second, shape[axis], [i, j][axis]);
    add_across(&column, quarter, rows, same, out);
}
