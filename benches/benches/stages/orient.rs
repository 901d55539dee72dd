//! The signs of the normals against number of points, for each method, number type and threads; axes and
//! neighborhoods are given.

use criterion::{Criterion, criterion_group};
use isograd::neighbors::{self, Neighborhoods, Radius};
use isograd::orient::{self, Method};
use isograd::{Real, normals};
use isograd_benches::{POINTS, torus};

use crate::common::{for_threads, group};

fn sign<T: Real>(criterion: &mut Criterion) {
    let methods = [
        ("orient", Method::Auto),
        ("orient-parity", Method::Parity(Default::default())),
    ];
    for (name, method) in methods {
        let mut group = group(criterion, name);
        for count in POINTS {
            let (points, _) = torus::samples::<T>(count);
            let mut neighborhoods = Neighborhoods::default();
            neighbors::forward(&points, Radius::Auto, &mut neighborhoods).expect("enough points");
            let mut axes = normals::Residual::default();
            normals::forward(&neighborhoods, &mut axes);
            let (mut scratch, mut out) = Default::default();
            for_threads::<T>(&mut group, count, "points", || {
                orient::forward(
                    &points,
                    &axes,
                    &neighborhoods,
                    None,
                    &method,
                    &mut scratch,
                    &mut out,
                )
                .expect("a closed body");
            });
        }
    }
}

criterion_group!(benches, sign::<f32>, sign::<f64>);
