//! The pullback of the whole pipeline: every result and every input, the same bits on any number of threads,
//! memory, and input that makes no sense. Whole bodies are in `isograd-shapes/tests/gradients.rs`.

use isograd::distance::extend;
use isograd::isosurface::Level;
use isograd::neighbors::Radius;
use isograd::orient::Method;
use isograd::poisson::Smoothing;
use isograd::splat::Weights;
use isograd::{
    Attribute, CloudCotangent, Cotangent, ExtensionCotangent, Grid, Options, Pipeline, PointCloud,
    Reconstruction, Reconstructor, Saved, Solve, SurfaceResolution,
};

use crate::common::{TORUS, Uniform};

/// A motion of a point in cells over which nothing that has no derivative is likely to change.
const STEP: f64 = 1e-7;

fn grid<T: Pipeline>() -> Grid<T> {
    let lower = [-1.213, -1.206, -0.619].map(T::of);
    Grid::new(lower, T::of(0.05), [48, 48, 24]).expect("a grid")
}

/// 5000 samples of a torus with normals of any length and an attribute of two components.
fn cloud<T: Pipeline>() -> PointCloud<T> {
    let exact = TORUS.uniform::<f64>(5000, 2);
    let mut random = Uniform::new(3);
    let normals = exact.normals().expect("given").iter().map(|n| {
        let length = 0.5 + random.next();
        n.map(|x| T::of(length * x))
    });
    let normals = normals.collect();
    let values = exact.points().iter();
    let values = values.flat_map(|p| [p[0] * p[1], (3.0 * p[2]).sin()].map(T::of));
    let attribute = Attribute {
        name: "heat".into(),
        components: 2,
        values: values.collect(),
    };
    let points = exact.points().iter().map(|p| p.map(T::of)).collect();
    PointCloud::new(points)
        .and_then(|cloud| cloud.with_normals(normals))
        .and_then(|cloud| cloud.with_attribute(attribute))
        .expect("a cloud")
}

fn random<T: Pipeline>(n: usize, seed: u64) -> Vec<T> {
    let mut random = Uniform::new(seed);
    (0..n).map(|_| T::of(random.next() - 0.4)).collect()
}

fn random_vectors<T: Pipeline>(n: usize, seed: u64) -> Vec<[T; 3]> {
    random::<T>(3 * n, seed).as_chunks().0.to_vec()
}

fn inner(a: impl IntoIterator<Item = f64>, b: impl IntoIterator<Item = f64>) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| a * b).sum()
}

fn flat(v: &[[f64; 3]]) -> impl Iterator<Item = f64> + '_ {
    v.iter().flatten().copied()
}

/// Everything that a loss may depend on, and the weight of each part.
struct Weighted<T> {
    sdf: Vec<T>,
    indicator: Vec<T>,
    vertices: Vec<[T; 3]>,
    normals: Vec<[T; 3]>,
    areas: Vec<T>,
    at_vertices: Vec<T>,
    in_band: Vec<T>,
}

/// An attribute and what came of it.
struct Extended<T> {
    attribute: Attribute<T>,
    extension: extend::Extension<T>,
    residual: extend::Residual<T>,
}

impl<T: Pipeline> Extended<T> {
    fn new(result: &Reconstruction<T>, cloud: &PointCloud<T>) -> Self {
        let attribute = cloud.attributes()[0].clone();
        let (mut extension, mut residual) = Default::default();
        let scratch = &mut Default::default();
        result
            .extend_into(
                &attribute,
                3.0 * result.sdf().grid().spacing().f64(),
                scratch,
                &mut residual,
                &mut extension,
            )
            .expect("extended");
        Self {
            attribute,
            extension,
            residual,
        }
    }
}

impl<T: Pipeline> Weighted<T> {
    fn new(result: &Reconstruction<T>, extended: &Extended<T>) -> Self {
        let (cells, of_surface) = (result.sdf().values().len(), dense_indicator(result).len());
        let (vertices, samples) = (result.mesh().vertices().len(), result.areas().len());
        Self {
            sdf: random(cells, 11),
            indicator: random(of_surface, 12),
            vertices: random_vectors(vertices, 13),
            normals: random_vectors(samples, 14),
            areas: random::<T>(samples, 15)
                .iter()
                .map(|&x| x * T::of(1e3))
                .collect(),
            at_vertices: random(extended.extension.vertices.len(), 16),
            in_band: random(extended.extension.values.len(), 17),
        }
    }

    fn pull(&self, result: &Reconstruction<T>, extended: &Extended<T>) -> CloudCotangent<T> {
        let extensions = [ExtensionCotangent {
            attribute: &extended.attribute,
            extension: &extended.extension,
            residual: &extended.residual,
            vertices: Some(&self.at_vertices),
            values: Some(&self.in_band),
        }];
        let cotangent = Cotangent {
            sdf: Some(&self.sdf),
            indicator: (!self.indicator.is_empty()).then_some(&self.indicator),
            iso_value: T::of(40.0),
            vertices: Some(&self.vertices),
            normals: Some(&self.normals),
            areas: Some(&self.areas),
            extensions: &extensions,
        };
        result.pullback(&cotangent).expect("a pullback")
    }
}

impl Weighted<f64> {
    /// All weights, in the order of [`results`].
    fn weights(&self) -> Vec<f64> {
        let vectors = [&self.vertices, &self.normals].map(|v| flat(v).collect());
        let [vertices, normals]: [Vec<f64>; 2] = vectors;
        [
            &self.sdf[..],
            &self.indicator,
            &[40.0],
            &vertices,
            &normals,
            &self.areas,
            &self.at_vertices,
            &self.in_band,
        ]
        .concat()
    }
}

/// The indicator, unless the solve was sparse.
fn dense_indicator<T: Pipeline>(result: &Reconstruction<T>) -> &[T] {
    match result.solve() {
        Solve::Sparse => &[],
        _ => result.indicator().values(),
    }
}

/// All results, one after the other.
fn results(result: &Reconstruction<f64>, extended: &Extended<f64>) -> Vec<f64> {
    let vectors = [result.mesh().vertices(), result.normals()].map(|v| flat(v).collect());
    let [vertices, normals]: [Vec<f64>; 2] = vectors;
    [
        result.sdf().values(),
        dense_indicator(result),
        &[result.iso_value()],
        &vertices,
        &normals,
        result.areas(),
        &extended.extension.vertices,
        &extended.extension.values,
    ]
    .concat()
}

/// Points, given normals, attribute and grid moved along a direction.
struct Direction {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    values: Vec<f64>,
    lower: [f64; 3],
    spacing: f64,
}

impl Direction {
    fn new(cloud: &PointCloud<f64>) -> Self {
        let n = cloud.len();
        Self {
            points: random_vectors(n, 21),
            normals: random_vectors(n, 22),
            values: random(2 * n, 23),
            lower: [0.3, -0.4, 0.2],
            spacing: 0.005,
        }
    }

    fn cloud(&self, cloud: &PointCloud<f64>, step: f64) -> PointCloud<f64> {
        let moved = |from: &[[f64; 3]], v: &[[f64; 3]]| -> Vec<[f64; 3]> {
            let pairs = from.iter().zip(v);
            pairs
                .map(|(p, v)| std::array::from_fn(|a| p[a] + step * v[a]))
                .collect()
        };
        let mut attribute = cloud.attributes()[0].clone();
        for (value, v) in attribute.values.iter_mut().zip(&self.values) {
            *value += step * v;
        }
        let normals = moved(cloud.normals().expect("given"), &self.normals);
        PointCloud::new(moved(cloud.points(), &self.points))
            .and_then(|cloud| cloud.with_normals(normals))
            .and_then(|cloud| cloud.with_attribute(attribute))
            .expect("a cloud")
    }

    fn grid(&self, step: f64) -> Grid<f64> {
        let grid = grid::<f64>();
        let lower = std::array::from_fn(|a| grid.lower()[a] + step * self.lower[a]);
        let spacing = grid.spacing() + step * self.spacing;
        Grid::new(lower, spacing, grid.shape()).expect("a grid")
    }

    fn inner(&self, bar: &CloudCotangent<f64>) -> f64 {
        inner(flat(&bar.points), flat(&self.points))
            + inner(flat(&bar.normals), flat(&self.normals))
            + inner(bar.attributes[0].clone(), self.values.clone())
            + inner(bar.grid.lower, self.lower)
            + bar.grid.spacing * self.spacing
    }
}

#[test]
fn all_results_are_pulled_back_to_all_inputs() {
    // One with which no sample enters or leaves a neighborhood over the steps.
    let radius = Radius::Fixed(0.18);
    let estimated = Options::default().radius(radius);
    let given = estimated.clone().orient(Method::Given);
    let plain = estimated
        .clone()
        .area(false)
        .splat(Weights::Paper)
        .smoothing(Smoothing::Cells(0.7))
        .surface(SurfaceResolution::Grid)
        .level(Level::Mean);
    let signs = estimated.clone().orient(Method::Signs);
    let screened = estimated
        .clone()
        .screening(2.0)
        .surface(SurfaceResolution::Factor(1.5));
    let unweighted = estimated.clone().area(false).level(Level::Local);
    let screened_thin = screened.clone().level(Level::Thin);
    let sparse = estimated
        .clone()
        .solve(Solve::Sparse)
        .surface(SurfaceResolution::Factor(2.0));
    let sparse_mean = sparse
        .clone()
        .smoothing(Smoothing::Cells(0.9))
        .level(Level::Mean);
    let thin = estimated
        .clone()
        .surface(SurfaceResolution::Factor(1.25))
        .level(Level::Thin);
    let coarse = estimated.clone().surface(SurfaceResolution::Factor(0.75));
    for options in [
        estimated,
        given,
        thin,
        coarse,
        signs,
        plain,
        unweighted,
        screened,
        screened_thin,
        sparse,
        sparse_mean,
    ] {
        let cloud = cloud::<f64>();
        let mut plan = Reconstructor::new(grid(), options.clone()).expect("options");
        let base = plan.reconstruct(&cloud).expect("a torus").clone();
        let extended = Extended::new(&base, &cloud);
        let weighted = Weighted::new(&base, &extended);
        let pulled = weighted.pull(&base, &extended);
        assert_eq!(pulled.guarded, 0);
        let cells = base.surface_grid().shape()[0] as f64 / base.sdf().grid().shape()[0] as f64;
        let lower = [base.surface_grid(), base.sdf().grid()].map(|grid| grid.lower()[0]);
        println!("a surface {cells} times as fine from {lower:?} on");
        assert_eq!(pulled.normals.is_empty(), options.orient != Method::Given);
        let direction = Direction::new(&cloud);
        let step = STEP * base.sdf().grid().spacing();
        let [plus, minus] = [step, -step].map(|step| {
            let moved = direction.cloud(&cloud, step);
            let mut plan = Reconstructor::new(direction.grid(step), options.clone());
            let plan = plan.as_mut().expect("options");
            let result = plan.reconstruct_held(&moved, &base).expect("a torus");
            assert_eq!(result.mesh().edges(), base.mesh().edges(), "a sign changed");
            assert_eq!(result.neighbor_counts(), base.neighbor_counts());
            results(result, &Extended::new(result, &moved))
        });
        // Subtracted before they are summed: the sums are large.
        let differences = plus.iter().zip(&minus).map(|(p, m)| (p - m) / (2.0 * step));
        let (pulled, difference) = (
            direction.inner(&pulled),
            inner(differences, weighted.weights()),
        );
        println!("{pulled}, {difference}, {:e}", pulled / difference - 1.0);
        assert!((pulled / difference - 1.0).abs() < 1e-6, "{options:?}");
    }
}

fn bits<T: Pipeline>(values: impl IntoIterator<Item = T>) -> Vec<u64> {
    values.into_iter().map(|v| v.f64().to_bits()).collect()
}

fn assert_same_bits<T: Pipeline>(options: Options) {
    let cloud = cloud::<T>();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| {
            let mut plan = Reconstructor::new(grid(), options.clone()).expect("options");
            let result = plan.reconstruct(&cloud).expect("a torus");
            let extended = Extended::new(result, &cloud);
            let bar = Weighted::new(result, &extended).pull(result, &extended);
            [
                bits(bar.points.into_iter().flatten()),
                bits(bar.normals.into_iter().flatten()),
                bits(bar.attributes.into_iter().flatten()),
                bits(bar.grid.lower),
                bits([bar.grid.spacing]),
            ]
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn one_two_and_five_threads_give_the_same_bits() {
    let orient = |method| Options::default().orient(method);
    assert_same_bits::<f32>(orient(Method::Auto));
    assert_same_bits::<f64>(orient(Method::Auto));
    assert_same_bits::<f32>(orient(Method::Given));
    assert_same_bits::<f64>(orient(Method::Signs));
    assert_same_bits::<f32>(orient(Method::Given).solve(Solve::Sparse));
    assert_same_bits::<f32>(orient(Method::Given).level(Level::Thin));
}

#[test]
fn single_precision_agrees_with_double_precision() {
    fn points<T: Pipeline>() -> Vec<f64> {
        let cloud = cloud::<T>();
        let mut plan = Reconstructor::new(grid(), Options::default()).expect("options");
        let result = plan.reconstruct(&cloud).expect("a torus");
        let phi = result.sdf().values();
        let bar: Vec<T> = phi
            .iter()
            .map(|&phi| T::of((-phi.f64().abs() / 0.1).exp()))
            .collect();
        let cotangent = Cotangent {
            sdf: Some(&bar),
            ..Cotangent::default()
        };
        let pulled = result.pullback(&cotangent).expect("a pullback");
        pulled.points.iter().flatten().map(|x| x.f64()).collect()
    }
    let (single, double) = (points::<f32>(), points::<f64>());
    let size = double.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let errors = single
        .iter()
        .zip(&double)
        .map(|(a, b)| (a - b).abs() / size);
    let mut errors: Vec<f64> = errors.collect();
    errors.sort_unstable_by(f64::total_cmp);
    // Cells on the medial axis may choose another face, and then a few points feel it.
    assert!(
        errors[errors.len() / 2] < 1e-4,
        "{:e}",
        errors[errors.len() / 2]
    );
    assert!(errors[errors.len() * 99 / 100] < 1e-2);
}

#[test]
fn what_does_not_fit_is_refused_with_a_reason() {
    let cloud = cloud::<f64>();
    let mut plan = Reconstructor::new(grid(), Options::default()).expect("options");
    let result = plan.reconstruct(&cloud).expect("a torus");
    let none = Cotangent::default();
    let mut bar = vec![0.0; result.sdf().values().len()];
    let sdf = |bar: &[f64]| {
        let cotangent = Cotangent {
            sdf: Some(bar),
            ..none
        };
        result
            .pullback(&cotangent)
            .expect_err("refused")
            .to_string()
    };
    assert!(sdf(&bar[1..]).contains("must have"));
    bar[77] = f64::NAN;
    assert!(
        sdf(&bar).contains("not finite at entry 77"),
        "{}",
        sdf(&bar)
    );
    let pulled = result.pullback(&none).expect("nothing to do");
    assert!(pulled.points.iter().flatten().all(|&x| x == 0.0));
}

/// A reconstruction restored from φ, closest faces and normals pulls back to the same bits.
fn assert_restored<T: Pipeline>(options: &Options) {
    let cloud = cloud::<T>();
    let mut plan = Reconstructor::new(grid(), options.clone()).expect("options");
    let result = plan.reconstruct(&cloud).expect("a torus").clone();
    let extended = Extended::new(&result, &cloud);
    let expected = Weighted::new(&result, &extended).pull(&result, &extended);
    let saved = Saved {
        sdf: result.sdf().values(),
        closest: result.closest(),
        normals: result.normals(),
    };
    let mut other = Reconstructor::new(grid(), options.clone()).expect("options");
    let restored = other.restore(&cloud, &saved).expect("all is there").clone();
    assert!(restored.mesh() == result.mesh() && restored.areas() == result.areas());
    assert_eq!(restored.iso_value().f64(), result.iso_value().f64());
    let extended = Extended::new(&restored, &cloud);
    let pulled = Weighted::new(&restored, &extended).pull(&restored, &extended);
    assert!(pulled == expected);
    let same = plan.restore(&cloud, &saved).expect("its last result");
    let extended = Extended::new(same, &cloud);
    let pulled = Weighted::new(same, &extended).pull(same, &extended);
    assert!(pulled == expected);
    let short = Saved {
        normals: &result.normals()[1..],
        ..saved
    };
    let refused = other.restore(&cloud, &short).err().map(|e| e.to_string());
    assert!(refused.is_some_and(|text| text.contains("list of normals")));
    let beyond = vec![u32::MAX - 1; result.closest().len()];
    let wrong = Saved {
        closest: &beyond,
        ..saved
    };
    let refused = other.restore(&cloud, &wrong).err().map(|e| e.to_string());
    assert!(refused.is_some_and(|text| text.contains("another reconstruction")));
}

#[test]
fn a_restored_result_pulls_back_to_the_same_bits() {
    assert_restored::<f32>(&Options::default());
    assert_restored::<f32>(&Options::default().level(Level::Thin));
    assert_restored::<f64>(
        &Options::default()
            .orient(Method::Given)
            .splat(Weights::Paper)
            .smoothing(Smoothing::Cells(0.7))
            .level(Level::Mean),
    );
}
