//! The metadata of the workspace.

use std::path::PathBuf;

use serde_json::Value;

use crate::process::{self, Outcome};

/// Paths and names from `cargo metadata`.
pub struct Workspace {
    /// Folder of all build products.
    pub target: PathBuf,
    /// Names of the examples of every package, sorted.
    pub examples: Vec<String>,
    /// Names of the packages that can be published.
    pub published: Vec<String>,
    /// Names of the default members.
    pub default_members: Vec<String>,
}

impl Workspace {
    /// Runs `cargo metadata`.
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
            .ok_or("`cargo metadata` lists no target folder")?;
        Ok(Self {
            target: PathBuf::from(target),
            examples: examples(&metadata),
            published: published(&metadata),
            default_members: default_members(&metadata),
        })
    }

    /// The program of the command line that the last build made.
    pub fn program(&self) -> PathBuf {
        let name = format!("isograd{}", std::env::consts::EXE_SUFFIX);
        self.target.join("debug").join(name)
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

/// Packages without `publish = false`, sorted.
fn published(metadata: &Value) -> Vec<String> {
    let mut names: Vec<String> = each(&metadata["packages"])
        .filter(|package| package["publish"].is_null())
        .filter_map(|package| package["name"].as_str().map(str::to_owned))
        .collect();
    names.sort();
    names
}

fn default_members(metadata: &Value) -> Vec<String> {
    let defaults = &metadata["workspace_default_members"];
    each(&metadata["packages"])
        .filter(|package| each(defaults).any(|id| *id == package["id"]))
        .filter_map(|package| package["name"].as_str().map(str::to_owned))
        .collect()
}

fn each(list: &Value) -> impl Iterator<Item = &Value> {
    list.as_array().into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_published_packages_and_default_members_are_found() {
        let metadata = serde_json::json!({"workspace_default_members": ["x#1"], "packages": [
            {"name": "isograd-x", "id": "x#1", "publish": [], "targets": [{"name": "b", "kind": ["example"]}, {"name": "x", "kind": ["lib"]}]},
            {"name": "isograd", "publish": null, "targets": [{"name": "a", "kind": ["example"]}]},
        ]});
        assert_eq!(examples(&metadata), ["a", "b"]);
        assert_eq!(published(&metadata), ["isograd"]);
        assert_eq!(default_members(&metadata), ["isograd-x"]);
        assert!(examples(&Value::Null).is_empty());
    }
}
