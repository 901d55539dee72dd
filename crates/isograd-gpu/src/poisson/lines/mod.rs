//! Cosine transforms of lines in shared memory, by Fourier transforms.
//!
//! A group has a tile of pairs of lines; a pair travels as one complex line `x` of length `n`. With `v` its
//! Makhoul order (even places first, then odd places backwards), `Z = FFT(v)` and `w_k = exp(−iπk/2n)`, the
//! cosine transforms of both lines are `Y_k = w_k Z_k + w̄_k Z_{n−k}`. Backwards, `Z_k = w̄_k (Y_k − i Y_{n−k})`
//! with `Y_n = 0`, and `x` comes out times `2n`. The passes of the Fourier transform are Stockham's, from one
//! half of the shared memory to the other. Its inverse is itself, with real and imaginary parts exchanged.

mod fourier;
mod tile;

use cubecl::prelude::*;

use super::axis::{Fourier, Lines};
use super::gain::{Gains, gain};
use crate::{Buffer, Device, Scalar};
use fourier::{Complex, transform_tile};
use tile::{
    Tile, first_pair, first_place, load, next_pair, next_place, own_tile, place, store, write,
};

/// Units of a group.
const BLOCK: u32 = 256;

/// Most bytes of shared memory for a group: with more, fewer groups run at a time.
const MEMORY: usize = 32 * 1024;

/// Tiles of small fields are not made smaller than so many pairs: what is read together is then wide enough.
const PAIRS: usize = 8;

/// Groups that keep a large device busy.
const GROUPS: usize = 256;

/// Complex numbers of a tile, a power of two: the longest line.
pub(super) fn capacity<R: Runtime, T: Scalar>(device: &Device<R>) -> usize {
    let numbers = device.shared_memory().min(MEMORY) / size_of::<T>();
    1 << (numbers / 4).ilog2()
}

/// What a kernel is launched with.
struct Launch {
    groups: CubeCount,
    dim: CubeDim,
    capacity: usize,
    pairs: usize,
}

impl Launch {
    fn new<R: Runtime, T: Scalar>(device: &Device<R>, lines: Lines) -> Self {
        let capacity = capacity::<R, T>(device);
        // A unit stays with one pair.
        let mut pairs = (1 << (capacity / lines.n).ilog2()).min(BLOCK as usize);
        while pairs > PAIRS && lines.count < 2 * pairs * GROUPS {
            pairs /= 2;
        }
        let tiles = lines.count.div_ceil(2 * pairs);
        Self {
            groups: device.groups(tiles * BLOCK as usize, BLOCK),
            dim: CubeDim::new_1d(BLOCK),
            capacity,
            pairs,
        }
    }
}

impl<T: Scalar> Fourier<T> {
    /// Lines → cosine transforms; or, if `inverse`, cosine transforms → lines times `2n`.
    pub(super) fn transform<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
        inverse: bool,
    ) {
        let launch = Launch::new::<R, T>(device, lines);
        transform::launch::<T, R>(
            device.client(),
            launch.groups,
            launch.dim,
            from.arg(),
            to.arg(),
            self.roots.arg(),
            self.radices.arg(),
            self.radices.len(),
            lines.n,
            lines.step,
            lines.count,
            launch.pairs,
            launch.capacity,
            lines.step == 1,
            inverse,
        );
    }

    /// Lines → cosine transforms times the gains → lines times `2n`.
    pub(super) fn filter<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
        gains: &Gains<T>,
    ) {
        let launch = Launch::new::<R, T>(device, lines);
        let [_, ny, nz] = gains.shape;
        filter::launch::<T, R>(
            device.client(),
            launch.groups,
            launch.dim,
            from.arg(),
            to.arg(),
            self.roots.arg(),
            self.radices.arg(),
            gains.spectrum.arg(),
            gains.gaussian.arg(),
            self.radices.len(),
            lines.n,
            lines.step,
            lines.count,
            launch.pairs,
            ny,
            nz,
            launch.capacity,
            lines.step == 1,
        );
    }
}

#[cube(launch)]
fn transform<F: Float>(
    input: &Array<F>,
    output: &mut Array<F>,
    roots: &Array<F>,
    radices: &Array<u32>,
    passes: usize,
    n: usize,
    step: usize,
    count: usize,
    pairs: usize,
    #[comptime] capacity: usize,
    #[comptime] contiguous: bool,
    #[comptime] inverse: bool,
) {
    let tile = own_tile(n, step, count, pairs, contiguous);
    let mut re = SharedMemory::<F>::new(2 * capacity);
    let mut im = SharedMemory::<F>::new(2 * capacity);
    load(input, &mut re, &mut im, &tile, comptime!(!inverse));
    let mut from = 0usize.runtime();
    if comptime!(inverse) {
        to_fourier(&mut re, &mut im, roots, &tile, from, capacity);
        from = capacity - from;
    }
    let at = transform_tile(
        &mut re, &mut im, roots, radices, passes, &tile, from, capacity,
    );
    if comptime!(inverse) {
        store(output, &re, &im, &tile, at);
    } else {
        store_cosines(output, &re, &im, roots, &tile, at);
    }
}

/// Writes the cosine transforms of the Fourier transforms at `at`.
#[cube]
fn store_cosines<F: Float>(
    output: &mut Array<F>,
    re: &SharedMemory<F>,
    im: &SharedMemory<F>,
    roots: &Array<F>,
    tile: &Tile,
    at: usize,
) {
    let items = tile.pairs * tile.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(tile);
    let mut k = first_place(tile);
    while item < items {
        let y = cosine(re, im, roots, tile, at, pair, k);
        write(output, tile, pair, k, y.re);
        write(output, tile, pair + tile.pairs, k, y.im);
        item += BLOCK as usize;
        pair = next_pair(tile, pair, k);
        k = next_place(tile, k);
    }
}

#[cube(launch)]
fn filter<F: Float>(
    input: &Array<F>,
    output: &mut Array<F>,
    roots: &Array<F>,
    radices: &Array<u32>,
    spectrum: &Array<F>,
    gaussian: &Array<F>,
    passes: usize,
    n: usize,
    step: usize,
    count: usize,
    pairs: usize,
    ny: usize,
    nz: usize,
    #[comptime] capacity: usize,
    #[comptime] contiguous: bool,
) {
    let tile = own_tile(n, step, count, pairs, contiguous);
    let mut re = SharedMemory::<F>::new(2 * capacity);
    let mut im = SharedMemory::<F>::new(2 * capacity);
    load(input, &mut re, &mut im, &tile, true);
    let at = transform_tile(
        &mut re,
        &mut im,
        roots,
        radices,
        passes,
        &tile,
        0usize.runtime(),
        capacity,
    );
    let line = tile.first + tile.pair;
    let mut k = tile.begin;
    while k < tile.n {
        let y = cosine(&re, &im, roots, &tile, at, tile.pair, k);
        let to = capacity - at + place(&tile, tile.pair, k);
        let mut one = F::new(0.0);
        let mut other = F::new(0.0);
        if line < tile.count {
            one = gain(spectrum, gaussian, k, line, n, ny, nz);
        }
        if line + tile.pairs < tile.count {
            other = gain(spectrum, gaussian, k, line + tile.pairs, n, ny, nz);
        }
        re[to] = y.re * one;
        im[to] = y.im * other;
        k += tile.stride;
    }
    sync_cube();
    to_fourier(&mut re, &mut im, roots, &tile, capacity - at, capacity);
    let end = transform_tile(
        &mut re, &mut im, roots, radices, passes, &tile, at, capacity,
    );
    store(output, &re, &im, &tile, end);
}

/// `Y_k` of the Fourier transforms at `at`.
#[cube]
fn cosine<F: Float>(
    re: &SharedMemory<F>,
    im: &SharedMemory<F>,
    roots: &Array<F>,
    tile: &Tile,
    at: usize,
    pair: usize,
    k: usize,
) -> Complex<F> {
    let partner = select(k == 0, 0, tile.n - k);
    let a = at + place(tile, pair, k);
    let b = at + place(tile, pair, partner);
    let c = roots[2 * tile.n + k];
    let s = roots[3 * tile.n + k];
    Complex::<F> {
        re: c * (re[a] + re[b]) - s * (im[a] - im[b]),
        im: c * (im[a] + im[b]) + s * (re[a] - re[b]),
    }
}

/// `Z_k`, its parts exchanged, of the cosine transforms at `from`, into the other half.
#[cube]
fn to_fourier<F: Float>(
    re: &mut SharedMemory<F>,
    im: &mut SharedMemory<F>,
    roots: &Array<F>,
    tile: &Tile,
    from: usize,
    #[comptime] capacity: usize,
) {
    let mut k = tile.begin;
    while k < tile.n {
        let here = place(tile, tile.pair, k);
        let a = from + here;
        let mut x = re[a];
        let mut y = im[a];
        if k > 0 {
            let b = from + place(tile, tile.pair, tile.n - k);
            x += im[b];
            y -= re[b];
        }
        let c = roots[2 * tile.n + k];
        let s = roots[3 * tile.n + k];
        let to = capacity - from + here;
        im[to] = c * x + s * y;
        re[to] = c * y - s * x;
        k += tile.stride;
    }
    sync_cube();
}
