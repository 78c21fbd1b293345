//! Points on small emitters, toward which paths cast shadow rays.
//!
//! A material whose triangles are a large part of the scene's surface is found by paths themselves: in a room
//! that shines everywhere, that is exact. Of the others each vertex of a path takes a point, uniform over
//! their area; it and the rays that meet the emitter by themselves are weighted by the balance heuristic
//! (Veach and Guibas, "Optimally combining sampling techniques", 1995).

use glam::Vec3;

use crate::random::hash_words;
use crate::surfaces::Surfaces;

/// The share of the surface of a scene from which on an emitter is large.
const LARGE: f64 = 0.3;

/// The most emitters that a vertex casts a shadow ray to; of more, this many are taken at random.
const MOST_RAYS: usize = 4;

/// The emitters that are sampled.
pub(crate) struct Emitters {
    small: Vec<Emitter>,
    /// For each column of emission, its place among the small ones.
    of_column: Vec<Option<usize>>,
    /// The shadow rays that a vertex casts to each emitter, on average.
    rays_each: f32,
}

struct Emitter {
    column: usize,
    /// The emitting triangles, and the share of the area up to and with each.
    triangles: Vec<u32>,
    up_to: Vec<f64>,
    /// The area in square metres; that of two sides counts once.
    area: f32,
}

/// A point on an emitter, as it is seen from another one.
pub(crate) struct Seen {
    /// The column of the emission.
    pub(crate) column: usize,
    /// Toward the point.
    pub(crate) direction: Vec3,
    /// How far away it is.
    pub(crate) distance: f32,
    /// Its emission in its material's own unit, RGB, times the solid angle that it stands for: rays that find
    /// it by themselves are not yet regarded.
    pub(crate) emission: [f32; 3],
    /// The points that are taken in each steradian there.
    pub(crate) density: f32,
}

impl Emitters {
    pub(crate) fn of(surfaces: &Surfaces<'_>) -> Self {
        let count = surfaces.parts.triangles.len() as u32;
        let area = |triangle: u32| 0.5 * f64::from(surfaces.twice_normal(triangle).length());
        let all: f64 = (0..count).map(area).sum();
        let mut triangles = vec![Vec::new(); surfaces.columns];
        for triangle in 0..count {
            if let Some(column) = surfaces.column(triangle).filter(|_| area(triangle) > 0.0) {
                triangles[column].push(triangle);
            }
        }
        let (mut small, mut of_column) = (Vec::new(), vec![None; surfaces.columns]);
        for (column, triangles) in triangles.into_iter().enumerate() {
            let own: f64 = triangles.iter().map(|&triangle| area(triangle)).sum();
            if own > 0.0 && own <= LARGE * all {
                let mut sum = 0.0;
                let up_to = triangles.iter().map(|&triangle| {
                    sum += area(triangle);
                    sum / own
                });
                let up_to = up_to.collect();
                of_column[column] = Some(small.len());
                small.push(Emitter { column, triangles, up_to, area: own as f32 });
            }
        }
        let rays_each = MOST_RAYS as f32 / (small.len() as f32).max(MOST_RAYS as f32);
        Self { small, of_column, rays_each }
    }

    /// A hash of all that they are, with hashes of all triangles.
    pub(crate) fn digest(&self, triangles: &[u64]) -> u64 {
        let of_emitter = |emitter: &Emitter| {
            let own = emitter.triangles.iter().map(|triangle| triangles[*triangle as usize]);
            hash_words(emitter.column as u64, own)
        };
        hash_words(0, self.small.iter().map(of_emitter))
    }

    /// The shadow rays that a vertex casts.
    pub(crate) fn rays(&self) -> usize {
        self.small.len().min(MOST_RAYS)
    }

    /// The point that the ray of a place takes, seen from there, by three numbers in [0, 1); `None` if it
    /// does not shine toward the place.
    pub(crate) fn seen_from(
        &self,
        surfaces: &Surfaces<'_>,
        place: Vec3,
        ray: usize,
        numbers: [f32; 3],
    ) -> Option<Seen> {
        // Each ray has other numbers than the one before: shifted by irrational steps (Cranley and
        // Patterson).
        let shift = |number: f32, step: f64| {
            let shifted = (f64::from(number) + ray as f64 * step).fract();
            if shifted < 1.0 { shifted } else { 0.0 }
        };
        let (pick, u, v) =
            (shift(numbers[0], 0.618_034), shift(numbers[1], 0.754_878), shift(numbers[2], 0.569_840));
        let count = self.small.len();
        let (emitter, pick) = if count <= MOST_RAYS {
            (self.small.get(ray)?, pick)
        } else {
            let at = pick * count as f64;
            (self.small.get(at as usize)?, at.fract())
        };
        let index = emitter.up_to.partition_point(|up_to| *up_to <= pick).min(emitter.triangles.len() - 1);
        let triangle = emitter.triangles[index];
        // Uniform in a triangle (Osada et al. 2002).
        let root = u.sqrt();
        let weights = [(root * (1.0 - v)) as f32, (root * v) as f32];
        let [a, b, c] = surfaces.parts.triangles[triangle as usize].map(Vec3::from);
        let (along, across) = (b - a, c - a);
        let normal = along.cross(across).normalize_or_zero();
        let point = a + along * weights[0] + across * weights[1];
        let way = point - place;
        let squared = way.length_squared();
        let distance = squared.sqrt();
        let direction = way / distance;
        let mut cosine = -normal.dot(direction);
        if surfaces.material(triangle).is_double_sided {
            cosine = cosine.abs();
        }
        if !(cosine > 0.0 && direction.is_finite()) {
            return None;
        }
        // Textures are averaged over the area that one of a thousand points stands for.
        let emission = surfaces.emission(triangle, weights, emitter.area / 1024.0);
        let density = self.rays_each * squared / (emitter.area * cosine);
        // The ray ends before the emitter itself.
        let clearance = 2.0 * surfaces.caster.clearance(triangle, point) / cosine.max(0.01);
        let distance = distance - clearance;
        Some(Seen {
            column: emitter.column,
            direction,
            distance,
            emission: emission.map(|e| e / density),
            density,
        })
    }

    /// The points that are taken in each steradian around a place of an emitter that a ray met: 0 if it is
    /// not sampled.
    pub(crate) fn density(&self, column: usize, distance: f32, cosine: f32) -> f32 {
        match self.of_column.get(column).copied().flatten() {
            Some(small) => self.rays_each * distance * distance / (self.small[small].area * cosine.max(1e-6)),
            None => 0.0,
        }
    }
}

impl std::fmt::Debug for Emitters {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Emitters").field("small", &self.small.len()).finish_non_exhaustive()
    }
}
