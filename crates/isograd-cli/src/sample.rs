//! `isograd sample`: samples a parametric shape.

use isograd::Real;
use isograd_io::CLOUD_EXTENSIONS;
use isograd_shapes::{Density, Sampling, Shape, all, by_name};

use crate::args::{self, Layout, Precision};
use crate::error::Error;
use crate::outputs::check_extension;
use crate::streams::to_stdout;

/// Runs the command.
pub fn run(args: &args::Sample) -> Result<(), Error> {
    if args.list {
        list();
        return Ok(());
    }
    match args.precision {
        Precision::F32 => sample::<f32>(args),
        Precision::F64 => sample::<f64>(args),
    }
}

/// The shape `name` with the parameters of `--param`.
pub(crate) fn shape(name: &str, parameters: &[(String, f64)]) -> Result<Shape, Error> {
    let mut shape = by_name(name)?;
    let values = parameters
        .iter()
        .map(|(name, value)| (name.as_str(), *value));
    shape.set_all(values)?;
    Ok(shape)
}

fn sample<T: Real>(args: &args::Sample) -> Result<(), Error> {
    // Clap requires the three wherever there is no --list.
    let (Some(name), Some(number), Some(output)) = (&args.shape, args.number, &args.output) else {
        return Err(Error::Usage("give SHAPE, -n N and -o CLOUD".into()));
    };
    check_extension(output, CLOUD_EXTENSIONS)?;
    isograd_io::check_output(output, CLOUD_EXTENSIONS)?;
    let shape = shape(name, &args.parameters)?;
    let sampling = Sampling {
        layout: match args.layout {
            Layout::Even => isograd_shapes::Layout::Even,
            Layout::Random => isograd_shapes::Layout::Random,
        },
        density: args
            .density
            .map_or(Density::Uniform, |d| Density::Gradient {
                axis: d.axis,
                ratio: d.ratio,
            }),
    };
    let samples = shape.sample::<T>(number as usize, &sampling, args.seed)?;
    isograd_io::write_cloud(output, &samples.cloud)?;
    if !args.running.quiet {
        to_stdout(&format!("wrote {}", output.display()));
    }
    Ok(())
}

fn list() {
    for shape in all() {
        to_stdout(&format!("{}: {}", shape.name(), shape.summary()));
        list_parameters(&shape);
    }
}

fn list_parameters(shape: &Shape) {
    for (parameter, value) in shape.parameters() {
        let unit = match parameter.unit {
            "" => String::new(),
            unit => format!(" ({unit})"),
        };
        to_stdout(&format!(
            "    {:<14} {:<10} {}{unit}, {} to {}",
            parameter.name, value, parameter.meaning, parameter.min, parameter.max
        ));
    }
}
