//! The grids of the automatic orientation beside the CPU's, and their parts beside plain loops.

mod bodies;
mod cells;

use cubecl::prelude::Runtime;
use isograd::Real;
use isograd::orient::fill as cpu;
use isograd_gpu::orient::auto::fill::{self, Fill, Lattice, Members, Sights};
use isograd_gpu::{Buffer, Device, Error, Scalar};

use crate::devices::{in_each_number, on_each_device};
use bodies::{Body, bodies};

/// Cells over a reach, and by how much discs grow with the cell: those of the automatic method.
const SCALES: [(f64, f64); 2] = [(0.8, 1.0), (1.6, 1.6 / 1.1)];

/// Lights that differ by less were met in the same cells.
const SAME: f32 = 1e-5;

/// Members of a cloud on a device.
struct Uploaded<T> {
    rows: Buffer<u32>,
    points: Buffer<T>,
    axes: Buffer<f32>,
    reach: Buffer<f32>,
    growth: f64,
}

impl<T: Scalar> Uploaded<T> {
    fn new<R: Runtime>(device: &Device<R>, body: &Body<T>, growth: f64) -> Self {
        Self {
            rows: device.upload(&body.members).unwrap(),
            points: device.upload(body.points.as_flattened()).unwrap(),
            axes: device.upload(body.axes.as_flattened()).unwrap(),
            reach: device.upload(&body.reach).unwrap(),
            growth,
        }
    }

    fn members(&self) -> Members<'_, T> {
        Members {
            rows: &self.rows,
            points: &self.points,
            axes: &self.axes,
            reach: &self.reach,
            growth: self.growth,
        }
    }
}

/// Evidence and ends in the host's memory.
fn download<R: Runtime>(device: &Device<R>, sights: &Sights) -> Vec<cpu::Sights> {
    let ends = device.download(&sights.ends).unwrap();
    let evidence = device.download(&sights.evidence).unwrap();
    let ends = ends.as_chunks::<2>().0.iter();
    let both = evidence.into_iter().zip(ends);
    both.map(|(evidence, &ends)| cpu::Sights { evidence, ends })
        .collect()
}

fn lattice<T: Scalar>(body: &Body<T>, scale: f64, budget: usize) -> Lattice {
    let [mut low, mut high] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for &m in &body.members {
        for a in 0..3 {
            let x = Real::f64(body.points[m as usize][a]);
            (low[a], high[a]) = (low[a].min(x), high[a].max(x));
        }
    }
    Lattice::new(low, high, scale * body.spacing, budget)
}

fn on_the_cpu<T: Scalar>(body: &Body<T>, lattice: &Lattice, growth: f64) -> cpu::Fill {
    let mut fill = cpu::Fill::default();
    fill.run(lattice, body.members.len(), |m| {
        let p = body.members[m] as usize;
        let point = body.points[p].map(Real::f64);
        (point, body.axes[p], growth * f64::from(body.reach[p]))
    });
    fill
}

/// Whether two members see the same.
fn same(a: &cpu::Sights, b: &cpu::Sights) -> bool {
    let near = |a: f32, b: f32| (a - b).abs() <= SAME;
    near(a.evidence, b.evidence) && near(a.ends[0], b.ends[0]) && near(a.ends[1], b.ends[1])
}

#[test]
fn what_samples_see_is_what_they_see_on_the_cpu() {
    in_each_number!(check_sights);
}

/// In double precision discs are in the same places; in single precision, in which a place is a few 10⁻⁶ of a cell off,
/// a few cells at the rims of discs are on the other side.
fn check_sights<R: Runtime, T: Scalar>(device: &Device<R>) {
    let (mut dark, mut bright) = (0, 0);
    for body in bodies::<T>() {
        for (scale, growth) in SCALES {
            let growth = growth * body.spacing;
            let lattice = lattice(&body, scale, 1 << 18);
            let expected = on_the_cpu(&body, &lattice, growth);
            let uploaded = Uploaded::new(device, &body, growth);
            let fill = Fill::new(device, &lattice, &uploaded.members()).unwrap();
            let found = download(device, &fill.look(device).unwrap());
            let cells = fill.occupied.cells(device).unwrap();
            let differ = |(a, b): &(&u8, &u8)| a != b;
            let moved = cells.iter().zip(expected.occupied()).filter(differ).count();
            let pairs = found.iter().zip(expected.sights());
            let others = pairs.filter(|(a, b)| !same(a, b)).count();
            let (n, regions) = (body.members.len(), fill.sides.len());
            println!(
                "{}, {}, {scale}: {moved} of {} cells and {others} of {n} members differ; {regions} regions",
                body.name,
                T::NAME,
                cells.len(),
            );
            let few = |n: usize| if T::NAME == "f32" { n.div_ceil(100) } else { 0 };
            assert_eq!(found.len(), n);
            assert!(moved <= few(n) && others <= few(n), "{}", body.name);
            if moved == 0 {
                assert_eq!(fill.sides, expected.sides(), "{}", body.name);
            }
            let matter = expected.sides().iter().filter(|&&side| side < 0).count();
            assert!(matter >= body.matter, "{}: {matter}", body.name);
            dark += found.iter().filter(|s| s.ends[0] < 0.0).count();
            bright += found.iter().filter(|s| s.ends[0] > 0.3).count();
        }
    }
    assert!(dark > 1000 && bright > 1000, "{dark} {bright}");
}

#[test]
fn the_same_bits_every_time() {
    in_each_number!(check_bits);
}

fn check_bits<R: Runtime, T: Scalar>(device: &Device<R>) {
    for body in bodies::<T>() {
        let lattice = lattice(&body, 0.8, 1 << 15);
        let uploaded = Uploaded::new(device, &body, body.spacing);
        let run = || {
            let sights = fill::forward(device, &lattice, &uploaded.members()).unwrap();
            download(device, &sights)
        };
        assert_eq!(run(), run(), "{}", body.name);
    }
}

#[test]
fn degenerate_members_see_what_they_see_on_the_cpu() {
    in_each_number!(check_degenerate);
}

fn check_degenerate<R: Runtime, T: Scalar>(device: &Device<R>) {
    let body = |points: Vec<[f64; 3]>, axis: [f32; 3], reach: f32| {
        let points = points.iter().map(|p| p.map(<T as Real>::of)).collect();
        Body::new("", points, |_| axis, |_| reach, 0.25)
    };
    let up = [0.0, 0.6, 0.8];
    let mut repeated = body(vec![[1.0, 2.0, 3.0], [1.5, 2.0, 3.0]], up, 1.0);
    repeated.members = vec![1, 1, 0, 1];
    let cases = [
        ("one", body(vec![[1.0, 2.0, 3.0]], up, 1.0)),
        (
            "all in one place",
            body(vec![[5.0, -2.0, 7.0]; 40], up, 1.0),
        ),
        (
            "no axis",
            body(vec![[0.0; 3], [1.0, 0.5, 0.25]], [0.0; 3], 1.0),
        ),
        ("no reach", body(vec![[0.0; 3], [1.0, 0.5, 0.25]], up, 0.0)),
        (
            "too far a reach",
            body(vec![[0.0; 3], [1.0, 0.5, 0.25]], up, 1e9),
        ),
        ("one row often", repeated),
        ("no free cell", body(vec![[0.0; 3]; 3], [0.0; 3], 1e9)),
    ];
    for (name, body) in cases {
        let lattice = lattice(&body, 0.8, 1 << 12);
        let expected = on_the_cpu(&body, &lattice, body.spacing);
        let uploaded = Uploaded::new(device, &body, body.spacing);
        let fill = Fill::new(device, &lattice, &uploaded.members()).unwrap();
        assert_eq!(
            fill.occupied.cells(device).unwrap(),
            expected.occupied(),
            "{name}"
        );
        assert_eq!(fill.sides, expected.sides(), "{name}");
        let found = download(device, &fill.look(device).unwrap());
        assert_eq!(found.len(), body.members.len());
        let mut pairs = found.iter().zip(expected.sights());
        assert!(pairs.all(|(a, b)| same(a, b)), "{name}: {found:?}");
    }
}

#[test]
fn no_members_and_arrays_that_do_not_fit() {
    on_each_device!(check_refused);
}

fn check_refused<R: Runtime>(device: &Device<R>) {
    let points = vec![[0f32; 3], [1.0; 3]];
    let mut body = Body::new("", points, |_| [1.0, 0.0, 0.0], |_| 1.0, 0.25);
    let fine = lattice(&body, 1.0, 1 << 12);
    body.members.clear();
    let mut uploaded = Uploaded::new(device, &body, 0.25);
    let nothing = Fill::new(device, &fine, &uploaded.members()).unwrap();
    assert_eq!(nothing.sides, [1]);
    let sights = nothing.look(device).unwrap();
    assert!(download(device, &sights).is_empty());
    let large = Lattice::new([0.0; 3], [1e4; 3], 1.0, usize::MAX);
    let refused = fill::forward(device, &large, &uploaded.members());
    assert!(matches!(refused, Err(Error::TooLarge { .. })));
    uploaded.axes = device.empty(5).unwrap();
    let refused = fill::forward(device, &fine, &uploaded.members());
    assert!(matches!(refused, Err(Error::Length { .. })));
}
