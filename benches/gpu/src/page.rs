//! The words and tables.

use std::fmt::Write as _;

use crate::problem::Size;
use crate::study::Results;

/// Where the part begins and ends.
pub const BEGIN: &str = "<!-- Written by `cargo xtask gpu`. Do not edit: change benches/gpu. -->\n";
pub const END: &str = "<!-- The end of what it writes. -->";

/// The part of the page that is about speed.
pub fn speed(results: &Results) -> String {
    let mut text = String::from("\n");
    match results.backend {
        Some(backend) => measured(&mut text, results, backend),
        None => text.push_str(
            "Times are not measured: there has been no GPU to measure on, nor have the kernels run through CUDA. Nor is \
             there a\ncomparison with NVIDIA Warp, with conjugate gradients in JAX or with Shape As Points. `cargo xtask \
             gpu` measures times\nwhere there is a GPU.\n\n",
        ),
    }
    let fish = &results.fish;
    let [nx, ny, nz] = fish.shape;
    let _ = write!(
        text,
        "The paper's fish, {nx}×{ny}×{nz} cells and {} samples in single precision, takes {:.0} MiB of the device's \
         memory,\nforward and backward, pools and all that is kept included: {:.0} bytes a cell (measured on {}).\n\n",
        thousands(fish.points),
        fish.bytes as f64 / f64::from(1 << 20),
        fish.bytes as f64 / fish.cells() as f64,
        results.device,
    );
    let (forward, backward) = (&fish.forward_effort, &fish.backward_effort);
    let _ = write!(
        text,
        "A reconstruction of it queues {} kernels and waits {} times, for a few numbers each time; its pullback queues {} \
         and waits\n{} times.\n\n",
        forward.launches, forward.waits, backward.launches, backward.waits,
    );
    text
}

fn measured(text: &mut String, results: &Results, backend: &str) {
    let (fish, device) = (&results.fish, &results.device);
    let milliseconds = |seconds: Option<f64>| 1e3 * seconds.unwrap_or(f64::NAN);
    let _ = write!(
        text,
        "On {device}, through {backend}, in single precision with all options as they come; data stay on the device, \
         the plan was\nused before, radii and sides are held. The paper's fish: {:.2} ms forward, {:.2} ms forward and \
         backward; {:.2} ms to find radii\nand sides by given normals. One field added to another moves {:.0} GB/s.\n\n",
        milliseconds(fish.forward),
        milliseconds(fish.both),
        milliseconds(fish.hold),
        results.bytes_per_second.unwrap_or(f64::NAN) / 1e9,
    );
    if let Some(power) = power(&results.cells) {
        let _ = write!(
            text,
            "From 128³ cells to the largest grid, time grows as cells to the power of {power:.2}, forward and backward.\n\n"
        );
    }
    stages(text, results);
    table(text, "Cells", &results.cells);
    table(text, "Points", &results.points);
}

/// The stages of the fish, beside what their least traffic would take.
fn stages(text: &mut String, results: &Results) {
    text.push_str("| stage | ms | share of the speed of that addition |\n|---|--:|--:|\n");
    let cells = results.fish.cells() as f64;
    let speed = results.bytes_per_second.unwrap_or(f64::NAN);
    for (name, seconds) in &results.fish.stages {
        // Fields read and written at least.
        let fields = match *name {
            "splat" => 1.0,
            "poisson" => 2.0,
            "isosurface" => 1.0,
            "distance" => 3.0,
            _ => 0.0,
        };
        let share = 4.0 * fields * cells / speed / seconds;
        let _ = match fields > 0.0 {
            true => writeln!(text, "| {name} | {:.3} | {share:.2} |", 1e3 * seconds),
            false => writeln!(text, "| {name} | {:.3} | |", 1e3 * seconds),
        };
    }
    text.push('\n');
}

fn table(text: &mut String, title: &str, sizes: &[Size]) {
    let _ = write!(
        text,
        "### {title}\n\n| cells | points | forward, ms | forward and backward, ms | bytes a cell |\n|---|--:|--:|--:|--:|\n"
    );
    for size in sizes {
        let [nx, ny, nz] = size.shape;
        let _ = writeln!(
            text,
            "| {nx}×{ny}×{nz} | {} | {:.2} | {:.2} | {:.0} |",
            thousands(size.points),
            1e3 * size.forward.unwrap_or(f64::NAN),
            1e3 * size.both.unwrap_or(f64::NAN),
            size.bytes as f64 / size.cells() as f64,
        );
    }
    text.push('\n');
}

/// Slope of the logarithm of time over that of cells, from 128³ on.
fn power(sizes: &[Size]) -> Option<f64> {
    let large = sizes.iter().filter(|size| size.cells() >= 128usize.pow(3));
    let points: Vec<[f64; 2]> = large
        .filter_map(|size| Some([(size.cells() as f64).ln(), size.both?.ln()]))
        .collect();
    let count = points.len() as f64;
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let up: f64 = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
    let down: f64 = points.iter().map(|p| (p[0] - x).powi(2)).sum();
    (points.len() > 1).then_some(up / down)
}

fn thousands(number: usize) -> String {
    let digits = number.to_string();
    let groups = digits.as_bytes().rchunks(3).rev();
    let groups: Vec<_> = groups.map(String::from_utf8_lossy).collect();
    groups.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Asked;

    fn asked(launches: u64, waits: u64) -> Asked {
        Asked { launches, waits }
    }

    fn size(n: usize, seconds: f64) -> Size {
        Size {
            shape: [n; 3],
            points: 1_234_567,
            forward: Some(seconds),
            both: Some(2.0 * seconds),
            hold: Some(seconds),
            stages: vec![("poisson", 1e-3)],
            bytes: 40 * (n as u64).pow(3),
            forward_effort: asked(300, 7),
            backward_effort: asked(200, 4),
        }
    }

    #[test]
    fn slope_is_that_of_the_large_grids() {
        let sizes = [64, 128, 256, 512].map(|n| match n {
            64 => size(n, 1.0),
            n => size(n, 1e-9 * (n as f64).powi(3)),
        });
        let power = power(&sizes).expect("three sizes");
        assert!((power - 1.0).abs() < 1e-12, "{power}");
    }

    #[test]
    fn page_says_what_was_measured_and_what_was_not() {
        let mut results = Results {
            device: "a GPU".into(),
            backend: None,
            bytes_per_second: None,
            fish: size(100, 0.01),
            cells: Vec::new(),
            points: Vec::new(),
        };
        let text = speed(&results);
        assert!(text.contains("not measured") && text.contains("40 bytes a cell"));
        assert!(text.contains("300 kernels and waits 7 times"));
        assert!(text.contains("1,234,567") && !text.contains("NaN"));
        results.backend = Some("CUDA");
        results.bytes_per_second = Some(1e12);
        results.cells = vec![size(128, 0.01), size(256, 0.08)];
        let text = speed(&results);
        assert!(text.contains("power of 1.00") && !text.contains("not measured"));
        assert!(
            text.contains("| poisson | 1.000 | 0.01 |") && !text.contains("NaN"),
            "{text}"
        );
    }
}
