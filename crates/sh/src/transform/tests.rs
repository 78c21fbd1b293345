use sphere::{DVec3, LatLong};

use super::sums::{Evaluate, ODD, PARTS, Project, Rows};
use super::*;
use crate::f64x4::SimdLevel;
use crate::legendre::LegendreRecurrence;
use crate::quadrature;
use crate::vector::{F64x8, LANES};
use test_data::reference;

use crate::testkit::{Noise, harmonics, legendre, relative_error};

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

fn lat_long(width: usize, height: usize) -> Grid {
    LatLong { width, height }.into()
}

fn gauss(width: usize, height: usize) -> Grid {
    GaussGrid::new(width, height).into()
}

/// Analysis after synthesis, relative to the largest coefficient.
///
/// The recurrence carries R_k = P_(l+1) / x, which near the equator is up to l times P_l: an error of l eps,
/// that is 511 * 2.2e-16 = 1.1e-13 each way at degree 511 and 4.5e-13 at 2048.
fn round_trip(grid: Grid, l: usize) {
    round_trip_within(grid, l, 1e-12);
}

fn round_trip_within(grid: Grid, l: usize, tolerance: f64) {
    let name = format!("{}x{} degree {l}", grid.width(), grid.height());
    let transform = Transform::new(grid, degree(l)).unwrap();
    let expected = Noise::new(l as u64 + 1).expansion(l);
    let pixels: Vec<[f64; 3]> = transform.synthesise(&expected);
    let error = relative_error(transform.analyse(&pixels).coefficients(), expected.coefficients());
    println!("{name}: {error:.1e}");
    assert!(error < tolerance, "{name}: {error:e}");
}

#[test]
fn analysis_after_synthesis_is_the_identity_on_1024_by_512() {
    for l in [0, 1, 2, 3, 30, 127, 128, 255, 256, 510, 511] {
        round_trip(lat_long(1024, 512), l);
    }
}

#[test]
fn analysis_after_synthesis_is_the_identity_on_odd_and_small_grids() {
    for (width, height, degrees) in [
        (1, 1, &[0usize] as &[_]),
        (2, 1, &[0]),
        (3, 2, &[0, 1]),
        (5, 3, &[0, 1, 2]),
        (7, 4, &[1, 2, 3]),
        (11, 9, &[3, 4, 5]),
        (9, 40, &[3, 4]),
        (17, 8, &[3, 4, 7]),
        (65, 33, &[15, 16, 17, 31, 32]),
        (64, 32, &[15, 16, 30, 31]),
        (102, 51, &[24, 25, 26, 49, 50]),
        (254, 127, &[62, 63, 64, 126]),
        (515, 257, &[127, 128, 129, 255, 256]),
        (1021, 509, &[254, 255, 508]),
    ] {
        for &l in degrees {
            round_trip(lat_long(width, height), l);
        }
    }
}

#[test]
fn analysis_after_synthesis_is_the_identity_on_gauss_grids() {
    for (width, height, l) in
        [(1, 1, 0), (3, 2, 1), (5, 3, 2), (61, 31, 30), (64, 40, 31), (511, 256, 255), (1024, 512, 511)]
    {
        round_trip(gauss(width, height), l);
    }
}

#[test]
fn degree_2048_is_the_identity_on_4100_by_2050() {
    round_trip_within(lat_long(4100, 2050), 2048, 4e-12);
}

#[test]
fn synthesis_is_the_direct_sum() {
    for (grid, l) in [
        (lat_long(30, 16), 12),
        (lat_long(31, 17), 15),
        (lat_long(96, 41), 40),
        (gauss(29, 15), 14),
        // Coarser than the expansion: values are still those of the function.
        (lat_long(8, 4), 21),
        (lat_long(5, 3), 17),
        (lat_long(1, 1), 6),
    ] {
        let synthesis = Synthesis::new(grid.clone(), degree(l)).unwrap();
        let expansion = Noise::new(7).expansion(l);
        let pixels: Vec<[f64; 3]> = synthesis.synthesise(&expansion);
        let mut direct = Vec::new();
        for row in 0..grid.height() {
            for column in 0..grid.width() {
                let direction = grid.direction(row, column);
                let y = harmonics(l, direction.theta(), direction.phi());
                let mut sum = [0.0; 3];
                for (y, row) in y.iter().zip(expansion.coefficients()) {
                    (0..3).for_each(|channel| sum[channel] += y * row[channel]);
                }
                direct.push(sum);
            }
        }
        // (degree + 1)^2 terms of size one against a sum of about degree: 1e-13 leaves a factor of ten.
        let error = relative_error(&pixels, &direct);
        assert!(error < 1e-13, "{}x{} degree {l}: {error:e}", grid.width(), grid.height());
    }
}

#[test]
fn analysis_is_the_direct_quadrature() {
    for (grid, l) in [(lat_long(30, 16), 7), (lat_long(31, 33), 15), (lat_long(40, 41), 19)] {
        let weights = quadrature::fejer(grid.height());
        let mut noise = Noise::new(3);
        let pixels: Vec<[f64; 3]> = (0..grid.len()).map(|_| noise.rgb()).collect();
        let mut direct = vec![[0.0; 3]; degree(l).rows()];
        for (index, pixel) in pixels.iter().enumerate() {
            let (row, column) = (index / grid.width(), index % grid.width());
            let direction = grid.direction(row, column);
            let weight = weights[row] * std::f64::consts::TAU / grid.width() as f64;
            for (sum, y) in direct.iter_mut().zip(harmonics(l, direction.theta(), direction.phi())) {
                (0..3).for_each(|channel| sum[channel] += weight * y * pixel[channel]);
            }
        }
        let transform = Transform::new(grid, degree(l)).unwrap();
        // Noise leaves coefficients ten times smaller than the sums of their terms' sizes.
        let error = relative_error(transform.analyse(&pixels).coefficients(), &direct);
        assert!(error < 1e-13, "degree {l}: {error:e}");
    }
}

#[test]
fn the_conventions_are_those_of_the_basis() {
    let grid = LatLong { width: 26, height: 13 };
    let expansion = Noise::new(11).expansion(12);
    let synthesis = Synthesis::new(grid, degree(12)).unwrap();
    let pixels: Vec<[f64; 3]> = synthesis.synthesise(&expansion);
    let x: [f64; 3] = expansion.coefficients()[3];
    // l = 1, m = 1 is 0.488603 x: brightest at the image's centre column.
    let mut only_x = Expansion::zero(degree(1));
    only_x.coefficients_mut()[3] = x.map(f64::abs);
    let image: Vec<[f64; 3]> = Synthesis::new(grid, degree(1)).unwrap().synthesise(&only_x);
    let expected = 0.488_602_511_902_919_9 * grid.direction(6, 13).vector().x * x[0].abs();
    assert!((image[6 * 26 + 13][0] - expected).abs() < 1e-14);
    let direct = expansion.evaluate(grid.direction(4, 9));
    assert!((0..3).all(|channel| (pixels[4 * 26 + 9][channel] - direct[channel]).abs() < 1e-12));
}

#[test]
fn analysis_is_the_adjoint_of_synthesis_under_the_weights_of_the_rows() {
    // sum over pixels of w f synthesis(a) = sum over rows of analysis(f) a, with Fejér's or Gauss' weights.
    let fejer = quadrature::fejer(33);
    let (_, gauss_weights) = quadrature::gauss_legendre(20);
    for (grid, l, weights) in [(lat_long(40, 33), 16, fejer), (gauss(41, 20), 19, gauss_weights)] {
        let (width, height) = (grid.width(), grid.height());
        let transform = Transform::new(grid, degree(l)).unwrap();
        let mut noise = Noise::new(5);
        let f: Vec<[f64; 3]> = (0..width * height).map(|_| noise.rgb()).collect();
        let a = noise.expansion(l);
        let image: Vec<[f64; 3]> = transform.synthesise(&a);
        let coefficients = transform.analyse(&f);
        let (mut left, mut right) = (0.0, 0.0);
        for (index, (f, image)) in f.iter().zip(&image).enumerate() {
            let weight = weights[index / width] * std::f64::consts::TAU / width as f64;
            left += weight * (f[0] * image[0] + f[1] * image[1] + f[2] * image[2]);
        }
        for (x, y) in coefficients.coefficients().iter().zip(a.coefficients()) {
            right += x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
        }
        // Some 1e3 terms of size one.
        assert!((left - right).abs() < 1e-12, "{left} {right}");
    }
}

#[test]
fn past_half_of_the_rows_the_series_of_each_column_is_integrated() {
    // The oracle: the sine or cosine series through a column's H values, k = 0 ..= H, on Gauss rows.
    for (width, height, l) in [(23, 12, 11), (24, 13, 9)] {
        let grid = LatLong { width, height };
        let mut noise = Noise::new(6);
        let pixels: Vec<[f64; 3]> = (0..grid.len()).map(|_| noise.rgb()).collect();
        let (theta, weights) = quadrature::gauss_legendre(2 * height);
        let mut direct = vec![[0.0; 3]; degree(l).rows()];
        for m in 0..=l {
            let wave = |angle: f64| if m % 2 == 0 { angle.cos() } else { angle.sin() };
            for (sign, turn) in [(1, f64::cos as fn(f64) -> f64), (-1, f64::sin)] {
                if m == 0 && sign < 0 {
                    continue;
                }
                for channel in 0..3 {
                    let column = |row: usize| -> f64 {
                        let pixel = |c: usize| pixels[row * width + c][channel];
                        (0..width).map(|c| pixel(c) * turn(m as f64 * grid.phi(c))).sum::<f64>()
                            * std::f64::consts::TAU
                            / width as f64
                    };
                    let column: Vec<f64> = (0..height).map(column).collect();
                    let series: Vec<f64> = (0..=height)
                        .map(|k| {
                            let norm = if k % height == 0 { 1.0 } else { 2.0 } / height as f64;
                            (0..height).map(|j| norm * column[j] * wave(k as f64 * grid.theta(j))).sum()
                        })
                        .collect();
                    for (theta, weight) in theta.iter().zip(&weights) {
                        let value: f64 = (0..=height).map(|k| series[k] * wave(k as f64 * theta)).sum();
                        for (other, p) in (m..).zip(legendre(m, l, *theta)) {
                            let row = (other * other + other).wrapping_add_signed(sign * m as isize);
                            direct[row][channel] += weight * value * p;
                        }
                    }
                }
            }
        }
        let found = Transform::new(grid, degree(l)).unwrap().analyse(&pixels);
        // Some 1e3 terms of size one make coefficients of size one.
        let error = relative_error(found.coefficients(), &direct);
        assert!(error < 1e-12, "{width}x{height} degree {l}: {error:e}");
    }
}

#[test]
fn results_are_bit_identical_for_any_number_of_threads() {
    for (grid, l) in [(lat_long(130, 65), 64), (lat_long(256, 128), 30), (gauss(129, 65), 64)] {
        let mut noise = Noise::new(9);
        let image: Vec<[f32; 3]> = (0..grid.len()).map(|_| noise.rgb().map(|v| v as f32)).collect();
        let results = [1, 2, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let transform = Transform::new(grid.clone(), degree(l)).unwrap();
                let coefficients = transform.analyse(&image);
                // The second use works in memory that the first one left.
                assert_eq!(coefficients, transform.analyse(&image));
                let pixels: Vec<[f32; 3]> = transform.synthesise(&coefficients);
                assert_eq!(pixels, transform.synthesise::<f32>(&coefficients));
                (coefficients, pixels)
            })
        });
        assert!(results[0] == results[1] && results[0] == results[2]);
    }
}

/// The levels of this machine.
fn levels() -> Vec<SimdLevel> {
    let mut levels = vec![SimdLevel::detect(), SimdLevel::Portable];
    #[cfg(target_arch = "x86_64")]
    levels.extend(pulp::x86::V3::try_new().map(SimdLevel::V3));
    levels
}

#[test]
fn every_level_gives_the_same_transform_to_the_last_bit() {
    fn results<T: Sample + PartialEq>(
        level: SimdLevel,
        grid: Grid,
        f: &Expansion,
    ) -> (Expansion, Vec<[T; 3]>) {
        let transform = Transform::at_level(level, grid, f.degree()).unwrap();
        let pixels: Vec<[T; 3]> = transform.synthesise(f);
        (transform.analyse(&pixels), pixels)
    }
    // Weights and rows resampled; a width with a large prime factor; rows split.
    for (width, height, l) in [(258, 129, 128), (128, 128, 30), (134, 65, 40), (134, 65, 64), (120, 70, 5)] {
        let (grid, f) = (lat_long(width, height), Noise::new(13).expansion(l));
        let expected = results::<f64>(SimdLevel::Portable, grid.clone(), &f);
        let expected_single = results::<f32>(SimdLevel::Portable, grid.clone(), &f);
        for level in levels() {
            let name = format!("{width}x{height} degree {l} {level:?}");
            assert!(results(level, grid.clone(), &f) == expected, "{name}");
            assert!(results(level, grid.clone(), &f) == expected_single, "{name}");
        }
    }
}

/// Pixels in single precision make an error of 1e-6 of the largest value at most, whatever the image: noise,
/// or a sun of a few pixels that is 1e4 times as bright as the mean.
#[test]
fn single_precision_errs_by_a_millionth_of_the_largest_value() {
    let mut worst = [0.0f64; 2];
    for (width, height, degrees) in [
        (1024, 512, &[0usize, 2, 30, 127, 255, 511] as &[_]),
        (1021, 509, &[30, 254, 508]),
        (1000, 500, &[30, 249, 499]),
        (134, 67, &[30, 66]),
    ] {
        let mut noise = Noise::new(21);
        let noisy: Vec<[f32; 3]> = (0..width * height).map(|_| noise.rgb().map(|v| v.abs() as f32)).collect();
        // At the pole, in mid-latitudes and on the equator, where lambda is largest beside P_lm.
        let suns = [0, height / 4, height / 2].map(|row| {
            let mut pixels = noisy.clone();
            for (row, column) in [(row, 77), (row, 78), (row + 1, 77)] {
                pixels[row * width + column] = [1e4, 0.7e4, 0.4e4];
            }
            pixels
        });
        for &l in degrees {
            let transform = Transform::new(lat_long(width, height), degree(l)).unwrap();
            for pixels in suns.iter().chain([&noisy]) {
                let doubles: Vec<_> = pixels.iter().map(|pixel| pixel.map(f64::from)).collect();
                let expected = transform.analyse(&doubles);
                let found = transform.analyse(pixels);
                let error = relative_error(found.coefficients(), expected.coefficients());
                let image: Vec<[f64; 3]> = transform.synthesise(&expected);
                let single: Vec<[f32; 3]> = transform.synthesise(&expected);
                let single: Vec<_> = single.iter().map(|pixel| pixel.map(f64::from)).collect();
                let error_of_image = relative_error(&single, &image);
                worst = [worst[0].max(error), worst[1].max(error_of_image)];
                println!("{width}x{height} degree {l}: {error:.1e} {error_of_image:.1e}");
                assert!(error < 1e-6 && error_of_image < 1e-6, "{width}x{height} degree {l}");
            }
        }
    }
    println!("largest errors of coefficients and of pixels: {:.1e} {:.1e}", worst[0], worst[1]);
}

#[test]
fn an_expansion_of_lower_degree_is_the_same_function() {
    let transform = Transform::new(lat_long(64, 32), degree(30)).unwrap();
    let low = Noise::new(15).expansion(8);
    let image: Vec<[f64; 3]> = transform.synthesise(&low);
    let padded: Vec<[f64; 3]> = transform.synthesise(&low.to_degree(degree(30)));
    assert_eq!(image, padded);
}

#[test]
fn too_coarse_grids_are_errors() {
    let error = |width, height, l| Transform::new(LatLong { width, height }, degree(l)).err().unwrap();
    assert_eq!(error(60, 31, 30), TransformError::TooFewColumns { columns: 60, degree: 30 });
    assert_eq!(error(61, 30, 30), TransformError::TooFewRows { rows: 30, degree: 30 });
    assert_eq!(error(0, 30, 0), TransformError::Empty { columns: 0, rows: 30 });
    assert_eq!(error(8, 0, 0), TransformError::Empty { columns: 8, rows: 0 });
    assert_eq!(error(60, 31, 30).to_string(), "60 columns are too few for degree 30: at least 61 are needed");
    assert_eq!(error(61, 30, 30).to_string(), "30 rows are too few for degree 30: at least 31 are needed");
    assert!(Transform::new(LatLong { width: 61, height: 31 }, degree(30)).is_ok());
}

#[test]
fn legendre_functions_of_degree_2048_are_finite_and_orthonormal() {
    let l_max = 2048;
    let (theta, weights) = quadrature::gauss_legendre(l_max + 1);
    let northern = (l_max + 1).div_ceil(2);
    let rows: Vec<(f64, f64)> = theta[..northern].iter().map(|theta| (theta.cos(), theta.sin())).collect();
    let rows = Rows::new(&rows, l_max);
    let mut recurrence = LegendreRecurrence::default();
    for (m, l) in [
        (0, 0),
        (0, 2048),
        (0, 2047),
        (1, 1024),
        (2, 2048),
        (37, 1000),
        (700, 700),
        (1500, 1999),
        (2040, 2047),
        (2048, 2048),
    ] {
        recurrence.prepare(m, l_max);
        let steps = recurrence.steps().len();
        // One l, in the first part of its parity.
        let mut terms = vec![[0.0; PARTS]; steps];
        let k = (l - m) / 2;
        if (l - m) % 2 == 0 {
            terms[k][0] = recurrence.even(k);
            if k > 0 {
                terms[k - 1][0] = recurrence.even_after(k - 1);
            }
        } else {
            terms[k][ODD] = recurrence.odd(k);
        }
        let mut columns = vec![[F64x8::ZERO; PARTS]; rows.groups()];
        let level = SimdLevel::detect();
        level.run_wide(Evaluate {
            rows: &rows,
            recurrence: &recurrence,
            degree: l_max,
            terms: &terms,
            columns: &mut columns,
        });
        assert!(columns.iter().flatten().all(|lane| lane.0.iter().all(|value| value.is_finite())));
        let part = ODD * ((l - m) % 2);
        for row in [0, 1, 5, 300, northern - 1] {
            let value = columns[row / LANES][part].0[row % LANES];
            let expected = legendre(m, l, theta[row])[l - m];
            // The oracle's own sum of logarithms errs by 2048 * eps * 10; values reach 10.
            assert!((value - expected).abs() < 2e-11, "P_{l},{m} of row {row}: {value} {expected}");
        }

        // integral of P_l P_l' sin(theta) for every l' of this parity: 1 / pi for m > 0, 1 / (2 pi) for m =
        // 0. A northern row counts twice; the odd part meets x lambda.
        let odd = part > 0;
        for row in 0..rows.groups() * LANES {
            let (group, lane) = (row / LANES, row % LANES);
            let both = if 2 * row + 1 == theta.len() { 1.0 } else { 2.0 };
            let weight = if row < northern { both * weights[row] } else { 0.0 };
            let x = if odd { rows.cosine[group].0[lane] } else { 1.0 };
            columns[group][part].0[lane] *= weight * x;
        }
        let mut scratch = [(); 2].map(|()| vec![F64x8::ZERO; rows.groups()]);
        let [current, previous] = &mut scratch;
        let mut sums = vec![[F64x8::ZERO; PARTS]; steps];
        level.run_wide(Project {
            rows: &rows,
            recurrence: &recurrence,
            degree: l_max,
            columns: &columns,
            current,
            previous,
            sums: &mut sums,
        });
        let norm = if m == 0 { std::f64::consts::TAU } else { std::f64::consts::PI };
        let total = |k: usize| sums[k][part].0.iter().sum::<f64>();
        for k2 in 0..steps {
            let other = m + 2 * k2 + usize::from(odd);
            if other > l_max {
                continue;
            }
            let earlier = if k2 > 0 { recurrence.even_after(k2 - 1) * total(k2 - 1) } else { 0.0 };
            let product = match odd {
                false => recurrence.even(k2) * total(k2) + earlier,
                true => recurrence.odd(k2) * total(k2),
            };
            let expected = if other == l { 1.0 } else { 0.0 };
            assert!((product * norm - expected).abs() < 1e-11, "<P_{l},{m}, P_{other},{m}>: {product}");
        }
    }
}

#[test]
fn the_reference_lighting_projects_to_its_coefficients() {
    let Some(lighting) = reference("the_reference_lighting_projects_to_its_coefficients", "lighting.json")
    else {
        return;
    };
    let rgb = |value: &serde_json::Value| -> [f64; 3] { std::array::from_fn(|i| value[i].as_f64().unwrap()) };
    let constant = rgb(&lighting["constant"]);
    let lobes: Vec<(DVec3, f64, [f64; 3])> = lighting["lobes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|lobe| {
            let direction = DVec3::from_array(rgb(&lobe["direction"]));
            (direction, lobe["sharpness"].as_f64().unwrap(), rgb(&lobe["amplitude"]))
        })
        .collect();
    let grid = LatLong { width: 1024, height: 512 };
    let mut pixels = Vec::new();
    for row in 0..grid.height {
        for column in 0..grid.width {
            let w = grid.direction(row, column).vector();
            let mut radiance = constant;
            for (direction, sharpness, amplitude) in &lobes {
                let lobe = (sharpness * (w.dot(*direction) - 1.0)).exp();
                (0..3).for_each(|channel| radiance[channel] += amplitude[channel] * lobe);
            }
            pixels.push(radiance.map(|value| value as f32));
        }
    }
    let expected: Vec<[f64; 3]> = lighting["sh"].as_array().unwrap().iter().map(rgb).collect();
    assert_eq!(expected.len(), 169);
    for l in [12, 30, 300] {
        let found = Transform::new(grid, degree(l)).unwrap().analyse(&pixels);
        let error = relative_error(&found.coefficients()[..169], &expected);
        println!("lighting.json at degree {l}: {error:.1e}");
        assert!(error < 2e-6, "degree {l}: {error:e}");
    }
}
