//! `cargo xtask deny`: licenses, bans, sources and advisories of the dependencies, as `deny.toml` sets them.

use std::process::Stdio;

use crate::process::{self, Outcome};

/// Runs cargo-deny, if it is installed. Advisories are fetched.
pub fn run(offline: bool) -> Outcome {
    if !installed() {
        println!(
            "SKIPPED deny: cargo-deny is not installed; run `cargo install --locked cargo-deny`"
        );
        return Ok(());
    }
    check(&["licenses", "bans", "sources"])?;
    if offline {
        println!("SKIPPED advisories: --offline");
        return Ok(());
    }
    check(&["advisories"])
}

fn check(what: &[&str]) -> Outcome {
    process::run(process::cargo(["deny", "--workspace", "check"]).args(what))
}

fn installed() -> bool {
    let mut command = process::cargo(["deny", "--version"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
