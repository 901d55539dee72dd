//! What the command line says.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand, ValueEnum};
use isograd::Backend;

mod fit;
mod gradcheck;
mod orient;
mod pipeline;

pub use fit::{Decay, Fit, Method, OffOr, TargetKind};
pub use gradcheck::Gradcheck;
pub use orient::{OrientArgs, OrientCloud};
pub use pipeline::{GridArgs, MethodArgs};

/// Point cloud in, exact signed distance field out.
#[derive(Debug, Parser)]
#[command(name = "isograd", version, about, after_help = STATUS)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const STATUS: &str = "Exit status: 0 done, 1 the work failed, 2 the command line is wrong, \
130 stopped by Ctrl-C.";

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Make the signed distance field and the surface of a point cloud
    Reconstruct(Box<Reconstruct>),
    /// Give the points of a cloud their outward normals
    Orient(Box<OrientCloud>),
    /// Sample a parametric body as a point cloud
    Sample(Sample),
    /// Signed distances at points, from a mesh or a field
    Query(Query),
    /// Change a body, or points, until their field matches a target
    Fit(Box<Fit>),
    /// Compare the gradients of a cloud's field with finite differences
    Gradcheck(Gradcheck),
    /// Say what a file holds
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
    /// The samples with normals and confidence: .ply or .npz
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub points: Option<PathBuf>,
    /// Numbers, times and warnings: .json
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub report: Option<PathBuf>,
    /// Three slices of the field and the spread of its slope: .png
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub plot: Option<PathBuf>,
    /// Cloud, surface and slice side by side: .png
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub picture: Option<PathBuf>,
    /// Turn and height of the viewer of --picture, in degrees
    #[arg(long, value_name = "DEGREES", num_args = 2, allow_negative_numbers = true,
        value_parser = finite, requires = "picture", help_heading = "Outputs")]
    pub view: Option<Vec<f64>>,

    /// Where to compute.
    #[command(flatten)]
    pub grid: GridArgs,
    /// How to compute.
    #[command(flatten)]
    pub method: MethodArgs,
    /// Take N samples of the surface of a mesh file instead of its vertices
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=50_000_000),
        help_heading = "Method")]
    pub sample: Option<u32>,

    /// Number type of the computation and of the outputs
    #[arg(long, default_value = "f32", help_heading = "Running")]
    pub precision: Precision,
    /// Where to compute: cpu, cuda (or cuda:1, the second device), vulkan, or auto: a GPU where there is one, else the
    /// CPU. A program is built with --features vulkan,cuda for these
    #[arg(long, default_value = "cpu", help_heading = "Running")]
    pub backend: Backend,
    /// How to run.
    #[command(flatten)]
    pub running: Running,
}

/// Arguments of `sample`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Sample {
    /// Name of the body
    #[arg(required_unless_present = "list")]
    pub shape: Option<String>,
    /// List the bodies and their parameters
    #[arg(long, exclusive = true)]
    pub list: bool,
    /// Number of samples
    #[arg(short = 'n', value_name = "N", required_unless_present = "list",
        value_parser = clap::value_parser!(u32).range(1..))]
    pub number: Option<u32>,
    /// Where to write the cloud: .ply, .npz, .xyz, .csv or .txt
    #[arg(short, long, value_name = "CLOUD", required_unless_present = "list")]
    pub output: Option<PathBuf>,
    /// A parameter of the body
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = name_and_value,
        allow_hyphen_values = true)]
    pub parameters: Vec<(String, f64)>,
    /// Seed of the random numbers
    #[arg(long, value_name = "S", default_value = "1")]
    pub seed: u64,
    /// Even spacing, or independent samples
    #[arg(long, default_value = "even")]
    pub layout: Layout,
    /// How many times as dense at the high end of an axis as at its low end, as `x:10`
    #[arg(long, value_name = "AXIS:RATIO")]
    pub density: Option<AxisRatio>,
    /// Number type of the coordinates
    #[arg(long, default_value = "f32")]
    pub precision: Precision,
    /// How to run.
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
    /// Where to write the points and what is known there: .ply, .npz, .xyz, .csv or .txt
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// How to run.
    #[command(flatten)]
    pub running: Running,
}

/// Arguments of `info`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Info {
    /// The file; `-` is standard input
    pub file: PathBuf,
}

/// How to run: the results do not depend on it.
#[derive(Clone, Copy, Debug, Args)]
pub struct Running {
    /// Number of threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024),
        help_heading = "Running")]
    pub threads: Option<u32>,
    /// Say nothing but warnings and errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Running")]
    pub quiet: bool,
    /// Say what each stage does and takes
    #[arg(short, long, help_heading = "Running")]
    pub verbose: bool,
}

/// See [`isograd::orient::Method`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Orient {
    /// From enclosure and neighbors
    Auto,
    /// By counting crossings, as the paper prints it
    Parity,
    /// The cloud's own normals
    Given,
    /// The directions found, each on the side of the cloud's own normal
    Signs,
    /// The directions found, each on the side that was seen
    Sensors,
}

/// See [`isograd::splat::Weights`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Splat {
    /// Quadratic B-spline
    Bspline,
    /// The paper's weights
    Paper,
}

/// See [`isograd::isosurface::Level`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Level {
    /// What it is at the samples near by
    Local,
    /// The same, also where the body is thinner than a cell, and made a cell thick; gradients go up and down there
    Thin,
    /// The mean at all samples
    Mean,
}

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// On
    On,
    /// Off
    Off,
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

/// A positive number, or `auto`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AutoOr {
    /// Chosen by the program.
    Auto,
    /// This.
    Value(f64),
}

/// A number that is 0 or more, or `auto`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AutoOrZero {
    /// Chosen by the program.
    Auto,
    /// This.
    Value(f64),
}

/// A positive number, or `full`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FullOr {
    /// Everywhere.
    Full,
    /// This.
    Value(f64),
}

/// An axis and a ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRatio {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Positive.
    pub ratio: f64,
}

impl FromStr for AutoOr {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => positive(text).map(Self::Value),
        }
    }
}

impl FromStr for AutoOrZero {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => not_negative(text).map(Self::Value),
        }
    }
}

impl FromStr for FullOr {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "full" => Ok(Self::Full),
            _ => positive(text).map(Self::Value),
        }
    }
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
            args.grid.bounds,
            Some(vec![-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
        );
        assert_eq!(args.method.normals.radius, AutoOr::Value(0.2));
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
            "isograd reconstruct a.ply --smooth -1",
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
            "isograd gradcheck a.ply --step 0",
        ] {
            assert!(Cli::try_parse_from(line.split(' ')).is_err(), "{line}");
        }
    }
}
