//! The command line of isograd as a library: the program and the Python package call [`run`].
#![warn(missing_docs)]

mod args;
mod backend;
mod batch;
mod clean;
mod closed;
mod error;
mod fit;
mod generate;
mod gradcheck;
mod info;
mod inputs;
mod interrupt;
mod isosurface;
mod memory;
mod orient;
mod outputs;
mod plot;
mod prediction;
mod progress;
mod query;
mod reconstruct;
mod report;
mod resample;
mod rounding;
mod sample;
mod sdf;
mod sequence;
mod streams;
mod surface;
mod threads;

use std::ffi::OsString;
use std::path::Path;

use clap::Parser;
use isograd::{Field, Real};
use isograd_io::printable;

use args::{Cli, Command};
use error::Error;
use streams::to_stderr;

pub use memory::Allocator;
pub use surface::{Error as SurfaceError, Omitted, write as write_surface};

/// Counts allocated bytes for the peak memory in reports.
#[global_allocator]
pub static ALLOCATOR: Allocator = Allocator;

/// Runs a command line, the first argument of which is the name of the program, and returns the exit status.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    ALLOCATOR.end_on_failure();
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come this way too, with status 0. An argument may be the name of a file.
            let arguments = arguments
                .iter()
                .map(|text| printable(&text.to_string_lossy()));
            let shown = Cli::try_parse_from(arguments).err();
            streams::print_clap(shown.as_ref().unwrap_or(&error));
            let status = error.exit_code().clamp(0, 255) as u8;
            return streams::finish().map_or_else(report, |()| status);
        }
    };
    interrupt::handle();
    let result = dispatch(&cli.command);
    // An error of the work comes first.
    let printed = streams::finish();
    interrupt::wait_if_stopping();
    result.and(printed).map_or_else(report, |()| 0)
}

/// Prints an error and returns its exit status.
fn report(error: Error) -> u8 {
    if !error.is_broken_pipe() {
        to_stderr(&format!("error: {error}"));
    }
    error.status()
}

/// Writes the picture `slices.png` of a field: three slices, and the spread of `|∇φ|`.
///
/// # Errors
/// A failed write, which leaves the file at `path` unchanged.
pub fn write_slices<T: Real>(path: &Path, field: &Field<T>) -> Result<(), isograd_io::Error> {
    plot::write(path, &plot::slices(field))
}

fn dispatch(command: &Command) -> Result<(), Error> {
    threads::start(running(command).and_then(|running| running.threads))?;
    match command {
        Command::Reconstruct(args) => reconstruct::run(args),
        Command::Orient(args) => orient::run(args),
        Command::Sample(args) => sample::run(args),
        Command::Clean(args) => clean::run(args),
        Command::Sdf(args) => sdf::run(args),
        Command::Isosurface(args) => isosurface::run(args),
        Command::Query(args) => query::run(args),
        Command::Fit(args) => fit::run(args),
        Command::Gradcheck(args) => gradcheck::run(args),
        Command::Info(args) => info::run(args),
        Command::Completions(args) => generate::completions(args),
        Command::Man(args) => generate::man(args),
    }
}

fn running(command: &Command) -> Option<&args::Running> {
    match command {
        Command::Reconstruct(args) => Some(&args.running),
        Command::Orient(args) => Some(&args.running),
        Command::Sample(args) => Some(&args.running),
        Command::Clean(args) => Some(&args.running),
        Command::Sdf(args) => Some(&args.running),
        Command::Isosurface(args) => Some(&args.running),
        Command::Query(args) => Some(&args.running),
        Command::Fit(args) => Some(&args.running),
        Command::Gradcheck(args) => Some(&args.running),
        Command::Info(_) | Command::Completions(_) | Command::Man(_) => None,
    }
}
