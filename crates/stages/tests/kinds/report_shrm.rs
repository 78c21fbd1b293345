//! The SHRMs of a report are those of the files that `export-shrm` writes: compared with the files.

use brdf::{Centre, Fresnel, Ggx, KajiyaKay, Ward};
use containers::{read_texture, tensors};
use serde_json::Value;
use shrm::reference::{Cull, Reference};
use sphere::{DVec3, Direction};
use stages::artifacts::{Brdf, Environment, Lighting, Material, Reflection};

use crate::fixture::{Case, case, environment, lambert};
use crate::report::{SMALL, check_page, export, report, stops, sunny};

const PAIR: [(&str, &str); 2] = [("environment", "light"), ("material", "finish")];

fn metal(roughness: f64) -> brdf::Material {
    let gold = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
    brdf::Material::Ggx(Ggx::new(roughness, gold, [1.0; 3]).unwrap())
}

fn hair() -> brdf::Material {
    brdf::Material::KajiyaKay(KajiyaKay::new(16.0, [0.8, 0.6, 0.5]).unwrap())
}

fn brushed() -> brdf::Material {
    brdf::Material::Ward(Ward::new([0.2, 0.5], [0.6, 0.5, 0.3]).unwrap())
}

/// A matte base under a highlight.
fn lacquer() -> brdf::Material {
    brdf::Material::layers(vec![lambert(0.4), metal(0.35)]).unwrap()
}

/// Two broad lights in a dim room, neither of which is a lamp.
fn soft(w: DVec3) -> [f64; 3] {
    let lobe = |x: f64, y: f64, z: f64| (6.0 * (DVec3::new(x, y, z).normalize().dot(w) - 1.0)).exp();
    let (a, b) = (lobe(-1.0, 0.4, 0.3), lobe(0.3, -1.0, -0.2));
    [0.1 + 3.0 * a + b, 0.1 + 2.5 * a + 1.5 * b, 0.15 + 2.0 * a + 3.0 * b]
}

/// The reflection as the stages make it.
fn reflection(light: &Environment, material: &brdf::Material, degrees: &str) -> Reflection {
    let lighting = case("project-sh", "").input("environment", light.clone()).artifact::<Lighting>();
    let brdf = case("project-brdf", degrees).input("material", Material(material.clone())).artifact::<Brdf>();
    let case = case("convolve", "").input("lighting", (*lighting).clone()).input("brdf", (*brdf).clone());
    (*case.artifact::<Reflection>()).clone()
}

fn exported(parameters: &str, reflection: &Reflection) -> Case {
    case("export-shrm", parameters).input("reflection", reflection.clone())
}

fn base(light: &Environment, material: &brdf::Material) -> Case {
    case("report", SMALL).keyed_input("environment", &PAIR[..1], light.clone()).keyed_input(
        "material",
        &PAIR[1..],
        Material(material.clone()),
    )
}

/// P, and the number of coefficients and the texels of each map, as a file says itself.
fn content(file: &[u8]) -> (u64, String) {
    let (p, rows, [faces, height, width]) = match tensors::decode_shrm(file) {
        Ok(map) => (map.p().get() as u64, map.rows(), map.grid().shape()),
        Err(_) => {
            let file = read_texture(file).unwrap();
            let texture = file.texture;
            let shape = [texture.faces, texture.height, texture.width];
            (file.metadata["specula.degree"].parse().unwrap(), texture.layers, shape)
        }
    };
    let unit = if rows == 1 { "coefficient" } else { "coefficients" };
    let of = if faces == 6 { "6 faces of " } else { "" };
    (p, format!("{rows} {unit} × {of}{width} × {height}"))
}

/// The figures of an SHRM are those of the files: their degree, texels and bytes.
fn check(figures: &Value, case: &Case) {
    let (exported, files) = case.exported();
    let contents: Vec<_> = files.iter().map(|file| content(file)).collect();
    let texture: Vec<&str> = contents.iter().map(|(_, texture)| texture.as_str()).collect();
    let found = figures["texture"].as_str().unwrap();
    let rest = found.strip_prefix(&texture.join(" + ")).unwrap_or_else(|| panic!("{found}, not {texture:?}"));
    assert!(rest.is_empty() || rest.ends_with(" light") || rest.ends_with(" lights"), "{found}");
    // Of two maps that of the highlight is the last.
    assert_eq!(figures["p"].as_u64(), contents.last().map(|(p, _)| *p), "{figures}");
    assert_eq!(figures["file"].as_u64(), Some(exported.bytes.iter().sum()), "{figures}");
}

/// With any parameters that say P, and with one file or two; materials without azimuth, with it, and brushed.
#[test]
fn a_connected_shrm_is_measured_as_its_file_holds_it() {
    let ktx2 = "format = \"ktx2\"\n";
    let (soft, sunny) = (environment(32, soft), sunny());
    let cases = [
        (hair(), &soft, format!("{ktx2}view = \"global\"\nresolution = 8"), format!("{ktx2}most-p = 1")),
        (hair(), &sunny, format!("{ktx2}resolution = 12"), ktx2.to_owned()),
        (metal(0.3), &sunny, "resolution = 9\nmost-p = 6".into(), format!("{ktx2}accept = [0.05, 0.1]")),
        (brushed(), &soft, format!("{ktx2}accept = [0.01, 0.02]\nmost-p = 16"), ktx2.to_owned()),
        (lacquer(), &soft, ktx2.into(), "layout = \"lat-long\"\nresolution = 10\nerror = 0.2".into()),
        (lacquer(), &sunny, format!("{ktx2}resolution = 8"), format!("{ktx2}parts = \"together\"")),
    ];
    let mut degrees = Vec::new();
    for (index, (material, light, baked, separate)) in cases.into_iter().enumerate() {
        let reflection = reflection(light, &material, "");
        let has_sun = std::ptr::eq(light, &sunny);
        assert_eq!(reflection.0.lamps().is_some(), has_sun);
        let baked = exported(&baked, &reflection);
        let separate = exported(&format!("{separate}\nlamps = \"separate\""), &reflection);
        // Which port it is makes no difference: the parameters say what is in the files.
        let ports = if index % 2 == 0 { ["shrm", "shrm-separate"] } else { ["shrm-separate", "shrm"] };
        let case = base(light, &material)
            .keyed_input("reflection", &PAIR, reflection.clone())
            .keyed_input(ports[0], &PAIR, baked.exported().0)
            .keyed_input(ports[1], &PAIR, separate.exported().0);
        let (json, page) = report(&case);
        check_page(&page);
        let pair = &json["pairs"][0];
        let mut forms = vec![("shrm", &baked)];
        forms.extend(has_sun.then_some(("shrm-separate", &separate)));
        for (method, case) in forms {
            check(export(pair, method), case);
            degrees.push(export(pair, method)["p"].as_u64().unwrap());
        }
    }
    assert!(degrees.iter().any(|p| *p > 4) && degrees.iter().any(|p| (1..4).contains(p)), "{degrees:?}");
}

/// In light without lamps, files of either form are those of the only SHRM.
#[test]
fn without_lamps_one_connected_export_is_enough() {
    let (light, material) = (environment(32, soft), metal(0.4));
    let reflection = reflection(&light, &material, "");
    let separate = exported("format = \"ktx2\"\nlamps = \"separate\"", &reflection);
    let case = base(&light, &material).keyed_input("reflection", &PAIR, reflection.clone()).keyed_input(
        "shrm",
        &PAIR,
        separate.exported().0,
    );
    check(export(&report(&case).0["pairs"][0], "shrm"), &separate);
}

/// Without a connection, of the reflection and of the export, both are as the stages make them by default.
#[test]
fn an_shrm_is_by_default_as_export_shrm_makes_it() {
    let cube = "format = \"ktx2\"\nresolution = 12\n";
    let (soft, sunny) = (environment(32, soft), sunny());
    for (material, light) in [(metal(0.35), &soft), (hair(), &sunny), (lacquer(), &sunny)] {
        let reflection = reflection(light, &material, "");
        let (json, page) = report(&base(light, &material));
        let pair = &json["pairs"][0];
        assert_eq!(pair["p"].as_u64(), Some(reflection.0.brdf().p().get() as u64));
        let mut forms = vec![("shrm", "baked")];
        forms.extend(reflection.0.lamps().map(|_| ("shrm-separate", "separate")));
        for (method, lamps) in forms {
            let mut figures = export(pair, method).clone();
            let case = exported(&format!("{cube}lamps = \"{lamps}\""), &reflection);
            let (files, _) = case.exported();
            // Texels and lights alone; files have some kilobytes of entries more.
            let bytes = figures["bytes"].as_u64().unwrap();
            let written = files.bytes.iter().sum::<u64>();
            assert!((bytes..bytes + 8000).contains(&written), "{bytes} {written}");
            assert_eq!(figures["file"], Value::Null);
            figures["file"] = written.into();
            check(&figures, &case);
        }
        assert!(page.contains(">~"), "{page:.6000}");
    }
}

#[test]
fn degrees_that_are_given_are_those_of_the_map() {
    for light in [environment(32, soft), sunny()] {
        let material = metal(0.35);
        let reflection = reflection(&light, &material, "degree = [10, 5]");
        let connected = base(&light, &material).keyed_input("reflection", &PAIR, reflection.clone());
        let baked = exported("format = \"ktx2\"\nresolution = 12", &reflection);
        let separate = exported("format = \"ktx2\"\nresolution = 12\nlamps = \"separate\"", &reflection);
        let connected = connected.keyed_input("shrm", &PAIR, baked.exported().0);
        let connected = connected.keyed_input("shrm-separate", &PAIR, separate.exported().0);
        let (json, _) = report(&connected);
        check(export(&json["pairs"][0], "shrm"), &baked);
        assert_eq!(export(&json["pairs"][0], "shrm")["p"], 5);
        if reflection.0.lamps().is_some() {
            check(export(&json["pairs"][0], "shrm-separate"), &separate);
        }
    }
}

/// The figures of two maps, from the files alone: looked up at each pixel by the normal and by the reflection
/// vector, added, and compared with a sum over all light.
#[test]
fn the_error_of_two_files_is_that_of_what_a_renderer_adds() {
    let (light, material) = (environment(32, soft), lacquer());
    let reflection = reflection(&light, &material, "");
    let exported = exported("resolution = 24", &reflection);
    let (files, bytes) = exported.exported();
    let case = base(&light, &material)
        .keyed_input("reflection", &PAIR, reflection.clone())
        .keyed_input("shrm", &PAIR, files);
    let (json, _) = report(&case);
    let found = export(&json["pairs"][0], "shrm");
    assert_eq!(found["one_of"], 1);

    let maps: Vec<_> = bytes.iter().map(|file| tensors::decode_shrm(file).unwrap()).collect();
    assert_eq!(maps.iter().map(|map| map.centre()).collect::<Vec<_>>(), [Centre::Normal, Centre::Reflection]);
    let truth = Reference::new(&light.0, &material, Cull::None);
    let dark = 0.01 * light.0.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI);
    let view = Direction::normalised(-DVec3::X);
    let mut stops_of_samples = Vec::new();
    for index in 0..32 * 32 {
        let [x, y] = [index % 32, index / 32].map(|i| (f64::from(i) - 15.5) / 16.0);
        if x.hypot(y) < 1.0 {
            let normal = Direction::normalised(DVec3::new(-(1.0 - x * x - y * y).sqrt(), -x, -y));
            let central = Centre::Reflection.central(normal, normal, view);
            let right = truth.radiance(central, view);
            let [diffuse, specular] =
                [(&maps[0], normal), (&maps[1], central)].map(|(map, at)| map.lookup().radiance(at, view));
            for channel in 0..3 {
                let sum = f64::from(diffuse[channel] + specular[channel]);
                let error = ((sum.max(0.0) + dark) / (right[channel] + dark)).log2().abs();
                stops_of_samples.push(error);
            }
        }
    }
    stops_of_samples.sort_by(f64::total_cmp);
    let at = |percent: usize| stops_of_samples[stops_of_samples.len() * percent / 100];
    for (found, expected) in stops(found).into_iter().zip([at(95), at(99)]) {
        // The report's brute force is good to 0.003 stops.
        assert!((found - expected).abs() < 0.005 + 0.02 * expected, "{found}, not {expected}");
    }
}

/// Of a material with two parts, a 3D texture and views are maps of each, unless the stage says otherwise;
/// one map shows the matte base by the reflection vector.
#[test]
fn other_maps_of_two_parts_are_measured_as_their_files_hold_them() {
    let (light, material) = (environment(32, soft), lacquer());
    let reflection = reflection(&light, &material, "");
    let figures = |parts: &str| {
        let maps = |kind| {
            let case = case(kind, &format!("resolution = 8\nparts = \"{parts}\""));
            case.input("reflection", reflection.clone()).exported().0
        };
        let case = base(&light, &material)
            .keyed_input("reflection", &PAIR, reflection.clone())
            .keyed_input("kautz-mccool", &PAIR, maps("export-kautz-mccool"))
            .keyed_input("cabral", &PAIR, maps("export-cabral"));
        let (json, _) = report(&case);
        ["kautz-mccool", "cabral"].map(|method| {
            let figures = export(&json["pairs"][0], method);
            let number = |name: &str| figures[name].as_u64().unwrap();
            (number("maps"), number("bytes"), stops(figures)[0])
        })
    };
    for ((maps, bytes, each), (one, of_one, together)) in
        figures("separate").into_iter().zip(figures("together"))
    {
        assert_eq!((maps, one, bytes), (2, 1, 2 * of_one));
        assert!(each < 0.5 * together, "{each} {together}");
    }
}

/// A plain map of each part has the size of both files of its stage, and one map of the whole has none there.
#[test]
fn maps_of_parts_have_the_size_of_both_files() {
    let (light, material) = (environment(32, soft), lacquer());
    let reflection = reflection(&light, &material, "");
    let size =
        |parameters: &str| {
            let maps = case("export-reflection-map", parameters).input("reflection", reflection.clone());
            let (files, _) = maps.exported();
            let total: u64 = files.bytes.iter().sum();
            let case = base(&light, &material)
                .keyed_input("reflection", &PAIR, reflection.clone())
                .keyed_input("reflection-map", &PAIR, files);
            let json = report(&case).0;
            let sizes = ["part-maps", "reflection-map"]
                .map(|method| export(&json["pairs"][0], method)["file"].as_u64());
            (total, sizes)
        };
    let (total, sizes) = size("resolution = 8");
    assert_eq!(sizes, [Some(total), None]);
    let (total, sizes) = size("resolution = 8\nparts = \"together\"");
    assert_eq!(sizes, [None, Some(total)]);
}

/// A bare metal has no matte base: its stages write one map, and the report has no maps of parts.
#[test]
fn a_bare_metal_has_one_map() {
    let (light, bare) = (
        environment(32, soft),
        brdf::StandardParameters { metallic: 1.0, roughness: 0.6, ..Default::default() },
    );
    let material = brdf::Material::Standard(brdf::Standard::new(bare).unwrap());
    let reflection = reflection(&light, &material, "");
    let maps = case("export-reflection-map", "resolution = 8").input("reflection", reflection.clone());
    let (files, written) = maps.exported();
    let case = base(&light, &material).keyed_input("reflection", &PAIR, reflection.clone()).keyed_input(
        "reflection-map",
        &PAIR,
        files,
    );
    let pair = &report(&case).0["pairs"][0];
    assert_eq!(export(pair, "reflection-map")["file"].as_u64(), Some(written[0].len() as u64));
    assert!(pair["exports"].as_array().unwrap().iter().all(|export| export["method"] != "part-maps"));
}

#[test]
fn files_that_are_no_shrm_or_the_same_one_are_errors() {
    let (light, material) = (environment(32, soft), metal(0.5));
    let reflection = reflection(&light, &material, "");
    let connected = || base(&light, &material).keyed_input("reflection", &PAIR, reflection.clone());
    let files = |parameters: &str| exported(parameters, &reflection).exported().0;
    let components = connected().keyed_input("shrm", &PAIR, files("form = \"components\"\nresolution = 8"));
    assert_eq!(
        components.failure(),
        "the port shrm: the files of export-shrm hold components, not harmonics"
    );
    let both = connected()
        .keyed_input("shrm", &PAIR, files("lamps = \"separate\"\nresolution = 4"))
        .keyed_input("shrm-separate", &PAIR, files("lamps = \"separate\"\nresolution = 8"));
    assert_eq!(
        both.failure(),
        "the ports shrm and shrm-separate both receive the files of export-shrm, lamps = \"separate\""
    );
}
