//! Directions follow the density that is told for them, and that density is the function's.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

mod product;

use std::f64::consts::{PI, TAU};

use sampling::{Density, Error, LeafShape, Options, Points, Sampler, Tables, UniformShare, Warp};
use sh::{Basis, Degree};
use sphere::{DVec3, Direction};
use test_data::tensors;

const SHAPES: [LeafShape; 3] = [LeafShape::Flat, LeafShape::Bilinear, LeafShape::Exact];

fn points(seed: u32, count: usize) -> Vec<[f32; 2]> {
    let mut points = vec![[0.0; 2]; count];
    Points::Random { seed }.fill(0, &mut points);
    points
}

/// Random points, and corners of the square.
fn points_and_corners(seed: u32) -> Vec<[f32; 2]> {
    let mut all = points(seed, 20_000);
    all.extend([[0.0, 0.0], [1.0 - f32::EPSILON / 2.0; 2], [0.0, 1.0 - f32::EPSILON / 2.0]]);
    all
}

#[track_caller]
fn check_inverted(name: &str, points: &[[f32; 2]], inverted: &[[f32; 2]]) {
    for (point, back) in points.iter().zip(inverted) {
        let worst = (0..2).map(|k| (point[k] - back[k]).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-5, "{name}: {point:?} {back:?}");
    }
}

fn sampler(coefficients: &[f64], options: Options) -> Sampler {
    let degree = Degree::new(coefficients.len().isqrt() - 1).unwrap();
    Sampler::new(&Tables::new(degree), coefficients, options).unwrap()
}

fn draw(sampler: &Sampler, points: &[[f32; 2]]) -> (Vec<[f32; 3]>, Vec<f32>) {
    let (mut directions, mut densities) = (vec![[0.0; 3]; points.len()], vec![0.0; points.len()]);
    sampler.sample_into(points, &mut directions, &mut densities);
    (directions, densities)
}

/// The function itself.
struct Function<'a> {
    basis: Basis,
    coefficients: &'a [f64],
    harmonics: Vec<f64>,
}

impl<'a> Function<'a> {
    fn new(coefficients: &'a [f64]) -> Self {
        let degree = Degree::new(coefficients.len().isqrt() - 1).unwrap();
        Self { basis: Basis::new(degree), coefficients, harmonics: vec![0.0; coefficients.len()] }
    }

    fn at(&mut self, direction: [f32; 3]) -> f64 {
        let [x, y, z] = direction.map(f64::from);
        self.basis.evaluate_into(Direction::normalised(DVec3::new(x, y, z)), &mut self.harmonics);
        self.harmonics.iter().zip(self.coefficients).map(|(y, f)| y * f).sum()
    }
}

/// The vectors of the reference: a clamped cosine (ringing), a Phong lobe far too sharp for its degree, and a
/// light that is positive everywhere.
fn vectors(test: &str) -> Option<Vec<(&'static str, Vec<f64>)>> {
    let mut file = tensors(test, "sampling/masses.safetensors")?;
    let mut take = |name| (name, file.remove(&format!("{name}.coefficients")).unwrap());
    Some(vec![take("cosine"), take("phong"), take("probe")])
}

/// 1 + 0.9 z - 0.3 x, positive everywhere.
fn slope() -> Vec<f64> {
    let (constant, linear) = ((4.0 * PI).sqrt(), (4.0 * PI / 3.0).sqrt());
    vec![constant, 0.0, 0.9 * linear, -0.3 * linear]
}

fn options(density: Density, share: f32, shape: LeafShape, warp: Warp) -> Options {
    Options { density, uniform_share: UniformShare::new(share).unwrap(), shape, warp }
}

/// Every kind of sampler at least once.
fn cases(test: &str) -> Vec<(String, Vec<f64>, Options)> {
    let mut cases = Vec::new();
    let mut add = |name: &str, f: &[f64], options: Options| {
        cases.push((format!("{name} {options:?}"), f.to_vec(), options));
    };
    for shape in SHAPES {
        add("slope", &slope(), options(Density::Positive, 0.0, shape, Warp::Rows));
    }
    let Some(vectors) = vectors(test) else { return cases };
    for (name, f) in &vectors {
        for shape in SHAPES {
            add(name, f, options(Density::Positive, 0.0, shape, Warp::Rows));
            add(name, f, options(Density::Absolute, 0.2, shape, Warp::Tree));
        }
    }
    let phong = &vectors[1].1;
    add("phong", phong, options(Density::Absolute, 0.0, LeafShape::Exact, Warp::Rows));
    add("phong", phong, options(Density::Positive, 0.5, LeafShape::Exact, Warp::Rows));
    // The negative of a light: nothing but its few positive parts is sampled.
    let negative: Vec<f64> = phong.iter().map(|value| -value).collect();
    add("negative phong", &negative, Options::default());
    cases
}

/// A grid of test cells, each of whole leaves.
const ROWS: usize = 16;
const COLUMNS: usize = 32;

fn cell(direction: [f32; 3]) -> usize {
    let [x, y, z] = direction.map(f64::from);
    let row = ((1.0 - z) / 2.0 * ROWS as f64) as usize;
    let turn = y.atan2(x) / TAU;
    let column = ((turn - turn.floor()) * COLUMNS as f64) as usize;
    row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
}

/// The integral of the density over each test cell: Gauss' rule of 3 x 3 nodes in each leaf.
fn probabilities(sampler: &Sampler) -> Vec<f64> {
    let grid = sampler.grid();
    let nodes = [(0.5 - 0.15f64.sqrt(), 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + 0.15f64.sqrt(), 5.0 / 18.0)];
    let mut cells = vec![0.0; ROWS * COLUMNS];
    for row in 0..grid.rows() {
        for column in 0..grid.columns() {
            for (t, weight_t) in nodes {
                for (s, weight_s) in nodes {
                    let z = 1.0 - 2.0 * (row as f64 + t) / grid.rows() as f64;
                    let phi = TAU * (column as f64 + s) / grid.columns() as f64;
                    let direction = Direction::from_angles(z.acos(), phi).vector();
                    let direction = direction.to_array().map(|x| x as f32);
                    cells[cell(direction)] +=
                        f64::from(sampler.density(direction)) * weight_t * weight_s * grid.area();
                }
            }
        }
    }
    cells
}

/// The probability that chi^2 is this large, cells that expect less than 5 pooled.
fn p_value(counts: &[f64], expected: &[f64]) -> f64 {
    let (mut pooled, mut chi, mut cells) = ([0.0; 2], 0.0, 0);
    let mut add = |count: f64, expected: f64| {
        chi += (count - expected) * (count - expected) / expected;
        cells += 1;
    };
    for (&count, &expected) in counts.iter().zip(expected) {
        if expected < 5.0 {
            pooled[0] += count;
            pooled[1] += expected;
        } else {
            add(count, expected);
        }
    }
    if pooled[0] > 0.0 && pooled[1] < 1e-3 {
        return 0.0;
    }
    if pooled[1] > 0.0 {
        add(pooled[0], pooled[1]);
    }
    upper_incomplete_gamma(0.5 * f64::from(cells - 1), 0.5 * chi)
}

/// Q(a, x), by the series below a + 1 and Lentz's continued fraction above (Numerical Recipes 3, section
/// 6.2).
fn upper_incomplete_gamma(a: f64, x: f64) -> f64 {
    let factor = (a * x.ln() - x - ln_gamma(a)).exp();
    if x <= 0.0 {
        return 1.0;
    }
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - factor * sum;
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut h = d;
    for i in 1..100_000 {
        let an = -f64::from(i) * (f64::from(i) - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    factor * h
}

/// Stirling's series after a shift past 20.
fn ln_gamma(a: f64) -> f64 {
    let (mut x, mut product) = (a, 1.0);
    while x < 20.0 {
        product *= x;
        x += 1.0;
    }
    let series = 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3)) + 1.0 / (1260.0 * x.powi(5));
    (x - 0.5) * x.ln() - x + 0.5 * TAU.ln() + series - product.ln()
}

const DRAWS: usize = 1_000_000;

fn counts(directions: &[[f32; 3]]) -> Vec<f64> {
    let mut counts = vec![0.0; ROWS * COLUMNS];
    directions.iter().for_each(|&direction| counts[cell(direction)] += 1.0);
    counts
}

#[test]
fn incomplete_gamma_has_its_closed_forms() {
    for x in [0.1, 1.0, 5.0, 40.0f64] {
        assert!((upper_incomplete_gamma(1.0, x) - (-x).exp()).abs() < 1e-12);
        let third = (-x).exp() * (1.0 + x + 0.5 * x * x);
        assert!((upper_incomplete_gamma(3.0, x) - third).abs() < 1e-12, "{x}");
    }
    // The median of a large chi-square is near its mean less 2/3.
    assert!((upper_incomplete_gamma(500.0, 499.666_7) - 0.5).abs() < 1e-4);
}

#[test]
fn directions_follow_the_density_that_is_told() {
    let cases = cases("directions_follow_the_density_that_is_told");
    let level = 1.0 - (1.0f64 - 1e-3).powf(1.0 / cases.len() as f64);
    for (seed, (name, f, options)) in cases.iter().enumerate() {
        let sampler = sampler(f, *options);
        let (directions, densities) = draw(&sampler, &points(seed as u32, DRAWS));
        let probabilities = probabilities(&sampler);
        let sum: f64 = probabilities.iter().sum();
        assert!((sum - 1.0).abs() < 5e-5, "{name}: the density integrates to {sum}");
        let expected: Vec<f64> = probabilities.iter().map(|p| p * DRAWS as f64).collect();
        let p = p_value(&counts(&directions), &expected);
        assert!(p > level, "{name}: p = {p:e}");
        // In each cell, the mean of 1 / density is the solid angle of what can be drawn.
        let mut sums = vec![[0.0; 2]; ROWS * COLUMNS];
        for (direction, density) in directions.iter().zip(&densities) {
            let [first, second] = &mut sums[cell(*direction)];
            let weight = 1.0 / f64::from(*density);
            *first += weight;
            *second += weight * weight;
            let told = sampler.density(*direction);
            assert!((told / density - 1.0).abs() < 2e-3, "{name}: {direction:?} {density} {told}");
        }
        if options.uniform_share.get() > 0.0 || name.starts_with("slope") || name.starts_with("probe") {
            let angle = 4.0 * PI / (ROWS * COLUMNS) as f64;
            for (index, [first, second]) in sums.iter().enumerate() {
                let mean = first / DRAWS as f64;
                let deviation = ((second / DRAWS as f64 - mean * mean) / DRAWS as f64).sqrt();
                // 5.5 deviations: 4e-8 for each of some thousands of cells.
                assert!(
                    (mean - angle).abs() < 5.5 * deviation,
                    "{name}, cell {index}: {mean} {angle} {deviation}"
                );
            }
        }
    }
}

#[test]
fn wrong_densities_are_rejected() {
    let sampler = sampler(&slope(), Options::default());
    let (directions, _) = draw(&sampler, &points(1, DRAWS));
    let (counts, p) = (counts(&directions), probabilities(&sampler));
    let against = |change: &dyn Fn(usize) -> f64| {
        let changed: Vec<f64> = (0..p.len()).map(change).collect();
        let sum: f64 = changed.iter().sum();
        p_value(&counts, &changed.iter().map(|p| p / sum * DRAWS as f64).collect::<Vec<_>>())
    };
    assert!(against(&|cell| p[cell]) > 1e-3);
    assert!(against(&|cell| p[cell] * if cell % 2 == 0 { 1.02 } else { 0.98 }) < 1e-6);
    let mirrored =
        |cell: usize| cell / COLUMNS * COLUMNS + (COLUMNS / 4 + COLUMNS - cell % COLUMNS) % COLUMNS;
    assert!(against(&|cell| p[mirrored(cell)]) < 1e-6);
    assert!(against(&|cell| if cell == 5 * COLUMNS { 0.0 } else { p[cell] }) < 1e-6);
}

#[test]
fn inversion_returns_the_point() {
    for (seed, (name, f, options)) in cases("inversion_returns_the_point").iter().enumerate() {
        let sampler = sampler(f, *options);
        let all = points_and_corners(seed as u32);
        let (directions, _) = draw(&sampler, &all);
        let mut inverted = vec![[0.0; 2]; all.len()];
        sampler.invert_into(&directions, &mut inverted);
        check_inverted(name, &all, &inverted);
    }
}

/// The relative variance of f / density, at 64 rows of leaves.
#[test]
fn shapes_differ_in_variance_as_documented() {
    let Some(vectors) = vectors("shapes_differ_in_variance_as_documented") else { return };
    let probe = &vectors[2].1;
    let mut f = Function::new(probe);
    for (shape, expected) in SHAPES.into_iter().zip([8e-4, 2e-5, 0.0]) {
        let sampler = sampler(probe, options(Density::Positive, 0.0, shape, Warp::Rows));
        assert_eq!(sampler.grid().rows(), 64);
        let (directions, densities) = draw(&sampler, &points(2, 50_000));
        let weights: Vec<f64> =
            directions.iter().zip(&densities).map(|(w, p)| f.at(*w) / f64::from(*p)).collect();
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        let variance = weights.iter().map(|w| (w / mean - 1.0).powi(2)).sum::<f64>() / weights.len() as f64;
        test_data::say(&format!("{shape:?}: Var(f/p)/mean^2 = {variance:e}"));
        assert!((variance - expected).abs() < 0.3 * expected + 1e-9, "{shape:?}: {variance:e}");
        assert!((mean / sampler.mass() - 1.0).abs() < 5.0 * (variance / 5e4).sqrt() + 1e-5, "{shape:?}");
    }
}

#[test]
fn nothing_positive_is_missed_and_no_weight_is_large() {
    let Some(vectors) = vectors("nothing_positive_is_missed_and_no_weight_is_large") else { return };
    // Exponents from dull to far sharper than degree 19 holds.
    let mut all: Vec<Vec<f64>> = vectors.into_iter().map(|(_, f)| f).collect();
    for exponent in [5.0, 30.0, 200.0f64] {
        let axis = Direction::from_angles(0.3 + exponent / 100.0, exponent);
        let zonal =
            |l: usize| [(-0.5 * (l * (l + 1)) as f64 / exponent).exp() * ((2 * l + 1) as f64).sqrt(); 3];
        let lobe = sh::Expansion::zonal(axis, Degree::new(19).unwrap(), zonal);
        all.push(lobe.coefficients().iter().map(|rgb| rgb[0]).collect());
    }
    for coefficients in &all {
        let mut f = Function::new(coefficients);
        for shape in SHAPES {
            let sampler = sampler(coefficients, options(Density::Positive, 0.0, shape, Warp::Rows));
            let (directions, densities) = draw(&sampler, &points(7, 40_000));
            let weights: Vec<f64> =
                directions.iter().zip(&densities).map(|(w, p)| f.at(*w).max(0.0) / f64::from(*p)).collect();
            let mean = weights.iter().sum::<f64>() / weights.len() as f64;
            let largest = weights.iter().fold(0.0, |a: f64, b| a.max(*b)) / mean;
            test_data::say(&format!("{shape:?}: largest weight {largest}"));
            assert!(largest < 5.0, "{shape:?}: {largest}");
            // Uniform directions: wherever f is positive, beyond what single precision tells from 0, it can
            // be drawn.
            let (mut missed, mut total) = (0.0, 0.0);
            for point in points(8, 40_000) {
                let (z, phi) = (1.0 - 2.0 * f64::from(point[0]), TAU * f64::from(point[1]));
                let direction = Direction::from_angles(z.acos(), phi).vector().to_array().map(|x| x as f32);
                let value = f.at(direction).max(0.0);
                total += value;
                if sampler.density(direction) == 0.0 {
                    missed += value;
                }
            }
            assert!(missed < 1e-6 * total, "{shape:?}: {missed} of {total}");
        }
    }
}

/// The mean and the variance of what the samples estimate, against the reference.
#[test]
fn estimates_have_the_mean_and_variance_of_the_reference() {
    let test = "estimates_have_the_mean_and_variance_of_the_reference";
    let (Some(vectors), Some(file)) = (vectors(test), tensors(test, "sampling/variance.safetensors")) else {
        return;
    };
    let vector = |name: &str| DVec3::from_slice(&file[name]);
    let (a, b) = (vector("a"), vector("b"));
    let g = |k: usize, w: [f32; 3]| {
        let w = DVec3::from_array(w.map(f64::from));
        [1.0, 1.0 + 0.5 * a.dot(w), f64::from(u8::from(w.z > 0.2)), (6.0 * (b.dot(w) - 1.0)).exp()][k]
    };
    let count = 400_000;
    // Mean, variance; fourth moment.
    let moments = |values: &[f64]| {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let power = |k: i32| values.iter().map(|value| (value - mean).powi(k)).sum::<f64>() / n;
        (mean, power(2))
    };
    for (name, coefficients) in &vectors {
        let table: Vec<&[f64]> = file[&format!("{name}.table")].chunks_exact(6).collect();
        let mut f = Function::new(coefficients);
        for (density, column) in [(Density::Positive, 0), (Density::Absolute, 4)] {
            let sampler = sampler(coefficients, options(density, 0.0, LeafShape::Exact, Warp::Rows));
            let (directions, densities) = draw(&sampler, &points(3, count));
            let mut signs = vec![0.0; count];
            sampler.signs_into(&directions, &mut signs);
            let target = |value: f64| if density == Density::Positive { value.max(0.0) } else { value };
            let values: Vec<f64> = directions.iter().map(|&w| target(f.at(w))).collect();
            let weights: Vec<f64> = values.iter().zip(&densities).map(|(f, p)| f / f64::from(*p)).collect();
            // Draws of the density itself, from those of the leaves: flat ones are thinned out.
            let largest = weights.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            let mut accepted = Vec::new();
            for (i, point) in points(4, count).iter().enumerate() {
                if density == Density::Absolute && values[i].abs() > 1e-6 {
                    assert_eq!(f64::from(signs[i]), values[i].signum());
                }
                if f64::from(point[0]) * largest < weights[i].abs() {
                    accepted.push((directions[i], values[i].signum()));
                }
            }
            for k in 0..4 {
                let [_, variance, fourth, uniform, signed, absolute] = table[k] else { unreachable!() };
                let expected = table[k][column];
                let estimates: Vec<f64> = (0..count).map(|i| weights[i] * g(k, directions[i])).collect();
                let (mean, spread) = moments(&estimates);
                let error = 4.0 * (spread / count as f64).sqrt() + 1e-6 * expected.abs();
                assert!((mean - expected).abs() < error, "{name} {density:?} {k}: {mean} {expected}");
                let _ = (uniform, signed);
                let norm = if density == Density::Positive { table[0][0] } else { absolute_norm(name) };
                let values: Vec<f64> = accepted.iter().map(|(w, sign)| norm * sign * g(k, *w)).collect();
                let (mean, spread) = moments(&values);
                let n = values.len() as f64;
                let variance = if density == Density::Positive { *variance } else { *absolute };
                assert!(
                    (mean - expected).abs() < 4.0 * (variance / n).sqrt() + 1e-6,
                    "{name} {density:?} {k}"
                );
                if density == Density::Positive {
                    let error =
                        4.0 * ((fourth - variance * variance).max(0.0) / n).sqrt() + 1e-5 * variance + 1e-9;
                    assert!((spread - variance).abs() < error, "{name} {k}: {spread} {variance}");
                }
            }
        }
    }
}

/// The integral of |f|, from sampling.json.
fn absolute_norm(name: &str) -> f64 {
    let file = test_data::reference("variance", "sampling/sampling.json").unwrap();
    file["variance"]["F"][name]["F_absolute"].as_f64().unwrap()
}

#[test]
fn results_depend_neither_on_threads_nor_on_batches() {
    for (name, f, options) in cases("results_depend_neither_on_threads_nor_on_batches") {
        let sampler = sampler(&f, options);
        let all = points(5, 10_001);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| draw(&sampler, &all))
        };
        let (directions, densities) = run(1);
        assert_eq!((&directions, &densities), (&run(3).0, &run(3).1), "{name}");
        for i in [0, 1, 63, 64, 4095, 4096, 10_000] {
            let one = sampler.sample(all[i]);
            assert_eq!((one.direction, one.density), (directions[i], densities[i]), "{name}, point {i}");
        }
    }
}

#[test]
fn degenerate_functions_are_errors_or_uniform() {
    let tables = Tables::new(Degree::new(2).unwrap());
    let new = |f: &[f64], density| {
        Sampler::new(&tables, f, options(density, 0.0, LeafShape::Bilinear, Warp::Rows)).map(|_| ())
    };
    let mut f = [0.0; 9];
    assert_eq!(new(&f, Density::Positive), Err(Error::NoMass));
    f[0] = -1.0;
    assert_eq!(new(&f, Density::Positive), Err(Error::NoMass));
    assert_eq!(new(&f, Density::Absolute), Ok(()));
    f[5] = f64::NEG_INFINITY;
    assert_eq!(new(&f, Density::Positive), Err(Error::NotFinite { l: 2, m: -1, value: f64::NEG_INFINITY }));
    f[5] = f64::NAN;
    assert_eq!(
        new(&f, Density::Positive).unwrap_err().to_string(),
        "the coefficient of l = 2, m = -1 is NaN, not a finite number"
    );
    // A negative mean: what is positive is sampled.
    let f = [-1.0, 0.0, 2.0, 0.0];
    for warp in [Warp::Rows, Warp::Tree] {
        for shape in SHAPES {
            let sampler = sampler(&f, options(Density::Positive, 0.0, shape, warp));
            let (directions, densities) = draw(&sampler, &points(6, 1000));
            assert!(directions.iter().all(|w| w[2] > 0.2) && densities.iter().all(|&p| p > 0.0));
            assert_eq!(sampler.density([0.0, 0.0, -1.0]), 0.0);
        }
    }
    // Degree 0 is uniform, at every scale.
    for scale in [1e-300, 1.0, 1e300] {
        for shape in SHAPES {
            let sampler = sampler(&[scale], options(Density::Positive, 0.0, shape, Warp::Rows));
            let (_, densities) = draw(&sampler, &points(6, 1000));
            assert!(densities.iter().all(|p| (f64::from(*p) * 4.0 * PI - 1.0).abs() < 1e-5));
            assert!((sampler.mass() / (scale * (4.0 * PI).sqrt()) - 1.0).abs() < 1e-5);
        }
    }
    // Points outside the square are moved to its edge, NaN to 0.
    let sampler = sampler(&slope(), Options::default());
    assert_eq!(sampler.sample([1.5, -1.0]), sampler.sample([1.0 - f32::EPSILON / 2.0, 0.0]));
    assert_eq!(sampler.sample([f32::NAN, 0.5]), sampler.sample([0.0, 0.5]));
}
