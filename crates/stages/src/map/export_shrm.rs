//! Writes a spherical harmonic reflection map (SHRM): what a material reflects, for every direction and every
//! view.
//!
//! ```toml
//! [stage.shrm]
//! kind = "export-shrm"
//! input = "reflection"
//! layout = "cube"
//! resolution = 64
//! view = "local"
//! format = "ktx2"
//! path = "{environment}/{material}/shrm"
//! ```
//!
//! A texel in direction C holds the coefficients of the light that is reflected toward each view V when the
//! material's central direction is C: the reflection vector, the normal (lambert) or the tangent
//! (kajiya-kay), as the file's `centre` says. One map serves every viewpoint, at any roughness, with the
//! lighting's own sharpness.
//!
//! > B(C, V) = sum over p <= P, |q| <= p of b_pq(C) Y_pq(w)
//!
//! Y_pq are real harmonics, orthonormal, without the Condon-Shortley phase, in row p*p + p + q. In a *local*
//! map w is the view in the frame of the texel, w = R^-1 V, R = R_z(phi) R_y(theta) of the texel's own
//! direction; a material that does not depend on the azimuth needs only the P + 1 coefficients with q = 0
//! there, all others need all (P + 1)^2. Light decides how many that are: for a truncation that is not
//! visible, the sample's copper and lacquer take 36 and 81 in its soft sky, and 289 in its studio. In a
//! *global* map [RH02, eq. 8] w is V itself: it takes more storage and less work in a shader.
//!
//! ## Degree
//!
//! A file grows with (P + 1)^2, so that the map takes the least P at which it is near enough to the field
//! that arrives: 95 % of the views, as a ball shows them, within the first number of `accept`, in stops, and
//! 99 % within the second. With `error` in its place the RMS error counts, as a share of the RMS radiance of
//! what the map holds [RH02, sec. 5]. P is at most `most-p`, 4 if it is not named. If no P up to that is
//! enough, the map takes the best of those up to 4, and a warning says what it reaches and what would help.
//! The build notes P, its errors and the file's size. A KTX2 file of a local map without azimuth grows with
//! P + 1 only: both limits are 16 there.
//!
//! | `most-p` | coefficients | 6 faces of 32 x 32 in KTX2 |
//! | --- | --- | --- |
//! | 2 | 9 | 0.4 MB |
//! | 4 | 25 | 1.2 MB |
//! | 8 | 81 | 4.0 MB |
//! | 16 | 289 | 14.2 MB |
//!
//! Degrees that `project-brdf` names are kept, unless `accept` or `most-p` is given here: `degree = [F, P]`
//! there is the way to a map of exactly this P.
//!
//! ## Resolution
//!
//! `resolution = "auto"` takes the lowest resolution, a multiple of 4, at which bilinear look-ups have an
//! estimated error of at most 0.01 times the RMS radiance, but at most 10 F rows of a lat-long map or an edge
//! of 5 F texels, F being the degree. If the file then has more than 1 MB, the resolution is lowered until it
//! has no more, or until the error is 0.03, which the note says. With `error` the resolution is what that
//! error needs. In any case "auto" stops at 16 MB. A file that is larger, because of a given resolution or
//! P, and a map that misses its tolerance have a warning.
//!
//! ## Files
//!
//! | `format` | file, after the item's `path` |
//! | --- | --- |
//! | `safetensors` | `.safetensors`: the tensor `shrm` [faces, height, width, (P+1)^2, 3], f32; zeros included |
//! | `exr` | `.exr`: a layer for each coefficient, zeros included; a cube is its six faces +X -X +Y -Y +Z -Z from top to bottom |
//! | `ktx2` | `.ktx2`: a cube array, or a 2D array for `lat-long`, with a layer for each coefficient; RGBA, alpha 1 |
//!
//! Coefficients are in row order p*p + p + q. A KTX2 file of a local map without azimuth has the P + 1 layers
//! with q = 0 only, in order of p; its entry `specula.terms` then is `zonal` and not `all`.
//!
//! WebGPU and WebGL 2 have at most 256 layers in a texture array, and a cube counts as six: a KTX2 file that
//! has more, because its P is above 5 in a cube or 15 in `lat-long`, is written with a warning.
//!
//! OpenEXR's layers are named `p1qm1` (p = 1, q = -1), `p1q0`, `p1q1`, ...; p = 0, q = 0 is the plain R, G,
//! B, which any viewer shows: times 0.2821 it is the mean over all views.
//!
//! Every file describes its content. Safetensors have `layout`, `view`, `centre`, `terms` (`zonal`: all
//! coefficients with q other than 0 are zero), `degree` (P), `basis` and `frame` in their metadata; KTX2 and
//! OpenEXR have the same as `specula.layout` and so on, and `specula.rows`, the names of their layers in the
//! order of KTX2.
//!
//! Lat-long maps have the image's centre along +X, its left quarter along +Y and row 0 toward +Z, the frame
//! being right-handed with +Z up. A cube is sampled with (-y, z, x) and looks unmirrored from inside.
//!
//! ## Lamps
//!
//! Suns and lamps are lights beside the series if `project-sh` has neither `degree` nor `tolerance`, or has
//! `lamps = "separate"`; degrees of `project-brdf` alone leave them there too. If `project-sh` has a `degree`
//! or a `tolerance` and no `lamps`, they are in the series, and cut with it: whatever `lamps` is here, the
//! map rings around them, and the file has no lights. `project-sh` notes it.
//!
//! With `lamps = "baked"` the map holds the lights: so that no cut rings into dark views, the coefficients of
//! each texel are then fitted to its views by relative least squares, and `accept` counts the lamps. P = 4 is
//! seldom enough for a sun: then a warning says so, and `"separate"` serves better. `most-p = 16` often is
//! enough, but not for a roughness below 0.2.
//!
//! With `lamps = "separate"` the map holds the rest alone, in fewer coefficients, and the file has the
//! lights: in safetensors the tensor `lights` [n, 7] (f64), in KTX2 and OpenEXR `specula.lights`, a JSON
//! array of arrays. A light is its direction x, y, z, its angular radius in radians, and the irradiance r, g,
//! b of a surface that faces it. A renderer adds, for each light, the mean over its disk of BRDF times the
//! cosine between light and normal, by the material's own formula, to what the map gives: a sun is as good as
//! a point, a lamp that is larger than the highlight is wide needs more (see below).
//!
//! ## Two maps
//!
//! A material with a matte base under a highlight has two centres. It gets a map of each: `{path}-diffuse`
//! is looked up by the normal, `{path}` by the reflection vector, and a renderer adds both; `centre` says
//! which is which. The base then needs few coefficients, often one. Other materials have no such file. With
//! `parts = "together"` one map holds the sum about the reflection vector, with more coefficients, of which
//! the build notes the number. Lights beside the maps (`lamps = "separate"`) are in `{path}` alone, and are
//! added once, with the whole material.
//!
//! ## From a map
//!
//! The input may be a map instead of a reflection. Then the map determines `layout`, `resolution` and P, so
//! leave out what chooses them; `view = "global"` converts a local map to a global one.
//!
//! ## In a shader
//!
//! `specula inspect FILE --shader glsl` prints the look-up of a map's file as it is: for its degree, terms,
//! view, layout and size; `wgsl`, `hlsl` and `metal` are the other languages. What follows explains it, for
//! P = 2.
//!
//! ## In a shader: local maps
//!
//! The frames of neighbouring texels differ, and they spin around the poles: never filter local coefficients
//! in hardware. Fetch four texels, evaluate each at the view *in its own frame*, and blend the colours. For P
//! = 2 and `lat-long`:
//!
//! ```glsl
//! vec3 texel(sampler2DArray map, ivec2 at, vec3 view) {
//!     ivec2 size = textureSize(map, 0).xy;
//!     if (at.y < 0 || at.y >= size.y) { // over a pole, half a turn on
//!         at.y = at.y < 0 ? -1 - at.y : 2 * size.y - 1 - at.y;
//!         at.x += size.x / 2;
//!     }
//!     at.x = (at.x + size.x) % size.x;
//!     float theta = 3.14159265 * (float(at.y) + 0.5) / float(size.y);
//!     float phi = 6.28318531 * (0.5 - (float(at.x) + 0.5) / float(size.x));
//!     vec3 z = vec3(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
//!     vec3 x = vec3(cos(theta) * cos(phi), cos(theta) * sin(phi), -sin(theta));
//!     vec3 y = vec3(-sin(phi), cos(phi), 0.0);
//!     vec3 w = vec3(dot(x, view), dot(y, view), dot(z, view));
//!     float Y[9] = float[](0.28209479,
//!         0.48860251 * w.y, 0.48860251 * w.z, 0.48860251 * w.x,
//!         1.09254843 * w.x * w.y, 1.09254843 * w.y * w.z, 0.31539157 * (3.0 * w.z * w.z - 1.0),
//!         1.09254843 * w.x * w.z, 0.54627422 * (w.x * w.x - w.y * w.y));
//!     vec3 sum = vec3(0.0);
//!     for (int row = 0; row < 9; row++) sum += Y[row] * texelFetch(map, ivec3(at, row), 0).rgb;
//!     return sum; // zonal files: rows 0, 1, 2 with Y[0], Y[2], Y[6]
//! }
//!
//! vec3 reflected(sampler2DArray map, vec3 central, vec3 view) { // both to the outside, of length 1
//!     vec2 uv = vec2(0.5 - atan(central.y, central.x) / 6.28318531, acos(clamp(central.z, -1.0, 1.0)) / 3.14159265);
//!     vec2 place = uv * vec2(textureSize(map, 0).xy) - 0.5;
//!     ivec2 at = ivec2(floor(place));
//!     vec2 f = fract(place);
//!     vec3 above = mix(texel(map, at, view), texel(map, at + ivec2(1, 0), view), f.x);
//!     vec3 below = mix(texel(map, at + ivec2(0, 1), view), texel(map, at + ivec2(1, 1), view), f.x);
//!     return mix(above, below, f.y);
//! }
//! ```
//!
//! For centre `reflection` the central direction is `2 * dot(n, v) * n - v`. A cube array works in the same
//! way: bind its memory as a 2D array (layer 6 * row + face), and let z be the direction of the texel, x and
//! y the directions of its theta and phi; if z is a pole, phi is 0.
//!
//! ## In a shader: global maps
//!
//! All texels share one frame, so hardware may filter them, and V's harmonics are computed once. For P = 2
//! and a cube:
//!
//! ```wgsl
//! fn reflected(central: vec3f, v: vec3f) -> vec3f {
//!     let Y = array<f32, 9>(0.28209479,
//!         0.48860251 * v.y, 0.48860251 * v.z, 0.48860251 * v.x,
//!         1.09254843 * v.x * v.y, 1.09254843 * v.y * v.z, 0.31539157 * (3.0 * v.z * v.z - 1.0),
//!         1.09254843 * v.x * v.z, 0.54627422 * (v.x * v.x - v.y * v.y));
//!     let c = vec3f(-central.y, central.z, central.x);
//!     var sum = vec3f(0.0);
//!     for (var row = 0; row < 9; row++) {
//!         sum += Y[row] * textureSampleLevel(map, filtering, c, row, 0.0).rgb; // texture_cube_array
//!     }
//!     return sum;
//! }
//! ```
//!
//! If the viewer is far away, V is the same for a whole frame. Then evaluate the sum once per texel into an
//! ordinary reflection map (equation 12), and look that up by C alone.
//!
//! ## In a shader: the lamps
//!
//! With `lamps = "separate"` add each light to what the map gives: its flux times the mean over its disk of
//! BRDF times the cosine between light and normal. Neither needs a shadow or a falloff. The mean is that of
//! n points, each with an equal share of the disk: 1 for a sun, about (3 radius / alpha)^2 for a lamp that is
//! larger than alpha / 10, alpha being the square of the roughness; each costs what a punctual light costs.
//! For the metal of model `standard`:
//!
//! ```wgsl
//! struct Light { direction: vec3f, radius: f32, irradiance: vec3f, unused: f32 }
//! @group(0) @binding(0) var<storage, read> lights: array<Light>;
//!
//! fn highlight(n: vec3f, v: vec3f, l: vec3f, roughness: f32, f_0: vec3f) -> vec3f { // BRDF times dot(n, l)
//!     let h = normalize(l + v);
//!     let n_l = max(dot(n, l), 0.0);
//!     let n_v = max(dot(n, v), 1e-4);
//!     let n_h = max(dot(n, h), 0.0);
//!     let a2 = roughness * roughness * roughness * roughness; // alpha is the square of roughness
//!     let base = n_h * n_h * (a2 - 1.0) + 1.0;
//!     let d = a2 / (3.14159265 * base * base);
//!     let shadowed = n_v * sqrt(n_l * n_l * (1.0 - a2) + a2) + n_l * sqrt(n_v * n_v * (1.0 - a2) + a2);
//!     let fresnel = f_0 + (1.0 - f_0) * pow(1.0 - max(dot(v, h), 0.0), 5.0);
//!     return fresnel * (d * 0.5 * n_l / max(shadowed, 1e-6));
//! }
//!
//! fn disk_point(light: Light, k: u32, count: u32) -> vec3f { // a spiral of equal areas
//!     if count == 1u { return light.direction; }
//!     let d = light.direction;
//!     let u = normalize(cross(d, select(vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0), abs(d.z) > 0.9)));
//!     let share = (f32(k) + 0.5) / f32(count);
//!     let theta = 2.0 * asin(sin(0.5 * light.radius) * sqrt(share));
//!     let phi = 2.3999632 * f32(k);
//!     return d * cos(theta) + (u * cos(phi) + cross(d, u) * sin(phi)) * sin(theta);
//! }
//!
//! fn shaded(n: vec3f, v: vec3f, roughness: f32, base_color: vec3f) -> vec3f {
//!     var sum = max(reflected(2.0 * dot(n, v) * n - v, v), vec3f(0.0)); // the map, see above
//!     for (var i = 0u; i < arrayLength(&lights); i++) {
//!         let across = lights[i].radius / (roughness * roughness);
//!         let count = select(1u, clamp(u32(9.0 * across * across), 8u, 1024u), across > 0.1);
//!         let flux = lights[i].irradiance * 2.0 / (1.0 + cos(lights[i].radius));
//!         for (var k = 0u; k < count; k++) {
//!             sum += flux / f32(count) * highlight(n, v, disk_point(lights[i], k, count), roughness, base_color);
//!         }
//!     }
//!     return sum;
//! }
//! ```
//!
//! `standard` keeps the light that facets reflect more than once, which this highlight leaves out: at
//! roughness 0.5 that is a tenth of a white metal's light, at roughness 1 more than half. An engine whose own
//! metals keep it has a better `highlight` already. For `phong`, with the reflection vector r, the sum has
//! `specular * (exponent + 1.0) / 6.2832 * pow(max(dot(r, point), 0.0), exponent)`, without a cosine, and
//! 1 / sqrt(exponent + 1) in place of alpha.
//!
//! ## Components
//!
//! `form = "components"` writes another sum: the principal components that Ramamoorthi and Hanrahan name as
//! future work. Hardware filters it, without poles and seams, and 8 to 16 fetches take the place of up to 289
//! times 4.
//!
//! > B(C, V) = sum over k < K of U_k(C) w_k(x, y)
//!
//! U_k is a cube of `resolution` texels along an edge (by default 32), whose faces have a border of a texel.
//! w_k are functions of the view that belong to the material: (x, y) is the place of the normal on a disc
//! about the reflection vector (of the view about the normal, if `centre` is `normal`), whose rim is the
//! horizon. K is the least number, up to 24, with which 95 and 99 of 100 look-ups are within the errors of
//! `accept`, as a ball shows them, or what `components` says. The build notes K and both errors.
//!
//! A narrow highlight under contrasty light needs many: copper of roughness 0.3 in a studio with its lamps
//! beside the map has errors of 0.18 and 0.50 stops with 9 components, 0.13 and 0.31 with 15, 0.08 and 0.19
//! with 24. Suns and lamps in the map take more, so that `lamps = "separate"` is worth it here. The
//! reflection must have its material: `project-sh` and `project-brdf` without degrees. Fibres have no
//! components.
//!
//! | `format` | files |
//! | --- | --- |
//! | `safetensors` | the tensors `components` [K, 6, n + 2, n + 2, 3] f32, n being the resolution, and `weights` [K, 64, 64] f32: w_k, -1 to 1 from left to right and from top to bottom |
//! | `safetensors`, `packed = true` | `sizes` [6, n + 2, n + 2, 3] f32; `components` [4, 6, n + 2, n + 2, 3] i8; `components_half` [K - 4, 6, n / 2 + 2, n / 2 + 2, 3] i8, n / 2 rounded up; `weights`. The sum is to be multiplied by the size, filtered by itself. 8 bits lose nothing that shows |
//! | `ktx2` | `.ktx2`: a 2D array with layer 6 k + face of n + 2 texels; `-weights.ktx2`: a 2D array of 64 texels, with w_4j to w_4j+3 in the channels of layer j |
//!
//! Texel (row, column) of a face looks toward s = (column - 1/2) / n, t = (row - 1/2) / n, the border beyond
//! the face. The frame is that of the face: its axes carried by the least rotation from its centre. With
//! bilinear filters, clamped (`specula inspect FILE.ktx2 --shader` prints it in other languages):
//!
//! ```glsl
//! vec3 reflected(sampler2DArray map, sampler2DArray weights, int K, vec3 n, vec3 v) { // to the outside
//!     vec3 r = 2.0 * dot(n, v) * n - v; // if `centre` is `normal`: c is made of n, d of v
//!     vec3 c = vec3(-r.y, r.z, r.x), d = vec3(-n.y, n.z, n.x), a, s, t, m = abs(c);
//!     int face;
//!     if (m.x >= m.y && m.x >= m.z) {
//!         a = vec3(c.x > 0.0 ? 1.0 : -1.0, 0.0, 0.0); s = vec3(0.0, 0.0, -a.x); t = vec3(0.0, -1.0, 0.0);
//!         face = c.x > 0.0 ? 0 : 1;
//!     } else if (m.y >= m.z) {
//!         a = vec3(0.0, c.y > 0.0 ? 1.0 : -1.0, 0.0); s = vec3(1.0, 0.0, 0.0); t = vec3(0.0, 0.0, a.y);
//!         face = c.y > 0.0 ? 2 : 3;
//!     } else {
//!         a = vec3(0.0, 0.0, c.z > 0.0 ? 1.0 : -1.0); s = vec3(a.z, 0.0, 0.0); t = vec3(0.0, -1.0, 0.0);
//!         face = c.z > 0.0 ? 4 : 5;
//!     }
//!     float near = dot(c, a), up = max(dot(d, c), 0.0), turn = (dot(d, a) + up) / (1.0 + near);
//!     vec2 place = vec2(dot(d, s) - dot(c, s) * turn, dot(d, t) - dot(c, t) * turn) * inversesqrt(1.0 + up);
//!     vec2 uv = vec2(dot(c, s), dot(c, t)) / near * 0.5 + 0.5;
//!     float side = float(textureSize(map, 0).x); // with the border
//!     uv = (uv * (side - 2.0) + 1.0) / side;
//!     vec3 sum = vec3(0.0);
//!     for (int k = 0; k < K; k++) {
//!         vec4 w = textureLod(weights, vec3(place * 0.5 + 0.5, float(k / 4)), 0.0);
//!         sum += w[k % 4] * textureLod(map, vec3(uv, float(6 * k + face)), 0.0).rgb;
//!     }
//!     return max(sum, vec3(0.0));
//! }
//! ```

use std::any::Any;

use brdf::Part;
use engine::{Context, Failure, Kind, Output, Port, Product};
use sh::Light;
use shrm::{MapLayout, Reflection, SMALL_P, Shrm, Terms};

use super::component_files::{Components, FormName};
use super::map_input;
use super::map_input::{MOST_BYTES, MapInput, PartOfMaterial};
use super::map_source::MapSource;
use super::shrm_file::{file, lamp_entries};
use super::shrm_parameters::{EXPORT_SHRM, ShrmFormat, ShrmParameters};
use crate::values::quantity::size;
use crate::values::{ExportedMaps, FileFormat, LampsName, PartsName, Resolution, edge_of, parts};

/// The kind `export-shrm`.
pub(crate) struct ExportShrm;

impl Kind for ExportShrm {
    type Parameters = ShrmParameters;

    const NAME: &'static str = EXPORT_SHRM;
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &{
        let mut kernels = [shrm::revisions::COMPONENTS; map_input::SMALL_MAP_KERNELS.len() + 2];
        kernels[1] = brdf::revisions::TABLE;
        let mut index = 0;
        while index < map_input::SMALL_MAP_KERNELS.len() {
            kernels[2 + index] = map_input::SMALL_MAP_KERNELS[index];
            index += 1;
        }
        kernels
    };
    const TEXT: &'static str = include_str!("export_shrm.rs");

    fn ports() -> Vec<Port> {
        vec![MapInput::port()]
    }

    fn product(parameters: &ShrmParameters, _: &[(&str, &'static str)]) -> Product {
        let container = parameters.format.container();
        let endings = match parameters.form {
            FormName::Harmonics => vec![container.ending().into()],
            FormName::Components => Components::endings(container),
        };
        Product::Files(parts::endings(parameters.parts, endings))
    }

    fn details(parameters: &ShrmParameters) -> Option<Box<dyn Any>> {
        let layout = parameters.layout.map_or(MapLayout::Cube, |name| name.0);
        Some(Box::new(ExportedMaps {
            edge: edge_of(parameters.resolution, layout),
            holds_lamps: Some(parameters.lamps == LampsName::Baked),
            joins_parts: Some(parameters.parts == PartsName::Together),
            ..ExportedMaps::default()
        }))
    }

    fn check(parameters: &ShrmParameters) -> Vec<(&'static str, String)> {
        let mut errors = parameters.input().check();
        errors.extend(parameters.encoding().check());
        errors.extend(parameters.check_form());
        errors
    }

    fn run(parameters: &ShrmParameters, context: &Context<'_>) -> Result<Output, Failure> {
        let whole = MapSource::of(&context.inputs)?;
        let base = whole.parts().map(|[diffuse, _]| diffuse);
        whole.export(parameters.parts, &context.reporter, |source, part, steps| {
            if parameters.form == FormName::Components {
                let MapSource::Reflection(reflection) = source else {
                    return Err(Failure::new("components are made from a reflection, not from a map")
                        .help("name a `convolve` stage as the input, or leave out `form`"));
                };
                let beside = beside(parameters, &reflection.0, part);
                let lamps = (&beside[..], &lamp_entries(&beside)[..]);
                let encoding = parameters.encoding();
                return parameters.components().files(&reflection.0, lamps, encoding, steps, context);
            }
            let of = match (part, &base) {
                (Some(Part::Diffuse), _) => PartOfMaterial::Diffuse,
                (Some(Part::Specular), Some(MapSource::Reflection(base))) => {
                    PartOfMaterial::Specular(&base.0)
                }
                _ => PartOfMaterial::All,
            };
            let (map, beside) = match source {
                MapSource::Shrm(_) => (parameters.input().map(context)?, Vec::new()),
                MapSource::Reflection(reflection) => (
                    parameters.input().map_of(&reflection.0, of, steps)?,
                    beside(parameters, &reflection.0, part),
                ),
            };
            context.reporter.check_cancelled()?;
            if parameters.lamps == LampsName::Separate && beside.is_empty() && part != Some(Part::Diffuse) {
                context
                    .reporter
                    .note("the file has no lights: there are none beside the series of the light");
            }
            let bytes = file(&map.0, &beside, parameters.encoding(), context)?;
            context.reporter.note(format!("{} bytes", bytes.len()));
            if bytes.len() > MOST_BYTES {
                context.reporter.warn(too_large(parameters, &map.0, bytes.len()));
            }
            Ok(vec![bytes])
        })
    }
}

/// The lights that the map does not hold. A renderer adds them once, with the whole material: of two maps
/// only that of the highlight has them.
fn beside(parameters: &ShrmParameters, reflection: &Reflection, part: Option<Part>) -> Vec<Light> {
    match (parameters.lamps, reflection.lamps()) {
        (LampsName::Separate, Some(lamps)) if part != Some(Part::Diffuse) => lamps.lights.clone(),
        _ => Vec::new(),
    }
}

/// Says that a file is large, and what makes it smaller.
fn too_large(parameters: &ShrmParameters, map: &Shrm, bytes: usize) -> String {
    let mut ways = Vec::new();
    let is_zonal = map.terms() == Terms::Zonal && parameters.format == ShrmFormat::Ktx2;
    if map.p().get() > SMALL_P && !is_zonal {
        ways.push(format!(
            "most-p = {SMALL_P} allows {} coefficients in place of {}",
            (SMALL_P + 1) * (SMALL_P + 1),
            map.p().rows()
        ));
    }
    if let Some(Resolution::Fixed(_)) = parameters.resolution {
        ways.push("resolution = \"auto\" takes what accuracy needs".into());
    } else {
        ways.push("a lower `resolution` takes less".into());
    }
    if parameters.format == ShrmFormat::Safetensors {
        ways.push("format = \"ktx2\" holds halves".into());
    }
    format!("the file has {}, more than {}: {}", size(bytes as u64), size(MOST_BYTES as u64), ways.join("; "))
}
