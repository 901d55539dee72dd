//! The clouds of a run: one, several, or those of folders.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use isograd_io::Format;

use crate::args;
use crate::error::Error;

/// One of several clouds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cloud {
    /// The file.
    pub path: PathBuf,
    /// Name of the file without its extension, which names its outputs.
    pub stem: String,
}

/// The clouds of the command line.
#[derive(Debug, PartialEq, Eq)]
pub enum Inputs {
    /// A single file, or standard input.
    One(PathBuf),
    /// Several files, a folder or a sequence, in natural order: 2 before 10.
    Several(Vec<Cloud>),
}

impl Inputs {
    /// Finds the clouds. Of a folder these are the files in it, not in its subfolders, that may hold points.
    ///
    /// # Errors
    /// [`Error::Usage`] for two clouds with the same stem, and standard input among several; [`Error::File`] for a folder
    /// without clouds, or that can't be read.
    pub fn new(args: &args::Reconstruct) -> Result<Self, Error> {
        let is_folder = |path: &PathBuf| path.is_dir();
        if let [path] = &args.clouds[..]
            && !args.sequence
            && !is_folder(path)
        {
            return Ok(Self::One(path.clone()));
        }
        let mut paths = Vec::new();
        for path in &args.clouds {
            match is_folder(path) {
                true => paths.extend(clouds_in(path)?),
                false => paths.push(path.clone()),
            }
        }
        if paths.iter().any(|path| path == Path::new("-")) {
            return Err(Error::Usage(
                "standard input is one cloud, and has no name for its outputs; give '-' alone, without --sequence".into(),
            ));
        }
        let cloud = |path: PathBuf| Cloud {
            stem: stem(&path),
            path,
        };
        let mut clouds: Vec<Cloud> = paths.into_iter().map(cloud).collect();
        let key = |cloud: &Cloud| cloud.path.to_string_lossy().into_owned();
        clouds.sort_by(|a, b| natural(&key(a), &key(b)));
        check_stems(&clouds)?;
        Ok(Self::Several(clouds))
    }
}

/// Name of a file without its extension.
pub fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// The files of a folder that may hold points.
fn clouds_in(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let file = || folder.display().to_string();
    let failed = |source| isograd_io::Error::Read {
        file: file(),
        source,
    };
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_cloud = Format::from_path(&path).is_some_and(|format| format != Format::Vti);
        if is_cloud && !name.starts_with('.') && path.is_file() {
            paths.push(path);
        }
    }
    if paths.is_empty() {
        return Err(Error::File(isograd_io::Error::Format {
            file: file(),
            problem:
                "the folder has no file with points, such as .ply, .xyz or .npz; check the path"
                    .into(),
        }));
    }
    Ok(paths)
}

/// Refuses clouds whose outputs would have the same names.
fn check_stems(clouds: &[Cloud]) -> Result<(), Error> {
    // These systems have one file for names that differ in case.
    let fold = cfg!(any(windows, target_os = "macos"));
    let key = |cloud: &Cloud| match fold {
        true => cloud.stem.to_lowercase(),
        false => cloud.stem.clone(),
    };
    let mut sorted: Vec<&Cloud> = clouds.iter().collect();
    sorted.sort_by_key(|cloud| key(cloud));
    let twins = sorted.windows(2).find(|pair| key(pair[0]) == key(pair[1]));
    let Some([a, b]) = twins.and_then(|pair| pair.first_chunk::<2>()) else {
        return Ok(());
    };
    Err(Error::Usage(format!(
        "{} and {} have the same name without extension, and so would their outputs; rename one, or run them one by one",
        a.path.display(),
        b.path.display()
    )))
}

/// Natural order of names: digits are compared as numbers.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while !left.is_empty() && !right.is_empty() {
        let ((x, after_x), (y, after_y)) = (split_run(left), split_run(right));
        let is_number = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
        let order = match is_number(x) && is_number(y) {
            true => {
                let (x, y) = (x.trim_start_matches('0'), y.trim_start_matches('0'));
                x.len().cmp(&y.len()).then(x.cmp(y))
            }
            false => x.cmp(y),
        };
        if order.is_ne() {
            return order;
        }
        (left, right) = (after_x, after_y);
    }
    left.len().cmp(&right.len()).then(a.cmp(b))
}

/// Splits off the digits, or the other characters, that a text begins with.
fn split_run(text: &str) -> (&str, &str) {
    let is_digit = text.starts_with(|c: char| c.is_ascii_digit());
    let end = text.find(|c: char| c.is_ascii_digit() != is_digit);
    text.split_at(end.unwrap_or(text.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_compared_as_numbers() {
        let sorted = [
            "",
            "a",
            "a01",
            "a1",
            "a1b",
            "a2",
            "a10",
            "a10b2",
            "a10b10",
            "a/2.ply",
            "a/10.ply",
            "b",
            "frame_0009",
            "frame_0010",
            "é2",
            "é10",
        ];
        let mut names = sorted;
        names.reverse();
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, sorted);
        // A total order.
        for a in sorted {
            for b in sorted {
                assert_eq!(natural(a, b), natural(b, a).reverse(), "{a} {b}");
                assert_eq!(natural(a, b).is_eq(), a == b, "{a} {b}");
            }
        }
    }
}
