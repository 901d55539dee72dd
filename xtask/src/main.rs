//! Commands for everyday work on the project: `cargo xtask --help` lists them.

mod bench;
mod deny;
mod environment;
mod examples;
mod fit;
mod flow;
mod fuzz;
mod kit;
mod limits;
mod links;
mod nvrtc;
mod packages;
mod pages;
mod peers;
mod pictures;
mod process;
mod programs;
mod python;
mod readme;
mod steps;
mod tally;
mod test;
mod workspace;

use std::io::Write as _;
use std::process::ExitCode;

use process::Outcome;
use test::Scope;

const HELP: &str = "\
cargo xtask COMMAND

Checks
  test [--all]     everything a change must pass, cheapest first: format, limits, links, clippy,
                   docs, tests, doc tests, the Python package, examples, and the commands and code
                   of the README; --all adds the GPU kernels on Vulkan and as PTX, PyTorch, the
                   benchmarks, a minute of fuzz, whether the pages match their figures, and the
                   published packages
  lint             the first four of these, for the whole workspace
  python           the tests of the Python package alone
  package          the packages as they are published: crates, source distribution
  fuzz [ARGS]      random input for the readers, the library and the command line; failing inputs
                   are saved in target/fuzz, and a line says how to repeat each. --minutes M (1),
                   --seed S (from the clock), --json FILE for the counts, --part
                   readers|library|program, and --case N for one input of that part
  deny             licenses, sources and advisories of every dependency (needs cargo-deny);
                   --offline leaves the advisories out

Figures and pages
  docs             measures and renders every page below docs/ that a command makes: accuracy,
                   gradients, orientation, scaling, gallery, fit; --render renders all pages from
                   their JSON without measuring; --check fails if a page differs from its JSON
  accuracy         docs/accuracy.md: errors against bodies with a closed form
  gradients        docs/gradients.md: the pullback against differences and closed forms, and its
                   cost; compares times, so leave the machine alone meanwhile
  orientation      docs/orientation.md: wrong signs on many clouds, and their doubt; with real shapes
                   where ../shared/data is there
  scaling          docs/scaling.md: time and memory against cells and points; leave the machine
                   alone meanwhile
  gallery          docs/images/: the picture of the README, and those of bad results
  fit              docs/fit.md: a fish found from its signed distance field
  gpu              docs/gpu.md: time and memory on a GPU
  gpu --pack       target/isograd-gpu-kit.tar.xz: tests and benchmarks for a machine with an NVIDIA
                   driver but without Rust and network
  gpu --page FILE  docs/gpu.md from the results that this kit has written
  bench [ARGS]     the benchmarks, every stage and the whole; --quick for a short run,
                   a stage's name for that stage; other arguments go to criterion
  peers [ARGS]     docs/peers.md: isograd beside other libraries, measured in one
                   run (needs Python 3 and PyPI; OpenVDB is compared where Debian's
                   python3-openvdb is installed); --quick for a short run
  surfaces [ARGS]  docs/surfaces.md: surfaces of the real shapes in ../shared/data (or --data DIR)
                   against their true meshes, beside PoissonRecon (needs Python 3 and PyPI)
  large [ARGS]     docs/large.md: 10 million samples at an effective 2048³, beside PoissonRecon;
                   leave the machine alone meanwhile (needs Python 3 and PyPI)
  flow [CASE...]   docs/flow.md: bodies in a flow solver, its film and its picture; about an hour
                   (needs Python 3 and PyPI)
  datasets [ARGS]  docs/datasets.md: clouds per core-hour, with estimated and with given normals

Exit status: 0 done, 1 a step failed, 2 the command line is wrong.";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let command = arguments.next().unwrap_or_default();
    let rest: Vec<String> = arguments.collect();
    if command == "--help" || command == "-h" || command == "help" {
        // The reader may have seen enough: `| head`.
        let _ = writeln!(std::io::stdout(), "{HELP}");
        return ExitCode::SUCCESS;
    }
    match run(&command, &rest) {
        Some(Ok(())) => ExitCode::SUCCESS,
        Some(Err(failure)) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
        None => {
            let given = [&[command], rest.as_slice()].concat().join(" ");
            eprintln!("error: unknown command '{given}'\n\n{HELP}");
            ExitCode::from(2)
        }
    }
}

/// Runs a command; `None` if there is no such command.
fn run(command: &str, rest: &[String]) -> Option<Outcome> {
    match (command, rest) {
        ("test", []) => Some(test::run(Scope::Default)),
        ("test", [flag]) if flag == "--all" => Some(test::run(Scope::All)),
        ("lint", []) => Some(test::lint()),
        ("python", []) => Some(test::python()),
        ("package", []) => Some(packages::run()),
        ("fuzz", _) => Some(fuzz::run(rest)),
        ("deny", []) => Some(deny::run(false)),
        ("deny", [flag]) if flag == "--offline" => Some(deny::run(true)),
        ("docs", []) => Some(pages::all()),
        ("docs", [flag]) if flag == "--render" => Some(pages::render(&[])),
        ("docs", [flag]) if flag == "--check" => Some(pages::check().map(drop)),
        ("accuracy" | "gradients" | "orientation" | "scaling", []) => Some(pages::measure(command)),
        ("gpu", []) => Some(pages::gpu()),
        ("gpu", [flag]) if flag == "--pack" => Some(kit::pack()),
        ("gpu", [flag, file]) if flag == "--page" => {
            Some(kit::import(file).and_then(|()| pages::render(&["gpu"])))
        }
        ("gallery", []) => Some(pictures::all()),
        ("fit", []) => Some(fit::run()),
        ("bench", _) => Some(bench::run(rest)),
        ("peers", _) => Some(peers::run(rest)),
        ("surfaces", _) => Some(peers::surfaces(rest)),
        ("large", _) => Some(peers::large(rest)),
        ("flow", _) => Some(flow::run(rest)),
        ("datasets", _) => Some(peers::datasets(rest)),
        _ => None,
    }
}
