//! Brute force compared with the sum over all texels, `shrm::reference::Reference`.

use brdf::{Fresnel, Ggx, KajiyaKay, Lambert, Microfacet, Phong};
use envmap::Environment;
use glam::DVec3;
use shrm::reference::{Cull, Reference};
use sphere::{Direction, LatLong};

use super::*;
use crate::PointSet;
#[cfg(feature = "gpu")]
use crate::shading::{lobe_sampling, on_device, sequence, shadows::NO_SHADOWS};

fn environment(rows: usize, radiance: impl Fn(DVec3) -> [f64; 3]) -> Environment {
    let grid = LatLong::with_rows(rows);
    let direction = |i: usize| grid.direction(i / grid.width, i % grid.width).vector();
    let pixels = (0..grid.len()).map(|i| radiance(direction(i)).map(|value| value as f32)).collect();
    Environment::new(grid, pixels).unwrap()
}

fn sky(w: DVec3) -> [f64; 3] {
    [1.0 + 0.5 * w.x, 1.0 + 0.3 * (4.0 * w.y).sin(), (1.0 + w.z).powi(2)]
}

/// A sky with a sun of 1.2 degrees, ten thousand times as bright.
fn sunny(w: DVec3) -> [f64; 3] {
    let sun = DVec3::new(0.5, -0.3, 0.6).normalize();
    let disc = if w.dot(sun) > 0.02f64.cos() { 1e4 } else { 0.0 };
    sky(w).map(|value| value + disc)
}

/// Lamps in the dark, some below the horizon.
fn lamps(w: DVec3) -> [f64; 3] {
    let stripes = (7.0 * w.x + 3.0 * w.y).sin() * (5.0 * w.z).cos();
    if stripes > 0.3 { [stripes, 1.0 + w.z, 50.0 * stripes.powi(8)] } else { [0.0; 3] }
}

fn environments() -> [(&'static str, Environment); 3] {
    [("sky", environment(32, sky)), ("sunny", environment(128, sunny)), ("lamps", environment(48, lamps))]
}

fn materials() -> [Material; 5] {
    let gold = Fresnel::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };
    [
        Material::Lambert(Lambert::new([0.8, 0.4, 0.1]).unwrap()),
        Material::Phong(Phong::new(32.0, [1.0, 0.5, 0.25]).unwrap()),
        Material::Microfacet(Microfacet::new(0.2, [1.0, 0.5, 0.25]).unwrap()),
        Material::Ggx(Ggx::new(0.4, gold, [1.0; 3]).unwrap()),
        Material::KajiyaKay(KajiyaKay::new(16.0, [1.0, 0.5, 0.25]).unwrap()),
    ]
}

/// Surfaces seen along the normal, from the side, at a grazing angle, from below, and with the sun in the
/// highlight.
fn surfaces() -> Vec<Surface> {
    let surface = |normal: Vec3, view: Vec3| Surface::new(normal, Vec3::new(0.2, 0.9, -0.1), -view, true);
    let sun = Vec3::new(0.5, -0.3, 0.6).normalize();
    let normal = Vec3::new(0.1, 0.3, 0.9).normalize();
    vec![
        surface(Vec3::Z, Vec3::Z),
        surface(normal, Vec3::new(1.0, 0.2, 0.4)),
        surface(normal, Vec3::new(1.0, 0.3, -0.16)),
        surface(-Vec3::Z, Vec3::new(0.3, 0.5, -1.0)),
        surface(normal, 2.0 * normal.dot(sun) * normal - sun),
    ]
}

/// The mean and the deviation of the estimates of many samples of pixels.
fn estimates(
    prepared: &Prepared,
    surface: &Surface,
    points: PointSet,
    [samples, pixels]: [u32; 2],
) -> (DVec3, DVec3) {
    let estimate = |pixel| {
        let sequence = Sequence::new(points, pixel);
        brute_force(prepared, surface, sequence, 0..samples).as_dvec3() / f64::from(samples)
    };
    let all: Vec<DVec3> = (0..pixels).map(estimate).collect();
    let mean = all.iter().sum::<DVec3>() / f64::from(pixels);
    let variance = all.iter().map(|one| (*one - mean) * (*one - mean)).sum::<DVec3>() / f64::from(pixels - 1);
    (mean, DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt()))
}

/// The sum over texels, each divided into 16: light samples treat texels as patches of one radiance.
fn expected(environment: &Environment, material: &Material, surface: &Surface) -> DVec3 {
    let grid = environment.grid();
    let finer = LatLong { width: 4 * grid.width, height: 4 * grid.height };
    let reference = Reference::new(&environment.downsampled(finer).unwrap(), material, Cull::None);
    let world = |v: Vec3| Direction::normalised(v.as_dvec3());
    let central = world(surface.central(material.centre()));
    DVec3::from_array(reference.radiance(central, world(surface.view)))
}

#[test]
fn it_converges_to_the_sum_over_texels() {
    for (name, environment) in environments() {
        let light = Arc::new(LightSamples::new(&environment));
        for material in materials() {
            let prepared = Prepared::of(Arc::clone(&light), &material);
            for surface in surfaces() {
                let expected = expected(&environment, &material, &surface);
                let pixels = 64;
                for points in PointSet::ALL {
                    let (many, deviation) = estimates(&prepared, &surface, points, [1024, pixels]);
                    for channel in 0..3 {
                        let of_mean = deviation[channel] / f64::from(pixels).sqrt();
                        let error = (many[channel] - expected[channel]).abs();
                        assert!(
                            error < 5.0 * of_mean + 1e-3 * expected[channel],
                            "{name} {material:?} {surface:?} {points:?}\n{many} {expected}"
                        );
                    }
                }
            }
        }
    }
}

/// The shaders of brute force, in the order of a renderer.
#[cfg(feature = "gpu")]
fn shaders() -> String {
    [
        include_str!("../surface.wgsl"),
        include_str!("../angles.wgsl"),
        &sequence::shader(),
        include_str!("../light_samples.wgsl"),
        &material::shader(&material::all_models()),
        &lobe_sampling::shader(),
        NO_SHADOWS,
        include_str!("../brute_force.wgsl"),
    ]
    .concat()
}

#[cfg(feature = "gpu")]
#[test]
fn the_shaders_are_valid() {
    use wgpu::naga::front::wgsl::parse_str;
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
    let source = shaders();
    let module = parse_str(&source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let valid = validator.validate(&module);
    assert!(valid.is_ok(), "{}", valid.unwrap_err().emit_to_string(&source));
}

/// The twins take the same samples, of even points and of random ones in turns. Rounding moves a few of them
/// across the edge of a texel, or changes a highlight: 2 parts in a thousand of a sum of 64.
#[cfg(feature = "gpu")]
#[test]
fn the_shader_matches_its_twin() {
    let Some(device) = on_device::device("the_shader_matches_its_twin") else { return };
    let answer = "
        fn answer(k: u32) -> vec3f {
            let surface = Surface(asked[3u * k].xyz, asked[3u * k + 1u].xyz, asked[3u * k + 2u].xyz);
            return brute_force(surface, sequence_new(k % 2u, k), 5u, 64u);
        }";
    let source = [shaders().as_str(), answer].concat();
    let surfaces = surfaces();
    let surfaces: Vec<&Surface> = surfaces.iter().cycle().take(100).collect();
    let asked: Vec<[f32; 4]> = surfaces
        .iter()
        .flat_map(|surface| [surface.normal, surface.tangent, surface.view])
        .map(|v| v.extend(0.0).to_array())
        .collect();
    for (name, environment) in environments() {
        let light = Arc::new(LightSamples::new(&environment));
        for material in materials() {
            let prepared = Prepared::of(Arc::clone(&light), &material);
            let packed = material::PackedMaterial::new(Some(&material)).unwrap();
            let lobes = prepared.lobes.words();
            let buffers: [&[u8]; 3] = [
                bytemuck::cast_slice(light.elements()),
                bytemuck::cast_slice(packed.words()),
                bytemuck::cast_slice(&lobes),
            ];
            let answers = on_device::answers(&device, &source, &asked, surfaces.len(), &buffers);
            for (k, (surface, found)) in surfaces.iter().zip(answers).enumerate() {
                let sequence = Sequence::new(PointSet::ALL[k % 2], k as u32);
                let expected = brute_force(&prepared, surface, sequence, 5..69);
                let error = (Vec3::from(found) - expected).abs();
                let allowed = 2e-3 * expected + 1e-6;
                assert!(
                    error.cmple(allowed).all(),
                    "{name} {material:?} {k} {surface:?}: {found:?} {expected}"
                );
            }
        }
    }
}
