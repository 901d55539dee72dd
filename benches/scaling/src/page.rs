//! The page.

use isograd_page::table::{Table, significant};
use isograd_page::text::thousands;

use crate::size::Size;
use crate::slope::exponent;
use crate::study::Results;

const HEAD: &str = "\
<!-- Written by `cargo xtask scaling`. Do not edit: change benches/scaling. -->
# Scaling

Time and memory of the whole pipeline against the size of the problem: random samples of a torus, single precision, all
threads, all options as they come, checks left out. *Forward* is a reconstruction with the plan used before, *backward*
the pullback of a cotangent at every cell. `cargo xtask scaling` measures everything again and writes this page, its
picture and [all numbers](scaling.json). Times are of one machine and one day; the slopes are what counts.

![Time and memory over cells and over points](images/scaling.png)

";

/// The whole page.
pub fn page(results: &Results) -> String {
    let mut page = HEAD.to_string();
    page += &slopes(results);
    page += &format!("\n## Cells\n\n{}\n", sizes(&results.cells));
    page += &format!("## Points\n\n{}\n", sizes(&results.points));
    page + &limit(results)
}

/// Exponents, and bytes for a cell and a point.
fn slopes(results: &Results) -> String {
    let of = |sizes: &[Size], x: fn(&Size) -> f64, y: fn(&Size) -> f64| {
        let pairs: Vec<[f64; 2]> = sizes.iter().map(|size| [x(size), y(size)]).collect();
        significant(exponent(&pairs), 2)
    };
    let cells = |size: &Size| size.cells() as f64;
    let points = |size: &Size| size.points as f64;
    format!(
        "\
- Time grows as cells to the power of {} forward and {} backward, and as points to the power of {} and {}:
  fitted over all sizes below, small ones included, whose fixed cost of the other kind makes the power smaller.
- Between the two largest sizes, forward: {} and {}.
- Memory: {} bytes a cell forward, {} with the pullback; {} bytes a point, {} with the pullback (from the two largest
  sizes). The field itself has 4 bytes a cell. A grid that needs more than is free is refused before work starts.
",
        of(&results.cells, cells, |s| s.forward),
        of(&results.cells, cells, |s| s.backward),
        of(&results.points, points, |s| s.forward),
        of(&results.points, points, |s| s.backward),
        last(&results.cells, cells, "cells"),
        last(&results.points, points, "points"),
        each(&results.cells, cells, |s| s.forward_bytes),
        each(&results.cells, cells, |s| s.backward_bytes),
        each(&results.points, points, |s| s.forward_bytes),
        each(&results.points, points, |s| s.backward_bytes),
    )
}

/// The exponent of forward time between the two largest sizes.
fn last(sizes: &[Size], x: fn(&Size) -> f64, name: &str) -> String {
    let largest = &sizes[sizes.len().saturating_sub(2)..];
    let pairs: Vec<[f64; 2]> = largest.iter().map(|size| [x(size), size.forward]).collect();
    format!(
        "{name} to the power of {}",
        significant(exponent(&pairs), 2)
    )
}

/// Bytes that one more cell or point takes, between the two largest sizes.
fn each(sizes: &[Size], x: fn(&Size) -> f64, bytes: fn(&Size) -> usize) -> String {
    match sizes {
        [.., a, b] => {
            let more = bytes(b) as f64 - bytes(a) as f64;
            significant(more / (x(b) - x(a)), 2)
        }
        _ => "?".into(),
    }
}

fn sizes(sizes: &[Size]) -> Table {
    let names = [
        "points",
        "forward, s",
        "backward, s",
        "ns a cell",
        "µs a point",
        "forward, MiB",
        "with the pullback, MiB",
    ];
    let mut table = Table::new(&["cells"], names.map(String::from));
    for size in sizes {
        let mebibytes = |bytes: usize| significant(bytes as f64 / (1u64 << 20) as f64, 3);
        let [nx, ny, nz] = size.shape;
        table.row(vec![
            format!("{nx}×{ny}×{nz}"),
            thousands(size.points),
            significant(size.forward, 3),
            significant(size.backward, 3),
            significant(1e9 * size.forward / size.cells() as f64, 3),
            significant(1e6 * size.forward / size.points as f64, 3),
            mebibytes(size.forward_bytes),
            mebibytes(size.backward_bytes),
        ]);
    }
    table
}

/// How far each stage of the paper's fish is from what memory allows.
fn limit(results: &Results) -> String {
    let (fish, copy) = (&results.fish, results.copy);
    let (cells, points) = (fish.cells() as f64, fish.points as f64);
    let mut table = Table::new(
        &["stage"],
        [
            "seconds",
            "least bytes",
            "seconds at the speed of a copy",
            "times that",
        ]
        .map(String::from),
    );
    for &(stage, seconds) in &fish.stages {
        let bytes = least_bytes(stage, cells, points);
        table.row(vec![
            stage.into(),
            significant(seconds, 3),
            thousands(bytes as usize),
            significant(bytes / copy, 2),
            significant(seconds * copy / bytes, 2),
        ]);
    }
    let [nx, ny, nz] = fish.shape;
    format!(
        "\
## How far from the limit of memory

The paper's fish, {nx}×{ny}×{nz} cells and {} samples, takes {} s forward and {} s backward. A copy of a
large array moves {} GB/s here, measured in the same run. What a stage must at least read and write (points, normals and
fields, once) would take the time of the fourth column at that speed; the last column says how many times that it takes.
Normals, orientation and distance are bound by arithmetic, not by memory.

{table}",
        thousands(fish.points),
        significant(fish.forward, 3),
        significant(fish.backward, 3),
        significant(copy / 1e9, 3),
    )
}

/// What a stage reads and writes if it does so once, in bytes.
fn least_bytes(stage: &str, cells: f64, points: f64) -> f64 {
    const VALUE: f64 = 4.0;
    match stage {
        // Points in, normals and areas out.
        "normals" => VALUE * 7.0 * points,
        // Axes in, normals and confidence out.
        "orient" => VALUE * 7.0 * points,
        // Samples in, a field out.
        "splat" => VALUE * (7.0 * points + cells),
        // A field in and one out.
        "poisson" => VALUE * 2.0 * cells,
        // A field in.
        "isosurface" => VALUE * cells,
        // A field in for the signs; φ and the closest faces out.
        _ => VALUE * 3.0 * cells,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(cells: usize, points: usize) -> Size {
        Size {
            shape: [cells, 10, 10],
            points,
            forward: 1e-6 * cells as f64,
            backward: 5e-7 * cells as f64,
            stages: vec![("poisson", 0.25), ("distance", 0.5)],
            forward_bytes: 1800 * cells + 100 * points,
            backward_bytes: 2600 * cells + 300 * points,
        }
    }

    #[test]
    fn the_page_has_slopes_bytes_and_the_share_of_the_copy() {
        let results = Results {
            cells: [100, 1_000, 10_000].map(|n| size(n, 10)).to_vec(),
            points: [100, 1_000].map(|n| size(100, n)).to_vec(),
            fish: size(1_000, 10),
            copy: 8e6,
        };
        let page = page(&results);
        for part in [
            "cells to the power of 1.0 forward and 1.0 backward",
            "18 bytes a cell forward, 26 with the pullback",
            "| poisson | 0.250 | 800,000 | 0.10 | 2.5 |",
            "| 100×10×10 | 1,000 |",
        ] {
            assert!(page.contains(part), "'{part}' is not in\n{page}");
        }
    }
}
