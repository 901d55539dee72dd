use super::*;
use crate::distance::lattice::{self, Band, Scratch};
use crate::{Field, Grid};
#[test]
#[ignore]
fn explore() {
    let n: usize = std::env::var("N").ok().map_or(64, |s| s.parse().unwrap());
    let band = std::env::var("BAND").map_or(Band::Full, |s| Band::Cells(s.parse().unwrap()));
    let mesh = torus::<f32>(282 * n / 128, 100 * n / 128);
    let grid = Grid::new([-1.0f32; 3], 2.0 / n as f32, [n; 3]).expect("grid");
    let chi = Field::zeros(grid);
    let mut scratch = Scratch::default();
    let mut phi = Field::zeros(grid);
    let mut closest = Vec::new();
    for _ in 0..std::env::var("REP").map_or(4, |s| s.parse().unwrap()) {
        let t = std::time::Instant::now();
        lattice::forward(&mesh, &chi, 0.0, band, &mut scratch, &mut phi, &mut closest).expect("ok");
        eprintln!("{} tri {:?}", mesh.faces().len(), t.elapsed());
    }
}
