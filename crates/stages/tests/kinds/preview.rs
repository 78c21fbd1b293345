//! Previews: pictures of every mode, turntables, and the messages about what cannot be drawn.

use std::io::Cursor;

use brdf::Choice;
use sh::{Degree, Stop};
use sphere::{DVec3, Rotation};
use stages::artifacts::{
    BrdfTable, Environment, LightField, Lighting, Material, Mesh, Reflection, ScaleSpace, Shrm, Taps,
    Transfer, VertexBlend,
};

use crate::fixture::{Case, case, environment, sky, sky_lighting};
use crate::report::microfacet;

const MODES: [&str; 8] = [
    "local-shrm",
    "global-shrm",
    "cabral",
    "kautz-mccool",
    "prefiltered",
    "irradiance",
    "mirror",
    "brute-force",
];

/// The sky reflected by a rough surface, of degrees F = 2, which hold all of the sky, and P = 2.
fn rough() -> Reflection {
    rough_under(&sky_lighting())
}

fn rough_under(lighting: &Lighting) -> Reflection {
    let (f, p) = (Degree::new(2).unwrap(), Degree::new(2).unwrap());
    let brdf = brdf::project(&microfacet(0.5), Choice::Degree { f, p }, Stop::NEVER).unwrap();
    Reflection(shrm::Reflection::convolve(&lighting.0.series, &brdf.coefficients))
}

/// A preview of a rough knot under the sky.
pub(crate) fn knot(parameters: &str) -> Case {
    sphere(&format!("mesh = \"torus-knot\"\n{parameters}"))
}

fn sphere(parameters: &str) -> Case {
    let small = "resolution = 8\nsamples = 1\nlight-samples = 8\nslices = 8";
    bare(&format!("{small}\n{parameters}")).input("material", Material(microfacet(0.5)))
}

fn bare(parameters: &str) -> Case {
    case("preview", parameters).input("reflection", rough()).input("environment", environment(32, sky))
}

/// Width, height and the codes of every frame.
pub(crate) fn frames(bytes: &[u8]) -> ([usize; 2], Vec<Vec<[u8; 3]>>) {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let size = [reader.info().width as usize, reader.info().height as usize];
    let count = reader.info().animation_control().map_or(1, |control| control.num_frames);
    let mut frames = Vec::new();
    for _ in 0..count {
        let mut codes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut codes).unwrap();
        frames.push(codes.as_chunks().0.to_vec());
    }
    (size, frames)
}

fn picture(case: &Case) -> ([usize; 2], Vec<[u8; 3]>) {
    let files = case.files();
    assert_eq!(files.len(), 1);
    assert!(containers::read_recipe(&files[0]).unwrap().contains("preview"));
    let (size, mut frames) = frames(&files[0]);
    assert_eq!(frames.len(), 1);
    (size, frames.remove(0))
}

/// The root of the mean squared difference of codes.
fn apart(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    let squares = a.as_flattened().iter().zip(b.as_flattened());
    let sum: f64 = squares.map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2)).sum();
    (sum / (3 * a.len()) as f64).sqrt()
}

/// The manifest of DESIGN.md: two ports and no parameter.
#[test]
fn with_its_defaults_it_draws_a_sphere() {
    let ran = bare("").run().unwrap();
    assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
    assert_eq!(ran.notes, ["exposure −2.4 stops from the log-average"]);
    let (size, frames) = frames(ran.files()[0]);
    assert_eq!((size, frames.len()), ([512, 512], 1));
}

/// Every mode's picture of this sky differs clearly from the others, and from the background alone.
#[test]
fn every_mode_draws_a_picture_of_its_own() {
    let whole = |mode: &str| picture(&sphere(&format!("modes = [\"{mode}\"]\nsize = [40, 30]")));
    let pictures = MODES.map(whole);
    let rough = ["local-shrm", "global-shrm", "cabral", "kautz-mccool", "prefiltered", "brute-force"];
    let truth = &pictures[7].1;
    for ((size, codes), mode) in pictures.iter().zip(MODES) {
        assert_eq!((size, codes.len()), (&[40, 30], 1200), "{mode}");
        let error = apart(codes, truth);
        eprintln!("{mode}: {error:.2} codes from brute force");
        if mode != "brute-force" && rough.contains(&mode) {
            // Of one material: close to each other, and not the same.
            assert!(error > 0.0 && error < 12.0, "{mode}: {error}");
        }
    }
    let matte = apart(&pictures[5].1, truth);
    assert!(matte > 10.0, "{matte}");
}

/// Three balls in one picture, of the coefficients or of the material; turned, they are others.
#[test]
fn samples_are_a_diagram_of_light_and_material() {
    let small = "modes = [\"samples\"]\nsize = [96, 40]";
    let still = picture(&sphere(small));
    assert_eq!(still.0, [96, 40]);
    assert!(apart(&still.1, &picture(&sphere(&format!("{small}\nlight-yaw = 90"))).1) > 1.0);
    let bare_light =
        || case("preview", &format!("{small}\nsamples = 1")).input("environment", environment(16, sky));
    let of_material = picture(&bare_light().input("material", Material(microfacet(0.5))));
    assert!(apart(&still.1, &of_material.1) > 0.0);
    let message = "samples needs a material, but the port material is not connected";
    assert_eq!(bare_light().failure(), message);
}

#[test]
fn outputs_do_not_depend_on_the_number_of_threads() {
    let modes = MODES.map(|mode| format!("\"{mode}\"")).join(", ");
    let parameters = "compare = \"brute-force\"\nsize = 32\nresolution = 8\nlight-samples = 4";
    let case = bare(&format!("modes = [{modes}]\n{parameters}")).input("material", Material(microfacet(0.5)));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| case.files())
    };
    assert!(with(1) == with(4));
}

#[test]
fn comparisons_are_below_with_their_numbers() {
    let case = sphere("modes = [\"prefiltered\", \"local-shrm\"]\ncompare = \"brute-force\"\nsize = 64");
    let ran = case.run().unwrap();
    let (size, _) = frames(ran.files()[0]);
    // Three pictures side by side, in two rows.
    assert!(size[0] > 3 * 64 && size[0] < 4 * 64 && size[1] > 2 * 64 && size[1] < 4 * 64, "{size:?}");
    let figure = |mode: &str| {
        let note = ran.notes.iter().find(|note| note.starts_with(mode)).unwrap();
        let error = note.strip_prefix(&format!("{mode}: 95 % within ")).unwrap();
        assert!(error.contains(" stops, 99 % within ") && error.contains("; RMS "), "{note}");
        error.split(' ').next().unwrap().parse::<f64>().unwrap()
    };
    eprintln!("{:?}", ran.notes);
    // P = 2 holds more of the view than its mean does.
    assert!(figure("local SHRM") < figure("prefiltered") && figure("prefiltered") < 2.0);
    assert_eq!(ran.notes.len(), 3);
}

#[test]
fn turntables_have_their_frames() {
    let animated = sphere("frames = 5\nsize = 24\nseconds = 2.5").files();
    let (size, turning) = frames(&animated[0]);
    assert_eq!((size, turning.len()), ([24, 24], 5));
    let reader = png::Decoder::new(Cursor::new(&animated[0])).read_info().unwrap();
    let frame = reader.info().frame_control().unwrap();
    assert_eq!((frame.delay_num, frame.delay_den), (500, 1000));
    for later in &turning[1..] {
        assert!(apart(&turning[0], later) > 1.0);
    }

    let (size, strip) = picture(&sphere("frames = 5\nsize = 24\nformat = \"strip\""));
    assert_eq!(size, [5 * 24, 24]);
    for (at, frame) in turning.iter().enumerate() {
        let own: Vec<_> = strip.chunks(120).flat_map(|row| row[24 * at..][..24].to_vec()).collect();
        assert!(own == *frame, "frame {at}");
    }
    // Each frame equals a still with that camera.
    let (_, still) = picture(&sphere("camera-yaw = 144\nsize = 24"));
    assert!(still == turning[2]);

    let (_, turned) = frames(&sphere("frames = 4\nsize = 24\nturn = \"light\"").files()[0]);
    let (_, still) = picture(&sphere("light-yaw = 90\nsize = 24"));
    assert!(still == turned[1]);
}

/// A turned light is the same as an environment and a lighting that were turned before; if only one of the
/// two was turned, a warning says so.
#[test]
fn light_is_turned_as_rotate_turns_it() {
    let turn = Rotation::from_yaw_pitch_roll(90.0_f64.to_radians(), 0.0, 0.0);
    let case = |reflection: Reflection, parameters: &str| {
        let turned = |w: DVec3| sky(turn.inverse().apply(sphere::Direction::normalised(w)).vector());
        case("preview", &format!("size = 32\nresolution = 16\n{parameters}"))
            .input("reflection", reflection)
            .input("environment", environment(32, turned))
    };
    let rotated = crate::fixture::case("rotate", "yaw = 90").input("lighting", sky_lighting());
    let before = case(rough_under(&rotated.artifact::<Lighting>()), "").run().unwrap();
    assert!(before.warnings.is_empty(), "{:?}", before.warnings);
    let (_, after) = picture(&bare("size = 32\nresolution = 16\nlight-yaw = 90"));
    // A quarter turn is whole texels of an environment of 64 columns.
    assert!(apart(&frames(before.files()[0]).1[0], &after) < 0.5);

    let mixed = case(rough(), "").run().unwrap();
    assert_eq!(
        mixed.warnings,
        ["the reflection was not made from this environment: connect the one that was projected, turned in \
          the same way as the lighting"]
    );
}

#[test]
fn a_map_or_a_mesh_may_be_connected() {
    let reflection = rough();
    let grid = shrm::MapGrid::Cube(sphere::Cube { edge: 8 });
    let map = Shrm(reflection.0.synthesise(grid, shrm::View::Local, Stop::NEVER).unwrap());
    let of_map = case("preview", "size = 32\nresolution = 8")
        .input("reflection", map)
        .input("environment", environment(32, sky));
    let of_reflection = bare("size = 32\nresolution = 8");
    assert!(picture(&of_map).1 == picture(&of_reflection).1);

    let knot = Mesh(mesh::shape("torus-knot").unwrap());
    let connected = bare("size = 32").input("mesh", knot);
    assert!(picture(&connected).1 == picture(&bare("mesh = \"torus-knot\"\nsize = 32")).1);

    let empty = bare("size = 16").input("mesh", Mesh(mesh::Mesh::joined(&[]).unwrap()));
    assert_eq!(empty.run().unwrap().warnings, ["the mesh has no triangles: only the background is seen"]);
}

#[test]
fn the_background_is_the_one_that_was_asked_for() {
    let corner = |parameters: &str| picture(&bare(&format!("size = 16\nsamples = 1\n{parameters}"))).1[0];
    assert_eq!(corner("background = 0\nexposure = 3"), [0; 3]);
    assert_eq!(corner("background = [0, 1, 0]\ncurve = \"plain\"\nexposure = -3"), [0, 255, 0]);
    // The sky is of degree 2: its harmonics hold it.
    let (sky, harmonics) = (corner(""), corner("background = \"harmonics\""));
    assert!((0..3).all(|c| sky[c].abs_diff(harmonics[c]) <= 2), "{sky:?} {harmonics:?}");
}

#[test]
fn brute_force_needs_the_material() {
    for parameters in ["modes = [\"brute-force\"]", "compare = \"brute-force\""] {
        let message = "brute-force needs a material, but the port material is not connected";
        assert_eq!(bare(parameters).failure(), message);
    }
}

/// The table and the transfer of a mesh, drawn by a viewer whose light has degree 2, as the table.
#[test]
fn tables_and_transfer_are_drawn_with_their_inputs() {
    let small = "size = 32\nsamples = 1\nlight-samples = 256";
    let brushed = brdf::Material::Ward(brdf::Ward::new([0.3, 0.6], [1.0, 0.8, 0.5]).unwrap());
    let table = case("tabulate-brdf", "degree = 2\nresolution = 16");
    let table = (*table.input("material", Material(brushed.clone())).artifact::<BrdfTable>()).clone();
    let knot = || Mesh(mesh::shape("torus-knot").unwrap());
    let transfer = case("precompute-transfer", "degree = 2\ndirections = 64").input("mesh", knot());
    let transfer = (*transfer.artifact::<Transfer>()).clone();
    let with = |parameters: &str| {
        case("preview", &format!("{small}\n{parameters}"))
            .input("environment", environment(32, sky))
            .input("material", Material(brushed.clone()))
            .input("table", table.clone())
    };
    let whole = |parameters: &str| with(parameters).input("mesh", knot()).input("transfer", transfer.clone());
    let ran = whole("modes = [\"table\", \"transfer\"]\ncompare = \"shadowed-brute-force\"").run().unwrap();
    let rms = |mode: &str| {
        let note = ran.notes.iter().find_map(|note| note.strip_prefix(&format!("{mode}: 95 % within ")));
        note.unwrap().split_once("; RMS ").unwrap().1.trim_end_matches(" %").parse::<f64>().unwrap()
    };
    assert!(rms("transfer") < 0.5 * rms("BRDF table"), "{:?}", ran.notes);
    let missing = |case: Case, message: &str| assert_eq!(case.failure(), message);
    missing(
        with("modes = [\"transfer\"]"),
        "transfer needs a transfer, but the port transfer is not connected",
    );
    missing(with(""), "local-shrm needs a reflection, but the port reflection is not connected");
    missing(bare("modes = [\"table\"]"), "table needs a table, but the port table is not connected");
    let other = with("modes = [\"transfer\"]").input("transfer", transfer.clone());
    missing(other, "the transfer belongs to another mesh");
}

/// A scale space of the sky with a lamp beside it, and the taps of gold: near brute force. Another light is
/// noticed.
#[test]
fn taps_are_drawn_with_their_inputs() {
    let gold = || microfacet(0.4);
    let lit = |w: DVec3| sky(w).map(|value| value + if w.x > 0.995 { 200.0 } else { 0.0 });
    let widths = taps::Widths::new(16).unwrap();
    let scales = |environment: Environment| {
        let lights = environment.0.separate_lamps(Stop::NEVER).unwrap().lights;
        assert!(!lights.is_empty());
        let space = taps::ScaleSpace::new(&environment.0, &lights, widths, Stop::NEVER).unwrap();
        let points = taps::LightPoints::new(&environment.0).unwrap();
        ScaleSpace(containers::tensors::EnvironmentScales { space, points })
    };
    let fitted = taps::fit(&gold(), 3, widths, Stop::NEVER).unwrap();
    let taps = || {
        Taps(containers::tensors::MaterialTaps {
            material: gold(),
            fitted: fitted.clone(),
            others: Vec::new(),
            varied: None,
            facets: Vec::new(),
        })
    };
    let with = |parameters: &str| {
        case("preview", &format!("size = 32\nsamples = 1\nlight-samples = 512\n{parameters}"))
            .input("environment", environment(64, lit))
            .input("material", Material(gold()))
    };
    let compared = "modes = [\"taps\"]\ncompare = \"brute-force\"";
    let scales_of_it = || scales(environment(64, lit));
    let ran = with(compared).input("scale-space", scales_of_it()).input("taps", taps()).run().unwrap();
    assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
    let note = ran.notes.iter().find_map(|note| note.strip_prefix("taps: 95 % within ")).unwrap();
    let p95 = note.split_once(" stops").unwrap().0.parse::<f64>().unwrap();
    assert!(p95 < 0.4, "{note}");
    let alone = with("modes = [\"taps\"]");
    assert_eq!(alone.failure(), "taps needs a scale-space, but the port scale-space is not connected");
    let alone = with("modes = [\"taps\"]").input("scale-space", scales_of_it());
    assert_eq!(alone.failure(), "taps needs the taps of a material, but the port taps is not connected");
    let turned = environment(64, |w| lit(DVec3::new(w.z, w.y, -w.x)));
    let ran = with("modes = [\"taps\"]").input("scale-space", scales(turned)).input("taps", taps());
    let warning = "the scale space was not made from this environment: connect the input of `scale-space`";
    assert_eq!(ran.run().unwrap().warnings, [warning]);
}

/// Taps that know the tangent show the streak of brushed metal, those of its mean over all turns do not.
#[test]
fn brushed_metal_shows_its_streak_by_taps() {
    let brushed = || Material(brdf::Material::Ward(brdf::Ward::new([0.2, 0.5], [0.6, 0.5, 0.3]).unwrap()));
    let window = |w: DVec3| [if w.y.abs() < 0.2 && w.x > 0.8 { 30.0 } else { 0.2 + 0.1 * w.z }; 3];
    let light = || environment(64, window);
    let scales =
        case("scale-space", "resolution = 32").input("environment", light()).artifact::<ScaleSpace>();
    let fitted = case("fit-taps", "taps = 4").input("material", brushed()).artifact::<Taps>();
    let mut mean = fitted.0.clone();
    mean.facets.clear();
    let error = |taps: Taps| {
        let parameters =
            "size = 32\nsamples = 1\nlight-samples = 512\nmodes = [\"taps\"]\ncompare = \"brute-force\"";
        let drawn = case("preview", parameters)
            .input("environment", light())
            .input("material", brushed())
            .input("scale-space", (*scales).clone())
            .input("taps", taps);
        let notes = drawn.run().unwrap().notes;
        let note = notes.iter().find_map(|note| note.strip_prefix("taps: 95 % within ")).unwrap();
        note.split_once(" stops").unwrap().0.parse::<f64>().unwrap()
    };
    let (with, without) = (error((*fitted).clone()), error(Taps(mean)));
    assert!(with < 0.4 && without > 2.0 * with, "{with} {without}");
}

/// At each point of a field, and far from all, the light is known: a single point draws what the distant
/// light does, and two points of the same light as well.
#[test]
fn a_light_field_lights_a_table() {
    let table = case("tabulate-brdf", "degree = 2\nresolution = 16");
    let table = (*table.input("material", Material(microfacet(0.5))).artifact::<BrdfTable>()).clone();
    let series = sky_lighting().0.whole();
    let drawn = |points: Vec<[f64; 3]>, dim: f64, modes: &str| {
        let dimmed = |k: usize| {
            let rows = series.coefficients().iter().map(|rgb| rgb.map(|value| value * dim.powi(k as i32)));
            sh::Expansion::from_coefficients(series.degree(), rows.collect()).unwrap()
        };
        let lights = (0..points.len()).map(dimmed).collect();
        let field = LightField(transfer::LightField::new(points, lights).unwrap());
        let drawn = bare(&format!("size = 32\nsamples = 1\nmodes = [{modes}]"));
        drawn.input("table", table.clone()).input("light-field", field).run().unwrap()
    };
    let codes = |ran: &crate::fixture::Ran| frames(ran.files()[0]).1[0].clone();
    let distant = bare("size = 32\nsamples = 1\nmodes = [\"table\"]").input("table", table.clone());
    let distant = codes(&distant.run().unwrap());
    let far = |other: &[[u8; 3]]| {
        let pairs = distant.iter().zip(other);
        pairs.filter(|(one, other)| (0..3).any(|k| one[k].abs_diff(other[k]) > 1)).count()
    };
    let [front, back] = [[1.5, 0.0, 0.0], [-1.5, 0.0, 0.0]];
    assert_eq!(far(&codes(&drawn(vec![front], 1.0, "\"table\""))), 0);
    assert_eq!(far(&codes(&drawn(vec![front, back], 1.0, "\"table\""))), 0);
    assert!(far(&codes(&drawn(vec![back, front], 0.2, "\"table\""))) > 200);
    let unused = drawn(vec![front], 1.0, "\"local-shrm\"");
    assert!(unused.warnings.iter().any(|warning| warning.contains("no mode shows the light-field")));
}

/// The picture of a table of two materials is that of one of them where the blend says so.
#[test]
fn a_blend_says_which_material_of_a_table_is_drawn() {
    let metal =
        |roughness: f64| Material(brdf::Material::Ward(brdf::Ward::new([roughness; 2], [1.0; 3]).unwrap()));
    let table = || case("tabulate-brdf", "degree = 2\nresolution = 16");
    let one = (*table().input("material", metal(0.6)).artifact::<BrdfTable>()).clone();
    let both = table().keyed_input("materials", &[("metal", "a")], metal(0.2)).keyed_input(
        "materials",
        &[("metal", "b")],
        metal(0.6),
    );
    let both = (*both.artifact::<BrdfTable>()).clone();
    let knot = || Mesh(mesh::shape("torus-knot").unwrap());
    let digest = engine::Digest::of(&engine::Artifact::encode(&knot()).unwrap()).to_string();
    let count = knot().0.positions().len();
    let blend = |value: Vec<[f32; 2]>, mesh: String| VertexBlend(containers::tensors::OfMesh { value, mesh });
    let with = |table: BrdfTable| {
        case("preview", "size = 32\nsamples = 1\nmodes = [\"table\"]")
            .input("environment", environment(32, sky))
            .input("mesh", knot())
            .input("table", table)
    };
    let expected = picture(&with(one));
    let blended =
        |share: f32| with(both.clone()).input("blend", blend(vec![[share, 0.0]; count], digest.clone()));
    assert_eq!(picture(&blended(1.0)), expected);
    assert!(apart(&picture(&blended(0.0)).1, &expected.1) > 1.0);
    let missing = "the table has 2 materials, but nothing places them on the mesh";
    assert_eq!(with(both.clone()).failure(), missing);
    let other = with(both.clone()).input("blend", blend(vec![[1.0, 0.0]; count], String::new()));
    assert_eq!(other.failure(), "the blend belongs to another mesh");
}

/// A sky of degree 2 is the same as an image and as a series.
#[test]
fn lighting_is_drawn_as_the_environment_that_it_is() {
    let of = |case: Case| picture(&case).1;
    let image =
        of(case("preview", "size = 32\nmodes = [\"mirror\"]").input("environment", environment(256, sky)));
    let series = of(case("preview", "size = 32\nmodes = [\"mirror\"]").input("environment", sky_lighting()));
    assert!(apart(&image, &series) < 1.0, "{}", apart(&image, &series));
}

#[test]
fn impossible_parameters_are_errors() {
    for (parameters, expected) in [
        ("amplify = 0", "amplify: 0 is not a number from 1 to 1000"),
        ("camera-pitch = 91", "camera-pitch: 91 is not a number from -90 to 90"),
        ("zoom = 0", "zoom: 0 is not a number from 0.1 to 100"),
        ("field = 180", "field: 180 is not a number from 1 to 120"),
        ("exposure = 101", "exposure: 101 is not a number from -100 to 100"),
        ("seconds = 0", "seconds: 0 is not a number from 0.1 to 600"),
        ("resolution = 1000", "resolution: 1000 is not a whole number from 4 to 512"),
        ("slices = 1", "slices: 1 is not a whole number from 2 to 256"),
        ("samples = 5", "samples: 5 is not a whole number from 1 to 4"),
        ("light-samples = 0", "light-samples: 0 is not a whole number from 1 to 65536"),
        ("frames = 0", "frames: 0 is not a whole number from 1 to 360"),
        ("modes = []", "modes: the list is empty; name one, such as \"local-shrm\""),
        ("modes = [\"mirror\", \"mirror\"]", "modes: \"mirror\" is listed twice"),
        ("compare = \"local-shrm\"", "compare: `modes` has no other mode to compare with it"),
        (
            "modes = [\"samples\"]\ncompare = \"mirror\"",
            "compare: \"samples\" is a diagram, which no other mode is compared with",
        ),
        ("format = \"apng\"", "format: one frame needs \"png\"; set frames to the number of frames"),
        ("frames = 2\nformat = \"png\"", "format: 2 frames need \"apng\" or \"strip\""),
        (
            "frames = 300\nsize = 1000",
            "size: all pictures together have 300000000 pixels, which is more than 67108864",
        ),
        ("size = 8", "size: 8 is not a whole number from 16 to 4096"),
    ] {
        let errors = case("preview", parameters).errors();
        assert!(errors.contains(&expected.to_owned()), "{parameters}: {errors:?}");
    }
    let errors = case("preview", "modes = [\"local\"]\nmesh = \"teapot\"\nbackground = \"sky\"").errors();
    assert_eq!(errors.len(), 3, "{errors:?}");
}

/// A real mesh under a real light.
#[test]
fn a_helmet_is_drawn_in_a_studio() {
    let Some(corpus) = test_data::folder("a_helmet_is_drawn_in_a_studio", "SPECULA_CORPUS") else { return };
    let bytes = std::fs::read(corpus.join("env/cc0/studio.hdr")).unwrap();
    let image = containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image;
    let grid = sphere::LatLong { width: image.width(), height: image.height() };
    let studio = envmap::Environment::new(grid, image.into_pixels()).unwrap();
    let (f, p) = (Degree::new(20).unwrap(), Degree::new(2).unwrap());
    let lighting = sh::Transform::new(grid, f).unwrap().analyse(studio.pixels());
    let brdf = brdf::project(&microfacet(0.3), Choice::Degree { f, p }, Stop::NEVER).unwrap();
    let reflection = Reflection(shrm::Reflection::convolve(&lighting, &brdf.coefficients));
    let helmet = crate::import_mesh::helmet(&corpus).artifact::<Mesh>();
    let case = case("preview", "size = [160, 120]\nsamples = 1\nbackground = [0, 0, 1]\ncurve = \"plain\"")
        .input("reflection", reflection)
        .input("environment", Environment(studio))
        .input("mesh", Mesh(helmet.0.clone()));
    let (_, codes) = picture(&case);
    let helmet = codes.iter().filter(|code| **code != [0, 0, 255]);
    let share = helmet.clone().count() as f64 / codes.len() as f64;
    let bright = helmet.filter(|code| code[1] > 100).count() as f64 / codes.len() as f64;
    // It is on a plinth, higher than wide, and lamps light it from both sides.
    assert!((0.08..0.3).contains(&share) && bright > 0.02, "{share} {bright}");
}
