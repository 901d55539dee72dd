//! Tests of the command line.

use clap::CommandFactory;

use super::*;

#[test]
fn the_definition_is_consistent() {
    Cli::command().debug_assert();
}

/// Value names of numbers, and words of which the help of each must have one: its unit, or that it has none.
#[test]
fn every_number_has_a_unit() {
    const NUMBERS: &str = "N H FRACTION DEGREES ALPHA FACTOR CELLS DISTANCE THICKNESS R SIZE K SPREAD SHARE X0 X,Y,Z RATIO W";
    const UNITS: [&str; 18] = [
        "cells",
        "unit",
        "fraction",
        "degrees",
        "samples",
        "number of",
        "points",
        "distance",
        "512M",
        "epochs",
        "relative",
        "factor",
        "seed",
        "thread",
        "ratio",
        "without unit",
        "times",
        "half",
    ];
    let program = Cli::command();
    let mut numbers = 0;
    for command in program.get_subcommands() {
        for argument in command.get_arguments() {
            let names = argument.get_value_names().unwrap_or_default();
            let mut words = names.iter().flat_map(|name| name.split(['|', ':']));
            if !words.any(|word| NUMBERS.split(' ').any(|number| number == word)) {
                continue;
            }
            numbers += 1;
            let help = argument.get_help().map(ToString::to_string);
            let help = help.unwrap_or_default().to_lowercase();
            let has_unit = UNITS.iter().any(|unit| help.contains(&unit.to_lowercase()));
            assert!(has_unit, "{} {argument}: {help}", command.get_name());
        }
    }
    assert!(numbers > 40, "{numbers}");
}

#[test]
fn negative_bounds_and_parameters_are_values_not_flags() {
    let parse = |line: &str| Cli::try_parse_from(line.split(' '));
    let cli = parse("isograd reconstruct a.ply --bounds -1 -1 -1 1 1 1 --radius 0.2");
    let Ok(Cli {
        command: Command::Reconstruct(args),
    }) = cli
    else {
        panic!("{cli:?}");
    };
    assert_eq!(args.clouds, [PathBuf::from("a.ply")]);
    assert_eq!(
        args.grid.cells.bounds,
        Some(vec![-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
    );
    assert_eq!(
        args.method.normals.radius,
        isograd::neighbors::Radius::Fixed(0.2)
    );
    let cli = parse("isograd orient a.ply -o b.ply --sensor -1,0,2e1 --sensor 3,-4,5");
    let Ok(Cli {
        command: Command::Orient(args),
    }) = cli
    else {
        panic!("{cli:?}");
    };
    assert_eq!(args.normals.sensor, [[-1.0, 0.0, 20.0], [3.0, -4.0, 5.0]]);
    let cli = parse("isograd sample fish -n 5 -o a.ply --param time=-0.5");
    let Ok(Cli {
        command: Command::Sample(args),
    }) = cli
    else {
        panic!("{cli:?}");
    };
    assert_eq!(args.parameters, [("time".to_string(), -0.5)]);
}

#[test]
fn values_that_make_no_sense_are_refused() {
    for line in [
        "isograd",
        "isograd reconstruct",
        "isograd reconstruct a.ply --resolution 0",
        "isograd reconstruct a.ply --resolution 64 --spacing 0.1",
        "isograd reconstruct a.ply --spacing -1",
        "isograd reconstruct a.ply --radius wide",
        "isograd reconstruct a.ply --smoothing -1",
        "isograd reconstruct a.ply --screening -0.5",
        "isograd reconstruct a.ply --level global",
        "isograd reconstruct a.ply --padding nan",
        "isograd reconstruct a.ply --bounds 0 0 0 1 1",
        "isograd reconstruct a.ply --orient guess",
        "isograd reconstruct a.ply --threads 0",
        "isograd reconstruct a.ply --backend gpu",
        "isograd reconstruct a.ply --backend cuda:x",
        "isograd reconstruct a.ply -q -v",
        "isograd sample fish -o a.ply",
        "isograd sample fish -n 5 -o a.ply --param time",
        "isograd sample fish -n 5 -o a.ply --density w:3",
        "isograd orient a.ply",
        "isograd orient a.ply -o b.ply --sensor 1,2",
        "isograd orient a.ply -o b.ply --sensor 1,2,inf",
        "isograd orient a.ply -o b.ply --parity-gamma 0",
        "isograd query a.ply -o b.ply",
        "isograd sdf a.ply",
        "isograd sdf a.ply -o b.vti --band -1",
        "isograd sdf a.ply -o b.vti --outliers keep",
        "isograd isosurface a.vti -o b.ply --level nan",
        "isograd clean a.ply -o b.ply --voxel 0",
        "isograd clean a.ply -o b.ply --statistical 8",
        "isograd clean a.ply -o b.ply --statistical 0,2",
        "isograd clean a.ply -o b.ply --radius 0.1,x",
        "isograd gradcheck a.ply --step 0",
        "isograd info a.csv --columns x,y",
        "isograd info a.csv --columns x,,z",
        "isograd info a.csv --max-memory many",
        "isograd info a.csv --max-memory 0",
    ] {
        assert!(Cli::try_parse_from(line.split(' ')).is_err(), "{line}");
    }
}
