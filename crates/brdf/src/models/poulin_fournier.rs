//! `poulin-fournier`: a surface of parallel cylinders, as of brushed metal, satin or a record.
//!
//! Cylinders of radius 1 lie side by side along the tangent (the surface's +X), their axes `distance` apart,
//! and rise to `height` above the floor between them (Poulin and Fournier, "A Model for Anisotropic
//! Reflection", 1990). Each point of cylinders and floor reflects as a matte surface with a highlight of
//! Blinn's: f = diffuse / pi + specular c(s) (n.h)^s, c as in `blinn-phong`. What a cylinder hides from light
//! or view does not count: with L, V, h in the plane of +Y and +Z, angles phi from +Z toward +Y, and n =
//! (0, sin phi, cos phi),
//!
//! > rho_hat = N.L / d (integral of f cos(phi - phi_l) cos(phi - phi_v) dphi / (cos phi_l cos phi_v) + f_0 w)
//!
//! over the arc of a cylinder that both see, d the distance, w the width of the floor that both see and f_0
//! its f. For a view from the side of +Y, the arc begins at phi_v - pi / 2 and ends where the next cylinder
//! hides it, sin(phi - phi_v) = d cos(phi_v) - 1, or at the floor.
//!
//! Both parts are integrated in closed form, the highlight but for the integral of cos^(s+2), for which a
//! material holds a Chebyshev series; shaders integrate it with Gauss' rule, to 3e-6. Poulin and Fournier
//! take Chebyshev polynomials for it, too, and no factor c. Light and view count as 0.06 degrees above the
//! horizon, as seen along the cylinders, if they are lower: nothing is seen of a cylinder from there.
//!
//! The model is reciprocal. Of a constant sky a view sees no more than one point of the surface reflects.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{Vec2, Vec3};
use sphere::{DVec3, Direction};

use super::blinn_phong::factor;
use super::facets::HalfVector;
use super::lobe::Lobe;
use super::model::Model;
use super::parameter::{POWER, Parameter, ParameterError, Range, SPECULAR, Value, Values, WEIGHT};
use crate::packed::{self, packed};

const EXPONENT: Parameter = Parameter::number(
    "exponent",
    "the sharpness of a point's highlight: the power of the half vector's cosine",
    POWER,
);
const DIFFUSE: Parameter =
    Parameter::colour("diffuse", "the share of light that a point's matte part reflects", WEIGHT).or(0.0);
const DISTANCE: Parameter = Parameter::number(
    "distance",
    "the distance between the axes of cylinders, in radii; 2 if they touch",
    Range { least: 2.0, most: 100.0, words: "a number from 2 to 100" },
)
.or(2.0);
const HEIGHT: Parameter = Parameter::number(
    "height",
    "how far cylinders rise above the floor, in radii; 0 is flat, 1 half a cylinder",
    Range { least: 0.0, most: 2.0, words: "a number from 0 to 2" },
)
.or(1.0);

/// The least cosine of phi_l and phi_v.
const MIN_COSINE: f64 = 1e-3;
/// Past an angle where (n.h)^s has fallen to e^-16 the highlight is not integrated.
const FAINT: f64 = 16.0;

/// The number of Chebyshev's terms of the integral of cos^(s+2): the last ones are 1e-12.
const TERMS: usize = 24;

/// Gauss' rule of 16 nodes: those above 0, and their weights.
const GAUSS: [[f64; 2]; 8] = [
    [0.095_012_509_837_637_44, 0.189_450_610_455_068_5],
    [0.281_603_550_779_258_9, 0.182_603_415_044_923_6],
    [0.458_016_777_657_227_4, 0.169_156_519_395_002_54],
    [0.617_876_244_402_643_7, 0.149_595_988_816_576_73],
    [0.755_404_408_355_003, 0.124_628_971_255_533_87],
    [0.865_631_202_387_831_7, 0.095_158_511_682_492_78],
    [0.944_575_023_073_232_6, 0.062_253_523_938_647_89],
    [0.989_400_934_991_649_9, 0.027_152_459_411_754_095],
];

/// A surface of parallel cylinders.
#[derive(Clone, Debug, PartialEq)]
pub struct PoulinFournier {
    exponent: f64,
    diffuse: [f64; 3],
    specular: [f64; 3],
    distance: f64,
    height: f64,
    /// The last angle of a cylinder above the floor, and half its width there.
    edge: f64,
    half_width: f64,
    /// tan(psi / 2) at the angle where cos^s(psi) is e^-16.
    reach: f64,
    /// The integral of cos^(s+2) from 0 to psi: the coefficients of the odd polynomials of Chebyshev in
    /// tan(psi / 2) / `reach`.
    integral: Box<[f64; TERMS]>,
    /// The factor c(s) of the highlight.
    factor: f64,
}

/// The parts of a cylinder, and of the floor to its +Y side, that a direction sees.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// The direction's angle in the plane of +Y and +Z, at least 0.06 degrees from the horizon.
    phi: f64,
    /// The sine of `phi`.
    sine: f64,
    cosine: f64,
    /// The first and the last angle of the arc of the cylinder that is seen.
    arc: [f64; 2],
    /// The places along +Y where the floor begins and ends, from the cylinder's axis.
    floor: [f64; 2],
}

impl PoulinFournier {
    /// Cylinders of this `distance` and `height`, in radii, whose points reflect the shares `diffuse` and
    /// `specular`, RGB, the latter in a highlight (n.h)^`exponent`.
    ///
    /// # Errors
    /// If `exponent` is not a number from 0 to 1e9, a channel of `diffuse` or `specular` not one from 0 to
    /// 1e6, `distance` not one from 2 to 100, or `height` not one from 0 to 2.
    pub fn new(
        exponent: f64,
        diffuse: [f64; 3],
        specular: [f64; 3],
        distance: f64,
        height: f64,
    ) -> Result<Self, ParameterError> {
        let z = 1.0 - HEIGHT.checked(height)?;
        let least = math::exp(-FAINT / EXPONENT.checked(exponent)?.max(1e-3));
        let reach = ((1.0 - least) / (1.0 + least)).sqrt();
        Ok(Self {
            exponent,
            diffuse: DIFFUSE.checked_colour(diffuse)?,
            specular: SPECULAR.checked_colour(specular)?,
            distance: DISTANCE.checked(distance)?,
            height,
            edge: math::acos(z),
            half_width: (1.0 - z * z).max(0.0).sqrt(),
            reach,
            integral: Box::new(series(exponent + 2.0, reach)),
            factor: factor(exponent),
        })
    }

    /// Returns the parts of cylinder and floor that a direction above the horizon sees.
    fn seen(&self, direction: DVec3) -> Seen {
        let across = math::hypot(direction.y, direction.z);
        let cosine = if across > 0.0 { (direction.z / across).max(MIN_COSINE) } else { 1.0 };
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        // The floor is at z = 1 - height, where the circle is 2 b wide.
        let (d, z, b) = (self.distance, 1.0 - self.height, self.half_width);
        // From the side of +Y: the arc begins where it turns away from the view, and the next cylinder hides
        // its end.
        let first = -math::atan2(cosine, sine);
        let last = first + 2.0 * math::asin((0.5 * d * cosine).min(1.0).sqrt());
        let arc = [first.max(-self.edge), last.min(self.edge)];
        let near = if b * sine >= -z * cosine { b } else { (1.0 + z * sine) / cosine };
        let far = if sine > z { d - (1.0 - z * sine) / cosine } else { d - b };
        let phi = first + FRAC_PI_2;
        match direction.y < 0.0 {
            true => {
                Seen { phi: -phi, sine: -sine, cosine, arc: [-arc[1], -arc[0]], floor: [d - far, d - near] }
            }
            false => Seen { phi, sine, cosine, arc, floor: [near, far] },
        }
    }

    /// The integral of cos^s(psi) cos(phi - phi_l) cos(phi - phi_v) over an arc, psi = phi - phi_h; `half` is
    /// h_y and h_z, of any length.
    fn highlight(&self, half: [f64; 2], seen: [Seen; 2], arc: [f64; 2]) -> f64 {
        let length = math::hypot(half[0], half[1]);
        let (sin_h, cos_h, phi_h) = (half[0] / length, half[1] / length, math::atan2(half[0], half[1]));
        // With t = tan(psi / 2) sine and cosine of psi are rational.
        let ends = arc.map(|phi| math::tan((0.5 * (phi - phi_h)).clamp(-0.25 * PI, 0.25 * PI)));
        let [from, to] = [ends[0].max(-self.reach), ends[1].min(self.reach)];
        if from >= to {
            return 0.0;
        }
        // Sine and cosine of phi_h - phi_l and of phi_h - phi_v.
        let [(sin_l, cos_l), (sin_v, cos_v)] =
            seen.map(|of| (sin_h * of.cosine - cos_h * of.sine, cos_h * of.cosine + sin_h * of.sine));
        // The integrals of cos^s from 0 to psi times cos^2, sin^2 and -sin cos, the last up to a constant.
        let s = self.exponent;
        let parts = |t: f64| {
            let scale = 1.0 / (1.0 + t * t);
            let (sine, cosine) = (2.0 * t * scale, (1.0 - t * t) * scale);
            let (power, of_cos2) = (power(cosine, s + 1.0), self.integral_of_cos2(t));
            [of_cos2, (of_cos2 - power * sine) / (s + 1.0), power * cosine / (s + 2.0)]
        };
        let ([cos2, sin2, both], before) = (parts(to), parts(from));
        let sum = cos_l * cos_v * (cos2 - before[0]) + sin_l * sin_v * (sin2 - before[1]);
        (sum + (cos_l * sin_v + sin_l * cos_v) * (both - before[2])).max(0.0)
    }

    /// The integral of cos^(s+2) from 0 to psi, t = tan(psi / 2).
    fn integral_of_cos2(&self, t: f64) -> f64 {
        let x = t / self.reach;
        // Clenshaw's sum: T_(n+2) = 2 (2 x^2 - 1) T_n - T_(n-2).
        let twice = 4.0 * x * x - 2.0;
        let (mut sum, mut last) = (0.0, 0.0);
        for coefficient in self.integral.iter().rev() {
            (sum, last) = (twice * sum + (coefficient - last), sum);
        }
        x * (sum - last)
    }

    /// Whether a view along the normal sees a floor.
    fn has_floor(&self) -> bool {
        self.height < 1.0 || self.distance > 2.0
    }
}

/// Returns cos^s; 0 if the cosine is not above 0.
fn power(cosine: f64, s: f64) -> f64 {
    if cosine > 0.0 { math::exp(s * math::ln(cosine)) } else { 0.0 }
}

/// The integral of cos^s(psi) from 0 on, as coefficients of T_1, T_3, ... in tan(psi / 2) / `reach`.
fn series(s: f64, reach: f64) -> [f64; TERMS] {
    let slope = |t: f64| 2.0 / (1.0 + t * t) * power((1.0 - t * t) / (1.0 + t * t), s);
    // Chebyshev's nodes above 0 from the least on; an odd function has the others too.
    let angle = |node: usize| PI * (TERMS - 1 - node) as f64 / (2 * TERMS) as f64 + 0.25 * PI / TERMS as f64;
    let (mut from, mut integral) = (0.0, 0.0);
    let mut coefficients = [0.0; TERMS];
    for node in 0..TERMS {
        let to = reach * math::cos(angle(node));
        let (middle, radius) = (0.5 * (from + to), 0.5 * (to - from));
        let rule = GAUSS.iter();
        let sum = rule.map(|[x, weight]| weight * (slope(middle - radius * x) + slope(middle + radius * x)));
        integral += radius * sum.sum::<f64>();
        from = to;
        for (k, coefficient) in coefficients.iter_mut().enumerate() {
            let wave = math::cos((2 * k + 1) as f64 * angle(node));
            *coefficient += 2.0 / TERMS as f64 * integral * wave;
        }
    }
    coefficients
}

/// The integral of cos(phi - phi_l) cos(phi - phi_v) over an arc.
fn matte([light, view]: [Seen; 2], [from, to]: [f64; 2]) -> f64 {
    let sum = light.phi + view.phi;
    let between = light.cosine * view.cosine + light.sine * view.sine;
    0.5 * (between * (to - from) + 0.5 * (math::sin(2.0 * to - sum) - math::sin(2.0 * from - sum)))
}

packed! {
    /// The constants of the formula of `poulin-fournier`.
    pub struct PoulinFournierConstants as poulin_fournier {
        /// s.
        exponent: f32,
        /// d.
        distance: f32,
        /// The height of the floor, 0 at the cylinders' axes.
        floor: f32,
        /// The last angle of a cylinder above the floor.
        edge: f32,
        /// Half the width of a cylinder at the floor.
        half_width: f32,
        /// The greatest tan(psi / 2).
        reach: f32,
        /// diffuse / pi.
        diffuse: Vec3,
        /// specular c(s).
        specular: Vec3,
        /// The nodes above 0 of Gauss' rule, each with its weight.
        gauss: [Vec2; 8],
    }
}

impl Model for PoulinFournier {
    type Constants = PoulinFournierConstants;

    const NAME: &'static str = "poulin-fournier";
    const SUMMARY: &'static str = "parallel cylinders along the tangent, as of brushed metal or satin";
    const DETAILS: &'static str = "\
Each point of the cylinders, and of the floor between them, is matte with a highlight; what one cylinder
hides of the next does not count (Poulin and Fournier 1990). The highlight is drawn out across the
cylinders; higher or closer cylinders draw it out more.";
    const PARAMETERS: &'static [Parameter] = &[EXPONENT, DIFFUSE, SPECULAR, DISTANCE, HEIGHT];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(
            values.number("exponent")?,
            values.colour("diffuse")?,
            values.colour("specular")?,
            values.number("distance")?,
            values.number("height")?,
        )
    }

    fn values(&self) -> Values {
        Values::default()
            .with("exponent", Value::Number(self.exponent))
            .with("diffuse", Value::Colour(self.diffuse))
            .with("specular", Value::Colour(self.specular))
            .with("distance", Value::Number(self.distance))
            .with("height", Value::Number(self.height))
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let Some(half) = HalfVector::new(incident, outgoing) else { return [0.0; 3] };
        let [light, view] = [incident, outgoing].map(|direction| self.seen(direction.vector()));
        let both = |one: [f64; 2], other: [f64; 2]| [one[0].max(other[0]), one[1].min(other[1])];
        let (arc, floor) = (both(light.arc, view.arc), both(light.floor, view.floor));
        let scale = half.light / self.distance;
        let (mut diffuse, mut specular) = (0.0, 0.0);
        if arc[0] < arc[1] {
            let seen = [light, view];
            let scale = scale / (light.cosine * view.cosine);
            diffuse += scale * matte(seen, arc).max(0.0);
            let sum = half.sum;
            let across = power((1.0 - sum.x * sum.x / half.length_squared).max(0.0), 0.5 * self.exponent);
            specular += scale * across * self.highlight([sum.y, sum.z], seen, arc);
        }
        if floor[0] < floor[1] {
            let width = scale * (floor[1] - floor[0]);
            diffuse += width;
            specular += width * power(half.cos2().min(1.0), 0.5 * self.exponent);
        }
        let (diffuse, specular) = (diffuse / PI, specular * self.factor);
        [0, 1, 2].map(|channel| self.diffuse[channel] * diffuse + self.specular[channel] * specular)
    }

    fn constants(&self) -> PoulinFournierConstants {
        PoulinFournierConstants {
            exponent: self.exponent as f32,
            distance: self.distance as f32,
            floor: (1.0 - self.height) as f32,
            edge: self.edge as f32,
            half_width: self.half_width as f32,
            reach: self.reach as f32,
            diffuse: packed::rgb(self.diffuse.map(|diffuse| diffuse / PI)),
            specular: packed::rgb(self.specular.map(|specular| specular * self.factor)),
            gauss: GAUSS.map(packed::two),
        }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        Ok(vec![Self::new(20.0, [0.3; 3], [0.7, 0.5, 0.0], 2.2, 1.0)?])
    }

    fn lobes(&self) -> Vec<Lobe> {
        let width = (2.0 / (self.exponent + 2.0)).sqrt();
        let mut lobes = vec![Lobe::facets([width, 1.0]), Lobe::Cosine];
        if self.has_floor() {
            lobes.push(Lobe::facets([width; 2]));
        }
        lobes
    }

    fn is_isotropic(&self) -> bool {
        self.height == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BlinnPhong, Lambert};

    /// Whether a point of the profile, in (y, z), sees far along a direction: no cylinder and no floor is in
    /// the way. Cylinders are sought one by one.
    fn is_open(model: &PoulinFournier, [y, z]: [f64; 2], direction: [f64; 2], own: i32) -> bool {
        let length = direction[0].hypot(direction[1]);
        let [dy, dz] = direction.map(|axis| axis / length);
        (-40..=41).filter(|k| *k != own).all(|k| {
            let (cy, cz) = (f64::from(k) * model.distance - y, -z);
            let along = cy * dy + cz * dz;
            let across = cy * dz - cz * dy;
            across.abs() >= 1.0 || along + (1.0 - across * across).sqrt() <= 0.0
        })
    }

    /// The integral over one period of the profile by small steps, each point's visibility by rays.
    fn by_brute_force(model: &PoulinFournier, light: DVec3, view: DVec3) -> [f64; 2] {
        let half = (light + view).normalize();
        let z = 1.0 - model.height;
        let (edge, b) = (z.acos(), (1.0 - z * z).max(0.0).sqrt());
        let [to_light, to_view] = [light, view].map(|v| [v.y, v.z]);
        let mut sums = [0.0; 2];
        let mut add = |place: [f64; 2], n: DVec3, own: i32, area: f64| {
            let (cos_l, cos_v) = (n.dot(light), n.dot(view));
            let above = cos_l > 0.0 && cos_v > 0.0;
            if above && is_open(model, place, to_light, own) && is_open(model, place, to_view, own) {
                let weight = cos_l * cos_v * area / (model.distance * view.z);
                sums[0] += weight / PI;
                sums[1] += weight * n.dot(half).max(0.0).powf(model.exponent) * factor(model.exponent);
            }
        };
        let steps = 20_000;
        for step in 0..steps {
            let share = (f64::from(step) + 0.5) / f64::from(steps);
            let phi = edge * (2.0 * share - 1.0);
            let n = DVec3::new(0.0, phi.sin(), phi.cos());
            add([n.y, n.z], n, 0, 2.0 * edge / f64::from(steps));
            let y = b + (model.distance - 2.0 * b) * share;
            // A point below a cylinder is outside of it, so that none is its own.
            add([y, z], DVec3::Z, 99, (model.distance - 2.0 * b) / f64::from(steps));
        }
        sums
    }

    fn shapes() -> impl Iterator<Item = [f64; 2]> {
        let heights = [0.0, 0.2, 0.7, 1.0, 1.4, 2.0];
        heights.into_iter().flat_map(|height| [2.0, 2.6, 5.0].map(|distance| [distance, height]))
    }

    fn direction(k: f64) -> Direction {
        Direction::from_angles((k * 0.618_034).fract() * 1.5, k * 2.399_963)
    }

    /// The integrals of cos^(s+2) by 2^16 steps of the middle rule.
    #[test]
    fn the_series_is_the_integral_of_a_power_of_the_cosine() {
        for s in [0.0, 0.3, 1.0, 20.0, 1e3, 1e6] {
            let model = PoulinFournier::new(s, [0.0; 3], [1.0; 3], 2.0, 1.0).unwrap();
            for share in [1.0, 0.9, 0.3, -0.01, -0.7] {
                let t = share * model.reach;
                let step = 2.0 * t.atan() / f64::from(1 << 16);
                let at = |i: i32| ((f64::from(i) + 0.5) * step).cos().powf(s + 2.0);
                let expected = step * (0..1 << 16).map(at).sum::<f64>();
                let found = model.integral_of_cos2(t);
                assert!((found - expected).abs() < 2e-9 * model.reach, "{s} {share}: {found} {expected}");
            }
        }
    }

    #[test]
    fn the_sum_over_visible_cylinders_is_that_of_brute_force() {
        for [distance, height] in shapes() {
            for exponent in [0.0, 8.0, 200.0] {
                let model = |diffuse, specular| {
                    PoulinFournier::new(exponent, [diffuse; 3], [specular; 3], distance, height).unwrap()
                };
                let [matte, shiny] = [model(1.0, 0.0), model(0.0, 1.0)];
                for k in 0..12 {
                    let [light, view] = [0.3, 17.7].map(|seed| direction(f64::from(k) + seed));
                    let expected = by_brute_force(&matte, light.vector(), view.vector());
                    let found = [&matte, &shiny].map(|model| model.rho_hat(light, view)[0]);
                    for (found, expected) in found.into_iter().zip(expected) {
                        // A step at each end of what is seen.
                        let error = (found - expected).abs();
                        assert!(
                            error < 1e-3 * expected + 2e-4,
                            "{distance} {height} {exponent} {k}: {found} {expected}"
                        );
                    }
                }
            }
        }
    }

    /// The parts of cylinders and floor that a view sees have, turned toward it, the area that it sees.
    #[test]
    fn what_a_view_sees_has_the_area_of_the_surface() {
        for [distance, height] in shapes() {
            let model = PoulinFournier::new(1.0, [1.0; 3], [0.0; 3], distance, height).unwrap();
            for k in 0..100 {
                let phi = (f64::from(k) / 50.0 - 0.99) * 1.569;
                let Seen { phi, arc, floor, .. } = model.seen(DVec3::new(0.0, phi.sin(), phi.cos()));
                let arc = if arc[0] < arc[1] { (arc[1] - phi).sin() - (arc[0] - phi).sin() } else { 0.0 };
                let floor = (floor[1] - floor[0]).max(0.0) * phi.cos();
                let error = (arc + floor - distance * phi.cos()).abs();
                assert!(error < 1e-12, "{distance} {height} {phi}: {arc} {floor}");
            }
        }
    }

    /// A surface of cylinders without height is a matte one with Blinn's highlight.
    #[test]
    fn cylinders_of_no_height_are_a_plane() {
        let flat = PoulinFournier::new(30.0, [0.4; 3], [0.6; 3], 2.5, 0.0).unwrap();
        let (matte, shiny) = (Lambert::new([0.4; 3]).unwrap(), BlinnPhong::new(30.0, [0.6; 3]).unwrap());
        assert!(flat.is_isotropic());
        for k in 0..60 {
            let [light, view] = [0.3, 17.7].map(|seed| direction(f64::from(k) + seed));
            let expected = matte.rho_hat(light, view)[0] + shiny.rho_hat(light, view)[0];
            assert!((flat.rho_hat(light, view)[0] - expected).abs() < 1e-12 * expected.max(1.0));
        }
    }

    /// Compares Gauss' rule with a sum of 10^5 steps: [`FAINT`] leaves 1e-7, the nodes 3e-6.
    #[test]
    fn the_highlight_is_integrated_to_a_few_millionths() {
        for exponent in [0.0, 1.0, 7.5, 60.0, 3000.0, 1e5] {
            let model = PoulinFournier::new(exponent, [0.0; 3], [1.0; 3], 2.0, 1.0).unwrap();
            let width = (2.0 / (exponent + 2.0)).sqrt();
            for (phi_h, light, view, arc) in [
                (0.1, 0.4, -0.2, [-1.0, 1.2]),
                (0.1, 0.4, -0.2, [0.1 - width, 0.1 + 0.3 * width]),
                (0.0, -1.0, 1.0, [-0.5, 0.5]),
            ] {
                let steps = 100_000;
                let step = (arc[1] - arc[0]) / f64::from(steps);
                let at = |k: i32| {
                    let phi = arc[0] + step * (f64::from(k) + 0.5);
                    (phi - phi_h).cos().powf(exponent) * (phi - light).cos() * (phi - view).cos()
                };
                let expected: f64 = (0..steps).map(|k| step * at(k)).sum();
                let seen = [light, view].map(|phi: f64| Seen {
                    phi,
                    sine: phi.sin(),
                    cosine: phi.cos(),
                    arc,
                    floor: [0.0; 2],
                });
                let found = model.highlight([2.0 * f64::sin(phi_h), 2.0 * f64::cos(phi_h)], seen, arc);
                assert!((found / expected - 1.0).abs() < 3e-6, "{exponent} {arc:?}: {found} {expected}");
            }
        }
    }
}
