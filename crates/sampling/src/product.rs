//! Points of the unit square to directions that follow the product of light and a function given by spherical
//! harmonics.
//!
//! Jarosz, Carr and Jensen (2009; JCJ09) multiply the integrals of quadrants with those of an environment's
//! wavelets. Here a point goes through four distributions: a row of leaves, a leaf, a row of texels in it, a
//! texel. There are two kinds of masses:
//!
//! - by leaves: the mean of f over the leaf times the light in it. Below, the light's own distribution,
//!   which no function changes: a new function costs its leaves, as without light.
//! - by texels: the light of a texel times the exact integral of f over it. Nodes are sums of texels; f
//!   changes inside a texel as in a leaf. Leaves smaller than texels divide them, so that masses are those
//!   of pieces.
//!
//! Each distribution is monotone in its uniform, so that stratified points stay stratified. Texels without
//! light are never drawn.

use std::sync::{Arc, OnceLock};

use sh::f64x4::{Lanes, SimdLevel, WithLanes};

use crate::batches::{draw_into, map_into};
use crate::cell_distribution::{ABREAST, BELOW_ONE, CellDistribution, Drawn, LEAST_MASS};
use crate::exact::invert_linear;
use crate::leaves::{Density, LeafOptions, Leaves};
use crate::piece_values::{PieceMasses, PieceTables};
use crate::pieces::Pieces;
use crate::sampler::{bilinear, normalise, share_below};
use crate::texel_distribution::{DrawnPiece, TexelDistribution};
use crate::{Error, Sample, Tables, TexelLight, UniformShare};

/// How f varies in the density of a product.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProductMasses {
    /// f varies from leaf to leaf: the mean of f over each. A new function costs no more than its leaves.
    #[default]
    Leaves,
    /// f varies from texel to texel: the exact integral of f over each. A new function takes as long as all
    /// texels do.
    FlatTexels,
    /// f is bilinear in z and phi inside each texel, between values at its corners, with the masses of
    /// [`ProductMasses::FlatTexels`].
    BilinearTexels,
}

/// The density that a [`ProductSampler`] draws from, and how.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProductOptions {
    /// The function of f that multiplies the light.
    pub density: Density,
    /// The share of f's density, before it multiplies the light, that is uniform over the sphere.
    pub uniform_share: UniformShare,
    /// How f varies in the density.
    pub masses: ProductMasses,
}

/// The tables that the products of one light with functions of one degree share.
///
/// Memory: 4 bytes for each texel and leaf, and for each row of texels and column of leaves; with
/// texels' masses, 16 bytes (degree + 1) more for each column.
pub struct ProductTables {
    tables: Arc<Tables>,
    pieces: Pieces,
    light: TexelLight,
    /// The light's distribution in each leaf.
    distribution: Arc<TexelDistribution>,
    /// The tables of pieces, made when texels have masses of their own.
    piece_tables: OnceLock<PieceTables>,
}

impl ProductTables {
    /// The tables of a light and the degree of `tables`.
    pub fn new(light: &TexelLight, tables: &Arc<Tables>) -> Arc<Self> {
        let grid = tables.grid();
        let pieces = Pieces::new(light.grid(), grid);
        let distribution = TexelDistribution::new(&pieces, grid, |row, masses| {
            let row = pieces.rows[row];
            for (column, mass) in pieces.columns.iter().zip(masses) {
                let mass_of_light = f64::from(light.relative(row.texel, column.texel)) * row.height();
                *mass = (mass_of_light * column.width()) as f32;
            }
        });
        Arc::new(Self {
            tables: tables.clone(),
            pieces,
            light: light.clone(),
            distribution: Arc::new(distribution),
            piece_tables: OnceLock::new(),
        })
    }

    /// The tables of the functions.
    pub fn function_tables(&self) -> &Arc<Tables> {
        &self.tables
    }

    /// The light that the functions multiply.
    pub fn light(&self) -> &TexelLight {
        &self.light
    }

    fn piece_tables(&self) -> &PieceTables {
        self.piece_tables.get_or_init(|| PieceTables::new(&self.pieces, self.tables.degree()))
    }
}

/// Draws directions from the product of light and a function on the sphere given by spherical harmonics.
///
/// The density told for a direction is the one with which it is drawn, from the same steps in single
/// precision. It is positive wherever light and the density asked of f are, up to 1e-30 of their largest
/// values and to what [`crate::Sampler`] says of f between its leaves. Points outside the unit square count
/// as the nearest inside.
///
/// # Example: a lobe toward +X under a bright window at +X
/// ```
/// use sampling::{ProductOptions, ProductSampler, ProductTables, SUM, Tables, TexelLight};
/// use sphere::LatLong;
///
/// let mut pixels = vec![[0.5; 3]; 8 * 16];
/// pixels[3 * 16 + 8] = [100.0; 3];
/// let window = envmap::Environment::new(LatLong { width: 16, height: 8 }, pixels).expect("8 x 16 texels");
/// let light = TexelLight::new(&window, SUM)?;
/// // 1 + x
/// let f = [3.544908, 0.0, 0.0, 2.046653];
/// let tables = ProductTables::new(&light, &Tables::new(sh::Degree::new(1)?));
/// let sampler = ProductSampler::new(&tables, &f, ProductOptions::default())?;
/// let sample = sampler.sample([0.25, 0.5]);
/// assert!((sample.density / sampler.density(sample.direction) - 1.0).abs() < 1e-5);
/// assert!(sampler.density([0.98, -0.17, 0.1]) > 100.0 * sampler.density([-0.98, -0.17, 0.1]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct ProductSampler {
    tables: Arc<ProductTables>,
    level: SimdLevel,
    options: ProductOptions,
    leaves: Leaves,
    cells: CellDistribution,
    texels: Arc<TexelDistribution>,
    pieces: Option<Arc<PieceMasses>>,
    single: Vec<f32>,
    mass: f64,
}

impl ProductSampler {
    /// A sampler of the light's product with the function of these coefficients, in order l*l + l + m, whose
    /// degree is that of the tables.
    ///
    /// # Errors
    /// If a coefficient is not finite, or the product is zero everywhere.
    ///
    /// # Panics
    /// If the number of coefficients is not that of the degree.
    pub fn new(
        tables: &Arc<ProductTables>,
        coefficients: &[f64],
        options: ProductOptions,
    ) -> Result<Self, Error> {
        let grid = tables.tables.grid();
        let mut sampler = Self {
            tables: tables.clone(),
            level: SimdLevel::detect(),
            options,
            leaves: Leaves::new(&tables.tables, false),
            cells: CellDistribution::new(grid.rows(), grid.columns()),
            texels: tables.distribution.clone(),
            pieces: None,
            single: Vec::new(),
            mass: 0.0,
        };
        sampler.replace(coefficients)?;
        Ok(sampler)
    }

    /// Takes another function of the same degree under the same light. After an error the sampler is to be
    /// given another one before it draws.
    ///
    /// # Errors
    /// If a coefficient is not finite, or the product is zero everywhere.
    ///
    /// # Panics
    /// If the number of coefficients is not that of the degree.
    pub fn replace(&mut self, coefficients: &[f64]) -> Result<(), Error> {
        let Self { tables, options, .. } = self;
        assert_eq!(coefficients.len(), tables.tables.degree().rows(), "one coefficient for each row");
        let scale = normalise(coefficients)?;
        let grid = tables.tables.grid();
        let inverse_area = (grid.area() as f32).recip();
        let mut rows = self.cells.sums_mut();
        let share = options.uniform_share.get();
        if options.masses == ProductMasses::Leaves {
            self.single.clear();
            self.single.extend(coefficients.iter().map(|&value| (value * scale) as f32));
            let how = LeafOptions { density: options.density, uniform_share: share, keep_masses: true };
            self.leaves.update(self.level, &tables.tables, &self.single, how, &mut rows);
        } else {
            let coefficients: Vec<f64> = coefficients.iter().map(|value| value * scale).collect();
            let (pieces, light) = (&tables.pieces, &tables.light);
            let masses =
                PieceMasses::new(tables.piece_tables(), pieces, &coefficients, options.density, share);
            let columns = pieces.columns.len();
            self.texels = Arc::new(TexelDistribution::new(pieces, grid, |row, output| {
                let texel_row = pieces.rows[row].texel;
                let of_row = &masses.masses[row * columns..][..columns];
                for ((mass, column), output) in of_row.iter().zip(&pieces.columns).zip(output) {
                    *output = mass * light.relative(texel_row, column.texel);
                }
            }));
            self.pieces = Some(Arc::new(masses));
        }
        for (row, sums) in rows.values.chunks_exact_mut(rows.stride).enumerate() {
            let mut sum = 0.0;
            for (column, entry) in sums[..grid.columns()].iter_mut().enumerate() {
                let mass = self.texels.mass(row, column);
                sum +=
                    if options.masses == ProductMasses::Leaves { *entry * inverse_area * mass } else { mass };
                *entry = sum;
            }
        }
        let total = self.cells.update();
        if total <= LEAST_MASS {
            return Err(Error::NoMass);
        }
        self.mass = f64::from(total) / scale * tables.light.largest();
        Ok(())
    }

    /// The tables.
    pub fn tables(&self) -> &Arc<ProductTables> {
        &self.tables
    }

    /// The sum of all masses, in the unit of light times f times sr: the integral of the density before it is
    /// normalised. Where f changes sign, masses are more than their integral.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// The direction of one point.
    pub fn sample(&self, point: [f32; 2]) -> Sample {
        let (mut directions, mut densities) = ([[0.0; 3]; 1], [0.0; 1]);
        self.draw(&[point], &mut directions, &mut densities);
        Sample { direction: directions[0], density: densities[0] }
    }

    /// The directions of many points, and the densities with which they are drawn, in 1/sr.
    ///
    /// Runs on the threads of the rayon pool that it is called in; every element is the same for any number
    /// of threads, and the same as from [`ProductSampler::sample`].
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn sample_into(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]], densities: &mut [f32]) {
        draw_into(points, directions, densities, |points, directions, densities| {
            self.draw(points, directions, densities);
        });
    }

    fn draw(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]], densities: &mut [f32]) {
        self.level.run_lanes(ProductDraw { sampler: self, points, directions, densities });
    }

    /// The density with which a direction is drawn, in 1/sr. The direction is a unit vector.
    pub fn density(&self, direction: [f32; 3]) -> f32 {
        let pieces = &self.tables.pieces;
        let place = pieces.locate(direction);
        let (row, column) = (place.row, place.column);
        let leaf = [pieces.rows[row].leaf, pieces.columns[column].leaf];
        let probability = self.cells.probability(leaf[0], leaf[1]);
        let given = self.texels.probability(leaf, [row, column]);
        if probability == 0.0 || given == 0.0 {
            return 0.0;
        }
        let relative = match self.corners(row, column) {
            Some(corners) => bilinear(corners, place.t, place.s),
            None => 1.0,
        };
        probability * given * pieces.inverse_area(row, column) * relative
    }

    /// The point whose direction this is: the inverse of [`ProductSampler::sample`], to 1e-5 and what the
    /// rounding of a direction is in its texel, times the texel's probability. Of a direction that is never
    /// drawn, the point at which its neighbours meet.
    pub fn invert(&self, direction: [f32; 3]) -> [f32; 2] {
        let pieces = &self.tables.pieces;
        let place = pieces.locate(direction);
        let leaf = [pieces.rows[place.row].leaf, pieces.columns[place.column].leaf];
        let (t, s) = (place.t, place.s);
        let rest = match self.corners(place.row, place.column) {
            Some([a, b, c, d]) => {
                let (west, east) = (a + (c - a) * t, b + (d - b) * t);
                [share_below(a + b, c + d, t), share_below(west, east, s)]
            }
            None => [t, s],
        };
        let rest = rest.map(|rest| rest.clamp(0.0, BELOW_ONE));
        let rest = self.texels.invert(leaf, [place.row, place.column], rest);
        self.cells.invert(leaf[0], leaf[1], rest)
    }

    /// [`ProductSampler::invert`] of many directions.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn invert_into(&self, directions: &[[f32; 3]], points: &mut [[f32; 2]]) {
        map_into(directions, points, |direction| self.invert(direction));
    }

    /// The density at the corners of a piece in which it is not flat: north-west, north-east, south-west,
    /// south-east.
    #[inline(always)]
    fn corners(&self, row: usize, column: usize) -> Option<[f32; 4]> {
        let masses = self.pieces.as_ref().filter(|_| self.options.masses == ProductMasses::BilinearTexels)?;
        let columns = self.tables.pieces.columns.len();
        if masses.flat[row * columns + column] {
            return None;
        }
        let north = &masses.corners[row * (columns + 1) + column..][..2];
        let south = &masses.corners[(row + 1) * (columns + 1) + column..][..2];
        Some([north[0], north[1], south[0], south[1]])
    }
}

/// Draws points, [`ABREAST`] at a time.
struct ProductDraw<'a> {
    sampler: &'a ProductSampler,
    points: &'a [[f32; 2]],
    directions: &'a mut [[f32; 3]],
    densities: &'a mut [f32],
}

impl WithLanes for ProductDraw<'_> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<L: Lanes>(self, lanes: L) {
        let Self { sampler, points, directions, densities } = self;
        let ProductSampler { cells, texels, tables, .. } = sampler;
        let mut leaves = Drawn::new();
        let outputs = directions.chunks_mut(ABREAST).zip(densities.chunks_mut(ABREAST));
        for (points, (directions, densities)) in points.chunks(ABREAST).zip(outputs) {
            let mut inside = [[0.0; 2]; ABREAST];
            for (to, from) in inside.iter_mut().zip(points) {
                for axis in 0..2 {
                    to[axis] = from[axis].max(0.0).clamp(0.0, BELOW_ONE);
                }
            }
            cells.draw(lanes, &inside[..points.len()], &mut leaves);
            for (i, (direction, density)) in directions.iter_mut().zip(densities).enumerate() {
                let rest = leaves.rest.map(|rest| rest[i]);
                let drawn = texels.draw(leaves.rows[i] as usize, leaves.columns[i] as usize, rest);
                let DrawnPiece { row, column, mut rest, probability } = drawn;
                let mut probability = probability * leaves.probabilities[i];
                if let Some(corners) = sampler.corners(row, column) {
                    let [a, b, c, d] = corners;
                    rest[0] = invert_linear(a + b, c + d, rest[0]);
                    let (west, east) = (a + (c - a) * rest[0], b + (d - b) * rest[0]);
                    rest[1] = invert_linear(west, east, rest[1]);
                    probability *= bilinear(corners, rest[0], rest[1]);
                }
                *density = probability * tables.pieces.inverse_area(row, column);
                let place = tables.pieces.inside(row, column, rest);
                *direction = tables.pieces.direction(row, column, place);
            }
        }
    }
}
