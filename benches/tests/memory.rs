//! Small studies that count memory, in one test: another one at the same time would be counted too.

use isograd_benches::gradients::motion::Motion;
use isograd_benches::gradients::ratios::Choice;
use isograd_benches::gradients::{Results, Study};
use isograd_benches::sampling::{Body, Draw};
use isograd_benches::scaling::{Cells, Problem};

#[test]
fn small_studies_meet_their_targets_and_count_memory() {
    // Small grids, and few samples: seconds, not minutes.
    let study = Study {
        fish: Body {
            name: "fish",
            shape: [136, 28, 40],
            samples: 3000,
        },
        torus: Body {
            name: "torus",
            shape: [32, 32, 16],
            samples: 3000,
        },
        spheres: vec![(32, 1000), (40, 2000)],
        draws: vec![Draw::Random],
        repeats: 1,
    };
    let results = study.run().expect("a study");
    the_pullback_agrees_with_held_differences(&results);
    a_sphere_grows_by_its_closed_forms(&results);
    every_choice_is_measured_for_every_motion(&results);
    memory_holds_at_least_the_indicator_and_the_closest_faces(&results);
    results_are_valid_json(&results);
    memory_of_a_problem_is_counted();
}

fn the_pullback_agrees_with_held_differences(results: &Results) {
    let rows = &results.parameters.rows;
    assert_eq!(rows.len(), 14);
    for row in rows {
        // The target of docs/gradients.md, at a size that takes a second.
        assert!(row.relative() < 1e-3 && row.changed == 0, "{row:?}");
    }
}

fn a_sphere_grows_by_its_closed_forms(results: &Results) {
    for sphere in &results.spheres {
        // The target is 1 % at 64 cells, and errors fall with the cell.
        for error in [sphere.area, sphere.volume, sphere.phi] {
            assert!(error.abs() < 0.02, "{sphere:?}");
        }
    }
}

fn every_choice_is_measured_for_every_motion(results: &Results) {
    // Two bodies, one distribution of samples, two functionals.
    let count = 4 * Choice::ALL.len() * Motion::ALL.len();
    assert_eq!(results.ratios.len(), count);
    for ratio in &results.ratios {
        assert!(ratio.ratio().is_finite(), "{ratio:?}");
        assert_eq!(ratio.path.is_some(), ratio.choice == Choice::ALL[0]);
    }
    // Two bodies, two number types and two numbers of threads; two bodies and two number types.
    assert_eq!((results.costs.len(), results.memory.len()), (8, 4));
}

fn memory_holds_at_least_the_indicator_and_the_closest_faces(results: &Results) {
    for memory in &results.memory {
        let number = if memory.precision == "f32" { 4 } else { 8 };
        let faces = memory.field / number * size_of::<u32>();
        assert!(memory.residual >= memory.field + faces, "{memory:?}");
        // The first pullback takes at least a field, later ones less than the first.
        assert!(memory.first >= memory.field, "{memory:?}");
        assert!(memory.later < memory.first, "{memory:?}");
    }
}

fn results_are_valid_json(results: &Results) {
    let text = results.json().expect("numbers");
    let value: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
    assert_eq!(value["parameters"].as_array().map(Vec::len), Some(14));
    assert!(value["ratios"][0]["motion"].is_string());
}

fn memory_of_a_problem_is_counted() {
    let problem = Problem {
        body: "torus",
        points: 2_000,
        cells: Cells::About(50_000),
    };
    let size = problem.measure(1).expect("a torus");
    let cells = size.cells();
    assert!((40_000..62_500).contains(&cells), "{cells}");
    assert!(size.forward > 0.0 && size.backward > 0.0);
    // φ, χ and the closest faces at least.
    assert!(size.forward_bytes > 12 * cells);
    assert!(size.backward_bytes >= size.forward_bytes);
}
