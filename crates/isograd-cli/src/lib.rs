//! The command line of isograd, as a library: `main.rs` only calls [`run`].
#![warn(missing_docs)]

pub mod args;
pub mod backend;
pub mod error;
pub mod fit;
pub mod gradcheck;
pub mod info;
mod interrupt;
pub mod orient;
pub mod outputs;
pub mod plot;
pub mod progress;
pub mod query;
pub mod reconstruct;
pub mod report;
mod resample;
pub mod sample;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;
use peak_alloc::PeakAlloc;

use args::{Cli, Command, Running};
use error::Error;
use progress::to_stderr;

/// Counts, so that the report can say how much memory was held at most.
#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Runs the program on its arguments, the first of which is its own name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come this way too, with status 0.
            let _ = error.print();
            return ExitCode::from(error.exit_code().clamp(0, 255) as u8);
        }
    };
    interrupt::handle();
    match dispatch(&cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            to_stderr(&format!("error: {error}"));
            ExitCode::from(error.status())
        }
    }
}

fn dispatch(command: &Command) -> Result<(), Error> {
    match command {
        Command::Reconstruct(args) => {
            start_threads(args.running)?;
            reconstruct::run(args)
        }
        Command::Orient(args) => {
            start_threads(args.running)?;
            orient::run(args)
        }
        Command::Sample(args) => {
            start_threads(args.running)?;
            sample::run(args)
        }
        Command::Query(args) => {
            start_threads(args.running)?;
            query::run(args)
        }
        Command::Fit(args) => {
            start_threads(args.running)?;
            fit::run(args)
        }
        Command::Gradcheck(args) => {
            start_threads(args.running)?;
            gradcheck::run(args)
        }
        Command::Info(args) => info::run(args),
    }
}

fn start_threads(running: Running) -> Result<(), Error> {
    let Some(threads) = running.threads else {
        return Ok(());
    };
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads as usize);
    Ok(builder.build_global()?)
}
