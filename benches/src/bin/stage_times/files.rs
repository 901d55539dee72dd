//! Folder of input and output arrays.

use std::fs;
use std::path::{Path, PathBuf};

use isograd::{Grid, Real};
use serde::Deserialize;

use isograd_benches::output::Outcome;

/// A number stored as raw little-endian bytes.
pub trait Number: Copy {
    /// Extension of its files.
    const SUFFIX: &'static str;
    /// Number from its bytes; the slice has its size.
    fn read(bytes: &[u8]) -> Self;
    /// Appends its bytes.
    fn write(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($($type:ident)*) => {$(
        impl Number for $type {
            const SUFFIX: &'static str = stringify!($type);
            fn read(bytes: &[u8]) -> Self {
                let mut own = [0; size_of::<Self>()];
                own.copy_from_slice(bytes);
                Self::from_le_bytes(own)
            }
            fn write(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    )*};
}
number!(f32 f64 u32);

/// Scalars of the input; missing ones are 0.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Settings {
    shape: [usize; 3],
    lower: [f64; 3],
    spacing: f64,
    radius: f64,
}

/// A folder and its `settings.json`.
pub struct Folder {
    path: PathBuf,
    settings: Settings,
}

impl Folder {
    /// Reads the settings.
    pub fn open(path: impl AsRef<Path>) -> Outcome<Self> {
        let path = path.as_ref().to_owned();
        let settings = serde_json::from_slice(&fs::read(path.join("settings.json"))?)?;
        Ok(Self { path, settings })
    }

    /// The grid of the settings.
    pub fn grid<T: Real>(&self) -> Outcome<Grid<T>> {
        let Settings {
            shape,
            lower,
            spacing,
            ..
        } = self.settings;
        Ok(Grid::new(lower.map(T::of), T::of(spacing), shape)?)
    }

    /// The radius of the settings.
    pub fn radius(&self) -> f64 {
        self.settings.radius
    }

    /// All numbers of `NAME.SUFFIX`.
    pub fn read<N: Number>(&self, name: &str) -> Outcome<Vec<N>> {
        let bytes = fs::read(self.file::<N>(name))?;
        Ok(bytes.chunks_exact(size_of::<N>()).map(N::read).collect())
    }

    /// `NAME.SUFFIX` as rows of three.
    pub fn read_rows<N: Number>(&self, name: &str) -> Outcome<Vec<[N; 3]>> {
        let numbers = self.read(name)?;
        Ok(numbers
            .chunks_exact(3)
            .map(|row| [row[0], row[1], row[2]])
            .collect())
    }

    /// Writes `NAME.SUFFIX`.
    pub fn write<N: Number>(&self, name: &str, numbers: impl IntoIterator<Item = N>) -> Outcome {
        let mut bytes = Vec::new();
        for number in numbers {
            number.write(&mut bytes);
        }
        Ok(fs::write(self.file::<N>(name), bytes)?)
    }

    fn file<N: Number>(&self, name: &str) -> PathBuf {
        self.path.join(format!("{name}.{}", N::SUFFIX))
    }
}
