//! Times one stage, one run at a time, for a program that runs other libraries in between.
//!
//! `stage-times STAGE FOLDER TYPE THREADS` reads its input from FOLDER, prints `ready`, and then replies to each line of its
//! input: to `run` with the seconds of one forward pass, to `save` with `saved` once the outputs are in FOLDER. Arrays are raw little-endian files, `NAME.f32`, `.f64` or `.u32`.

mod files;
mod samples;
mod stages;

use std::io::{BufRead, Write};
use std::time::Instant;

use isograd::Pipeline;
use isograd_benches::output::Outcome;
use isograd_benches::pool;

use files::{Folder, Number};
use stages::Stage;

fn main() -> Outcome {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [stage, folder, number, threads] = arguments.as_slice() else {
        return Err("usage: stage-times STAGE FOLDER f32|f64 THREADS".into());
    };
    let folder = Folder::open(folder)?;
    let threads = threads.parse()?;
    match number.as_str() {
        "f32" => serve::<f32>(stage, &folder, threads),
        "f64" => serve::<f64>(stage, &folder, threads),
        other => Err(format!("'{other}' is neither f32 nor f64").into()),
    }
}

/// Replies to requests until the input ends.
fn serve<T: Pipeline + Number>(name: &str, folder: &Folder, threads: usize) -> Outcome {
    let pool = pool(threads);
    let mut stage =
        pool.install(|| stages::by_name::<T>(name, folder).map_err(|e| e.to_string()))?;
    reply("ready")?;
    for request in std::io::stdin().lock().lines() {
        match request?.as_str() {
            "run" => reply(&pool.install(|| seconds(stage.as_mut()))?.to_string())?,
            "save" => {
                stage.save(folder)?;
                reply("saved")?;
            }
            other => return Err(format!("'{other}' is not a request: expected run or save").into()),
        }
    }
    Ok(())
}

fn seconds(stage: &mut dyn Stage) -> Result<f64, String> {
    stage.prepare();
    let start = Instant::now();
    stage.run()?;
    Ok(start.elapsed().as_secs_f64())
}

fn reply(line: &str) -> Outcome {
    let mut output = std::io::stdout().lock();
    writeln!(output, "{line}")?;
    Ok(output.flush()?)
}
