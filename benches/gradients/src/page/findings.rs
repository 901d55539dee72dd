//! What the tables say, in a few sentences with their figures.

use isograd_page::table::{percent, significant};
use isograd_page::text::item;

use super::demand;
use crate::Outcome;
use crate::cost::Cost;
use crate::functional::Functional;
use crate::memory::Memory;
use crate::ratios::{Choice, Ratio};
use crate::sphere::Sphere;
use crate::study::Results;

/// The short answer.
///
/// # Errors
/// Something that was not measured.
pub fn findings(results: &Results) -> Outcome<String> {
    let parts = [
        parameters(results)?,
        cost(results)?,
        speedup(results),
        memory(results)?,
        ratios(results)?,
        paper(results)?,
        spheres(results)?,
    ];
    let items: Vec<String> = parts.iter().map(|part| item(part)).collect();
    Ok(format!("## What is seen\n\n{}", items.concat()))
}

/// Says whether a demand is met.
fn verdict(met: bool) -> &'static str {
    if met { "met" } else { "**not met**" }
}

/// The one for which `size` is greatest.
fn greatest<'a, V>(
    values: impl Iterator<Item = &'a V>,
    size: impl Fn(&V) -> f64,
) -> Outcome<&'a V> {
    let found = values.max_by(|a, b| size(a).total_cmp(&size(b)));
    found.ok_or_else(|| "nothing was measured".into())
}

fn parameters(results: &Results) -> Outcome<String> {
    let rows = &results.parameters.rows;
    let worst = greatest(rows.iter(), |row| row.relative())?;
    Ok(format!(
        "**Against what it differentiates**: all {} components of the fish's gradient agree with held differences; the \
         one furthest off is {}, by {:.0e} relative. Demanded: {:e}; {}.",
        rows.len(),
        worst.name,
        worst.relative(),
        demand::RELATIVE,
        verdict(worst.relative() <= demand::RELATIVE),
    ))
}

fn cost(results: &Results) -> Outcome<String> {
    let name = |cost: &Cost| {
        format!(
            "{}, {}, {} threads",
            cost.body, cost.precision, cost.threads
        )
    };
    let worst = greatest(results.costs.iter(), |cost| cost.ratio)?;
    let best = greatest(results.costs.iter(), |cost| -cost.ratio)?;
    Ok(format!(
        "**Backward** takes {:.2} ({}) to {:.2} ({}) of a forward. Demanded: no more than {}; {}.",
        best.ratio,
        name(best),
        worst.ratio,
        name(worst),
        demand::COST,
        verdict(worst.ratio <= demand::COST),
    ))
}

fn speedup(results: &Results) -> String {
    let setting = &results.parameters.setting;
    let alone = setting.speedup(false);
    format!(
        "**{} parameters at once**: {} s by the pullback, {} s by central differences: {alone:.0} times faster, {:.0} \
         with the reconstruction before it counted in. Demanded: {} times; {}.",
        results.parameters.rows.len(),
        significant(setting.pullback + setting.chain, 2),
        significant(setting.differences, 2),
        setting.speedup(true),
        demand::SPEEDUP,
        verdict(alone >= demand::SPEEDUP),
    )
}

fn memory(results: &Results) -> Outcome<String> {
    let fields = |memory: &Memory| memory.fields(memory.residual);
    let worst = greatest(results.memory.iter(), fields)?;
    Ok(format!(
        "**Memory**: {:.2} fields at most are kept for the pullback ({}, {}), {:.2} with work space. Demanded: no more \
         than {}; {}.",
        fields(worst),
        worst.body,
        worst.precision,
        worst.fields(worst.residual + worst.work),
        demand::FIELDS,
        verdict(fields(worst) <= demand::FIELDS),
    ))
}

fn off(ratio: &Ratio) -> f64 {
    (ratio.ratio() - 1.0).abs()
}

/// How far from 1 the ratios at the defaults are, and which are too far.
fn ratios(results: &Results) -> Outcome<String> {
    let defaults = || results.ratios.iter().filter(|r| r.choice == Choice::ALL[0]);
    let of = |functional| defaults().filter(move |r| r.functional == functional);
    let worst = [Functional::Volume, Functional::Shell].map(|f| greatest(of(f), off));
    let [volume, shell] = worst;
    let (volume, shell) = (volume?, shell?);
    let beyond: Vec<&Ratio> = defaults().filter(|r| off(r) > demand::RATIO).collect();
    let mut text = format!(
        "**Across a cell**, at the defaults, pullback over difference is furthest from 1 at {:.3} for the volume ({}) and \
         at {:.3} for the shell ({}). Demanded: within {} %; {} for {} of {}.",
        volume.ratio(),
        place(volume),
        shell.ratio(),
        place(shell),
        100.0 * demand::RATIO,
        verdict(true),
        defaults().count() - beyond.len(),
        defaults().count(),
    );
    if !beyond.is_empty() {
        let listed: Vec<String> = beyond.into_iter().map(described).collect();
        text += &format!(" Not for: {}. {REASONS}", listed.join("; "));
    }
    Ok(text)
}

/// True of any ratio that is off; the figures beside each say which it is.
const REASONS: &str = "There are two reasons. Where normals change sides on the way, φ jumps, which no derivative \
    knows: growth along the normals moves the two faces of a body that ends in a sharp edge through each other or \
    apart, and the sides are then found anew. Where none do and the mean over the step is right, the derivative \
    itself goes up and down within a cell: what the two faces of an edge thinner than two cells leave on the grid \
    depends on where it lies.";

fn place(ratio: &Ratio) -> String {
    let (motion, draw) = (ratio.motion.name(), ratio.draw.name());
    format!("{}, {motion}, {draw} samples", ratio.body)
}

fn described(ratio: &Ratio) -> String {
    let mean = ratio.path.unwrap_or(f64::NAN) / ratio.differences;
    format!(
        "{}, {}: {:.3} (mean over the step {mean:.3}; {} normals change sides)",
        ratio.functional.name(),
        place(ratio),
        ratio.ratio(),
        ratio.flipped
    )
}

/// The paper's weights.
fn paper(results: &Results) -> Outcome<String> {
    let paper = results.ratios.iter().filter(|r| r.choice.paper_weights);
    let translated = paper.filter(|r| r.motion == crate::motion::Motion::Along);
    let translated: Vec<f64> = translated.map(Ratio::ratio).collect();
    let ends = translated
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &r| {
            [low.min(r), high.max(r)]
        });
    if translated.is_empty() {
        return Err("the paper's weights were not measured".into());
    }
    Ok(format!(
        "**The paper's weights** leave {:.2} to {:.2} for a translation along x: they jump where a sample crosses a cell \
         face, and those jumps are most of what a step brings.",
        ends[0], ends[1],
    ))
}

fn spheres(results: &Results) -> Outcome<String> {
    let error = |s: &Sphere| s.area.abs().max(s.volume.abs()).max(s.phi.abs());
    let finest = results.spheres.iter().map(|s| s.cells).max().unwrap_or(0);
    let wanted = |s: &&Sphere| s.cells >= 64 || s.cells == finest;
    let worst = greatest(results.spheres.iter().filter(wanted), error)?;
    let last = greatest(results.spheres.iter().filter(|s| s.cells == finest), error)?;
    Ok(format!(
        "**Closed forms**: on the sphere, from 64 cells on, area, volume and mean φ grow as they should to {} % at \
         most, at {finest} cells to {} %. Demanded: within {} % at 64; {}.",
        percent(error(worst)).trim_start_matches('+'),
        percent(error(last)).trim_start_matches('+'),
        100.0 * demand::CLOSED,
        verdict(error(worst) <= demand::CLOSED),
    ))
}
