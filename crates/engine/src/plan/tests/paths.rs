//! The paths of exported files, and paths that are errors.

use super::*;

/// The manifest of an export with this path.
fn with_path(path: &str) -> String {
    let path = serde_json::json!(path);
    format!(
        "{SOURCES}[stage.mixed]\nkind = \"concat\"\ninputs = {{ left = \"sky\", right = \"paint\" }}\n[stage.export]\nkind = \"write\"\ninput = \"mixed\"\npath = {path}\n"
    )
}

/// Checks the files or errors of each path.
fn check(paths: &[&str], expected: Expect) {
    let text = paths.iter().map(|path| match load(FILES, &with_path(path)) {
        Ok(plan) => {
            let files = plan.items.iter().flat_map(|item| &item.files);
            marked(path, &files.map(|file| format!("{file}\n")).collect::<String>())
        }
        Err(errors) => marked(path, &shown(&errors)),
    });
    expected.assert_eq(&text.collect::<String>());
}

#[test]
fn placeholders_are_stems() {
    check(
        &["{sky}/{paint}/map", "all/{paint}-{sky}"],
        expect![[r#"
        {sky}/{paint}/map: dawn/gold/map.txt
        {sky}/{paint}/map: noon/gold/map.txt
        {sky}/{paint}/map: dawn/red/map.txt
        {sky}/{paint}/map: noon/red/map.txt
        all/{paint}-{sky}: all/gold-dawn.txt
        all/{paint}-{sky}: all/gold-noon.txt
        all/{paint}-{sky}: all/red-dawn.txt
        all/{paint}-{sky}: all/red-noon.txt
    "#]],
    );
}

#[test]
fn the_default_is_the_stage_and_its_keys() {
    let stage = "[stage.export]\nkind = \"write-pair\"\ninput = \"sky\"\n[stage.all]\nkind = \"collect\"\ninput = \"sky\"\n[stage.report]\nkind = \"write\"\ninput = \"all\"\n";
    let plan = load(FILES, &format!("{SOURCES}{stage}")).unwrap();
    let files: Vec<_> = plan.items.iter().flat_map(|item| &item.files).collect();
    assert_eq!(
        files,
        [
            "export/dawn/body.txt",
            "export/dawn/index.txt",
            "export/noon/body.txt",
            "export/noon/index.txt",
            "report.txt"
        ]
    );
}

#[test]
fn a_path_that_is_not_valid_on_every_system_is_an_error() {
    for path in [
        "../{sky}/{paint}",
        "a/../../{sky}/{paint}",
        "/abs/{sky}/{paint}",
        "C:/{sky}/{paint}",
        "{sky}\\{paint}",
        "\\\\server\\{sky}{paint}",
        "{sky}//{paint}",
        "./{sky}/{paint}",
        "{sky}/{paint}/",
        ".{sky}/{paint}",
        "con/{sky}/{paint}",
        "{sky}/{paint}/Lpt1",
        "{sky}./{paint}",
        "{sky} /{paint}",
        "{sky}/{paint}?",
        "{sky}/a:b{paint}",
        "{sky}/{paint}\u{7f}",
    ] {
        let errors = load(FILES, &with_path(path));
        assert_eq!(errors.map(|plan| drawn(&plan)).unwrap_err().errors.len(), 1, "{path}");
    }
    check(
        &["../{sky}/{paint}", "C:/{sky}/{paint}", r"{sky}\{paint}", "nul/{sky}{paint}", "{sky}/{paint}.", ""],
        expect![[r#"
        ../{sky}/{paint}: 15:8 "../{sky}/{paint}" leaves "out" | expected a path inside "out"
        C:/{sky}/{paint}: 15:8 "C:/{sky}/{paint}" is absolute and leaves "out" | expected a path inside "out"
        {sky}\{paint}: 15:8 "{sky}\\{paint}" contains a \ | expected / between folders
        nul/{sky}{paint}: 15:8 "nul/{sky}{paint}" contains "nul", which is a device on Windows | expected another name
        {sky}/{paint}.: 15:8 "{sky}/{paint}." has a name that ends with a dot or a space, which Windows drops | expected another ending
        : 15:8 "" is empty | expected a path inside "out"
    "#]],
    );
}

// Windows has no file `b:c.txt`.
#[cfg(not(windows))]
#[test]
fn a_stem_that_is_not_valid_on_every_system_is_an_error() {
    check_errors(
        "a/con.txt a/b:c.txt",
        "[stage.s]\nkind = \"text-source\"\nsource = \"a/*\"\n[stage.w]\nkind = \"write\"\ninput = \"s\"\n",
        expect![[r#"
            5:8 the file "w/b:c.txt" of item [b:c] contains ':', which Windows does not allow in names | expected another character
        "#]],
    );
}

#[test]
fn wrong_placeholders_are_errors() {
    check(
        &["{skie}/{paint}", "{stage}/{mixed}", "{sky}/{paint", "{sky}}/{paint}", "{sky}/x", "x"],
        expect![[r#"
        {skie}/{paint}: 15:8 {skie} is not a key of this stage's items | expected one of: {paint}, {sky} | did you mean {sky}?
        {stage}/{mixed}: 15:8 {stage} is not a key of this stage's items | expected one of: {paint}, {sky} | to use the stage's name, write it: export
        {stage}/{mixed}: 15:8 {mixed} is not a key of this stage's items | expected one of: {paint}, {sky}
        {sky}/{paint: 15:8 "{sky}/{paint" has an unmatched brace | expected {SOURCE STAGE}
        {sky}}/{paint}: 15:8 "{sky}}/{paint}" has an unmatched brace | expected {SOURCE STAGE}
        {sky}/x: 15:8 the path is the same for several items of "export" | expected {paint} in the path
        x: 15:8 the path is the same for several items of "export" | expected {paint} and {sky} in the path
    "#]],
    );
}

#[test]
fn two_items_that_write_the_same_file_are_an_error() {
    let stages = r#"
[stage]
a = { kind = "write", input = "sky", path = "maps/{sky}" }
b = { kind = "write", input = "sky", path = "Maps/{sky}" }
c = { kind = "write", input = "paint", path = "{paint}" }
d = { kind = "write-pair", input = "paint", path = "{paint}.txt" }
"#;
    check_errors(
        FILES,
        &format!("{SOURCES}{stages}"),
        expect![[r#"
            12:45 a [dawn] and b [dawn] write "maps/dawn.txt" and "Maps/dawn.txt", which are the same file if case is ignored | expected a path that no other item has | change the path of one of the stages
            14:52 c [gold] writes the file "gold.txt", but d [gold] needs a folder of that name for "gold.txt/body.txt" | expected a path that no other item has | change the path of one of the stages
        "#]],
    );
    check_errors(
        "s/a.txt s/ab.txt p/bc.txt p/c.txt",
        "[stage.s]\nkind = \"text-source\"\nsource = \"s/*\"\n[stage.p]\nkind = \"text-source\"\nsource = \"p/*\"\n[stage.m]\nkind = \"concat\"\ninputs = { left = \"s\", right = \"p\" }\n[stage.w]\nkind = \"write\"\ninput = \"m\"\npath = \"{s}{p}\"\n",
        expect![[r#"
            14:8 w [bc, a] and w [c, ab] both write "abc.txt" | expected a path that no other item has | separate the placeholders with a / or another character
        "#]],
    );
}

#[test]
fn files_that_differ_only_in_case_are_the_same_export() {
    check_errors(
        "a/Sky.txt a/sky.txt",
        "[stage.s]\nkind = \"text-source\"\nsource = \"a/*\"\n[stage.w]\nkind = \"write\"\ninput = \"s\"\n",
        expect![[r#"
            5:8 w [Sky] and w [sky] write "w/Sky.txt" and "w/sky.txt", which are the same file if case is ignored | expected a path that no other item has | rename a/Sky.txt or a/sky.txt
        "#]],
    );
}

#[test]
fn files_that_differ_only_in_the_encoding_of_accents_are_the_same_export() {
    let source = "[stage.s]\nkind = \"text-source\"\nsource = \"a/*\"\n";
    let write = |stage: &str, path: &str| {
        format!("[stage.{stage}]\nkind = \"write\"\ninput = \"s\"\npath = \"{path}\"\n")
    };
    let files = "a/caf\u{e9}.txt a/cafe\u{301}.txt";
    check_errors(
        files,
        &format!("{source}{}", write("w", "{s}")),
        expect![[r#"
            8:8 w [café] and w [café] write "cafe\u{301}.txt" and "café.txt", which are the same file on macOS: they have the same letters in different encodings | expected a path that no other item has | rename "a/cafe\u{301}.txt" or "a/café.txt"
        "#]],
    );
    // Exports of two stages.
    check_errors(
        "a/x.txt",
        &format!("{source}{}{}", write("v", "\u{c9}t\u{e9}/{s}"), write("w", "e\u{301}te\u{301}/{s}")),
        expect![[r#"
            12:8 v [x] and w [x] write "Été/x.txt" and "e\u{301}te\u{301}/x.txt", which are the same file on macOS: they have the same letters in different encodings | expected a path that no other item has | change the path of one of the stages
        "#]],
    );
    check_errors(
        "a/Caf\u{e9}.txt a/cafe\u{301}.txt",
        &format!("{source}{}{}", write("v", "v/{s}"), write("w", "v/{s}x")),
        expect![[r#"
            8:8 v [Café] and v [café] write "v/Café.txt" and "v/cafe\u{301}.txt", which are the same file on macOS: they have the same letters in different encodings | expected a path that no other item has | rename a/Café.txt or a/café.txt
            12:8 w [Café] and w [café] write "v/Caféx.txt" and "v/cafe\u{301}x.txt", which are the same file on macOS: they have the same letters in different encodings | expected a path that no other item has | rename a/Café.txt or a/café.txt
        "#]],
    );
}
