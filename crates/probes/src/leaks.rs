//! Light that leaks: what surfaces take from probes that cannot see them.
//!
//! Engines blend the eight probes around a place whether there is a wall between them or not. The measure is
//! taken at points of the surfaces: the share of the blend's weight that belongs to probes from which no
//! light can come to the point, because something is in between. Light itself has no part in it.

use glam::Vec3;
use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::lit_probes::corner_weights;
use crate::places::{ProbePlaces, Repair};
use crate::random::hash;
use crate::surfaces::Surfaces;
use crate::volume::{Lattice, Volume};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 0;

/// How probes are blended at a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// By place and visibility, as [`crate::LitProbes::irradiance`] does.
    Visible,
    /// three.js from revision 187 on: by the place half a spacing in front of the surface, in the first box
    /// of cells that contains that place; outside of the outer probes by the nearest place between them.
    Three,
    /// Bevy: by the point's own place, in the mean of all boxes of cells that contain it.
    Bevy,
}

impl Blend {
    /// All blends.
    pub const ALL: [Self; 3] = [Self::Three, Self::Bevy, Self::Visible];

    /// The word for it in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Three => "three",
            Self::Bevy => "bevy",
            Self::Visible => "visible",
        }
    }

    /// The name that people read.
    pub fn label(self) -> &'static str {
        match self {
            Self::Three => "three.js 187",
            Self::Bevy => "Bevy",
            Self::Visible => "by visibility, as shade-vertices and export-gltf",
        }
    }
}

/// The points of surfaces at which leaks are measured if nobody says how many.
pub const LEAK_POINTS: usize = 2000;

/// A point of a surface, and what it takes from probes that cannot see it.
#[derive(Clone, Debug, PartialEq)]
pub struct Leak {
    /// The point, in metres.
    pub point: [f32; 3],
    /// Its normal, of length 1.
    pub normal: [f32; 3],
    /// The share of the weight of probes that cannot see the point.
    pub share: f32,
    /// These probes with their weights, the largest first. A probe without light of its own is not among
    /// them: those that fill it are.
    pub probes: Vec<(u32, f32)>,
}

/// What leaks at points of the surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Leaks {
    /// The points that are lit, evenly spread over the area of the surfaces in volumes.
    pub points: Vec<Leak>,
    /// How many points more were left out: no valid probe within two cells sees them, as on the bottom of a
    /// crate, or on the outer side of a wall.
    pub hidden: usize,
}

impl Leaks {
    /// The mean share of all points; 0 if there are none.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.points.iter().map(|leak| f64::from(leak.share)).sum();
        sum / self.points.len().max(1) as f64
    }

    /// The points at which most leaks, the worst first.
    pub fn worst(&self) -> Vec<&Leak> {
        let mut points: Vec<&Leak> = self.points.iter().filter(|leak| leak.share > 0.0).collect();
        points.sort_by(|a, b| b.share.total_cmp(&a.share));
        points
    }
}

/// How many points are tried for each that is asked for: surfaces outside of volumes have none.
const TRIES: usize = 16;

/// How many points are tried between two questions whether to stop.
const BLOCK: usize = 64;

/// Measures what leaks at `count` points of the surfaces, or fewer if most of them are outside of volumes.
///
/// The points are spread evenly over the area, on fronts, and on both sides of what is double-sided; they
/// depend on the surfaces and volumes alone. Uses all threads; the result does not depend on their number.
///
/// # Errors
/// If it was stopped.
pub fn leaks(
    surfaces: &Surfaces<'_>,
    places: &ProbePlaces,
    blend: Blend,
    count: usize,
    stop: Stop<'_>,
) -> Result<Leaks, Stopped> {
    let points = lit_points(surfaces, places, blend, count, stop)?;
    let measured: Vec<Option<Leak>> = points
        .into_par_iter()
        .map(|(point, weights)| {
            stop.check()?;
            Ok(leak(surfaces, places, &point, weights))
        })
        .collect::<Result<_, Stopped>>()?;
    let all = measured.len();
    let points: Vec<Leak> = measured.into_iter().flatten().collect();
    Ok(Leaks { hidden: all - points.len(), points })
}

/// Points with the probes that light them: the first `count` that are in a volume.
fn lit_points(
    surfaces: &Surfaces<'_>,
    places: &ProbePlaces,
    blend: Blend,
    count: usize,
    stop: Stop<'_>,
) -> Result<Vec<(Point, Weights)>, Stopped> {
    let points = SurfacePoints::new(surfaces);
    let mut lit = Vec::new();
    let (mut tried, most) = (0, TRIES.saturating_mul(count));
    while tried < most && lit.len() < count {
        let end = tried.saturating_add(count).min(most);
        let block = |block: usize| {
            stop.check()?;
            let first = tried + block * BLOCK;
            let points = (first..end.min(first + BLOCK)).filter_map(|index| points.get(index as u64));
            let weighed = points.map(|point| (point, blend.weights(places, &point)));
            Ok(weighed.filter(|(_, weights)| !weights.is_empty()).collect())
        };
        let blocks = (0..(end - tried).div_ceil(BLOCK)).into_par_iter().map(block);
        let found = blocks.collect::<Result<Vec<Vec<_>>, Stopped>>()?;
        lit.extend(found.into_iter().flatten());
        tried = end;
    }
    lit.truncate(count);
    Ok(lit)
}

/// Probes with their weights.
type Weights = Vec<(u32, f32)>;

/// A place on a surface.
#[derive(Clone, Copy, Debug)]
struct Point {
    at: Vec3,
    normal: Vec3,
    /// How far in front of it rays start.
    clearance: f32,
}

impl Point {
    fn is_seen_from(&self, surfaces: &Surfaces<'_>, probe: [f32; 3]) -> bool {
        let start = self.at + self.normal * self.clearance;
        let way = Vec3::from(probe) - start;
        let distance = way.length();
        distance == 0.0 || surfaces.between(start, way / distance, distance).is_some()
    }
}

/// Points of surfaces, evenly spread over their area, without end.
///
/// The sequence is that of multiples of the powers of the number g with g^4 = g + 1 (Roberts 2018, "The
/// unreasonable effectiveness of quasirandom sequences"): one coordinate chooses the triangle, two the place.
struct SurfacePoints<'a> {
    surfaces: &'a Surfaces<'a>,
    /// The area of the triangles up to each one.
    areas: Vec<f64>,
}

/// The inverse of the number with g^4 = g + 1.
const STEP: f64 = 0.819_172_513_396_164_4;

impl<'a> SurfacePoints<'a> {
    fn new(surfaces: &'a Surfaces<'a>) -> Self {
        let area = |triangle: u32| f64::from(surfaces.twice_normal(triangle).length());
        let areas = (0..surfaces.parts.triangles.len() as u32).scan(0.0, |sum, triangle| {
            *sum += area(triangle);
            Some(*sum)
        });
        Self { surfaces, areas: areas.collect() }
    }

    /// The point with an index; `None` if there are no triangles.
    fn get(&self, k: u64) -> Option<Point> {
        let coordinate = |step: f64| (0.5 + k as f64 * step).fract();
        let all = *self.areas.last()?;
        let area = all * coordinate(STEP);
        let triangle = self.areas.partition_point(|end| *end <= area).min(self.areas.len() - 1) as u32;
        let [mut u, mut v] =
            [coordinate(STEP * STEP), coordinate(STEP * STEP * STEP)].map(|coordinate| coordinate as f32);
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let [a, b, c] = self.surfaces.parts.triangles[triangle as usize].map(Vec3::from);
        let at = a + (b - a) * u + (c - a) * v;
        let mut normal = self.surfaces.twice_normal(triangle).normalize_or_zero();
        if self.surfaces.material(triangle).is_double_sided && hash(k) & 1 == 1 {
            normal = -normal;
        }
        Some(Point { at, normal, clearance: self.surfaces.caster.clearance(triangle, at) })
    }
}

impl Blend {
    /// The probes that light a point, with weights that sum to 1; none if it is in no volume.
    fn weights(self, places: &ProbePlaces, point: &Point) -> Weights {
        let mut first = 0;
        let mut sum = Weights::new();
        let mut boxes = 0;
        for volume in places.volumes() {
            let spacing = Vec3::from(volume.spacing());
            let (at, is_inside) = match self {
                Self::Visible => (point.at, volume.contains(point.at)),
                Self::Three => {
                    let at = point.at + 0.5 * spacing * point.normal;
                    (at, cells_contain(volume, at, 0.01))
                }
                Self::Bevy => (point.at, cells_contain(volume, point.at, 0.0)),
            };
            if is_inside {
                boxes += 1;
                if self == Self::Visible {
                    return corner_weights(places, at, point.normal).unwrap_or_default();
                }
                sum.extend(volume.corners(at).map(|(index, _, weight)| ((first + index) as u32, weight)));
                if self == Self::Three {
                    break;
                }
            }
            first += volume.len();
        }
        let share = 1.0 / boxes.max(1) as f32;
        sum.iter_mut().for_each(|(_, weight)| *weight *= share);
        sum
    }
}

/// Whether a place is in the box that has a cell for each probe, or nearer to it than `margin` cells.
fn cells_contain(volume: &Volume, at: Vec3, margin: f32) -> bool {
    let margin = margin + if volume.lattice == Lattice::Corners { 0.5 } else { 0.0 };
    let spacing = volume.spacing();
    (0..3).all(|axis| {
        let [least, most] = volume.bounds.map(|end| end[axis]);
        let margin = margin * spacing[axis];
        (least - margin..=most + margin).contains(&at[axis])
    })
}

/// What leaks at a point that probes light with some weights; `None` if no probe near it sees it.
fn leak(surfaces: &Surfaces<'_>, places: &ProbePlaces, point: &Point, of: Weights) -> Option<Leak> {
    let mut weights = Weights::new();
    for (probe, weight) in of {
        match &places.repairs()[probe as usize] {
            Repair::None | Repair::Moved => weights.push((probe, weight)),
            Repair::Filled(sources) => {
                weights.extend(sources.iter().map(|(source, share)| (*source, weight * share)));
            }
            Repair::Lost(source) => weights.push((*source, weight)),
        }
    }
    weights.sort_by_key(|(probe, _)| *probe);
    let mut probes: Weights = weights
        .chunk_by(|one, other| one.0 == other.0)
        .map(|own| (own[0].0, own.iter().map(|(_, weight)| weight).sum()))
        .filter(|(_, weight)| *weight > 0.0)
        .collect();
    let all = probes.len();
    let is_seen = |probe: u32| point.is_seen_from(surfaces, places.positions()[probe as usize]);
    probes.retain(|(probe, _)| !is_seen(*probe));
    if probes.len() == all && !near(places, point.at).any(is_seen) {
        return None;
    }
    probes.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    Some(Leak {
        point: point.at.to_array(),
        normal: point.normal.to_array(),
        share: probes.iter().map(|(_, weight)| weight).sum::<f32>().min(1.0),
        probes,
    })
}

/// The valid probes within two cells of a point, in all volumes that it is in.
fn near(places: &ProbePlaces, at: Vec3) -> impl Iterator<Item = u32> + '_ {
    let mut first = 0;
    places.volumes().iter().flat_map(move |volume| {
        let own = first;
        first += volume.len();
        let (cell, _) = volume.around(at);
        let steps = (0..64).map(|k| [k % 4 - 1, k / 4 % 4 - 1, k / 16 - 1]);
        steps
            .filter(move |_| cells_contain(volume, at, 0.5))
            .filter_map(move |step| volume.neighbour(cell, step))
            .map(move |index| own + index)
            .filter(|probe| places.is_valid(*probe))
            .map(|probe| probe as u32)
    })
}
