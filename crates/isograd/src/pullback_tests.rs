//! Every stage's pullback is the transpose of its derivative: `⟨J v, w⟩ = ⟨v, Jᵀ w⟩` for random `v` and `w`,
//! with `J v` from central differences of the forward map. And what the pullback does where there is none.

use crate::data::{Field, Grid, Mesh};
use crate::isosurface::{self, iso_value};
use crate::neighbors::tests::{Random, torus, ugly_clouds};
use crate::neighbors::{self, Neighborhoods, Radius};
use crate::splat::{self, SampleCotangent, Samples, Weights};
use crate::testing::{Direction, assert_adjoint, inner, moved, numbers, product, vectors};
use crate::{Real, distance, normals, poisson, vector};

/// Truncation is of the square of the step, rounding of its inverse.
const STEP: f64 = 1e-5;

/// A torus' neighborhoods, and those of moved points.
struct Near {
    points: Vec<[f64; 3]>,
    held: Neighborhoods<f64>,
}

impl Near {
    /// 1600 samples, with few of them at one end: some radii grow there.
    fn torus() -> Self {
        let samples = torus(1600, 4);
        let thinned = samples.iter().enumerate();
        let points = thinned
            .filter(|(i, s)| s.0[0] < 0.4 || i % 9 == 0)
            .map(|(_, s)| s.0)
            .collect();
        Self::new(points)
    }

    fn new(points: Vec<[f64; 3]>) -> Self {
        let mut held = Neighborhoods::default();
        neighbors::forward(&points, Radius::Auto, &mut held).expect("a valid cloud");
        Self { points, held }
    }

    fn moved(&self, v: &[[f64; 3]], step: f64) -> Neighborhoods<f64> {
        let mut out = Neighborhoods::default();
        neighbors::hold(&moved(&self.points, v, step), &self.held, &mut out).expect("as before");
        assert_eq!(out.count, self.held.count, "a neighborhood changed");
        out
    }
}

fn axes<T: Real>(near: &Neighborhoods<T>) -> normals::Residual<T> {
    let mut residual = normals::Residual::default();
    normals::forward(near, &mut residual);
    residual
}

fn areas<T: Real>(near: &Neighborhoods<T>) -> Vec<T> {
    let mut areas = Vec::new();
    splat::area::forward(near, &mut areas);
    areas
}

/// From axes to points, radii included.
fn axes_pullback<T: Real>(
    near: &Neighborhoods<T>,
    residual: &normals::Residual<T>,
    axes_bar: &[[T; 3]],
) -> Vec<[T; 3]> {
    let mut bar = vec![[T::zero(); 3]; axes_bar.len()];
    let mut radii = Default::default();
    let scratch = &mut Default::default();
    let guarded = normals::pullback(near, residual, axes_bar, scratch, &mut bar, &mut radii);
    assert_eq!(guarded, residual.guarded());
    neighbors::pullback(near, &radii, &mut bar);
    bar
}

/// From areas to points, radii included.
fn areas_pullback<T: Real>(near: &Neighborhoods<T>, areas_bar: &[T]) -> Vec<[T; 3]> {
    let mut bar = vec![[T::zero(); 3]; areas_bar.len()];
    let mut radii = Default::default();
    let (areas, scratch) = (areas(near), &mut Default::default());
    splat::area::pullback(near, &areas, areas_bar, scratch, &mut bar, &mut radii);
    neighbors::pullback(near, &radii, &mut bar);
    bar
}

#[test]
fn axes_and_areas_with_grown_radii() {
    let near = Near::torus();
    let n = near.points.len();
    assert!(near.held.grown() > 10, "{}", near.held.grown());
    let mut random = Random::new(1);
    let (v, w) = (vectors(n, &mut random), vectors(n, &mut random));
    let u = numbers(n, &mut random);
    let step = STEP * near.held.common_radius * 1e-2;

    let residual = axes(&near.held);
    let bar = axes_pullback(&near.held, &residual, &w);
    assert_adjoint("axes", inner(&bar, &v), step, |s| {
        let mut at = normals::Residual::default();
        normals::forward(&near.moved(&v, s), &mut at);
        inner(&at.normals, &w)
    });

    let bar = areas_pullback(&near.held, &u);
    assert_adjoint("areas", inner(&bar, &v), step, |s| {
        product(&areas(&near.moved(&v, s)), &u)
    });
}

#[test]
fn axes_from_wider_neighborhoods() {
    let mut random = Random::new(11);
    let mut noise = || 0.12 * (random.uniform() + random.uniform() - 1.0);
    let rough = torus(1600, 4).into_iter().map(|s| s.0.map(|x| x + noise()));
    let near = Near::new(rough.collect());
    let residual = axes(&near.held);
    let pairs = residual.radius.iter().zip(&near.held.radius);
    let wide = pairs.filter(|(wide, own)| wide > own).count();
    assert!(wide > 100 && wide < near.points.len(), "{wide}");

    let n = near.points.len();
    let (v, w) = (vectors(n, &mut random), vectors(n, &mut random));
    let step = STEP * near.held.common_radius * 1e-2;
    let bar = axes_pullback(&near.held, &residual, &w);
    assert_adjoint("axes", inner(&bar, &v), step, |s| {
        let mut at = normals::Residual::default();
        normals::forward(&near.moved(&v, s), &mut at);
        inner(&at.normals, &w)
    });
}

#[test]
fn degenerate_clouds_have_finite_gradients_in_f32_and_f64() {
    degenerate::<f32>();
    degenerate::<f64>();
}

fn degenerate<T: Real>() {
    for (name, points) in ugly_clouds::<T>() {
        let mut near = Neighborhoods::default();
        neighbors::forward(&points, Radius::Auto, &mut near).expect("a valid cloud");
        let n = points.len();
        let residual = axes(&near);
        let ones = vec![[T::one(), T::of(-0.3), T::of(0.7)]; n];
        let of_axes = axes_pullback(&near, &residual, &ones);
        let of_areas = areas_pullback(&near, &vec![T::one(); n]);
        for bar in [of_axes, of_areas] {
            let bad = bar.iter().position(|&b| !vector::is_finite(b));
            assert_eq!(bad, None, "{name}");
        }
    }
}

/// Samples of a torus on a grid around it.
struct Setting {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    areas: Vec<f64>,
    grid: Grid<f64>,
}

impl Setting {
    fn new(n: usize) -> Self {
        let samples = torus(n, 2);
        let mut random = Random::new(3);
        Self {
            points: samples.iter().map(|s| s.0).collect(),
            normals: samples.iter().map(|s| s.1).collect(),
            areas: (0..n).map(|_| 0.01 + 0.01 * random.uniform()).collect(),
            grid: Grid::new([-1.2, -1.2, -0.6], 0.1, [24, 24, 12]).expect("a grid"),
        }
    }

    fn samples(&self) -> Samples<'_, f64> {
        Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        }
    }

    /// With all inputs moved along a direction.
    fn moved(&self, v: &Direction, step: f64) -> Self {
        let lower = vector::add(self.grid.lower(), vector::scale(v.lower, step));
        let spacing = self.grid.spacing() + step * v.spacing;
        let areas = self.areas.iter().zip(&v.areas);
        Self {
            points: moved(&self.points, &v.points, step),
            normals: moved(&self.normals, &v.normals, step),
            areas: areas.map(|(a, v)| a + step * v).collect(),
            grid: Grid::new(lower, spacing, self.grid.shape()).expect("a grid"),
        }
    }

    fn splat(&self, weights: Weights) -> (Field<f64>, splat::Residual) {
        let mut b = Field::zeros(self.grid);
        let mut residual = splat::Residual::default();
        let scratch = &mut Default::default();
        splat::forward(self.samples(), weights, scratch, &mut residual, &mut b).expect("inside");
        (b, residual)
    }

    fn zeros(&self) -> SampleCotangent<f64> {
        SampleCotangent::zeros(self.points.len())
    }
}

#[test]
fn splat_to_points_normals_areas_and_grid() {
    for weights in [Weights::BSpline, Weights::Paper] {
        let setting = Setting::new(700);
        let mut random = Random::new(5);
        let v = Direction::new(700, &mut random);
        let (b, residual) = setting.splat(weights);
        let w = numbers(b.values().len(), &mut random);
        let bar = Field::new(setting.grid, w.clone()).expect("sizes match");
        let mut out = setting.zeros();
        let scratch = &mut Default::default();
        splat::pullback(setting.samples(), &residual, &bar, scratch, &mut out);
        // No sample may cross a face of a cell, where the paper's weights jump.
        assert_adjoint("splat", v.inner(&out), 1e-2 * STEP, |s| {
            product(setting.moved(&v, s).splat(weights).0.values(), &w)
        });
    }
}

#[test]
fn poisson_is_its_own_transpose() {
    let plan = poisson::Plan::<f64>::new([9, 14, 11]);
    let mut random = Random::new(6);
    let (v, w) = (
        numbers(9 * 14 * 11, &mut random),
        numbers(9 * 14 * 11, &mut random),
    );
    let solve = |field: &[f64]| {
        let mut field = field.to_vec();
        plan.solve(&mut field, 0.8, &mut Default::default())
            .expect("sizes match");
        field
    };
    let (there, back) = (product(&solve(&v), &w), product(&v, &solve(&w)));
    assert!((there / back - 1.0).abs() < 1e-12, "{there} {back}");
}

/// A smooth function of cell indices with a closed surface at its level.
fn indicator(grid: Grid<f64>) -> Field<f64> {
    let value = |cell: usize| {
        let [x, y, z] = grid.cell(cell).map(|c| c as f64);
        let far =
            ((x - 11.3) / 7.1).powi(2) + ((y - 11.7) / 6.3).powi(2) + ((z - 5.4) / 3.6).powi(2);
        (far - 1.0).tanh() + 0.1 * (0.9 * x + 1.3 * y).sin() * (0.7 * z).cos()
    };
    Field::new(grid, (0..grid.cells()).map(value).collect()).expect("sizes match")
}

#[test]
fn iso_value_to_indicator_samples_and_grid() {
    let setting = Setting::new(700);
    let mut random = Random::new(7);
    let v = Direction::new(700, &mut random);
    let chi = indicator(setting.grid);
    let along = numbers(chi.values().len(), &mut random);
    let mut residual = iso_value::Residual::default();
    iso_value::forward(&chi, &setting.points, &setting.areas, &mut residual).expect("a level");
    let values_bar = numbers(700, &mut random);
    let order = setting.splat(Weights::BSpline).1;
    let (mut out, mut chi_bar) = (setting.zeros(), vec![0.0; along.len()]);
    let samples = splat::SortedSamples {
        samples: setting.samples(),
        order: &order,
    };
    iso_value::pullback(
        chi.grid(),
        samples,
        &residual,
        2.5,
        &values_bar,
        &mut chi_bar,
        &mut out,
    );
    let pulled = v.inner(&out) + product(&chi_bar, &along);
    // No sample may cross a plane through cell centers, where the slope jumps.
    assert_adjoint("iso-value", pulled, 1e-2 * STEP, |s| {
        let at = setting.moved(&v, s);
        let values = chi.values().iter().zip(&along).map(|(c, v)| c + s * v);
        let chi = Field::new(at.grid, values.collect()).expect("sizes match");
        let mut residual = iso_value::Residual::default();
        let c = iso_value::forward(&chi, &at.points, &at.areas, &mut residual).expect("a level");
        let values: Vec<f64> = residual.at_samples.iter().map(|at| at.value).collect();
        2.5 * c + product(&values, &values_bar)
    });
}

fn surface(chi: &Field<f64>, level: f64) -> Mesh<f64> {
    let mut mesh = Mesh::default();
    isosurface::forward(chi, level, &mut Default::default(), &mut mesh).expect("a surface");
    mesh
}

#[test]
fn vertices_to_indicator_level_and_grid() {
    let setting = Setting::new(10);
    let mut random = Random::new(8);
    let v = Direction::new(10, &mut random);
    let chi = indicator(setting.grid);
    let mesh = surface(&chi, 0.05);
    let along = numbers(chi.values().len(), &mut random);
    let w = vectors(mesh.vertices().len(), &mut random);
    let mut chi_bar = vec![0.0; along.len()];
    let found = isosurface::pullback(&chi, 0.05, &mesh, &w, &mut chi_bar);
    assert_eq!(found.guarded, 0);
    let pulled = product(&chi_bar, &along)
        + 0.3 * found.level
        + vector::dot(found.grid.lower, v.lower)
        + found.grid.spacing * v.spacing;
    assert_adjoint("vertices", pulled, STEP, |s| {
        let grid = setting.moved(&v, s).grid;
        let values = chi.values().iter().zip(&along).map(|(c, v)| c + s * v);
        let chi = Field::new(grid, values.collect()).expect("sizes match");
        let at = surface(&chi, 0.05 + 0.3 * s);
        assert_eq!(at.edges(), mesh.edges(), "a sign changed");
        inner(at.vertices(), &w)
    });
}

#[test]
fn an_edge_along_which_nothing_changes_is_guarded() {
    let grid = Grid::new([0.0f32; 3], 1.0, [4; 3]).expect("a grid");
    let mut chi = Field::zeros(grid);
    chi.values_mut().fill(1.0);
    chi.values_mut()[grid.index([1, 1, 1])] = -1.0;
    chi.values_mut()[grid.index([2, 2, 2])] = 1.0 - f32::EPSILON;
    let mut mesh = Mesh::default();
    isosurface::forward(&chi, 1.0, &mut Default::default(), &mut mesh).expect("a surface");
    let w = vec![[1e30f32; 3]; mesh.vertices().len()];
    let mut chi_bar = vec![0.0; 64];
    let found = isosurface::pullback(&chi, 1.0, &mesh, &w, &mut chi_bar);
    assert_eq!(found.guarded, 6);
    assert!(chi_bar.iter().all(|x| x.is_finite()) && found.level.is_finite());
}

#[test]
fn distance_to_vertices_and_grid() {
    let setting = Setting::new(10);
    let mut random = Random::new(9);
    let v = Direction::new(10, &mut random);
    let chi = indicator(setting.grid);
    let mesh = surface(&chi, 0.05);
    let solve = |mesh: &Mesh<f64>, chi: &Field<f64>| {
        let mut phi = Field::zeros(*chi.grid());
        let mut closest = Vec::new();
        let (band, scratch) = (distance::Band::Full, &mut Default::default());
        distance::lattice::forward(mesh, chi, 0.05, band, scratch, &mut phi, &mut closest)
            .expect("a mesh");
        (phi, closest)
    };
    let (phi, closest) = solve(&mesh, &chi);
    let along = vectors(mesh.vertices().len(), &mut random);
    let w = numbers(phi.values().len(), &mut random);
    let mut vertices_bar = vec![[0.0; 3]; along.len()];
    let scratch = &mut Default::default();
    let grid = distance::lattice::pullback(&mesh, &phi, &closest, &w, scratch, &mut vertices_bar);
    let pulled =
        inner(&vertices_bar, &along) + vector::dot(grid.lower, v.lower) + grid.spacing * v.spacing;
    // On the medial axis φ has a crease: few cells are near it, and ever fewer for a smaller step.
    assert_adjoint("distance", pulled, 1e-3 * STEP, |s| {
        let grid = setting.moved(&v, s).grid;
        let chi = Field::new(grid, chi.values().to_vec()).expect("sizes match");
        let vertices = moved(mesh.vertices(), &along, s);
        let mesh = Mesh::new(vertices, mesh.faces().to_vec()).expect("finite");
        product(solve(&mesh, &chi).0.values(), &w)
    });
}

#[test]
fn distance_of_a_cell_on_the_surface_follows_its_normal() {
    // Cell centers lie on the plane z = 0.5, which is all the surface there is.
    let corners = vec![[-9.0, -9.0, 0.5], [9.0, -9.0, 0.5], [0.0, 9.0, 0.5]];
    let mesh = Mesh::new(corners, vec![[0, 1, 2]]).expect("finite");
    let grid = Grid::new([0.0; 3], 1.0, [2, 2, 2]).expect("a grid");
    let chi = Field::zeros(grid);
    let mut phi = Field::zeros(grid);
    let mut closest = Vec::new();
    let (band, scratch) = (distance::Band::Full, &mut Default::default());
    distance::lattice::forward(&mesh, &chi, 0.0, band, scratch, &mut phi, &mut closest)
        .expect("a mesh");
    let mut w = vec![0.0; 8];
    w[0] = 1.0;
    let mut bar = vec![[0.0f64; 3]; 3];
    let scratch = &mut Default::default();
    let grid_bar = distance::lattice::pullback(&mesh, &phi, &closest, &w, scratch, &mut bar);
    assert_eq!(phi.at([0, 0, 0]), 0.0);
    assert!((grid_bar.lower[2] - 1.0).abs() < 1e-12, "{grid_bar:?}");
    let total = bar.iter().fold([0.0; 3], |sum, &b| vector::add(sum, b));
    assert!((total[2] + 1.0).abs() < 1e-12, "{total:?}");
}

#[test]
fn given_normals_are_pulled_back_through_their_length() {
    let mut random = Random::new(10);
    let (g, v, w) = (
        vectors(50, &mut random),
        vectors(50, &mut random),
        vectors(50, &mut random),
    );
    let mut bars = w.clone();
    crate::orient::given_pullback(&g, &mut bars);
    assert_adjoint("given normals", inner(&bars, &v), STEP, |s| {
        let units = moved(&g, &v, s).into_iter();
        let units: Vec<[f64; 3]> = units.filter_map(vector::normalized).collect();
        inner(&units, &w)
    });
    let mut bars = vec![[1.0f32; 3]; 2];
    let replaced = crate::orient::given_pullback(&[[1e-40f32, 0.0, 0.0], [f32::MAX; 3]], &mut bars);
    assert!(bars.iter().all(|&b| vector::is_finite(b)), "{bars:?}");
    assert_eq!(replaced, 2);
    let mut bars = vec![[1.0; 3]; 2];
    let replaced =
        crate::orient::given_pullback(&[[1e-310, 0.0, 0.0], [0.0, 1e-310, 1e-310]], &mut bars);
    assert!(bars.iter().all(|&b| vector::is_finite(b)), "{bars:?}");
    assert_eq!(bars[0], [0.0, f64::MAX, f64::MAX]);
    assert_eq!(replaced, 3);
}
