//! Target, variables and options of a fit from the command line.

use isograd::{Grid, Outliers, PointCloud};
use isograd_fit::{Decay, Optimizer, Options, Points, ShapeParameters, Start, Target, Variables};
use isograd_io::{Attributes, Content, Geometry};
use isograd_shapes::{Sampling, Shape};

use crate::args::{self, Method, TargetKind};
use crate::error::Error;

/// Number of samples from which the bounds of a shape are estimated.
const BOUNDS_SAMPLES: usize = 4000;

/// Inputs of a fit.
pub struct Inputs {
    pub target: Target,
    pub variables: Variables,
    pub options: Options,
}

impl Inputs {
    pub fn read(args: &args::Fit) -> Result<Self, Error> {
        let variables = variables(args)?;
        let target = target(args, &variables)?;
        check_memory(args, target.grid())?;
        Ok(Self {
            target,
            variables,
            options: options(args),
        })
    }
}

fn options(args: &args::Fit) -> Options {
    let steps = args.epochs as usize;
    let optimizer = match args.optimizer {
        Method::Lbfgs => Optimizer::lbfgs(args.rate),
        Method::Adam => Optimizer::adam(
            args.rate,
            match args.decay {
                args::Decay::Constant => Decay::Constant,
                args::Decay::Cosine => Decay::Cosine { steps },
                args::Decay::Exponential => Decay::Exponential {
                    half_life: 0.1 * steps as f64,
                },
            },
        ),
    };
    Options {
        optimizer,
        band: args.band,
        epochs: steps,
        tolerance: args.tolerance,
        backend: args.backend,
        ..Options::default()
    }
}

fn variables(args: &args::Fit) -> Result<Variables, Error> {
    if let Some(path) = &args.points {
        let options = args.reading.options(Attributes::Sensors);
        let geometry = options.read_geometry(path)?;
        let cloud = PointCloud::new(geometry.points).map_err(Error::input(path))?;
        let mut points = Points::new(cloud);
        if let Some(weight) = args.smoothness {
            points.smoothness = weight;
        }
        return Ok(Variables::Points(points));
    }
    // Clap requires one of the two.
    let name = args.shape.as_deref().unwrap_or_default();
    let shape = crate::sample::shape(name, &args.parameters)?;
    let default = ShapeParameters::new(shape.clone());
    Ok(Variables::Shape(ShapeParameters {
        only: only(args, &shape)?,
        samples: args.samples.map_or(default.samples, |n| n as usize),
        seed: args.seed,
        resample: args.resample.map(|epochs| epochs as usize),
        start: args
            .random_start
            .map_or(Start::Given, |spread| Start::Random {
                seed: args.seed,
                spread,
            }),
        ..default
    }))
}

/// The names that match `--only`.
fn only(args: &args::Fit, shape: &Shape) -> Result<Option<Vec<String>>, Error> {
    if args.only.is_empty() {
        return Ok(None);
    }
    let mut names = Vec::new();
    for pattern in &args.only {
        let Some(beginning) = pattern.strip_suffix('*') else {
            names.push(pattern.clone());
            continue;
        };
        let all = shape.parameters().map(|(p, _)| p.name);
        let before = names.len();
        names.extend(
            all.filter(|name| name.starts_with(beginning))
                .map(String::from),
        );
        if names.len() == before {
            return Err(Error::Usage(format!(
                "--only {pattern}: no parameter of {} begins with '{beginning}'; see isograd sample --list",
                shape.name()
            )));
        }
    }
    Ok(Some(names))
}

/// Checks that the grid fits into memory, before anything of its size is allocated.
fn check_memory(args: &args::Fit, grid: &Grid<f64>) -> Result<(), Error> {
    isograd::check_memory(grid).map_err(Error::input(&args.target))
}

fn target(args: &args::Fit, variables: &Variables) -> Result<Target, Error> {
    let path = &args.target;
    let options = match args.points {
        Some(_) => args.reading.memory.options(),
        None => args.reading.options(Attributes::Sensors),
    };
    let content = match args.target_kind {
        TargetKind::Sdf => Content::Field(options.read_field(path)?),
        TargetKind::Mesh => Content::Geometry(options.read_mesh(path)?),
        TargetKind::Cloud => Content::Geometry(options.read_geometry(path)?),
        TargetKind::Auto => options.read(path)?,
    };
    let geometry = match content {
        Content::Field(field) if has_grid(args) => {
            let [nx, ny, nz] = field.field.grid().shape();
            return Err(Error::Usage(format!(
                "{} is a field and brings its grid of {nx} × {ny} × {nz} cells; leave --resolution, --spacing, --padding and --bounds out",
                path.display()
            )));
        }
        Content::Field(field) => return Target::from_sdf(field.field).map_err(Error::input(path)),
        Content::Geometry(geometry) => geometry,
    };
    let as_cloud = args.target_kind == TargetKind::Cloud || geometry.faces.is_empty();
    let outliers = match as_cloud {
        true => args.grid.outliers,
        // Few, far vertices may span large faces.
        false => Outliers::Keep,
    };
    let grid = grid(args, outliers, &geometry, variables)?;
    check_memory(args, &grid)?;
    if as_cloud {
        let cloud = geometry.cloud::<f64>().map_err(Error::input(path))?;
        let options = isograd::Options::default().outliers(outliers);
        Target::from_cloud(&cloud, grid, &options).map_err(Error::input(path))
    } else {
        let mesh = geometry.mesh::<f64>().map_err(Error::input(path))?;
        Target::from_mesh(mesh, grid).map_err(Error::input(path))
    }
}

fn has_grid(args: &args::Fit) -> bool {
    let args::CellArgs {
        resolution,
        spacing,
        padding,
        bounds,
    } = &args.grid.cells;
    resolution.is_some() || spacing.is_some() || padding.is_some() || bounds.is_some()
}

/// The grid of the command line, by default around the target and the start.
fn grid(
    args: &args::Fit,
    outliers: Outliers,
    target: &Geometry,
    variables: &Variables,
) -> Result<Grid<f64>, Error> {
    let path = &args.target;
    let mut points = target.points.clone();
    match variables {
        Variables::Points(start) => points.extend(start.cloud.points()),
        Variables::Shape(parameters) => {
            let shape = parameters.started()?;
            let samples = shape.sample::<f64>(BOUNDS_SAMPLES, &Sampling::default(), args.seed)?;
            points.extend(samples.cloud.points());
        }
    }
    let all = PointCloud::new(points).map_err(Error::input(path))?;
    args.grid
        .cells
        .grid(&all, outliers)
        .map_err(Error::input(path))
}
