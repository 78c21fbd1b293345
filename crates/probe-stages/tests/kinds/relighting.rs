//! Transport first, lighting second.

use std::sync::Arc;

use containers::tensors;
use probes::LitProbes;
use sh::{Degree, Expansion};
use stages::artifacts::{Environment, Lighting, ProbeLamps, ProbePlaces, ProbeTransport, Probes, Scene};

use crate::fixture::{Ran, case, part};
use crate::room::Room;

/// A room with everything that is baked in it.
pub(crate) struct Baked {
    pub(crate) scene: Arc<Scene>,
    pub(crate) transport: Arc<ProbeTransport>,
    pub(crate) lamps: Arc<ProbeLamps>,
}

impl Baked {
    pub(crate) fn of(room: &Room, parameters: &str) -> Self {
        let scene = room.scene();
        let places: Arc<ProbePlaces> =
            case("place-probes", "").input("scene", &*part(&scene, "shape")).artifact();
        let bake = |kind, of: &str| {
            case(kind, parameters).input("scene", &*part(&scene, of)).input("places", &*places)
        };
        Self {
            transport: bake("bake-probes", "surfaces").artifact(),
            lamps: bake("bake-lamps", "lamps").artifact(),
            scene,
        }
    }

    pub(crate) fn lit(&self, parameters: &str, sky: Option<&Expansion>) -> Ran<Probes> {
        let case = case("light-probes", parameters)
            .input("transport", &*self.transport)
            .input("lamps", &*self.lamps)
            .input("scene", &*self.scene);
        let case = match sky {
            Some(sky) => case.input("lighting", &Lighting(sky.clone().into())),
            None => case,
        };
        case.run().unwrap()
    }
}

/// A sky of degree 4 without symmetry.
pub(crate) fn sky(seed: f64) -> Expansion {
    let row = |row: usize| {
        [0, 1, 2].map(|channel| {
            if row == 0 { 4.0 } else { (seed * (row * 3 + channel) as f64).sin() / (1.0 + row as f64) }
        })
    };
    Expansion::from_coefficients(Degree::new(4).unwrap(), (0..25).map(row).collect()).unwrap()
}

fn rows(light: &LitProbes) -> Vec<f64> {
    light.rows().as_flattened().as_flattened().iter().map(|value| f64::from(*value)).collect()
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// The sum of two skies lights as both do, and the transport times a sky is its light.
#[test]
fn light_is_linear_in_the_sky_to_1e_5() {
    let baked = Baked::of(&Room::new(), "paths = 64");
    let parameters = "window = \"none\"\nlamps-scale = 0.0\nemission-scale = 0.0";
    let light = |sky: &Expansion| rows(&baked.lit(parameters, Some(sky)).value.0.light);
    let (one, two) = (sky(1.7), sky(0.9));
    let mixed = one.coefficients().iter().zip(two.coefficients());
    let mixed = mixed.map(|(a, b)| [0, 1, 2].map(|k| 0.3 * a[k] + 2.5 * b[k])).collect();
    let mixed = Expansion::from_coefficients(one.degree(), mixed).unwrap();
    let sum: Vec<f64> = light(&one).iter().zip(light(&two)).map(|(a, b)| 0.3 * a + 2.5 * b).collect();
    assert!(difference(&light(&mixed), &sum) < 1e-5);
    let transport = &baked.transport.0;
    let mut product = Vec::new();
    for probe in 0..transport.transport.len() {
        let mut rows = vec![[0.0; 3]; 9];
        transport.transport.add_sky(probe, &one, &mut rows);
        product.extend(rows.as_flattened().iter().map(|value| *value as f32));
    }
    transport.places.dilate(&mut product, 27);
    let product: Vec<f64> = product.into_iter().map(f64::from).collect();
    assert!(difference(&light(&one), &product) < 1e-6);
}

/// Emission and lamps take their colours from the scene.
#[test]
fn lamps_and_emission_are_scaled_and_direct_light_can_be_left_out() {
    let baked = Baked::of(&Room::new(), "paths = 64");
    let light =
        |parameters: &str| rows(&baked.lit(&format!("window = \"none\"\n{parameters}"), None).value.0.light);
    // The sum of row 0 over the probes, in a channel.
    let sum = |rows: &[f64], channel: usize| rows.iter().skip(channel).step_by(27).sum::<f64>();
    let lamps = light("emission-scale = 0.0");
    let twice = light("emission-scale = 0.0\nlamps-scale = 2.0");
    assert!(difference(&twice, &lamps.iter().map(|x| 2.0 * x).collect::<Vec<_>>()) < 1e-6);
    let all = light("emission-scale = 0.0\nlamps = \"all\"");
    assert!(sum(&all, 0) > 1.1 * sum(&lamps, 0) && sum(&lamps, 0) > 0.0);
    // Both lamps have the colour (1, 0.8, 0.6), and the room is grey but for the crate.
    assert!(sum(&all, 0) > sum(&all, 1) && sum(&all, 1) > sum(&all, 2));
    let glow = light("lamps-scale = 0.0");
    let reflected = light("lamps-scale = 0.0\nemission = \"indirect\"");
    assert!(sum(&glow, 0) > sum(&reflected, 0) && sum(&reflected, 0) > 0.0);
    assert!(sum(&glow, 0) > 1.5 * sum(&glow, 1) && sum(&glow, 1) > 1.5 * sum(&glow, 2));
}

#[test]
fn a_window_leaves_no_irradiance_below_zero() {
    let baked = Baked::of(&Room::new(), "paths = 64");
    let ran = baked.lit("lamps = \"all\"\nlamps-scale = 100.0", Some(&sky(1.7)));
    let light = &ran.value.0.light;
    assert!(light.windows().iter().any(|lambda| *lambda > 0.0));
    let note = ran.notes.iter().find(|note| note.contains("are softened")).unwrap();
    assert!(note.contains(" of 48 probes are softened, so that no irradiance is below zero"), "{note}");
    let plain = baked.lit("lamps = \"all\"\nlamps-scale = 100.0\nwindow = \"none\"", Some(&sky(1.7)));
    assert!(plain.value.0.light.windows().iter().all(|lambda| *lambda == 0.0));
    // In single precision a window is right to 1e-6 of the mean.
    let negative = |light: &LitProbes| {
        let is_below = |rows: &&[[f32; 3]; 9]| {
            let mut lifted = **rows;
            lifted[0] = lifted[0].map(|mean| mean * (1.0 + 1e-5));
            probes::least_window(&lifted) > 0.0
        };
        light.rows().iter().filter(is_below).count()
    };
    assert_eq!(negative(light), 0);
    assert!(negative(&plain.value.0.light) > 0);
}

#[test]
fn units_that_differ_and_energy_that_is_left_out_are_said() {
    let baked = Baked::of(&Room::new(), "paths = 64\ndegree = 2");
    let warnings = baked.lit("lamps-scale = 1e6", Some(&sky(1.7))).warnings;
    assert!(warnings[0].contains("times the irradiance of the sky to the probes"), "{warnings:?}");
    assert!(warnings[0].contains("set `lamps-scale` (it is 1000000)"), "{warnings:?}");
    let ran = baked.lit("", Some(&sky(1.7)));
    assert_eq!(ran.warnings, [""; 0]);
    assert!(!ran.notes.iter().any(|note| note.contains("energy")));
    let mut sharp = Expansion::zero(Degree::new(6).unwrap());
    sharp.coefficients_mut()[0] = [2.0; 3];
    sharp.coefficients_mut()[48] = [1.0; 3];
    let notes = baked.lit("", Some(&sharp)).notes;
    let expected = "20.00 % of the sky's energy is above degree 4, that of the transport, and left out";
    assert!(notes.contains(&expected.to_owned()), "{notes:?}");
}

/// An environment is projected as `project-sh` does it.
#[test]
fn a_sky_may_be_an_environment() {
    let baked = Baked::of(&Room::new(), "paths = 64");
    let grid = sphere::LatLong::with_rows(16);
    let pixel = |index: usize| {
        let z = grid.direction(index / grid.width, index % grid.width).vector().z;
        [1.0 + z as f32, 1.0, 1.0 - 0.5 * z as f32]
    };
    let environment = envmap::Environment::new(grid, (0..grid.len()).map(pixel).collect()).unwrap();
    let ran = case("light-probes", "")
        .input("transport", &*baked.transport)
        .input("scene", &*baked.scene)
        .input("lighting", &Environment(environment))
        .run::<Probes>()
        .unwrap();
    assert!(ran.notes.contains(&"2 lamps of the scene are dark: port lamps is not connected".to_owned()));
    // Radiance of 1 everywhere is 2 sqrt(pi) in row 0; that of z is 4 pi / 3 times 0.488603 in row 2.
    let root = 2.0 * std::f64::consts::PI.sqrt();
    let z = 4.0 * std::f64::consts::PI / 3.0 * 0.488_602_511_9;
    let mut rows = vec![[0.0; 3]; 25];
    rows[0] = [root; 3];
    rows[2] = [z, 0.0, -0.5 * z];
    let sky = Expansion::from_coefficients(Degree::new(4).unwrap(), rows).unwrap();
    let expected = case("light-probes", "")
        .input("transport", &*baked.transport)
        .input("scene", &*baked.scene)
        .input("lighting", &Lighting(sky.into()))
        .artifact::<Probes>();
    let tensors::Probes { light, .. } = &ran.value.0;
    assert!(difference(&self::rows(light), &self::rows(&expected.0.light)) < 1e-5);
}

/// A sun beside the sky's series is a lamp: its shadow is sharp, and its light is not blurred into the sky.
#[test]
fn suns_are_split_off() {
    let room = Room::new();
    let scene = room.scene();
    let places: Arc<ProbePlaces> = case("place-probes", "points = [[0.0, 0.0, 1.75], [-1.5, -1.5, 0.5]]")
        .input("scene", &*scene)
        .artifact();
    let light = sh::Light {
        direction: sphere::Direction::new(sphere::DVec3::new(0.6, 0.0, 0.8)).unwrap(),
        radius: 0.005,
        irradiance: [5.0, 4.0, 3.0],
    };
    let lighting = Lighting(sh::Lighting { series: sky(1.7), lights: vec![light] });
    let transport: Arc<ProbeTransport> =
        case("bake-probes", "paths = 64").input("scene", &*scene).input("places", &*places).artifact();
    let bake = case("bake-lamps", "paths = 64\nlamps = []").input("scene", &*scene).input("places", &*places);
    let lamps: Arc<ProbeLamps> = bake.input("lights", &lighting).artifact();
    assert_eq!(lamps.0.names, ["sun toward [0.6, 0, 0.8]"]);
    let light = |lamps: Option<&ProbeLamps>, parameters: &str| {
        let case = case("light-probes", &format!("window = \"none\"\n{parameters}"))
            .input("transport", &*transport)
            .input("scene", &*scene)
            .input("lighting", &lighting);
        match lamps {
            Some(lamps) => case.input("lamps", lamps).run::<Probes>().unwrap(),
            None => case.run().unwrap(),
        }
    };
    let ran = light(Some(&lamps), "lamps = \"all\"\nlamps-scale = 0.0");
    assert!(!ran.notes.iter().any(|note| note.contains("blurred")), "{:?}", ran.notes);
    let none = case("light-probes", "window = \"none\"")
        .input("transport", &*transport)
        .input("scene", &*scene)
        .input("lighting", &Lighting(sky(1.7).into()))
        .artifact::<Probes>();
    // Nothing is between the first probe and the sun: 5 times Y_0, and what the room reflects of it.
    let row = |probes: &Probes| f64::from(probes.0.light.rows()[0][0][0]);
    let straight = 5.0 * 0.5 / std::f64::consts::PI.sqrt();
    let found = row(&ran.value) - row(&none);
    assert!(found > straight && found < 2.0 * straight, "{found} {straight}");
    let indirect = row(&light(Some(&lamps), "").value) - row(&none);
    assert!((found - indirect - straight).abs() < 1e-3 * straight, "{found} {indirect} {straight}");
    let notes = light(None, "").notes;
    assert!(
        notes.iter().any(|note| note.starts_with("1 lights beside the sky's series are blurred")),
        "{notes:?}"
    );
}

/// A warning names some of the probes that missed the wanted error, and a note all of them, with their
/// errors.
#[test]
fn probes_that_missed_their_error_are_named() {
    let scene = Room::new().scene();
    let places: Arc<ProbePlaces> =
        case("place-probes", "").input("scene", &*part(&scene, "shape")).artifact();
    let ran = case("bake-probes", "paths = 16\nerror = 0.0001\npaths-most = 32")
        .input("scene", &*part(&scene, "surfaces"))
        .input("places", &*places)
        .run::<ProbeTransport>()
        .unwrap();
    let errors = ran.value.0.transport.errors();
    let is_missed = |probe: &usize| places.0.is_valid(*probe) && errors[*probe] > 0.0001;
    let missed: Vec<usize> = (0..places.0.len()).filter(is_missed).collect();
    assert!((9..200).contains(&missed.len()), "{missed:?}");
    let begin = "transport: the probes that missed error = 0.0001: ";
    let named = ran.notes.iter().find_map(|note| note.strip_prefix(begin)).unwrap();
    let expected: Vec<String> =
        missed.iter().map(|probe| format!("{probe} {:.2} %", 100.0 * errors[*probe])).collect();
    assert_eq!(named, expected.join(", "));
    assert!(ran.warnings[0].contains(&format!("and {} more; raise `paths-most`", missed.len() - 8)));
}
