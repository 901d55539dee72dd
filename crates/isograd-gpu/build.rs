//! Compiles the formulas of `isograd-element` a second time, as parts of kernels: sets the cfg `cube` and writes the
//! line that includes their source files.

use std::path::Path;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(cube)");
    println!("cargo::rustc-cfg=cube");
    println!("cargo::rerun-if-changed=build.rs");
    let variable = |name: &str| std::env::var(name).expect("set by cargo");
    let formulas = Path::new(&variable("DEP_ISOGRAD_ELEMENT_SOURCE")).join("lib.rs");
    let module = format!("#[path = {formulas:?}]\n#[allow(dead_code)]\npub(crate) mod element;\n");
    let file = Path::new(&variable("OUT_DIR")).join("element.rs");
    std::fs::write(&file, module).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
}
