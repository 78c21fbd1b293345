//! The files that a source matches, and the errors if it matches none.

use super::*;
use crate::platform::path_text;

/// Checks what is found for each pair of files and a source.
fn check(pairs: &[(&str, &str)], expected: Expect) {
    let lines = |&(files, source): &(&str, &str)| marked(source, &found(files, &format!("\"{source}\"")));
    expected.assert_eq(&pairs.iter().map(lines).collect::<String>());
}

/// Checks sources that are written as TOML writes them. Warnings come after the files.
fn check_values(files: &str, sources: &[&str], expected: Expect) {
    expected
        .assert_eq(&sources.iter().map(|source| marked(source, &found(files, source))).collect::<String>());
}

/// The files that the source matches, by their paths in `/project`, and nothing else.
#[track_caller]
fn check_found(files: &str, source: &str, expected: &[&str]) {
    let expected = expected.iter().map(|file| format!("/project/{file}\n")).collect::<String>();
    assert_eq!(found(files, source), expected, "{source}");
}

/// The files, in lines, and the warnings or errors.
fn found(files: &str, source: &str) -> String {
    let manifest = format!("[stage.s]\nkind = \"text-source\"\nsource = {source}\n");
    match load(files, &manifest) {
        Ok(plan) => {
            let sources = plan.items.iter().map(|item| path_text(item.source.as_ref().unwrap()));
            test_data::unix_paths(sources.map(|source| format!("{source}\n")).collect::<String>())
                + &shown(&plan.warnings)
        }
        Err(errors) => shown(&errors),
    }
}

#[test]
fn alternatives_and_depth() {
    let files = "a/x.exr a/y.hdr a/z.png a/b/w.exr a/b/c/v.exr q/u.exr";
    check_found(files, r#""a/*.{exr,hdr}""#, &["a/x.exr", "a/y.hdr"]);
    check_found(files, r#""a/**/*.exr""#, &["a/b/c/v.exr", "a/b/w.exr", "a/x.exr"]);
    check_found(files, r#""{a/*.hdr,q/*.exr}""#, &["q/u.exr", "a/y.hdr"]);
    check_found(files, r#""a/?/*.exr""#, &["a/b/w.exr"]);
    check_found(files, r#""*/b/[v-x].exr""#, &["a/b/w.exr"]);
    check_found(files, r#""**/v.*""#, &["a/b/c/v.exr"]);
    check_found(files, r#""../project/q/*""#, &["../project/q/u.exr"]);
}

#[test]
fn exports_hidden_folders_and_links_below_a_double_star_are_not_searched() {
    check_found("out/x.exr .specula/y.exr a/z.exr", r#""**/*.exr""#, &["a/z.exr"]);
    let mut tree = Tree::new("a/z.exr b/y.exr");
    let names = tree.0.get_mut(Path::new(PROJECT)).unwrap();
    *names = names.iter().cloned().map(|name| Name { link: name.name == "b", ..name }).collect();
    let found = |source: &str| {
        let text = format!("schema = 1\n[stage.s]\nkind = \"text-source\"\nsource = \"{source}\"\n");
        let plan = Plan::of_bytes(&manifest_file(), text.as_bytes(), &kinds(), &tree).unwrap();
        plan.items.iter().map(|item| item.key.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(found("**/*.exr"), ["z"]);
    assert_eq!(found("*/*.exr"), ["y", "z"]);
}

#[test]
fn a_glob_that_matches_nothing_shows_what_exists() {
    check(
        &[
            ("a/x.png a/sub/y.exr", "a/*.exr"),
            ("a/sub/", "a/sub/*.exr"),
            ("assets/environments/x.exr", "assets/enviroments/*.exr"),
            ("a/b.txt", "x/y/z/*.exr"),
            ("../assets/x.png", "../assets/*.exr"),
            ("a/[x].exr", "a/[x].exr"),
            ("a/1 a/2 a/3 a/4 a/5 a/6 a/7 a/8 a/9 a/10 a/11", "a/*.exr"),
        ],
        expect![[r#"
        a/*.exr: 4:10 no file matches "a/*.exr" | expected files in a | a contains sub/, x.png
        a/sub/*.exr: 4:10 no file matches "a/sub/*.exr" | expected files in a/sub | a/sub is empty
        assets/enviroments/*.exr: 4:10 no file matches "assets/enviroments/*.exr" | expected files in assets/enviroments | the folder assets/enviroments does not exist; assets contains environments/; did you mean "environments"?
        x/y/z/*.exr: 4:10 no file matches "x/y/z/*.exr" | expected files in x/y/z | the folder x does not exist; /project contains a/
        ../assets/*.exr: 4:10 no file matches "../assets/*.exr" | expected files in /assets | /assets contains x.png
        a/[x].exr: 4:10 no file matches "a/[x].exr" | expected files in a | there is a file with exactly this name: put its special characters in brackets, such as [[] for [
        a/*.exr: 4:10 no file matches "a/*.exr" | expected files in a | a contains 1, 10, 11, 2, 3, 4, 5, 6 and 3 more
    "#]],
    );
}

#[test]
fn a_missing_file_is_reported_with_the_nearest_name() {
    check(
        &[("a/sky.exr", "a/sky.hdr"), ("a/sky.exr", "b/sky.exr"), ("a/sky.exr", "a/b/c.exr")],
        expect![[r#"
        a/sky.hdr: 4:10 there is no file or folder "a/sky.hdr" | expected a file, a folder or a glob | a contains sky.exr; did you mean "sky.exr"?
        b/sky.exr: 4:10 there is no file or folder "b/sky.exr" | expected a file, a folder or a glob | the folder b does not exist; /project contains a/
        a/b/c.exr: 4:10 there is no file or folder "a/b/c.exr" | expected a file, a folder or a glob | the folder a/b does not exist; a contains sky.exr
    "#]],
    );
}

#[test]
fn invalid_sources_are_errors() {
    check(
        &[
            ("", ""),
            ("", "a\\\\*.exr"),
            ("", "a/{b"),
            ("", "a/[b"),
            ("", ".."),
            ("", "."),
            ("out/x.exr", "out/*.exr"),
            ("out/x.exr", "a/../out/x.exr"),
            ("a/x.exr a/x.hdr a/y.exr a/y.hdr", "a/*"),
        ],
        expect![[r#"
        : 4:10 the source is empty | expected a file, a folder or a glob
        a\\*.exr: 4:10 a source cannot contain \ | expected / between folders | write "a/*.exr"
        a/{b: 4:10 "a/{b" is not a valid glob: unclosed alternate group; missing '}' (maybe escape '{' with '[{]'?) | to match a special character itself, put it in brackets: [[] or [*]
        a/[b: 4:10 "a/[b" is not a valid glob: unclosed character class; missing ']' | to match a special character itself, put it in brackets: [[] or [*]
        ..: 4:10 ".." does not end in a name, but its item needs one | expected a file, a folder or a glob | name the folder: "../faces"
        .: 4:10 "." does not end in a name, but its item needs one | expected a file, a folder or a glob | name the folder: "../faces"
        out/*.exr: 4:10 "out/*.exr" is inside "out", the folder for exports | connect the stage that makes the file instead, or move the file
        a/../out/x.exr: 4:10 "a/../out/x.exr" is inside "out", the folder for exports | connect the stage that makes the file instead, or move the file
        a/*: 4:10 2 files have the stem "x": a/x.exr, a/x.hdr | expected one file for each stem | the stem is the item's name: rename a file, leave one out, or use a stage for each glob
        a/*: 4:10 2 files have the stem "y": a/y.exr, a/y.hdr | expected one file for each stem | the stem is the item's name: rename a file, leave one out, or use a stage for each glob
    "#]],
    );
}

#[test]
fn several_globs_and_what_they_leave_out() {
    let files = "sky/noon.hdr sky/old_noon.hdr sky/old/dawn.hdr sky/lab/lamp.hdr lab/probe.exr";
    check_found(files, r#"["sky/*.hdr", "!sky/old_*"]"#, &["sky/noon.hdr"]);
    check_found(files, r#"["!sky/old_*", "sky/*.hdr", "lab/probe.exr"]"#, &["sky/noon.hdr", "lab/probe.exr"]);
    // A folder that is left out is not searched.
    check_found(
        files,
        r#"["sky/**/*.hdr", "!sky/old"]"#,
        &["sky/lab/lamp.hdr", "sky/noon.hdr", "sky/old_noon.hdr"],
    );
    check_found(
        files,
        r#"["sky/**/*.hdr", "!**/lamp.*", "!./sky/../sky/old/*"]"#,
        &["sky/noon.hdr", "sky/old_noon.hdr"],
    );
    // A file that two globs match is one item.
    check_found(files, r#"["sky/n*.hdr", "./sky/../sky/noon.hdr", "sky/noon.hdr"]"#, &["sky/noon.hdr"]);
    check_values(
        files,
        &[r#"["sky/*.hdr", "!sky/odl_*"]"#],
        expect![[r#"
        ["sky/*.hdr", "!sky/odl_*"]: /project/sky/noon.hdr
        ["sky/*.hdr", "!sky/odl_*"]: /project/sky/old_noon.hdr
        ["sky/*.hdr", "!sky/odl_*"]: 4:24 "!sky/odl_*" excludes nothing: no file of this source matches it
    "#]],
    );
}

#[test]
fn a_source_without_a_file_to_read_is_an_error() {
    let files = "sky/noon.hdr sky/dawn.hdr";
    check_values(
        files,
        &[
            r#""!sky/old_*""#,
            "[]",
            r#"["sky/*.hdr", "!sky"]"#,
            r#"["sky/*.hdr", "!"]"#,
            r#"["sky/*.hdr", "sky/*.exr"]"#,
            r#"["sky/*.hdr", 7]"#,
        ],
        expect![[r#"
        "!sky/old_*": 4:10 the source lists nothing to read | expected a file, a folder or a glob | to leave files out: source = ["sky/*.hdr", "!sky/old_*"]
        []: 4:10 the source lists nothing to read | expected a file, a folder or a glob | to leave files out: source = ["sky/*.hdr", "!sky/old_*"]
        ["sky/*.hdr", "!sky"]: 4:10 the source excludes every file that it matches | expected at least one file | narrow the pattern after the !
        ["sky/*.hdr", "!"]: 4:24 the source is empty | expected a file, a folder or a glob
        ["sky/*.hdr", "sky/*.exr"]: 4:24 no file matches "sky/*.exr" | expected files in sky | sky contains dawn.hdr, noon.hdr
        ["sky/*.hdr", 7]: 4:10 an array is not an array of strings | expected source = ["..."]
    "#]],
    );
}

#[test]
fn a_file_that_differs_in_case_only_is_named() {
    check(
        &[("sky/a.hdr sky/B.HDR sky/c.Exr sky/d.png", "sky/*.{exr,hdr}")],
        expect![[r#"
        sky/*.{exr,hdr}: /project/sky/a.hdr
        sky/*.{exr,hdr}: 4:10 2 files are not read: they differ from "sky/*.{exr,hdr}" only in case: sky/B.HDR, sky/c.Exr | rename it, or add its spelling to the glob: *.{hdr,HDR}
    "#]],
    );
    check_found("sky/a.hdr sky/B.HDR", r#"["sky/*.hdr", "sky/*.HDR"]"#, &["sky/B.HDR", "sky/a.hdr"]);
    check(
        &[("sky/B.HDR", "sky/*.hdr")],
        expect![[r#"
        sky/*.hdr: 4:10 no file matches "sky/*.hdr" | expected files in sky | sky/B.HDR differs only in case, and case counts
    "#]],
    );
    check_found("sky/a.hdr sky/B.HDR", r#"["sky/*.hdr", "!sky/*.HDR"]"#, &["sky/a.hdr"]);
}

#[test]
fn what_a_shell_expands_is_not_expanded_and_said_so() {
    check(
        &[("sky/a.hdr", "~/sky/*.hdr"), ("sky/a.hdr", "$HDRI/*.hdr"), ("sky/a.hdr", "${HDRI}/sky.hdr")],
        expect![[r#"
        ~/sky/*.hdr: 4:10 no file matches "~/sky/*.hdr" | expected files in ~/sky | a source does not expand ~: write the path itself
        $HDRI/*.hdr: 4:10 no file matches "$HDRI/*.hdr" | expected files in $HDRI | a source does not expand $HDRI: write the path itself
        ${HDRI}/sky.hdr: 4:10 no file matches "${HDRI}/sky.hdr" | expected files in /project | a source does not expand ${HDRI}: write the path itself
    "#]],
    );
    check_found("$HDRI/sky.hdr", r#""$HDRI/sky.hdr""#, &["$HDRI/sky.hdr"]);
    let errors = load("a.txt", "out = \"~/out\"\n[stage.s]\nkind = \"text-source\"\nsource = \"a.txt\"");
    expect![[r#"
        2:7 out = "~/out" would be a folder with that name: ~ is not expanded | expected a folder inside the manifest's folder | out = "out" is the default
    "#]].assert_eq(&shown(&errors.map(|plan| drawn(&plan)).unwrap_err()));
}
