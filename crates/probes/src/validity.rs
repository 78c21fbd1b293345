//! What a probe sees around it: whether it is inside of something, and how near surfaces are.

use std::sync::LazyLock;

use glam::Vec3;

use crate::closed::closed;
use crate::surfaces::{Place, Surfaces};

/// The directions in which a probe looks around.
pub(crate) const LOOKS: usize = 256;

/// The share of directions with the backs of solids from which on a probe is inside of one.
pub const MOST_BACKS: f32 = 0.25;

/// Probes stand no nearer to a surface than this, in metres.
pub const LEAST_DISTANCE: f32 = 0.02;

/// What a probe sees.
#[derive(Clone, Debug)]
pub(crate) struct View {
    /// The share of directions in which the back of a surface of one side is seen.
    pub(crate) back_share: f32,
    /// The share in which it is that of a solid.
    pub(crate) solid_share: f32,
    /// The distance to the nearest surface that was seen; infinite if there is none.
    pub(crate) nearest: f32,
    /// The backs of solids that were seen: the distance, the direction and the triangle; the nearest first.
    pub(crate) backs: Vec<(f32, Vec3, u32)>,
    /// The nearest surface that was seen.
    pub(crate) surface: Option<Place>,
    /// How far each ray goes.
    pub(crate) distances: Vec<f32>,
}

impl View {
    pub(crate) fn is_inside(&self) -> bool {
        self.solid_share > MOST_BACKS
    }
}

/// The directions in which probes look around.
pub(crate) fn look_directions() -> &'static [Vec3] {
    static DIRECTIONS: LazyLock<Vec<Vec3>> = LazyLock::new(|| {
        let direction = |index| {
            let v = sphere::spiral(index, LOOKS).vector();
            Vec3::new(v.x as f32, v.y as f32, v.z as f32)
        };
        (0..LOOKS).map(direction).collect()
    });
    &DIRECTIONS
}

/// A scene in which probes look around.
pub(crate) struct Viewer<'a> {
    pub(crate) surfaces: &'a Surfaces<'a>,
    closed: Vec<bool>,
    directions: &'static [Vec3],
}

impl<'a> Viewer<'a> {
    pub(crate) fn new(surfaces: &'a Surfaces<'a>) -> Self {
        Self { surfaces, closed: closed(&surfaces.parts.triangles), directions: look_directions() }
    }

    /// Looks around from a place.
    pub(crate) fn view(&self, from: Vec3) -> View {
        let (mut backs, mut all, mut nearest, mut surface) = (Vec::new(), 0, f32::INFINITY, None);
        let mut distances = vec![f32::INFINITY; LOOKS];
        for (&direction, length) in self.directions.iter().zip(&mut distances) {
            let Some(hit) = self.surfaces.closest(from, direction, 0).0 else { continue };
            *length = hit.distance;
            if hit.distance < nearest {
                nearest = hit.distance;
                surface = Some(hit);
            }
            if !hit.front && !self.surfaces.material(hit.triangle).is_double_sided {
                all += 1;
                if self.closed[hit.triangle as usize] {
                    backs.push((hit.distance, direction, hit.triangle));
                }
            }
        }
        backs.sort_by(|a, b| a.0.total_cmp(&b.0));
        // The plane of the nearest surface is nearer than where the nearest ray met it.
        let surface = surface.map(|hit| self.surfaces.place(&hit));
        if let Some(place) = &surface {
            nearest = nearest.min((from - place.position).dot(place.normal).abs());
        }
        let share = |count: usize| count as f32 / LOOKS as f32;
        View { back_share: share(all), solid_share: share(backs.len()), nearest, backs, surface, distances }
    }

    /// Whether nothing is between two places.
    pub(crate) fn sees(&self, from: Vec3, to: Vec3) -> bool {
        let way = to - from;
        let distance = way.length();
        distance == 0.0 || self.surfaces.between(from, way / distance, distance).is_some()
    }

    /// The surfaces between two places: how many are met at their front, and how many at their back.
    pub(crate) fn crossings(&self, from: Vec3, to: Vec3) -> [usize; 2] {
        let way = to - from;
        let distance = way.length();
        let mut crossings = [0, 0];
        if distance > 0.0 {
            self.surfaces.caster.is_blocked(from, way / distance, distance, |hit| {
                crossings[usize::from(!hit.front)] += 1;
                false
            });
        }
        crossings
    }
}
