//! `specula convert` and `specula convert-sh`: environments and lighting, without a manifest.

use std::fs;

use crate::support::{Project, STUDIO, files_below};

#[test]
fn an_environment_is_converted_to_every_format_and_back() {
    let project = Project::assets_alone();
    for (output, options, what) in [
        ("a.exr", &["--precision", "float"][..], "512 x 256"),
        ("a.hdr", &["--resolution", "32"], "64 x 32"),
        ("a.png", &["--exposure", "-1.5"], "512 x 256"),
        ("a.ktx2", &["--layout", "cube", "--resolution", "16"], "16 x 16"),
        ("a.dds", &["--layout", "cube", "--resolution", "16"], "16 x 16"),
        ("a-cross.exr", &["--layout", "cube-cross", "-r", "16"], "48 x 64"),
    ] {
        let run = project.ok(&[&["convert", STUDIO, "-o", output], options].concat());
        assert_eq!(run.stderr, format!("Wrote 1 file to {output}.\n"));
        let found = project.ok(&["inspect", output]).stdout;
        assert!(found.contains(what), "{output}: {found}");
    }
    let run =
        project.ok(&["convert", "a-cross.exr", "--from", "cube-cross", "-o", "faces", "--layout", "cube"]);
    assert_eq!(run.stderr, "Wrote 6 files to faces.\n");
    assert!(project.path("faces/px.exr").exists());
    let run = project.ok(&["convert", "faces", "--from", "cube", "--yaw", "90", "-o", "new/back.hdr"]);
    assert_eq!(run.stderr, "Wrote 1 file to new/back.hdr.\n");
    // A folder of images; and nothing else was written.
    project.ok(&["convert", "assets/environments", "-o", "all", "--format", "rgbe", "-r", "16"]);
    assert_eq!(files_below(&project.path("all")).into_keys().collect::<Vec<_>>(), ["sky.hdr", "studio.hdr"]);
    assert!(!project.path(".specula").exists() && !project.path("pipeline.toml").exists());
}

#[test]
fn six_faces_and_textures_are_found_to_be_environments() {
    let project = Project::assets_alone();
    project.ok(&["convert", STUDIO, "-o", "faces", "--layout", "cube", "-r", "16"]);
    let run = project.ok(&["convert", "faces", "-o", "all"]);
    assert_eq!(run.stderr, "Wrote 1 file to all.\n");
    project.ok(&["convert", "faces", "-o", "one.exr"]);
    assert_eq!(fs::read(project.path("all/faces.exr")).unwrap(), fs::read(project.path("one.exr")).unwrap());
    fs::copy(project.path("one.exr"), project.path("faces/panorama.exr")).unwrap();
    let run = project.specula(&["convert", "faces", "-o", "all"]);
    assert!(
        run.stderr.contains("contains other images in addition to the six faces px.exr, nx.exr"),
        "{}",
        run.stderr
    );

    project.ok(&["convert", STUDIO, "-o", "a.ktx2", "--layout", "cube", "-r", "16"]);
    project.ok(&["convert", "a.ktx2", "-o", "b.exr", "--colour-space", "ACES - ACEScg"]);
    // A dome of 180 degrees that a header declares, its rest filled.
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nVIEW= -vta -vh 180 -vv 180\n\n-Y 4 +X 4\n";
    let dome = [header.as_bytes(), &[128, 128, 128, 129].repeat(16)].concat();
    fs::write(project.path("dome.hdr"), dome).unwrap();
    for (fill, words) in [
        ("black", "The rest, 50 % of the sphere, is black; --fill edge or mean or a colour adds light there"),
        ("mean", "with the picture's mean light"),
        ("0.5,1,2", "with one colour"),
        ("[0.5, 1, 2]", "with one colour"),
        ("0.5", "with one colour"),
    ] {
        let run = project.ok(&["convert", "dome.hdr", "-o", "dome.exr", "--fill", fill]);
        assert!(run.stderr.contains(words), "{fill}: {}", run.stderr);
    }
    project.specula(&["convert", "dome.hdr", "-o", "dome.exr", "--fill", "grey"]).ends(2, ["\"edge\""]);

    let run = project.specula(&["convert", "a.ktx2", "-o", "b.exr", "--colour-space", "rec601"]);
    assert!(run.stderr.contains("rec2020"), "{}", run.stderr);
}

/// `--lights` says how many lamps stay beside the levels of a compact map's light.
#[test]
fn an_environment_is_converted_to_the_light_of_compact_maps() {
    let project = Project::assets_alone();
    let lights = |options: &[&str]| {
        project.ok(&[&["convert", STUDIO, "-o", "light", "--to", "taps", "-r", "16"], options].concat());
        let text = fs::read_to_string(project.path("light/taps.json")).unwrap();
        let numbers: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(numbers["resolution"], 16);
        numbers["lights"].as_array().unwrap().len()
    };
    let (all, none) = (lights(&["--lights", "all"]), lights(&["--lights", "0"]));
    assert!(all > 0 && none == 0, "{all}");
    assert_eq!(lights(&[]), all.min(8));
    let files = files_below(&project.path("light")).into_keys().collect::<Vec<_>>();
    assert_eq!(files, ["levels.ktx2", "normals.ktx2", "taps.json"]);
    let run = project.ok(&["convert", STUDIO, "-o", "one.safetensors", "--to", "taps", "-r", "16"]);
    assert_eq!(run.stderr, "Wrote 1 file to one.safetensors.\n");
    project.ok(&[
        "convert",
        "assets/environments",
        "-o",
        "both",
        "--to",
        "taps",
        "-r",
        "16",
        "--exposure",
        "1",
    ]);
    assert_eq!(files_below(&project.path("both")).len(), 6);

    let options = ["convert", STUDIO, "-o", "light", "--to", "taps", "--lights", "2", "-r", "16"];
    let text = project.ok(&[&options[..], &["--manifest"]].concat()).stdout;
    for line in ["kind = \"scale-space\"", "lights = 2", "kind = \"export-taps\""] {
        assert!(text.contains(line), "{text}");
    }
    for (options, words) in [
        (&["-o", "a.exr", "--lights", "2"][..], "--lights is an option of --to taps and --sun light"),
        (&["-o", "a", "--to", "taps", "--lights", "few"], "a whole number of lights, or \"all\""),
        (&["-o", "a", "--to", "taps", "--precision", "half"], "--precision is an option of --to environment"),
        (&["-o", "a", "--to", "taps", "-r", "48"], "the nearest is 64"),
        (&["-o", "a", "--to", "taps", "--format", "safetensors"], "does not have a name that fits"),
    ] {
        project.specula(&[&["convert", STUDIO], options].concat()).ends(2, [words]);
    }
}

#[test]
fn a_grey_card_or_what_was_white_balances_a_photograph() {
    let project = Project::assets_alone();
    let image = |options: &[&str]| {
        project.ok(&[&["convert", STUDIO, "-o", "a.exr", "--precision", "float"], options].concat());
        let bytes = fs::read(project.path("a.exr")).unwrap();
        containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image
    };
    let [card, warm, same] = [
        image(&["--grey-card", "200,100,8,4"]),
        image(&["--white-balance", "0.9,0.6,0.3"]),
        image(&["--white-balance", "6504"]),
    ];
    let of_card = |c: usize| {
        let rows = card.pixels().chunks(card.width()).skip(100).take(4);
        let sum: f32 = rows.flat_map(|row| &row[200..208]).map(|pixel| pixel[c]).sum();
        sum / 32.0
    };
    for c in 0..3 {
        assert!((of_card(c) - 0.18).abs() < 1e-5, "{}", of_card(c));
    }
    let ratio = |c: usize| warm.pixels()[77][c] / same.pixels()[77][c];
    assert!((ratio(2) / ratio(0) - 3.0).abs() < 1e-5);
    let wrong = ["convert", STUDIO, "-o", "b.exr", "--grey-card", "1,2,3"];
    project.specula(&wrong).ends(2, ["--grey-card", "[left, top, width, height]"]);
    let far = ["convert", STUDIO, "-o", "b.exr", "--grey-card", "600,2,3,4"];
    project.specula(&far).ends(1, ["not all within the 512 x 256 picture"]);
    // What `inspect` says of the frame holds for what it says of the sun.
    let frame = |file: &str| {
        let text = project.ok(&["inspect", file]).stdout;
        text.lines().find_map(|line| line.strip_prefix("frame")).unwrap().trim().to_owned()
    };
    assert!(
        frame(STUDIO).starts_with("lat-long, as a width of twice the height suggests"),
        "{}",
        frame(STUDIO)
    );
    project.ok(&["convert", STUDIO, "-o", "strip.exr", "--layout", "cube-strip", "-r", "16"]);
    assert!(!frame("strip.exr").contains("lat-long"), "{}", frame("strip.exr"));
}

/// `--engine` writes what `export-engine` makes of each environment, or the one file that is named.
#[test]
fn environments_are_converted_to_the_light_of_an_engine() {
    let project = Project::assets_alone();
    let names = |folder: &str| files_below(&project.path(folder)).into_keys().collect::<Vec<_>>();
    let small = ["-r", "16"];
    project.ok(&[&["convert", STUDIO, "--engine", "three", "-o", "one/"], &small[..]].concat());
    let all = ["README.txt", "bounds.json", "environment-irradiance.json", "environment-skybox.ktx2"];
    assert_eq!(names("one"), [&all[..], &["environment.ktx2"]].concat());
    assert!(fs::read_to_string(project.path("one/README.txt")).unwrap().contains("scene.background = "));
    for inputs in [
        &["assets/environments"][..],
        &["assets/environments/*.exr"],
        &["assets/environments/studio.exr", "assets/environments/sky.exr"],
    ] {
        project.ok(&[&["convert"], inputs, &["--engine", "bevy", "-o", "all", "-r", "32"]].concat());
        let names = names("all");
        assert!(names.len() == 10 && names.contains(&"sky/environment-specular.ktx2".into()), "{names:?}");
        fs::remove_dir_all(project.path("all")).unwrap();
    }
    // One file, by its extension, with what belongs to it.
    for (output, options, files) in [
        ("a/sky.env", &[][..], &["sky.env"][..]),
        ("b/sky.ktx", &["-r", "32"], &["sky-sh.txt", "sky.ktx"]),
        ("c/sky.gltf", &["-r", "32"], &["sky.gltf"]),
        ("d/sky.ktx2", &["--engine", "bevy", "-r", "32"], &["sky-diffuse.ktx2", "sky.ktx2"]),
        ("e/sky.dds", &["--engine", "three"], &["sky-irradiance.json", "sky.dds"]),
        ("f/sky.hdr", &["--engine", "godot"], &["sky.hdr"]),
    ] {
        let size = if options.is_empty() || output.starts_with("e/") { &small[..] } else { &[] };
        project.ok(&[&["convert", STUDIO, "-o", output], options, size].concat());
        assert_eq!(names(&output[..1]), files, "{output}");
    }
    assert!(project.ok(&["inspect", "e/sky.dds"]).stdout.contains("BC6H"));

    project.ok(&["convert", STUDIO, "--engine", "three", "-o", "n/", "-r", "16", "--sky", "none"]);
    assert!(!names("n").contains(&"environment-skybox.ktx2".into()));
    project.ok(&["convert", STUDIO, "--engine", "three", "-o", "n/", "-r", "16", "--sky", "8"]);
    let found = project.ok(&["inspect", "n/environment-skybox.ktx2"]).stdout;
    assert!(found.contains("8 x 8, 6 faces"), "{found}");
    // A sun that is a light of its own.
    let run = project.specula(&[
        "convert",
        STUDIO,
        "--engine",
        "babylon",
        "-o",
        "s/",
        "--exposure",
        "9",
        "-r",
        "16",
    ]);
    run.ends(0, ["--sun light makes it a separate light"]);
    let sun = ["convert", STUDIO, "--engine", "godot", "--sun", "light", "--lights", "2", "-o", "s/"];
    project.ok(&sun);
    let lights: serde_json::Value =
        serde_json::from_slice(&fs::read(project.path("s/environment-lights.json")).unwrap()).unwrap();
    assert_eq!(lights["lights"].as_array().map(Vec::len), Some(2));
    project
        .specula(&["convert", STUDIO, "--sun", "light", "-o", "x.exr"])
        .ends(2, ["--sun is an option of --engine"]);

    let text = project.ok(&["convert", STUDIO, "--engine", "unity", "-o", "lit/", "--manifest"]).stdout;
    assert!(text.contains("kind = \"export-engine\"") && text.contains("path = \"lit\""), "{text}");
    project.write("pipeline.toml", &text);
    project.ok(&["build"]);
    project.ok(&["convert", STUDIO, "--engine", "unity", "-o", "same/"]);
    let unity = "environment.exr";
    let [built, converted] =
        ["out/lit", "same"].map(|folder| fs::read(project.path(folder).join(unity)).unwrap());
    let image = |bytes: &[u8]| {
        let image = containers::read_image(bytes, &containers::ReadOptions::default()).unwrap().image;
        image.pixels().to_vec()
    };
    assert!(image(&built) == image(&converted));

    for (options, words) in [
        (&["--engine", "thre", "-o", "x/"][..], "did you mean \"three\"?"),
        (&["--engine", "three", "--to", "taps", "-o", "x/"], "cannot be used with"),
        (&["--engine", "three", "-o", "x.env"], "three loads .ktx2 or .dds, not x.env"),
        (&["--engine", "three", "-o", "x/", "--layout", "cube"], "--layout is an option of images"),
        (&["--engine", "three", "-o", "x.ktx2", "--sky", "8"], "x.ktx2 is only the light; name a folder"),
        (&["--engine", "unity", "-o", "x/", "--sky", "8"], "the engine shows the lat-long image itself"),
        (&["--engine", "three", "-o", "x/", "--sky", "few"], "a whole number of texels, or \"none\""),
        (&["-o", "x.exr", "--sky", "8"], "--sky is an option of --engine"),
        (&["--engine", "three", "-o", "x/", "-r", "100"], "the nearest size that fits is 128"),
        (&["--engine", "three", "-o", "x/", "--format", "rgbd"], "three loads \"rgba16f\" or \"bc6h\""),
        (&["-o", "x"], "--engine three -o x` writes the files that an engine loads"),
        (&["-o", "x.safetensors"], "--to taps -o x.safetensors` writes the light of compact maps"),
        (&["-o", "x.json"], "`specula convert-sh` converts spherical harmonics"),
        (&["-o", "x.usda"], "export-light-rig writes suns and lamps"),
        (&["-o", "x.tif"], "x.tif does not have the extension of an image"),
    ] {
        project.specula(&[&["convert", STUDIO], options].concat()).ends(2, [words]);
    }
    let run = project.specula(&["convert", "assets/environments", "--engine", "three", "-o", "x.ktx2"]);
    run.ends(2, ["x.ktx2 is one file; name a folder for several environments"]);
    let run = project.specula(&["convert", "assets/none*", "--engine", "three", "-o", "x"]);
    run.ends(2, ["assets/none* matches no image of an environment"]);
}

/// Packed texels, levels and Zstandard of a texture.
#[test]
fn a_texture_is_written_for_a_renderer() {
    let project = Project::assets_alone();
    let cube = ["convert", STUDIO, "--layout", "cube", "-r", "16"];
    for (output, options, words) in [
        ("a.ktx2", &["--texels", "bc6h", "--levels", "--zstd"][..], "BC6H"),
        ("b.ktx2", &["--texels", "rgb9e5"], "RGB9E5"),
        ("c.dds", &["--texels", "bc6h", "--levels"], "BC6H"),
        ("d.ktx2", &["--levels", "--zstd"], "RGBA16F"),
    ] {
        project.ok(&[&cube[..], &["-o", output], options].concat());
        let found = project.ok(&["inspect", output]).stdout;
        assert!(found.contains(words), "{output}: {found}");
        let texture = containers::read_texture(&fs::read(project.path(output)).unwrap()).unwrap().texture;
        // 16, 8, 4, 2 and 1 texels.
        let levels = if options.contains(&"--levels") { 5 } else { 1 };
        assert_eq!(texture.levels().count(), levels, "{output}");
    }
    project.ok(&["convert", STUDIO, "-o", "e.ktx2", "-r", "8", "--levels"]);
    let texture = containers::read_texture(&fs::read(project.path("e.ktx2")).unwrap()).unwrap().texture;
    assert_eq!(texture.levels().map(<[_]>::len).collect::<Vec<_>>(), [128, 32, 8, 2]);
    for (options, words) in [
        (&["-o", "x.exr", "--texels", "bc6h"][..], "only format = \"ktx2\" or \"dds\" uses it"),
        (&["-o", "x.dds", "--zstd"], "only format = \"ktx2\" can be compressed"),
        (&["-o", "x.exr", "--levels"], "only format = \"ktx2\" or \"dds\" has them"),
        (&["-o", "x.ktx2", "--texels", "bc6h", "--precision", "half"], "packed texels already set them"),
        (&["--engine", "three", "-o", "x/", "--zstd"], "--zstd is an option of textures"),
    ] {
        project.specula(&[&["convert", STUDIO], options].concat()).ends(2, [words]);
    }
}

#[test]
fn a_conversion_prints_the_manifest_that_does_the_same() {
    let project = Project::assets_alone();
    let options =
        ["convert", STUDIO, "-o", "made/studio.ktx2", "--layout", "cube", "-r", "16", "--yaw", "30"];
    let text = project.ok(&[&options[..], &["--manifest"]].concat()).stdout;
    assert!(!project.path("made").exists(), "it converts nothing");
    project.ok(&options);
    project.write("pipeline.toml", &text);
    project.ok(&["build"]);
    assert!(project.outputs()["made/studio.ktx2"] == fs::read(project.path("made/studio.ktx2")).unwrap());
}

#[test]
fn a_conversion_that_is_impossible_says_why_and_leaves_what_was_there() {
    let project = Project::assets_alone();
    project.write("notes.hdr", "not an image");
    project.write("kept.exr", "kept");
    for (arguments, code, words) in [
        (&["none.exr", "-o", "kept.exr"][..], 2, "cannot read none.exr"),
        (&["notes.hdr", "-o", "kept.exr"], 1, "notes.hdr"),
        (&[STUDIO, "-o", "kept"], 2, "kept does not have the extension of an image"),
        (&[STUDIO, "-o", "kept.exr", "--format", "rgbe"], 2, "is not a file name for the format rgbe"),
        (&[STUDIO, "-o", "kept.exr", "--layout", "cubes"], 2, "did you mean \"cube\"?"),
        (&[STUDIO, "-o", "kept.ktx2", "--layout", "cube-cross"], 2, "a texture is \"lat-long\" or \"cube\""),
        (&[STUDIO, "-o", "kept.exr", "--from", "probe"], 1, "probe"),
    ] {
        let run = project.specula(&[&["convert"], arguments].concat());
        assert_eq!(run.code, Some(code), "{arguments:?}: {run:?}");
        assert!(run.stderr.contains(words), "{arguments:?}: {}", run.stderr);
    }
    assert_eq!(fs::read_to_string(project.path("kept.exr")).unwrap(), "kept");
}

/// Messages of a conversion name its options, and a folder of six faces is a cube.
#[test]
fn convert_names_its_own_options() {
    let project = Project::assets_alone();
    project.ok(&["convert", STUDIO, "-o", "faces", "--layout", "cube", "-r", "16"]);
    project.ok(&["convert", "faces", "-o", "back.exr"]);
    assert!(project.path("back.exr").exists());
    let run = project.specula(&["convert", "faces/px.exr", "-o", "out.exr"]);
    assert!(run.stderr.contains("is it --from probe?"), "{}", run.stderr);
    assert!(!run.stderr.contains("layout ="), "{}", run.stderr);
    // A shape that shows its layout needs no option.
    project.ok(&["convert", STUDIO, "-o", "strip.exr", "--layout", "cube-strip", "-r", "32"]);
    project
        .specula(&["convert", "strip.exr", "-o", "from_strip.exr"])
        .ends(0, ["strip.exr is assumed to be cube-strip"]);
}

/// Through every convention and back.
#[test]
fn lighting_is_converted_between_engines() {
    let project = Project::assets_alone();
    project.ok(&["test-pattern", "--preset", "babylon", "-r", "32", "babylon"]);
    project
        .specula(&["convert-sh", "babylon/pattern-orient.env", "--to", "filament", "-o", "sh.txt"])
        .ends(0, ["from  babylon-env\n", "to    filament\n"]);
    let mut last = "sh.txt".to_owned();
    let mut from = "filament".to_owned();
    for to in ["three", "unity", "directx", "unreal", "gltf", "babylon", "specula", "babylon-env", "filament"]
    {
        let next = format!("{to}.json");
        project.ok(&["convert-sh", &last, "--from", &from, "--to", to, "-o", &next]);
        (last, from) = (next, to.to_owned());
    }
    let json: serde_json::Value = serde_json::from_slice(&fs::read(project.path(&last)).unwrap()).unwrap();
    // 2 + d: red for x, green for y, blue for z of Filament's world; rows 1, y, z, x.
    for (row, expected) in
        [[2.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]].into_iter().enumerate()
    {
        for (channel, expected) in expected.into_iter().enumerate() {
            let found = json["coefficients"][row][channel].as_f64().unwrap();
            assert!((found - expected).abs() < 1e-14, "{json}");
        }
    }
    project.write("long.txt", &"1 2 3\n".repeat(16));
    project.write("cut.json", "{\"preset\": \"three\", \"coefficients\": [[1");
    for (arguments, message) in [
        (["long.txt", "--from", "filament", "--to", "three"], "A_3 is 0"),
        (["sh.txt", "--from", "quake", "--to", "three"], "\"quake\" is not a preset"),
        (["three.json", "--from", "unity", "--to", "three"], "expected `unity`, found `three`"),
        (["cut.json", "--from", "three", "--to", "unity"], "the JSON ends too early"),
        (["missing", "--from", "three", "--to", "unity"], "cannot read missing"),
    ] {
        let run = project.specula(&[&["convert-sh"][..], &arguments].concat());
        assert!(run.code == Some(2) && run.stderr.contains(message), "{arguments:?}: {}", run.stderr);
    }
}
