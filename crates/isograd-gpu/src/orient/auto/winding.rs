//! The generalized winding number of domains of samples, at some of the samples: `isograd`'s `orient/winding.rs`.

use cubecl::prelude::*;
use isograd::orient::decide::Domains;

use super::graph::Graph;
use crate::element::winding;
use crate::neighbors::BLOCK;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error};

/// Samples that are summed in single precision.
const RUN: usize = 1024;

/// `(probes, domains)` the winding number that each domain gives at each of the `probes`. `positions` `(N, 3)` are
/// in sample spacings, relative to one of the samples, in sorted order. Waits for the device.
///
/// # Errors
/// [`Error::TooLarge`], [`Error::Failed`].
pub fn numbers<R: Runtime>(
    device: &Device<R>,
    graph: &Graph,
    positions: &Buffer<f32>,
    domains: &Domains<'_>,
    probes: &[u32],
) -> Result<Vec<f64>, Error> {
    let runs = Runs::of(domains);
    let count = runs.domain.len() * probes.len();
    let mut numbers = vec![0.0; probes.len() * domains.count];
    if count == 0 {
        return Ok(numbers);
    }
    let sums: Buffer<f32> = device.empty(count)?;
    sum_runs::launch::<R>(
        device.client(),
        device.groups(count, BLOCK),
        CubeDim::new_1d(BLOCK),
        positions.arg(),
        graph.axis.arg(),
        graph.area.arg(),
        device.upload(domains.sign)?.arg(),
        device.upload(&runs.members)?.arg(),
        device.upload(&runs.ends)?.arg(),
        device.upload(probes)?.arg(),
        sums.arg(),
        count as u32,
    );
    let sums = device.download(&sums)?;
    for (sums, &domain) in sums.chunks_exact(probes.len()).zip(&runs.domain) {
        for (probe, &sum) in sums.iter().enumerate() {
            numbers[probe * domains.count + domain as usize] += f64::from(sum);
        }
    }
    Ok(numbers)
}

/// The samples of each domain, in runs.
#[derive(Default)]
struct Runs {
    /// Samples, run after run.
    members: Vec<u32>,
    /// Where each run ends.
    ends: Vec<u32>,
    /// The domain of each run.
    domain: Vec<u32>,
}

impl Runs {
    fn of(domains: &Domains<'_>) -> Self {
        let mut runs = Self::default();
        for (domain, members) in (0..).zip(domains.members()) {
            for run in members.chunks(RUN) {
                runs.members.extend_from_slice(run);
                runs.ends.push(runs.members.len() as u32);
                runs.domain.push(domain);
            }
        }
        runs
    }
}

/// A unit for each run and probe.
#[cube(launch)]
fn sum_runs(
    positions: &Array<f32>,
    axes: &Array<f32>,
    areas: &Array<f32>,
    signs: &Array<f32>,
    members: &Array<u32>,
    ends: &Array<u32>,
    probes: &Array<u32>,
    sums: &mut Array<f32>,
    count: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let run = ABSOLUTE_POS / probes.len();
        let at = Vector3::<f32>::at(positions, probes[ABSOLUTE_POS % probes.len()] as usize);
        let mut first = 0u32.runtime();
        if run > 0 {
            first = ends[run - 1];
        }
        let mut sum = f32::new(0.0);
        for member in first..ends[run] {
            let p = members[member as usize] as usize;
            let offset = Vector3::<f32>::at(positions, p).sub(at);
            let moment = signs[p] * areas[p] / f32::new(4.0 * std::f32::consts::PI);
            let along = moment * offset.dot(Vector3::<f32>::at(axes, p));
            let square = winding::softened::<f32>(offset.dot(offset));
            sum += winding::share::<f32>(along, square, f32::sqrt(square));
        }
        sums[ABSOLUTE_POS] = sum;
    }
}
