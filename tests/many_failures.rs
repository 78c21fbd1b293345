//! Of many failed items the first are reported in full and the others counted, except with `--verbose`.

use crate::support::Project;

/// 60 materials that fail, each with one dependent item, and another with ten.
const MANIFEST: &str = r#"
schema = 1
[stage]
material = { kind = "import-material", source = "bad/*.toml" }
coefficients = { kind = "project-brdf", input = "material", degree = [4, 0] }
root = { kind = "import-material", source = "root.toml" }
"#;

fn project() -> Project {
    let dependants = (0..10).map(|n| {
        format!("of-root-{n} = {{ kind = \"project-brdf\", input = \"root\", degree = [{}, 0] }}\n", n + 2)
    });
    let project = Project::new(&format!("{MANIFEST}{}", dependants.collect::<String>()));
    for n in 0..60 {
        project.write(&format!("bad/m{n:02}.toml"), "model = \"fong\"\n");
    }
    project.write("root.toml", "model = \"fong\"\n");
    project
}

#[test]
fn the_first_are_reported_and_the_others_counted_and_events_name_all() {
    let project = project();
    let run = project.specula(&["build", "--jobs", "1"]).ends(1, []);
    let reported = |run: &str| (run.matches("FAILED  ").count(), run.matches("\nerror: ").count());
    assert_eq!(reported(&run.stderr), (50, 50), "{}", run.stderr);
    assert!(run.stderr.contains("\n... and 11 more failed items; --verbose shows all\n"), "{}", run.stderr);
    assert!(run.stderr.contains("61 FAILED, 70 not run"), "{}", run.stderr);
    let few = run.stderr.lines().find(|line| line.contains("not run because of it: of-root")).unwrap();
    assert!(few.ends_with("; of-root-4 [root] and 5 more"), "{few}");

    let all = project.specula(&["build", "--verbose"]);
    assert_eq!(reported(&all.stderr), (61, 61), "{}", all.stderr);
    assert!(!all.stderr.contains(" more"), "{}", all.stderr);
    let events = project.events(&[]);
    assert_eq!(events.iter().filter(|event| event["event"] == "failed").count(), 61);
}

#[test]
fn nearly_equal_warnings_share_a_line_and_verbose_shows_each() {
    let project = Project::new(MANIFEST);
    project.write("root.toml", "model = \"lambert\"\nalbedo = 0.5\n");
    for n in 0..60 {
        project.write(&format!("bad/m{n:02}.toml"), &format!("model = \"lambert\"\nalbedo = {}.5\n", n + 1));
    }
    let warnings = |arguments: &[&str]| {
        let stderr = project.ok(arguments).stderr;
        stderr.lines().filter(|line| line.contains("warning  ")).map(str::to_owned).collect::<Vec<_>>()
    };
    let [built] = &warnings(&["build"])[..] else { panic!("one line stands for all") };
    assert!(built.contains("material: 60 items: the material reflects more light"), "{built}");
    assert!(built.ends_with("; for example [m00]"), "{built}");
    assert_eq!(warnings(&["build", "-q"]), [built.as_str()], "the warnings of a build are repeated");
    assert_eq!(warnings(&["build", "--verbose"]).len(), 60);
}
