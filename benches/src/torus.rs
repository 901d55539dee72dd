//! The body of the benchmarks: a torus, R = 0.7, r = 0.25, in a cube of side 2.4.

use isograd::{Field, Grid, Real};

const MAJOR: f64 = 0.7;
const MINOR: f64 = 0.25;
const SIDE: f64 = 2.4;

/// A cubic grid of `cells`³.
///
/// # Panics
/// Fewer cells than a grid may have.
pub fn grid<T: Real>(cells: usize) -> Grid<T> {
    let spacing = T::of(SIDE / cells as f64);
    Grid::new([T::of(-0.5 * SIDE); 3], spacing, [cells; 3]).expect("a grid of that size")
}

/// The exact signed distance at every cell center.
pub fn field<T: Real>(cells: usize) -> Field<T> {
    let mut field = Field::zeros(grid(cells));
    let grid = *field.grid();
    for (index, value) in field.values_mut().iter_mut().enumerate() {
        let [x, y, z] = grid.center_f64(grid.cell(index));
        *value = T::of((x.hypot(y) - MAJOR).hypot(z) - MINOR);
    }
    field
}

/// `count` reproducible samples, uniform by area, and their outward normals.
pub fn samples<T: Real>(count: usize) -> (Vec<[T; 3]>, Vec<[T; 3]>) {
    let mut random = SplitMix(1);
    (0..count).map(|_| sample(&mut random)).unzip()
}

fn sample<T: Real>(random: &mut SplitMix) -> ([T; 3], [T; 3]) {
    loop {
        let tube = random.uniform() * std::f64::consts::TAU;
        let around = random.uniform() * std::f64::consts::TAU;
        // Accepted in proportion to the circumference at that angle of the tube.
        let reach = MAJOR + MINOR * tube.cos();
        if random.uniform() * (MAJOR + MINOR) < reach {
            let normal = [
                tube.cos() * around.cos(),
                tube.cos() * around.sin(),
                tube.sin(),
            ];
            let point = [
                reach * around.cos(),
                reach * around.sin(),
                MINOR * tube.sin(),
            ];
            return (point.map(T::of), normal.map(T::of));
        }
    }
}

/// Random generator of Steele, Lea and Flood.
struct SplitMix(u64);

impl SplitMix {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}
