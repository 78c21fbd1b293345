//! Every error is reported once, with its place.

use super::*;

#[test]
fn all_errors_of_a_manifest_are_reported_at_once() {
    check_errors(
        "skies/dawn.txt",
        r#"
ouput = "x"
out = "../elsewhere"
[stage.sky]
kind = "text-sorce"
source = "skies/*.txt"
[stage."bad name"]
kind = "text-source"
source = "skies/*.txt"
inptu = "sky"
[stage.empty]
kind = "text-source"
source = "skies/*.exr"
[stage.text]
kind = "text-source"
source = "skies/*.txt"
[stage.loud]
kind = "upper"
inputs = { txt = "text" }
[stage.louder]
kind = "upper"
input = "lowd"
[stage.suffixed]
kind = "suffix"
input = "text"
times = "two"
place = "behind"
[stage.after]
kind = "concat"
inputs = { left = "suffixed", right = "loud" }
[stage.many]
kind = "suffix"
text = "x"
times = 10
input = "text"
[stage.joined]
kind = "concat"
inputs = { left = "text" }
[stage.counted]
kind = "count"
input = "text"
[stage.wrong]
kind = "upper"
input = "counted"
[stage.file]
kind = "write"
input = "text"
[stage.of-file]
kind = "upper"
input = "file"
path = "{text}"
"#,
        expect![[r#"
            3:1 unknown key "ouput" | expected one of: schema, out, stage | did you mean "out"?
            4:7 out = "../elsewhere" leaves the manifest's folder | expected a path inside the manifest's folder | out = "out" is the default
            6:8 there is no kind "text-sorce" | expected one of: text-source, upper, private, suffix, concat, collect, count, refuse and 2 more | did you mean "text-source"?
            8:8 "bad name" cannot be the name of a stage | expected only the characters A-Z, a-z, 0-9, _ and -
            11:1 unknown key "inptu" | expected one of: kind, source, path
            14:10 no file matches "skies/*.exr" | expected files in skies | skies contains dawn.txt
            20:12 upper has no port "txt" | expected one of: text | did you mean "text"?
            23:9 there is no stage "lowd" | expected one of: sky, bad name, empty, text, loud, louder, suffixed, after and 6 more | did you mean "loud"?
            24:1 "text" is missing | expected text = a string
            27:9 times: "two" is not a whole number, 0 or more | expected a whole number, 0 or more
            28:9 place: "behind" is not "before" or "after" | expected "before" or "after"
            35:9 times: 10 is more than 9
            37:1 port "right" of stage "joined" is not connected | expected inputs = { right = "STAGE", ... } | these stages make text: bad name, empty, text
            45:9 port "text" takes text, but stage "counted" makes number | expected a stage that makes text | these stages make text: bad name, empty, text
            51:9 port "text" takes text, but stage "file" exports files | expected a stage that makes text | these stages make text: bad name, empty, text
        "#]],
    );
}

#[test]
fn keys_of_the_engine_have_the_right_types() {
    check_errors(
        "a.txt",
        r#"
out = 3
[stage]
loose = 1
[stage.s]
kind = "text-source"
source = ["a.txt"]
[stage.t]
kind = 3
[stage.u]
kind = "upper"
input = ["s"]
[stage.v]
kind = "upper"
inputs = "s"
[stage.w]
kind = "concat"
inputs = { left = "s", right = 3 }
[stage.x]
kind = "upper"
input = "s"
inputs = { text = "s" }
[stage.y]
kind = "collect"
input = "s"
per = "s"
[stage.z]
input = "loose"
"#,
        expect![[r#"
            3:7 3 is not a string | expected out = "..."
            5:9 1 is not a table | expected [stage.loose]
            10:8 3 is not a string | expected kind = "..."
            13:9 an array is not a string | expected input = "..."
            16:10 "s" is not a table | expected inputs = { PORT = "STAGE" } | input = "s" connects the first port
            19:32 3 is not the name of a stage | expected the name of a stage
            23:1 "input" and "inputs" exclude each other | expected only one of them | "input" connects the first port, "inputs" connects ports by name
            27:7 "s" is not an array of strings | expected per = ["..."]
            28:1 stage "z" has no kind | expected kind = "..."
        "#]],
    );
}

#[test]
fn keys_that_a_kind_does_not_use_are_errors() {
    check_errors(
        "a.txt",
        r#"
[stage.s]
kind = "text-source"
[stage.t]
kind = "text-source"
source = "a.txt"
input = "s"
[stage.u]
kind = "upper"
source = "a.txt"
[stage.v]
kind = "upper"
input = "t"
path = "x"
[stage.w]
kind = "upper"
input = "v"
per = ["t"]
"#,
        expect![[r#"
            3:1 stage "s" has no source | expected source = "...", a file, a folder or a glob
            8:9 text-source does not take an input | expected no "input" | it reads files: source = "..."
            9:1 port "text" of stage "u" is not connected | expected input = "STAGE" | these stages make text: s, t, v, w
            11:10 upper does not read files | expected no "source" | connect a stage that makes text: input = "STAGE"
            15:8 stage "v" does not export files | expected no "path" | upper makes text, for other stages
            19:7 upper has no port that takes many items | expected no "per" | "per" chooses how such a port groups its items
        "#]],
    );
}

#[test]
fn per_names_keys_of_the_inputs() {
    let stages = r#"
[stage]
a = { kind = "collect", input = "sky", per = ["skye"] }
b = { kind = "collect", inputs = { texts = "paint", title = "sky" }, per = ["paint"] }
c = { kind = "collect", input = "sky", per = ["sky", "sky"] }
d = { kind = "collect", input = "b", per = ["nothing"] }
"#;
    check_errors(
        FILES,
        &format!("{SOURCES}{stages}"),
        expect![[r#"
            11:47 "skye" is not a key of this stage's inputs | expected one of: sky | did you mean "sky"?
            12:76 "per" leaves out sky, but a port that takes a single item needs it | expected at least "sky"
            13:54 "sky" appears twice | expected each key once
        "#]],
    );
}

#[test]
fn cycles_are_spelled_out() {
    check_errors(
        "a.txt",
        r#"
[stage]
a = { kind = "upper", input = "c" }
b = { kind = "upper", input = "a" }
c = { kind = "upper", input = "b" }
self = { kind = "upper", input = "self" }
after = { kind = "write", input = "c" }
x = { kind = "concat", inputs = { left = "s", right = "y" } }
y = { kind = "concat", inputs = { left = "x", right = "a" } }
s = { kind = "text-source", source = "a.txt" }
"#,
        expect![[r#"
            4:31 stages need each other in a cycle: a needs c, which needs b, which needs a | expected a stage that does not need this one
            7:34 stage "self" needs itself | expected a stage that does not need this one
            9:55 stages need each other in a cycle: x needs y, which needs x | expected a stage that does not need this one
        "#]],
    );
}

#[test]
fn schema_out_and_stages_are_checked() {
    let check = |text: &str, expected: Expect| {
        let plan = Plan::of_bytes(&manifest_file(), text.as_bytes(), &kinds(), &Tree::new(""));
        expected.assert_eq(&shown(&plan.map(|plan| drawn(&plan)).unwrap_err()));
    };
    check(
        "",
        expect![[r#"
            1:1 "schema" is missing | expected schema = 1 on the first line
            1:1 there are no stages | expected [stage.NAME]
        "#]],
    );
    check(
        "schema = 2\nstages = 1\n",
        expect![[r#"
            1:10 unknown schema 2 | expected 1 | this manifest is for another version of Specula
        "#]],
    );
    check(
        "schema = \"1\"\nout = \"/abs\"\n[stage]\n",
        expect![[r#"
            1:10 "1" is not 1 | expected 1
            2:7 out = "/abs" is absolute and leaves the manifest's folder | expected a path inside the manifest's folder | out = "out" is the default
            3:8 there are no stages | expected [stage.NAME]
        "#]],
    );
    check(
        "schema = 1\nout = \".\"\nstage = 1\n",
        expect![[r#"
            2:7 out = "." is the manifest's own folder | expected a folder for exports only, inside the manifest's folder | out = "out" is the default
            3:9 "stage" is not a table of stages | expected [stage.NAME]
        "#]],
    );
    check(
        "schema = 1\nout = \"a/../..\"\n[[stage]]\nkind = \"x\"\n",
        expect![[r#"
            2:7 out = "a/../.." leaves the manifest's folder | expected a path inside the manifest's folder | out = "out" is the default
            3:1 "stage" is not a table of stages | expected [stage.NAME]
        "#]],
    );
    check(
        "schema = 1\nout = 'C:\\out'\n",
        expect![[r#"
            2:7 out = "C:\\out" contains a \ | expected / between folders | out = "out" is the default
            2:15 there are no stages | expected [stage.NAME]
        "#]],
    );
}

#[test]
fn a_mistake_is_reported_once() {
    // What depends on the misspelt kind, the empty glob or the bad parameter is not reported.
    check_errors(
        "a.txt",
        r#"
[stage]
s = { kind = "text-sauce", source = "a.txt" }
e = { kind = "text-source", source = "*.exr" }
u = { kind = "upper", input = "s" }
n = { kind = "count", input = "u" }
v = { kind = "concat", inputs = { left = "u", right = "e" } }
w = { kind = "write", input = "v", path = "{s}/{e}" }
p = { kind = "suffix", input = "e" }
q = { kind = "count", input = "p" }
all = { kind = "collect", input = "v", per = ["s"] }
"#,
        expect![[r#"
            4:14 there is no kind "text-sauce" | expected one of: text-source, upper, private, suffix, concat, collect, count, refuse and 2 more | did you mean "text-source"?
            5:38 no file matches "*.exr" | expected files in /project | /project contains a.txt
            10:5 "text" is missing | expected text = a string
        "#]],
    );
}

#[test]
fn stage_names_appear_unchanged_in_messages() {
    check_errors(
        "a.txt",
        r#"
[stage.what-does-it]
kind = "text-source"
source = "a.txt"
[stage.upper]
kind = "upper"
"#,
        expect![[r#"
            6:1 port "text" of stage "upper" is not connected | expected input = "STAGE" | stage "what-does-it" makes text
        "#]],
    );
}

#[test]
fn too_many_items_are_refused_before_they_are_made() {
    let names: String = (0..101).map(|i| format!("a/{i}.txt ")).collect();
    let mut manifest = String::new();
    for source in ["x", "y", "z"] {
        manifest += &format!("[stage.{source}]\nkind = \"text-source\"\nsource = \"a/*\"\n");
    }
    manifest += "[stage.xyz]\nkind = \"concat\"\ninputs = { left = \"x\", right = \"y\", end = \"z\" }\n";
    check_errors(
        &names,
        &manifest,
        expect![[r#"
            11:1 stage "xyz" makes too many items: 101 of x times 101 of y times 101 of z | expected at most 1000000 items with 16000000 inputs in all stages
        "#]],
    );
}
