//! Samples of a surface.

use std::sync::Arc;

use crate::{Real, vector};

/// A named value per sample, with a fixed number of components (a surface velocity has 3).
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute<T> {
    /// Its name, as files and reports show it.
    pub name: String,
    /// Number of components per sample, at least 1.
    pub components: usize,
    /// `(N, components)`, row by row.
    pub values: Vec<T>,
}

/// Where the samples were seen from, in their unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Sensors<T> {
    /// `(N, 3)`: a position for each sample.
    Each(Vec<[T; 3]>),
    /// `(M, 3)`: every sample was seen from at least one of these; from which, is not known. One position is
    /// that of all samples.
    Any(Vec<[T; 3]>),
}

impl<T> Sensors<T> {
    /// The positions, whatever they belong to.
    pub fn positions(&self) -> &[[T; 3]] {
        match self {
            Self::Each(positions) | Self::Any(positions) => positions,
        }
    }
}

/// Samples of a surface: `(N, 3)` points, and, where known, normals, sensors and attributes. Its reconstructions share
/// points and normals with it.
#[derive(Clone, Debug, PartialEq)]
pub struct PointCloud<T> {
    points: Arc<Vec<[T; 3]>>,
    normals: Option<Arc<Vec<[T; 3]>>>,
    sensors: Option<Sensors<T>>,
    attributes: Vec<Attribute<T>>,
}

/// Why a cloud was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PointCloudError {
    /// A coordinate is NaN or infinite.
    #[error("point {index} is not finite: ({x:?}, {y:?}, {z:?}); remove it or mend it")]
    NotFinite {
        /// Index of the point, from 0.
        index: usize,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
        /// Third coordinate.
        z: f64,
    },
    /// The normals do not match the points.
    #[error("{normals} normals for {points} points; give one normal a point, or none at all")]
    NormalCount {
        /// Number of points.
        points: usize,
        /// Number of normals.
        normals: usize,
    },
    /// A component of a normal is NaN or infinite.
    #[error("the normal of point {index} is not finite; remove the point or mend the normal")]
    NormalNotFinite {
        /// Index of the point, from 0.
        index: usize,
    },
    /// The sensor positions do not match the points.
    #[error(
        "{sensors} sensor positions for {points} points; give one for each point, or at least one that all share"
    )]
    SensorCount {
        /// Number of points.
        points: usize,
        /// Number of positions.
        sensors: usize,
    },
    /// A coordinate of a sensor is NaN or infinite.
    #[error("sensor position {index} is not finite; mend it, or give one for all points")]
    SensorNotFinite {
        /// Index of the position, from 0.
        index: usize,
    },
    /// An attribute does not match the points.
    #[error("attribute '{name}' has {values} values, not {components} for each of {points} points")]
    AttributeCount {
        /// Name of the attribute.
        name: String,
        /// Number of values.
        values: usize,
        /// Components per point.
        components: usize,
        /// Number of points.
        points: usize,
    },
    /// More points than 32-bit indices can name.
    #[error("{points} points are more than the {max} that one cloud may hold; thin the cloud")]
    TooMany {
        /// Number of points.
        points: usize,
        /// The limit.
        max: usize,
    },
}

impl<T: Real> PointCloud<T> {
    /// A cloud of `(N, 3)` finite points, in the user's unit. `N` may be 0: how many a method needs is
    /// the method's own error.
    ///
    /// # Errors
    /// [`PointCloudError::NotFinite`] names the first bad point.
    pub fn new(points: Vec<[T; 3]>) -> Result<Self, PointCloudError> {
        const MAX: usize = u32::MAX as usize - 1;
        if points.len() > MAX {
            return Err(PointCloudError::TooMany {
                points: points.len(),
                max: MAX,
            });
        }
        if let Some(index) = points.iter().position(|&p| !vector::is_finite(p)) {
            let [x, y, z] = vector::to_f64(points[index]);
            return Err(PointCloudError::NotFinite { index, x, y, z });
        }
        Ok(Self {
            points: Arc::new(points),
            normals: None,
            sensors: None,
            attributes: Vec::new(),
        })
    }

    /// A cloud of parts that were checked.
    pub(super) fn from_parts(
        points: Vec<[T; 3]>,
        normals: Option<Vec<[T; 3]>>,
        sensors: Option<Sensors<T>>,
    ) -> Self {
        Self {
            points: Arc::new(points),
            normals: normals.map(Arc::new),
            sensors,
            attributes: Vec::new(),
        }
    }

    /// This cloud with a normal for each point (any length but zero; outward where the method
    /// trusts them).
    ///
    /// # Errors
    /// A wrong count, or a normal that is not finite.
    pub fn with_normals(mut self, normals: Vec<[T; 3]>) -> Result<Self, PointCloudError> {
        if normals.len() != self.points.len() {
            return Err(PointCloudError::NormalCount {
                points: self.points.len(),
                normals: normals.len(),
            });
        }
        if let Some(index) = normals.iter().position(|&n| !vector::is_finite(n)) {
            return Err(PointCloudError::NormalNotFinite { index });
        }
        self.normals = Some(Arc::new(normals));
        Ok(self)
    }

    /// This cloud, with the positions that its points were seen from.
    ///
    /// # Errors
    /// A number of positions other than that of the points where there is one for each, none where all share
    /// them, or one that is not finite.
    pub fn with_sensors(mut self, sensors: Sensors<T>) -> Result<Self, PointCloudError> {
        let positions = sensors.positions();
        let is_enough = match &sensors {
            Sensors::Each(positions) => positions.len() == self.points.len(),
            Sensors::Any(positions) => !positions.is_empty(),
        };
        if !is_enough {
            return Err(PointCloudError::SensorCount {
                points: self.points.len(),
                sensors: positions.len(),
            });
        }
        if let Some(index) = positions.iter().position(|&p| !vector::is_finite(p)) {
            return Err(PointCloudError::SensorNotFinite { index });
        }
        self.sensors = Some(sensors);
        Ok(self)
    }

    /// This cloud with one more attribute.
    ///
    /// # Errors
    /// A number of values other than `N · components`.
    pub fn with_attribute(mut self, attribute: Attribute<T>) -> Result<Self, PointCloudError> {
        let expected = self.points.len().checked_mul(attribute.components);
        if attribute.components == 0 || expected != Some(attribute.values.len()) {
            return Err(PointCloudError::AttributeCount {
                name: attribute.name,
                values: attribute.values.len(),
                components: attribute.components,
                points: self.points.len(),
            });
        }
        self.attributes.push(attribute);
        Ok(self)
    }

    /// `(N, 3)` points.
    pub fn points(&self) -> &[[T; 3]] {
        &self.points
    }

    /// `(N, 3)` normals, where the cloud has them.
    pub fn normals(&self) -> Option<&[[T; 3]]> {
        self.normals.as_ref().map(|normals| normals.as_slice())
    }

    /// `(N, 3)` points, without a copy.
    pub(crate) fn shared_points(&self) -> Arc<Vec<[T; 3]>> {
        self.points.clone()
    }

    /// `(N, 3)` normals, without a copy; empty where the cloud has none.
    pub(crate) fn shared_normals(&self) -> Arc<Vec<[T; 3]>> {
        self.normals.clone().unwrap_or_default()
    }

    /// Where the points were seen from, where that is known.
    pub fn sensors(&self) -> Option<&Sensors<T>> {
        self.sensors.as_ref()
    }

    /// The attributes, in the order in which they were added.
    pub fn attributes(&self) -> &[Attribute<T>] {
        &self.attributes
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Low and high corner of the axis-aligned bounding box; `None` for an empty cloud.
    pub fn bounds(&self) -> Option<([T; 3], [T; 3])> {
        bounds(&self.points)
    }
}

/// Low and high corner of the axis-aligned box around `points`; `None` if there are none.
pub(crate) fn bounds<T: Real>(points: &[[T; 3]]) -> Option<([T; 3], [T; 3])> {
    let (&first, rest) = points.split_first()?;
    Some(rest.iter().fold((first, first), |(mut low, mut high), p| {
        for a in 0..3 {
            low[a] = low[a].min(p[a]);
            high[a] = high[a].max(p[a]);
        }
        (low, high)
    }))
}
