//! Cosine transforms of lines in shared memory, by Fourier transforms.
//!
//! A group has a tile of pairs of lines; a pair travels as one complex line `x` of length `n`. With `v` its
//! Makhoul order (even places first, then odd places backward), `Z = FFT(v)` and `w_k = exp(−iπk/2n)`, the
//! cosine transforms of both lines are `Y_k = w_k Z_k + w̄_k Z_{n−k}`. Backwards, `Z_k = w̄_k (Y_k − i Y_{n−k})`
//! with `Y_n = 0`, and `x` comes out times `2n`. The passes of the Fourier transform are Stockham's, from one
//! half of the shared memory to the other. Its inverse is itself, with real and imaginary parts exchanged. Lengths with
//! large prime factors are transformed by Bluestein's chirp, a convolution of a longer line.

mod fourier;
mod tile;

use cubecl::prelude::*;

use super::axis::{Fourier, Lines};
use super::gain::{Gains, Spectrum, gain};
use crate::device::{Ready, launch};
use crate::{Buffer, Device, Scalar};
use fourier::{Complex, transform_tile};
use tile::{
    Shared, Tile, first_pair, first_place, load, new_shared, next_pair, next_place, own_tile,
    place, store, write,
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

/// Tables of the Fourier transforms in kernels.
#[derive(CubeLaunch, CubeType)]
pub(super) struct Tables<F: Float + CubeElement> {
    roots: Array<F>,
    radices: Array<u32>,
    chirp: Array<F>,
    passes: usize,
    /// Complex numbers of a Fourier transform.
    length: usize,
    /// Pairs of lines of a tile.
    pairs: usize,
}

/// Constants of a kernel.
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
pub(super) struct Layout {
    /// Complex numbers of a half of the shared memory.
    capacity: usize,
    contiguous: bool,
    chirped: bool,
    inverse: bool,
}

/// Arguments of a launch.
struct Launch<T: Scalar, R: Runtime> {
    units: usize,
    tables: Ready<TablesLaunch<T, R>>,
    layout: Ready<Layout>,
}

impl<T: Scalar> Fourier<T> {
    fn launch<R: Runtime>(&self, device: &Device<R>, lines: Lines, inverse: bool) -> Launch<T, R> {
        let capacity = capacity::<R, T>(device);
        // A unit stays with one pair.
        let mut pairs = (1 << (capacity / self.length).ilog2()).min(BLOCK as usize);
        while pairs > PAIRS && lines.count < 2 * pairs * GROUPS {
            pairs /= 2;
        }
        let tiles = lines.count.div_ceil(2 * pairs);
        Launch {
            units: tiles * BLOCK as usize,
            tables: Ready::new(TablesLaunch::new(
                self.roots.arg(),
                self.radices.arg(),
                self.chirp.as_ref().unwrap_or(&self.roots).arg(),
                self.radices.len(),
                self.length,
                pairs,
            )),
            layout: Ready::new(Layout {
                capacity,
                contiguous: lines.step == 1,
                chirped: self.chirp.is_some(),
                inverse,
            }),
        }
    }

    /// Lines → cosine transforms; or, if `inverse`, cosine transforms → lines times `2n`.
    pub(super) fn transform<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
        inverse: bool,
    ) {
        let launch = self.launch(device, lines, inverse);
        launch!(device, launch.units, BLOCK => transform<T>(
            from, to, lines, launch.tables, launch.layout,
        ));
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
        let launch = self.launch(device, lines, false);
        launch!(device, launch.units, BLOCK => filter<T>(
            from, to, lines, launch.tables, Ready::new(gains.arg()), launch.layout,
        ));
    }
}

#[cube(launch)]
fn transform<F: Float + CubeElement>(
    input: &Array<F>,
    output: &mut Array<F>,
    lines: &Lines,
    tables: &Tables<F>,
    #[comptime] layout: Layout,
) {
    let tile = own_tile::<F>(lines, tables, layout);
    let mut shared = new_shared::<F>(layout);
    load(input, &mut shared, &tile, comptime!(!layout.inverse));
    let mut from = 0usize.runtime();
    if comptime!(layout.inverse) {
        to_fourier(&mut shared, tables, &tile, from);
        from = shared.half - from;
    }
    let at = transform_tile(&mut shared, tables, &tile, from, layout.chirped);
    if comptime!(layout.inverse) {
        store(output, &shared, &tile, at);
    } else {
        store_cosines(output, &shared, tables, &tile, at);
    }
}

/// Writes the cosine transforms of the Fourier transforms at `at`.
#[cube]
fn store_cosines<F: Float + CubeElement>(
    output: &mut Array<F>,
    shared: &Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    at: usize,
) {
    let items = tile.pairs * tile.lines.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(tile);
    let mut k = first_place(tile);
    while item < items {
        let y = cosine(shared, tables, tile, at, pair, k);
        write(output, tile, pair, k, y.re);
        write(output, tile, pair + tile.pairs, k, y.im);
        item += BLOCK as usize;
        pair = next_pair(tile, pair, k);
        k = next_place(tile, k);
    }
}

#[cube(launch)]
fn filter<F: Float + CubeElement>(
    input: &Array<F>,
    output: &mut Array<F>,
    lines: &Lines,
    tables: &Tables<F>,
    gains: &Spectrum<F>,
    #[comptime] layout: Layout,
) {
    let tile = own_tile::<F>(lines, tables, layout);
    let mut shared = new_shared::<F>(layout);
    load(input, &mut shared, &tile, true);
    let start = 0usize.runtime();
    let at = transform_tile(&mut shared, tables, &tile, start, layout.chirped);
    let line = tile.first + tile.pair;
    let mut k = tile.begin;
    while k < lines.n {
        let y = cosine(&shared, tables, &tile, at, tile.pair, k);
        let to = shared.half - at + place(&tile, tile.pair, k);
        let mut one = F::new(0.0);
        let mut other = F::new(0.0);
        if line < lines.count {
            one = gain(gains, k, line);
        }
        if line + tile.pairs < lines.count {
            other = gain(gains, k, line + tile.pairs);
        }
        shared.re[to] = y.re * one;
        shared.im[to] = y.im * other;
        k += tile.stride;
    }
    sync_cube();
    let other = shared.half - at;
    to_fourier(&mut shared, tables, &tile, other);
    let end = transform_tile(&mut shared, tables, &tile, at, layout.chirped);
    store(output, &shared, &tile, end);
}

/// `Y_k` of the Fourier transforms at `at`.
#[cube]
fn cosine<F: Float + CubeElement>(
    shared: &Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    at: usize,
    pair: usize,
    k: usize,
) -> Complex<F> {
    let partner = select(k == 0, 0, tile.lines.n - k);
    let a = at + place(tile, pair, k);
    let b = at + place(tile, pair, partner);
    let c = tables.roots[2 * tile.length + k];
    let s = tables.roots[2 * tile.length + tile.lines.n + k];
    Complex::<F> {
        re: c * (shared.re[a] + shared.re[b]) - s * (shared.im[a] - shared.im[b]),
        im: c * (shared.im[a] + shared.im[b]) + s * (shared.re[a] - shared.re[b]),
    }
}

/// `Z_k`, its parts exchanged, of the cosine transforms at `from`, into the other half.
#[cube]
fn to_fourier<F: Float + CubeElement>(
    shared: &mut Shared<F>,
    tables: &Tables<F>,
    tile: &Tile,
    from: usize,
) {
    let mut k = tile.begin;
    while k < tile.lines.n {
        let here = place(tile, tile.pair, k);
        let a = from + here;
        let mut x = shared.re[a];
        let mut y = shared.im[a];
        if k > 0 {
            let b = from + place(tile, tile.pair, tile.lines.n - k);
            x += shared.im[b];
            y -= shared.re[b];
        }
        let c = tables.roots[2 * tile.length + k];
        let s = tables.roots[2 * tile.length + tile.lines.n + k];
        let to = shared.half - from + here;
        shared.im[to] = c * x + s * y;
        shared.re[to] = c * y - s * x;
        k += tile.stride;
    }
    sync_cube();
}
