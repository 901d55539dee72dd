//! The README's shell commands, run as a new user would, and the files it lists.
//!
//! Its Rust code is compiled and run as a doc test of `isograd`.

use std::fs;
use std::process::Command;

use crate::process::{self, Outcome};
use crate::workspace::Workspace;

/// The README's way to build and run the program. The tests run the program that they have built.
const PROGRAM: &str = "cargo run --release --";

/// Runs every command in the README's `sh` blocks, then checks that every `out/…` path it lists exists.
pub fn run() -> Outcome<Vec<String>> {
    let path = process::root().join("README.md");
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let program = Workspace::load()?.program();
    for command in commands(&text) {
        let command = command.replace(PROGRAM, &format!("'{}'", program.display()));
        println!("$ {command}");
        process::run(
            Command::new("sh")
                .args(["-c", &command])
                .current_dir(process::root()),
        )?;
    }
    for name in output_paths(&text) {
        if !process::root().join(name).exists() {
            return Err(format!(
                "the README lists {name}, but its commands did not write it"
            ));
        }
    }
    Ok(Vec::new())
}

/// The commands in `sh` blocks, in order, except those of `cargo xtask`, which runs this.
fn commands(text: &str) -> Vec<&str> {
    let mut inside = false;
    let mut found = Vec::new();
    for line in text.lines() {
        let line = line.trim();
        if let Some(language) = line.strip_prefix("```") {
            inside = language.trim() == "sh";
        } else if inside && is_command(line) {
            found.push(line);
        }
    }
    found
}

fn is_command(line: &str) -> bool {
    !line.is_empty() && !line.starts_with('#') && !line.starts_with("cargo xtask")
}

/// The files below `out/` in code spans of the text: `` `out/fish/mesh.ply` ``.
fn output_paths(text: &str) -> Vec<&str> {
    text.split('`')
        .filter(|part| part.starts_with("out/") && !part.contains(char::is_whitespace))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
# Title
```sh
cargo run -- a
# a remark

cargo xtask test
```
```rust
let x = 1;
```
```text
not a command
```
See `out/fish/mesh.ply` and `out of date`.
```sh
echo done
```
";

    #[test]
    fn only_lines_of_sh_blocks_are_commands() {
        assert_eq!(commands(TEXT), ["cargo run -- a", "echo done"]);
    }

    #[test]
    fn files_in_code_spans_are_found() {
        assert_eq!(output_paths(TEXT), ["out/fish/mesh.ply"]);
    }
}
