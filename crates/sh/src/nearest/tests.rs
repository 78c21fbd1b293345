use super::*;
use crate::quadrature::gauss_legendre;
use crate::testkit::Noise;
use crate::{Degree, minimum, non_negative, zonal_into};
use sphere::{Direction, LatLong};

fn nearest_to(f: &Expansion, mean: Mean) -> Result<Nearest, NearestError> {
    nearest_non_negative(f, mean, Stop::NEVER)
}

/// max(axis . w, 0)^exponent cut at a degree, about an axis that no grid favours.
fn phong(exponent: i32, degree: usize) -> Expansion {
    let (theta, weights) = gauss_legendre(400);
    let mut u = vec![0.0; degree + 1];
    let mut y = u.clone();
    for (theta, weight) in theta.iter().zip(&weights) {
        // The upper half of z, where the integrand is smooth.
        let z = (theta.cos() + 1.0) / 2.0;
        zonal_into(z, &mut y);
        u.iter_mut().zip(&y).for_each(|(u, y)| *u += PI * weight * z.powi(exponent) * y);
    }
    Expansion::zonal(Direction::from_angles(0.8, 0.3), Degree::new(degree).unwrap(), |l| {
        [u[l], 2.0 * u[l], 0.0]
    })
}

/// Noise with a mean that leaves every channel some mass.
fn noise(degree: usize, seed: u64) -> Expansion {
    let mut noise = Noise::new(seed);
    let mut f = Expansion::zero(Degree::new(degree).unwrap());
    f.coefficients_mut().as_flattened_mut().iter_mut().for_each(|value| *value = noise.next());
    f.coefficients_mut()[0] = f.get(0, 0).map(|mean| mean.abs() + 0.1);
    f
}

/// The root of the integral of f^2 in one channel.
fn norm(expansion: &Expansion, channel: usize) -> f64 {
    expansion.coefficients().iter().map(|rgb| rgb[channel].powi(2)).sum::<f64>().sqrt()
}

/// The root of the integral of (a - b)^2, channels together.
fn distance(a: &Expansion, b: &Expansion) -> f64 {
    product(a, b, a, b).sqrt()
}

/// The integral of (a - b) (c - d), channels together.
fn product(a: &Expansion, b: &Expansion, c: &Expansion, d: &Expansion) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|f| f.coefficients().as_flattened());
    (0..a.len()).map(|i| (a[i] - b[i]) * (c[i] - d[i])).sum()
}

/// The figures of an offset and of the least window are for comparison.
#[test]
fn lobes_change_far_less_than_by_an_offset_or_a_window() {
    for (exponent, degree, nearest, offset, window) in
        [(10, 7, 0.0303, 0.11, 0.84), (20, 12, 0.0107, 0.018, 0.91), (64, 12, 0.211, 0.66, 0.97)]
    {
        let f = phong(exponent, degree);
        let found = nearest_to(&f, Mean::Free).unwrap();
        let name = format!("Phong {exponent}, degree {degree}");
        assert!((found.change / nearest - 1.0).abs() < 0.01, "{name}: {}", found.change);
        let [below, size] = [-found.before.value / y_00(), norm(&f, found.before.channel)];
        assert!((below / size / offset - 1.0).abs() < 0.1, "{name}: offset {}", below / size);
        let windowed = distance(&non_negative(&f).unwrap().expansion, &f) / norm(&f, 0).hypot(norm(&f, 1));
        assert!((windowed - window).abs() < 0.01, "{name}: window {windowed}");
        assert!(found.lifted <= 1e-6 && found.after.value >= 0.0, "{name}: {found:?}");
        assert!(minimum(&found.expansion).value >= 0.0, "{name}");
        assert_eq!(norm(&found.expansion, 2), 0.0, "black stays black");
    }
}

/// On a grid of eight times as many rows as the search has, and from there downhill by ever shorter steps.
#[test]
fn no_valley_is_missed() {
    for degree in [2, 3, 4, 7, 12] {
        let order = Degree::new(degree).unwrap();
        let (grid, basis) = (LatLong::with_rows(24 * (degree + 1)), Basis::new(order));
        let synthesis = crate::Synthesis::new(grid, order).unwrap();
        let given = (0..6).map(|seed| noise(degree, seed)).chain([phong(10, degree), phong(64, degree)]);
        for (case, given) in given.enumerate() {
            let found = nearest_to(&given, Mean::Free).unwrap();
            let pixels: Vec<[f64; 3]> = synthesis.synthesise(&found.expansion);
            for channel in 0..3 {
                let largest = pixels.iter().map(|pixel| pixel[channel]).fold(0.0, f64::max);
                let mut order: Vec<usize> = (0..pixels.len()).collect();
                order.sort_by(|a, b| pixels[*a][channel].total_cmp(&pixels[*b][channel]));
                for &start in order.iter().step_by(9).take(80) {
                    let mut place = grid.direction(start / grid.width, start % grid.width);
                    let (mut least, mut step) = (pixels[start][channel], PI / grid.height as f64);
                    while step > 1e-5 {
                        let (u, v) = place.vector().any_orthonormal_pair();
                        let around = (0..6).map(|k| {
                            let (sine, cosine) = (f64::from(k) * PI / 3.0).sin_cos();
                            let other =
                                Direction::normalised(place.vector() + (u * cosine + v * sine) * step);
                            (basis.evaluate(&found.expansion, other)[channel], other)
                        });
                        let (value, other) = around.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
                        if value < least {
                            (least, place) = (value, other);
                        } else {
                            step /= 2.0;
                        }
                    }
                    assert!(least >= -1e-8 * largest, "degree {degree}, {case}: {:e}", least / largest);
                }
            }
        }
    }
}

/// g is the projection of f onto the convex cone of the non-negative functions: the integral of (f - g) (h -
/// g) is 0 or less for every h of the cone, and that of (f - g) g is 0.
#[test]
fn no_other_non_negative_function_is_nearer() {
    for degree in [1, 2, 5, 8] {
        let zero = Expansion::zero(Degree::new(degree).unwrap());
        for seed in 0..4 {
            let f = noise(degree, seed);
            let found = nearest_to(&f, Mean::Free).unwrap();
            let g = &found.expansion;
            let size = product(&f, &zero, &f, &zero);
            assert!(found.lifted <= 1e-6 && found.after.value >= 0.0, "{found:?}");
            let along = product(&f, g, g, &zero);
            assert!(along.abs() < 1e-5 * size, "{degree} {seed}: {along:e}");
            for other in 10..20 {
                let h = nearest_to(&noise(degree, other), Mean::Free).unwrap().expansion;
                let toward = product(&f, g, &h, g);
                assert!(toward < 1e-5 * size, "{degree} {seed}, toward {other}: {toward:e}");
            }
        }
    }
}

/// Hildreth 1957 with one inequality for each pixel. It may go below zero between pixels, by at most F (F +
/// 1) / 2 (0.71 pi / 64)^2 = 1.2 % of the largest value: it is nearer than g, but hardly.
#[test]
fn another_method_on_many_directions_is_hardly_nearer() {
    let degree = Degree::new(4).unwrap();
    let grid = LatLong::with_rows(64);
    let basis = Basis::new(degree);
    let normals: Vec<Vec<f64>> = (0..grid.len())
        .map(|pixel| {
            let mut rows = vec![0.0; degree.rows()];
            basis.evaluate_into(grid.direction(pixel / grid.width, pixel % grid.width), &mut rows);
            rows
        })
        .collect();
    let f = noise(4, 7);
    let found = nearest_to(&f, Mean::Free).unwrap();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut reached = f.clone();
    for channel in 0..3 {
        let mut g: Vec<f64> = f.coefficients().iter().map(|rgb| rgb[channel]).collect();
        let mut weights = vec![0.0; normals.len()];
        for _ in 0..2000 {
            for (k, normal) in weights.iter_mut().zip(&normals) {
                let change = (-dot(normal, &g) / dot(normal, normal)).max(-*k);
                if change != 0.0 {
                    *k += change;
                    g.iter_mut().zip(normal).for_each(|(g, y)| *g += change * y);
                }
            }
        }
        reached.coefficients_mut().iter_mut().zip(g).for_each(|(rgb, g)| rgb[channel] = g);
    }
    let [ours, theirs] = [&found.expansion, &reached].map(|g| distance(g, &f));
    assert!(theirs < ours * (1.0 + 1e-6) && ours < 1.01 * theirs, "{ours} {theirs}");
    assert!(distance(&found.expansion, &reached) < 0.1 * ours);
}

#[test]
fn the_mean_can_be_kept() {
    for (exponent, degree) in [(10, 7), (20, 12)] {
        let f = phong(exponent, degree);
        let [free, kept] = [Mean::Free, Mean::Kept].map(|mean| nearest_to(&f, mean).unwrap());
        assert_eq!(kept.expansion.get(0, 0), f.get(0, 0));
        assert!(free.expansion.get(0, 0)[0] > f.get(0, 0)[0], "a free mean rises");
        assert!(kept.after.value >= 0.0 && kept.lifted <= 1e-6, "{kept:?}");
        // A window keeps the mean too.
        let windowed = distance(&non_negative(&f).unwrap().expansion, &f);
        assert!(free.change < kept.change && distance(&kept.expansion, &f) < 0.1 * windowed);
    }
    let found = nearest_to(&noise_with_mean(6), Mean::Kept).unwrap();
    assert!(found.after.value >= 0.0, "{found:?}");
}

fn noise_with_mean(degree: usize) -> Expansion {
    let mut f = noise(degree, 3);
    f.coefficients_mut()[0] = [2.0, 1.0, 0.1];
    f
}

#[test]
fn a_function_that_is_not_negative_is_left_alone() {
    let mut f = Expansion::zero(Degree::new(3).unwrap());
    assert_eq!(nearest_to(&f, Mean::Kept).unwrap().expansion, f, "black");
    f.coefficients_mut()[0] = [1.0; 3];
    f.coefficients_mut()[5] = [0.2; 3];
    let found = nearest_to(&f, Mean::Free).unwrap();
    assert_eq!((found.change, &found.expansion), (0.0, &f));
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let f = noise(6, 1);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| nearest_to(&f, Mean::Free).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn functions_without_a_useful_neighbour_are_errors() {
    let mut f = noise(2, 1);
    f.coefficients_mut()[5][1] = f64::NAN;
    let error = nearest_to(&f, Mean::Free).unwrap_err();
    assert!(matches!(error, NearestError::NotFinite { l: 2, m: -1, channel: 1 }), "{error}");
    // Nothing is positive; and what is positive is too little for any function of this degree.
    for bump in [0.0, 0.85] {
        let mut f = Expansion::zonal(Direction::X, Degree::new(2).unwrap(), |l| {
            [f64::from(u8::from(l == 2)) * bump; 3]
        });
        f.coefficients_mut()[0] = [-1.0 / (2.0 * y_00()); 3];
        let largest = f.evaluate(Direction::X)[0];
        assert_eq!(largest > 0.0, bump > 0.0, "{largest}");
        assert_eq!(nearest_to(&f, Mean::Free), Err(NearestError::NoMass { channel: 0 }));
    }
    let mut f = phong(10, 7);
    f.coefficients_mut()[0] = [-0.1, 0.1, 0.0];
    assert!(nearest_to(&f, Mean::Free).is_ok(), "its positive part has mass");
    let error = nearest_to(&f, Mean::Kept).unwrap_err();
    assert!(matches!(error, NearestError::NoPositiveMean { channel: 0, .. }), "{error}");
    assert_eq!(nearest_non_negative(&f, Mean::Free, Stop::when(&|| true)), Err(Stopped.into()));
}
