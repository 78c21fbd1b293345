//! What a surface reflects of a small light in the mean over some views: a function of the angle between the
//! light and the central direction alone.
//!
//! By the theorem of Funk and Hecke it turns a lighting's series into that of the mean reflection,
//!
//! > B_lm = L_lm times 2 pi times the integral of g(theta) P_l(cos theta) sin(theta) dtheta,
//!
//! with g the mean of rho_hat over the views. A disk of light is reflected by the mean of g over the disk.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use brdf::{Centre, Material, SurfaceView, ViewValues};
use rayon::prelude::*;
use sh::{Degree, Expansion, Light};
use sphere::Direction;

use crate::plain::Plain;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The mean of rho_hat over some views, by the angle between light and central direction.
#[derive(Debug)]
pub struct MeanLobe {
    of_point: Zonal,
}

/// A function of the angle to an axis: linear between nodes in the sine of half that angle, which is half the
/// distance of both.
#[derive(Debug)]
struct Zonal {
    nodes: Arc<Nodes>,
    values: Vec<[f64; 3]>,
}

/// The nodes of a [`Zonal`].
#[derive(Debug)]
struct Nodes {
    angles: Vec<f64>,
    sines: Vec<f64>,
    /// The last node at or before k / [`BUCKETS`], squared.
    before: Vec<usize>,
}

/// The means over the disks of some lights as sums over values of any lobe: what does not depend on the
/// material, so that a caller may keep it for all materials.
#[derive(Debug, Default)]
pub struct DiskMeans(Vec<DiskMean>);

/// The mean over a disk of a function of the angle to an axis, at nodes of the angle of the disk's centre.
#[derive(Debug)]
struct DiskMean {
    nodes: Arc<Nodes>,
    /// For each node, where its points begin and the sum of their weights.
    starts: Vec<(usize, f64)>,
    points: Vec<DiskPoint>,
}

/// A part of a mean.
#[derive(Clone, Copy, Debug)]
struct DiskPoint {
    /// The value is between that of node k and the next one, at this share of the way.
    k: usize,
    share: f64,
    weight: f64,
}

/// Lights that a [`MeanLobe`] reflects.
pub struct MeanLight {
    /// The direction, the flux and the lobe of each light.
    lights: Vec<(Direction, [f64; 3], Zonal)>,
}

impl MeanLobe {
    /// The mean over the views that a plain reflection map stands for: see
    /// [`Reflection::plain`](crate::Reflection::plain).
    pub fn plain(material: &Material, plain: Plain) -> Self {
        Self::new(material, &plain_views(material.centre(), plain))
    }

    /// The mean over all views at an angle theta_o from the central direction.
    pub fn ring(material: &Material, theta: f64) -> Self {
        let views: Vec<_> =
            graded(AZIMUTHS).map(|(phi, share)| (Direction::from_angles(theta, phi), share)).collect();
        Self::new(material, &views)
    }

    /// The mean over views of half a turn of azimuths: the other half is its mirror image.
    fn new(material: &Material, views: &[(Direction, f64)]) -> Self {
        let nodes = Arc::new(Nodes::of_lobe());
        let (centre, turns) = (material.centre(), material.turns());
        let (seen, weights): (Vec<SurfaceView>, Vec<f64>) =
            views.iter().map(|(view, weight)| (centre.toward(*view), *weight)).unzip();
        let incident: Vec<_> = nodes.angles.iter().map(|angle| Direction::from_angles(*angle, 0.0)).collect();
        let has_horizon = material.has_horizon();
        // Sums over fixed groups of views, so that the number of threads changes no bit.
        let of_views = |(views, weights): (&[SurfaceView], &[f64])| {
            let (mut sums, mut rho) = (vec![[0.0; 3]; incident.len()], ViewValues::default());
            for (view, weight) in views.iter().zip(weights) {
                rho.fill(view, &incident, has_horizon, |outgoing, incident, values| {
                    material.means_over_turns(turns, outgoing, incident, values);
                });
                for (sum, rho) in sums.iter_mut().zip(rho.values()) {
                    (0..3).for_each(|channel| sum[channel] += weight * rho[channel]);
                }
            }
            sums
        };
        let parts = seen.par_chunks(VIEWS).zip(weights.par_chunks(VIEWS)).map(of_views);
        let mut values = vec![[0.0; 3]; incident.len()];
        for part in parts.collect::<Vec<_>>() {
            for (value, part) in values.iter_mut().zip(part) {
                (0..3).for_each(|channel| value[channel] += part[channel]);
            }
        }
        Self { of_point: Zonal { nodes, values } }
    }

    /// The lobe of these lights: the mean over the disk of each, which is a function of one angle too.
    pub fn of(&self, lights: &[Light]) -> MeanLight {
        self.over(lights, &DiskMeans::new(lights))
    }

    /// [`MeanLobe::of`] with the means over the disks of these lights.
    pub fn over(&self, lights: &[Light], disks: &DiskMeans) -> MeanLight {
        let of_light = |(light, disk): (&Light, &DiskMean)| {
            (light.direction, light.flux(), disk.of(&self.of_point.values))
        };
        MeanLight { lights: lights.par_iter().zip(&disks.0).map(of_light).collect() }
    }

    /// The reflection of a lighting's series, to this degree or its own.
    ///
    /// Between nodes, which are 0.02 radians apart at most, the lobe is taken as linear. Tests: within 1e-3
    /// of the mean of the material's projection, for highlights of roughness 0.3 and more.
    pub fn reflect(&self, lighting: &Expansion, degree: Degree) -> Expansion {
        let mut field = lighting.to_degree(degree.min(lighting.degree()));
        let factors = self.factors(field.degree().get());
        for (l, factor) in factors.iter().enumerate() {
            for row in &mut field.coefficients_mut()[l * l..(l + 1) * (l + 1)] {
                (0..3).for_each(|channel| row[channel] *= factor[channel]);
            }
        }
        field
    }

    /// 2 pi times the integral of g P_l, l = 0 ..= degree.
    fn factors(&self, degree: usize) -> Vec<[f64; 3]> {
        let mut factors = vec![[0.0; 3]; degree + 1];
        // Two nodes of Gauss on each step, between whose ends g is linear.
        for (ends, values) in self.of_point.nodes.angles.windows(2).zip(self.of_point.values.windows(2)) {
            let (middle, half) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
            for side in [-1.0, 1.0] {
                let share = 0.5 + 0.5 * side / 3.0_f64.sqrt();
                let theta: f64 = middle + side * half / 3.0_f64.sqrt();
                let weight = TAU * half * math::sin(theta);
                let g: [f64; 3] =
                    std::array::from_fn(|c| weight * (values[0][c] + share * (values[1][c] - values[0][c])));
                let (x, mut before, mut p) = (math::cos(theta), 0.0, 1.0);
                for (l, factor) in factors.iter_mut().enumerate() {
                    (0..3).for_each(|channel| factor[channel] += p * g[channel]);
                    let l = l as f64;
                    (before, p) = (p, ((2.0 * l + 1.0) * x * p - l * before) / (l + 1.0));
                }
            }
        }
        factors
    }
}

impl Zonal {
    fn at(&self, sine: f64) -> [f64; 3] {
        let (k, share) = self.nodes.place(sine);
        self.between(k, share)
    }

    /// The value at a share of the way from a node to the next one.
    fn between(&self, k: usize, share: f64) -> [f64; 3] {
        between(&self.values, k, share)
    }
}

fn between(values: &[[f64; 3]], k: usize, share: f64) -> [f64; 3] {
    let [a, b] = [values[k], values[k + 1]];
    std::array::from_fn(|channel| a[channel] + share * (b[channel] - a[channel]))
}

impl Nodes {
    fn new(angles: Vec<f64>) -> Self {
        let sines: Vec<f64> = angles.iter().map(|angle| math::sin(angle / 2.0)).collect();
        let bucket = |k: usize| math::powi(k as f64 / BUCKETS as f64, 2);
        let before = (0..=BUCKETS).map(|k| sines.partition_point(|sine| *sine <= bucket(k)) - 1).collect();
        Self { angles, sines, before }
    }

    /// The nodes of every [`MeanLobe`].
    fn of_lobe() -> Self {
        let mut angles = angles(1e-4, 0.04, 0.02);
        // The horizon of a surface that is seen by its normal.
        angles.insert(angles.partition_point(|angle| *angle < PI / 2.0), PI / 2.0);
        Self::new(angles)
    }

    /// The node before a sine, and the share of the way to the next one.
    fn place(&self, sine: f64) -> (usize, f64) {
        let mut k = self.before[((sine.sqrt() * BUCKETS as f64) as usize).min(BUCKETS)];
        while k + 2 < self.sines.len() && self.sines[k + 1] <= sine {
            k += 1;
        }
        let k = k.min(self.sines.len() - 2);
        (k, self.share(k, sine))
    }

    /// The share of the way from a node to the next one.
    fn share(&self, k: usize, sine: f64) -> f64 {
        ((sine - self.sines[k]) / (self.sines[k + 1] - self.sines[k])).clamp(0.0, 1.0)
    }
}

impl DiskMeans {
    /// The means over the disks of these lights.
    pub fn new(lights: &[Light]) -> Self {
        let nodes = Nodes::of_lobe();
        Self(lights.par_iter().map(|light| DiskMean::new(&nodes, light.radius)).collect())
    }

    /// The bytes that they take.
    pub fn bytes(&self) -> usize {
        self.0.iter().map(|disk| size_of_val(&disk.points[..])).sum()
    }
}

impl DiskMean {
    /// The integral over circles about the axis, of which the disk of this radius holds an arc in closed
    /// form. It has nodes where the function has them, and others that are dense about the edge.
    fn new(function: &Nodes, radius: f64) -> Self {
        let mut angles = function.angles.clone();
        if radius > 0.0 {
            // Further away than twice the radius, what the disk sees varies as slowly as the function itself.
            let near = function.angles.iter().take_while(|angle| **angle <= radius);
            let edge = near.flat_map(|angle| [radius - angle, radius + angle, PI - radius + angle]);
            angles.extend(edge.filter(|angle| *angle > 0.0 && *angle < PI));
            angles.sort_by(f64::total_cmp);
            angles.dedup_by(|a, b| *a - *b < 1e-5);
        }
        let (mut starts, mut points) = (Vec::new(), Vec::new());
        for angle in &angles {
            let start = points.len();
            starts.push((start, function.over_disk(radius, *angle, &mut points)));
        }
        Self { nodes: Arc::new(Nodes::new(angles)), starts, points }
    }

    /// The mean of a function with these values at the nodes of [`MeanLobe`].
    fn of(&self, values: &[[f64; 3]]) -> Zonal {
        let ends = self.starts.iter().skip(1).map(|(start, _)| *start).chain([self.points.len()]);
        let mean = |((start, whole), end): (&(usize, f64), usize)| {
            let mut sum = [0.0; 3];
            for DiskPoint { k, share, weight } in &self.points[*start..end] {
                let value = between(values, *k, *share);
                (0..3).for_each(|channel| sum[channel] += weight * value[channel]);
            }
            sum.map(|sum| sum / whole)
        };
        Zonal { nodes: Arc::clone(&self.nodes), values: self.starts.iter().zip(ends).map(mean).collect() }
    }
}

impl Nodes {
    /// Adds the points of the mean over the disk of this radius whose centre is at an angle from the axis.
    /// Returns the sum of their weights.
    fn over_disk(&self, radius: f64, away: f64, points: &mut Vec<DiskPoint>) -> f64 {
        let start = points.len();
        let mut whole = 0.0;
        if radius >= 1e-6 {
            let (lowest, highest) = ((away - radius).max(0.0), (away + radius).min(PI));
            // Within this circle the disk is whole, or it begins there.
            let edge = (away - radius).abs();
            let circles = Circles::new(radius, away);
            let first = self.angles.partition_point(|angle| *angle <= lowest).max(1) - 1;
            for k in first..self.angles.len() - 1 {
                let (from, to) = (self.angles[k].max(lowest), self.angles[k + 1].min(highest));
                if to <= from {
                    break;
                }
                let middle = edge.clamp(from, to);
                for (from, to) in [(from, middle), (middle, to)] {
                    let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
                    if half <= 0.0 {
                        continue;
                    }
                    let is_smooth =
                        [lowest, edge, highest].iter().all(|end| (end - centre).abs() > 3.0 * half);
                    for &(place, weight) in if is_smooth { &GAUSS[..] } else { &GAUSS_AT_ENDS[..] } {
                        let (sine, arc) = circles.arc(centre + half * place);
                        let weight = weight * half * arc;
                        points.push(DiskPoint { k, share: self.share(k, sine), weight });
                        whole += weight;
                    }
                }
            }
        }
        if whole > 0.0 {
            return whole;
        }
        points.truncate(start);
        let (k, share) = self.place(math::sin(away / 2.0));
        points.push(DiskPoint { k, share, weight: 1.0 });
        1.0
    }
}

/// Gauss's two points on [-1, 1] and their weights.
const GAUSS: [(f64, f64); 2] = [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];

/// Gauss's four points in an angle u from 0 to pi, in which arcs that begin as a square root are smooth:
/// cos u, and the weight of the point times pi / 2 sin u.
const GAUSS_AT_ENDS: [(f64, f64); 4] = [
    (-0.976_304_574_079_488_9, 0.118_243_460_573_327_3),
    (-0.509_015_785_495_715_6, 0.881_748_653_655_532_7),
    (0.509_015_785_495_715_6, 0.881_748_653_655_532_7),
    (0.976_304_574_079_488_9, 0.118_243_460_573_327_3),
];

/// The circles about the axis, of which a disk holds arcs.
struct Circles {
    /// sin^2(radius / 2).
    disk: f64,
    /// The angle from the axis to the centre of the disk: its sine, and sine and cosine of half of it.
    sine: f64,
    half: (f64, f64),
}

impl Circles {
    fn new(radius: f64, away: f64) -> Self {
        let half = math::sin_cos(away / 2.0);
        Self { disk: math::powi(math::sin(radius / 2.0), 2), sine: 2.0 * half.0 * half.1, half }
    }

    /// The sine of half an angle, and half the length of the arc that the disk holds of the circle at this
    /// angle from the axis: by haversines, hav(radius) = hav(angle - away) + sin(angle) sin(away) hav(arc).
    fn arc(&self, angle: f64) -> (f64, f64) {
        let (sine, cosine) = math::sin_cos(angle / 2.0);
        let apart = sine * self.half.1 - cosine * self.half.0;
        let size = 2.0 * sine * cosine;
        let (rest, whole) = (self.disk - apart * apart, size * self.sine);
        let arc = if rest >= whole { PI } else { 2.0 * math::asin((rest / whole).max(0.0).sqrt()) };
        (sine, size * arc)
    }
}

impl MeanLight {
    /// The radiance of the lights from a surface with this central direction.
    pub fn radiance(&self, central: Direction) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (direction, flux, lobe) in &self.lights {
            let rho = lobe.at(0.5 * central.vector().distance(direction.vector()));
            (0..3).for_each(|channel| sum[channel] += flux[channel] * rho[channel]);
        }
        sum
    }
}

/// Parts of the square root of the sine, each of which has a node or two.
const BUCKETS: usize = 1024;

/// Angles from the central direction, dense about it: steps of `share` of the angle, from `least` to `most`.
pub(crate) fn angles(least: f64, share: f64, most: f64) -> Vec<f64> {
    let mut angles = vec![0.0];
    let mut angle: f64 = 0.0;
    while angle < PI {
        angle = (angle + (share * angle).clamp(least, most)).min(PI);
        angles.push(angle);
    }
    angles
}

/// The index k and the share of an angle between two of a table's angles k and k + 1.
pub(crate) fn place(angles: &[f64], angle: f64) -> (usize, f64) {
    let k = angles.partition_point(|node| *node <= angle).clamp(1, angles.len() - 1) - 1;
    (k, ((angle - angles[k]) / (angles[k + 1] - angles[k])).clamp(0.0, 1.0))
}

/// Views that one thread sums: a ring has work for several.
const VIEWS: usize = 8;

/// Azimuths of views over half a turn.
const AZIMUTHS: usize = 40;

/// Rows of the views of a mean.
const ROWS: usize = 64;

/// Nodes from 0 to pi and their weights, which sum to 1: closer together toward both ends, where highlights
/// of grazing views are narrow.
fn graded(count: usize) -> impl Iterator<Item = (f64, f64)> + Clone {
    (0..count).map(move |j| {
        let turn = TAU * (j as f64 + 0.5) / count as f64;
        (0.5 * (turn - math::sin(turn)), (1.0 - math::cos(turn)) / count as f64)
    })
}

/// The views that a plain map stands for and their weights, which sum to 1: as `plain.rs` has them.
fn plain_views(centre: Centre, plain: Plain) -> Vec<(Direction, f64)> {
    let ring = |theta: f64, weight: f64| {
        graded(AZIMUTHS).map(move |(phi, share)| (Direction::from_angles(theta, phi), weight * share))
    };
    match (plain, centre) {
        (Plain::HeadOn, Centre::Tangent) => ring(PI / 2.0, 1.0).collect(),
        (Plain::HeadOn, _) => vec![(Direction::Z, 1.0)],
        (Plain::Mean, Centre::Normal) => {
            // The half turn of the nodes as the quarter turn of theta_o.
            let rows = graded(ROWS).map(|(angle, weight)| (angle / 2.0, weight * math::sin(angle)));
            normalised(rows.collect()).into_iter().flat_map(|(theta, weight)| ring(theta, weight)).collect()
        }
        (Plain::Mean, centre) => {
            let power = if centre == Centre::Tangent { 2 } else { 1 };
            let rows =
                graded(ROWS).map(|(theta, weight)| (theta, weight * math::powi(math::sin(theta), power)));
            normalised(rows.collect()).into_iter().flat_map(|(theta, weight)| ring(theta, weight)).collect()
        }
    }
}

/// Scales weights to a sum of 1.
fn normalised(rows: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let sum: f64 = rows.iter().map(|row| row.1).sum();
    rows.into_iter().map(|(theta, weight)| (theta, weight / sum)).collect()
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Ggx, KajiyaKay, Lambert, Phong, project};
    use sh::Stop;

    use super::*;
    use crate::Reflection;

    /// A lighting with every degree up to 12.
    fn lighting() -> Expansion {
        let degree = Degree::new(12).unwrap();
        let value = |row: usize| ((row * 37 % 101) as f64 / 50.0 - 1.0) / (1.0 + row as f64).sqrt();
        let rows = (0..degree.rows()).map(|row| [value(row), value(row + 5), value(row + 11)]);
        Expansion::from_coefficients(degree, rows.collect()).unwrap()
    }

    #[test]
    fn the_reflection_of_a_series_is_that_of_the_materials_projection() {
        let metal = brdf::Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
        let materials = [
            Material::Lambert(Lambert::new([0.8, 0.4, 0.1]).unwrap()),
            Material::Phong(Phong::new(12.0, [1.0, 0.8, 0.5]).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(16.0, [1.0, 0.5, 0.2]).unwrap()),
            Material::Ggx(Ggx::new(0.3, metal, [1.0; 3]).unwrap()),
            Material::Ggx(Ggx::new(0.8, metal, [1.0; 3]).unwrap()),
        ];
        let lighting = lighting();
        for material in materials {
            let brdf = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
            let expected = Reflection::convolve(&lighting, &brdf).plain(Plain::Mean);
            let found = MeanLobe::plain(&material, Plain::Mean).reflect(&lighting, Degree::MAX);
            let size =
                expected.coefficients().as_flattened().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            let pairs =
                expected.coefficients().as_flattened().iter().zip(found.coefficients().as_flattened());
            let worst = pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            assert!(worst < 1e-3 * size, "{}: {worst} of {size}", material.name());
        }
    }
}
