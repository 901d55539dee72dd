//! Polygons, cut into triangles.
//!
//! A fan around the first corner is kept where no triangle of it faces the other way, as in every convex polygon. Otherwise
//! ears are clipped in the plane of the polygon's mean normal. All triangles then face one way, so that together they cover each
//! place as often as the polygon winds around it: a polygon that does not cross itself exactly once. Where no ears are left, as
//! in polygons that cross themselves, and in those of more than [`LARGEST`] corners, the fan stays.

use isograd_element::vector;

use crate::limits::Memory;

/// Most corners of a polygon whose ears are clipped: the time grows with their square.
const LARGEST: usize = 4096;

/// Memory for each corner of a polygon whose ears are clipped: its place, two neighbors, its turn, up to three entries among the
/// candidates, in a vector whose capacity doubles, and a triangle.
const EACH: usize = 128;

/// Sine of an angle below which a fan may turn back: roundings, and less than any grid resolves.
const ROUNDING: f64 = 1e-6;

/// Sine of an angle below which a corner is straight.
const STRAIGHT: f64 = 1e-12;

/// Triangles of polygons.
#[derive(Default)]
pub(crate) struct Triangles {
    faces: Vec<[u32; 3]>,
    /// Polygons with corners that were not yet known: index of their first triangle, and the number of their triangles.
    deferred: Vec<(usize, usize)>,
}

impl Triangles {
    /// Appends a polygon, of whose corners some may come later than the `points` so far.
    pub fn push(
        &mut self,
        memory: &Memory,
        points: &[[f64; 3]],
        corners: &[u32],
    ) -> Result<(), String> {
        if corners
            .iter()
            .all(|&corner| (corner as usize) < points.len())
        {
            return triangulate(memory, points, corners, &mut self.faces);
        }
        let begin = self.faces.len();
        fan(memory, corners, &mut self.faces)?;
        let count = self.faces.len() - begin;
        if count > 1 {
            memory.make_room(&mut self.deferred, 1)?;
            self.deferred.push((begin, count));
        }
        Ok(())
    }

    /// The triangles, once all points are known.
    pub fn finish(mut self, memory: &Memory, points: &[[f64; 3]]) -> Result<Vec<[u32; 3]>, String> {
        let mut corners = Vec::new();
        for (begin, count) in self.deferred {
            let triangles = &mut self.faces[begin..begin + count];
            corners.clear();
            memory.make_room(&mut corners, count + 2)?;
            corners.extend_from_slice(&triangles[0][..2]);
            corners.extend(triangles.iter().map(|triangle| triangle[2]));
            improve(memory, points, &corners, triangles)?;
        }
        Ok(self.faces)
    }
}

/// Appends the triangles of a polygon, with its winding.
pub(crate) fn triangulate(
    memory: &Memory,
    points: &[[f64; 3]],
    corners: &[u32],
    faces: &mut Vec<[u32; 3]>,
) -> Result<(), String> {
    let begin = faces.len();
    fan(memory, corners, faces)?;
    improve(memory, points, corners, &mut faces[begin..])
}

/// Appends the fan of a polygon around its first corner.
fn fan(memory: &Memory, corners: &[u32], faces: &mut Vec<[u32; 3]>) -> Result<(), String> {
    if let Some((&first, rest)) = corners.split_first() {
        memory.make_room(faces, rest.len())?;
        faces.extend(rest.windows(2).map(|pair| [first, pair[0], pair[1]]));
    }
    Ok(())
}

/// Replaces a fan that turns back, if there are ears enough.
fn improve(
    memory: &Memory,
    points: &[[f64; 3]],
    corners: &[u32],
    triangles: &mut [[u32; 3]],
) -> Result<(), String> {
    let place = |corner: &u32| points.get(*corner as usize).copied().unwrap_or_default();
    if !(4..=LARGEST).contains(&corners.len()) {
        return Ok(());
    }
    let [first, rest @ ..] = corners else {
        return Ok(());
    };
    let first = place(first);
    let spokes = || rest.iter().map(|corner| vector::sub(place(corner), first));
    let Some(normal) = normal_where_the_fan_turns_back(spokes) else {
        return Ok(());
    };
    let Some([u, v]) = vector::tangents(normal) else {
        return Ok(());
    };
    let bytes = EACH * corners.len();
    memory.reserve(bytes)?;
    let flat = |spoke: [f64; 3]| [vector::dot(u, spoke), vector::dot(v, spoke)];
    let places = std::iter::once([0.0; 2])
        .chain(spokes().map(flat))
        .collect();
    if let Some(ears) = Polygon::new(places).ears() {
        for (triangle, ear) in triangles.iter_mut().zip(ears) {
            *triangle = ear.map(|corner| corners[corner]);
        }
    }
    memory.release(bytes);
    Ok(())
}

/// The unit normal of a polygon if a triangle of its fan faces the other way; `spokes` lead from the first corner to the others.
fn normal_where_the_fan_turns_back<I>(spokes: impl Fn() -> I) -> Option<[f64; 3]>
where
    I: Iterator<Item = [f64; 3]>,
{
    let pairs = || spokes().zip(spokes().skip(1));
    let area = pairs().fold([0.0; 3], |sum, (a, b)| {
        vector::add(sum, vector::cross(a, b))
    });
    let normal = vector::normalized(area)?;
    let turns_back = |(a, b): ([f64; 3], [f64; 3])| {
        let area = vector::dot(vector::cross(a, b), normal);
        area < 0.0 && area < -ROUNDING * vector::norm(a) * vector::norm(b)
    };
    pairs().any(turns_back).then_some(normal)
}

/// Direction in which a polygon turns at a corner.
#[derive(Clone, Copy, PartialEq)]
enum Turn {
    Convex,
    Straight,
    Reflex,
}

/// Corners of a polygon in its plane that are not yet cut off, counterclockwise.
struct Polygon {
    places: Vec<[f64; 2]>,
    before: Vec<usize>,
    after: Vec<usize>,
    turns: Vec<Turn>,
    left: usize,
}

/// Twice the signed area of a triangle.
fn area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn length(p: [f64; 2], q: [f64; 2]) -> f64 {
    (q[0] - p[0]).hypot(q[1] - p[1])
}

impl Polygon {
    fn new(places: Vec<[f64; 2]>) -> Self {
        let n = places.len();
        let mut polygon = Self {
            before: (0..n).map(|corner| (corner + n - 1) % n).collect(),
            after: (0..n).map(|corner| (corner + 1) % n).collect(),
            turns: vec![Turn::Straight; n],
            places,
            left: n,
        };
        (0..n).for_each(|corner| polygon.turns[corner] = polygon.turn(corner));
        polygon
    }

    /// A corner with its two neighbors.
    fn triangle(&self, corner: usize) -> [usize; 3] {
        [self.before[corner], corner, self.after[corner]]
    }

    fn turn(&self, corner: usize) -> Turn {
        let triangle = self.triangle(corner).map(|corner| self.places[corner]);
        let [a, b, c] = triangle;
        let area = area(triangle);
        match area.abs() > STRAIGHT * length(a, b) * length(b, c) {
            true if area > 0.0 => Turn::Convex,
            true => Turn::Reflex,
            false => Turn::Straight,
        }
    }

    /// Whether the triangle at a corner has no other corner in it, nor on its edges.
    fn is_ear(&self, corner: usize) -> bool {
        if self.turns[corner] != Turn::Convex {
            return false;
        }
        let [from, _, to] = self.triangle(corner);
        let [a, b, c] = [from, corner, to].map(|corner| self.places[corner]);
        let slack = STRAIGHT * (length(a, b) + length(b, c)).powi(2);
        let mut other = self.after[to];
        while other != from {
            // If any corner is inside, one that is not convex is.
            if self.turns[other] != Turn::Convex {
                let p = self.places[other];
                let mut parts = [[a, b, p], [b, c, p], [c, a, p]].into_iter();
                if parts.all(|part| area(part) >= -slack) && ![a, b, c].contains(&p) {
                    return false;
                }
            }
            other = self.after[other];
        }
        true
    }

    /// Cuts off a corner; its neighbors are candidates for the next one.
    fn clip(&mut self, corner: usize, candidates: &mut Vec<usize>) -> [usize; 3] {
        let triangle = self.triangle(corner);
        let [from, _, to] = triangle;
        (self.after[from], self.before[to]) = (to, from);
        // It leads back to itself, which no corner that is left does.
        (self.after[corner], self.before[corner]) = (corner, corner);
        self.left -= 1;
        for neighbor in [from, to] {
            self.turns[neighbor] = self.turn(neighbor);
            candidates.push(neighbor);
        }
        triangle
    }

    fn is_left(&self, corner: usize) -> bool {
        self.after[corner] != corner
    }

    /// Whether a corner lies on the one before it, or is the tip of a line to which the outline returns.
    fn is_flat(&self, corner: usize) -> bool {
        let [a, b, c] = self.triangle(corner).map(|corner| self.places[corner]);
        a == b || a == c
    }

    /// Cuts off those of the candidates that a rule names, and of their neighbors.
    fn cut(
        &mut self,
        mut candidates: Vec<usize>,
        triangles: &mut Vec<[usize; 3]>,
        rule: fn(&Self, usize) -> bool,
    ) {
        while let Some(corner) = candidates.pop() {
            if self.left > 3 && self.is_left(corner) && rule(self, corner) {
                triangles.push(self.clip(corner, &mut candidates));
            }
        }
    }

    /// Triangles that all face one way; `None` if there are none, as in a polygon that crosses itself.
    fn ears(mut self) -> Option<Vec<[usize; 3]>> {
        let n = self.places.len();
        let mut triangles = Vec::with_capacity(n.saturating_sub(2));
        for rule in [Self::is_flat, Self::is_ear] {
            self.cut((0..n).rev().collect(), &mut triangles, rule);
        }
        while self.left > 3 {
            // Corners on a line.
            let mut corners = 0..n;
            let straight = corners.find(|&c| self.is_left(c) && self.turns[c] == Turn::Straight)?;
            let mut candidates = Vec::new();
            triangles.push(self.clip(straight, &mut candidates));
            self.cut(candidates, &mut triangles, Self::is_ear);
        }
        let last = (0..n).find(|&corner| self.is_left(corner))?;
        triangles.push(self.triangle(last));
        (self.turns[last] != Turn::Reflex).then_some(triangles)
    }
}
