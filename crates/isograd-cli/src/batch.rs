//! Several clouds, one after another.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Instant;

use isograd::Verdict;
use isograd_io::Geometry;

use crate::args;
use crate::error::Error;
use crate::inputs::Cloud;
use crate::outputs::{Outputs, canonical};
use crate::progress::Progress;
use crate::reconstruct::{Job, PARTS};
use crate::sequence;

/// Reconstructs several clouds; an error of one does not stop the others.
///
/// # Errors
/// [`Error::Usage`] before any work; [`Error::Clouds`] and [`Error::BadClouds`] after all of it; at once an error that all
/// clouds would have.
pub fn run(args: &args::Reconstruct, clouds: &[Cloud]) -> Result<(), Error> {
    let outputs = outputs(args, clouds)?;
    let mut batch = Batch {
        args,
        clouds,
        outputs,
        progress: Progress::new(clouds.len(), args.running),
        start: Instant::now(),
    };
    match args.sequence {
        true => sequence::run(&mut batch),
        false => batch.go(&mut |job, geometry, progress| job.alone(geometry, progress)),
    }
}

/// The outputs of each cloud, none of which may be a cloud.
fn outputs(args: &args::Reconstruct, clouds: &[Cloud]) -> Result<Vec<Outputs>, Error> {
    let inputs: BTreeSet<PathBuf> = clouds.iter().map(|cloud| canonical(&cloud.path)).collect();
    let outputs_of = |cloud: &Cloud| {
        let outputs = Outputs::new(args, &cloud.path, &cloud.stem, true)?;
        if let Some(path) = outputs
            .files()
            .find(|path| inputs.contains(&canonical(path)))
        {
            return Err(Error::Usage(format!(
                "{} is one of the clouds; write to another folder",
                path.display()
            )));
        }
        Ok(outputs)
    };
    clouds.iter().map(outputs_of).collect()
}

/// The work on several clouds.
pub struct Batch<'a> {
    /// The command line.
    pub args: &'a args::Reconstruct,
    /// The clouds, in order.
    pub clouds: &'a [Cloud],
    outputs: Vec<Outputs>,
    /// The progress of all.
    pub progress: Progress,
    start: Instant,
}

/// Reconstructs a cloud that was read, and returns the verdict.
pub type Reconstruct<'a> =
    dyn FnMut(&Job, Geometry, &mut Progress) -> Result<Option<Verdict>, Error> + 'a;

impl Batch<'_> {
    /// Whether the outputs of cloud `k` exist, and so it is to be skipped.
    pub fn is_skipped(&self, k: usize) -> bool {
        self.args.skip_existing && self.outputs[k].are_up_to_date(&self.clouds[k].path)
    }

    /// Calls `reconstruct` for every cloud that is not skipped, and prints how many were good. One that is skipped counts as
    /// bad if its report says so.
    ///
    /// # Errors
    /// See [`run`].
    pub fn go(&mut self, reconstruct: &mut Reconstruct) -> Result<(), Error> {
        let mut tally = Tally::default();
        for (k, cloud) in self.clouds.iter().enumerate() {
            if self.is_skipped(k) {
                match self.outputs[k].were_bad() {
                    true => tally.bad += 1,
                    false => tally.skipped += 1,
                }
                continue;
            }
            let name = cloud.path.display().to_string();
            let progress = &mut self.progress;
            progress.begin_cloud(k, self.clouds.len(), PARTS, name);
            let job = Job::read(self.args, &cloud.path, &self.outputs[k], progress);
            match job.and_then(|(job, geometry)| reconstruct(&job, geometry, progress)) {
                Ok(verdict) => tally.add(verdict),
                Err(error) if error.is_of_program() => return Err(error),
                Err(error) => {
                    tally.failed += 1;
                    progress.error(&error);
                }
            }
        }
        self.progress.finish();
        self.conclude(&tally)
    }

    fn conclude(&self, tally: &Tally) -> Result<(), Error> {
        let clouds = self.clouds.len();
        let seconds = self.start.elapsed().as_secs_f64();
        self.progress
            .print(&format!("{clouds} clouds: {tally}, {seconds:.2} s"));
        if tally.failed > 0 {
            let failed = tally.failed;
            return Err(Error::Clouds { failed, clouds });
        }
        match tally.bad {
            bad @ 1.. if self.args.strict => Err(Error::BadClouds { bad, clouds }),
            _ => Ok(()),
        }
    }
}

/// Number of clouds with each verdict.
#[derive(Debug, Default)]
struct Tally {
    good: usize,
    check: usize,
    bad: usize,
    failed: usize,
    skipped: usize,
}

impl Tally {
    fn add(&mut self, verdict: Option<Verdict>) {
        match verdict {
            Some(Verdict::Good) => self.good += 1,
            Some(Verdict::Check) | None => self.check += 1,
            Some(Verdict::Bad) => self.bad += 1,
        }
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            good,
            check,
            bad,
            failed,
            skipped,
        } = self;
        write!(f, "{good} good, {check} check, {bad} bad, {failed} failed")?;
        match skipped {
            0 => Ok(()),
            _ => write!(f, ", {skipped} skipped (outputs exist)"),
        }
    }
}
