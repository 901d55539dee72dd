//! Samples beside a surface: those that it misses, and those on thin parts.

use pulp::{Arch, Simd, WithSimd};

use super::bvh::{Bvh, LANES, NOWHERE, NearestTriangles, Stack, Triangles};
use super::lattice::NO_TRIANGLE;
use super::pseudonormals::Pseudonormals;
use super::query::{
    PACKETS_PER_TASK, PART, Surface, far_if_nan, morton_order, nearest_triangles, packet,
};
use super::{Error, Scratch};
use crate::vector::{dot, norm, scale, sub, to_f64};
use crate::{Mesh, Real, parallel};

/// Share by which a bound of a distance exceeds it, so that rounding changes nothing.
const MARGIN: f64 = 1.001;

/// Samples with outward normals, and the limits of [`count`], in the user's unit.
#[derive(Clone, Copy)]
pub(crate) struct Samples<'a, T> {
    pub points: &'a [[T; 3]],
    pub normals: &'a [[T; 3]],
    /// Distance from the surface beyond which it misses a sample.
    pub within: T,
    /// Distance from the surface beyond which a sample is far from it.
    pub far: T,
    /// Distance below a sample at which its own side must still be the nearest.
    pub depth: T,
}

/// Numbers of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Counts {
    /// At the depth below the sample, the gradient of the distance is against its normal, but not at the sample.
    pub thin: usize,
    /// At the sample, the gradient of the distance is against its normal.
    pub turned: usize,
    /// The surface is not within the limit.
    pub missed: usize,
    /// The surface is not within the larger limit.
    pub far: usize,
}

/// Counts samples by their distance to `mesh`. The tree in `built`, if given, must be the one of this mesh. Beside the
/// trees it takes 16 bytes per sample.
///
/// # Errors
/// [`Error::Empty`] and [`Error::Range`].
pub(crate) fn count<T: Real>(
    mesh: &Mesh<T>,
    built: Option<&Scratch<T>>,
    samples: Samples<'_, T>,
) -> Result<Counts, Error> {
    let mut own = Bvh::default();
    let bvh = tree_of(mesh, built, &mut own)?;
    let order = morton_order(bvh, samples.points, &|_| true);
    let surface = Surface {
        mesh,
        bvh,
        pseudonormals: &Pseudonormals::new(mesh),
    };
    let arch = Arch::new();
    let mut counts = Counts::default();
    for order in order.chunks(PART) {
        let triangles = Triangles::new(mesh, bvh);
        let tasks = order.chunks(PACKETS_PER_TASK * LANES);
        let found = parallel::map_each(tasks, |_, order| {
            arch.dispatch(Task {
                triangles: &triangles,
                surface: &surface,
                samples,
                order,
            })
        });
        counts = found.into_iter().fold(counts, Counts::add);
    }
    Ok(counts)
}

impl<T: Real> Samples<'_, T> {
    /// Counts of one sample, from its normal, its distance from the surface and the gradients of the distance there and below.
    #[inline(always)]
    pub(crate) fn judged(&self, normal: [T; 3], distance: T, gradients: [[T; 3]; 2]) -> Counts {
        let [at, below] = gradients.map(|gradient| dot(gradient, normal) < T::of(-0.5));
        let turned = at && distance <= self.within;
        Counts {
            thin: usize::from(below && !turned),
            turned: usize::from(turned),
            // True for NaN.
            missed: usize::from(!(distance <= self.within)),
            far: usize::from(!(distance <= self.far)),
        }
    }
}

impl Counts {
    pub(crate) fn add(self, other: Self) -> Self {
        Self {
            thin: self.thin + other.thin,
            turned: self.turned + other.turned,
            missed: self.missed + other.missed,
            far: self.far + other.far,
        }
    }
}

/// The tree of `mesh`: the one in `built`, if given, or a new one in `own`.
fn tree_of<'a, T: Real>(
    mesh: &Mesh<T>,
    built: Option<&'a Scratch<T>>,
    own: &'a mut Bvh,
) -> Result<&'a Bvh, Error> {
    match built {
        Some(scratch) => Ok(&scratch.bvh),
        None => {
            own.rebuild(mesh)?;
            Ok(own)
        }
    }
}

/// For each point the face of `mesh` closest to it; `NO_TRIANGLE` for one that is not finite. The tree in `built`, if
/// given, must be the one of this mesh.
///
/// # Errors
/// [`Error::Empty`] and [`Error::Range`].
pub(crate) fn nearest_faces<T: Real>(
    mesh: &Mesh<T>,
    built: Option<&Scratch<T>>,
    points: &[[T; 3]],
) -> Result<Vec<u32>, Error> {
    let mut own = Bvh::default();
    let bvh = tree_of(mesh, built, &mut own)?;
    let mut faces = nearest_triangles(mesh, bvh, points, &|_| f64::INFINITY);
    parallel::for_each(&mut faces, |_, place| {
        *place = match *place {
            NOWHERE => NO_TRIANGLE,
            place => bvh.face(place),
        }
    });
    Ok(faces)
}

/// Counts some samples that are close to each other.
struct Task<'a, T> {
    triangles: &'a Triangles<'a, T>,
    surface: &'a Surface<'a, T>,
    samples: Samples<'a, T>,
    /// Morton code and index of each sample.
    order: &'a [(u64, u32)],
}

impl<T: Real> WithSimd for Task<'_, T> {
    type Output = Counts;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Counts {
        let mut stack = Stack::new();
        let mut counts = Counts::default();
        let depth = self.samples.depth;
        for order in self.order.chunks(LANES) {
            // The last packet repeats its last sample.
            let index: [usize; LANES] =
                std::array::from_fn(|l| order[l.min(order.len() - 1)].1 as usize);
            let points = index.map(|i| self.samples.points[i]);
            let normals = index.map(|i| self.samples.normals[i]);
            let at = self.nearest(&points, [f64::INFINITY; LANES], &mut stack);
            let hits: [_; LANES] =
                std::array::from_fn(|l| self.surface.hit(points[l], at[l], None));
            let at = hits.map(|hit| hit.distance.abs());
            let below: [[T; 3]; LANES] =
                std::array::from_fn(|l| sub(points[l], scale(normals[l], depth)));
            // By the triangle inequality no farther than the surface is from the sample.
            let bounds = std::array::from_fn(|l| {
                let apart = norm(sub(to_f64(points[l]), to_f64(below[l])));
                far_if_nan((MARGIN * (at[l].f64() + apart)).powi(2))
            });
            let nearest = self.nearest(&below, bounds, &mut stack);
            for l in 0..order.len() {
                let below = self.surface.hit(below[l], nearest[l], None);
                let gradients = [hits[l].gradient, below.gradient];
                counts = counts.add(self.samples.judged(normals[l], at[l], gradients));
            }
        }
        counts
    }
}

impl<T: Real> Task<'_, T> {
    /// Places in the tree of the triangles closest to some points, whose squared distances are below `bounds`.
    #[inline(always)]
    fn nearest(
        &self,
        points: &[[T; 3]; LANES],
        bounds: [f64; LANES],
        stack: &mut Stack,
    ) -> [u32; LANES] {
        let packet = packet(points);
        let mut found = NearestTriangles {
            squared: bounds,
            ..NearestTriangles::NOTHING
        };
        self.triangles.nearest(&packet, &mut found, stack);
        // Bounds that rounding at huge coordinates made too small.
        if found.triangle.contains(&NOWHERE) && bounds != [f64::INFINITY; LANES] {
            found = NearestTriangles::NOTHING;
            self.triangles.nearest(&packet, &mut found, stack);
        }
        found.triangle
    }
}
