use super::*;

#[test]
fn every_case_has_the_errors_of_its_kind() {
    // Small grids, and few samples: seconds, not minutes.
    let study = Study {
        bodies: vec!["torus", "sphere"],
        cells: vec![24, 32],
        samples: 4000,
    };
    let results = study.run().expect("a study");
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
    let measured = results
        .row(&study.default_case("sphere", 32))
        .expect("measured");
    let floor = results
        .floors
        .iter()
        .find(|f| (f.body, f.cells) == ("sphere", 32))
        .expect("measured");
    // A vertex of the exact φ is off by the curvature of φ along an edge; the centroid of a face by that of the body below
    // the face, which is more. Samples cost more than either.
    assert!(floor.surface.vertices.mean < floor.surface.faces.mean);
    assert!(floor.surface.vertices.mean < measured.surface.vertices.mean);
    let json: serde_json::Value =
        serde_json::from_str(&results.json(&study).expect("results")).expect("valid JSON");
    assert_eq!(
        json["rows"].as_array().map(Vec::len),
        Some(results.rows.len())
    );
    let shares = json["histograms"][1]["all"].as_array().expect("a list");
    let sum: f64 = shares.iter().filter_map(serde_json::Value::as_f64).sum();
    assert!((0.99..1.0 + 1e-9).contains(&sum), "{sum}");
}
