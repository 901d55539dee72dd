//! Arguments of every command that runs the pipeline.

use clap::Args;
use isograd::distance::lattice::Band;
use isograd::poisson::Smoothing;
use isograd::{Grid, GridError, Options, PointCloud, Real, Resolution, isosurface, splat};

use super::{AutoOrZero, FullOr, Level, OrientArgs, Splat, Switch, finite, not_negative, positive};

/// The grid.
#[derive(Debug, Args)]
pub struct GridArgs {
    /// Cells on the longest side [default: 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65535),
        conflicts_with = "spacing", help_heading = "Grid")]
    pub resolution: Option<u32>,
    /// Cell size, in the cloud's unit
    #[arg(long, value_name = "H", value_parser = positive, help_heading = "Grid")]
    pub spacing: Option<f64>,
    /// Room on every side, as a fraction of the longest side [default: 0.1]
    #[arg(long, value_name = "FRACTION", value_parser = not_negative, help_heading = "Grid")]
    pub padding: Option<f64>,
    /// The box to compute in, instead of a fitted one
    #[arg(long, num_args = 6, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"],
        allow_negative_numbers = true, value_parser = finite, conflicts_with = "padding",
        help_heading = "Grid")]
    pub bounds: Option<Vec<f64>>,
}

/// The method.
#[derive(Debug, Args)]
pub struct MethodArgs {
    /// The normals.
    #[command(flatten)]
    pub normals: OrientArgs,
    /// How a sample is spread over the cells round it
    #[arg(long, default_value = "bspline", help_heading = "Method")]
    pub splat: Splat,
    /// Whether a sample counts by the area that it stands for
    #[arg(long, default_value = "on", help_heading = "Method")]
    pub area: Switch,
    /// Width of the smoothing of the indicator, in cells; auto: 0.8 of the distance between samples
    #[arg(
        long,
        value_name = "CELLS|auto",
        default_value = "auto",
        help_heading = "Method"
    )]
    pub smooth: AutoOrZero,
    /// How strongly the indicator is drawn to one value at the samples; 1 to 4 are usual, 0 is off
    #[arg(long, value_name = "ALPHA", default_value = "0", value_parser = not_negative,
        help_heading = "Method")]
    pub screening: f64,
    /// Which value of the indicator the surface is at: that at the samples near by, or their mean
    #[arg(long, default_value = "local", help_heading = "Method")]
    pub level: Level,
    /// How far from the surface φ is computed, in the cloud's unit
    #[arg(
        long,
        value_name = "H|full",
        default_value = "full",
        help_heading = "Method"
    )]
    pub band: FullOr,
}

impl GridArgs {
    /// The grid that is asked for, round `cloud` where no bounds are given.
    ///
    /// # Errors
    /// See [`GridError`].
    pub fn grid<T: Real>(&self, cloud: &PointCloud<T>) -> Result<Grid<T>, GridError> {
        let resolution = match (self.spacing, self.resolution) {
            (Some(h), _) => Resolution::Spacing(T::of(h)),
            (None, n) => Resolution::Cells(n.unwrap_or(128) as usize),
        };
        match self.bounds.as_deref() {
            Some(&[x0, y0, z0, x1, y1, z1]) => {
                let corners = [[x0, y0, z0], [x1, y1, z1]].map(|corner| corner.map(T::of));
                Grid::from_bounds(corners[0], corners[1], resolution)
            }
            _ => Grid::fit(cloud, resolution, T::of(self.padding.unwrap_or(0.1))),
        }
    }
}

impl MethodArgs {
    /// The options of the pipeline.
    pub fn options(&self) -> Options {
        Options::default()
            .radius(self.normals.radius())
            .orient(self.normals.method())
            .splat(match self.splat {
                Splat::Bspline => splat::Weights::BSpline,
                Splat::Paper => splat::Weights::Paper,
            })
            .area(self.area == Switch::On)
            .smoothing(match self.smooth {
                AutoOrZero::Auto => Smoothing::Auto,
                AutoOrZero::Value(cells) => Smoothing::Cells(cells),
            })
            .screening(self.screening)
            .level(match self.level {
                Level::Local => isosurface::Level::Local,
                Level::Thin => isosurface::Level::Thin,
                Level::Mean => isosurface::Level::Mean,
            })
            .band(match self.band {
                FullOr::Full => Band::Full,
                FullOr::Value(h) => Band::Within(h),
            })
    }
}
