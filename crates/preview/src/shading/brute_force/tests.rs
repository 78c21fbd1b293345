//! Brute force compared with the sum over all texels, `shrm::reference::Reference`.

use brdf::{BrdfCoefficients, Choice, Fresnel, Ggx, KajiyaKay, Lambert, Microfacet, Phong, project};
use envmap::Environment;
use glam::DVec3;
use sh::{Degree, Stop};
use shrm::Reflection;
use shrm::reference::{Cull, Reference};
use sphere::{Direction, LatLong};

use super::*;
use crate::shading::product_samples::{FIRST, ProductCell};
#[cfg(feature = "gpu")]
use crate::shading::product_tables::{CELLS, HEADER};
use crate::shading::product_tables::{ProductTables, ViewAxes};
#[cfg(feature = "gpu")]
use crate::shading::{lobe_sampling, on_device, product_samples, sequence, shadows::NO_SHADOWS};
use crate::{Light, MapSizes, PointSet};

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
    product: Option<Product<'_>>,
    surface: &Surface,
    points: PointSet,
    [samples, pixels]: [u32; 2],
) -> (DVec3, DVec3) {
    let estimate = |pixel| {
        let sequence = Sequence::new(points, pixel);
        let sum = brute_force_past(prepared, product, surface, sequence, 0..samples, |_| true);
        sum.as_dvec3() / f64::from(samples)
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
                    let (many, deviation) = estimates(&prepared, None, &surface, points, [1024, pixels]);
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
        &product_samples::shader(),
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

/// The sums of the shader and those of its twin, over samples 5 to 68 of even points and of random ones in
/// turns. Rounding moves a few of them across the edge of a texel, or changes a highlight: 2 parts in a
/// thousand of a sum of 64.
#[cfg(feature = "gpu")]
fn assert_same_sums(
    device: &(wgpu::Device, wgpu::Queue),
    name: &str,
    prepared: &Prepared,
    product: Option<(&ProductTables, ViewAxes)>,
) {
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
    let packed = material::PackedMaterial::new(Some(prepared.material())).unwrap();
    let lobes = prepared.lobes.words();
    let tables = product.map_or_else(
        || vec![0.0; HEADER as usize],
        |(tables, axes)| {
            let cells = (0..(CELLS * CELLS) as usize).flat_map(|cell| tables.table(axes, cell));
            tables.header(axes).into_iter().chain(tables.fixed().iter().copied()).chain(cells).collect()
        },
    );
    assert!(product.is_none_or(|(of, _)| of.count() == tables.len()));
    let buffers: [&[u8]; 9] = [
        bytemuck::cast_slice(prepared.light.elements()),
        bytemuck::cast_slice(packed.words()),
        bytemuck::cast_slice(&lobes),
        &[],
        &[],
        &[],
        &[],
        &[],
        bytemuck::cast_slice(&tables),
    ];
    let answers = on_device::answers(device, &source, &asked, surfaces.len(), &buffers);
    for (k, (surface, found)) in surfaces.iter().zip(answers).enumerate() {
        let sequence = Sequence::new(PointSet::ALL[k % 2], k as u32);
        let cell = product.map(|(tables, axes)| ProductCell::new(tables, axes, surface));
        let product = cell.as_ref().map(|cell| Product { directions: cell, first: FIRST });
        let expected = brute_force_past(prepared, product, surface, sequence, 5..69, |_| true);
        let error = (Vec3::from(found) - expected).abs();
        let allowed = 2e-3 * expected + 1e-6;
        let material = prepared.material();
        assert!(error.cmple(allowed).all(), "{name} {material:?} {k} {surface:?}: {found:?} {expected}");
    }
}

#[cfg(feature = "gpu")]
#[test]
fn the_shader_matches_its_twin() {
    let Some(device) = on_device::device("the_shader_matches_its_twin") else { return };
    for (name, environment) in environments() {
        let light = Arc::new(LightSamples::new(&environment));
        for material in materials() {
            assert_same_sums(&device, name, &Prepared::of(Arc::clone(&light), &material), None);
        }
    }
}

#[cfg(feature = "gpu")]
#[test]
fn the_shader_that_follows_the_product_matches_its_twin() {
    let test = "the_shader_that_follows_the_product_matches_its_twin";
    let Some(device) = on_device::device(test) else { return };
    for followed in followed() {
        assert_same_sums(&device, followed.name, &followed.prepared, Some((&followed.tables, followed.axes)));
    }
}

/// A look whose product is followed, for a distant viewer.
struct Followed {
    name: &'static str,
    environment: Environment,
    prepared: Prepared,
    tables: ProductTables,
    axes: ViewAxes,
}

/// Chalk, whose lobe is about the normal, and gold, whose lobe is about the reflection, in all environments.
fn followed() -> Vec<Followed> {
    let [chalk, _, _, gold, _] = materials();
    let degree = |degree| Degree::new(degree).unwrap();
    let choice = Choice::Degree { f: degree(19), p: degree(16) };
    let series = |material: &Material| project(material, choice, Stop::NEVER).unwrap().coefficients;
    let series: [(Material, BrdfCoefficients); 2] = [chalk, gold].map(|material| {
        let coefficients = series(&material);
        (material, coefficients)
    });
    let sizes = MapSizes { edge: 8, slices: 4 };
    let mut all = Vec::new();
    for (name, environment) in environments() {
        let light = Arc::new(Light::new(environment.clone(), None));
        for (material, series) in &series {
            let reflection = Reflection::convolve(light.lighting(), series);
            let look = Look::new(Arc::clone(&light), reflection, Some(material.clone()), sizes);
            all.push(Followed {
                name,
                environment: environment.clone(),
                prepared: Prepared::new(&look).unwrap(),
                tables: ProductTables::new(&look).unwrap(),
                axes: ViewAxes::new(Vec3::new(0.48, 0.36, 0.8)),
            });
        }
    }
    all
}

/// The sum over texels is the oracle, far from the viewer of the tables, and below the surface, too.
#[test]
fn samples_of_the_product_converge_to_the_sum_over_texels() {
    const PIXELS: u32 = 64;
    for Followed { name, environment, prepared, tables, axes } in followed() {
        for surface in surfaces() {
            let expected = expected(&environment, prepared.material(), &surface);
            let cell = ProductCell::new(&tables, axes, &surface);
            let product = Some(Product { directions: &cell, first: FIRST });
            for points in PointSet::ALL {
                let (mean, deviation) = estimates(&prepared, product, &surface, points, [512, PIXELS]);
                for channel in 0..3 {
                    let of_mean = deviation[channel] / f64::from(PIXELS).sqrt();
                    let error = (mean[channel] - expected[channel]).abs();
                    let allowed = 5.0 * of_mean + 1e-3 * expected[channel];
                    assert!(error < allowed, "{name} {surface:?} {points:?}\n{mean} {expected}");
                }
            }
        }
    }
}

/// The density of each texel times its solid angle is the probability of the texel: all of them are 1 in
/// total, and by chi-square 65,536 directions fall into 16 x 16 parts of the sphere as often as it says.
#[test]
fn the_density_of_the_product_is_that_of_its_samples() {
    const PARTS: usize = 16;
    const COUNT: u32 = 1 << 16;
    for Followed { name, environment, prepared, tables, axes } in followed() {
        let (grid, light) = (environment.grid(), &prepared.light);
        let part = |[row, column]: [u32; 2]| {
            row as usize * PARTS / grid.height * PARTS + column as usize * PARTS / grid.width
        };
        for (number, surface) in surfaces().into_iter().enumerate() {
            let cell = ProductCell::new(&tables, axes, &surface);
            let cell: &dyn ProductDirections = &cell;
            let mut shares = [0.0; PARTS * PARTS];
            for row in 0..grid.height {
                for column in 0..grid.width {
                    let direction = grid.direction(row, column).vector().as_vec3();
                    let lit = light.at(direction);
                    assert_eq!(lit.texel, [row as u32, column as u32]);
                    let density = f64::from(cell.density(light, direction, &lit));
                    shares[part(lit.texel)] += density * grid.solid_angle(row);
                }
            }
            let total: f64 = shares.iter().sum();
            assert!((total - 1.0).abs() < 1e-4, "{name} {surface:?}: {total}");
            let sequence = Sequence::new(PointSet::Random, number as u32);
            let (mut counts, mut moved) = ([0.0; PARTS * PARTS], 0);
            for i in 0..COUNT {
                let lit = cell.sample(light, sequence.point(i));
                counts[part(lit.texel)] += 1.0;
                moved += u32::from(light.at(lit.direction).texel != lit.texel);
            }
            // Rounding moves directions on the edge of a texel.
            assert!(moved < COUNT / 500, "{name} {surface:?}: {moved}");
            let (mut chi, mut parts, mut rest) = (0.0, 0.0, [0.0; 2]);
            let mut add = |count: f64, share: f64| {
                let expected = share * f64::from(COUNT);
                chi += (count - expected).powi(2) / expected;
                parts += 1.0;
            };
            for (count, share) in counts.into_iter().zip(shares) {
                // Parts with few directions count as one.
                if share * f64::from(COUNT) < 10.0 {
                    rest = [rest[0] + count, rest[1] + share];
                } else {
                    add(count, share);
                }
            }
            if rest[1] * f64::from(COUNT) >= 10.0 {
                add(rest[0], rest[1]);
            } else {
                assert!(rest[0] < 40.0, "{name} {surface:?}: {rest:?}");
            }
            // The mean of chi-square is its degrees of freedom, its variance twice as much.
            assert!(chi < parts + 5.0 * f64::sqrt(2.0 * parts) + 5.0, "{name} {surface:?}: {chi} of {parts}");
        }
    }
}
