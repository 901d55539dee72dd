//! `isograd completions` and `isograd man`: files made from the definition of the command line.

use std::io::Write;

use clap::{Command, CommandFactory};
use isograd_io::atomic;

use crate::args::{self, Cli};
use crate::error::Error;
use crate::outputs::create_folder;
use crate::streams::{to_stdout, write_stdout};

/// Prints the completions of a shell.
pub fn completions(args: &args::Completions) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "isograd", &mut script);
    write_stdout(&script);
    Ok(())
}

/// Writes a manual page of the program and of each command.
///
/// # Errors
/// A folder that can't be created, or a failed write.
pub fn man(args: &args::Man) -> Result<(), Error> {
    create_folder(&args.output)?;
    let mut program = Cli::command().disable_help_subcommand(true);
    // Names the commands `isograd-reconstruct` and so on.
    program.build();
    let commands = program.get_subcommands().cloned();
    for command in commands.chain([program.clone()]) {
        write_page(args, command)?;
    }
    to_stdout(&format!("wrote {}", args.output.display()));
    Ok(())
}

fn write_page(args: &args::Man, command: Command) -> Result<(), Error> {
    let page = clap_mangen::Man::new(command);
    let mut text = Vec::new();
    // Memory has no errors of writing.
    let _ = page.render(&mut text);
    let path = args.output.join(page.get_filename());
    Ok(atomic::write(&path, |out| out.write_all(&text))?)
}
