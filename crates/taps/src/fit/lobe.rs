//! What a material reflects toward one view, in many small shares.

use std::f64::consts::PI;

use brdf::{Centre, Material};
use sphere::{DVec3, Direction};

use super::spots::Spots;

/// The angles from R and the azimuths of the directions that light is taken from, on one side.
const ANGLES: usize = 64;
const AZIMUTHS: usize = 24;

/// The reflection of a material toward one view, which is the same on both sides of the plane of view and
/// normal.
#[derive(Clone, Debug)]
pub(super) struct Lobe {
    /// Directions of light with y >= 0 in the frame of R (+Z is R, +X lies toward the normal), and rho_hat
    /// there times the solid angle of both sides, RGB.
    pub(super) shares: Vec<(DVec3, [f64; 3])>,
}

impl Lobe {
    /// The lobe toward a view at an angle from the normal, in the mean over all turns of the surface;
    /// directions are dense within `width` of R.
    pub(super) fn new(material: &Material, theta: f64, width: f64) -> Self {
        let (sine, cosine) = math::sin_cos(theta);
        let view = Direction::from_unit(DVec3::new(sine, 0.0, cosine));
        let (r, toward) = (DVec3::new(-sine, 0.0, cosine), DVec3::new(cosine, 0.0, sine));
        let scale = 0.5 * width;
        let end = math::asinh(PI / scale);
        let angle = |part: f64| scale * math::sinh(end * part / ANGLES as f64);
        let (mut shares, turns) = (Vec::new(), turns(material));
        for i in 0..ANGLES {
            let ring = math::cos(angle(i as f64)) - math::cos(angle((i + 1) as f64));
            let solid_angle = 2.0 * PI * ring / AZIMUTHS as f64;
            let (s, c) = math::sin_cos(angle(i as f64 + 0.5));
            for j in 0..AZIMUTHS {
                let (y, x) = math::sin_cos(PI * (j as f64 + 0.5) / AZIMUTHS as f64);
                let local = DVec3::new(s * x, s * y, c);
                let light = local.x * toward + local.y * DVec3::Y + local.z * r;
                let rho = material.mean_over_turns(turns, Direction::from_unit(light), view);
                if rho != [0.0; 3] {
                    shares.push((local, rho.map(|rho| rho.max(0.0) * solid_angle)));
                }
            }
        }
        Self { shares }
    }

    /// What some channels of the lobe, or the sum of all if it is `None`, reflect of each spot, size by size,
    /// if the albedo of each is 1.
    pub(super) fn seen<const N: usize>(
        &self,
        channels: [Option<usize>; N],
        spots: &[Spots],
    ) -> [Vec<f64>; N] {
        let of = |channel: Option<usize>, rgb: &[f64; 3]| {
            channel.map_or_else(|| rgb.iter().sum(), |channel| rgb[channel])
        };
        let wholes = channels
            .map(|channel| self.shares.iter().map(|(_, rgb)| of(channel, rgb)).sum::<f64>().max(1e-30));
        let shares: Vec<(DVec3, [f64; N])> = (self.shares.iter())
            .map(|(direction, rgb)| {
                let share = |index: usize| of(channels[index], rgb) / wholes[index];
                let shares = std::array::from_fn(|index| Some(share(index)).filter(|share| *share > 1e-9));
                (*direction, shares.map(|share| share.unwrap_or(0.0)))
            })
            .collect();
        let mut truths = [const { Vec::new() }; N];
        for spots in spots {
            for centre in &spots.centres {
                let mirrored = DVec3::new(centre.x, -centre.y, centre.z);
                let mut sums = [0.0; N];
                for (direction, shares) in &shares {
                    let radiance =
                        spots.radiance(centre.dot(*direction)) + spots.radiance(mirrored.dot(*direction));
                    (0..N).for_each(|index| sums[index] += shares[index] * radiance);
                }
                (0..N).for_each(|index| truths[index].push(0.5 * sums[index]));
            }
        }
        truths
    }

    /// Whether the lobe has one shape in all colours.
    pub(super) fn is_of_one_colour(&self) -> bool {
        is_of_one_colour(&self.shares)
    }

    /// The directional albedo, RGB.
    pub(super) fn albedo(&self) -> [f64; 3] {
        albedo(&self.shares)
    }
}

/// Whether shares have one shape in all colours: their parts of the albedo differ by less than a hundredth of
/// it.
pub(super) fn is_of_one_colour(shares: &[(DVec3, [f64; 3])]) -> bool {
    let albedo = albedo(shares);
    let whole: f64 = albedo.iter().sum();
    (0..3).all(|channel| {
        let differs = |(_, share): &(DVec3, [f64; 3])| {
            (share[channel] / albedo[channel] - share.iter().sum::<f64>() / whole).abs()
        };
        albedo[channel] <= 0.0 || shares.iter().map(differs).sum::<f64>() < 0.01
    })
}

/// The sum of shares, RGB.
pub(super) fn albedo(shares: &[(DVec3, [f64; 3])]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (_, share) in shares {
        (0..3).for_each(|channel| sum[channel] += share[channel]);
    }
    sum
}

/// The turns of the surface over which a material is averaged: 1 if it is isotropic.
pub(crate) fn turns(material: &Material) -> usize {
    match material.centre() {
        Centre::Tangent => STRAND_TURNS,
        _ => material.turns(),
    }
}

/// The turns of a material about its tangent.
const STRAND_TURNS: usize = 25;

/// The width of a material's lobe seen head on, in radians: that of a Gaussian with its peak and its albedo.
pub(crate) fn width(material: &Material) -> f64 {
    let guess = material.highlight_width().clamp(0.01, 0.7);
    let whole: f64 = Lobe::new(material, 0.0, guess).albedo().iter().sum();
    let peak: f64 = material.mean_over_turns(turns(material), Direction::Z, Direction::Z).iter().sum();
    if peak > 0.0 && whole > 0.0 { (whole / (2.0 * PI * peak)).sqrt().clamp(0.005, 0.7) } else { guess }
}
