//! Child processes, run from the root of the repository.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// A result whose error is a message for the user.
pub type Outcome<T = ()> = Result<T, String>;

/// `cargo ARGUMENTS`, with the cargo that runs this program.
pub fn cargo<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(arguments).current_dir(root());
    if is_first_build() {
        command.env("CARGO_INCREMENTAL", "0");
    }
    command
}

/// Whether there are no incremental builds of the library here, as in a fresh clone. What makes later builds quick costs
/// the first one a sixth more.
fn is_first_build() -> bool {
    let chosen = std::env::var_os("CARGO_INCREMENTAL").is_some();
    let program = std::env::current_exe().ok();
    let folder = program.and_then(|program| Some(program.parent()?.join("incremental")));
    let entries = folder.and_then(|folder| std::fs::read_dir(folder).ok());
    let of_library = |name: std::ffi::OsString| name.to_string_lossy().starts_with("isograd-");
    let is_built =
        entries.is_some_and(|entries| entries.flatten().any(|entry| of_library(entry.file_name())));
    !chosen && !is_built
}

/// The root of the repository.
pub fn root() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here)
}

/// Runs a command and waits for its end.
pub fn run(command: &mut Command) -> Outcome {
    let status = command
        .status()
        .map_err(|error| could_not_start(command, &error))?;
    if status.success() {
        return Ok(());
    }
    Err(format!("`{}` ended with {status}", shown(command)))
}

/// Runs a command and passes on each line of its standard output as it arrives.
pub fn run_by_line(command: &mut Command, mut line: impl FnMut(&str)) -> Outcome {
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| could_not_start(command, &error))?;
    if let Some(output) = child.stdout.take() {
        // Tests may print bytes that are not UTF-8.
        for bytes in BufReader::new(output).split(b'\n') {
            let bytes = bytes.map_err(|error| format!("`{}`: {error}", shown(command)))?;
            line(String::from_utf8_lossy(&bytes).trim_end_matches('\r'));
        }
    }
    let status = child
        .wait()
        .map_err(|error| format!("`{}`: {error}", shown(command)))?;
    if status.success() {
        return Ok(());
    }
    Err(format!("`{}` ended with {status}", shown(command)))
}

/// The command as typed in a shell.
fn shown(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let name = program.file_name().unwrap_or(command.get_program());
    std::iter::once(name)
        .chain(command.get_args())
        .map(|part| part.to_string_lossy())
        .collect::<Vec<_>>()
        .join(" ")
}

fn could_not_start(command: &Command, error: &std::io::Error) -> String {
    format!("`{}` could not be started: {error}", shown(command))
}
