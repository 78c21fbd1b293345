//! A small scene for the window's tests.

use std::sync::Arc;

use brdf::{Choice, Lambert, MODELS, Material, Value, Values, project};
use envmap::{CubeMap, Environment};
use sh::{Degree, Expansion, Lighting, Stop, Transform};
use shrm::Reflection;
use sphere::{Cube, Direction, LatLong};

use preview::{
    CompactMap, CompactTaps, FormField, FormSection, Light, Look, MapSizes, MaterialForm, PrefilteredCube,
    Scene,
};
use taps::{ScaleSpace, Widths, fit};

/// A white diffuse sphere under a sky that is brighter above.
pub(crate) fn scene() -> Scene {
    let grid = LatLong::with_rows(16);
    let pixels: Vec<[f32; 3]> =
        (0..grid.len()).map(|pixel| [1.0 + (pixel < grid.len() / 2) as u8 as f32; 3]).collect();
    let environment = Environment::new(grid, pixels).unwrap();
    let degree = Degree::new(7).unwrap();
    let lighting = Transform::new(grid, degree).unwrap().analyse(environment.pixels());
    let white = Material::Lambert(Lambert::new([0.8; 3]).unwrap());
    let coefficients =
        project(&white, Choice::Degree { f: degree, p: Degree::ZERO }, Stop::NEVER).unwrap().coefficients;
    let reflection = Reflection::convolve(&lighting, &coefficients);
    let light = Arc::new(Light::new(environment, Some(lighting)));
    let look = Look::new(light, reflection, Some(white), MapSizes { edge: 8, slices: 4 });
    Scene::of(Arc::new(mesh::shape("sphere").unwrap()), Arc::new(look))
}

/// The scene of [`scene`] before its maps are made.
pub(crate) fn without_maps() -> Scene {
    let scene = scene();
    let object = &scene.objects[0];
    let material = object.look.material().unwrap().clone();
    let look = Look::without_maps(Arc::clone(&scene.light), material, object.look.sizes());
    Scene::of(Arc::clone(&object.mesh), Arc::new(look))
}

/// The light of [`scene`] alone, with a cube of two levels, which the second of two spheres reads between.
pub(crate) fn light_alone() -> Scene {
    let scene = scene();
    let level = |edge: usize| CubeMap::new(Cube { edge }, vec![[1.5; 3]; 6 * edge * edge]).unwrap();
    let cube = Arc::new(PrefilteredCube::new([2, 1].map(level).into()).unwrap());
    let look = |roughness| {
        let cube = Some((Arc::clone(&cube), roughness));
        Arc::new(Look::of_white_metal(Arc::clone(&scene.light), roughness, cube).unwrap())
    };
    Scene::row(Arc::clone(&scene.light), &scene.objects[0].mesh, &[0.0, 0.5].map(look))
}

/// The scene of [`scene`] with the taps of its material and the scale space of its light.
pub(crate) fn with_taps() -> Scene {
    let scene = scene();
    let object = &scene.objects[0];
    let material = object.look.material().unwrap().clone();
    let widths = Widths::new(8).unwrap();
    let scales = ScaleSpace::new(scene.light.environment(), &[], widths, Stop::NEVER).unwrap();
    let taps = CompactTaps::Angle(fit(&material, 1, widths, Stop::NEVER).unwrap().table);
    let map = CompactMap { scales: Arc::new(scales), taps: Arc::new(taps), material: material.clone() };
    let look = Look::without_maps(Arc::clone(&scene.light), material, object.look.sizes());
    Scene::of(Arc::clone(&object.mesh), Arc::new(look.with_compact_map(Some(Arc::new(map)))))
}

/// A sphere with a BRDF table under two circular lights: one in front of the camera, one behind it.
pub(crate) fn lamps() -> Scene {
    let disk = |x: f64| sh::Light::from_flux(Direction::normalised([x, 0.0, 0.3].into()), 0.1, [1.0; 3]);
    let degree = Degree::new(2).unwrap();
    let lighting = Lighting { series: Expansion::zero(degree), lights: vec![disk(1.0), disk(-1.0)] };
    let white = Material::Lambert(Lambert::new([0.8; 3]).unwrap());
    let (table, _) = brdf::tabulate(&white, degree, 4, Stop::NEVER).unwrap();
    let light = Arc::new(Light::of_lighting(lighting).unwrap());
    let look = Look::without_maps(light, white, MapSizes { edge: 8, slices: 4 });
    let look = Arc::new(look.with_table(Some(Arc::new(table))));
    Scene::of(Arc::new(mesh::shape("sphere").unwrap()), look)
}

/// The parameters of [`phong_form`].
pub(crate) const EXPONENT: FormField = FormField { section: 0, parameter: 0 };
pub(crate) const SPECULAR: FormField = FormField { section: 0, parameter: 1 };

/// The form of a material file with the model `phong`.
pub(crate) fn phong_form(exponent: f64) -> MaterialForm {
    let model = MODELS.iter().find(|model| model.name == "phong").unwrap();
    let values = Values::default()
        .with("exponent", Value::Number(exponent))
        .with("specular", Value::Colour([1.0, 0.8, 0.3]));
    let parameters = model.parameters.to_vec();
    MaterialForm {
        sections: vec![FormSection { heading: "phong".into(), place: Vec::new(), parameters, values }],
    }
}
