//! Products of light and functions.

use envmap::Environment;
use sampling::{
    Density, Error, ProductMasses, ProductOptions, ProductSampler, ProductTables, SUM, Tables, TexelLight,
    UniformShare,
};
use sh::{CellGrid, CellTransform, Degree};
use sphere::{DVec3, LatLong};

use super::*;

const ALL_MASSES: [ProductMasses; 3] =
    [ProductMasses::Leaves, ProductMasses::FlatTexels, ProductMasses::BilinearTexels];

/// Texels of 0.3 to 2, a quarter of the sphere black, and a sun of one texel.
fn environment(grid: LatLong) -> Environment {
    let noise = points(99, grid.len());
    let texel = |index: usize| {
        let column = index % grid.width;
        let is_black = column < grid.width / 4;
        let scale =
            if index == grid.len() * 3 / 8 + grid.width / 3 { 200.0 } else { 0.3 + 1.7 * noise[index][0] };
        if is_black { [0.0; 3] } else { [0.2, 0.3, 0.5].map(|share| share * scale) }
    };
    Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap()
}

/// Texels that are leaves and parts of leaves, that hold many leaves, and that leaves cut.
fn grids() -> [LatLong; 3] {
    [(128, 64), (16, 8), (90, 45)].map(|(width, height)| LatLong { width, height })
}

fn product(environment: &Environment, f: &[f64], options: ProductOptions) -> ProductSampler {
    let degree = Degree::new(f.len().isqrt() - 1).unwrap();
    let light = TexelLight::new(environment, SUM).unwrap();
    ProductSampler::new(&ProductTables::new(&light, &Tables::new(degree)), f, options).unwrap()
}

fn draw(sampler: &ProductSampler, points: &[[f32; 2]]) -> (Vec<[f32; 3]>, Vec<f32>) {
    let (mut directions, mut densities) = (vec![[0.0; 3]; points.len()], vec![0.0; points.len()]);
    sampler.sample_into(points, &mut directions, &mut densities);
    (directions, densities)
}

/// The sum of channels of the texel in a direction.
fn light(environment: &Environment, direction: [f32; 3]) -> f64 {
    let grid = environment.grid();
    let [x, y, z] = direction.map(f64::from);
    let (column, row) = grid.position(Direction::normalised(DVec3::new(x, y, z)));
    let inside = |x: f64, count: usize| ((x + 0.5) as usize).min(count - 1);
    let (row, column) = (inside(row, grid.height), inside(column, grid.width));
    environment.pixels()[row * grid.width + column].iter().map(|&value| f64::from(value)).sum()
}

fn cases(test: &str) -> Vec<(String, LatLong, Vec<f64>, ProductOptions)> {
    let mut cases = Vec::new();
    let mut functions = vec![("slope", slope())];
    functions.extend(vectors(test).unwrap_or_default());
    for (number, (name, f)) in functions.into_iter().enumerate() {
        for (index, grid) in grids().into_iter().enumerate() {
            let masses = ALL_MASSES[(number + index) % 3];
            let uniform_share = UniformShare::new([0.0, 0.2][number % 2]).unwrap();
            let density = if index == 1 { Density::Absolute } else { Density::Positive };
            let options = ProductOptions { density, uniform_share, masses };
            cases.push((format!("{name} {grid:?} {options:?}"), grid, f.clone(), options));
        }
    }
    cases
}

/// The integrals of the density, and the solid angle with light, over the test cells: Gauss' rule of 2 x 2
/// nodes between the edges of texels and leaves, where densities are bilinear.
fn integrals(sampler: &ProductSampler, environment: &Environment) -> (Vec<f64>, Vec<f64>) {
    let (texels, leaves) = (environment.grid(), sampler.tables().function_tables().grid());
    let mut z: Vec<f64> = (0..=texels.height).map(|i| (PI * i as f64 / texels.height as f64).cos()).collect();
    z.extend((1..leaves.rows()).map(|i| 1.0 - 2.0 * i as f64 / leaves.rows() as f64));
    let mut phi: Vec<f64> = (0..=texels.width).map(|i| PI - TAU * i as f64 / texels.width as f64).collect();
    phi.extend((1..leaves.columns()).map(|i| PI - TAU * i as f64 / leaves.columns() as f64));
    let (mut cells, mut lit) = (vec![0.0; ROWS * COLUMNS], vec![0.0; ROWS * COLUMNS]);
    for list in [&mut z, &mut phi] {
        list.sort_by(f64::total_cmp);
    }
    let node = |edge: &[f64], k: usize| {
        let offset = [-0.5, 0.5][k] / 3f64.sqrt();
        0.5 * (edge[0] + edge[1]) + offset * (edge[1] - edge[0])
    };
    for z in z.windows(2) {
        for phi in phi.windows(2) {
            let area = 0.25 * (z[1] - z[0]) * (phi[1] - phi[0]);
            for k in 0..4 {
                let direction = Direction::from_angles(node(z, k / 2).acos(), node(phi, k % 2)).vector();
                let direction = direction.to_array().map(|x| x as f32);
                let cell = cell(direction);
                cells[cell] += f64::from(sampler.density(direction)) * area;
                lit[cell] += if light(environment, direction) > 0.0 { area } else { 0.0 };
            }
        }
    }
    (cells, lit)
}

#[test]
fn directions_follow_the_product() {
    let cases = cases("directions_follow_the_product");
    let level = 1.0 - (1.0f64 - 1e-3).powf(1.0 / cases.len() as f64);
    for (seed, (name, grid, f, options)) in cases.iter().enumerate() {
        let environment = environment(*grid);
        let sampler = product(&environment, f, *options);
        let (directions, densities) = draw(&sampler, &points(100 + seed as u32, DRAWS));
        let (probabilities, lit) = integrals(&sampler, &environment);
        let sum: f64 = probabilities.iter().sum();
        // What is nearer to a texel's edge than a leaf's edge may move is on the wrong side of it.
        assert!((sum - 1.0).abs() < 2e-4, "{name}: the density integrates to {sum}");
        let expected: Vec<f64> = probabilities.iter().map(|p| p * DRAWS as f64).collect();
        let p = p_value(&counts(&directions), &expected);
        assert!(p > level, "{name}: p = {p:e}");
        let mut sums = vec![[0.0; 2]; ROWS * COLUMNS];
        for (direction, density) in directions.iter().zip(&densities) {
            assert!(light(&environment, *direction) > 0.0, "{name}: black texel at {direction:?}");
            let [first, second] = &mut sums[cell(*direction)];
            let weight = 1.0 / f64::from(*density);
            *first += weight;
            *second += weight * weight;
            let told = sampler.density(*direction);
            assert!((told / density - 1.0).abs() < 3e-3, "{name}: {direction:?} {density} {told}");
        }
        if options.uniform_share.get() > 0.0 || name.starts_with("slope") || name.starts_with("probe") {
            for (index, [first, second]) in sums.iter().enumerate() {
                let mean = first / DRAWS as f64;
                let deviation = ((second / DRAWS as f64 - mean * mean) / DRAWS as f64).sqrt();
                // 5.5 deviations: 4e-8 for each of some thousands of cells.
                assert!(
                    (mean - lit[index]).abs() <= 5.5 * deviation + 1e-3 * lit[index],
                    "{name}, cell {index}: {mean} {} {deviation}",
                    lit[index]
                );
            }
        }
    }
}

#[test]
fn wrong_products_are_rejected() {
    let environment = environment(grids()[0]);
    let sampler = product(&environment, &slope(), ProductOptions::default());
    let counts = counts(&draw(&sampler, &points(1, DRAWS)).0);
    let p = integrals(&sampler, &environment).0;
    let without_f = product(&environment, &[1.0], ProductOptions::default());
    let of_light = integrals(&without_f, &environment).0;
    let test = |p: &[f64]| {
        let sum: f64 = p.iter().sum();
        p_value(&counts, &p.iter().map(|p| p / sum * DRAWS as f64).collect::<Vec<_>>())
    };
    assert!(test(&p) > 1e-3);
    assert!(test(&of_light) < 1e-6);
    let mirrored: Vec<f64> =
        (0..p.len()).map(|cell| p[cell / COLUMNS * COLUMNS + (COLUMNS - 1 - cell % COLUMNS)]).collect();
    assert!(test(&mirrored) < 1e-6);
    let uneven: Vec<f64> =
        p.iter().enumerate().map(|(cell, p)| p * if cell % 2 == 0 { 1.02 } else { 0.98 }).collect();
    assert!(test(&uneven) < 1e-6);
}

#[test]
fn inversion_returns_the_point_of_a_product() {
    for (seed, (name, grid, f, options)) in
        cases("inversion_returns_the_point_of_a_product").iter().enumerate()
    {
        let sampler = product(&environment(*grid), f, *options);
        let all = points_and_corners(seed as u32);
        let (directions, _) = draw(&sampler, &all);
        let mut inverted = vec![[0.0; 2]; all.len()];
        sampler.invert_into(&directions, &mut inverted);
        check_inverted(name, &all, &inverted);
    }
}

/// The exact product integral, texel by texel, is what samples estimate: with the signs of f where all of
/// it is sampled, without what f has below zero otherwise.
#[test]
fn estimates_are_the_product_integral() {
    let test = "estimates_are_the_product_integral";
    let Some(vectors) = vectors(test) else { return };
    let count = 400_000;
    for (name, coefficients) in &vectors {
        let mut f = Function::new(coefficients);
        for grid in grids() {
            let environment = environment(grid);
            let cells = CellTransform::new(
                CellGrid::lat_long(grid),
                Degree::new(coefficients.len().isqrt() - 1).unwrap(),
            );
            let texels: Vec<[f64; 1]> =
                environment.pixels().iter().map(|rgb| [rgb.iter().map(|&v| f64::from(v)).sum()]).collect();
            let projected = cells.project(&texels);
            let exact: f64 = projected.iter().zip(coefficients).map(|(e, f)| e[0] * f).sum();
            for masses in ALL_MASSES {
                let options = ProductOptions { density: Density::Absolute, masses, ..Default::default() };
                let sampler = product(&environment, coefficients, options);
                let (directions, densities) = draw(&sampler, &points(3, count));
                let mut estimates = directions
                    .iter()
                    .zip(&densities)
                    .map(|(w, p)| light(&environment, *w) * f.at(*w) / f64::from(*p));
                let (mut sum, mut squares, mut largest) = (0.0, 0.0, 0.0f64);
                estimates.by_ref().for_each(|estimate| {
                    sum += estimate;
                    squares += estimate * estimate;
                    largest = largest.max(estimate.abs());
                });
                let n = count as f64;
                let (mean, variance) = (sum / n, squares / n - (sum / n).powi(2));
                let error = 4.0 * (variance / n).sqrt() + 1e-5 * sampler.mass();
                assert!((mean - exact).abs() < error, "{name} {grid:?} {masses:?}: {mean} {exact} {error}");
                assert!(largest < 5.0 * sampler.mass(), "{name} {grid:?} {masses:?}: {largest}");
                if name == &"probe" {
                    // f is positive: what is left is how it varies in leaves or texels.
                    let relative = variance / (mean * mean);
                    test_data::say(&format!("{name} {grid:?} {masses:?}: Var(Ef/p)/mean^2 = {relative:.1e}"));
                    assert!((sampler.mass() / exact - 1.0).abs() < 5e-3, "{} {exact}", sampler.mass());
                    assert!(relative < 3e-3);
                }
            }
        }
    }
}

#[test]
fn negative_texels_are_not_drawn_and_texels_that_are_not_finite_are_errors() {
    let grid = LatLong { width: 16, height: 8 };
    let value = |index: usize| if index.is_multiple_of(3) { -1.0 } else { 1.0 + index as f32 };
    let environment = Environment::new(grid, (0..128).map(|index| [value(index); 3]).collect()).unwrap();
    let sampler = product(&environment, &slope(), ProductOptions::default());
    let (directions, densities) = draw(&sampler, &points(5, 10_000));
    for (direction, density) in directions.iter().zip(densities) {
        assert!(density > 0.0 && light(&environment, *direction) > 0.0);
    }
    let wrong = TexelLight::new(&environment, [1.0, f64::NAN, 1.0]);
    assert!(matches!(wrong, Err(Error::TexelNotFinite { row: 0, column: 0, .. })));
}

#[test]
fn products_depend_neither_on_threads_nor_on_batches() {
    for (name, grid, f, options) in cases("products_depend_neither_on_threads_nor_on_batches") {
        let environment = environment(grid);
        let all = points(5, 10_001);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| draw(&product(&environment, &f, options), &all))
        };
        let (directions, densities) = run(1);
        assert_eq!((&directions, &densities), (&run(3).0, &run(3).1), "{name}");
        let sampler = product(&environment, &f, options);
        for i in [0, 1, 63, 64, 4095, 4096, 10_000] {
            let one = sampler.sample(all[i]);
            assert_eq!((one.direction, one.density), (directions[i], densities[i]), "{name}, point {i}");
        }
    }
}

#[test]
fn products_without_mass_are_errors() {
    let grid = LatLong { width: 16, height: 8 };
    let black = Environment::new(grid, vec![[0.0; 3]; 128]).unwrap();
    assert_eq!(TexelLight::new(&black, SUM), Err(Error::NoMass));
    // Light only from below, on a function that is positive only above.
    let pixels = (0..128).map(|index| if index / 16 == 7 { [1.0; 3] } else { [0.0; 3] }).collect();
    let below = TexelLight::new(&Environment::new(grid, pixels).unwrap(), SUM).unwrap();
    let tables = ProductTables::new(&below, &Tables::new(Degree::new(1).unwrap()));
    for masses in ALL_MASSES {
        let new = |f: &[f64], density| {
            let options = ProductOptions { density, masses, ..Default::default() };
            ProductSampler::new(&tables, f, options).map(|_| ())
        };
        let above = [-0.5, 0.0, 1.0, 0.0];
        assert_eq!(new(&above, Density::Positive), Err(Error::NoMass), "{masses:?}");
        assert_eq!(new(&above, Density::Absolute), Ok(()));
        assert_eq!(new(&[0.0; 4], Density::Positive), Err(Error::NoMass));
        let bad = [1.0, 0.0, f64::NAN, 0.0];
        assert!(matches!(new(&bad, Density::Positive), Err(Error::NotFinite { l: 1, m: 0, .. })));
        // At every scale of both.
        for scale in [1e-200, 1e200] {
            let f = [scale, 0.0, 0.5 * scale, 0.0];
            let options = ProductOptions { masses, ..Default::default() };
            let sampler = ProductSampler::new(&tables, &f, options).unwrap();
            let sample = sampler.sample([0.3, 0.6]);
            assert!(sample.density > 0.0 && sample.density.is_finite() && sample.direction[2] < -0.9);
        }
    }
}
