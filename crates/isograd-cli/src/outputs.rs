//! Output files of a reconstruction, checked before the work begins.

use std::io::Write;
use std::path::{Path, PathBuf};

use isograd::Verdict;
use isograd_io::atomic::is_standard_output;
use isograd_io::{FIELD_EXTENSIONS, MESH_EXTENSIONS, check_output, has_extension};
use serde::Serialize;

use crate::args;
use crate::error::Error;
use crate::streams::reserve_stdout;

/// Extensions of the points file.
const POINTS_EXTENSIONS: &[&str] = &["ply", "npz"];

/// Paths of the output files; the flag of a file takes precedence over the folder.
#[derive(Debug)]
pub struct Outputs {
    folder: Option<PathBuf>,
    /// The surface.
    pub mesh: Option<PathBuf>,
    /// The field.
    pub sdf: Option<PathBuf>,
    /// The samples.
    pub points: Option<PathBuf>,
    /// The report.
    pub report: Option<PathBuf>,
    /// The slices.
    pub plot: Option<PathBuf>,
    /// The views.
    pub picture: Option<PathBuf>,
}

impl Outputs {
    /// The outputs for one of the clouds: `{}` in their names stands for `stem`. Those of `several` clouds must hold it, or
    /// are in a subfolder of that name.
    ///
    /// # Errors
    /// [`Error::Usage`] for no output at all, a wrong extension, a repeated name, or the name of the input;
    /// [`Error::File`] for a missing folder.
    pub fn new(
        args: &args::Reconstruct,
        input: &Path,
        stem: &str,
        several: bool,
    ) -> Result<Self, Error> {
        let folder = folder_for(args, stem, several)?;
        let file = |given: &Option<PathBuf>| {
            let file = given.as_deref().map(|path| file_for(path, stem, several));
            file.transpose()
        };
        let pick = |given: &Option<PathBuf>, name: &str| {
            let in_folder = || folder.as_ref().map(|folder| folder.join(name));
            Ok::<_, Error>(file(given)?.or_else(in_folder))
        };
        let outputs = Self {
            mesh: pick(&args.mesh, "mesh.ply")?,
            sdf: pick(&args.sdf, "sdf.vti")?,
            points: pick(&args.points, "points.ply")?,
            report: pick(&args.report, "report.json")?,
            plot: pick(&args.plot, "slices.png")?,
            picture: file(&args.picture)?,
            folder,
        };
        if outputs.all().next().is_none() {
            return Err(Error::Usage(
                "no output is named; give -o DIR for all files, or a FILE to --mesh, --sdf, --points, --report, --plot or --picture".into(),
            ));
        }
        outputs.check_names(input)?;
        outputs.check_folders()?;
        Ok(outputs)
    }

    /// The files.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.all().map(|(path, _)| path)
    }

    /// Whether all files exist, and none is older than the input. Files are written whole or not at all.
    pub fn are_up_to_date(&self, input: &Path) -> bool {
        let modified = |path: &Path| {
            std::fs::metadata(path)
                .and_then(|file| file.modified())
                .ok()
        };
        let begin = modified(input);
        self.files()
            .all(|path| path.is_file() && modified(path) >= begin)
    }

    /// Whether the report of an earlier run, if it is one of the files, has the verdict `bad`.
    pub fn were_bad(&self) -> bool {
        let text = self
            .report
            .as_ref()
            .and_then(|path| std::fs::read(path).ok());
        let report = text.and_then(|text| serde_json::from_slice::<serde_json::Value>(&text).ok());
        report.is_some_and(|report| report["verdict"] == Verdict::Bad.name())
    }

    fn all(&self) -> impl Iterator<Item = (&Path, &'static [&'static str])> {
        let files: [(&Option<PathBuf>, &'static [&'static str]); 6] = [
            (&self.mesh, MESH_EXTENSIONS),
            (&self.sdf, FIELD_EXTENSIONS),
            (&self.points, POINTS_EXTENSIONS),
            (&self.report, &["json"]),
            (&self.plot, &["png"]),
            (&self.picture, &["png"]),
        ];
        files
            .into_iter()
            .filter_map(|(path, endings)| Some((path.as_deref()?, endings)))
    }

    fn check_names(&self, input: &Path) -> Result<(), Error> {
        let mut seen: Vec<PathBuf> = Vec::new();
        for (path, endings) in self.all() {
            check_extension(path, endings)?;
            check_not_input(path, input)?;
            let name = canonical(path);
            if seen.contains(&name) {
                return Err(Error::Usage(format!(
                    "{} is the name of two outputs; give each its own",
                    path.display()
                )));
            }
            seen.push(name);
        }
        Ok(())
    }

    /// Checks the folders: that of `-o` may be missing, any other must exist.
    fn check_folders(&self) -> Result<(), Error> {
        if let Some(folder) = &self.folder
            && folder.exists()
            && !folder.is_dir()
        {
            return Err(Error::Usage(format!(
                "{} is a file; -o takes a folder",
                folder.display()
            )));
        }
        // That of several clouds is to hold a folder for each.
        let outer = self.folder.as_deref().and_then(Path::parent);
        if let Some(outer) = outer.filter(|outer| outer.exists() && !outer.is_dir()) {
            return Err(Error::Usage(format!(
                "{} is a file; -o takes a folder",
                outer.display()
            )));
        }
        let missing = self.folder.as_ref().filter(|folder| !folder.exists());
        for (path, endings) in self.all() {
            let is_created = missing.is_some_and(|folder| path.parent() == Some(folder));
            if !is_created {
                check_output(path, endings)?;
            }
        }
        Ok(())
    }

    /// Creates the folder of `-o`.
    pub fn create_folder(&self) -> Result<(), Error> {
        self.folder.as_deref().map_or(Ok(()), create_folder)
    }
}

/// Creates a folder, and those that it is in, unless they exist.
pub fn create_folder(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|source| {
        Error::File(isograd_io::Error::Write {
            file: folder.display().to_string(),
            source,
        })
    })
}

/// Checks the extension of a name; `-` is standard output, which must not be a terminal unless the file is JSON.
pub fn check_extension(path: &Path, endings: &[&str]) -> Result<(), Error> {
    if is_standard_output(path) {
        return reserve_stdout(path, endings == ["json"]);
    }
    if has_extension(path, endings) {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{}: the name must end in .{}",
        path.display(),
        endings.join(" or .")
    )))
}

/// Checks that an output is not the input, under whatever name.
pub fn check_not_input(path: &Path, input: &Path) -> Result<(), Error> {
    if is_standard_output(path) || canonical(path) != canonical(input) && !is_same_file(path, input)
    {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{} is the input; write to another file or folder",
        path.display()
    )))
}

/// The folder of `-o` for the cloud `stem`.
fn folder_for(
    args: &args::Reconstruct,
    stem: &str,
    several: bool,
) -> Result<Option<PathBuf>, Error> {
    let Some(folder) = &args.output else {
        return Ok(None);
    };
    if is_standard_output(folder) {
        return Err(Error::Usage(
            "-o takes a folder; standard output takes one file: --mesh -, --sdf -, --points - or --report -".into(),
        ));
    }
    Ok(Some(match named(folder, stem) {
        Some(folder) => folder,
        None if several => folder.join(stem),
        None => folder.clone(),
    }))
}

/// The path of an output for the cloud `stem`.
fn file_for(path: &Path, stem: &str, several: bool) -> Result<PathBuf, Error> {
    match named(path, stem) {
        Some(path) => Ok(path),
        None if several => Err(Error::Usage(format!(
            "{} would be written once for every cloud; write {{}} into its name, which stands for the name of the cloud, or give -o DIR",
            path.display()
        ))),
        None => Ok(path.into()),
    }
}

/// A path with `stem` for every `{}`; `None` without any.
fn named(path: &Path, stem: &str) -> Option<PathBuf> {
    let text = path.to_str().filter(|text| text.contains("{}"))?;
    Some(text.replace("{}", stem).into())
}

/// The canonical path of a file, which may not exist yet.
pub fn canonical(path: &Path) -> PathBuf {
    isograd_io::atomic::resolve(path).unwrap_or_else(|_| path.to_path_buf())
}

/// Whether two paths lead to one file, such as hard links.
#[cfg(unix)]
fn is_same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |path: &Path| std::fs::metadata(path).map(|file| (file.dev(), file.ino()));
    matches!((place(a), place(b)), (Ok(a), Ok(b)) if a == b)
}

/// Hard links are not found out here.
#[cfg(not(unix))]
fn is_same_file(_: &Path, _: &Path) -> bool {
    false
}

/// Writes a report as indented JSON, atomically.
pub fn write_report(path: &Path, report: &impl Serialize) -> Result<(), Error> {
    isograd_io::atomic::write(path, |out| {
        serde_json::to_writer_pretty(&mut *out, report)?;
        out.write_all(b"\n")
    })?;
    Ok(())
}
