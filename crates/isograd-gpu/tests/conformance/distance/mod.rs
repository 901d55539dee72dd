//! The distance, beside the CPU's stage and all triangles tried.

mod extension;
mod lattice;
mod meshes;
mod pullback;

use cubecl::prelude::Runtime;
use isograd::distance::lattice::{Band, Scratch};
use isograd::{Field, Grid, Mesh, Real};
use isograd_gpu::distance::{self, lattice::Residual};
use isograd_gpu::{Device, Scalar};

use crate::devices::Numbers;

/// A field of signs at random, with the level 0.1: the stage must take them as they are.
fn signs<T: Real>(grid: Grid<T>) -> Field<T> {
    Field::new(grid, Numbers(5).list(grid.cells())).unwrap()
}

fn grid<T: Real>(lower: [f64; 3], spacing: f64, shape: [usize; 3]) -> Grid<T> {
    Grid::new(lower.map(T::of), T::of(spacing), shape).unwrap()
}

/// A mesh on the device.
fn upload<R: Runtime, T: Scalar>(device: &Device<R>, mesh: &Mesh<T>) -> distance::Mesh<T> {
    distance::Mesh {
        vertices: device.upload(mesh.vertices().as_flattened()).unwrap(),
        faces: device.upload(mesh.faces().as_flattened()).unwrap(),
    }
}

/// `φ` and the closest faces that the device finds, and what it keeps.
fn solve<R: Runtime, T: Scalar>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    chi: &Field<T>,
    band: Band,
) -> (Vec<T>, Vec<u32>, Residual<T>) {
    let mesh = upload(device, mesh);
    let signs = device.upload(chi.values()).unwrap();
    let level = device.upload(&[T::of(0.1)]).unwrap();
    let (phi, residual) =
        distance::lattice::forward(device, &mesh, chi.grid(), &signs, &level, band).unwrap();
    let closest = device.download(residual.closest()).unwrap();
    (device.download(&phi).unwrap(), closest, residual)
}

/// [`solve`] on the CPU.
fn solve_on_cpu<T: Real>(mesh: &Mesh<T>, chi: &Field<T>, band: Band) -> (Field<T>, Vec<u32>) {
    let mut phi = Field::zeros(*chi.grid());
    let mut closest = Vec::new();
    let (level, mut scratch) = (T::of(0.1), Scratch::default());
    isograd::distance::lattice::forward(
        mesh,
        chi,
        level,
        band,
        &mut scratch,
        &mut phi,
        &mut closest,
    )
    .unwrap();
    (phi, closest)
}
