//! Samples of a mesh, for clouds that come as meshes.

use isograd_element::vector::{add, cross, norm, normalized, scale, sub};
use isograd_io::Geometry;

/// `n` points of the surface with the normals of their faces, as many per area everywhere: one in each of
/// `n` equal shares of the area, at places of the R2 low-discrepancy sequence (Roberts 2018).
///
/// `None` where the faces have no area.
pub fn resample(geometry: &Geometry, n: usize) -> Option<Geometry> {
    let corners = |face: &[u32; 3]| face.map(|v| geometry.points[v as usize]);
    let mut total = 0.0;
    let cumulative: Vec<f64> = geometry
        .faces
        .iter()
        .map(|face| {
            let [a, b, c] = corners(face);
            total += 0.5 * norm(cross(sub(b, a), sub(c, a)));
            total
        })
        .collect();
    if !(total > 0.0) || !total.is_finite() {
        return None;
    }
    let mut points = Vec::with_capacity(n);
    let mut normals = Vec::with_capacity(n);
    for i in 0..n {
        let area = (i as f64 + 0.5) / n as f64 * total;
        let face = cumulative.partition_point(|&sum| sum < area);
        let [a, b, c] = corners(&geometry.faces[face.min(geometry.faces.len() - 1)]);
        let (s, t) = in_triangle(i);
        let (ab, ac) = (sub(b, a), sub(c, a));
        points.push(add(a, add(scale(ab, s), scale(ac, t))));
        normals.push(normalized(cross(ab, ac)).unwrap_or_default());
    }
    Some(Geometry {
        points,
        normals: Some(normals),
        attributes: Vec::new(),
        faces: Vec::new(),
        dtype: geometry.dtype,
        format: geometry.format,
    })
}

/// The `i`-th place in the triangle `s, t ≥ 0, s + t ≤ 1`.
fn in_triangle(i: usize) -> (f64, f64) {
    // The plastic number: g³ = g + 1.
    const G: f64 = 1.324_717_957_244_746;
    let s = (0.5 + i as f64 / G).fract();
    let t = (0.5 + i as f64 / (G * G)).fract();
    if s + t > 1.0 {
        (1.0 - s, 1.0 - t)
    } else {
        (s, t)
    }
}

#[cfg(test)]
mod tests {
    use isograd_io::{Dtype, Format};

    use super::*;

    fn mesh(points: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Geometry {
        Geometry {
            points,
            normals: None,
            attributes: Vec::new(),
            faces,
            dtype: Dtype::F64,
            format: Format::Obj,
        }
    }

    #[test]
    fn samples_are_as_dense_on_small_faces_as_on_large_ones() {
        // Two triangles of areas 1.5 and 0.5 in the plane z = 2, one without area between them.
        let points = vec![
            [0.0, 0.0, 2.0],
            [3.0, 0.0, 2.0],
            [0.0, 1.0, 2.0],
            [-1.0, 0.0, 2.0],
        ];
        let faces = vec![[0, 1, 2], [0, 0, 2], [0, 2, 3]];
        let samples = resample(&mesh(points, faces), 4000).expect("has area");
        let right = samples.points.iter().filter(|p| p[0] > 0.0).count();
        assert_eq!(right, 3000);
        for (p, n) in samples.points.iter().zip(samples.normals.expect("normals")) {
            assert!(p[0] / 3.0 + p[1] <= 1.0 + 1e-12 && p[1] >= 0.0 && p[2] == 2.0);
            assert_eq!(n, [0.0, 0.0, 1.0]);
        }
        let mean = samples.points.iter().map(|p| p[1]).sum::<f64>() / 4000.0;
        // The centroid of either triangle is a third up; the sequence's error is far below this.
        assert!((mean - 1.0 / 3.0).abs() < 2e-3, "{mean}");
    }

    #[test]
    fn faces_without_area_give_nothing() {
        assert_eq!(
            resample(&mesh(vec![[0.0; 3]; 3], vec![[0, 1, 2]]), 10),
            None
        );
        assert_eq!(resample(&mesh(vec![[0.0; 3]; 3], Vec::new()), 10), None);
    }
}
