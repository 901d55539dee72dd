//! What a file of points or of a mesh holds.

use isograd::data::Attribute;
use isograd::{Mesh, MeshError, PointCloud, PointCloudError, Real, vector};

use crate::format::Format;
use crate::number::Dtype;

/// The content of a file of points or of a mesh, in double precision: every coordinate and normal is
/// finite, every face names vertices that are there.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// `(N, 3)` points or vertices, in the file's order and unit.
    pub points: Vec<[f64; 3]>,
    /// `(N, 3)` normals, as they stand in the file (any length).
    pub normals: Option<Vec<[f64; 3]>>,
    /// What else the file says of each point.
    pub attributes: Vec<Attribute<f64>>,
    /// `(F, 3)` triangles; polygons are cut into fans. Empty where the file has none.
    pub faces: Vec<[u32; 3]>,
    /// How the file stored the coordinates.
    pub dtype: Dtype,
    /// The file's format.
    pub format: Format,
}

impl Geometry {
    /// The points as a cloud of type `T`.
    ///
    /// # Errors
    /// A coordinate beyond the range of `f32`, or more points than a cloud may hold.
    pub fn cloud<T: Real>(&self) -> Result<PointCloud<T>, PointCloudError> {
        let cloud = PointCloud::new(convert(&self.points))?;
        let cloud = match &self.normals {
            Some(normals) => cloud.with_normals(convert(normals))?,
            None => cloud,
        };
        self.attributes.iter().try_fold(cloud, |cloud, attribute| {
            cloud.with_attribute(Attribute {
                name: attribute.name.clone(),
                components: attribute.components,
                values: attribute.values.iter().map(|&v| T::of(v)).collect(),
            })
        })
    }

    /// The triangles as a mesh of type `T`; without faces, a mesh without faces.
    ///
    /// # Errors
    /// A coordinate beyond the range of `f32`, or more vertices than 32-bit indices can name.
    pub fn mesh<T: Real>(&self) -> Result<Mesh<T>, MeshError> {
        Mesh::new(convert(&self.points), self.faces.clone())
    }
}

fn convert<T: Real>(points: &[[f64; 3]]) -> Vec<[T; 3]> {
    points.iter().map(|&p| vector::of_f64(p)).collect()
}

/// The triangles of a polygon, as a fan round its first corner; the same winding.
pub(crate) fn triangulate(corners: &[u32], faces: &mut Vec<[u32; 3]>) {
    if let Some((&first, rest)) = corners.split_first() {
        faces.extend(rest.windows(2).map(|pair| [first, pair[0], pair[1]]));
    }
}

/// What is wrong with a coordinate or normal, if it is not finite.
pub(crate) fn refuse_not_finite(what: &str, v: [f64; 3]) -> Result<(), String> {
    if vector::is_finite(v) {
        return Ok(());
    }
    Err(format!(
        "the {what} ({}, {}, {}) is not finite; remove the point or mend it",
        v[0], v[1], v[2]
    ))
}
