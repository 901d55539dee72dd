//! The surface with the attributes of the samples at its vertices.

use std::path::Path;

use isograd::distance::extend;
use isograd::{Attribute, Mesh, PointCloud, PointCloudError, Real};
use isograd_backend::{Number, View};
use isograd_io::atomic::is_standard_output;
use isograd_io::{SURFACE_EXTENSIONS, byte_colors, has_extension, is_sensor};

/// Attributes that are not in the file of a surface.
#[derive(Debug, Default)]
pub struct Omitted {
    /// The format holds none: their names, and formats that do.
    pub note: Option<String>,
    /// Attributes with values that are not finite.
    pub warnings: Vec<String>,
}

/// Error in writing a surface.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An array of a device.
    #[error(transparent)]
    Result(#[from] isograd_backend::Error),
    /// The file.
    #[error(transparent)]
    File(#[from] isograd_io::Error),
    /// The vertices with their attributes.
    #[error(transparent)]
    Vertices(#[from] PointCloudError),
}

/// Writes the surface; its vertices have the attributes of the cloud where the format holds them.
///
/// # Errors
/// A failed write, which leaves the file at `path` unchanged; an array that can't be copied from a device.
pub fn write<T: Number>(
    path: &Path,
    view: View<'_, T>,
    mesh: &Mesh<T>,
    cloud: &PointCloud<T>,
) -> Result<Omitted, Error> {
    let mut omitted = Omitted::default();
    let attributes = cloud.attributes();
    let names = attributes.iter().map(|attribute| attribute.name.as_str());
    let names: Vec<&str> = names.filter(|name| !is_sensor(name)).collect();
    if names.is_empty() || !holds_attributes(path) {
        isograd_io::write_mesh(path, mesh)?;
        omitted.note = (!names.is_empty()).then(|| {
            format!(
                "{} holds no attributes; {} can be written to .ply and .vtp",
                path.display(),
                names.join(", ")
            )
        });
        return Ok(omitted);
    }
    let mut vertices = PointCloud::new(mesh.vertices().to_vec())?;
    for (attribute, is_color) in attributes.iter().zip(byte_colors(attributes)) {
        if is_sensor(&attribute.name) {
            continue;
        }
        match view.vertex_values(attribute) {
            Ok(values) => vertices = with_values(vertices, attribute, values, is_color)?,
            Err(isograd_backend::Error::Extension(error @ extend::Error::NotFinite { .. })) => {
                omitted.warnings.push(format!(
                    "'{}' is not written to {}: {error}",
                    attribute.name,
                    path.display()
                ));
            }
            Err(error) => return Err(error.into()),
        }
    }
    isograd_io::write_surface(path, &vertices, mesh.faces())?;
    Ok(omitted)
}

/// Adds an attribute to the vertices; colors are rounded to whole numbers from 0 to 255.
fn with_values<T: Real>(
    vertices: PointCloud<T>,
    attribute: &Attribute<T>,
    mut values: Vec<T>,
    is_color: bool,
) -> Result<PointCloud<T>, PointCloudError> {
    if is_color {
        for value in &mut values {
            // The sum makes 0 of a negative zero, which a byte does not have and `max` may keep.
            *value = value.round().max(T::zero()).min(T::of(255.0)) + T::zero();
        }
    }
    vertices.with_attribute(Attribute {
        values,
        ..attribute.clone()
    })
}

fn holds_attributes(path: &Path) -> bool {
    is_standard_output(path) || has_extension(path, SURFACE_EXTENSIONS)
}
