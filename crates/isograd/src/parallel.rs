//! Parallel loops whose result does not depend on the number of threads.
//!
//! Work is cut where the number of threads has no say, and what the parts return is combined in their order. All loops of
//! the crate are here, and all of them end in [`run`]: what rayon adds to a loop is compiled once, and not for each closure.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::Real;

/// Items in one chunk of a loop over points or vertices.
pub(crate) const CHUNK: usize = 2048;

/// Pieces of a loop over few items.
const PIECES: usize = 64;

/// Calls `f` with each of `0..n`.
fn run(n: usize, f: &(dyn Fn(usize) + Sync)) {
    (0..n).into_par_iter().for_each(f);
}

/// `f` of every part and its number, in order. Parts are often chunks of slices that are walked together, as in
/// `map_each(out.chunks_mut(n).zip(points.chunks(n)), |k, (out, points)| …)`.
pub(crate) fn map_each<P: Send, R: Send>(
    parts: impl IntoIterator<Item = P>,
    f: impl Fn(usize, P) -> R + Sync,
) -> Vec<R> {
    let parts = parts.into_iter();
    let mut slots = Vec::with_capacity(parts.size_hint().0);
    for part in parts {
        slots.push(Mutex::new((Some(part), None)));
    }
    of_slots(slots, &f)
}

/// A part, until it is taken, and its result.
type Slot<P, R> = Mutex<(Option<P>, Option<R>)>;

/// Compiled once for each `P` and `R`.
fn of_slots<P: Send, R: Send>(
    slots: Vec<Slot<P, R>>,
    f: &(dyn Fn(usize, P) -> R + Sync),
) -> Vec<R> {
    run(slots.len(), &|k| {
        let part = unpoisoned(slots[k].lock()).0.take();
        let result = part.map(|part| f(k, part));
        unpoisoned(slots[k].lock()).1 = result;
    });
    let mut results = Vec::with_capacity(slots.len());
    for slot in slots {
        results.extend(unpoisoned(slot.into_inner()).1);
    }
    results
}

/// Calls `f` with every part and its number: [`map_each`] without results.
pub(crate) fn each<P: Send>(parts: impl IntoIterator<Item = P>, f: impl Fn(usize, P) + Sync) {
    map_each(parts, f);
}

/// [`map_each`] with a scratch, which `new` makes once for each thread. It holds whatever the part before left in it.
pub(crate) fn map_each_with<S: Send, P: Send, R: Send>(
    new: impl Fn() -> S + Sync,
    parts: impl IntoIterator<Item = P>,
    f: impl Fn(&mut S, usize, P) -> R + Sync,
) -> Vec<R> {
    let pool = Pool::default();
    map_each(parts, |k, part| {
        pool.with(&new, |scratch| f(scratch, k, part))
    })
}

/// Idle scratches, whose contents have no influence on results.
#[derive(Debug)]
pub(crate) struct Pool<S>(Mutex<Vec<S>>);

impl<S> Pool<S> {
    /// Runs `work` with a scratch of the pool, or with a new one where all are in use.
    pub(crate) fn with<R>(&self, new: impl FnOnce() -> S, work: impl FnOnce(&mut S) -> R) -> R {
        let idle = unpoisoned(self.0.lock()).pop();
        let mut scratch = idle.unwrap_or_else(new);
        let result = work(&mut scratch);
        unpoisoned(self.0.lock()).push(scratch);
        result
    }
}

impl<S> Default for Pool<S> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<S> Clone for Pool<S> {
    /// An empty pool.
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// No closure of a caller runs while one of the locks is held, so none can be poisoned.
fn unpoisoned<G>(lock: Result<G, PoisonError<G>>) -> G {
    lock.unwrap_or_else(PoisonError::into_inner)
}

/// `f(0), …, f(n − 1)`.
pub(crate) fn map<T: Clone + Default + Send>(n: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut out = Vec::new();
    fill(&mut out, n, f);
    out
}

/// [`map`] with a scratch, as [`map_each_with`] has it.
pub(crate) fn map_with<S: Send, T: Clone + Default + Send>(
    new: impl Fn() -> S + Sync,
    n: usize,
    f: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    let mut out = vec![T::default(); n];
    let size = piece(n);
    map_each_with(new, out.chunks_mut(size), |scratch, k, out| {
        for (i, out) in out.iter_mut().enumerate() {
            *out = f(scratch, k * size + i);
        }
    });
    out
}

/// Makes `out` hold `f(0), …, f(n − 1)`, in the memory that it has.
pub(crate) fn fill<T: Clone + Default + Send>(
    out: &mut Vec<T>,
    n: usize,
    f: impl Fn(usize) -> T + Sync,
) {
    resize(out, n, T::default());
    for_each(out, |i, item| *item = f(i));
}

/// Makes `out` hold `n` items, which are written later: `value`, or what it holds. New memory that is 0 is not touched here.
pub(crate) fn resize<T: Clone>(out: &mut Vec<T>, n: usize, value: T) {
    if out.capacity() < n {
        // Free before new memory is taken.
        *out = Vec::new();
        *out = vec![value; n];
    } else {
        out.resize(n, value);
    }
}

/// [`resize`] for items that are not numbers: all threads touch new memory first.
pub(crate) fn resize_large<T: Clone + Send + Sync>(out: &mut Vec<T>, n: usize, value: T) {
    if out.capacity() < n {
        *out = Vec::new();
        fill_large(out, n, &|_| value.clone());
    } else {
        out.resize(n, value);
    }
}

/// [`fill`] for items that are large or not numbers, which are written once and need no default. Compiled once for each `T`.
pub(crate) fn fill_large<T: Send>(out: &mut Vec<T>, n: usize, f: &(dyn Fn(usize) -> T + Sync)) {
    (0..n).into_par_iter().map(f).collect_into_vec(out);
}

/// Calls `f` with the index of each item, and the item.
pub(crate) fn for_each<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    let size = piece(items.len());
    in_pieces(items, size, &|k, piece| {
        for (i, item) in piece.iter_mut().enumerate() {
            f(k * size + i, item);
        }
    });
}

/// [`each`] of the chunks of a slice, compiled once for each `T`.
fn in_pieces<T: Send>(items: &mut [T], size: usize, f: &(dyn Fn(usize, &mut [T]) + Sync)) {
    each(items.chunks_mut(size), f);
}

/// `Σ_i f(i)` for `i` in `0..n`, several sums at once, in one fixed order.
pub(crate) fn sum_array<const M: usize>(
    n: usize,
    f: impl Fn(usize) -> [f64; M] + Sync,
) -> [f64; M] {
    let partial = of_ranges(n, CHUNK, &|items| {
        let mut total = [0.0; M];
        for i in items {
            let term = f(i);
            for m in 0..M {
                total[m] += term[m];
            }
        }
        total
    });
    let mut total = [0.0; M];
    for part in partial {
        for m in 0..M {
            total[m] += part[m];
        }
    }
    total
}

/// `join` of `none` and all `f(i)`, in any order of brackets: `join` must be associative to the last bit.
pub(crate) fn reduce<R: Clone + Send + Sync>(
    n: usize,
    none: R,
    f: impl Fn(usize) -> R + Sync,
    join: impl Fn(R, R) -> R + Sync,
) -> R {
    let of = |items: Range<usize>| items.fold(none.clone(), |all, i| join(all, f(i)));
    of_ranges(n, piece(n), &of)
        .into_iter()
        .fold(none.clone(), &join)
}

/// The least and the greatest of some numbers, but for NaN; infinity and minus infinity if there are none.
pub(crate) fn range<T: Real>(values: &[T]) -> [T; 2] {
    let wider = |[low, high]: [T; 2], [l, h]: [T; 2]| [low.min(l), high.max(h)];
    let none = [T::infinity(), T::neg_infinity()];
    let of = |_, chunk: &[T]| chunk.iter().fold(none, |ends, &v| wider(ends, [v, v]));
    map_each(values.chunks(CHUNK), of)
        .into_iter()
        .fold(none, wider)
}

/// How many of `0..n` are so.
pub(crate) fn count(n: usize, is_so: impl Fn(usize) -> bool + Sync) -> usize {
    let of = |items: Range<usize>| items.filter(|&i| is_so(i)).count();
    of_ranges(n, piece(n), &of).into_iter().sum()
}

/// The first of `0..n` that is so.
pub(crate) fn first(n: usize, is_so: impl Fn(usize) -> bool + Sync) -> Option<usize> {
    let of = |mut items: Range<usize>| items.find(|&i| is_so(i));
    of_ranges(n, piece(n), &of).into_iter().flatten().next()
}

/// The items of all `f(i)`, which may be options, in order.
pub(crate) fn flat_map<R: Clone + Send, I: IntoIterator<Item = R>>(
    n: usize,
    f: impl Fn(usize) -> I + Sync,
) -> Vec<R> {
    let of = |items: Range<usize>| {
        let mut found = Vec::new();
        items.for_each(|i| found.extend(f(i)));
        found
    };
    of_ranges(n, piece(n), &of).concat()
}

/// `f` of each range of `size` of `0..n`, compiled once for each `R`.
fn of_ranges<R: Send>(n: usize, size: usize, f: &(dyn Fn(Range<usize>) -> R + Sync)) -> Vec<R> {
    let ranges = (0..n.div_ceil(size)).map(|k| k * size..n.min((k + 1) * size));
    map_each(ranges, |_, range| f(range))
}

/// Items in a piece of a loop over `n`: few may each take long.
fn piece(n: usize) -> usize {
    n.div_ceil(PIECES).clamp(1, CHUNK)
}

/// Both results, found side by side.
pub(crate) fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    let (mut of_a, mut of_b) = (None, None);
    let (mut a, mut b) = (Some(a), Some(b));
    both(&mut || of_a = a.take().map(|a| a()), &mut || {
        of_b = b.take().map(|b| b())
    });
    match (of_a, of_b) {
        (Some(a), Some(b)) => (a, b),
        _ => unreachable!("rayon calls both"),
    }
}

/// Compiled once, as [`run`] is.
fn both(a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send)) {
    rayon::join(a, b);
}
