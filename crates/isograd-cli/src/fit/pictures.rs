//! Pictures of chosen epochs, and all of them side by side.

use isograd_fit::{Fit, Target};

use super::outputs::Folder;
use crate::args;
use crate::error::Error;
use crate::plot::{self, Camera, Canvas, Comparison};

/// Pictures drawn so far.
pub struct Pictures {
    comparison: Comparison,
    drawn: Vec<(usize, Canvas)>,
}

impl Pictures {
    pub fn new(args: &args::Fit, target: &Target) -> Self {
        let camera = match args.view.as_deref() {
            Some(&[azimuth, elevation]) => Camera { azimuth, elevation },
            _ => Camera::default(),
        };
        Self {
            comparison: Comparison::new(target.sdf(), target.surface(), camera),
            drawn: Vec::new(),
        }
    }

    /// Draws the current epoch, unless it is drawn already.
    pub fn draw(&mut self, fit: &mut Fit, folder: &Folder) -> Result<(), Error> {
        let epoch = fit.epoch();
        if self.drawn.last().is_some_and(|(last, _)| *last == epoch) {
            return Ok(());
        }
        let error = fit.history().last().map_or(0.0, |last| last.mean_error);
        let title = format!("epoch {epoch}: mean error {} cells", rounded(error));
        let result = fit.reconstruction()?;
        let mesh = result.mesh().map_err(isograd_fit::Error::from)?;
        let sdf = result.sdf().map_err(isograd_fit::Error::from)?;
        let picture = self.comparison.draw(mesh, sdf, &title);
        plot::write(&folder.path(&format!("epoch_{epoch:04}.png")), &picture)?;
        self.drawn.push((epoch, picture));
        Ok(())
    }

    /// Writes all epochs that were drawn, side by side.
    pub fn write_all(&self, folder: &Folder) -> Result<(), Error> {
        let columns: Vec<&Canvas> = self.drawn.iter().map(|(_, picture)| picture).collect();
        plot::write(&folder.path("epochs.png"), &plot::side_by_side(&columns))?;
        Ok(())
    }
}

/// Two significant digits.
fn rounded(value: f64) -> String {
    match value {
        v if v >= 0.1 => format!("{v:.2}"),
        v if v >= 0.01 => format!("{v:.3}"),
        v if v >= 1e-3 => format!("{v:.4}"),
        v => format!("{v:.1e}"),
    }
}
