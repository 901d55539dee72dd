//! Links between the pages of the repository: every linked file exists.

use std::fs;
use std::path::{Path, PathBuf};

use crate::process::{self, Outcome};

/// Checks the target of every relative link in the Markdown pages.
pub fn run() -> Outcome<Vec<String>> {
    let mut broken = Vec::new();
    for page in pages()? {
        let text = fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))?;
        let folder = page.parent().unwrap_or(process::root());
        for target in targets(&text) {
            if !folder.join(target).exists() {
                broken.push(format!("{}: no file {target}", page.display()));
            }
        }
    }
    if broken.is_empty() {
        return Ok(Vec::new());
    }
    Err(format!("broken links\n  {}", broken.join("\n  ")))
}

/// Every Markdown page at the root and anywhere below `docs/`.
fn pages() -> Outcome<Vec<PathBuf>> {
    let mut pages = Vec::new();
    collect(process::root(), false, &mut pages)?;
    collect(&process::root().join("docs"), true, &mut pages)?;
    Ok(pages)
}

fn collect(folder: &Path, deep: bool, pages: &mut Vec<PathBuf>) -> Outcome {
    let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for entry in entries {
        let path = entry
            .map_err(|e| format!("{}: {e}", folder.display()))?
            .path();
        if deep && path.is_dir() {
            collect(&path, deep, pages)?;
        } else if path.extension().is_some_and(|extension| extension == "md") {
            pages.push(path);
        }
    }
    pages.sort();
    Ok(())
}

/// The relative targets of `[text](target)` and `src="target"`, without `#section`, code blocks left out.
fn targets(text: &str) -> Vec<&str> {
    let mut inside_code = false;
    let mut found = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside_code = !inside_code;
        } else if !inside_code {
            found.extend(after(line, "](", ')'));
            found.extend(after(line, "src=\"", '"'));
        }
    }
    found.retain(|target| !target.is_empty() && !target.contains("://"));
    found
}

/// The text between each `open` and the next `close`, up to a `#`.
fn after<'a>(line: &'a str, open: &'a str, close: char) -> impl Iterator<Item = &'a str> {
    line.split(open)
        .skip(1)
        .filter_map(move |rest| rest.split_once(close))
        .map(|(target, _)| target.split('#').next().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_targets_are_found_and_others_are_not() {
        let text = "See [a](docs/a.md#part), [b](https://b.org/x) and ![c](c.png).\n\
                    ```text\n[d](d.md)\n```\n<img src=\"e.png\"> [f](#here)";
        assert_eq!(targets(text), ["docs/a.md", "c.png", "e.png"]);
    }
}
