//! Signs from the previous step, for bodies that move.
//!
//! Between two steps of a simulation an axis turns by a few degrees, and keeps its side. So its sign is that
//! of the normal which the same point had in the step before: a product for each point, instead of a search.
//! Where an axis has jumped (at a sharp edge it may belong to one side now and to the other then) the
//! neighbors decide.

use super::turned::{is_far, side_among_neighbors};
use super::{MethodUsed, Orientation};
use crate::element::turned;
use crate::neighbors::Neighborhoods;
use crate::{Real, vector};

/// State of the previous step, in input order.
#[derive(Clone, Debug, Default)]
pub(super) struct Previous {
    /// Outward normals: their sides are all that counts.
    normals: Vec<[f32; 3]>,
    /// The confidence that each sign had when it was searched for.
    confidence: Vec<f32>,
    /// Scratch: cosine between each axis and the normal before, and the points where it is small.
    cosines: Vec<f64>,
    turned: Vec<u32>,
}

impl Previous {
    /// Stores a result of another method.
    pub(super) fn keep<T: Real>(&mut self, out: &Orientation<T>) {
        self.keep_normals(out);
        let confidence = out.confidence.iter().map(|c| c.f64() as f32);
        self.confidence.clear();
        self.confidence.extend(confidence);
    }

    fn keep_normals<T: Real>(&mut self, out: &Orientation<T>) {
        self.normals.clear();
        let single = |n: &[T; 3]| n.map(|x| x.f64() as f32);
        self.normals.extend(out.normals.iter().map(single));
    }

    /// Turns the axes that `out` holds to the sides of the step before. `false`, and nothing is changed, where
    /// there was none with as many points that these could have come from.
    pub(super) fn follow<T: Real>(
        &mut self,
        points: &[[T; 3]],
        neighborhoods: &Neighborhoods<T>,
        out: &mut Orientation<T>,
    ) -> bool {
        if !self.compare(&out.normals) {
            return false;
        }
        for (i, cosine) in self.cosines.iter().enumerate() {
            if !is_far(*cosine) {
                let confidence = f64::from(self.confidence[i]).min(cosine.abs());
                out.set_sign(i, *cosine < 0.0, confidence);
            }
        }
        for k in 0..self.turned.len() {
            let i = self.turned[k] as usize;
            let has_sign = |j: usize| !is_far(self.cosines[j]);
            let side = side_among_neighbors(i, points, neighborhoods, &out.normals, has_sign);
            let flip = side < 0.0 || side == 0.0 && self.cosines[i] < 0.0;
            out.set_sign(i, flip, side.abs().min(1.0));
            self.confidence[i] = out.confidence[i].f64() as f32;
        }
        out.decided.given = points.len() - self.turned.len();
        out.decided.neighbors = self.turned.len();
        out.method = MethodUsed::Previous {
            turned: self.turned.len(),
        };
        self.keep_normals(out);
        true
    }

    /// Finds the axes that have turned far; `false` where they are too many, or these are other points.
    fn compare<T: Real>(&mut self, axes: &[[T; 3]]) -> bool {
        if axes.is_empty() || self.normals.len() != axes.len() {
            return false;
        }
        let cosine = |(axis, before): (&[T; 3], &[f32; 3])| {
            vector::dot(vector::to_f64(*axis), before.map(f64::from))
        };
        self.cosines.clear();
        self.cosines
            .extend(axes.iter().zip(&self.normals).map(cosine));
        let far = (0u32..).zip(&self.cosines);
        self.turned.clear();
        self.turned
            .extend(far.filter(|&(_, &c)| is_far(c)).map(|(i, _)| i));
        turned::are_few(self.turned.len(), axes.len())
    }
}
