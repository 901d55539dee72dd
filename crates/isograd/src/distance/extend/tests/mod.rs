//! Clouds and surfaces of the torus of radii 0.7 and 0.25, and what must hold of any extension.

mod derivatives;
mod oracle;
mod properties;
mod pullback;

use super::{Error, Extension, Region, Residual, Samples, Scratch, Surface, forward};
use crate::data::{Attribute, Field, Grid, Mesh};
use crate::neighbors::{self, Neighborhoods, Radius};
use crate::vector::to_f64;
use crate::{Real, distance, isosurface, splat};

pub(super) use crate::neighbors::tests::{Random, torus};

/// Signed distance to the torus.
pub(super) fn torus_distance([x, y, z]: [f64; 3]) -> f64 {
    (x.hypot(y) - 0.7).hypot(z) - 0.25
}

/// Samples, and a surface with its grid.
pub(super) struct Scene<T: Real> {
    pub points: Vec<[T; 3]>,
    pub neighborhoods: Neighborhoods<T>,
    pub areas: Vec<T>,
    pub mesh: Mesh<T>,
    pub phi: Field<T>,
    pub closest: Vec<u32>,
}

impl<T: Real> Scene<T> {
    /// `points` as samples of the torus, whose surface is made on a grid of `cells³`.
    pub fn new(points: &[[f64; 3]], cells: usize) -> Self {
        let points: Vec<[T; 3]> = points.iter().map(|p| p.map(T::of)).collect();
        let mut neighborhoods = Neighborhoods::default();
        neighbors::forward(&points, Radius::Auto, &mut neighborhoods).expect("samples");
        let mut areas = Vec::new();
        splat::area::forward(&neighborhoods, &mut areas);

        let spacing = T::of(2.2 / cells as f64);
        let grid = Grid::new([T::of(-1.1); 3], spacing, [cells; 3]).expect("a grid");
        let at = |i| T::of(torus_distance(grid.center_f64(grid.cell(i))));
        let chi = Field::new(grid, (0..grid.cells()).map(at).collect()).expect("a field");
        let (mut mesh, mut phi, mut closest) = (Mesh::default(), Field::zeros(grid), Vec::new());
        isosurface::forward(&chi, T::zero(), &mut Default::default(), &mut mesh).expect("surface");
        distance::lattice::forward(
            &mesh,
            &chi,
            T::zero(),
            distance::Band::Within(4.0 * spacing.f64()),
            &mut Default::default(),
            &mut phi,
            &mut closest,
        )
        .expect("distance");
        Self {
            points,
            neighborhoods,
            areas,
            mesh,
            phi,
            closest,
        }
    }

    /// `n` random samples.
    pub fn random(n: usize, cells: usize) -> Self {
        let points: Vec<[f64; 3]> = torus(n, 1).into_iter().map(|(p, _)| p).collect();
        Self::new(&points, cells)
    }

    /// 400 samples at four places.
    pub fn coinciding() -> Self {
        let places = [
            [0.7, 0.0, 0.25],
            [-0.7, 0.0, 0.25],
            [0.0, 0.95, 0.0],
            [0.0, -0.45, 0.0],
        ];
        let points: Vec<[f64; 3]> = (0..400).map(|i| places[i % 4]).collect();
        Self::new(&points, 24)
    }

    /// One value for each sample, a function of its place.
    pub fn attribute<const C: usize>(&self, f: impl Fn([f64; 3]) -> [f64; C]) -> Attribute<T> {
        let values = self
            .points
            .iter()
            .flat_map(|&p| f(to_f64(p)).map(T::of))
            .collect();
        Attribute {
            name: "velocity".into(),
            components: C,
            values,
        }
    }

    pub fn samples(&self) -> Samples<'_, T> {
        Samples {
            neighborhoods: &self.neighborhoods,
            radius: self.neighborhoods.common_radius,
            areas: &self.areas,
        }
    }

    pub fn surface(&self) -> Surface<'_, T> {
        Surface {
            mesh: &self.mesh,
            phi: &self.phi,
            closest: &self.closest,
        }
    }

    pub fn try_extend(
        &self,
        attribute: &Attribute<T>,
        cells: f64,
    ) -> Result<(Extension<T>, Residual<T>), Error> {
        self.extend_in(attribute, cells * self.phi.grid().spacing().f64())
    }

    pub fn extend_in(
        &self,
        attribute: &Attribute<T>,
        region: impl Into<Region>,
    ) -> Result<(Extension<T>, Residual<T>), Error> {
        let (mut extension, mut residual) = (Extension::default(), Residual::default());
        let (samples, surface, scratch) = (self.samples(), self.surface(), &mut Scratch::default());
        forward(
            samples,
            attribute,
            surface,
            region,
            scratch,
            &mut residual,
            &mut extension,
        )?;
        Ok((extension, residual))
    }

    pub fn extend(&self, attribute: &Attribute<T>) -> (Extension<T>, Residual<T>) {
        self.try_extend(attribute, 3.0).expect("extends")
    }

    /// Largest and root mean square error at the vertices against a function of the place.
    pub fn vertex_error<const C: usize>(
        &self,
        extension: &Extension<T>,
        f: impl Fn([f64; 3]) -> [f64; C],
    ) -> (f64, f64) {
        let (mut largest, mut sum) = (0.0f64, 0.0);
        for (&y, value) in self
            .mesh
            .vertices()
            .iter()
            .zip(extension.vertices.chunks_exact(C))
        {
            let truth = f(to_f64(y));
            let squared: f64 = (0..C).map(|c| (value[c].f64() - truth[c]).powi(2)).sum();
            largest = largest.max(squared.sqrt());
            sum += squared;
        }
        (largest, (sum / self.mesh.vertices().len() as f64).sqrt())
    }
}
