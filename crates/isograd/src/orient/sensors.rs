//! Signs from sensor positions.
//!
//! A sample was seen from outside: its outward normal is on the side of its sensor. How well that tells the two
//! sides apart is the cosine between axis and line of sight. A grazing view, of which a small error of the axis
//! changes the side, only adds to the evidence of the automatic method.

use super::evidence;
use super::{Error, Known};
use crate::data::Sensors;
use crate::{Real, vector};

/// Cosine, from −1 to 1, between each axis and the direction from its point to its sensor. Where it is not
/// known which of several sensors saw the point: that of the most grazing one where they are all on one side,
/// else 0.
pub(super) fn views<T: Real>(
    points: &[[T; 3]],
    axes: &[[T; 3]],
    known: &Known<'_, T>,
    out: &mut Vec<f32>,
) -> Result<(), Error> {
    let sensors = known.sensors.ok_or(Error::NoSensors)?;
    out.clear();
    let pairs = points.iter().zip(axes).enumerate();
    match sensors {
        Sensors::Each(positions) => {
            super::check_count(points, positions, "sensor positions")?;
            for (i, (&point, &axis)) in pairs {
                out.push(view(i, point, axis, positions[i])?);
            }
        }
        Sensors::Any(positions) => {
            for (i, (&point, &axis)) in pairs {
                out.push(view_of_any(i, point, axis, positions)?);
            }
        }
    }
    Ok(())
}

fn view<T: Real>(i: usize, point: [T; 3], axis: [T; 3], sensor: [T; 3]) -> Result<f32, Error> {
    let sight = vector::sub(vector::to_f64(sensor), vector::to_f64(point));
    let sight = vector::normalized(sight).ok_or(Error::SensorOnPoint { index: i })?;
    Ok(vector::dot(vector::to_f64(axis), sight) as f32)
}

fn view_of_any<T: Real>(
    i: usize,
    point: [T; 3],
    axis: [T; 3],
    sensors: &[[T; 3]],
) -> Result<f32, Error> {
    let mut agreed: Option<f32> = None;
    for &sensor in sensors {
        let cosine = view(i, point, axis, sensor)?;
        agreed = Some(agreed.map_or(cosine, |before| evidence::agreed(before, cosine)));
    }
    agreed.ok_or(Error::NoSensors)
}
