//! Stages that start from samples.

use isograd::isosurface::iso_value;
use isograd::neighbors::{Neighborhoods, Radius};
use isograd::splat::{self, SampleCotangent, Samples, area};
use isograd::{Field, Real, normals, orient, poisson};

use isograd_benches::output::Outcome;

use super::files::{Folder, Number};
use super::stages::Stage;

/// Points and a radius → normals and areas, the index and the radii included.
pub struct Normals<T: Real> {
    points: Vec<[T; 3]>,
    radius: Radius,
    neighborhoods: Neighborhoods<T>,
    residual: normals::Residual<T>,
    areas: Vec<T>,
}

impl<T: Real + Number> Normals<T> {
    /// Reads the points; a radius of 0 in the settings is automatic.
    pub fn open(folder: &Folder) -> Outcome<Self> {
        Ok(Self {
            points: folder.read_rows("points")?,
            radius: match folder.radius() {
                0.0 => Radius::Auto,
                // The weights that Warp's kernels have.
                radius => Radius::Cut(radius),
            },
            neighborhoods: Neighborhoods::default(),
            residual: normals::Residual::default(),
            areas: Vec::new(),
        })
    }
}

impl<T: Real + Number> Stage for Normals<T> {
    fn run(&mut self) -> Result<(), String> {
        let computed = normals::forward_with_neighborhoods(
            &self.points,
            self.radius,
            &mut self.neighborhoods,
            &mut self.residual,
        );
        computed.map_err(|error| error.to_string())?;
        area::forward(&self.neighborhoods, &mut self.areas);
        Ok(())
    }

    fn save(&self, folder: &Folder) -> Outcome {
        folder.write("normals", self.residual.normals.iter().flatten().copied())?;
        folder.write("areas", self.areas.iter().copied())
    }
}

/// Points → outward normals, and areas.
pub struct Oriented<T: Real> {
    axes: Normals<T>,
    scratch: orient::Scratch,
    orientation: orient::Orientation<T>,
}

impl<T: Real + Number> Oriented<T> {
    /// Reads the input of [`Normals`].
    pub fn open(folder: &Folder) -> Outcome<Self> {
        Ok(Self {
            axes: Normals::open(folder)?,
            scratch: orient::Scratch::default(),
            orientation: orient::Orientation::default(),
        })
    }
}

impl<T: Real + Number> Stage for Oriented<T> {
    fn run(&mut self) -> Result<(), String> {
        self.axes.run()?;
        let chosen = orient::forward(
            &self.axes.points,
            &self.axes.residual,
            &self.axes.neighborhoods,
            None,
            &orient::Method::Auto,
            &mut self.scratch,
            &mut self.orientation,
        );
        chosen.map_err(|error| error.to_string())
    }

    fn save(&self, folder: &Folder) -> Outcome {
        folder.write(
            "normals",
            self.orientation.normals.iter().flatten().copied(),
        )
    }
}

/// Points and normals → χ less its level, and a cotangent of that → cotangents of points and normals. All
/// areas are 1.
pub struct Indicator<T: Real> {
    points: Vec<[T; 3]>,
    normals: Vec<[T; 3]>,
    areas: Vec<T>,
    bar: Vec<T>,
    chi: Field<T>,
    level: T,
    residual: iso_value::Residual<T>,
    chi_bar: Field<T>,
    plan: poisson::Plan<T>,
    poisson: poisson::Scratch<T>,
    splat: splat::Scratch,
    order: splat::Residual,
    pullback: splat::PullbackScratch<T>,
    samples_bar: SampleCotangent<T>,
}

impl<T: Real + Number> Indicator<T> {
    /// Reads points, normals and the cotangent.
    pub fn open(folder: &Folder) -> Outcome<Self> {
        let points: Vec<[T; 3]> = folder.read_rows("points")?;
        let grid = folder.grid()?;
        Ok(Self {
            normals: folder.read_rows("normals")?,
            areas: vec![T::one(); points.len()],
            points,
            bar: folder.read("bar")?,
            chi: Field::zeros(grid),
            level: T::zero(),
            residual: iso_value::Residual::default(),
            chi_bar: Field::zeros(grid),
            plan: poisson::Plan::new(grid.shape()),
            poisson: poisson::Scratch::default(),
            splat: splat::Scratch::default(),
            order: splat::Residual::default(),
            pullback: splat::PullbackScratch::default(),
            samples_bar: SampleCotangent::default(),
        })
    }

    fn pass(&mut self) -> Outcome {
        let samples = Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        };
        let weights = splat::Weights::default();
        let (chi, order) = (&mut self.chi, &mut self.order);
        splat::forward(samples, weights, &mut self.splat, order, chi)?;
        self.plan.solve(chi.values_mut(), 0.0, &mut self.poisson)?;
        self.level = iso_value::forward(chi, &self.points, &self.areas, &mut self.residual)?;
        let grid = *chi.grid();

        let bars = &mut self.samples_bar;
        bars.points.fill([T::zero(); 3]);
        bars.points.resize(self.points.len(), [T::zero(); 3]);
        bars.normals.fill([T::zero(); 3]);
        bars.normals.resize(self.points.len(), [T::zero(); 3]);
        bars.areas.fill(T::zero());
        bars.areas.resize(self.points.len(), T::zero());
        let chi_bar = self.chi_bar.values_mut();
        chi_bar.copy_from_slice(&self.bar);
        let level_bar = -T::of(self.bar.iter().map(|x| x.f64()).sum());
        let residual = &self.residual;
        iso_value::pullback(
            &grid,
            splat::SortedSamples { samples, order },
            residual,
            level_bar,
            &[],
            chi_bar,
            bars,
        );
        self.plan.solve(chi_bar, 0.0, &mut self.poisson)?;
        splat::pullback(samples, order, &self.chi_bar, &mut self.pullback, bars);
        Ok(())
    }
}

impl<T: Real + Number> Stage for Indicator<T> {
    fn run(&mut self) -> Result<(), String> {
        self.pass().map_err(|error| error.to_string())
    }

    fn save(&self, folder: &Folder) -> Outcome {
        let level = self.level;
        folder.write("chi", self.chi.values().iter().map(|&chi| chi - level))
    }
}
