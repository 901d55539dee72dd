use std::sync::LazyLock;

use isograd_page::table::{percent, significant};

use crate::body::{Body, Draw};
use crate::motion::Motion;
use crate::ratios::Choice;
use crate::study::{Results, Study};

/// Small grids, and few samples: seconds, not minutes.
static SMALL: LazyLock<(Study, Results)> = LazyLock::new(|| {
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
    (study, results)
});

fn page() -> String {
    super::page(&SMALL.0, &SMALL.1).expect("a page")
}

/// The cells of the line that begins with these words.
fn line(page: &str, begin: &str) -> Vec<String> {
    let line = page.lines().find(|line| line.starts_with(begin));
    let cells = line.expect("a line").trim_matches('|').split('|');
    cells.map(|cell| cell.trim().to_string()).collect()
}

#[test]
fn columns_hold_what_their_heads_say() {
    let (page, results) = (page(), &SMALL.1);
    assert!(!page.contains("NaN"), "{page}");

    let row = &results.parameters.rows[6];
    let cells = line(&page, "| height1 |");
    assert_eq!(cells[1], significant(row.pullback, 5));
    assert_eq!(cells[2], significant(row.held, 5));
    assert_eq!(cells[5], format!("{:.3}", row.pullback / row.real));

    let cost = &results.costs[0];
    let cells = line(&page, "| torus, 32 × 32 × 16 | f32 | 1 |");
    assert_eq!(cells[3], significant(cost.forward, 3));
    assert_eq!(cells[5], format!("{:.2}", cost.ratio));
    // Six stages of the forward, and six columns before them.
    assert_eq!(cells.len(), 12);

    let sphere = &results.spheres[0];
    let cells = line(&page, "| 1,000 random | 32 |");
    assert_eq!(cells[2], percent(sphere.area));
    assert_eq!(cells[4], percent(sphere.phi));
}

#[test]
fn the_pullback_agrees_with_differences_of_the_map_that_it_differentiates() {
    let rows = &SMALL.1.parameters.rows;
    assert_eq!(rows.len(), 14);
    for row in rows {
        // The demand of the page itself, at a size where it takes a second.
        assert!(row.relative() < 1e-3 && row.changed == 0, "{row:?}");
    }
}

#[test]
fn a_sphere_grows_as_its_closed_forms_say() {
    for sphere in &SMALL.1.spheres {
        // 1 % is demanded at 64 cells, and errors fall with the cell.
        for error in [sphere.area, sphere.volume, sphere.phi] {
            assert!(error.abs() < 0.02, "{sphere:?}");
        }
    }
}

#[test]
fn every_choice_is_measured_for_every_motion() {
    let results = &SMALL.1;
    // Two bodies, one way of drawing samples, two functionals.
    let count = 4 * Choice::ALL.len() * Motion::ALL.len();
    assert_eq!(results.ratios.len(), count);
    for ratio in &results.ratios {
        assert!(ratio.ratio().is_finite(), "{ratio:?}");
        assert_eq!(ratio.path.is_some(), ratio.choice == Choice::ALL[0]);
    }
    // Two number types and two numbers of threads; two number types.
    assert_eq!((results.costs.len(), results.memory.len()), (8, 4));
}

#[test]
fn memory_counts_at_least_the_indicator_and_the_closest_faces() {
    for memory in &SMALL.1.memory {
        let cell = if memory.precision == "f32" { 4 } else { 8 };
        assert!(
            memory.residual >= memory.field + memory.field / cell * 4,
            "{memory:?}"
        );
        // The first pullback takes a field at least, later ones less than that.
        assert!(
            memory.first >= memory.field && memory.later < memory.first,
            "{memory:?}"
        );
    }
}

#[test]
fn numbers_are_written_as_json() {
    let text = crate::json(&SMALL.1).expect("numbers");
    let value: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
    assert_eq!(value["parameters"].as_array().map(Vec::len), Some(14));
    assert!(value["ratios"][0]["motion"].is_string());
}
