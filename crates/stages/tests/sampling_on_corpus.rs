//! Sampling under real light: the noise of directions that follow the light, a measured material's lobe, or
//! their product, and light rigs.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use std::num::NonZeroU32;
use std::path::Path;
use std::time::Instant;

use brdf::{BrdfCoefficients, Choice, Material, project};
use containers::ReadOptions;
use envmap::{Environment, Layout};
use sampling::{
    Irradiance, LightMasses, Method, Options, ProductOptions, ProductSampler, ProductTables, SUM, Sampler,
    Tables, TexelLight, UniformShare, rig, weigh,
};
use sh::{Degree, Light, Stop};
use shrm::reference::{Cull, Estimate, Reference, Sampled};
use sphere::{DMat3, DVec3, Direction, LatLong};

const MATERIALS: [&str; 2] = ["garnet_red", "krylon_blue"];
const ENVIRONMENTS: [&str; 5] = ["studio", "apartment", "forest", "night", "sunrise"];

/// Samples of one estimate, as a renderer takes them at a pixel.
const SAMPLES: usize = 64;

/// A surface and a view of it: the frame, and the view in the world.
struct Pixel {
    to_local: DMat3,
    normal: Direction,
    tangent: Direction,
    view: Direction,
}

/// Surfaces that face all ways, seen from up to 60 degrees.
fn pixels() -> Vec<Pixel> {
    let pixel = |k: u32| {
        let turn = |step: f64| (f64::from(k) * step).fract();
        let normal = Direction::from_angles(
            (1.0 - 2.0 * turn(0.618_034)).acos(),
            std::f64::consts::TAU * turn(0.754_878),
        );
        let x = normal.vector().cross(DVec3::new(0.3, 0.5, 0.8)).normalize();
        let frame = DMat3::from_cols(x, normal.vector().cross(x), normal.vector());
        let view = Direction::from_angles(1.05 * turn(0.324_718), std::f64::consts::TAU * turn(0.569_84));
        Pixel {
            to_local: frame.transpose(),
            normal,
            tangent: Direction::normalised(x),
            view: Direction::normalised(frame * view.vector()),
        }
    };
    (1..=12).map(pixel).collect()
}

fn environment(corpus: &Path, name: &str) -> Environment {
    let bytes = std::fs::read(corpus.join(format!("env/cc0/{name}.hdr"))).unwrap();
    let image = containers::read_image(&bytes, &ReadOptions::default()).unwrap().image;
    Environment::from_image(image, Layout::LatLong, None).unwrap()
}

fn material(corpus: &Path, name: &str) -> (Material, BrdfCoefficients) {
    let file = format!("{name}.brdf");
    let bytes = std::fs::read(corpus.join("brdf/measured").join(&file)).unwrap();
    let material = containers::measured::read(&file, &bytes, None).unwrap();
    let coefficients = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
    (material, coefficients.cut_to(degree(19), degree(16)))
}

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// The sum over channels of radiance times rho_hat.
fn integrand(pixel: &Pixel, material: &Material, environment: &Environment, w: Direction) -> f64 {
    let grid = environment.grid();
    let local = |w: Direction| Direction::normalised(pixel.to_local * w.vector());
    let rho_hat = material.rho_hat(local(w), local(pixel.view));
    let (column, row) = grid.position(w);
    let inside = |x: f64, count: usize| ((x + 0.5) as usize).min(count - 1);
    let texel = environment.pixels()[inside(row, grid.height) * grid.width + inside(column, grid.width)];
    rho_hat.iter().zip(texel).map(|(rho, light)| rho * f64::from(light)).sum()
}

/// Random points.
fn points(seed: u32) -> Vec<[f32; 2]> {
    let mut state = u64::from(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1 << 24) as f32
    };
    // The first few numbers of near seeds are alike.
    (0..SAMPLES + 20).map(|_| [next(), next()]).skip(20).collect()
}

/// The relative mean square of the error of estimates, summed over pixels, and the seconds that they took.
fn noise(
    pixels: &[Pixel],
    exact: &[f64],
    rounds: u32,
    value: impl Fn(&Pixel, Direction) -> f64,
    mut draw: impl FnMut(&Pixel, &[[f32; 2]], &mut [[f32; 3]], &mut [f32]),
) -> (f64, f64) {
    let (mut directions, mut densities) = ([[0.0; 3]; SAMPLES], [0.0; SAMPLES]);
    let (mut error, begin) = (0.0, Instant::now());
    for (index, pixel) in pixels.iter().enumerate() {
        for round in 0..rounds {
            draw(pixel, &points(1000 * index as u32 + round + 1), &mut directions, &mut densities);
            let weights = directions.iter().zip(&densities).map(|(w, p)| {
                let w = Direction::normalised(DVec3::from_array(w.map(f64::from)));
                if *p > 0.0 { value(pixel, w) / f64::from(*p) } else { 0.0 }
            });
            let mean = weights.sum::<f64>() / SAMPLES as f64;
            error += (mean / exact[index] - 1.0).powi(2);
        }
    }
    let count = (pixels.len() as u32 * rounds) as f64;
    ((error / count).sqrt(), begin.elapsed().as_secs_f64() / count)
}

#[test]
fn a_product_has_less_noise_than_its_factors() {
    let test = "a_product_has_less_noise_than_its_factors";
    let Some(corpus) = test_data::folder(test, "SPECULA_CORPUS") else { return };
    let tables = Tables::new(degree(19));
    let constant = Tables::new(degree(0));
    let pixels = pixels();
    let rounds = 16;
    test_data::say("relative RMS error of 64 samples; in brackets the error at the time of the product's");
    for name in MATERIALS {
        let (material, coefficients) = material(&corpus, name);
        for environment_name in ENVIRONMENTS {
            let environment = environment(&corpus, environment_name);
            let grid: LatLong = environment.grid();
            let exact: Vec<f64> = (pixels.iter())
                .map(|pixel| {
                    let texel = |index: usize| {
                        let (row, column) = (index / grid.width, index % grid.width);
                        integrand(pixel, &material, &environment, grid.direction(row, column))
                            * grid.solid_angle(row)
                    };
                    (0..grid.len()).map(texel).sum()
                })
                .collect();
            let value = |pixel: &Pixel, w: Direction| integrand(pixel, &material, &environment, w);
            let f =
                |pixel: &Pixel| weigh(&coefficients.at_view(pixel.normal, pixel.tangent, pixel.view), SUM);
            let light = TexelLight::new(&environment, SUM).unwrap();
            let light_only =
                ProductSampler::new(&ProductTables::new(&light, &constant), &[1.0], Default::default())
                    .unwrap();
            let of_light = noise(&pixels, &exact, rounds, value, |_, points, directions, densities| {
                light_only.sample_into(points, directions, densities);
            });
            // What the series lacks of the material is drawn too.
            let uniform_share = UniformShare::new(0.1).unwrap();
            let options = Options { uniform_share, ..Default::default() };
            let mut lobe = Sampler::new(&tables, &f(&pixels[0]), options).unwrap();
            let of_lobe = noise(&pixels, &exact, rounds, value, |pixel, points, directions, densities| {
                lobe.replace(&f(pixel)).unwrap();
                lobe.sample_into(points, directions, densities);
            });
            let options = ProductOptions { uniform_share, ..Default::default() };
            let product_tables = ProductTables::new(&light, &tables);
            let mut product = ProductSampler::new(&product_tables, &f(&pixels[0]), options).unwrap();
            let of_product = noise(&pixels, &exact, rounds, value, |pixel, points, directions, densities| {
                product.replace(&f(pixel)).unwrap();
                product.sample_into(points, directions, densities);
            });
            let told = |(error, time): (f64, f64)| {
                let at_equal_time = error * (time / of_product.1).sqrt();
                format!("{error:.4} ({at_equal_time:.4}, {:.0} us)", 1e6 * time)
            };
            test_data::say(&format!(
                "{name:11} {environment_name:9} light {} lobe {} product {}",
                told(of_light),
                told(of_lobe),
                told(of_product)
            ));
            assert!(of_product.0 < of_light.0 && of_product.0 < of_lobe.0, "{name}, {environment_name}");
        }
    }
}

/// The irradiance of a surface: the sum over all texels.
fn irradiance(environment: &Environment, normal: Direction) -> [f64; 3] {
    let grid = environment.grid();
    let mut sum = [0.0; 3];
    for (index, texel) in environment.pixels().iter().enumerate() {
        let row = index / grid.width;
        let w = grid.direction(row, index % grid.width);
        let weight = w.vector().dot(normal.vector()).max(0.0) * grid.solid_angle(row);
        (0..3).for_each(|c| sum[c] += f64::from(texel[c]) * weight);
    }
    sum
}

/// The RMS error of the irradiance of lights, as a share of its mean.
fn error(normals: &[(Direction, [f64; 3])], lights: &[Light]) -> f64 {
    let (mut square, mut sum) = (0.0, 0.0);
    for (normal, exact) in normals {
        for c in 0..3 {
            let of =
                |light: &Light| light.irradiance[c] * light.direction.vector().dot(normal.vector()).max(0.0);
            square += (lights.iter().map(of).sum::<f64>() - exact[c]).powi(2);
            sum += exact[c];
        }
    }
    let count = 3.0 * normals.len() as f64;
    (square / count).sqrt() / (sum / count)
}

#[test]
fn rigs_have_all_light_of_photographs_and_tend_to_their_irradiance() {
    let test = "rigs_have_all_light_of_photographs_and_tend_to_their_irradiance";
    let Some(corpus) = test_data::folder(test, "SPECULA_CORPUS") else { return };
    for name in ENVIRONMENTS {
        let environment = environment(&corpus, name);
        let total = environment.integral();
        let normals: Vec<_> =
            pixels().iter().map(|pixel| (pixel.normal, irradiance(&environment, pixel.normal))).collect();
        let masses = LightMasses::of_environment(&environment).unwrap();
        let told = Irradiance::of(&masses);
        for method in [Method::MedianCut, Method::Warped] {
            let errors = [4, 64, 1024].map(|count| {
                let lights = rig(&masses, NonZeroU32::new(count).unwrap(), method);
                for c in 0..3 {
                    let flux: f64 = lights.iter().map(|light| light.flux()[c]).sum();
                    assert!((flux / total[c] - 1.0).abs() < 1e-6, "{name} {method:?} {count}");
                }
                let (error, told) = (error(&normals, &lights), told.error(&lights));
                // Over other normals than the sampler's own, about the same.
                assert!((0.3..3.0).contains(&(error / told)), "{name} {method:?} {count}: {error} {told}");
                error
            });
            test_data::say(&format!("{name:9} {method:?}: 4, 64, 1024 lights: {errors:.4?}"));
            assert!(errors[1] < 0.4 * errors[0] && errors[2] < 0.02, "{name} {method:?}: {errors:?}");
        }
    }
}

/// The sampled reference against the sum over all texels; all lobes are wider than a few of these. Without an
/// expansion the batches have no directions of the product: twice as many batches have as many directions.
#[test]
fn the_sampled_reference_is_right_to_its_standard_error() {
    let test = "the_sampled_reference_is_right_to_its_standard_error";
    let Some(corpus) = test_data::folder(test, "SPECULA_CORPUS") else { return };
    let metal = brdf::Fresnel::Conductor { n: [0.2, 0.9, 1.1], k: [3.9, 2.4, 2.1] };
    let ggx = |roughness| Material::Ggx(brdf::Ggx::new(roughness, metal, [1.0; 3]).unwrap());
    let mut materials = MATERIALS.map(|name| (name.to_owned(), material(&corpus, name).0)).to_vec();
    materials.extend([0.2, 0.5].map(|roughness| (format!("ggx {roughness}"), ggx(roughness))));
    let pixels = pixels();
    test_data::say(
        "standard error over the root mean square of 512 directions, ms; without the product; sum",
    );
    for name in ["studio", "night"] {
        let environment = environment(&corpus, name);
        for (material_name, material) in &materials {
            let coefficients = project(material, Choice::Full, Stop::NEVER).unwrap().coefficients;
            let none =
                BrdfCoefficients::new(material.centre(), degree(0), degree(0), vec![[0.0; 3]]).unwrap();
            let central = |pixel: &Pixel| material.centre().central(pixel.normal, pixel.tangent, pixel.view);
            let estimates = |coefficients: &BrdfCoefficients, directions: usize| {
                let sampled = Sampled::new(&environment, material, coefficients, directions, 0);
                let begin = Instant::now();
                let one =
                    |(index, pixel): (usize, &Pixel)| sampled.radiance(index, central(pixel), pixel.view);
                let estimates: Vec<Estimate> = pixels.iter().enumerate().map(one).collect();
                (estimates, 1e3 * begin.elapsed().as_secs_f64() / pixels.len() as f64)
            };
            let begin = Instant::now();
            let reference = Reference::new(&environment, material, Cull::None);
            let truth: Vec<[f64; 3]> =
                pixels.iter().map(|pixel| reference.radiance(central(pixel), pixel.view)).collect();
            let sum_time = 1e3 * begin.elapsed().as_secs_f64() / pixels.len() as f64;
            let size = rms(truth.iter().flatten().copied());
            let told = |estimates: &[Estimate]| {
                rms(estimates.iter().flat_map(|estimate| estimate.standard_error)) / size
            };
            let (with, time) = estimates(&coefficients, 512);
            let (without, time_without) = estimates(&none, 1024);
            test_data::say(&format!(
                "{material_name:11} {name:9} {:.4} {time:.1} ms; {:.4} {time_without:.1} ms; {sum_time:.0} ms",
                told(&with),
                told(&without)
            ));
            if MATERIALS.contains(&material_name.as_str()) {
                assert!(told(&with) < 0.6 * told(&without), "{material_name}, {name}");
            }
            let (many, _) = estimates(&coefficients, 4096);
            let ratios: Vec<f64> = (many.iter().zip(&truth))
                .flat_map(|(estimate, truth)| {
                    let ratio = |channel: usize| {
                        let error = estimate.radiance[channel] - truth[channel];
                        // The midpoint rule of the sum, and what rare directions carry.
                        error / (estimate.standard_error[channel] + 5e-4 * truth[channel] + 1e-4 * size)
                    };
                    [0, 1, 2].map(ratio)
                })
                .collect();
            let largest = ratios.iter().fold(0.0, |largest: f64, ratio| largest.max(ratio.abs()));
            test_data::say(&format!("  ratio {:.2}, at most {largest:.2}", rms(ratios.iter().copied())));
            assert!(largest < 5.0 && rms(ratios.iter().copied()) < 1.6, "{material_name}, {name}");
        }
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (count, squares) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value * value));
    f64::sqrt(squares / count)
}
