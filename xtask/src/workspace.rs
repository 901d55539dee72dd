//! What cargo knows of the workspace.

use std::path::PathBuf;

use serde_json::Value;

use crate::process::{self, Outcome};

/// The target folder and the names of all examples.
pub struct Workspace {
    /// Where cargo puts what it builds.
    pub target: PathBuf,
    /// Names of the examples of every package, sorted.
    pub examples: Vec<String>,
}

impl Workspace {
    /// Asks cargo.
    pub fn load() -> Outcome<Self> {
        let mut command = process::cargo(["metadata", "--no-deps", "--format-version", "1"]);
        let output = command
            .output()
            .map_err(|error| format!("`cargo metadata` could not be started: {error}"))?;
        if !output.status.success() {
            let reason = String::from_utf8_lossy(&output.stderr);
            return Err(format!("`cargo metadata` failed: {reason}"));
        }
        let metadata: Value = serde_json::from_slice(&output.stdout)
            .map_err(|error| format!("`cargo metadata` printed no JSON: {error}"))?;
        let target = metadata["target_directory"]
            .as_str()
            .ok_or("`cargo metadata` names no target folder")?;
        Ok(Self {
            target: PathBuf::from(target),
            examples: examples(&metadata),
        })
    }
}

fn examples(metadata: &Value) -> Vec<String> {
    let mut names: Vec<String> = each(&metadata["packages"])
        .flat_map(|package| each(&package["targets"]))
        .filter(|target| each(&target["kind"]).any(|kind| kind == "example"))
        .filter_map(|target| target["name"].as_str().map(str::to_owned))
        .collect();
    names.sort();
    names
}

fn each(list: &Value) -> impl Iterator<Item = &Value> {
    list.as_array().into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_of_every_package_are_found() {
        let metadata = serde_json::json!({"packages": [
            {"targets": [{"name": "b", "kind": ["example"]}, {"name": "x", "kind": ["lib"]}]},
            {"targets": [{"name": "a", "kind": ["example"]}]},
        ]});
        assert_eq!(examples(&metadata), ["a", "b"]);
        assert!(examples(&Value::Null).is_empty());
    }
}
