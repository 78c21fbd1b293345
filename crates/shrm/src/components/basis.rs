//! The functions of the view that a material's reflection is a sum of: its principal components.
//!
//! About the central direction an isotropic material has no preferred azimuth. So the covariance of what it
//! reflects, over all turns of the light, is one matrix over the angles theta_v for each order m of the
//! azimuth; each eigenvector g is a component g(theta_v) if m = 0, otherwise two of equal weight, with cos(m
//! phi) and sin(m phi).
//!
//! The covariance is that of two families of light, of which neither knows an environment; their traces are
//! made equal. The first is points of light
//! from everywhere, each in an ambient of .03, .1 and .3 of its flux, whose reflections are divided by their
//! mean over the views: so a component counts by what it changes in stops. The second is light whose
//! harmonics are independent with variances (l + 1)^-3, as photographs have them.

use std::f64::consts::{PI, SQRT_2};

use brdf::{Centre, Material, TableError};
use sh::Degree;

use super::eigen::eigenvectors;
use super::lobes::{AZIMUTHS, Lobes, PointTable};

/// Angles theta_v at which components are held.
pub const RADII: usize = 16;

/// The most components of a basis.
pub const MAX_COMPONENTS: usize = 24;

/// The highest order m that a component may have.
const ORDERS: usize = 12;

/// The degree of the light of the second family.
const DEGREE: usize = 64;

/// The ambient light's flux, as shares of the point's.
const AMBIENT: [f64; 3] = [0.03, 0.1, 0.3];

/// The components of a material, the greatest first.
///
/// They are orthonormal in the mean over views as a ball shows them to a distant camera, for which the
/// squared sine of theta_v is uniform: the mean of w_j w_k over the 16 radii is 1 if j = k, otherwise 0. As
/// an integral it is so within a few percent, or a tenth for those that are steep near the horizon.
#[derive(Clone, Debug, PartialEq)]
pub struct ComponentBasis {
    pub(super) centre: Centre,
    pub(super) components: Vec<Component>,
}

/// A function of the view: g(r) times cos(m phi), or sin(m phi).
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// The order m of the azimuth.
    pub order: usize,
    /// Whether it has the sine of m phi.
    pub sine: bool,
    /// The variance of the material's reflections along this component, as a share of all.
    pub share: f64,
    /// g at the radii (i + 1/2) / 16, r = sqrt(1 - cos(theta_v)).
    pub radial: [f64; RADII],
}

/// The radii of the disc at which components are held.
pub(super) fn radii() -> [f64; RADII] {
    std::array::from_fn(|i| (i as f64 + 0.5) / RADII as f64)
}

/// The angle theta_v of a radius.
pub(super) fn angle_of(radius: f64) -> f64 {
    math::acos(1.0 - radius * radius)
}

/// The shares of the views at each of the [`radii`], of a ball that a distant camera sees.
pub(super) fn shares() -> [f64; RADII] {
    // The squared sine is 1 - (1 - r^2)^2.
    let shares = radii().map(|r| r * (1.0 - r * r));
    let sum: f64 = shares.iter().sum();
    shares.map(|share| share / sum)
}

impl ComponentBasis {
    /// The first components of a material, at most [`MAX_COMPONENTS`].
    ///
    /// # Errors
    /// If the material has a value that is not finite.
    pub fn of(material: &Material) -> Result<Self, TableError> {
        let angles = radii().map(angle_of);
        let degree = Degree::new(DEGREE).unwrap_or(Degree::MAX);
        let lobes = Lobes::new(material, &angles, degree, ORDERS)?;
        let mut by_order = [points(&PointTable::new(material, &angles)), spectrum(&lobes)];
        for family in &mut by_order {
            let trace: f64 = (0..=ORDERS).map(|m| signs(m) * trace(&family[m])).sum();
            family.iter_mut().flatten().for_each(|value| *value /= trace.max(f64::MIN_POSITIVE));
        }
        let (root, mut found) = (shares().map(f64::sqrt), Vec::new());
        for m in 0..=ORDERS {
            let entry = |index: usize| 0.5 * (by_order[0][m][index] + by_order[1][m][index]);
            for (value, vector) in eigenvectors(RADII, (0..RADII * RADII).map(entry).collect()) {
                let norm = if m == 0 { 1.0 } else { SQRT_2 };
                let radial = std::array::from_fn(|i| norm * vector[i] / root[i]);
                found.push(Component { order: m, sine: false, share: value, radial });
            }
        }
        found.sort_by(|a, b| b.share.total_cmp(&a.share));
        let mut components = Vec::with_capacity(MAX_COMPONENTS + 1);
        // A component of less than this is rounding; but a black material has one, too.
        let counts = |(index, component): &(usize, Component)| *index == 0 || component.share > 1e-9;
        for (_, component) in found.into_iter().enumerate().filter(counts) {
            let pair = component.order > 0;
            if components.len() + 1 + usize::from(pair) > MAX_COMPONENTS {
                break;
            }
            components.push(component.clone());
            if pair {
                components.push(Component { sine: true, ..component });
            }
        }
        Ok(Self { centre: material.centre(), components })
    }

    /// The kind of the central directions that the views are seen about: reflection vectors or normals.
    pub fn centre(&self) -> Centre {
        self.centre
    }

    /// The components, the greatest first.
    pub fn components(&self) -> &[Component] {
        &self.components
    }

    /// The numbers of first components that do not part the two of one order, from 1.
    pub fn counts(&self) -> impl Iterator<Item = usize> {
        let parts = |count: usize| {
            let [last, next] = [self.components.get(count - 1), self.components.get(count)];
            last.is_some_and(|last| last.order > 0 && !last.sine) && next.is_some_and(|next| next.sine)
        };
        (1..=self.components.len()).filter(move |count| !parts(*count))
    }

    /// Returns the basis with its first components alone.
    #[must_use]
    pub fn first(&self, count: usize) -> Self {
        Self { centre: self.centre, components: self.components.iter().take(count).cloned().collect() }
    }

    /// The values of all components at a place (x, y) of the disc, whose radius is sqrt(1 - cos(theta_v)):
    /// cubic in the radius, exact in the azimuth. Slightly past the rim they go on smoothly.
    pub fn at(&self, [x, y]: [f64; 2]) -> Vec<f64> {
        let r = math::hypot(x, y);
        let [cosine, sine] = if r > 0.0 { [x / r, y / r] } else { [1.0, 0.0] };
        let mut turns = [[1.0, 0.0]; ORDERS + 1];
        for m in 1..=ORDERS {
            let [c, s] = turns[m - 1];
            turns[m] = [c * cosine - s * sine, s * cosine + c * sine];
        }
        let cubic = Cubic::new(r.min(1.1));
        let value =
            |component: &Component| cubic.of(component) * turns[component.order][usize::from(component.sine)];
        self.components.iter().map(value).collect()
    }

    /// The components as textures of `edge` x `edge` texels, shape [components, edge, edge]: column c has its
    /// centre at x = 2 (c + 1/2) / edge - 1 on the disc, row r at y = 2 (r + 1/2) / edge - 1. Texels past the
    /// rim continue the function there, so that bilinear look-ups on the rim are right.
    pub fn textures(&self, edge: usize) -> Vec<f32> {
        let mut texels = vec![0.0; self.components.len() * edge * edge];
        for index in 0..edge * edge {
            let place = |at: usize| 2.0 * (at as f64 + 0.5) / edge as f64 - 1.0;
            for (k, value) in self.at([place(index % edge), place(index / edge)]).into_iter().enumerate() {
                texels[k * edge * edge + index] = value as f32;
            }
        }
        texels
    }
}

/// Lagrange's cubic through the four nodes about a radius; through the pole, a function of order m goes on
/// with the sign (-1)^m.
struct Cubic {
    first: isize,
    weights: [f64; 4],
}

impl Cubic {
    fn new(radius: f64) -> Self {
        let place = radius * RADII as f64 - 0.5;
        let first = (place.floor() as isize - 1).min(RADII as isize - 4);
        let x = place - first as f64;
        let [a, b, c, d] = [x, x - 1.0, x - 2.0, x - 3.0];
        Self { first, weights: [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0] }
    }

    fn of(&self, component: &Component) -> f64 {
        let node = |index: isize| match usize::try_from(index) {
            Ok(index) => component.radial[index],
            // Node -1 is the mirror image of node 0.
            Err(_) if component.order.is_multiple_of(2) => component.radial[(-1 - index) as usize],
            Err(_) => -component.radial[(-1 - index) as usize],
        };
        (0..).zip(self.weights).map(|(step, weight)| weight * node(self.first + step)).sum()
    }
}

/// How many components a function of one order makes.
fn signs(m: usize) -> f64 {
    if m == 0 { 1.0 } else { 2.0 }
}

fn trace(matrix: &[f64]) -> f64 {
    (0..RADII).map(|i| matrix[i * RADII + i]).sum()
}

/// Adds a function's square, weighted by the shares of views, to a matrix.
fn add_square(matrix: &mut [f64], weight: f64, values: &[f64; RADII], root: &[f64; RADII]) {
    for i in 0..RADII {
        for j in 0..RADII {
            matrix[i * RADII + j] += weight * values[i] * root[i] * values[j] * root[j];
        }
    }
}

/// The covariance of points of light in an ambient, by order.
fn points(table: &PointTable) -> Vec<Vec<f64>> {
    let (shares, angles) = (shares(), &table.angles);
    let root = shares.map(f64::sqrt);
    let mut found = vec![vec![0.0; RADII * RADII]; ORDERS + 1];
    // cos(m phi) times the weight of the node: half at both ends of the half turn.
    let cosine = |m: usize, azimuth: usize| {
        let ends = if azimuth == 0 || azimuth == AZIMUTHS { 0.5 } else { 1.0 };
        ends / AZIMUTHS as f64 * math::cos(PI * (m * azimuth) as f64 / AZIMUTHS as f64)
    };
    let cosines: Vec<f64> = (0..=ORDERS).flat_map(|m| (0..=AZIMUTHS).map(move |a| cosine(m, a))).collect();
    // The solid angle of the ring of a node, as a share of the sphere.
    let ring = |k: usize| {
        let edge = |low: usize| math::cos(0.5 * (angles[low] + angles[low + 1]));
        let inner = if k == 0 { 1.0 } else { edge(k - 1) };
        let outer = if k + 1 == angles.len() { -1.0 } else { edge(k) };
        0.5 * (inner - outer)
    };
    for channel in 0..3 {
        let harmonics = |k: usize, m: usize| -> [f64; RADII] {
            let mut sum = [0.0; RADII];
            for azimuth in 0..=AZIMUTHS {
                let values = &table.node(k, azimuth)[channel * RADII..][..RADII];
                let cosine = cosines[m * (AZIMUTHS + 1) + azimuth];
                (0..RADII).for_each(|i| sum[i] += cosine * f64::from(values[i]));
            }
            sum
        };
        let all: Vec<Vec<[f64; RADII]>> =
            (0..angles.len()).map(|k| (0..=ORDERS).map(|m| harmonics(k, m)).collect()).collect();
        // What ambient light of flux 1 gives: a mean over the sphere.
        let mut ambient = [0.0; RADII];
        for (k, harmonics) in all.iter().enumerate() {
            (0..RADII).for_each(|i| ambient[i] += ring(k) * harmonics[0][i]);
        }
        for (k, harmonics) in all.iter().enumerate() {
            for share in AMBIENT {
                let with: [f64; RADII] = std::array::from_fn(|i| harmonics[0][i] + share * ambient[i]);
                let mean: f64 = (0..RADII).map(|i| shares[i] * with[i]).sum();
                if mean <= 0.0 {
                    continue;
                }
                let weight = ring(k) / (mean * mean);
                for (m, matrix) in found.iter_mut().enumerate() {
                    add_square(matrix, weight, if m == 0 { &with } else { &harmonics[m] }, &root);
                }
            }
        }
    }
    found
}

/// The covariance of light with a falling spectrum, by order.
fn spectrum(lobes: &Lobes) -> Vec<Vec<f64>> {
    let root = shares().map(f64::sqrt);
    let mut found = vec![vec![0.0; RADII * RADII]; ORDERS + 1];
    for (m, matrix) in found.iter_mut().enumerate() {
        for l in m..=lobes.degree() {
            let weight = math::powi(l as f64 + 1.0, -3) / signs(m);
            for channel in 0..3 {
                let values: [f64; RADII] = std::array::from_fn(|i| lobes.of(m, l, channel)[i]);
                add_square(matrix, weight, &values, &root);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use brdf::{Fresnel, Ggx, Lambert};

    use super::*;

    fn copper() -> Material {
        let fresnel = Fresnel::Conductor { n: [0.2, 0.92, 1.1], k: [3.91, 2.45, 2.14] };
        Material::Ggx(Ggx::new(0.3, fresnel, [1.0; 3]).unwrap())
    }

    #[test]
    fn components_are_orthonormal_over_the_views_of_a_ball() {
        let basis = ComponentBasis::of(&copper()).unwrap();
        assert!(basis.components().len() >= MAX_COMPONENTS - 1);
        let (rings, azimuths) = (200, 60);
        let count = basis.components().len();
        let mut products = vec![0.0; count * count];
        for ring in 0..rings {
            let cosine = (1.0 - (f64::from(ring) + 0.5) / f64::from(rings)).sqrt();
            let r = (1.0 - cosine).sqrt();
            for azimuth in 0..azimuths {
                let (s, c) = (TAU * f64::from(azimuth) / f64::from(azimuths)).sin_cos();
                let w = basis.at([r * c, r * s]);
                for index in 0..count * count {
                    products[index] += w[index / count] * w[index % count] / f64::from(rings * azimuths);
                }
            }
        }
        // The sum over 16 radii is no exact integral of a component that is steep near the horizon.
        for (index, product) in products[..5 * count].iter().enumerate() {
            let expected = f64::from(index / count == index % count);
            assert!((product - expected).abs() < 0.08, "{} {}: {product}", index / count, index % count);
        }
        for (i, a) in basis.components().iter().enumerate() {
            for (j, b) in basis.components().iter().enumerate() {
                let azimuths = match (a.order == b.order && a.sine == b.sine, a.order) {
                    (false, _) => 0.0,
                    (true, 0) => 1.0,
                    (true, _) => 0.5,
                };
                let sum: f64 = (0..RADII).map(|r| shares()[r] * a.radial[r] * b.radial[r]).sum();
                assert!((azimuths * sum - f64::from(i == j)).abs() < 1e-12, "{i} {j}: {sum}");
            }
        }
        assert!(basis.components().windows(2).all(|pair| pair[0].share >= pair[1].share));
        assert!(
            basis.counts().next() == Some(1) && basis.counts().all(|k| k != 2),
            "{:?}",
            basis.components()[1]
        );
    }

    #[test]
    fn a_matte_surface_has_one_component_that_is_the_same_for_every_view() {
        let basis = ComponentBasis::of(&Material::Lambert(Lambert::new([0.5, 0.3, 0.2]).unwrap())).unwrap();
        assert_eq!((basis.centre(), basis.components().len()), (Centre::Normal, 1));
        for place in [[0.0, 0.0], [0.7, 0.1], [-0.6, 0.8]] {
            assert!((basis.at(place)[0] - 1.0).abs() < 1e-5, "{place:?}: {:?}", basis.at(place));
        }
    }

    #[test]
    fn cubics_are_exact_and_pass_the_pole() {
        for (order, f) in [(0, (|r| 1.0 - r * r) as fn(f64) -> f64), (1, |r| r * (2.0 - r * r))] {
            let radial = radii().map(f);
            let component = Component { order, sine: false, share: 1.0, radial };
            for r in [0.0, 0.01, 0.3, 0.97, 1.0] {
                assert!((Cubic::new(r).of(&component) - f(r)).abs() < 1e-14, "{order} {r}");
            }
        }
    }
}
