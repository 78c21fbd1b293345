//! The revision guard: if the output of a kind changes beyond rounding, its revision must be raised, or
//! caches would return old results as new ones.
//!
//! [`TABLE`] holds, for each kind, its revision and a fingerprint of its fixture's output: the number of
//! numbers, their sum, the sum of their sizes and two sums with weights that depend on their order. If a test
//! fails because of an intended change, raise `REVISION` in the file of the kind or of the kernel that
//! changed, and put the printed line into the table.

use engine::{Artifact, Output, Product};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde_json::Value;
use stages::artifacts::{
    Brdf, BrdfTable, Environment, LightField, Lighting, Material, Mesh, Prefiltered, Reflection, ScaleSpace,
    Shrm, Taps, Transfer, VertexBlend, VertexRadiance,
};

use crate::fixture::{
    Case, case, environment, exr, kinds, lambert, phong, pixels, reflection, sky, sky_lighting,
};

/// What a kind computes in another way, as `kind, what`.
pub(crate) const VARIANTS: [&str; 2] = ["reference, sampled", "sample-directions, product"];

/// Kind or variant, revision, fingerprint.
const TABLE: &[(&str, u32, [f64; 5])] = &[
    ("import-environment", 3, [96.00000000, 294.15642142, 294.15642142, 1.42842033, -16.81971523]),
    ("import-material", 2, [4.00000000, 9.00000000, 9.00000000, 8.75279504, 0.48240101]),
    ("import-mesh", 3, [156.00000000, 120.00000000, 144.00000000, 38.87456349, -0.20060482]),
    ("project-sh", 9, [147.00000000, 31.35296448, 32.22187732, 4.72306372, 1.13808101]),
    ("rotate", 4, [27.00000000, 9.81585951, 15.94363884, 7.85013800, -0.04349477]),
    ("project-brdf", 11, [84.00000000, 4.33436622, 4.92776406, 0.49485746, -0.09654360]),
    ("convolve", 13, [36.00000000, 25.62677718, 25.62677744, 9.59641872, 1.37049466]),
    ("scale-space", 7, [24480.00000000, 35635.09194726, 35635.09194726, -18.99275590, 2.82135842]),
    ("fit-taps", 5, [910.00000000, 223.74100580, 226.66262260, 0.44851476, -0.03001829]),
    ("export-taps", 8, [44841.00000000, 64630.77833562, 65220.92613181, 193.75792122, 22.49350721]),
    ("prefilter", 9, [378.00000000, 377.99386433, 377.99386433, 6.71541860, 2.75259023]),
    ("dfg", 5, [48.00000000, 16.43887138, 16.43887138, -0.67852147, 2.15037524]),
    ("test-pattern", 13, [69120.00000000, 80677.26088471, 80677.26088471, -15.99289069, 9.62319618]),
    (
        "export-engine",
        18,
        [43030.00000000, 108470.17525508, 108470.17526656, -32144.71947227, 61199.10044042],
    ),
    ("export-environment", 5, [450.00000000, 1272.81445312, 1272.81445312, 12.17500315, 5.75886064]),
    ("export-reflection-map", 7, [1296.00000000, 518.40527344, 518.40527344, 1.53200292, -0.96969274]),
    ("export-shrm", 25, [1458.00000000, 209.57901371, 370.56937039, -8.33842415, 4.83045393]),
    ("reference", 9, [96.00000000, 27.59375000, 27.59375000, -0.10275476, 0.09699185]),
    ("reference, sampled", 9, [96.00000000, 27.60314941, 27.60314941, -0.07613749, 0.09068694]),
    ("contact-sheet", 9, [6935040.00000000, 636455.97917270, 636455.97917270, -64.96272181, 5.64543847]),
    ("export-page", 29, [3.00000000, 1.00000000, 1.00000000, 1.00000000, 0.00000000]),
    ("report", 44, [297.00000000, 7702067.19679152, 7702067.19679152, 390084.84000560, -3079872.04746041]),
    ("preview", 32, [688224.00000000, 57584.81637291, 57584.81637291, 8.67273897, 3.22259895]),
    ("export-cabral", 17, [1575.00000000, 754.51357624, 849.29541752, -43.59984273, -0.82769094]),
    ("export-kautz-mccool", 17, [223.00000000, 78.88049061, 84.59551746, 10.18207046, -1.08493032]),
    ("export-view-maps", 17, [1497.00000000, 538.41252518, 556.84685949, 3.10003517, 3.98891865]),
    ("import-reflection-maps", 2, [1458.00000000, 201.28708034, 413.02017110, -1.92816769, 1.01576073]),
    ("exec", 2, [384.00000000, 383.99999908, 383.99999908, 0.14044671, 0.67112033]),
    ("brush-mesh", 1, [126.00000000, 89.87190910, 131.87190910, -3.10480748, -3.44804098]),
    ("vertex-blend", 1, [9.00000000, 4.05000007, 4.05000007, 0.02259533, 0.44091425]),
    ("precompute-transfer", 7, [729.00000000, 10.32283473, 96.62044215, -0.66551477, -2.79295807]),
    ("circular-lights", 2, [48.00000000, 18.36154651, 29.12322030, 1.94446095, 1.11122145]),
    ("sum-lighting", 1, [75.00000000, 38.92282258, 74.62133954, 2.12965142, 1.78515938]),
    ("light-field", 1, [156.00000000, 43.03889242, 45.03889242, 5.12625653, -1.31238622]),
    ("tabulate-brdf", 5, [432.00000000, 18.23065146, 56.81875229, -0.29086107, 0.09455148]),
    ("shade-vertices", 6, [27.00000000, 18.70190126, 18.70190126, 0.00654035, -0.37619567]),
    ("export-brdf-table", 1, [432.00000000, 18.23072815, 41.22508240, -0.82318352, 0.51969589]),
    ("export-gltf", 3, [441.00000000, 131.98281982, 181.48188560, -4.55139173, -4.09833557]),
    ("sample-light", 2, [87.00000000, 61.29606103, 76.55954017, -0.78341016, -2.93318267]),
    ("largest-wavelets", 2, [1944.00000000, 2116.35601163, 2116.35601163, 152.10479015, -46.90351223]),
    ("export-wavelets", 2, [160.00000000, 4090.26718709, 4092.26511100, -224.18113686, 357.60015963]),
    ("sample-directions", 2, [700.00000000, 316.34839657, 407.04493364, -4.28556726, 6.02085767]),
    ("sample-directions, product", 2, [700.00000000, 1074.29260420, 1165.13496194, -2.42051165, 9.20029112]),
    ("subtract-lights", 3, [24576.00000000, 17511.55947974, 17511.55947974, 1.71991093, -0.32013821]),
    ("export-light-rig", 1, [56.00000000, 310.99010542, 317.15413561, 6.97544114, -5.15714744]),
    ("import-scene", 2, [66.00000000, 209.00000000, 241.40000004, 89.75610560, 15.74761971]),
    ("scene-part", 1, [66.00000000, 209.00000000, 241.40000004, 89.75610560, 15.74761971]),
    ("place-probes", 7, [521.00000000, 2846.76000287, 2936.57333492, -35.30705276, 43.19165024]),
    ("check-probes", 6, [1549.00000000, 7325.11162369, 7481.90520464, 691.20648002, -21.99124444]),
    ("bake-probes", 6, [47305.00000000, 4520.31922556, 7612.04752289, 166.09656452, 30.15935994]),
    ("bake-lamps", 6, [3584.00000000, 100.53781012, 111.77654336, -4.32245479, 1.58572299]),
    ("light-probes", 8, [2313.00000000, 3902.80852932, 4315.69730314, 73.76188155, 47.41483040]),
    ("probe-pattern", 1, [441.00000000, 858.07860208, 952.00660682, -38.72261105, -29.46942826]),
    ("export-probes", 2, [471.00000000, 392.96325111, 517.28138810, 2.24608314, -9.92970182]),
    ("export-sh", 2, [29.00000000, 7.45000000, 7.45000002, -3.15827626, 1.72448820]),
];

/// A small run of a kind that covers what can change.
pub(crate) fn fixture(kind: &str) -> Case {
    match kind {
        "import-environment" => {
            let pixels = (0..64).map(|i| [1.0 + (i % 8) as f32, 0.5 * (i / 8) as f32, 0.25]).collect();
            case("import-environment", "layout = \"probe\"\nexposure = 0.5")
                .file("a.exr", exr(8, 8, pixels))
                .source("a.exr")
        }
        "import-material" => case("import-material", "")
            .file("a.toml", "model = \"phong\"\nexponent = 7.5\nspecular = [0.9, 0.5, 0.1]")
            .source("a.toml"),
        "import-mesh" => crate::import_mesh::square(),
        "project-sh" => case("project-sh", "degree = 6\nwindow = \"lanczos\"")
            .input("environment", environment(16, |w| sky(w).map(|value| value.powi(3)))),
        "rotate" => case("rotate", "yaw = 20\npitch = -35\nroll = 110").input("lighting", sky_lighting()),
        "project-brdf" => {
            let rough = brdf::Microfacet::new(0.5, [1.0, 0.5, 0.2]).unwrap();
            case("project-brdf", "tolerance = 0.05")
                .input("material", Material(brdf::Material::Microfacet(rough)))
        }
        "convolve" => {
            let brdf = case("project-brdf", "").input("material", Material(phong(3.0))).artifact::<Brdf>();
            case("convolve", "").input("lighting", sky_lighting()).input("brdf", (*brdf).clone())
        }
        "scale-space" => crate::taps::scale_space("resolution = 8\nlights = 1"),
        "fit-taps" => crate::taps::fit_taps("taps = 2"),
        "export-taps" => crate::taps::pair(""),
        "prefilter" => case("prefilter", "roughness = [0.0, 0.2, 1.0]\nresolution = 4")
            .input("environment", environment(16, sky)),
        "export-engine" => {
            case("export-engine", "preset = \"bevy\"\nresolution = 32").input("light", environment(16, sky))
        }
        "test-pattern" => case("test-pattern", "preset = \"gltf\"\nresolution = 32"),
        "dfg" => case("dfg", "resolution = 4\nsheen = true\nvariant = \"filament\""),
        "export-environment" => {
            case("export-environment", "layout = \"cube-strip\"\nresolution = 5\nexposure = 1.5")
                .input("environment", environment(16, sky))
        }
        "export-reflection-map" => case("export-reflection-map", "layout = \"cube-cross\"\nresolution = 6")
            .input("reflection", reflection(lambert(0.8), 2)),
        "export-shrm" => case("export-shrm", "resolution = 3\nview = \"global\"\nformat = \"ktx2\"")
            .input("reflection", crate::export_shrm::made_up(true)),
        "export-cabral" => case("export-cabral", "layout = \"sphere\"\nresolution = 6")
            .input("reflection", crate::explicit_maps::reflection(2, 2)),
        "export-kautz-mccool" => case("export-kautz-mccool", "format = \"exr\"\nresolution = 3\nslices = 4")
            .input("reflection", crate::explicit_maps::reflection(2, 1)),
        "export-view-maps" => case("export-view-maps", "view = \"local\"\nviews = 3\nresolution = 3")
            .input("reflection", crate::explicit_maps::reflection(2, 2)),
        "import-reflection-maps" => {
            let maps = case("export-cabral", "resolution = 3\nprecision = \"float\"");
            let maps = maps.input("reflection", crate::explicit_maps::reflection(2, 2));
            crate::explicit_maps::import("", &maps)
        }
        "export-sh" => case("export-sh", "preset = \"unity\"").input("lighting", sky_lighting()),
        "reference" | "reference, sampled" => {
            let method = if kind == "reference" { "" } else { "\nmethod = \"sampled\"\nsamples = 256" };
            case("reference", &format!("view = [30, 20]\nresolution = 4\nenvironment-resolution = 8{method}"))
                .input("environment", environment(16, sky))
                .input(
                    "material",
                    Material(brdf::Material::Microfacet(brdf::Microfacet::new(0.4, [0.5; 3]).unwrap())),
                )
        }
        "contact-sheet" => case("contact-sheet", "degrees = [1]")
            .input("environment", environment(16, sky))
            .input("lighting", sky_lighting())
            .keyed_input("reflection", &[("material", "chalk")], reflection(lambert(0.8), 2)),
        "exec" => case(
            "exec",
            "command = [\"sh\", \"-c\", \"cp $0 $1\", \"{input.sky}\", \"{output}\"]
            output = { type = \"environment\" }",
        )
        .input("sky", environment(8, sky)),
        "report" => case("report", "sphere = 32\nresolution = 8\ndegree = [4, 2]")
            .input("environment", environment(16, sky))
            .input("material", Material(crate::report::microfacet(0.5))),
        "preview" => crate::preview::knot(
            "modes = [\"local-shrm\", \"mirror\"]\ncompare = \"brute-force\"\nsize = 160",
        ),
        "export-page" => crate::export_page::page("resolution = 8\nslices = 4", "copper"),
        "circular-lights" => crate::circular_lights::studio("degree = 3\nwindow = \"lanczos\""),
        "sum-lighting" => {
            let lamps = crate::circular_lights::studio("lamps = \"series\"").artifact::<Lighting>();
            case("sum-lighting", "").input("lighting", sky_lighting()).input("added", (*lamps).clone())
        }
        "light-field" => crate::light_field::near("points = { open = [-1, 0, 0], wall = [1, 0, 0.5] }"),
        "brush-mesh" => {
            case("brush-mesh", "vector = [1, 2, 3]\nturn = 20").input("mesh", crate::vertices::pit())
        }
        "precompute-transfer" => case("precompute-transfer", "degree = 2\ndirections = 256\nbounces = 2")
            .input("mesh", crate::vertices::pit())
            .input("material", Material(lambert(0.8))),
        "shade-vertices" => crate::vertices::shaded(true),
        "vertex-blend" => crate::vertices::blend(""),
        "tabulate-brdf" => case("tabulate-brdf", "resolution = 4\ndegree = 2")
            .input("material", crate::brdf_table::brushed()),
        "export-brdf-table" => {
            let table = case("tabulate-brdf", "resolution = 4\ndegree = 2")
                .input("material", crate::brdf_table::brushed())
                .artifact::<BrdfTable>();
            case("export-brdf-table", "format = \"ktx2\"").input("table", (*table).clone())
        }
        "export-gltf" => crate::export_gltf::knot(),
        "sample-light" => crate::light_rig::sampled("count = 12\nmethod = \"warped\""),
        "sample-directions" => {
            crate::sample_directions::lobe("count = 100\nleaves = \"analytic\"\nwarp = \"hierarchical\"")
        }
        "sample-directions, product" => crate::sample_directions::product("count = 100"),
        "largest-wavelets" => crate::wavelets::few("count = 40"),
        "export-wavelets" => crate::wavelets::exported("count = 40"),
        "subtract-lights" => crate::light_rig::subtracted("most = 2"),
        "export-light-rig" => crate::light_rig::exported("format = \"gltf\""),
        "import-scene" => crate::light_probes::import(),
        "scene-part" => crate::light_probes::part("lamps"),
        "place-probes" => crate::light_probes::places(),
        "bake-probes" => crate::light_probes::bake("bake-probes", "surfaces"),
        "bake-lamps" => crate::light_probes::bake("bake-lamps", "lamps"),
        "light-probes" => crate::light_probes::lit(),
        "probe-pattern" => crate::light_probes::pattern(),
        "check-probes" => crate::light_probes::leaks(),
        "export-probes" => crate::light_probes::exported(),
        other => panic!("give {other} a fixture here"),
    }
}

/// Every number of an output, in order.
fn numbers(case: &Case) -> Vec<f64> {
    let colours = |rows: &[[f64; 3]]| rows.as_flattened().to_vec();
    match (case.run().unwrap().output, case.product()) {
        (Output::Artifact { bytes, .. }, Product::Artifact(name)) => match name {
            Environment::TYPE => {
                let environment = Environment::decode(&bytes).unwrap().0;
                environment.pixels().as_flattened().iter().map(|&value| value.into()).collect()
            }
            Lighting::TYPE => {
                let sh::Lighting { series, lights } = Lighting::decode(&bytes).unwrap().0;
                let row = |light: &sh::Light| {
                    let [direction, irradiance] = [light.direction.vector().to_array(), light.irradiance];
                    [&direction[..], &[light.radius], &irradiance].concat()
                };
                [colours(series.coefficients()), lights.iter().flat_map(row).collect()].concat()
            }
            LightField::TYPE => {
                let field = LightField::decode(&bytes).unwrap().0;
                let lights = field.lights().iter().flat_map(|light| colours(light.coefficients()));
                field.points().as_flattened().iter().copied().chain(lights).collect()
            }
            Brdf::TYPE => colours(Brdf::decode(&bytes).unwrap().0.coefficients.rho()),
            Reflection::TYPE => {
                let reflection = Reflection::decode(&bytes).unwrap().0;
                [colours(reflection.lighting().coefficients()), colours(reflection.brdf().rho())].concat()
            }
            Transfer::TYPE => {
                let transfer = Transfer::decode(&bytes).unwrap().0.value;
                let transfer::Form::Matrices(matrices) = transfer.form() else { panic!("not matrices") };
                matrices.values().iter().map(|&value| value.into()).collect()
            }
            VertexBlend::TYPE => {
                let places = VertexBlend::decode(&bytes).unwrap().0.value;
                places.iter().map(|&[first, _]| first.into()).collect()
            }
            VertexRadiance::TYPE => {
                let radiance = VertexRadiance::decode(&bytes).unwrap().0.value;
                radiance.as_flattened().iter().map(|&value| value.into()).collect()
            }
            BrdfTable::TYPE => {
                let table = BrdfTable::decode(&bytes).unwrap().0;
                table.values().iter().map(|&value| value.into()).collect()
            }
            Shrm::TYPE => {
                let map = Shrm::decode(&bytes).unwrap().0;
                map.values().as_flattened().iter().map(|&value| value.into()).collect()
            }
            Prefiltered::TYPE => {
                let prefiltered = Prefiltered::decode(&bytes).unwrap().0;
                let levels = prefiltered.levels.iter().flat_map(|level| level.map.pixels().as_flattened());
                levels.map(|&value| value.into()).collect()
            }
            ScaleSpace::TYPE => {
                let space = ScaleSpace::decode(&bytes).unwrap().0.space;
                let maps = space.levels().iter().chain(space.normals());
                maps.flat_map(|map| map.pixels().as_flattened()).map(|&value| value.into()).collect()
            }
            Taps::TYPE => {
                let table = Taps::decode(&bytes).unwrap().0.fitted.table;
                let taps = table.rows().iter().flat_map(|row| &row.taps);
                let taps = taps.flat_map(|tap| [tap.delta, tap.std].into_iter().chain(tap.weight));
                let normals = table.rows().iter().flat_map(|row| &row.normals);
                taps.chain(normals.flat_map(|tap| [tap.y].into_iter().chain(tap.weight))).collect()
            }
            Material::TYPE => {
                let models = &containers::tensors::describe(&bytes).unwrap().metadata["material"];
                json_numbers(&serde_json::from_str(models).unwrap())
            }
            Mesh::TYPE => {
                let mesh = Mesh::decode(&bytes).unwrap().0;
                let corners = mesh.triangles().as_flattened().iter().map(|&corner| f64::from(corner));
                let vectors = [mesh.positions().as_flattened(), mesh.normals().as_flattened()];
                let more = [mesh.tangents().as_flattened(), mesh.coordinates().unwrap().as_flattened()];
                let numbers = vectors.into_iter().chain(more).flatten().map(|&number| f64::from(number));
                numbers.chain(corners).collect()
            }
            other => match crate::light_probes::numbers(other, &bytes) {
                Some(numbers) => numbers,
                None => panic!("read the numbers of {other} here"),
            },
        },
        (Output::Files(files), _) => files.iter().flatten().flat_map(|file| file_numbers(file)).collect(),
        _ => unreachable!("checked by the run"),
    }
}

fn file_numbers(file: &[u8]) -> Vec<f64> {
    if file.starts_with(b"<!doctype html>") {
        // A page shows the figures of the JSON file; this counts its pictures and plots.
        let page = String::from_utf8_lossy(file);
        return ["<img", "<polyline", "<tr>"].map(|element| page.matches(element).count() as f64).into();
    }
    if file.starts_with(b"glTF") {
        return crate::export_gltf::Read::of(file).numbers();
    }
    if containers::is_texture(file) {
        let texture = containers::read_texture(file).unwrap().texture;
        return texture.levels().flatten().flatten().map(|&value| value.into()).collect();
    }
    if let Ok(light) = containers::read_gltf_image_based_light(file) {
        return light.cube.levels().flatten().flatten().map(|&value| value.into()).collect();
    }
    if file.starts_with(b"u,v,") {
        let text = String::from_utf8_lossy(file);
        return text
            .lines()
            .skip(1)
            .flat_map(|line| line.split(','))
            .map(|word| word.parse().unwrap())
            .collect();
    }
    if let Ok(file) = SafeTensors::deserialize(file) {
        let numbers = |(_, tensor): (String, TensorView<'_>)| -> Vec<f64> {
            let words = tensor.data().as_chunks::<4>().0.iter().copied();
            match tensor.dtype() {
                Dtype::U32 => words.map(|word| u32::from_le_bytes(word).into()).collect(),
                Dtype::F32 => words.map(|word| f32::from_le_bytes(word).into()).collect(),
                other => panic!("give {other:?} an arm here"),
            }
        };
        let mut tensors = file.tensors();
        tensors.sort_by(|(one, _), (other, _)| one.cmp(other));
        return tensors.into_iter().flat_map(numbers).collect();
    }
    if file.first().is_some_and(u8::is_ascii_uppercase) && str::from_utf8(file).is_ok() {
        // A README has no numbers that count.
        return Vec::new();
    }
    match serde_json::from_slice(file) {
        Ok(json) => json_numbers(&json),
        Err(_) => pixels(file).2.as_flattened().iter().map(|&value| value.into()).collect(),
    }
}

fn json_numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Number(number) => number.as_f64().into_iter().collect(),
        Value::Array(values) => values.iter().flat_map(json_numbers).collect(),
        Value::Object(members) => members.values().flat_map(json_numbers).collect(),
        _ => Vec::new(),
    }
}

fn fingerprint(numbers: &[f64]) -> [f64; 5] {
    let sum = |weight: &dyn Fn(f64) -> f64| -> f64 {
        numbers.iter().enumerate().map(|(index, value)| value * weight(index as f64)).sum()
    };
    let size = numbers.iter().map(|value| value.abs()).sum();
    [numbers.len() as f64, sum(&|_| 1.0), size, sum(&|i| (0.37 * i).cos()), sum(&|i| (1.91 * i).sin())]
}

#[test]
fn an_output_that_changes_has_a_new_revision() {
    let mut errors = Vec::new();
    for kind in kinds().iter() {
        if kind.name() == "exec" && !cfg!(unix) {
            eprintln!("SKIPPED the revision of exec: its fixture is a shell's command");
            continue;
        }
        let variants = VARIANTS.iter().filter(|variant| kind_of(variant) == kind.name());
        for name in std::iter::once(kind.name()).chain(variants.copied()) {
            let found = fingerprint(&numbers(&fixture(name)));
            let line = format!("(\"{name}\", {}, {found:.8?}),", kind.revision());
            match TABLE.iter().find(|(listed, ..)| *listed == name) {
                None => errors.push(format!("add: {line}")),
                Some((_, revision, _)) if *revision != kind.revision() => {
                    errors.push(format!("update: {line}"));
                }
                Some((_, _, expected)) => {
                    // Rounding of another processor or of 8 and 16-bit files moves sums by less than 1e-5 of
                    // their size.
                    let same =
                        found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-5 * found[2].max(1.0));
                    if !same {
                        errors.push(format!("raise the revision of {name}, then update: {line}"));
                    }
                }
            }
        }
    }
    let listed = |name: &str| kinds().get(kind_of(name)).is_some();
    errors.extend(TABLE.iter().filter(|(name, ..)| !listed(name)).map(|(name, ..)| format!("remove {name}")));
    assert!(errors.is_empty(), "\n{}", errors.join("\n"));
}

/// The kind of a variant.
pub(crate) fn kind_of(name: &str) -> &str {
    name.split(", ").next().unwrap_or(name)
}
