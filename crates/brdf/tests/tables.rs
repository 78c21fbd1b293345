//! BRDF tables against values that were integrated without the code of this project: `prt-tables.json`,
//! `prt-anisotropic.json` and `prt-energy.json`.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{AshikhminShirley, BrdfTable, KajiyaKay, Material, Phong, Views, Ward, tabulate};
use glam::{DMat3, DQuat, DVec3};
use serde_json::Value;
use sh::{Degree, Expansion, Stop, Window, rotate};
use sphere::{Direction, Rotation};

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|index| value[index].as_f64().unwrap())
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_array(numbers(value))
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// The material of a case.
fn material(case: &Value) -> Material {
    let parameter = |name: &str, default: f64| case["parameters"][name].as_f64().unwrap_or(default);
    match case["model"].as_str().unwrap() {
        "ward" => {
            let roughness = [parameter("roughness_x", f64::NAN), parameter("roughness_y", f64::NAN)];
            Material::Ward(Ward::new(roughness, [parameter("specular", 1.0); 3]).unwrap())
        }
        "ashikhmin-shirley" => {
            let exponents = [parameter("exponent_x", f64::NAN), parameter("exponent_y", f64::NAN)];
            let (diffuse, specular) = ([parameter("diffuse", 0.0); 3], [parameter("specular", 1.0); 3]);
            Material::AshikhminShirley(AshikhminShirley::new(exponents, diffuse, specular).unwrap())
        }
        "kajiya-kay" => {
            Material::KajiyaKay(KajiyaKay::new(parameter("exponent", f64::NAN), [1.0; 3]).unwrap())
        }
        other => panic!("no model {other} here"),
    }
}

/// The lighting of `lighting.json`, from its lobes: the coefficients of e^(k (x - 1)) by Gauss' rule.
fn lighting(json: &Value, degree: Degree) -> Expansion {
    let (nodes, weights) = sh::quadrature::gauss_legendre(80);
    let mut sum = Expansion::zero(degree);
    sum.coefficients_mut()[0] =
        numbers::<3>(&json["constant"]).map(|value| value * (4.0 * std::f64::consts::PI).sqrt());
    let mut row = vec![0.0; degree.get() + 1];
    for lobe in json["lobes"].as_array().unwrap() {
        let (sharpness, amplitude) = (lobe["sharpness"].as_f64().unwrap(), numbers::<3>(&lobe["amplitude"]));
        let mut u = vec![0.0; degree.get() + 1];
        for (theta, weight) in nodes.iter().zip(&weights) {
            sh::zonal_into(theta.cos(), &mut row);
            let value = std::f64::consts::TAU * weight * (sharpness * (theta.cos() - 1.0)).exp();
            u.iter_mut().zip(&row).for_each(|(u, y)| *u += value * y);
        }
        let axis = Direction::normalised(vector(&lobe["direction"]));
        let lobe = Expansion::zonal(axis, degree, |l| amplitude.map(|amplitude| amplitude * u[l]));
        for (sum, lobe) in sum.coefficients_mut().iter_mut().zip(lobe.coefficients()) {
            (0..3).for_each(|channel| sum[channel] += lobe[channel]);
        }
    }
    sum
}

/// The rotation from the world to the frame of a surface: its rows are x, y and N.
fn frame(normal: DVec3, tangent: [f64; 4], turn: f64) -> Rotation {
    let t = DVec3::new(tangent[0], tangent[1], tangent[2]);
    let b = normal.cross(t) * tangent[3];
    let x = (t * turn.to_radians().cos() + b * turn.to_radians().sin()).normalize();
    let y = normal.cross(x);
    let q = DQuat::from_mat3(&DMat3::from_cols(x, y, normal).transpose());
    Rotation::from_quaternion(q.x, q.y, q.z, q.w).unwrap()
}

fn windowed(light: &Expansion) -> Expansion {
    let mut light = light.clone();
    let degree = light.degree();
    for l in 0..=degree.get() {
        let factor = Window::Hanning.factor(l, degree);
        light.coefficients_mut()[l * l..(l + 1) * (l + 1)]
            .iter_mut()
            .for_each(|rgb| rgb.iter_mut().for_each(|value| *value *= factor));
    }
    light
}

/// [KSS02, eq. 1] over the rows of a local lighting.
fn dot(light: &Expansion, c: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (l, c) in light.coefficients().iter().zip(c) {
        (0..3).for_each(|channel| sum[channel] += l[channel] * c[channel]);
    }
    sum
}

/// The root of the mean squared difference, relative to that of the values.
#[derive(Default)]
struct Rms {
    difference: f64,
    size: f64,
}

impl Rms {
    fn add(&mut self, found: [f64; 3], expected: [f64; 3]) {
        for channel in 0..3 {
            self.difference += (found[channel] - expected[channel]).powi(2);
            self.size += expected[channel].powi(2);
        }
    }

    fn get(&self) -> f64 {
        (self.difference / self.size).sqrt()
    }
}

#[test]
fn texels_are_the_integrals() {
    let Some(reference) = test_data::reference("texels_are_the_integrals", "prt-tables.json") else { return };
    let cases = reference["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 3);
    for case in cases {
        let (table, error) = tabulate(&material(case), degree(4), 128, Stop::NEVER).unwrap();
        assert_eq!((table.channels(), table.count()), (1, 1), "grey");
        let mut worst: f64 = 0.0;
        for texel in case["texels"].as_array().unwrap() {
            let [row, column] = ["row", "column"].map(|name| texel[name].as_u64().unwrap() as usize);
            let view = BrdfTable::view(128, row, column);
            assert!((view.vector() - vector(&texel["direction"])).length() < 1e-9);
            let found = &table.values()[(row * 128 + column) * 25..][..25];
            let expected = list(&texel["c"]);
            worst =
                found.iter().zip(&expected).fold(worst, |worst, (a, b)| worst.max((f64::from(*a) - b).abs()));
            let mut looked_up = [0.0; 25];
            table.lookup_into(0, view, &mut looked_up);
            let most = looked_up.iter().zip(found).fold(0.0f32, |most, (a, b)| most.max((a - b).abs()));
            assert!(most < 1e-5, "a texel's centre shows the texel: {most:e}");
        }
        eprintln!("{}: {worst:.1e}, stated {error:.1e}", case["model"]);
        assert!(worst < 1e-6, "{worst:e}");
    }
}

#[test]
fn radiance_is_right_at_the_view_and_through_the_table() {
    const TEST: &str = "radiance_is_right_at_the_view_and_through_the_table";
    let Some(reference) = test_data::reference(TEST, "prt-anisotropic.json") else { return };
    let light = test_data::reference(TEST, "lighting.json").unwrap();
    let names = ["degree_2", "degree_4", "degree_6", "degree_14", "degree_14_hanning"];
    let degrees = [2, 4, 6, 14, 14];
    for case in reference["cases"].as_array().unwrap() {
        let material = material(case);
        let views = Views::new(&material, degree(14));
        let (table, _) = tabulate(&material, degree(14), 128, Stop::NEVER).unwrap();
        let mut errors: [[Rms; 2]; 5] = Default::default();
        let rows = case["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 12);
        for row in rows {
            let turn = row["turn"].as_f64().unwrap();
            let to_local = frame(vector(&row["normal"]), numbers(&row["tangent"]), turn);
            let view = to_local.apply(Direction::normalised(vector(&row["view"])));
            let integrated = views.coefficients(view).unwrap().c;
            let mut numbers_of = vec![0.0; table.texel()];
            table.lookup_into(0, view, &mut numbers_of);
            let looked_up: Vec<[f64; 3]> = numbers_of.iter().map(|value| [f64::from(*value); 3]).collect();
            for ((name, l), [at_view, through]) in names.iter().zip(degrees).zip(&mut errors) {
                let light = lighting(&light, degree(l));
                let light = if name.ends_with("hanning") { windowed(&light) } else { light };
                let local = rotate(&light, to_local);
                let expected = numbers(&row[*name]);
                at_view.add(dot(&local, &integrated), expected);
                through.add(dot(&local, &looked_up), expected);
            }
        }
        for (name, [at_view, through]) in names.iter().zip(&errors) {
            let [at_view, through] = [at_view.get(), through.get()];
            eprintln!("{} {name}: {at_view:.1e}, through the table {through:.1e}", case["model"]);
            assert!(at_view < 1e-5 && through < 5e-4, "{} {name}: {at_view:e} {through:e}", case["model"]);
        }
    }
}

/// The share of energy that each degree and those below it hold.
fn captured(c: &[[f64; 3]], energy: f64) -> Vec<f64> {
    let mut sum = 0.0;
    (0..15)
        .map(|l| {
            sum += c[l * l..(l + 1) * (l + 1)].iter().map(|rgb| rgb[0] * rgb[0]).sum::<f64>();
            sum / energy
        })
        .collect()
}

fn check_shares(found: &[f64], expected: &Value, what: &str) {
    for (l, (found, expected)) in found.iter().zip(list(expected)).enumerate() {
        assert!((found - expected).abs() < 1e-3, "{what}, l = {l}: {found} {expected}");
    }
}

#[test]
fn degrees_hold_the_energy_that_they_should() {
    const TEST: &str = "degrees_hold_the_energy_that_they_should";
    let Some(reference) = test_data::reference(TEST, "prt-energy.json") else { return };
    for case in reference["phong"].as_array().unwrap() {
        let exponent = case["exponent"].as_f64().unwrap();
        let phong = Material::Phong(Phong::new(exponent, [1.0; 3]).unwrap());
        let (views, view) = (Views::new(&phong, degree(14)), Direction::from_angles(0.7, 2.0));
        let shares = captured(&views.coefficients(view).unwrap().c, views.energy(view).unwrap()[0]);
        check_shares(&shares, &case["captured"], &format!("phong {exponent}"));
    }
    for case in reference["cases"].as_array().unwrap() {
        let material = material(case);
        let views = Views::new(&material, degree(14));
        for view in case["views"].as_array().unwrap() {
            let [polar, azimuth] = ["polar", "azimuth"].map(|name| view[name].as_f64().unwrap().to_radians());
            let direction = Direction::from_angles(polar, azimuth);
            let c = views.coefficients(direction).unwrap().c;
            check_shares(&captured(&c, views.energy(direction).unwrap()[0]), &view["captured"], "a view");
        }
        let shares = brdf::captured(&material, degree(14), Stop::NEVER).unwrap();
        check_shares(&shares, &case["captured_over_views"], "over views");
    }
}

/// Degree 20 stands for the whole lighting: the file's own figures fall to 1e-5 at degree 14.
#[test]
fn a_sphere_is_as_far_off_as_the_degrees_make_it() {
    const TEST: &str = "a_sphere_is_as_far_off_as_the_degrees_make_it";
    let Some(reference) = test_data::reference(TEST, "prt-energy.json") else { return };
    let light = lighting(&test_data::reference(TEST, "lighting.json").unwrap(), degree(20));
    let (view, brush) = (vector(&reference["view"]), vector(&reference["brush"]));
    let pixels = reference["pixels"].as_u64().unwrap() as i32;
    let across = if view.x.abs() < 0.6 { DVec3::X } else { DVec3::Y };
    let across = (across - view * across.dot(view)).normalize();
    let up = view.cross(across);
    for case in reference["cases"].as_array().unwrap() {
        let material = material(case);
        let views = Views::new(&material, degree(20));
        let names = ["degree_2", "degree_4", "degree_6", "degree_8", "degree_4_hanning"];
        let degrees = [2, 4, 6, 8, 4];
        let mut errors: [Rms; 5] = Default::default();
        let mut points = 0;
        for index in 0..pixels * pixels {
            let [x, y] = [index % pixels, index / pixels]
                .map(|k| 2.0 * (f64::from(k) + 0.5) / f64::from(pixels) - 1.0);
            if x * x + y * y >= 1.0 {
                continue;
            }
            points += 1;
            let normal = across * x + up * y + view * (1.0 - x * x - y * y).sqrt();
            let tangent = (brush - normal * brush.dot(normal)).normalize();
            let to_local = frame(normal, [tangent.x, tangent.y, tangent.z, 1.0], 0.0);
            let c = views.coefficients(to_local.apply(Direction::normalised(view))).unwrap().c;
            let whole = dot(&rotate(&light, to_local), &c);
            for ((name, l), error) in names.iter().zip(degrees).zip(&mut errors) {
                let cut = light.to_degree(degree(l));
                let cut = if name.ends_with("hanning") { windowed(&cut) } else { cut };
                error.add(dot(&rotate(&cut, to_local), &c), whole);
            }
        }
        assert_eq!(points, case["sphere_points"].as_i64().unwrap());
        for (name, error) in names.iter().zip(&errors) {
            let expected = case["sphere_rms"][*name].as_f64().unwrap();
            let ratio = error.get() / expected;
            assert!((ratio - 1.0).abs() < 0.02, "{} {name}: {ratio}", case["model"]);
        }
    }
}
