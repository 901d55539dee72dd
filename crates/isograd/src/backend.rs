//! Where to compute: the choice, for those who offer one. This crate computes on the CPU; `isograd-gpu` on the others.

use std::fmt;
use std::str::FromStr;

/// Where to compute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Backend {
    /// On the CPU.
    #[default]
    Cpu,
    /// On the NVIDIA device of this number, through CUDA.
    Cuda(usize),
    /// On the fastest device that Vulkan has.
    Vulkan,
    /// On a GPU if there is one, else on the CPU.
    Auto,
}

/// A text that names no backend.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no backend; give cpu, cuda (or cuda:1 for the second device), vulkan or auto")]
pub struct UnknownBackend(String);

impl FromStr for Backend {
    type Err = UnknownBackend;

    fn from_str(text: &str) -> Result<Self, UnknownBackend> {
        let unknown = || UnknownBackend(text.into());
        match text {
            "cpu" => Ok(Self::Cpu),
            "cuda" => Ok(Self::Cuda(0)),
            "vulkan" => Ok(Self::Vulkan),
            "auto" => Ok(Self::Auto),
            _ => {
                let number = text.strip_prefix("cuda:").ok_or_else(unknown)?;
                number.parse().map(Self::Cuda).map_err(|_| unknown())
            }
        }
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cpu => f.write_str("cpu"),
            Self::Cuda(0) => f.write_str("cuda"),
            Self::Cuda(number) => write!(f, "cuda:{number}"),
            Self::Vulkan => f.write_str("vulkan"),
            Self::Auto => f.write_str("auto"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backend_reads_back_from_its_name() {
        use Backend::{Auto, Cpu, Cuda, Vulkan};
        for backend in [Cpu, Cuda(0), Cuda(3), Vulkan, Auto] {
            assert_eq!(backend.to_string().parse(), Ok(backend));
        }
        for text in ["", "gpu", "cuda:", "cuda:-1", "CPU", "vulkan:0"] {
            let error = text.parse::<Backend>().expect_err(text).to_string();
            assert!(error.contains("vulkan or auto"), "{error}");
        }
    }
}
