//! A mesh as GLB.

use std::io::{self, Write};

use isograd::{Mesh, Real};

use super::{BINARY, JSON, MAGIC};
use crate::bytes::write_reals;

/// Writes a mesh in single precision, with its vertices as they are: viewers show the y axis upward.
pub(crate) fn write_mesh<T: Real>(out: &mut impl Write, mesh: &Mesh<T>) -> io::Result<()> {
    let refuse = |problem: &str| Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    let vertices = || mesh.vertices().iter().map(|v| v.map(|x| x.f64() as f32));
    // Readers want the bounding box.
    let (mut lower, mut upper) = ([f32::MAX; 3], [f32::MIN; 3]);
    for vertex in vertices() {
        for axis in 0..3 {
            lower[axis] = lower[axis].min(vertex[axis]);
            upper[axis] = upper[axis].max(vertex[axis]);
        }
    }
    if lower.iter().chain(&upper).any(|x| x.is_infinite()) {
        return refuse("a vertex is too large for single precision");
    }
    // Arrays of no values are not allowed.
    let is_empty = mesh.vertices().is_empty() || mesh.faces().is_empty();
    let faces = if is_empty { &[] } else { mesh.faces() };
    let points = if is_empty { 0 } else { mesh.vertices().len() };
    let (lengths, total) = ([12 * points, 12 * faces.len()], 12 * (points + faces.len()));
    let mut json = String::from(r#"{"asset":{"version":"2.0","generator":"isograd"}"#);
    if !is_empty {
        json += &format!(
            r#","scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],"buffers":[{{"byteLength":{total}}}],"bufferViews":[{{"buffer":0,"byteLength":{},"target":34962}},{{"buffer":0,"byteOffset":{},"byteLength":{},"target":34963}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{points},"type":"VEC3","min":{lower:?},"max":{upper:?}}},{{"bufferView":1,"componentType":5125,"count":{},"type":"SCALAR"}}]"#,
            lengths[0],
            lengths[0],
            lengths[1],
            3 * faces.len()
        );
    }
    json.push('}');
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let word = |n: usize| u32::try_from(n).map(u32::to_le_bytes);
    let (Ok(file), Ok(head), Ok(body)) =
        (word(28 + json.len() + total), word(json.len()), word(total))
    else {
        return refuse("GLB cannot hold more than 4 GiB; choose another format");
    };
    for part in [
        MAGIC,
        &2u32.to_le_bytes(),
        &file,
        &head,
        JSON,
        json.as_bytes(),
        &body,
        BINARY,
    ] {
        out.write_all(part)?;
    }
    write_reals(out, vertices().take(points).flatten())?;
    for corner in faces.iter().flatten() {
        out.write_all(&corner.to_le_bytes())?;
    }
    Ok(())
}
