//! ImageData: a field on a grid.
//!
//! In VTK the first axis is fastest, in [`Field`] the last; `Origin` is the position of the first point,
//! the center of the first cell of a [`Field`].

use std::io::{self, Write};

use isograd::{Field, Real};

use super::data::{DataArray, VtkFile};
use super::xml::Node;
use crate::bytes::{push_real, scalar_name, size};
use crate::error::Error;
use crate::field::{FieldFile, field_file};
use crate::format::Format;
use crate::source::Input;

/// Reads a field: the scalar array `sdf`, or the only one, of the point data or, if there are none, of
/// the cell data (values at the cell centers). Cells must be cubes aligned with the axes.
pub(crate) fn read(input: &Input) -> Result<FieldFile, Error> {
    let file = VtkFile::open(input, "ImageData")?;
    let image = file.data_set("ImageData")?;
    let bad = |problem: String| file.error(image, problem);
    let extent: [f64; 6] = file.numbers(image, "WholeExtent", None)?;
    let origin: [f64; 3] = file.numbers(image, "Origin", Some([0.0; 3]))?;
    let spacing: [f64; 3] = file.numbers(image, "Spacing", Some([1.0; 3]))?;
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    if file.numbers(image, "Direction", Some(identity))? != identity {
        return Err(bad(
            "the axes are rotated (Direction); resample along x, y and z".into(),
        ));
    }
    let h = spacing[0];
    // Spacings that went through decimal text may differ in their last digits.
    if spacing.iter().any(|s| !((s - h).abs() <= 1e-6 * h.abs())) {
        return Err(bad(format!(
            "the cells are not cubes (Spacing {spacing:?}); resample the image"
        )));
    }
    let mut pieces = image.children_named("Piece");
    let (Some(piece), None) = (pieces.next(), pieces.next()) else {
        return Err(bad(
            "the image has several pieces or none; save it in one piece".into(),
        ));
    };
    if file.numbers(piece, "Extent", Some(extent))? != extent {
        return Err(bad(
            "the piece does not cover WholeExtent; save it in one piece".into(),
        ));
    }
    let points =
        shape(extent).ok_or_else(|| bad(format!("WholeExtent {extent:?} is not a box")))?;
    let (array, node, is_cells) = scalar_array(&file, piece)?;
    let half = if is_cells { 0.5 } else { 0.0 };
    let shape = points.map(|n| n - usize::from(is_cells));
    let origin = std::array::from_fn(|a| origin[a] + h * (extent[2 * a] + half));
    let count = shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
    if count != Some(array.count) {
        let problem = format!(
            "{} values for {shape:?} samples; the file is cut short or its extent is wrong",
            array.count
        );
        return Err(file.error(node, problem));
    }
    let mut values = input
        .memory
        .filled(array.count)
        .map_err(|problem| file.error(node, problem))?;
    file.read(node, &array, |at, value| {
        values[last_axis_fastest(at, shape)] = value;
    })?;
    field_file(origin, h, shape, values, array.dtype, Format::Vti)
        .map_err(|problem| file.error(node, problem))
}

/// Number of points along each axis.
fn shape(extent: [f64; 6]) -> Option<[usize; 3]> {
    let mut shape = [0; 3];
    for axis in 0..3 {
        let steps = extent[2 * axis + 1] - extent[2 * axis];
        if !(0.0..1e9).contains(&steps) || steps.fract() != 0.0 {
            return None;
        }
        shape[axis] = steps as usize + 1;
    }
    Some(shape)
}

/// Selects the array to read; the flag says whether it is cell data.
fn scalar_array<'a, 'n>(
    file: &VtkFile<'a>,
    piece: &'n Node,
) -> Result<(DataArray<'a>, &'n Node, bool), Error> {
    for (section, is_cells) in [("PointData", false), ("CellData", true)] {
        let Some(data) = piece.child(section) else {
            continue;
        };
        let arrays: Vec<&Node> = data.children_named("DataArray").collect();
        let named = |name: &str| {
            let mut nodes = arrays.iter().copied();
            nodes.find(|node| node.attribute("Name") == Some(name))
        };
        let only = (arrays.len() == 1).then(|| arrays[0]);
        let active = data.attribute("Scalars").and_then(named);
        if let Some(node) = named("sdf").or(only).or(active) {
            let array = file.array(node)?;
            if array.components != 1 {
                return Err(
                    file.error(node, "the array has several components; a distance has one")
                );
            }
            return Ok((array, node, is_cells));
        }
    }
    Err(file.error(
        piece,
        "no scalar array is called 'sdf', and there is not exactly one array",
    ))
}

/// Index with the last axis fastest of the value `at` with the first axis fastest.
fn last_axis_fastest(at: usize, [nx, ny, nz]: [usize; 3]) -> usize {
    let (i, j, k) = (at % nx, at / nx % ny, at / nx / ny);
    (i * ny + j) * nz + k
}

/// Writes a field as point data `sdf`, a raw appended array of type `T`.
pub(crate) fn write<T: Real>(out: &mut impl Write, field: &Field<T>) -> io::Result<()> {
    let grid = field.grid();
    let [nx, ny, nz] = grid.shape();
    let [x, y, z] = grid.center_f64([0; 3]);
    let h = grid.spacing().f64();
    let extent = format!("0 {} 0 {} 0 {}", nx - 1, ny - 1, nz - 1);
    let real = scalar_name::<T>(["Float32", "Float64"]);
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
  <ImageData WholeExtent="{extent}" Origin="{x:?} {y:?} {z:?}" Spacing="{h:?} {h:?} {h:?}">
    <Piece Extent="{extent}">
      <PointData Scalars="sdf">
        <DataArray type="{real}" Name="sdf" format="appended" offset="0"/>
      </PointData>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
_"#
    )?;
    out.write_all(&((grid.cells() * size::<T>()) as u64).to_le_bytes())?;
    write_first_axis_fastest(out, field)?;
    out.write_all(b"\n  </AppendedData>\n</VTKFile>\n")
}

/// Writes the values with the first axis fastest, several planes at once to use each cache line fully.
fn write_first_axis_fastest<T: Real>(out: &mut impl Write, field: &Field<T>) -> io::Result<()> {
    const PLANES: usize = 16;
    let [nx, ny, nz] = field.grid().shape();
    let values = field.values();
    let mut planes: Vec<Vec<u8>> = vec![Vec::new(); PLANES.min(nz)];
    for first in (0..nz).step_by(PLANES) {
        let count = PLANES.min(nz - first);
        for j in 0..ny {
            for i in 0..nx {
                let row = (i * ny + j) * nz + first;
                for (plane, &value) in planes.iter_mut().zip(&values[row..row + count]) {
                    push_real(plane, value);
                }
            }
        }
        for plane in &mut planes {
            out.write_all(plane)?;
            plane.clear();
        }
    }
    Ok(())
}
