//! Progress of the work: a bar on a terminal, nothing in a pipe.

mod work;

use std::fmt::Write;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use isograd::{Report, Verdict};

use crate::args::Running;
use crate::streams::{to_stderr, to_stdout};
use work::Work;

/// Characters between the ends of the bar.
const WIDTH: usize = 24;

/// A bar that counts work, with the time to go.
pub struct Progress {
    bar: ProgressBar,
    work: Arc<Mutex<Work>>,
    quiet: bool,
    verbose: bool,
    current: Option<(String, Instant)>,
    /// The cloud of this part of the work, where there are several.
    cloud: Option<String>,
    /// Kinds of notes that were printed.
    noted: Vec<&'static str>,
}

impl Progress {
    /// A bar of `parts` equal parts, drawn on standard error where that is a terminal.
    pub fn new(parts: usize, running: Running) -> Self {
        let visible = std::io::stderr().is_terminal() && !running.quiet && !running.verbose;
        let target = match visible {
            true => ProgressDrawTarget::stderr(),
            false => ProgressDrawTarget::hidden(),
        };
        let work = Arc::new(Mutex::new(Work::new(parts, Instant::now())));
        let bar = ProgressBar::with_draw_target(None, target);
        let template = ProgressStyle::with_template("{spinner} {work} {msg} ({elapsed}{left})");
        if let Ok(style) = template {
            let (shown, left) = (work.clone(), work.clone());
            let style = style.with_key("work", move |_: &ProgressState, out: &mut dyn Write| {
                let _ = out.write_str(&draw(&lock(&shown), Instant::now()));
            });
            let style = style.with_key("left", move |_: &ProgressState, out: &mut dyn Write| {
                if let (_, Some(left)) = lock(&left).progress(Instant::now()) {
                    let _ = write!(out, ", {:#} left", HumanDuration(left));
                }
            });
            bar.set_style(style);
        }
        if visible {
            bar.enable_steady_tick(Duration::from_millis(120));
        }
        Self {
            bar,
            work,
            quiet: running.quiet,
            verbose: running.verbose,
            current: None,
            cloud: None,
            noted: Vec::new(),
        }
    }

    /// Begins cloud `cloud`, from 0, of several, with `parts` equal parts.
    pub fn begin_cloud(&mut self, cloud: usize, clouds: usize, parts: usize, name: String) {
        self.end_step();
        self.detail(&name);
        lock(&self.work).begin_cloud(cloud, clouds, parts, Instant::now());
        self.cloud = Some(name);
    }

    /// Sets the parts still to come, with the seconds that each may take; other parts count for nothing.
    pub fn expect(&mut self, parts: Vec<(&'static str, f64)>) {
        self.end_step();
        lock(&self.work).expect(parts, Instant::now());
    }

    /// Begins the next part.
    pub fn step(&mut self, name: &str) {
        self.end_step();
        self.bar.set_message(match &self.cloud {
            Some(cloud) => format!("{cloud}: {name}"),
            None => name.to_string(),
        });
        lock(&self.work).begin(name, Instant::now());
        self.current = Some((name.to_string(), Instant::now()));
    }

    fn end_step(&mut self) {
        if let Some((name, start)) = self.current.take() {
            lock(&self.work).end(Instant::now());
            if self.verbose {
                to_stderr(&format!(
                    "{name:<12} {:8.3} s",
                    start.elapsed().as_secs_f64()
                ));
            }
        }
    }

    /// A text about the cloud, which names it where there are several.
    fn about(&self, text: &str) -> String {
        match &self.cloud {
            Some(cloud) => format!("{cloud}: {text}"),
            None => text.into(),
        }
    }

    /// Prints an error to standard error, where the work goes on.
    pub fn error(&self, error: &crate::error::Error) {
        self.bar.suspend(|| to_stderr(&format!("error: {error}")));
    }

    /// Prints a warning to standard error, also with `-q`.
    pub fn warn(&self, text: &str) {
        let line = format!("warning: {}", self.about(text));
        self.bar.suspend(|| to_stderr(&line));
    }

    /// Prints a note to standard error, once for all clouds, unless `-q`.
    pub fn note(&mut self, kind: &'static str, text: &str) {
        if !self.quiet && !self.noted.contains(&kind) {
            self.noted.push(kind);
            self.bar.suspend(|| to_stderr(&format!("note: {text}")));
        }
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
        let label = self.cloud.as_deref().unwrap_or("verdict");
        let line = format!("{label}: {}", report.conclusion());
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

    /// Prints a result of one cloud to standard output, unless `-q`; of several only with `-v`.
    pub fn print_one(&self, text: &str) {
        if self.cloud.is_none() || self.verbose {
            self.print(&self.about(text));
        }
    }

    /// Prints that a file was written; of several clouds only with `-v`.
    pub fn wrote(&self, path: &Path) {
        if self.cloud.is_none() || self.verbose {
            self.print(&format!("wrote {}", path.display()));
        }
    }

    /// Ends the last part of a cloud, and removes the bar unless there are several.
    pub fn finish_cloud(&mut self) {
        match self.cloud {
            Some(_) => self.end_step(),
            None => self.finish(),
        }
    }

    /// Ends the last part and removes the bar.
    pub fn finish(&mut self) {
        self.end_step();
        self.bar.finish_and_clear();
    }
}

fn lock(work: &Mutex<Work>) -> MutexGuard<'_, Work> {
    work.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The bar, the share of the work, and the number of the cloud.
fn draw(work: &Work, now: Instant) -> String {
    let share = work.progress(now).0.clamp(0.0, 1.0);
    let full = (share * WIDTH as f64) as usize;
    let head = if full < WIDTH { ">" } else { "" };
    let bar = format!("{}{head}", "=".repeat(full));
    let clouds = work.clouds();
    let clouds = clouds.map_or(String::new(), |(k, n)| format!(" {k}/{n}"));
    format!("[{bar:WIDTH$}] {:3.0} %{clouds}", 100.0 * share)
}

/// Text of an area or a volume: six decimals, or powers of ten where these say little.
pub fn decimal(value: f64) -> String {
    match value.abs() {
        0.0 | 1e-3..1e7 => format!("{value:.6}"),
        _ => format!("{value:.5e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_is_as_long_whatever_the_share() {
        let now = Instant::now();
        let mut work = Work::new(2, now);
        assert_eq!(draw(&work, now), "[>                       ]   0 %");
        work.begin("a", now);
        work.end(now + Duration::from_secs(1));
        let half = draw(&work, now + Duration::from_secs(1));
        assert_eq!(half, "[============>           ]  50 %");
        work.begin("b", now);
        work.end(now + Duration::from_secs(2));
        let all = draw(&work, now + Duration::from_secs(2));
        assert_eq!(all, "[========================] 100 %");
        work.begin_cloud(1, 3, 5, now);
        assert!(
            draw(&work, now).ends_with("  33 % 2/3"),
            "{}",
            draw(&work, now)
        );
    }
}
