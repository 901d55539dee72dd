//! What single samples say of their signs, and what they believe once their neighbors were heard.

use cubecl::prelude::*;
use isograd::orient::decide::{Beliefs, Domains, Reading};
use isograd::orient::groups::Scale;

use super::fill::Sights;
use super::graph::{self, Graph};
use super::winding;
use crate::element::evidence;
use crate::neighbors::BLOCK;
use crate::primitives::{fill::zeros, flags};
use crate::{Buffer, Device, Error};

/// What there is to see at each sample, in sorted order, each `(N,)`.
pub struct Seen {
    /// What the fills say.
    filled: Buffer<f32>,
    /// `(N, 2)` the light on both sides of each axis.
    ends: Buffer<f32>,
    /// How much light there is on both sides of samples that scatter: 0..1.
    pub slabs: Buffer<f32>,
}

impl Seen {
    /// Nothing yet.
    pub fn nothing<R: Runtime>(device: &Device<R>, n: usize) -> Result<Self, Error> {
        Ok(Self {
            filled: zeros(device, n)?,
            ends: device.upload(&vec![1.0; 2 * n])?,
            slabs: zeros(device, n)?,
        })
    }

    /// Adds what the `members` of a group see on one of its grids.
    pub fn add<R: Runtime>(
        &self,
        device: &Device<R>,
        members: &Buffer<u32>,
        sights: &Sights,
        scale: &Scale,
    ) {
        add_sights::launch::<R>(
            device.client(),
            device.groups(members.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            members.arg(),
            sights.evidence.arg(),
            sights.ends.arg(),
            self.filled.arg(),
            self.ends.arg(),
            self.slabs.arg(),
            scale.weight,
        );
    }
}

/// The samples' own voices.
pub struct Voices<'a, R: Runtime> {
    pub device: &'a Device<R>,
    pub graph: &'a Graph,
    pub seen: Seen,
    /// What sheets say.
    pub sheets: Buffer<f32>,
    /// Cosines of the views from sensors, in input order; 0 without them.
    pub views: &'a Buffer<f32>,
    /// `(N,)` index in the input of each sorted point.
    pub places: &'a Buffer<u32>,
    /// `(N, 3)` in sample spacings, relative to one of them.
    pub positions: Buffer<f32>,
}

impl<R: Runtime> Voices<'_, R> {
    fn weigh(&self, reading: Reading) -> Result<Buffer<f32>, Error> {
        let n = self.places.len();
        let own = self.device.empty(n)?;
        weigh_evidence::launch::<R>(
            self.device.client(),
            self.device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            self.seen.filled.arg(),
            self.seen.ends.arg(),
            self.seen.slabs.arg(),
            self.sheets.arg(),
            self.graph.side.arg(),
            self.views.arg(),
            self.places.arg(),
            own.arg(),
            reading == Reading::Bold,
        );
        Ok(own)
    }
}

impl<R: Runtime> Beliefs for Voices<'_, R> {
    type Error = Error;

    fn hear(
        &mut self,
        reading: Reading,
        evidence: &mut Vec<f32>,
        belief: &mut Vec<f32>,
    ) -> Result<(), Error> {
        let own = self.weigh(reading)?;
        *belief = self
            .device
            .download(&graph::relax(self.device, self.graph, &own)?)?;
        *evidence = self.device.download(&own)?;
        Ok(())
    }

    fn differ(&mut self) -> Result<bool, Error> {
        let n = self.places.len();
        let differing: Buffer<u32> = self.device.empty(n)?;
        flag_differing::launch::<R>(
            self.device.client(),
            self.device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            self.seen.ends.arg(),
            self.sheets.arg(),
            differing.arg(),
        );
        Ok(flags::first(self.device, &differing)?.is_some())
    }

    fn winding(&mut self, domains: &Domains<'_>, probes: &[u32]) -> Result<Vec<f64>, Error> {
        winding::numbers(self.device, self.graph, &self.positions, domains, probes)
    }
}

/// A unit for each member. No two are the same sample.
#[cube(launch)]
fn add_sights(
    members: &Array<u32>,
    evidence: &Array<f32>,
    ends: &Array<f32>,
    filled: &mut Array<f32>,
    all_ends: &mut Array<f32>,
    slabs: &mut Array<f32>,
    weight: f32,
) {
    if ABSOLUTE_POS < members.len() {
        let p = members[ABSOLUTE_POS] as usize;
        let (front, behind) = (ends[2 * ABSOLUTE_POS], ends[2 * ABSOLUTE_POS + 1]);
        filled[p] += weight * evidence[ABSOLUTE_POS];
        slabs[p] = max(slabs[p], min(front, behind));
        all_ends[2 * p] = min(all_ends[2 * p], front);
        all_ends[2 * p + 1] = min(all_ends[2 * p + 1], behind);
    }
}

/// How open the side is that a second sheet behind the sample makes the outer one.
#[cube]
fn open_at(ends: &Array<f32>, p: usize, sheet: f32) -> f32 {
    let side = select(sheet < 0.0f32, 1usize, 0usize);
    evidence::openness::<f32>(ends[2 * p + side])
}

#[cube(launch)]
fn weigh_evidence(
    filled: &Array<f32>,
    ends: &Array<f32>,
    slabs: &Array<f32>,
    sheets: &Array<f32>,
    sides: &Array<f32>,
    views: &Array<f32>,
    places: &Array<u32>,
    own: &mut Array<f32>,
    #[comptime] bold: bool,
) {
    if ABSOLUTE_POS < places.len() {
        let p = ABSOLUTE_POS;
        let mut open = f32::new(1.0);
        if !bold {
            open = open_at(ends, p, sheets[p]);
        }
        let seen = evidence::of_view::<f32>(views[places[p] as usize]);
        own[p] = evidence::weighed::<f32>(filled[p], sheets[p], open, slabs[p], sides[p], seen);
    }
}

#[cube(launch)]
fn flag_differing(ends: &Array<f32>, sheets: &Array<f32>, differing: &mut Array<u32>) {
    if ABSOLUTE_POS < differing.len() {
        let sheet = sheets[ABSOLUTE_POS];
        let differs = evidence::differs::<f32>(sheet, open_at(ends, ABSOLUTE_POS, sheet));
        differing[ABSOLUTE_POS] = select(differs, 1u32, 0u32);
    }
}
