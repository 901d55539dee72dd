//! Passes the location of the source files to the build script of `isograd-gpu`, which compiles them again as parts of
//! kernels.

fn main() {
    let root = std::env::var("CARGO_MANIFEST_DIR").expect("set by cargo");
    println!("cargo::metadata=source={root}/src");
    println!("cargo::rerun-if-changed=build.rs");
}
