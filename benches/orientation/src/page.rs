//! The page.

use isograd_page::statistics::median;
use isograd_page::table::{Table, significant};
use isograd_page::text::thousands;

use crate::study::{Results, Row, Step};
use crate::suite::Family;

const HEAD: &str = "\
<!-- Written by `cargo xtask orientation`. Do not edit: change benches/orientation. -->
# Orientation: which side is outside

The direction of a normal is computed; its *side* is chosen. One patch on the wrong side ruins φ, so this page says how
isograd chooses, how often it is wrong, and what to do where it can't know.

`cargo xtask orientation` measures everything again and writes this page. A sign counts as wrong where the normal is
more than 120° from the truth; where its axis is more than 60° off either way, there is no right sign, and none is
judged.

![Samples of five clouds by what became of their signs](images/orientation.png)

";

const CHOICE: &str = "\
## What to choose

| you have | choose | why |
|---|---|---|
| points | `auto`, the default | nothing to set; every point gets a confidence, and a doubtful one a reason |
| normals that are right | `given` | nothing is guessed |
| normals whose side is right, but not their direction (from a mesh, or with noise) | `signs` | directions from the points, sides from the normals |
| where the points were seen from | `sensors` | a surface is seen from outside: only grazing views are left to `auto` |
| a body that moves, step by step | `previous`, in a plan | the sides of the step before; a small share of the time of `auto` |
| the paper, to compare | `parity` | as printed, with its hyperparameters |

`isograd orient CLOUD -o OUT.ply` does this alone: the same points with `nx ny nz confidence`. In Python it is
`isograd.orient(points)`.

## How `auto` works

";

const METHOD: &str = "\
Where samples scatter, from noise or because they lie on both sides of a thin body, the axis is that of a wider
neighborhood, as far as that is smoother. Then five kinds of evidence are summed for each point, from −1 (the axis
points inward) to 1 (outward):

- *Enclosure.* The samples are drawn on a grid as discs in their tangent planes. What they close off from the outside is
  matter, a cavity inside matter is air again, and so on. Two grids of different cells look at this.
- *Sky.* Where the samples leave holes, the side of the surface that sees less of the sky, along 26 directions, is the
  inner one.
- *Sheets.* Where neighbors lie on several sheets, a robust fit tells the one through the sample from the others. A
  parallel sheet less than a few spacings away is the other side of a thin body, or of a narrow gap.
- *Height.* Where noise has made one layer of the two sides of a thin body, with air on both sides of it, a sample above
  the middle of the layer belongs to the upper side.
- *Neighbors.* Two axes next to each other hang together, reflected at the plane half-way between their samples: along a
  sheet, round an edge, and across a thin body or a narrow gap.

What a point knows spreads over the graph of its neighbors. Points that agree make domains; between domains that
contradict each other the *winding number* decides: the right signs are those with which it is ½ on the surface. A thin
body and a narrow gap look alike from near; where that matters, both readings are tried, and the winding number chooses.
Far parts of a cloud get grids of their own, so that an outlier makes none of them coarse. Time and memory are bounded by
the number of points; the bits are the same for any number of threads.

";

const DOUBT: &str = "\
## Doubt

The confidence of a point, from 0 to 1, says how clearly the evidence round it speaks for its sign. Below 0.1 a sign is
*doubtful*, and has a reason:

| reason | what its nearest samples look like | what helps |
|---|---|---|
| thin | two sheets, less than about three spacings apart | more samples there |
| sparse | twice as far apart as elsewhere: a sparse part, or outliers | more samples there, or fewer outliers |
| open | a rim or a hole among them | closing it |
| noisy | they scatter about the surface by a third of their spacing | less noise |
| unexplained | none of these | |

Sensors or normals help against all of them. The report has the shares, and the warning names the largest.

";

/// The whole page.
pub fn page(results: &Results) -> String {
    let mut page = [HEAD, CHOICE, METHOD].concat();
    page += &summary(results);
    for family in Family::ALL {
        let rows: Vec<&Row> = results.rows.iter().filter(|r| r.family == family).collect();
        if !rows.is_empty() {
            page += &format!("### {}\n\n{}\n", title(family), table(&rows));
        }
    }
    page + DOUBT + &moving(&results.steps)
}

fn title(family: Family) -> &'static str {
    match family {
        Family::Real => "Real shapes",
        Family::Sampled => "Bodies, sampled in several ways",
        Family::Degraded => "Holes, noise and outliers",
        Family::Thin => "Sheets close to each other",
        Family::Joined => "Cavities, bodies that touch, open surfaces",
    }
}

/// What the tables show, and what they come to.
fn summary(results: &Results) -> String {
    let rows = &results.rows;
    let real = match rows.iter().any(|row| row.family == Family::Real) {
        true => "",
        false => {
            " Real shapes are left out: the folder `../shared/data`, which is no part of the repository, \
             is not there."
        }
    };
    let right = rows.iter().filter(|row| row.auto.wrong <= 0.5).count();
    let parity = rows.iter().filter(|row| row.parity.wrong <= 0.5).count();
    let slowest = rows.iter().map(|row| row.time).fold(0.0, f64::max);
    format!(
        "\
## How often it is wrong

Wrong signs in per cent of those that are judged, by `auto` and by `parity`; the rest of a row is of `auto`. *Least* is
what one gets wrong who knows the clean surface: noise throws samples of a thin body to its other side. *Axis* is the mean
angle between axis and truth in degrees, *narrow* the same with one radius for all, *caught* the share of the wrong signs
that are doubtful, *time* that for a point over that of the cloud in the middle. A number after a name is the distance of
two sheets in spacings, the thickness of a wing in chords, or the deviation of the noise in longest sides. Where boxes
touch, samples of two faces that look at each other lie in one place; nothing can part them, and they are not judged.{real}

At most 0.5 % are wrong on {right} of {} clouds (`parity`: {parity}). The slowest cloud takes {} times as long for a point
as that in the middle.

",
        rows.len(),
        significant(slowest, 2)
    )
}

fn table(rows: &[&Row]) -> Table {
    let names = [
        "points", "auto", "least", "parity", "axis", "narrow", "doubtful", "mostly", "caught",
        "time",
    ];
    let mut table = Table::new(&["cloud"], names.map(String::from));
    for row in rows {
        let auto = &row.auto;
        let most = auto.reasons.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let mostly = most.filter(|r| r.1 > 0.0).map_or("", |r| r.0);
        table.row(vec![
            row.cloud.clone(),
            thousands(row.points),
            share(auto.wrong),
            auto.least.map_or(String::new(), share),
            share(row.parity.wrong),
            format!("{:.1}", auto.axis_mean),
            format!("{:.1}", auto.axis_mean_narrow),
            share(auto.doubtful),
            mostly.into(),
            auto.caught.map_or(String::new(), |c| format!("{c:.0}")),
            significant(row.time, 2),
        ]);
    }
    table
}

/// Two decimals, where there is anything.
fn share(percent: f64) -> String {
    match percent {
        0.0 => "0".into(),
        _ => format!("{percent:.2}"),
    }
}

/// The body that moves.
fn moving(steps: &[Step]) -> String {
    let following: Vec<&Step> = steps.iter().filter(|step| step.follows).collect();
    let worst = steps.iter().map(|step| step.wrong).fold(0.0, f64::max);
    let turned = following.iter().map(|step| step.turned).max().unwrap_or(0);
    let time = median(following.iter().map(|step| step.time).collect());
    format!(
        "\
## Bodies that move

The fish swims through one beat of its tail in {} steps, 50,000 random samples that move with its skin; `previous`
orients the first and follows from there. In {} steps it followed, in no step were more than {} % of the signs wrong, and
at most {} axes had turned far and were left to their neighbors. Following takes {} of the time of `auto` on the same
cloud (the median of the steps; neighborhoods and axes, which both need, aside).

The result then depends on the calls before: a plan that begins in the middle of a motion may choose another sign where
the choice was doubtful. The functions for JAX and PyTorch have no plan, and refuse it; there, give the normals of the
step before, with `orient=\"signs\"`.
",
        steps.len().saturating_sub(1),
        following.len(),
        share(worst),
        turned,
        significant(time, 2)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::Errors;

    #[test]
    fn the_page_says_so_where_real_shapes_are_absent() {
        let row = |family| Row {
            cloud: "a".into(),
            family,
            points: 1_000,
            auto: Errors::default(),
            parity: Errors {
                wrong: 7.0,
                ..Errors::default()
            },
            time: 1.0,
        };
        let steps = vec![Step {
            wrong: 0.0,
            turned: 3,
            follows: true,
            time: 0.02,
        }];
        let with = |family| {
            page(&Results {
                rows: vec![row(family)],
                steps: steps.clone(),
            })
        };
        assert!(with(Family::Thin).contains("Real shapes are left out"));
        let real = with(Family::Real);
        assert!(!real.contains("left out") && real.contains("### Real shapes"));
        assert!(real.contains("| a | 1,000 | 0 |  | 7.00 |"), "{real}");
        assert!(real.contains("takes 0.020 of the time"), "{real}");
    }
}
