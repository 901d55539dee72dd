//! Attributes at the vertices of the mesh, whichever mesh that is.

use isograd::distance::extend::Error;
use isograd::isosurface::trim::Trim;
use isograd::orient::Method;
use isograd::sheet::Sheet;
use isograd::{
    Attribute, Grid, Options, Pipeline, PointCloud, Reconstruction, Reconstructor, Resolution,
};

use crate::common::{TORUS, Uniform};

/// Samples of the torus above `bottom`, and a coordinate and a constant as attribute.
fn cloud<T: Pipeline>(bottom: f64) -> (PointCloud<T>, Attribute<T>) {
    let keep = |p: [f64; 3]| f64::from(u8::from(p[2] > bottom));
    let cloud = TORUS.cloud::<T>(3000, 3, keep);
    let values = cloud.points().iter().flat_map(|p| [p[0], T::of(3.25)]);
    let attribute = Attribute {
        name: "x".into(),
        components: 2,
        values: values.collect(),
    };
    (cloud, attribute)
}

fn reconstruct<T: Pipeline>(cloud: &PointCloud<T>, options: Options) -> Reconstruction<T> {
    let grid = Grid::fit(cloud, Resolution::Cells(40), T::of(0.2)).expect("a grid");
    let mut plan = Reconstructor::new(grid, options.orient(Method::Given)).expect("options");
    plan.reconstruct(cloud).expect("a surface");
    plan.into_reconstruction()
}

fn agrees_with_the_extension<T: Pipeline>() {
    let (mut cloud, mut attribute) = cloud::<T>(-1.0);
    // And with a sample that is left out.
    for extra in [None, Some([T::of(90.0); 3])] {
        if let Some(point) = extra {
            let add = |rows: &[[T; 3]], row| rows.iter().copied().chain([row]).collect();
            let normals = add(
                cloud.normals().expect("normals"),
                [T::one(), T::zero(), T::zero()],
            );
            let points = PointCloud::new(add(cloud.points(), point)).expect("finite");
            cloud = points.with_normals(normals).expect("as many");
            attribute.values.extend([T::of(1e6), T::of(1e6)]);
        }
        let result = reconstruct(&cloud, Options::default());
        assert_eq!(result.outliers().len(), usize::from(extra.is_some()));
        let values = result.vertex_values(&attribute).expect("extends");
        let width = result.sdf().grid().spacing().f64();
        let (extension, _) = result
            .extend_with_residual(&attribute, width)
            .expect("extends");
        assert_eq!(values.len(), 2 * result.mesh().vertices().len());
        assert!(values == extension.vertices);
    }
}

#[test]
fn values_are_those_of_the_extension() {
    agrees_with_the_extension::<f32>();
    agrees_with_the_extension::<f64>();
}

#[test]
fn trimmed_meshes_and_shells_have_values_at_their_own_vertices() {
    let (cloud, attribute) = cloud::<f64>(0.0);
    let trimmed = Options::default().trim(Trim::Distance(0.1));
    for options in [trimmed.clone(), trimmed.sheet(Sheet::Thickness(0.1))] {
        let result = reconstruct(&cloud, options);
        let vertices = result.mesh().vertices();
        let values = result.vertex_values(&attribute).expect("extends");
        assert_eq!(values.len(), 2 * vertices.len());
        let (mut largest, mut sum) = (0.0f64, 0.0);
        for (vertex, value) in vertices.iter().zip(values.chunks_exact(2)) {
            let error = (value[0] - vertex[0]).abs();
            (largest, sum) = (largest.max(error), sum + error);
            // A sum of weights that is 1 to a few rounding errors.
            assert!((value[1] - 3.25).abs() < 1e-13, "{value:?}");
        }
        // A shell is half of its thickness off the samples, and the rim is up to 0.1 beyond them.
        let mean = sum / vertices.len() as f64;
        assert!(largest < 0.15 && mean < 0.06, "{largest:e} {mean:e}");
    }
}

#[test]
fn wrong_attributes_are_refused() {
    let (cloud, attribute) = cloud::<f64>(-1.0);
    let result = reconstruct(&cloud, Options::default());
    let mut uniform = Uniform::new(1);
    let mut wrong = attribute.clone();
    wrong.values.pop();
    let error = result
        .vertex_values(&wrong)
        .expect_err("a value is missing");
    assert!(matches!(error, Error::Samples { .. }), "{error}");
    let sample = (uniform.next() * cloud.len() as f64) as usize;
    let mut wrong = attribute;
    wrong.values[2 * sample] = f64::NAN;
    let error = result.vertex_values(&wrong).expect_err("not a number");
    assert_eq!(error, Error::NotFinite { sample });
}
