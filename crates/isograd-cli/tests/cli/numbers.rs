//! Clouds whose numbers are not finite, or have lost digits.

use isograd::PointCloud;

use crate::sandbox::Sandbox;

/// A sandbox with a cloud of a sphere of radius 0.5.
fn sphere() -> Sandbox {
    Sandbox::with("sample sphere -n 3000 -o cloud.ply")
}

#[test]
fn digits_that_a_file_in_single_precision_lacks_are_said_to_be_missing() {
    let sandbox = sphere();
    let near = sandbox.geometry("cloud.ply").points;
    let far = |x: f64| {
        near.iter()
            .map(move |p| [(p[0] + x) as f32, p[1] as f32, p[2] as f32])
    };
    for (x, expected) in [(1e6, true), (10.0, false)] {
        let cloud = PointCloud::new(far(x).collect()).expect("finite");
        isograd_io::write_cloud(&sandbox.path("far.ply"), &cloud).expect("writes");
        for precision in ["f32", "f64"] {
            let line = "reconstruct far.ply --mesh m.ply --resolution 32 --precision";
            let run = sandbox.run(&format!("{line} {precision}"));
            let is_said = run.stderr.contains("digits are missing in the file itself");
            assert_eq!(is_said, expected, "{run:?}");
        }
    }
}

#[test]
fn normals_that_are_not_finite_matter_only_where_they_are_used() {
    let sandbox = sphere();
    let cloud = sandbox.geometry("cloud.ply");
    let file = |normal: &str| {
        let rows = cloud
            .points
            .iter()
            .enumerate()
            .map(|(i, [x, y, z])| match i {
                0 => format!("{x:?},{y:?},{z:?},{normal}\n"),
                _ => format!(
                    "{x:?},{y:?},{z:?},{:?},{:?},{:?}\n",
                    2.0 * x,
                    2.0 * y,
                    2.0 * z
                ),
            });
        format!("x,y,z,nx,ny,nz\n{}", rows.collect::<String>())
    };
    sandbox.write("nan.csv", file("nan,nan,nan"));
    sandbox.write("zero.csv", file("0,0,1"));
    for name in ["nan", "zero"] {
        sandbox.done(&format!(
            "reconstruct {name}.csv --sdf {name}.npz --resolution 24"
        ));
        sandbox.done(&format!("orient {name}.csv -o {name}.ply"));
    }
    assert_eq!(sandbox.read("nan.npz"), sandbox.read("zero.npz"));
    assert_eq!(sandbox.read("nan.ply"), sandbox.read("zero.ply"));
    for orient in ["given", "signs"] {
        let said = "| nan.csv, line 2 | not finite | isograd clean";
        sandbox.says(&format!(
            "1 reconstruct nan.csv -o out --orient {orient} {said}"
        ));
        sandbox.says(&format!(
            "1 orient nan.csv -o out.ply --orient {orient} {said}"
        ));
    }
    sandbox.done("clean nan.csv -o clean.csv");
    sandbox.done("reconstruct clean.csv -o out --orient given --resolution 24");
}
