//! The generator reproduces the committed sample environments and the sample mesh.

#[path = "../examples/sample_assets/main.rs"]
#[allow(dead_code)]
mod sample_assets;

use std::path::Path;

use containers::{ReadOptions, read_image};

/// Bit for bit with the numeric libraries that made the committed files; with others a sine may differ in its
/// last bit, which occasionally changes a half float by one unit in the last place.
#[test]
fn regenerating_the_samples_gives_the_committed_bytes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    for (name, bytes) in sample_assets::files().unwrap() {
        let committed = std::fs::read(folder.join(name)).unwrap();
        assert!(committed.len() < 1_000_000, "{name} has {} bytes", committed.len());
        if cfg!(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu")) {
            assert!(committed == bytes, "{name} differs: run the example sample_assets and commit its files");
        }
        if name.ends_with(".glb") {
            assert_eq!(committed.len(), bytes.len(), "{name}");
            continue;
        }
        let decode = |bytes: &[u8]| read_image(bytes, &ReadOptions::default()).unwrap().image;
        let (old, new) = (decode(&committed), decode(&bytes));
        assert_eq!((old.width(), old.height()), (512, 256));
        let values = old.pixels().as_flattened().iter().zip(new.pixels().as_flattened());
        assert!(values.clone().all(|(old, new)| (old - new).abs() <= old.abs() / 512.0 + 1e-6), "{name}");
    }
}
