//! `specula inspect FILE --picture`: the PNG, where it lies, and what cannot be drawn or written.

use std::fs;
use std::path::Path;

use crate::support::{Project, files_below};
use serde_json::Value;

const GOLD: &str = "assets/materials/gold.toml";

/// The width and height of a picture.
fn size(file: &Path) -> [usize; 2] {
    let bytes = fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let image = containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image;
    [image.width(), image.height()]
}

fn names(folder: &Path) -> Vec<String> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn a_picture_is_written_whole_and_reported() {
    let project = Project::small();
    let text = project.ok(&["inspect", GOLD, "--picture", "new/folder/gold.png"]).stdout;
    assert!(text.contains("\npicture       new/folder/gold.png\npicture size  1680 x 598\n"), "{text}");
    assert_eq!(size(&project.path("new/folder/gold.png")), [1680, 598]);
    assert_eq!(names(&project.path("new/folder")), ["gold.png"]);
    // Nothing but the rows of the picture differs from a description without one.
    let without = project.ok(&["inspect", GOLD]).stdout;
    assert!(text.starts_with(&without), "{without}");

    let first = fs::read(project.path("new/folder/gold.png")).unwrap();
    project.ok(&["inspect", GOLD, "--picture", "new/folder/gold.png"]);
    assert_eq!(fs::read(project.path("new/folder/gold.png")).unwrap(), first);
}

#[test]
fn an_anisotropic_material_has_two_rows() {
    let project = Project::small();
    project
        .write("brushed.toml", "model = \"ward\"\nroughness = 0.2\nroughness_x = 0.08\nroughness_y = 0.4\n");
    let json = project.ok(&["inspect", "brushed.toml", "--json", "--picture", "brushed.png"]).stdout;
    let facts: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&facts["what"], &facts["isotropic"]), (&"material".into(), &false.into()));
    assert_eq!(facts["picture"], "brushed.png");
    assert_eq!(facts["picture size"], "1680 x 1064");
    assert_eq!(size(&project.path("brushed.png")), [1680, 1064]);
}

#[test]
fn a_material_in_the_cache_is_drawn_as_its_file_is() {
    let project = Project::small();
    project.ok(&["build", "material"]);
    project.ok(&["inspect", "assets/materials/chalk.toml", "--picture", "a/chalk.png"]);
    let blobs = files_below(&project.path(".specula/blobs"));
    let is_chalk = |name: &&String| {
        let text = project.ok(&["inspect", &format!(".specula/blobs/{name}")]).stdout;
        text.contains("what          material") && text.contains("model lambert")
    };
    let chalk = blobs.keys().find(is_chalk).unwrap();
    project.ok(&["inspect", &format!(".specula/blobs/{chalk}"), "--picture", "b/chalk.png"]);
    // They differ in the title, which is the name of the file.
    assert_eq!(size(&project.path("a/chalk.png")), size(&project.path("b/chalk.png")));
}

/// The artifact in the cache and the exported file.
#[test]
fn a_brdf_table_is_drawn_and_described() {
    let project = Project::small();
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    let stages = "\n[stage.table]\nkind = \"tabulate-brdf\"\ninput = \"material\"\nresolution = 16\ndegree = 2\n\
                  [stage.table-file]\nkind = \"export-brdf-table\"\ninput = \"table\"\npath = \"{material}/table\"\n";
    project.write("pipeline.toml", &(manifest + stages));
    project.ok(&["build", "table-file"]);
    let file = "out/gold/table.safetensors";
    let text = project.ok(&["inspect", file, "--picture", "gold.png"]).stdout;
    assert!(text.contains("what          brdf-table"), "{text}");
    assert!(text.contains("degree        2\nviews         16 x 16\nmaterials     1\n"), "{text}");
    assert_eq!(size(&project.path("gold.png"))[0], 1680);
    let blobs = files_below(&project.path(".specula/blobs"));
    let tables = blobs.keys().filter(|name| {
        let text = project.ok(&["inspect", &format!(".specula/blobs/{name}")]).stdout;
        text.contains("what          brdf-table")
    });
    for name in tables.take(1) {
        project.ok(&["inspect", &format!(".specula/blobs/{name}"), "--picture", "blob.png"]);
        assert_eq!(size(&project.path("blob.png")), size(&project.path("gold.png")));
    }
}

#[test]
fn a_file_that_is_not_a_material_has_no_picture() {
    let project = Project::small();
    let run = project.specula(&["inspect", "assets/environments/studio.exr", "--picture", "a.png"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("assets/environments/studio.exr is not a material"), "{}", run.stderr);
    assert!(run.stdout.is_empty() && !project.path("a.png").exists());

    project.write("bad.toml", "model = \"fong\"\n");
    let run = project.specula(&["inspect", "bad.toml", "--picture", "a.png"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("bad.toml:1:9: there is no model \"fong\""), "{}", run.stderr);
    assert!(!project.path("a.png").exists() && !project.path(".specula").exists());
}

#[test]
fn the_name_of_a_picture_ends_in_png() {
    let project = Project::small();
    for arguments in [&["inspect", GOLD, "--picture", "gold.jpg"][..], &["inspect", "--picture", GOLD]] {
        project.specula(arguments).ends(2, ["its name must end in .png"]);
    }
}

#[test]
fn a_picture_that_cannot_be_written_is_a_system_error_that_names_it() {
    let project = Project::small();
    // A file where a folder would be, and a folder where the file would be.
    project.write("taken", "");
    fs::create_dir(project.path("folder.png")).unwrap();
    for place in ["taken/gold.png", "folder.png"] {
        let run = project.specula(&["inspect", GOLD, "--picture", place]);
        assert_eq!(run.code, Some(4), "{}", run.stderr);
        assert!(run.stderr.contains(&format!("cannot write {place}")), "{}", run.stderr);
        assert!(run.stdout.is_empty(), "{}", run.stdout);
    }
    assert_eq!(fs::read_to_string(project.path("taken")).unwrap(), "");
    assert!(names(&project.path("folder.png")).is_empty());
    assert!(!names(&project.path("")).iter().any(|name| name.ends_with(".part")));
}
