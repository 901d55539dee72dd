//! What a reconstruction keeps for its pullback, and what the pullback takes.

use isograd::{Cotangent, Options, PullbackScratch, Real, Reconstructor};
use peak_alloc::PeakAlloc;
use serde::Serialize;

use crate::Outcome;
use crate::body::{Body, Sampled, narrowed, points_alone};

/// Bytes of one body and number type.
#[derive(Clone, Debug, Serialize)]
pub struct Memory {
    /// Name of the body.
    pub body: &'static str,
    /// Number type.
    pub precision: &'static str,
    /// Bytes of one value for each cell.
    pub field: usize,
    /// Bytes kept for the pullback, beside φ, mesh and normals.
    pub residual: usize,
    /// Bytes of work space that stays with the result.
    pub work: usize,
    /// Bytes that the first pullback takes on top, at most.
    pub first: usize,
    /// Bytes that later pullbacks take on top, at most.
    pub later: usize,
}

impl Memory {
    /// Bytes in fields.
    pub fn fields(&self, bytes: usize) -> f64 {
        bytes as f64 / self.field as f64
    }
}

/// Measures a body in both number types.
///
/// # Errors
/// What the pipeline says.
pub fn measure(body: &Body, sampled: &Sampled) -> Outcome<Vec<Memory>> {
    Ok(vec![
        in_type::<f32>(body, sampled)?,
        in_type::<f64>(body, sampled)?,
    ])
}

fn in_type<T: Real>(body: &Body, sampled: &Sampled) -> Outcome<Memory> {
    // The command line's crate, which draws the pictures, has it as the allocator of all that links it.
    let memory = PeakAlloc;
    if memory.peak_usage() == 0 {
        return Err("memory is not being counted".into());
    }
    let cloud = points_alone::<T>(sampled.cloud.points())?;
    let options = Options::default().checks(false);
    let mut plan = Reconstructor::new(narrowed(&sampled.grid)?, options)?;
    let result = plan.reconstruct(&cloud)?;
    let cotangent = Cotangent {
        sdf: Some(result.sdf().values()),
        ..Cotangent::default()
    };
    let mut scratch = PullbackScratch::default();
    let mut out = isograd::CloudCotangent::default();
    let mut taken = || -> Outcome<usize> {
        let before = memory.current_usage();
        memory.reset_peak_usage();
        result.pullback_into(&cloud, &cotangent, &mut scratch, &mut out)?;
        Ok(memory.peak_usage().saturating_sub(before))
    };
    Ok(Memory {
        body: body.name,
        precision: T::NAME,
        field: size_of_val(result.sdf().values()),
        residual: result.residual_bytes(),
        work: result.work_bytes(),
        first: taken()?,
        later: taken()?,
    })
}
