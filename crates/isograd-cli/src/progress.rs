//! Progress of the work: a bar on a terminal, nothing in a pipe.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use isograd::{Report, Verdict};

use crate::args::Running;
use crate::streams::{to_stderr, to_stdout};

/// A bar with one step per part of the work.
pub struct Progress {
    bar: ProgressBar,
    quiet: bool,
    verbose: bool,
    current: Option<(String, Instant)>,
}

impl Progress {
    /// A bar of `steps`, drawn on standard error where that is a terminal.
    pub fn new(steps: usize, running: Running) -> Self {
        let visible = std::io::stderr().is_terminal() && !running.quiet && !running.verbose;
        let target = match visible {
            true => ProgressDrawTarget::stderr(),
            false => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(steps as u64), target);
        let template = "{spinner} {bar:24} {pos}/{len} {msg} ({elapsed})";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        if visible {
            bar.enable_steady_tick(Duration::from_millis(120));
        }
        Self {
            bar,
            quiet: running.quiet,
            verbose: running.verbose,
            current: None,
        }
    }

    /// Begins the next part.
    pub fn step(&mut self, name: &str) {
        self.end_step();
        self.bar.set_message(name.to_string());
        self.current = Some((name.to_string(), Instant::now()));
    }

    fn end_step(&mut self) {
        if let Some((name, start)) = self.current.take() {
            self.bar.inc(1);
            if self.verbose {
                to_stderr(&format!(
                    "{name:<12} {:8.3} s",
                    start.elapsed().as_secs_f64()
                ));
            }
        }
    }

    /// Prints a warning to standard error, also with `-q`.
    pub fn warn(&self, text: &str) {
        self.bar.suspend(|| to_stderr(&format!("warning: {text}")));
    }

    /// Prints the warnings of a report.
    pub fn warn_of(&self, report: &Report) {
        for warning in report.reasons() {
            self.warn(&warning.to_string());
        }
    }

    /// Prints the verdict of a report, with its reasons and what to try: to standard error with `-q`, and only if it is
    /// not good.
    pub fn conclude(&self, report: &Report) {
        let line = format!("verdict: {}", report.conclusion());
        match report.verdict() {
            Some(Verdict::Check | Verdict::Bad) if self.quiet => {
                self.bar.suspend(|| to_stderr(&line));
            }
            _ => self.print(&line),
        }
    }

    /// Prints a detail with `-v`.
    pub fn detail(&self, text: &str) {
        if self.verbose {
            to_stderr(text);
        }
    }

    /// Prints a result to standard output, unless `-q`.
    pub fn print(&self, text: &str) {
        if !self.quiet {
            self.bar.suspend(|| to_stdout(text));
        }
    }

    /// Ends the last part and removes the bar.
    pub fn finish(&mut self) {
        self.end_step();
        self.bar.finish_and_clear();
    }
}
