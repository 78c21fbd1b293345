//! Points that follow light, a lobe, and their product, on lat-long maps of what they follow.

use envmap::{Environment, ToneMap, to_srgb8};
use sampling::{ProductOptions, ProductSampler, ProductTables, SUM, Tables, TexelLight};
use sh::Degree;
use sphere::{Direction, LatLong};

use super::phong::Phong;
use super::picture::Picture;
use super::{POINTS, first, vector};

/// The number of points on a map.
pub const COUNT: usize = 512;

/// Rows of a map in pixels.
const ROWS: usize = 160;

/// The lobe's degree.
const DEGREE: usize = 7;

/// The lobe: exponent 10, toward 20 degrees above the horizon.
fn lobe() -> Phong {
    Phong { exponent: 10, axis: Direction::from_angles(70f64.to_radians(), 1.2) }
}

/// A row of maps for each of [`POINTS`], random ones above: the light, the lobe, and the product.
///
/// # Errors
/// If the light or the product is black.
pub fn draw(environment: &Environment) -> Result<Picture, Box<dyn std::error::Error>> {
    let degree = Degree::new(DEGREE)?;
    let light = TexelLight::new(environment, SUM)?;
    let sampler = |light: &TexelLight, degree: Degree, f: &[f64]| {
        let tables = ProductTables::new(light, &Tables::new(degree));
        ProductSampler::new(&tables, f, ProductOptions::default())
    };
    let white = TexelLight::new(&constant()?, SUM)?;
    let f = lobe().coefficients(degree);
    let columns = [
        (background(environment, |_| 1.0)?, sampler(&light, Degree::new(0)?, &[1.0])?),
        (
            background(&constant()?, |w| lobe().value(w.vector()) / lobe().largest())?,
            sampler(&white, degree, &f)?,
        ),
        (
            background(environment, |w| lobe().value(w.vector()) / lobe().largest())?,
            sampler(&light, degree, &f)?,
        ),
    ];
    let row = |points| {
        let of = |(map, sampler): &(Picture, ProductSampler)| {
            let (mut directions, mut densities) = (vec![[0.0; 3]; COUNT], vec![0.0; COUNT]);
            sampler.sample_into(&first(points, COUNT), &mut directions, &mut densities);
            let mut map = map.clone();
            for w in directions {
                let (column, row) = LatLong::with_rows(ROWS).position(Direction::normalised(vector(w)));
                map.dot([column + 0.5, row + 0.5], 1.2);
            }
            map
        };
        columns.iter().map(of).collect()
    };
    Ok(Picture::sheet(&POINTS.map(row)))
}

fn constant() -> Result<Environment, String> {
    let grid = LatLong::with_rows(ROWS);
    Environment::new(grid, vec![[1.0; 3]; grid.len()]).ok_or_else(|| "a constant environment".into())
}

/// The environment times a function, in the exposure of the environment.
fn background(environment: &Environment, times: impl Fn(Direction) -> f64) -> Result<Picture, envmap::Error> {
    let grid = LatLong::with_rows(ROWS);
    let shown = environment.resized(grid)?;
    let texel = |index: usize| {
        let share = times(grid.direction(index / grid.width, index % grid.width));
        shown.pixels()[index].map(|value| (f64::from(value) * share) as f32)
    };
    let radiance: Vec<[f32; 3]> = (0..grid.len()).map(texel).collect();
    let codes = to_srgb8(&radiance, environment.exposure().stops, ToneMap::Filmic);
    Ok(Picture::new(grid.width, grid.height, |column, row| codes[row * grid.width + column]))
}
