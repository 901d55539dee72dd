//! What a file of points or of a mesh holds.

use isograd::data::Attribute;
use isograd::{Mesh, MeshError, PointCloud, PointCloudError, Real, Sensors};
use isograd_element::vector;

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
    /// The points as a cloud of type `T`. Attributes that say where each point was seen from (`sensor_x`,
    /// `sensor_y` and `sensor_z`, or `sensor` of three components) become its sensors, and stay attributes.
    ///
    /// # Errors
    /// A coordinate or sensor beyond the range of `f32` or not finite, or more points than a cloud may hold.
    pub fn cloud<T: Real>(&self) -> Result<PointCloud<T>, PointCloudError> {
        let cloud = PointCloud::new(convert(&self.points))?;
        let cloud = match &self.normals {
            Some(normals) => cloud.with_normals(convert(normals))?,
            None => cloud,
        };
        let cloud = match self.sensors() {
            Some(sensors) => cloud.with_sensors(Sensors::Each(convert(&sensors)))?,
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

    /// `(N, 3)` where each point was seen from, if attributes say so.
    fn sensors(&self) -> Option<Vec<[f64; 3]>> {
        let find = |name: &str, components: usize| {
            let mut found = self.attributes.iter();
            found.find(|a| a.name == name && a.components == components)
        };
        if let Some(whole) = find("sensor", 3) {
            return Some(whole.values.as_chunks().0.to_vec());
        }
        // As a writer splits an attribute of three components.
        [
            ["sensor_x", "sensor_y", "sensor_z"],
            ["sensor_0", "sensor_1", "sensor_2"],
        ]
        .into_iter()
        .find_map(|[x, y, z]| {
            let (x, y, z) = (find(x, 1)?, find(y, 1)?, find(z, 1)?);
            let rows = x.values.iter().zip(&y.values).zip(&z.values);
            Some(rows.map(|((&x, &y), &z)| [x, y, z]).collect())
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

#[cfg(test)]
mod tests {
    use super::*;

    fn geometry(attributes: &[(&str, usize)]) -> Geometry {
        let of = |&(name, components): &(&str, usize)| Attribute {
            name: name.into(),
            components,
            values: (0..2 * components).map(|v| v as f64).collect(),
        };
        Geometry {
            points: vec![[0.0; 3], [1.0; 3]],
            normals: None,
            attributes: attributes.iter().map(of).collect(),
            faces: Vec::new(),
            dtype: Dtype::F64,
            format: Format::Npz,
        }
    }

    #[test]
    fn attributes_that_say_where_a_point_was_seen_from_are_its_sensors() {
        let whole = geometry(&[("sensor", 3)]).cloud::<f64>().expect("a cloud");
        let rows = vec![[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]];
        assert_eq!(whole.sensors(), Some(&Sensors::Each(rows)));
        for names in [
            ["sensor_z", "sensor_x", "sensor_y"],
            ["sensor_0", "sensor_1", "sensor_2"],
        ] {
            let split = geometry(&names.map(|name| (name, 1)));
            let cloud = split.cloud::<f32>().expect("a cloud");
            let rows = vec![[0.0; 3], [1.0; 3]];
            assert_eq!(cloud.sensors(), Some(&Sensors::Each(rows)));
            assert_eq!(cloud.attributes().len(), 3);
        }
        for part in [&[("sensor_x", 1), ("sensor_y", 1)][..], &[("sensor", 1)]] {
            let cloud = geometry(part).cloud::<f64>().expect("a cloud");
            assert_eq!(cloud.sensors(), None);
        }
    }
}
