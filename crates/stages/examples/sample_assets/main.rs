//! Makes the sample environments and the sample mesh: `cargo run --release -p stages --example
//! sample_assets`.
//!
//! `assets/environments/sky.exr` is a clear sky whose sun is smaller than a texel, so a truncated series
//! rings and windows matter; `studio.exr` a dark room with softboxes and coloured rim lights.
//! `assets/meshes/knot.glb` is a knot that casts shadows on itself. `examples/brushed` has a head and a
//! teapot, `examples/probes` a room. The same bytes are written on every run.

#![allow(clippy::disallowed_methods)] // it may compute with std

mod glb;
mod head;
mod knot;
mod noise;
mod room;
mod sky;
mod solid;
mod studio;
mod teapot;

use std::error::Error;
use std::path::Path;

use containers::{Precision, write_exr};
use envmap::Image;
use sphere::LatLong;

/// The grid of the samples.
const GRID: LatLong = LatLong::with_rows(256);

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    for (name, bytes) in files()? {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(&folder))?;
        std::fs::write(&path, &bytes)?;
        println!("{} ({} kB)", path.display(), bytes.len() / 1000);
    }
    Ok(())
}

/// A file's path among the assets, and its content.
type File = (&'static str, Vec<u8>);

/// The sample environments, and the meshes.
pub(crate) fn files() -> Result<Vec<File>, Box<dyn Error>> {
    let scenes =
        [("environments/sky.exr", sky::render(GRID)), ("environments/studio.exr", studio::render(GRID))];
    let encoded = scenes.into_iter().map(|(name, pixels)| {
        let image = Image::new(GRID.width, GRID.height, pixels).ok_or("the grid has pixels")?;
        let fits = image.pixels().as_flattened().iter().all(|value| *value <= 65504.0);
        assert!(fits, "{name} is too bright for half floats");
        let encoded = write_exr(&image, Precision::Half, None)?;
        Ok((name, encoded.bytes))
    });
    let meshes = [
        ("meshes/knot.glb", knot::glb_of_knot()),
        ("../examples/brushed/meshes/head.glb", head::glb_of_head()),
        ("../examples/brushed/meshes/teapot.glb", teapot::glb_of_teapot()),
        ("../examples/probes/room.glb", room::glb_of_room()),
    ];
    encoded.chain(meshes.map(Ok)).collect()
}
