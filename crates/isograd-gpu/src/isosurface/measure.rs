//! Area and enclosed volume of a triangle mesh.
//!
//! # Map
//! [`forward`]: the two integrals of [`isograd::isosurface::measure`], seen from the center of the bounding box, so
//! that the place of the mesh costs no digits. Pieces and topology are left to the CPU.
//!
//! # Residual
//! The mesh and its bounding box.
//!
//! # Pullback
//! [`pullback`]: that of [`isograd::isosurface::measure_pullback`]. Each vertex collects what its faces mean for it,
//! in the order of the faces.
//!
//! # Not differentiable
//! A face without area: left out of the area, and counted.

use cubecl::prelude::*;

use super::signs::{BLOCK, not_finite};
use super::sums::fold;
use crate::device::check_length;
use crate::primitives::ends::ends;
use crate::primitives::reduce::{groups_for, sum_of_group};
use crate::primitives::sort::{order, starts};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// What there is to measure.
#[derive(Clone)]
pub struct Measures<T> {
    /// `(2,)` the area, in unit length², and the enclosed volume, in unit length³: positive where faces are
    /// counter-clockwise seen from outside.
    pub area_and_volume: Buffer<T>,
    /// `(1,)` faces without area.
    pub flat_faces: Buffer<u32>,
}

/// What the pullback needs.
#[derive(Clone)]
pub struct Residual<T> {
    vertices: Buffer<T>,
    faces: Buffer<u32>,
    /// Low and high corner of the box round the vertices.
    bounds: Buffer<T>,
}

/// Measures a mesh of `(V, 3)` vertices and `(F, 3)` faces, which name vertices from 0.
///
/// # Errors
/// [`Error::Length`] where an array is not of triples or there are no vertices; [`Error::TooLarge`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    vertices: &Buffer<T>,
    faces: &Buffer<u32>,
) -> Result<(Measures<T>, Residual<T>), Error> {
    check_length("the vertices", vertices, (vertices.len() / 3).max(1) * 3)?;
    check_length("the faces", faces, faces.len() / 3 * 3)?;
    let residual = Residual {
        vertices: vertices.clone(),
        faces: faces.clone(),
        bounds: ends(device, vertices, 3)?,
    };
    let count = faces.len() / 3;
    let groups = groups_for(count);
    let partial: Buffer<T> = device.empty(2 * groups)?;
    let partly_flat: Buffer<u32> = device.empty(groups)?;
    let out = Measures {
        area_and_volume: device.empty(2)?,
        flat_faces: device.empty(1)?,
    };
    add_faces::launch::<T, R>(
        device.client(),
        CubeCount::Static(groups as u32, 1, 1),
        CubeDim::new_1d(BLOCK as u32),
        residual.arg(),
        partial.arg(),
        partly_flat.arg(),
        count as u32,
        groups as u32,
        BLOCK,
    );
    fold(device, &partial, groups, 0, &out.area_and_volume);
    fold(device, &partly_flat, groups, 0, &out.flat_faces);
    Ok((out, residual))
}

/// The cotangent `(V, 3)` of the vertices from those `(2,)` of area and volume.
///
/// # Errors
/// [`Error::Length`], [`Error::TooLarge`].
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    bars: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    check_length("the cotangent of area and volume", bars, 2)?;
    let count = residual.vertices.len() / 3;
    let corners = order(device, &residual.faces, count as u32)?;
    let first = starts(device, &corners.keys, count as u32)?;
    let vertices_bar = device.empty(residual.vertices.len())?;
    gather_faces::launch::<T, R>(
        device.client(),
        device.groups(count, BLOCK as u32),
        CubeDim::new_1d(BLOCK as u32),
        residual.arg(),
        corners.places.arg(),
        first.arg(),
        bars.arg(),
        vertices_bar.arg(),
        count as u32,
    );
    Ok(vertices_bar)
}

impl<T: Scalar> Residual<T> {
    fn arg<R: Runtime>(&self) -> TrianglesLaunch<T, R> {
        TrianglesLaunch::new(self.vertices.arg(), self.faces.arg(), self.bounds.arg())
    }
}

/// The mesh, in a kernel.
#[derive(CubeType, CubeLaunch)]
pub struct Triangles<F: Float + CubeElement> {
    vertices: Array<F>,
    faces: Array<u32>,
    bounds: Array<F>,
}

/// The unit vector along `a`, or zero where that has no direction or is not finite.
#[cube]
fn unit<F: Float + CubeElement>(a: Vector3<F>) -> Vector3<F> {
    let finite = not_finite::<F>(max(F::abs(a.x), max(F::abs(a.y), F::abs(a.z)))) == 0u32;
    a.choose(finite, Vector3::<F>::zero()).direction()
}

/// Corner `k` of a face.
#[cube]
fn corner<F: Float + CubeElement>(mesh: &Triangles<F>, face: usize, k: usize) -> Vector3<F> {
    Vector3::<F>::at(&mesh.vertices, mesh.faces[3 * face + k] as usize)
}

/// Center of the box.
#[cube]
fn center<F: Float + CubeElement>(mesh: &Triangles<F>) -> Vector3<F> {
    let half = F::new(0.5);
    Vector3::<F> {
        x: half * mesh.bounds[0] + half * mesh.bounds[3],
        y: half * mesh.bounds[1] + half * mesh.bounds[4],
        z: half * mesh.bounds[2] + half * mesh.bounds[5],
    }
}

#[cube(launch)]
fn add_faces<F: Float + CubeElement>(
    mesh: &Triangles<F>,
    partial: &mut Array<F>,
    partly_flat: &mut Array<u32>,
    count: u32,
    groups: u32,
    #[comptime] block: usize,
) {
    let mut area = F::new(0.0);
    let mut volume = F::new(0.0);
    let mut flat = 0u32;
    let from = center::<F>(mesh);
    let mut face = ABSOLUTE_POS;
    while face < count as usize {
        let a = corner::<F>(mesh, face, 0usize);
        let b = corner::<F>(mesh, face, 1usize).sub(a);
        let c = corner::<F>(mesh, face, 2usize).sub(a);
        let normal = b.cross(c);
        let direction = unit::<F>(normal);
        area += normal.dot(direction) / F::new(2.0);
        volume += a.sub(from).dot(normal) / F::new(6.0);
        flat += select(direction.dot(direction) == F::new(0.0), 1u32, 0u32);
        face += groups as usize * block;
    }
    let mut shared = SharedMemory::<F>::new(block);
    let mut counts = SharedMemory::<u32>::new(block);
    let area = sum_of_group::<F>(area, &mut shared);
    let volume = sum_of_group::<F>(volume, &mut shared);
    let flat = sum_of_group::<u32>(flat, &mut counts);
    if UNIT_POS == 0u32 {
        partial[CUBE_POS] = area;
        partial[CUBE_POS + groups as usize] = volume;
        partly_flat[CUBE_POS] = flat;
    }
}

/// With `n` the unit normal of a face `(a, b, c)`, `ā += A̅ (b − c) × n / 2` and `ā += V̅ b × c / 6`.
#[cube(launch)]
fn gather_faces<F: Float + CubeElement>(
    mesh: &Triangles<F>,
    corners: &Array<u32>,
    first: &Array<u32>,
    bars: &Array<F>,
    vertices_bar: &mut Array<F>,
    count: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let mut x = F::new(0.0);
        let mut y = F::new(0.0);
        let mut z = F::new(0.0);
        let from = center::<F>(mesh);
        let of_area = bars[0] / F::new(2.0);
        let of_volume = bars[1] / F::new(6.0);
        for at in first[ABSOLUTE_POS]..first[ABSOLUTE_POS + 1] {
            let place = corners[at as usize] as usize;
            let face = place / 3;
            let k = place % 3;
            let a = corner::<F>(mesh, face, k);
            let b = corner::<F>(mesh, face, (k + 1) % 3);
            let c = corner::<F>(mesh, face, (k + 2) % 3);
            let normal = unit::<F>(b.sub(a).cross(c.sub(a)));
            let sweep = b.sub(c).cross(normal);
            let cone = b.sub(from).cross(c.sub(from));
            x += of_area * sweep.x + of_volume * cone.x;
            y += of_area * sweep.y + of_volume * cone.y;
            z += of_area * sweep.z + of_volume * cone.z;
        }
        vertices_bar[3 * ABSOLUTE_POS] = x;
        vertices_bar[3 * ABSOLUTE_POS + 1] = y;
        vertices_bar[3 * ABSOLUTE_POS + 2] = z;
    }
}
