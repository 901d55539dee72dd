//! What is known of the sides of a cloud, on the device.

use cubecl::prelude::Runtime;
use isograd::orient::{Error as Refused, Method, ParityOptions};
use isograd::{PointCloud, Sensors};

use super::Error;
use crate::{Buffer, Device, Scalar, orient};

/// How signs are chosen, with what that needs.
pub(super) enum Sides<T> {
    Auto,
    Parity(ParityOptions),
    Signs(Buffer<T>),
    SeenEach(Buffer<T>),
    SeenAny(Buffer<T>),
    /// No axes are turned: the cloud's own normals are taken.
    Given,
}

impl<T: Scalar> Sides<T> {
    /// What `method`, which is that of a first call, needs of a cloud.
    pub(super) fn upload<R: Runtime>(
        device: &Device<R>,
        cloud: &PointCloud<T>,
        method: Method,
    ) -> Result<Self, Error> {
        let refused = |reason: Refused| Error::Host(reason.into());
        let normals = || cloud.normals().ok_or_else(|| refused(Refused::NoNormals));
        let sensors = || cloud.sensors().ok_or_else(|| refused(Refused::NoSensors));
        let vectors = |vectors: &[[T; 3]]| device.upload(vectors.as_flattened());
        Ok(match method {
            Method::Auto | Method::Previous => Self::Auto,
            Method::Parity(options) => Self::Parity(options),
            Method::Given => {
                normals()?;
                Self::Given
            }
            Method::Signs => Self::Signs(vectors(normals()?)?),
            Method::Sensors => match sensors()? {
                Sensors::Each(positions) => Self::SeenEach(vectors(positions)?),
                Sensors::Any(positions) => Self::SeenAny(vectors(positions)?),
            },
        })
    }

    /// As the device's stage has it; none where no signs are to be chosen.
    pub(super) fn method(&self) -> Option<orient::Method<'_, T>> {
        Some(match self {
            Self::Auto => orient::Method::Auto,
            Self::Parity(options) => orient::Method::Parity(*options),
            Self::Signs(vectors) => orient::Method::Signs(vectors),
            Self::SeenEach(positions) => orient::Method::Sensors(orient::Sensors::Each(positions)),
            Self::SeenAny(positions) => orient::Method::Sensors(orient::Sensors::Any(positions)),
            Self::Given => return None,
        })
    }

    /// Its name in a report.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Parity(_) => "parity",
            Self::Signs(_) => "signs",
            Self::SeenEach(_) | Self::SeenAny(_) => "sensors",
            Self::Given => "given",
        }
    }
}
