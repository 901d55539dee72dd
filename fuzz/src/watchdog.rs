//! Inputs that never end, or that end the whole program.
//!
//! The command that repeats the current input is kept in the file `target/fuzz/running`, from which `cargo xtask fuzz`
//! prints it if this program is killed or aborts.

use std::fs::File;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::case::Case;

/// Time after which an input counts as endless.
const ENDLESS: Duration = Duration::from_secs(120);

/// Watches the current input.
pub struct Watchdog {
    current: Arc<Mutex<(Instant, String)>>,
    file: File,
    path: PathBuf,
}

impl Watchdog {
    /// Starts the thread that ends the program with a message if an input is endless.
    pub fn start(folder: &Path) -> Result<Self, String> {
        let path = folder.join("running");
        let file = File::create(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let current = Arc::new(Mutex::new((Instant::now(), String::new())));
        let watched = Arc::clone(&current);
        std::thread::spawn(move || {
            loop {
                std::thread::sleep(Duration::from_secs(1));
                let Ok(current) = watched.lock() else { return };
                if current.0.elapsed() > ENDLESS {
                    let seconds = ENDLESS.as_secs();
                    println!("FAILED: no end after {seconds} s\n  repeat: {}", current.1);
                    std::process::exit(1);
                }
            }
        });
        Ok(Self {
            current,
            file,
            path,
        })
    }

    /// Notes that an input begins.
    pub fn begin(&mut self, case: &Case) {
        let command = case.to_string();
        // Padded, so that a shorter line covers a longer one.
        let _ = self.file.rewind();
        let _ = writeln!(self.file, "{command:<120}");
        if let Ok(mut current) = self.current.lock() {
            *current = (Instant::now(), command);
        }
    }

    /// Ends the watch: all inputs are done.
    pub fn stop(&self) {
        let _ = std::fs::remove_file(&self.path);
    }
}
