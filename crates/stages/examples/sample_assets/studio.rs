//! A dark studio: a key softbox, a fill strip, an overhead bank and two coloured rim lights in a room with a
//! polished floor.
//!
//! Rectangular lights shine on matte walls by sums over their area; the floor adds a mirror image by
//! Schlick's Fresnel term. Metres; the eye is at the origin, 1.5 above the floor.

use std::f64::consts::PI;

use sphere::{DVec3, LatLong};

use super::noise::{octaves, sampled};

/// Corners of the room. The camera looks along +X.
const LOW: DVec3 = DVec3::new(-5.0, -4.5, -1.5);
/// See [`LOW`].
const HIGH: DVec3 = DVec3::new(5.5, 4.5, 3.4);

/// A rectangle that shines to one side.
struct Lamp {
    centre: DVec3,
    /// From the centre to the middle of the right edge, and of the upper edge.
    half: [DVec3; 2],
    radiance: DVec3,
}

impl Lamp {
    /// A lamp that faces a point, of a width and a height.
    fn facing(centre: DVec3, target: DVec3, size: (f64, f64), radiance: DVec3) -> Self {
        let normal = (target - centre).normalize();
        let across = if normal.z.abs() > 0.99 { DVec3::Y } else { DVec3::Z.cross(normal).normalize() };
        Self { centre, half: [across * (size.0 / 2.0), normal.cross(across) * (size.1 / 2.0)], radiance }
    }

    fn normal(&self) -> DVec3 {
        self.half[0].cross(self.half[1]).normalize()
    }

    /// The light that leaves a point of the lamp, (u, v) in [-1, 1]: brightest in the middle, none from the
    /// frame.
    fn emitted(&self, u: f64, v: f64) -> DVec3 {
        if u.abs().max(v.abs()) > 0.96 {
            return DVec3::splat(0.01);
        }
        let weave = 1.0 + 0.03 * (octaves(9.0 * u, 9.0 * v, 3) - 0.5);
        self.radiance * weave * (1.0 - 0.35 * (u * u + v * v) / 2.0)
    }

    /// The distance of the lamp along a ray, and its radiance there.
    fn seen(&self, origin: DVec3, ray: DVec3) -> Option<(f64, DVec3)> {
        let normal = self.normal();
        let slope = ray.dot(normal);
        let along = (self.centre - origin).dot(normal) / slope;
        let place = origin + along * ray - self.centre;
        let [u, v] = self.half.map(|half| place.dot(half) / half.length_squared());
        let hit = along > 1e-6 && along.is_finite() && u.abs() <= 1.0 && v.abs() <= 1.0;
        let back = DVec3::splat(0.004);
        hit.then(|| (along, if slope < 0.0 { self.emitted(u, v) } else { back }))
    }

    /// The irradiance of a surface at a point, without shadows.
    fn irradiance(&self, point: DVec3, normal: DVec3) -> DVec3 {
        const SIDE: usize = 4;
        let area = 4.0 * self.half[0].length() * self.half[1].length() / (SIDE * SIDE) as f64;
        let facing = self.normal();
        let mut sum = 0.0;
        for sample in 0..SIDE * SIDE {
            let at = |i: usize| 2.0 * (i as f64 + 0.5) / SIDE as f64 - 1.0;
            let (u, v) = (at(sample % SIDE), at(sample / SIDE));
            let way = self.centre + u * self.half[0] + v * self.half[1] - point;
            let squared = way.length_squared();
            let cosines = way.dot(normal).max(0.0) * (-way.dot(facing)).max(0.0) / squared;
            sum += (1.0 - 0.35 * (u * u + v * v) / 2.0) * cosines / squared * area;
        }
        self.radiance * sum
    }
}

/// The radiance of the studio.
pub(crate) fn render(grid: LatLong) -> Vec<[f32; 3]> {
    let lamps = lamps();
    sampled(grid, 3, |direction| scene(&lamps, DVec3::ZERO, direction, true))
}

fn lamps() -> Vec<Lamp> {
    let subject = DVec3::new(0.0, 0.0, 0.0);
    let at = DVec3::new;
    vec![
        // The key: behind the camera, to the left, above.
        Lamp::facing(at(-2.1, 2.3, 1.7), subject, (1.6, 1.6), at(10.0, 9.2, 8.1)),
        // The fill: a tall strip to the right.
        Lamp::facing(at(-1.6, -2.7, 0.5), subject, (0.5, 2.2), at(2.8, 3.2, 3.7)),
        // The overhead bank.
        Lamp::facing(at(1.0, 0.0, 2.6), at(1.0, 0.0, 0.0), (1.7, 0.8), at(5.0, 5.0, 5.1)),
        // The rims: behind the subject, magenta and teal.
        Lamp::facing(at(2.4, -2.6, 0.7), subject, (0.3, 2.0), at(14.0, 1.4, 6.0)),
        Lamp::facing(at(2.6, 2.5, 0.3), subject, (0.3, 1.8), at(0.9, 8.0, 10.5)),
    ]
}

fn scene(lamps: &[Lamp], origin: DVec3, ray: DVec3, mirror: bool) -> DVec3 {
    // The room's wall along the ray: the nearest of the three planes that it heads for.
    let along = |axis: usize| {
        let wall = if ray[axis] > 0.0 { HIGH[axis] } else { LOW[axis] };
        let along = (wall - origin[axis]) / ray[axis];
        if along.is_finite() && along > 0.0 { along } else { f64::INFINITY }
    };
    let axis = (1..3).fold(0, |best, axis| if along(axis) < along(best) { axis } else { best });
    let wall = along(axis);
    let lamp = lamps.iter().filter_map(|lamp| lamp.seen(origin, ray));
    if let Some((_, shown)) = lamp.filter(|(far, _)| *far < wall).min_by(|a, b| a.0.total_cmp(&b.0)) {
        return shown;
    }
    let point = origin + wall * ray;
    let mut normal = DVec3::ZERO;
    normal[axis] = -ray[axis].signum();
    let floor = axis == 2 && ray.z < 0.0;
    let albedo = if floor {
        DVec3::new(0.2, 0.19, 0.18) * (0.75 + 0.5 * octaves(1.5 * point.x, 1.5 * point.y, 5))
    } else if axis == 0 && ray.x > 0.0 {
        // A paper backdrop behind the subject.
        DVec3::new(0.3, 0.3, 0.315)
    } else {
        DVec3::new(0.13, 0.13, 0.14) * (0.85 + 0.3 * octaves(0.8 * (point.x + point.y), 0.8 * point.z, 4))
    };
    let irradiance: DVec3 = lamps.iter().map(|lamp| lamp.irradiance(point, normal)).sum();
    let matte = albedo * (irradiance / PI + DVec3::splat(0.05));
    if floor && mirror {
        let fresnel = 0.04 + 0.96 * (1.0 + ray.z).max(0.0).powi(5);
        let reflected = scene(lamps, point, DVec3::new(ray.x, ray.y, -ray.z), false);
        return matte + 0.7 * fresnel * reflected;
    }
    matte
}
