//! Loops compiled for the instruction set of the processor.

use pulp::{Arch, Simd, WithSimd};

/// Runs `f` compiled with the widest instruction set that `arch` found. `f` and what it calls in its
/// loops are to be `#[inline(always)]`: a function that stands alone is compiled for the oldest set.
///
/// `pulp` takes closures too, but as `FnOnce`, and the compiler calls most closures through a shim of that
/// trait which it need not inline: such a loop may silently end up in baseline code.
#[inline(always)]
pub(crate) fn dispatch<R>(arch: Arch, f: impl FnMut() -> R) -> R {
    arch.dispatch(Inline(f))
}

/// Evaluates an expression with the widest instruction set that `arch` found: [`dispatch`] of an inlined closure.
macro_rules! vectorized {
    ($arch:expr, $body:expr) => {
        $crate::simd::dispatch(
            $arch,
            #[inline(always)]
            || $body,
        )
    };
}
pub(crate) use vectorized;

struct Inline<F>(F);

impl<R, F: FnMut() -> R> WithSimd for Inline<F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> R {
        (self.0)()
    }
}

/// `a b + c`, rounded once where the instruction set `S` does that in one step, else twice.
#[inline(always)]
pub(crate) fn multiply_add<S: Simd>(a: f32, b: f32, c: f32) -> f32 {
    // The sets with vectors of more than sixteen bytes have the instruction. In others it may be a call.
    if size_of::<S::f32s>() > 16 {
        a.mul_add(b, c)
    } else {
        a * b + c
    }
}
