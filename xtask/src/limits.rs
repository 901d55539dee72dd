//! Limits on the sources: at most 8 parameters a function, `self` included, and about 400 lines a file.
//!
//! Clippy checks parameters too, but does not see the functions that macros take as input, such as GPU kernels.

use std::fs;
use std::path::{Path, PathBuf};

use crate::process::{self, Outcome};

const PARAMETERS: usize = 8;
const LINES: usize = 400;
/// Folders with Rust sources.
const FOLDERS: [&str; 5] = ["benches", "bindings", "crates", "fuzz", "xtask"];

/// Fails if a function has too many parameters; prints files that are too long.
pub fn run() -> Outcome<Vec<String>> {
    let mut files = Vec::new();
    for folder in FOLDERS {
        collect(&process::root().join(folder), &mut files)?;
    }
    files.sort();
    let mut offenders = Vec::new();
    for path in files {
        let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let name = path.strip_prefix(process::root()).unwrap_or(&path);
        let lines = text.lines().count();
        if lines > LINES {
            println!("warning: {} has {lines} lines", name.display());
        }
        for function in functions(&text) {
            if function.parameters > PARAMETERS {
                offenders.push(format!(
                    "{}:{}: `{}` has {} parameters",
                    name.display(),
                    function.line,
                    function.name,
                    function.parameters
                ));
            }
        }
    }
    if offenders.is_empty() {
        return Ok(Vec::new());
    }
    Err(format!(
        "{} functions have more than {PARAMETERS} parameters\n  {}",
        offenders.len(),
        offenders.join("\n  ")
    ))
}

/// Every `.rs` file in a folder and its subfolders.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Outcome {
    let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

#[derive(Debug, PartialEq)]
struct Function {
    name: String,
    /// Counted from 1.
    line: usize,
    parameters: usize,
}

/// Every `fn name(…)` of a source, in order, inside macros as well.
fn functions(source: &str) -> Vec<Function> {
    let text = blank_comments_and_literals(source);
    let mut functions = Vec::new();
    for (start, _) in text.match_indices("fn ") {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        if text[..start].ends_with(is_word) {
            continue;
        }
        let rest = text[start + 3..].trim_start();
        let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        let (name, rest) = rest.split_at(end);
        if name.is_empty() {
            continue;
        }
        functions.push(Function {
            name: name.to_owned(),
            line: text[..start].matches('\n').count() + 1,
            parameters: parameters(rest),
        });
    }
    functions
}

/// Number of parameters in `<generics>(parameters)…`.
fn parameters(signature: &str) -> usize {
    let mut depth = 0;
    let (mut inside, mut commas, mut pending) = (false, 0, false);
    let mut previous = ' ';
    for c in signature.chars() {
        match c {
            '(' if depth == 0 && !inside => inside = true,
            '(' | '[' | '{' | '<' => {
                depth += 1;
                pending = true;
            }
            ')' if depth == 0 => return commas + usize::from(pending),
            '>' if matches!(previous, '-' | '=') => {}
            ')' | ']' | '}' | '>' => depth -= 1,
            ',' if depth == 0 && inside => {
                commas += 1;
                pending = false;
            }
            _ => pending |= inside && !c.is_whitespace(),
        }
        // What the generics hold is no parameter.
        pending &= inside;
        previous = c;
    }
    0
}

/// The source with comments and literals replaced by spaces; line breaks stay.
fn blank_comments_and_literals(source: &str) -> String {
    let characters: Vec<char> = source.chars().collect();
    let mut text = String::with_capacity(source.len());
    let mut i = 0;
    while i < characters.len() {
        let end = literal_end(&characters, i);
        for &c in &characters[i..end] {
            text.push(if c == '\n' { '\n' } else { ' ' });
        }
        if end == i {
            text.push(characters[i]);
            i += 1;
        }
        i = i.max(end);
    }
    text
}

/// The end of the comment or literal that begins at `i`, or `i` if none does.
fn literal_end(text: &[char], i: usize) -> usize {
    let at = |k: usize| text.get(k).copied().unwrap_or('\0');
    let find = |from: usize, good: &dyn Fn(usize) -> bool| {
        (from..text.len()).find(|&k| good(k)).unwrap_or(text.len())
    };
    match at(i) {
        '/' if at(i + 1) == '/' => find(i, &|k| at(k) == '\n'),
        '/' if at(i + 1) == '*' => {
            (find(i + 2, &|k| at(k) == '*' && at(k + 1) == '/') + 2).min(text.len())
        }
        'r' if at(i + 1) == '#' && at(i + 2) == '"' => {
            (find(i + 3, &|k| at(k) == '"' && at(k + 1) == '#') + 2).min(text.len())
        }
        '"' => {
            let mut k = i + 1;
            while k < text.len() && at(k) != '"' {
                k += if at(k) == '\\' { 2 } else { 1 };
            }
            (k + 1).min(text.len())
        }
        // A character, not a lifetime.
        '\'' if at(i + 1) == '\\' => (find(i + 3, &|k| at(k) == '\'') + 1).min(text.len()),
        '\'' if at(i + 2) == '\'' => i + 3,
        _ => i,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = r##"
// fn comment(a: A, b: B) {}
fn none() -> u8 { let s = "fn text(a, b, c)"; let c = '"'; 1 }
#[cube(launch)]
pub fn kernel<F: Fn(u8, u8) -> u8, const N: usize>(
    /* (a, b, */ points: &Array<Vector<F, 3>>,
    pair: (u8, [u8; 3]),
    #[comptime] options: Options<(A, B)>, // a, b
) {}
macro_rules! m { () => { fn inner(&'a self, f: impl Fn(A, B) -> C) {} } }
type Pointer = fn(u8, u8);
"##;

    #[test]
    fn parameters_are_counted_inside_macros_and_without_generics() {
        let counted: Vec<(String, usize, usize)> = functions(SOURCE)
            .into_iter()
            .map(|function| (function.name, function.line, function.parameters))
            .collect();
        let expected = [("none", 3, 0), ("kernel", 5, 3), ("inner", 10, 2)];
        assert_eq!(
            counted,
            expected.map(|(name, line, count)| (name.to_owned(), line, count))
        );
    }
}
