//! The kernels of [`pullback`](super::pullback()) that have a unit a sample.

use cubecl::prelude::*;

use super::cells::{FORM, OTHERS, TAKEN};
use super::plate::{Usual, plate_of, pull_plate};
use super::sample::{
    PassArrays, SEEN, STATE, Sample, corner, derivatives, is_held, mean, sample, see, side, without,
};
use crate::grid::{Lattice, cell_at, center_of};
use crate::primitives::reduce::{BLOCK, sum_of_group, write_sum, write_two_sums};
use crate::splat::{bspline, bspline_slope, pick, subtract_from_grid};
use crate::vector::Vector3;

/// Cotangents of a sample: `r̄`, `ū`, `ω̄`, of its index coordinates, of its normal, of `â`.
pub(super) const BARS: usize = 10;

/// Results of the pass at each sample; and `−(r̄ m + ū w)`, summed a group at a time, in the first places of
/// `partial`.
#[cube(launch)]
pub(super) fn see_means_again<F: Float + CubeElement>(
    pass: &PassArrays<F>,
    state: &Array<F>,
    bars: &Array<F>,
    seen: &mut Array<F>,
    partial: &mut Array<F>,
    grid: Lattice<F>,
) {
    let i = ABSOLUTE_POS;
    let zero = F::new(0.0);
    let mut product = zero;
    if i < pass.keys.len() && is_held::<F>(pass.keys[i], &grid) {
        let me = sample::<F>(&pass.samples, i);
        let corner = corner::<F>(pass.keys[i], &grid);
        let found = see::<F>(&pass.sums, &pass.areas, corner, &grid, me, state[i * STATE]);
        seen[i * SEEN] = found.mean;
        seen[i * SEEN + 1] = found.slope;
        seen[i * SEEN + 2] = found.forecast;
        product = -(bars[i * BARS] * found.mean + bars[i * BARS + 1] * found.slope);
    }
    let mut shared = SharedMemory::<F>::new(BLOCK);
    let total = sum_of_group::<F>(product, &mut shared);
    if UNIT_POS == 0 && CUBE_POS <= (pass.keys.len() - 1) / BLOCK {
        partial[CUBE_POS] = total;
    }
}

/// `λ`, and cotangents of the five sums.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
pub(super) struct GainBars<F: Float + CubeElement> {
    gain: F,
    rise: F,
    slope: F,
    agreement: F,
    offset: F,
    forecast: F,
}

/// Adds to a sample's cotangents of its place and normal, and of `ω` and `r` those for a part of `s̄`.
#[cube]
fn add_to_bars<F: Float>(
    bars: &mut Array<F>,
    at: usize,
    place: Vector3<F>,
    normal: Vector3<F>,
    area: F,
    s_bar: F,
    s: F,
    trust: F,
) {
    bars[at] += trust * s_bar;
    // Where nothing is followed, the slope of ω is 0.
    if trust > F::new(0.0) {
        bars[at + 2] += s_bar * s / trust;
    }
    place.add_to(bars, at + 3);
    normal.add_to(bars, at + 6);
    bars[at + 9] += area;
}

/// Cotangents of the pass's results at the samples, pulled to the samples themselves; those of the cells
/// become forms to spread.
#[cube(launch)]
pub(super) fn pull_seen_means<F: Float + CubeElement>(
    pass: &PassArrays<F>,
    seen: &Array<F>,
    state: &Array<F>,
    bars: &mut Array<F>,
    forms: &mut Array<F>,
    of: GainBars<F>,
    grid: Lattice<F>,
) {
    let i = ABSOLUTE_POS;
    if i < pass.keys.len() && is_held::<F>(pass.keys[i], &grid) {
        let me = sample::<F>(&pass.samples, i);
        let (s, u) = (state[i * STATE], state[i * STATE + 1]);
        let (w, p) = (seen[i * SEEN + 1], seen[i * SEEN + 2]);
        let at = i * BARS;
        let two = F::new(2.0);
        let mean_bar = -(of.gain * bars[at]);
        let slope_bar = me.area * of.rise * u - of.gain * bars[at + 1];
        let forecast_bar = me.area * (of.agreement * s + two * of.forecast * p);
        bars[at + 1] += me.area * (of.rise * w + two * of.slope * u);
        let of_sums = of.rise * w * u
            + of.slope * u * u
            + of.agreement * s * p
            + of.offset * s * s
            + of.forecast * p * p;
        let s_bar = me.area * (of.agreement * p + two * of.offset * s);
        write_tilt::<F>(forms, i * FORM, me, mean_bar, slope_bar);
        let corner = corner::<F>(pass.keys[i], &grid);
        let found = pull_forecast::<F>(pass, i, &grid, me, s, mean_bar, forecast_bar, forms);
        let of_means = derivatives::<F>(&pass.sums, &pass.areas, corner, &grid, me.f, true);
        let bend = of_means.bend(me.normal).scale(slope_bar);
        add_to_bars::<F>(
            bars,
            at,
            found.place.add(bend),
            of_means.gradient().scale(slope_bar),
            of_sums + found.area,
            s_bar + found.offset,
            s,
            me.trust,
        );
    }
}

/// Offset, `m̄` and `w̄ n` of a sample, in the form that is spread.
#[cube]
fn write_tilt<F: Float>(forms: &mut Array<F>, at: usize, me: Sample<F>, mean_bar: F, slope_bar: F) {
    me.f.store(forms, at);
    forms[at + 3] = mean_bar;
    me.normal.scale(slope_bar).store(forms, at + 4);
}

/// Cotangents of a sample's index coordinates, of `â` and of `s`.
#[derive(CubeType, Clone, Copy)]
struct OfSample<F: Float> {
    place: Vector3<F>,
    area: F,
    offset: F,
}

/// From `m̄` and `p̄` of a sample to itself, by the 2³ cell centers around it; `y` and `−y v` of those become its
/// form to spread.
#[cube]
fn pull_forecast<F: Float + CubeElement>(
    pass: &PassArrays<F>,
    sample: usize,
    grid: &Lattice<F>,
    me: Sample<F>,
    s: F,
    mean_bar: F,
    forecast_bar: F,
    forms: &mut Array<F>,
) -> OfSample<F> {
    let zero = F::new(0.0);
    let (form, corner) = (sample * FORM, corner::<F>(pass.keys[sample], grid));
    let mut place = Vector3::<F>::zero();
    let mut area_bar = zero;
    let mut offset_bar = zero;
    for i in 0..2u32 {
        let x = side::<F>(me.f.x, i);
        for j in 0..2u32 {
            let y = side::<F>(me.f.y, j);
            for k in 0..2u32 {
                let z = side::<F>(me.f.z, k);
                let at = (corner + (x.cell * grid.ny + y.cell) * grid.nz + z.cell) as usize;
                let bump = x.bump * y.bump * z.bump;
                let own = me.area * bump;
                let rest = without::<F>(&pass.sums, &pass.areas, at, own, s);
                let part = x.tent * y.tent * z.tent * forecast_bar / rest.others;
                let side = ((i * 2u32 + j) * 2u32 + k) as usize;
                forms[form + OTHERS + side] = part;
                forms[form + TAKEN + side] = -(part * rest.value);
                offset_bar -= part * own;
                let weight_bar = part * (rest.value - s);
                area_bar += bump * weight_bar;
                let value_bar =
                    mean_bar * mean::<F>(&pass.sums, &pass.areas, at) + forecast_bar * rest.value;
                let tilt = me.area * weight_bar;
                place.x += x.tent_slope * y.tent * z.tent * value_bar
                    + x.bump_slope * y.bump * z.bump * tilt;
                place.y += x.tent * y.tent_slope * z.tent * value_bar
                    + x.bump * y.bump_slope * z.bump * tilt;
                place.z += x.tent * y.tent * z.tent_slope * value_bar
                    + x.bump * y.bump * z.bump_slope * tilt;
            }
        }
    }
    OfSample::<F> {
        place,
        area: area_bar,
        offset: offset_bar,
    }
}

/// From `M̄` and `D̄` at the cells to the samples near by.
#[cube(launch)]
pub(super) fn pull_cells<F: Float + CubeElement>(
    keys: &Array<u32>,
    samples: &Array<F>,
    sum_bars: &Array<F>,
    area_bars: &Array<F>,
    state: &Array<F>,
    bars: &mut Array<F>,
    count: u32,
    grid: Lattice<F>,
) {
    let s = ABSOLUTE_POS;
    if s < count as usize && is_held::<F>(keys[s], &grid) {
        let me = sample::<F>(samples, s);
        let offset = state[s * STATE];
        let corner = corner::<F>(keys[s], &grid);
        let found = gather_cells_back::<F>(sum_bars, area_bars, corner, &grid, me.f, offset);
        add_to_bars::<F>(
            bars,
            s * BARS,
            found.place.scale(me.area),
            Vector3::<F>::zero(),
            found.area,
            me.area * found.offset,
            offset,
            me.trust,
        );
    }
}

/// `Σ ∇B b`, `Σ B b` and `Σ B M̄` with `b = s M̄ + D̄`, over the 3³ cells from `corner` on.
#[cube]
fn gather_cells_back<F: Float + CubeElement>(
    sum_bars: &Array<F>,
    area_bars: &Array<F>,
    corner: u32,
    grid: &Lattice<F>,
    f: Vector3<F>,
    s: F,
) -> OfSample<F> {
    let zero = F::new(0.0);
    let (x, dx) = (bspline::<F>(f.x), bspline_slope::<F>(f.x));
    let (y, dy) = (bspline::<F>(f.y), bspline_slope::<F>(f.y));
    let (z, dz) = (bspline::<F>(f.z), bspline_slope::<F>(f.z));
    let mut place = Vector3::<F>::zero();
    let mut area_bar = zero;
    let mut offset_bar = zero;
    for i in 0..3u32 {
        let (wx, sx) = (pick::<F>(x, i + 2u32), pick::<F>(dx, i + 2u32));
        for j in 0..3u32 {
            let (wy, sy) = (pick::<F>(y, j + 2u32), pick::<F>(dy, j + 2u32));
            let row = (corner + (i * grid.ny + j) * grid.nz) as usize;
            let low = s * sum_bars[row] + area_bars[row];
            let middle = s * sum_bars[row + 1] + area_bars[row + 1];
            let high = s * sum_bars[row + 2] + area_bars[row + 2];
            let along = z.below * low + z.center * middle + z.above * high;
            let slope = dz.below * low + dz.center * middle + dz.above * high;
            let sum = z.below * sum_bars[row]
                + z.center * sum_bars[row + 1]
                + z.above * sum_bars[row + 2];
            offset_bar += wx * wy * sum;
            area_bar += wx * wy * along;
            place.x += sx * wy * along;
            place.y += wx * sy * along;
            place.z += wx * wy * slope;
        }
    }
    OfSample::<F> {
        place,
        area: area_bar,
        offset: offset_bar,
    }
}

/// Cotangents of `U` and `w`, summed a group at a time.
#[cube(launch)]
pub(super) fn pull_plates<F: Float + CubeElement>(
    state: &Array<F>,
    bars: &Array<F>,
    partial: &mut Array<F>,
    count: u32,
    usual: Usual<F>,
    #[comptime] thin: bool,
) {
    let s = ABSOLUTE_POS;
    let mut usual_bar = F::new(0.0);
    let mut width_bar = F::new(0.0);
    if s < count as usize {
        let of = plate_of::<F>(state[s * STATE + 1], &usual);
        let bar = pull_plate::<F>(of, &usual, bars[s * BARS + 2], bars[s * BARS], thin);
        usual_bar = bar.usual;
        width_bar = bar.width;
    }
    write_two_sums::<F>(usual_bar, width_bar, partial);
}

/// `χ` before the first pass, and the samples with their slopes.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct Slopes<F: Float + CubeElement> {
    chi: Array<F>,
    keys: Array<u32>,
    samples: Array<F>,
    state: Array<F>,
}

/// From `ω`, `δ` and `U` to the slopes before the first pass, and from those to places, normals and, as forms to
/// spread, cells. `share` is what `U` has for `â u`.
#[cube(launch)]
pub(super) fn pull_slopes<F: Float + CubeElement>(
    of: &Slopes<F>,
    bars: &mut Array<F>,
    forms: &mut Array<F>,
    share: F,
    usual: Usual<F>,
    grid: Lattice<F>,
    #[comptime] thin: bool,
) {
    let s = ABSOLUTE_POS;
    if s < of.keys.len() && is_held::<F>(of.keys[s], &grid) {
        let (me, at) = (sample::<F>(&of.samples, s), s * BARS);
        let slope = of.state[s * STATE + 1];
        let plate = plate_of::<F>(slope, &usual);
        let bar = pull_plate::<F>(plate, &usual, bars[at + 2], bars[at], thin);
        let rising = max(slope, F::new(0.0));
        let slope_bar = bars[at + 1] + bar.slope + share * me.area * rising;
        let squares = rising * rising - usual.slope * usual.slope;
        bars[at + 9] += F::new(0.5) * share * squares;
        let corner = corner::<F>(of.keys[s], &grid);
        let found = derivatives::<F>(&of.chi, &of.chi, corner, &grid, me.f, false);
        let bend = found.bend(me.normal).scale(slope_bar);
        bend.add_to(bars, at + 3);
        found.gradient().scale(slope_bar).add_to(bars, at + 6);
        write_tilt::<F>(forms, s * FORM, me, F::new(0.0), slope_bar);
    }
}

/// From the sorted order to that of the input, and to the user's units.
#[cube(launch)]
pub(super) fn add_bars<F: Float + CubeElement>(
    places: &Array<u32>,
    bars: &Array<F>,
    values_bar: &mut Array<F>,
    points_bar: &mut Array<F>,
    normals_bar: &mut Array<F>,
    areas_bar: &mut Array<F>,
    spacing: F,
    #[comptime] area_weights: bool,
) {
    let s = ABSOLUTE_POS;
    if s < places.len() {
        let i = places[s] as usize;
        let at = s * BARS;
        values_bar[i] = bars[at];
        for axis in 0..3usize {
            points_bar[3 * i + axis] += bars[at + 3 + axis] / spacing;
            normals_bar[3 * i + axis] += bars[at + 6 + axis];
        }
        let mut area = bars[at + 9];
        if comptime!(area_weights) {
            area = area / spacing / spacing;
        }
        areas_bar[i] += area;
    }
}

/// Cotangents of the grid from those of a group, and of the iso-value: less the sum of `r̄`.
#[cube(launch)]
pub(super) fn add_bars_of_grid<F: Float + CubeElement>(
    keys: &Array<u32>,
    samples: &Array<F>,
    bars: &Array<F>,
    grid_sums: &mut Array<F>,
    level_sums: &mut Array<F>,
    count: u32,
    grid: Lattice<F>,
    #[comptime] area_weights: bool,
) {
    let s = ABSOLUTE_POS;
    let zero = F::new(0.0);
    let mut bar = Vector3::<F>::zero();
    let mut of_spacing = zero;
    let mut value = zero;
    if s < count as usize && is_held::<F>(keys[s], &grid) {
        let (me, at) = (sample::<F>(samples, s), s * BARS);
        let cell = cell_at(keys[s], grid.ny, grid.nz);
        bar = Vector3::<F>::load(bars, at + 3).over(grid.spacing);
        value = -bars[at];
        // ∂x̂/∂h = −x̂/h; and the areas are divided by h².
        of_spacing = center_of::<F>(cell).add(me.f).dot(bar);
        if comptime!(area_weights) {
            of_spacing += F::new(2.0) * me.area * bars[at + 9] / grid.spacing;
        }
    }
    subtract_from_grid::<F>(bar, of_spacing, grid_sums);
    write_sum::<F>(value, level_sums);
}
