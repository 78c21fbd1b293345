//! Lamps shaded by the material, with shadow rays, against integrals over their disks.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{KajiyaKay, Lambert, Material, Phong, Ward};
use mesh::Mesh;
use sh::{Light, Stop, Stopped};
use sphere::{DVec3, Direction};
use transfer::{Frames, Occluders, Viewer, shade_lights};

const HEIGHT: f64 = 0.5;
const HALF: f64 = 0.3;

/// Places of a floor at z = 0 from below the middle of a square to its open side; the tangent is turned by 30
/// degrees.
fn floor() -> Mesh {
    let (sine, cosine) = 30f32.to_radians().sin_cos();
    let places: Vec<[f32; 3]> = (0..21).map(|k| [0.05 * k as f32, 0.03, 0.0]).collect();
    let count = places.len();
    Mesh::new(places, vec![[0.0, 0.0, 1.0]; count], vec![[cosine, sine, 0.0, 1.0]; count], None, Vec::new())
        .unwrap()
}

/// The square above it.
fn square() -> Occluders {
    let (half, height) = (HALF as f32, HEIGHT as f32);
    let corners =
        [[-half, -half, height], [half, -half, height], [half, half, height], [-half, half, height]];
    let mesh = Mesh::new(
        corners.to_vec(),
        vec![[0.0, 0.0, 1.0]; 4],
        vec![[1.0, 0.0, 0.0, 1.0]; 4],
        None,
        vec![[0, 1, 2], [0, 2, 3]],
    );
    Occluders::of(&mesh.unwrap())
}

fn ward() -> Material {
    Material::Ward(Ward::new([0.2, 0.5], [0.9, 0.6, 0.3]).unwrap())
}

fn lamp(radius: f64) -> Light {
    Light::from_flux(Direction::from_angles(0.35, 0.4), radius, [2.0, 1.0, 0.5])
}

const VIEW: [f64; 3] = [-0.6, 0.2, 0.7];

/// The radiance of a place of the floor: 300 rings of 300 points of the disk.
fn integral(place: [f32; 3], light: &Light, material: &Material, shadow: bool) -> [f64; 3] {
    let (rings, points) = (300, 300);
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    let (x, y) = (DVec3::new(cosine, sine, 0.0), DVec3::new(-sine, cosine, 0.0));
    let local = |v: DVec3| Direction::normalised(DVec3::new(v.dot(x), v.dot(y), v.z));
    let view = local(DVec3::from_array(VIEW).normalize());
    let centre = light.direction.vector();
    let across = centre.cross(DVec3::X).normalize();
    let along = centre.cross(across);
    let mut sum = [0.0; 3];
    for ring in 0..rings {
        let height = 1.0 - (1.0 - light.radius.cos()) * (f64::from(ring) + 0.5) / f64::from(rings);
        let out = (1.0 - height * height).sqrt();
        for point in 0..points {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(point) / f64::from(points)).sin_cos();
            let s = centre * height + (along * cosine + across * sine) * out;
            let hit = DVec3::from_array(place.map(f64::from)) + s * (HEIGHT / s.z);
            if s.z > 0.0 && !(shadow && hit.x.abs() < HALF && hit.y.abs() < HALF) {
                let rho_hat = material.rho_hat(local(s), view);
                let share = 1.0 / f64::from(rings * points);
                (0..3).for_each(|channel| sum[channel] += light.flux()[channel] * share * rho_hat[channel]);
            }
        }
    }
    sum
}

fn shaded(occluders: Option<&Occluders>, material: &Material, light: Light, count: usize) -> Vec<[f32; 3]> {
    let viewer = Viewer::Distant(Direction::normalised(DVec3::from_array(VIEW)));
    let frames = Frames::of(&floor()).unwrap();
    shade_lights(&frames, occluders, material, viewer, &[light], count, Stop::NEVER).unwrap()
}

#[test]
fn the_edge_of_a_shadow_is_as_soft_as_the_lamp_is_wide() {
    let occluders = square();
    let chalk = Material::Lambert(Lambert::new([0.9, 0.6, 0.3]).unwrap());
    for material in [ward(), chalk] {
        for (radius, partly) in [(0.25, 4), (0.02, 0)] {
            let light = lamp(radius);
            let open = shaded(None, &material, light, 4096);
            let expected: Vec<[f64; 3]> =
                floor().positions().iter().map(|place| integral(*place, &light, &material, true)).collect();
            for (count, limit) in [(4096, 0.005), (16, 0.1)] {
                let found = shaded(Some(&occluders), &material, light, count);
                let mut edges = 0;
                for ((expected, found), open) in expected.iter().zip(&found).zip(&open) {
                    for channel in 0..3 {
                        let open = f64::from(open[channel]);
                        let error = (f64::from(found[channel]) - expected[channel]).abs() / open;
                        assert!(error < limit, "{radius} {count}: {error} {found:?} {expected:?}");
                        edges += usize::from((0.05..0.95).contains(&(expected[channel] / open)));
                    }
                }
                assert!(edges >= 3 * partly, "{radius}: {edges} in half shadow");
            }
        }
    }
}

/// rho_hat at its centre times the flux; of a matte floor, albedo / pi times the irradiance, also where the
/// horizon hides a part of a low lamp.
#[test]
fn an_open_vertex_has_f_times_the_irradiance() {
    let small = lamp(0.01);
    let found = shaded(Some(&square()), &ward(), small, 16)[20];
    let expected = integral([1.0, 0.03, 0.0], &small, &ward(), false);
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    let local = |v: DVec3| {
        Direction::normalised(DVec3::new(v.x * cosine + v.y * sine, v.y * cosine - v.x * sine, v.z))
    };
    let rho_hat = ward().rho_hat(local(small.direction.vector()), local(DVec3::from_array(VIEW)));
    for channel in 0..3 {
        let at_centre = rho_hat[channel] * small.flux()[channel];
        for expected in [expected[channel], at_centre] {
            let error = f64::from(found[channel]) / expected - 1.0;
            assert!(error.abs() < 1e-3, "{channel}: {error}");
        }
    }
    let chalk = Material::Lambert(Lambert::new([0.5; 3]).unwrap());
    for (theta, radius) in [(0.5, 0.3), (1.5, 0.3), (std::f64::consts::FRAC_PI_2, 0.5), (1.8, 0.4)] {
        let light = Light::from_flux(Direction::from_angles(theta, -1.0), radius, [1.0; 3]);
        let expected = light.irradiance_on(Direction::Z)[0] * 0.5 / std::f64::consts::PI;
        let found = f64::from(shaded(None, &chalk, light, 4096)[0][0]);
        assert!((found - expected).abs() < 1e-4, "{theta} {radius}: {found} {expected}");
    }
}

/// The horizon of a vertex is no occluder: what phong and fibres reflect from below stays, as with transfer.
#[test]
fn light_from_below_the_horizon_is_not_shadowed() {
    let below = Light::from_flux(Direction::from_angles(2.0, 0.4), 0.2, [1.0; 3]);
    let hair = Material::KajiyaKay(KajiyaKay::new(8.0, [0.5; 3]).unwrap());
    for material in [Material::Phong(Phong::new(2.0, [1.0; 3]).unwrap()), hair] {
        let (open, covered) =
            (shaded(None, &material, below, 16), shaded(Some(&square()), &material, below, 16));
        assert!(open == covered && open[0][0] > 0.0, "{}: {open:?}", material.name());
    }
    let dark = shaded(None, &ward(), below, 16);
    assert_eq!(dark[0], [0.0; 3]);
}

#[test]
fn results_are_the_same_with_any_number_of_threads() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let knot = mesh::shape("torus-knot").unwrap();
            let (frames, occluders) = (Frames::of(&knot).unwrap(), Occluders::of(&knot));
            let (viewer, lights) = (Viewer::At([3.0, 0.0, 1.0]), [lamp(0.2), lamp(0.0)]);
            shade_lights(&frames, Some(&occluders), &ward(), viewer, &lights, 4, Stop::NEVER).unwrap()
        })
    };
    let found = with(1);
    assert!(found == with(3));
    assert!(found.as_flattened().iter().all(|value| value.is_finite() && *value >= 0.0));
    let (lit, all) = (found.iter().filter(|rgb| rgb[0] > 0.0).count(), found.len());
    assert!(lit > all / 10 && lit < all, "{lit} of {all}");
}

#[test]
fn nothing_is_shaded_once_it_is_stopped() {
    let (frames, viewer) = (Frames::of(&floor()).unwrap(), Viewer::Distant(Direction::Z));
    assert_eq!(
        shade_lights(&frames, None, &ward(), viewer, &[lamp(0.1)], 4, Stop::when(&|| true)),
        Err(Stopped)
    );
    let dark = shade_lights(&frames, None, &ward(), viewer, &[], 4, Stop::NEVER).unwrap();
    assert_eq!(dark, vec![[0.0; 3]; 21]);
    let none = Frames::of(&Mesh::joined(&[]).unwrap()).unwrap();
    assert_eq!(shade_lights(&none, None, &ward(), viewer, &[lamp(0.1)], 4, Stop::NEVER), Ok(Vec::new()));
}
