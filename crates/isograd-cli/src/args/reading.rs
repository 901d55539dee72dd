//! Arguments of every command that reads files.

use std::path::Path;

use clap::Args;
use isograd_io::{Attributes, Columns, Geometry, Limits, NotFinite, ReadOptions, parse_size};

/// Limit on memory.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Reading")]
pub struct MemoryArgs {
    /// Memory that reading a file may take, such as 512M or 4G [default: 64 times the size of the file, at least 64M]
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub max_memory: Option<u64>,
}

impl MemoryArgs {
    /// Options of a reader that needs points, normals, sensors and faces.
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            limits: Limits {
                memory: self.max_memory,
            },
            attributes: Attributes::Sensors,
            ..ReadOptions::default()
        }
    }
}

/// Limit on memory, and columns of text files.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Reading")]
pub struct ReadingArgs {
    /// Limit on memory.
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// Columns of x, y and z in a text file, by name or by number from 1 [default: from the header, or 1,2,3]
    #[arg(long, value_name = "A,B,C", value_parser = columns)]
    pub columns: Option<[String; 3]>,
    /// Columns of the normals in a text file
    #[arg(long, value_name = "A,B,C", value_parser = columns)]
    pub normal_columns: Option<[String; 3]>,
}

impl ReadingArgs {
    /// Reads a cloud with these attributes. Normals that are not finite are left out where they are not used.
    ///
    /// # Errors
    /// An error of the reader.
    pub fn read(
        &self,
        cloud: &Path,
        attributes: Attributes,
        uses_normals: bool,
    ) -> Result<Geometry, isograd_io::Error> {
        let options = ReadOptions {
            not_finite: match uses_normals {
                true => NotFinite::Refuse,
                false => NotFinite::KeepNormals,
            },
            ..self.options(attributes)
        };
        let mut geometry = options.read_geometry(cloud)?;
        if !geometry.has_finite_normals() {
            geometry.normals = None;
        }
        Ok(geometry)
    }

    /// Options of a reader that keeps these attributes.
    pub fn options(&self, attributes: Attributes) -> ReadOptions {
        ReadOptions {
            columns: Columns {
                points: self.columns.clone(),
                normals: self.normal_columns.clone(),
            },
            attributes,
            ..self.memory.options()
        }
    }
}

/// Three names or numbers with commas between them.
fn columns(text: &str) -> Result<[String; 3], String> {
    let columns: Vec<String> = text.split(',').map(|name| name.trim().into()).collect();
    <[String; 3]>::try_from(columns)
        .ok()
        .filter(|columns| columns.iter().all(|name| !name.is_empty()))
        .ok_or_else(|| format!("'{text}' is not A,B,C, such as 2,3,4 or east,north,up"))
}
