//! The surface with the attributes of the samples at its vertices.

use std::path::Path;

use isograd::distance::extend;
use isograd::{Attribute, Mesh, PointCloud, PointCloudError, Real};
use isograd_backend::{Number, View};
use isograd_io::atomic::is_standard_output;
use isograd_io::{SURFACE_EXTENSIONS, byte_colors, has_extension, is_sensor};

use crate::error::Error;
use crate::progress::Progress;

/// Writes the surface; its vertices have the attributes of the cloud where the format holds them. A note or a warning names
/// those that are not written.
pub fn write<T: Number>(
    path: &Path,
    view: View<'_, T>,
    mesh: &Mesh<T>,
    cloud: &PointCloud<T>,
    progress: &mut Progress,
) -> Result<(), Error> {
    let attributes = cloud.attributes();
    let names = attributes.iter().map(|attribute| attribute.name.as_str());
    let names: Vec<&str> = names.filter(|name| !is_sensor(name)).collect();
    if names.is_empty() || !holds_attributes(path) {
        if !names.is_empty() {
            progress.note(
                "attributes",
                &format!(
                    "{} holds no attributes; {} can be written to .ply and .vtp",
                    path.display(),
                    names.join(", ")
                ),
            );
        }
        return Ok(isograd_io::write_mesh(path, mesh)?);
    }
    let mut vertices = PointCloud::new(mesh.vertices().to_vec());
    for (attribute, is_color) in attributes.iter().zip(byte_colors(attributes)) {
        if is_sensor(&attribute.name) {
            continue;
        }
        match view.vertex_values(attribute) {
            Ok(values) => vertices = with_values(vertices, attribute, values, is_color),
            Err(isograd_backend::Error::Extension(error @ extend::Error::NotFinite { .. })) => {
                progress.warn(&format!(
                    "'{}' is not written to {}: {error}",
                    attribute.name,
                    path.display()
                ));
            }
            Err(error) => return Err(Error::input(path)(error)),
        }
    }
    let vertices = vertices.map_err(Error::input(path))?;
    Ok(isograd_io::write_surface(path, &vertices, mesh.faces())?)
}

/// Adds an attribute to the vertices; colors are rounded to whole numbers from 0 to 255.
fn with_values<T: Real>(
    vertices: Result<PointCloud<T>, PointCloudError>,
    attribute: &Attribute<T>,
    mut values: Vec<T>,
    is_color: bool,
) -> Result<PointCloud<T>, PointCloudError> {
    if is_color {
        for value in &mut values {
            *value = value.round().max(T::zero()).min(T::of(255.0));
        }
    }
    vertices?.with_attribute(Attribute {
        values,
        ..attribute.clone()
    })
}

fn holds_attributes(path: &Path) -> bool {
    is_standard_output(path) || has_extension(path, SURFACE_EXTENSIONS)
}
