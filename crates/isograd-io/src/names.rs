//! Names of columns: recognition of coordinates and normals, choice by the user, and unique names for writers.

use std::collections::HashMap;

/// Largest number of columns of a text file and of properties of a PLY header. Scans have up to some hundreds.
pub(crate) const MAX_COLUMNS: usize = 4096;

/// Quantity with three components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Points,
    Normals,
}

/// Beginnings of names such as `points_x` and `Points:0`.
const POINTS: &[&str] = &[
    "point",
    "points",
    "pos",
    "position",
    "positions",
    "coord",
    "coords",
    "coordinate",
    "coordinates",
];
const NORMALS: &[&str] = &["n", "normal", "normals"];

/// Lower-case name without its unit: `x` for `X [m]`.
fn plain(name: &str) -> String {
    let name = name.trim();
    let without_unit = match name.chars().last() {
        Some(']') => name.split_once('['),
        Some(')') => name.split_once('('),
        _ => None,
    };
    let name = without_unit.map_or(name, |(name, _)| name.trim());
    name.to_lowercase()
}

/// The beginning of a plain name that it shares with the other two axes, and the axis.
fn split_axis(plain: &str) -> Option<(Quantity, &str, usize)> {
    match plain {
        "easting" => return Some((Quantity::Points, "easting", 0)),
        "northing" => return Some((Quantity::Points, "easting", 1)),
        "height" | "elevation" | "altitude" => return Some((Quantity::Points, "easting", 2)),
        _ => {}
    }
    let last = plain.chars().last()?;
    let (axis, is_digit) = match last {
        'x' | 'y' | 'z' => (last as usize - 'x' as usize, false),
        '0' | '1' | '2' => (last as usize - '0' as usize, true),
        _ => return None,
    };
    let beginning = &plain[..plain.len() - 1];
    let word = beginning.trim_end_matches([':', '_', '.', '-', ' ']);
    if is_digit && word == beginning {
        return None;
    }
    let quantity = match word {
        "" if beginning.is_empty() => Quantity::Points,
        word if POINTS.contains(&word) => Quantity::Points,
        word if NORMALS.contains(&word) => Quantity::Normals,
        _ => return None,
    };
    Some((quantity, beginning, axis))
}

/// Whether readers of text take a column of this name for a component of the normals.
pub(crate) fn is_normal(name: &str) -> bool {
    matches!(split_axis(&plain(name)), Some((Quantity::Normals, _, _)))
}

/// The three columns of a quantity. Of several triples, `x, y, z` is preferred, then the first. `None` if there is no
/// triple, or if an axis has several columns.
pub(crate) fn find(names: &[String], quantity: Quantity) -> Option<[usize; 3]> {
    let plain: Vec<String> = names.iter().map(|name| plain(name)).collect();
    let mut triples: Vec<(&str, [Axis; 3])> = Vec::new();
    for (column, plain) in plain.iter().enumerate() {
        let Some((_, beginning, axis)) = split_axis(plain).filter(|found| found.0 == quantity)
        else {
            continue;
        };
        let known = triples.iter().position(|(known, _)| *known == beginning);
        let at = known.unwrap_or_else(|| {
            triples.push((beginning, [Axis::default(); 3]));
            triples.len() - 1
        });
        triples[at].1[axis].add(column, names[column] == *plain);
    }
    triples.sort_by_key(|(beginning, _)| !beginning.is_empty());
    triples.into_iter().find_map(|(_, axes)| {
        let [x, y, z] = axes.map(Axis::column);
        Some([x?, y?, z?])
    })
}

/// Columns that may be that of an axis.
#[derive(Clone, Copy, Default)]
struct Axis {
    /// Columns with exactly the plain name, without a unit and in lower case: their number, and the last.
    exact: (usize, usize),
    /// All columns.
    any: (usize, usize),
}

impl Axis {
    fn add(&mut self, column: usize, is_exact: bool) {
        self.any = (self.any.0 + 1, column);
        if is_exact {
            self.exact = (self.exact.0 + 1, column);
        }
    }

    fn column(self) -> Option<usize> {
        let found = [self.exact, self.any].into_iter().find(|(n, _)| *n == 1);
        found.map(|(_, column)| column)
    }
}

/// The columns that the user wants, by name or by number from 1. Without a header, `names` is `None`.
pub(crate) fn choose(
    wanted: &[String; 3],
    names: Option<&[String]>,
    width: usize,
) -> Result<[usize; 3], String> {
    let mut columns = [0; 3];
    for (column, wanted) in columns.iter_mut().zip(wanted) {
        let all = names.unwrap_or_default().iter();
        let mut named = all.enumerate().filter(|(_, name)| *name == wanted);
        let number = wanted.parse::<usize>().ok();
        let number = number.filter(|n| (1..=width).contains(n));
        *column = match (named.next(), named.next(), number) {
            (Some((at, _)), None, _) => at,
            (None, _, Some(number)) => number - 1,
            (Some(_), Some(_), _) => {
                return Err(format!(
                    "several columns are called '{wanted}'; choose by number"
                ));
            }
            (None, _, None) => {
                return Err(match names {
                    Some(names) => format!("there is no column '{wanted}'; {}", list(names)),
                    None => format!(
                        "there is no column '{wanted}': without a header, columns are numbers from 1 to {width}"
                    ),
                });
            }
        };
    }
    let [x, y, z] = columns;
    if x == y || y == z || z == x {
        return Err(format!(
            "the columns {} are not three different ones",
            wanted.join(",")
        ));
    }
    Ok(columns)
}

/// Problem of a header without coordinates.
pub(crate) fn unrecognized(names: &[String]) -> String {
    format!(
        "the header does not say which columns are x, y and z; {}; choose three by name or number with --columns A,B,C (columns in Python)",
        list(names)
    )
}

/// The columns for a message.
fn list(names: &[String]) -> String {
    const LONGEST: usize = 24;
    let shown = names.iter().take(LONGEST).enumerate();
    let shown: Vec<String> = shown
        .map(|(i, name)| format!("{} {}", i + 1, crate::lines::quoted(name.as_bytes())))
        .collect();
    let more = match names.len() > LONGEST {
        true => format!(" and {} more", names.len() - LONGEST),
        false => String::new(),
    };
    format!("the columns are {}{more}", shown.join(", "))
}

/// Names that are each used once.
#[derive(Default)]
pub(crate) struct UniqueNames {
    /// Number with which the next column of this name is told apart.
    next: HashMap<String, usize>,
}

impl UniqueNames {
    /// `name`, with a number behind it if it is taken or not allowed.
    pub fn add(&mut self, name: &str, is_allowed: impl Fn(&str) -> bool) -> String {
        let mut unique = name.to_string();
        while self.next.contains_key(&unique) || !is_allowed(&unique) {
            let number = self.next.entry(name.into()).or_insert(1);
            *number += 1;
            unique = format!("{name}_{number}");
        }
        self.next.entry(unique.clone()).or_insert(1);
        unique
    }
}
