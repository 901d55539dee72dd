//! Arguments of `sdf` and `isosurface`.

use std::path::PathBuf;

use clap::Args;
use isograd::distance::Band;

use super::reading::MemoryArgs;
use super::{CellArgs, Running, STATUS, finite};

/// Arguments of `sdf`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Sdf {
    /// The mesh: PLY, OBJ, STL, OFF, GLB or VTP; `-` is standard input (PLY)
    pub mesh: PathBuf,
    /// Output: .vti or .npz
    #[arg(short, long, value_name = "FIELD")]
    pub output: PathBuf,
    /// Arguments of the grid.
    #[command(flatten)]
    pub cells: CellArgs,
    /// Distance from the surface up to which φ is computed, in the mesh's unit
    #[arg(
        long,
        value_name = "H|full",
        default_value = "full",
        help_heading = "Method"
    )]
    pub band: Band,
    /// Limit on memory.
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// Arguments of the run.
    #[command(flatten)]
    pub running: Running,
}

/// Arguments of `isosurface`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Isosurface {
    /// The field: .vti or .npz
    pub field: PathBuf,
    /// Output: .ply, .obj, .stl, .off, .glb or .vtp
    #[arg(short, long, value_name = "MESH")]
    pub output: PathBuf,
    /// Value of the field at the surface; below it is inside
    #[arg(long, value_name = "VALUE", default_value = "0", value_parser = finite,
        allow_negative_numbers = true)]
    pub level: f64,
    /// Limit on memory.
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// Arguments of the run.
    #[command(flatten)]
    pub running: Running,
}
