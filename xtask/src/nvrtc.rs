//! NVRTC, which compiles the GPU's kernels to PTX on a machine without a GPU: from PyPI, below the target
//! folder.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::process::{self, Outcome};
use crate::python::{self, Stamp};
use crate::workspace::Workspace;

/// Where the tests look for it.
pub struct Nvrtc {
    folder: PathBuf,
}

impl Nvrtc {
    /// Fetches what `requirements.txt` lists, once; or why that can't be done here.
    pub fn fetch() -> Outcome<Self> {
        let folder = Workspace::load()?.target.join("xtask").join("nvrtc");
        let requirements = process::root().join("crates/isograd-gpu/tests/ptx/requirements.txt");
        let text = fs::read_to_string(&requirements)
            .map_err(|e| format!("{}: {e}", requirements.display()))?;
        let stamp = Stamp::new(folder.join("installed-requirements.txt"), text);
        if !stamp.fits() {
            println!("fetching NVRTC");
            python::remove_folder(&folder)?;
            let mut pip = Command::new(python::interpreter()?);
            pip.args(["-m", "pip", "install", "--quiet", "--no-deps"])
                .args(["--disable-pip-version-check", "--only-binary", ":all:"])
                .arg("--target")
                .arg(&folder)
                .arg("--requirement")
                .arg(requirements);
            python::capture(&mut pip).map_err(|output| python::reason(&output).to_string())?;
            stamp.write()?;
        }
        Ok(Self { folder })
    }

    /// Lets the tests that a command runs find it.
    pub fn tell(&self, command: &mut Command) {
        let nvidia = self.folder.join("nvidia");
        let mut paths = vec![nvidia.join("cuda_nvrtc/lib")];
        if let Some(others) = std::env::var_os("LD_LIBRARY_PATH") {
            paths.extend(std::env::split_paths(&others));
        }
        if let Ok(paths) = std::env::join_paths(paths) {
            command.env("LD_LIBRARY_PATH", paths);
        }
        command.env("ISOGRAD_CUDA_INCLUDE", nvidia.join("cuda_runtime/include"));
    }
}
