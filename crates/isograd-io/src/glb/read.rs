//! The meshes of a scene, each moved by the transforms of its nodes.

use std::collections::HashMap;

use isograd::data::Attribute;
use isograd_element::vector;

use super::accessor::{Vectors, open};
use super::buffers::Buffers;
use super::document::{self, Attributes, Document, Node, Primitive};
use crate::error::{Error, Location};
use crate::format::Format;
use crate::geometry::Geometry;
use crate::number::{Dtype, as_index};
use crate::source::Input;

/// Linear part by rows, and translation.
#[derive(Clone, Copy, PartialEq)]
struct Transform {
    linear: [[f64; 3]; 3],
    translation: [f64; 3],
}

impl Transform {
    const IDENTITY: Self = Self {
        linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
    };

    fn of(node: &Node) -> Self {
        if let Some(m) = &node.matrix {
            // By columns.
            return Self {
                linear: [0, 1, 2].map(|row| [m[row], m[row + 4], m[row + 8]]),
                translation: [m[12], m[13], m[14]],
            };
        }
        let [x, y, z, w] = node
            .rotation
            .as_deref()
            .copied()
            .unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let rotation = [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - z * w),
                2.0 * (x * z + y * w),
            ],
            [
                2.0 * (x * y + z * w),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - x * w),
            ],
            [
                2.0 * (x * z - y * w),
                2.0 * (y * z + x * w),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ];
        let scale = node.scale.as_deref().copied().unwrap_or([1.0; 3]);
        Self {
            linear: rotation.map(|row| [0, 1, 2].map(|i| row[i] * scale[i])),
            translation: node.translation.as_deref().copied().unwrap_or_default(),
        }
    }

    fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        self.linear.map(|row| vector::dot(row, v))
    }

    fn point(&self, p: [f64; 3]) -> [f64; 3] {
        match *self == Self::IDENTITY {
            // Every bit stays.
            true => p,
            false => vector::add(self.turned(p), self.translation),
        }
    }

    /// The transform of a child in the frame of this one.
    fn then(&self, child: &Self) -> Self {
        let column = |i: usize| self.turned(child.linear.map(|row| row[i]));
        let columns = [column(0), column(1), column(2)];
        Self {
            linear: [0, 1, 2].map(|row| columns.map(|column| column[row])),
            translation: self.point(child.translation),
        }
    }

    /// Cofactors of the linear part, which transform normals up to a factor, and the sign of its determinant.
    fn cofactors(&self) -> ([[f64; 3]; 3], f64) {
        let [a, b, c] = self.linear;
        let rows = [
            vector::cross(b, c),
            vector::cross(c, a),
            vector::cross(a, b),
        ];
        (
            rows,
            if vector::dot(a, rows[0]) < 0.0 {
                -1.0
            } else {
                1.0
            },
        )
    }
}

/// Reads the meshes of the default scene as one.
pub(crate) fn read(input: &Input) -> Result<Geometry, Error> {
    let (document, buffers) = document::parse(input)?;
    let mut reader = Reader {
        input,
        document: &document,
        buffers: &buffers,
        geometry: Geometry::from_points(Vec::new(), Dtype::F32, Format::Glb),
        normals: Some(Vec::new()),
        colors: Some(Default::default()),
    };
    reader.scene()?;
    let Reader {
        mut geometry,
        normals,
        colors,
        ..
    } = reader;
    if !geometry.points.is_empty() {
        geometry.normals = normals;
        let names = ["red", "green", "blue"].into_iter();
        let attribute = |(name, values): (&str, Vec<f64>)| Attribute {
            name: name.into(),
            components: 1,
            values,
        };
        geometry.attributes = names
            .zip(colors.into_iter().flatten())
            .map(attribute)
            .collect();
    }
    Ok(geometry)
}

struct Reader<'a> {
    input: &'a Input<'a>,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    geometry: Geometry,
    /// `None` as soon as a part of the mesh has none.
    normals: Option<Vec<[f64; 3]>>,
    /// Red, green and blue; likewise.
    colors: Option<[Vec<f64>; 3]>,
}

impl<'a> Reader<'a> {
    fn bad(&self, problem: impl Into<String>) -> Error {
        self.input.error(Location::Whole, problem)
    }

    /// The nodes at the top of the default scene; without scenes, those without a parent.
    fn roots(&self) -> Result<Vec<usize>, String> {
        let document = self.document;
        let (scenes, nodes) = (&document.scenes, &document.nodes);
        let scene = scenes.get(document.scene.unwrap_or(0));
        let memory = &self.input.memory;
        let mut roots =
            memory.with_capacity(scene.map_or(nodes.len(), |scene| scene.nodes.len()))?;
        match scene {
            Some(scene) => roots.extend(&scene.nodes),
            None if !scenes.is_empty() => {
                return Err("the default scene is missing; the file is damaged".into());
            }
            None => {
                let mut is_child: Vec<bool> = memory.filled(nodes.len())?;
                for &child in nodes.iter().flat_map(|node| &node.children) {
                    if let Some(is_child) = is_child.get_mut(child) {
                        *is_child = true;
                    }
                }
                roots.extend((0..nodes.len()).filter(|&node| !is_child[node]));
            }
        }
        Ok(roots)
    }

    /// Visits the nodes of the scene, or all meshes if there are no nodes. Each node may be visited once: they form trees.
    fn scene(&mut self) -> Result<(), Error> {
        let nodes = &self.document.nodes;
        if nodes.is_empty() && self.document.scenes.is_empty() {
            let mut all = 0..self.document.meshes.len();
            return all.try_for_each(|mesh| self.mesh(mesh, &Transform::IDENTITY));
        }
        let roots = self.roots().map_err(|problem| self.bad(problem))?;
        let memory = &self.input.memory;
        let mut seen: Vec<bool> = memory
            .filled(nodes.len())
            .map_err(|problem| self.bad(problem))?;
        let mut open = Vec::new();
        let (mut children, mut parent) = (roots.as_slice(), Transform::IDENTITY);
        loop {
            memory
                .make_room(&mut open, children.len())
                .map_err(|problem| self.bad(problem))?;
            open.extend(children.iter().rev().map(|&node| (node, parent)));
            let Some((index, outer)) = open.pop() else {
                return Ok(());
            };
            let node = nodes
                .get(index)
                .filter(|_| !std::mem::replace(&mut seen[index], true));
            let node = node.ok_or_else(|| {
                self.bad(format!(
                    "node {index} is missing, or has two parents; the file is damaged"
                ))
            })?;
            parent = outer.then(&Transform::of(node));
            children = &node.children;
            if let Some(mesh) = node.mesh {
                self.mesh(mesh, &parent)?;
            }
        }
    }

    fn mesh(&mut self, index: usize, transform: &Transform) -> Result<(), Error> {
        let Some(mesh) = self.document.meshes.get(index) else {
            return Err(self.bad(format!("mesh {index} is missing; the file is damaged")));
        };
        // Parts of a mesh may share their vertices: index of the first one, and their number.
        let mut vertices: HashMap<Attributes, (usize, usize)> = HashMap::new();
        for primitive in &mesh.primitives {
            // Bounds the work for a mesh that many nodes share.
            let work = self.input.memory.reserve(size_of::<Primitive>());
            work.map_err(|problem| self.bad(problem))?;
            // 1 to 3 are lines.
            if !matches!(primitive.mode, 0 | 4..=6) {
                continue;
            }
            let (first, count) = match vertices.get(&primitive.attributes) {
                Some(&known) => known,
                None => {
                    let new = self.vertices(&primitive.attributes, transform)?;
                    *vertices.entry(primitive.attributes).or_insert(new)
                }
            };
            if primitive.mode >= 4 {
                let flip = transform.cofactors().1 < 0.0;
                self.faces(primitive, first, count, flip)?;
            }
        }
        Ok(())
    }

    fn open(&self, index: usize, shapes: &[(&str, usize)]) -> Result<Vectors<'a>, Error> {
        open(self.input, (self.document, self.buffers), index, shapes)
    }

    /// Appends the vertices of a part; the index of the first one, and their number.
    fn vertices(
        &mut self,
        of: &Attributes,
        transform: &Transform,
    ) -> Result<(usize, usize), Error> {
        let first = self.geometry.points.len();
        let Some(position) = of.position else {
            return Ok((first, 0));
        };
        let memory = &self.input.memory;
        let positions = self.open(position, &[("VEC3", 3)])?;
        let room = memory.make_room(&mut self.geometry.points, positions.count);
        room.map_err(|problem| self.bad(problem))?;
        let not_finite = self.input.options.not_finite;
        for index in 0..positions.count {
            let point = transform.point(positions.vector(index));
            not_finite
                .check("vertex", point)
                .map_err(|problem| self.input.error(positions.location(index), problem))?;
            self.geometry.points.push(point);
        }
        self.add_normals(of.normal, positions.count, transform)?;
        self.add_colors(of.color, positions.count)?;
        Ok((first, positions.count))
    }

    /// Opens an attribute of `count` vertices.
    fn attribute(
        &self,
        index: usize,
        count: usize,
        shapes: &[(&str, usize)],
    ) -> Result<Vectors<'a>, Error> {
        let vectors = self.open(index, shapes)?;
        if vectors.count != count {
            let problem = format!(
                "{} values for {count} vertices; the file is damaged",
                vectors.count
            );
            return Err(self.input.error(vectors.location(0), problem));
        }
        Ok(vectors)
    }

    fn add_normals(
        &mut self,
        accessor: Option<usize>,
        count: usize,
        transform: &Transform,
    ) -> Result<(), Error> {
        let Some((index, mut all)) = accessor.zip(self.normals.take()) else {
            return Ok(());
        };
        let normals = self.attribute(index, count, &[("VEC3", 3)])?;
        let memory = &self.input.memory;
        memory
            .make_room(&mut all, count)
            .map_err(|problem| self.bad(problem))?;
        let (cofactors, sign) = transform.cofactors();
        let not_finite = self.input.options.not_finite;
        for row in 0..count {
            let mut normal = normals.vector(row);
            not_finite
                .check("normal", normal)
                .map_err(|problem| self.input.error(normals.location(row), problem))?;
            if transform.linear != Transform::IDENTITY.linear {
                let turned = cofactors.map(|row| sign * vector::dot(row, normal));
                normal = vector::normalized(turned).unwrap_or_default();
            }
            all.push(normal);
        }
        self.normals = Some(all);
        Ok(())
    }

    fn add_colors(&mut self, accessor: Option<usize>, count: usize) -> Result<(), Error> {
        let Some((index, mut all)) = accessor.zip(self.colors.take()) else {
            return Ok(());
        };
        if !self.input.options.keeps("red") {
            return Ok(());
        }
        let colors = self.attribute(index, count, &[("VEC3", 3), ("VEC4", 4)])?;
        for (channel, values) in all.iter_mut().enumerate() {
            let room = self.input.memory.make_room(values, count);
            room.map_err(|problem| self.bad(problem))?;
            values.extend((0..count).map(|row| colors.get(row, channel)));
        }
        self.colors = Some(all);
        Ok(())
    }

    /// Appends the triangles of a part, whose vertices are the `count` from `first` on.
    fn faces(
        &mut self,
        of: &Primitive,
        first: usize,
        count: usize,
        flip: bool,
    ) -> Result<(), Error> {
        let indices = of
            .indices
            .map(|index| self.open(index, &[("SCALAR", 1)]))
            .transpose()?;
        let corner = |at: usize| {
            let (value, location) = match &indices {
                Some(indices) => (indices.get(at, 0), indices.location(at)),
                None => (at as f64, Location::Whole),
            };
            let vertex = as_index(value, count).and_then(|i| u32::try_from(first + i).ok());
            vertex.ok_or_else(|| {
                self.input.error(
                    location,
                    format!("the face names vertex {value}, but there are {count}"),
                )
            })
        };
        let corners = indices.as_ref().map_or(count, |indices| indices.count);
        let triangles = match of.mode {
            4 => corners / 3,
            _ => corners.saturating_sub(2),
        };
        let mut faces = std::mem::take(&mut self.geometry.faces);
        let room = self.input.memory.make_room(&mut faces, triangles);
        room.map_err(|problem| self.bad(problem))?;
        for triangle in 0..triangles {
            let mut at = match of.mode {
                4 => [3 * triangle, 3 * triangle + 1, 3 * triangle + 2],
                // Every second triangle of a strip is turned.
                5 => [
                    triangle,
                    triangle + 1 + triangle % 2,
                    triangle + 2 - triangle % 2,
                ],
                _ => [0, triangle + 1, triangle + 2],
            };
            if flip {
                at.swap(1, 2);
            }
            faces.push([corner(at[0])?, corner(at[1])?, corner(at[2])?]);
        }
        self.geometry.faces = faces;
        Ok(())
    }
}
