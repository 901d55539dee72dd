//! Seconds and bytes of the pipeline forward and backward.

use isograd::isosurface::Level;
use isograd::{Options, Pipeline, Reconstructor, SurfaceResolution};
use serde::Serialize;

use crate::output::Outcome;
use crate::sampling::{Body, Sampled, convert_grid, points_only};
use crate::timing::Passes;
use crate::{THREADS, pool};

/// Seconds for one body, number type and number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct Cost {
    /// Name of the body.
    pub body: &'static str,
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub samples: usize,
    /// Number type.
    pub precision: &'static str,
    /// Threads.
    pub threads: usize,
    /// Median seconds of a reconstruction without checks.
    pub forward: f64,
    /// Median seconds of its pullback.
    pub backward: f64,
    /// Median ratio of the pullback to the reconstruction just before it.
    pub ratio: f64,
    /// Median seconds of each stage of the reconstruction.
    pub stages: Vec<(&'static str, f64)>,
}

/// Bytes for one body and number type.
#[derive(Clone, Debug, Serialize)]
pub struct Memory {
    /// Name of the body.
    pub body: &'static str,
    /// Number type.
    pub precision: &'static str,
    /// Bytes of one value per cell.
    pub field: usize,
    /// Bytes kept for the pullback, besides φ, mesh and normals.
    pub residual: usize,
    /// Bytes of workspace that stays with the result.
    pub work: usize,
    /// Additional bytes of the first pullback, at its peak.
    pub first: usize,
    /// Additional bytes of later pullbacks, at their peak.
    pub later: usize,
}

/// Measures a body in both number types, with each number of threads.
pub fn measure(
    body: &Body,
    sampled: &Sampled,
    repeats: usize,
) -> Outcome<(Vec<Cost>, Vec<Memory>)> {
    let (mut costs, mut memory) = (Vec::new(), Vec::new());
    for threads in THREADS {
        for precision in ["f32", "f64"] {
            eprintln!("{}: cost, {precision}, {threads} threads", body.name);
            let passes = pool(threads).install(|| match precision {
                "f32" => passes::<f32>(sampled, repeats),
                _ => passes::<f64>(sampled, repeats),
            })?;
            costs.push(Cost {
                body: body.name,
                shape: body.shape,
                samples: body.samples,
                precision,
                threads,
                forward: passes.forward(),
                backward: passes.backward(),
                ratio: passes.ratio(),
                stages: passes.stages(),
            });
            if threads == 1 {
                memory.push(bytes(body, precision, &passes)?);
            }
        }
    }
    Ok((costs, memory))
}

fn passes<T: Pipeline>(sampled: &Sampled, repeats: usize) -> Result<Passes, String> {
    let passes = || {
        let cloud = points_only::<T>(sampled.cloud.points())?;
        let options = Options::default()
            .surface(SurfaceResolution::Grid)
            .level(Level::Local)
            .checks(false);
        let mut plan = Reconstructor::new(convert_grid(&sampled.grid)?, options)?;
        Passes::measure(&mut plan, &cloud, repeats)
    };
    // A `Box<dyn Error>` cannot leave its thread.
    passes().map_err(|error: Box<dyn std::error::Error>| error.to_string())
}

fn bytes(body: &Body, precision: &'static str, passes: &Passes) -> Outcome<Memory> {
    let ([field, residual, work], [first, later]) = (passes.kept_bytes, passes.pullback_bytes);
    Ok(Memory {
        body: body.name,
        precision,
        field,
        residual,
        work,
        first,
        later,
    })
}
