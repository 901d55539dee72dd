//! A plan where a backend says.

use std::ops::ControlFlow;

use isograd::{Backend, Grid, Options, PointCloud, Reconstructor, Saved, Stage};
#[cfg(feature = "gpu")]
use isograd_gpu::host;

use crate::view::{Kept, Made, Of, View};
use crate::{Error, Number};

/// [`Reconstructor`] on the CPU or on a device.
pub struct Plan<T: Number>(On<T>);

enum On<T: Number> {
    /// And why, where that was left to the program.
    Cpu(Box<Reconstructor<T>>, Option<String>),
    /// With what it made last.
    #[cfg(feature = "gpu")]
    Device(Box<host::Plan<T>>, Option<Box<Last<T>>>),
}

/// A cloud, and what a device made of it.
#[cfg(feature = "gpu")]
struct Last<T: Number> {
    cloud: PointCloud<T>,
    result: host::Reconstruction<T>,
}

#[cfg(feature = "gpu")]
impl<T: Number> Last<T> {
    /// Whether it is what a cloud and its normals after orientation would give again.
    fn is_of(&self, cloud: &PointCloud<T>, normals: &[[T; 3]]) -> bool {
        self.cloud.points() == cloud.points()
            && self.cloud.normals() == cloud.normals()
            && self.result.normals().is_ok_and(|found| found == normals)
    }
}

impl<T: Number> Plan<T> {
    /// A plan for clouds that lie on `grid`, at least 2 cells off its walls. Libraries of a GPU are loaded here, where
    /// `backend` may mean one, and nowhere before.
    ///
    /// # Errors
    /// A bad grid or option; a backend that was not built in, or whose device can't be had.
    pub fn new(backend: Backend, grid: Grid<T>, options: Options) -> Result<Self, Error> {
        choose(backend, grid, options).map(Self)
    }

    /// Who computes: `cpu`, or a backend and its device, such as `vulkan: NVIDIA H100`.
    pub fn name(&self) -> &str {
        match &self.0 {
            On::Cpu(..) => "cpu",
            #[cfg(feature = "gpu")]
            On::Device(plan, _) => plan.name(),
        }
    }

    /// Why it is the CPU, where that was left to the program.
    pub fn note(&self) -> Option<&str> {
        match &self.0 {
            On::Cpu(_, note) => note.as_deref(),
            #[cfg(feature = "gpu")]
            On::Device(..) => None,
        }
    }

    /// [`Self::note`], to be said once: the next time there is none.
    pub fn take_note(&mut self) -> Option<String> {
        match &mut self.0 {
            On::Cpu(_, note) => note.take(),
            #[cfg(feature = "gpu")]
            On::Device(..) => None,
        }
    }

    /// Runs all stages. The result stays with the plan.
    ///
    /// # Errors
    /// An error of a stage or of the device.
    pub fn reconstruct(&mut self, cloud: &PointCloud<T>) -> Result<View<'_, T>, Error> {
        self.reconstruct_observed(cloud, &mut |_| ControlFlow::Continue(()))
    }

    /// [`Self::reconstruct`] with an `observer` that is called before each stage, where it runs; if it breaks, the work stops.
    ///
    /// # Errors
    /// As [`Self::reconstruct`], and where the observer breaks.
    pub fn reconstruct_observed(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<View<'_, T>, Error> {
        match &mut self.0 {
            On::Cpu(plan, _) => Ok(View(Of::Cpu(plan.reconstruct_observed(cloud, observer)?))),
            #[cfg(feature = "gpu")]
            On::Device(plan, last) => {
                // Its memory is free before that of the next is asked for.
                *last = None;
                let result = plan.reconstruct_observed(cloud, observer)?;
                Ok(keep(plan, last, cloud, result))
            }
        }
    }

    /// [`Self::reconstruct_observed`] with a result to keep: on the CPU a copy.
    pub fn make(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Made<T>, Error> {
        match &mut self.0 {
            On::Cpu(plan, _) => {
                let result = plan.reconstruct_observed(cloud, observer)?;
                Ok(Made(Kept::Cpu(Box::new(result.clone()))))
            }
            #[cfg(feature = "gpu")]
            On::Device(plan, _) => {
                let result = plan.reconstruct_observed(cloud, observer)?;
                Ok(Made(Kept::Device(Box::new(result), plan.name().into())))
            }
        }
    }

    /// Lets go of the last result, where a device has it: its memory may be wanted by others. The CPU's is part of the
    /// plan.
    pub fn release(&mut self) {
        #[cfg(feature = "gpu")]
        if let On::Device(_, last) = &mut self.0 {
            *last = None;
        }
    }

    /// Finds a result of the same grid, options and cloud again, to the bit: at once if it is the last one, else by a
    /// reconstruction.
    ///
    /// # Errors
    /// An error of a stage or of the device; saved results of another reconstruction.
    pub fn restore(
        &mut self,
        cloud: &PointCloud<T>,
        saved: &Saved<'_, T>,
    ) -> Result<View<'_, T>, Error> {
        match &mut self.0 {
            On::Cpu(plan, _) => Ok(View(Of::Cpu(plan.restore(cloud, saved)?))),
            #[cfg(feature = "gpu")]
            On::Device(plan, last) => {
                saved.check(plan.grid().cells(), cloud.len())?;
                restore(plan, last, cloud, saved.normals)
            }
        }
    }

    /// [`Self::restore`] on a device, from the `(N, 3)` normals alone.
    ///
    /// # Errors
    /// As [`Self::restore`]; a plan of the CPU.
    #[cfg(feature = "cuda")]
    pub fn restore_from_normals(
        &mut self,
        cloud: &PointCloud<T>,
        normals: &[[T; 3]],
    ) -> Result<View<'_, T>, Error> {
        match &mut self.0 {
            On::Cpu(..) => Err(Error::OnDevice),
            On::Device(plan, last) => restore(plan, last, cloud, normals),
        }
    }
}

#[cfg(feature = "gpu")]
fn restore<'a, T: Number>(
    plan: &'a host::Plan<T>,
    last: &'a mut Option<Box<Last<T>>>,
    cloud: &PointCloud<T>,
    normals: &[[T; 3]],
) -> Result<View<'a, T>, Error> {
    if !last.as_ref().is_some_and(|last| last.is_of(cloud, normals)) {
        *last = None;
        let result = plan.restore(cloud, normals)?;
        return Ok(keep(plan, last, cloud, result));
    }
    let last = last.as_ref().expect("a result, as was asked");
    Ok(View(Of::Device(&last.result, plan.name())))
}

/// Keeps a result, to look at.
#[cfg(feature = "gpu")]
fn keep<'a, T: Number>(
    plan: &'a host::Plan<T>,
    last: &'a mut Option<Box<Last<T>>>,
    cloud: &PointCloud<T>,
    result: host::Reconstruction<T>,
) -> View<'a, T> {
    let cloud = cloud.clone();
    let last = last.insert(Box::new(Last { cloud, result }));
    View(Of::Device(&last.result, plan.name()))
}

impl<T: Number> On<T> {
    fn cpu(grid: Grid<T>, options: Options, note: Option<String>) -> Result<Self, Error> {
        let plan = Reconstructor::new(grid, options)?;
        Ok(Self::Cpu(Box::new(plan), note))
    }
}

#[cfg(feature = "gpu")]
fn choose<T: Number>(backend: Backend, grid: Grid<T>, options: Options) -> Result<On<T>, Error> {
    match host::choose(backend, grid, &options)? {
        host::Choice::Cpu(note) => On::cpu(grid, options, note),
        host::Choice::Device(plan) => Ok(On::Device(plan, None)),
    }
}

#[cfg(not(feature = "gpu"))]
fn choose<T: Number>(backend: Backend, grid: Grid<T>, options: Options) -> Result<On<T>, Error> {
    const NONE: &str = "computed on the CPU: neither CUDA nor Vulkan is built into this program";
    match backend {
        Backend::Cpu => On::cpu(grid, options, None),
        Backend::Auto => On::cpu(grid, options, Some(NONE.into())),
        backend => Err(Error::NotBuilt(backend)),
    }
}
