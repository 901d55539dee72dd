//! Runs every example in an empty folder of its own.

use std::fs;
use std::process::Command;

use crate::environment;
use crate::process::{self, Outcome};
use crate::workspace::Workspace;

/// Runs all examples, which the last build made. None of them takes arguments.
pub fn run() -> Outcome<Vec<String>> {
    let workspace = Workspace::load()?;
    if workspace.examples.is_empty() {
        return Ok(vec!["SKIPPED examples: there are none".to_owned()]);
    }
    for name in &workspace.examples {
        println!("example {name}");
        let folder = workspace.target.join("xtask").join("examples").join(name);
        environment::remove_folder(&folder)?;
        fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
        let program = workspace.target.join("debug").join("examples").join(file);
        process::run(Command::new(program).current_dir(&folder))?;
    }
    Ok(Vec::new())
}
