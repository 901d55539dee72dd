//! The automatic method on a device, as `isograd`'s `orient/auto.rs` does it.
//!
//! What concerns single samples, their neighbors and the cells of the grids is done on the device: the graph, the
//! fills, the evidence, and how it spreads. What concerns the cloud as a whole is the CPU's own code: the parts that
//! get a grid of their own, and the domains of samples that agree, whose signs are chosen together; for that the
//! graph and the beliefs are copied.

pub mod fill;
pub mod graph;
mod voices;
pub mod winding;

use cubecl::prelude::*;
use isograd::orient::decide::{Decision, Place, Signs};
use isograd::orient::graph as cpu;
use isograd::orient::groups::Groups;
use isograd_element::evidence::is_clear;
use isograd_element::vector;

use super::{Axes, Decided, Error, Turned};
use crate::element::evidence;
use crate::neighbors::{BLOCK, Neighborhoods};
use crate::primitives::fill::zeros;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};
use fill::Members;
use graph::Graph;
use voices::{Seen, Voices};

/// Where the samples are, on the host.
struct Samples<T> {
    points: Vec<[T; 3]>,
    spacing: f64,
}

impl<T: Scalar> Samples<T> {
    fn positions(&self) -> Vec<[f32; 3]> {
        (0..self.points.len())
            .map(|p| self.in_spacings(p))
            .collect()
    }
}

impl<T: Scalar> Place for Samples<T> {
    fn user(&self, p: usize) -> [f64; 3] {
        vector::to_f64(self.points[p])
    }

    fn spacing(&self) -> f64 {
        self.spacing
    }
}

/// Chooses the sign of each axis. `views` `(N,)`, in input order, are cosines between axes and lines of sight, where
/// sensors know.
pub(super) fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Axes<'_, T>,
    views: Option<&Buffer<f32>>,
) -> Result<Turned<T>, Error> {
    let n = neighborhoods.len();
    let mut signs = Signs::default();
    let dark = zeros(device, n)?;
    if n > 0 {
        let mut graph = graph::forward(
            device,
            neighborhoods,
            axes.normals,
            axes.residual,
            axes.spacing,
        )?;
        let place = Samples {
            points: device
                .download(&neighborhoods.points)?
                .as_chunks()
                .0
                .to_vec(),
            spacing: axes.spacing.f64(),
        };
        let mut whole = copy(device, &graph, &place)?;
        let seen = look(device, neighborhoods, &graph, &whole, &place)?;
        graph::part_slabs(device, &mut graph, &seen.slabs)?;
        whole.coupling = device.download(&graph.coupling)?.as_chunks().0.to_vec();
        let mut voices = Voices {
            sheets: graph::sheet_evidence(device, neighborhoods, &graph, axes.spacing)?,
            device,
            graph: &graph,
            seen,
            views: views.unwrap_or(&dark),
            places: &neighborhoods.places,
            positions: device.upload(place.positions().as_flattened())?,
        };
        signs.find(&whole, &mut voices, views.is_some(), &place)?;
    }
    turn(
        device,
        neighborhoods,
        axes.normals,
        views.unwrap_or(&dark),
        &signs,
    )
}

/// What the CPU needs of the graph; the couplings are still to change.
fn copy<R: Runtime, T: Scalar>(
    device: &Device<R>,
    graph: &Graph,
    place: &Samples<T>,
) -> Result<cpu::Graph, Error> {
    let near = device.download(&graph.near)?.as_chunks().0.to_vec();
    let unit = 1.0 / place.spacing;
    let offsets = |(p, near): (usize, &[u32; cpu::NEIGHBORS])| {
        near.map(|q| {
            let offset = vector::sub(place.points[q as usize], place.points[p]);
            offset.map(|x| (x.f64() * unit) as f32)
        })
    };
    Ok(cpu::Graph {
        offset: near.iter().enumerate().map(offsets).collect(),
        near,
        axis: device.download(&graph.axis)?.as_chunks().0.to_vec(),
        reach: device.download(&graph.reach)?,
        area: device.download(&graph.area)?,
        ..cpu::Graph::default()
    })
}

/// Draws the parts of the cloud on their grids.
fn look<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    graph: &Graph,
    whole: &cpu::Graph,
    place: &Samples<T>,
) -> Result<Seen, Error> {
    let mut groups = Groups::default();
    groups.find(whole, |p| place.user(p));
    let seen = Seen::nothing(device, neighborhoods.len())?;
    for group in 0..groups.bounds.len() {
        let members = device.upload(groups.members(group))?;
        for scale in groups.scales(group, whole, place, &mut Vec::new()) {
            let drawn = Members {
                rows: &members,
                points: &neighborhoods.points,
                axes: &graph.axis,
                reach: &graph.reach,
                growth: scale.growth,
            };
            let sights = fill::forward(device, &scale.lattice, &drawn)?;
            seen.add(device, &members, &sights, &scale);
        }
    }
    Ok(seen)
}

/// Turns the axes. A clear view decides alone.
fn turn<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Buffer<T>,
    views: &Buffer<f32>,
    signs: &Signs,
) -> Result<Turned<T>, Error> {
    let n = neighborhoods.len();
    let (normals, confidence) = (device.empty(3 * n)?, device.empty(n)?);
    let seen = device.download(views)?;
    let places = device.download(&neighborhoods.places)?;
    let mut decided = Decided::default();
    let mut known = Vec::with_capacity(2 * n);
    for (p, &i) in places.iter().enumerate() {
        let verdict = signs.verdict(p);
        match verdict.by {
            _ if is_clear(seen[i as usize]) => decided.given += 1,
            Decision::Evidence => decided.evidence += 1,
            Decision::Neighbors => decided.neighbors += 1,
            Decision::Rule => decided.rule += 1,
        }
        known.extend([if verdict.flip { -1.0 } else { 1.0 }, verdict.confidence]);
    }
    let known = device.upload(&known)?;
    if n > 0 {
        turn_axes::launch::<T, R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            neighborhoods.places.arg(),
            axes.arg(),
            known.arg(),
            views.arg(),
            normals.arg(),
            confidence.arg(),
        );
    }
    Ok(Turned {
        normals,
        confidence,
        decided,
        detection_radius: None,
    })
}

/// `known` are sign and confidence of each sorted point.
#[cube(launch)]
fn turn_axes<F: Float>(
    places: &Array<u32>,
    axes: &Array<F>,
    known: &Array<f32>,
    views: &Array<f32>,
    normals: &mut Array<F>,
    confidence: &mut Array<F>,
) {
    if ABSOLUTE_POS < places.len() {
        let i = places[ABSOLUTE_POS] as usize;
        let view = views[i];
        let clear = evidence::is_clear::<f32>(view);
        let side = select(clear, view, known[2 * ABSOLUTE_POS]);
        let sure = select(clear, f32::new(1.0), known[2 * ABSOLUTE_POS + 1]);
        let sign = select(side < f32::new(0.0), F::new(-1.0), F::new(1.0));
        Vector3::<F>::at(axes, i).scale(sign).write(normals, i);
        confidence[i] = F::cast_from(sure);
    }
}
