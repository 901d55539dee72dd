//! `isograd clean`, run as a user runs it.

use crate::sandbox::Sandbox;

#[test]
fn steps_are_applied_in_order_and_attributes_go_along() {
    let sandbox = Sandbox::new();
    let text = "x,y,z,nx,ny,nz,heat\n0,0,0,0,0,1,7\n0,0,0,0,0,1,8\n1,0,0,0,0,1,9\n1,0.01,0,0,0,1,10\n9,9,9,0,0,1,11\n";
    sandbox.write("cloud.csv", text);
    let run = sandbox.done("clean cloud.csv -o out.csv --duplicates 0 --radius 1.5,1 --voxel 0.5");
    for line in [
        "duplicates: 1 removed",
        "radius: 1 removed",
        "voxel: 1 removed",
        "2 of 5 points kept",
    ] {
        assert!(run.stdout.contains(line), "{}", run.stdout);
    }
    let kept = sandbox.geometry("out.csv");
    assert_eq!(kept.points, [[0.0; 3], [1.0, 0.0, 0.0]]);
    assert_eq!(kept.normals.map(|n| n.len()), Some(2));
    assert_eq!(kept.attributes[0].values, [7.0, 9.0]);
}

#[test]
fn thinned_clouds_are_apart() {
    let sandbox = Sandbox::with("sample sphere -n 4000 -o cloud.ply");
    sandbox.done("clean cloud.ply -o out.ply -q --poisson-disk 0.1 --statistical 8,3");
    let points = sandbox.geometry("out.ply").points;
    assert!((100..1000).contains(&points.len()), "{}", points.len());
    for (i, p) in points.iter().enumerate() {
        for q in &points[..i] {
            let squared: f64 = (0..3).map(|a| (p[a] - q[a]).powi(2)).sum();
            assert!(squared > 0.01);
        }
    }
}

#[test]
fn points_and_normals_that_are_not_finite_are_left_out() {
    let sandbox = Sandbox::new();
    let text = "x,y,z,nx,ny,nz,heat\n0,0,0,0,0,1,7\n0,nan,0,0,0,1,8\n1,0,0,0,0,inf,9\n1,0,0,0,0,1,10\n0,0,0,0,0,1,11\n";
    sandbox.write("cloud.csv", text);
    let kept = |steps: &str, removed: &str| {
        let run = sandbox.done(&format!("clean cloud.csv -o out.csv {steps}"));
        assert!(run.stdout.contains("not-finite: 2 removed"), "{run:?}");
        assert!(run.stdout.contains(removed), "{run:?}");
        sandbox.geometry("out.csv").attributes[0].values.clone()
    };
    assert_eq!(kept("", "3 of 5 points kept"), [7.0, 10.0, 11.0]);
    assert_eq!(kept("--duplicates 0", "2 of 5 points kept"), [7.0, 10.0]);
    sandbox.write("none.csv", "x,y,z\nnan,0,0\n");
    sandbox.says("1 clean none.csv -o new.csv | no point of 1 is left | not_finite 1");
}

#[test]
fn command_lines_with_bad_numbers_are_refused() {
    let sandbox = Sandbox::with("sample sphere -n 100 -o cloud.ply");
    sandbox.says("2 clean cloud.ply -o out.ply --voxel=-1 | above 0");
    sandbox.says("2 clean cloud.ply -o out.ply --statistical 8 | is not K,S");
    sandbox.says("2 clean cloud.ply -o out.ply --radius 0.1,some | whole number");
    sandbox.says("2 clean cloud.ply -o out.vti --voxel 1 | must end in");
    sandbox.says("2 clean cloud.ply -o cloud.ply --voxel 1 | cloud.ply");
    sandbox.says("1 clean cloud.ply -o out.ply --radius 0.001,5 | no point of 100 is left");
    assert!(!sandbox.path("out.ply").exists());
}
