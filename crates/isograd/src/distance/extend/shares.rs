//! Cotangents of the samples from the fits at the vertices.
//!
//! Every chunk of vertices sums the contributions to each sample in its reach; the samples then sum the
//! chunks, in their order.

use std::collections::HashMap;

use super::fit::Neighbor;
use super::fit_pullback::{Adjoint, Share};
use super::forward::collect;
use super::pullback::Inputs;
use crate::Real;
use crate::gather::bounded;
use crate::neighbors::NearCells;
use crate::parallel::{self, CHUNK};
use crate::vector::{dot, norm_squared, scale, sub};

/// Scratch buffers of one thread.
#[derive(Default)]
pub(super) struct Workspace<T> {
    /// `ū_v` of the vertex at hand.
    pub bar: Vec<f64>,
    near: NearCells<T>,
    neighbors: Vec<Neighbor>,
    /// `ū_v v_j` of each of them, then `q_j`.
    contracted: Vec<f64>,
    /// Sample → its slot in the chunk. Looked up only: its order has no part in the result.
    slots: HashMap<u32, u32>,
}

/// Cotangents of the samples from one chunk of vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Shares {
    /// Sample and slot, ascending.
    order: Vec<(u32, u32)>,
    /// By slot: 3 of the point, 1 of the area, and the components of the attribute.
    sums: Vec<f64>,
    /// `R R̄` of the least radius.
    pub least_radius: f64,
}

/// Numbers of a slot before the attribute's.
const FIXED: usize = 4;

impl Shares {
    pub(super) fn begin<T>(&mut self, work: &mut Workspace<T>) {
        self.order.clear();
        self.sums.clear();
        self.least_radius = 0.0;
        work.slots.clear();
    }

    pub(super) fn finish(&mut self) {
        self.order.sort_unstable();
    }

    /// Adds the cotangents of the samples around a vertex from `ū_v`, which is in `work.bar`. Returns `ȳ_v`.
    pub(super) fn add_fit<T: Real>(
        &mut self,
        inputs: &Inputs<'_, T>,
        vertex: usize,
        work: &mut Workspace<T>,
        guarded: &mut usize,
    ) -> [f64; 3] {
        let Workspace {
            bar,
            near,
            neighbors,
            contracted,
            slots,
        } = work;
        if bar.iter().all(|u| *u == 0.0) {
            return [0.0; 3];
        }
        let (samples, smallest_area) = (inputs.samples, inputs.residual.smallest_area);
        let radius = inputs.residual.fits[vertex].radius;
        let at = inputs.surface.mesh.vertices()[vertex];
        collect(samples, smallest_area, at, T::of(radius), near, neighbors);
        contracted.clear();
        contracted.extend(neighbors.iter().map(|n| -> f64 {
            let values = &inputs.attribute.values[n.sample as usize * bar.len()..];
            bar.iter().zip(values).map(|(u, v)| u * v.f64()).sum()
        }));
        let adjoint = Adjoint::new(radius, neighbors, contracted);
        *guarded += usize::from(adjoint.degenerate);
        let (mut of_vertex, mut of_radius) = ([0.0; 3], 0.0);
        for (n, &q) in neighbors.iter().zip(&*contracted) {
            let area = samples.areas[n.sample as usize].f64() + smallest_area;
            let share = adjoint.share(n, q, area);
            let of_point = scale(share.offset, 1.0 / radius);
            of_vertex = sub(of_vertex, of_point);
            of_radius -= dot(share.offset, adjoint.offset(n));
            self.add(n.sample, of_point, share, bar, slots);
        }
        if radius <= samples.radius.f64() {
            self.least_radius += of_radius;
        } else if let Some((sample, offset)) = adjoint.last_within(neighbors) {
            let of_point = scale(offset, of_radius / (radius * norm_squared(offset)));
            of_vertex = sub(of_vertex, of_point);
            self.add(sample, of_point, Share::default(), bar, slots);
        }
        of_vertex
    }

    #[inline(always)]
    fn add(
        &mut self,
        sample: u32,
        of_point: [f64; 3],
        share: Share,
        bar: &[f64],
        slots: &mut HashMap<u32, u32>,
    ) {
        let Self { order, sums, .. } = self;
        let stride = FIXED + bar.len();
        let slot = *slots.entry(sample).or_insert_with(|| {
            let slot = order.len() as u32;
            order.push((sample, slot));
            sums.resize(sums.len() + stride, 0.0);
            slot
        });
        let sums = &mut sums[slot as usize * stride..][..stride];
        let [x, y, z] = of_point;
        for (sum, term) in sums.iter_mut().zip([x, y, z, share.area]) {
            *sum += term;
        }
        for (sum, u) in sums[FIXED..].iter_mut().zip(bar) {
            *sum += share.value * u;
        }
    }
}

/// Sums the chunks for every sample. Overwrites the outputs, and returns the number of values out of range.
pub(super) fn add_to_samples<T: Real>(
    shares: &[Shares],
    components: usize,
    attribute: &mut [T],
    points: &mut [[T; 3]],
    areas: &mut [T],
) -> usize {
    let stride = FIXED + components;
    let outputs = points.chunks_mut(CHUNK).zip(areas.chunks_mut(CHUNK));
    let outputs = outputs.zip(attribute.chunks_mut(CHUNK * components));
    let guarded = parallel::map_each(outputs, |chunk, ((points, areas), attribute)| {
        let mut sums = vec![0.0; points.len() * stride];
        add_chunks(shares, chunk * CHUNK, stride, &mut sums);
        let mut guarded = 0;
        let mut finite = |x: f64| bounded(x, &mut guarded);
        let values = attribute.chunks_exact_mut(components);
        for (k, (sums, values)) in sums.chunks_exact(stride).zip(values).enumerate() {
            points[k] = [sums[0], sums[1], sums[2]].map(&mut finite);
            areas[k] = finite(sums[3]);
            for (value, &sum) in values.iter_mut().zip(&sums[FIXED..]) {
                *value = finite(sum);
            }
        }
        guarded
    });
    guarded.into_iter().sum()
}

/// Adds up the shares of the samples from `first` on.
fn add_chunks(shares: &[Shares], first: usize, stride: usize, sums: &mut [f64]) {
    let end = first + sums.len() / stride;
    for Shares {
        order, sums: parts, ..
    } in shares
    {
        let begin = order.partition_point(|&(sample, _)| (sample as usize) < first);
        for &(sample, slot) in &order[begin..] {
            if sample as usize >= end {
                break;
            }
            let sums = &mut sums[(sample as usize - first) * stride..][..stride];
            let part = &parts[slot as usize * stride..][..stride];
            for (sum, part) in sums.iter_mut().zip(part) {
                *sum += part;
            }
        }
    }
}
