//! The command line of isograd as a library: the program and the Python package call [`run`].
#![warn(missing_docs)]

mod args;
mod backend;
mod error;
mod fit;
mod gradcheck;
mod info;
mod interrupt;
mod orient;
mod outputs;
mod plot;
mod progress;
mod query;
mod reconstruct;
mod report;
mod resample;
mod sample;

use std::ffi::OsString;

use clap::Parser;
use peak_alloc::PeakAlloc;

use args::{Cli, Command};
use error::Error;
use progress::to_stderr;

/// Counts allocated bytes for the peak memory in reports.
#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Runs a command line, the first argument of which is the name of the program, and returns the exit status.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come this way too, with status 0.
            let _ = error.print();
            return error.exit_code().clamp(0, 255) as u8;
        }
    };
    interrupt::handle();
    match dispatch(&cli.command) {
        Ok(()) => 0,
        Err(error) => {
            to_stderr(&format!("error: {error}"));
            error.status()
        }
    }
}

fn dispatch(command: &Command) -> Result<(), Error> {
    start_threads(command)?;
    match command {
        Command::Reconstruct(args) => reconstruct::run(args),
        Command::Orient(args) => orient::run(args),
        Command::Sample(args) => sample::run(args),
        Command::Query(args) => query::run(args),
        Command::Fit(args) => fit::run(args),
        Command::Gradcheck(args) => gradcheck::run(args),
        Command::Info(args) => info::run(args),
    }
}

/// Starts the threads of `--threads`.
fn start_threads(command: &Command) -> Result<(), Error> {
    let running = match command {
        Command::Reconstruct(args) => &args.running,
        Command::Orient(args) => &args.running,
        Command::Sample(args) => &args.running,
        Command::Query(args) => &args.running,
        Command::Fit(args) => &args.running,
        Command::Gradcheck(args) => &args.running,
        Command::Info(_) => return Ok(()),
    };
    if let Some(threads) = running.threads {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads as usize);
        builder.build_global()?;
    }
    Ok(())
}
