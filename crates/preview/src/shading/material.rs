//! rho_hat of every reflection model, in f32, from a material packed into words as the shader reads it.
//!
//! rho_hat is the BRDF times the incident cosine, in 1/sr, RGB, in the frame of the surface: +Z the normal,
//! +X the tangent (`brdf::Model::rho_hat`, whose module texts have the formulas and papers). The words are
//! u32:
//!
//! | words | what |
//! | --- | --- |
//! | 1 | the number of layers; a material that is not a sum is one layer |
//! | per layer 1 | its model: its place in `brdf::for_each_model`, from 0 on; then measured tables, and those that depend on the tangent |
//! | 1 | the number of words that follow |
//! | | the constants of its formula (`brdf::Material::constants`), each as the bits of its f32 |
//!
//! Each model has one formula here, a method of `Layer` named after the model's module, and the same formula
//! in material.wgsl, `material_` and that name. The choice between them is made from the list, in both
//! languages. What the formulas share is in `terms.rs` and terms.wgsl.
//!
//! The formulas are written for f32: they take the power of a cosine near 1 from the square of its sine and
//! an angle from an arc tangent, and they decide before a division what would be 0 / 0 or out of range. No
//! value is infinite or NaN, for any two unit vectors.

pub(super) mod terms;
#[cfg(test)]
pub(super) mod tests;

use std::collections::BTreeSet;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

use brdf::{MODELS, Material};
use glam::{Vec3, Vec4};

use self::terms::{
    Half, NEAR, TINY, bounded_exp, conductor, dielectric, fifth, half_and_difference, half_difference,
    lambda_cosine, ln_cosine, one_less_sinc, power, power_of,
};
use super::angles::{angle, circle};
use super::shader_constants::shader_constants;
use crate::RenderError;

shader_constants!("MATERIAL_":
    /// A Gaussian of a squared slope over a squared roughness is 0 in f32 from here on, with room for its
    /// factors.
    STEEP: f32 = 80.0;
    /// The least cosine in factors that have no bound at grazing: see ashikhmin-shirley and ward.
    MIN_COSINE: f32 = 1e-3;
    /// The least cosine of light and view in the masking of fibres.
    GRAZING: f32 = 1e-4;
);

/// The formula of a model.
struct Formula {
    /// The name of the method of [`Layer`]; the shader's function has the prefix `material_` before it.
    name: &'static str,
    rho_hat: fn(Layer<'_>, Vec3, Vec3) -> Vec3,
}

macro_rules! formulas {
    ($($module:ident::$model:ident),* $(,)?) => {
        formulas!(@ $($module,)* measured, measured_anisotropic);
    };
    (@ $($name:ident),*) => {
        /// The formula of every model, by its number.
        const FORMULAS: &[Formula] = &[$(Formula {
            name: stringify!($name),
            rho_hat: |layer, light, view| layer.$name(light, view),
        },)*];
    };
}
brdf::for_each_model!(formulas);

/// The text of the shader for layers of these models, by their numbers in [`PackedMaterial::models`]:
/// constants, what the formulas share, the choice between them, and material.wgsl.
///
/// A shader knows the models of its material alone: some devices go through every formula that it names, for
/// each look at the material.
pub fn shader(models: &BTreeSet<u32>) -> String {
    let wanted = |(number, _): &(usize, &Formula)| models.contains(&(*number as u32));
    let cases = FORMULAS.iter().enumerate().filter(wanted).map(|(number, Formula { name, .. })| {
        format!("        case {number}u: {{ return material_{name}(at, light, view); }}\n")
    });
    let choice = format!(
        "fn material_layer(model: u32, at: u32, light: vec3f, view: vec3f) -> vec3f {{\n    switch model {{\n{}\
         \x20       default: {{ return vec3f(0.0); }}\n    }}\n}}\n",
        cases.collect::<String>(),
    );
    [&terms::shader(), WGSL_CONSTANTS, &choice, include_str!("material.wgsl")].concat()
}

/// The numbers of all models.
#[cfg(test)]
pub(crate) fn all_models() -> BTreeSet<u32> {
    (0..FORMULAS.len() as u32).collect()
}

/// The number of a layer's model.
fn number(layer: &Material) -> u32 {
    let of_table = MODELS.len() + usize::from(matches!(layer, Material::MeasuredAnisotropic(_)));
    MODELS.iter().position(|model| model.name == layer.name()).unwrap_or(of_table) as u32
}

/// A material as the shader reads it.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedMaterial {
    words: Vec<u32>,
}

impl PackedMaterial {
    /// Packs a material.
    ///
    /// # Errors
    /// [`RenderError::Maps`] if its measured tables are too large for the shader to count their words.
    pub fn new(material: &Material) -> Result<Self, RenderError> {
        let layers = material.leaves();
        let mut words = vec![layers.len() as u32];
        for layer in layers {
            let constants = layer.constants();
            words.extend([number(layer), constants.len() as u32]);
            words.extend(constants.iter().map(|value| value.to_bits()));
        }
        match u32::try_from(words.len()) {
            Ok(_) => Ok(Self { words }),
            Err(_) => {
                Err(RenderError::maps("the measured layers of a material are too large for brute force"))
            }
        }
    }

    /// The numbers of the layers' models.
    pub fn models(material: &Material) -> BTreeSet<u32> {
        material.leaves().into_iter().map(number).collect()
    }

    /// The words, for the buffer `material` of the shader.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// rho_hat(incident, outgoing), RGB, in 1/sr: both unit vectors in the frame of the surface, away from
    /// it.
    pub fn evaluate(&self, incident: Vec3, outgoing: Vec3) -> Vec3 {
        let (count, mut rest) = (self.words[0], &self.words[1..]);
        let mut sum = Vec3::ZERO;
        for _ in 0..count {
            let (words, others) = rest[2..].split_at(rest[1] as usize);
            sum += (FORMULAS[rest[0] as usize].rho_hat)(Layer { words }, incident, outgoing);
            rest = others;
        }
        sum
    }
}

/// The constants of a layer.
#[derive(Clone, Copy)]
struct Layer<'w> {
    words: &'w [u32],
}

impl Layer<'_> {
    fn number(self, k: usize) -> f32 {
        f32::from_bits(self.words[k])
    }

    fn colour(self, k: usize) -> Vec3 {
        Vec3::new(self.number(k), self.number(k + 1), self.number(k + 2))
    }

    fn standard(self, light: Vec3, view: Vec3) -> Vec3 {
        let Some(half) = Half::new(light, view) else { return Vec3::ZERO };
        let of_light = self.at_cosine(24, half.light);
        let of_view = self.at_cosine(24, half.view);
        let grazing = fifth((1.0 - half.facet()).max(0.0));
        let coat =
            (self.number(6) + (self.number(7) - self.number(6)) * grazing) * half.facets(self.number(5));
        let (f_0, f_90) = (self.colour(1), Vec3::splat(self.number(4)));
        let highlight = of_light.y.min(of_view.y) * half.facets(self.number(0));
        let mut sum = Vec3::splat(coat) + (f_0 + (f_90 - f_0) * grazing) * highlight;
        let sheen = self.colour(8);
        if sheen.max_element() > 0.0 {
            sum += sheen * (of_light.x.min(of_view.x) * self.charlie(11, half) * half.light);
        }
        sum + self.colour(18) * (of_light.z * of_view.z * half.light)
            + self.colour(21) * (of_light.w * of_view.w * half.light)
    }

    fn lambert(self, light: Vec3, _: Vec3) -> Vec3 {
        self.colour(0) * light.z.max(0.0)
    }

    fn oren_nayar(self, light: Vec3, view: Vec3) -> Vec3 {
        if light.z <= 0.0 {
            return Vec3::ZERO;
        }
        let across = (light.x * view.x + light.y * view.y).max(0.0) / light.z.max(view.z.abs());
        (self.colour(0) + self.colour(3) * across) * light.z
    }

    fn phong(self, light: Vec3, view: Vec3) -> Vec3 {
        let mirrored = Vec3::new(-view.x, -view.y, view.z);
        let sine = light.cross(mirrored);
        self.colour(1) * power(light.dot(mirrored), sine.dot(sine), self.number(0))
    }

    fn blinn_phong(self, light: Vec3, view: Vec3) -> Vec3 {
        let Some(half) = Half::new(light, view) else { return Vec3::ZERO };
        self.colour(1) * (half.light * half.power(self.number(0)))
    }

    fn microfacet(self, light: Vec3, view: Vec3) -> Vec3 {
        let sum = light + view;
        if light.z <= 0.0 || sum.dot(sum) <= 0.0 {
            return Vec3::ZERO;
        }
        let theta_h = angle(sum.truncate().length(), sum.z);
        let share = theta_h / self.number(0);
        self.colour(1) * math::exp(-(share * share).min(STEEP))
    }

    fn torrance_sparrow(self, light: Vec3, view: Vec3) -> Vec3 {
        let Some(half) = Half::new(light, view) else { return Vec3::ZERO };
        let m = self.number(0);
        let across = half.across() / (m * m);
        let z2 = half.sum.z * half.sum.z;
        if across >= STEEP * z2 {
            return Vec3::ZERO;
        }
        let cos2 = z2 / half.length_squared;
        let d = math::exp(-across / z2) / (cos2 * cos2);
        let masked = half.light * half.view
            + half.view * lambda_cosine(m, half.light)
            + half.light * lambda_cosine(m, half.view);
        self.colour(1) * self.fresnel(4, half) * (d * half.light / masked)
    }

    fn ggx(self, light: Vec3, view: Vec3) -> Vec3 {
        let Some(half) = Half::new(light, view) else { return Vec3::ZERO };
        // Facets of one width have the same formula: alpha_x alpha_y is alpha^2, and their ratio 1.
        let (product, ratio) = (self.number(0), self.number(13));
        let sum = half.sum;
        let across = sum.x * sum.x * ratio + sum.y * sum.y / ratio + product * sum.z * sum.z;
        let across = across / half.length_squared;
        let masked = |v: Vec3, cosine: f32| {
            (self.number(11) * v.x * v.x + self.number(12) * v.y * v.y + cosine * cosine).sqrt()
        };
        let masked = half.light * masked(view, half.view) + half.view * masked(light, half.light);
        self.colour(1) * self.fresnel(4, half) * (half.light / masked / (across * across))
    }

    fn ward(self, light: Vec3, view: Vec3) -> Vec3 {
        let Some(half) = Half::new(light, view) else { return Vec3::ZERO };
        let (x, y, z) = (half.sum.x / self.number(0), half.sum.y / self.number(1), half.sum.z);
        let across = x * x + y * y;
        if across >= STEEP * z * z {
            return Vec3::ZERO;
        }
        let slopes = across / (z * z);
        let lobe =
            math::exp(-slopes) * (half.length_squared / (z * z)) * (half.light / z / z.max(MIN_COSINE));
        self.colour(2) * lobe
    }

    fn ashikhmin_shirley(self, light: Vec3, view: Vec3) -> Vec3 {
        let Some(half) = Half::new(light, view) else { return Vec3::ZERO };
        let (sum, across, facet) = (half.sum, half.across(), half.facet());
        let turned = self.number(0) * sum.x * sum.x + self.number(1) * sum.y * sum.y;
        let exponent = if across > 0.0 { turned / across } else { 0.0 };
        let lobe = self.number(2) * half.power(exponent) / facet.max(MIN_COSINE)
            * (half.light / half.light.max(half.view));
        let grazing = fifth((1.0 - facet).max(0.0));
        let fade = |cosine: f32| 1.0 - fifth(1.0 - 0.5 * cosine);
        let base = fade(half.light) * fade(half.view) * half.light;
        let specular = self.colour(3);
        (specular + (Vec3::ONE - specular) * grazing) * lobe + self.colour(6) * base
    }

    fn poulin_fournier(self, light: Vec3, view: Vec3) -> Vec3 {
        let Some(half) = Half::new(light, view) else { return Vec3::ZERO };
        let (of_light, of_view) = (self.cylinder(light), self.cylinder(view));
        let arc = [of_light.arc[0].max(of_view.arc[0]), of_light.arc[1].min(of_view.arc[1])];
        let floor = [of_light.floor[0].max(of_view.floor[0]), of_light.floor[1].min(of_view.floor[1])];
        let (s, scale) = (self.number(0), half.light / self.number(1));
        let (mut diffuse, mut specular) = (0.0, 0.0);
        if arc[0] < arc[1] {
            let scale = scale / (of_light.cosine * of_view.cosine);
            let (middle, radius) = (0.5 * (arc[0] + arc[1]), 0.5 * (arc[1] - arc[0]));
            let [from_light, from_view] = [of_light, of_view].map(|of| circle((middle - of.phi) / TAU).x);
            let twice = circle((2.0 * middle - of_light.phi - of_view.phi) / TAU).x;
            let matte = 2.0 * from_light * from_view - one_less_sinc(2.0 * radius) * twice;
            diffuse += scale * (radius * matte).max(0.0);
            let sum = half.sum;
            let along = sum.x * sum.x / half.length_squared;
            let across = power((1.0 - along).max(0.0).sqrt(), along, s);
            specular += scale * across * self.cylinder_highlight(sum, [of_light, of_view], arc);
        }
        if floor[0] < floor[1] {
            let width = scale * (floor[1] - floor[0]);
            diffuse += width;
            specular += width * half.power(0.5 * s);
        }
        self.colour(6) * diffuse + self.colour(9) * specular
    }

    fn lafortune(self, light: Vec3, view: Vec3) -> Vec3 {
        if light.z <= 0.0 {
            return Vec3::ZERO;
        }
        let (across, along) = (light.x * view.x + light.y * view.y, light.z * view.z);
        let mut brdf = self.colour(0);
        for lobe in 0..self.number(3) as usize {
            let k = 4 + 6 * lobe;
            let base = self.number(k) * across + self.number(k + 1) * along;
            brdf += self.colour(k + 3) * power_of(base, self.number(k + 2));
        }
        brdf * light.z
    }

    fn kajiya_kay(self, light: Vec3, view: Vec3) -> Vec3 {
        let (sin_i, sin_o) =
            (Vec3::new(0.0, light.y, light.z).length(), Vec3::new(0.0, view.y, view.z).length());
        let sine = sin_i * view.x - light.x * sin_o;
        self.colour(1) * power(light.x * view.x + sin_i * sin_o, sine * sine, self.number(0))
    }

    fn measured(self, light: Vec3, view: Vec3) -> Vec3 {
        if light.z <= 0.0 {
            return Vec3::ZERO;
        }
        let [theta_h, theta_d, phi_d] = half_difference(light, view);
        let [n_h, n_d, n_phi] = [0, 1, 2].map(|axis| self.number(axis) as usize);
        let (h, to_h) = place((theta_h / FRAC_PI_2).sqrt(), n_h);
        let (d, to_d) = place(theta_d / FRAC_PI_2, n_d);
        let turn = phi_d / PI * n_phi as f32;
        let phi = turn as usize;
        let to_phi = turn - phi as f32;
        let low = [h * n_d + d, h * n_d + (d + 1).min(n_d - 1)];
        let step = if h + 1 < n_h { n_d } else { 0 };
        let row = |row: usize| {
            let [before, after] =
                [phi % n_phi, (phi + 1) % n_phi].map(|column| self.colour(6 + 3 * (row * n_phi + column)));
            before + (after - before) * to_phi
        };
        let near = row(low[0]) * (1.0 - to_d) + row(low[1]) * to_d;
        let far = row(low[0] + step) * (1.0 - to_d) + row(low[1] + step) * to_d;
        self.colour(3) * (near * (1.0 - to_h) + far * to_h) * light.z
    }

    fn measured_anisotropic(self, light: Vec3, view: Vec3) -> Vec3 {
        if light.z <= 0.0 {
            return Vec3::ZERO;
        }
        let [theta_h, phi_h, theta_d, psi] = half_and_difference(light, view);
        let [n_h, n_phi, n_d, n_psi] = [0, 1, 2, 3].map(|axis| self.number(axis) as usize);
        let (h, to_h) = place((theta_h / FRAC_PI_2).sqrt(), n_h);
        let (d, to_d) = place(theta_d / FRAC_PI_2, n_d);
        let (phi, psi) = (phi_h / TAU * n_phi as f32, psi / PI * n_psi as f32);
        let ((j, to_phi), (m, to_psi)) = ((phi as usize, phi.fract()), (psi as usize, psi.fract()));
        let mut sum = Vec3::ZERO;
        for (i, weight_h) in [(h, 1.0 - to_h), ((h + 1).min(n_h - 1), to_h)] {
            for (j, weight_phi) in [(j % n_phi, 1.0 - to_phi), ((j + 1) % n_phi, to_phi)] {
                for (k, weight_d) in [(d, 1.0 - to_d), ((d + 1).min(n_d - 1), to_d)] {
                    let row = ((i * n_phi + j) * n_d + k) * n_psi;
                    let [before, after] =
                        [m % n_psi, (m + 1) % n_psi].map(|column| self.colour(7 + 3 * (row + column)));
                    sum += (before + (after - before) * to_psi) * (weight_h * weight_phi * weight_d);
                }
            }
        }
        self.colour(4) * sum * light.z
    }

    /// The parts of a cylinder of poulin-fournier, and of the floor beside it, that a direction sees.
    fn cylinder(self, direction: Vec3) -> Cylinder {
        let height = direction.z.max(0.0);
        let length = Vec3::new(0.0, direction.y, height).length();
        let cosine = if length > 0.0 { (height / length).max(MIN_COSINE) } else { 1.0 };
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (d, z, edge, b) = (self.number(1), self.number(2), self.number(3), self.number(4));
        let hidden = (0.5 * d * cosine).min(1.0);
        let first = -angle(cosine, sine);
        let last = first + 2.0 * angle(hidden.sqrt(), (1.0 - hidden).sqrt());
        let (first, last) = (first.max(-edge), last.min(edge));
        let near = if b * sine >= -z * cosine { b } else { (1.0 + z * sine) / cosine };
        let far = if sine > z { d - (1.0 - z * sine) / cosine } else { d - b };
        let phi = angle(sine, cosine);
        match direction.y < 0.0 {
            true => Cylinder { phi: -phi, cosine, arc: [-last, -first], floor: [d - far, d - near] },
            false => Cylinder { phi, cosine, arc: [first, last], floor: [near, far] },
        }
    }

    /// The integral of cos^s(psi) and both cosines over an arc, psi from the half vector.
    fn cylinder_highlight(self, sum: Vec3, seen: [Cylinder; 2], arc: [f32; 2]) -> f32 {
        let phi_h = angle(sum.y, sum.z);
        let reach = self.number(5);
        let ends = arc.map(|phi| {
            let turn = circle((0.5 * (phi - phi_h)).clamp(-0.25 * PI, 0.25 * PI) / TAU);
            turn.y / turn.x
        });
        let (from, to) = (ends[0].max(-reach), ends[1].min(reach));
        if from >= to {
            return 0.0;
        }
        let (middle, radius) = (0.5 * (from + to), 0.5 * (to - from));
        let [light, view] = seen.map(|of| circle((phi_h - of.phi) / TAU));
        let at = |t: f32| {
            let scale = 1.0 / (1.0 + t * t);
            let (sine, cosine) = (2.0 * t * scale, (1.0 - t) * (1.0 + t) * scale);
            let [light, view] = [light, view].map(|of| (cosine * of.x - sine * of.y).max(0.0));
            2.0 * scale * power(cosine, sine * sine, self.number(0)) * light * view
        };
        let mut integral = 0.0;
        for node in 0..8 {
            let step = radius * self.number(12 + 2 * node);
            integral += self.number(13 + 2 * node) * (at(middle - step) + at(middle + step));
        }
        radius * integral
    }

    /// Four functions at a cosine: between the nodes of tables, whose number is at `k`.
    fn at_cosine(self, k: usize, cosine: f32) -> Vec4 {
        let last = self.number(k) as usize - 1;
        let place = cosine.min(1.0).sqrt() * last as f32;
        let node = (place as usize).min(last - 1);
        let [low, high] = [node, node + 1]
            .map(|node| Vec4::from_array([0, 1, 2, 3].map(|column| self.number(k + 1 + 4 * node + column))));
        low + (high - low) * (place - node as f32)
    }

    /// The sheen of fibres: a power of sin(theta_h) and the masking of light and view, whose constants begin
    /// at `k`.
    fn charlie(self, k: usize, half: Half) -> f32 {
        let sin2 = half.across() / half.length_squared;
        let cos2 = half.sum.z * half.sum.z / half.length_squared;
        let ln = if cos2 < NEAR { 2.0 * ln_cosine(cos2) } else { math::ln(sin2.max(TINY)) };
        let [light, view] = [half.light, half.view].map(|cosine| cosine.max(GRAZING));
        let masked = (1.0 + self.charlie_lambda(k, light) + self.charlie_lambda(k, view)) * light * view;
        bounded_exp(self.number(k) * ln) / masked
    }

    fn charlie_lambda(self, k: usize, cosine: f32) -> f32 {
        let ln = |x: f32| {
            let power = bounded_exp(self.number(k + 3) * math::ln(x.max(TINY)));
            self.number(k + 1) / (1.0 + self.number(k + 2) * power)
                + self.number(k + 4) * x
                + self.number(k + 5)
        };
        match cosine < 0.5 {
            true => bounded_exp(ln(cosine)),
            false => bounded_exp(self.number(k + 6) - ln((1.0 - cosine).max(0.0))),
        }
    }

    /// The share that a smooth facet reflects: its constants begin at `k`.
    fn fresnel(self, k: usize, half: Half) -> Vec3 {
        let (cosine, sin2) = (half.facet(), half.turn);
        if self.number(k) == 0.0 {
            return Vec3::splat(dielectric(self.number(k + 1), cosine));
        }
        let share = |channel: usize| {
            conductor(self.number(k + 1 + channel), self.number(k + 4 + channel), cosine, sin2)
        };
        Vec3::new(share(0), share(1), share(2))
    }
}

/// The parts of a cylinder of poulin-fournier, and of the floor beside it, that a direction sees.
#[derive(Clone, Copy)]
struct Cylinder {
    /// The direction's angle in the plane across the cylinder, from +Z toward +Y.
    phi: f32,
    /// The cosine of `phi`.
    cosine: f32,
    /// The ends of the arc of the cylinder that is seen.
    arc: [f32; 2],
    /// The ends of the floor that is seen.
    floor: [f32; 2],
}

/// The node before `share` of an axis of n nodes at 0, 1/n, 2/n ..., and how far the share is on the way to
/// the next, 0 to 1.
fn place(share: f32, n: usize) -> (usize, f32) {
    let at = (share * n as f32).min((n - 1) as f32);
    let node = at as usize;
    (node, at - node as f32)
}
