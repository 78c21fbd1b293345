use envmap::Environment;
use sh::Stop;
use sphere::{DVec3, Direction, LatLong, spiral, to_cube};

use super::*;
use crate::{NormalTap, ROWS, ScaleSpace, Tap, TapRow, VariedTable, Weights};

fn look_up(language: Language, source: Source, lights: usize) -> LookUp {
    LookUp {
        language,
        source,
        cube_coordinates: LookUp::SPECULA,
        rows_from_bottom: false,
        widths: Widths::new(64).unwrap(),
        taps: 6,
        normals: 1,
        lights,
        varied: None,
    }
}

#[test]
fn every_text_in_wgsl_is_valid() {
    for (source, lights, rows_from_bottom, varied) in [
        (Source::CubeArray, 0, false, None),
        (Source::CubeArray, 8, true, None),
        (Source::Atlas, 3, false, None),
        (Source::CubeArray, 2, true, Some((Weights::Colour, 17))),
        (Source::Atlas, 0, false, Some((Weights::ScaleBias, 33))),
    ] {
        let brdf = "fn tap_brdf(N: vec3f, V: vec3f, L: vec3f, radius: f32) -> vec3f { return L; }";
        let text = LookUp { rows_from_bottom, varied, ..look_up(Language::Wgsl, source, lights) }.text();
        let further = match varied {
            None => "",
            Some((Weights::Colour, _)) => ", d.x",
            Some((Weights::ScaleBias, _)) => ", tap_albedo(d.x, d.y).x, d",
        };
        let lit = if lights > 0 { "+ tap_lights(d, d)" } else { "" };
        let main = format!(
            "@fragment fn main(@location(0) d: vec3f) -> @location(0) vec4f {{
                return vec4f(tap_reflected(d, d{further}) {lit}, 1.0);
            }}"
        );
        let text = [brdf, &text, &main].join("\n");
        let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| {
            panic!("{}", error.emit_to_string(&text));
        });
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::CUBE_ARRAY_TEXTURES,
        );
        validator.validate(&module).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
    }
}

/// What is left of WGSL in the other languages, whose compilers are not here.
#[test]
fn every_declaration_is_turned_round() {
    for language in [Language::Glsl, Language::Hlsl] {
        for (source, varied) in [
            (Source::CubeArray, None),
            (Source::Atlas, None),
            (Source::Atlas, Some((Weights::Colour, 9))),
            (Source::Atlas, Some((Weights::ScaleBias, 9))),
        ] {
            let text = LookUp { varied, ..look_up(language, source, 2) }.text();
            let code: Vec<_> = text.lines().map(|line| line.split("//").next().unwrap()).collect();
            let code = code.join("\n");
            for word in
                ["f32", "i32", "vec2f", "vec3f", "vec4f", "let ", "var ", "fn ", "->", ": ", "sample_"]
            {
                assert!(!code.contains(word), "{word:?} in\n{text}");
            }
            // The text is between the back quotes of JavaScript, too.
            assert!(!text.contains(['`', '$', '\\']), "{text}");
        }
    }
    let glsl = look_up(Language::Glsl, Source::CubeArray, 0).functions();
    assert!(glsl.contains("    return textureLod(tap_levels, vec4(c, layer), mip).rgb;"), "{glsl}");
    assert!(glsl.contains("    vec3 sum = vec3(0.0, 0.0, 0.0);"), "{glsl}");
    let varied = Some((Weights::ScaleBias, 9));
    let shared = LookUp { varied, ..look_up(Language::Glsl, Source::CubeArray, 0) }.text();
    assert!(shared.contains("uniform highp sampler2DArray tap_table;"), "{shared}");
    assert!(shared.contains("    return textureLod(tap_table, vec3(place, layer), 0.0);"), "{shared}");
    let hlsl = look_up(Language::Hlsl, Source::Atlas, 0).functions();
    assert!(hlsl.contains("static const int TAP_COUNT = 6;  // look-ups"), "{hlsl}");
    assert!(hlsl.contains("    for (int j = 0; j < TAP_NORMALS; j++) {"), "{hlsl}");
    let turned = LookUp { rows_from_bottom: true, ..look_up(Language::Glsl, Source::Atlas, 0) }.functions();
    assert!(turned.contains("textureLod(tap_levels, vec2(place.x, 1.0 - place.y), 0.0).rgb"), "{turned}");
}

/// A picture of levels, and the look-ups of `atlas.wgsl` in it.
struct Picture {
    edge: usize,
    image: Image,
}

impl Picture {
    fn new(levels: &[CubeMap]) -> Self {
        Self { edge: levels[0].cube().edge, image: atlas_picture(levels).unwrap() }
    }

    fn look_up(&self, direction: Direction, k: f64) -> [f64; 3] {
        let [x, y] = texel(face(to_cube(direction.vector())), self.edge as f64, k).map(|place| place - 0.5);
        let at = |dx: usize, dy: usize| {
            self.image.pixels()[(y as usize + dy) * self.image.width() + x as usize + dx]
        };
        let (u, v) = (x.fract(), y.fract());
        std::array::from_fn(|c| {
            let at = |dx, dy| f64::from(at(dx, dy)[c]);
            (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) + v * ((1.0 - u) * at(0, 1) + u * at(1, 1))
        })
    }
}

/// The twin of `tap_cube`.
fn face(c: DVec3) -> [f64; 3] {
    let a = c.abs();
    let sign = |x: f64| if x > 0.0 { 1.0 } else { -1.0 };
    let place = |s: f64, t: f64, m: f64, face: f64| [0.5 + 0.5 * s / m, 0.5 + 0.5 * t / m, face];
    if a.x >= a.y && a.x >= a.z {
        return place(-sign(c.x) * c.z, -c.y, a.x, 0.5 - 0.5 * sign(c.x));
    }
    if a.y >= a.z {
        return place(c.x, sign(c.y) * c.z, a.y, 2.5 - 0.5 * sign(c.y));
    }
    place(sign(c.z) * c.x, -c.y, a.z, 4.5 - 0.5 * sign(c.z))
}

/// The twin of `tap_texel`.
fn texel([s, t, face]: [f64; 3], edge: f64, k: f64) -> [f64; 2] {
    let octave = (0.25 * k).floor();
    let n = (-octave).exp2() * edge;
    let left = octave.min(1.0) * 4.0 * (edge + 2.0) + (k - 4.0 * octave) * (n + 2.0);
    let top = 6.0 * (edge - 2.0 * n + 2.0 * (octave - 1.0)).max(0.0) + face * (n + 2.0);
    [left + 1.0 + n * s, top + 1.0 + n * t]
}

fn mixed(a: [f64; 3], b: [f64; 3], share: f64) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + share * (b[c] - a[c]))
}

fn space() -> ScaleSpace {
    let grid = LatLong::with_rows(64);
    let lamp = Direction::from_angles(1.0, 0.7);
    let radiance = |index: usize| {
        let d = grid.direction(index / grid.width, index % grid.width);
        let glow = if d.dot(lamp) > 0.95 { 20.0 } else { 0.0 };
        [1.0 + 0.5 * d.vector().z as f32 + glow, 1.0, 0.2 + 0.1 * (6.0 * d.vector().x).sin() as f32]
    };
    let environment = Environment::new(grid, (0..grid.len()).map(radiance).collect()).unwrap();
    ScaleSpace::new(&environment, &[], Widths::new(16).unwrap(), Stop::NEVER).unwrap()
}

#[test]
fn pictures_of_levels_are_looked_up_as_cubes_are() {
    let space = space();
    let (levels, normals) = (Picture::new(space.levels()), Picture::new(space.normals()));
    // The columns and rows that the shader's `tap_normal_level` assumes.
    assert_eq!([normals.image.width(), normals.image.height()], [72, 108]);
    let widths = space.widths();
    for index in 0..3000 {
        let direction = spiral(index, 3000);
        // tap_blurred and tap_about_normal.
        let log_std = -3.0 + 4.0 * index as f64 / 3000.0;
        let x = 4.0 * (log_std - widths.std(0).log2());
        let x = x.clamp(0.0, (widths.len() - 1) as f64 - 0.001);
        let k = x.floor();
        let share = ((0.5 * (x - k)).exp2() - 1.0) * 2.414_213_56;
        let found = mixed(levels.look_up(direction, k), levels.look_up(direction, k + 1.0), share);
        let expected = space.blurred(direction, log_std.exp2());
        for channel in 0..3 {
            assert!((found[channel] - expected[channel]).abs() < 1e-5, "{found:?} {expected:?}");
        }
        let y = (7.3 * index as f64).fract();
        let (k, share) = ((3.0 * y).floor(), (3.0 * y).fract());
        let found = mixed(normals.look_up(direction, k), normals.look_up(direction, k + 1.0), share);
        let expected = space.about_normal(direction, y);
        for channel in 0..3 {
            assert!((found[channel] - expected[channel]).abs() < 1e-5, "{found:?} {expected:?}");
        }
    }
}

#[test]
fn a_table_has_two_rows_a_tap_and_one_about_the_normal() {
    let row = |i: usize| TapRow {
        taps: vec![Tap { delta: i as f64, std: 0.25, weight: [0.5, 0.25, 0.125] }; 2],
        normals: vec![NormalTap { y: 0.75, weight: [1.0, 2.0, 3.0] }],
    };
    let texels = table_texels(&TapTable::new((0..ROWS).map(row).collect()).unwrap());
    assert_eq!(texels.len(), 5 * ROWS);
    assert_eq!(texels[2 * ROWS + 7], [7.0, -2.0, 0.0, 0.0]);
    assert_eq!(texels[3 * ROWS + 64], [0.5, 0.25, 0.125, 0.0]);
    assert_eq!(texels[4 * ROWS], [1.0, 2.0, 3.0, 0.75]);
}

/// The look-up of the shader, linear in both directions, is [`VariedTable::at_reflectance`].
#[test]
fn a_table_over_roughness_has_a_layer_a_tap() {
    let row = |i: usize, table: f64| TapRow {
        taps: vec![Tap { delta: i as f64, std: table.exp2(), weight: [0.5 * table, 0.25, 0.0] }; 2],
        normals: vec![NormalTap { y: 0.75, weight: [1.0, table, 0.0] }],
    };
    let table = |table: f64| TapTable::new((0..ROWS).map(|i| row(i, table)).collect()).unwrap();
    let tables = vec![table(0.0), table(1.0), table(2.0)];
    let varied = VariedTable::new([0.0, 1.0], tables, Weights::ScaleBias).unwrap();
    let (layers, texels) = varied_texels(&varied);
    assert_eq!((layers, texels.len()), (3, 3 * 3 * ROWS));
    let texel = |layer: usize, row: usize, column: usize| texels[(layer * 3 + row) * ROWS + column];
    assert_eq!(texel(1, 2, 7), [7.0, 2.0, 1.0, 0.25]);
    assert_eq!(texel(2, 1, 64), [0.75, 0.0, 1.0, 1.0]);
    let found = varied.at_reflectance(0.25, [0.5, 1.0, 0.0]);
    let middle: Vec<f32> = (0..4).map(|k| 0.5 * (texel(0, 0, 9)[k] + texel(0, 1, 9)[k])).collect();
    let tap = found.rows()[9].taps[0];
    assert!((tap.std.log2() - f64::from(middle[1])).abs() < 1e-12 && tap.delta == 9.0);
    let [scale, bias] = [middle[2], middle[3]].map(f64::from);
    assert_eq!(tap.weight, [0.5 * scale + bias, scale + bias, bias]);
    let colours = VariedTable::new([0.0, 1.0], varied.tables().to_vec(), Weights::Colour).unwrap();
    assert_eq!(varied_texels(&colours).0, 5);
    assert!(VariedTable::new([1.0, 1.0], varied.tables().to_vec(), Weights::Colour).is_none());
    assert!(VariedTable::new([0.0, 1.0], varied.tables()[..1].to_vec(), Weights::Colour).is_none());
}
