//! The pullback, beside the CPU's for the same extension.

use super::*;
use crate::samples::report;

tests! {
    in_each_number: cotangents_are_those_of_the_cpu, the_attribute_gets_the_transpose_of_the_map;
}

/// Cotangents of an extension.
struct Bars<T> {
    vertices: Option<Vec<T>>,
    cells: Option<Vec<T>>,
}

impl<T: Scalar> Bars<T> {
    /// Of both, or one, or of a few vertices alone.
    fn all(extension: &cpu::Extension<T>) -> [Self; 4] {
        let vertices = Numbers(21).list(extension.vertices.len());
        let cells = Numbers(22).list(extension.values.len());
        let mut few = vec![T::of(0.0); vertices.len()];
        few[..10].copy_from_slice(&vertices[..10]);
        let of = |vertices: Option<&Vec<T>>, cells: Option<&Vec<T>>| Self {
            vertices: vertices.cloned(),
            cells: cells.cloned(),
        };
        [
            of(Some(&vertices), Some(&cells)),
            of(Some(&vertices), None),
            of(None, Some(&cells)),
            of(Some(&few), None),
        ]
    }
}

/// Cotangents in the host's memory: of attribute, points and least radius, areas, vertices, low corner and spacing of the
/// grid.
type Pulled<T> = [Vec<T>; 6];

const NAMES: [&str; 6] = [
    "attribute",
    "points and radius",
    "areas",
    "vertices",
    "lower",
    "spacing",
];

fn pull<R: Runtime, T: Scalar>(
    device: &Device<R>,
    scene: &OnDevice<T>,
    (extension, residual): &(extend::Extension<T>, extend::Residual<T>),
    bars: &Bars<T>,
) -> (Pulled<T>, usize) {
    let [vertices, cells] = [&bars.vertices, &bars.cells]
        .map(|bar| bar.as_ref().map(|bar| device.upload(bar).unwrap()));
    let given = [vertices.as_ref(), cells.as_ref()];
    let found = scene
        .pullback(device, (extension, residual), given)
        .unwrap();
    let numbers = |buffer: &Buffer<T>| device.download(buffer).unwrap();
    let grid = numbers(&found.grid);
    let radius = numbers(&found.radius)[0] / scene.radius;
    let pulled = [
        numbers(&found.attribute),
        [numbers(&found.points), vec![radius]].concat(),
        numbers(&found.areas),
        numbers(&found.vertices),
        grid[..3].to_vec(),
        grid[3..].to_vec(),
    ];
    (pulled, device.download(&found.guarded).unwrap()[0] as usize)
}

fn pull_on_cpu<T: Scalar>(
    scene: &Scene<T>,
    attribute: &Attribute<T>,
    (extension, residual): &(cpu::Extension<T>, cpu::Residual<T>),
    bars: &Bars<T>,
) -> (Pulled<T>, usize) {
    let mut out = cpu::Cotangent::default();
    let inputs = cpu::Inputs {
        samples: scene.samples(),
        attribute,
        surface: scene.surface(),
        residual,
        extension,
        vertices_bar: bars.vertices.as_deref(),
        values_bar: bars.cells.as_deref(),
    };
    cpu::pullback(&inputs, &mut out).unwrap();
    let radius = T::of(out.radius / Real::f64(scene.samples().radius));
    let pulled = [
        out.attribute,
        [out.points.into_flattened(), vec![radius]].concat(),
        out.areas,
        out.vertices.into_flattened(),
        out.grid.lower.to_vec(),
        vec![out.grid.spacing],
    ];
    (pulled, out.guarded)
}

fn largest<T: Scalar>(numbers: &[T]) -> f64 {
    let sizes = numbers.iter().map(|x| Real::f64(*x).abs());
    sizes.fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
}

/// Adds up the cotangents of the points that coincide: every so many of them.
fn add_up<T: Scalar>(points_and_radius: &mut Vec<T>, places: usize) {
    let radius = points_and_radius.pop().expect("a radius");
    let mut sums = vec![T::of(0.0); 3 * places];
    for (i, bar) in points_and_radius.iter().enumerate() {
        sums[i % (3 * places)] += *bar;
    }
    sums.push(radius);
    *points_and_radius = sums;
}

fn cotangents_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for scene in Scene::<T>::all() {
        // Across a line or a plane of samples, slopes are bounded by the ridge alone: 1e-5 of their spread, by which the
        // rounding of both sides is divided, and that of `g·s` twice.
        let tolerance = match (scene.name, T::NAME) {
            ("four places", _) => 20.0 * tolerance,
            ("a flat square", "f64") => 100.0 * tolerance,
            _ => tolerance,
        };
        for components in [1, 3, 6] {
            let attribute = scene.attribute(components);
            let on_device = scene.upload(device, &attribute);
            let made = on_device.extend(device, 3.0).unwrap();
            let of_cpu = downloaded(device, scene.grid().shape(), &made);
            // All kinds with three components; all of them together with other numbers of components, too.
            let kinds = if components == 3 { 4 } else { 1 };
            for (case, bars) in Bars::all(&of_cpu.0).into_iter().take(kinds).enumerate() {
                let (mut found, guarded) = pull(device, &on_device, &made, &bars);
                let (mut expected, wanted) = pull_on_cpu(&scene, &attribute, &of_cpu, &bars);
                println!("{}, {components} in {}:", scene.name, T::NAME);
                let pulled = found.clone();
                if scene.name == "four places" {
                    // Which of the samples in one place is the 6th or 64th is not said.
                    for of in [&mut found, &mut expected] {
                        add_up(&mut of[1], 4);
                    }
                }
                for (k, name) in NAMES.into_iter().enumerate() {
                    if largest(&expected[k]) > 1e-12 {
                        assert_near(name, &found[k], &expected[k], tolerance);
                    } else {
                        // Of samples that coincide, but for what rounding says.
                        assert!(largest(&found[k]) < 1e-6, "{name}");
                    }
                }
                if scene.name != "four places" {
                    // Whether samples in one place coincide to the last bit, rounding says.
                    assert_eq!(guarded, wanted);
                }
                // Of all cotangents, which go through every kernel.
                if case == 0 {
                    let again = pull(device, &on_device, &made, &bars);
                    assert!(again == (pulled, guarded), "other bits the second time");
                }
            }
        }
    }
}

/// `⟨v̄, v⟩ = ⟨ū, u⟩`, for noise.
fn the_attribute_gets_the_transpose_of_the_map<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for scene in Scene::<T>::all() {
        let components = 5;
        let attribute = Attribute {
            name: "noise".into(),
            components,
            values: Numbers(55).list(components * scene.points.len()),
        };
        let on_device = scene.upload(device, &attribute);
        let made = on_device.extend(device, 3.0).unwrap();
        let (extension, _) = downloaded(device, scene.grid().shape(), &made);
        let [bars, ..] = Bars::all(&extension);
        let ([attribute_bar, ..], _) = pull(device, &on_device, &made, &bars);
        let dot = |a: &[T], b: &[T]| -> [f64; 2] {
            let products = a.iter().zip(b).map(|(a, b)| Real::f64(*a) * Real::f64(*b));
            products.fold([0.0; 2], |[sum, size], x| [sum + x, size + x.abs()])
        };
        let [at_vertices, size] = dot(bars.vertices.as_ref().unwrap(), &extension.vertices);
        let [in_band, more] = dot(bars.cells.as_ref().unwrap(), &extension.values);
        let [found, _] = dot(&attribute_bar, &attribute.values);
        let error = (found - at_vertices - in_band).abs() / (size + more);
        report(scene.name, error);
        assert!(error <= 0.1 * tolerance, "{}: {error:e}", scene.name);
    }
}
