//! Explicit maps are written, hold the reflection's values, and are read back.

use brdf::{BrdfCoefficients, Centre};
use containers::{ReadOptions, read_image, read_texture};
use engine::Artifact;
use serde_json::Value;
use sh::{Degree, Stop};
use shrm::{MapGrid, MapViews, Terms, View, ViewSet, icosahedron, sphere_map_axes};
use sphere::{Cube, Direction, Face, LatLong, MirrorBall};
use stages::artifacts::{Reflection, Shrm};

use crate::fixture::{Case, case, difference, pixels, sky_lighting};

/// Values are below 3; f32 keeps 6e-8 of them, and sums of 25 coefficients some of those.
const F32: f64 = 1e-6;

/// A half keeps 11 bits, rounded: 2^-12 of values below 4; coefficients are sums of such errors times 3.5 /
/// views.
const HALF: f64 = 2e-3;

/// The reflection of the sky, F = 2, by a made-up BRDF of degree P with terms up to |q| = `azimuth`.
pub(crate) fn reflection(p: usize, azimuth: usize) -> Reflection {
    let f = Degree::new(2).unwrap();
    let rho = (0..=2).flat_map(|l| {
        (0..(p + 1) * (p + 1)).map(move |k| {
            let (p, q) = (k / (p + 1), k % (p + 1));
            let value = 0.5 / (1 + l + 2 * p + q) as f64 * if (l + p) % 3 == 2 { -1.0 } else { 1.0 };
            if q <= l && q <= p && q <= azimuth { [value, 0.8 * value, 0.5 * value] } else { [0.0; 3] }
        })
    });
    let brdf = BrdfCoefficients::new(Centre::Reflection, f, Degree::new(p).unwrap(), rho.collect()).unwrap();
    Reflection(shrm::Reflection::convolve(&sky_lighting().0.series, &brdf))
}

fn export(kind: &'static str, parameters: &str, reflection: Reflection) -> Case {
    case(kind, parameters).input("reflection", reflection)
}

/// A case of the import, with the files of an export beside each other.
pub(crate) fn import(parameters: &str, exported: &Case) -> Case {
    let endings = exported.endings();
    let mut import = case("import-reflection-maps", parameters);
    for (ending, bytes) in endings.iter().zip(exported.files()) {
        import = import.file(&format!("old{ending}"), bytes);
    }
    import.source(&format!("old{}", endings.last().unwrap()))
}

fn view_set(map: &shrm::Shrm, views: MapViews) -> ViewSet {
    ViewSet::from_shrm(map, views, Stop::NEVER).unwrap().unwrap()
}

fn index(case: &Case) -> Value {
    serde_json::from_slice(case.files().last().unwrap()).unwrap()
}

fn vector(value: &Value) -> [f64; 3] {
    serde_json::from_value(value.clone()).unwrap()
}

/// The three weights by the rule in the index, from nothing but the index.
fn blend(index: &Value, view: Direction) -> Vec<(usize, f64)> {
    let vertex =
        |k: &Value| sphere::DVec3::from_array(vector(&index["maps"][k.as_u64().unwrap() as usize]["view"]));
    let v = view.vector();
    for triangle in index["triangles"].as_array().unwrap() {
        let [a, b, c] = [0, 1, 2].map(|k| vertex(&triangle[k]));
        let parts = [v.dot(b.cross(c)), v.dot(c.cross(a)), v.dot(a.cross(b))];
        if parts.iter().all(|part| *part >= -1e-12) {
            let sum: f64 = parts.iter().sum();
            return (0..3).map(|k| (triangle[k].as_u64().unwrap() as usize, parts[k] / sum)).collect();
        }
    }
    panic!("no triangle holds {view:?}")
}

#[test]
fn cabrals_maps_hold_the_light_toward_the_vertices() {
    for (layout, grid) in
        [("cube", MapGrid::Cube(Cube { edge: 5 })), ("lat-long", MapGrid::LatLong(LatLong::with_rows(5)))]
    {
        let parameters = format!("layout = \"{layout}\"\nresolution = 5\nprecision = \"float\"");
        let exported = export("export-cabral", &parameters, reflection(2, 2));
        let endings = exported.endings();
        assert_eq!(
            (endings.len(), endings[0].as_str(), endings[12].as_str()),
            (13, "/view-00.exr", "/cabral.json")
        );
        let (files, index) = (exported.files(), index(&exported));
        assert_eq!(
            containers::read_recipe(files.last().unwrap()).as_deref(),
            Some("{\"kind\":\"export-cabral\"}")
        );
        assert_eq!(containers::read_recipe(&files[3]).as_deref(), Some("{\"kind\":\"export-cabral\"}"));
        for (k, view) in icosahedron::vertices().into_iter().enumerate() {
            let entry = &index["maps"][k];
            assert_eq!(entry["file"], endings[k][1..]);
            assert_eq!(vector(&entry["view"]), view.vector().to_array());
            assert_eq!(vector(&entry["view_file"]), sphere::to_file(view.vector()).to_array());
            let (_, _, found) = pixels(&files[k]);
            let expected: Vec<_> = (0..grid.len())
                .map(|texel| reflection(2, 2).0.evaluate(grid.direction(texel), view))
                .collect();
            assert!(difference(&found, &expected) < F32, "{layout} {k}");
        }
        let view = Direction::from_angles(1.0, -2.0);
        let corners = icosahedron::corners(view);
        for (vertex, weight) in blend(&index, view) {
            let at = corners.vertices.iter().position(|k| *k == vertex).unwrap();
            assert!((corners.weights[at] - weight).abs() < 1e-12);
        }
        assert_eq!(
            (&index["views"], &index["layout"], &index["degree"]),
            (&"global".into(), &layout.into(), &2.into())
        );
        assert!(exported.run().unwrap().warnings.is_empty());
    }
}

/// The position in the picture by the formula of the index.
#[test]
fn a_sphere_map_is_looked_up_as_its_index_says() {
    let exported = export(
        "export-cabral",
        "layout = \"sphere\"\nresolution = 21\nprecision = \"float\"",
        reflection(2, 2),
    );
    let (files, index) = (exported.files(), index(&exported));
    let ball = MirrorBall { edge: 21 };
    for (k, view) in icosahedron::vertices().into_iter().enumerate() {
        let (width, height, found) = pixels(&files[k]);
        assert_eq!((width, height), (21, 21));
        let entry = &index["maps"][k];
        let axes = ["right", "up"].map(|name| sphere::DVec3::from_array(vector(&entry[name])));
        for (axis, expected) in axes.iter().zip(sphere_map_axes(view)) {
            assert!((*axis - expected.vector()).length() < 1e-15);
        }
        for (row, column) in [(10, 10), (3, 8), (12, 19), (17, 5)] {
            let inside = ball.direction(row, column).unwrap().vector();
            let c = view.vector() * inside.x + axes[0] * inside.y + axes[1] * inside.z;
            let s = 1.0 / (2.0 * (1.0 + c.dot(view.vector()))).sqrt();
            let (u, v) = ((1.0 + c.dot(axes[0]) * s) / 2.0, (1.0 - c.dot(axes[1]) * s) / 2.0);
            assert!(
                (u * 21.0 - 0.5 - column as f64).abs() < 1e-9 && (v * 21.0 - 0.5 - row as f64).abs() < 1e-9
            );
            let expected = reflection(2, 2).0.evaluate(Direction::normalised(c), view);
            assert!(difference(&[found[row * 21 + column]], &[expected]) < F32);
        }
    }
}

#[test]
fn every_format_of_cabrals_maps_comes_back() {
    // RGBE keeps 8 bits of the largest channel, cut: 2^-7 of values below 4. It has no negative values, which
    // the field of P = 2 has.
    for (parameters, tolerance) in [
        ("format = \"exr\"\nprecision = \"float\"", F32),
        ("format = \"exr\"", HALF),
        ("format = \"dds\"\nprecision = \"float\"", F32),
        ("format = \"dds\"", HALF),
        ("layout = \"lat-long\"\nformat = \"dds\"\nprecision = \"float\"", F32),
        ("format = \"rgbe\"", 0.02),
    ] {
        for p in if tolerance > HALF { 0..=1 } else { 0..=2 } {
            let parameters = format!("{parameters}\nresolution = 4");
            let exported = export("export-cabral", &parameters, reflection(p, p));
            assert!(exported.run().unwrap().warnings.is_empty());
            let ran = import("", &exported).run().unwrap();
            let found = ran.artifact::<Shrm>();
            assert_eq!((found.0.p().get(), found.0.view(), found.0.terms()), (p, View::Global, Terms::All));
            let expected = reflection(p, p).0.synthesise(found.0.grid(), View::Global, Stop::NEVER).unwrap();
            let error = difference(found.0.values(), expected.values());
            assert!(error < tolerance, "{parameters}: P = {p}: {error:e}");
            assert!(
                ran.notes[0].starts_with(&format!("P = {p} from 12 maps: the residual is ")),
                "{:?}",
                ran.notes
            );
            assert_eq!(ran.reads.len(), 13);
        }
    }
}

#[test]
fn twelve_views_of_a_higher_degree_lose_energy_with_a_warning() {
    let exported = export("export-cabral", "resolution = 4\nprecision = \"float\"", reflection(4, 2));
    let ran = exported.run().unwrap();
    let what = " of the reflected energy changes faster with the view (P = 3 to 4) than twelve views can \
                represent, and is lost";
    let said = ran.warnings.iter().chain(&ran.notes).find(|text| text.contains(what));
    assert!(said.is_some_and(|said| said.ends_with("; export-shrm keeps it")), "{said:?}");
    let ran = import("", &exported).run().unwrap();
    assert_eq!(ran.artifact::<Shrm>().0.p().get(), 2);
    assert_eq!(ran.notes[1], "the maps were made from P = 4; these views determine only P = 2");
    let failure = import("degree = 3", &exported).failure();
    assert_eq!(
        failure,
        "cannot import cabral.json: degree P = 3 has 16 coefficients, more than 12 views determine"
    );
}

/// The middle of a 64-texel ball has 1 / 16 radians a texel: h^2 / 8 of second derivatives up to 9 times 2;
/// the rim spoils a few texels of each of the twelve views.
#[test]
fn sphere_maps_come_back_blurred_and_say_so() {
    let exported = export("export-cabral", "layout = \"sphere\"\nresolution = 64", reflection(2, 2));
    let ran = import("resolution = 8", &exported).run().unwrap();
    let found = ran.artifact::<Shrm>();
    let grid = MapGrid::Cube(Cube { edge: 8 });
    assert_eq!((found.0.grid(), found.0.p().get()), (grid, 2));
    let expected = reflection(2, 2).0.synthesise(grid, View::Global, Stop::NEVER).unwrap();
    let error = difference(found.0.values(), expected.values());
    assert!(error < 0.1, "{error}");
    let ran = import("", &exported).run().unwrap();
    assert_eq!(ran.artifact::<Shrm>().0.grid(), MapGrid::Cube(Cube { edge: 32 }));
}

#[test]
fn a_3d_texture_holds_the_slices_and_comes_back() {
    let grid = MapGrid::LatLong(LatLong::with_rows(4));
    let map = reflection(3, 0).0.synthesise(grid, View::Local, Stop::NEVER).unwrap();
    let expected = view_set(&map, MapViews::even_angles(5));
    for (format, tolerance) in [("dds", F32), ("ktx2", F32), ("exr", F32), ("dds", HALF)] {
        let precision = if tolerance == F32 { "float" } else { "half" };
        let parameters =
            format!("format = \"{format}\"\nprecision = \"{precision}\"\nresolution = 4\nslices = 5");
        let exported = export("export-kautz-mccool", &parameters, reflection(3, 0));
        assert!(exported.run().unwrap().warnings.is_empty());
        let files = exported.files();
        let found: Vec<[f32; 3]> = if format == "exr" {
            assert_eq!(files.len(), 6);
            files[..5].iter().flat_map(|file| pixels(file).2).collect()
        } else {
            let texture = read_texture(&files[0]).unwrap().texture;
            assert_eq!((texture.width, texture.height, texture.depth), (8, 4, 5));
            texture.pixels
        };
        assert!(difference(&found, expected.maps()) < tolerance);
        let index = index(&exported);
        for (k, angle) in expected.views().angles().iter().enumerate() {
            assert_eq!(index["maps"][k]["theta_o"].as_f64(), Some(*angle));
            assert_eq!(index["maps"][k]["slice"].as_u64(), (format != "exr").then_some(k as u64));
        }
        let back = import("", &exported).artifact::<Shrm>();
        assert_eq!((back.0.view(), back.0.terms(), back.0.p().get()), (View::Local, Terms::Zonal, 3));
        assert!(difference(back.0.values(), map.values()) < tolerance, "{format}");
    }
}

#[test]
fn a_3d_texture_of_a_material_with_azimuth_warns() {
    let ran = export("export-kautz-mccool", "resolution = 4\nslices = 2", reflection(2, 2)).run().unwrap();
    assert!(
        ran.notes.iter().any(|note| note == "2 slices hold P = 1; the field has P = 2"),
        "{:?}",
        ran.notes
    );
    // Less than a percent is a note.
    let lost = ran.notes.iter().chain(&ran.warnings).filter(|text| text.contains("(q > 0)"));
    let [lost] = lost.collect::<Vec<_>>()[..] else { panic!("{:?} {:?}", ran.notes, ran.warnings) };
    assert!(
        lost.contains(" % of the reflected energy changes around the central direction (q > 0)"),
        "{lost}"
    );
}

#[test]
fn view_maps_hold_every_view_and_come_back() {
    for view in ["global", "local"] {
        for (format, layout) in [("ktx2", "cube"), ("dds", "lat-long"), ("exr", "cube"), ("dds", "cube")] {
            let parameters = format!(
                "views = 5\nview = \"{view}\"\nformat = \"{format}\"\nlayout = \"{layout}\"\nprecision = \"float\"\nresolution = 3"
            );
            let exported = export("export-view-maps", &parameters, reflection(2, 2));
            let ran = exported.run().unwrap();
            assert!(ran.warnings.is_empty() && ran.notes.iter().all(|note| !note.contains("views hold")));
            let grid = match layout {
                "cube" => MapGrid::Cube(Cube { edge: 3 }),
                _ => MapGrid::LatLong(LatLong::with_rows(3)),
            };
            let view = if view == "global" { View::Global } else { View::Local };
            let map = reflection(2, 2).0.synthesise(grid, view, Stop::NEVER).unwrap();
            let expected = view_set(&map, MapViews::Table { side: 5, view });
            let files = exported.files();
            let found: Vec<[f32; 3]> = match format {
                "exr" => files[..25].iter().flat_map(|file| pixels(file).2).collect(),
                _ => read_texture(&files[0]).unwrap().texture.pixels,
            };
            assert!(difference(&found, expected.maps()) < F32);
            for (k, direction) in expected.views().directions().into_iter().enumerate() {
                let entry = &index(&exported)["maps"][k];
                assert_eq!(entry["layer"].as_u64(), (format != "exr").then_some(k as u64));
                assert_eq!(vector(&entry["view"]), direction.vector().to_array());
                assert_eq!(entry.get("view_file").is_some(), view == View::Global);
            }
            let back = import("", &exported).artifact::<Shrm>();
            assert_eq!((back.0.view(), back.0.p().get()), (view, 2));
            assert!(difference(back.0.values(), map.values()) < F32, "{format} {layout}");
        }
    }
    let few = export("export-view-maps", "views = 4\nresolution = 3", reflection(2, 2)).run().unwrap();
    let message = "4 x 4 views hold P = 1; the field has P = 2, for which views = 5 is enough";
    assert!(few.notes.iter().any(|note| note == message), "{:?}", few.notes);
}

/// A map that arrives is taken as it is on its own texels, and interpolated on others.
#[test]
fn maps_are_made_from_a_map_too() {
    let grid = MapGrid::Cube(Cube { edge: 6 });
    let map = || Shrm(reflection(2, 2).0.synthesise(grid, View::Global, Stop::NEVER).unwrap());
    let from_map = |kind, parameters: &str| case(kind, parameters).input("reflection", map());
    let own = from_map("export-cabral", "precision = \"float\"").run().unwrap();
    assert!(own.notes.is_empty(), "{:?}", own.notes);
    let (_, _, found) = pixels(&from_map("export-cabral", "precision = \"float\"").files()[2]);
    let expected = map().0.view_map(icosahedron::vertices()[2]);
    assert!(difference(&found, &expected) < F32);
    // The interpolated map is off by less than h^2 / 8 x 9 x 3 with h = 1 / 3.
    let other = from_map("export-kautz-mccool", "format = \"exr\"\nprecision = \"float\"");
    let notes = other.run().unwrap().notes;
    assert_eq!(notes[0], "the map was interpolated from a cube of edge 6 to lat-long 24 x 12");
    let exact = reflection(2, 2)
        .0
        .synthesise(MapGrid::LatLong(LatLong::with_rows(12)), View::Local, Stop::NEVER)
        .unwrap();
    let exact = view_set(&exact, MapViews::even_angles(16));
    assert!(difference(&pixels(&other.files()[3]).2, exact.map(3)) < 0.3);
    let local = from_map("export-view-maps", "view = \"local\"\nviews = 5\nprecision = \"float\"");
    let exact = reflection(2, 2).0.synthesise(grid, View::Local, Stop::NEVER).unwrap();
    let back = import("", &local).artifact::<Shrm>();
    assert!(difference(back.0.values(), exact.values()) < F32);
    let ball = from_map("export-cabral", "layout = \"sphere\"\nprecision = \"float\"").files();
    assert_eq!(pixels(&ball[0]).0, 16);
}

/// The exports of an imported map equal the files that were imported.
#[test]
fn an_imported_map_is_exported_again() {
    let exported = export("export-cabral", "resolution = 4\nprecision = \"float\"", reflection(2, 2));
    let back = import("", &exported).artifact::<Shrm>();
    let again = case("export-cabral", "precision = \"float\"").input("reflection", (*back).clone());
    for (old, new) in exported.files()[..12].iter().zip(again.files()) {
        assert!(difference(&pixels(old).2, &pixels(&new).2) < F32);
    }
}

#[test]
fn bad_maps_are_reported_by_file() {
    let exported =
        export("export-view-maps", "views = 3\nformat = \"exr\"\nresolution = 2", reflection(1, 1));
    let files = exported.files();
    let check = |name: &str, bytes: Option<Vec<u8>>, expected: &str| {
        let mut import = case("import-reflection-maps", "");
        let endings = exported.endings();
        for (ending, file) in endings.iter().zip(&files) {
            if ending == name {
                if let Some(bytes) = &bytes {
                    import = import.file(&format!("old{ending}"), bytes.clone());
                }
            } else {
                import = import.file(&format!("old{ending}"), file.clone());
            }
        }
        let failure = import.source("old/view-maps.json").failure();
        assert!(failure.contains(expected), "{failure}");
        assert!(failure.starts_with("cannot import view-maps.json: "), "{failure}");
    };
    let picture = |width: usize, height: usize, value: f32| {
        let mut values = vec![[0.5; 3]; width * height];
        values[7][1] = value;
        crate::fixture::exr(width, height, values)
    };
    check("/view-004.exr", None, "view-004.exr: cannot read ");
    check("/view-004.exr", Some(files[4][..files[4].len() / 2].to_vec()), "view-004.exr: OpenEXR: ");
    check("/view-004.exr", Some(b"no picture".to_vec()), "view-004.exr: ");
    check(
        "/view-004.exr",
        Some(picture(3, 18, 0.5)),
        "view-004.exr: 3 x 3 texels, but view-000.exr has 2 x 2; all maps of an index must have the same size",
    );
    check(
        "/view-004.exr",
        Some(picture(4, 2, 0.5)),
        "view-004.exr: a cube has six square faces, stacked in a picture that is six times as high as wide; \
         this file is 4 x 2",
    );
    check(
        "/view-004.exr",
        Some(picture(2, 12, f32::NAN)),
        "view-004.exr: NaN at column 1, row 3 (rows of faces below each other)",
    );
    let text = String::from_utf8(files[9].clone()).unwrap();
    let edit = |from: &str, to: &str| Some(text.replacen(from, to, 1).into_bytes());
    check(
        "/view-maps.json",
        edit("\"global\"", "\"angles\""),
        "the map in view-000.exr: with `views` \"angles\" expected a `theta_o` and no view",
    );
    check(
        "/view-maps.json",
        edit("{\"file\":\"view-002.exr\"", "{\"slice\":1,\"file\":\"view-002.exr\""),
        "view-002.exr: `slice` is given, but the file has no slices",
    );
    check(
        "/view-maps.json",
        edit("\"view\":[", "\"theta_o\":0.5,\"view_file\":[["),
        "not an index of reflection maps",
    );
    check("/view-maps.json", edit("view-001.exr", "../new/view-001.exr"), "view-001.exr: cannot read ");
    check("/view-maps.json", Some(b"{}".to_vec()), "missing field `format`");
    // Nine views, eight of them equal, determine one coefficient.
    let mut value: Value = serde_json::from_slice(&files[9]).unwrap();
    for k in 1..9 {
        value["maps"][k]["view"] = value["maps"][0]["view"].clone();
        value["maps"][k].as_object_mut().unwrap().remove("view_file");
    }
    let same = serde_json::to_vec(&value).unwrap();
    let one = case("import-reflection-maps", "degree = 1").file("old/i.json", same);
    let one = (0..9).fold(one, |case, k| case.file(&format!("old/view-00{k}.exr"), files[k].clone()));
    let failure = one.source("old/i.json").failure();
    assert!(
        failure.contains("the 9 views do not determine degree P = 1: errors would grow inf times"),
        "{failure}"
    );
}

#[test]
fn parts_of_textures_are_checked() {
    let exported = export("export-view-maps", "views = 2\nresolution = 2", reflection(0, 0));
    let files = exported.files();
    let text = String::from_utf8(files[1].clone()).unwrap();
    for (from, to, expected) in [
        ("\"layer\":3", "\"layer\":4", "maps.ktx2: `layer` is 4; the file has 4, counted from 0"),
        ("\"layer\":3,", "", "maps.ktx2: `layer` is missing; the file has 4"),
        (
            "\"cube\"",
            "\"lat-long\"",
            "maps.ktx2: a lat-long map is twice as wide as high; this file is 2 x 12",
        ),
    ] {
        assert!(text.contains(from), "{text}");
        let import = case("import-reflection-maps", "")
            .file("old/maps.ktx2", files[0].clone())
            .file("old/view-maps.json", text.replace(from, to));
        let failure = import.source("old/view-maps.json").failure();
        assert_eq!(failure, format!("cannot import view-maps.json: {expected}"));
    }
}

#[test]
fn values_past_the_largest_half_are_reported() {
    let mut bright = reflection(2, 2);
    let lighting = sh::Expansion::from_coefficients(
        bright.0.lighting().degree(),
        bright.0.lighting().coefficients().iter().map(|row| row.map(|value| 1e6 * value)).collect(),
    );
    bright = Reflection(shrm::Reflection::convolve(&lighting.unwrap(), bright.0.brdf()));
    for (kind, parameters) in [
        ("export-cabral", "resolution = 3"),
        ("export-cabral", "resolution = 3\nformat = \"dds\""),
        ("export-kautz-mccool", "resolution = 3"),
        ("export-view-maps", "resolution = 3\nviews = 2"),
    ] {
        let of = |more: &str| {
            case(kind, &format!("{parameters}{more}")).input("reflection", bright.clone()).run().unwrap()
        };
        let notes = of("").notes;
        assert!(notes.iter().any(|note| note.starts_with("written in 32-bit floats")), "{kind}: {notes:?}");
        let warnings = of("\nprecision = \"half\"").warnings;
        assert!(warnings.iter().any(|warning| warning.contains("light is lost")), "{kind}: {warnings:?}");
        let refused = format!("{parameters}\noverflow = \"error\"");
        let failure = case(kind, &refused).input("reflection", bright.clone()).failure();
        assert!(failure.contains("exceed 65504"), "{failure}");
    }
}

#[test]
fn negative_values_that_rgbe_cannot_hold_are_reported() {
    let mut lighting = sky_lighting().0.series;
    lighting.coefficients_mut().iter_mut().for_each(|row| *row = row.map(|value| -value));
    let dark = Reflection(shrm::Reflection::convolve(&lighting, reflection(2, 2).0.brdf()));
    let ran =
        case("export-cabral", "resolution = 2\nformat = \"rgbe\"").input("reflection", dark).run().unwrap();
    assert!(
        ran.warnings[0].contains("values are negative and turn black, because RGBE has no sign"),
        "{:?}",
        ran.warnings
    );
}

#[test]
fn parameters_without_effect_or_out_of_range_are_errors() {
    for (kind, parameters, expected) in [
        (
            "export-cabral",
            "format = \"rgbe\"\nprecision = \"float\"",
            "precision: only format = \"exr\" or \"dds\" uses it",
        ),
        (
            "export-cabral",
            "precision = \"float\"\noverflow = \"error\"",
            "overflow: only files of half floats use it",
        ),
        ("export-kautz-mccool", "slices = 1", "slices: 1 is not a whole number from 2 to 256"),
        ("export-view-maps", "views = 65", "views: 65 is not a whole number from 1 to 64"),
        ("import-reflection-maps", "degree = 65", "degree: 65 is not a whole number from 0 to 64"),
        ("import-reflection-maps", "resolution = 0", "resolution: 0 is not a whole number from 1 to 4096"),
    ] {
        assert_eq!(case(kind, parameters).errors(), [expected]);
    }
}

/// A table of 100 GB is refused before memory is asked for.
#[test]
fn more_maps_than_a_file_holds_are_refused() {
    for (kind, parameters, expected) in [
        (
            "export-view-maps",
            "views = 64\nresolution = 512\nlayout = \"lat-long\"",
            "4096 maps of 524288 texels have more than 134217728 texels together",
        ),
        (
            "export-kautz-mccool",
            "slices = 256\nresolution = 1024",
            "256 maps of 2097152 texels have more than 134217728 texels together",
        ),
        (
            "export-cabral",
            "resolution = 1400",
            "12 maps of 11760000 texels have more than 134217728 texels together",
        ),
        (
            "export-cabral",
            "layout = \"sphere\"\nresolution = 4096",
            "12 maps of 16777216 texels have more than 134217728 texels together",
        ),
    ] {
        assert_eq!(export(kind, parameters, reflection(0, 0)).failure(), expected);
    }
}

/// A line of a hand-written index that was copied and not changed.
#[test]
fn a_map_or_a_view_that_is_named_twice_is_reported() {
    let exported =
        export("export-view-maps", "views = 3\nformat = \"exr\"\nresolution = 2", reflection(1, 1));
    assert!(import("", &exported).run().unwrap().warnings.is_empty());
    let files = exported.files();
    let check = |member: &str, expected: &str| {
        let mut value: Value = serde_json::from_slice(&files[9]).unwrap();
        value["maps"][4][member] = value["maps"][2][member].clone();
        if member == "view" {
            value["maps"][4].as_object_mut().unwrap().remove("view_file");
        }
        let case = case("import-reflection-maps", "").file("old/i.json", serde_json::to_vec(&value).unwrap());
        let case = (0..9).fold(case, |case, k| case.file(&format!("old/view-00{k}.exr"), files[k].clone()));
        assert_eq!(case.source("old/i.json").run().unwrap().warnings, [expected]);
    };
    check("file", "entries 3 and 5 of `maps` name the same map, view-002.exr");
    check("view", "entries 3 and 5 of `maps`, in view-002.exr and view-004.exr, have the same view");
}

/// Faces of a cube in one picture have the orientation of those of `export-reflection-map`.
#[test]
fn the_faces_of_a_picture_lie_in_file_order() {
    let exported = export("export-cabral", "resolution = 3\nprecision = \"float\"", reflection(1, 1));
    let image = read_image(&exported.files()[0], &ReadOptions::default()).unwrap().image;
    assert_eq!((image.width(), image.height()), (3, 18));
    let cube = Cube { edge: 3 };
    for (k, face) in Face::ALL.into_iter().enumerate() {
        let expected = reflection(1, 1).0.evaluate(cube.direction(face, 2, 1), Direction::Z);
        assert!(difference(&[image.pixels()[(3 * k + 2) * 3 + 1]], &[expected]) < F32);
    }
    assert_eq!(Shrm::TYPE, "shrm");
}
