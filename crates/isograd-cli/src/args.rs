//! Arguments of the command line.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand, ValueEnum};
use isograd::Backend;

mod clean;
mod field;
mod fit;
mod generate;
mod gradcheck;
mod orient;
mod pipeline;
mod reading;
#[cfg(test)]
mod tests;

pub use clean::Clean;
pub use field::{Isosurface, Sdf};
pub use fit::{Decay, Fit, Method, TargetKind};
pub use generate::{Completions, Man};
pub use gradcheck::Gradcheck;
pub use orient::{OrientArgs, OrientCloud};
pub use pipeline::{CellArgs, GridArgs, MethodArgs};
pub use reading::ReadingArgs;

/// Reconstructs exact signed distance fields, closed meshes and oriented normals from point clouds. Every result ends with a
/// verdict, good, check or bad, that says whether it can be trusted.
#[derive(Debug, Parser)]
#[command(name = "isograd", version, after_help = format!("{EXAMPLE}\n\n{STATUS}"))]
pub struct Cli {
    /// Command.
    #[command(subcommand)]
    pub command: Command,
}

const EXAMPLE: &str =
    "Example, which writes field, mesh, points and report of a cloud into the folder out:
  isograd reconstruct cloud.ply -o out";

const STATUS: &str = "Exit status: 0 done, 1 the work failed (of several clouds: at least one), 2 the command line is wrong, \
3 the result is bad (reconstruct --strict), 130 stopped by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP, 141 if the reader of the output went away.";

/// Commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Reconstruct the signed distance field and the surface of a point cloud
    Reconstruct(Box<Reconstruct>),
    /// Compute the outward normals of a point cloud
    Orient(Box<OrientCloud>),
    /// Sample a parametric shape as a point cloud
    Sample(Sample),
    /// Remove points and normals that are not finite, duplicates and outliers of a point cloud, and thin it
    Clean(Clean),
    /// Compute the signed distance field of a mesh
    Sdf(Box<Sdf>),
    /// Extract the surface of a field as a mesh
    Isosurface(Isosurface),
    /// Compute signed distances of points to a mesh or in a field
    Query(Query),
    /// Optimize a shape, or points, until their field matches a target
    Fit(Box<Fit>),
    /// Compare the gradients of a cloud's field with finite differences
    Gradcheck(Box<Gradcheck>),
    /// Describe the content of a file
    Info(Info),
    /// Print the completions of a shell
    Completions(Completions),
    /// Write manual pages
    Man(Man),
}

/// Arguments of `reconstruct`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Reconstruct {
    /// The cloud: PLY, PCD, LAS, PTS, XYZ, XYZN, XYZRGB, CSV, TXT, OBJ, OFF, STL, GLB, NPY, NPZ or VTP; `-` is standard input
    /// (PLY or text). More than one, or the folder that they are in, are reconstructed one after another; outputs of each
    /// go to DIR/NAME, where NAME is its name without extension, or to where `{}` in the name of an output stands for NAME
    #[arg(value_name = "CLOUD", required = true, num_args = 1..)]
    pub clouds: Vec<PathBuf>,
    /// Write mesh.ply, sdf.vti, points.ply, report.json and slices.png into DIR; of several clouds into DIR/NAME
    #[arg(short, long, value_name = "DIR", help_heading = "Outputs")]
    pub output: Option<PathBuf>,
    /// The surface: .ply, .obj, .stl, .off, .glb or .vtp; `-` is standard output (PLY)
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub mesh: Option<PathBuf>,
    /// The signed distance field: .vti or .npz; `-` is standard output (VTI)
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub sdf: Option<PathBuf>,
    /// The points with normals and confidence: .ply or .npz; `-` is standard output (PLY)
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub points: Option<PathBuf>,
    /// Settings, measurements, times and warnings: .json; `-` is standard output
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub report: Option<PathBuf>,
    /// Three slices of the field and histograms of |∇φ|: .png
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub plot: Option<PathBuf>,
    /// Cloud, surface and slice side by side: .png
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub picture: Option<PathBuf>,
    /// Azimuth and elevation of the camera of --picture, in degrees
    #[arg(long, value_name = "DEGREES", num_args = 2, allow_negative_numbers = true,
        value_parser = finite, requires = "picture", help_heading = "Outputs")]
    pub view: Option<Vec<f64>>,

    /// Arguments of the grid.
    #[command(flatten)]
    pub grid: GridArgs,
    /// Arguments of the method.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Take N samples of the surface of a mesh file instead of its vertices
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=50_000_000),
        help_heading = "Method")]
    pub sample: Option<u32>,
    /// Arguments of the input.
    #[command(flatten)]
    pub reading: ReadingArgs,

    /// The clouds are steps in time: all have one grid, around all of them, and from the second on each normal keeps its
    /// side (--orient previous), for which the points must be as many, in the same order
    #[arg(long, help_heading = "Several clouds")]
    pub sequence: bool,
    /// Leave out a cloud if all its outputs exist and none is older than the cloud: to go on after an interruption
    #[arg(long, help_heading = "Several clouds")]
    pub skip_existing: bool,

    /// Exit with status 3 if the verdict is bad, that in the report of a cloud left out included; all outputs are written
    #[arg(long, help_heading = "Running")]
    pub strict: bool,
    /// Number type of the computation and of the outputs
    #[arg(long, default_value = "f32", help_heading = "Running")]
    pub precision: Precision,
    /// Device: cpu, cuda (or cuda:1, the second device), vulkan, or auto (a GPU if available, else the CPU). GPUs need a
    /// program built with --features vulkan,cuda
    #[arg(long, default_value = "cpu", help_heading = "Running")]
    pub backend: Backend,
    /// Arguments of the run.
    #[command(flatten)]
    pub running: Running,
}

/// Arguments of `sample`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Sample {
    /// Name of the shape
    #[arg(required_unless_present = "list")]
    pub shape: Option<String>,
    /// List the shapes and their parameters
    #[arg(long, exclusive = true)]
    pub list: bool,
    /// Number of samples
    #[arg(short = 'n', value_name = "N", required_unless_present = "list",
        value_parser = clap::value_parser!(u32).range(1..))]
    pub number: Option<u32>,
    /// Output: .ply, .npz, .pcd, .xyz, .csv or .txt; `-` is standard output (PLY)
    #[arg(short, long, value_name = "CLOUD", required_unless_present = "list")]
    pub output: Option<PathBuf>,
    /// Value of a parameter of the shape
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = name_and_value,
        allow_hyphen_values = true)]
    pub parameters: Vec<(String, f64)>,
    /// Seed of the random numbers
    #[arg(long, value_name = "S", default_value = "1")]
    pub seed: u64,
    /// Distribution of the samples
    #[arg(long, default_value = "even")]
    pub layout: Layout,
    /// Ratio of the densities at the high and the low end of an axis, such as `x:10`
    #[arg(long, value_name = "AXIS:RATIO")]
    pub density: Option<AxisRatio>,
    /// Number type of the coordinates
    #[arg(long, default_value = "f32")]
    pub precision: Precision,
    /// Arguments of the run.
    #[command(flatten)]
    pub running: Running,
}

/// Arguments of `query`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Query {
    /// A mesh (.ply, .obj, .stl, .off, .glb, .vtp) or a field (.vti, .npz)
    #[arg(value_name = "MESH_OR_SDF")]
    pub source: PathBuf,
    /// The points; `-` is standard input
    #[arg(long, value_name = "POINTS")]
    pub at: PathBuf,
    /// Output, the points with the results: .ply, .npz, .pcd, .xyz, .csv or .txt; `-` is standard output (PLY)
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Arguments of the input; columns are those of the points.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Arguments of the run.
    #[command(flatten)]
    pub running: Running,
}

/// Arguments of `info`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Info {
    /// The file; `-` is standard input
    pub file: PathBuf,
    /// Arguments of the input.
    #[command(flatten)]
    pub reading: ReadingArgs,
}

/// Arguments of the run, which have no influence on the results.
#[derive(Clone, Copy, Debug, Args)]
pub struct Running {
    /// Number of threads [default: one per core]; at most 16 are started, or one per core if that is more
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024),
        help_heading = "Running")]
    pub threads: Option<u32>,
    /// Print only warnings and errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Running")]
    pub quiet: bool,
    /// Print the stages and their times
    #[arg(short, long, help_heading = "Running")]
    pub verbose: bool,
}

/// Number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Precision {
    /// Single precision
    F32,
    /// Double precision
    F64,
}

/// See [`isograd_shapes::Layout`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Layout {
    /// Evenly spaced
    Even,
    /// Independent of each other
    Random,
}

/// An axis and a ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRatio {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Positive.
    pub ratio: f64,
}

impl FromStr for AxisRatio {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("'{text}' is not AXIS:RATIO, such as x:10");
        let (axis, ratio) = text.split_once(':').ok_or_else(wrong)?;
        let axis = ["x", "y", "z"]
            .iter()
            .position(|name| *name == axis)
            .ok_or_else(wrong)?;
        Ok(Self {
            axis,
            ratio: positive(ratio)?,
        })
    }
}

fn finite(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_string())?;
    value
        .is_finite()
        .then_some(value)
        .ok_or_else(|| "not finite".into())
}

fn positive(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    (value > 0.0)
        .then_some(value)
        .ok_or_else(|| "it must be above 0".into())
}

fn not_negative(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    (value >= 0.0)
        .then_some(value)
        .ok_or_else(|| "it must be 0 or more".into())
}

fn name_and_value(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("it must be NAME=VALUE")?;
    Ok((name.trim().to_string(), finite(value.trim())?))
}
