//! A clear day: Preetham's sky, its sun, thin clouds, hills, and a paved place in the grass.
//!
//! A. J. Preetham, P. Shirley, B. Smits, *A practical analytic model for daylight*, SIGGRAPH 1999: appendix
//! A.2 gives Perez' coefficients and the zenith as functions of the turbidity. Luminance is scaled from
//! kcd/m^2.

use std::f64::consts::PI;

use sphere::{DVec3, Direction, LatLong};

use super::noise::{noise, octaves, random, sampled};

const TURBIDITY: f64 = 2.6;
/// Toward the sun: behind and to the left of a camera that looks along +X.
const SUN: (f64, f64) = (58.0 * PI / 180.0, 128.0 * PI / 180.0);
/// The angle from the sun's centre to its edge: 0.267 degrees, against 0.7 for a texel.
const SUN_RADIUS: f64 = 0.267 * PI / 180.0;
/// The sun's irradiance of a surface that faces it: about twice that of the sky, as through haze.
const SUN_IRRADIANCE: DVec3 = DVec3::new(2.3, 2.0, 1.62);
/// Units of radiance in a kcd/m^2.
const SCALE: f64 = 0.055;
/// The height of the eye above the ground, in metres.
const EYE: f64 = 1.6;

/// The radiance of the scene.
pub(crate) fn render(grid: LatLong) -> Vec<[f32; 3]> {
    let sky = Sky::new();
    let mut pixels = sampled(grid, 4, |direction| scene(&sky, direction));
    add_sun(grid, &mut pixels);
    pixels
}

fn sun() -> DVec3 {
    Direction::from_angles(SUN.0, SUN.1).vector()
}

/// Perez' formula for one of Y, x, y: value at the zenith and five coefficients.
struct Perez {
    zenith: f64,
    coefficients: [f64; 5],
}

impl Perez {
    fn shape(&self, cos_theta: f64, gamma: f64) -> f64 {
        let [a, b, c, d, e] = self.coefficients;
        (1.0 + a * (b / cos_theta).exp()) * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))
    }

    fn value(&self, cos_theta: f64, gamma: f64) -> f64 {
        self.zenith * self.shape(cos_theta, gamma) / self.shape(1.0, SUN.0)
    }
}

struct Sky {
    luminance: Perez,
    x: Perez,
    y: Perez,
}

impl Sky {
    fn new() -> Self {
        let t = TURBIDITY;
        let line = |slopes: [f64; 5], offsets: [f64; 5]| std::array::from_fn(|i| slopes[i] * t + offsets[i]);
        let cubic = |rows: [[f64; 4]; 3]| {
            let s = SUN.0;
            let [a, b, c] = rows.map(|row| ((row[0] * s + row[1]) * s + row[2]) * s + row[3]);
            (a * t + b) * t + c
        };
        let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * SUN.0);
        Self {
            luminance: Perez {
                zenith: (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192,
                coefficients: line(
                    [0.1787, -0.3554, -0.0227, 0.1206, -0.0670],
                    [-1.4630, 0.4275, 5.3251, -2.5771, 0.3703],
                ),
            },
            x: Perez {
                zenith: cubic([
                    [0.00166, -0.00375, 0.00209, 0.0],
                    [-0.02903, 0.06377, -0.03202, 0.00394],
                    [0.11693, -0.21196, 0.06052, 0.25886],
                ]),
                coefficients: line(
                    [-0.0193, -0.0665, -0.0004, -0.0641, -0.0033],
                    [-0.2592, 0.0008, 0.2125, -0.8989, 0.0452],
                ),
            },
            y: Perez {
                zenith: cubic([
                    [0.00275, -0.00610, 0.00317, 0.0],
                    [-0.04214, 0.08970, -0.04153, 0.00516],
                    [0.15346, -0.26756, 0.06670, 0.26688],
                ]),
                coefficients: line(
                    [-0.0167, -0.0950, -0.0079, -0.0441, -0.0109],
                    [-0.2608, 0.0092, 0.2102, -1.6537, 0.0529],
                ),
            },
        }
    }

    /// The clear sky in a direction; below the horizon, the horizon.
    fn radiance(&self, direction: DVec3) -> DVec3 {
        let cos_theta = direction.z.max(0.015);
        let gamma = direction.dot(sun()).clamp(-1.0, 1.0).acos();
        let luminance = SCALE * self.luminance.value(cos_theta, gamma);
        let (x, y) = (self.x.value(cos_theta, gamma), self.y.value(cos_theta, gamma));
        // CIE XYZ to linear Rec. 709.
        let (big_x, big_z) = (luminance * x / y, luminance * (1.0 - x - y) / y);
        DVec3::new(
            3.2406 * big_x - 1.5372 * luminance - 0.4986 * big_z,
            -0.9689 * big_x + 1.8758 * luminance + 0.0415 * big_z,
            0.0557 * big_x - 0.2040 * luminance + 1.0570 * big_z,
        )
        .max(DVec3::ZERO)
    }
}

fn scene(sky: &Sky, direction: DVec3) -> DVec3 {
    let elevation = direction.z.asin();
    let azimuth = direction.y.atan2(direction.x);
    if elevation < 0.0 {
        return ground(sky, direction);
    }
    let horizon = haze(sky, direction);
    // Two ranges of hills, the nearer one darker and greener.
    let ridge = |height: f64, bumps: f64, offset: f64| {
        let turn = (offset + azimuth.cos() * bumps, azimuth.sin() * bumps);
        height * (0.35 + octaves(turn.0, turn.1, 5))
    };
    if elevation < ridge(0.045, 5.0, 40.0) {
        return horizon.lerp(DVec3::new(0.045, 0.065, 0.03), 0.55);
    }
    if elevation < ridge(0.085, 2.5, 90.0) {
        return horizon.lerp(DVec3::new(0.05, 0.07, 0.06), 0.3);
    }
    let clear = sky.radiance(direction);
    // Cirrus on a plane above.
    let (x, y) = (direction.x / (direction.z + 0.12), direction.y / (direction.z + 0.12));
    let veil = octaves(1.1 * x + 0.5 * y + 7.0, 2.6 * y - 0.3 * x, 6);
    let cover = ((veil - 0.5) / 0.28).clamp(0.0, 1.0).powf(1.3) * (elevation / 0.25).min(1.0);
    let glow = 1.0 + 2.0 * direction.dot(sun()).max(0.0).powi(12);
    clear.lerp(DVec3::new(0.78, 0.76, 0.74) * glow, 0.55 * cover)
}

/// The sky just above the horizon, into which hills and ground fade.
fn haze(sky: &Sky, direction: DVec3) -> DVec3 {
    sky.radiance(DVec3::new(direction.x, direction.y, 0.06).normalize())
}

fn ground(sky: &Sky, direction: DVec3) -> DVec3 {
    let distance = EYE / -direction.z.min(-1e-4);
    let (x, y) = (direction.x * distance, direction.y * distance);
    let flat = x.hypot(y);
    // Detail finer than a sample fades with distance.
    let detail = |size: f64| 1.0 / (1.0 + (flat / (60.0 * size)).powi(2));
    let grass = {
        let patches = octaves(0.15 * x, 0.15 * y, 3) - 0.5;
        let blades = (noise(9.0 * x, 9.0 * y) - 0.5) * detail(0.1);
        DVec3::new(0.13, 0.19, 0.06) * (1.0 + 0.9 * patches + 0.5 * blades)
    };
    let stone = {
        let (column, row) = ((x / 0.9).floor(), (y / 0.9).floor());
        let shade = 0.3 * (random(column as i64, row as i64) - 0.5) * detail(0.9);
        let edge = |v: f64| (v / 0.9 - (v / 0.9).round()).abs() * 0.9;
        let joint = if edge(x).min(edge(y)) < 0.025 { 0.45 * detail(0.15) } else { 0.0 };
        let grain = 0.25 * (octaves(3.0 * x, 3.0 * y, 4) - 0.5) * detail(0.3);
        DVec3::new(0.42, 0.37, 0.31) * (1.0 + shade + grain - joint)
    };
    let border = 7.0 + 0.5 * (octaves(0.8 * x, 0.8 * y, 3) - 0.5);
    let albedo = grass.lerp(stone, ((border - flat) / 0.15 + 0.5).clamp(0.0, 1.0));
    // The sky's irradiance on level ground is near pi times its radiance half-way up, on the mean of all
    // sides.
    let sides = [(0.6, -0.5), (-0.6, -0.5), (0.6, 0.5), (-0.6, 0.5)];
    let sides = sides.map(|(x, y)| sky.radiance(DVec3::new(x, y, 0.5).normalize()));
    let irradiance = SUN_IRRADIANCE * sun().z + PI / 4.0 * sides.into_iter().sum::<DVec3>();
    let lit = albedo * irradiance / PI;
    lit.lerp(haze(sky, direction), 1.0 - (-flat / 400.0).exp())
}

/// Adds the sun's disc: each texel gets its share, and together they have exactly the sun's irradiance.
fn add_sun(grid: LatLong, pixels: &mut [[f32; 3]]) {
    const SIDE: usize = 32;
    let fine = LatLong { width: grid.width * SIDE, height: grid.height * SIDE };
    let (column, row) = grid.position(Direction::normalised(sun()));
    let around = |centre: f64| (centre.round() as usize).saturating_sub(2)..=centre.round() as usize + 2;
    let mut shares = Vec::new();
    for row in around(row) {
        for column in around(column) {
            let inside = (0..SIDE * SIDE).filter(|sample| {
                let (i, j) = (row * SIDE + sample / SIDE, column * SIDE + sample % SIDE);
                fine.direction(i, j).vector().dot(sun()) > SUN_RADIUS.cos()
            });
            let area = inside.count() as f64 / (SIDE * SIDE) as f64 * grid.solid_angle(row);
            shares.push((row, column, area));
        }
    }
    let total: f64 = shares.iter().map(|(_, _, area)| area).sum();
    for (row, column, area) in shares {
        let radiance = SUN_IRRADIANCE * (area / total / grid.solid_angle(row));
        let pixel = &mut pixels[row * grid.width + column];
        *pixel = std::array::from_fn(|c| pixel[c] + radiance[c] as f32);
    }
}
