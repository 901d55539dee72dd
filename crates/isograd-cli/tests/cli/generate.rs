//! `isograd completions`, `isograd man` and `--help`.

use std::process::Command;

use crate::sandbox::Sandbox;

const COMMANDS: [&str; 7] = [
    "reconstruct",
    "orient",
    "sample",
    "query",
    "fit",
    "gradcheck",
    "info",
];

#[test]
fn completions_name_every_command_in_every_shell() {
    let sandbox = Sandbox::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let run = sandbox.done(&format!("completions {shell}"));
        assert_eq!(run.stderr, "", "{shell}");
        for command in COMMANDS {
            assert!(run.stdout.contains(command), "{shell} {command}");
        }
        assert!(run.stdout.contains("skip-existing"), "{shell}");
    }
    sandbox.says("2 completions tcsh | bash");
    sandbox.says("2 completions | SHELL");
}

#[cfg(target_os = "linux")]
#[test]
fn bash_completes_flags_and_commands() {
    let sandbox = Sandbox::new();
    sandbox.write("isograd.bash", sandbox.done("completions bash").stdout);
    let bash = |script: &str| {
        let mut command = Command::new("bash");
        command
            .args(["--norc", "-c", script])
            .current_dir(sandbox.path("."));
        let output = command.output().expect("bash starts");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    bash("bash -n isograd.bash");
    let completed = bash(
        "source isograd.bash; COMP_WORDS=(isograd reconstruct --res); COMP_CWORD=2; _isograd isograd --res reconstruct; echo \"${COMPREPLY[@]}\"",
    );
    assert_eq!(completed.trim(), "--resolution");
    let completed = bash(
        "source isograd.bash; COMP_WORDS=(isograd gr); COMP_CWORD=1; _isograd isograd gr isograd; echo \"${COMPREPLY[@]}\"",
    );
    assert_eq!(completed.trim(), "gradcheck");
}

#[test]
fn every_command_has_a_manual_page() {
    let sandbox = Sandbox::with("man -o man/man1");
    let page = |name: &str| {
        let text = sandbox.read(&format!("man/man1/{name}.1"));
        String::from_utf8(text).expect("text")
    };
    assert!(page("isograd").contains("isograd\\-reconstruct(1)"));
    for command in COMMANDS {
        let text = page(&format!("isograd-{command}"));
        assert!(
            text.contains(".SH NAME") && text.contains(".SH OPTIONS"),
            "{command}"
        );
    }
    assert!(page("isograd-reconstruct").contains("\\-\\-skip\\-existing"));
    sandbox.write("file", "");
    sandbox.says("1 man -o file | cannot write file");
    sandbox.says("2 man | --output");
}

#[test]
fn help_says_what_the_program_does_with_an_example() {
    let help = Sandbox::new().done("--help").stdout;
    for part in [
        "point clouds",
        "verdict",
        "isograd reconstruct cloud.ply -o out",
        "Exit status",
    ] {
        assert!(help.contains(part), "{part}: {help}");
    }
}
