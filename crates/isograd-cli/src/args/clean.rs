//! Arguments of `clean`.

use std::path::PathBuf;

use clap::Args;
use isograd::clean::{Options, Sparse, Statistical};

use super::{ReadingArgs, Running, STATUS, not_negative, positive};

/// Arguments of `clean`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Clean {
    /// The cloud, in any format that `reconstruct` reads
    pub cloud: PathBuf,
    /// Output, the points that are kept: .ply, .npz, .pcd, .xyz, .csv or .txt
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Remove all but one of the points within DISTANCE of each other, in the cloud's unit; 0: of equal points
    #[arg(long, value_name = "DISTANCE", value_parser = not_negative,
        help_heading = "Steps, in this order")]
    pub duplicates: Option<f64>,
    /// Remove points whose mean distance to their K nearest neighbors is above the mean of all plus S standard deviations,
    /// such as 20,2
    #[arg(long, value_name = "K,S", value_parser = statistical,
        help_heading = "Steps, in this order")]
    pub statistical: Option<Statistical>,
    /// Remove points with fewer than N others within R, in the cloud's unit, such as 0.05,3
    #[arg(long, value_name = "R,N", value_parser = sparse,
        help_heading = "Steps, in this order")]
    pub radius: Option<Sparse>,
    /// Keep one point in each cube of side H, in the cloud's unit: the one nearest to their mean
    #[arg(long, value_name = "H", value_parser = positive,
        help_heading = "Steps, in this order")]
    pub voxel: Option<f64>,
    /// Keep points that are more than R apart, as many as fit in, in the cloud's unit
    #[arg(long, value_name = "R", value_parser = positive,
        help_heading = "Steps, in this order")]
    pub poisson_disk: Option<f64>,
    /// Arguments of the input.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Arguments of the run.
    #[command(flatten)]
    pub running: Running,
}

impl Clean {
    /// The steps behind the removal of points that are not finite.
    pub fn options(&self) -> Options {
        Options {
            drop_not_finite: false,
            duplicates: self.duplicates,
            statistical: self.statistical,
            radius: self.radius,
            voxel: self.voxel,
            poisson_disk: self.poisson_disk,
        }
    }
}

fn statistical(text: &str) -> Result<Statistical, String> {
    let (neighbors, ratio) = pair(text, "K,S, such as 20,2")?;
    let neighbors = match count(neighbors)? {
        0 => return Err("the number of neighbors must be 1 or more".into()),
        neighbors => neighbors,
    };
    Ok(Statistical {
        neighbors,
        ratio: not_negative(ratio)?,
    })
}

fn sparse(text: &str) -> Result<Sparse, String> {
    let (radius, neighbors) = pair(text, "R,N, such as 0.05,3")?;
    Ok(Sparse {
        radius: positive(radius)?,
        neighbors: count(neighbors)?,
    })
}

fn pair<'a>(text: &'a str, form: &str) -> Result<(&'a str, &'a str), String> {
    let wrong = || format!("'{text}' is not {form}");
    let (first, second) = text.split_once(',').ok_or_else(wrong)?;
    Ok((first.trim(), second.trim()))
}

fn count(text: &str) -> Result<usize, String> {
    let number: Result<u32, _> = text.parse();
    Ok(number.map_err(|_| format!("'{text}' is not a whole number"))? as usize)
}
