//! Arguments of the command line.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand, ValueEnum};
use isograd::Backend;

mod clean;
mod field;
mod fit;
mod gradcheck;
mod orient;
mod pipeline;
mod reading;

pub use clean::Clean;
pub use field::{Isosurface, Sdf};
pub use fit::{Decay, Fit, Method, TargetKind};
pub use gradcheck::Gradcheck;
pub use orient::{OrientArgs, OrientCloud};
pub use pipeline::{CellArgs, GridArgs, MethodArgs};
pub use reading::ReadingArgs;

/// Point cloud in, exact signed distance field out.
#[derive(Debug, Parser)]
#[command(name = "isograd", version, about, after_help = STATUS)]
pub struct Cli {
    /// Command.
    #[command(subcommand)]
    pub command: Command,
}

const STATUS: &str = "Exit status: 0 done, 1 the work failed, 2 the command line is wrong, \
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
    /// Remove duplicates and outliers of a point cloud, and thin it
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
}

/// Arguments of `reconstruct`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Reconstruct {
    /// The cloud: PLY, XYZ, CSV, TXT, OBJ, STL, NPY, NPZ or VTP; `-` is standard input (PLY or text)
    pub cloud: PathBuf,
    /// Write mesh.ply, sdf.vti, points.ply, report.json and slices.png into DIR
    #[arg(short, long, value_name = "DIR", help_heading = "Outputs")]
    pub output: Option<PathBuf>,
    /// The surface: .ply, .obj, .stl or .vtp
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub mesh: Option<PathBuf>,
    /// The signed distance field: .vti or .npz
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub sdf: Option<PathBuf>,
    /// The points with normals and confidence: .ply or .npz
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub points: Option<PathBuf>,
    /// Settings, measurements, times and warnings: .json
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

    /// Exit with status 3 if the verdict is bad; all outputs are written
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
    /// Output: .ply, .npz, .xyz, .csv or .txt
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
    /// A mesh (.ply, .obj, .stl, .vtp) or a field (.vti, .npz)
    #[arg(value_name = "MESH_OR_SDF")]
    pub source: PathBuf,
    /// The points; `-` is standard input
    #[arg(long, value_name = "POINTS")]
    pub at: PathBuf,
    /// Output, the points with the results: .ply, .npz, .xyz, .csv or .txt
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

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn negative_bounds_and_parameters_are_values_not_flags() {
        let parse = |line: &str| Cli::try_parse_from(line.split(' '));
        let cli = parse("isograd reconstruct a.ply --bounds -1 -1 -1 1 1 1 --radius 0.2");
        let Ok(Cli {
            command: Command::Reconstruct(args),
        }) = cli
        else {
            panic!("{cli:?}");
        };
        assert_eq!(
            args.grid.cells.bounds,
            Some(vec![-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
        );
        assert_eq!(
            args.method.normals.radius,
            isograd::neighbors::Radius::Fixed(0.2)
        );
        let cli = parse("isograd orient a.ply -o b.ply --sensor -1,0,2e1 --sensor 3,-4,5");
        let Ok(Cli {
            command: Command::Orient(args),
        }) = cli
        else {
            panic!("{cli:?}");
        };
        assert_eq!(args.normals.sensor, [[-1.0, 0.0, 20.0], [3.0, -4.0, 5.0]]);
        let cli = parse("isograd sample fish -n 5 -o a.ply --param time=-0.5");
        let Ok(Cli {
            command: Command::Sample(args),
        }) = cli
        else {
            panic!("{cli:?}");
        };
        assert_eq!(args.parameters, [("time".to_string(), -0.5)]);
    }

    #[test]
    fn values_that_make_no_sense_are_refused() {
        for line in [
            "isograd",
            "isograd reconstruct",
            "isograd reconstruct a.ply --resolution 0",
            "isograd reconstruct a.ply --resolution 64 --spacing 0.1",
            "isograd reconstruct a.ply --spacing -1",
            "isograd reconstruct a.ply --radius wide",
            "isograd reconstruct a.ply --smoothing -1",
            "isograd reconstruct a.ply --screening -0.5",
            "isograd reconstruct a.ply --level global",
            "isograd reconstruct a.ply --padding nan",
            "isograd reconstruct a.ply --bounds 0 0 0 1 1",
            "isograd reconstruct a.ply --orient guess",
            "isograd reconstruct a.ply --threads 0",
            "isograd reconstruct a.ply --backend gpu",
            "isograd reconstruct a.ply --backend cuda:x",
            "isograd reconstruct a.ply -q -v",
            "isograd sample fish -o a.ply",
            "isograd sample fish -n 5 -o a.ply --param time",
            "isograd sample fish -n 5 -o a.ply --density w:3",
            "isograd orient a.ply",
            "isograd orient a.ply -o b.ply --sensor 1,2",
            "isograd orient a.ply -o b.ply --sensor 1,2,inf",
            "isograd orient a.ply -o b.ply --parity-gamma 0",
            "isograd query a.ply -o b.ply",
            "isograd sdf a.ply",
            "isograd sdf a.ply -o b.vti --band -1",
            "isograd sdf a.ply -o b.vti --outliers keep",
            "isograd isosurface a.vti -o b.ply --level nan",
            "isograd clean a.ply -o b.ply",
            "isograd clean a.ply -o b.ply --voxel 0",
            "isograd clean a.ply -o b.ply --statistical 8",
            "isograd clean a.ply -o b.ply --statistical 0,2",
            "isograd clean a.ply -o b.ply --radius 0.1,x",
            "isograd gradcheck a.ply --step 0",
            "isograd info a.csv --columns x,y",
            "isograd info a.csv --columns x,,z",
            "isograd info a.csv --max-memory many",
            "isograd info a.csv --max-memory 0",
        ] {
            assert!(Cli::try_parse_from(line.split(' ')).is_err(), "{line}");
        }
    }
}
