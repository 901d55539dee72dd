//! Generic functions that are compiled once for each number type, in this crate.
//!
//! Elsewhere a generic function is compiled in every program that calls it: without this, each test, bench and binding
//! would spend minutes compiling the stages again, and run them as slow as that program is compiled.

/// Declares a trait of both number types, and implements its functions by generic ones.
macro_rules! concrete {
    (
        $(#[$docs:meta])+ pub trait $trait:ident: $super:ident;
        $(fn $name:ident($($arg:ident: $type:ty),+ $(,)?) -> $out:ty = $body:expr;)+
    ) => {
        $(#[$docs])+
        pub trait $trait: $super {
            $(#[doc(hidden)] fn $name($($arg: $type),+) -> $out;)+
        }

        impl $trait for f32 {
            $(fn $name($($arg: $type),+) -> $out { $body })+
        }

        impl $trait for f64 {
            $(fn $name($($arg: $type),+) -> $out { $body })+
        }
    };
}

pub(crate) use concrete;
