//! Stages with their input, scratch buffers and output in memory.

use isograd::distance::Band;
use isograd::{
    Field, Mesh, Options, Pipeline, PointCloud, Reconstructor, SurfaceResolution, distance,
    isosurface, poisson,
};

use isograd_benches::output::Outcome;

use super::files::{Folder, Number};
use super::samples::{Indicator, Normals, Oriented};

/// One stage with its input.
pub trait Stage: Send {
    /// Untimed preparation of a run.
    fn prepare(&mut self) {}
    /// One forward pass.
    fn run(&mut self) -> Result<(), String>;
    /// Writes the output of the last run.
    fn save(&self, folder: &Folder) -> Outcome;
}

/// Reads the input of a stage.
pub fn by_name<T: Pipeline + Number>(name: &str, folder: &Folder) -> Outcome<Box<dyn Stage>> {
    Ok(match name {
        "distance" => Box::new(Distance::<T>::open(folder, None)?),
        "band" => Box::new(Distance::<T>::open(folder, Some(3.0))?),
        "whole" => Box::new(Whole::<T>::open(folder)?),
        "normals" => Box::new(Normals::<T>::open(folder)?),
        "orient" => Box::new(Oriented::<T>::open(folder)?),
        "indicator" => Box::new(Indicator::<T>::open(folder)?),
        "poisson" => Box::new(Poisson::<T>::open(folder)?),
        "isosurface" => Box::new(Isosurface::<T>::open(folder)?),
        _ => return Err(format!("unknown stage '{name}'").into()),
    })
}

/// `b` → `χ`.
struct Poisson<T: Pipeline> {
    b: Vec<T>,
    field: Vec<T>,
    plan: poisson::Plan<T>,
    scratch: poisson::Scratch<T>,
}

impl<T: Pipeline + Number> Poisson<T> {
    fn open(folder: &Folder) -> Outcome<Self> {
        let b = folder.read("b")?;
        Ok(Self {
            field: b.clone(),
            b,
            plan: poisson::Plan::new(folder.grid::<T>()?.shape()),
            scratch: poisson::Scratch::default(),
        })
    }
}

impl<T: Pipeline + Number> Stage for Poisson<T> {
    fn prepare(&mut self) {
        self.field.copy_from_slice(&self.b);
    }

    fn run(&mut self) -> Result<(), String> {
        let solved = self.plan.solve(&mut self.field, 0.0, &mut self.scratch);
        solved.map_err(|error| error.to_string())
    }

    fn save(&self, folder: &Folder) -> Outcome {
        folder.write("chi", self.field.iter().copied())
    }
}

/// A field → its zero level set.
struct Isosurface<T: Pipeline> {
    chi: Field<T>,
    mesh: Mesh<T>,
    scratch: isosurface::Scratch,
}

impl<T: Pipeline + Number> Isosurface<T> {
    fn open(folder: &Folder) -> Outcome<Self> {
        Ok(Self {
            chi: Field::new(folder.grid()?, folder.read("chi")?)?,
            mesh: Mesh::default(),
            scratch: isosurface::Scratch::default(),
        })
    }
}

impl<T: Pipeline + Number> Stage for Isosurface<T> {
    fn run(&mut self) -> Result<(), String> {
        let extracted =
            isosurface::forward(&self.chi, T::zero(), &mut self.scratch, &mut self.mesh);
        extracted.map(drop).map_err(|error| error.to_string())
    }

    fn save(&self, folder: &Folder) -> Outcome {
        folder.write("vertices", self.mesh.vertices().iter().flatten().copied())?;
        folder.write("faces", self.mesh.faces().iter().flatten().copied())
    }
}

/// A field and its zero level set, extracted beforehand → `φ`.
struct Distance<T: Pipeline> {
    band: Band,
    mesh: Mesh<T>,
    chi: Field<T>,
    phi: Field<T>,
    closest: Vec<u32>,
    scratch: distance::Scratch<T>,
}

impl<T: Pipeline + Number> Distance<T> {
    fn open(folder: &Folder, cells: Option<f64>) -> Outcome<Self> {
        let chi = Field::new(folder.grid()?, folder.read("chi")?)?;
        let mut mesh = Mesh::default();
        isosurface::forward(&chi, T::zero(), &mut Default::default(), &mut mesh)?;
        let width = |cells| Band::Within(cells * chi.grid().spacing().f64());
        Ok(Self {
            band: cells.map_or(Band::Full, width),
            mesh,
            phi: chi.clone(),
            chi,
            closest: Vec::new(),
            scratch: distance::Scratch::default(),
        })
    }
}

impl<T: Pipeline + Number> Stage for Distance<T> {
    fn run(&mut self) -> Result<(), String> {
        let done = distance::lattice::forward(
            &self.mesh,
            &self.chi,
            T::zero(),
            self.band,
            &mut self.scratch,
            &mut self.phi,
            &mut self.closest,
        );
        done.map_err(|error| error.to_string())
    }

    fn save(&self, folder: &Folder) -> Outcome {
        folder.write("phi", self.phi.values().iter().copied())?;
        folder.write("vertices", self.mesh.vertices().iter().flatten().copied())?;
        folder.write("faces", self.mesh.faces().iter().flatten().copied())
    }
}

/// Points → `φ` and the report, by a plan with the default options.
struct Whole<T: Pipeline> {
    cloud: PointCloud<T>,
    plan: Reconstructor<T>,
    phi: Vec<T>,
}

impl<T: Pipeline + Number> Whole<T> {
    fn open(folder: &Folder) -> Outcome<Self> {
        Ok(Self {
            cloud: PointCloud::new(folder.read_rows("points")?)?,
            plan: Reconstructor::new(
                folder.grid()?,
                Options::default().surface(SurfaceResolution::Grid),
            )?,
            phi: Vec::new(),
        })
    }
}

impl<T: Pipeline + Number> Stage for Whole<T> {
    fn run(&mut self) -> Result<(), String> {
        let result = self.plan.reconstruct(&self.cloud);
        let result = result.map_err(|error| error.to_string())?;
        self.phi.clear();
        self.phi.extend_from_slice(result.sdf().values());
        Ok(())
    }

    fn save(&self, folder: &Folder) -> Outcome {
        folder.write("phi", self.phi.iter().copied())
    }
}
