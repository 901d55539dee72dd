//! Clouds with attributes of any name and number, written and read back.

use isograd::data::Attribute;
use isograd::{PointCloud, Real};
use isograd_io::{Content, Geometry};

use crate::mutations::Random;

/// Pieces of names, among them what readers treat in a special way.
const PIECES: &[&str] = &[
    "",
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "X",
    "NX",
    "x [m]",
    "points",
    "normals",
    "Points:0",
    "Normals",
    "normal_x",
    "sdf",
    "origin",
    "spacing",
    "sensor",
    "easting",
    "nan",
    "inf",
    "1",
    "-2.5e3",
    "1e5",
    "_",
    "__",
    "é",
    "温度",
    "°C",
    "\"",
    "'",
    ",",
    ";",
    "\n",
    "\r",
    "\t",
    " ",
    "#",
    "//",
    "/",
    "\\",
    "..",
    ".npy",
    "a.npy",
    "\0",
    "%",
    "{}",
    ":0",
    "end_header",
    "vertex_indices",
    "a",
    "A",
    "b",
    "long",
];

fn name(random: &mut Random) -> String {
    let pieces = random.below(4);
    let mut name: String = (0..pieces)
        .map(|_| PIECES[random.below(PIECES.len())])
        .collect();
    if random.below(20) == 0 {
        name = name.repeat(1 + random.below(200));
    }
    name
}

fn value<T: Real>(random: &mut Random) -> T {
    T::of(match random.below(8) {
        0 => f64::NAN,
        1 => f64::NEG_INFINITY,
        2 => -0.0,
        3 => random.below(256) as f64,
        _ => random.below(1 << 20) as f64 / 77.0 - 5000.0,
    })
}

fn cloud<T: Real>(random: &mut Random) -> PointCloud<T> {
    let count = random.below(4);
    let rows = |random: &mut Random| -> Vec<[T; 3]> {
        let number = |random: &mut Random| T::of(random.below(1 << 20) as f64 / 77.0 - 5000.0);
        (0..count)
            .map(|_| std::array::from_fn(|_| number(random)))
            .collect()
    };
    let mut cloud = PointCloud::new(rows(random)).expect("finite");
    if random.below(2) == 0 {
        cloud = cloud.with_normals(rows(random)).expect("finite");
    }
    for _ in 0..random.below(5) {
        let components = [1, 1, 2, 3, 70][random.below(5)];
        let attribute = Attribute {
            name: name(random),
            components,
            values: (0..count * components).map(|_| value(random)).collect(),
        };
        cloud = cloud.with_attribute(attribute).expect("right length");
    }
    cloud
}

/// Bits of each column; NaN has many.
fn columns<T: Real>(attributes: &[Attribute<T>], rows: usize) -> Vec<Vec<Option<u64>>> {
    let bits = |value: &T| (!value.f64().is_nan()).then(|| value.f64().to_bits());
    let column = |a: &Attribute<T>, c: usize| {
        let values = a.values.iter().skip(c).step_by(a.components);
        values.take(rows).map(bits).collect()
    };
    let columns = attributes
        .iter()
        .map(|a| (0..a.components).map(move |c| (a, c)));
    columns.flatten().map(|(a, c)| column(a, c)).collect()
}

fn round_trip<T: Real>(path: &std::path::Path, cloud: &PointCloud<T>) -> Result<(), String> {
    isograd_io::write_cloud(path, cloud).map_err(|e| format!("not written: {e}"))?;
    let content = isograd_io::read(path).map_err(|e| format!("not read: {e}"))?;
    let Content::Geometry(file) = content else {
        return Err("read as a field".into());
    };
    let bits = |rows: &[[T; 3]]| -> Vec<[u64; 3]> {
        rows.iter().map(|r| r.map(|x| x.f64().to_bits())).collect()
    };
    let read = |rows: &[[f64; 3]]| -> Vec<[T; 3]> { rows.iter().map(|r| r.map(T::of)).collect() };
    if bits(&read(&file.points)) != bits(cloud.points()) {
        return Err("the points differ".into());
    }
    if file.normals.as_deref().map(|n| bits(&read(n))) != cloud.normals().map(bits) {
        return Err(format!(
            "the normals differ: {:?}, {:?}",
            file.normals,
            cloud.normals()
        ));
    }
    let attributes: Vec<Attribute<T>> = file.attributes.iter().map(narrow).collect();
    let (new, old) = (
        columns(&attributes, cloud.len()),
        columns(cloud.attributes(), cloud.len()),
    );
    if new != old {
        return Err(format!(
            "{} columns of attributes became {}",
            old.len(),
            new.len()
        ));
    }
    unique_names(&file)
}

fn narrow<T: Real>(attribute: &Attribute<f64>) -> Attribute<T> {
    Attribute {
        name: attribute.name.clone(),
        components: attribute.components,
        values: attribute.values.iter().map(|&v| T::of(v)).collect(),
    }
}

fn unique_names(file: &Geometry) -> Result<(), String> {
    let mut names: Vec<&str> = file.attributes.iter().map(|a| a.name.as_str()).collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    match names.len() == count {
        true => Ok(()),
        false => Err(format!("names occur twice: {names:?}")),
    }
}

#[test]
fn every_cloud_that_is_written_can_be_read_again() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let mut failed = Vec::new();
    for seed in 1..=400u64 {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let single: PointCloud<f32> = cloud(&mut random);
        let double: PointCloud<f64> = cloud(&mut random);
        for extension in isograd_io::CLOUD_EXTENSIONS {
            let path = folder.path().join("cloud").with_extension(extension);
            let results = [round_trip(&path, &single), round_trip(&path, &double)];
            for problem in results.into_iter().filter_map(Result::err) {
                failed.push(format!("seed {seed}, {extension}: {problem}"));
            }
        }
    }
    assert!(
        failed.is_empty(),
        "{} failed:\n{}",
        failed.len(),
        failed.join("\n")
    );
}
