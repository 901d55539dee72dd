//! Lists of vertices, and their culling for the children of a block.

use super::block::CHILDREN;

/// A vertex, in cells from the center of the block.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct Site {
    pub position: [f32; 3],
    /// The largest slack of its triangles (see `Frame`).
    pub slack: f32,
    /// The square of its distance from the center of the block, less the slack.
    pub power: f32,
    /// Its number.
    pub number: u32,
}

/// Boxes of the children of a block, `[axis][child]`, in cells from the center of the block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boxes {
    /// Centers of the boxes of cell centers.
    pub center: [[f32; CHILDREN]; 3],
    /// Their sides.
    pub side: [[f32; CHILDREN]; 3],
    /// A point of the mesh near each.
    pub foot: [[f32; CHILDREN]; 3],
    /// `|center − foot|²` plus a bound of rounding.
    pub bound: [f32; CHILDREN],
    /// Squared distances from the centers beyond which sites are ignored.
    pub reach: [f32; CHILDREN],
}

impl Boxes {
    /// Boxes that reject all sites.
    pub(super) const NOTHING: Self = Self {
        center: [[0.0; CHILDREN]; 3],
        side: [[0.0; CHILDREN]; 3],
        foot: [[0.0; CHILDREN]; 3],
        bound: [f32::NEG_INFINITY; CHILDREN],
        reach: [f32::NEG_INFINITY; CHILDREN],
    };

    /// For each child, 1 if a triangle of the site may be closest to one of its points, else 0.
    ///
    /// For a point `v`, `|q − foot|² − |q − v|²` is linear in `q`: over the box it is at most
    /// `|c − foot|² − |c − v|² + Σ side |v − foot|`. A triangle adds at most its slack.
    #[inline(always)]
    fn matter(&self, site: &Site) -> [u32; CHILDREN] {
        let v = site.position;
        let mut matter = [0; CHILDREN];
        for l in 0..CHILDREN {
            let mut squared = 0.0;
            let mut gain = 0.0;
            for a in 0..3 {
                let d = v[a] - self.center[a][l];
                gain += self.side[a][l] * (v[a] - self.foot[a][l]).abs();
                squared += d * d;
            }
            let closer = gain - squared + site.slack + self.bound[l];
            let kept = (closer >= 0.0) & (squared <= self.reach[l]);
            matter[l] = u32::from(kept);
        }
        matter
    }
}

/// A list for each child of a block, one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct ChildLists {
    places: Vec<u32>,
    /// Room for each.
    room: usize,
    length: [u32; CHILDREN],
}

impl ChildLists {
    pub(super) fn of(&self, child: usize) -> &[u32] {
        let first = child * self.room;
        &self.places[first..first + self.length[child] as usize]
    }

    /// Lists for each child those of the `listed` sites whose triangles may be closest to one of its points.
    #[inline(always)]
    pub(super) fn cull(&mut self, sites: &[Site], listed: &[u32], boxes: &Boxes) {
        self.room = listed.len();
        if self.places.len() < CHILDREN * self.room {
            self.places.resize(CHILDREN * self.room, 0);
        }
        let mut length = [0; CHILDREN];
        for &place in listed {
            let matter = boxes.matter(&sites[place as usize]);
            for l in 0..CHILDREN {
                // Written in any case, kept if not culled: a branch would be mispredicted.
                self.places[l * self.room + length[l] as usize] = place;
            }
            for l in 0..CHILDREN {
                length[l] += matter[l];
            }
        }
        self.length = length;
    }
}

/// For each of some points, `[axis][point]`, the listed site closest to it: 0 where there is none.
#[inline(always)]
pub(super) fn closest<const N: usize>(
    sites: &[Site],
    listed: &[u32],
    points: &[[f32; N]; 3],
) -> [u32; N] {
    let mut best = [f32::INFINITY; N];
    let mut found = [0; N];
    for &place in listed {
        let v = sites[place as usize].position;
        for l in 0..N {
            let d = [
                v[0] - points[0][l],
                v[1] - points[1][l],
                v[2] - points[2][l],
            ];
            let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let closer = squared < best[l];
            best[l] = if closer { squared } else { best[l] };
            found[l] = if closer { place } else { found[l] };
        }
    }
    found
}
