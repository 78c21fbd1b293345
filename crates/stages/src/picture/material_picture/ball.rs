//! A ball of a material under a sky and a lamp, by direct integration.
//!
//! The camera looks along +X from far away, up is +Z: the picture's centre is the normal -X. The sky has the
//! radiance M (1 + C s(z)) with an odd s: it is bright above and dark below, with a soft horizon. Over the
//! hemisphere about a horizontal normal the odd part integrates to zero, so the irradiance there is pi M. The
//! lamp is a disk of constant radiance at the upper left, behind the camera. All light is white: colours are
//! those of the material.
//!
//! The sky is smooth, so samples of the material's lobes suffice for it: the mean of L rho_hat / p, p being
//! their density. The lamp is sampled too, because lobes that are wider than it rarely hit it; both kinds of
//! samples are weighted by the power heuristic (Veach and Guibas, "Optimally Combining Sampling Techniques
//! for Monte Carlo Rendering", 1995). All pixels share their sample points: the error that remains is smooth,
//! not noise.

use std::f64::consts::{PI, TAU};

use brdf::Material;
use envmap::Environment;
use preview::PointSet;
use preview::shading::lobe_sampling::LobeSampling;
use preview::shading::sequence::Sequence;
use sphere::{DMat3, DVec3, Direction, LatLong};

use crate::picture::ball_camera::{draw, inside};

/// The ball's radius in units of half the picture's width.
const OUTLINE: f64 = 0.92;
/// The number of points along each side of a pixel.
const POINTS: usize = 2;

/// The numbers of samples that each point has.
#[derive(Clone, Copy)]
pub(super) struct Samples {
    lobes: u32,
    lamp: u32,
}

impl Samples {
    /// Within 4 % of the integral for a matte material but at its outline: three steps of 8 bits in the dark.
    pub(super) const FEW: Self = Self { lobes: 32, lamp: 4 };
}

/// The mean radiance M of the sky; [`CONTRAST`] is C.
const SKY: f64 = 0.5;
const CONTRAST: f64 = 0.7;
/// Half the height of the soft horizon, as a sine.
const HORIZON: f64 = 0.25;
/// The irradiance of a surface that faces the lamp.
const LAMP_IRRADIANCE: f64 = 1.6;
/// The angle from the lamp's centre to its edge, in radians.
const LAMP_RADIUS: f64 = 0.12;
/// The direction toward the lamp; not yet of length 1.
const LAMP_DIRECTION: DVec3 = DVec3::new(-0.65, 0.5, 0.6);

/// The light, in the world's frame.
struct BallLight {
    lamp: DMat3,
    /// The radiance of the lamp.
    radiance: f64,
    solid_angle: f64,
}

impl BallLight {
    fn new() -> Self {
        let solid_angle = TAU * (1.0 - math::cos(LAMP_RADIUS));
        let radiance = LAMP_IRRADIANCE / (PI * math::powi(math::sin(LAMP_RADIUS), 2));
        Self { lamp: frame(LAMP_DIRECTION.normalize(), DVec3::Z), radiance, solid_angle }
    }

    /// The radiance of the lamp from a direction, and the density of [`BallLight::sample`] there.
    fn lamp(&self, w: DVec3) -> (f64, f64) {
        let hit = w.dot(self.lamp.z_axis) > math::cos(LAMP_RADIUS);
        if hit { (self.radiance, 1.0 / self.solid_angle) } else { (0.0, 0.0) }
    }

    /// A direction toward the lamp for a point of the unit square, uniform in solid angle.
    fn sample(&self, [along, around]: [f64; 2]) -> DVec3 {
        let z = 1.0 - along * (1.0 - math::cos(LAMP_RADIUS));
        let (sine, cosine) = math::sin_cos(TAU * around);
        let across = (1.0 - z * z).max(0.0).sqrt();
        self.lamp * DVec3::new(across * cosine, across * sine, z)
    }
}

/// The radiance of the sky at a height.
fn sky(z: f64) -> f64 {
    let x = (z / HORIZON).clamp(-1.0, 1.0);
    let step = x * (3.0 - x * x) / 2.0;
    SKY * (1.0 + CONTRAST * (0.75 * step + 0.25 * z))
}

/// A right-handed frame with this z axis, whose x axis points along `up` x z.
fn frame(z: DVec3, up: DVec3) -> DMat3 {
    let x = up.cross(z).try_normalize().unwrap_or(DVec3::Y);
    DMat3::from_cols(x, z.cross(x), z)
}

/// The radiance toward the camera in an `edge` x `edge` picture, RGB; black outside of the ball.
///
/// Tangents run along the circles of latitude, turned back by `azimuth` (radians) about the normal.
pub(super) fn ball(material: &Material, azimuth: f64, edge: usize, samples: Samples) -> Vec<[f32; 3]> {
    let (light, lobes) = (BallLight::new(), LobeSampling::new(material, 0.0));
    let (sine, cosine) = math::sin_cos(azimuth);
    let turn = DMat3::from_cols(DVec3::new(cosine, -sine, 0.0), DVec3::new(sine, cosine, 0.0), DVec3::Z);
    let see = |(): &mut (), at: [f64; 2], point: usize| {
        let surface = frame(normal(at)?, DVec3::Z) * turn;
        Some(reflected(material, &lobes, &light, surface, samples, point as u32))
    };
    sh::unstopped(|stop| draw(edge, stop, |_, _| POINTS, || (), see))
}

/// The exposure of the light, as of every environment.
pub(super) fn exposure() -> f64 {
    // The disk of the lamp is five rows wide.
    let (light, grid) = (BallLight::new(), LatLong::with_rows(64));
    let radiance = |w: DVec3| [(sky(w.z) + light.lamp(w).0) as f32; 3];
    let pixels = (0..grid.len())
        .map(|index| radiance(grid.direction(index / grid.width, index % grid.width).vector()));
    // All values are finite and not negative.
    Environment::new(grid, pixels.collect()).map_or(0.0, |environment| environment.exposure().stops)
}

/// Lays a colour over the pixels outside of the ball.
pub(super) fn surround(picture: &mut [[u8; 3]], edge: usize, colour: [u8; 3]) {
    for (index, pixel) in picture.iter_mut().enumerate() {
        let covered = (inside(OUTLINE, index % edge, index / edge, edge) + 0.5).clamp(0.0, 1.0);
        for (channel, surround) in pixel.iter_mut().zip(colour) {
            let (ball, surround) = (f64::from(*channel), f64::from(surround));
            *channel = (surround + (ball - surround) * covered).round() as u8;
        }
    }
}

/// The ball's normal at a point across and down the picture; `None` outside.
fn normal(at: [f64; 2]) -> Option<DVec3> {
    // Looking along +X, the picture's right is -Y.
    let [y, z] = at.map(|at| -(at / OUTLINE));
    let squared = 1.0 - y * y - z * z;
    (squared > 0.0).then(|| DVec3::new(-squared.sqrt(), y, z))
}

/// The radiance toward the camera with the samples of a point of a pixel; the columns of `surface` are the
/// tangent, the bitangent and the normal.
fn reflected(
    material: &Material,
    lobes: &LobeSampling,
    light: &BallLight,
    surface: DMat3,
    samples: Samples,
    point: u32,
) -> [f64; 3] {
    let to_surface = surface.transpose();
    // Lobes are sampled in f32; rho_hat sees the same view and the same light.
    let view32 = (to_surface * -DVec3::X).as_vec3();
    let view = Direction::normalised(view32.as_dvec3());
    let sequence = Sequence::new(PointSet::Even, 0);
    let mut sum = [0.0; 3];
    let mut add = |incident: Direction, factor: f64| {
        let rho_hat = material.rho_hat(incident, view);
        (0..3).for_each(|channel| sum[channel] += factor * rho_hat[channel]);
    };
    // What both kinds of samples give the lamp: its radiance times the weight of one kind, over the density
    // of all its samples.
    let weighted = |radiance: f64, own: f64, other: f64| radiance * own / (own * own + other * other);
    let [lobe_count, lamp_count] = [samples.lobes, samples.lamp].map(f64::from);
    for i in 0..samples.lobes {
        let incident32 = lobes.sample(sequence.point(point * samples.lobes + i), view32);
        let density = f64::from(lobes.density(incident32, view32));
        if density > 0.0 {
            let incident = Direction::normalised(incident32.as_dvec3());
            let w = surface * incident.vector();
            let (lamp, lamp_density) = light.lamp(w);
            let lamp = weighted(lamp, lobe_count * density, lamp_count * lamp_density);
            add(incident, sky(w.z) / (lobe_count * density) + lamp);
        }
    }
    for i in 0..samples.lamp {
        let w = light.sample(sequence.point(point * samples.lamp + i).map(f64::from));
        let incident32 = (to_surface * w).as_vec3();
        let density = f64::from(lobes.density(incident32, view32));
        let lamp = weighted(light.radiance, lamp_count / light.solid_angle, lobe_count * density);
        add(Direction::normalised(incident32.as_dvec3()), lamp);
    }
    sum
}

#[cfg(test)]
mod tests {
    use brdf::{KajiyaKay, Lambert, Phong};
    use sphere::LatLong;

    use super::*;

    const EDGE: usize = 65;
    const MANY: Samples = Samples { lobes: 512, lamp: 64 };

    /// The radiance at a pixel's centre, and the normal there.
    fn at(picture: &[[f32; 3]], column: usize, row: usize) -> (f64, DVec3) {
        let [y, z] = [column, row].map(|cell| -(2.0 * (cell as f64 + 0.5) / EDGE as f64 - 1.0) / OUTLINE);
        (f64::from(picture[row * EDGE + column][1]), DVec3::new(-(1.0 - y * y - z * z).sqrt(), y, z))
    }

    /// Head on the irradiance is pi M of the sky, and that of the lamp times its cosine.
    #[test]
    fn a_matte_ball_has_the_known_radiance_head_on() {
        let chalk = Material::Lambert(Lambert::new([0.3, 0.8, 0.0]).unwrap());
        let picture = ball(&chalk, 0.0, EDGE, MANY);
        let (found, normal) = at(&picture, EDGE / 2, EDGE / 2);
        assert_eq!(normal, -DVec3::X);
        let cosine = -LAMP_DIRECTION.normalize().x;
        let expected = 0.8 / PI * (PI * SKY + LAMP_IRRADIANCE * cosine);
        // The error of the sequence's 2048 points falls nearly as their number.
        assert!((found / expected - 1.0).abs() < 2e-3, "{found}, not {expected}");
        let [red, green, blue] = picture[EDGE * EDGE / 2];
        assert!((red / green - 0.375).abs() < 1e-6 && blue == 0.0);
    }

    /// The sky's irradiance as a sum over all texels of a fine grid, and the whole lamp above the horizon.
    #[test]
    fn a_matte_ball_has_the_irradiance_of_every_normal() {
        let picture = ball(&Material::Lambert(Lambert::new([1.0; 3]).unwrap()), 0.0, EDGE, MANY);
        let grid = LatLong::with_rows(256);
        for (column, row) in [(20, 20), (32, 8), (44, 54), (10, 30), (32, 57)] {
            let (found, normal) = at(&picture, column, row);
            let mut irradiance = 0.0;
            for texel in 0..grid.len() {
                let (row, column) = (texel / grid.width, texel % grid.width);
                let w = grid.direction(row, column).vector();
                irradiance += grid.solid_angle(row) * sky(w.z) * w.dot(normal).max(0.0);
            }
            let cosine = LAMP_DIRECTION.normalize().dot(normal);
            // Neither partly below the horizon: then it would not be a multiple of the cosine.
            assert!(cosine.abs() > LAMP_RADIUS.sin(), "{cosine}");
            let expected = (irradiance + LAMP_IRRADIANCE * cosine.max(0.0)) / PI;
            assert!((found / expected - 1.0).abs() < 4e-3, "{column} {row}: {found}, not {expected}");
        }
    }

    #[test]
    fn few_samples_are_near_the_integral() {
        let chalk = Material::Lambert(Lambert::new([1.0; 3]).unwrap());
        let [few, many] = [Samples::FEW, MANY].map(|samples| ball(&chalk, 0.0, EDGE, samples));
        let lit = few.iter().zip(&many).filter(|(_, many)| many[1] > 0.0);
        let mut errors: Vec<f32> = lit.map(|(few, many)| (few[1] / many[1] - 1.0).abs()).collect();
        errors.sort_by(f32::total_cmp);
        let (most, of_99) = (errors[errors.len() - 1], errors[errors.len() * 99 / 100]);
        // The pixels at the outline have a point or two.
        assert!(of_99 < 0.04 && most < 0.1, "{of_99} {most}");
    }

    /// The lobe is so narrow that each pixel shows the light in its mirror direction, which between the four
    /// points of a pixel varies by a percent.
    #[test]
    fn a_mirror_shows_the_sky_and_the_lamp_where_they_are() {
        let picture = ball(&Material::Phong(Phong::new(1e6, [1.0; 3]).unwrap()), 0.0, EDGE, MANY);
        let mirrored = |normal: DVec3| DVec3::X - 2.0 * normal.x * normal;
        for (column, row) in [(32, 32), (32, 10), (45, 20), (20, 50), (50, 40)] {
            let (found, normal) = at(&picture, column, row);
            let expected = sky(mirrored(normal).z);
            assert!((found / expected - 1.0).abs() < 0.05, "{column} {row}: {found}, not {expected}");
        }
        let brightest = (0..EDGE * EDGE).max_by(|a, b| picture[*a][1].total_cmp(&picture[*b][1])).unwrap();
        let (found, normal) = at(&picture, brightest % EDGE, brightest / EDGE);
        let lamp = LAMP_DIRECTION.normalize();
        assert!(mirrored(normal).angle_between(lamp) < LAMP_RADIUS, "{normal}");
        let expected = BallLight::new().radiance + sky(lamp.z);
        assert!((found / expected - 1.0).abs() < 0.05, "{found}, not {expected}");
    }

    /// Light that a fibre reflects from below the horizon counts; the tangent decides.
    #[test]
    fn a_turned_tangent_turns_the_highlight() {
        let hair = Material::KajiyaKay(KajiyaKay::new(16.0, [0.1; 3]).unwrap());
        let [along, across] = [0.0, PI / 2.0].map(|azimuth| ball(&hair, azimuth, EDGE, MANY));
        let differ = |column: usize, row: usize| {
            let [one, other] = [&along, &across].map(|picture| at(picture, column, row).0);
            (one / other - 1.0).abs()
        };
        assert!(differ(32, 10) > 0.1 && differ(10, 32) > 0.1, "{} {}", differ(32, 10), differ(10, 32));
        // A quarter turn once more is the same fibre.
        let again = ball(&hair, PI, EDGE, MANY);
        assert!((at(&again, 20, 20).0 / at(&along, 20, 20).0 - 1.0).abs() < 0.02);
    }

    #[test]
    fn the_lamp_has_its_irradiance() {
        let light = BallLight::new();
        let count = 4096;
        let mut sum = 0.0;
        for i in 0..count {
            let w = light.sample(Sequence::new(PointSet::Even, 0).point(i).map(f64::from));
            assert!(
                (w.length() - 1.0).abs() < 1e-12 && w.angle_between(light.lamp.z_axis) < LAMP_RADIUS + 1e-9
            );
            sum += light.radiance * w.dot(light.lamp.z_axis) * light.solid_angle;
        }
        let found = sum / f64::from(count);
        assert!((found / LAMP_IRRADIANCE - 1.0).abs() < 2e-3, "{found}");
    }

    #[test]
    fn only_the_disk_of_the_ball_is_lit() {
        let picture = ball(&Material::Lambert(Lambert::new([1.0; 3]).unwrap()), 0.0, EDGE, MANY);
        let lit = picture.iter().filter(|pixel| pixel[1] > 0.0).count() as f64;
        let disk = PI * (OUTLINE * EDGE as f64 / 2.0).powi(2);
        // Pixels that the outline crosses count in full: half of the circumference too many.
        assert!(lit >= disk && lit < disk + 2.0 * PI * OUTLINE * EDGE as f64 / 2.0, "{lit} {disk}");
        let mut codes = vec![[200; 3]; EDGE * EDGE];
        surround(&mut codes, EDGE, [10; 3]);
        assert_eq!((codes[0], codes[EDGE * EDGE / 2]), ([10; 3], [200; 3]));
    }
}
