//! Arguments of `completions` and `man`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

use super::STATUS;

/// Arguments of `completions`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Completions {
    /// The shell; its completions go to standard output
    pub shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Man {
    /// Folder for isograd.1 and a page of each command, such as ~/.local/share/man/man1
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
}
