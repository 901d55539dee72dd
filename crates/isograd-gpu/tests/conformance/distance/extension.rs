//! Attributes on the surface and around it, beside the CPU's stage.

mod cotangents;
mod degenerate;

use cubecl::prelude::Runtime;
use isograd::distance::Band;
use isograd::distance::extend::{self as cpu, Region};
use isograd::neighbors::Neighborhoods;
use isograd::orient::Method;
use isograd::{Attribute, Field, Grid, Mesh, Real};
use isograd_gpu::distance::{self, extend};
use isograd_gpu::{Buffer, Device, Scalar};

use super::{grid, meshes, upload};
use crate::clouds::on_cpu;
use crate::devices::{Numbers, tests, tolerance};
use crate::samples::assert_near;

tests! {
    in_each_number: values_are_those_of_the_cpu, constants_are_exact;
}

/// Samples, a surface and the grid around it, on the CPU.
struct Scene<T> {
    name: &'static str,
    points: Vec<[T; 3]>,
    near: Neighborhoods<T>,
    areas: Vec<T>,
    mesh: Mesh<T>,
    phi: Field<T>,
    closest: Vec<u32>,
}

/// Points at random on the torus of [`meshes::torus`].
fn torus_points(count: usize) -> Vec<[f64; 3]> {
    let mut numbers = Numbers(31);
    let mut turn = || std::f64::consts::TAU * numbers.unit();
    let mut point = || {
        let (s, t) = (turn(), turn());
        let r = 0.7 + 0.25 * t.cos();
        [r * s.cos(), r * s.sin(), 0.25 * t.sin()]
    };
    (0..count).map(|_| point()).collect()
}

fn distance(a: &[f64; 3], b: [f64; 3]) -> f64 {
    let squares = (0..3).map(|k| (a[k] - b[k]).powi(2));
    squares.sum::<f64>().sqrt()
}

impl<T: Scalar> Scene<T> {
    fn new(name: &'static str, points: &[[f64; 3]], mesh: Mesh<T>) -> Self {
        let points: Vec<[T; 3]> = points.iter().map(|p| p.map(T::of)).collect();
        let plan = on_cpu(&points, Method::Given).expect(name);
        let near = plan.neighborhoods().clone();
        let mut areas = Vec::new();
        isograd::splat::area::forward(&near, &mut areas);
        let (phi, closest) = measure(&mesh);
        Self {
            name,
            points,
            near,
            areas,
            mesh,
            phi,
            closest,
        }
    }

    /// Random samples of a torus.
    fn even() -> Self {
        Self::new("torus", &torus_points(1200), meshes::torus(36, 14))
    }

    /// A torus as it is, with holes, with an outlier, in few places, with areas of 0; and a box with flat sides.
    fn all() -> Vec<Self> {
        let points = torus_points(1600);
        let outlier = [0.7, 0.0, 0.4];
        let hole = |p: &&[f64; 3]| distance(p, outlier) > 0.4 && p[0] > -0.5;
        let mut holed: Vec<_> = points.iter().filter(hole).copied().collect();
        let holes = Self::new("holes", &holed, meshes::torus(36, 14));
        holed.push(outlier);
        let outlying = Self::new("an outlier in a hole", &holed, meshes::torus(36, 14));
        assert!(Real::f64(outlying.areas[holed.len() - 1]) == 0.0);
        let places = [
            [0.7, 0.0, 0.25],
            [-0.7, 0.0, 0.25],
            [0.0, 0.95, 0.0],
            [0.0, -0.45, 0.0],
        ];
        let few: Vec<_> = (0..400).map(|i| places[i % 4]).collect();
        let few = Self::new("four places", &few, meshes::torus(30, 12));
        let mut none = Self::even();
        none.name = "areas of 0";
        none.areas.fill(T::of(0.0));
        let square = Self::new("a flat square", &square(1200), plate());
        vec![Self::even(), holes, outlying, few, none, square]
    }

    fn grid(&self) -> &Grid<T> {
        self.phi.grid()
    }

    /// A value of each sample, by its place, of so many components round 20.
    fn attribute(&self, components: usize) -> Attribute<T> {
        let wave = |p: &[T; 3], c: usize| {
            let [x, y, z] = p.map(|x| Real::f64(x));
            20.0 + (3.0 * x + c as f64).sin() + y * z * (1.0 + c as f64)
        };
        let row = |p: &[T; 3]| {
            (0..components)
                .map(|c| T::of(wave(p, c)))
                .collect::<Vec<_>>()
        };
        Attribute {
            name: "wave".into(),
            components,
            values: self.points.iter().flat_map(row).collect(),
        }
    }

    fn samples(&self) -> cpu::Samples<'_, T> {
        cpu::Samples {
            neighborhoods: &self.near,
            radius: self.near.common_radius,
            areas: &self.areas,
        }
    }

    fn surface(&self) -> cpu::Surface<'_, T> {
        cpu::Surface {
            mesh: &self.mesh,
            phi: &self.phi,
            closest: &self.closest,
        }
    }

    fn on_cpu(
        &self,
        attribute: &Attribute<T>,
        region: impl Into<Region>,
    ) -> Result<(cpu::Extension<T>, cpu::Residual<T>), cpu::Error> {
        let (mut residual, mut extension) = Default::default();
        let scratch = &mut cpu::Scratch::default();
        let (samples, surface) = (self.samples(), self.surface());
        cpu::forward(
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

    fn upload<R: Runtime>(&self, device: &Device<R>, attribute: &Attribute<T>) -> OnDevice<T> {
        let points = device.upload(self.points.as_flattened()).unwrap();
        let radii = device.upload(&self.near.radius).unwrap();
        OnDevice {
            near: isograd_gpu::neighbors::forward(device, &points, &radii).unwrap(),
            radius: self.near.common_radius,
            areas: device.upload(&self.areas).unwrap(),
            values: device.upload(&attribute.values).unwrap(),
            components: attribute.components,
            mesh: upload(device, &self.mesh),
            grid: *self.grid(),
            phi: device.upload(self.phi.values()).unwrap(),
            closest: device.upload(&self.closest).unwrap(),
        }
    }
}

/// Random points of a square of side 1 in the plane z = 0.
fn square(count: usize) -> Vec<[f64; 3]> {
    let mut numbers = Numbers(41);
    let mut point = || [numbers.unit() - 0.5, numbers.unit() - 0.5, 0.0];
    (0..count).map(|_| point()).collect()
}

/// A square mesh that waves a little off that plane.
fn plate<T: Scalar>() -> Mesh<T> {
    const SIDE: u32 = 24;
    let at = |i: u32| 0.9 * (f64::from(i) / f64::from(SIDE - 1) - 0.5);
    let vertex = |v: u32| {
        let (x, y) = (at(v / SIDE), at(v % SIDE));
        [x, y, 0.002 * (9.0 * x).sin() * (7.0 * y).cos()].map(T::of)
    };
    let cell = |q: u32| {
        let a = q / (SIDE - 1) * SIDE + q % (SIDE - 1);
        [[a, a + SIDE, a + SIDE + 1], [a, a + SIDE + 1, a + 1]]
    };
    let faces = (0..(SIDE - 1) * (SIDE - 1)).flat_map(cell).collect();
    Mesh::new((0..SIDE * SIDE).map(vertex).collect(), faces).unwrap()
}

/// φ around a mesh within 4 cells, and the closest faces.
fn measure<T: Scalar>(mesh: &Mesh<T>) -> (Field<T>, Vec<u32>) {
    let grid = grid::<T>([-1.03, -1.07, -0.41], 0.083, [26, 26, 11]);
    super::solve_on_cpu(mesh, &super::signs(grid), Band::Within(4.0 * 0.083))
}

/// A [`Scene`] on a device.
struct OnDevice<T> {
    near: isograd_gpu::neighbors::Neighborhoods<T>,
    radius: T,
    areas: Buffer<T>,
    values: Buffer<T>,
    components: usize,
    mesh: distance::Mesh<T>,
    grid: Grid<T>,
    phi: Buffer<T>,
    closest: Buffer<u32>,
}

impl<T: Scalar> OnDevice<T> {
    fn samples(&self) -> extend::Samples<'_, T> {
        extend::Samples {
            neighborhoods: &self.near,
            radius: self.radius,
            areas: &self.areas,
        }
    }

    fn attribute(&self) -> extend::Attribute<'_, T> {
        extend::Attribute {
            values: &self.values,
            components: self.components,
        }
    }

    fn surface(&self) -> extend::Surface<'_, T> {
        extend::Surface {
            mesh: &self.mesh,
            grid: &self.grid,
            phi: &self.phi,
            closest: &self.closest,
        }
    }

    fn extend<R: Runtime>(
        &self,
        device: &Device<R>,
        region: impl Into<Region>,
    ) -> Result<(extend::Extension<T>, extend::Residual<T>), extend::Error> {
        let (samples, surface) = (self.samples(), self.surface());
        extend::forward(device, samples, self.attribute(), surface, region)
    }

    /// The pullback, given cotangents at the vertices and in the band.
    fn pullback<R: Runtime>(
        &self,
        device: &Device<R>,
        (extension, residual): (&extend::Extension<T>, &extend::Residual<T>),
        [vertices, values]: [Option<&Buffer<T>>; 2],
    ) -> Result<extend::Cotangent<T>, extend::Error> {
        let (samples, of, surface) = (self.samples(), self.attribute(), self.surface());
        extend::pullback(
            device, samples, of, surface, residual, extension, vertices, values,
        )
    }
}

/// Results of a device, in the host's memory.
fn downloaded<R: Runtime, T: Scalar>(
    device: &Device<R>,
    shape: [usize; 3],
    (extension, residual): &(extend::Extension<T>, extend::Residual<T>),
) -> (cpu::Extension<T>, cpu::Residual<T>) {
    let numbers = |buffer: &Buffer<T>| device.download(buffer).unwrap();
    let double = |x: T| Real::f64(x);
    let fits = numbers(&residual.fits);
    let fit = |row: &[T]| cpu::Fit {
        radius: double(row[0]),
        weight: double(row[1]),
        mean: [row[2], row[3], row[4]].map(double),
        tilt: [row[5], row[6], row[7]].map(double),
    };
    let extension = cpu::Extension {
        components: extension.components,
        shape,
        vertices: numbers(&extension.vertices),
        cells: device.download(&extension.cells).unwrap(),
        values: numbers(&extension.values),
    };
    let residual = cpu::Residual {
        fits: fits.chunks_exact(extend::FIT).map(fit).collect(),
        smallest_area: double(numbers(&residual.smallest_area)[0]),
        barycentric: numbers(&residual.barycentric).as_chunks().0.to_vec(),
    };
    (extension, residual)
}

fn values_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for scene in Scene::<T>::all() {
        let width = |cells: f64| cells * Real::f64(scene.grid().spacing());
        for (components, region) in [
            (1, Region::Band(width(0.7))),
            (2, Region::Inside(width(0.7))),
            (3, Region::Band(width(3.0))),
            (6, Region::Band(width(50.0))),
        ] {
            let attribute = scene.attribute(components);
            let (expected, kept) = scene.on_cpu(&attribute, region).unwrap();
            let on_device = scene.upload(device, &attribute);
            let shape = scene.grid().shape();
            let run = || downloaded(device, shape, &on_device.extend(device, region).unwrap());
            let (found, residual) = run();
            println!("{}, {components} in {}:", scene.name, T::NAME);
            assert_eq!(found.cells, expected.cells);
            assert_near("vertices", &found.vertices, &expected.vertices, tolerance);
            assert_near("cells", &found.values, &expected.values, tolerance);
            let radii = |of: &cpu::Residual<T>| -> Vec<T> {
                of.fits.iter().map(|fit| T::of(fit.radius)).collect()
            };
            assert_near("radii", &radii(&residual), &radii(&kept), tolerance);
            let ratio = residual.smallest_area / kept.smallest_area;
            assert!((ratio - 1.0).abs() <= tolerance, "{ratio}");
            assert!((found, residual) == run(), "other bits the second time");
        }
    }
}

fn constants_are_exact<R: Runtime, T: Scalar>(device: &Device<R>) {
    let constant = [0.1, -3.7e5, 2.0 / 3.0, 4.0, 5e-9].map(T::of);
    for scene in Scene::<T>::all() {
        let attribute = Attribute {
            name: "constant".into(),
            components: 5,
            values: constant.repeat(scene.points.len()),
        };
        let found = scene
            .upload(device, &attribute)
            .extend(device, 3.0)
            .unwrap();
        let (found, _) = downloaded(device, scene.grid().shape(), &found);
        for row in found.vertices.chunks(5).chain(found.values.chunks(5)) {
            assert_eq!(row, constant, "{}", scene.name);
        }
    }
}
