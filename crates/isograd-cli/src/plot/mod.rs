//! Pictures: slices of a field with the spread of `|∇φ|`, and views of clouds and surfaces.
//!
//! Everything is drawn here, in a few small files, with a font that travels in the program: no display,
//! no system fonts, the same pixels on every machine.

mod axis;
mod canvas;
mod color;
mod comparison;
mod losses;
mod overview;
mod panel;
mod scene;
mod slice;
mod slices;

use std::path::Path;

pub use canvas::Canvas;
pub use comparison::{Comparison, side_by_side};
pub use losses::losses;
pub use overview::overview;
pub use scene::Camera;
pub use slices::slices;

/// Writes a picture as PNG; the file appears whole or not at all.
///
/// # Errors
/// An error of the operating system.
pub fn write(path: &Path, picture: &Canvas) -> Result<(), isograd_io::Error> {
    isograd_io::atomic::write(path, |out| picture.write_png(out))
}
