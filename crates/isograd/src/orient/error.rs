//! Errors of the orientation.

/// Errors of the orientation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The method needs normals, and the cloud has none.
    #[error("the cloud has no normals to take; orient it automatically or by parity")]
    NoNormals,
    /// Points, axes or normals differ in number.
    #[error("{points} points and {vectors} {kind}: give one for each point")]
    Count {
        /// Number of points.
        points: usize,
        /// Number of axes, normals or sensor positions.
        vectors: usize,
        /// `"axes"`, `"normals"` or `"sensor positions"`.
        kind: &'static str,
    },
    /// A vector that has no direction.
    #[error(
        "{kind} of point {index} is zero or not finite; mend it, or orient automatically from the points alone"
    )]
    NoDirection {
        /// Index of the first such point, from 0.
        index: usize,
        /// `"the axis"` or `"the normal"`.
        kind: &'static str,
    },
    /// The method needs sensor positions, and the cloud has none.
    #[error("the cloud has no sensor positions; give them, or orient automatically")]
    NoSensors,
    /// A point that is where its sensor is.
    #[error(
        "point {index} lies exactly at a sensor, so that it has no line of sight; remove it (scanners write such points for rays that met nothing)"
    )]
    SensorOnPoint {
        /// Index of the first such point, from 0.
        index: usize,
    },
    /// A parity option out of range.
    #[error("the parity option {name} is {value}; give a finite number of at least {least}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The least value it can have.
        least: f64,
    },
    /// The detection radius is nothing beside the extent of the cloud.
    #[error(
        "the parity method's detection radius is {radius:e}, a millionth of the cloud: its points come in equal pairs; remove the duplicates, or orient automatically"
    )]
    DetectionRadius {
        /// `r_d`, in the unit of the points.
        radius: f64,
    },
}
