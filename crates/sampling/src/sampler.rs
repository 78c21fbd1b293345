//! Points of the unit square to directions that follow a function given by spherical harmonics.
//!
//! The sphere is divided into leaves of equal area in (z, phi). A point first goes to a leaf, with the
//! probability of the leaf's mass, then to a place in it by what is left of its two uniforms. Both steps are
//! monotone in each uniform, so that stratified points stay stratified. Jarosz, Carr and Jensen (2009; JCJ09)
//! integrate every quadrant on the way down; here all leaves are integrated once and masses are summed from
//! the leaves up, because a node's signed integral says nothing of the positive parts in it.

use std::sync::Arc;

use sh::f64x4::{Lanes, SimdLevel, WithLanes};
use sh::{Basis, Expansion};
use sphere::{DVec3, Direction};

use crate::batches::{draw_into, map_into};
use crate::cell_distribution::{ABREAST, BELOW_ONE, CellDistribution, Drawn, LEAST_MASS, MassRows};
use crate::exact::{ExactLeaves, Scratch, WIDTH, invert_linear};
use crate::leaves::{Density, LeafOptions, Leaves};
use crate::mass_tree::MassTree;
use crate::{Error, LeafGrid, Tables};

/// Raised when the directions of points change, those of products too: every kind of stage that draws some
/// adds this to its own revision.
pub const REVISION: u32 = 1;

/// The density inside a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LeafShape {
    /// The density is constant inside a leaf, as in JCJ09, and not f.
    Flat,
    /// The density is bilinear in z and phi between the values of f at the corners, with the exact mass.
    #[default]
    Bilinear,
    /// The density is f itself, to single precision.
    Exact,
}

/// How a point finds its leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Warp {
    /// A point finds a row by its first uniform, then a column in it by its second: the faster way.
    #[default]
    Rows,
    /// A point goes down a tree of masses, z before phi at each node: hierarchical sample warping.
    Tree,
}

/// The density that a [`Sampler`] draws from, and how.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// The density, up to its norm.
    pub density: Density,
    /// The share of the density that is uniform over the sphere.
    pub uniform_share: UniformShare,
    /// The density inside a leaf.
    pub shape: LeafShape,
    /// How a point finds its leaf.
    pub warp: Warp,
}

/// A share in [0, 1).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UniformShare(f32);

impl UniformShare {
    /// A checked share; `None` unless it is in [0, 1).
    pub fn new(share: f32) -> Option<Self> {
        (0.0..1.0).contains(&share).then_some(Self(share))
    }

    /// The share as a number.
    pub fn get(self) -> f32 {
        self.0
    }
}

/// A direction that was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// A unit vector.
    pub direction: [f32; 3],
    /// The density with which the direction was drawn, in 1/sr.
    pub density: f32,
}

/// The leaves' distribution.
#[derive(Clone)]
enum Selection {
    Rows(CellDistribution),
    Tree(MassTree),
}

/// Draws directions from a function on the sphere given by spherical harmonics.
///
/// The density told for a direction is the one with which it is drawn, computed by the same steps in single
/// precision; the tests hold it against the drawn directions by chi-square. It follows f as [`LeafShape`]
/// says, except in leaves where f changes sign: these are flat, at a bound of f. There max(f, 0) over the
/// density is at most 3 times its mean (measured, degree 19), and no place with f > 0 is left out beyond
/// 1e-6 of the whole. Points outside the square count as the nearest inside.
///
/// # Example: a lobe about +Z is denser there
/// ```
/// use sampling::{Options, Sampler, Tables};
/// use sh::Degree;
///
/// // 1 + z
/// let f = [3.544908, 0.0, 2.046653, 0.0];
/// let sampler = Sampler::new(&Tables::new(Degree::new(1)?), &f, Options::default())?;
/// let sample = sampler.sample([0.25, 0.5]);
/// assert!((sample.density - sampler.density(sample.direction)).abs() < 1e-5);
/// assert!(sampler.density([0.0, 0.0, 1.0]) > 100.0 * sampler.density([0.0, 0.0, -1.0]));
/// let point = sampler.invert(sample.direction);
/// assert!((point[0] - 0.25).abs() < 1e-5 && (point[1] - 0.5).abs() < 1e-5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Sampler {
    tables: Arc<Tables>,
    level: SimdLevel,
    options: Options,
    leaves: Leaves,
    selection: Selection,
    exact: Option<Box<ExactLeaves>>,
    coefficients: Vec<f64>,
    single: Vec<f32>,
    /// Sum of all leaves' masses.
    mass: f64,
}

/// One number from three channels.
///
/// [`SUM`] is what a renderer that carries colour samples by.
pub type ChannelWeights = [f64; 3];

/// The sum of the channels.
pub const SUM: ChannelWeights = [1.0; 3];

/// The coefficients of a weighted sum of an expansion's channels.
pub fn weigh(expansion: &Expansion, weights: ChannelWeights) -> Vec<f64> {
    let rows = expansion.coefficients().iter();
    rows.map(|rgb| rgb.iter().zip(weights).map(|(value, weight)| value * weight).sum()).collect()
}

impl Sampler {
    /// A sampler of the function with these coefficients, in order l*l + l + m, whose degree is that of the
    /// tables.
    ///
    /// # Errors
    /// If a coefficient is not finite, or the density is zero everywhere.
    ///
    /// # Panics
    /// If the number of coefficients is not that of the degree.
    pub fn new(tables: &Arc<Tables>, coefficients: &[f64], options: Options) -> Result<Self, Error> {
        let grid = tables.grid();
        let is_exact = options.shape == LeafShape::Exact;
        let mut sampler = Self {
            tables: tables.clone(),
            level: SimdLevel::detect(),
            options,
            leaves: Leaves::new(tables, is_exact),
            selection: match options.warp {
                Warp::Rows => Selection::Rows(CellDistribution::new(grid.rows(), grid.columns())),
                Warp::Tree => Selection::Tree(MassTree::default()),
            },
            exact: is_exact.then(|| Box::new(ExactLeaves::new(tables))),
            coefficients: Vec::new(),
            single: Vec::new(),
            mass: 0.0,
        };
        sampler.replace(coefficients)?;
        Ok(sampler)
    }

    /// Takes another function of the same degree, in the memory of the last. After an error the sampler is
    /// to be given another one before it draws.
    ///
    /// # Errors
    /// If a coefficient is not finite, or the density is zero everywhere.
    ///
    /// # Panics
    /// If the number of coefficients is not that of the degree.
    pub fn replace(&mut self, coefficients: &[f64]) -> Result<(), Error> {
        let tables = &*self.tables;
        assert_eq!(coefficients.len(), tables.degree().rows(), "one coefficient for each row");
        let scale = normalise(coefficients)?;
        self.coefficients.clear();
        self.coefficients.extend(coefficients.iter().map(|value| value * scale));
        self.single.clear();
        self.single.extend(self.coefficients.iter().map(|&value| value as f32));
        let Options { density, uniform_share, warp, .. } = self.options;
        let keep_masses = warp == Warp::Tree;
        let how = LeafOptions { density, uniform_share: uniform_share.0, keep_masses };
        let total = match &mut self.selection {
            Selection::Rows(cells) => {
                self.leaves.update(self.level, tables, &self.single, how, &mut cells.sums_mut());
                cells.update()
            }
            Selection::Tree(tree) => {
                let grid = tables.grid();
                let mut masses = vec![0.0; grid.leaves()];
                let mut output = MassRows { values: &mut masses, stride: grid.columns() };
                self.leaves.update(self.level, tables, &self.single, how, &mut output);
                *tree = MassTree::new(grid.rows(), masses);
                tree.total()
            }
        };
        if total <= LEAST_MASS {
            return Err(Error::NoMass);
        }
        self.mass = f64::from(total) / scale;
        if let Some(exact) = &mut self.exact {
            let leaves = &self.leaves;
            let columns = tables.grid().columns();
            exact.update(self.level, tables, &self.coefficients, leaves.floor, |row, column| {
                leaves.sign(row, column, columns)
            });
        }
        Ok(())
    }

    /// The leaves.
    pub fn grid(&self) -> LeafGrid {
        self.tables.grid()
    }

    /// The sum of the masses of all leaves, in the unit of f times sr: the integral of the density before it
    /// is normalised. Leaves of both signs count as what they are drawn with, more than their integral.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// The direction of one point.
    pub fn sample(&self, point: [f32; 2]) -> Sample {
        let (mut directions, mut densities) = ([[0.0; 3]; 1], [0.0; 1]);
        let draw =
            Draw { sampler: self, points: &[point], directions: &mut directions, densities: &mut densities };
        self.level.run_lanes(draw);
        Sample { direction: directions[0], density: densities[0] }
    }

    /// The directions of many points, and the densities with which they are drawn, in 1/sr.
    ///
    /// Runs on the threads of the rayon pool that it is called in; every element is the same for any number
    /// of threads, and the same as from [`Sampler::sample`].
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn sample_into(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]], densities: &mut [f32]) {
        draw_into(points, directions, densities, |points, directions, densities| {
            self.level.run_lanes(Draw { sampler: self, points, directions, densities });
        });
    }

    /// The density with which a direction is drawn, in 1/sr. The direction is a unit vector.
    pub fn density(&self, direction: [f32; 3]) -> f32 {
        let grid = self.grid();
        let place = grid.locate(direction);
        let (row, column) = (place.row, place.column);
        let probability = match &self.selection {
            Selection::Rows(cells) => cells.probability(row, column),
            Selection::Tree(tree) => tree.probability(row, column),
        };
        if probability == 0.0 {
            return 0.0;
        }
        let relative = match (self.shape_of(row, column), &self.exact) {
            (LeafShape::Exact, Some(exact)) => exact.relative_density(row, column, [place.t, place.s]),
            (LeafShape::Bilinear, _) => {
                let corners = self.leaves.corners(row, column, grid.columns());
                bilinear(corners, place.t, place.s)
            }
            _ => 1.0,
        };
        probability * (grid.area() as f32).recip() * relative
    }

    /// The point whose direction this is: the inverse of [`Sampler::sample`], to 1e-5. Of a direction that
    /// is never drawn, the point at which its neighbours meet.
    pub fn invert(&self, direction: [f32; 3]) -> [f32; 2] {
        let grid = self.grid();
        let place = grid.locate(direction);
        let (row, column) = (place.row, place.column);
        let (t, s) = (place.t, place.s);
        let rest = match (self.shape_of(row, column), &self.exact) {
            (LeafShape::Exact, Some(exact)) => exact.invert(row, column, [t, s]),
            (LeafShape::Bilinear, _) => {
                let [a, b, c, d] = self.leaves.corners(row, column, grid.columns());
                let (west, east) = (a + (c - a) * t, b + (d - b) * t);
                [share_below(a + b, c + d, t), share_below(west, east, s)]
            }
            _ => [t, s],
        };
        let rest = rest.map(|rest| rest.clamp(0.0, BELOW_ONE));
        match &self.selection {
            Selection::Rows(cells) => cells.invert(row, column, rest),
            Selection::Tree(tree) => tree.invert(row, column, rest),
        }
    }

    /// [`Sampler::invert`] of many directions.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn invert_into(&self, directions: &[[f32; 3]], points: &mut [[f32; 2]]) {
        map_into(directions, points, |direction| self.invert(direction));
    }

    /// The sign of f at directions: 1 or -1. With [`Density::Absolute`], sign over density times
    /// [`Sampler::mass`] is the weight that makes the samples of a signed f unbiased where leaves are exact,
    /// f over density everywhere.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn signs_into(&self, directions: &[[f32; 3]], signs: &mut [f32]) {
        let basis = Basis::new(self.tables.degree());
        map_into(directions, signs, |direction| self.sign(&basis, direction));
    }

    /// The sign of f in a leaf, or at the direction if the leaf has both.
    fn sign(&self, basis: &Basis, direction: [f32; 3]) -> f32 {
        let (place, columns) = (self.grid().locate(direction), self.grid().columns());
        if !self.leaves.is_flat(place.row, place.column, columns) {
            return self.leaves.sign(place.row, place.column, columns);
        }
        let mut harmonics = vec![0.0; self.coefficients.len()];
        let [x, y, z] = direction.map(f64::from);
        basis.evaluate_into(Direction::normalised(DVec3::new(x, y, z)), &mut harmonics);
        let value: f64 = harmonics.iter().zip(&self.coefficients).map(|(y, f)| y * f).sum();
        if value < 0.0 { -1.0 } else { 1.0 }
    }

    /// The density inside one leaf.
    fn shape_of(&self, row: usize, column: usize) -> LeafShape {
        if self.leaves.is_flat(row, column, self.grid().columns()) {
            LeafShape::Flat
        } else {
            self.options.shape
        }
    }
}

/// Returns one over the largest coefficient: the density does not depend on the scale, and single precision
/// has less range.
pub(crate) fn normalise(coefficients: &[f64]) -> Result<f64, Error> {
    let (mut sums, mut largest) = ([0.0f64; 8], [0.0f64; 8]);
    for chunk in coefficients.chunks(8) {
        for ((sum, largest), value) in sums.iter_mut().zip(&mut largest).zip(chunk) {
            *sum += value;
            *largest = largest.max(value.abs());
        }
    }
    let largest = largest.iter().fold(0.0f64, |a, &b| a.max(b));
    if !sums.iter().sum::<f64>().is_finite()
        && let Some(row) = coefficients.iter().position(|value| !value.is_finite())
    {
        let l = row.isqrt();
        let m = row as isize - (l * l + l) as isize;
        return Err(Error::NotFinite { l, m, value: coefficients[row] });
    }
    let scale = largest.recip();
    if !scale.is_finite() || largest == 0.0 {
        return Err(Error::NoMass);
    }
    Ok(scale)
}

/// The bilinear density through four corners (north-west, north-east, south-west, south-east) over its mean.
#[inline(always)]
pub(crate) fn bilinear([a, b, c, d]: [f32; 4], t: f32, s: f32) -> f32 {
    let (west, east) = (a + (c - a) * t, b + (d - b) * t);
    4.0 * (west + (east - west) * s) / ((a + b) + (c + d))
}

/// The share of a linear density from a to b that lies below x in [0, 1].
pub(crate) fn share_below(a: f32, b: f32, x: f32) -> f32 {
    x * (2.0 * a + (b - a) * x) / (a + b)
}

/// Draws points, [`ABREAST`] at a time.
struct Draw<'a> {
    sampler: &'a Sampler,
    points: &'a [[f32; 2]],
    directions: &'a mut [[f32; 3]],
    densities: &'a mut [f32],
}

impl WithLanes for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<L: Lanes>(self, lanes: L) {
        let Self { sampler, points, directions, densities } = self;
        let mut drawn = Drawn::new();
        let mut scratch = sampler.exact.as_ref().map(|_| Scratch::new());
        let outputs = directions.chunks_mut(ABREAST).zip(densities.chunks_mut(ABREAST));
        for (points, (directions, densities)) in points.chunks(ABREAST).zip(outputs) {
            let mut inside = [[0.0; 2]; ABREAST];
            for (to, from) in inside.iter_mut().zip(points) {
                for axis in 0..2 {
                    // NaN becomes 0.
                    to[axis] = from[axis].max(0.0).clamp(0.0, BELOW_ONE);
                }
            }
            match &sampler.selection {
                Selection::Rows(cells) => cells.draw(lanes, &inside[..points.len()], &mut drawn),
                Selection::Tree(tree) => tree.draw(&inside[..points.len()], &mut drawn),
            }
            sampler.finish(lanes, scratch.as_mut(), &drawn, directions, densities);
        }
    }
}

/// Where points are in their leaves.
struct PlacesInLeaves {
    /// The fraction of each point's leaf that lies north of it.
    t: [f32; ABREAST],
    /// The fraction of each point's leaf that lies west of it.
    s: [f32; ABREAST],
    /// The density at each point, relative to the mean of its leaf.
    relative: [f32; ABREAST],
}

impl Sampler {
    /// Takes leaves and the remainders of the uniforms to directions.
    #[inline(always)]
    fn finish<L: Lanes>(
        &self,
        lanes: L,
        scratch: Option<&mut Scratch>,
        drawn: &Drawn,
        directions: &mut [[f32; 3]],
        densities: &mut [f32],
    ) {
        let grid = self.grid();
        let count = directions.len();
        let [t, s] = drawn.rest;
        let mut places = PlacesInLeaves { t, s, relative: [1.0; ABREAST] };
        match (self.options.shape, &self.exact, scratch) {
            (LeafShape::Bilinear, ..) => self.place_bilinear(drawn, &mut places),
            (LeafShape::Exact, Some(exact), Some(scratch)) => {
                self.place_exact(lanes, exact, scratch, drawn, count, &mut places);
            }
            _ => {}
        }
        let PlacesInLeaves { mut t, mut s, mut relative } = places;
        let [margin_t, margin_s] = grid.margins();
        let inverse_area = (grid.area() as f32).recip();
        for i in 0..ABREAST {
            t[i] = t[i].max(margin_t).min(1.0 - margin_t);
            s[i] = s[i].max(margin_s).min(1.0 - margin_s);
            relative[i] *= drawn.probabilities[i] * inverse_area;
        }
        let mut all = [[0.0f32; ABREAST]; 3];
        for i in 0..ABREAST {
            let [x, y, z] = grid.direction(drawn.rows[i], drawn.columns[i], t[i], s[i]);
            (all[0][i], all[1][i], all[2][i]) = (x, y, z);
        }
        for i in 0..count {
            directions[i] = [all[0][i], all[1][i], all[2][i]];
        }
        densities.copy_from_slice(&relative[..count]);
    }

    #[inline(always)]
    fn place_bilinear(&self, drawn: &Drawn, places: &mut PlacesInLeaves) {
        let PlacesInLeaves { t, s, relative } = places;
        let columns = self.grid().columns();
        let mut corners = [[0.0f32; ABREAST]; 4];
        for i in 0..ABREAST {
            let (row, column) = (drawn.rows[i] as usize, drawn.columns[i] as usize);
            let values = self.leaves.corners(row, column, columns);
            for k in 0..4 {
                corners[k][i] = values[k];
            }
        }
        for i in 0..ABREAST {
            let [a, b, c, d] = [corners[0][i], corners[1][i], corners[2][i], corners[3][i]];
            t[i] = invert_linear(a + b, c + d, t[i]);
            let (west, east) = (a + (c - a) * t[i], b + (d - b) * t[i]);
            s[i] = invert_linear(west, east, s[i]);
            relative[i] = 4.0 * (west + (east - west) * s[i]) / ((a + b) + (c + d));
        }
    }

    #[inline(always)]
    fn place_exact<L: Lanes>(
        &self,
        lanes: L,
        exact: &ExactLeaves,
        scratch: &mut Scratch,
        drawn: &Drawn,
        count: usize,
        places: &mut PlacesInLeaves,
    ) {
        let PlacesInLeaves { t, s, relative } = places;
        let columns = self.grid().columns();
        let mut chosen = [0; ABREAST];
        let mut chosen_count = 0;
        for i in 0..count {
            if !self.leaves.is_flat(drawn.rows[i] as usize, drawn.columns[i] as usize, columns) {
                chosen[chosen_count] = i;
                chosen_count += 1;
            }
        }
        for chosen in chosen[..chosen_count].chunks(WIDTH) {
            let (mut cells, mut rest) = ([(0, 0); WIDTH], [[0.0; WIDTH]; 2]);
            for i in 0..WIDTH {
                // Those that are missing repeat the last point.
                let of = chosen[i.min(chosen.len() - 1)];
                cells[i] = (drawn.rows[of] as usize, drawn.columns[of] as usize);
                (rest[0][i], rest[1][i]) = (drawn.rest[0][of], drawn.rest[1][of]);
            }
            let found = exact.draw(lanes, scratch, &cells, &rest);
            for (i, &of) in chosen.iter().enumerate() {
                (t[of], s[of], relative[of]) = (found[0][i], found[1][i], found[2][i]);
            }
        }
    }
}
