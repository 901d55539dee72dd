//! Arguments of every command that reconstructs.

use clap::{ArgAction, Args};
use isograd::distance::Band;
use isograd::isosurface::Level;
use isograd::isosurface::trim::Trim;
use isograd::poisson::{Smoothing, Walls};
use isograd::sheet::Sheet;
use isograd::splat::Weights;
use isograd::{
    Grid, GridError, Options, Outliers, PointCloud, Real, Resolution, Solve, SurfaceResolution,
};

use super::{OrientArgs, finite, not_negative, positive};

/// Arguments of the cells of a grid.
#[derive(Debug, Args)]
pub struct CellArgs {
    /// Cells on the longest side [default: 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65535),
        conflicts_with = "spacing", help_heading = "Grid")]
    pub resolution: Option<u32>,
    /// Cell size, in the cloud's unit
    #[arg(long, value_name = "H", value_parser = positive, help_heading = "Grid")]
    pub spacing: Option<f64>,
    /// Padding on every side, as a fraction of the longest side [default: 0.1]
    #[arg(long, value_name = "FRACTION", value_parser = not_negative, help_heading = "Grid")]
    pub padding: Option<f64>,
    /// Corners of the grid, in the cloud's unit, instead of the padded bounds of the cloud
    #[arg(long, num_args = 6, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"],
        allow_negative_numbers = true, value_parser = finite, conflicts_with = "padding",
        help_heading = "Grid")]
    pub bounds: Option<Vec<f64>>,
}

/// Arguments of the grid of a cloud.
#[derive(Debug, Args)]
pub struct GridArgs {
    /// Its cells.
    #[command(flatten)]
    pub cells: CellArgs,
    /// Use of outliers, samples that are far from all others or in mid-air: ignore (left out, with a warning) or keep
    #[arg(
        long,
        value_name = "ignore|keep",
        default_value = "ignore",
        help_heading = "Grid"
    )]
    pub outliers: Outliers,
}

/// Arguments of the method: the fields of [`Options`].
#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub struct MethodArgs {
    /// Arguments of the normals.
    #[command(flatten)]
    pub normals: OrientArgs,
    /// Weights that spread a sample over the cells around it: bspline (quadratic B-spline) or paper
    #[arg(long, value_name = "WEIGHTS", default_value = "bspline")]
    pub splat: Weights,
    /// Whether a sample is weighted by the area that it stands for: on or off
    #[arg(long, value_name = "on|off", default_value = "on", action = ArgAction::Set, value_parser = switch)]
    pub area: bool,
    /// Width of the smoothing of the indicator, in cells of the surface; auto: 0.8 of the distance between samples
    #[arg(long, value_name = "CELLS|auto", default_value = "auto")]
    pub smoothing: Smoothing,
    /// Strength of the pull of the indicator to one value at the samples, without unit; 1 to 4 are usual, 0 is off
    #[arg(long, value_name = "ALPHA", default_value = "0", value_parser = not_negative)]
    pub screening: f64,
    /// Value of the indicator at the surface: thin (that at the samples nearby; parts thinner than a cell are made about a
    /// cell thick, and automatic cells of the surface are halved where the solve is dense), local (like thin, without both:
    /// thin parts may be cut off) or mean (the mean at all samples)
    #[arg(long, value_name = "LEVEL", default_value = "thin")]
    pub level: Level,
    /// Cells that the surface is found on: auto (about the distance between samples; at most twice as fine
    /// as those of φ, or four times within 2²⁵ cells), grid (those of φ), a cell size in the
    /// cloud's unit, or how many times as fine as φ's, such as 3x; φ stays on its own grid
    #[arg(long, value_name = "auto|grid|H|Fx", default_value = "auto")]
    pub surface: SurfaceResolution,
    /// Cells at which the indicator is computed: dense (all of the surface's), sparse (near the samples, with coarse ones for
    /// the rest) or auto (sparse beyond 2²⁵)
    #[arg(long, value_name = "auto|dense|sparse", default_value = "auto")]
    pub solve: Solve,
    /// Condition at the walls of the grid: free (the surface may pass through them: half models), closed (it never reaches
    /// them), or auto (free if a sample lies within 3.5 cells of a wall, else closed)
    #[arg(long, value_name = "free|closed|auto", default_value = "free")]
    pub walls: Walls,
    /// Removes the faces of the mesh further than this from all samples, in the cloud's unit; auto: 4 times their typical
    /// distance or, where they are sparse, 2.5 times that around the nearest one. φ stays
    #[arg(long, value_name = "auto|off|DISTANCE", default_value = "off")]
    pub trim: Trim,
    /// Membranes and sails: φ is the unsigned distance to the trimmed surface (--trim auto unless given) less half of
    /// this thickness, in the cloud's unit, and the mesh is the closed shell
    #[arg(long, value_name = "off|THICKNESS", default_value = "off")]
    pub sheet: Sheet,
    /// Distance from the surface up to which φ is computed, in the cloud's unit
    #[arg(long, value_name = "H|full", default_value = "full")]
    pub band: Band,
}

impl GridArgs {
    /// The grid: between `--bounds`, or around `cloud`.
    pub fn grid<T: Real>(&self, cloud: &PointCloud<T>) -> Result<Grid<T>, GridError> {
        self.cells.grid(cloud, self.outliers)
    }
}

impl CellArgs {
    /// The grid: between `--bounds`, or around `cloud`, with this use of outliers.
    pub fn grid<T: Real>(
        &self,
        cloud: &PointCloud<T>,
        outliers: Outliers,
    ) -> Result<Grid<T>, GridError> {
        let resolution = match (self.spacing, self.resolution) {
            (Some(h), _) => Resolution::Spacing(T::of(h)),
            (None, n) => Resolution::Cells(n.unwrap_or(128) as usize),
        };
        match self.bounds.as_deref() {
            Some(&[x0, y0, z0, x1, y1, z1]) => {
                let corners = [[x0, y0, z0], [x1, y1, z1]].map(|corner| corner.map(T::of));
                Grid::from_bounds(corners[0], corners[1], resolution)
            }
            _ => {
                let padding = T::of(self.padding.unwrap_or(0.1));
                Grid::fit_with(cloud, resolution, padding, outliers)
            }
        }
    }
}

impl MethodArgs {
    /// The options of the pipeline, with the given use of outliers.
    pub fn options(&self, outliers: Outliers) -> Options {
        Options::default()
            .outliers(outliers)
            .radius(self.normals.radius)
            .orient(self.normals.method())
            .splat(self.splat)
            .area(self.area)
            .smoothing(self.smoothing)
            .screening(self.screening)
            .level(self.level)
            .surface(self.surface)
            .solve(self.solve)
            .walls(self.walls)
            .trim(self.trim)
            .sheet(self.sheet)
            .band(self.band)
    }
}

fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("give on or off".into()),
    }
}
