//! Steps in order: each prints its name, time and result, and the first failure ends the run.

use std::time::{Duration, Instant};

use crate::process::Outcome;

/// Completed steps and their `SKIPPED` lines.
#[derive(Default)]
pub struct Steps {
    done: Vec<(&'static str, Duration)>,
    skipped: Vec<String>,
}

impl Steps {
    /// Runs a step, which returns its `SKIPPED` lines.
    pub fn step(
        &mut self,
        name: &'static str,
        work: impl FnOnce() -> Outcome<Vec<String>>,
    ) -> Outcome {
        println!("\n── {name}");
        let start = Instant::now();
        let result = work();
        let time = start.elapsed();
        match result {
            Ok(skipped) => {
                println!("── {name}: passed in {:.1} s", time.as_secs_f64());
                self.done.push((name, time));
                self.skipped.extend(skipped);
                Ok(())
            }
            Err(failure) => {
                println!("── {name}: FAILED after {:.1} s", time.as_secs_f64());
                Err(format!("step '{name}': {failure}"))
            }
        }
    }

    /// Prints the time of every step, then all `SKIPPED` lines.
    pub fn summarize(&self) {
        println!("\n── summary");
        for (name, time) in &self.done {
            println!("passed  {:7.1} s  {name}", time.as_secs_f64());
        }
        let total: Duration = self.done.iter().map(|(_, time)| *time).sum();
        println!("total   {:7.1} s", total.as_secs_f64());
        for line in &self.skipped {
            println!("{line}");
        }
    }
}
