//! Which cases are measured, and the measuring of them.

use std::collections::HashMap;

use isograd::{Grid, PointCloud, Real, Reconstructor, Resolution};
use isograd_element::vector;
use isograd_shapes::{Shape, by_name};
use serde::Serialize;

use crate::Outcome;
use crate::case::{Case, Draw, Level, Normals, Precision, Splat};
use crate::exact::{Exact, widened};
use crate::measure::{BAND, Measured, Surface, measure, surface_errors};

/// Every cloud is drawn with this seed.
const SEED: u64 = 1;
/// Free space round the body, in longest sides: the default of the command line.
const PADDING: f64 = 0.1;
/// On finer grids than this, in a series that keeps the samples per cell, there are more samples.
const REFERENCE_CELLS: usize = 128;

/// Widths of the smoothing that are compared: none, and automatic.
pub const SMOOTHINGS: [Option<f64>; 2] = [None, Some(0.0)];

/// A way to the level of the surface.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Local or not.
    pub level: Level,
    /// Width of the smoothing, in cells.
    pub smoothing: Option<f64>,
    /// `α`.
    pub screening: f64,
}

/// The ways that are compared: the plain one first, the default second.
pub const WAYS: [Way; 7] = [
    way(Level::Mean, Some(0.0), 0.0),
    way(Level::Local, None, 0.0),
    way(Level::Mean, None, 0.0),
    way(Level::Local, Some(0.0), 0.0),
    way(Level::Mean, Some(0.0), 1.0),
    way(Level::Mean, Some(0.0), 4.0),
    way(Level::Local, None, 4.0),
];

const fn way(level: Level, smoothing: Option<f64>, screening: f64) -> Way {
    Way {
        level,
        smoothing,
        screening,
    }
}

/// How much is measured.
#[derive(Clone, Debug)]
pub struct Study {
    /// Bodies, by name; the first is the one that options are compared on.
    pub bodies: Vec<&'static str>,
    /// Cells on the longest side, growing.
    pub cells: Vec<usize>,
    /// Samples of a body, whatever the grid.
    pub samples: usize,
}

/// One case and what came out.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What was reconstructed.
    #[serde(flatten)]
    pub case: Case,
    /// Its errors.
    #[serde(flatten)]
    pub measured: Measured,
}

/// Marching cubes of the exact distance.
#[derive(Clone, Debug, Serialize)]
pub struct Floor {
    /// Name of the body.
    pub body: &'static str,
    /// Cells on the longest side.
    pub cells: usize,
    /// Cell size, in the body's unit.
    pub cell: f64,
    /// Errors of the surface.
    pub surface: Surface,
}

/// All results.
#[derive(Clone, Debug, Serialize)]
pub struct Results {
    /// One for each case, each once.
    pub rows: Vec<Row>,
    /// One for each body and grid.
    pub floors: Vec<Floor>,
}

impl Study {
    /// What the page is made of.
    pub fn full() -> Self {
        Self {
            bodies: vec!["torus", "sphere", "ellipsoid", "box", "nacelle"],
            cells: vec![32, 64, 128, 256],
            samples: 50_000,
        }
    }

    /// Samples on a grid of `cells` such that a cell always gets as many: 50,000 at 128 cells.
    pub fn proportional_samples(&self, cells: usize) -> usize {
        self.samples * cells * cells / (REFERENCE_CELLS * REFERENCE_CELLS)
    }

    /// The body that options are compared on.
    pub fn first(&self) -> &'static str {
        self.bodies[0]
    }

    /// The case of `body` on a grid of `cells`, all at its default.
    pub fn default_case(&self, body: &'static str, cells: usize) -> Case {
        Case::new(body, self.samples, cells)
    }

    /// The grid of what is shown on one grid only.
    pub fn middle_cells(&self) -> usize {
        self.cells[self.cells.len() / 2]
    }

    /// The first body with samples drawn and normals found in every way, on every grid.
    pub fn sampling_case(
        &self,
        draw: Draw,
        normals: Normals,
        smoothing: Option<f64>,
        cells: usize,
    ) -> Case {
        Case {
            draw,
            normals,
            smoothing,
            ..self.default_case(self.first(), cells)
        }
    }

    /// The first body with exact normals and every choice of the splat.
    pub fn splat_case(&self, draw: Draw, splat: Splat, area_weights: bool, cells: usize) -> Case {
        Case {
            splat,
            area_weights,
            // The weights alone: a local level would mend what they do.
            level: Level::Mean,
            smoothing: Some(0.0),
            ..self.sampling_case(draw, Normals::Exact, None, cells)
        }
    }

    /// The first body with random samples, exact normals, and one way to the level.
    pub fn level_case(&self, way: &Way, cells: usize) -> Case {
        Case {
            level: way.level,
            smoothing: way.smoothing,
            screening: way.screening,
            ..self.sampling_case(Draw::Random, Normals::Exact, None, cells)
        }
    }

    /// A body with as many samples per cell on every grid.
    pub fn proportional_case(&self, body: &'static str, draw: Draw, cells: usize) -> Case {
        Case {
            draw,
            ..Case::new(body, self.proportional_samples(cells), cells)
        }
    }

    /// The normals of every body for every way of drawing samples, on one grid: they do not depend on it.
    pub fn normals_case(&self, body: &'static str, draw: Draw) -> Case {
        Case {
            draw,
            ..self.default_case(body, self.cells[0])
        }
    }

    /// The first body in either number type.
    pub fn precision_case(&self, precision: Precision) -> Case {
        Case {
            precision,
            ..self.default_case(self.first(), self.middle_cells())
        }
    }

    /// Every case, each once, in an order in which those that share an exact distance stand together.
    fn cases(&self) -> Vec<Case> {
        let mut cases = vec![self.precision_case(Precision::F64)];
        for &cells in &self.cells {
            for &body in &self.bodies {
                cases.push(self.default_case(body, cells));
                cases.push(self.proportional_case(body, Draw::Random, cells));
            }
            for draw in Draw::ALL {
                for normals in [Normals::Exact, Normals::Estimated] {
                    cases.extend(SMOOTHINGS.map(|s| self.sampling_case(draw, normals, s, cells)));
                }
                for splat in Splat::ALL {
                    cases.extend(
                        [true, false].map(|area| self.splat_case(draw, splat, area, cells)),
                    );
                }
            }
            cases.extend(WAYS.iter().map(|way| self.level_case(way, cells)));
            cases.push(self.proportional_case(self.first(), Draw::Even, cells));
        }
        for &body in &self.bodies {
            cases.extend(Draw::ALL.map(|draw| self.normals_case(body, draw)));
        }
        let place = |case: &Case| self.bodies.iter().position(|&body| body == case.body);
        cases.sort_by_key(|case| (place(case), case.cells));
        let mut unique: Vec<Case> = Vec::new();
        for case in cases {
            if !unique.contains(&case) {
                unique.push(case);
            }
        }
        unique
    }

    /// Measures everything; says on stderr where it is.
    ///
    /// # Errors
    /// The first case that fails.
    pub fn run(&self) -> Outcome<Results> {
        let mut results = Results {
            rows: Vec::new(),
            floors: Vec::new(),
        };
        let cases = self.cases();
        for of_body in cases.chunk_by(|a, b| a.body == b.body) {
            let mut bench = Bench::new(of_body[0].body, self.samples)?;
            for on_grid in of_body.chunk_by(|a, b| a.cells == b.cells) {
                let (body, cells) = (on_grid[0].body, on_grid[0].cells);
                eprintln!("{body}, {cells} cells: {} cases", on_grid.len());
                bench.measure(on_grid, &mut results)?;
            }
        }
        Ok(results)
    }
}

/// One body with the clouds that were drawn from it.
struct Bench {
    shape: Shape,
    reference: PointCloud<f64>,
    clouds: HashMap<(Draw, usize), PointCloud<f64>>,
}

impl Bench {
    fn new(body: &str, samples: usize) -> Outcome<Self> {
        let shape = by_name(body)?;
        let reference = shape.sample(samples, &Draw::Random.sampling(), SEED)?.cloud;
        Ok(Self {
            shape,
            reference,
            clouds: HashMap::new(),
        })
    }

    /// Cases on one grid, and marching cubes of the exact distance there.
    fn measure(&mut self, cases: &[Case], results: &mut Results) -> Outcome {
        let Some(Case { body, cells, .. }) = cases.first().copied() else {
            return Ok(());
        };
        // One grid for all clouds, so that they can be compared; that of a cloud of random samples, so
        // that no symmetry of the body is one of the grid.
        let grid = Grid::fit(
            &convert::<f32>(&self.reference)?,
            Resolution::Cells(cells),
            PADDING as f32,
        )?;
        let exact = Exact::new(&self.shape, widened(&grid)?, BAND)?;
        let cell = f64::from(grid.spacing());
        let surface = surface_errors(&exact.mesh()?, &self.shape, cell);
        results.floors.push(Floor {
            body,
            cells,
            cell,
            surface,
        });
        for case in cases {
            let measured = match case.precision {
                Precision::F32 => self.case(case, &exact, grid)?,
                Precision::F64 => self.case(case, &exact, widened(&grid)?)?,
            };
            results.rows.push(Row {
                case: *case,
                measured,
            });
        }
        Ok(())
    }

    fn case<T: Real>(&mut self, case: &Case, exact: &Exact, grid: Grid<T>) -> Outcome<Measured> {
        let cloud = convert(self.cloud(case.draw, case.samples)?)?;
        let mut plan = Reconstructor::new(grid, case.options(grid.spacing().f64()))?;
        measure(case, &self.shape, exact, &mut plan, &cloud)
            .map_err(|e| format!("{case:?}: {e}").into())
    }

    fn cloud(&mut self, draw: Draw, samples: usize) -> Outcome<&PointCloud<f64>> {
        if !self.clouds.contains_key(&(draw, samples)) {
            let cloud = self.shape.sample(samples, &draw.sampling(), SEED)?.cloud;
            self.clouds.insert((draw, samples), cloud);
        }
        Ok(&self.clouds[&(draw, samples)])
    }
}

/// The same cloud in another number type.
fn convert<T: Real>(cloud: &PointCloud<f64>) -> Outcome<PointCloud<T>> {
    let cast = |vectors: &[[f64; 3]]| vectors.iter().map(|&v| vector::of_f64(v)).collect();
    let points = PointCloud::new(cast(cloud.points()))?;
    Ok(match cloud.normals() {
        Some(normals) => points.with_normals(cast(normals))?,
        None => points,
    })
}

impl Results {
    /// What was measured of a case.
    ///
    /// # Errors
    /// A case that is not part of the study.
    pub fn row(&self, case: &Case) -> Outcome<&Measured> {
        let row = self.rows.iter().find(|row| row.case == *case);
        Ok(&row
            .ok_or_else(|| format!("not measured: {case:?}"))?
            .measured)
    }

    /// Marching cubes of the exact distance.
    ///
    /// # Errors
    /// A body or a grid that is not part of the study.
    pub fn floor(&self, body: &str, cells: usize) -> Outcome<&Floor> {
        let floor = self
            .floors
            .iter()
            .find(|floor| floor.body == body && floor.cells == cells);
        floor.ok_or_else(|| format!("not measured: {body} at {cells} cells").into())
    }
}
