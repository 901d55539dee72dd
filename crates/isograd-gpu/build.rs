//! Sets the cfg `cube`, under which formulas shared with the CPU become parts of kernels.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(cube)");
    println!("cargo::rustc-cfg=cube");
    println!("cargo::rerun-if-changed=build.rs");
}
