//! Colors of points: whole numbers from 0 to 255 in most files.

use isograd::data::Attribute;
use isograd::{PointCloud, Real};

/// Names of the channels.
pub(crate) const CHANNELS: [&str; 4] = ["red", "green", "blue", "alpha"];

/// Names of attributes that hold all channels of a color.
const PACKED: [&str; 4] = ["rgb", "rgba", "color", "colors"];

/// For each attribute, whether it is a color, or a channel of one, of whole numbers from 0 to 255: `red`, `green`, `blue` and
/// perhaps `alpha`, of one component each, or an attribute `RGB`, `RGBA`, `color` or `colors` of 3 or 4 components. Writers
/// store these as bytes. Numbers of 0 and 1 alone are fractions, unless all are 0.
pub fn byte_colors<T: Real>(attributes: &[Attribute<T>]) -> Vec<bool> {
    let channels: Vec<usize> = channels(attributes).into_iter().flatten().collect();
    let values = |k: &usize| attributes[*k].values.iter();
    let has_colors = channels.len() >= 3 && are_bytes(channels.iter().flat_map(values));
    let packed = |attribute: &Attribute<T>| {
        let named = |name: &&str| attribute.name.eq_ignore_ascii_case(name);
        matches!(attribute.components, 3 | 4) && PACKED.iter().any(named)
    };
    let is_color = |(k, attribute): (usize, &Attribute<T>)| match channels.contains(&k) {
        true => has_colors,
        false => packed(attribute) && are_bytes(attribute.values.iter()),
    };
    attributes.iter().enumerate().map(is_color).collect()
}

/// The attribute of each channel, in the order of [`CHANNELS`]; all `None` without red, green and blue.
pub(crate) fn channels<T: Real>(attributes: &[Attribute<T>]) -> [Option<usize>; 4] {
    let find = |name: &str| {
        let mut attributes = attributes.iter();
        attributes.position(|a| a.components == 1 && a.name.eq_ignore_ascii_case(name))
    };
    let found = CHANNELS.map(find);
    match found[..3].iter().all(Option::is_some) {
        true => found,
        false => [None; 4],
    }
}

fn are_bytes<'a, T: Real>(values: impl Iterator<Item = &'a T>) -> bool {
    let mut largest = T::zero();
    for &value in values {
        let is_byte = value.fract() == T::zero() && value <= T::of(255.0);
        // A byte has no negative zero.
        if !is_byte || value.is_sign_negative() {
            return false;
        }
        largest = largest.max(value);
    }
    largest != T::one()
}

/// Whether each column of a cloud, in the order of [`row`](crate::columns::row), is written as a byte.
pub(crate) fn byte_columns<T: Real>(cloud: &PointCloud<T>) -> Vec<bool> {
    let vectors = if cloud.normals().is_some() { 6 } else { 3 };
    let mut columns = vec![false; vectors];
    for (attribute, is_color) in cloud
        .attributes()
        .iter()
        .zip(byte_colors(cloud.attributes()))
    {
        columns.extend(std::iter::repeat_n(is_color, attribute.components));
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(name: &str, components: usize, values: &[f64]) -> Attribute<f64> {
        Attribute {
            name: name.into(),
            components,
            values: values.to_vec(),
        }
    }

    #[test]
    fn colors_of_whole_numbers_up_to_255_are_bytes() {
        let color = |values: [f64; 3]| {
            let names = ["Red", "green", "blue"].into_iter().zip(values);
            names
                .map(|(name, v)| attribute(name, 1, &[v]))
                .collect::<Vec<_>>()
        };
        for (values, expected) in [
            ([0.0, 128.0, 255.0], true),
            ([0.0, 0.0, 0.0], true),
            ([0.0, 1.0, 0.0], false),
            ([0.5, 128.0, 255.0], false),
            ([0.0, 128.0, 256.0], false),
            ([-1.0, 128.0, 255.0], false),
            ([-0.0, 128.0, 255.0], false),
            ([f64::INFINITY, 128.0, 255.0], false),
            ([f64::NAN, 128.0, 255.0], false),
        ] {
            assert_eq!(byte_colors(&color(values)), [expected; 3], "{values:?}");
        }
        let mut attributes = color([1.0, 2.0, 3.0]);
        attributes.push(attribute("alpha", 1, &[255.0]));
        attributes.push(attribute("label", 1, &[7.0]));
        assert_eq!(byte_colors(&attributes), [true, true, true, true, false]);
        // No color without its third channel.
        assert_eq!(byte_colors(&attributes[..2]), [false; 2]);
        for (name, components, expected) in [("RGB", 3, true), ("rgb", 2, false), ("v", 3, false)] {
            let packed = attribute(name, components, &[9.0; 6]);
            assert_eq!(byte_colors(&[packed]), [expected]);
        }
    }
}
