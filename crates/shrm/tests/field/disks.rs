//! Disks of light in maps, against a fine sum over the disk: midpoints of rings, the slow and obvious form.

use std::f64::consts::{PI, TAU};

use brdf::{Fresnel, Ggx, Lambert, Material, Phong};
use sh::Light;
use shrm::{Lamps, MeanLobe, Plain};
use sphere::Direction;

/// A disk of radiance 1.
fn disk(direction: Direction, degrees: f64) -> Light {
    let radius = degrees.to_radians();
    Light::from_flux(direction, radius, [4.0 * PI * (radius / 2.0).sin().powi(2); 3])
}

/// The mean of a function over a disk, at the midpoints of `count` angles around it and thrice as many rings,
/// each with its solid angle.
fn brute_force(light: &Light, count: usize, value: impl Fn(Direction) -> f64) -> f64 {
    let (centre, (u, v)) = (light.direction.vector(), light.direction.vector().any_orthonormal_pair());
    let (mut sum, mut whole) = (0.0, 0.0);
    for ring in 0..3 * count {
        let theta = light.radius * (ring as f64 + 0.5) / (3 * count) as f64;
        whole += theta.sin() * count as f64;
        for k in 0..count {
            let phi = TAU * (k as f64 + 0.5) / count as f64;
            let around = u * phi.cos() + v * phi.sin();
            let direction = Direction::normalised(centre * theta.cos() + around * theta.sin());
            sum += theta.sin() * value(direction);
        }
    }
    sum / whole
}

fn phong(exponent: f64) -> Material {
    Material::Phong(Phong::new(exponent, [1.0; 3]).unwrap())
}

fn lambert() -> Material {
    Material::Lambert(Lambert::new([1.0; 3]).unwrap())
}

fn ggx(roughness: [f64; 2]) -> Material {
    let metal = Fresnel::Conductor { n: [0.2, 0.9, 1.2], k: [3.9, 2.5, 2.4] };
    Material::Ggx(Ggx::stretched(roughness, metal, [1.0; 3]).unwrap())
}

const RADII: [f64; 7] = [0.27, 1.0, 2.5, 5.0, 15.0, 40.0, 60.0];

/// The values of a report: radiance 1, exponent 60, 15 degrees about +Z, and a matte surface.
#[test]
fn a_disk_of_15_degrees_has_the_light_of_its_integral() {
    let lamp = disk(Direction::Z, 15.0);
    for (material, degrees, expected) in
        [(phong(60.0), 0.5, 0.8787), (phong(60.0), 20.5, 0.1690), (lambert(), 95.5, 0.00127)]
    {
        let central = Direction::from_angles(f64::to_radians(degrees), 0.3);
        let plain = MeanLobe::plain(&material, Plain::Mean).of(&[lamp]).radiance(central)[0];
        let view = Direction::from_angles(0.8, 0.1);
        let seen = Lamps { lights: vec![lamp], material }.radiance(central, view)[0];
        assert!((plain - expected).abs() < 5e-4, "plain {degrees}: {plain} {expected}");
        assert!((seen - expected).abs() < 1e-3, "seen {degrees}: {seen} {expected}");
    }
}

/// A lobe of one angle over a disk is within 1e-3 of its largest value, of suns to softboxes, also where the
/// horizon cuts the disk.
#[test]
fn zonal_lobes_of_disks_are_their_integrals() {
    let materials = [1.0, 10.0, 60.0, 300.0, 2000.0].map(phong).into_iter().chain([lambert()]);
    for material in materials {
        let lobe = MeanLobe::plain(&material, Plain::Mean);
        for degrees in RADII {
            let lamp = disk(Direction::Z, degrees);
            let reflected = lobe.of(&[lamp]);
            let found: Vec<(f64, f64)> = (0..26)
                .map(|k| {
                    let away = f64::from(k) * 4.8 + 0.3;
                    let central = Direction::from_angles(away.to_radians(), 0.7);
                    let found = reflected.radiance(central)[0];
                    let rho = |w| material.rho_hat_about_centre(turned(central, w), Direction::Z)[0];
                    (found, lamp.flux()[0] * brute_force(&lamp, 200, rho))
                })
                .collect();
            let peak = found.iter().map(|pair| pair.1).fold(0.0, f64::max);
            let worst = found.iter().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-3 * peak, "{material:?}, {degrees} degrees: {worst:e} of {peak}");
        }
    }
}

/// A direction of the world in a frame about the central direction.
fn turned(central: Direction, w: Direction) -> Direction {
    let z = central.vector();
    let (x, y) = z.any_orthonormal_pair();
    let w = w.vector();
    Direction::normalised(sphere::DVec3::new(w.dot(x), w.dot(y), w.dot(z)))
}

/// Points over disks give what a fine sum over them does, in the range of disks that [`sh::Light::points`]
/// states: views whose mirror direction goes through the disk and past its edge, and normals all around,
/// whose horizons cut it.
fn points_reflect_as_integrals(lowest_cosine: f64, limit: f64) {
    let materials = [lambert(), phong(60.0), phong(2000.0), ggx([0.3; 2]), ggx([0.6; 2]), ggx([1.0; 2])];
    let mut wrong = Vec::new();
    for material in materials {
        let width = material.highlight_width();
        for degrees in RADII {
            let lights = vec![disk(Direction::from_angles(1.1, 0.4), degrees)];
            if lights[0].radius / width > 14.0 {
                continue;
            }
            let lamps = Lamps { lights, material: material.clone() };
            let light = &lamps.lights[0];
            let views = (0..40).map(|k| {
                let (turn, share) = (f64::from(k) * 2.4, (f64::from(k) * 0.618).fract());
                let slope = f64::acos(1.0 - (1.0 - lowest_cosine) * share);
                if k % 4 == 0 {
                    let normal = sphere::spiral(k as usize, 40);
                    return (normal, around(normal, slope, turn));
                }
                let seen = around(light.direction, (light.radius + 3.0 * width) * f64::from(k) / 40.0, turn);
                let normal = around(seen, slope, 1.7 * turn);
                let mirrored = 2.0 * normal.dot(seen) * normal.vector() - seen.vector();
                (normal, Direction::normalised(mirrored))
            });
            let found: Vec<(f64, f64)> = views
                .map(|(normal, view)| {
                    let central = material.centre().central(normal, any_tangent(normal), view);
                    let surface = |w| turned(normal, w);
                    let rho = |w| material.rho_hat(surface(w), surface(view))[0];
                    let expected = light.flux()[0] * brute_force(light, 120, rho);
                    (lamps.radiance(central, view)[0], expected)
                })
                .collect();
            let peak = found.iter().map(|pair| pair.1).fold(0.0, f64::max);
            let worst = found.iter().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if worst > limit * peak {
                wrong.push(format!("{material:?}, {degrees} degrees: {:e} of the peak", worst / peak));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn points_of_disks_reflect_as_their_integrals() {
    points_reflect_as_integrals(0.5, 1.2e-3);
}

/// Near the horizon a highlight is much narrower across than along.
#[test]
fn points_of_disks_at_grazing_views_are_within_five_percent() {
    points_reflect_as_integrals(0.1, 0.05);
}

fn any_tangent(normal: Direction) -> Direction {
    Direction::normalised(normal.vector().any_orthonormal_vector())
}

/// A direction at an angle from another.
fn around(axis: Direction, theta: f64, phi: f64) -> Direction {
    let (u, v) = axis.vector().any_orthonormal_pair();
    let across = u * phi.cos() + v * phi.sin();
    Direction::normalised(axis.vector() * theta.cos() + across * theta.sin())
}

/// An anisotropic material beside a map is its mean over turns, whatever the frame of the texel: the same all
/// around a lamp head on, and that of 999 turns.
#[test]
fn a_brushed_highlight_in_a_map_is_the_mean_over_all_turns() {
    for roughness in [[0.2, 0.5], [0.16, 0.5], [0.5, 0.3]] {
        let material = ggx(roughness);
        let lamps = Lamps { lights: vec![disk(Direction::Z, 1.0)], material: material.clone() };
        let mean =
            |incident: Direction, outgoing: Direction| material.mean_over_turns(999, incident, outgoing)[0];
        let peak = mean(Direction::Z, Direction::Z);
        for k in 0..60 {
            let angle = 0.012 * f64::from(k);
            let [a, b] = [0.0, 0.7].map(|phi| {
                let central = Direction::from_angles(angle, phi);
                lamps.radiance(central, central)[0]
            });
            assert!(
                (a - b).abs() < 1e-3 * peak * lamps.lights[0].flux()[0],
                "{roughness:?} {angle}: {a} {b}"
            );
            let [incident, outgoing] = [Direction::from_angles(angle, 0.3), Direction::from_angles(0.4, 2.0)];
            let found = material.mean_over_turns(material.turns(), incident, outgoing)[0];
            let error = (found - mean(incident, outgoing)).abs();
            assert!(error < 1e-3 * peak, "{roughness:?} {angle}: {error:e} of {peak}");
        }
    }
}
