//! What a preview finds in a graph, and the scenes that it reads from results.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use containers::{Precision, write_exr};
use engine::{BuildOptions, Cancel, Event, ItemIndex, Plan, ResultsSnapshot};
use preview::{Aim, Look, MapSizes, Mode, Scene};
use sphere::{Direction, LatLong};
use stages::{PreviewCatalog, SceneCache};

use crate::fixture::kinds;

const SOURCES: &str = r#"
schema = 1

[stage.environment]
kind = "import-environment"
source = "light/*.exr"

[stage.material]
kind = "import-material"
source = "paint/*.toml"

[stage.lighting]
kind = "project-sh"
input = "environment"
degree = 2

[stage.coefficients]
kind = "project-brdf"
input = "material"
degree = [2, 1]
"#;

pub(crate) const REFLECTION: &str = r#"
[stage.reflection]
kind = "convolve"
inputs = { lighting = "lighting", brdf = "coefficients" }
"#;

/// A project of two lights and two paints, with more stages.
pub(crate) fn project(stages: &str) -> (tempfile::TempDir, Plan) {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    let grid = LatLong::with_rows(8);
    for (name, toward) in [("east", [0.0, 1.0, 0.0]), ("north", [1.0, 0.0, 0.0])] {
        let lamp = Direction::normalised(toward.into());
        let pixels = (0..grid.len()).map(|pixel| {
            let lit = grid.direction(pixel / grid.width, pixel % grid.width).vector().dot(lamp.vector());
            [lit.max(0.0) as f32; 3]
        });
        let image = envmap::Image::new(grid.width, grid.height, pixels.collect()).unwrap();
        write(&format!("light/{name}.exr"), &write_exr(&image, Precision::Float, None).unwrap().bytes);
    }
    write("paint/gold.toml", b"model = \"phong\"\nexponent = 4\nspecular = [1.0, 0.8, 0.3]\n");
    write("paint/tin.toml", b"model = \"lambert\"\nalbedo = 0.5\n");
    write("paint/white.txt", b"");
    write("pipeline.toml", format!("{SOURCES}{stages}").as_bytes());
    let plan = load(folder.path());
    (folder, plan)
}

pub(crate) fn load(folder: &Path) -> Plan {
    Plan::load(&folder.join("pipeline.toml"), &kinds()).unwrap_or_else(|errors| panic!("{errors}"))
}

pub(crate) fn build(plan: &Plan) -> ResultsSnapshot {
    let failed = |event: Event| assert!(!matches!(event, Event::Failed { .. }), "{event:?}");
    engine::build(plan, &BuildOptions::default(), &Cancel::default(), &failed).unwrap();
    ResultsSnapshot::open(plan).unwrap()
}

/// The name of the stage of an item.
pub(crate) fn stage_name(plan: &Plan, item: ItemIndex) -> &str {
    &plan.stages[plan.items[item].stage].name
}

/// Describes the subjects that can be shown, a line for each entry: its names and what exports it.
pub(crate) fn described(catalog: &PreviewCatalog) -> String {
    let mut text = String::new();
    for environment in catalog.environments() {
        for material in catalog.materials() {
            let Some(entry) = catalog.entry(environment, material).unwrap() else { continue };
            let stage = |item: &ItemIndex| stage_name(catalog.plan(), *item).to_owned();
            let exports = entry.exports.iter().map(stage).collect::<Vec<_>>().join(", ");
            let made = entry.reflection.or(entry.table).unwrap();
            let _ = writeln!(text, "{material} under {environment}: {} -> {exports}", stage(&made));
        }
    }
    text
}

#[test]
fn every_pair_that_is_reflected_is_shown_under_the_names_of_its_files() {
    let export = "[stage.map]\nkind = \"export-shrm\"\ninput = \"reflection\"\nresolution = 8\n";
    let (_folder, plan) = project(&format!("{REFLECTION}{export}"));
    let catalog = PreviewCatalog::of(plan);
    let pairs = "gold under east: reflection -> map\ntin under east: reflection -> map\n\
                 gold under north: reflection -> map\ntin under north: reflection -> map\n";
    assert_eq!(described(&catalog), pairs);
    let stages = catalog.stages(catalog.entry("east", "gold").unwrap().unwrap(), "sphere");
    let stages = stages.into_iter().collect::<Vec<_>>();
    assert_eq!(stages, ["coefficients", "environment", "lighting", "material", "reflection"]);
    assert_eq!(catalog.catalog().pairs, [(0, 0), (0, 1), (1, 0), (1, 1)].into());
    assert!(catalog.check_environment("north").is_ok() && catalog.check_material("north").is_err());
    let unknown = catalog.entry("nort", "gold").unwrap_err();
    assert_eq!((unknown.what, &unknown.known[..]), ("environment", &["east".to_owned(), "north".into()][..]));
    assert!(catalog.check_mesh("torus-knot").is_ok() && catalog.check_mesh("torus").is_err());
}

#[test]
fn of_several_reflections_of_a_pair_those_that_are_exported_are_shown() {
    let turned = "[stage.turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 90.0\n\
                  [stage.other]\nkind = \"convolve\"\ninputs = { lighting = \"turned\", brdf = \"coefficients\" }\n";
    let both = format!("{REFLECTION}{turned}");
    let catalog = PreviewCatalog::of(project(&both).1);
    assert_eq!(catalog.materials(), ["gold (reflection)", "tin (reflection)", "gold (other)", "tin (other)"]);
    let export = "[stage.map]\nkind = \"export-shrm\"\ninput = \"other\"\n";
    let catalog = PreviewCatalog::of(project(&format!("{both}{export}")).1);
    assert_eq!(catalog.materials(), ["gold", "tin"]);
    assert!(described(&catalog).starts_with("gold under east: other -> map\n"));
    // A stage that gathers many items is not an export of one of them.
    let sheet = "[stage.sheet]\nkind = \"contact-sheet\"\n\
                 inputs = { environment = \"environment\", lighting = \"lighting\", reflection = \"reflection\" }\n";
    let catalog = PreviewCatalog::of(project(&format!("{both}{export}{sheet}")).1);
    assert!(described(&catalog).starts_with("gold under east: other -> map\n"));
}

#[test]
fn what_is_not_built_is_not_shown() {
    let matte = "[stage.matte]\nkind = \"convolve\"\n\
                 inputs = { lighting = \"lighting\", brdf = \"coefficients\" }\n";
    let export = "[stage.map]\nkind = \"export-shrm\"\ninput = \"reflection\"\n";
    let plan = project(&format!("{REFLECTION}{matte}{export}")).1;
    let among = |stage: &str| described(&PreviewCatalog::among(plan.clone(), &[stage.to_owned()]));
    assert!(among("map").starts_with("gold under east: reflection -> map\n"));
    assert!(among("matte").starts_with("gold under east: matte -> \n"));
    assert_eq!(among("coefficients"), "");
}

#[test]
fn materials_of_one_name_are_distinguished_by_their_stages() {
    let more = r#"
[stage.finish]
kind = "import-material"
source = "paint/gold.toml"
[stage.rough]
kind = "project-brdf"
input = "finish"
degree = [1, 0]
[stage.shine]
kind = "convolve"
inputs = { lighting = "lighting", brdf = "rough" }
[stage.all]
kind = "import-material"
source = "paint/*.toml"
[stage.fine]
kind = "project-brdf"
input = "all"
degree = [2, 0]
[stage.glow]
kind = "convolve"
inputs = { lighting = "lighting", brdf = "fine" }
"#;
    let catalog = PreviewCatalog::of(project(&format!("{REFLECTION}{more}")).1);
    let names = catalog.materials().iter().map(String::as_str).collect::<BTreeSet<_>>();
    assert_eq!(names.len(), 5, "{names:?}");
    let expected = ["gold (all)", "gold (finish)", "gold (material)", "tin (all)", "tin (material)"];
    assert_eq!(names.into_iter().collect::<Vec<_>>(), expected);
}

#[test]
fn meshes_of_the_graph_come_before_the_built_in_ones() {
    let mesh = "[stage.mesh]\nkind = \"import-mesh\"\nsource = \"shapes/*.glb\"\n";
    let (folder, plan) = project(REFLECTION);
    assert_eq!(PreviewCatalog::of(plan).meshes(), ["sphere", "torus-knot", "plane"]);
    for name in ["helmet", "sphere"] {
        fs::create_dir_all(folder.path().join("shapes")).unwrap();
        fs::write(folder.path().join(format!("shapes/{name}.glb")), "").unwrap();
    }
    fs::write(folder.path().join("pipeline.toml"), format!("{SOURCES}{REFLECTION}{mesh}")).unwrap();
    let catalog = PreviewCatalog::of(load(folder.path()));
    let names = ["helmet", "sphere (mesh)", "sphere (built-in)", "torus-knot", "plane"];
    assert_eq!(catalog.meshes(), names);
    let entry = catalog.entry("east", "gold").unwrap().unwrap();
    assert!(catalog.stages(entry, "helmet").contains("mesh"));
    assert!(!catalog.stages(entry, "plane").contains("mesh"), "a still needs no other mesh");
    let built = ["reflection".to_owned()];
    assert!(!PreviewCatalog::among(load(folder.path()), &built).meshes().contains(&"helmet".into()));
    let results = ResultsSnapshot::open(catalog.plan()).unwrap();
    let mesh = |name: &str| SceneCache::default().mesh(&catalog, &results, name);
    assert!(mesh("plane").is_ok());
    assert_eq!(
        mesh("helmet").unwrap_err().chain[0],
        "mesh [helmet] has not been built yet, or its result was removed"
    );
}

#[test]
fn the_sizes_of_maps_are_those_that_exports_fix() {
    let entry = |stages: &str| {
        let catalog = PreviewCatalog::of(project(&format!("{REFLECTION}{stages}")).1);
        catalog.entry("east", "gold").unwrap().unwrap().clone()
    };
    let sizes = |stages: &str| entry(stages).sizes;
    let of = |edge, slices| MapSizes { edge, slices };
    let holds_lamps = |stages: &str| entry(stages).holds_lamps;
    let stage = |name: &str, more: &str| {
        format!("[stage.{name}]\nkind = \"export-{name}\"\ninput = \"reflection\"\n{more}\n")
    };
    let beside = stage("shrm", "lamps = \"separate\"");
    assert!(!holds_lamps("") && holds_lamps(&stage("shrm", "lamps = \"baked\"")) && !holds_lamps(&beside));
    for kind in ["shrm", "cabral", "kautz-mccool", "reflection-map"] {
        let together = stage(kind, "parts = \"together\"");
        assert!(entry(&together).joins_parts && !entry(&stage(kind, "")).joins_parts, "{kind}");
    }
    let mixed = stage("shrm", "parts = \"together\"") + &stage("cabral", "");
    assert!(!entry("").joins_parts && !entry(&mixed).joins_parts);
    assert_eq!(sizes(""), of(64, 16));
    assert_eq!(sizes(&stage("shrm", "resolution = 24")), of(24, 16));
    assert_eq!(sizes(&stage("shrm", "resolution = 25\nlayout = \"lat-long\"")), of(13, 16));
    assert_eq!(sizes(&stage("shrm", "resolution = \"auto\"")), of(64, 16));
    let volume = stage("kautz-mccool", "resolution = 40\nslices = 9");
    assert_eq!(sizes(&volume), of(20, 9));
    assert_eq!(sizes(&(volume + &stage("cabral", "resolution = 12"))), of(20, 9));
    assert_eq!(sizes(&stage("kautz-mccool", "")), of(64, 16));
}

#[test]
fn without_a_reflection_of_an_environment_there_is_nothing_to_show() {
    let catalog = PreviewCatalog::of(project("").1);
    assert!(catalog.is_empty());
    assert_eq!(described(&catalog), "");
}

#[test]
fn a_scene_is_read_from_the_last_build_and_stays_the_same_value_until_its_parts_change() {
    let export = "[stage.map]\nkind = \"export-shrm\"\ninput = \"reflection\"\nresolution = 8\n";
    let (folder, plan) = project(&format!("{REFLECTION}{export}accept = [90, 99]\n"));
    let catalog = PreviewCatalog::of(plan.clone());
    let mut scenes = SceneCache::default();
    let entry = |material: &str| catalog.entry("east", material).unwrap().unwrap().clone();
    let empty = ResultsSnapshot::open(&plan).unwrap();
    let failure = scenes.look(&plan, &empty, &entry("gold")).unwrap_err();
    assert_eq!(failure.chain[0], "environment [east] has not been built yet, or its result was removed");

    let results = build(&plan);
    let scene = scenes.scene(&catalog, &results, &entry("gold"), "sphere").unwrap();
    let look = &scene.objects[0].look;
    assert_eq!((look.cube().edge, look.centre()), (8, brdf::Centre::Reflection));
    assert_eq!(look.light().lighting().degree().get(), 2);
    assert!(look.material().is_some());
    let file = (0..2).find_map(|file| results.file_digest(entry("gold").exports[0], file)).unwrap();
    let file = containers::tensors::decode_shrm(&results.read_file(file).unwrap()).unwrap();
    let p = |look: &Look| look.local().unwrap().iter().map(|map| map.p().get()).max().unwrap();
    assert_eq!((file.p().get(), p(look), look.reflection().unwrap().brdf().p().get()), (0, 0, 1));
    let facts = catalog.facts(&results, &entry("gold"));
    assert_eq!(facts.exports.len(), 1);
    assert!(facts.exports[0].name == "export-shrm, safetensors" && facts.exports[0].bytes > 8 * 8 * 6 * 12);
    assert!(
        facts.notes.iter().any(|note| note.starts_with("lighting: degree 2 holds ")),
        "{:?}",
        facts.notes
    );
    let tin = scenes.look(&plan, &results, &entry("tin")).unwrap();
    assert!(Arc::ptr_eq(tin.light(), look.light()), "one light for both");

    fs::write(folder.path().join("paint/gold.toml"), "model = \"phong\"\nexponent = 2\n").unwrap();
    let results = build(&plan);
    let again = scenes.scene(&catalog, &results, &entry("gold"), "sphere").unwrap();
    assert!(!Arc::ptr_eq(&again.objects[0].look, look));
    assert!(Arc::ptr_eq(&again.objects[0].mesh, &scene.objects[0].mesh));
    assert!(Arc::ptr_eq(&scenes.look(&plan, &results, &entry("tin")).unwrap(), &tin));
}

/// Builds only these stages and those that they need.
pub(crate) fn build_only(plan: &Plan, stages: &[&str]) -> ResultsSnapshot {
    let stages = stages.iter().map(ToString::to_string).collect();
    let only = BuildOptions { stages, ..BuildOptions::default() };
    engine::build(plan, &only, &Cancel::default(), &|_| {}).unwrap();
    ResultsSnapshot::open(plan).unwrap()
}

#[test]
fn a_look_has_no_maps_until_they_are_made_of_its_light_and_its_material() {
    let (folder, plan) = project(REFLECTION);
    let catalog = PreviewCatalog::of(plan.clone());
    let entry = catalog.entry("east", "gold").unwrap().unwrap();
    let mut scenes = SceneCache::default();
    let first = build_only(&plan, &["environment", "material"]);
    let bare = scenes.look(&plan, &first, entry).unwrap();
    assert!(!bare.has_maps() && bare.material().is_some());
    let results = build(&plan);
    let look = scenes.look(&plan, &results, entry).unwrap();
    assert!(look.has_maps());
    assert_eq!(look.material(), bare.material());
    let is_older = |results: &ResultsSnapshot| {
        catalog.facts(results, entry).notes.iter().any(|note| note.contains("older than its inputs"))
    };
    assert!(!is_older(&results));

    // Only the material is rebuilt, not what is made from it.
    fs::write(folder.path().join("paint/gold.toml"), "model = \"phong\"\nexponent = 2\n").unwrap();
    let results = build_only(&plan, &["material"]);
    assert!(is_older(&results));
    let edited = scenes.look(&plan, &results, entry).unwrap();
    assert!(!edited.has_maps() && edited.material() != look.material(), "it is not the old picture");
    assert!(Arc::ptr_eq(edited.light(), look.light()), "its light has not changed");
    assert!(Arc::ptr_eq(&scenes.look(&plan, &results, entry).unwrap(), &edited));

    let results = build(&plan);
    assert!(!is_older(&results) && scenes.look(&plan, &results, entry).unwrap().has_maps());

    // The new light is shown before it is projected.
    fs::copy(folder.path().join("light/north.exr"), folder.path().join("light/east.exr")).unwrap();
    let results = build_only(&plan, &["environment"]);
    let relit = scenes.look(&plan, &results, entry).unwrap();
    let lit =
        |look: &Look| look.light().environment().radiance(Direction::normalised([1.0, 0.0, 0.0].into()))[0];
    assert!(!relit.has_maps() && lit(&relit) > 0.9 && lit(&look) < 0.1, "{} {}", lit(&relit), lit(&look));
}

#[test]
fn maps_of_a_material_that_no_longer_imports_stay() {
    let (folder, plan) = project(REFLECTION);
    let catalog = PreviewCatalog::of(plan.clone());
    let entry = catalog.entry("east", "gold").unwrap().unwrap();
    build(&plan);
    fs::write(folder.path().join("paint/gold.toml"), "model = \"phong\"\nexponent = -1\n").unwrap();
    engine::build(&plan, &BuildOptions::default(), &Cancel::default(), &|_| {}).unwrap();
    let results = ResultsSnapshot::open(&plan).unwrap();
    assert!(SceneCache::default().look(&plan, &results, entry).unwrap().has_maps(), "the last valid picture");
}

#[test]
fn an_edited_material_is_shown_without_maps_and_is_the_same_value_until_it_changes() {
    let (_folder, plan) = project(REFLECTION);
    let catalog = PreviewCatalog::of(plan.clone());
    let entry = catalog.entry("east", "gold").unwrap().unwrap();
    let results = build(&plan);
    let mut scenes = SceneCache::default();
    let built = scenes.scene(&catalog, &results, entry, "sphere").unwrap();
    let mut edited = |albedo: f64| {
        let material = brdf::Material::Lambert(brdf::Lambert::new([albedo; 3]).unwrap());
        let scene = scenes.edited(&catalog, &results, entry, "sphere", &material).unwrap();
        assert_eq!(scene.objects[0].look.material(), Some(&material));
        scene
    };
    let [one, again, other] = [0.5, 0.5, 0.6].map(&mut edited);
    let same = |one: &Scene, other: &Scene| Arc::ptr_eq(&one.objects[0].look, &other.objects[0].look);
    assert!(same(&one, &again) && !same(&one, &other) && !other.has_maps());
    assert!(Arc::ptr_eq(&one.light, &built.light));
}

/// The lamp of `east` is turned by 90 degrees about +Z: from +Y to -X.
#[test]
fn an_environment_is_turned_as_its_lighting_is() {
    let turned = "[stage.turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 90.0\n\
                  [stage.other]\nkind = \"convolve\"\ninputs = { lighting = \"turned\", brdf = \"coefficients\" }\n";
    let (_folder, plan) = project(turned);
    let results = build(&plan);
    let catalog = PreviewCatalog::of(plan);
    let entry = catalog.entry("east", "gold").unwrap().unwrap();
    let look = SceneCache::default().look(catalog.plan(), &results, entry).unwrap();
    let toward = |x: f64| Direction::normalised([x, 0.0, 0.0].into());
    let radiance = |x: f64| look.light().environment().radiance(toward(x))[0];
    assert!(radiance(-1.0) > 0.9 && radiance(1.0) < 0.1, "{} {}", radiance(-1.0), radiance(1.0));
    let harmonics = |x: f64| look.light().lighting().evaluate(toward(x))[0];
    assert!(harmonics(-1.0) > 0.8 && harmonics(1.0) < 0.2, "{} {}", harmonics(-1.0), harmonics(1.0));
}

/// A brushed metal that is tabulated, and a mesh with its transfer.
const TABULATED: &str = r#"
[stage.metal]
kind = "import-material"
source = "metal/*.toml"
[stage.table]
kind = "tabulate-brdf"
input = "metal"
degree = 2
resolution = 8
[stage.mesh]
kind = "import-mesh"
source = "shapes/*.glb"
[stage.transfer]
kind = "precompute-transfer"
input = "mesh"
degree = 1
directions = 32
[stage.lamps]
kind = "circular-lights"
source = "lamps.toml"
[stage.turned]
kind = "rotate"
input = "lamps"
yaw = 90.0
"#;

pub(crate) fn tabulated(stages: &str) -> (tempfile::TempDir, Plan) {
    let (folder, _) = project("");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    write("metal/steel.toml", b"model = \"ward\"\nroughness = 0.2\nroughness_y = 0.5\n");
    write("shapes/knot.glb", include_bytes!("../../../../assets/meshes/knot.glb"));
    write("pot.glb", include_bytes!("../../../../examples/brushed/meshes/teapot.glb"));
    write("lamps.toml", b"[[light]]\ndirection = [0, 1, 0]\nangular_radius = 20\nradiance = 3\n");
    write("pipeline.toml", format!("{SOURCES}{TABULATED}{stages}").as_bytes());
    let plan = load(folder.path());
    (folder, plan)
}

pub(crate) fn shaded(name: &str, lighting: &str) -> String {
    format!(
        "[stage.{name}]\nkind = \"shade-vertices\"\n\
         inputs = {{ mesh = \"mesh\", table = \"table\", lighting = \"{lighting}\" }}\n"
    )
}

#[test]
fn a_table_is_shown_under_the_lights_under_which_vertices_are_shaded() {
    let catalog = PreviewCatalog::of(tabulated("").1);
    assert!(catalog.is_empty(), "no stage combines the table with a light");
    let stages = shaded("sunlit", "lighting") + &shaded("lamplit", "turned");
    let catalog = PreviewCatalog::of(tabulated(&stages).1);
    let expected =
        "steel under east: table -> \nsteel under north: table -> \nsteel under lamps: table -> \n";
    assert_eq!(described(&catalog), expected);
    let entry = catalog.entry("lamps", "steel").unwrap().unwrap();
    let stages = |mesh: &str| catalog.stages(entry, mesh).into_iter().collect::<Vec<_>>();
    assert_eq!(stages("plane"), ["lamps", "metal", "table", "turned"]);
    assert_eq!(stages("knot"), ["lamps", "mesh", "metal", "table", "transfer", "turned"]);
    let parts = catalog.parts(entry, "knot").into_iter().map(|item| stage_name(catalog.plan(), item));
    assert_eq!(parts.collect::<Vec<_>>(), ["lamps", "metal", "mesh", "transfer", "table"]);
}

#[test]
fn a_table_of_a_reflected_material_belongs_to_its_reflection() {
    let stages = "[stage.matte]\nkind = \"tabulate-brdf\"\ninput = \"material\"\nresolution = 8\n\
                  [stage.seen]\nkind = \"shade-vertices\"\n\
                  inputs = { mesh = \"mesh\", table = \"matte\", lighting = \"lighting\" }\n";
    let catalog = PreviewCatalog::of(tabulated(&format!("{REFLECTION}{stages}")).1);
    assert!(
        described(&catalog).starts_with("gold under east: reflection -> \ntin under east: reflection -> \n")
    );
    let entry = catalog.entry("north", "tin").unwrap().unwrap();
    let table = entry.table.unwrap();
    assert_eq!(stage_name(catalog.plan(), table), "matte");
    assert!(entry.ancestry.contains(&table) && entry.maps.contains(&table));
}

#[test]
fn a_scene_has_the_table_and_the_transfer_that_were_made_of_its_parts() {
    let (folder, plan) = tabulated(&shaded("lamplit", "turned"));
    let catalog = PreviewCatalog::of(plan.clone());
    let entry = catalog.entry("lamps", "steel").unwrap().unwrap();
    let results = build(&plan);
    let mut scenes = SceneCache::default();
    let scene = scenes.scene(&catalog, &results, entry, "knot").unwrap();
    assert!(scene.offers(Mode::Table) && scene.offers(Mode::Transfer) && !scene.offers(Mode::LocalShrm));
    let again = scenes.scene(&catalog, &results, entry, "knot").unwrap();
    let transfer = |scene: &Scene| scene.objects[0].transfer.clone().unwrap();
    assert!(Arc::ptr_eq(&scene.objects[0].look, &again.objects[0].look));
    assert!(Arc::ptr_eq(&transfer(&scene), &transfer(&again)));
    let plane = scenes.scene(&catalog, &results, entry, "plane").unwrap();
    assert!(plane.offers(Mode::Table) && !plane.offers(Mode::Transfer));

    // The lamp at +Y was turned to -X. It can be moved, by the picture alone.
    let toward = |x: f64| Direction::normalised([x, 0.0, 0.0].into());
    let radiance = |scene: &Scene, x: f64| scene.light.environment().radiance(toward(x))[0];
    assert!((radiance(&scene, -1.0) - 3.0).abs() < 1e-3 && radiance(&scene, 1.0) == 0.0);
    let moved = scene.with_disks_at(&[toward(1.0)]).unwrap();
    assert!((radiance(&moved, 1.0) - 3.0).abs() < 1e-3 && radiance(&moved, -1.0) == 0.0);
    assert!(moved.offers(Mode::Transfer) && moved.with_disks_at(&[]).is_none());
    let lit = |scene: &Scene, x: f64| scene.light.lighting().evaluate(toward(x))[0];
    // To degree 4 a lamp of the flux 1.1 sr is about 25 / (4 pi) of it high, and 5 / (4 pi) opposite.
    assert!(lit(&scene, -1.0) > 1.5 && lit(&scene, 1.0) < 0.7 && lit(&moved, 1.0) > 1.5);

    // Only the material is rebuilt, not the table.
    fs::write(folder.path().join("metal/steel.toml"), "model = \"ward\"\nroughness = 0.4\n").unwrap();
    let results = build_only(&plan, &["metal"]);
    let edited = scenes.scene(&catalog, &results, entry, "knot").unwrap();
    assert!(!edited.offers(Mode::Table) && edited.objects[0].look.material().is_some());
}

const COMPACT: &str = r#"
[stage.blurred]
kind = "scale-space"
input = "environment"
resolution = 8
lights = 0
[stage.taps]
kind = "fit-taps"
input = "material"
taps = 1
"#;

#[test]
fn a_compact_map_is_shown_under_the_lights_that_a_stage_combines_it_with() {
    let catalog = PreviewCatalog::of(project(COMPACT).1);
    assert!(catalog.is_empty(), "no stage combines the taps with a light");
    let export = "[stage.compact]\nkind = \"export-taps\"\n\
                  inputs = { scale-space = \"blurred\", taps = \"taps\" }\n";
    let catalog = PreviewCatalog::of(project(&format!("{COMPACT}{export}")).1);
    assert_eq!((catalog.environments().len(), catalog.materials()), (2, &["gold".into(), "tin".into()][..]));
    let entry = catalog.entry("north", "tin").unwrap().unwrap();
    assert!(entry.reflection.is_none() && entry.exports.len() == 1);
    let stages = catalog.stages(entry, "plane").into_iter().collect::<Vec<_>>();
    assert_eq!(stages, ["blurred", "environment", "material", "taps"]);
}

#[test]
fn a_compact_map_belongs_to_the_reflection_of_its_light_and_its_material() {
    let turned = "[stage.turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 90.0\n\
                  [stage.other]\nkind = \"convolve\"\ninputs = { lighting = \"turned\", brdf = \"coefficients\" }\n";
    let (folder, plan) = project(&format!("{REFLECTION}{turned}{COMPACT}"));
    let catalog = PreviewCatalog::of(plan.clone());
    let still = catalog.entry("east", "gold (reflection)").unwrap().unwrap();
    let turned = catalog.entry("east", "gold (other)").unwrap().unwrap();
    assert!(still.compact_map.is_some() && turned.compact_map.is_none());
    let results = build(&plan);
    let mut scenes = SceneCache::default();
    let scene = scenes.scene(&catalog, &results, still, "sphere").unwrap();
    assert!(scene.offers(Mode::Taps) && scene.offers(Mode::LocalShrm));
    assert!(!scenes.scene(&catalog, &results, turned, "sphere").unwrap().offers(Mode::Taps));
    let again = scenes.scene(&catalog, &results, still, "sphere").unwrap();
    assert!(Arc::ptr_eq(&scene.objects[0].look, &again.objects[0].look));
    let other =
        scenes.look(&plan, &results, catalog.entry("east", "tin (reflection)").unwrap().unwrap()).unwrap();
    let scales = |look: &Look| Arc::clone(&look.compact_map().unwrap().scales);
    assert!(Arc::ptr_eq(&scales(&other), &scales(&scene.objects[0].look)), "one scale space for both");

    // Only the material is rebuilt, not its taps.
    fs::write(folder.path().join("paint/gold.toml"), "model = \"phong\"\nexponent = 2\n").unwrap();
    let results = build_only(&plan, &["material"]);
    assert!(!scenes.scene(&catalog, &results, still, "sphere").unwrap().offers(Mode::Taps));
}

#[test]
fn a_mesh_has_the_blend_that_was_made_of_it() {
    let stages = "[stage.pot]\nkind = \"import-mesh\"\nsource = \"pot.glb\"\n\
                  [stage.noise]\nkind = \"vertex-blend\"\ninput = \"pot\"\ngltf = \"pot.glb\"\n\
                  attribute = \"_BLEND\"\n\
                  [stage.varying]\nkind = \"tabulate-brdf\"\ninput = \"metal\"\nvary = \"roughness\"\n\
                  from = 0.2\nto = 0.8\ncount = 2\ndegree = 2\nresolution = 8\n\
                  [stage.seen]\nkind = \"shade-vertices\"\n\
                  inputs = { mesh = \"pot\", table = \"varying\", lighting = \"lamps\", blend = \"noise\" }\n";
    let (_folder, plan) = tabulated(stages);
    let catalog = PreviewCatalog::of(plan.clone());
    let entry = catalog.entry("lamps", "steel").unwrap().unwrap();
    let parts = catalog.parts(entry, "pot").into_iter().map(|item| stage_name(catalog.plan(), item));
    assert!(parts.collect::<Vec<_>>().contains(&"noise"));
    let results = build_only(&plan, &["seen"]);
    let mut scenes = SceneCache::default();
    let scene = scenes.scene(&catalog, &results, entry, "pot").unwrap();
    let object = &scene.objects[0];
    let blend = object.blend.as_ref().unwrap();
    assert_eq!(blend.len(), object.mesh.positions().len());
    assert!(blend.contains(&[0.0; 2]) && blend.contains(&[1.0, 0.0]), "the noise goes from end to end");
    assert!(scenes.scene(&catalog, &results, entry, "plane").unwrap().objects[0].blend.is_none());
}

#[test]
fn the_sample_is_turned_in_all_its_pictures() {
    let root = engine::canonicalize(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap();
    let text = fs::read_to_string(root.join("pipeline.toml")).unwrap();
    let root = root.to_str().unwrap().replace('\\', "/");
    let text = text.replace("\"assets/", &format!("\"{root}/assets/"));
    let folder = tempfile::tempdir().unwrap();
    let manifest = folder.path().join("pipeline.toml");
    let catalog = |text: &str| {
        fs::write(&manifest, text).unwrap();
        PreviewCatalog::of(Plan::load(&manifest, &kinds()).unwrap_or_else(|errors| panic!("{errors}")))
    };
    let turned = catalog(&text);
    let entry = turned.entry("sky", "gold").unwrap().unwrap();
    let edit = turned.with_turned_light(entry, Aim { yaw: 1.0, pitch: 0.0 }, &text).unwrap();
    assert_eq!(
        edit.changes,
        [
            "[stage.environment-turned] is new: it turns environment (yaw = 57.3) for light, report, page, shaded-mesh, sheet, preview",
            "[stage.lighting-turned] is new: it turns lighting (yaw = 57.3) for reflection, shine, received, shaded, sheet",
            "this turns the light of sky, studio",
        ]
    );
    let new = edit.text.lines().collect::<Vec<_>>();
    let replaced = text.lines().filter(|line| !new.contains(line)).count();
    assert_eq!(replaced, 9, "only the connections change");
    catalog(&edit.text);
}
