//! The shader against the models in f64.

use brdf::{
    AshikhminShirley, BlinnPhong, Fresnel, Ggx, KajiyaKay, Lafortune, LafortuneLobe, Lambert, Measured,
    MeasuredAnisotropic, Microfacet, OrenNayar, Phong, PoulinFournier, Standard, StandardParameters,
    TorranceSparrow, Ward,
};
#[cfg(feature = "gpu")]
use glam::DVec3;

use super::*;
#[cfg(feature = "gpu")]
use crate::shading::on_device;

/// Materials of every model, a table and layers, each with its sharpness s: its highlight is about 1 /
/// sqrt(s) wide. A model that has none here is tested with its examples.
pub(crate) fn materials() -> Vec<(Material, f64)> {
    let glass = Fresnel::Dielectric(1.5);
    let gold = Fresnel::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };
    let lobe = |cx: f64, cz: f64, n: f64| LafortuneLobe { cx, cz, n, weight: [1.0, 0.5, 0.25] };
    let rgb = [1.0, 0.5, 0.2];
    let lambert = || Material::Lambert(Lambert::new([0.8, 0.4, 0.0]).unwrap());
    let phong = |s: f64| Material::Phong(Phong::new(s, rgb).unwrap());
    let blinn_phong = |s: f64| Material::BlinnPhong(BlinnPhong::new(s, rgb).unwrap());
    let microfacet = |sigma: f64| Material::Microfacet(Microfacet::new(sigma, rgb).unwrap());
    let torrance =
        |m: f64, fresnel| Material::TorranceSparrow(TorranceSparrow::new(m, fresnel, rgb).unwrap());
    let ggx = |roughness: f64, fresnel| Material::Ggx(Ggx::new(roughness, fresnel, rgb).unwrap());
    let ward = |x: f64, y: f64| Material::Ward(Ward::new([x, y], rgb).unwrap());
    let ashikhmin = |x: f64, y: f64| {
        Material::AshikhminShirley(AshikhminShirley::new([x, y], [0.5, 0.2, 0.1], [0.04, 0.5, 1.0]).unwrap())
    };
    let kajiya_kay = |s: f64| Material::KajiyaKay(KajiyaKay::new(s, rgb).unwrap());
    let standard = |roughness: f64, clearcoat: f64, sheen: f64| {
        Standard::new(StandardParameters {
            base_color: rgb,
            metallic: 0.3,
            roughness,
            clearcoat,
            clearcoat_roughness: 0.1,
            sheen: [0.0, 0.5 * sheen, sheen],
            sheen_roughness: 0.3,
            ..StandardParameters::default()
        })
        .unwrap()
    };
    let mut materials = vec![
        (Material::Standard(standard(0.3, 0.0, 0.0)), 120.0),
        (Material::Standard(standard(0.5, 0.6, 0.0)), 1e4),
        (Material::Standard(standard(0.4, 0.0, 1.0)), 120.0),
        (Material::Standard(standard(0.02, 1.0, 0.8)), 6.25e6),
        (lambert(), 1.0),
        (Material::Lafortune(Lafortune::new([0.3, 0.2, 0.1], vec![]).unwrap()), 1.0),
        (
            Material::Lafortune(
                Lafortune::new([0.1; 3], vec![lobe(-0.95, 0.8, 12.0), lobe(0.5, 0.5, 3.0)]).unwrap(),
            ),
            12.0,
        ),
        (
            Material::Lafortune(Lafortune::new([0.0; 3], vec![lobe(-1.0, 0.99, 900.0)]).unwrap()),
            900.0 * 900.0,
        ),
        (Material::layers(vec![lambert(), phong(300.0), ggx(0.3, glass)]).unwrap(), 300.0),
        (Material::layers(vec![Material::layers(vec![lambert()]).unwrap(), chalk(), chalk()]).unwrap(), 1.0),
        (chalk(), 1.0),
        (twill(), 1.0),
    ];
    for part in standard(0.4, 0.3, 0.5).parts() {
        materials.push((Material::Standard(part), 1e4));
    }
    for sigma in [0.0, 25.0, 90.0] {
        materials.push((Material::OrenNayar(OrenNayar::new([0.8, 0.4, 0.0], sigma).unwrap()), 1.0));
    }
    for s in [0.0, 1.0, 2.5, 20.0, 1000.0, 1e6] {
        materials.push((phong(s), s));
        materials.push((blinn_phong(s), s));
        materials.push((kajiya_kay(s), s));
    }
    for width in [0.01, 0.1, 0.5, 1.0] {
        materials.push((microfacet(width), 1.0 / (width * width)));
        materials.push((torrance(width, glass), 1.0 / (width * width)));
        materials.push((ggx(width, gold), 1.0 / width.powi(4)));
        materials.push((ward(width, 0.3), 1.0 / (width * width)));
    }
    materials.push((microfacet(50.0), 1.0));
    for ior in [1.0, 1.01, 10.0] {
        materials.push((ggx(0.4, Fresnel::Dielectric(ior)), 40.0));
    }
    for (x, y) in [(0.1, 0.7), (1.0, 0.3), (0.5, 0.05)] {
        let sharpness = f64::min(x, y).powi(-4);
        materials.push((Material::Ggx(Ggx::stretched([x, y], gold, rgb).unwrap()), sharpness));
    }
    // Where little of a cylinder is seen, near the horizon, the ends of the arc are as uncertain as those of
    // a sharp highlight.
    for (s, distance, height) in [(0.0, 2.0, 1.0), (20.0, 2.0, 1.0), (20.0, 2.7, 0.4), (400.0, 3.0, 1.8)] {
        let cylinders = PoulinFournier::new(s, [0.3, 0.2, 0.1], rgb, distance, height).unwrap();
        materials.push((Material::PoulinFournier(cylinders), 1e5));
    }
    for (n, k) in [(0.01, 0.0), (0.01, 50.0), (50.0, 50.0), (1.0, 0.0)] {
        materials.push((torrance(0.3, Fresnel::Conductor { n: [n; 3], k: [k; 3] }), 11.0));
    }
    for (x, y) in [(0.0, 0.0), (50.0, 50.0), (5000.0, 8.0)] {
        materials.push((ashikhmin(x, y), x));
    }
    for example in Material::examples().unwrap() {
        if materials.iter().all(|(material, _)| material.name() != example.name()) {
            let sharpness = example.highlight_width().powi(-2);
            materials.push((example, sharpness));
        }
    }
    materials
}

/// A table with a highlight, of a shape without symmetry.
fn chalk() -> Material {
    let shape = [12, 7, 9];
    let mut values = Vec::new();
    for entry in 0..shape.iter().product() {
        let node = [entry / 63, entry / 9 % 7, entry % 9];
        let [h, d, phi] = Measured::node(shape, node);
        let value = 0.2 + 0.5 * (-4.0 * h).exp() * (1.0 + 0.3 * (2.0 * phi).cos() * d.sin());
        values.push([value as f32, 0.5 * value as f32, 0.1]);
    }
    Material::Measured(Measured::new(shape, values).unwrap().scaled([1.0, 0.8, 0.5]).unwrap())
}

/// A table that depends on the tangent, without symmetry.
fn twill() -> Material {
    let shape = [6, 9, 5, 4];
    let mut values = Vec::new();
    for entry in 0..shape.iter().product() {
        let node = [entry / 180, entry / 20 % 9, entry / 4 % 5, entry % 4];
        let [h, phi, d, psi] = MeasuredAnisotropic::node(shape, node);
        let value =
            0.2 + 0.3 * (-4.0 * h).exp() * (1.0 + 0.5 * (2.0 * phi - 0.3).cos() + 0.2 * psi.sin() * d);
        values.push([value as f32, 0.5 * value as f32, 0.1]);
    }
    let table = MeasuredAnisotropic::new(shape, values).unwrap();
    Material::MeasuredAnisotropic(table.scaled([1.0, 0.8, 0.5]).unwrap())
}

/// Directions over the whole sphere for light and over the upper half for views: scattered ones, some near
/// the horizon, the normal, and light near the mirror direction of each view, where highlights are.
#[cfg(feature = "gpu")]
fn pairs() -> Vec<[Vec3; 2]> {
    let scattered = |i: u32, seed: f64, reach: f64| {
        let i = f64::from(i) + seed;
        Direction::from_angles((1.0 - reach * (i * 0.618_034).fract()).acos(), i * 2.399_963).vector()
    };
    let mut pairs = Vec::new();
    for i in 0..300 {
        let view = match i % 10 {
            0 => DVec3::Z,
            1 => DVec3::new(f64::from(i).cos(), f64::from(i).sin(), 1e-3),
            2 => DVec3::new(f64::from(i).cos(), f64::from(i).sin(), 0.0),
            _ => scattered(i, 0.3, 1.0),
        };
        let mirrored = DVec3::new(-view.x, -view.y, view.z);
        let low =
            DVec3::new((2.0 * f64::from(i)).sin(), (2.0 * f64::from(i)).cos(), 10f64.powi(-(i as i32 % 8)));
        for light in [
            scattered(i, 7.1, 2.0),
            low,
            mirrored,
            mirrored + 0.001 * scattered(i, 1.7, 2.0),
            mirrored + 0.03 * scattered(i, 2.7, 2.0),
            mirrored + 0.3 * scattered(i, 3.7, 2.0),
            view,
            -view,
            DVec3::new(view.x, -view.y, view.z),
        ] {
            pairs.push([light, view].map(|v| v.normalize().as_vec3()));
        }
    }
    pairs
}

/// The error of rho_hat in f32. A unit vector in f32 is 6e-8 too long or too short, and off by as much to the
/// side, which moves the angle theta from the peak of a lobe e^(-s theta^2 / 2) by d = 2e-7 and its value by
/// s theta d, at most sqrt(s) d of the peak and sqrt(2 s ln(peak / value)) d of itself; the roundings of a
/// dozen operations add 1e-6, and a logarithm times s, if the cosine is not near 1, as much times ln(peak /
/// value) < 80. The base of a lobe of lafortune is not a cosine: its power n is as uncertain as s = n^2.
///
/// If light and view are nearly opposite, the error of the half vector grows by the factor by which their sum
/// is shorter than 2.
pub(crate) fn allowed(value: f64, s: f64, [light, view]: [Vec3; 2]) -> f64 {
    let facet = (0.5 * (light + view).length()).max(1e-9);
    let of_itself = 2e-5 + 2e-7 / f64::from(facet) * (2.0 * s * 40.0).sqrt();
    of_itself * value + 1e-7
}

/// A formula for each model, chosen by its number.
#[test]
fn the_shader_has_a_formula_for_every_model() {
    let source = shader(&all_models());
    let mut seen = BTreeSet::new();
    for (material, _) in materials().iter().filter(|(material, _)| material.leaves() == [material]) {
        let number = PackedMaterial::new(Some(material)).unwrap().words()[1];
        let name = material.name().replace('-', "_");
        for part in [
            format!("case {number}u: {{ return material_{name}(at, light, view); }}"),
            format!("fn material_{name}(at: u32, light: vec3f, view: vec3f) -> vec3f {{"),
        ] {
            assert!(source.contains(&part), "{part}: {source}");
        }
        seen.insert(number);
    }
    assert_eq!(seen, all_models());
}

/// Extreme vectors: axes, nearly opposite ones, and some with the smallest numbers.
fn extremes() -> Vec<Vec3> {
    let mut vectors = vec![Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
    for z in [f32::MIN_POSITIVE, 1e-30, 1e-20, 1e-13, 1e-11, 1e-7, 1e-4] {
        for [x, y] in [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.6, -0.8], [1.0, 1e-30]] {
            vectors.push(Vec3::new(x, y, z));
            vectors.push(Vec3::new(y * z, x * z, 1.0));
        }
    }
    vectors
}

#[test]
fn no_value_is_infinite_or_nan() {
    for (material, _) in materials() {
        for light in extremes() {
            for view in extremes() {
                let exact = material.rho_hat(direction(light), direction(view));
                let value = rho_hat(&material, light, direction(view));
                let is_finite = exact.iter().all(|value| value.is_finite()) && value.is_finite();
                assert!(
                    is_finite && value.min_element() >= 0.0,
                    "{material:?}: {light} {view}: {value} {exact:?}"
                );
            }
        }
    }
}

#[cfg(feature = "gpu")]
#[test]
fn no_value_of_the_shader_is_infinite_or_nan() {
    let Some(device) = on_device::device("no_value_of_the_shader_is_infinite_or_nan") else { return };
    let pairs: Vec<[Vec3; 2]> = extremes()
        .into_iter()
        .flat_map(|light| extremes().into_iter().map(move |view| [light, view]))
        .collect();
    for (material, _) in materials() {
        for ([light, view], value) in pairs.iter().zip(of_shader(&device, &material, &pairs)) {
            assert!(value.is_finite() && value.min_element() >= 0.0, "{material:?}: {light} {view}: {value}");
        }
    }
}

/// rho_hat of a material on a device, for each light and view.
#[cfg(feature = "gpu")]
fn of_shader(device: &(wgpu::Device, wgpu::Queue), material: &Material, pairs: &[[Vec3; 2]]) -> Vec<Vec3> {
    let source = [
        include_str!("../angles.wgsl"),
        &shader(&PackedMaterial::models(material)),
        "fn answer(k: u32) -> vec3f { return material_rho_hat(asked[2u * k].xyz, asked[2u * k + 1u].xyz); }",
    ];
    let asked: Vec<[f32; 4]> = pairs.iter().flatten().map(|v| v.extend(0.0).to_array()).collect();
    let packed = PackedMaterial::new(Some(material)).unwrap();
    let words = bytemuck::cast_slice(packed.words());
    let answers = on_device::answers(device, &source.concat(), &asked, pairs.len(), &[&[], words]);
    answers.into_iter().map(Vec3::from).collect()
}

/// Compares a material on a device with its model.
#[cfg(feature = "gpu")]
fn compare(device: &(wgpu::Device, wgpu::Queue), material: &Material, s: f64) {
    let pairs = pairs();
    // A conductor of n = 1 and k = 0 reflects nothing, as the difference of numbers near 1 that a device may
    // round by a few units.
    let nothing = Fresnel::Conductor { n: [1.0; 3], k: [0.0; 3] };
    let nothing = TorranceSparrow::new(0.3, nothing, [1.0, 0.5, 0.2]).unwrap();
    let is_nothing = *material == Material::TorranceSparrow(nothing);
    let units = if is_nothing { 3e-7 } else { 0.0 };
    for ([light, view], found) in pairs.iter().zip(of_shader(device, material, &pairs)) {
        let expected = material.rho_hat(direction(*light), direction(*view));
        for channel in 0..3 {
            let (found, expected) = (f64::from(found[channel]), expected[channel]);
            assert!(
                (found - expected).abs() <= allowed(expected, s, [*light, *view]) + units,
                "{material:?}\nlight {light} view {view} channel {channel}: {found} {expected}"
            );
        }
    }
}

/// Beside the errors of [`allowed`], a device has those of its division and root (2.5 units), exponential
/// and logarithm (WGSL allows 2^-21 of the latter, times s), which are no larger.
#[cfg(feature = "gpu")]
#[test]
fn the_shader_is_the_models() {
    let Some(device) = on_device::device("the_shader_is_the_models") else { return };
    for (material, s) in materials() {
        compare(&device, &material, s);
    }
}

/// Garnet red as it was measured. Its highlight is so sharp that it lies in the first few nodes of the table,
/// where the square root of theta_h is as uncertain as the cosine with a power of 1e6.
#[cfg(feature = "gpu")]
#[test]
fn a_measured_material_of_the_corpus_is_what_its_table_says() {
    let Some(corpus) = test_data::folder("a_measured_material_of_the_corpus", "SPECULA_CORPUS") else {
        return;
    };
    let Some(device) = on_device::device("a_measured_material_of_the_corpus") else { return };
    let file = "garnet_red.brdf";
    let bytes = std::fs::read(corpus.join("brdf/measured").join(file)).unwrap();
    let measured = containers::measured::read(file, &bytes, None).unwrap();
    compare(&device, &measured, 1e6);
}

/// Ngan's fits of Ward's model to 86 measured materials: a matte layer and a highlight each.
#[cfg(feature = "gpu")]
#[test]
fn fits_of_the_corpus_are_what_the_models_say() {
    let Some(corpus) = test_data::folder("fits_of_the_corpus", "SPECULA_CORPUS") else { return };
    let Some(device) = on_device::device("fits_of_the_corpus") else { return };
    let text = std::fs::read_to_string(corpus.join("brdf/fits/ngan_ward.fit")).unwrap();
    let mut fits = 0;
    for line in text.lines().filter(|line| line.contains("NganWard")) {
        let numbers: Vec<f64> = line
            .split(|c: char| !c.is_ascii_digit() && c != '.' && c != 'e' && c != '-')
            .filter_map(|word| word.parse().ok())
            .collect();
        let [.., r, g, b, r_s, g_s, b_s, roughness] = numbers[..] else { panic!("{line}") };
        // Ours begins at 0.01.
        let roughness = roughness.clamp(0.01, 1.0);
        let matte = Material::Lambert(Lambert::new([r, g, b]).unwrap());
        let highlight = Material::Ward(Ward::new([roughness; 2], [r_s, g_s, b_s]).unwrap());
        compare(&device, &Material::layers(vec![matte, highlight]).unwrap(), roughness.powi(-2));
        fits += 1;
    }
    assert_eq!(fits, 86);
}
