//! Cosine transforms of lines in shared memory, by Fourier transforms.
//!
//! A group has a tile of pairs of lines; a pair travels as one complex line `x` of length `n`. With `v` its
//! Makhoul order (even places first, then odd places backwards), `Z = FFT(v)` and `w_k = exp(−iπk/2n)`, the
//! cosine transforms of both lines are `Y_k = w_k Z_k + w̄_k Z_{n−k}`. Backwards, `Z_k = w̄_k (Y_k − i Y_{n−k})`
//! with `Y_n = 0`, and `x` comes out times `2n`. The passes of the Fourier transform are Stockham's, from one
//! half of the shared memory to the other. Its inverse is itself, with real and imaginary parts exchanged.

use cubecl::prelude::*;

use super::axis::{Fourier, Lines};
use super::gain::{Gains, gain};
use crate::{Buffer, Device, Scalar};

/// Units of a group.
const BLOCK: u32 = 256;

/// Most bytes of shared memory for a group: with more, fewer groups run at a time.
const MEMORY: usize = 32 * 1024;

/// A tile has at least so many pairs, if there are: what is read together is then wide enough.
const PAIRS: usize = 8;

/// Groups that keep a large device busy.
const GROUPS: usize = 256;

/// Complex numbers of a tile, a power of two: the longest line.
pub(super) fn capacity<R: Runtime, T: Scalar>(device: &Device<R>) -> usize {
    let memory = &device.client().properties().hardware;
    let numbers = memory.max_shared_memory_size.min(MEMORY) / size_of::<T>();
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
    /// Lines → cosine transforms.
    pub(super) fn forward<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
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
        );
    }

    /// Cosine transforms → lines times `2n`.
    pub(super) fn inverse<R: Runtime>(
        &self,
        device: &Device<R>,
        lines: Lines,
        from: &Buffer<T>,
        to: &Buffer<T>,
    ) {
        let launch = Launch::new::<R, T>(device, lines);
        transform_back::launch::<T, R>(
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
) {
    let tile = tile(n, step, count, pairs, contiguous);
    let mut re = SharedMemory::<F>::new(2 * capacity);
    let mut im = SharedMemory::<F>::new(2 * capacity);
    load(input, &mut re, &mut im, &tile, true);
    let at = fourier(
        &mut re,
        &mut im,
        roots,
        radices,
        passes,
        &tile,
        0usize.runtime(),
        capacity,
    );
    let items = tile.pairs * tile.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(&tile);
    let mut k = first_place(&tile);
    while item < items {
        let y = cosine(&re, &im, roots, &tile, at, pair, k);
        write(output, &tile, pair, k, y.re);
        write(output, &tile, pair + tile.pairs, k, y.im);
        item += BLOCK as usize;
        pair = next_pair(&tile, pair, k);
        k = next_place(&tile, k);
    }
}

#[cube(launch)]
fn transform_back<F: Float>(
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
) {
    let tile = tile(n, step, count, pairs, contiguous);
    let mut re = SharedMemory::<F>::new(2 * capacity);
    let mut im = SharedMemory::<F>::new(2 * capacity);
    load(input, &mut re, &mut im, &tile, false);
    let begin = 0usize.runtime();
    to_fourier(&mut re, &mut im, roots, &tile, begin, capacity);
    let at = fourier(
        &mut re,
        &mut im,
        roots,
        radices,
        passes,
        &tile,
        capacity - begin,
        capacity,
    );
    store(output, &re, &im, &tile, at);
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
    let tile = tile(n, step, count, pairs, contiguous);
    let mut re = SharedMemory::<F>::new(2 * capacity);
    let mut im = SharedMemory::<F>::new(2 * capacity);
    load(input, &mut re, &mut im, &tile, true);
    let at = fourier(
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
    let end = fourier(
        &mut re, &mut im, roots, radices, passes, &tile, at, capacity,
    );
    store(output, &re, &im, &tile, end);
}

/// The lines of a group: `pairs` of them from the first on, paired with as many behind those. In shared
/// memory, places of a line are `pairs` apart.
#[derive(CubeType, Clone, Copy)]
struct Tile {
    /// Cells of a line.
    n: usize,
    /// Distance in memory between neighbours on a line.
    step: usize,
    /// Lines of the field.
    count: usize,
    pairs: usize,
    first: usize,
    /// Pair of a unit, where it stays with one: units go through its places from `begin` on by `stride`.
    pair: usize,
    begin: usize,
    stride: usize,
    /// Whether neighbours on a line are neighbours in memory, or else cells of neighbouring lines: the field
    /// is read and written in that order.
    #[cube(comptime)]
    contiguous: bool,
}

#[cube]
fn tile(n: usize, step: usize, count: usize, pairs: usize, #[comptime] contiguous: bool) -> Tile {
    let unit = UNIT_POS as usize;
    Tile {
        n,
        step,
        count,
        pairs,
        first: CUBE_POS * 2 * pairs,
        pair: unit % pairs,
        begin: unit / pairs,
        stride: BLOCK as usize / pairs,
        contiguous,
    }
}

/// Where a cell of a line is in the field.
#[cube]
fn cell(tile: &Tile, line: usize, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        line * tile.n + j
    } else {
        (line / tile.step) * (tile.n * tile.step) + line % tile.step + j * tile.step
    }
}

/// Where a place of a pair is in shared memory.
#[cube]
fn place(tile: &Tile, pair: usize, j: usize) -> usize {
    j * tile.pairs + pair
}

/// The pair that a unit reads or writes first.
#[cube]
fn first_pair(tile: &Tile) -> usize {
    if comptime!(tile.contiguous) {
        UNIT_POS as usize / tile.n
    } else {
        tile.pair
    }
}

/// The place of that.
#[cube]
fn first_place(tile: &Tile) -> usize {
    if comptime!(tile.contiguous) {
        UNIT_POS as usize % tile.n
    } else {
        tile.begin
    }
}

/// The pair that a unit reads or writes after place `j` of this one.
#[cube]
fn next_pair(tile: &Tile, pair: usize, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        let block = BLOCK as usize;
        let carry = j + block % tile.n >= tile.n;
        pair + block / tile.n + select(carry, 1, 0)
    } else {
        pair
    }
}

/// The place of that.
#[cube]
fn next_place(tile: &Tile, j: usize) -> usize {
    if comptime!(tile.contiguous) {
        let next = j + BLOCK as usize % tile.n;
        select(next >= tile.n, next - tile.n, next)
    } else {
        j + tile.stride
    }
}

/// Even places first, then odd places backwards.
#[cube]
fn makhoul(j: usize, n: usize) -> usize {
    let odd = j % 2;
    select(odd == 1, n - j.div_ceil(2), j / 2)
}

/// Reads the tile into the first half of the shared memory. Lines that don't exist are 0.
#[cube]
fn load<F: Float>(
    input: &Array<F>,
    re: &mut SharedMemory<F>,
    im: &mut SharedMemory<F>,
    tile: &Tile,
    #[comptime] reorder: bool,
) {
    let items = tile.pairs * tile.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(tile);
    let mut j = first_place(tile);
    while item < items {
        let mut to = j;
        if comptime!(reorder) {
            to = makhoul(j, tile.n);
        }
        let to = place(tile, pair, to);
        re[to] = read(input, tile, pair, j);
        im[to] = read(input, tile, pair + tile.pairs, j);
        item += BLOCK as usize;
        pair = next_pair(tile, pair, j);
        j = next_place(tile, j);
    }
    sync_cube();
}

/// Writes the lines, whose parts are exchanged, back from Makhoul order.
#[cube]
fn store<F: Float>(
    output: &mut Array<F>,
    re: &SharedMemory<F>,
    im: &SharedMemory<F>,
    tile: &Tile,
    at: usize,
) {
    let items = tile.pairs * tile.n;
    let mut item = UNIT_POS as usize;
    let mut pair = first_pair(tile);
    let mut j = first_place(tile);
    while item < items {
        let from = at + place(tile, pair, makhoul(j, tile.n));
        write(output, tile, pair, j, im[from]);
        write(output, tile, pair + tile.pairs, j, re[from]);
        item += BLOCK as usize;
        pair = next_pair(tile, pair, j);
        j = next_place(tile, j);
    }
}

#[cube]
fn read<F: Float>(input: &Array<F>, tile: &Tile, line: usize, j: usize) -> F {
    let mut value = F::new(0.0);
    if tile.first + line < tile.count {
        value = input[cell(tile, tile.first + line, j)];
    }
    value
}

#[cube]
fn write<F: Float>(output: &mut Array<F>, tile: &Tile, line: usize, j: usize, value: F) {
    if tile.first + line < tile.count {
        output[cell(tile, tile.first + line, j)] = value;
    }
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

/// The Fourier transforms of what is at `from`, one half of the shared memory; returns the half they are in.
#[cube]
fn fourier<F: Float>(
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
struct Complex<F: Float> {
    re: F,
    im: F,
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
