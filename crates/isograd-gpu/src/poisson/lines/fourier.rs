//! The Fourier transforms of a tile, in passes.

use cubecl::prelude::*;

use super::Tables;
use super::tile::{Shared, Tile, place};

/// The Fourier transforms of the numbers at `from`, one half of the shared memory; returns the half they are in.
#[cube]
pub(super) fn transform_tile<F: Float + CubeElement>(
    shared: &mut Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
    #[comptime] chirped: bool,
) -> usize {
    if comptime!(chirped) {
        transform_by_chirp(shared, tables, tile, from)
    } else {
        transform_by_passes(shared, tables, tile, from)
    }
}

/// With `w_j = exp(−πij²/n)`, `Z_k = w_k Σ_j (x_j w_j) w̄_{k−j}`: a cyclic convolution of `length` numbers.
#[cube]
fn transform_by_chirp<F: Float + CubeElement>(
    shared: &mut Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
) -> usize {
    let n = tile.lines.n;
    let mut j = tile.begin;
    while j < tile.length {
        let at = from + place(tile, tile.pair, j);
        if j < n {
            let x = times_table(shared, tables, at, j, n);
            shared.re[at] = x.re;
            shared.im[at] = x.im;
        } else {
            shared.re[at] = F::new(0.0);
            shared.im[at] = F::new(0.0);
        }
        j += tile.stride;
    }
    sync_cube();
    let middle = transform_by_passes(shared, tables, tile, from);
    // A transform of numbers whose parts are exchanged is the inverse one, its parts exchanged.
    let mut k = tile.begin;
    while k < tile.length {
        let at = middle + place(tile, tile.pair, k);
        let x = times_table(shared, tables, at, 2 * n + k, tile.length);
        shared.re[at] = x.im;
        shared.im[at] = x.re;
        k += tile.stride;
    }
    sync_cube();
    let end = transform_by_passes(shared, tables, tile, middle);
    let mut k = tile.begin;
    while k < n {
        let at = end + place(tile, tile.pair, k);
        let re = shared.im[at];
        shared.im[at] = shared.re[at];
        shared.re[at] = re;
        let x = times_table(shared, tables, at, k, n);
        shared.re[at] = x.re;
        shared.im[at] = x.im;
        k += tile.stride;
    }
    sync_cube();
    end
}

/// The number at a place, times number `entry` of the table of the chirp, whose imaginary part is `pitch` further on.
#[cube]
fn times_table<F: Float + CubeElement>(
    shared: &Shared<F>,
    tables: &Tables<F>,
    at: usize,
    entry: usize,
    pitch: usize,
) -> Complex<F> {
    let c = tables.chirp[entry];
    let s = tables.chirp[entry + pitch];
    Complex::<F> {
        re: shared.re[at] * c - shared.im[at] * s,
        im: shared.re[at] * s + shared.im[at] * c,
    }
}

#[cube]
fn transform_by_passes<F: Float + CubeElement>(
    shared: &mut Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
) -> usize {
    let mut at = from;
    let mut done = 1usize.runtime();
    for pass in 0..tables.passes {
        let radix = tables.radices[pass] as usize;
        let to = shared.half - at;
        if radix == 4 {
            pass_of_four(shared, tables, tile, at, to, done);
        } else if radix == 2 {
            pass_of_two(shared, tables, tile, at, to, done);
        } else if radix == 3 {
            pass_of_few(shared, tables, tile, at, to, done, 3usize);
        } else if radix == 5 {
            pass_of_few(shared, tables, tile, at, to, done, 5usize);
        } else {
            pass_of_any(shared, tables, tile, at, to, done, radix);
        }
        sync_cube();
        at = to;
        done *= radix;
    }
    at
}

#[derive(CubeType, Clone, Copy)]
pub(super) struct Complex<F: Float> {
    pub(super) re: F,
    pub(super) im: F,
}

/// Place `j` of a unit's pair, turned by `exp(−2πit/n)`.
#[cube]
fn turned<F: Float + CubeElement>(
    shared: &Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
    j: usize,
    t: usize,
) -> Complex<F> {
    let at = from + place(tile, tile.pair, j);
    let c = tables.roots[t];
    let s = tables.roots[tile.length + t];
    Complex::<F> {
        re: shared.re[at] * c - shared.im[at] * s,
        im: shared.re[at] * s + shared.im[at] * c,
    }
}

/// Writes place `j` of a unit's pair.
#[cube]
fn set<F: Float>(shared: &mut Shared<F>, tile: &Tile, to: usize, j: usize, re: F, im: F) {
    let at = to + place(tile, tile.pair, j);
    shared.re[at] = re;
    shared.im[at] = im;
}

/// One pass with radix 2, after passes whose product is `done`.
#[cube]
fn pass_of_two<F: Float + CubeElement>(
    shared: &mut Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
    to: usize,
    done: usize,
) {
    let part = tile.length / 2;
    let turn = part / done;
    let mut b = tile.begin;
    while b < part {
        let k = b % done;
        let v0 = from + place(tile, tile.pair, b);
        let (re, im) = (shared.re[v0], shared.im[v0]);
        let v1 = turned(shared, tables, tile, from, b + part, k * turn);
        let first = (b - k) * 2 + k;
        set(shared, tile, to, first, re + v1.re, im + v1.im);
        set(shared, tile, to, first + done, re - v1.re, im - v1.im);
        b += tile.stride;
    }
}

/// One pass with radix 4.
#[cube]
fn pass_of_four<F: Float + CubeElement>(
    shared: &mut Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
    to: usize,
    done: usize,
) {
    let part = tile.length / 4;
    let turn = part / done;
    let mut b = tile.begin;
    while b < part {
        let k = b % done;
        let t = k * turn;
        let v0 = from + place(tile, tile.pair, b);
        let v1 = turned(shared, tables, tile, from, b + part, t);
        let v2 = turned(shared, tables, tile, from, b + 2 * part, 2 * t);
        let v3 = turned(shared, tables, tile, from, b + 3 * part, 3 * t);
        let (sum_re, sum_im) = (shared.re[v0] + v2.re, shared.im[v0] + v2.im);
        let (gap_re, gap_im) = (shared.re[v0] - v2.re, shared.im[v0] - v2.im);
        let (odd_re, odd_im) = (v1.re + v3.re, v1.im + v3.im);
        let (odd_gap_re, odd_gap_im) = (v1.re - v3.re, v1.im - v3.im);
        let u0 = (b - k) * 4 + k;
        let (u1, u2, u3) = (u0 + done, u0 + 2 * done, u0 + 3 * done);
        set(shared, tile, to, u0, sum_re + odd_re, sum_im + odd_im);
        set(
            shared,
            tile,
            to,
            u1,
            gap_re + odd_gap_im,
            gap_im - odd_gap_re,
        );
        set(shared, tile, to, u2, sum_re - odd_re, sum_im - odd_im);
        set(
            shared,
            tile,
            to,
            u3,
            gap_re - odd_gap_im,
            gap_im + odd_gap_re,
        );
        b += tile.stride;
    }
}

/// One pass with a small radix, as plain sums of numbers that are read once.
#[cube]
fn pass_of_few<F: Float + CubeElement>(
    shared: &mut Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
    to: usize,
    done: usize,
    #[comptime] radix: usize,
) {
    let part = tile.length / radix;
    let turn = part / done;
    let mut unit_re = Array::<F>::new(radix);
    let mut unit_im = Array::<F>::new(radix);
    #[unroll]
    for q in 0..radix {
        unit_re[q] = tables.roots[q * part];
        unit_im[q] = tables.roots[tile.length + q * part];
    }
    let mut v_re = Array::<F>::new(radix);
    let mut v_im = Array::<F>::new(radix);
    let mut b = tile.begin;
    while b < part {
        let k = b % done;
        #[unroll]
        for q in 0..radix {
            let v = turned(shared, tables, tile, from, b + q * part, q * k * turn);
            v_re[q] = v.re;
            v_im[q] = v.im;
        }
        let first = (b - k) * radix + k;
        #[unroll]
        for s in 0..radix {
            let mut sum_re = v_re[0];
            let mut sum_im = v_im[0];
            #[unroll]
            for q in 1..radix {
                let w = comptime!((q * s) % radix);
                sum_re += v_re[q] * unit_re[w] - v_im[q] * unit_im[w];
                sum_im += v_re[q] * unit_im[w] + v_im[q] * unit_re[w];
            }
            set(shared, tile, to, first + s * done, sum_re, sum_im);
        }
        b += tile.stride;
    }
}

/// One pass with any radix, as a plain sum for each of its results.
#[cube]
fn pass_of_any<F: Float + CubeElement>(
    shared: &mut Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
    to: usize,
    done: usize,
    radix: usize,
) {
    let part = tile.length / radix;
    let mut result = tile.begin;
    while result < tile.length {
        let k = result % done;
        let blocks = result / done;
        let b = (blocks / radix) * done + k;
        // Of each term, its angle is so much beyond that of the term before; it stays below a whole turn.
        let turn = k * (part / done) + (blocks % radix) * part;
        let mut angle = 0usize.runtime();
        let mut sum_re = F::new(0.0);
        let mut sum_im = F::new(0.0);
        for q in 0..radix {
            let v = turned(shared, tables, tile, from, b + q * part, angle);
            sum_re += v.re;
            sum_im += v.im;
            angle += turn;
            if angle >= tile.length {
                angle -= tile.length;
            }
        }
        set(shared, tile, to, result, sum_re, sum_im);
        result += tile.stride;
    }
}
