use std::path::Path;

use brdf::{
    Absent, Fresnel, Ggx, Lafortune, LafortuneLobe, Lambert, MODELS, Material as Model, Phong, Standard,
    StandardParameters, Value, Values,
};
use engine::{Artifact, Output};
use stages::artifacts::Material;

use crate::fixture::{Case, case};

/// The values of `model`, as errors list them.
fn models() -> String {
    let names: Vec<_> =
        MODELS.iter().map(|model| model.name).chain(["measured", "gltf", "materialx", "layers"]).collect();
    names.join(", ")
}

fn import(text: &str) -> Case {
    case("import-material", "").file("materials/gold.toml", text).source("materials/gold.toml")
}

/// A matte table of 10 degrees in both angles and phi.
fn csv() -> String {
    let mut text = String::from("theta_i,theta_o,phi,r,g,b\n");
    for i in 0..9 {
        for o in 0..9 {
            for phi in 0..19 {
                text += &format!("{},{},{},0.2,0.1,0.05\n", 10 * i, 10 * o, 10 * phi);
            }
        }
    }
    text
}

#[test]
fn models_take_their_parameters() {
    let lambert = import("model = \"lambert\"\nalbedo = 0.5\n").artifact::<Material>();
    assert_eq!(lambert.0, Model::Lambert(Lambert::new([0.5; 3]).unwrap()));
    let phong = import("exponent = 64\nmodel = \"phong\"\nspecular = [1, 0.77, 0.34]").artifact::<Material>();
    assert_eq!(phong.0, Model::Phong(Phong::new(64.0, [1.0, 0.77, 0.34]).unwrap()));
    let gold =
        import("model = \"ggx\"\nroughness = 0.3\nn = [0.14, 0.37, 1.45]\nk = 2").artifact::<Material>();
    let fresnel = Fresnel::Conductor { n: [0.14, 0.37, 1.45], k: [2.0; 3] };
    assert_eq!(gold.0, Model::Ggx(Ggx::new(0.3, fresnel, [1.0; 3]).unwrap()));
    let skin = import("model = \"lafortune\"\nlobes = [{ cx = -0.9, cz = 1, n = 9 }]\ndiffuse = 0.1");
    let lobe = LafortuneLobe { cx: -0.9, cz: 1.0, n: 9.0, weight: [1.0; 3] };
    assert_eq!(
        skin.artifact::<Material>().0,
        Model::Lafortune(Lafortune::new([0.1; 3], vec![lobe]).unwrap())
    );
}

/// A value as a material file has it.
fn toml(value: &Value) -> String {
    let table = |values: &Values| {
        let entries: Vec<_> =
            values.iter().map(|(name, value)| format!("{name} = {}", toml(value))).collect();
        format!("{{ {} }}", entries.join(", "))
    };
    match value {
        Value::Number(number) => format!("{number:?}"),
        Value::Colour(rgb) => format!("{rgb:?}"),
        Value::Records(records) => format!("[{}]", records.iter().map(table).collect::<Vec<_>>().join(", ")),
    }
}

/// The examples of every model are read by the one mechanism, with all of their parameters, and with those
/// alone that they must have and those of each choice.
#[test]
fn every_model_can_be_imported() {
    for example in Model::examples().unwrap() {
        let model = MODELS.iter().find(|model| model.name == example.name()).unwrap();
        let (mut whole, mut least) = (format!("model = \"{}\"\n", model.name), String::new());
        for (name, value) in example.values().iter() {
            let line = format!("{name} = {}\n", toml(value));
            let parameter = model.parameters.iter().find(|parameter| parameter.name == name).unwrap();
            if !matches!(parameter.absent, Absent::Default(_)) {
                least += &line;
            }
            whole += &line;
        }
        assert_eq!(import(&whole).artifact::<Material>().0, example, "{whole}");
        let found = import(&format!("{least}model = \"{}\"", model.name)).artifact::<Material>();
        assert_eq!(found.0.name(), model.name, "{least}");
    }
}

#[test]
fn a_width_for_both_directions_is_not_needed_if_each_has_its_own() {
    for (model, both, range, rest) in [
        ("ggx", "roughness", "0.01 to 1", "ior = 1.5"),
        ("ward", "roughness", "0.01 to 1", ""),
        ("ashikhmin-shirley", "exponent", "0 to 1e9", "specular = 0.04"),
    ] {
        let [x, y] = ["x", "y"].map(|axis| format!("{both}_{axis}"));
        let text = |widths: &str| format!("model = \"{model}\"\n{rest}\n{widths}");
        let material = |widths: &str| import(&text(widths)).artifact::<Material>().0.clone();
        let stretched = material(&format!("{x} = 0.2\n{y} = 0.6"));
        assert_eq!(stretched, material(&format!("{both} = 0.2\n{y} = 0.6")));
        assert_eq!(stretched, material(&format!("{both} = 0.6\n{x} = 0.2")));
        assert_eq!(stretched, material(&format!("{both} = 0.9\n{x} = 0.2\n{y} = 0.6")));
        assert_eq!(material(&format!("{x} = 0.3\n{y} = 0.3")), material(&format!("{both} = 0.3")));
        for widths in ["", &format!("{x} = 0.2"), &format!("{y} = 0.2")] {
            let expected = format!(
                "gold.toml:1:1: \"{both}\" is missing; expected {both} = a number from {range}, or both {x} and {y}"
            );
            assert_eq!(import(&text(widths)).failure(), expected);
        }
        // An error in one of them is not a second error of the other.
        let failure = import(&text(&format!("{x} = -1\n{y} = 0.6"))).failure();
        assert_eq!(failure, format!("gold.toml:3:{}: {x}: -1 is not a number from {range}", x.len() + 4));
    }
}

#[test]
fn layers_are_materials_in_an_array() {
    let inline = "layers = [{ model = \"lambert\", albedo = 0.5 }, { model = \"phong\", exponent = 64, specular = 0.1 }]";
    let tables = "model = \"layers\"\n[[layers]]\nmodel = \"lambert\"\nalbedo = 0.5\n[[layers]]\nmodel = \"phong\"\n\
                  exponent = 64\nspecular = 0.1";
    let layers = vec![
        Model::Lambert(Lambert::new([0.5; 3]).unwrap()),
        Model::Phong(Phong::new(64.0, [0.1; 3]).unwrap()),
    ];
    for text in [inline, tables] {
        assert_eq!(import(text).artifact::<Material>().0, Model::layers(layers.clone()).unwrap());
    }
}

/// What is read can also be handed on: the artifact's bytes hold the deepest layers that are allowed.
#[test]
fn layers_may_be_nested_to_a_depth() {
    let nested = |depth: usize| {
        let heads = (1..=depth).map(|depth| format!("[[{}]]\n", vec!["layers"; depth].join(".")));
        import(&format!("{}model = \"lambert\"\nalbedo = 0.5", heads.collect::<String>()))
    };
    let mut material = nested(32).artifact::<Material>().0.clone();
    while let Model::Layers(mut layers) = material {
        material = layers.remove(0);
    }
    assert_eq!(material.name(), "lambert");
    let failure = nested(33).failure();
    assert_eq!(
        failure,
        "gold.toml:33:227: layers are nested more than 32 deep; put all of them into one list, because \
         layers are summed"
    );
}

#[test]
fn a_measured_file_is_part_of_the_material() {
    let case = import(
        "layers = [{ model = \"lambert\", albedo = 0.1 }, { model = \"measured\", file = \"paint.csv\", scale = 0.5 }]",
    );
    let ran = case.file("materials/paint.csv", csv()).run().unwrap();
    let read: Vec<_> = ran.reads.iter().map(|read| read.path.clone()).collect();
    assert_eq!(read, ["gold.toml", "paint.csv"].map(|name| Path::new("/memory/materials").join(name)));
    let Model::Layers(layers) = ran.artifact::<Material>().0.clone() else { panic!("no layers") };
    let Model::Measured(paint) = &layers[1] else { panic!("not measured") };
    assert_eq!(paint.scale(), [0.5; 3]);

    let mut foil = String::from("theta_i,phi_i,theta_o,phi_o,r,g,b\n");
    for i in 0..40 {
        foil += &format!("{},{},{},{},0.2,0.1,0.3\n", i * 2, i * 77, (i * 31) % 80, i * 131);
    }
    let found =
        import("model = \"measured\"\nfile = \"foil.csv\"\nscale = 2").file("materials/foil.csv", foil);
    let found = found.artifact::<Material>();
    assert!(matches!(&found.0, Model::MeasuredAnisotropic(foil) if foil.scale() == [2.0; 3]));

    // A source that is such a file itself, and one whose ending says nothing.
    let alone = case_of("paint.csv", &csv());
    assert!(matches!(alone.artifact::<Material>().0, Model::Measured(_)));
    let named = import("model = \"measured\"\nfile = \"paint.txt\"\nformat = \"table\"")
        .file("materials/paint.txt", csv());
    assert!(matches!(named.artifact::<Material>().0, Model::Measured(_)));
}

/// A file of two materials, one of them with a texture in a file beside it.
const PAINTED: &str = r#"{
    "asset": { "version": "2.0" },
    "images": [{ "uri": "textures/red.png" }],
    "textures": [{ "source": 0 }],
    "materials": [
        { "name": "red", "alphaMode": "BLEND", "pbrMetallicRoughness": {
            "metallicFactor": 0, "roughnessFactor": 0.5, "baseColorTexture": { "index": 0 } } },
        { "name": "steel", "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "roughnessFactor": 0.4 } }
    ]
}"#;

fn painted(parameters: &str) -> Case {
    let red = containers::write_png(2, 1, &[[255, 0, 0]; 2], None).unwrap();
    case("import-material", parameters)
        .file("models/painted.gltf", PAINTED)
        .file("models/textures/red.png", red)
        .source("models/painted.gltf")
}

fn standard(base_color: [f64; 3], metallic: f64, roughness: f64) -> Model {
    let parameters = StandardParameters {
        base_color,
        metallic,
        roughness,
        sheen_roughness: 0.1,
        ..StandardParameters::default()
    };
    Model::Standard(Standard::new(parameters).unwrap())
}

#[test]
fn a_material_of_a_gltf_file_is_chosen_by_name_or_number() {
    let ran = painted("material = \"red\"").run().unwrap();
    assert_eq!(ran.artifact::<Material>().0, standard([1.0, 0.0, 0.0], 0.0, 0.5));
    let read: Vec<_> = ran.reads.iter().map(|read| read.path.clone()).collect();
    assert_eq!(read, ["painted.gltf", "textures/red.png"].map(|name| Path::new("/memory/models").join(name)));
    assert_eq!(ran.notes, ["base_color: averaged over 2 x 1 texels of textures/red.png"]);
    assert_eq!(ran.warnings, ["the alphaMode BLEND of the material is not read: the material is opaque"]);
    // Only the textures of the material are read.
    let steel = painted("material = 1").run().unwrap();
    assert_eq!(steel.artifact::<Material>().0, standard([0.5; 3], 1.0, 0.4));
    assert_eq!(steel.reads.len(), 1);
}

/// A glob of such files makes an item of each material.
#[test]
fn a_material_file_may_name_a_material_of_a_gltf_file() {
    let named = |text: &str| {
        let red = containers::write_png(1, 1, &[[255, 0, 0]], None).unwrap();
        import(text)
            .file("materials/helmet/painted.gltf", PAINTED)
            .file("materials/helmet/textures/red.png", red)
    };
    let red = named("model = \"gltf\"\nfile = \"helmet/painted.gltf\"\nmaterial = \"red\"").run().unwrap();
    assert_eq!(red.artifact::<Material>().0, standard([1.0, 0.0, 0.0], 0.0, 0.5));
    assert_eq!(
        red.notes,
        ["helmet/painted.gltf: base_color: averaged over 1 x 1 texels of textures/red.png"]
    );
    assert_eq!(red.reads.len(), 3);
    let layers = "layers = [{ model = \"gltf\", file = \"helmet/painted.gltf\", material = 1 }]";
    let Model::Layers(layers) = named(layers).artifact::<Material>().0.clone() else { panic!("no layers") };
    assert_eq!(layers, [standard([0.5; 3], 1.0, 0.4)]);
    for (text, expected) in [
        (
            "model = \"gltf\"\nfile = \"helmet/painted.gltf\"",
            "gold.toml:2:8: file: the file has 2 materials; expected `material` to be one of: 0: red, 1: steel",
        ),
        (
            "model = \"gltf\"\nfile = \"helmet/painted.gltf\"\nmaterial = 0.5",
            "gold.toml:3:12: material: 0.5 is not the name of a material, or its number, counted from 0",
        ),
        (
            "model = \"gltf\"",
            "gold.toml:1:1: \"file\" is missing; expected file = the path of a .gltf or .glb file, from this file's folder",
        ),
        (
            "model = \"gltf\"\nfile = \"b.glb\"\nlens = 3",
            "gold.toml:3:1: unknown key \"lens\"; expected one of: file, material",
        ),
        ("model = \"gltf\"\nfile = \"b.glb\"", "gold.toml:2:8: file: cannot read /memory/materials/b.glb"),
    ] {
        let failure = named(text).failure();
        assert!(failure.starts_with(expected), "{failure}");
    }
}

/// Base colour, metallic and roughness of a material of the model `standard`.
fn base(material: &Model) -> ([f64; 3], f64, f64) {
    match material {
        Model::Standard(material) => {
            let StandardParameters { base_color, metallic, roughness, .. } = material.parameters();
            (base_color, metallic, roughness)
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn presets_are_materials_and_their_keys_can_be_replaced() {
    let preset = |text: &str| import(text).artifact::<Material>().0.clone();
    let copper = preset("material = \"copper\"");
    assert_eq!(base(&copper), ([0.932, 0.623, 0.522], 1.0, 0.3));
    assert_eq!(base(&preset("roughness = 0.6\nmaterial = \"copper\"")), ([0.932, 0.623, 0.522], 1.0, 0.6));
    let Model::Layers(layers) = preset("layers = [{ material = \"copper\" }]") else { panic!("no layers") };
    assert_eq!(layers, std::slice::from_ref(&copper));
    // A stage needs no file for one.
    let stage = case("import-material", "material = \"copper\"");
    assert_eq!(stage.artifact::<Material>().0, copper);
    for (text, expected) in [
        (
            "material = \"coper\"",
            "gold.toml:1:12: material: there is no preset \"coper\"; did you mean \"copper\"?",
        ),
        ("material = 3", "gold.toml:1:12: material: 3 is not the name of a preset"),
        ("material = \"copper\"\nexponent = 3", "gold.toml:2:1: unknown key \"exponent\""),
        ("material = \"copper\"\nroughness = 3", "gold.toml:2:13: roughness: 3 is not "),
        ("model = \"copper\"", "gold.toml:1:9: there is no model \"copper\""),
    ] {
        let failure = import(text).failure();
        assert!(failure.starts_with(expected), "{failure}");
    }
}

const MTLX: &str = r#"<?xml version="1.0"?>
<materialx version="1.39">
  <standard_surface name="SR_red" type="surfaceshader">
    <input name="base_color" type="color3" value="0.5, 0.1, 0.1" />
    <input name="specular_roughness" type="float" value="0.5" />
    <input name="emission" type="float" value="1" />
  </standard_surface>
  <surfacematerial name="Red" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="SR_red" />
  </surfacematerial>
</materialx>
"#;

#[test]
fn a_material_of_a_materialx_file_is_one_of_the_standard_model() {
    let file = |parameters: &str, text: &str| {
        case("import-material", parameters).file("models/red.mtlx", text).source("models/red.mtlx")
    };
    let ran = file("", MTLX).run().unwrap();
    assert_eq!(base(&ran.artifact::<Material>().0), ([0.5, 0.1, 0.1], 0.0, 0.5));
    assert_eq!(ran.warnings, ["line 6: emission: emitted light is left out"]);
    let named = "model = \"materialx\"\nfile = \"red.mtlx\"\nmaterial = \"Red\"";
    let ran = import(named).file("materials/red.mtlx", MTLX).run().unwrap();
    assert_eq!(base(&ran.artifact::<Material>().0), ([0.5, 0.1, 0.1], 0.0, 0.5));
    assert_eq!(ran.warnings, ["red.mtlx: line 6: emission: emitted light is left out"]);
    assert_eq!(
        file("material = \"blue\"", MTLX).failure(),
        "red.mtlx: there is no material \"blue\"; expected one of: 0: Red"
    );
    let broken = file("", &MTLX.replace("</materialx>", "</a>")).failure();
    assert!(broken.starts_with("red.mtlx: line 11, column "), "{broken}");
    let without = import("model = \"materialx\"").failure();
    assert!(without.contains("expected file = the path of a .mtlx file"), "{without}");
}

#[test]
fn errors_of_gltf_materials_name_the_file() {
    let failure = painted("").failure();
    assert_eq!(
        failure,
        "painted.gltf: the file has 2 materials; expected `material` to be one of: 0: red, 1: steel"
    );
    let failure = painted("material = \"blue\"").failure();
    assert_eq!(failure, "painted.gltf: there is no material \"blue\"; expected one of: 0: red, 1: steel");
    let without = painted("material = \"red\"").file("models/textures/red.png", "PNG").failure();
    let place = "painted.gltf: materials[0].pbrMetallicRoughness.baseColorTexture: textures/red.png: ";
    assert!(without.starts_with(place), "{without}");
    let toml =
        case("import-material", "material = \"red\"").file("a.toml", "model = \"lambert\"").source("a.toml");
    assert!(
        toml.failure()
            .starts_with("a.toml is not a glTF or MaterialX file, so there is no material to choose from")
    );
    assert_eq!(case("import-material", "material = -1").errors().len(), 1);
}

/// The helmet's materials, with their textures beside.
#[test]
fn materials_of_the_corpus_are_imported() {
    let Some(corpus) = test_data::folder("materials_of_the_corpus_are_imported", "SPECULA_CORPUS") else {
        return;
    };
    let folder = corpus.join("mesh/FlightHelmet");
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    let mut case = case("import-material", "material = \"LeatherPartsMat\"")
        .file("FlightHelmet.gltf", read("FlightHelmet.gltf"))
        .source("FlightHelmet.gltf");
    for part in ["BaseColor", "OcclusionRoughMetal"] {
        let name = format!("FlightHelmet_Materials_LeatherPartsMat_{part}.png");
        case = case.file(&name, read(&name));
    }
    let ran = case.run().unwrap();
    assert_eq!((ran.reads.len(), ran.notes.len(), ran.warnings.len()), (3, 2, 0));
    assert_eq!(ran.artifact::<Material>().0.name(), "standard");
}

fn case_of(name: &str, text: &str) -> Case {
    case("import-material", "").file(name, text).source(name)
}

#[test]
fn errors_of_measured_files_say_what_and_where() {
    for (text, expected) in [
        ("model = \"measured\"", "gold.toml:1:1: \"file\" is missing"),
        (
            "model = \"measured\"\nfile = \"paint.txt\"",
            "gold.toml:2:8: file: \"paint.txt\" does not have the extension of a measured BRDF; expected one of: .binary (merl), .brdf \
             (cornell), .curet (curet), .csv (table); or name the format, such as format = \"merl\"",
        ),
        (
            "model = \"measured\"\nfile = \"nowhere.csv\"",
            "gold.toml:2:8: file: cannot read /memory/materials/nowhere.csv",
        ),
        ("model = \"measured\"\nfile = \"broken.csv\"", "gold.toml:2:8: file: "),
        (
            "model = \"measured\"\nfile = \"a.csv\"\nformat = \"mrl\"",
            "gold.toml:3:10: format: \"mrl\" is not one of: \"merl\", \"cornell\", \"curet\", \"table\"",
        ),
    ] {
        let failure = import(text).file("materials/broken.csv", "theta_i\n1\n").failure();
        assert!(failure.starts_with(expected), "{failure}");
    }
    let failure = case_of("broken.brdf", "this is none").failure();
    assert!(failure.contains("broken.brdf"), "{failure}");
}

/// The files of CURET are beside the material file, in a folder; each is read, so that an edit reruns the
/// item.
#[test]
fn a_sample_of_the_files_that_curet_publishes() {
    let table: String = (1..=205)
        .map(|i| {
            let i = f64::from(i);
            let (theta_v, theta_i) = ((i * 0.754_877).fract() * 1.4, (i * 0.569_840).fract() * 1.4);
            format!("{i}  {theta_v} {}  {theta_i} 0.5\r\n", i * 2.399_963)
        })
        .collect();
    let values = |value: &str| format!("6 {}\n7 {}\n", " 9".repeat(205), format!(" {value}").repeat(205));
    let felt = |text: &str| {
        import(text)
            .file("materials/curet/table.txt", table.as_str())
            .file("materials/curet/rbrdf.dat", values("0.2"))
            .file("materials/curet/gbrdf.dat", values("0.1"))
            .file("materials/curet/bbrdf.dat", values("0.05"))
    };
    let text = "model = \"measured\"\nfile = \"curet\"\nsample = 7\nscale = 2";
    let ran = felt(text).run().unwrap();
    assert_eq!(ran.reads.len(), 5, "{:?}", ran.reads);
    assert!(ran.notes[0].starts_with("curet: 205 measurements were fitted"), "{:?}", ran.notes);
    let material = ran.artifact::<Material>();
    let up = sphere::Direction::Z;
    for (found, expected) in material.0.rho_hat(up, up).into_iter().zip([0.4, 0.2, 0.1]) {
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }
    assert_eq!(felt(text).check(), None);
    for (key, expected) in [
        ("sample = 8", "gold.toml:2:8: file: curet: rbrdf.dat: there is no sample 8; the last is 7"),
        ("sample = -1", "gold.toml:3:10: sample: -1 is not the number of a sample, from 1 on"),
        ("sample = 7\nformat = \"merl\"", "gold.toml:3:10: sample: only format = \"curet\" has samples"),
    ] {
        let failure = felt(&format!("model = \"measured\"\nfile = \"curet\"\n{key}")).failure();
        assert!(failure.starts_with(expected), "{failure}");
    }
    let gone = import("model = \"measured\"\nfile = \"curet\"\nsample = 7").failure();
    assert!(gone.starts_with("gold.toml:2:8: file: cannot read /memory/materials/curet/table.txt"), "{gone}");
}

#[test]
fn all_errors_are_reported_each_with_its_place() {
    let failure = import("model = \"phong\"\nexponant = 4\nspecular = [1, 2]\n").run().err().unwrap();
    assert_eq!(
        failure.chain,
        [
            "gold.toml: 3 errors",
            "gold.toml:1:1: \"exponent\" is missing; expected exponent = a number from 0 to 1e9",
            "gold.toml:2:1: unknown key \"exponant\"; expected one of: exponent, specular; did you mean \"exponent\"?",
            "gold.toml:3:12: specular: 2 numbers are not a colour; expected a colour: [red, green, blue] or one \
             number for a grey, each a number from 0 to 1e6",
        ]
    );
    let layers = "layers = [\n  { model = \"phong\", exponent = -4, specular = [1, -2, \"x\"] },\n  { model = \"labmert\" },\n  \
                  3,\n  { model = \"lafortune\", lobes = [{ cx = 1, cz = 99 }, 7] },\n]\n";
    let failure = import(layers).run().err().unwrap();
    assert_eq!(
        failure.chain,
        [
            "gold.toml: 8 errors".to_owned(),
            "gold.toml:2:33: exponent: -4 is not a number from 0 to 1e9".into(),
            "gold.toml:2:52: specular: -2 is not a number from 0 to 1e6".into(),
            "gold.toml:2:56: specular: \"x\" is not a number from 0 to 1e6".into(),
            format!(
                "gold.toml:3:13: there is no model \"labmert\"; expected one of: {}; did you mean \"lambert\"?",
                models()
            ),
            "gold.toml:4:3: layers[2]: 3 is not a table { model, ... }".into(),
            "gold.toml:5:35: \"lobes[0].n\" is missing; expected n = a number from 0 to 1e6".into(),
            "gold.toml:5:50: lobes[0].cz: 99 is not a number from -10 to 10".into(),
            "gold.toml:5:56: lobes[1]: 7 is not a table".into(),
        ]
    );
}

#[test]
fn one_fault_stands_alone() {
    let expected_models = format!("expected one of: {}", models());
    for (text, expected) in [
        (
            "model = \"fong\"",
            format!("gold.toml:1:9: there is no model \"fong\"; {expected_models}; did you mean \"phong\"?"),
        ),
        ("albedo = 1", format!("gold.toml:1:1: \"model\" is missing; {expected_models}")),
        ("model = \"GGX\"", format!("gold.toml:1:9: there is no model \"GGX\"; {expected_models}; did you mean \"ggx\"?")),
        (
            "Model = \"ggx\"",
            format!("gold.toml:1:1: \"model\" is missing; {expected_models}; did you mean \"model\" instead of \"Model\"?"),
        ),
        (
            "model = \"lambert\"\nalbedo = 1\nlayers = [{ model = \"phong\", exponent = 3 }]",
            "gold.toml:3:1: `layers` cannot be combined with model = \"lambert\"; make the model one of the layers".into(),
        ),
        ("model = 3", format!("gold.toml:1:9: 3 is not a string; {expected_models}")),
        ("model = \"phong\"\nexponent = -1", "gold.toml:2:12: exponent: -1 is not a number from 0 to 1e9".into()),
        ("model = \"microfacet\"\nsigma = 0", "gold.toml:2:9: sigma: 0 is not a number from 1e-4 to 100".into()),
        ("model = \"ggx\"\nroughness = 0.5", "gold.toml:1:1: ior is missing; give ior, or n and k".into()),
        (
            "model = \"ggx\"\nroughness = 0.5\nior = 1.5\nn = 1",
            "gold.toml:3:7: ior conflicts with n or k; give ior, or n and k".into(),
        ),
        (
            "model = \"lafortune\"\nlobes = [{ cx = -9, cz = 9, n = 900 }]",
            "gold.toml:2:33: lobes[0].n: 900 is not a power that keeps the lobe, max(|cx|, |cz|)^n, at 1e9 or below".into(),
        ),
        (
            "layers = [{ model = \"kajiya-kay\", exponent = 3 }, { model = \"lambert\", albedo = 1 }]",
            "gold.toml:1:10: layers: kajiya-kay is taken about the tangent and lambert is not: they have no common \
             centre; expected layers of kajiya-kay alone, or none"
                .into(),
        ),
        ("layers = []", "gold.toml:1:10: layers: there is no layer; expected one or more".into()),
        (
            "model = \"layers\"",
            "gold.toml:1:1: \"layers\" is missing; expected layers = an array of tables { model, ... }".into(),
        ),
        (
            "model = \"lambert\"\nalbedo = 2e6",
            "gold.toml:2:10: albedo: 2000000 is not a number from 0 to 1e6".into(),
        ),
    ] {
        assert_eq!(import(text).failure(), expected);
    }
    let failure = import("model = \n").failure();
    assert!(failure.starts_with("gold.toml:1:9: a value is missing"), "{failure}");
}

#[test]
fn a_material_that_makes_light_is_warned_of() {
    let ran = import("model = \"lambert\"\nalbedo = [0.5, 1.5, 0.5]\n").run().unwrap();
    assert_eq!(
        ran.warnings,
        [
            "the material reflects more light than falls on it: 1.500 times as much when viewed 0 degrees from the normal"
        ]
    );
    let both = "layers = [{ model = \"lambert\", albedo = 0.8 }, { model = \"phong\", exponent = 9, specular = 0.8 }]";
    assert_eq!(import(both).run().unwrap().warnings.len(), 1);
    assert!(import("model = \"lambert\"\nalbedo = 1\n").run().unwrap().warnings.is_empty());
}

#[test]
fn equal_materials_are_equal_bytes() {
    let bytes = |text: &str| match import(text).run().unwrap().output {
        Output::Artifact { bytes, .. } => bytes,
        _ => unreachable!(),
    };
    let one = bytes("model = \"phong\"\nexponent = 3\nspecular = 0.5");
    assert_eq!(one, bytes("specular = [0.5, 0.5, 0.5]\nexponent = 3.0\nmodel = \"phong\" # shiny"));
    assert!(Material::decode(&one[..one.len() - 1]).is_err());
}

#[test]
fn a_folder_is_no_material() {
    let folder = case("import-material", "").file("materials/gold.toml", "").source("materials");
    let failure = folder.run().err().unwrap();
    assert_eq!(failure.chain, ["materials is a folder, not a material"]);
    assert!(failure.help.unwrap().contains("*.toml"));
}

/// For pictures, and tables with another extension, syntax errors are not listed.
#[test]
fn a_file_that_is_not_a_material_is_reported_as_such() {
    for content in [&b"\x76\x2f\x31\x01\xff"[..], b"theta_i,theta_o\n1,2\n3,4\n"] {
        let failure =
            case("import-material", "").file("sky.exr", content).source("sky.exr").run().err().unwrap();
        assert_eq!(failure.chain.len(), 2, "{:?}", failure.chain);
        assert_eq!(
            failure.chain[0],
            "sky.exr is not TOML, and does not have the extension of a measured BRDF"
        );
        assert!(failure.help.unwrap().contains(".toml, .gltf, .glb, .mtlx, or one of: .binary (merl)"));
    }
    // TOML under any name is a material.
    assert_eq!(
        case_of("gold.mat", "model = \"phong\"\nexponent = 3").artifact::<Material>().0.name(),
        "phong"
    );
}
