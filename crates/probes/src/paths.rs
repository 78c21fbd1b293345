//! Paths of light from a probe through a scene: every vertex casts shadow rays to small emitters, and the
//! path ends in the sky, in the dark, after a number of reflections, or at random.
//!
//! Light that arrives from the direction w, L(w), is estimated by a path whose first direction is uniform on
//! the sphere. At a matte surface it goes on with the density cosine / pi, which leaves the albedo as the
//! factor of a reflection. After [`ROULETTE_AFTER`] reflections a path ends with the chance 1 - albedo, and
//! what goes on is divided by the chance to do so: the mean stays what it was (Arvo and Kirk, "Particle
//! transport and image synthesis", 1990).
//!
//! With a cache of the light at surfaces, a path ends at the first one: what is left of it is then the
//! choice of a direction. A point of the cache has few rays, so that a path goes on to the next surface if
//! more rays than these come to the same point. It is split there, because the wall next to a probe is half
//! of all that the probe sees, and a ray for each path finds a small window from it no better than the
//! probe's own rays do (Arvo and Kirk again, splitting).

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::Vec3;
use sampling::PointsOfFour;

use crate::bricks::Dependencies;
use crate::cells::CellGrid;
use crate::emitters::Emitters;
use crate::random::hash;
use crate::surfaces::{Place, Surfaces};

/// The reflections after which paths may end at random.
const ROULETTE_AFTER: u32 = 4;

/// The rays of a path that goes on from a surface next to its probe, where the cache is too coarse.
const PARTS: u32 = 4;

/// The reflections whose numbers are prepared.
const PREPARED: usize = 8;

/// The solid angles over which a probe's rays and those of reflections average textures, in steradians: of
/// 4096 rays over the sphere, and of 1024 over a half of it.
const FOOTPRINTS: [f32; 2] = [2.0 * TAU / 4096.0, TAU / 1024.0];

/// What a path brings to a probe: light times the inverse of the density of its first direction.
pub(crate) trait Visitor {
    /// A path begins with a ray in a direction.
    fn begin(&mut self, direction: Vec3);

    /// A share of the radiance of the sky in a direction, RGB, arrives from the first direction.
    fn sky(&mut self, direction: Vec3, share: [f32; 3]);

    /// A share of the radiance of an emitter arrives from the first direction after some reflections.
    fn emission(&mut self, column: usize, share: [f32; 3], reflections: u32);

    /// A share of the radiance of an emitter arrives from another direction, without a reflection.
    fn emission_from(&mut self, direction: Vec3, column: usize, share: [f32; 3]);

    /// A surface reflects: `share` of the irradiance at this place arrives at the probe from the first
    /// direction of the path.
    fn reflects(&mut self, surfaces: &Surfaces<'_>, place: &Place, share: [f32; 3]);

    /// A share of the light of a point of the cache arrives from the first direction.
    fn cached(&mut self, light: &PointOfCache<'_>, share: [f32; 3]);

    /// What the light depends on, if that is to be known.
    fn depends(&mut self) -> Option<(&CellGrid, &mut Dependencies)> {
        None
    }
}

/// Light of points on surfaces, of all reflections that paths may have.
pub(crate) trait CachedLight {
    /// The light of the point that stands for the place that a ray met after some reflections; `directions`
    /// is how many rays from the same place there are in a steradian.
    fn find(
        &self,
        surfaces: &Surfaces<'_>,
        met: &Met,
        reflections: u32,
        directions: f32,
        visitor: &mut impl Visitor,
    ) -> AtPlace<'_>;
}

/// A point of the cache.
pub(crate) struct PointOfCache<'a> {
    pub(crate) light: &'a [f32],
    /// The group that it belongs to.
    pub(crate) group: u32,
}

/// What the cache knows of a place.
pub(crate) enum AtPlace<'a> {
    /// The light of the point that stands for it.
    Light(PointOfCache<'a>),
    /// More rays from one place meet its point than the point has rays of its own.
    TooCoarse,
    /// No point stands for it.
    Nothing,
}

/// The numbers of the paths of a block: those of different blocks, and of different probes, are independent.
pub(crate) struct Numbers {
    first: PointsOfFour,
    whole: LaterNumbers,
    parts: LaterNumbers,
}

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        let first = PointsOfFour::new(hash(seed));
        Self { first, whole: LaterNumbers::new(seed), parts: LaterNumbers::new(!seed) }
    }
}

/// The numbers of paths after a reflection.
struct LaterNumbers {
    seed: u64,
    /// For each reflection, the numbers of the next direction and of the shadow rays.
    sets: [[PointsOfFour; 2]; PREPARED],
}

impl LaterNumbers {
    fn new(seed: u64) -> Self {
        let of = |set: u64| PointsOfFour::new(hash(seed ^ (set << 1)));
        Self { seed, sets: std::array::from_fn(|k| [of(2 * k as u64 + 1), of(2 * k as u64 + 2)]) }
    }

    /// The numbers of a path after some reflections: of the next direction (1), or of the shadow rays (2).
    fn after(&self, reflections: u32, which: usize, index: u32) -> [f32; 4] {
        match self.sets.get(reflections as usize) {
            Some(sets) => sets[which - 1].get(index),
            None => {
                let set = 2 * u64::from(reflections) + which as u64;
                PointsOfFour::new(hash(self.seed ^ (set << 1))).get(index)
            }
        }
    }

    /// A seed of a path's passing of surfaces after some reflections.
    fn passing(&self, reflections: u32, index: u32) -> u64 {
        hash(self.seed.wrapping_add((u64::from(index) << 8) | u64::from(reflections)))
    }
}

/// A scene in which paths are traced.
pub(crate) struct Paths<'a> {
    pub(crate) surfaces: &'a Surfaces<'a>,
    /// The emitters to which vertices cast shadow rays.
    pub(crate) emitters: Option<&'a Emitters>,
    /// The most reflections; `None` for all.
    pub(crate) bounces: Option<u32>,
}

/// A ray of a path.
#[derive(Clone, Copy)]
pub(crate) struct PathRay {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    /// The density of the direction.
    pub(crate) density: f32,
    /// The share of the light of what it meets that arrives.
    pub(crate) throughput: [f32; 3],
    /// The reflections of this light before it arrives.
    pub(crate) reflections: u32,
    /// A seed of which surfaces it passes.
    pub(crate) passing: u64,
}

/// A surface that a ray met and that reflects.
#[derive(Clone, Copy)]
pub(crate) struct Met {
    pub(crate) place: Place,
    pub(crate) albedo: [f32; 3],
    /// The length of the ray in metres.
    pub(crate) distance: f32,
    /// The cosine between the ray and the normal.
    pub(crate) cosine: f32,
}

impl Met {
    fn largest_albedo(&self) -> f32 {
        self.albedo[0].max(self.albedo[1]).max(self.albedo[2])
    }
}

impl Paths<'_> {
    /// Traces a path of a block from a place. With a cache, which comes with the number of paths of the
    /// block, it ends at the first surface or the second one if there is a point; it is split at the first
    /// one if the cache is too coarse there.
    pub(crate) fn trace(
        &self,
        from: Vec3,
        numbers: &Numbers,
        index: u32,
        cache: Option<(&impl CachedLight, u32)>,
        visitor: &mut impl Visitor,
    ) {
        let [u, v, next_u, next_v] = numbers.first.get(index);
        let mut ray = PathRay {
            origin: from,
            direction: uniform(u, v),
            density: 0.25 * FRAC_1_PI,
            throughput: [4.0 * PI; 3],
            reflections: 0,
            passing: numbers.whole.passing(0, index),
        };
        visitor.begin(ray.direction);
        if let Some(emitters) = self.emitters {
            let [a, b, c, _] = numbers.whole.after(0, 2, index);
            for number in 0..emitters.rays() {
                let seen = emitters.seen_from(self.surfaces, from, number, [a, b, c]);
                let Some(seen) = seen else { continue };
                let left = self.between(from, seen.direction, seen.distance, visitor);
                let Some(left) = left else { continue };
                let weight = seen.density / (seen.density + ray.density);
                let share = [0, 1, 2].map(|channel| left[channel] * seen.emission[channel] * weight);
                visitor.emission_from(seen.direction, seen.column, share);
            }
        }
        let Some(met) = self.meet(&mut ray, visitor) else { return };
        if self.bounces == Some(0) {
            return;
        }
        let known = cache.map_or(AtPlace::Nothing, |(cache, rays)| {
            cache.find(self.surfaces, &met, 0, rays as f32 * 0.25 * FRAC_1_PI, visitor)
        });
        self.reflect(&mut ray, &met, visitor);
        let cache = cache.map(|(cache, _)| cache);
        match known {
            AtPlace::Light(light) => visitor.cached(&light, ray.throughput),
            AtPlace::Nothing => {
                let numbers = (&numbers.whole, index);
                self.go_on(ray, met, [next_u, next_v], numbers, cache, visitor);
            }
            AtPlace::TooCoarse => {
                for part in 0..PARTS {
                    let index = index.wrapping_mul(PARTS).wrapping_add(part);
                    let [u, v, ..] = numbers.parts.after(1, 1, index);
                    let throughput = ray.throughput.map(|light| light / PARTS as f32);
                    let part = PathRay { throughput, ..ray };
                    self.go_on(part, met, [u, v], (&numbers.parts, index), cache, visitor);
                }
            }
        }
    }

    /// Follows a path from the first surface, which it leaves by the numbers u and v.
    fn go_on(
        &self,
        mut ray: PathRay,
        mut met: Met,
        [mut u, mut v]: [f32; 2],
        (numbers, index): (&LaterNumbers, u32),
        cache: Option<&impl CachedLight>,
        visitor: &mut impl Visitor,
    ) {
        let mut chance = 0.0;
        loop {
            let place = &met.place;
            self.sample_emitters(place, &ray, numbers.after(ray.reflections, 2, index), visitor);
            if ray.reflections > ROULETTE_AFTER {
                let most = met.largest_albedo();
                if chance >= most {
                    return;
                }
                ray.throughput = ray.throughput.map(|light| light / most);
            }
            ray.passing = numbers.passing(ray.reflections, index);
            ray.leaves(place, u, v);
            let Some(next) = self.meet(&mut ray, visitor) else { return };
            met = next;
            if self.bounces.is_some_and(|most| ray.reflections >= most) {
                return;
            }
            let known = cache.map(|cache| cache.find(self.surfaces, &met, ray.reflections, 0.0, visitor));
            self.reflect(&mut ray, &met, visitor);
            if let Some(AtPlace::Light(light)) = known {
                return visitor.cached(&light, ray.throughput);
            }
            [u, v, chance, _] = numbers.after(ray.reflections, 1, index);
        }
    }

    /// Takes a ray's light over to the surface that it met.
    fn reflect(&self, ray: &mut PathRay, met: &Met, visitor: &mut impl Visitor) {
        ray.reflections += 1;
        ray.throughput = times(ray.throughput, met.albedo);
        visitor.reflects(self.surfaces, &met.place, ray.throughput.map(|light| light * FRAC_1_PI));
    }

    /// What a ray meets, after its light of the sky or of emission; `None` if nothing there reflects.
    pub(crate) fn meet(&self, ray: &mut PathRay, visitor: &mut impl Visitor) -> Option<Met> {
        let (hit, left) = self.surfaces.closest(ray.origin, ray.direction, ray.passing);
        ray.throughput = times(ray.throughput, left);
        if let Some((grid, depends)) = visitor.depends() {
            let distance = hit.map_or(f32::INFINITY, |hit| hit.distance);
            depends.cells.add_ray(grid, ray.origin, ray.direction, distance);
        }
        let Some(hit) = hit else {
            visitor.sky(ray.direction, ray.throughput);
            return None;
        };
        let place = self.surfaces.place(&hit);
        if !place.is_lit {
            return None;
        }
        let cosine = -place.normal.dot(ray.direction);
        let solid_angle = FOOTPRINTS[usize::from(ray.reflections > 0)];
        let area = solid_angle * hit.distance * hit.distance / cosine.max(0.05);
        if let Some(column) = self.surfaces.column(hit.triangle) {
            let emission = self.surfaces.emission(hit.triangle, hit.weights, area);
            let others = self.emitters.map_or(0.0, |emitters| emitters.density(column, hit.distance, cosine));
            let weight = ray.density / (ray.density + others);
            visitor.emission(column, times(ray.throughput, emission.map(|e| e * weight)), ray.reflections);
        }
        let albedo = self.surfaces.albedo(&place, area);
        let met = Met { place, albedo, distance: hit.distance, cosine };
        (met.largest_albedo() > 0.0).then_some(met)
    }

    /// What of the light between two places arrives, RGB; `None` if it is nothing.
    fn between(
        &self,
        origin: Vec3,
        direction: Vec3,
        distance: f32,
        visitor: &mut impl Visitor,
    ) -> Option<[f32; 3]> {
        let left = self.surfaces.between(origin, direction, distance);
        if let Some((grid, depends)) = visitor.depends() {
            let free = || self.surfaces.blocked_after(origin, direction, distance);
            depends.cells.add_ray(grid, origin, direction, left.map_or_else(free, |_| distance));
        }
        left
    }

    /// Casts shadow rays to emitters from a place that reflects `ray`'s light.
    pub(crate) fn sample_emitters(
        &self,
        place: &Place,
        ray: &PathRay,
        numbers: [f32; 4],
        visitor: &mut impl Visitor,
    ) {
        let Some(emitters) = self.emitters else { return };
        let origin = place.start();
        let [a, b, c, _] = numbers;
        for number in 0..emitters.rays() {
            let seen = emitters.seen_from(self.surfaces, origin, number, [a, b, c]);
            let Some(seen) = seen else { continue };
            let cosine = place.normal.dot(seen.direction);
            if cosine <= 0.0 {
                continue;
            }
            let left = self.between(origin, seen.direction, seen.distance, visitor);
            let Some(left) = left else { continue };
            let weight = FRAC_1_PI * cosine * seen.density / (seen.density + cosine * FRAC_1_PI);
            let share = times(ray.throughput, times(left, seen.emission.map(|e| e * weight)));
            visitor.emission(seen.column, share, ray.reflections);
        }
    }
}

impl PathRay {
    /// Leaves a place with the density cosine / pi, for uniform numbers.
    pub(crate) fn leaves(&mut self, place: &Place, u: f32, v: f32) {
        self.origin = place.start();
        self.direction = around(place.normal, u, v);
        self.density = place.normal.dot(self.direction).max(1e-6) * FRAC_1_PI;
    }
}

fn times(one: [f32; 3], other: [f32; 3]) -> [f32; 3] {
    [one[0] * other[0], one[1] * other[1], one[2] * other[2]]
}

/// A direction, uniform on the sphere for uniform numbers.
fn uniform(u: f32, v: f32) -> Vec3 {
    let z = 1.0 - 2.0 * u;
    let across = (1.0 - z * z).max(0.0).sqrt();
    let (sine, cosine) = math::sin_cos(TAU * v);
    Vec3::new(across * cosine, across * sine, z)
}

/// A direction around a normal with the density cosine / pi for uniform numbers.
///
/// The frame is that of Duff et al., "Building an orthonormal basis, revisited" (2017).
pub(crate) fn around(normal: Vec3, u: f32, v: f32) -> Vec3 {
    let (radius, (sine, cosine)) = (u.sqrt(), math::sin_cos(TAU * v));
    let height = (1.0 - u).max(0.0).sqrt().max(1e-4);
    let Vec3 { x, y, z } = normal;
    let sign = 1.0_f32.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    let tangent = Vec3::new(1.0 + sign * x * x * a, sign * b, -sign * x);
    let other = Vec3::new(b, sign + y * y * a, -y);
    (tangent * (radius * cosine) + other * (radius * sine) + normal * height).normalize()
}
