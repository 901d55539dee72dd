//! Errors against bodies whose distance is known in closed form.

mod case;
mod exact;
mod measure;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use isograd::{Grid, Pipeline, PointCloud, Reconstructor, Resolution};
use isograd_shapes::{Shape, by_name};
use serde::Serialize;

use crate::output::{Json, Outcome};
use crate::sampling::{Draw, SEED, convert, convert_grid};
use case::{Case, Level, Normals, Precision, Splat};
use exact::Exact;
use measure::{BAND, BINS, Measured, Surface, measure, surface_errors};

/// Free space around the body, in longest sides: the default of the command line.
const PADDING: f64 = 0.1;
/// In a series that keeps the samples per cell, the grid that has [`Study::samples`].
const REFERENCE_CELLS: usize = 128;

/// Smoothing widths that are compared: automatic, and none.
const SMOOTHINGS: [Option<f64>; 2] = [None, Some(0.0)];

/// Combinations of level, smoothing width and screening that are compared.
const LEVELS: [(Level, Option<f64>, f64); 7] = [
    (Level::Mean, Some(0.0), 0.0),
    (Level::Local, None, 0.0),
    (Level::Mean, None, 0.0),
    (Level::Local, Some(0.0), 0.0),
    (Level::Mean, Some(0.0), 1.0),
    (Level::Mean, Some(0.0), 4.0),
    (Level::Local, None, 4.0),
];

/// Extent of the study.
#[derive(Clone, Debug)]
pub struct Study {
    /// Names of the bodies. Options are compared on the first.
    pub bodies: Vec<&'static str>,
    /// Cells on the longest side, ascending.
    pub cells: Vec<usize>,
    /// Samples of a body on every grid.
    pub samples: usize,
}

/// A case and its errors.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The case.
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

/// Results of the study.
#[derive(Clone, Debug)]
pub struct Results {
    /// One for each case, each once.
    pub rows: Vec<Row>,
    /// One for each body and grid.
    pub floors: Vec<Floor>,
}

/// Parameters of a body.
#[derive(Serialize)]
struct BodyParameters {
    body: &'static str,
    parameters: Vec<(&'static str, f64)>,
}

/// Histograms of `|∇φ|` for the default case of a body, in fractions of the cells.
#[derive(Serialize)]
struct Histograms<'a> {
    body: &'static str,
    cells: usize,
    bins: [f64; 2],
    all: &'a [f64],
    near: &'a [f64],
}

impl Study {
    /// The study shown in docs/accuracy.md.
    pub fn full() -> Self {
        Self {
            bodies: vec!["torus", "sphere", "ellipsoid", "box", "nacelle"],
            cells: vec![32, 64, 128, 256],
            samples: 50_000,
        }
    }

    /// Number of samples that keeps the samples per cell: 50,000 at 128 cells.
    fn proportional_samples(&self, cells: usize) -> usize {
        self.samples * cells * cells / (REFERENCE_CELLS * REFERENCE_CELLS)
    }

    /// The body on which options are compared.
    fn first(&self) -> &'static str {
        self.bodies[0]
    }

    /// The default case of `body` on a grid of `cells`.
    fn default_case(&self, body: &'static str, cells: usize) -> Case {
        Case::new(body, self.samples, cells)
    }

    /// The grid of the tables and charts that show one grid only.
    fn middle_cells(&self) -> usize {
        self.cells[self.cells.len() / 2]
    }

    /// The first body with one choice of samples, normals and smoothing.
    fn sampling_case(
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

    /// The first body with exact normals and one choice of the splat.
    fn splat_case(&self, draw: Draw, splat: Splat, area: bool, cells: usize) -> Case {
        Case {
            splat,
            area,
            // Without the local level, which would hide their effect.
            level: Level::Mean,
            smoothing: Some(0.0),
            ..self.sampling_case(draw, Normals::Exact, None, cells)
        }
    }

    /// The first body with random samples, exact normals, and one combination of [`LEVELS`].
    fn level_case(
        &self,
        (level, smoothing, screening): (Level, Option<f64>, f64),
        cells: usize,
    ) -> Case {
        Case {
            level,
            smoothing,
            screening,
            ..self.sampling_case(Draw::Random, Normals::Exact, None, cells)
        }
    }

    /// A body with the same number of samples per cell on every grid.
    fn proportional_case(&self, body: &'static str, draw: Draw, cells: usize) -> Case {
        Case {
            draw,
            ..Case::new(body, self.proportional_samples(cells), cells)
        }
    }

    /// The case whose normals are shown: they do not depend on the grid.
    fn normals_case(&self, body: &'static str, draw: Draw) -> Case {
        Case {
            draw,
            ..self.default_case(body, self.cells[0])
        }
    }

    /// The first body in either number type.
    fn precision_case(&self, precision: Precision) -> Case {
        Case {
            precision,
            ..self.default_case(self.first(), self.middle_cells())
        }
    }

    /// Every case once, sorted by body and grid, which share an exact distance.
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
            cases.extend(LEVELS.map(|level| self.level_case(level, cells)));
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

    /// Measures all cases, with progress on stderr.
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

/// A body and the clouds drawn from it.
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
        // One grid for all clouds, so that they can be compared: that of random samples, so that the grid does not share
        // the symmetries of the body.
        let grid = Grid::fit(
            &convert::<f32>(&self.reference)?,
            Resolution::Cells(cells),
            PADDING as f32,
        )?;
        let exact = Exact::new(&self.shape, convert_grid(&grid)?, BAND)?;
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
                Precision::F64 => self.case::<f64>(case, &exact, convert_grid(&grid)?)?,
            };
            results.rows.push(Row {
                case: *case,
                measured,
            });
        }
        Ok(())
    }

    fn case<T: Pipeline>(
        &mut self,
        case: &Case,
        exact: &Exact,
        grid: Grid<T>,
    ) -> Outcome<Measured> {
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

impl Results {
    /// The results as JSON.
    pub fn json(&self, study: &Study) -> Outcome<String> {
        let (mut bodies, mut histograms) = (Vec::new(), Vec::new());
        let cells = study.middle_cells();
        for &body in &study.bodies {
            let shape = by_name(body)?;
            let parameters = shape.parameters().map(|(p, value)| (p.name, value));
            bodies.push(BodyParameters {
                body,
                parameters: parameters.collect(),
            });
            let field = self.row(&study.default_case(body, cells))?.field.as_ref();
            let field = field.ok_or("the default case has no field")?;
            histograms.push(Histograms {
                body,
                cells,
                bins: [BINS.lower, BINS.upper],
                all: &field.slope_all.shares,
                near: &field.slope_near.shares,
            });
        }
        let json = Json::default().with("bodies", &bodies)?;
        let json = json.with("histograms", &histograms)?;
        let json = json.with("rows", &self.rows)?;
        Ok(json.with("floors", &self.floors)?.text())
    }

    /// Errors of a case.
    fn row(&self, case: &Case) -> Outcome<&Measured> {
        let row = self.rows.iter().find(|row| row.case == *case);
        Ok(&row
            .ok_or_else(|| format!("not measured: {case:?}"))?
            .measured)
    }
}
