//! The neighbor graph of the automatic orientation beside that of the CPU.

use cubecl::prelude::Runtime;
use isograd::Real;
use isograd::orient::graph::{Graph, NEIGHBORS};
use isograd_element::coupling;
use isograd_element::vector;
use isograd_gpu::orient::auto::graph::{self, part_slabs, relax, sheet_evidence};
use isograd_gpu::{Device, Scalar, neighbors, normals};
use isograd_shapes::{Layout, Sampling};

use crate::clouds::{Cloud, clouds, real};
use crate::devices::{Numbers, in_each_number, on_each_device};

/// What single precision may do to a number, of the size it has there.
const TOLERANCE: f64 = 1e-4;

/// The graph holds single precision whatever the points are in.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// A cloud on the device, sorted, with the CPU's radii.
struct Placed<T> {
    near: neighbors::Neighborhoods<T>,
    graph: graph::Graph,
    /// Input index of each sorted point.
    order: Vec<u32>,
}

impl<T: Scalar> Placed<T> {
    fn new<R: Runtime>(device: &Device<R>, cloud: &Cloud<T>) -> Self {
        let radii = device.upload(&cloud.near.radius).unwrap();
        let near = neighbors::forward(device, &cloud.upload(device), &radii).unwrap();
        let wide = device.upload(&cloud.axes.radius).unwrap();
        let wide = neighbors::with_radii(device, &near, &wide).unwrap();
        let (_, planes) = normals::forward(device, &wide).unwrap();
        let axes = device.upload(cloud.axes.normals.as_flattened()).unwrap();
        let spacing = cloud.near.spacing();
        Self {
            graph: graph::forward(device, &near, &axes, Some(&planes), spacing).unwrap(),
            order: device.download(near.order()).unwrap(),
            near,
        }
    }

    /// The graph on the host, still in the order of the device. Without offsets.
    fn download<R: Runtime>(&self, device: &Device<R>) -> Graph {
        let numbers = |buffer| device.download::<f32>(buffer).unwrap();
        let near = device.download(&self.graph.near).unwrap();
        Graph {
            near: near.as_chunks().0.to_vec(),
            axis: numbers(&self.graph.axis).as_chunks().0.to_vec(),
            coupling: numbers(&self.graph.coupling).as_chunks().0.to_vec(),
            reach: numbers(&self.graph.reach),
            scatter: numbers(&self.graph.scatter),
            thickness: numbers(&self.graph.thickness),
            area: numbers(&self.graph.area),
            spread: numbers(&self.graph.spread),
            side: numbers(&self.graph.side),
            ..Graph::default()
        }
    }
}

/// The graph with all rows and all indices those of the input, `order` being the input index of each sorted point.
fn by_input(graph: &Graph, order: &[u32]) -> Graph {
    let mut position = vec![0; order.len()];
    for (p, &i) in order.iter().enumerate() {
        position[i as usize] = p;
    }
    fn rows<V: Copy>(values: &[V], position: &[usize]) -> Vec<V> {
        position
            .iter()
            .filter_map(|&p| values.get(p).copied())
            .collect()
    }
    let near = rows(&graph.near, &position);
    Graph {
        near: near
            .iter()
            .map(|near| near.map(|p| order[p as usize]))
            .collect(),
        offset: rows(&graph.offset, &position),
        axis: rows(&graph.axis, &position),
        coupling: rows(&graph.coupling, &position),
        reach: rows(&graph.reach, &position),
        scatter: rows(&graph.scatter, &position),
        thickness: rows(&graph.thickness, &position),
        area: rows(&graph.area, &position),
        spread: rows(&graph.spread, &position),
        side: rows(&graph.side, &position),
        ring: rows(&graph.ring, &position),
    }
}

/// The CPU's graph, by input index.
fn expected<T: Scalar>(cloud: &Cloud<T>) -> Graph {
    let mut graph = Graph::default();
    graph.build(&(&cloud.axes).into(), &cloud.near);
    by_input(&graph, cloud.near.index.order())
}

/// Both sides of a plate so many spacings thick, with noise of so many spacings, in places above itself.
fn plate<T: Scalar>(name: &'static str, thick: f64, noise: f64) -> Cloud<T> {
    let n = 3001;
    let spacing = (2.0 / n as f64).sqrt();
    let mut numbers = Numbers(29);
    let mut sample = |k: usize| {
        let height = thick * (k % 2) as f64 + noise * numbers.signed();
        [numbers.unit() - 7.0, spacing * height, numbers.unit()].map(real)
    };
    Cloud::of(name, (0..n).map(&mut sample).collect())
}

/// Bodies with edges, thin parts and noise, and clouds that break careless indices.
fn all_clouds<T: Scalar>() -> Vec<Cloud<T>> {
    let mut numbers = Numbers(3);
    let mut body = |name: &'static str, n: usize, noise: f64| {
        let sampling = Sampling {
            layout: Layout::Random,
            ..Sampling::default()
        };
        let shape = isograd_shapes::by_name(name).unwrap();
        let samples = shape.sample::<f64>(n, &sampling, 11).unwrap();
        let mut points = samples.cloud.points().to_vec();
        for x in points.as_flattened_mut() {
            *x += noise * numbers.signed();
        }
        Cloud::of(name, points.iter().map(|p| p.map(real)).collect())
    };
    let bodies = [
        body("airliner", 4003, 0.0),
        body("box", 2001, 0.0),
        body("knot", 3001, 0.01),
        body("car", 2503, 0.0),
    ];
    let lattice = (0..1331).map(|i| [i % 11, i / 11 % 11, i / 121].map(|x| real(f64::from(x))));
    let few = |n: usize| -> Vec<[T; 3]> {
        let mut numbers = Numbers(n as u64);
        (0..n)
            .map(|_| [0; 3].map(|_| real(numbers.unit())))
            .collect()
    };
    let mut all = clouds();
    all.extend(bodies);
    all.extend([
        plate("plate of 1.5 spacings", 1.5, 0.0),
        plate("plate of 0.2 spacings", 0.2, 0.0),
        plate("plate of 2 spacings with noise", 2.0, 0.6),
        Cloud::of("a lattice", lattice.collect()),
        Cloud::of("heaps of 40", few(40).repeat(40)),
        Cloud::of("five points", few(5)),
        Cloud::of("17 points", few(17)),
    ]);
    all
}

#[test]
fn the_graph_is_that_of_the_cpu() {
    in_each_number!(check_graph);
}

/// Where rounding decides which of two neighbors is nearer, or which plane fits a quorum best, a point may have
/// another sheet than on the CPU: those are counted. All that is found from equal sheets is equal.
fn check_graph<R: Runtime, T: Scalar>(device: &Device<R>) {
    let (mut sheets, mut scattering, mut strong) = (0, 0, 0);
    for cloud in all_clouds::<T>() {
        let (name, n) = (cloud.name, cloud.points.len());
        let placed = Placed::new(device, &cloud);
        let found = by_input(&placed.download(device), &placed.order);
        let expected = expected(&cloud);
        let others = check_neighbors(&cloud, &found, &expected);
        let alike = |i: usize| {
            let off = vector::norm(vector::sub(found.axis[i], expected.axis[i]));
            let scatter = f64::from(found.scatter[i] - expected.scatter[i]).abs();
            f64::from(off) < TOLERANCE
                && scatter <= TOLERANCE * f64::from(expected.ring[i])
                && found.near[i] == expected.near[i]
        };
        let alike: Vec<bool> = (0..n).map(alike).collect();
        let flips = alike.iter().filter(|&&a| !a).count();
        let mut worst = Worst::default();
        for i in (0..n).filter(|&i| expected.near[i].iter().all(|&j| alike[j as usize]) && alike[i])
        {
            // Of few points none has a ring.
            let far = expected.offset[i].map(vector::norm);
            let unit = far.into_iter().fold(expected.ring[i], f32::max);
            worst.take("reach", found.reach[i], expected.reach[i], unit);
            worst.take("scatter", found.scatter[i], expected.scatter[i], unit);
            worst.take("thickness", found.thickness[i], expected.thickness[i], unit);
            worst.take(
                "spread",
                found.spread[i],
                expected.spread[i],
                expected.spread[i],
            );
            worst.take("side", found.side[i], expected.side[i], 1.0);
        }
        println!(
            "{name}, {}: {others} of {n} with other neighbors, {flips} with another sheet; {worst:?}",
            T::NAME
        );
        check_couplings(device, &cloud, &placed);
        worst.check(name);
        // In a solid lattice many planes fit equally well.
        let most = if name == "a lattice" { n / 40 } else { n / 500 };
        assert!(flips <= most, "{name}: {flips} of {n} differ");
        sheets += expected.scatter.iter().filter(|&&s| s > 0.0).count();
        scattering += expected.spread.iter().filter(|&&s| s > 0.0).count();
        strong += expected
            .coupling
            .as_flattened()
            .iter()
            .filter(|c| c.abs() > 0.5)
            .count();
    }
    assert!(
        sheets > 1000 && scattering > 1000 && strong > 10_000,
        "{sheets} {scattering} {strong}"
    );
}

/// Couplings and areas are those of the CPU's formulas for the axes and lengths that the device found. Beside its own
/// couplings there is nothing to see where sheets are flat to rounding: there the height of one sample over the sheet
/// of another is rounding, and so is their tie, on the CPU as well.
fn check_couplings<R: Runtime, T: Scalar>(
    device: &Device<R>,
    cloud: &Cloud<T>,
    placed: &Placed<T>,
) {
    let mut graph = placed.download(device);
    fill_offsets(cloud, &placed.order, &mut graph);
    let mut worst = 0.0f32;
    for (p, near) in graph.near.iter().enumerate() {
        let mut same = 0.0;
        for (slot, &q) in near.iter().enumerate() {
            let q = q as usize;
            let (a, b, d) = (graph.axis[p], graph.axis[q], graph.offset[p][slot]);
            let gap = coupling::least_gap(graph.scatter[p], graph.scatter[q]);
            let spreads = graph.spread[p] * graph.spread[q];
            let thicknesses = graph.thickness[p] * graph.thickness[q];
            let blur = coupling::blur(graph.reach[p], spreads, thicknesses, gap);
            let heights = vector::dot(a, d) * vector::dot(b, d);
            let square = vector::norm_squared(d) + blur;
            let tie = coupling::coupled(vector::dot(a, b), heights, square, gap);
            let expected = if q == p { 0.0 } else { coupling::trusted(tie) };
            let own = graph.coupling[p][slot];
            worst = worst.max((own - expected).abs());
            same += f32::from(u8::from(coupling::on_same_sheet(own, vector::dot(a, b))));
        }
        let expected = coupling::area(graph.reach[p], same);
        if graph.area[p] != expected {
            worst = worst.max((graph.area[p] / expected - 1.0).abs());
        }
    }
    println!("    couplings and areas within {worst:.1e} of those of the same axes");
    assert!(f64::from(worst) <= TOLERANCE, "{}: {worst:e}", cloud.name);
}

/// The largest differences, each in its own unit.
#[derive(Debug, Default)]
struct Worst(std::collections::BTreeMap<&'static str, f64>);

impl Worst {
    fn take(&mut self, what: &'static str, found: f32, expected: f32, unit: f32) {
        assert!(found.is_finite(), "{what}: {found}, not {expected}");
        let difference = f64::from(found - expected).abs();
        let worst = self.0.entry(what).or_insert(0.0);
        if difference > 0.0 {
            *worst = worst.max(difference / f64::from(unit));
        }
    }

    fn check(&self, name: &str) {
        for (what, &worst) in &self.0 {
            assert!(worst <= TOLERANCE, "{name}, {what}: {worst:e}");
        }
    }
}

/// How many points have other neighbors, or the same in another order; those are equally far but for rounding, and in
/// double precision and between whole numbers there are none.
fn check_neighbors<T: Scalar>(cloud: &Cloud<T>, found: &Graph, expected: &Graph) -> usize {
    let mut others = 0;
    for i in 0..cloud.points.len() {
        let square = |j: u32| {
            let [a, b] = [i, j as usize].map(|i| vector::to_f64(cloud.points[i]));
            vector::norm_squared(vector::sub(a, b))
        };
        for (&j, &k) in found.near[i].iter().zip(&expected.near[i]) {
            let (a, b) = (square(j), square(k));
            assert!(
                (a - b).abs() <= ROUNDING * b,
                "{}, point {i}: {j}, not {k}",
                cloud.name
            );
        }
        others += usize::from(found.near[i] != expected.near[i]);
    }
    let exact = ["a lattice", "heaps of 40", "five points", "17 points"];
    if T::NAME == "f64" || exact.contains(&cloud.name) {
        assert_eq!(others, 0, "{}", cloud.name);
    }
    others
}

#[test]
fn what_spreads_along_a_graph_is_what_does_on_the_cpu() {
    in_each_number!(check_spread);
}

/// On the device's own graph.
fn check_spread<R: Runtime, T: Scalar>(device: &Device<R>) {
    let (mut parted, mut evident, mut believing) = (0, 0, 0);
    for cloud in all_clouds::<T>() {
        let name = cloud.name;
        let Placed {
            near,
            mut graph,
            order,
        } = Placed::new(device, &cloud);
        let placed = Placed {
            near: near.clone(),
            graph: graph.clone(),
            order,
        };
        let mut cpu = placed.download(device);
        let before = cpu.coupling.clone();
        fill_offsets(&cloud, &placed.order, &mut cpu);
        let mut numbers = Numbers(13);
        let n = cloud.points.len();
        // As often as not there is no slab, and no evidence.
        let slab: Vec<f32> = (0..n).map(|_| numbers.signed().max(0.0) as f32).collect();
        let evidence: Vec<f32> = (0..n)
            .map(|_| (3.0 * numbers.signed()).clamp(-2.0, 2.0) as f32)
            .map(|x| x.signum() * (x.abs() - 1.0).max(0.0))
            .collect();
        let mut worst = Worst::default();
        let mut compare = |what, found: Vec<f32>, expected: &[f32]| {
            assert_eq!(found.len(), expected.len());
            for (found, &expected) in found.into_iter().zip(expected) {
                worst.take(what, found, expected, 1.0);
            }
        };
        part_slabs(device, &mut graph, &device.upload(&slab).unwrap()).unwrap();
        cpu.part_slabs(&slab);
        let coupling = device.download(&graph.coupling).unwrap();
        compare("parted", coupling, cpu.coupling.as_flattened());
        let sheets = sheet_evidence(device, &near, &graph, cloud.near.spacing()).unwrap();
        let expected: Vec<f32> = (0..n).map(|p| cpu.sheet_evidence(p)).collect();
        compare("sheets", device.download(&sheets).unwrap(), &expected);
        let belief = relax(device, &graph, &device.upload(&evidence).unwrap()).unwrap();
        let (mut beliefs, mut next) = Default::default();
        cpu.relax(&evidence, &mut beliefs, &mut next);
        compare("belief", device.download(&belief).unwrap(), &beliefs);
        println!("{name}, {}: {worst:?}", T::NAME);
        worst.check(name);
        parted += (0..n).filter(|&p| before[p] != cpu.coupling[p]).count();
        evident += expected.iter().filter(|e| e.abs() > 0.05).count();
        believing += beliefs.iter().filter(|b| b.abs() > 0.05).count();
    }
    assert!(
        parted > 1000 && evident > 1000 && believing > 1000,
        "{parted} {evident} {believing}"
    );
}

/// As the CPU takes them.
fn fill_offsets<T: Scalar>(cloud: &Cloud<T>, order: &[u32], graph: &mut Graph) {
    let unit = 1.0 / Real::f64(cloud.near.spacing());
    let point = |p: usize| cloud.points[order[p] as usize];
    let offset = |p: usize, q: u32| {
        vector::sub(point(q as usize), point(p)).map(|x| (Real::f64(x) * unit) as f32)
    };
    let rows = graph.near.iter().enumerate();
    graph.offset = rows.map(|(p, near)| near.map(|q| offset(p, q))).collect();
}

#[test]
fn any_number_of_points_has_a_graph_and_the_nearest_are_those_of_all_pairs() {
    on_each_device!(check_few);
}

fn check_few<R: Runtime>(device: &Device<R>) {
    let mut numbers = Numbers(37);
    // On a few places, so that many are equal or equally far; zeros of both signs are equal.
    let mut place = |_| {
        [0; 3].map(|_| match numbers.bits() % 4 {
            0 => 0.0f32,
            1 => -0.0,
            k => k as f32,
        })
    };
    for n in [0, 1, 2, 5, 16, 17, 18, 333, 2000] {
        let points: Vec<[f32; 3]> = (0..n).map(&mut place).collect();
        check_all_pairs(device, &points);
        check_all_pairs(device, &vec![[1.5; 3]; n]);
    }
}

fn check_all_pairs<R: Runtime>(device: &Device<R>, points: &[[f32; 3]]) {
    let n = points.len();
    let buffer = device.upload(points.as_flattened()).unwrap();
    let radii = device.upload(&vec![1f32; n]).unwrap();
    let near = neighbors::forward(device, &buffer, &radii).unwrap();
    let (axes, planes) = normals::forward(device, &near).unwrap();
    let graph = graph::forward(device, &near, &axes, Some(&planes), 1.0).unwrap();
    assert!(graph.len() == n && graph.is_empty() == (n == 0));
    let order = device.download(near.order()).unwrap();
    let placed = Placed { near, graph, order };
    let found = by_input(&placed.download(device), &placed.order);
    for i in 0..n {
        let mut others: Vec<(f32, u32)> = (0..n)
            .filter(|&j| j != i)
            .map(|j| {
                (
                    vector::norm_squared(vector::sub(points[j], points[i])),
                    j as u32,
                )
            })
            .collect();
        others.sort_by(|a, b| a.partial_cmp(b).unwrap());
        others.resize(n.saturating_sub(1).max(NEIGHBORS), (0.0, i as u32));
        let nearest: Vec<u32> = others.iter().map(|&(_, j)| j).take(NEIGHBORS).collect();
        assert_eq!(found.near[i], nearest[..], "point {i} of {n}");
        let numbers = [
            found.reach[i],
            found.scatter[i],
            found.area[i],
            found.thickness[i],
        ];
        assert!(
            numbers.iter().all(|x| x.is_finite() && *x >= 0.0),
            "{numbers:?}"
        );
        for (slot, &j) in found.near[i].iter().enumerate() {
            let coupling = found.coupling[i][slot];
            assert!(
                coupling.abs() <= 1.0 && (j as usize != i || coupling == 0.0),
                "{coupling}"
            );
        }
    }
    let ones = device.upload(&vec![1f32; n]).unwrap();
    let sheets = sheet_evidence(device, &placed.near, &placed.graph, 1.0).unwrap();
    let belief = relax(device, &placed.graph, &ones).unwrap();
    for x in [sheets, belief]
        .iter()
        .flat_map(|x| device.download(x).unwrap())
    {
        assert!(x.abs() <= 1.0, "{x}");
    }
}

#[test]
fn heaps_take_no_quadratic_time_and_two_runs_of_the_graph_give_the_same_bits() {
    on_each_device!(check_runs);
}

/// A look at all equal points from each of them would take hours.
fn check_runs<R: Runtime>(device: &Device<R>) {
    let mut points = vec![[0.5f32; 3]; 40_000];
    points[7] = [1e6; 3];
    points[8] = [1e6, 0.0, 3.0];
    let buffer = device.upload(points.as_flattened()).unwrap();
    let ones = device.upload(&vec![1f32; points.len()]).unwrap();
    let heap = || {
        let near = neighbors::forward(device, &buffer, &ones).unwrap();
        let graph = graph::forward(device, &near, &buffer, None, 1.0).unwrap();
        let order = device.download(near.order()).unwrap();
        bits(device, Placed { near, graph, order }, 1.0)
    };
    assert!(heap() == heap());
    let plate = plate::<f32>("plate", 1.0, 0.3);
    let run = || {
        let placed = Placed::new(device, &plate);
        bits(device, placed, plate.near.spacing())
    };
    assert!(run() == run());
}

/// All that a graph holds and leads to.
fn bits<R: Runtime>(device: &Device<R>, mut placed: Placed<f32>, spacing: f32) -> Vec<u32> {
    let halves = vec![0.5f32; placed.order.len()];
    let halves = device.upload(&halves).unwrap();
    part_slabs(device, &mut placed.graph, &halves).unwrap();
    let sheets = sheet_evidence(device, &placed.near, &placed.graph, spacing).unwrap();
    let belief = relax(device, &placed.graph, &sheets).unwrap();
    let graph = placed.download(device);
    let mut bits: Vec<u32> = graph.near.as_flattened().to_vec();
    for numbers in [
        graph.axis.as_flattened(),
        graph.coupling.as_flattened(),
        &graph.reach,
        &graph.scatter,
        &graph.thickness,
        &graph.area,
        &graph.spread,
        &graph.side,
        &device.download(&belief).unwrap(),
    ] {
        bits.extend(numbers.iter().map(|x| x.to_bits()));
    }
    bits
}

#[test]
fn a_graph_of_arrays_that_do_not_fit_is_refused() {
    on_each_device!(check_refused);
}

fn check_refused<R: Runtime>(device: &Device<R>) {
    let cloud = &clouds::<f32>()[2];
    let mut placed = Placed::new(device, cloud);
    let few = device.upload(&[1f32; 9]).unwrap();
    assert!(graph::forward(device, &placed.near, &few, None, 1.0).is_err());
    assert!(part_slabs(device, &mut placed.graph, &few).is_err());
    assert!(relax(device, &placed.graph, &few).is_err());
    let other = neighbors::forward(device, &few, &device.upload(&[1f32; 3]).unwrap()).unwrap();
    assert!(sheet_evidence(device, &other, &placed.graph, 1.0).is_err());
    let (_, planes) = normals::forward(device, &other).unwrap();
    let axes = device.upload(cloud.axes.normals.as_flattened()).unwrap();
    assert!(graph::forward(device, &placed.near, &axes, Some(&planes), 1.0).is_err());
    // Without planes nothing scatters.
    let graph = graph::forward(device, &placed.near, &axes, None, 1.0).unwrap();
    for zeros in [&graph.spread, &graph.side] {
        assert!(device.download(zeros).unwrap().iter().all(|&x| x == 0.0));
    }
}
