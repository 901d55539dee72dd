//! Random input for the readers, the library and the command line: `cargo xtask fuzz`.
//!
//! Every input follows from a seed and its number. The parts run in turn; the summary counts inputs and failures.

mod bombs;
mod case;
mod clouds;
mod files;
mod library;
mod mutate;
#[cfg(unix)]
mod program;
mod random;
mod readers;
mod summary;
mod watchdog;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use peak_alloc::PeakAlloc;

use case::{Case, Inputs, Part, keep_panics};
use library::Library;
use readers::Readers;
use summary::Summary;
use watchdog::Watchdog;

/// Counts live bytes.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

const USAGE: &str = "cargo xtask fuzz [--minutes M] [--seed S] [--json FILE] [--part PART [--case N]]

Random input for the readers, the library and the command line, in turn.
  --minutes M  time in all (default: 1)
  --seed S     seed of all inputs (default: from the clock)
  --json FILE  writes the counts to FILE
  --part PART  only readers, library or program
  --case N     only input N of this part
Failing inputs are saved in target/fuzz. Exit status: 0 no failure, 1 failures, 2 the command line is wrong.";

/// Time of one part before the next has its turn.
const SLICE: Duration = Duration::from_secs(5);

/// Command line.
struct Arguments {
    minutes: f64,
    seed: u64,
    json: Option<PathBuf>,
    parts: Vec<Part>,
    case: Option<u64>,
}

fn main() -> ExitCode {
    let arguments = match parse(std::env::args().skip(1)) {
        Ok(arguments) => arguments,
        Err(problem) => {
            eprintln!("{problem}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    match run(&arguments) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(problem) => {
            eprintln!("error: {problem}");
            ExitCode::FAILURE
        }
    }
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, String> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let mut arguments = Arguments {
        minutes: 1.0,
        seed: now.map_or(1, |time| time.as_secs()),
        json: None,
        parts: Part::ALL.to_vec(),
        case: None,
    };
    while let Some(name) = words.next() {
        let value = words.next().ok_or(format!("'{name}' has no value"))?;
        let bad = || format!("'{value}' is no value of '{name}'");
        match name.as_str() {
            "--minutes" => arguments.minutes = value.parse().map_err(|_| bad())?,
            "--seed" => arguments.seed = value.parse().map_err(|_| bad())?,
            "--json" => arguments.json = Some(value.into()),
            "--part" => arguments.parts = vec![Part::from_name(&value).ok_or_else(bad)?],
            "--case" => arguments.case = Some(value.parse().map_err(|_| bad())?),
            _ => return Err(format!("unknown option '{name}'")),
        }
    }
    match arguments {
        Arguments {
            case: Some(_),
            ref parts,
            ..
        } if parts.len() > 1 => Err("--case needs --part".into()),
        Arguments { minutes, .. } if !(0.0..1e6).contains(&minutes) => {
            Err("--minutes is out of range".into())
        }
        arguments => Ok(arguments),
    }
}

/// Runs all inputs and returns the number of failures.
fn run(arguments: &Arguments) -> Result<u64, String> {
    let folder = folder()?;
    println!("seed {}, {} minutes", arguments.seed, arguments.minutes);
    keep_panics();
    let mut parts = Vec::new();
    for &part in &arguments.parts {
        parts.extend(inputs(part, &folder)?.map(|inputs| (part, inputs, 0)));
    }
    let mut runner = Runner {
        watchdog: Watchdog::start(&folder)?,
        summary: Summary::default(),
        folder,
    };
    let mut case = Case {
        part: Part::Readers,
        seed: arguments.seed,
        number: 0,
    };
    let end = Instant::now() + Duration::from_secs_f64(60.0 * arguments.minutes);
    for (part, inputs, _) in parts.iter_mut().filter(|_| arguments.case.is_some()) {
        (case.part, case.number) = (*part, arguments.case.unwrap_or_default());
        runner.one(&case, inputs.as_mut());
    }
    // A short run has several turns of each part as well.
    let slice = SLICE.min(end.saturating_duration_since(Instant::now()) / 12);
    while arguments.case.is_none() && Instant::now() < end {
        for (part, inputs, next) in &mut parts {
            let start = Instant::now();
            while start.elapsed() < slice && Instant::now() < end {
                (case.part, case.number) = (*part, *next);
                runner.one(&case, inputs.as_mut());
                *next += 1;
            }
        }
    }
    runner.watchdog.stop();
    println!("{}", runner.summary.table());
    if let Some(path) = &arguments.json {
        let json = runner.summary.json(arguments.seed, arguments.minutes);
        let json = json.map_err(|e| e.to_string())?;
        fs::write(path, json).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(runner.summary.failures())
}

/// Data that every input needs.
struct Runner {
    watchdog: Watchdog,
    summary: Summary,
    folder: PathBuf,
}

impl Runner {
    fn one(&mut self, case: &Case, inputs: &mut dyn Inputs) {
        self.watchdog.begin(case);
        let name = format!("{}-{}-{}", case.part.name(), case.seed, case.number);
        let outcome = inputs.run(case.random(), &self.folder, &name);
        self.summary.add(case, outcome);
    }
}

/// Inputs of a part; `None` where it cannot run on this system.
fn inputs(part: Part, folder: &Path) -> Result<Option<Box<dyn Inputs>>, String> {
    Ok(Some(match part {
        Part::Readers => Box::new(Readers::new(folder.join("copies"))?),
        Part::Library => Box::new(Library::new()?),
        #[cfg(unix)]
        Part::Program => {
            let path = std::env::current_exe().map_err(|e| e.to_string())?;
            Box::new(program::Program::new(
                path.with_file_name("isograd"),
                folder,
            )?)
        }
        #[cfg(not(unix))]
        Part::Program => {
            println!("SKIPPED program: signals and limits are those of Unix");
            return Ok(None);
        }
    }))
}

/// Creates `target/fuzz`, beside the folder of this program.
fn folder() -> Result<PathBuf, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let target = program.ancestors().nth(2).unwrap_or(Path::new("target"));
    let folder = target.join("fuzz");
    fs::create_dir_all(folder.join("copies")).map_err(|e| format!("{}: {e}", folder.display()))?;
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_command_repeats_an_input() {
        let case = Case {
            part: Part::Library,
            seed: 7,
            number: 12,
        };
        let line = case.to_string();
        let words = line.split(' ').skip(3).map(String::from);
        let arguments = parse(words).expect("valid");
        assert_eq!((arguments.seed, arguments.case), (7, Some(12)));
        assert_eq!(arguments.parts, [Part::Library]);
        for wrong in [
            "--minutes",
            "--minutes x",
            "--minutes -1",
            "--case 3",
            "--part all",
            "--fast 1",
        ] {
            assert!(
                parse(wrong.split(' ').map(String::from)).is_err(),
                "{wrong}"
            );
        }
    }
}
