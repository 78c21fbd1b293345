//! The text of a shader that looks up a map: made for the degree, the terms, the frame, the layout and the
//! size of one map, so that it runs as it is.
//!
//! There is one source for all languages ([`shading_language`]). The harmonics are unrolled from their
//! recurrences. A local map is fetched and blended as [`crate::Lookup`] does, because its texels have frames
//! of their own; hardware filters a global one.

mod components;
mod glsl;
mod harmonics;

use brdf::Centre;
use sh::Degree;
pub use shading_language::Language;
use shading_language::{Resource, ResourceKind, Source};

use crate::{MapGrid, Shrm, Terms, View};
pub use components::ComponentShader;
use glsl::PRECISION;
use harmonics::{Addend, Statement, statements};

/// What a shader has to know of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapShader {
    /// The texels.
    pub grid: MapGrid,
    /// The frame of the views.
    pub view: View,
    /// What the directions of the texels are.
    pub centre: Centre,
    /// The degree P in the view.
    pub p: Degree,
    /// The coefficients that the texture has a layer for.
    pub terms: Terms,
}

impl MapShader {
    /// The shader of a map, whose texture has a layer for each coefficient that it keeps.
    pub fn of(map: &Shrm) -> Self {
        Self { grid: map.grid(), view: map.view(), centre: map.centre(), p: map.p(), terms: map.terms() }
    }

    /// The text: a function `reflected(central, view)`, what it calls, and the texture that it reads.
    ///
    /// # Example: a white sky needs one coefficient
    /// ```
    /// use shrm::shader::{Language, MapShader};
    /// use shrm::{MapGrid, Terms, View};
    /// let shader = MapShader {
    ///     grid: MapGrid::Cube(sphere::Cube { edge: 8 }),
    ///     view: View::Local,
    ///     centre: brdf::Centre::Reflection,
    ///     p: sh::Degree::ZERO,
    ///     terms: Terms::Zonal,
    /// };
    /// let text = shader.text(Language::Glsl);
    /// assert!(text.contains("vec3 reflected(vec3 central, vec3 view) {"));
    /// assert!(text.contains("sum += 0.2820948 * coefficient(at, face);"));
    /// ```
    pub fn text(&self, language: Language) -> String {
        let source = self.source();
        let precision = match language {
            Language::Glsl => self.precision(),
            Language::Hlsl | Language::Metal | Language::Wgsl => "",
        };
        [&self.heading(), precision, &source.text(language)].concat()
    }

    fn source(&self) -> Source {
        let is_hardware_cube = self.view == View::Global && self.is_cube();
        let kind = if is_hardware_cube { ResourceKind::Cubes } else { ResourceKind::Layers };
        let mut resources = vec![Resource { name: "map", kind }];
        if self.view == View::Global {
            let repeats = if self.is_cube() { "linear" } else { "linear, repeats across, clamped down" };
            resources.push(Resource { name: "filtering", kind: ResourceKind::Sampler(repeats) });
        }
        Source { functions: self.functions(), resources, rows_from_bottom: false }
    }

    /// The version that GLSL needs, and its precision.
    fn precision(&self) -> &'static str {
        match (self.view, self.is_cube()) {
            (View::Global, true) => {
                "// GLSL ES 3.20, GLSL 4.00 or later; WebGL 2 has no cube arrays.\n\
                 precision highp float;\nprecision highp int;\n"
            }
            _ => PRECISION,
        }
    }

    fn is_cube(&self) -> bool {
        matches!(self.grid, MapGrid::Cube(_))
    }

    /// What the functions take, in comments.
    fn heading(&self) -> String {
        let [_, height, width] = self.grid.shape();
        let (p, rows) = (self.p.get(), self.rows());
        let view = if self.view == View::Local { "local" } else { "global" };
        let central = match self.centre {
            Centre::Reflection => "the reflection vector, 2 dot(n, v) n - v",
            Centre::Normal => "the normal",
            Centre::Tangent => "the tangent",
        };
        let order = if self.terms == Terms::Zonal { "p, q being 0" } else { "p * p + p + q" };
        let texture = match (self.view, self.is_cube()) {
            (View::Local, true) => {
                format!("a 2D array of {} layers, 6 * row + face: the memory of KTX2's cube array", 6 * rows)
            }
            (View::Local, false) => format!("a 2D array of {rows} layers, as KTX2 has it"),
            (View::Global, true) => format!("a cube array of {rows} cubes, filtered bilinearly"),
            (View::Global, false) => {
                format!(
                    "a 2D array of {rows} layers, filtered bilinearly; it repeats across and is clamped down"
                )
            }
        };
        let size = if self.is_cube() {
            format!("cube of {width}")
        } else {
            format!("lat-long map of {width} x {height}")
        };
        format!(
            "// A {view} {size} with P = {p}: reflected(central, view) is the radiance toward the view from\n\
             // a surface whose central direction is {central}.\n\
             // Both directions point to the outside, have length 1 and are right-handed with +Z up.\n\
             // What the map has below zero is for the caller: max(reflected(central, view), 0).\n\
             // The texture is {texture}.\n\
             // The row of (p, q) is {order}.\n"
        )
    }

    /// The number of coefficients of a texel.
    fn rows(&self) -> usize {
        if self.terms == Terms::Zonal { self.p.get() + 1 } else { self.p.rows() }
    }

    /// All functions, in the words of WGSL.
    fn functions(&self) -> String {
        let [_, height, width] = self.grid.shape();
        let sizes =
            |text: &str| text.replace("WIDTH", &width.to_string()).replace("HEIGHT", &height.to_string());
        let frame = if self.terms == Terms::Zonal { "" } else { FRAME };
        let w =
            if self.terms == Terms::Zonal { "vec3f(0.0, 0.0, dot(view, z))" } else { "in_frame(z, view)" };
        let radiance = self.radiance();
        let text = match (self.view, self.is_cube()) {
            (View::Local, true) => [LOADED, &radiance, frame, CUBE_PLACE, CUBE].concat(),
            (View::Local, false) => [LOADED, &radiance, frame, LAT_LONG].concat(),
            (View::Global, true) => [FROM_CUBES, &radiance, GLOBAL_CUBE].concat(),
            (View::Global, false) => [FROM_LAYERS, &radiance, GLOBAL_LAT_LONG].concat(),
        };
        sizes(&text.replace("LOCAL_VIEW", w))
    }

    /// The sum over the coefficients at one place of the texture, seen from w.
    fn radiance(&self) -> String {
        let place = match (self.view, self.is_cube()) {
            (View::Local, true) => "at: vec2i, face: i32",
            (View::Local, false) => "at: vec2i",
            (View::Global, true) => "at: vec3f",
            (View::Global, false) => "at: vec2f",
        };
        let has_faces = (self.view, self.is_cube()) == (View::Local, true);
        let layer = |row: usize| match (has_faces, row) {
            (false, row) => row.to_string(),
            (true, 0) => "face".to_owned(),
            (true, row) => format!("face + {}", 6 * row),
        };
        let mut text = format!(
            "fn radiance({place}, w: vec3f) -> vec3f {{\n    var sum: vec3f = vec3f(0.0, 0.0, 0.0);\n"
        );
        for statement in statements(self.p.get(), self.terms) {
            text.push_str("    ");
            match statement {
                Statement::Let(name, value) => text.push_str(&format!("let {name}: f32 = {value};")),
                Statement::Add(Addend { factor, rows }) => {
                    let coefficient = |row: usize| format!("coefficient(at, {})", layer(row));
                    match &rows[..] {
                        [(None, row)] => text.push_str(&format!("sum += {factor} * {};", coefficient(*row))),
                        rows => {
                            let wave = |wave: &Option<String>| wave.clone().unwrap_or_default();
                            let each = rows
                                .iter()
                                .map(|(name, row)| format!("{} * {}", wave(name), coefficient(*row)));
                            let each: Vec<String> = each.collect();
                            text.push_str(&format!("sum += {factor} * ({});", each.join(" + ")));
                        }
                    }
                }
            }
            text.push('\n');
        }
        text.push_str("    return sum;\n}\n\n");
        text
    }
}

/// A coefficient of a texel.
const LOADED: &str = "\
fn coefficient(at: vec2i, layer: i32) -> vec3f {
    return load_layer(map, at, layer).rgb;
}

";

/// A coefficient between the texels of a cube.
const FROM_CUBES: &str = "\
fn coefficient(at: vec3f, layer: i32) -> vec3f {
    return sample_cube(map, at, layer, 0.0).rgb;
}

";

/// A coefficient between the texels of a lat-long map.
const FROM_LAYERS: &str = "\
fn coefficient(at: vec2f, layer: i32) -> vec3f {
    return sample_layer(map, at, layer).rgb;
}

";

/// The view in the frame of a texel toward z, whose x and y point along theta and phi.
const FRAME: &str = "\
fn in_frame(z: vec3f, view: vec3f) -> vec3f {
    let sine: f32 = length(z.xy);
    var away: vec2f = vec2f(1.0, 0.0);
    if (sine > 0.0) {
        away = z.xy / sine;
    }
    let south: vec3f = vec3f(z.z * away.x, z.z * away.y, -sine);
    return vec3f(dot(view, south), view.y * away.x - view.x * away.y, dot(view, z));
}

";

/// Directions in cube coordinates and places on faces, s and t from 0 to 1.
const CUBE_PLACE: &str = "\
fn cube_direction(face: i32, s: f32, t: f32) -> vec3f {
    let x: f32 = 2.0 * s - 1.0;
    let y: f32 = 1.0 - 2.0 * t;
    if (face == 0) { return vec3f(1.0, y, -x); }
    if (face == 1) { return vec3f(-1.0, y, x); }
    if (face == 2) { return vec3f(x, 1.0, -y); }
    if (face == 3) { return vec3f(x, -1.0, y); }
    if (face == 4) { return vec3f(x, y, 1.0); }
    return vec3f(-x, y, -1.0);
}

fn face_and_place(c: vec3f) -> vec3f {
    let a: vec3f = abs(c);
    var found: vec3f = vec3f(4.0, c.x, -c.y);
    var most: f32 = a.z;
    if (c.z <= 0.0) { found = vec3f(5.0, -c.x, -c.y); }
    if (a.y >= a.z) {
        most = a.y;
        found = vec3f(2.0, c.x, c.z);
        if (c.y <= 0.0) { found = vec3f(3.0, c.x, -c.z); }
    }
    if (a.x >= a.y && a.x >= a.z) {
        most = a.x;
        found = vec3f(0.0, -c.z, -c.y);
        if (c.x <= 0.0) { found = vec3f(1.0, c.z, -c.y); }
    }
    return vec3f(found.x, 0.5 * found.y / most + 0.5, 0.5 * found.z / most + 0.5);
}

";

/// A local cube: over an edge lies the texel beside it on the next face, at a corner the mean of three.
const CUBE: &str = "\
fn texel(home: i32, place: vec2i, view: vec3f) -> vec3f {
    var face: i32 = home;
    var at: vec2i = place;
    if (at.x < 0 || at.y < 0 || at.x >= WIDTH || at.y >= WIDTH) {
        let s: f32 = clamp((f32(at.x) + 0.5) / WIDTH.0, -0.00001, 1.00001);
        let t: f32 = clamp((f32(at.y) + 0.5) / WIDTH.0, -0.00001, 1.00001);
        let beside: vec3f = face_and_place(cube_direction(home, s, t));
        face = i32(beside.x);
        let last: i32 = WIDTH - 1;
        at = vec2i(clamp(i32(beside.y * WIDTH.0), 0, last), clamp(i32(beside.z * WIDTH.0), 0, last));
    }
    let c: vec3f = cube_direction(face, (f32(at.x) + 0.5) / WIDTH.0, (f32(at.y) + 0.5) / WIDTH.0);
    let z: vec3f = normalize(vec3f(c.z, -c.x, c.y));
    return radiance(at, face, LOCAL_VIEW);
}

fn reflected(central: vec3f, view: vec3f) -> vec3f {
    let home: vec3f = face_and_place(vec3f(-central.y, central.z, central.x));
    let place: vec2f = home.yz * WIDTH.0 - 0.5;
    let first: vec2i = vec2i(floor(place));
    let part: vec2f = fract(place);
    var sum: vec3f = vec3f(0.0, 0.0, 0.0);
    var plain: vec3f = vec3f(0.0, 0.0, 0.0);
    var left: f32 = 1.0;
    for (var k: i32 = 0; k < 4; k++) {
        let at: vec2i = first + vec2i(k % 2, k / 2);
        let is_past_x: bool = at.x < 0 || at.x >= WIDTH;
        let is_past_y: bool = at.y < 0 || at.y >= WIDTH;
        if (!(is_past_x && is_past_y)) {
            let weight: f32 = abs(1.0 - f32(k % 2) - part.x) * abs(1.0 - f32(k / 2) - part.y);
            let value: vec3f = texel(i32(home.x), at, view);
            sum += weight * value;
            plain += value;
            left -= weight;
        }
    }
    return sum + left / 3.0 * plain;
}
";

/// A local lat-long map: over a pole lies the first row, half a turn on.
const LAT_LONG: &str = "\
fn texel(place: vec2i, view: vec3f) -> vec3f {
    var at: vec2i = place;
    if (at.y < 0) {
        at = vec2i(at.x + WIDTH / 2, -1 - at.y);
    }
    if (at.y >= HEIGHT) {
        at = vec2i(at.x + WIDTH / 2, 2 * HEIGHT - 1 - at.y);
    }
    at = vec2i((at.x + WIDTH) % WIDTH, at.y);
    let theta: f32 = 3.1415927 * (f32(at.y) + 0.5) / HEIGHT.0;
    let phi: f32 = 6.2831855 * (0.5 - (f32(at.x) + 0.5) / WIDTH.0);
    let z: vec3f = vec3f(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
    return radiance(at, LOCAL_VIEW);
}

fn reflected(central: vec3f, view: vec3f) -> vec3f {
    let u: f32 = 0.5 - atan2(central.y, central.x) / 6.2831855;
    let v: f32 = acos(clamp(central.z, -1.0, 1.0)) / 3.1415927;
    let place: vec2f = vec2f(u * WIDTH.0 - 0.5, v * HEIGHT.0 - 0.5);
    let first: vec2i = vec2i(floor(place));
    let part: vec2f = fract(place);
    var sum: vec3f = vec3f(0.0, 0.0, 0.0);
    for (var k: i32 = 0; k < 4; k++) {
        let weight: f32 = abs(1.0 - f32(k % 2) - part.x) * abs(1.0 - f32(k / 2) - part.y);
        sum += weight * texel(first + vec2i(k % 2, k / 2), view);
    }
    return sum;
}
";

/// A global cube, which hardware filters.
const GLOBAL_CUBE: &str = "\
fn reflected(central: vec3f, view: vec3f) -> vec3f {
    return radiance(vec3f(-central.y, central.z, central.x), view);
}
";

/// A global lat-long map, which hardware filters.
const GLOBAL_LAT_LONG: &str = "\
fn reflected(central: vec3f, view: vec3f) -> vec3f {
    let u: f32 = 0.5 - atan2(central.y, central.x) / 6.2831855;
    let v: f32 = acos(clamp(central.z, -1.0, 1.0)) / 3.1415927;
    return radiance(vec2f(u, v), view);
}
";
