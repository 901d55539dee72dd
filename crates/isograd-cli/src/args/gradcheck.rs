//! Arguments of `gradcheck`.

use std::path::PathBuf;

use clap::Args;

use super::{GridArgs, MethodArgs, ReadingArgs, Running, STATUS, positive};

/// Arguments of `gradcheck`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Gradcheck {
    /// The cloud, in any format that `reconstruct` reads
    pub cloud: PathBuf,
    /// The table as numbers: .json
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub report: Option<PathBuf>,

    /// Arguments of the grid.
    #[command(flatten)]
    pub grid: GridArgs,
    /// Arguments of the method.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Arguments of the input.
    #[command(flatten)]
    pub reading: ReadingArgs,

    /// Displacement of the large step in both directions, in cells
    #[arg(long, value_name = "CELLS", default_value = "0.5", value_parser = positive,
        allow_negative_numbers = true, help_heading = "Comparison")]
    pub step: f64,
    /// Largest relative error of the pullback against the small step; the command fails beyond it
    #[arg(long, value_name = "SHARE", default_value = "1e-3", value_parser = positive,
        help_heading = "Comparison")]
    pub tolerance: f64,
    /// Seed of the random directions
    #[arg(
        long,
        value_name = "S",
        default_value = "1",
        help_heading = "Comparison"
    )]
    pub seed: u64,

    /// Arguments of the run.
    #[command(flatten)]
    pub running: Running,
}
