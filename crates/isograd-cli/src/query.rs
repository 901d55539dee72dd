//! `isograd query`: signed distances at points.

use isograd::distance::Query;
use isograd::isosurface::measure;
use isograd::{Attribute, PointCloud};
use isograd_io::{Attributes, CLOUD_EXTENSIONS, Content, FieldFile, Geometry};

use crate::args;
use crate::error::Error;
use crate::outputs::{check_extension, check_not_input};
use crate::streams::{to_stderr, to_stdout};

/// Runs the command. Everything is computed and written in double precision.
pub fn run(args: &args::Query) -> Result<(), Error> {
    check_extension(&args.output, CLOUD_EXTENSIONS)?;
    isograd_io::check_output(&args.output, CLOUD_EXTENSIONS)?;
    for input in [&args.source, &args.at] {
        check_not_input(&args.output, input)?;
    }
    let source = args.reading.memory.options().read(&args.source)?;
    let options = args.reading.options(Attributes::Sensors);
    let points = options.read_geometry(&args.at)?.points;
    let attributes = match source {
        Content::Field(field) => query_field(&field, &points),
        Content::Geometry(geometry) => query_mesh(args, &geometry, &points)?,
    };
    let cloud = attributes
        .into_iter()
        .fold(PointCloud::new(points), |cloud, attribute| {
            cloud?.with_attribute(attribute)
        })
        .map_err(Error::input(&args.at))?;
    isograd_io::write_cloud(&args.output, &cloud)?;
    if !args.running.quiet {
        to_stdout(&format!("wrote {}", args.output.display()));
    }
    Ok(())
}

fn attribute<const N: usize>(name: &str, rows: Vec<[f64; N]>) -> Attribute<f64> {
    Attribute {
        name: name.into(),
        components: N,
        values: rows.into_flattened(),
    }
}

/// Trilinear values and gradients; NaN at points outside the grid.
fn query_field(file: &FieldFile, points: &[[f64; 3]]) -> Vec<Attribute<f64>> {
    let (lower, upper) = (file.field.grid().lower(), file.field.grid().upper());
    let inside = |p: [f64; 3]| (0..3).all(|a| p[a] >= lower[a] && p[a] <= upper[a]);
    let (distances, gradients): (Vec<[f64; 1]>, Vec<[f64; 3]>) = points
        .iter()
        .map(|&p| match inside(p) {
            true => {
                let (value, gradient) = file.field.interpolate_with_gradient(p);
                ([value], gradient)
            }
            false => ([f64::NAN], [f64::NAN; 3]),
        })
        .unzip();
    let outside = distances.iter().filter(|d| d[0].is_nan()).count();
    if outside > 0 {
        to_stderr(&format!(
            "warning: {outside} of {} points lie outside the grid; φ is NaN there",
            points.len()
        ));
    }
    vec![
        attribute("distance", distances),
        attribute("gradient", gradients),
    ]
}

/// Exact distances, gradients, closest points, and their triangles and barycentric coordinates.
fn query_mesh(
    args: &args::Query,
    geometry: &Geometry,
    points: &[[f64; 3]],
) -> Result<Vec<Attribute<f64>>, Error> {
    let mesh = geometry.mesh::<f64>().map_err(Error::input(&args.source))?;
    if !measure::measure(&mesh, &mut measure::Scratch::default()).closed {
        to_stderr(&format!(
            "warning: the mesh in {} is not closed; the sign can't be trusted",
            args.source.display()
        ));
    }
    let query = Query::new(mesh).map_err(Error::input(&args.source))?;
    let hits = query.query(points, None);
    Ok(vec![
        attribute("distance", hits.iter().map(|hit| [hit.distance]).collect()),
        attribute("gradient", hits.iter().map(|hit| hit.gradient).collect()),
        attribute("closest", hits.iter().map(|hit| hit.point).collect()),
        attribute(
            "triangle",
            hits.iter().map(|hit| [f64::from(hit.triangle)]).collect(),
        ),
        attribute(
            "barycentric",
            hits.iter().map(|hit| hit.barycentric).collect(),
        ),
    ])
}
