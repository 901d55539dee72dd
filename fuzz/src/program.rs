//! The command line: kills, signals, full disks, outputs that nobody reads, and input that cannot be read.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

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
        "query mesh.stl --at cloud.ply -o distances.ply",
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
/// A check in a folder with the inputs.
type Check = fn(&Program, &Path, &mut Random) -> Checked;

/// Checks by the row of the summary that counts them.
const CHECKS: [(&str, Check); 5] = [
    ("killed", Program::kill),
    ("killed", Program::kill),
    ("full disk", Program::full_disk),
    ("standard output", Program::standard_output),
    ("bad input", Program::bad_input),
];

/// The program, its inputs, and for each job the complete outputs and the time.
pub struct Program {
    path: PathBuf,
    inputs: Files,
    complete: Vec<(Files, Duration)>,
    corpus: Vec<Seed>,
}

/// End of a run.
struct Run {
    /// Exit status; 128 and the number of the signal that ended it.
    status: i32,
    stderr: String,
}

impl fmt::Display for Run {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "status {}: {}", self.status, self.stderr.trim())
    }
}

impl Program {
    /// Runs every job to its end, in `folder`.
    pub fn new(path: PathBuf, folder: &Path) -> Result<Self, String> {
        let folder = folder.join("complete");
        let text = |e: std::io::Error| format!("{}: {e}", folder.display());
        let mut program = Self {
            path,
            inputs: Files::new(),
            complete: Vec::new(),
            corpus: corpus()?,
        };
        program.fill(&folder, false).map_err(text)?;
        program.expect(&folder, "sample sphere -n 500 -o cloud.ply")?;
        program.expect(
            &folder,
            "reconstruct cloud.ply --resolution 24 --mesh mesh.stl -q",
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

    /// Makes a new folder with the inputs and, if so chosen, old outputs.
    fn fill(&self, folder: &Path, with_outputs: bool) -> std::io::Result<()> {
        let _ = fs::remove_dir_all(folder);
        fs::create_dir_all(folder)?;
        for (name, content) in &self.inputs {
            fs::write(folder.join(name), content)?;
        }
        if with_outputs {
            fs::create_dir(folder.join("out"))?;
            for name in JOBS.iter().flat_map(|job| job.1) {
                fs::write(folder.join(name), old(name))?;
            }
        }
        Ok(())
    }

    /// `isograd LINE` in a folder, after commands of the shell.
    fn command(&self, folder: &Path, before: &str, line: &str) -> Command {
        let mut command = Command::new("sh");
        let script = format!("{before}exec \"$0\" {line}");
        command
            .arg("-c")
            .arg(script)
            .arg(&self.path)
            .current_dir(folder);
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        command
    }

    /// Runs a command line that has to succeed.
    fn expect(&self, folder: &Path, line: &str) -> Checked {
        let run = finish(&mut self.command(folder, "", line), |_| Ok(()))?;
        check(run.status == 0, || format!("`isograd {line}`: {run}"))
    }

    /// Sends a signal at a random moment. After SIGKILL the next run removes what was left.
    fn kill(&self, folder: &Path, random: &mut Random) -> Checked {
        let job = random.below(JOBS.len());
        let (name, number) = random.pick(&SIGNALS);
        let delay = self.complete[job].1.mul_f64(random.between(0.0, 1.2));
        let run = finish(&mut self.command(folder, "", JOBS[job].0), |id| {
            std::thread::sleep(delay);
            // `kill` is built into the shell.
            let mut kill = Command::new("sh");
            kill.arg("-c").arg(format!("kill -{name} {id}"));
            kill.stderr(Stdio::null()).status().map(drop)
        })?;
        let what = format!("SIG{name} after {delay:?}");
        check([0, 128 + number].contains(&run.status), || {
            format!("{what}: {run}")
        })?;
        self.check_outputs(folder, job, &run, name == "KILL")
            .map_err(|e| format!("{what}: {e}"))?;
        if name == "KILL" {
            let run = finish(&mut self.command(folder, "", JOBS[job].0), |_| Ok(()))?;
            check(run.status == 0, || format!("a run after {what}: {run}"))?;
            return self
                .check_outputs(folder, job, &run, false)
                .map_err(|e| format!("a run after {what}: {e}"));
        }
        Ok(())
    }

    /// Limits the size of files, which stands in for a disk that fills up; the signal at the limit is ignored or not.
    fn full_disk(&self, folder: &Path, random: &mut Random) -> Checked {
        let job = random.below(JOBS.len());
        let sizes = self.complete[job].0.values().map(Vec::len);
        let blocks = random.below(sizes.max().unwrap_or(0) / 512 + 2);
        let (trap, status) = random.pick(&[("", 128 + 25), ("trap '' XFSZ; ", 1)]);
        let limit = format!("{trap}ulimit -f {blocks}; ");
        let run = finish(&mut self.command(folder, &limit, JOBS[job].0), |_| Ok(()))?;
        let is_clear = run.status != 1 || run.stderr.contains("free some space");
        check([0, status].contains(&run.status) && is_clear, || {
            format!("{limit}{run}")
        })?;
        self.check_outputs(folder, job, &run, status != 1)
            .map_err(|e| format!("{limit}{e}"))
    }

    /// Runs with a standard output that is full, or that nobody reads.
    fn standard_output(&self, folder: &Path, random: &mut Random) -> Checked {
        let (line, is_full) = (random.pick(&PRINTING), random.one_in(2));
        let mut command = self.command(folder, "", line);
        if is_full {
            let full = fs::OpenOptions::new().write(true).open("/dev/full");
            command.stdout(full.map_err(|e| format!("/dev/full: {e}"))?);
        } else {
            // The end that reads is closed at once.
            command.stdout(std::io::pipe().map_err(|e| e.to_string())?.1);
        }
        let run = finish(&mut command, |_| Ok(()))?;
        let (what, allowed): (_, &[i32]) = if is_full {
            ("full", &[1])
        } else {
            ("closed", &[0, 1, 141])
        };
        check(allowed.contains(&run.status), || {
            format!("{what} standard output, {line}: {run}")
        })
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
            1 => format!("orient {name} -o bad.ply"),
            _ => format!("info {name}"),
        };
        let run = finish(&mut self.command(folder, "", &line), |_| Ok(()))?;
        if run.status == 0 && kind == "mutated" {
            return Ok(());
        }
        let is_error = run.status == 1 && run.stderr.contains("error: ") && files(folder) == before;
        check(is_error, || format!("{kind} input, {line}: {run}"))?;
        run.stderr.lines().try_for_each(check_message)
    }

    /// Checks that every output of a job has its old or its complete new content, the latter if the run succeeded, and that
    /// nothing else was written. With `temporary`, hidden files may be there.
    fn check_outputs(&self, folder: &Path, job: usize, run: &Run, temporary: bool) -> Checked {
        let (found, complete) = (files(folder), &self.complete[job].0);
        for (name, content) in &found {
            let is_hidden = name.rsplit('/').next().unwrap_or_default().starts_with('.');
            let is_old = run.status != 0 && *content == old(name);
            let is_right = match complete.get(name) {
                // Times differ between runs.
                Some(_) if name.ends_with(".json") => {
                    is_old || content.starts_with(b"{") && content.ends_with(b"}\n")
                }
                Some(new) => is_old || content == new,
                None if is_hidden => temporary,
                None => self.inputs.get(name) == Some(content) || *content == old(name),
            };
            check(is_right, || {
                format!(
                    "{name} has {} bytes, neither old nor new; {run}",
                    content.len()
                )
            })?;
        }
        let missing = complete
            .keys()
            .find(|name| run.status == 0 && !found.contains_key(*name));
        missing.map_or(Ok(()), |name| Err(format!("{name} is missing")))
    }
}

impl Inputs for Program {
    fn run(&mut self, mut random: Random, folder: &Path, name: &str) -> Outcome {
        let (row, check) = random.pick(&CHECKS);
        let folder = folder.join(name);
        let filled = self
            .fill(&folder, random.one_in(2))
            .map_err(|e| e.to_string());
        let result = filled.and_then(|()| check(self, &folder, &mut random));
        if result.is_ok() {
            let _ = fs::remove_dir_all(&folder);
        }
        Outcome {
            row,
            accepted: result.is_ok(),
            failure: result.err(),
            ..Outcome::default()
        }
    }
}

fn check(is_right: bool, problem: impl FnOnce() -> String) -> Checked {
    if is_right { Ok(()) } else { Err(problem()) }
}

/// Content of an output before the run.
fn old(name: &str) -> Vec<u8> {
    format!("old {name}").into_bytes()
}

/// Starts a command, calls `meanwhile` with its process id, and waits. A panic of the program is an error.
fn finish(
    command: &mut Command,
    meanwhile: impl FnOnce(u32) -> std::io::Result<()>,
) -> Result<Run, String> {
    let run = || {
        let child = command.spawn()?;
        meanwhile(child.id())?;
        child.wait_with_output()
    };
    let output = run().map_err(|e| format!("{command:?}: {e}"))?;
    let signal = output.status.signal().map(|number| 128 + number);
    let run = Run {
        status: output.status.code().or(signal).unwrap_or(-1),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    };
    let is_panic = run.status == 101 || run.stderr.contains("panicked");
    check(!is_panic, || format!("the program panicked: {run}")).map(|()| run)
}

/// Contents of all files in a folder and its subfolders; those that cannot be read are empty.
fn files(folder: &Path) -> Files {
    let mut files = Files::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let (path, name) = (
            entry.path(),
            entry.file_name().to_string_lossy().into_owned(),
        );
        if path.is_dir() {
            let inner = self::files(&path).into_iter();
            files.extend(inner.map(|(file, content)| (format!("{name}/{file}"), content)));
        } else {
            files.insert(name, fs::read(&path).unwrap_or_default());
        }
    }
    files
}
