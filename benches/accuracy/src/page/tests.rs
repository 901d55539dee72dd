use isograd_page::table::number;

use crate::study::Study;

/// Small grids, and few samples: seconds, not minutes.
fn small() -> Study {
    Study {
        bodies: vec!["torus", "sphere"],
        cells: vec![24, 32],
        samples: 4000,
    }
}

#[test]
fn columns_hold_what_their_heads_say() {
    let study = small();
    let results = study.run().expect("a study");
    let page = super::page(&study, &results).expect("a page");
    assert!(!page.contains("NaN"), "{page}");
    for row in &results.rows {
        let surface = &row.measured.surface;
        for spread in [&surface.vertices, &surface.faces] {
            assert!(spread.count > 100 && spread.mean > 0.0, "{row:?}");
            assert!(
                spread.mean < spread.p99 && spread.p99 <= spread.max,
                "{row:?}"
            );
        }
        assert!(surface.closed, "{row:?}");
        assert_eq!(row.measured.field.is_some(), row.case.is_default());
    }

    // One line of the main table against the numbers it is made of.
    let measured = results
        .row(&study.default_case("sphere", 32))
        .expect("measured");
    let floor = &results.floor("sphere", 32).expect("measured").surface;
    let before = results
        .row(&study.default_case("sphere", 24))
        .expect("measured");
    let fall = before.surface.vertices.mean / measured.surface.vertices.mean;
    // As a length, an error that stays the same in cells is of order 1. On grids as coarse as these the
    // margin of 4 cells on either side sets the cell size, so 24 and 16 cells span the body.
    let order = 1.0 + fall.ln() / (24f64 / 16.0).ln();
    let numbers = [
        measured.surface.vertices.mean,
        measured.surface.vertices.max,
        measured.surface.faces.mean,
        measured.surface.faces.max,
        floor.vertices.mean,
        floor.vertices.max,
        floor.faces.mean,
        floor.faces.max,
    ]
    .map(number);
    let line = page
        .lines()
        .find(|line| line.starts_with("| sphere | 32 |"))
        .expect("a line");
    let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
    assert_eq!(cells[3], format!("{} / {}", numbers[0], numbers[1]));
    assert_eq!(cells[4], number(order));
    assert_eq!(cells[5], format!("{} / {}", numbers[2], numbers[3]));
    assert_eq!(cells[6], format!("{} / {}", numbers[4], numbers[5]));
    assert_eq!(cells[7], format!("{} / {}", numbers[6], numbers[7]));

    // A vertex of the exact φ is off by what the distance curves along an edge; the middle of a face by
    // what the body curves below the face, which is more. Samples cost more than either.
    assert!(floor.vertices.mean < floor.faces.mean);
    assert!(floor.vertices.mean < measured.surface.vertices.mean);
}
