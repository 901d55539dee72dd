//! Options of every command that reads files.

use crate::sandbox::Sandbox;

#[test]
fn the_points_of_a_table_with_normals_first_are_its_points() {
    let sandbox = Sandbox::with("sample ellipsoid -n 200 -o a.csv");
    let text = String::from_utf8(sandbox.read("a.csv")).expect("text");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("x,y,z,nx,ny,nz"));
    let mut turned = String::from(
        "\"Normals:0\",\"Normals:1\",\"Normals:2\",\"Points:0\",\"Points:1\",\"Points:2\"\n",
    );
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        turned.push_str(&[&fields[3..], &fields[..3]].concat().join(","));
        turned.push('\n');
    }
    sandbox.write("b.csv", turned);
    let [a, b] = ["a", "b"].map(|name| sandbox.done(&format!("info {name}.csv")).stdout);
    assert_eq!(a, b);
}

#[test]
fn columns_without_known_names_are_chosen_on_the_command_line() {
    let sandbox = Sandbox::new();
    sandbox.write("a.csv", "t,a,b,c\n9,1,2,3\n9,4,5,6\n");
    for line in [
        "reconstruct a.csv -o out",
        "orient a.csv -o out.ply",
        "gradcheck a.csv",
        "query a.csv --at a.csv -o out.ply",
        "fit --target a.csv --shape sphere -o out",
        "info a.csv",
    ] {
        let parts = ["a.csv, line 1", "2 'a'", "--columns A,B,C"];
        sandbox.run(line).says(1, &parts);
    }
    for columns in ["a,b,c", "2,3,4"] {
        let run = sandbox.done(&format!("info a.csv --columns {columns}"));
        let bounds = "[1.0, 2.0, 3.0] to [4.0, 5.0, 6.0]";
        assert!(run.stdout.contains(bounds), "{}", run.stdout);
    }
    let run = sandbox.done("info a.csv --columns 2,3,4 --normal-columns t,a,b");
    assert!(run.stdout.contains("normals      yes"), "{}", run.stdout);
    sandbox.done("sample sphere -n 10 -o a.ply");
    sandbox.says("1 info a.ply --columns x,y,z | a.ply | this is PLY");
}

#[test]
fn every_command_keeps_within_max_memory() {
    let sandbox = Sandbox::with("sample sphere -n 200 -o a.ply");
    for line in [
        "reconstruct a.ply -o out",
        "orient a.ply -o out.ply",
        "gradcheck a.ply",
        "query a.ply --at a.ply -o out.ply",
        "fit --target a.ply --shape sphere -o out",
        "fit --target a.ply --points a.ply -o out",
        "info a.ply",
    ] {
        let run = sandbox.run(&format!("{line} --max-memory 8K"));
        run.says(1, &["a.ply", "the limit is 8 KiB", "--max-memory SIZE"]);
    }
    sandbox.done("info a.ply --max-memory 1M");
}
