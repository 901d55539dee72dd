//! Arguments of every command that finds normals, and of `orient`, which does nothing else.

use std::path::PathBuf;

use clap::Args;
use isograd::neighbors::Radius;
use isograd::orient::{self, ParityOptions};
use isograd::{PointCloud, PointCloudError, Real, Sensors};

use super::{AutoOr, Orient, Running, STATUS, finite, positive};
use crate::error::Error;

/// The normals and their sides.
#[derive(Debug, Args)]
pub struct OrientArgs {
    /// Neighborhood radius of the normals, in the cloud's unit
    #[arg(
        long,
        value_name = "R|auto",
        default_value = "auto",
        help_heading = "Method"
    )]
    pub radius: AutoOr,
    /// How the side of the surface is found
    #[arg(long, default_value = "auto", help_heading = "Method")]
    pub orient: Orient,
    /// A place that the points were seen from, in their unit; more than one where it is not known which saw a
    /// point. Instead of the columns sensor_x, sensor_y and sensor_z of the cloud
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true,
        help_heading = "Method")]
    pub sensor: Vec<[f64; 3]>,
    /// Detection radius of --orient parity, in half the largest distance to a nearest point [default: 2.5]
    #[arg(long, value_name = "FACTOR", value_parser = positive, help_heading = "Method")]
    pub parity_gamma: Option<f64>,
    /// Points in a row at the beginning of a ray that --orient parity still takes for one [default: 2]
    #[arg(long, value_name = "N", help_heading = "Method")]
    pub parity_tolerance: Option<u32>,
}

impl OrientArgs {
    /// Whether all that is given is used.
    ///
    /// # Errors
    /// [`Error::Usage`] where not.
    pub fn check(&self) -> Result<(), Error> {
        let unused = |what: &str, needed: &str| {
            let message = format!("{what} is not used without --orient {needed}");
            Err(Error::Usage(message))
        };
        if !self.sensor.is_empty() && self.orient != Orient::Sensors {
            return unused("--sensor", "sensors");
        }
        let has_parity = self.parity_gamma.is_some() || self.parity_tolerance.is_some();
        if has_parity && self.orient != Orient::Parity {
            return unused("--parity-gamma or --parity-tolerance", "parity");
        }
        Ok(())
    }

    /// The neighborhood radius.
    pub fn radius(&self) -> Radius {
        match self.radius {
            AutoOr::Auto => Radius::Auto,
            AutoOr::Value(r) => Radius::Fixed(r),
        }
    }

    /// How the signs are chosen.
    pub fn method(&self) -> orient::Method {
        let default = ParityOptions::default();
        match self.orient {
            Orient::Auto => orient::Method::Auto,
            Orient::Parity => orient::Method::Parity(ParityOptions {
                gamma: self.parity_gamma.unwrap_or(default.gamma),
                tolerance: self
                    .parity_tolerance
                    .map_or(default.tolerance, |n| n as usize),
                ..default
            }),
            Orient::Given => orient::Method::Given,
            Orient::Signs => orient::Method::Signs,
            Orient::Sensors => orient::Method::Sensors,
        }
    }

    /// The cloud with the sensors of the command line in place of its own, if there are any.
    ///
    /// # Errors
    /// A place beyond the range of `T`.
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
    /// Where to write the points with normals and confidence: .ply, .npz, .xyz, .csv or .txt
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Numbers, times and warnings: .json
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// The normals.
    #[command(flatten)]
    pub normals: OrientArgs,
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
