//! `isograd gradcheck`, run as a user runs it.

use crate::sandbox::Sandbox;

#[test]
fn the_pullback_of_a_torus_agrees_with_small_steps() {
    let sandbox = Sandbox::with("sample torus -n 6000 -o torus.ply");
    // Of 48 cells, a plane through centers passes through a sample.
    let run = sandbox
        .run("gradcheck torus.ply --resolution 50 --tolerance 1e-6 --report check.json --seed 2");
    run.says(0, &[]);
    let table = run.stdout;
    let last = table.lines().last().unwrap_or_default();
    assert!(
        last.starts_with("verdict: good: the pullback is within"),
        "{table}"
    );
    assert!(table.contains("loss: volume of the body"), "{table}");
    for motion in [
        "noise",
        "waves",
        "translation x",
        "rotation z",
        "growth",
        "bending",
    ] {
        assert!(table.contains(motion), "{table}");
    }
    // A torus does not feel it where it turns around its own axis.
    let line = table.lines().find(|line| line.starts_with("rotation z"));
    assert!(line.is_some_and(|line| line.contains("≈ 0")), "{table}");
    assert!(
        table.contains("pullback and large step differ most for"),
        "{table}"
    );
    let report = sandbox.json("check.json");
    assert_eq!(report["guarded"], 0);
    assert_eq!(report["verdict"], "good");
    let loss = report["loss"].as_str().expect("a text");
    assert!(loss.starts_with("volume of the body"), "{loss}");
    let motions = report["motions"].as_array().expect("a list");
    assert_eq!(motions.len(), 10);
    for motion in motions {
        let number = |key: &str| motion[key].as_f64().expect("a number");
        let small = motion["small"]["value"].as_f64().expect("a number");
        assert!(
            (number("pullback") - small).abs() < 1e-6 * number("scale"),
            "{motion}"
        );
    }
}

#[test]
fn a_gradient_that_is_off_fails_where_a_tolerance_is_given() {
    let sandbox = Sandbox::with("sample torus -n 3000 -o torus.ply --seed 4");
    // No rounding is as small as this.
    let run = sandbox.run("gradcheck torus.ply --resolution 32 --tolerance 1e-30 -q");
    run.says(1, &["torus.ply: the pullback differs", "more than 1.0e-30"]);
    assert_eq!(run.stdout, "");
}

#[test]
fn bad_input_is_refused_with_a_reason() {
    let sandbox = Sandbox::with("sample torus -n 3000 -o torus.ply");
    sandbox.write("one.xyz", "1 2 3\n");
    sandbox.says("1 gradcheck none.ply | none.ply");
    sandbox.says("1 gradcheck one.xyz | one.xyz | can't be fitted");
    sandbox.says("1 gradcheck torus.ply --resolution 32 --step 9 | torus.ply: the cloud moved by 9 cells | 2 cells inside");
    sandbox.says("2 gradcheck torus.ply --step -1 | --step");
    sandbox.says("2 gradcheck torus.ply --report a.txt | a.txt | .json");
    sandbox.says(
        "1 gradcheck torus.ply --resolution 32 --orient given --report no/such/a.json | no/such",
    );
}
