//! One input: its number, its outcome, and the command that repeats it.

use std::fmt;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Mutex;

use crate::random::Random;

/// Part of the program that an input is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Readers of files.
    Readers,
    /// Reconstruction and pullback.
    Library,
    /// The command line.
    Program,
}

impl Part {
    /// All parts, in the order of the summary.
    pub const ALL: [Self; 3] = [Self::Readers, Self::Library, Self::Program];

    /// Name on the command line and in the summary.
    pub fn name(self) -> &'static str {
        ["readers", "library", "program"][self as usize]
    }

    /// Part of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|part| part.name() == name)
    }
}

/// An input, which follows from these three alone.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Part.
    pub part: Part,
    /// Seed of the run.
    pub seed: u64,
    /// Number within the part, from 0.
    pub number: u64,
}

impl Case {
    /// Random numbers of this input.
    pub fn random(&self) -> Random {
        Random::new(self.seed, self.part as u64, self.number)
    }
}

impl fmt::Display for Case {
    /// The command that repeats this input.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (part, seed, number) = (self.part.name(), self.seed, self.number);
        write!(
            f,
            "cargo xtask fuzz --seed {seed} --part {part} --case {number}"
        )
    }
}

/// Result of one input.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Row of the summary.
    pub row: &'static str,
    /// Whether the input was accepted, not refused with an error.
    pub accepted: bool,
    /// Peak of live memory per byte of input; 0 where that is not measured.
    pub memory_ratio: f64,
    /// Time per byte of input, in ns; 0 where that is not measured.
    pub ns_per_byte: f64,
    /// Description of a broken promise.
    pub failure: Option<String>,
}

/// Inputs of one part.
pub trait Inputs {
    /// Runs the input of these random numbers. A failing input is saved in `folder`, in a file or folder whose name
    /// begins with `name`.
    fn run(&mut self, random: Random, folder: &Path, name: &str) -> Outcome;
}

/// Message and location of the last panic of any thread.
static LAST_PANIC: Mutex<Option<String>> = Mutex::new(None);

/// Keeps messages of panics for [`catch`] instead of printing them.
pub fn keep_panics() {
    panic::set_hook(Box::new(|info| {
        if let Ok(mut last) = LAST_PANIC.lock() {
            *last = Some(info.to_string().replace('\n', ": "));
        }
    }));
}

/// Runs `work`; a panic becomes an error.
pub fn catch<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let work = AssertUnwindSafe(work);
    panic::catch_unwind(work).map_err(|_| {
        let last = LAST_PANIC.lock().ok().and_then(|mut last| last.take());
        last.unwrap_or_else(|| "panicked".into())
    })
}

/// Checks that a message has one line of at most 500 characters, without control characters.
pub fn check_message(message: &str) -> Result<(), String> {
    let length = message.chars().count();
    if message.is_empty() || length > 500 || message.chars().any(char::is_control) {
        let shown: String = message.chars().take(200).collect();
        return Err(format!(
            "a message is empty, too long ({length} characters) or has control characters: {shown:?}"
        ));
    }
    Ok(())
}
