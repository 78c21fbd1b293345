//! How far the taps of a material are from a sum over the pixels of an environment.
//!
//! Views are those of a ball that a distant camera sees, from every side: the direction of reflection is
//! uniform over the sphere, and the squared sine of the angle between normal and view is uniform. Errors are
//! in stops,
//! |log2((taps + e) / (sum + e))| with e = 1 % of the environment's mean radiance, of each colour by itself.

use std::f64::consts::{PI, TAU};

use brdf::{LightSum, Material};
use envmap::Environment;
use rayon::prelude::*;
use sh::{Light, Stop, Stopped};
use sphere::{DVec3, Direction, LatLong, spiral};

use crate::fit::{lobe_width, turns as fit_turns};
use crate::{FacetTable, ScaleSpace, SurfaceFrame, TapTable};

/// The radiance that counts as black, as a share of an environment's mean.
const BLACK_SHARE: f64 = 0.01;

/// A pixel that is this many times brighter than the mean stays a point of its own.
const BRIGHT: f64 = 6.0;

/// The rows of the pixels that bright points are taken from, and of all others.
const ROWS: [usize; 2] = [256, 128];

/// The width of a highlight, in radians, from which the points of a cell may count as one.
const WIDE: f64 = 0.2;

/// The angle from R, in radians, from which they may for any highlight.
const FAR: f64 = 0.45;

/// An environment as points of light: what an error is measured against.
#[derive(Clone, Debug, PartialEq)]
pub struct LightPoints {
    /// The direction and the flux, RGB, of each point.
    points: Vec<([f32; 3], [f32; 3])>,
}

/// A point of light.
#[derive(Clone, Copy, Debug)]
struct Point {
    direction: DVec3,
    flux: [f64; 3],
}

/// Points of light that lie close together.
#[derive(Clone, Debug)]
struct Cell {
    /// All of them at their mean direction.
    whole: Point,
    /// Whether one of them is bright, so that it shows where a highlight is dark.
    is_bright: bool,
    points: Vec<Point>,
}

impl LightPoints {
    /// The points of an environment: its pixels, joined to 256 rows where it is bright and to 128 elsewhere.
    ///
    /// # Errors
    /// If the environment cannot be resampled.
    pub fn new(environment: &Environment) -> Result<Self, envmap::Error> {
        let fine = LatLong::with_rows(ROWS[0].min(environment.grid().height.max(2)));
        let pixels = environment.downsampled(fine)?;
        let integral = pixels.integral();
        let mean = integral.iter().sum::<f64>() / (12.0 * PI);
        let coarse = LatLong::with_rows((fine.height / 2).max(1));
        let mut sums = vec![(DVec3::ZERO, [0.0_f64; 3]); coarse.len()];
        let mut points = Vec::new();
        for (index, rgb) in pixels.pixels().iter().enumerate() {
            let (row, column) = (index / fine.width, index % fine.width);
            let solid_angle = fine.solid_angle(row);
            let direction = fine.direction(row, column).vector();
            let flux = rgb.map(|value| f64::from(value) * solid_angle);
            if rgb.iter().map(|value| f64::from(*value)).sum::<f64>() > 3.0 * BRIGHT * mean {
                points.push((direction.as_vec3().to_array(), flux.map(|flux| flux as f32)));
                continue;
            }
            let (direction_sum, sum) = &mut sums
                [(row / 2).min(coarse.height - 1) * coarse.width + (column / 2).min(coarse.width - 1)];
            *direction_sum += direction * solid_angle;
            (0..3).for_each(|channel| sum[channel] += flux[channel]);
        }
        for (direction, flux) in sums {
            if let Some(direction) = direction.try_normalize().filter(|_| flux != [0.0; 3]) {
                points.push((direction.as_vec3().to_array(), flux.map(|flux| flux as f32)));
            }
        }
        Ok(Self { points })
    }

    /// Points with these directions and fluxes; `None` if a number is not finite or a direction not of length
    /// 1.
    pub fn from_points(points: Vec<([f32; 3], [f32; 3])>) -> Option<Self> {
        let is_sound = |(direction, flux): &([f32; 3], [f32; 3])| {
            let length: f32 = direction.iter().map(|value| value * value).sum();
            (length - 1.0).abs() < 1e-4 && flux.iter().all(|value| value.is_finite())
        };
        points.iter().all(is_sound).then_some(Self { points })
    }

    /// The direction and the flux, RGB, of each point.
    pub fn points(&self) -> &[([f32; 3], [f32; 3])] {
        &self.points
    }

    /// The points by the cells of 64 rows.
    fn cells(&self) -> Vec<Cell> {
        let grid = LatLong::with_rows(64);
        let mut cells: Vec<(Vec<Point>, DVec3)> = vec![(Vec::new(), DVec3::ZERO); grid.len()];
        for (direction, flux) in &self.points {
            let direction = DVec3::from_array(direction.map(f64::from));
            let (column, row) = grid.position(Direction::normalised(direction));
            let column = (column.round().max(0.0) as usize) % grid.width;
            let row = (row.round().max(0.0) as usize).min(grid.height - 1);
            let (points, sum) = &mut cells[row * grid.width + column];
            let flux = flux.map(f64::from);
            *sum += direction * flux.iter().map(|value| value.abs()).sum::<f64>();
            points.push(Point { direction, flux });
        }
        let bright = BRIGHT * 12.0 * PI * self.mean() / self.points.len().max(1) as f64;
        let is_bright = |point: &Point| point.flux.iter().sum::<f64>() > bright;
        let cell = |(points, sum): (Vec<Point>, DVec3)| {
            let flux = points.iter().fold([0.0; 3], |sum, point| {
                std::array::from_fn(|channel| sum[channel] + point.flux[channel])
            });
            let whole = Point { direction: sum.try_normalize()?, flux };
            Some(Cell { whole, is_bright: points.iter().any(is_bright), points })
        };
        cells.into_iter().filter_map(cell).collect()
    }

    /// The mean radiance over the sphere and the three colours.
    fn mean(&self) -> f64 {
        self.points.iter().flat_map(|(_, flux)| flux).map(|value| f64::from(*value)).sum::<f64>()
            / (12.0 * PI)
    }
}

/// An error in stops.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accuracy {
    /// The error that 95 of 100 views stay below.
    pub p95: f64,
    /// The error that 99 of 100 views stay below.
    pub p99: f64,
}

/// A number of taps and of lights, and the error with them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trade {
    /// The index of the table.
    pub table: usize,
    /// J, the look-ups in the levels of the scale space.
    pub taps: usize,
    /// The lights beside the scale space.
    pub lights: usize,
    /// The error.
    pub accuracy: Accuracy,
}

impl Trade {
    /// What a pixel costs, in floating-point operations: 20 a tap and 35 a light.
    pub fn cost(&self) -> usize {
        20 * self.taps + 35 * self.lights
    }

    /// The cheapest whose errors [p95, p99] are at most `accept`, in stops; if there is none, the one that
    /// misses it least.
    pub fn cheapest(found: &[Self], accept: [f64; 2]) -> Option<Self> {
        let excess = |trade: &Self| trade.accuracy.excess(accept);
        let enough = found.iter().filter(|trade| excess(trade) <= 1.0);
        let least = enough.min_by(|a, b| a.cost().cmp(&b.cost()).then(excess(a).total_cmp(&excess(b))));
        least.or_else(|| found.iter().min_by(|a, b| excess(a).total_cmp(&excess(b)))).copied()
    }
}

impl Accuracy {
    /// How many times the errors are those that are accepted, [p95, p99] in stops; the larger ratio.
    pub fn excess(self, [p95, p99]: [f64; 2]) -> f64 {
        (self.p95 / p95.max(1e-9)).max(self.p99 / p99.max(1e-9))
    }
}

/// The taps of a material, by the angle between normal and view ([`TapTable`]) or by the whole view
/// ([`FacetTable`]).
pub trait Taps: Sync {
    /// The number J of look-ups in the levels.
    fn count(&self) -> usize;

    /// The radiance of a surface toward a view in the world, RGB; the lights beside the scale space are not
    /// in it.
    fn reflected(&self, light: &ScaleSpace, frame: SurfaceFrame, view: Direction) -> [f64; 3];
}

impl Taps for TapTable {
    fn count(&self) -> usize {
        self.taps()
    }

    fn reflected(&self, light: &ScaleSpace, frame: SurfaceFrame, view: Direction) -> [f64; 3] {
        self.radiance(light, frame.normal(), view)
    }
}

impl Taps for FacetTable {
    fn count(&self) -> usize {
        self.taps()
    }

    fn reflected(&self, light: &ScaleSpace, frame: SurfaceFrame, view: Direction) -> [f64; 3] {
        self.radiance(light, frame, view)
    }
}

/// A normal, a tangent and the direction toward the viewer.
#[derive(Clone, Copy, Debug)]
struct BallView {
    normal: DVec3,
    tangent: DVec3,
    view: DVec3,
}

/// A material under an environment, toward many views, by sums over points of light.
#[derive(Clone, Debug)]
pub struct Truth {
    views: Vec<BallView>,
    radiance: Vec<[f64; 3]>,
    dark: f64,
    /// The turns over which a view is averaged; 1 if each surface is turned in a way of its own.
    turns: usize,
}

impl Truth {
    /// The sums toward `count` views, in the mean over all turns of the surface about its normal. Each takes
    /// rho_hat at every point of light.
    ///
    /// # Errors
    /// If the work was stopped.
    pub fn new(
        light: &LightPoints,
        material: &Material,
        count: usize,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        Self::summed(light, material, count, fit_turns(material), lobe_width(material), stop)
    }

    /// The sums toward `count` views of surfaces that are turned about their normals in all ways, for taps
    /// that know the tangent: [`FacetTable`].
    ///
    /// # Errors
    /// If the work was stopped.
    pub fn turned(
        light: &LightPoints,
        material: &Material,
        count: usize,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        Self::summed(light, material, count, 1, material.highlight_width(), stop)
    }

    fn summed(
        light: &LightPoints,
        material: &Material,
        count: usize,
        turns: usize,
        width: f64,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        let views: Vec<BallView> = (0..count).map(|index| ball_view(index, count)).collect();
        let cells = light.cells();
        // A streak is narrow far from R too.
        let far = if fit_turns(material) > 1 { PI } else { FAR };
        let far = if width >= WIDE { 2.0 } else { math::cos(far) };
        let radiance = |view: &BallView| {
            stop.check()?;
            let r = 2.0 * view.normal.dot(view.view) * view.normal - view.view;
            let points = cells.iter().flat_map(|cell| {
                let is_whole = !cell.is_bright && r.dot(cell.whole.direction) < far;
                if is_whole { std::slice::from_ref(&cell.whole) } else { &cell.points }
            });
            Ok(reflected(material, view, turns, points.copied()))
        };
        let radiance = views.par_iter().map(radiance).collect::<Result<_, Stopped>>()?;
        Ok(Self { views, radiance, dark: BLACK_SHARE * light.mean(), turns })
    }

    /// The error of taps that look into a scale space, with the lights beside it reflected by the material.
    pub fn error(&self, table: &impl Taps, light: &ScaleSpace, material: &Material) -> Accuracy {
        self.error_with(table, light, &self.reflected_lights(light.lights(), material))
    }

    /// The errors of each table with each number of the scale space's lights beside it, the others being in
    /// it: all tables with the first number of lights, then with the next.
    ///
    /// # Errors
    /// If the work was stopped.
    pub fn trade(
        &self,
        tables: &[&impl Taps],
        counts: &[usize],
        light: &ScaleSpace,
        material: &Material,
        stop: Stop<'_>,
    ) -> Result<Vec<Trade>, Stopped> {
        let mut found = Vec::with_capacity(tables.len() * counts.len());
        for count in counts {
            stop.check()?;
            let light = light.keeping(*count);
            let lights = self.reflected_lights(light.lights(), material);
            found.extend(tables.iter().enumerate().map(|(index, table)| Trade {
                table: index,
                taps: table.count(),
                lights: light.lights().len(),
                accuracy: self.error_with(*table, &light, &lights),
            }));
        }
        Ok(found)
    }

    /// What the material reflects of lights toward each view.
    fn reflected_lights(&self, lights: &[Light], material: &Material) -> Vec<[f64; 3]> {
        let width = material.highlight_width();
        let points: Vec<Point> = lights.iter().flat_map(|light| light_points(light, width)).collect();
        self.views
            .par_iter()
            .map(|view| reflected(material, view, self.turns, points.iter().copied()))
            .collect()
    }

    fn error_with(&self, table: &impl Taps, light: &ScaleSpace, lights: &[[f64; 3]]) -> Accuracy {
        let views = self.views.par_iter().zip(&self.radiance).zip(lights);
        let stops = views.map(|((view, truth), lights)| {
            let [normal, tangent, toward] = [view.normal, view.tangent, view.view].map(Direction::normalised);
            let taps = table.reflected(light, SurfaceFrame::new(normal, tangent), toward);
            std::array::from_fn(|channel| {
                let found = (taps[channel] + lights[channel]).max(0.0);
                math::log2((found + self.dark) / (truth[channel].max(0.0) + self.dark)).abs()
            })
        });
        let stops: Vec<[f64; 3]> = stops.collect();
        let mut stops = stops.into_flattened();
        stops.sort_by(f64::total_cmp);
        let at = |share: f64| stops.get((share * stops.len() as f64) as usize).copied().unwrap_or(0.0);
        Accuracy { p95: at(0.95), p99: at(0.99) }
    }
}

/// The points of a light for a material with highlights of a width, each with its flux.
fn light_points(light: &Light, width: f64) -> Vec<Point> {
    let flux = light.flux();
    let point = |(direction, share): (Direction, f64)| Point {
        direction: direction.vector(),
        flux: flux.map(|flux| flux * share),
    };
    light.points(width).into_iter().map(point).collect()
}

/// The view of an index: directions of reflection on a spiral, angles and turns by low-discrepancy sequences.
fn ball_view(index: usize, count: usize) -> BallView {
    let r = spiral(index, count).vector();
    // The plastic number's sequence fills the square evenly with the spiral's order.
    let [a, b] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_2];
    let part = |step: f64| (0.5 + step * index as f64).fract();
    let theta = math::asin(part(a).sqrt());
    let (u, w) = r.any_orthonormal_pair();
    let (y, x) = math::sin_cos(TAU * part(b));
    let (s, c) = math::sin_cos(theta);
    let normal = r * c + (u * x + w * y) * s;
    // The golden ratio's sequence turns the surface.
    let (y, x) = math::sin_cos(TAU * part(0.618_033_988_749_894_9));
    let (u, w) = normal.any_orthonormal_pair();
    BallView { normal, tangent: u * x + w * y, view: 2.0 * normal.dot(r) * normal - r }
}

/// The radiance of a surface toward a view under points of light, in the mean over some turns about its
/// normal.
fn reflected(
    material: &Material,
    view: &BallView,
    turns: usize,
    points: impl Iterator<Item = Point>,
) -> [f64; 3] {
    let z = view.normal;
    let across = (view.view - z.dot(view.view) * z).try_normalize();
    // An isotropic material is not turned: so that the sum is the same with its own tangent and without.
    let is_turned = turns == 1 && !material.is_isotropic();
    let x = if is_turned { view.tangent } else { across.unwrap_or_else(|| z.any_orthonormal_vector()) };
    let y = z.cross(x);
    let local = |v: DVec3| Direction::from_unit(DVec3::new(v.dot(x), v.dot(y), v.dot(z)));
    let outgoing = local(view.view);
    let mut sum = LightSum::new(material, turns, outgoing);
    for Point { direction, flux } in points {
        sum.add(local(direction), flux);
    }
    sum.total()
}

#[cfg(test)]
mod tests {
    use brdf::{Fresnel, Ggx, Microfacet};

    use super::*;

    /// Cells that count as one point change a sum by less than a hundredth of a stop.
    #[test]
    fn cells_far_from_the_highlight_are_as_good_as_their_points() {
        let grid = LatLong::with_rows(256);
        let texel = |index: usize| {
            let (row, column) = (index / grid.width, index % grid.width);
            let lamp = row % 50 == 20 && column % 90 < 3;
            [if lamp { 500.0 } else { 0.2 + ((row * 7 + column * 3) % 11) as f32 }; 3]
        };
        let sky = Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap();
        let light = LightPoints::new(&sky).unwrap();
        let point = |(direction, flux): &([f32; 3], [f32; 3])| Point {
            direction: DVec3::from_array(direction.map(f64::from)),
            flux: flux.map(f64::from),
        };
        let copper = Fresnel::Conductor { n: [0.27, 0.68, 1.32], k: [3.61, 2.63, 2.29] };
        let ggx = |roughness| Material::Ggx(Ggx::new(roughness, copper, [1.0; 3]).unwrap());
        let facets = Material::Microfacet(Microfacet::new(0.1, [1.0; 3]).unwrap());
        for material in [ggx(0.15), ggx(0.3), ggx(0.7), facets] {
            let truth = Truth::new(&light, &material, 100, Stop::NEVER).unwrap();
            for (view, found) in truth.views.iter().zip(&truth.radiance) {
                let all = reflected(&material, view, 1, light.points.iter().map(point));
                let stops = ((found[0] + truth.dark) / (all[0] + truth.dark)).log2().abs();
                assert!(stops < 0.01, "{material:?}: {stops}");
            }
        }
    }

    #[test]
    fn the_cheapest_that_is_accurate_enough_is_chosen() {
        let trade =
            |taps, lights, p95, p99| Trade { table: 0, taps, lights, accuracy: Accuracy { p95, p99 } };
        let found = [
            trade(1, 0, 0.6, 0.9),
            trade(6, 0, 0.2, 0.4),
            trade(6, 1, 0.08, 0.2),
            trade(4, 2, 0.09, 0.2),
            trade(8, 0, 0.09, 0.26),
            trade(6, 2, 0.05, 0.1),
        ];
        let cheapest = |accept| Trade::cheapest(&found, accept).map(|found| (found.taps, found.lights));
        // 20 J + 35 n: 150 for four taps and two lights, 155 for six and one.
        assert_eq!(cheapest([0.1, 0.25]), Some((4, 2)));
        assert_eq!(cheapest([0.085, 0.25]), Some((6, 1)));
        assert_eq!(cheapest([1.0, 1.0]), Some((1, 0)));
        // If none is, it is the one that misses least.
        assert_eq!(cheapest([0.01, 0.02]), Some((6, 2)));
        assert_eq!(Trade::cheapest(&[], [0.1, 0.25]), None);
    }
}
