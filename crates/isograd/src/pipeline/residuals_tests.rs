//! A reconstruction without residuals is the same one, and says that it can't be pulled back.

use crate::data::{Attribute, PointCloud};
use crate::distance::extend;
use crate::distance::lattice::Band;
use crate::neighbors::tests::even_sphere;
use crate::orient::Method;
use crate::{
    Cotangent, Grid, Options, PullbackError, Reconstruction, Reconstructor, Resolution, Solve,
    SurfaceResolution,
};

/// A sphere of so many samples that memory is freed between stages, and one sample far from it, which is left out.
fn cloud() -> PointCloud<f64> {
    let mut points = even_sphere(3600);
    points.insert(40, [30.0, 4.0, 0.0]);
    let attribute = Attribute {
        name: "x".into(),
        components: 1,
        values: points.iter().map(|p| p[0]).collect(),
    };
    PointCloud::new(points.clone())
        .and_then(|cloud| cloud.with_normals(points))
        .and_then(|cloud| cloud.with_attribute(attribute))
        .expect("a cloud")
}

fn reconstruct(cloud: &PointCloud<f64>, options: Options) -> Reconstruction<f64> {
    let grid = Grid::fit(cloud, Resolution::Cells(24), 0.1).expect("fits");
    let mut plan = Reconstructor::new(grid, options).expect("a plan");
    plan.reconstruct(cloud).expect("reconstructs");
    plan.reconstruct(cloud).expect("once more");
    plan.into_reconstruction()
}

#[test]
fn results_without_residuals_have_the_same_bits_and_no_pullback() {
    let cloud = cloud();
    let attribute = &cloud.attributes()[0];
    let narrow = Options::default()
        .solve(Solve::Sparse)
        .surface(SurfaceResolution::Factor(3.0))
        .band(Band::Within(0.3));
    let ways = [
        Options::default(),
        Options::default().orient(Method::Given),
        narrow.clone().orient(Method::Given),
        narrow.band(Band::Full),
    ];
    for options in ways {
        let whole = reconstruct(&cloud, options.clone());
        let found = reconstruct(&cloud, options.clone().residuals(false));
        assert_eq!(found.sdf(), whole.sdf(), "{options:?}");
        assert_eq!(found.mesh(), whole.mesh(), "{options:?}");
        assert_eq!(found.normals(), whole.normals(), "{options:?}");
        assert_eq!(found.areas(), whole.areas(), "{options:?}");
        assert_eq!(found.report().warnings, whole.report().warnings);
        assert_eq!(
            found.report().doubtful_regions,
            whole.report().doubtful_regions
        );
        let values = |of: &Reconstruction<f64>| of.vertex_values(attribute).expect("values");
        assert_eq!(values(&found), values(&whole), "{options:?}");

        assert!(found.closest().is_empty() && !whole.closest().is_empty());
        let ones = vec![1.0; found.sdf().values().len()];
        let cotangent = Cotangent {
            sdf: Some(&ones),
            ..Cotangent::default()
        };
        assert!(whole.pullback(&cotangent).is_ok());
        let refused = found.pullback(&cotangent);
        assert_eq!(refused, Err(PullbackError::NoResiduals));
        let refused = found.extend(&cloud, "x", 0.2);
        assert!(matches!(refused, Err(extend::Error::Closest { .. })));
    }
}
