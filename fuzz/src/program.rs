//! The command line: kills, signals, full disks, outputs that nobody reads, and input that cannot be read.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use isograd::PointCloud;

use crate::case::{Inputs, Outcome, check_message};
use crate::files::{Seed, corpus, mutant};
use crate::random::Random;

/// Command lines that write files, and their outputs.
const JOBS: [(&str, &[&str]); 5] = [
    (
        "reconstruct cloud.ply -o out --resolution 40",
        &[
            "out/mesh.ply",
            "out/sdf.vti",
            "out/points.ply",
            "out/report.json",
            "out/slices.png",
        ],
    ),
    (
        "reconstruct cloud.ply --resolution 32 --mesh m.obj --sdf s.npz --points p.npz -q",
        &["m.obj", "s.npz", "p.npz"],
    ),
    (
        "sample fish -n 20000 --layout random -o fish.csv",
        &["fish.csv"],
    ),
    ("orient cloud.ply -o normals.xyz", &["normals.xyz"]),
    (
        "query cloud_mesh.stl --at cloud.ply -o distances.ply",
        &["distances.ply"],
    ),
];
/// Command lines that write to standard output.
const PRINTING: [&str; 4] = [
    "info cloud.ply",
    "sample --list",
    "--help",
    "gradcheck cloud.ply --resolution 16",
];
/// Signals, with their numbers.
const SIGNALS: [(&str, i32); 4] = [("KILL", 9), ("TERM", 15), ("HUP", 1), ("INT", 2)];

/// Contents of files by name.
type Files = BTreeMap<String, Vec<u8>>;
type Checked = Result<(), String>;

/// A program, and the complete outputs of its jobs.
pub struct Program {
    path: PathBuf,
    complete: Vec<(Files, Duration)>,
    inputs: Files,
    corpus: Vec<Seed>,
}

/// End of a run.
struct Run {
    status: ExitStatus,
    stderr: String,
}

impl Program {
    /// Runs every job to its end, in `folder`.
    pub fn new(path: PathBuf, folder: &Path) -> Result<Self, String> {
        let folder = folder.join("complete");
        let text = |e: std::io::Error| format!("{}: {e}", folder.display());
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).map_err(text)?;
        let point = |i: usize| {
            let (z, turn) = ((2 * i + 1) as f32 / 500.0 - 1.0, i as f32 * 2.399_963);
            let r = (1.0 - z * z).sqrt();
            [r * turn.cos(), r * turn.sin(), z]
        };
        let cloud = PointCloud::new((0..500).map(point).collect()).map_err(|e| e.to_string())?;
        isograd_io::write_cloud(&folder.join("cloud.ply"), &cloud).map_err(|e| e.to_string())?;
        let mut program = Self {
            path,
            complete: Vec::new(),
            inputs: Files::new(),
            corpus: corpus()?,
        };
        program.expect(
            &folder,
            "reconstruct cloud.ply --resolution 24 --mesh cloud_mesh.stl -q",
        )?;
        program.inputs = files(&folder);
        for (line, names) in JOBS {
            let start = Instant::now();
            program.expect(&folder, line)?;
            let time = start.elapsed();
            let mut written = files(&folder);
            written.retain(|name, _| names.contains(&name.as_str()));
            program.complete.push((written, time));
        }
        fs::remove_dir_all(&folder).map_err(text)?;
        Ok(program)
    }

    fn command(&self, folder: &Path, line: &str) -> Command {
        let mut command = Command::new(&self.path);
        command.args(line.split_whitespace()).current_dir(folder);
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        command
    }

    /// Runs a command line that has to succeed.
    fn expect(&self, folder: &Path, line: &str) -> Checked {
        let run = finish(&mut self.command(folder, line), |_| Ok(()))?;
        match run.status.success() {
            true => Ok(()),
            false => Err(format!(
                "`isograd {line}`: {}: {}",
                run.status,
                run.stderr.trim()
            )),
        }
    }

    /// Sends a signal at a random moment.
    fn kill(&self, folder: &Path, random: &mut Random) -> Checked {
        let job = random.below(JOBS.len());
        let (name, number) = random.pick(&SIGNALS);
        let delay = self.complete[job].1.mul_f64(random.between(0.0, 1.2));
        let mut command = self.command(folder, JOBS[job].0);
        let run = finish(&mut command, |id| {
            std::thread::sleep(delay);
            // A shell without a program `kill` has it built in.
            let script = format!("kill -{name} {id}");
            Command::new("sh")
                .args(["-c", &script])
                .stderr(Stdio::null())
                .status()
                .map(drop)
        })?;
        let what = format!("SIG{name} after {delay:?}");
        let ended = run.status.success()
            || run.status.signal() == Some(number)
            || number != 9 && run.status.code() == Some(128 + number);
        if !ended {
            return Err(format!("{what}: {}: {}", run.status, run.stderr.trim()));
        }
        self.old_or_new(folder, job, number == 9)
            .map_err(|e| format!("{what}: {e}"))?;
        if number == 9 {
            // The next run succeeds and removes what the killed one left.
            self.expect(folder, JOBS[job].0)?;
            self.old_or_new(folder, job, false)
                .map_err(|e| format!("a run after {what}: {e}"))?;
        }
        Ok(())
    }

    /// Limits the size of files, which stands in for a disk that fills up.
    fn full_disk(&self, folder: &Path, random: &mut Random) -> Checked {
        let job = random.below(JOBS.len());
        let largest = self.complete[job]
            .0
            .values()
            .map(Vec::len)
            .max()
            .unwrap_or(0);
        let blocks = random.below(largest / 512 + 2);
        let is_ignored = random.one_in(2);
        let trap = if is_ignored { "trap '' XFSZ; " } else { "" };
        let script = format!("{trap}ulimit -f {blocks}; exec \"$0\" {}", JOBS[job].0);
        let mut command = Command::new("sh");
        command
            .arg("-c")
            .arg(&script)
            .arg(&self.path)
            .current_dir(folder);
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let run = finish(&mut command, |_| Ok(()))?;
        let what = format!("files of at most {blocks} blocks");
        let is_error = is_ignored && run.status.code() == Some(1);
        // SIGXFSZ.
        let is_killed =
            !is_ignored && (run.status.signal() == Some(25) || run.status.code() == Some(153));
        if !run.status.success() && !is_error && !is_killed {
            return Err(format!("{what}: {}: {}", run.status, run.stderr.trim()));
        }
        if is_error && !run.stderr.contains("free some space") {
            return Err(format!(
                "{what}: the error does not name the disk: {}",
                run.stderr.trim()
            ));
        }
        self.old_or_new(folder, job, is_killed)
            .map_err(|e| format!("{what}: {e}"))
    }

    /// Runs with a standard output that is full or closed.
    fn standard_output(&self, folder: &Path, random: &mut Random) -> Checked {
        let line = random.pick(&PRINTING);
        let mut command = self.command(folder, line);
        let is_full = random.one_in(2);
        if is_full {
            let full = fs::OpenOptions::new().write(true).open("/dev/full");
            command.stdout(full.map_err(|e| format!("/dev/full: {e}"))?);
        } else {
            // The end that reads is closed at once.
            let (_, writer) = std::io::pipe().map_err(|e| e.to_string())?;
            command.stdout(writer);
        }
        let run = finish(&mut command, |_| Ok(()))?;
        match (is_full, run.status.code()) {
            (true, Some(1)) | (false, Some(0 | 1 | 141)) => Ok(()),
            _ => {
                let what = if is_full { "a full" } else { "a closed" };
                Err(format!(
                    "`isograd {line}` with {what} output: {}: {}",
                    run.status,
                    run.stderr.trim()
                ))
            }
        }
    }

    /// Gives input that is missing, empty, no file, or mutated.
    fn bad_input(&self, folder: &Path, random: &mut Random) -> Checked {
        let seed = &self.corpus[random.below(self.corpus.len())];
        let name = format!("bad_{}", seed.name);
        let path = folder.join(&name);
        let kind = random.pick(&[
            "mutated",
            "mutated",
            "missing",
            "folder",
            "empty",
            "unreadable",
        ]);
        let made = match kind {
            "mutated" => fs::write(&path, mutant(seed, &self.corpus, random).bytes),
            "folder" => fs::create_dir(&path),
            "empty" => fs::write(&path, b""),
            // Reading the memory of a process from its start fails, even for the superuser.
            "unreadable" => std::os::unix::fs::symlink("/proc/self/mem", &path),
            _ => Ok(()),
        };
        made.map_err(|e| e.to_string())?;
        let before = files(folder);
        let line = match random.below(3) {
            0 => format!("reconstruct {name} --mesh bad.stl --resolution 16"),
            1 => format!("orient {name} -o normals.ply"),
            _ => format!("info {name}"),
        };
        let run = finish(&mut self.command(folder, &line), |_| Ok(()))?;
        let what = format!("`isograd {line}` with a {kind} file");
        if run.status.success() && kind == "mutated" {
            return Ok(());
        }
        let message = run.stderr.trim();
        if run.status.code() != Some(1) || !message.contains("error: ") {
            return Err(format!("{what}: {}: {message}", run.status));
        }
        for line in message.lines() {
            check_message(line).map_err(|e| format!("{what}: {e}"))?;
        }
        match files(folder) == before {
            true => Ok(()),
            false => Err(format!("{what}: files were written")),
        }
    }

    /// Checks that every output of a job has its old or its complete new content, and that nothing else was written. With
    /// `temporary`, hidden files may be there.
    fn old_or_new(&self, folder: &Path, job: usize, temporary: bool) -> Checked {
        let complete = &self.complete[job].0;
        for (name, content) in files(folder) {
            let is_hidden = name.rsplit('/').next().unwrap_or_default().starts_with('.');
            let expected = match complete.get(&name) {
                // Times differ between runs.
                Some(_) if name.ends_with(".json") => {
                    serde_json::from_slice::<serde_json::Value>(&content).is_ok()
                }
                Some(new) => content == *new || content == old(&name),
                None if is_hidden => temporary,
                None => self.inputs.get(&name) == Some(&content) || content == old(&name),
            };
            if !expected {
                return Err(format!(
                    "{name} has {} bytes and is neither old nor new",
                    content.len()
                ));
            }
        }
        Ok(())
    }
}

impl Inputs for Program {
    fn run(&mut self, mut random: Random, folder: &Path, name: &str) -> Outcome {
        type Check = fn(&Program, &Path, &mut Random) -> Checked;
        let checks: [(&str, Check); 5] = [
            ("killed", Self::kill),
            ("killed", Self::kill),
            ("full disk", Self::full_disk),
            ("standard output", Self::standard_output),
            ("bad input", Self::bad_input),
        ];
        let (row, check) = random.pick(&checks);
        let folder = folder.join(name);
        let failure = self
            .fill(&folder, &mut random)
            .map_err(|e| format!("{}: {e}", folder.display()))
            .and_then(|()| check(self, &folder, &mut random));
        if failure.is_ok() {
            let _ = fs::remove_dir_all(&folder);
        }
        Outcome {
            row,
            accepted: failure.is_ok(),
            failure: failure.err(),
            ..Outcome::default()
        }
    }
}

impl Program {
    /// A new folder with the inputs and, in half of the cases, old outputs.
    fn fill(&self, folder: &Path, random: &mut Random) -> std::io::Result<()> {
        let _ = fs::remove_dir_all(folder);
        fs::create_dir_all(folder)?;
        for (name, content) in &self.inputs {
            fs::write(folder.join(name), content)?;
        }
        if random.one_in(2) {
            fs::create_dir(folder.join("out"))?;
            for name in JOBS.iter().flat_map(|job| job.1) {
                fs::write(folder.join(name), old(name))?;
            }
        }
        Ok(())
    }
}

/// Content of an output before the run.
fn old(name: &str) -> Vec<u8> {
    format!("\"old {name}\"").into_bytes()
}

/// Starts a command, calls `meanwhile` with its process id, and waits. A panic of the program is an error.
fn finish(
    command: &mut Command,
    meanwhile: impl FnOnce(u32) -> std::io::Result<()>,
) -> Result<Run, String> {
    let run = || {
        let mut child = command.spawn()?;
        let done = meanwhile(child.id());
        let mut stderr = Vec::new();
        if let Some(mut pipe) = child.stderr.take() {
            pipe.read_to_end(&mut stderr)?;
        }
        let status = child.wait()?;
        done.map(|()| (status, String::from_utf8_lossy(&stderr).into_owned()))
    };
    let (status, stderr) = run().map_err(|e: std::io::Error| format!("{command:?}: {e}"))?;
    match stderr.contains("panicked") || status.code() == Some(101) {
        true => Err(format!("the program panicked: {stderr}")),
        false => Ok(Run { status, stderr }),
    }
}

/// Contents of all files in a folder and its subfolders; those that cannot be read are empty.
fn files(folder: &Path) -> Files {
    let mut files = Files::new();
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if path.is_dir() {
            let inner = self::files(&path).into_iter();
            files.extend(inner.map(|(file, content)| (format!("{name}/{file}"), content)));
        } else {
            files.insert(name, fs::read(&path).unwrap_or_default());
        }
    }
    files
}
