//! Brute force with samples of the product of light and material.

use brdf::{Fresnel, Ggx, KajiyaKay};
use glam::Vec3;
use sampling::ProductSampler;

use super::*;
use crate::cpu::product_sampling::{BandSamplers, OWN_SAMPLES, ProductSampling};
use crate::shading::brute_force::{Prepared, Product, brute_force_past};
use crate::shading::product_samples::is_worth;
use crate::shading::sequence::Sequence;

/// Windows in a dim room.
fn windows(w: DVec3) -> [f64; 3] {
    let pane = (5.0 * w.x + 1.0).sin() > 0.6 && (4.0 * w.z).cos() > 0.3 && w.y > -0.4;
    [0.2, 0.2, 0.3].map(|dim| if pane { 30.0 } else { dim })
}

fn ggx(roughness: f64) -> Material {
    let gold = Fresnel::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };
    Material::Ggx(Ggx::new(roughness, gold, [1.0; 3]).unwrap())
}

fn soft() -> Arc<Look> {
    look(&light(48, windows), &ggx(0.5), [19, 16])
}

/// The samples of a sampler, if there is one.
fn followed(sampler: Option<&ProductSampler>) -> Option<Product<'_>> {
    sampler.map(|sampler| Product::always(sampler))
}

#[test]
fn samples_of_the_product_halve_the_noise_and_keep_the_mean() {
    const SAMPLES: u32 = 256;
    let look = soft();
    let scene = Scene::of(sphere(), Arc::clone(&look));
    let shot = shot([24, 24], Show::One(Mode::BruteForce));
    let product = ProductSampling::new(&look).unwrap();
    let prepared = Prepared::new(&look).unwrap();
    let (mut squares, mut sums, mut deviations) = ([0.0; 2], [0.0; 2], 0.0);
    for surface in seen(&scene, &shot).into_iter().flatten().map(|hit| hit.surface) {
        let mut samplers = BandSamplers::new(&shot);
        let sampler = samplers.get(&product, surface.normal, surface.view).unwrap();
        let mean = |sampler, number: u32, samples: u32| {
            let sequence = Sequence::new(PointSet::Even, number);
            let sum: Vec3 =
                brute_force_past(&prepared, followed(sampler), &surface, sequence, 0..samples, |_| true);
            f64::from(sum.element_sum()) / f64::from(samples)
        };
        // The truth without any sampler of the product.
        let truth: f64 = mean(None, 77, 1 << 14);
        for (place, sampler) in [None, Some(sampler)].into_iter().enumerate() {
            for number in 0..4 {
                let error = mean(sampler, number, SAMPLES) / truth - 1.0;
                squares[place] += error * error;
                sums[place] += error;
                deviations += 1.0;
            }
        }
    }
    let count = deviations / 2.0;
    let [plain, by_product] = squares.map(|sum| f64::sqrt(sum / count));
    assert!(by_product < 0.6 * plain, "{by_product} {plain}");
    // No bias: the mean error is within its own standard error, and that of the truth.
    let bias = sums[1] / count;
    assert!(bias.abs() < 4.0 * by_product / f64::sqrt(count) + 2e-3, "{bias} {by_product}");
}

#[test]
fn lobes_that_the_series_does_not_hold_have_no_sampler() {
    let lit = light(16, windows);
    let has = |look: &Look| ProductSampling::new(look).is_some();
    assert!(has(&look(&lit, &lambert(0.7), [19, 16])));
    assert!(!has(&look(&lit, &ggx(0.15), [19, 16])), "too sharp");
    assert!(!has(&look(&lit, &ggx(0.5), [4, 2])), "cut short");
    let hair = Material::KajiyaKay(KajiyaKay::new(8.0, [0.6; 3]).unwrap());
    assert!(!has(&look(&lit, &hair, [19, 16])), "about the tangent");
    assert!(!has(&look(&light(16, |_| [0.0; 3]), &lambert(0.7), [19, 16])), "black");
}

#[test]
fn few_samples_are_not_worth_a_sampler_and_pictures_with_it_do_not_depend_on_threads() {
    let few = shot([20, 14], Show::One(Mode::BruteForce));
    let many = Shot { light_samples: 64, samples: 2, ..few.clone() };
    assert!(!is_worth(&few) && is_worth(&many));
    let scene = Scene::of(sphere(), soft());
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, &many))
    };
    assert_eq!(on(1), on(3));
}

/// A photograph of the corpus with a low sun.
fn sunrise() -> Option<Arc<Light>> {
    let corpus = test_data::folder("a_sun_lit_photograph_has_less_noise_by_the_product", "SPECULA_CORPUS")?;
    let bytes = std::fs::read(corpus.join("env/cc0/sunrise.hdr")).unwrap();
    let image = containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image;
    let environment = Environment::from_image(image, envmap::Layout::LatLong, None).unwrap();
    Some(Arc::new(Light::new(environment, None)))
}

/// Each sample of a pixel has random points and, for the product, a sampler of the lobe in its own frame.
/// The oracle has many even points without any sampler.
#[test]
fn a_sun_lit_photograph_has_less_noise_by_the_product() {
    const SAMPLES: u32 = 256;
    const NUMBERS: u32 = 8;
    let Some(lit) = sunrise() else { return };
    let look = look(&lit, &ggx(0.45), [19, 16]);
    let scene = Scene::of(sphere(), Arc::clone(&look));
    let many = Shot { light_samples: OWN_SAMPLES, ..shot([12, 12], Show::One(Mode::BruteForce)) };
    let product = ProductSampling::new(&look).unwrap();
    let by = |share| Prepared::with_light_share(Arc::clone(lit.samples()), look.material().unwrap(), share);
    let (both, light, lobe) = (Prepared::new(&look).unwrap(), by(1.0), by(0.0));
    let (mut squares, mut bias, mut count) = ([0.0; 3], 0.0, 0.0);
    let mut samplers = BandSamplers::new(&many);
    for surface in seen(&scene, &many).into_iter().flatten().map(|hit| hit.surface) {
        let sampler = samplers.get(&product, surface.normal, surface.view).unwrap();
        let mean = |prepared, sampler, sequence, samples: u32| {
            let sum = brute_force_past(prepared, followed(sampler), &surface, sequence, 0..samples, |_| true);
            f64::from(sum.element_sum()) / f64::from(samples)
        };
        let truth = mean(&both, None, Sequence::new(PointSet::Even, 77), 1 << 15);
        for number in 0..NUMBERS {
            let sequence = Sequence::new(PointSet::Random, number);
            let error = |prepared, sampler| mean(prepared, sampler, sequence, SAMPLES) / truth - 1.0;
            let errors = [error(&both, Some(sampler)), error(&light, None), error(&lobe, None)];
            (0..3).for_each(|by| squares[by] += errors[by] * errors[by]);
            bias += errors[0];
            count += 1.0;
        }
    }
    let [by_product, by_light, by_lobe] = squares.map(|sum| f64::sqrt(sum / count));
    assert!(4.0 * by_product < by_light && 4.0 * by_product < by_lobe, "{by_product} {by_light} {by_lobe}");
    // The mean error is within 4 of its own deviations, and the truth's 0.2 %.
    let bias = bias / count;
    assert!(bias.abs() < 4.0 * by_product / f64::sqrt(count) + 2e-3, "{bias} {by_product}");
}

/// A sampler that took the lobes of other normals before has the density of a new one.
#[test]
fn a_sample_of_a_pixel_has_the_lobe_in_its_own_frame() {
    let look = soft();
    let scene = Scene::of(sphere(), Arc::clone(&look));
    let few = shot([16, 16], Show::One(Mode::BruteForce));
    let many = Shot { light_samples: OWN_SAMPLES, ..few.clone() };
    let product = ProductSampling::new(&look).unwrap();
    let (mut kept, mut cells, mut apart) = (BandSamplers::new(&many), BandSamplers::new(&few), 0);
    for surface in seen(&scene, &many).into_iter().flatten().map(|hit| hit.surface) {
        let (normal, view) = (surface.normal, surface.view);
        let mut fresh = BandSamplers::new(&many);
        let fresh = fresh.get(&product, normal, view).unwrap();
        let kept = kept.get(&product, normal, view).unwrap();
        let cell = cells.get(&product, normal, view).unwrap();
        for k in 0..20 {
            let direction = sphere::spiral(k, 20).vector().as_vec3().to_array();
            assert_eq!(kept.density(direction), fresh.density(direction));
            apart += u32::from(cell.density(direction) != fresh.density(direction));
        }
    }
    assert!(apart > 1000, "the middle of a cell is another normal: {apart}");
}
