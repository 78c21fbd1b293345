//! The light that arrives at points on surfaces, of all reflections, so that one ray of a path finds it
//! there.
//!
//! Ward, Rubinstein and Clear, "A ray tracing solution for diffuse interreflection" (1988), with points that
//! are chosen beforehand and an exact account of reflections. Rays leave each point with the density
//! cosine / pi; where one meets a surface, it is linked to the point that stands for that place
//! ([`crate::surface_points`]). With E_0, the light that arrives at the points straight from sources,
//!
//! > E_k(p) = 1/M sum over the links q of p of albedo(q) E_(k-1)(q)
//!
//! is what arrives after k reflections: a sum over links, which traces no ray, for all columns of the
//! transport at once. Rays that meet no point near enough are stood for by one of them, whose place becomes a
//! point with fewer rays of its own.
//!
//! The light of a point is that of its place alone, so that in the mean over seeds it is blurred over the
//! part of the surface for which a point stands. `tests/reference.rs` has the size of that bias.

use std::f32::consts::FRAC_1_PI;
use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;
use sampling::PointsOfFour;
use sh::{Stop, Stopped};

use crate::bricks::{PointGroups, connected};
use crate::cells::CellGrid;
use crate::material::MOST_ALBEDO;
use crate::paths::{AtPlace, CachedLight, Met, PathRay, Paths, PointOfCache, Visitor, around};
use crate::random::{hash, hash_of, share_of};
use crate::surface_points::{Sequence, SurfacePoints};
use crate::surfaces::{Place, Surfaces};

/// The rays of a point toward the sky for each that finds what it meets: whether anything is in the way takes
/// a fraction of the time.
pub(crate) const SKY_RAYS: u32 = 4;

/// How often it is asked whether to stop, about, while a cache is made.
pub(crate) const STEPS: usize = 64;

/// How often places without a point become points, one after the other.
const GENERATIONS: usize = 4;

/// The share of the light of a point, RMS over all, that may be missing when the rest is taken as a geometric
/// series.
const LEFT_OVER: f64 = 2e-3;

/// The most that a reflection leaves of light, in that series: no albedo is higher.
const MOST_RATIO: f32 = MOST_ALBEDO;

/// The most reflections of the light in the cache.
const MOST_BOUNCES: u32 = 1024;

/// The light of points.
pub(crate) struct Cache {
    points: SurfacePoints,
    /// The mean radiance that arrives at each point, weighted by the cosine, for places that paths come to
    /// first, and for those after one reflection more, if their light has one less: [point, number].
    light: Vec<Vec<f32>>,
    /// Whether the light is that of all reflections, for all places.
    has_all: bool,
    length: usize,
    /// The rays of a point.
    rays: u32,
    /// The groups of the points, if dependencies are to be known.
    pub(crate) groups: Option<PointGroups>,
}

/// How the light of points is computed.
pub(crate) struct CacheOptions<'a> {
    /// The points, at least.
    pub(crate) points: usize,
    /// The rays of a point: a power of two, so that those of neighbouring points are evenly spread together.
    pub(crate) rays: u32,
    pub(crate) seed: u64,
    /// Whether light straight from sources is part of it.
    pub(crate) with_direct: bool,
    /// The channel of each number of a point.
    pub(crate) channels: &'a [u8],
    /// The cells of space, if it is to be known what light at probes depends on.
    pub(crate) cells: Option<&'a CellGrid>,
}

/// Collects the light that arrives at a point straight from sources, in the numbers of a point.
pub(crate) trait PointLight: Visitor {
    /// Whether there is light of the sky, of which there are [`SKY_RAYS`] estimates for each other one.
    const HAS_SKY: bool;

    fn numbers(self) -> Vec<f32>;
}

/// A point with what its rays met.
struct Traced {
    /// The light straight from sources.
    direct: Vec<f32>,
    links: Vec<u32>,
    /// The place that stands for those without a point, its albedo, and its share, which is above 1.
    other: Option<(Place, [f32; 3], [f32; 3])>,
    /// Links whose light is tinted on the way.
    tinted: Vec<(u32, [f32; 3])>,
    /// The rays that found what they met.
    rays: u32,
}

impl Cache {
    /// Traces rays from points of a scene; `light` makes the light of one.
    pub(crate) fn new<L: PointLight>(
        paths: &Paths<'_>,
        options: &CacheOptions<'_>,
        light: impl Fn() -> L + Sync,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        let points = SurfacePoints::new(paths.surfaces, options.points, hash(options.seed));
        let length = options.channels.len();
        let mut next: Vec<(Place, Sequence)> = points.all().collect();
        let mut albedo: Vec<[f32; 3]> =
            next.par_iter().map(|(place, _)| paths.surfaces.albedo(place, points.area)).collect();
        let own = albedo.len();
        let mut traced: Vec<Traced> = Vec::new();
        for generation in 0..=GENERATIONS {
            let rays = if generation == 0 { options.rays } else { (options.rays / 4).max(4) };
            let is_last = generation == GENERATIONS;
            let trace = |(place, (seed, at)): &(Place, Sequence)| {
                // The rays toward the sky alone have the next indices.
                let first = at.wrapping_mul(SKY_RAYS * rays);
                let indices = first..first.wrapping_add(rays);
                paths.trace_point(place, indices, *seed, &points, is_last, light())
            };
            let chunk = |chunk: &[(Place, Sequence)]| {
                stop.check()?;
                Ok(chunk.iter().map(trace).collect())
            };
            let chunks = next.par_chunks(next.len().div_ceil(STEPS).max(1)).map(chunk);
            let found = chunks.collect::<Result<Vec<Vec<Traced>>, Stopped>>()?;
            let mut found: Vec<Traced> = found.into_iter().flatten().collect();
            next.clear();
            for traced in &mut found {
                if let Some((place, own, share)) = traced.other.take() {
                    traced.tinted.push((albedo.len() as u32, share));
                    albedo.push(own);
                    next.push((place, (place_seed(&place, options.seed), 0)));
                }
            }
            traced.extend(found);
            if next.is_empty() {
                break;
            }
        }
        let parts = options.cells.map(|_| parts_of_scene(&traced));
        let mut light = bounced(traced, &albedo, options, paths.bounces, stop)?;
        for light in &mut light {
            light.truncate(own * length);
            light.shrink_to_fit();
        }
        let groups = options.cells.zip(parts).map(|(grid, parts)| {
            let places = points.all().map(|(place, _)| place.position);
            let points: Vec<(u32, Vec3)> = parts.into_iter().zip(places).collect();
            PointGroups::new(grid, &points, |point| {
                let own = light.iter().flat_map(|light| &light[point * length..][..length]);
                hash_of(options.seed, own.copied())
            })
        });
        Ok(Self { points, light, has_all: paths.bounces.is_none(), length, rays: options.rays, groups })
    }

    /// A hash of the sizes of points.
    pub(crate) fn digest(&self) -> u64 {
        hash_of(u64::from(self.rays), [self.points.area, self.points.most])
    }
}

impl CachedLight for Cache {
    fn find(
        &self,
        surfaces: &Surfaces<'_>,
        met: &Met,
        reflections: u32,
        directions: f32,
        visitor: &mut impl Visitor,
    ) -> AtPlace<'_> {
        let Some(light) = self.light.get(if self.has_all { 0 } else { reflections as usize }) else {
            return AtPlace::Nothing;
        };
        if directions * self.points.area * met.cosine > self.rays as f32 * met.distance * met.distance {
            return AtPlace::TooCoarse;
        }
        if let Some((grid, depends)) = visitor.depends() {
            let [least, most] = self.points.box_of_find(surfaces, &met.place);
            depends.cells.add_box(grid, least, most);
        }
        let point = self.points.find(surfaces, &met.place);
        let light = point.and_then(|point| {
            let light = light.get(point * self.length..(point + 1) * self.length)?;
            let group = self.groups.as_ref().and_then(|groups| groups.of.get(point));
            Some(PointOfCache { light, group: group.copied().unwrap_or(0) })
        });
        light.map_or(AtPlace::Nothing, AtPlace::Light)
    }
}

/// For each point the first of those between which light goes, if not straight then by others.
fn parts_of_scene(traced: &[Traced]) -> Vec<u32> {
    let links = traced.iter().zip(0..).flat_map(|(point, own)| {
        let links = point.links.iter().copied().chain(point.tinted.iter().map(|(link, _)| *link));
        links.map(move |link| (own, link))
    });
    connected(traced.len(), links)
}

/// The seed of a point: that of its place.
fn place_seed(place: &Place, seed: u64) -> u64 {
    hash_of(seed, place.position.to_array().into_iter().chain([place.normal.x]))
}

impl Paths<'_> {
    fn trace_point<L: PointLight>(
        &self,
        place: &Place,
        indices: Range<u32>,
        seed: u64,
        points: &SurfacePoints,
        is_last: bool,
        mut light: L,
    ) -> Traced {
        let [directions, shadows] = [0, 1].map(|set| PointsOfFour::new(hash(seed ^ set)));
        let (rays, end) = (indices.len() as u32, indices.end);
        light.reflects(self.surfaces, place, [rays as f32 * FRAC_1_PI; 3]);
        let (mut links, mut tinted) = (Vec::new(), Vec::new());
        let (mut other, mut others, mut lost) = (None, 0.0, 0);
        for index in indices {
            let [u, v, ..] = directions.get(index);
            let mut ray = PathRay {
                origin: place.start(),
                direction: place.normal,
                density: 0.0,
                throughput: [1.0; 3],
                reflections: 1,
                passing: hash(seed ^ (u64::from(index) + 2)),
            };
            self.sample_emitters(place, &ray, shadows.get(index), &mut light);
            ray.leaves(place, u, v);
            let Some(met) = self.meet(&mut ray, &mut light) else { continue };
            match points.find(self.surfaces, &met.place) {
                Some(point) if ray.throughput == [1.0; 3] => links.push(point as u32),
                Some(point) => tinted.push((point as u32, ray.throughput)),
                None if is_last => lost += 1,
                None => {
                    // One of them all, each with the same chance (Vitter, reservoir sampling).
                    others += 1.0;
                    if share_of(hash(ray.passing)) * others < 1.0 {
                        other = Some((met.place, met.albedo, ray.throughput));
                    }
                }
            }
        }
        if L::HAS_SKY {
            for index in end..end.wrapping_add((SKY_RAYS - 1) * rays) {
                let [u, v, ..] = directions.get(index);
                let direction = around(place.normal, u, v);
                if let Some(left) = self.surfaces.between(place.start(), direction, f32::INFINITY) {
                    light.sky(direction, left);
                }
            }
        }
        let other = other.map(|(place, albedo, share)| (place, albedo, share.map(|share| share * others)));
        let mut direct = light.numbers();
        direct.iter_mut().for_each(|number| *number /= rays as f32);
        Traced { direct, links, other, tinted, rays: (rays - lost).max(1) }
    }
}

/// The light of all points of up to `bounces` reflections, of which the last is that at the place of a path;
/// and, unless it is all, of one less.
fn bounced(
    mut traced: Vec<Traced>,
    albedo: &[[f32; 3]],
    options: &CacheOptions<'_>,
    bounces: Option<u32>,
    stop: Stop<'_>,
) -> Result<Vec<Vec<f32>>, Stopped> {
    let length = options.channels.len();
    let mut light: Vec<f32> = Vec::with_capacity(traced.len() * length);
    traced.iter_mut().for_each(|point| light.append(&mut std::mem::take(&mut point.direct)));
    let mut sum = if options.with_direct { light.clone() } else { vec![0.0; light.len()] };
    let mut before = sizes(&light, length);
    let mut next = vec![0.0; light.len()];
    let mut sum_before = vec![0.0; if bounces.is_some() { sum.len() } else { 0 }];
    for reflection in 1..bounces.unwrap_or(MOST_BOUNCES) {
        stop.check()?;
        if bounces.is_some() {
            sum_before.copy_from_slice(&sum);
        }
        light.par_chunks_exact_mut(length).zip(albedo).for_each(|(light, albedo)| {
            for (number, channel) in light.iter_mut().zip(options.channels) {
                *number *= albedo[usize::from(*channel) % 3];
            }
        });
        let row = |at: u32| &light[at as usize * length..][..length];
        next.par_chunks_exact_mut(length).zip(&traced).for_each(|(next, point)| {
            next.fill(0.0);
            for &link in &point.links {
                next.iter_mut().zip(row(link)).for_each(|(sum, number)| *sum += number);
            }
            for (link, share) in &point.tinted {
                let numbers = row(*link).iter().zip(options.channels);
                for (sum, (number, channel)) in next.iter_mut().zip(numbers) {
                    *sum += share[usize::from(*channel) % 3] * number;
                }
            }
            let scale = 1.0 / point.rays as f32;
            next.iter_mut().for_each(|number| *number *= scale);
        });
        std::mem::swap(&mut light, &mut next);
        sum.par_iter_mut().zip(&light).for_each(|(sum, number)| *sum += number);
        if bounces.is_none() && is_step(reflection) {
            let now = sizes(&light, length);
            let rest = rests(&before, &now, &sizes(&sum, length));
            if let Some(rest) = rest {
                for ((sum, light), rest) in
                    sum.chunks_exact_mut(length).zip(light.chunks_exact(length)).zip(rest)
                {
                    sum.iter_mut().zip(light).for_each(|(sum, number)| *sum += rest * number);
                }
                break;
            }
        }
        if bounces.is_none() && is_step(reflection + 1) {
            before = sizes(&light, length);
        }
    }
    Ok(if bounces.is_none() { vec![sum] } else { vec![sum, sum_before] })
}

/// Whether the series may end after so many reflections: a power of two, or half as many more. An edit
/// elsewhere then seldom changes where it ends, and with that the last bits of all light.
fn is_step(reflections: u32) -> bool {
    reflections.is_power_of_two() || reflections.is_multiple_of(3) && (reflections / 3).is_power_of_two()
}

/// The sum of the magnitudes of the numbers of each point.
fn sizes(light: &[f32], length: usize) -> Vec<f32> {
    light.par_chunks_exact(length).map(|light| light.iter().map(|number| number.abs()).sum()).collect()
}

/// How much of the light after the last reflection the light after all further ones is, at each point: that
/// of a geometric series, which it comes close to, in each room with its own ratio. `None` as long as it is
/// not small.
fn rests(before: &[f32], now: &[f32], sum: &[f32]) -> Option<Vec<f32>> {
    let rest = |(before, now): (&f32, &f32)| {
        let ratio = if *now > 0.0 { (now / before).min(MOST_RATIO) } else { 0.0 };
        ratio / (1.0 - ratio)
    };
    let rests: Vec<f32> = before.iter().zip(now).map(rest).collect();
    let (mut squares, mut count) = (0.0, 0.0);
    for ((rest, now), sum) in rests.iter().zip(now).zip(sum) {
        if *sum > 0.0 {
            squares += f64::from(rest * now / sum) * f64::from(rest * now / sum);
            count += 1.0;
        }
    }
    (squares <= LEFT_OVER * LEFT_OVER * count).then_some(rests)
}
