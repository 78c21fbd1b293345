//! The statistics of a scene in the inspector, computed on a thread: degrees, energies and sizes.

use brdf::Centre;
use sh::{energy_per_degree, image_energy, unstopped};
use shrm::accuracy::Accuracy;

use preview::{CompactTaps, Object, Scene};

/// Statistics of a scene; if it has several looks, of the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SceneStatistics {
    pub(crate) triangles: usize,
    pub(crate) objects: usize,
    /// The central directions of the maps.
    pub(crate) centre: String,
    /// Whether there is no material, but white metal that shows the light.
    pub(crate) shows_light: bool,
    /// The lighting's degree in the reflection; an imported map does not say.
    pub(crate) f: Option<usize>,
    /// The view's degree, of several maps the highest; `None` without maps.
    pub(crate) p: Option<usize>,
    /// Rows and columns of the environment.
    pub(crate) environment: [usize; 2],
    /// The number of lamps beside the lighting's series.
    pub(crate) lamps: usize,
    /// The share of the environment's energy in each degree; with lamps, of the environment without them.
    /// Empty without maps.
    pub(crate) lighting: Vec<f64>,
    /// The share of the reflected field's energy in each degree; empty for an imported map.
    pub(crate) reflected: Vec<f64>,
    /// The share of the reflected field's energy that is the same in every view: what a plain map holds.
    pub(crate) plain: Option<f64>,
    /// The name of each map and its bytes as 32-bit RGB.
    pub(crate) maps: Vec<(String, u64)>,
}

impl SceneStatistics {
    pub(crate) fn of(scene: &Scene) -> Self {
        let Some(first) = scene.objects.first() else { return Self::default() };
        let look = first.look.as_ref();
        let reflection = look.reflection();
        let environment = look.light().environment();
        let grid = environment.grid();
        let lamps = reflection.and_then(|made| made.lamps()).map_or(0, |lamps| lamps.lights.len());
        let soft = (lamps > 0).then(|| unstopped(|stop| environment.separate_lamps(stop)).soft);
        let total: f64 = image_energy(grid, soft.as_ref().unwrap_or(environment).pixels()).iter().sum();
        let lighting = || look.has_maps().then(|| look.light().lighting());
        let held = reflection.map(|made| made.lighting()).or_else(lighting);
        let held = held.map_or_else(Vec::new, energy_per_degree);
        let known: f64 = held.as_flattened().iter().sum();
        let share = |energy: &[f64; 3]| ratio(energy.iter().sum(), total.max(known));
        let accuracy = reflection.map(|reflection| Accuracy::of(reflection, [0.0; 3], 0.0));
        Self {
            triangles: scene.objects.iter().map(|object| object.mesh.triangles().len()).sum(),
            objects: scene.objects.len(),
            centre: look.centres().into_iter().map(centre_text).collect::<Vec<_>>().join(" and "),
            shows_light: scene.shows_light(),
            f: reflection.map(|reflection| reflection.lighting().degree().get()),
            p: look.view_degrees().iter().map(|p| p.get()).max(),
            environment: [grid.height, grid.width],
            lamps,
            lighting: held.iter().map(share).collect(),
            reflected: accuracy.as_ref().map(reflected).unwrap_or_default(),
            plain: accuracy.map(|accuracy| 1.0 - accuracy.at(accuracy.f(), 0).truth),
            maps: maps(first),
        }
    }

    /// The share of the environment's energy that the lighting holds.
    pub(crate) fn captured(&self) -> f64 {
        self.lighting.iter().sum()
    }
}

fn centre_text(centre: Centre) -> &'static str {
    match centre {
        Centre::Reflection => "reflection vector",
        Centre::Normal => "normal",
        Centre::Tangent => "tangent",
    }
}

/// The share that each degree adds.
fn reflected(accuracy: &Accuracy) -> Vec<f64> {
    let mut before = 1.0;
    let curve = accuracy.curve(accuracy.p());
    let gained = |estimate: shrm::accuracy::TruncationEstimate| {
        std::mem::replace(&mut before, estimate.truth) - estimate.truth
    };
    curve.into_iter().map(gained).collect()
}

fn maps(object: &Object) -> Vec<(String, u64)> {
    let look = object.look.as_ref();
    let sizes = look.sizes();
    let texel = 3 * size_of::<f32>() as u64;
    let face = 6 * (sizes.edge as u64).pow(2) * texel;
    let grid = look.light().environment().grid();
    let edge = sizes.edge;
    let mut maps = Vec::new();
    let degrees = look.view_degrees();
    if !degrees.is_empty() {
        let coefficients = degrees.iter().map(|p| p.rows() as u64).sum::<u64>();
        let parts = degrees.len() as u64;
        let of_each = |count: usize| parts * count as u64;
        let (views, slices) = (of_each(12), of_each(sizes.slices));
        let each = if parts > 1 { ", a map of each part" } else { "" };
        maps = vec![
            (format!("SHRM, cube {edge}, {coefficients} rows"), coefficients * face),
            (format!("Cabral, cube {edge}, {views} maps"), views * face),
            (format!("Kautz-McCool, cube {edge}, {slices} slices"), slices * face),
            (format!("prefiltered, cube {edge}{each}"), parts * face),
        ];
    }
    if let Some((cube, _)) = look.prefiltered_cube() {
        let levels = cube.levels();
        let name = format!("prefiltered, cube {}, {} levels", levels[0].cube().edge, levels.len());
        maps.push((name, levels.iter().map(|level| level.cube().len() as u64 * texel).sum()));
    }
    if let Some(table) = look.table() {
        let (degree, views) = (table.degree().get(), table.size());
        let name = format!("BRDF table, degree {degree}, {views} x {views}");
        maps.push((name, size_of_val(table.values()) as u64));
    }
    if let Ok(map) = look.compact_map() {
        let cubes = || map.scales.levels().iter().chain(map.scales.normals());
        let name =
            format!("scale space, cube {}, {} levels", map.scales.widths().edge(), map.scales.levels().len());
        maps.push((name, cubes().map(|cube| size_of_val(cube.pixels()) as u64).sum()));
        let (taps, normals) = (map.taps.table().taps(), map.taps.table().normals());
        let (kind, numbers) = match &*map.taps {
            CompactTaps::Angle(table) => ("taps", table.rows().len() * (5 * taps + 4 * normals)),
            CompactTaps::View(table) => ("facet taps", table.nodes().len() * (6 * taps + 4 * normals)),
        };
        maps.push((
            format!("{taps} {kind}, {normals} about the normal"),
            (numbers * size_of::<f32>()) as u64,
        ));
    }
    if let Some(transfer) = &object.transfer {
        let first = &transfer[0];
        let (output, input) = (first.output().get(), first.input().get());
        let name = format!("transfer, degrees {output} and {input}, {} vertices", first.len());
        maps.push((name, transfer.iter().map(|transfer| size_of_val(transfer.values()) as u64).sum()));
    }
    maps.push(("irradiance, 9 rows".into(), 9 * texel));
    maps.push((format!("environment, {} x {}", grid.width, grid.height), grid.len() as u64 * texel));
    maps
}

fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use sh::Stop;

    use super::*;
    use crate::testkit;

    #[test]
    fn a_white_sphere_under_a_bright_sky_has_known_statistics() {
        let statistics = SceneStatistics::of(&testkit::scene());
        assert_eq!((statistics.f, statistics.p, &*statistics.centre), (Some(7), Some(0), "normal"));
        assert_eq!(statistics.triangles, mesh::shape("sphere").unwrap().triangles().len());
        assert_eq!(statistics.environment, [16, 32]);
        // Radiance 2 above and 1 below is 1.5 + 0.5 sign(z). Of its energy, 4 pi 2.5, the mean holds 4 pi
        // 2.25, and degree 1 holds 4 pi 0.25 3/4; 16 rows blur the edge.
        assert!((statistics.lighting[0] - 0.9).abs() < 1e-3, "{:?}", statistics.lighting);
        assert!((statistics.lighting[1] - 0.075).abs() < 2e-3, "{:?}", statistics.lighting);
        assert!((0.98..1.0).contains(&statistics.captured()), "{}", statistics.captured());
        // A diffuse surface blurs most of the light's detail; all degrees together are the whole energy.
        assert!((statistics.reflected.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(statistics.reflected[0] > statistics.lighting[0], "{:?}", statistics.reflected);
        assert!((statistics.plain.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(statistics.maps[0], ("SHRM, cube 8, 1 rows".into(), 6 * 64 * 12));
    }

    #[test]
    fn maps_of_two_parts_are_added() {
        let lacquer = brdf::Material::Standard(brdf::Standard::new(Default::default()).unwrap());
        let [f, matte, glossy] = [4, 0, 2].map(|degree| sh::Degree::new(degree).unwrap());
        let sky = sh::Expansion::from_coefficients(f, vec![[1.0; 3]; f.rows()]).unwrap();
        let reflected = |material: &brdf::Material, p| {
            let made = brdf::project(material, brdf::Choice::Degree { f, p }, Stop::NEVER).unwrap();
            shrm::Reflection::convolve(&sky, &made.coefficients)
        };
        let [diffuse, specular] = lacquer.split().unwrap();
        let parts = [reflected(&diffuse, matte), reflected(&specular, glossy)];
        let reflection = reflected(&lacquer, glossy).with_parts(parts);
        let light = std::sync::Arc::clone(testkit::scene().objects[0].look.light());
        let sizes = preview::MapSizes { edge: 8, slices: 3 };
        let look = preview::Look::new(light, reflection, None, sizes);
        let mesh = std::sync::Arc::new(mesh::shape("plane").unwrap());
        let statistics = SceneStatistics::of(&Scene::of(mesh, std::sync::Arc::new(look)));
        assert_eq!((&*statistics.centre, statistics.p), ("normal and reflection vector", Some(2)));
        let face = 6 * 64 * 12;
        let expected = [
            ("SHRM, cube 8, 10 rows", 10),
            ("Cabral, cube 8, 24 maps", 24),
            ("Kautz-McCool, cube 8, 6 slices", 6),
            ("prefiltered, cube 8, a map of each part", 2),
        ];
        assert_eq!(statistics.maps[..4], expected.map(|(name, maps)| (name.to_owned(), maps * face)));
    }

    /// The sun is counted; its energy is not in what the series is measured against.
    #[test]
    fn the_energy_of_lamps_is_not_missing_from_the_series() {
        let grid = sphere::LatLong::with_rows(32);
        let pixel = |texel: usize| if texel == 20 * 64 + 9 { [3000.0; 3] } else { [1.0; 3] };
        let sky = envmap::Environment::new(grid, (0..grid.len()).map(pixel).collect()).unwrap();
        let separated = sky.separate_lamps(Stop::NEVER).unwrap();
        let degree = sh::Degree::new(4).unwrap();
        let series = sh::Transform::new(grid, degree).unwrap().analyse(separated.soft.pixels());
        let white = brdf::Material::Lambert(brdf::Lambert::new([1.0; 3]).unwrap());
        let brdf =
            brdf::project(&white, brdf::Choice::Degree { f: degree, p: sh::Degree::ZERO }, Stop::NEVER)
                .unwrap();
        let lamps = shrm::Lamps { lights: separated.lights, material: white };
        let reflection = shrm::Reflection::convolve(&series, &brdf.coefficients).with_lamps(lamps);
        let light = std::sync::Arc::new(preview::Light::new(sky, None));
        let look = preview::Look::new(light, reflection, None, preview::MapSizes::default());
        let look = std::sync::Arc::new(look);
        let statistics =
            SceneStatistics::of(&Scene::of(std::sync::Arc::new(mesh::shape("plane").unwrap()), look));
        assert_eq!(statistics.lamps, 1);
        // The sun's texel, 0.009 sr, is cut down to ten times the mean of 3. What is left of it has the
        // energy 8 beside the sky's 4 pi; with the sun it would be 80 000.
        assert!(statistics.captured() > 0.5, "{}", statistics.captured());
    }

    #[test]
    fn without_maps_only_the_light_and_the_mesh_have_statistics() {
        let statistics = SceneStatistics::of(&testkit::without_maps());
        assert_eq!((statistics.f, statistics.p, statistics.lamps), (None, None, 0));
        assert!(statistics.lighting.is_empty() && statistics.plain.is_none());
        assert_eq!(statistics.triangles, SceneStatistics::of(&testkit::scene()).triangles);
        let names = statistics.maps.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>();
        assert_eq!(names, ["irradiance, 9 rows", "environment, 32 x 16"]);
    }

    #[test]
    fn a_light_alone_has_the_cube_of_an_engine() {
        let statistics = SceneStatistics::of(&testkit::light_alone());
        assert!(statistics.shows_light && statistics.p.is_none());
        assert_eq!(statistics.objects, 2);
        assert_eq!(statistics.maps[0], ("prefiltered, cube 2, 2 levels".into(), (24 + 6) * 12));
    }

    #[test]
    fn an_empty_scene_has_no_statistics() {
        let scene = Scene { objects: Vec::new(), ..testkit::scene() };
        assert_eq!(SceneStatistics::of(&scene), SceneStatistics::default());
    }
}
