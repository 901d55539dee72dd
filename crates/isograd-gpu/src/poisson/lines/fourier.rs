//! The Fourier transforms of a tile, in passes.

use cubecl::prelude::*;

use super::tile::{Tile, place};

/// The Fourier transforms of what is at `from`, one half of the shared memory; returns the half they are in.
#[cube]
pub(super) fn transform_tile<F: Float>(
    re: &mut SharedMemory<F>,
    im: &mut SharedMemory<F>,
    roots: &Array<F>,
    radices: &Array<u32>,
    passes: usize,
    tile: &Tile,
    from: usize,
    #[comptime] capacity: usize,
) -> usize {
    let mut at = from;
    let mut done = 1usize.runtime();
    for pass in 0..passes {
        let radix = radices[pass] as usize;
        let to = capacity - at;
        if radix == 4 {
            pass_of_four(re, im, roots, tile, at, to, done);
        } else if radix == 2 {
            pass_of_two(re, im, roots, tile, at, to, done);
        } else if radix == 3 {
            pass_of_few(re, im, roots, tile, at, to, done, 3usize);
        } else if radix == 5 {
            pass_of_few(re, im, roots, tile, at, to, done, 5usize);
        } else {
            pass_of_any(re, im, roots, tile, at, to, done, radix);
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
fn turned<F: Float>(
    re: &SharedMemory<F>,
    im: &SharedMemory<F>,
    roots: &Array<F>,
    tile: &Tile,
    from: usize,
    j: usize,
    t: usize,
) -> Complex<F> {
    let at = from + place(tile, tile.pair, j);
    let c = roots[t];
    let s = roots[tile.n + t];
    Complex::<F> {
        re: re[at] * c - im[at] * s,
        im: re[at] * s + im[at] * c,
    }
}

/// One pass with radix 2, after passes whose product is `done`.
#[cube]
fn pass_of_two<F: Float>(
    re: &mut SharedMemory<F>,
    im: &mut SharedMemory<F>,
    roots: &Array<F>,
    tile: &Tile,
    from: usize,
    to: usize,
    done: usize,
) {
    let part = tile.n / 2;
    let turn = part / done;
    let mut b = tile.begin;
    while b < part {
        let k = b % done;
        let v0 = from + place(tile, tile.pair, b);
        let v1 = turned(re, im, roots, tile, from, b + part, k * turn);
        let first = (b - k) * 2 + k;
        let u0 = to + place(tile, tile.pair, first);
        re[u0] = re[v0] + v1.re;
        im[u0] = im[v0] + v1.im;
        let u1 = to + place(tile, tile.pair, first + done);
        re[u1] = re[v0] - v1.re;
        im[u1] = im[v0] - v1.im;
        b += tile.stride;
    }
}

/// One pass with radix 4.
#[cube]
fn pass_of_four<F: Float>(
    re: &mut SharedMemory<F>,
    im: &mut SharedMemory<F>,
    roots: &Array<F>,
    tile: &Tile,
    from: usize,
    to: usize,
    done: usize,
) {
    let part = tile.n / 4;
    let turn = part / done;
    let mut b = tile.begin;
    while b < part {
        let k = b % done;
        let t = k * turn;
        let v0 = from + place(tile, tile.pair, b);
        let v1 = turned(re, im, roots, tile, from, b + part, t);
        let v2 = turned(re, im, roots, tile, from, b + 2 * part, 2 * t);
        let v3 = turned(re, im, roots, tile, from, b + 3 * part, 3 * t);
        let (sum_re, sum_im) = (re[v0] + v2.re, im[v0] + v2.im);
        let (gap_re, gap_im) = (re[v0] - v2.re, im[v0] - v2.im);
        let (odd_re, odd_im) = (v1.re + v3.re, v1.im + v3.im);
        let (odd_gap_re, odd_gap_im) = (v1.re - v3.re, v1.im - v3.im);
        let first = (b - k) * 4 + k;
        let u0 = to + place(tile, tile.pair, first);
        re[u0] = sum_re + odd_re;
        im[u0] = sum_im + odd_im;
        let u1 = to + place(tile, tile.pair, first + done);
        re[u1] = gap_re + odd_gap_im;
        im[u1] = gap_im - odd_gap_re;
        let u2 = to + place(tile, tile.pair, first + 2 * done);
        re[u2] = sum_re - odd_re;
        im[u2] = sum_im - odd_im;
        let u3 = to + place(tile, tile.pair, first + 3 * done);
        re[u3] = gap_re - odd_gap_im;
        im[u3] = gap_im + odd_gap_re;
        b += tile.stride;
    }
}

/// One pass with a small radix, as plain sums of numbers that are read once.
#[cube]
fn pass_of_few<F: Float>(
    re: &mut SharedMemory<F>,
    im: &mut SharedMemory<F>,
    roots: &Array<F>,
    tile: &Tile,
    from: usize,
    to: usize,
    done: usize,
    #[comptime] radix: usize,
) {
    let part = tile.n / radix;
    let turn = part / done;
    let mut unit_re = Array::<F>::new(radix);
    let mut unit_im = Array::<F>::new(radix);
    #[unroll]
    for q in 0..radix {
        unit_re[q] = roots[q * part];
        unit_im[q] = roots[tile.n + q * part];
    }
    let mut v_re = Array::<F>::new(radix);
    let mut v_im = Array::<F>::new(radix);
    let mut b = tile.begin;
    while b < part {
        let k = b % done;
        #[unroll]
        for q in 0..radix {
            let v = turned(re, im, roots, tile, from, b + q * part, q * k * turn);
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
            let at = to + place(tile, tile.pair, first + s * done);
            re[at] = sum_re;
            im[at] = sum_im;
        }
        b += tile.stride;
    }
}

/// One pass with any radix, as a plain sum for each of its results.
#[cube]
fn pass_of_any<F: Float>(
    re: &mut SharedMemory<F>,
    im: &mut SharedMemory<F>,
    roots: &Array<F>,
    tile: &Tile,
    from: usize,
    to: usize,
    done: usize,
    radix: usize,
) {
    let part = tile.n / radix;
    let mut result = tile.begin;
    while result < tile.n {
        let k = result % done;
        let blocks = result / done;
        let b = (blocks / radix) * done + k;
        // Of each term, its angle is so much beyond that of the term before; it stays below a whole turn.
        let turn = k * (part / done) + (blocks % radix) * part;
        let mut angle = 0usize.runtime();
        let mut sum_re = F::new(0.0);
        let mut sum_im = F::new(0.0);
        for q in 0..radix {
            let v = turned(re, im, roots, tile, from, b + q * part, angle);
            sum_re += v.re;
            sum_im += v.im;
            angle += turn;
            if angle >= tile.n {
                angle -= tile.n;
            }
        }
        let at = to + place(tile, tile.pair, result);
        re[at] = sum_re;
        im[at] = sum_im;
        result += tile.stride;
    }
}
