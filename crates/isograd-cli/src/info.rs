//! `isograd info`: description of a file.

use isograd::differential::{EikonalOptions, Spread, eikonal};
use isograd::isosurface::measure;
use isograd_io::{Attributes, Content, FieldFile, Geometry};

use crate::args;
use crate::error::Error;
use crate::streams::to_stdout;

/// Runs the command.
pub fn run(args: &args::Info) -> Result<(), Error> {
    match args.reading.options(Attributes::All).read(&args.file)? {
        Content::Geometry(geometry) => describe_geometry(args, &geometry),
        Content::Field(field) => {
            describe_field(&field);
            Ok(())
        }
    }
}

fn line(name: &str, text: impl std::fmt::Display) {
    to_stdout(&format!("{name:<12} {text}"));
}

fn describe_geometry(args: &args::Info, geometry: &Geometry) -> Result<(), Error> {
    let cloud = geometry.cloud::<f64>().map_err(Error::input(&args.file))?;
    line("format", geometry.format.name());
    line("stored as", geometry.dtype.name());
    line("points", cloud.len());
    if let Some((low, high)) = cloud.bounds() {
        line("bounds", format!("{low:?} to {high:?}"));
    }
    line(
        "normals",
        if cloud.normals().is_some() {
            "yes"
        } else {
            "no"
        },
    );
    for attribute in cloud.attributes() {
        let components = match attribute.components {
            1 => String::new(),
            n => format!(", {n} components"),
        };
        line("attribute", format!("{}{components}", attribute.name));
    }
    if geometry.faces.is_empty() {
        return Ok(());
    }
    let mesh = geometry.mesh::<f64>().map_err(Error::input(&args.file))?;
    let measures = measure::measure(&mesh, &mut measure::Scratch::default());
    line("faces", measures.faces);
    line("closed", if measures.closed { "yes" } else { "no" });
    line("components", measures.components);
    line("euler", measures.euler);
    line("area", measures.area);
    line("volume", measures.volume);
    Ok(())
}

fn describe_field(file: &FieldFile) {
    let grid = file.field.grid();
    let [nx, ny, nz] = grid.shape();
    line("format", file.format.name());
    line("stored as", file.dtype.name());
    line("cells", format!("{nx} × {ny} × {nz}"));
    line("origin", format!("{:?}", grid.origin()));
    line("spacing", grid.spacing());
    line(
        "bounds",
        format!("{:?} to {:?}", grid.lower(), grid.upper()),
    );
    let values = file.field.values().iter();
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
        (low.min(v), high.max(v))
    });
    line("values", format!("{low} to {high}"));
    let eikonal = eikonal(&file.field, &EikonalOptions::default());
    let spread = |s: &Spread| format!("mean {:.4}, 5 % {:.4}, 95 % {:.4}", s.mean, s.p05, s.p95);
    if let Some(all) = &eikonal.all {
        line("|∇φ|", spread(all));
    }
    if let Some(near) = &eikonal.near {
        line("|∇φ| near", spread(near));
    }
}
