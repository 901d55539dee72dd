//! Real clouds and their meshes in `../shared/data`.

use std::path::{Path, PathBuf};

/// The folder, or `None` after saying that the test is skipped.
pub fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !folder.is_dir() {
        println!("SKIPPED: ../shared/data is absent");
        return None;
    }
    Some(folder)
}

/// All clouds, clean and degraded; none after saying that the test is skipped.
pub fn clouds() -> Vec<PathBuf> {
    let Some(folder) = folder() else {
        return Vec::new();
    };
    let entries = std::fs::read_dir(folder).expect("readable");
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let is_cloud = |path: &PathBuf| path.to_string_lossy().ends_with(".points.ply");
    let mut clouds: Vec<PathBuf> = paths.filter(is_cloud).collect();
    clouds.sort();
    assert!(clouds.len() >= 10, "{clouds:?}");
    clouds
}
