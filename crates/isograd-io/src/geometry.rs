//! Content of a file of points or of a mesh.

use isograd::data::Attribute;
use isograd::{Mesh, MeshError, PointCloud, PointCloudError, Real, Sensors};

use isograd_element::vector;

use crate::format::Format;
use crate::number::Dtype;

/// The content of a file of points or of a mesh, in double precision: every coordinate and normal is
/// finite, unless the reader was to [keep](crate::NotFinite) others, and every face names vertices that are there.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// `(N, 3)` points or vertices, in the file's order and unit.
    pub points: Vec<[f64; 3]>,
    /// `(N, 3)` normals, not normalized.
    pub normals: Option<Vec<[f64; 3]>>,
    /// Further values per point.
    pub attributes: Vec<Attribute<f64>>,
    /// `(F, 3)` triangles, into which polygons are cut. Empty if the file has none.
    pub faces: Vec<[u32; 3]>,
    /// Number type of the coordinates in the file.
    pub dtype: Dtype,
    /// The file's format.
    pub format: Format,
}

impl Geometry {
    /// Points alone.
    pub(crate) fn from_points(points: Vec<[f64; 3]>, dtype: Dtype, format: Format) -> Self {
        Self {
            points,
            normals: None,
            attributes: Vec::new(),
            faces: Vec::new(),
            dtype,
            format,
        }
    }

    /// Whether all normals are finite.
    pub fn has_finite_normals(&self) -> bool {
        let mut normals = self.normals.iter().flatten();
        normals.all(|&normal| vector::is_finite(normal))
    }

    /// Removes points that are not finite or whose normal is not, and faces with such corners. Returns the number of points
    /// removed.
    pub fn drop_not_finite(&mut self) -> usize {
        let normals = self.normals.as_deref().unwrap_or_default();
        let normals = normals.iter().map(Some).chain(std::iter::repeat(None));
        let rows = self.points.iter().zip(normals);
        let is_finite = |row: &[f64; 3]| vector::is_finite(*row);
        let kept: Vec<bool> = rows
            .map(|(point, normal)| is_finite(point) && normal.is_none_or(is_finite))
            .collect();
        let removed = kept.iter().filter(|&&is_kept| !is_kept).count();
        if removed == 0 {
            return 0;
        }
        retain(&mut self.points, &kept, 1);
        if let Some(normals) = &mut self.normals {
            retain(normals, &kept, 1);
        }
        for attribute in &mut self.attributes {
            retain(&mut attribute.values, &kept, attribute.components);
        }
        let mut next = 0;
        let index = |&is_kept: &bool| {
            next += u32::from(is_kept);
            is_kept.then_some(next.wrapping_sub(1))
        };
        let indices: Vec<Option<u32>> = kept.iter().map(index).collect();
        self.faces.retain_mut(|face| {
            let all = face.map(|corner| indices.get(corner as usize).copied().flatten());
            let [Some(a), Some(b), Some(c)] = all else {
                return false;
            };
            *face = [a, b, c];
            true
        });
        removed
    }

    /// Converts the points to a cloud of type `T`. Attributes with sensor positions (`sensor_x`,
    /// `sensor_y` and `sensor_z`, or `sensor` of three components) become its sensors and stay attributes.
    ///
    /// # Errors
    /// A coordinate or sensor that is not finite in `T`, or more points than a cloud may hold.
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

    /// `(N, 3)` sensor positions, if the attributes hold them.
    fn sensors(&self) -> Option<Vec<[f64; 3]>> {
        let find = |name: &str, components: usize| {
            let mut attributes = self.attributes.iter();
            attributes.find(|a| a.components == components && a.name.eq_ignore_ascii_case(name))
        };
        if let Some(whole) = find(SENSOR, 3) {
            return Some(whole.values.as_chunks().0.to_vec());
        }
        SENSOR_AXES.into_iter().find_map(|[x, y, z]| {
            let (x, y, z) = (find(x, 1)?, find(y, 1)?, find(z, 1)?);
            let rows = x.values.iter().zip(&y.values).zip(&z.values);
            Some(rows.map(|((&x, &y), &z)| [x, y, z]).collect())
        })
    }

    /// Converts vertices and faces to a mesh of type `T`.
    ///
    /// # Errors
    /// A coordinate that is not finite in `T`, or more vertices than 32-bit indices can address.
    pub fn mesh<T: Real>(&self) -> Result<Mesh<T>, MeshError> {
        Mesh::new(convert(&self.points), self.faces.clone())
    }
}

/// Attribute of three components with the sensor positions.
const SENSOR: &str = "sensor";

/// Attributes of one component with the sensor positions. The second form is how the writers split [`SENSOR`].
const SENSOR_AXES: [[&str; 3]; 2] = [
    ["sensor_x", "sensor_y", "sensor_z"],
    ["sensor_0", "sensor_1", "sensor_2"],
];

/// Whether an attribute of this name may hold sensor positions.
pub fn is_sensor(name: &str) -> bool {
    let mut names = SENSOR_AXES.as_flattened().iter().chain([&SENSOR]);
    names.any(|known| name.eq_ignore_ascii_case(known))
}

/// Retains the rows that are kept, each of so many values.
fn retain<V>(values: &mut Vec<V>, kept: &[bool], components: usize) {
    let mut rows = kept
        .iter()
        .flat_map(|&is_kept| std::iter::repeat_n(is_kept, components));
    values.retain(|_| rows.next().unwrap_or(true));
}

fn convert<T: Real>(points: &[[f64; 3]]) -> Vec<[T; 3]> {
    points.iter().map(|p| p.map(T::of)).collect()
}

/// Refuses a point or normal (`what`) that is not finite.
pub(crate) fn check_finite(what: &str, [x, y, z]: [f64; 3]) -> Result<(), String> {
    if x.is_finite() && y.is_finite() && z.is_finite() {
        return Ok(());
    }
    Err(format!(
        "the {what} ({x}, {y}, {z}) is not finite; correct it, or leave such points out with 'isograd clean' (drop_not_finite in Python)"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn geometry(attributes: &[(&str, usize)]) -> Geometry {
        let attribute = |&(name, components): &(&str, usize)| Attribute {
            name: name.into(),
            components,
            values: (0..2 * components).map(|v| v as f64).collect(),
        };
        Geometry {
            attributes: attributes.iter().map(attribute).collect(),
            ..Geometry::from_points(vec![[0.0; 3], [1.0; 3]], Dtype::F64, Format::Npz)
        }
    }

    #[test]
    fn rows_that_are_not_finite_are_dropped_with_their_faces() {
        let nan = f64::NAN;
        let mut points: Vec<[f64; 3]> = (0..6).map(|i| [f64::from(i); 3]).collect();
        let mut normals = points.clone();
        (points[1][2], normals[4][0]) = (nan, f64::INFINITY);
        let mut geometry = Geometry {
            faces: vec![[0, 1, 2], [0, 2, 3], [3, 4, 5], [5, 3, 2]],
            attributes: vec![Attribute {
                name: "a".into(),
                components: 2,
                values: (0..12).map(f64::from).collect(),
            }],
            normals: Some(normals),
            ..Geometry::from_points(points, Dtype::F64, Format::Ply)
        };
        assert!(!geometry.has_finite_normals());
        assert_eq!(geometry.drop_not_finite(), 2);
        let left = [0.0, 2.0, 3.0, 5.0];
        assert_eq!(geometry.points, left.map(|x| [x; 3]));
        assert_eq!(geometry.normals, Some(left.map(|x| [x; 3]).to_vec()));
        let values: Vec<f64> = left.iter().flat_map(|x| [2.0 * x, 2.0 * x + 1.0]).collect();
        assert_eq!(geometry.attributes[0].values, values);
        assert_eq!(geometry.faces, [[0, 1, 2], [3, 2, 1]]);
        assert_eq!(
            (geometry.drop_not_finite(), geometry.has_finite_normals()),
            (0, true)
        );
    }

    #[test]
    fn attributes_with_sensor_positions_become_the_sensors_of_a_cloud() {
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
