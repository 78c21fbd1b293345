//! A real environment, a real mesh and a measured material.

use std::path::Path;
use std::sync::Arc;

use envmap::{Environment, Layout};
use preview::{Mode, Scene, Show};
use sphere::LatLong;

use crate::compared::Compared;
use crate::{scenes, shot};

/// An environment of the corpus at a small size.
fn environment(file: &Path, layout: Layout) -> Environment {
    let bytes = std::fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let image = containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image;
    Environment::from_image(image, layout, Some(LatLong::with_rows(128))).unwrap()
}

#[test]
fn a_real_mesh_under_real_light_with_a_measured_material() {
    let test = "a_real_mesh_under_real_light_with_a_measured_material";
    let Some(folder) = test_data::folder(test, "SPECULA_CORPUS") else { return };
    let Some(mut compared) = Compared::new(test) else { return };
    let read =
        |file: &str| std::fs::read(folder.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
    let mut alone =
        |path: &str| -> Result<Arc<Vec<u8>>, containers::Error> { panic!("the file needs {path}") };
    let mesh = Arc::new(containers::read_gltf(&read("mesh/suzi.glb"), &mut alone).unwrap().mesh);
    let garnet = read("brdf/measured/garnet_red.brdf");
    let garnet = containers::measured::read("garnet_red.brdf", &garnet, None).unwrap();
    for (name, file, layout) in [
        ("grace", "env/probes/grace_probe.hdr", Layout::Probe),
        ("sunrise", "env/cc0/sunrise.hdr", Layout::LatLong),
    ] {
        let light = environment(&folder.join(file), layout);
        let exposure = light.exposure().stops;
        let look = scenes::look(light, garnet.clone(), 16, 4);
        let scene = Scene::of(Arc::clone(&mesh), look);
        for mode in Mode::ALL.into_iter().filter(|mode| scene.offers(*mode)) {
            let shot = preview::Shot { exposure, size: [120, 90], ..shot(&scene, Show::One(mode)) };
            compared.add(mode.name(), name, &scene, &shot);
        }
    }
    compared.finish();
}
