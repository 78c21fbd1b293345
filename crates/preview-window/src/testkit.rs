//! A small scene for the window's tests.

use std::sync::Arc;

use brdf::{Choice, Lambert, Material, project};
use envmap::Environment;
use sh::{Degree, Transform};
use shrm::Reflection;
use sphere::LatLong;

use preview::{Light, Look, MapSizes, Scene};

/// A white diffuse sphere under a sky that is brighter above.
pub(crate) fn scene() -> Scene {
    let grid = LatLong::with_rows(16);
    let pixels: Vec<[f32; 3]> =
        (0..grid.len()).map(|pixel| [1.0 + (pixel < grid.len() / 2) as u8 as f32; 3]).collect();
    let environment = Environment::new(grid, pixels).unwrap();
    let degree = Degree::new(7).unwrap();
    let lighting = Transform::new(grid, degree).unwrap().analyse(environment.pixels());
    let white = Material::Lambert(Lambert::new([0.8; 3]).unwrap());
    let coefficients = project(&white, Choice::Degree { f: degree, p: Degree::ZERO }).unwrap().coefficients;
    let reflection = Reflection::convolve(&lighting, &coefficients);
    let light = Arc::new(Light::new(environment, Some(lighting)));
    let look = Look::new(light, reflection, Some(white), MapSizes { edge: 8, slices: 4 });
    Scene::of(Arc::new(mesh::shape("sphere").unwrap()), Arc::new(look))
}

/// The same before its maps are made.
pub(crate) fn without_maps() -> Scene {
    let scene = scene();
    let object = &scene.objects[0];
    let material = object.look.material().unwrap().clone();
    let look = Look::without_maps(Arc::clone(&scene.light), material, object.look.sizes());
    Scene::of(Arc::clone(&object.mesh), Arc::new(look))
}
