use std::f64::consts::{PI, TAU};

use brdf::{BrdfCoefficients, Centre};
use containers::{Texture, read_exr_layers, read_recipe, read_texture, row_names, tensors};
use sh::{Degree, Stop};
use shrm::{MapGrid, Terms, View};
use sphere::{Cube, DVec3, Direction, LatLong};
use stages::artifacts::{Brdf, Material, Reflection, Shrm};

use crate::fixture::{Case, case, lambert, reflection, sky_lighting};

/// The sky reflected by something made up of degree F = P = 2, with or without azimuth.
pub(crate) fn made_up(azimuth: bool) -> Reflection {
    let two = Degree::new(2).unwrap();
    let rho = (0..27)
        .map(|i| {
            let (l, p, q) = (i / 9, i / 3 % 3, i % 3);
            let there = q <= l.min(p) && (azimuth || q == 0);
            let value = 0.4 + 0.3 * l as f64 - 0.2 * p as f64 + 0.1 * q as f64;
            if there { [value, 0.5 * value, 0.1] } else { [0.0; 3] }
        })
        .collect();
    let brdf = BrdfCoefficients::new(Centre::Reflection, two, two, rho).unwrap();
    Reflection(shrm::Reflection::convolve(&sky_lighting().0.series, &brdf))
}

fn export(parameters: &str) -> Case {
    case("export-shrm", parameters).input("reflection", made_up(true))
}

const CUBE: &str = "layout = \"cube\"\nresolution = 3\n";
const LAT_LONG: &str = "layout = \"lat-long\"\nresolution = 4\n";

fn grids() -> [(&'static str, MapGrid); 2] {
    [(CUBE, MapGrid::Cube(Cube { edge: 3 })), (LAT_LONG, MapGrid::LatLong(LatLong { width: 8, height: 4 }))]
}

/// Values below 8 as f32: half a unit in the last place of 2^-21, twice because of earlier rounding.
const F32: f64 = 1e-6;
/// As halves: half of 2^-8.
const HALF: f64 = 0.002;

/// The largest difference of a texel's rows from the expected ones.
fn error(found: &[[f32; 3]], expected: &[[f64; 3]]) -> f64 {
    crate::fixture::difference(found, expected)
}

#[test]
fn local_texels_hold_the_coefficients_at_their_directions() {
    let reflection = made_up(true);
    for (shape, grid) in grids() {
        let file = &export(shape).files()[0];
        let map = tensors::decode_shrm(file).unwrap();
        assert_eq!((map.grid(), map.view(), map.terms()), (grid, View::Local, Terms::All));
        assert_eq!((map.centre(), map.p().get()), (Centre::Reflection, 2));
        for texel in 0..grid.len() {
            let expected = reflection.0.coefficients(grid.direction(texel));
            let error = error(map.texel(texel), &expected);
            assert!(error < F32, "{shape}, texel {texel}: {error:e}");
        }
        assert_eq!(read_recipe(file).as_deref(), Some("{\"kind\":\"export-shrm\"}"));
    }
}

#[test]
fn global_texels_give_the_radiance_toward_a_view_of_the_world() {
    let reflection = made_up(true);
    let view = Direction::from_angles(1.1, 0.4);
    let mut basis = [0.0; 9];
    sh::Basis::new(Degree::new(2).unwrap()).evaluate_into(view, &mut basis);
    for (shape, grid) in grids() {
        let file = &export(&format!("{shape}view = \"global\"")).files()[0];
        let map = tensors::decode_shrm(file).unwrap();
        assert_eq!((map.grid(), map.view()), (grid, View::Global));
        for texel in 0..grid.len() {
            let expected = reflection.0.evaluate(grid.direction(texel), view);
            for channel in 0..3 {
                let rows = map.texel(texel).iter().zip(&basis);
                let found: f64 = rows.map(|(row, y)| f64::from(row[channel]) * y).sum();
                // Nine products of values and harmonics below 1.1.
                assert!((found - expected[channel]).abs() < 9.0 * F32, "{shape}, texel {texel}");
            }
        }
    }
}

/// The texture and its metadata.
fn texture(case: &Case) -> (Texture, std::collections::BTreeMap<String, String>) {
    let file = read_texture(&case.files()[0]).unwrap();
    (file.texture, file.metadata)
}

#[test]
fn ktx2_has_a_layer_for_each_coefficient() {
    let reflection = made_up(true);
    for (shape, grid) in grids() {
        for (precision, tolerance) in [("half", HALF), ("float", F32)] {
            let case = export(&format!("{shape}format = \"ktx2\"\nprecision = \"{precision}\""));
            assert_eq!(case.endings(), [".ktx2"]);
            let (texture, metadata) = texture(&case);
            let [faces, height, width] = grid.shape();
            assert_eq!((texture.width, texture.height, texture.faces), (width, height, faces));
            assert_eq!((texture.layers, texture.depth), (9, 1));
            for texel in 0..grid.len() {
                let found: Vec<_> = (0..9).map(|row| texture.pixels[row * grid.len() + texel]).collect();
                let error = error(&found, &reflection.0.coefficients(grid.direction(texel)));
                assert!(error < tolerance, "{shape}, {precision}, texel {texel}: {error:e}");
            }
            let layout = if faces == 6 { "cube" } else { "lat-long" };
            for (key, value) in [
                ("specula.layout", layout),
                ("specula.view", "local"),
                ("specula.centre", "reflection"),
                ("specula.terms", "all"),
                ("specula.degree", "2"),
                ("specula.rows", "p0q0 p1qm1 p1q0 p1q1 p2qm2 p2qm1 p2q0 p2q1 p2q2"),
                ("KTXorientation", "rd"),
                ("specula", "{\"kind\":\"export-shrm\"}"),
            ] {
                assert_eq!(metadata[key], value, "{key}");
            }
        }
    }
}

#[test]
fn a_material_without_azimuth_has_p_plus_one_layers_and_nine_rows() {
    let plain = |parameters: &str| {
        case("export-shrm", &format!("{CUBE}{parameters}")).input("reflection", made_up(false))
    };
    let (texture, metadata) = texture(&plain("format = \"ktx2\"\nprecision = \"float\""));
    assert_eq!((texture.layers, metadata["specula.terms"].as_str()), (3, "zonal"));
    assert_eq!(metadata["specula.rows"], "p0q0 p1q0 p2q0");
    // Safetensors and OpenEXR hold every row.
    let map = tensors::decode_shrm(&plain("").files()[0]).unwrap();
    assert_eq!(map.terms(), Terms::Zonal);
    let description = tensors::describe(&plain("").files()[0]).unwrap();
    assert_eq!(description.tensors, [("shrm".into(), "F32".into(), vec![6, 3, 3, 9, 3])]);
    let layers = read_exr_layers(&plain("format = \"exr\"\nprecision = \"float\"").files()[0]).unwrap();
    assert_eq!(layers.layers.len(), 9);
    for (p, name) in ["", "p1q0", "p2q0"].into_iter().enumerate() {
        let (_, pixels) = layers.layers.iter().find(|(found, _)| found == name).unwrap();
        assert!(*pixels == texture.pixels[54 * p..54 * (p + 1)], "{name}");
        assert!((0..54).all(|texel| pixels[texel] == map.texel(texel)[p]), "{name}");
    }
    let zeros = layers.layers.iter().filter(|(_, pixels)| pixels.iter().all(|pixel| *pixel == [0.0; 3]));
    assert_eq!(zeros.count(), 6);
    // A global map of it needs all.
    let (texture, metadata) = self::texture(&plain("format = \"ktx2\"\nview = \"global\""));
    assert_eq!((texture.layers, metadata["specula.terms"].as_str()), (9, "all"));
}

#[test]
fn openexr_has_a_named_layer_for_each_coefficient() {
    let reflection = made_up(true);
    for (shape, grid) in grids() {
        let case = export(&format!("{shape}format = \"exr\""));
        assert_eq!(case.endings(), [".exr"]);
        let file = &case.files()[0];
        let found = read_exr_layers(file).unwrap();
        let [faces, height, width] = grid.shape();
        assert_eq!((found.width, found.height), (width, faces * height));
        for (row, name) in row_names(2, Terms::All).into_iter().enumerate() {
            let name = if row == 0 { String::new() } else { name };
            let (_, pixels) = found.layers.iter().find(|(layer, _)| *layer == name).unwrap();
            for (texel, pixel) in pixels.iter().enumerate() {
                let expected = reflection.0.coefficients(grid.direction(texel))[row];
                assert!(error(&[*pixel], &[expected]) < HALF, "{name}, texel {texel}");
            }
        }
        assert_eq!(found.metadata["specula.view"], "local");
        // A plain image to a reader that knows no layers.
        let plain = containers::read_image(file, &containers::ReadOptions::default()).unwrap().image;
        assert!(plain.pixels() == found.layers.iter().find(|(name, _)| name.is_empty()).unwrap().1);
    }
}

/// The manual's GLSL, line by line, against the look-up of the kernel.
#[test]
fn the_shader_of_the_manual_gives_the_radiance_of_a_look_up() {
    let (texture, _) = texture(&export(&format!("{LAT_LONG}format = \"ktx2\"\nprecision = \"float\"")));
    let map = tensors::decode_shrm(&export(LAT_LONG).files()[0]).unwrap();
    let (width, height) = (texture.width as i64, texture.height as i64);
    let texel = |x: i64, y: i64, view: DVec3| -> DVec3 {
        let (mut x, mut y) = (x, y);
        if y < 0 || y >= height {
            y = if y < 0 { -1 - y } else { 2 * height - 1 - y };
            x += width / 2;
        }
        x = (x + width) % width;
        let theta = PI * (y as f64 + 0.5) / height as f64;
        let phi = TAU * (0.5 - (x as f64 + 0.5) / width as f64);
        let z = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let ex = DVec3::new(theta.cos() * phi.cos(), theta.cos() * phi.sin(), -theta.sin());
        let ey = DVec3::new(-phi.sin(), phi.cos(), 0.0);
        let w = DVec3::new(ex.dot(view), ey.dot(view), z.dot(view));
        let harmonics = [
            0.28209479,
            0.48860251 * w.y,
            0.48860251 * w.z,
            0.48860251 * w.x,
            1.09254843 * w.x * w.y,
            1.09254843 * w.y * w.z,
            0.31539157 * (3.0 * w.z * w.z - 1.0),
            1.09254843 * w.x * w.z,
            0.54627422 * (w.x * w.x - w.y * w.y),
        ];
        let fetch = |row: i64| texture.pixels[((row * height + y) * width + x) as usize];
        let taps = harmonics.iter().zip(0..).map(|(y, row)| {
            let [r, g, b] = fetch(row).map(f64::from);
            *y * DVec3::new(r, g, b)
        });
        taps.sum()
    };
    for (theta, phi) in [(0.05, 2.0), (3.1, -2.0), (1.5, 3.13), (1.2, -3.13), (0.9, 0.3), (2.0, -1.0)] {
        let central = Direction::from_angles(theta, phi);
        for view in [Direction::from_angles(0.8, 1.0), Direction::from_angles(2.5, -2.8)] {
            let v = view.vector();
            let c = central.vector();
            let (u, down) = (0.5 - c.y.atan2(c.x) / TAU, c.z.clamp(-1.0, 1.0).acos() / PI);
            let (px, py) = (u * width as f64 - 0.5, down * height as f64 - 0.5);
            let (x, y) = (px.floor() as i64, py.floor() as i64);
            let (fx, fy) = (px - px.floor(), py - py.floor());
            let above = texel(x, y, v).lerp(texel(x + 1, y, v), fx);
            let below = texel(x, y + 1, v).lerp(texel(x + 1, y + 1, v), fx);
            let found = above.lerp(below, fy);
            let expected = map.radiance(central, view);
            for channel in 0..3 {
                let error = (found[channel] - f64::from(expected[channel])).abs();
                assert!(error < 9.0 * F32, "{theta} {phi}, channel {channel}: {error:e}");
            }
        }
    }
}

/// A map as an artifact.
fn map(grid: MapGrid, view: View) -> Shrm {
    Shrm(made_up(true).0.synthesise(grid, view, Stop::NEVER).unwrap())
}

#[test]
fn a_map_that_arrives_is_written_unchanged() {
    for (shape, grid) in grids() {
        for view in [View::Local, View::Global] {
            let from_map =
                |parameters: &str| case("export-shrm", parameters).input("reflection", map(grid, view));
            let words = if view == View::Local { "view = \"local\"\n" } else { "view = \"global\"\n" };
            let expected = export(&format!("{shape}{words}")).files();
            assert!(from_map("").files() == expected);
            assert!(from_map(&format!("{shape}{words}")).files() == expected);
        }
        let local = case("export-shrm", "view = \"global\"").input("reflection", map(grid, View::Local));
        assert_eq!(tensors::decode_shrm(&local.files()[0]).unwrap().view(), View::Global);
    }
}

#[test]
fn a_map_that_arrives_is_not_made_into_another() {
    let cube = MapGrid::Cube(Cube { edge: 3 });
    for (parameters, view, message) in [
        (
            "layout = \"lat-long\"",
            View::Local,
            "layout = \"lat-long\", but the connected map is a local cube of 3",
        ),
        ("resolution = 4", View::Local, "resolution = 4, but the connected map is a local cube of 3"),
        (
            "resolution = \"auto\"",
            View::Local,
            "resolution = \"auto\", but the connected map is a local cube of 3",
        ),
        ("error = 0.1", View::Local, "error = 0.1, but the connected map is a local cube of 3"),
        (
            "accept = [0.1, 0.2]",
            View::Local,
            "accept = [0.1, 0.2], but the connected map is a local cube of 3",
        ),
        ("most-p = 2", View::Local, "most-p = 2, but the connected map is a local cube of 3"),
        ("view = \"local\"", View::Global, "view = \"local\", but the connected map is a global cube of 3"),
    ] {
        let failure =
            case("export-shrm", parameters).input("reflection", map(cube, view)).run().err().unwrap();
        assert_eq!(failure.to_string(), message);
        assert!(failure.help.unwrap().contains(", or make a new map"));
    }
}

#[test]
fn degrees_resolution_and_size_are_noted() {
    let ran = export(CUBE).run().unwrap();
    let message = "F = 2, P = 2: a local cube of 3, 54 texels of 9 coefficients; bilinear look-ups have an estimated error of ";
    assert!(ran.notes[0].starts_with(message), "{}", ran.notes[0]);
    assert_eq!(ran.notes[1], format!("{} bytes", ran.files()[0].len()));
    let zonal = case("export-shrm", LAT_LONG).input("reflection", made_up(false)).run().unwrap();
    let message = "a local lat-long map of 8 x 4, 32 texels of 3 coefficients with q = 0; all others are zero; bilinear";
    assert!(zonal.notes[0].contains(message), "{}", zonal.notes[0]);
    let lambert = case("export-shrm", CUBE).input("reflection", reflection(lambert(0.5), 2)).run().unwrap();
    assert!(lambert.notes[0].starts_with("F = 2, P = 0: "), "{}", lambert.notes[0]);
}

#[test]
fn an_error_chooses_the_resolution() {
    for (layout, words) in [(shrm::MapLayout::Cube, "cube"), (shrm::MapLayout::LatLong, "lat-long")] {
        for error in [0.2, 0.1] {
            let expected = made_up(true).0.resolution(layout, error);
            let case = export(&format!("layout = \"{words}\"\nerror = {error}"));
            let ran = case.run().unwrap();
            let [_, rows, _] = tensors::decode_shrm(&case.files()[0]).unwrap().grid().shape();
            assert_eq!(rows, expected.texels, "{words}, {error}");
            let (_, said) = ran.notes[0].split_once("estimated error of ").unwrap();
            let (percent, rest) = said.split_once(' ').unwrap();
            let percent: f64 = percent.parse().unwrap();
            assert!((percent / (100.0 * expected.estimated_error) - 1.0).abs() < 0.06, "{}", ran.notes[0]);
            assert_eq!(rest, "% of the RMS radiance");
            assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
        }
    }
    // Degree 2 asks for no more than an edge of 10, to the next multiple of 4.
    let case = export("error = 0.0001");
    assert_eq!(tensors::decode_shrm(&case.files()[0]).unwrap().grid(), MapGrid::Cube(Cube { edge: 12 }));
    let warning = &case.run().unwrap().warnings[0];
    assert!(
        warning
            .starts_with("the map is too coarse for its reflection: between its texels it is off by about "),
        "{warning}"
    );
    assert!(
        warning.contains(" and 0.010 % was allowed; \"auto\" stops at 12 texels along an edge"),
        "{warning}"
    );
    // Nothing given: a local cube, within 0.01 or the most.
    assert_eq!(tensors::decode_shrm(&export("").files()[0]).unwrap().view(), View::Local);
}

#[test]
fn values_past_the_largest_half_are_reported() {
    let bright = |parameters: &str| {
        let values = vec![[7e4, 1.0, -7e4]; 6];
        let cube = MapGrid::Cube(Cube { edge: 1 });
        let map =
            shrm::Shrm::new(cube, View::Local, Centre::Normal, Degree::ZERO, Terms::All, values).unwrap();
        case("export-shrm", parameters).input("reflection", Shrm(map))
    };
    for format in ["exr", "ktx2"] {
        let ran = bright(&format!("format = \"{format}\"")).run().unwrap();
        assert!(ran.warnings.is_empty());
        assert!(ran.notes.iter().any(|note| note.starts_with("written in 32-bit floats")), "{:?}", ran.notes);
        let ran = bright(&format!("format = \"{format}\"\nprecision = \"half\"")).run().unwrap();
        let message = "12 values exceed 65504, the largest half";
        // 4496 of 70000.
        let lost = "the largest values are clamped: 6.4 % of the red sum is lost, 6.4 % of the blue; ";
        assert!(ran.warnings[0].starts_with(lost) && ran.warnings.len() == 1, "{:?}", ran.warnings);
        assert_eq!(bright(&format!("format = \"{format}\"\noverflow = \"error\"")).failure(), message);
        let kept = bright(&format!("format = \"{format}\"\nprecision = \"float\"")).run().unwrap();
        assert!(kept.warnings.is_empty());
    }
    assert!(bright("").run().unwrap().warnings.is_empty());
}

/// Texture arrays of browsers end at 256 layers, of which a cube takes six for each coefficient.
#[test]
fn a_texture_with_more_layers_than_browsers_take_is_reported() {
    let warnings = |p: usize, terms: Terms, grid: MapGrid, format: &str| {
        let degree = Degree::new(p).unwrap();
        let rows = if terms == Terms::All { degree.rows() } else { p + 1 };
        let values = vec![[0.5; 3]; grid.len() * rows];
        let map = shrm::Shrm::new(grid, View::Local, Centre::Normal, degree, terms, values).unwrap();
        let case = case("export-shrm", &format!("format = \"{format}\"")).input("reflection", Shrm(map));
        case.run().unwrap().warnings
    };
    let cube = MapGrid::Cube(Cube { edge: 1 });
    let lat_long = MapGrid::LatLong(LatLong { width: 2, height: 1 });
    let cannot = "WebGPU and WebGL 2 cannot load this file: it has";
    for (p, terms, grid, expected) in [
        (5, Terms::All, cube, None),
        (
            6,
            Terms::All,
            cube,
            Some(
                "294 layers, and their texture arrays at most 256; set most-p = 5 or less, or layout = \"lat-long\", which has 49",
            ),
        ),
        (
            16,
            Terms::All,
            cube,
            Some("1734 layers, and their texture arrays at most 256; set most-p = 5 or less"),
        ),
        (16, Terms::Zonal, cube, None),
        (15, Terms::All, lat_long, None),
        (
            16,
            Terms::All,
            lat_long,
            Some("289 layers, and their texture arrays at most 256; set most-p = 15 or less"),
        ),
    ] {
        let expected: Vec<String> = expected.iter().map(|text| format!("{cannot} {text}")).collect();
        assert_eq!(warnings(p, terms, grid, "ktx2"), expected);
        assert!(warnings(p, terms, grid, "exr").is_empty());
    }
}

#[test]
fn parameters_that_would_have_no_effect_are_errors() {
    for (parameters, expected) in [
        ("resolution = 0", "resolution: 0 is not a whole number from 1 to 4096 or \"auto\""),
        ("resolution = 5000", "resolution: 5000 is not a whole number from 1 to 4096 or \"auto\""),
        ("resolution = \"best\"", "resolution: \"best\" is not a whole number from 1 to 4096 or \"auto\""),
        ("accept = [0.1, 0.2]\nerror = 0.1", "error: accept already sets the allowed error"),
        ("accept = [0.1]", "accept: an array is not [p95, p99], two numbers of stops above 0"),
        ("accept = 0.1", "accept: 0.1 is not [p95, p99], two numbers of stops above 0"),
        ("most-p = 33", "most-p: 33 is not a whole number from 0 to 32"),
        ("error = 1", "error: 1 is not a number, 0.000001 or more and below 1"),
        ("precision = \"float\"", "precision: only format = \"exr\" or \"ktx2\" uses it"),
        ("overflow = \"error\"", "overflow: only files of half floats use it"),
        ("components = 4", "components: only form = \"components\" uses it"),
        ("form = \"components\"\nmost-p = 3", "most-p: only form = \"harmonics\" uses it"),
        ("packed = true", "packed: only form = \"components\" uses it"),
        ("form = \"components\"\nview = \"local\"", "view: only form = \"harmonics\" uses it"),
        ("form = \"components\"\nerror = 0.1", "error: only form = \"harmonics\" uses it"),
        ("form = \"components\"\nlayout = \"lat-long\"", "layout: components are on a cube"),
        ("form = \"components\"\nformat = \"exr\"", "format: components are in safetensors or ktx2"),
        (
            "form = \"components\"\nformat = \"ktx2\"\npacked = true",
            "packed: only format = \"safetensors\" uses it",
        ),
        (
            "form = \"components\"\ncomponents = 4\naccept = [0.1, 0.2]",
            "accept: only components = \"auto\" uses it",
        ),
    ] {
        assert_eq!(case("export-shrm", parameters).errors(), [expected]);
    }
}

/// The sky reflected by a material, with what a fit of components needs.
fn with_material(material: brdf::Material) -> Reflection {
    let brdf = case("project-brdf", "").input("material", Material(material)).artifact::<Brdf>();
    let convolved = case("convolve", "").input("lighting", sky_lighting()).input("brdf", (*brdf).clone());
    (*convolved.artifact::<Reflection>()).clone()
}

#[test]
fn components_add_up_to_what_is_reflected() {
    let material = brdf::Material::Microfacet(brdf::Microfacet::new(0.3, [1.0; 3]).unwrap());
    let field = with_material(material);
    let export = |parameters: &str| {
        case("export-shrm", &format!("form = \"components\"\nresolution = 8\n{parameters}"))
            .input("reflection", field.clone())
    };
    let ran = export("components = 12").run().unwrap();
    assert!(
        ran.notes[0].starts_with("12 components on a cube of 8: 95 % of views are within"),
        "{:?}",
        ran.notes
    );
    let described = tensors::describe(ran.files()[0]).unwrap();
    assert_eq!(
        described.tensors,
        [
            ("components".into(), "F32".into(), vec![12, 6, 10, 10, 3]),
            ("weights".into(), "F32".into(), vec![12, 64, 64])
        ]
    );
    assert_eq!(described.metadata["centre"], "reflection");
    let packed = &export("components = 12\npacked = true").files()[0];
    let names: Vec<String> =
        tensors::describe(packed).unwrap().tensors.into_iter().map(|tensor| tensor.0).collect();
    assert_eq!(names, ["sizes", "weights", "components", "components_half"]);
    // The sum at the centre of a texel of the face +X, of a surface seen straight on: the disc's centre lies
    // between four texels of the weights.
    let case = export("components = 12\nformat = \"ktx2\"\nprecision = \"float\"");
    assert_eq!(case.endings(), [".ktx2", "-weights.ktx2"]);
    let [map, weights] = [0, 1].map(|file| read_texture(&case.files()[file]).unwrap());
    assert_eq!(
        (map.texture.width, map.texture.layers, map.metadata["specula.components"].as_str()),
        (10, 72, "12")
    );
    assert_eq!((weights.texture.width, weights.texture.layers), (64, 3));
    let map = &map.texture.pixels;
    let central = Cube { edge: 8 }.direction(sphere::Face::PositiveX, 2, 5);
    // `read_texture` drops alpha, so that components 3, 7 and 11 are missing from the weights.
    let basis = shrm::components::ComponentBasis::of(field.0.material().unwrap()).unwrap();
    let w = basis.at([0.0, 0.0]);
    // Head on, the series of the view rings: the material's own value is exact.
    let exact = field.0.plain(shrm::Plain::HeadOn).evaluate(central);
    for channel in 0..3 {
        let found: f64 = (0..12).map(|k| w[k] * f64::from(map[600 * k + 3 * 10 + 6][channel])).sum();
        assert!((found / exact[channel] - 1.0).abs() < 0.03, "{found} {exact:?}");
    }
    for k in [0, 1, 2, 4] {
        let at = |row: usize, column: usize| weights.texture.pixels[(k / 4 * 64 + row) * 64 + column][k % 4];
        let mean = 0.25 * (at(31, 31) + at(31, 32) + at(32, 31) + at(32, 32));
        assert!((f64::from(mean) - w[k]).abs() < 0.01, "{k}: {mean} {}", w[k]);
    }
}

#[test]
fn components_are_as_many_as_the_tolerance_takes() {
    let field = with_material(brdf::Material::Microfacet(brdf::Microfacet::new(0.4, [1.0; 3]).unwrap()));
    let count = |parameters: &str| {
        let ran = case("export-shrm", &format!("form = \"components\"\nresolution = 6\n{parameters}"))
            .input("reflection", field.clone())
            .run()
            .unwrap();
        let described = tensors::describe(ran.files()[0]).unwrap();
        (described.tensors[0].2[0], ran.warnings.len())
    };
    let (loose, exact) = (count("accept = [0.4, 0.8]"), count("accept = [0.0001, 0.0001]"));
    assert!(loose.0 < exact.0 && (loose.1, exact.1) == (0, 1), "{loose:?} {exact:?}");
}

#[test]
fn components_need_a_reflection_with_its_material() {
    let cube = shrm::MapGrid::Cube(Cube { edge: 3 });
    let map = Shrm(made_up(true).0.synthesise(cube, View::Local, Stop::NEVER).unwrap());
    let of_map = case("export-shrm", "form = \"components\"").input("reflection", map).failure();
    assert!(of_map.starts_with("components are made from a reflection, not from a map"), "{of_map}");
    let unknown = export("form = \"components\"").failure();
    assert!(unknown.starts_with("the reflection does not hold its material"), "{unknown}");
}
