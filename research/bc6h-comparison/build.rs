//! Links the C++ library, which objects of the compressor use.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-link-arg-bins=-lstdc++");
}
