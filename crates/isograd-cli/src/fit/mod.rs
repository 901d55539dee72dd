//! `isograd fit`: fits a shape, or points, to a target.

mod inputs;
mod outputs;
mod pictures;

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use isograd_fit::{Checkpoint, Fit, Outcome};

use crate::args;
use crate::backend;
use crate::error::Error;
use crate::interrupt::Deferred;
use crate::progress::Progress;
use inputs::Inputs;
use outputs::Folder;
use pictures::Pictures;

/// Runs the command.
///
/// # Errors
/// See [`Error`]; then no file has been left incomplete.
pub fn run(args: &args::Fit) -> Result<(), Error> {
    let start = Instant::now();
    let folder = Folder::new(args)?;
    let mut progress = Progress::new(args.epochs as usize + 1, args.running);
    progress.step("read");
    let inputs = Inputs::read(args)?;
    let mut fit = begin(args, &inputs)?;
    progress.detail(&format!("on {}", fit.backend()));
    if let Some(note) = fit.backend_note() {
        progress.warn(note);
    }
    folder.create()?;
    let mut pictures = Pictures::new(args, &inputs.target);
    let run = Run {
        args,
        folder: &folder,
        start,
    };
    let outcome = run.descend(&mut fit, &mut pictures, &mut progress)?;
    progress.finish();
    run.end(&mut fit, &mut pictures, outcome, &progress)
}

/// The fit at its start, or resumed from the checkpoint.
fn begin(args: &args::Fit, inputs: &Inputs) -> Result<Fit, Error> {
    let (variables, options) = (inputs.variables.clone(), inputs.options.clone());
    let Some(path) = &args.resume else {
        let fit = Fit::new(&inputs.target, variables, options);
        return fit.map_err(|error| backend::fit_error(args.backend, error));
    };
    let bytes = std::fs::read(path).map_err(Error::input(path))?;
    let checkpoint: Checkpoint = serde_json::from_slice(&bytes).map_err(|error| {
        Error::input(path)(format!(
            "it is not a checkpoint ({error}); give a file that --checkpoint wrote, or begin anew without --resume"
        ))
    })?;
    Fit::resume(&inputs.target, variables, options, checkpoint).map_err(|error| match error {
        isograd_fit::Error::Resume { .. } => Error::input(path)(error),
        other => backend::fit_error(args.backend, other),
    })
}

/// Context of a run.
struct Run<'a> {
    args: &'a args::Fit,
    folder: &'a Folder,
    start: Instant,
}

impl Run<'_> {
    /// Runs all epochs, with pictures and checkpoints.
    fn descend(
        &self,
        fit: &mut Fit,
        pictures: &mut Pictures,
        progress: &mut Progress,
    ) -> Result<Outcome, Error> {
        let interrupt = Deferred::new();
        let mut failure = self.draw(fit, pictures).err();
        let mut observer = |fit: &mut Fit| {
            if let Some(last) = fit.history().last() {
                progress.step(&format!(
                    "loss {:.3e}, mean error {:.4} cells",
                    last.loss, last.mean_error
                ));
            }
            let due = fit
                .epoch()
                .is_multiple_of(self.args.checkpoint_every as usize);
            let result = match &self.args.checkpoint {
                Some(path) if due => outputs::write_json(path, &fit.checkpoint()),
                _ => Ok(()),
            };
            failure = result.and_then(|()| self.draw(fit, pictures)).err();
            match failure.is_some() || interrupt.is_requested() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        };
        let outcome = fit.run(&mut observer);
        failure.map_or(Ok(outcome?), Err)
    }

    /// Draws the current epoch, if it is in `--pictures-at`.
    fn draw(&self, fit: &mut Fit, pictures: &mut Pictures) -> Result<(), Error> {
        let epoch = fit.epoch();
        if !self.args.pictures_at.contains(&(epoch as u32)) {
            return Ok(());
        }
        pictures.draw(fit, self.folder)
    }

    fn end(
        &self,
        fit: &mut Fit,
        pictures: &mut Pictures,
        outcome: Outcome,
        progress: &Progress,
    ) -> Result<(), Error> {
        let stopped = outcome == Outcome::Stopped;
        let in_folder = || stopped.then(|| self.folder.path("checkpoint.json"));
        let checkpoint: Option<PathBuf> = self.args.checkpoint.clone().or_else(in_folder);
        if let Some(path) = &checkpoint {
            outputs::write_json(path, &fit.checkpoint())?;
        }
        if !stopped {
            pictures.draw(fit, self.folder)?;
            pictures.write_all(self.folder)?;
        }
        let seconds = self.start.elapsed().as_secs_f64();
        self.folder.write_results(fit, outcome, seconds)?;
        outputs::summarize(fit, outcome, seconds, self.args, progress);
        progress.print(&format!("wrote {}", self.folder.path("").display()));
        match checkpoint {
            Some(path) if stopped => Err(Error::Stopped {
                epoch: fit.epoch(),
                file: path.display().to_string(),
            }),
            _ => Ok(()),
        }
    }
}
