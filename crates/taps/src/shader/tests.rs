use envmap::Environment;
use sh::Stop;
use sphere::{DVec3, Direction, LatLong, spiral, to_cube};

use super::*;
use crate::{NormalTap, ROWS, ScaleSpace, SurfaceFrame, Tap, TapRow, VariedTable, Weights};

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
        table: TableShape::Angle,
    }
}

#[test]
fn every_text_in_wgsl_is_valid() {
    let facets = |is_quarter| TableShape::Facets { is_quarter };
    for (source, lights, rows_from_bottom, table) in [
        (Source::CubeArray, 0, false, TableShape::Angle),
        (Source::CubeArray, 8, true, TableShape::Angle),
        (Source::Atlas, 3, false, TableShape::Angle),
        (Source::CubeArray, 3, true, facets(true)),
        (Source::Atlas, 0, false, facets(false)),
        (Source::CubeArray, 2, true, TableShape::Varied(Weights::Colour, 17)),
        (Source::Atlas, 0, false, TableShape::Varied(Weights::ScaleBias, 33)),
    ] {
        let brdf = "fn tap_brdf(N: vec3f, V: vec3f, L: vec3f, radius: f32) -> vec3f { return L; }";
        let text = LookUp { rows_from_bottom, table, ..look_up(Language::Wgsl, source, lights) }.text();
        let further = match table {
            TableShape::Angle => "d",
            TableShape::Facets { .. } => "d.yzx, d",
            TableShape::Varied(Weights::Colour, _) => "d, d.x",
            TableShape::Varied(Weights::ScaleBias, _) => "d, tap_albedo(d.x, d.y).x, d",
        };
        let lit = if lights > 0 { "+ tap_lights(d, d)" } else { "" };
        let main = format!(
            "@fragment fn main(@location(0) d: vec3f) -> @location(0) vec4f {{
                return vec4f(tap_reflected(d, {further}) {lit}, 1.0);
            }}"
        );
        let text = [brdf, &text, &main].join("\n");
        assert_valid(&text);
    }
}

fn assert_valid(text: &str) {
    let module =
        naga::front::wgsl::parse_str(text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::CUBE_ARRAY_TEXTURES,
    );
    validator.validate(&module).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
}

/// What is left of WGSL in the other languages, whose compilers are not here.
#[test]
fn every_declaration_is_turned_round() {
    for language in [Language::Glsl, Language::Hlsl] {
        for (source, table) in [
            (Source::CubeArray, TableShape::Angle),
            (Source::Atlas, TableShape::Angle),
            (Source::CubeArray, TableShape::Facets { is_quarter: true }),
            (Source::Atlas, TableShape::Facets { is_quarter: false }),
            (Source::Atlas, TableShape::Varied(Weights::Colour, 9)),
            (Source::Atlas, TableShape::Varied(Weights::ScaleBias, 9)),
        ] {
            let text = LookUp { table, ..look_up(language, source, 2) }.text();
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
    let table = TableShape::Varied(Weights::ScaleBias, 9);
    let shared = LookUp { table, ..look_up(Language::Glsl, Source::CubeArray, 0) }.text();
    assert!(shared.contains("uniform highp sampler2DArray tap_table;"), "{shared}");
    assert!(shared.contains("    return textureLod(tap_table, vec3(place, layer), 0.0);"), "{shared}");
    let hlsl = look_up(Language::Hlsl, Source::Atlas, 0).functions();
    assert!(hlsl.contains("static const int TAP_COUNT = 6;  // look-ups"), "{hlsl}");
    assert!(hlsl.contains("    for (int j = 0; j < TAP_NORMALS; j++) {"), "{hlsl}");
    let table = TableShape::Facets { is_quarter: true };
    let turned = LookUp { rows_from_bottom: true, table, ..look_up(Language::Glsl, Source::Atlas, 0) };
    let turned = turned.functions();
    assert!(turned.contains("textureLod(tap_levels, vec2(place.x, 1.0 - place.y), 0.0).rgb"), "{turned}");
    assert!(turned.contains("textureLod(tap_table, vec2(place.x, 1.0 - place.y), 0.0);"), "{turned}");
}

/// The components of a cross product are those of Z x X in a right-handed world, and of X x Z in its mirror
/// image.
#[test]
fn the_direction_across_the_tangent_is_the_same_in_every_world() {
    let table = TableShape::Facets { is_quarter: false };
    for (cube_coordinates, across) in [
        (LookUp::SPECULA, "cross(N, X)"),
        (["d.z", "d.y", "d.x"], "cross(N, X)"),
        (["d.x", "d.y", "-d.z"], "cross(N, X)"),
        (["d.x", "d.y", "d.z"], "cross(X, N)"),
        (["-d.z", "d.y", "d.x"], "cross(X, N)"),
        (["d.x", "d.z", "-d.y"], "cross(X, N)"),
    ] {
        let look_up = LookUp { cube_coordinates, table, ..look_up(Language::Hlsl, Source::Atlas, 0) };
        let text = look_up.functions();
        assert!(text.contains(&format!("    float3 Y = {across};\n")), "{cube_coordinates:?} {text}");
    }
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

/// The twin of `tap_node`: a bilinear look-up in the picture of a table.
fn node(table: &FacetTable, texels: &[[f32; 4]], p: [f64; 2], picture: usize) -> [f64; 4] {
    let side = table.side();
    let rows = (2 * table.taps() + table.normals()) * side;
    let place = [0, 1].map(|axis| {
        let (first, size) = [(0, side), (picture * side, rows)][axis];
        ((side as f64 - 1.0) * p[axis] + first as f64 + 0.5) / size as f64
    });
    let [x, y] = [place[0] * side as f64 - 0.5, place[1] * rows as f64 - 0.5];
    let at = |dx: usize, dy: usize| {
        texels[(y as usize + dy).min(rows - 1) * side + (x as usize + dx).min(side - 1)]
    };
    let (u, v) = (x.fract(), y.fract());
    std::array::from_fn(|c| {
        let at = |dx, dy| f64::from(at(dx, dy)[c]);
        (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) + v * ((1.0 - u) * at(0, 1) + u * at(1, 1))
    })
}

/// A table whose values change from node to node.
fn facets(is_quarter: bool) -> FacetTable {
    let side = if is_quarter { FacetTable::QUARTER } else { FacetTable::WHOLE };
    let node = |index: usize| {
        let part = |step: f64| (step * index as f64).fract();
        let tap = |j: f64| FacetTap {
            slope: [part(0.37 + j) - 0.5, part(0.71 - j) - 0.4],
            std: 0.1 + 0.3 * part(0.13),
            weight: [part(0.21), 0.2 + j, 0.1],
        };
        FacetNode {
            taps: vec![tap(0.0), tap(0.125)],
            normals: vec![NormalTap { y: part(0.57), weight: [0.1, part(0.43), 0.3] }],
        }
    };
    FacetTable::new((0..side * side).map(node).collect()).unwrap()
}

/// The twin of `tap_reflected` with a tangent is [`FacetTable::radiance`].
#[test]
fn pictures_of_facets_are_looked_up_as_the_table_is() {
    let space = space();
    for is_quarter in [true, false] {
        let table = facets(is_quarter);
        let texels = facet_texels(&table);
        for index in 0..500 {
            let (n, v) = (spiral(index, 500), spiral((index * 37 + 11) % 500, 500));
            let t = spiral((index * 11 + 3) % 500, 500).vector();
            let (normal, view) = (n.vector(), v.vector());
            let across = t - normal.dot(t) * normal;
            let x = across / across.length_squared().max(1e-12).sqrt();
            let y = normal.cross(x);
            let local = DVec3::new(view.dot(x), view.dot(y), view.dot(normal).max(0.0)).normalize();
            let scale = 1.0 / ((1.0 + local.z) * (1.0 + local.z.sqrt())).sqrt();
            let disc = [local.x * scale, local.y * scale];
            let mirror = disc.map(|value| if is_quarter && value < 0.0 { -1.0 } else { 1.0 });
            let first = if is_quarter { 0.0 } else { -1.0 };
            let p = [0, 1].map(|axis| (mirror[axis] * disc[axis] - first) / (1.0 - first));
            let mut found = [0.0; 3];
            for j in 0..2 {
                let [shape, weight] = [0, 1].map(|k| node(&table, &texels, p, 2 * j + k));
                let h = DVec3::new(mirror[0] * shape[0], mirror[1] * shape[1], 1.0);
                let l = 2.0 * local.dot(h) / h.dot(h) * h - local;
                let d = l.x * x + l.y * y + l.z * normal;
                let light = space.blurred(Direction::normalised(d), shape[2].exp2());
                (0..3).for_each(|c| found[c] += weight[c] * light[c]);
            }
            let tap = node(&table, &texels, p, 4);
            let light = space.about_normal(n, tap[3]);
            (0..3).for_each(|c| found[c] += tap[c] * light[c]);
            let frame = SurfaceFrame::new(n, Direction::normalised(t));
            let expected = table.radiance(&space, frame, v);
            for c in 0..3 {
                assert!((found[c] - expected[c]).abs() < 1e-4, "{index}: {found:?} {expected:?}");
            }
        }
    }
}
