//! NVRTC from PyPI, which compiles CUDA kernels to PTX without a GPU, below the target folder.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::environment::{self, Stamp};
use crate::process::{self, Outcome};
use crate::workspace::Workspace;

/// An installation of NVRTC and the CUDA headers.
pub struct Nvrtc {
    /// Holds the folder `nvidia` of the wheels.
    pub folder: PathBuf,
}

impl Nvrtc {
    /// Installs the packages in `requirements.txt`, once.
    pub fn fetch() -> Outcome<Self> {
        let folder = Workspace::load()?.target.join("xtask").join("nvrtc");
        let requirements = process::root().join("crates/isograd-gpu/tests/ptx/requirements.txt");
        let text = fs::read_to_string(&requirements)
            .map_err(|e| format!("{}: {e}", requirements.display()))?;
        let stamp = Stamp::new(folder.join("installed-requirements.txt"), text);
        if !stamp.is_current() {
            println!("fetching NVRTC");
            environment::remove_folder(&folder)?;
            let mut pip = Command::new(environment::interpreter()?);
            pip.args(["-m", "pip", "install", "--quiet", "--no-deps"])
                .args(["--disable-pip-version-check", "--only-binary", ":all:"])
                .arg("--target")
                .arg(&folder)
                .arg("--requirement")
                .arg(requirements);
            environment::capture(&mut pip)
                .map_err(|output| environment::reason(&output).to_string())?;
            stamp.write()?;
        }
        Ok(Self { folder })
    }

    /// Sets the search paths of a command whose tests need NVRTC.
    pub fn set_paths(&self, command: &mut Command) {
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
