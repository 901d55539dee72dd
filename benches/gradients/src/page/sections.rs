//! One section for each question.

use isograd_page::table::{Table, percent, significant};
use isograd_page::text::thousands;

use super::cells;
use crate::body::Draw;
use crate::cost::{self, Cost};
use crate::functional::{Functional, LAYER};
use crate::motion::Motion;
use crate::parameters::OFF;
use crate::ratios::{Choice, Ratio};
use crate::study::Results;

fn head(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.into()).collect()
}

/// The gradient of a fit, component by component.
pub fn parameters(results: &Results) -> String {
    let setting = &results.parameters.setting;
    let mut table = Table::new(
        &["parameter"],
        head(&[
            "pullback",
            "held",
            "relative difference",
            "across a cell",
            "pullback / across",
            "normals that change sides",
        ]),
    );
    for row in &results.parameters.rows {
        table.row(vec![
            row.name.into(),
            significant(row.pullback, 5),
            significant(row.held, 5),
            format!("{:.1e}", row.relative()),
            significant(row.real, 4),
            format!("{:.3}", row.ratio()),
            row.flipped.to_string(),
        ]);
    }
    format!(
        "## A gradient, parameter by parameter

The loss is that of the paper's fit, `L = Σ_o (φ_o − φ̃_o)²` over all cells, with `φ̃` of the default fish and `φ`
of one whose 6 widths and 8 heights are each off by up to {off} %. The samples stay at their surface coordinates. The
pullback gives `∂L/∂x` for each sample, `Shape::pullback` turns that into `∂L/∂p`: one chain, all parameters at once.

![Pullback beside differences for 6 widths and 8 heights](images/gradients-parameters.png)

{table}
Above each pair of bars stands the relative difference of the two. The step of the held differences is
{step:e} cells of the fastest sample; {changed} neighborhoods changed. A component that is small beside the others is
the difference of large parts, and half a cell is a long way for it: `L` is curved. Where normals change sides, at the
edge of the tail fin, `L` also jumps, and no derivative knows of it.
",
        off = 100.0 * OFF,
        step = results.parameters.rows.iter().map(|row| row.held_step).fold(0.0, f64::max),
        changed = results.parameters.rows.iter().map(|row| row.changed).sum::<usize>(),
    ) + &gradient_cost(setting)
}

/// What the whole gradient takes, and what differences take.
fn gradient_cost(setting: &crate::parameters::Setting) -> String {
    let mut table = Table::new(&["gradient of L"], head(&["seconds", "times faster"]));
    let mut row = |name: String, seconds: f64, faster: Option<f64>| {
        let faster = faster.map_or(String::new(), |times| format!("{times:.0}"));
        table.row(vec![name, significant(seconds, 3), faster]);
    };
    let pulled = setting.pullback + setting.chain;
    let differences = format!(
        "central differences: {} reconstructions",
        setting.reconstructions
    );
    row(differences, setting.differences, None);
    row(
        "pullback to the parameters".into(),
        pulled,
        Some(setting.speedup(false)),
    );
    row(
        "… and the reconstruction before it".into(),
        pulled + setting.forward,
        Some(setting.speedup(true)),
    );
    format!(
        "\n{table}\nf64, {} cells, {} samples, {} threads; all in one run.\n",
        cells(setting.shape),
        thousands(setting.samples),
        setting.threads
    )
}

/// Seconds forward and backward.
pub fn cost(results: &Results) -> String {
    let stages: Vec<_> = cost::stages().map(|stage| stage.name()).collect();
    let mut numbers = head(&["threads", "forward, s", "backward, s", "backward / forward"]);
    numbers.extend(stages.iter().map(|stage| format!("{stage}, s")));
    let mut table = Table::new(&["body", "type"], numbers);
    for cost in &results.costs {
        table.row(cost_row(cost));
    }
    format!(
        "## Cost

Forward and backward in turn, in one run; medians. The checks of the forward are left out (they have no pullback),
and the pullback is warm: its memory is there. Every cell of φ has a cotangent. The stages are those of the forward.

![Seconds forward and backward](images/gradients-cost.png)

{table}"
    )
}

fn cost_row(cost: &Cost) -> Vec<String> {
    let body = format!("{}, {}", cost.body, cells(cost.shape));
    let mut row = vec![
        body,
        cost.precision.into(),
        cost.threads.to_string(),
        significant(cost.forward, 3),
        significant(cost.backward, 3),
        format!("{:.2}", cost.ratio),
    ];
    let stages = cost.stages.iter();
    row.extend(stages.map(|(_, seconds)| significant(*seconds, 2)));
    row
}

/// Bytes.
pub fn memory(results: &Results) -> String {
    let columns = [
        "one field",
        "kept",
        "work space",
        "first pullback, peak",
        "later pullbacks, peak",
    ];
    let mut table = Table::new(&["body", "type"], head(&columns));
    let megabytes = |bytes: usize| format!("{:.1} MB", bytes as f64 / 1e6);
    for memory in &results.memory {
        let mut row = vec![
            memory.body.into(),
            memory.precision.into(),
            megabytes(memory.field),
        ];
        let parts = [memory.residual, memory.work, memory.first, memory.later];
        row.extend(
            parts.map(|bytes| format!("{} ({:.2})", megabytes(bytes), memory.fields(bytes))),
        );
        table.row(row);
    }
    format!(
        "## Memory

A **field** is one number for each cell. **Kept** is what a `Reconstruction` holds for its pullback beside φ, the mesh
and the normals (`Reconstruction::residual_bytes`): the indicator, the closest face of each cell, the lattice edge of
each vertex, and what the stages keep of the samples. **Work space** stays with it so that the next call of the plan
need not take it again (`work_bytes`). The peaks are what a pullback takes on top, the first time and with memory used
again. In brackets: fields.

{table}"
    )
}

/// The local derivative over what a step brings.
pub fn ratios(results: &Results) -> String {
    let text = format!(
        "## Across a cell

`F = h³ Σ_o w(x_o) g(φ_o/h)` is a smooth functional of φ, with a weight `w` that is linear in the place and changes
by about as much over half the body along each axis. **Volume**: `g` falls smoothly from 1 inside to 0 outside, over
±{LAYER} cells. **Shell**: `g` is a smooth bump of that width round the surface, the same on both sides, so that only
what changes the area counts. Each figure is the pullback's `dF` over the difference of `F` across a cell: two whole
reconstructions, half a cell to either side. 1 is right.

![Pullback over differences across a cell](images/gradients-ratios.png)

"
    );
    let mut parts = vec![text];
    for functional in Functional::ALL {
        parts.push(format!(
            "### {}\n\n{}",
            capital(functional.name()),
            ratio_table(results, functional)
        ));
    }
    parts.push(format!(
        "### Inside the step\n\nAt the defaults, the mean of the pullbacks at five places of the step over the same \
         difference: what is off\nin one place only is right in the mean, what jumps is not. Beside it: samples whose \
         normal changes sides over\nthe step, and samples whose number of neighbors changes.\n\n{}",
        path_table(results)
    ));
    parts.join("\n")
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// A row for each body, way of drawing samples, and motion; a column for each choice of options.
fn ratio_table(results: &Results, functional: Functional) -> String {
    let columns = Choice::ALL.map(Choice::name);
    let mut table = Table::new(&["body", "samples", "motion"], columns);
    for of_motion in groups(results, functional) {
        let first = of_motion[0];
        let mut row = labels(first);
        for choice in Choice::ALL {
            let found = of_motion.iter().find(|ratio| ratio.choice == choice);
            row.push(found.map_or(String::new(), |ratio| shown(ratio.ratio())));
        }
        table.row(row);
    }
    table.to_string()
}

/// What happens between the ends of the step, at the defaults.
fn path_table(results: &Results) -> String {
    let columns = ["volume", "shell", "change sides", "change neighbors"];
    let mut table = Table::new(&["body", "samples", "motion"], head(&columns));
    let of = |functional| {
        let groups = groups(results, functional);
        groups.into_iter().map(|group| group[0]).collect::<Vec<_>>()
    };
    for (volume, shell) in of(Functional::Volume)
        .into_iter()
        .zip(of(Functional::Shell))
    {
        let mean = |r: &Ratio| {
            r.path
                .map_or(String::new(), |path| shown(path / r.differences))
        };
        let mut row = labels(volume);
        row.extend([mean(volume), mean(shell)]);
        row.extend([volume.flipped, volume.changed].map(thousands));
        table.row(row);
    }
    table.to_string()
}

/// The ratios of a functional, those of one body, draw and motion together, the default options first.
fn groups(results: &Results, functional: Functional) -> Vec<Vec<&Ratio>> {
    let mut groups = Vec::new();
    let mut bodies: Vec<&str> = results.ratios.iter().map(|ratio| ratio.body).collect();
    bodies.dedup();
    for body in bodies {
        for (draw, motion) in Draw::ALL
            .into_iter()
            .flat_map(|draw| Motion::ALL.map(|motion| (draw, motion)))
        {
            let belongs = |r: &&Ratio| {
                r.body == body && r.draw == draw && r.motion == motion && r.functional == functional
            };
            let group: Vec<_> = results.ratios.iter().filter(belongs).collect();
            if !group.is_empty() {
                groups.push(group);
            }
        }
    }
    groups
}

fn labels(ratio: &Ratio) -> Vec<String> {
    [ratio.body, ratio.draw.name(), ratio.motion.name()]
        .map(String::from)
        .into()
}

fn shown(ratio: f64) -> String {
    format!("{ratio:.3}").replace('-', "−")
}

/// Closed forms.
pub fn spheres(results: &Results) -> String {
    let columns = ["cells", "d(area)/dr, %", "d(volume)/dr, %", "mean dφ/dr, %"];
    let mut table = Table::new(&["samples"], head(&columns));
    for sphere in &results.spheres {
        table.row(vec![
            format!("{} {}", thousands(sphere.samples), sphere.draw.name()),
            sphere.cells.to_string(),
            percent(sphere.area),
            percent(sphere.volume),
            percent(sphere.phi),
        ]);
    }
    format!(
        "## A sphere that grows

All samples of a sphere of radius ½ move outward along the exact normals. `d(area)/dr = 8πr` and
`d(volume)/dr = 4πr²` are pulled back from the mesh, `dφ/dr = −1` from the mean of φ over all cells. Relative errors, in
percent, with as many samples per cell on every grid.

{table}"
    )
}
