//! Loads manifests from the disk, expands them again, and measures how long it takes.

use super::*;

#[test]
fn a_missing_manifest_is_an_error_with_help() {
    let folder = tempfile::tempdir().unwrap();
    let error = |name: &str| {
        let errors = Plan::load(&folder.path().join(name), &kinds()).map(|plan| drawn(&plan)).unwrap_err();
        let error = errors.errors[0].clone();
        format!("{} | {}", error.message, error.help.or(error.expected).unwrap_or_default())
    };
    assert!(error("pipeline.toml").ends_with("there is no .toml file in that folder"));
    std::fs::write(folder.path().join("pipline.toml"), "").unwrap();
    assert!(error("pipeline.toml").ends_with("did you mean \"pipline.toml\"?"));
    assert!(error("no/pipeline.toml").ends_with("that folder does not exist"));
    assert_eq!(error("."), "the manifest is a folder | expected a file, pipeline.toml");
}

#[test]
fn items_are_expanded_again_without_the_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("skies")).unwrap();
    std::fs::write(path("skies/dawn.txt"), "dawn").unwrap();
    std::fs::write(path("pipeline.toml"), "schema = 1\n[stage.sky]\nkind = \"text-source\"\nsource = \"skies/*.txt\"\n[stage.one]\nkind = \"text-source\"\nsource = \"skies/dawn.txt\"\n").unwrap();
    let graph = Graph::load(&path("pipeline.toml"), &kinds()).unwrap();
    std::fs::remove_file(path("pipeline.toml")).unwrap();
    assert_eq!(graph.expand(&DiskFolders).unwrap().items.len(), 2);
    std::fs::write(path("skies/noon.txt"), "noon").unwrap();
    let plan = graph.expand(&DiskFolders).unwrap();
    assert_eq!(plan.items.len(), 3);
    assert_eq!(plan.out, path("out"));
    std::fs::remove_file(path("skies/dawn.txt")).unwrap();
    assert_eq!(graph.expand(&DiskFolders).map(|plan| drawn(&plan)).unwrap_err().errors.len(), 1);

    let (name, sky) = graph.sources().next().unwrap();
    assert_eq!((name, sky.text()), ("sky", "skies/*.txt"));
    assert!(sky.folders().eq([path("skies/").as_path()]));
    assert!(sky.concerns(&path("skies/new.txt")));
    for other in ["skies/new.exr", "skies/.new.txt", "skies/new.txt~", "new.txt", "skies/deep/new.txt"] {
        assert!(!sky.concerns(&path(other)), "{other}");
    }
    let (_, one) = graph.sources().nth(1).unwrap();
    assert!(one.concerns(&path("skies/dawn.txt")) && !one.concerns(&path("skies/noon.txt")));
}

#[test]
fn ten_thousand_items_are_planned_quickly() {
    let names =
        |folder: &str, count: usize| (0..count).map(|i| format!("{folder}/{i}.txt ")).collect::<String>();
    let tree = Tree::new(&(names("skies", 70) + &names("paints", 70)));
    let manifest = format!(
        "schema = 1\n{SOURCES}[stage.mixed]\nkind = \"concat\"\ninputs = {{ left = \"sky\", right = \"paint\" }}\n[stage.file]\nkind = \"write\"\ninput = \"mixed\"\n[stage.all]\nkind = \"collect\"\ninput = \"mixed\"\n"
    );
    let mut least = std::time::Duration::MAX;
    for _ in 0..5 {
        let start = std::time::Instant::now();
        let plan = Plan::of_bytes(&manifest_file(), manifest.as_bytes(), &kinds(), &tree).unwrap();
        least = least.min(start.elapsed());
        assert_eq!(plan.items.len(), 70 + 70 + 4900 + 4900 + 1);
        assert_eq!(plan.items.last().unwrap().inputs[0].len(), 4900);
    }
    // It takes 20 ms on an idle core of 2025; the bound only excludes a join that compares all pairs, on a
    // busy machine.
    assert!(least < std::time::Duration::from_secs(2), "{least:?}");
}

#[test]
fn thousands_of_stages_in_a_row_or_in_a_cycle_do_not_overflow_the_stack() {
    let count = 5000;
    let chain = |first: &str| {
        let stages = (1..count).map(|i| format!("[stage.s{i}]\nkind = \"upper\"\ninput = \"s{}\"\n", i - 1));
        format!("[stage.s0]\n{first}\n{}", stages.collect::<String>())
    };
    let plan = load("a.txt", &chain("kind = \"text-source\"\nsource = \"a.txt\"")).unwrap();
    assert_eq!(plan.items.len(), count);
    let cycle = load("", &chain(&format!("kind = \"upper\"\ninput = \"s{}\"", count - 1)));
    expect![[r#"
        4:9 stages need each other in a cycle: s0 needs s4999, needs s4998, needs s4997, needs s4996, needs s4995, needs s4994, needs s4993, needs s4992 and 4992 more | expected a stage that does not need this one
    "#]].assert_eq(&shown(&cycle.map(|plan| drawn(&plan)).unwrap_err()));
}

#[cfg(unix)]
#[test]
fn cyclic_links_are_not_followed_and_only_files_are_items() {
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;

    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("a")).unwrap();
    std::fs::write(path("a/x.txt"), "").unwrap();
    symlink(path("a"), path("a/loop")).unwrap();
    symlink(path("nowhere"), path("a/broken.txt")).unwrap();
    symlink(path("a/x.txt"), path("a/linked.txt")).unwrap();
    let _socket = UnixListener::bind(path("a/socket.txt")).unwrap();
    std::fs::write(
        path("pipeline.toml"),
        "schema = 1\n[stage.s]\nkind = \"text-source\"\nsource = \"a/**/*.txt\"\n",
    )
    .unwrap();
    let plan = Plan::load(&path("pipeline.toml"), &kinds()).unwrap();
    let stems: Vec<_> = plan.items.iter().map(|item| item.key.to_string()).collect();
    assert_eq!(stems, ["broken", "linked", "x"]);
}
