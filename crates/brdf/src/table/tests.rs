//! Properties of tables; `tests/tables.rs` compares them with reference values.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::*;
use crate::models::tests::every_model;
use crate::{Lambert, Measured, MeasuredAnisotropic, Phong, Ward, albedo};

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

fn lambert(albedo: [f64; 3]) -> Material {
    Material::Lambert(Lambert::new(albedo).unwrap())
}

fn brushed() -> Material {
    Material::Ward(Ward::new([0.2, 0.5], [1.0, 0.5, 0.25]).unwrap())
}

/// The coefficients by Gauss-Legendre in cos(theta) on each side of the horizon and equal steps in phi.
fn by_brute_force(material: &Material, view: Direction, degree: Degree) -> Vec<[f64; 3]> {
    let (nodes, weights) = sh::quadrature::gauss_legendre(160);
    let basis = Basis::new(degree);
    let mut rows = vec![0.0; degree.rows()];
    let mut sum = vec![[0.0; 3]; degree.rows()];
    let columns = 480;
    for side in [1.0, -1.0] {
        for (theta, weight) in nodes.iter().zip(&weights) {
            let z: f64 = side * (theta.cos() + 1.0) / 2.0;
            for column in 0..columns {
                let incident = Direction::from_angles(z.acos(), TAU * f64::from(column) / f64::from(columns));
                let value = material.rho_hat(incident, view);
                basis.evaluate_into(incident, &mut rows);
                for (sum, y) in sum.iter_mut().zip(&rows) {
                    let factor = y * weight / 2.0 * TAU / f64::from(columns);
                    (0..3).for_each(|channel| sum[channel] += factor * value[channel]);
                }
            }
        }
    }
    sum
}

/// The brute force has 1e-4 where a model has kinks (the matte base of oren-nayar, the two heights of
/// ashikhmin-shirley) or a highlight as narrow as its steps (the clear coat of standard), and 1e-10 and
/// less elsewhere.
#[test]
fn coefficients_are_the_integrals_for_every_model() {
    for material in every_model() {
        let views = Views::new(&material, degree(6));
        for view in [Direction::from_angles(0.3, 2.0), Direction::from_angles(1.1, -0.8)] {
            let found = views.coefficients(view).unwrap();
            let expected = by_brute_force(&material, view, degree(6));
            let size = expected.as_flattened().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
            let pairs = found.c.as_flattened().iter().zip(expected.as_flattened());
            let error = pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / size;
            assert!(error < 2e-4, "{}: {error:e}", material.name());
            if ["ward", "ggx", "microfacet", "blinn-phong"].contains(&material.name()) {
                assert!(error < 1e-8, "{}: {error:e}", material.name());
            }
            let stated = if material.name() == "poulin-fournier" { 2e-4 } else { 2e-5 };
            assert!(found.error < stated * size, "{}: {:e}", material.name(), found.error);
        }
    }
}

/// Compares with brute force, which has 1e-3 of a table's kinks itself.
fn check_measured(material: &Material, view: Direction) {
    let found = Views::new(material, degree(4)).coefficients(view).unwrap();
    let expected = by_brute_force(material, view, degree(4));
    let size = expected.as_flattened().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    let pairs = found.c.as_flattened().iter().zip(expected.as_flattened());
    let error = pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / size;
    eprintln!("{view:?}: {error:.1e}, stated {:.1e}", found.error / size);
    assert!(error < 2e-3 && found.error < 5e-3 * size, "{view:?}: {error:e} {:e}", found.error);
}

/// A table of a glossy paint: kinks between all nodes.
#[test]
fn coefficients_of_an_isotropic_measured_surface_are_the_integrals() {
    let shape @ [_, n_d, n_phi] = [30, 30, 18];
    let value = |entry: usize| {
        let place = [entry / n_phi / n_d, entry / n_phi % n_d, entry % n_phi];
        let [h, d, _] = Measured::node(shape, place);
        [(0.1 + 2.0 * (-(h.tan() / 0.2).powi(2).min(80.0)).exp() * (1.0 + d)) as f32; 3]
    };
    let values = (0..shape.iter().product()).map(value).collect();
    let material = Material::Measured(Measured::new(shape, values).unwrap());
    for theta in [0.0, 0.3, 0.8, 1.1, 1.4, 1.55] {
        check_measured(&material, Direction::from_angles(theta, 0.4));
    }
}

/// A table of a brushed metal, turned so that no mirror leaves it as it is: kinks between all nodes.
#[test]
fn coefficients_of_a_measured_surface_are_the_integrals() {
    let shape @ [_, n_phi, n_d, n_psi] = [24, 36, 16, 8];
    let value = |entry: usize| {
        let (row, m) = (entry / n_psi, entry % n_psi);
        let place = [row / n_d / n_phi, row / n_d % n_phi, row % n_d, m];
        let [h, phi, d, _] = MeasuredAnisotropic::node(shape, place);
        let slopes = h.tan().powi(2) * ((phi - 0.4).cos().powi(2) / 0.16 + (phi - 0.4).sin().powi(2) / 0.01);
        [(0.1 + 2.0 * (-slopes.min(80.0)).exp() * (1.0 + d)) as f32; 3]
    };
    let values = (0..shape.iter().product()).map(value).collect();
    let material = Material::MeasuredAnisotropic(MeasuredAnisotropic::new(shape, values).unwrap());
    assert!(!material.is_orthotropic());
    for (theta, phi) in [(0.0, 0.0), (0.3, 2.0), (1.1, -0.8), (1.4, 0.5)] {
        check_measured(&material, Direction::from_angles(theta, phi));
    }
    // Texels of all quarters have the coefficients toward their own views.
    let (table, _) = tabulate(&material, degree(2), 5, Stop::NEVER).unwrap();
    let views = Views::new(&material, degree(2));
    for (texel, values) in table.values().chunks_exact(9).enumerate() {
        let view = BrdfTable::view(5, texel / 5, texel % 5);
        let c = views.coefficients(Direction::from_angles(view.theta().min(LOWEST), view.phi())).unwrap().c;
        assert!(values.iter().zip(&c).all(|(a, b)| (f64::from(*a) - b[0]).abs() < 1e-6), "{texel}");
    }
}

/// Under a white sky of L_00 = sqrt(4 pi) a surface shows its albedo, which [`albedo`] has to 1e-3 by another
/// rule: near grazing too.
#[test]
fn the_first_row_is_the_albedo() {
    for material in every_model() {
        let views = Views::new(&material, degree(0));
        for theta in [0.0, 0.7, 1.3, 1.55] {
            let view = Direction::from_angles(theta, 0.5);
            let (found, expected) = (views.coefficients(view).unwrap().c[0], albedo(&material, view));
            for channel in 0..3 {
                let found = found[channel] * (4.0 * PI).sqrt();
                let error = (found - expected[channel]).abs() / expected[channel].max(1.0);
                assert!(error < 2e-3, "{} {theta}: {found} {expected:?}", material.name());
            }
        }
    }
}

/// The premise of [`tabulate`]: the other quarters mirror one.
#[test]
fn every_model_is_the_same_in_a_mirror() {
    for material in every_model() {
        for k in 0..50 {
            let k = f64::from(k);
            let light = Direction::from_angles((k * 0.618).fract() * 1.5, k);
            let view = Direction::from_angles((k * 0.414).fract() * 1.5, 2.3 * k);
            let value = material.rho_hat(light, view);
            for flip in [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0)] {
                let [light, view] = [light, view].map(|d| Direction::from_unit(d.vector() * flip));
                let mirrored = material.rho_hat(light, view);
                for channel in 0..3 {
                    let error = (value[channel] - mirrored[channel]).abs();
                    assert!(error <= 1e-12 * value[channel].abs(), "{}", material.name());
                }
            }
        }
    }
}

/// Each texel, also those of other quarters and those that are turned, has the coefficients toward its view.
#[test]
fn texels_have_the_coefficients_toward_their_views() {
    let isotropic = Material::Ward(Ward::new([0.3, 0.3], [1.0, 0.5, 0.25]).unwrap());
    let hair = Material::KajiyaKay(crate::KajiyaKay::new(5.0, [0.5; 3]).unwrap());
    for (material, channels) in [(brushed(), 3), (isotropic, 3), (hair, 1), (lambert([0.5; 3]), 1)] {
        let size = 7;
        let (table, _) = tabulate(&material, degree(4), size, Stop::NEVER).unwrap();
        let views = Views::new(&material, degree(4));
        assert_eq!((table.channels(), table.count(), table.texel()), (channels, 1, 25 * channels));
        for (texel, values) in table.values().chunks_exact(25 * channels).enumerate() {
            let view = BrdfTable::view(size, texel / size, texel % size);
            let view = Direction::from_angles(view.theta().min(LOWEST), view.phi());
            let c = views.coefficients(view).unwrap().c;
            for (values, c) in values.chunks_exact(channels).zip(&c) {
                let close = |channel: usize| (f64::from(values[channel]) - c[channel]).abs() < 3e-7;
                assert!((0..channels).all(close), "{} {texel}: {values:?} {c:?}", material.name());
            }
        }
    }
}

#[test]
fn a_view_from_below_is_clamped_to_the_rim_or_mirrored() {
    let degree = degree(1);
    let look = |table: &BrdfTable, view: DVec3| {
        let mut c = vec![0.0; table.texel()];
        table.lookup_into(0, Direction::normalised(view), &mut c);
        c
    };
    let (table, _) = tabulate(&brushed(), degree, 32, Stop::NEVER).unwrap();
    assert_eq!(table.below(), BelowHorizon::Clamped);
    let rim = look(&table, DVec3::new(0.6, -0.8, 0.0));
    for z in [-0.7, 1e-9] {
        let near = look(&table, DVec3::new(0.6, -0.8, z));
        assert!(near.iter().zip(&rim).all(|(a, b)| (a - b).abs() < 1e-6), "{z}");
    }
    assert!(look(&table, DVec3::NEG_Z).iter().all(|value| value.is_finite()));
    let hair = Material::KajiyaKay(crate::KajiyaKay::new(5.0, [0.5; 3]).unwrap());
    let (table, _) = tabulate(&hair, degree, 32, Stop::NEVER).unwrap();
    assert_eq!(table.below(), BelowHorizon::Mirrored);
    let [up, down] = [0.7, -0.7].map(|z| look(&table, DVec3::new(0.6, -0.8, z)));
    assert_eq!(up, down);
}

#[test]
fn layers_add_and_closed_forms_agree_with_integrals() {
    let phong = || Material::Phong(Phong::new(9.0, [0.5; 3]).unwrap());
    let view = Direction::from_angles(0.9, 1.0);
    let c = |material: &Material| Views::new(material, degree(4)).coefficients(view).unwrap().c;
    let both = Material::layers(vec![phong(), lambert([0.2, 0.4, 0.6]), brushed()]).unwrap();
    let parts = [phong(), lambert([0.2, 0.4, 0.6]), brushed()].map(|part| c(&part));
    for (row, sum) in c(&both).iter().enumerate() {
        for channel in 0..3 {
            let expected: f64 = parts.iter().map(|part| part[row][channel]).sum();
            assert!((sum[channel] - expected).abs() < 1e-7);
        }
    }
    // The square of a lobe cos^9 is one of cos^18: 2 pi peak^2 / 19.
    let peak = 0.5 * 10.0 / TAU;
    let energy = Views::new(&phong(), degree(0)).energy(view).unwrap()[0];
    assert!((energy / (TAU * peak * peak / 19.0) - 1.0).abs() < 1e-5, "{energy}");
}

#[test]
fn a_table_is_the_same_with_any_number_of_threads() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| tabulate(&brushed(), degree(3), 12, Stop::NEVER).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_table_can_be_stopped_and_must_be_finite() {
    assert_eq!(tabulate(&brushed(), degree(4), 8, Stop::when(&|| true)), Err(Stopped.into()));
    // f32::MAX times a scale of 1e6 is finite in f64: so far nothing that a file holds is not.
    let huge = Measured::new([1, 1, 1], vec![[f32::MAX; 3]]).unwrap().scaled([1e6; 3]).unwrap();
    assert!(tabulate(&Material::Measured(huge), degree(0), 2, Stop::NEVER).is_ok());
    let error = TableError::NotFinite { incident: Direction::X, view: Direction::Z };
    assert_eq!(
        error.to_string(),
        "the material has no finite value for light from theta 90.00, phi 0.00 degrees and the view theta 0.00, \
         phi 0.00 degrees, in the surface's frame"
    );
}

#[test]
fn a_table_has_the_length_of_its_shape() {
    let new = |size, channels, length| {
        BrdfTable::new(degree(1), size, channels, BelowHorizon::Clamped, vec![0.0; length])
    };
    assert_eq!(new(3, 3, 2 * 9 * 4 * 3).map(|table| table.count()), Some(2));
    for (size, channels, length) in [(3, 2, 72), (3, 1, 35), (0, 1, 4), (3, 1, 0)] {
        assert_eq!(new(size, channels, length), None);
    }
    let corner = BrdfTable::view(4, 0, 0);
    assert_eq!((corner.theta(), corner.phi()), (FRAC_PI_2, 0.75 * PI), "row 0 is at +y");
}

/// The view that is taken for one near or below the horizon is the one that the map's rim was made of.
#[test]
fn a_view_from_below_is_looked_up_above_the_horizon() {
    let near = |a: Direction, b: Direction| (a.vector() - b.vector()).length() < 1e-12;
    let (up, down) = (Direction::from_angles(0.7, -2.0), Direction::from_angles(PI - 0.7, -2.0));
    let rim = Direction::from_angles(LOWEST, -2.0);
    for (below, of_down) in [(BelowHorizon::Clamped, rim), (BelowHorizon::Mirrored, up)] {
        assert!(near(below.view(up), up) && near(below.view(down), of_down));
        assert!(near(below.view(Direction::Z), Direction::Z));
    }
}
