//! Gives the program of Windows its manifest: paths of any length, and UTF-8 wherever a function of the
//! system takes text.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_CFG_WINDOWS").is_some() {
        let manifest = embed_manifest::new_manifest("Specula");
        embed_manifest::embed_manifest(manifest).expect("the manifest is written to the build folder");
    }
}
