//! Writes `fish.ply`, 20,000 even samples of the default fish, points alone, into the current folder or
//! the one named:
//! `cargo run --release -p isograd-shapes --example make_clouds examples/clouds`

use std::error::Error;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use isograd_shapes::{Sampling, by_name};

fn main() -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = std::env::args().nth(1).unwrap_or(".".into()).into();
    std::fs::create_dir_all(&folder)?;
    let samples = by_name("fish")?.sample::<f32>(20_000, &Sampling::default(), 0)?;
    let mut file = BufWriter::new(std::fs::File::create(folder.join("fish.ply"))?);
    let count = samples.cloud.len();
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex {count}\n"
    )?;
    write!(
        file,
        "property float x\nproperty float y\nproperty float z\nend_header\n"
    )?;
    for coordinate in samples.cloud.points().iter().flatten() {
        file.write_all(&coordinate.to_le_bytes())?;
    }
    Ok(file.flush()?)
}
