//! Options of the readers: limits, chosen columns, attributes.

use isograd::PointCloud;
use isograd::data::Attribute;
use isograd_io::{Attributes, Columns, Format, Geometry, Limits, ReadOptions, parse_size};

use crate::files::{self, source};

fn limited(memory: u64) -> ReadOptions {
    ReadOptions {
        limits: Limits {
            memory: Some(memory),
        },
        ..ReadOptions::default()
    }
}

#[test]
fn every_reader_keeps_within_a_given_limit() {
    for (name, format, bytes) in files::valid_files() {
        let size = bytes.len() as u64;
        let source = source(&name, bytes);
        let parse = |memory: u64| {
            let options = limited(memory);
            match name.starts_with("sdf") {
                true => options.parse_field(&source, format).map(drop),
                false => options.parse_geometry(&source, format).map(drop),
            }
        };
        let message = parse(size + 16).expect_err(&name).to_string();
        let limit = format!("the limit is {}", size + 16);
        for part in [name.as_str(), "at least", "--max-memory"] {
            assert!(message.contains(part), "{message}");
        }
        assert!(size + 16 >= 1024 || message.contains(&limit), "{message}");
        // Buffers for a few numbers are of a constant size.
        parse(16 * size + (32 << 10)).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn a_file_larger_than_the_limit_is_not_read() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("a.obj");
    std::fs::write(&path, files::OBJ).expect("writes");
    let error = limited(files::OBJ.len() as u64 - 1).read_geometry(&path);
    let message = error.expect_err("too large").to_string();
    assert!(message.contains("the limit is 146 bytes"), "{message}");
    assert!(limited(1 << 20).read(&path).is_ok());
}

#[test]
fn sizes_have_units() {
    for (text, bytes) in [
        ("1000", 1000),
        ("512M", 512 << 20),
        ("4g", 4 << 30),
        ("1.5 GiB", 3 << 29),
        ("64KB", 64 << 10),
        ("2T", 2 << 40),
    ] {
        assert_eq!(parse_size(text), Ok(bytes), "{text}");
    }
    for text in [
        "",
        "M",
        "-1",
        "0",
        "1e3",
        "12X",
        "nan",
        "1..5G",
        "9999999999T",
    ] {
        let message = parse_size(text).expect_err(text);
        assert!(message.contains("512M"), "{message}");
    }
}

fn choose(points: [&str; 3], normals: Option<[&str; 3]>, text: &str) -> Result<Geometry, String> {
    let options = ReadOptions {
        columns: Columns {
            points: Some(points.map(String::from)),
            normals: normals.map(|normals| normals.map(String::from)),
        },
        ..ReadOptions::default()
    };
    let file = options.parse_geometry(&source("file.csv", text), Format::Text);
    file.map_err(|e| e.to_string())
}

#[test]
fn columns_are_chosen_by_name_or_number() {
    let text = "t,lon,lat,depth,u,v,w\n9,1,2,3,0,0,1\n";
    for points in [
        ["lon", "lat", "depth"],
        ["2", "3", "4"],
        ["lon", "3", "depth"],
    ] {
        let file = choose(points, Some(["u", "v", "7"]), text).expect("valid");
        assert_eq!(file.points, [[1.0, 2.0, 3.0]]);
        assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]]));
        assert_eq!(file.attributes.len(), 1);
    }
    // A header that names coordinates is overruled, and a file may have none.
    let file = choose(["3", "2", "1"], None, "x,y,z\n3,2,1\n").expect("valid");
    assert_eq!(file.points, [[1.0, 2.0, 3.0]]);
    let file = choose(["2", "3", "4"], None, "9 1 2 3 0 0\n").expect("valid");
    assert_eq!((file.points, file.normals), (vec![[1.0, 2.0, 3.0]], None));
    for (points, part) in [
        (
            ["lon", "lat", "height"],
            "no column 'height'; the columns are 1 't', 2 'lon'",
        ),
        (["lon", "lat", "8"], "no column '8'"),
        (["lon", "lat", "0"], "no column '0'"),
        (["lon", "lat", "2"], "three different ones"),
    ] {
        let message = choose(points, None, text).expect_err(part);
        assert!(message.contains(part), "{message}");
    }
    let message = choose(["a", "b", "c"], None, "1 2 3\n").expect_err("no header");
    assert!(message.contains("numbers from 1 to 3"), "{message}");
    let twice = "a,a,b,c\n1,2,3,4\n";
    let message = choose(["a", "b", "c"], None, twice).expect_err("twice");
    assert!(
        message.contains("several columns are called 'a'"),
        "{message}"
    );
}

#[test]
fn columns_of_other_formats_are_not_chosen() {
    let options = ReadOptions {
        columns: Columns {
            points: None,
            normals: Some(["1", "2", "3"].map(String::from)),
        },
        ..ReadOptions::default()
    };
    let error = options.parse_geometry(&source("a.ply", files::ASCII_PLY), Format::Ply);
    let message = error.expect_err("refused").to_string();
    assert!(
        message.contains("a.ply") && message.contains("this is PLY"),
        "{message}"
    );
}

#[test]
fn attributes_can_be_left_out_but_for_sensors() {
    let names = ["heat", "sensor_x", "sensor_y", "sensor_z"];
    let cloud = names.iter().fold(
        PointCloud::<f64>::new(vec![[1.0, 2.0, 3.0]]).expect("finite"),
        |cloud, name| {
            let attribute = Attribute {
                name: (*name).into(),
                components: 1,
                values: vec![4.0],
            };
            cloud.with_attribute(attribute).expect("right length")
        },
    );
    let options = ReadOptions {
        attributes: Attributes::Sensors,
        ..ReadOptions::default()
    };
    for name in ["a.ply", "a.npz", "a.csv", "a.xyz", "a.pcd"] {
        let bytes = files::written(name, |path| isograd_io::write_cloud(path, &cloud));
        let format = Format::from_path(name.as_ref()).expect("known");
        let file = options.parse_geometry(&source(name, bytes), format);
        let file = file.expect("valid");
        assert_eq!(file.attributes.len(), 3, "{name}");
        assert!(file.cloud::<f64>().expect("valid").sensors().is_some());
    }
    let vtp = source("a.vtp", files::ASCII_VTP);
    let file = options.parse_geometry(&vtp, Format::Vtp).expect("valid");
    assert!(file.attributes.is_empty() && file.normals.is_some());
}

#[test]
fn more_columns_than_readers_accept_are_not_written() {
    let attribute = Attribute {
        name: "a".into(),
        components: 5000,
        values: vec![0.0; 5000],
    };
    let cloud = PointCloud::<f32>::new(vec![[0.0; 3]]).expect("finite");
    let cloud = cloud.with_attribute(attribute).expect("right length");
    let folder = tempfile::tempdir().expect("temporary folder");
    for name in ["a.ply", "a.csv", "a.pcd"] {
        let error = isograd_io::write_cloud(&folder.path().join(name), &cloud);
        let message = error.expect_err(name).to_string();
        assert!(
            message.contains("5003 columns, more than the 4096"),
            "{message}"
        );
    }
    let path = folder.path().join("a.npz");
    isograd_io::write_cloud(&path, &cloud).expect("writes");
    let file = isograd_io::read_geometry(&path).expect("reads");
    assert_eq!(file.attributes[0].components, 5000);
}
