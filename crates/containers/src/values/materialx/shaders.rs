//! What the inputs of each kind of shader are in our material.
//!
//! The sources are the definitions of the shaders as graphs: `standard_surface.mtlx` of MaterialX 1.39, whose
//! layers are those of Autodesk's Standard Surface (Georgiev and others 2019), and the specification of
//! OpenPBR 1.1 with its `open_pbr_surface.mtlx`. C is the coat's weight, T = 1 + C (coat_color - 1) its tint,
//! m the metalness.
//!
//! | ours | standard_surface | open_pbr_surface |
//! | --- | --- | --- |
//! | `base_color` | T base base_color | T base_weight base_color, of a metal times specular_weight |
//! | `metallic` | metalness | base_metalness |
//! | `roughness` | specular_roughness, moved toward 1 by coat coat_roughness coat_affect_roughness | the fourth root of min(1, r^4 + 2 r_c^4) under a coat, r = specular_roughness, r_c = coat_roughness |
//! | `ior` | specular_IOR, or its inverse below 1 | of F_0 = ((e - 1) / (e + 1))^2 specular_weight, where e is specular_ior, and divided by coat_ior (inverted below 1) under a coat |
//! | `specular` | specular | min(1, 50 F_0): what reflects almost nothing has no bright rim |
//! | `specular_color` | T specular_color | T specular_color |
//! | `clearcoat`, `clearcoat_roughness` | coat, coat_roughness | coat_weight, coat_roughness |
//! | `sheen` | sheen sheen_color | fuzz_weight fuzz_color |
//! | `sheen_roughness` | the root of sheen_roughness, which is alpha | fuzz_roughness^1.25: MaterialX translates it to sheen_roughness^2.5 |
//!
//! What scatters below the surface leaves it as from a matte base: base_color is mixed with subsurface_color.
//! What is transmitted is lost: the base is darkened by (1 - transmission). Both count for what is not metal.

use brdf::StandardParameters;

use super::shader::Default::{Colour, Direction, Ignored, Number};
use super::shader::{Input, Shader};

/// A kind of surface shader.
pub(super) struct Kind {
    /// The tag of its elements.
    pub(super) name: &'static str,
    /// Its inputs in a version of its definition.
    pub(super) inputs: fn(Option<&str>) -> &'static [Input],
    /// Its inputs as parameters of our material.
    pub(super) parameters: fn(&mut Shader) -> StandardParameters,
}

/// Every kind of surface shader that is read.
pub(super) const SHADERS: [Kind; 2] = [
    Kind { name: "standard_surface", inputs: standard_inputs, parameters: standard_surface },
    Kind { name: "open_pbr_surface", inputs: |_| OPEN_PBR, parameters: open_pbr_surface },
];

const BLACK: [f64; 3] = [0.0; 3];
const WHITE: [f64; 3] = [1.0; 3];

/// The inputs of `standard_surface`: 1.0.0 has two other defaults than 1.0.1.
fn standard_inputs(version: Option<&str>) -> &'static [Input] {
    const OLD: &[Input] = &{
        let mut inputs = STANDARD_SURFACE;
        inputs[0].1 = Number(0.8);
        inputs[1].1 = Colour(WHITE);
        inputs
    };
    if version == Some("1.0.0") { OLD } else { &STANDARD_SURFACE }
}

/// The inputs of `standard_surface` 1.0.1.
const STANDARD_SURFACE: [Input; 42] = [
    ("base", Number(1.0)),
    ("base_color", Colour([0.8; 3])),
    ("diffuse_roughness", Number(0.0)),
    ("metalness", Number(0.0)),
    ("specular", Number(1.0)),
    ("specular_color", Colour(WHITE)),
    ("specular_roughness", Number(0.2)),
    ("specular_IOR", Number(1.5)),
    ("specular_anisotropy", Number(0.0)),
    ("specular_rotation", Ignored),
    ("transmission", Number(0.0)),
    ("transmission_color", Ignored),
    ("transmission_depth", Ignored),
    ("transmission_scatter", Ignored),
    ("transmission_scatter_anisotropy", Ignored),
    ("transmission_dispersion", Ignored),
    ("transmission_extra_roughness", Ignored),
    ("subsurface", Number(0.0)),
    ("subsurface_color", Colour(WHITE)),
    ("subsurface_radius", Ignored),
    ("subsurface_scale", Ignored),
    ("subsurface_anisotropy", Ignored),
    ("sheen", Number(0.0)),
    ("sheen_color", Colour(WHITE)),
    ("sheen_roughness", Number(0.3)),
    ("coat", Number(0.0)),
    ("coat_color", Colour(WHITE)),
    ("coat_roughness", Number(0.1)),
    ("coat_anisotropy", Number(0.0)),
    ("coat_rotation", Ignored),
    ("coat_IOR", Number(1.5)),
    ("coat_normal", Direction),
    ("coat_affect_color", Number(0.0)),
    ("coat_affect_roughness", Number(0.0)),
    ("thin_film_thickness", Number(0.0)),
    ("thin_film_IOR", Ignored),
    ("emission", Number(0.0)),
    ("emission_color", Colour(WHITE)),
    ("opacity", Colour(WHITE)),
    ("thin_walled", Ignored),
    ("normal", Direction),
    ("tangent", Direction),
];

/// The inputs of `open_pbr_surface`.
const OPEN_PBR: &[Input] = &[
    ("base_weight", Number(1.0)),
    ("base_color", Colour([0.8; 3])),
    ("base_diffuse_roughness", Number(0.0)),
    ("base_metalness", Number(0.0)),
    ("specular_weight", Number(1.0)),
    ("specular_color", Colour(WHITE)),
    ("specular_roughness", Number(0.3)),
    ("specular_ior", Number(1.5)),
    ("specular_roughness_anisotropy", Number(0.0)),
    ("transmission_weight", Number(0.0)),
    ("transmission_color", Ignored),
    ("transmission_depth", Ignored),
    ("transmission_scatter", Ignored),
    ("transmission_scatter_anisotropy", Ignored),
    ("transmission_dispersion_scale", Ignored),
    ("transmission_dispersion_abbe_number", Ignored),
    ("subsurface_weight", Number(0.0)),
    ("subsurface_color", Colour([0.8; 3])),
    ("subsurface_radius", Ignored),
    ("subsurface_radius_scale", Ignored),
    ("subsurface_scatter_anisotropy", Ignored),
    ("fuzz_weight", Number(0.0)),
    ("fuzz_color", Colour(WHITE)),
    ("fuzz_roughness", Number(0.5)),
    ("coat_weight", Number(0.0)),
    ("coat_color", Colour(WHITE)),
    ("coat_roughness", Number(0.0)),
    ("coat_roughness_anisotropy", Number(0.0)),
    ("coat_ior", Number(1.6)),
    ("coat_darkening", Number(1.0)),
    ("thin_film_weight", Number(0.0)),
    ("thin_film_thickness", Ignored),
    ("thin_film_ior", Ignored),
    ("emission_luminance", Number(0.0)),
    ("emission_color", Colour(WHITE)),
    ("geometry_opacity", Number(1.0)),
    ("geometry_thin_walled", Ignored),
    ("geometry_normal", Direction),
    ("geometry_coat_normal", Direction),
    ("geometry_tangent", Direction),
    ("geometry_coat_tangent", Direction),
];

const EMITTED: &str = "emitted light is left out";
const OPAQUE: &str = "the material is opaque here";
const STRETCHED: &str = "the highlight is not stretched here";
const ROUGH_BASE: &str = "the matte base is smooth here";
const FILM: &str = "the thin film is left out";
const COAT_INDEX: &str = "the coat reflects as one of index 1.5";
const TRANSMITTED: &str = "light that passes through is left out, and the base is darker by its share";
const SCATTERED: &str = "light that scatters below the surface leaves it where it entered";
const EDGE: &str = "a metal's edge has no tint here";

/// What both kinds of shader say of the body of a material, under their own names.
struct Body {
    weight: &'static str,
    metalness: &'static str,
    transmission: &'static str,
    subsurface: &'static str,
    coat: &'static str,
}

/// The colour of the base, and the tint of the coat.
fn body(shader: &mut Shader, names: &Body) -> ([f64; 3], [f64; 3]) {
    let [weight, metal, coat] = [names.weight, names.metalness, names.coat].map(|name| shader.share(name));
    let [transmission, subsurface] =
        [names.transmission, names.subsurface].map(|name| shader.share(name) * (1.0 - metal));
    if transmission > 0.0 {
        shader.warn(names.transmission, TRANSMITTED);
    }
    if subsurface > 0.0 {
        shader.warn(names.subsurface, SCATTERED);
    }
    let below = if subsurface > 0.0 { shader.shares("subsurface_color") } else { BLACK };
    let base = shader.shares("base_color");
    let tint = if coat > 0.0 { shader.shares("coat_color") } else { WHITE };
    let tint = tint.map(|tint| 1.0 + coat * (tint - 1.0));
    let colour = [0, 1, 2].map(|channel| {
        let body = weight * base[channel];
        (body + (below[channel] - body) * subsurface) * (1.0 - transmission) * tint[channel]
    });
    (colour, tint)
}

/// A highlight's roughness within our range.
fn rough(roughness: f64) -> f64 {
    roughness.max(0.01)
}

/// The roughness of sheen within our range.
fn sheen_rough(roughness: f64) -> f64 {
    roughness.max(0.1)
}

fn standard_surface(shader: &mut Shader) -> StandardParameters {
    let names = Body {
        weight: "base",
        metalness: "metalness",
        transmission: "transmission",
        subsurface: "subsurface",
        coat: "coat",
    };
    let (base_color, tint) = body(shader, &names);
    let [metallic, coat, specular, coat_roughness] =
        ["metalness", "coat", "specular", "coat_roughness"].map(|name| shader.share(name));
    let specular_color = shader.shares("specular_color");
    if metallic > 0.0 && specular_color.iter().any(|channel| specular * channel != 1.0) {
        shader.warn(if specular == 1.0 { "specular_color" } else { "specular" }, EDGE);
    }
    shader.left_out("emission", 0.0, EMITTED);
    shader.left_out("opacity", 1.0, OPAQUE);
    shader.left_out("specular_anisotropy", 0.0, STRETCHED);
    shader.left_out("diffuse_roughness", 0.0, ROUGH_BASE);
    shader.left_out("thin_film_thickness", 0.0, FILM);
    if coat > 0.0 {
        shader.left_out("coat_IOR", 1.5, COAT_INDEX);
        shader.left_out("coat_anisotropy", 0.0, STRETCHED);
        shader.left_out("coat_affect_color", 0.0, "the coat does not change the base's saturation here");
    }
    let roughened = coat * coat_roughness * shader.share("coat_affect_roughness");
    let roughness = shader.share("specular_roughness");
    let [sheen, sheen_roughness] = ["sheen", "sheen_roughness"].map(|name| shader.share(name));
    StandardParameters {
        base_color,
        metallic,
        roughness: rough(roughness + (1.0 - roughness) * roughened),
        ior: if specular > 0.0 { index(shader, "specular_IOR") } else { 1.5 },
        specular,
        specular_color: [0, 1, 2].map(|channel| specular_color[channel] * tint[channel]),
        clearcoat: coat,
        clearcoat_roughness: rough(coat_roughness),
        sheen: shader.shares("sheen_color").map(|channel| sheen * channel),
        sheen_roughness: sheen_rough(sheen_roughness.sqrt()),
    }
}

/// An index of refraction within our range. Below 1 its inverse reflects as much.
fn index(shader: &mut Shader, name: &str) -> f64 {
    let index = shader.number(name).abs();
    let index = if index < 1.0 { 1.0 / index } else { index };
    if index > 10.0 {
        shader.warn(name, "the index is limited to 10");
    }
    index.min(10.0)
}

fn open_pbr_surface(shader: &mut Shader) -> StandardParameters {
    let names = Body {
        weight: "base_weight",
        metalness: "base_metalness",
        transmission: "transmission_weight",
        subsurface: "subsurface_weight",
        coat: "coat_weight",
    };
    let (base_color, tint) = body(shader, &names);
    let [metallic, coat, coat_roughness, roughness] =
        ["base_metalness", "coat_weight", "coat_roughness", "specular_roughness"]
            .map(|name| shader.share(name));
    let weight = shader.number("specular_weight").max(0.0);
    if metallic > 0.0 {
        shader.left_out("specular_color", 1.0, EDGE);
    }
    // That of a metal may be more than 1.
    let specular_color = if metallic < 1.0 { shader.shares("specular_color") } else { WHITE };
    shader.left_out("emission_luminance", 0.0, EMITTED);
    shader.left_out("geometry_opacity", 1.0, OPAQUE);
    shader.left_out("specular_roughness_anisotropy", 0.0, STRETCHED);
    shader.left_out("base_diffuse_roughness", 0.0, ROUGH_BASE);
    shader.left_out("thin_film_weight", 0.0, FILM);
    if coat > 0.0 {
        shader.left_out("coat_ior", 1.5, COAT_INDEX);
        shader.left_out("coat_roughness_anisotropy", 0.0, STRETCHED);
        shader.left_out("coat_darkening", 0.0, "the coat does not darken what is below it here");
    }
    let fourth = |roughness: f64| math::powi(roughness, 4);
    let roughened = (fourth(roughness) + 2.0 * fourth(coat_roughness)).min(1.0).sqrt().sqrt();
    // The highlight under a coat is that of the border between the two.
    let bare = index(shader, "specular_ior");
    let coated = bare / index(shader, "coat_ior");
    let coated = if coated < 1.0 { 1.0 / coated } else { coated };
    let eta = bare + (coated - bare) * coat;
    let f_0 = (math::powi((eta - 1.0) / (eta + 1.0), 2) * weight).min(0.66);
    let specular = (50.0 * f_0).min(1.0);
    let root = f_0.max(0.02).sqrt();
    let [fuzz, fuzz_roughness] = ["fuzz_weight", "fuzz_roughness"].map(|name| shader.share(name));
    let of_metal = 1.0 + metallic * (weight.min(1.0) - 1.0);
    StandardParameters {
        base_color: base_color.map(|channel| channel * of_metal),
        metallic,
        roughness: rough(roughness + (roughened - roughness) * coat),
        ior: (1.0 + root) / (1.0 - root),
        specular,
        specular_color: [0, 1, 2].map(|channel| specular_color[channel] * tint[channel]),
        clearcoat: coat,
        clearcoat_roughness: rough(coat_roughness),
        sheen: shader.shares("fuzz_color").map(|channel| fuzz * channel),
        sheen_roughness: sheen_rough(math::pow(fuzz_roughness, 1.25)),
    }
}
