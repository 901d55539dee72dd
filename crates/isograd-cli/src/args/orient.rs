//! Arguments of every command that estimates normals, and of `orient`.

use std::path::PathBuf;

use clap::Args;
use isograd::neighbors::Radius;
use isograd::orient::{Method, ParityOptions};
use isograd::{PointCloud, PointCloudError, Real, Sensors};

use super::{ReadingArgs, Running, STATUS, finite, positive};
use crate::error::Error;

/// Arguments of the normals.
#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub struct OrientArgs {
    /// Neighborhood radius of the normals, in the cloud's unit; cut:R for the paper's weights, which end at it with a jump
    #[arg(long, value_name = "R|auto|cut:R", default_value = "auto")]
    pub radius: Radius,
    /// Method that finds the side of each normal: auto (from enclosure and neighbors), parity (count of crossings, as
    /// in the paper), given (the cloud's own normals), signs (estimated directions on the side of the cloud's own
    /// normals), sensors (estimated directions on the side of the sensors) or previous (those of the frame before, in a
    /// --sequence; else auto) [default: auto; with --sequence: previous]
    #[arg(long, value_name = "METHOD")]
    pub orient: Option<Method>,
    /// Position of a sensor, in the cloud's unit; more than one where it is unknown which one saw a point. Replaces the
    /// columns sensor_x, sensor_y and sensor_z of the cloud
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    pub sensor: Vec<[f64; 3]>,
    /// Detection radius of --orient parity, in half the largest distance to a nearest point [default: 2.5]
    #[arg(long, value_name = "FACTOR", value_parser = positive)]
    pub parity_gamma: Option<f64>,
    /// Points in a row at the beginning of a ray that --orient parity still counts as one [default: 2]
    #[arg(long, value_name = "N")]
    pub parity_tolerance: Option<u32>,
}

impl OrientArgs {
    /// Checks that every argument is used.
    ///
    /// # Errors
    /// [`Error::Usage`] for an argument without effect.
    pub fn check(&self) -> Result<(), Error> {
        let unused = |name: &str, needed: &str| {
            let message = format!("{name} is not used without --orient {needed}");
            Err(Error::Usage(message))
        };
        let method = self.method();
        if !self.sensor.is_empty() && method != Method::Sensors {
            return unused("--sensor", "sensors");
        }
        let has_parity = self.parity_gamma.is_some() || self.parity_tolerance.is_some();
        if has_parity && !matches!(method, Method::Parity(_)) {
            return unused("--parity-gamma or --parity-tolerance", "parity");
        }
        Ok(())
    }

    /// The method, with the options of parity.
    pub fn method(&self) -> Method {
        let method = self.orient.unwrap_or_default();
        let Method::Parity(default) = method else {
            return method;
        };
        Method::Parity(ParityOptions {
            gamma: self.parity_gamma.unwrap_or(default.gamma),
            tolerance: self
                .parity_tolerance
                .map_or(default.tolerance, |n| n as usize),
            ..default
        })
    }

    /// Whether the method takes normals of the cloud into account.
    pub fn uses_normals(&self) -> bool {
        matches!(self.method(), Method::Given | Method::Signs)
    }

    /// The cloud, with the sensors of the command line in place of its own where there are any.
    ///
    /// # Errors
    /// A position beyond the range of `T`.
    pub fn with_sensors<T: Real>(
        &self,
        cloud: PointCloud<T>,
    ) -> Result<PointCloud<T>, PointCloudError> {
        if self.sensor.is_empty() {
            return Ok(cloud);
        }
        let places = self.sensor.iter().map(|place| place.map(T::of));
        cloud.with_sensors(Sensors::Any(places.collect()))
    }
}

/// Arguments of `orient`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct OrientCloud {
    /// The cloud, in any format that `reconstruct` reads
    pub cloud: PathBuf,
    /// Where to write the points with normals and confidence: .ply, .npz, .pcd, .xyz, .csv or .txt; `-` is standard output (PLY)
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Numbers, times and warnings: .json
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// The normals.
    #[command(flatten)]
    pub normals: OrientArgs,
    /// Arguments of the input.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// How to run.
    #[command(flatten)]
    pub running: Running,
}

/// Three numbers with commas between them.
fn place(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, String> = text.split(',').map(|x| finite(x.trim())).collect();
    let wrong = |_| format!("'{text}' is not X,Y,Z, such as 0,0,1.5");
    numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).map_err(wrong))
}
