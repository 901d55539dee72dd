//! Content of a file of a field.

use isograd::{Field, Grid, Real};

use crate::format::Format;
use crate::number::Dtype;

/// A field on a grid, in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldFile {
    /// Values at the cell centers.
    pub field: Field<f64>,
    /// Number type of the values in the file.
    pub dtype: Dtype,
    /// The file's format.
    pub format: Format,
}

impl FieldFile {
    /// Converts the field to type `T`; `None` if the cell centers of its grid are not distinct in `T`.
    pub fn convert<T: Real>(&self) -> Option<Field<T>> {
        let grid = self.field.grid();
        let lower = grid.lower().map(T::of);
        let grid = Grid::new(lower, T::of(grid.spacing()), grid.shape()).ok()?;
        let values = self.field.values().iter().map(|&v| T::of(v)).collect();
        Field::new(grid, values).ok()
    }
}

/// Builds a field from the position of its first sample; the error is the problem.
pub(crate) fn field_file(
    origin: [f64; 3],
    spacing: f64,
    shape: [usize; 3],
    values: Vec<f64>,
    dtype: Dtype,
    format: Format,
) -> Result<FieldFile, String> {
    let lower = origin.map(|x| x - 0.5 * spacing);
    let grid = Grid::new(lower, spacing, shape).map_err(|e| e.to_string())?;
    if let Some(index) = values.iter().position(|v| !v.is_finite()) {
        let cell = grid.cell(index);
        return Err(format!(
            "the value of cell {cell:?} is not finite; correct it"
        ));
    }
    let field = Field::new(grid, values).map_err(|e| e.to_string())?;
    Ok(FieldFile {
        field,
        dtype,
        format,
    })
}
