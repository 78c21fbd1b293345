//! What arrives at a port that takes the sizes of exported files, or one of the files.

use expect_test::expect;

use super::*;
use crate::kinds::ExportedFiles;
use crate::parameters;

/// Writes the sizes of files to a file, with the names of their items and the parameters of [`Letters`].
struct Sizes;

impl Kind for Sizes {
    type Parameters = Nothing;
    const NAME: &'static str = "sizes";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Lists sizes.\n";
    const SHOWS_KEYS: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::many::<ExportedFiles>("files")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".txt".into()])
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let mut text = String::new();
        for (key, files) in context.inputs.many::<ExportedFiles>("files")? {
            write!(text, "{key}: {:?}, {} in all", files.bytes, files.total()).unwrap();
            if files.kind == Letters::NAME {
                let Letter { letter, times } = Letter::from_canonical(&files.parameters).unwrap();
                write!(text, ", {letter} x {times}").unwrap();
            }
            text.push('\n');
        }
        Ok(Output::files(vec![text.into_bytes()]))
    }
}

fn project() -> Project {
    let mut project = two_texts(
        r#"
schema = 1
[stage]
text = { kind = "text-source", source = "*.txt" }
pair = { kind = "write-pair", input = "text" }
sizes = { kind = "sizes", input = "pair" }
"#,
    );
    project.kinds = kinds().with(Sizes);
    project
}

#[test]
fn a_consumer_of_files_gets_their_sizes_and_reruns_only_if_one_changes() {
    let project = project();
    project.write("b.txt", "");
    assert_has(project.build(), ["5 ran"]);
    // The empty text has no body.
    assert_eq!(project.read("out/sizes.txt"), "a: [3, 1], 4 in all\nb: [0, 1], 1 in all\n");
    assert_has(project.build(), ["ended: 0 ran, 5 up to date"]);

    // Other bytes of the same number.
    project.write("a.txt", "two");
    assert_has(project.build(), ["ran pair [a]\n", "up to date sizes\n", "ended: 2 ran, 3 up to date"]);

    project.write("a.txt", "three");
    expect![[r#"
        planned 3 stages, 5 items
        up to date text [b]
        up to date pair [b]
        run text [a]: file a.txt some -> some
        ran text [a]
        run pair [a]: text text [a] some -> some
        ran pair [a]
        published pair/a/body.txt 5
        published pair/a/index.txt 1
        run sizes: files pair [a] some -> some
        ran sizes
        published sizes.txt 40
        ended: 3 ran, 2 up to date, 0 failed, 0 skipped, 3 published, 0 removed
    "#]]
    .assert_eq(&project.build());
    assert_eq!(project.read("out/sizes.txt"), "a: [5, 1], 6 in all\nb: [0, 1], 1 in all\n");

    // If a text returns to what it was, the cache has everything that was made of it.
    project.write("a.txt", "one");
    assert_has(project.build(), ["ended: 0 ran, 5 up to date"]);
    assert_eq!(project.read("out/sizes.txt"), "a: [3, 1], 4 in all\nb: [0, 1], 1 in all\n");
}

#[test]
fn a_consumer_alone_runs_without_the_files() {
    let mut project = project();
    project.build();
    project.options.force = true;
    project.options.stages = vec!["sizes".into()];
    project.remove("out/sizes.txt");
    assert_has(project.build(), ["run sizes: forced\n", "ended: 1 ran, 4 up to date"]);
    assert_eq!(project.read("out/sizes.txt"), "a: [3, 1], 4 in all\nb: [3, 1], 4 in all\n");
}

#[test]
fn a_failed_export_skips_what_needs_its_size() {
    let project = project();
    project.build();
    std::fs::write(project.folder.join("a.txt"), [0xff, 0xfe]).unwrap();
    assert_has(project.build(), ["1 failed, 2 skipped"]);
    assert_eq!(project.read("out/sizes.txt"), "a: [3, 1], 4 in all\nb: [3, 1], 4 in all\n");
}

#[test]
fn only_a_port_that_asks_for_sizes_takes_an_export() {
    let project = project();
    project.edit("input = \"pair\"", "input = \"text\"");
    let error = Plan::load(&project.path("pipeline.toml"), &project.kinds).err().unwrap().to_string();
    assert_has(
        error,
        ["port \"files\" takes files, but stage \"text\" makes text", "stage \"pair\" makes files"],
    );
}

parameters! {
    /// Parameters of [`Letters`].
    struct Letter {
        /// What is written in place of each letter.
        letter: String = "x".into(),
        /// How often.
        times: usize = 1,
    }
}

/// Writes a file that is as long for every letter.
struct Letters;

impl Kind for Letters {
    type Parameters = Letter;
    const NAME: &'static str = "letters";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Writes letters.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Letter, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".txt".into()])
    }

    fn run(parameters: &Letter, context: &Context<'_>) -> Result<Output, Failure> {
        let count = context.inputs.get::<Text>("text")?.0.len() * parameters.times;
        Ok(Output::files(vec![parameters.letter.repeat(count).into_bytes()]))
    }
}

#[test]
fn a_consumer_of_files_learns_the_parameters_by_which_they_were_made() {
    let mut project = two_texts(
        r#"
schema = 1
[stage]
text = { kind = "text-source", source = "a.txt" }
letters = { kind = "letters", input = "text" }
sizes = { kind = "sizes", input = "letters" }
"#,
    );
    project.kinds = kinds().with(Letters).with(Sizes);
    assert_has(project.build(), ["3 ran"]);
    assert_eq!(project.read("out/sizes.txt"), "a: [3], 3 in all, x x 1\n");
    // Other files of the same size, made by another parameter.
    project.edit("input = \"text\"", "input = \"text\", letter = \"y\"");
    assert_has(project.build(), ["ran letters", "ran sizes", "ended: 2 ran, 1 up to date"]);
    assert_eq!(project.read("out/sizes.txt"), "a: [3], 3 in all, y x 1\n");
    // A default that is written out changes no parameter, so the consumer does not run.
    project.edit("letter = \"y\"", "letter = \"y\", times = 1");
    assert_has(project.build(), ["ended: 0 ran, 3 up to date"]);
    project.edit("times = 1", "times = 2");
    assert_has(project.build(), ["ended: 2 ran, 1 up to date"]);
    assert_eq!(project.read("out/sizes.txt"), "a: [6], 6 in all, y x 2\n");
}

/// Writes the bodies of [`WritePair`](crate::testkit::WritePair) to a file, with the names of their items.
pub(super) struct Bodies;

impl Kind for Bodies {
    type Parameters = Nothing;
    const NAME: &'static str = "bodies";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Lists bodies.\n";
    const SHOWS_KEYS: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::many_files("body", "/body.txt")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".txt".into()])
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let mut text = String::new();
        for (key, body) in context.inputs.many_files("body")? {
            writeln!(text, "{key}: {}", String::from_utf8_lossy(&body)).unwrap();
        }
        Ok(Output::files(vec![text.into_bytes()]))
    }
}

/// Adds a stage that takes the bodies beside the one that takes sizes.
fn project_of_bodies() -> Project {
    let mut project = project();
    project.edit("sizes = {", "bodies = { kind = \"bodies\", input = \"pair\" }\nsizes = {");
    project.kinds = kinds().with(Sizes).with(Bodies);
    project
}

#[test]
fn a_consumer_of_a_file_reruns_if_its_bytes_change() {
    let project = project_of_bodies();
    project.write("b.txt", "");
    assert_has(project.build(), ["6 ran"]);
    assert_eq!(project.read("out/bodies.txt"), "a: one\n", "the empty text has no body");
    assert_has(project.build(), ["ended: 0 ran, 6 up to date"]);

    // Other bytes of the same number.
    project.write("a.txt", "two");
    let built = project.build();
    assert_has(&built, ["run bodies: body pair [a] some -> some\n", "up to date sizes\n", "ended: 3 ran"]);
    assert_eq!(project.read("out/bodies.txt"), "a: two\n");
    // What somebody else wrote into the folder is not read.
    project.write("out/pair/a/body.txt", "six");
    project.write("b.txt", "ten");
    assert_has(project.build(), ["run bodies: body pair [b] some -> some\n"]);
    assert_eq!(project.read("out/bodies.txt"), "a: two\nb: ten\n");

    project.write("a.txt", "one");
    project.write("b.txt", "");
    assert_has(project.build(), ["ended: 0 ran, 6 up to date"]);
    assert_eq!(project.read("out/bodies.txt"), "a: one\n");
}

#[test]
fn a_change_of_other_files_runs_no_consumer_of_a_file() {
    let mut project = project_of_bodies();
    project.kinds = replacing(Numbered).with(Sizes).with(Bodies);
    project.build();
    project.edit("input = \"text\"", "input = \"text\", number = 2");
    assert_has(project.build(), ["ran pair [a]\n", "up to date bodies\n", "run sizes: files pair [a]"]);
}

parameters! {
    /// Parameters of [`Numbered`].
    struct Number {
        /// The second file.
        number: usize = 1,
    }
}

/// Writes a text, and a number.
struct Numbered;

impl Kind for Numbered {
    type Parameters = Number;
    const NAME: &'static str = "write-pair";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Writes two files.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Number, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec!["/body.txt".into(), "/index.txt".into()])
    }

    fn run(parameters: &Number, context: &Context<'_>) -> Result<Output, Failure> {
        let text = context.inputs.get::<Text>("text")?;
        let number = parameters.number.to_string();
        Ok(Output::files(vec![text.0.clone().into_bytes(), number.into_bytes()]))
    }
}

#[test]
fn a_damaged_file_is_made_again_for_those_that_read_it() {
    let project = project_of_bodies();
    project.build();
    // Damage of the same size shows only when the file is read.
    std::fs::write(project.blob("one"), "oen").unwrap();
    project.write("b.txt", "ten");
    assert_has(project.build(), ["run pair [a]: result lost\n", "ended: 5 ran, 1 up to date"]);
    assert_eq!(project.read("out/bodies.txt"), "a: one\nb: ten\n");
    assert_eq!(std::fs::read(project.blob("one")).unwrap(), b"one");
}

#[test]
fn only_an_export_with_the_file_is_taken() {
    let project = project_of_bodies();
    project.edit("kind = \"bodies\", input = \"pair\"", "kind = \"bodies\", input = \"sizes\"");
    let error = Plan::load(&project.path("pipeline.toml"), &project.kinds).err().unwrap().to_string();
    assert_has(
        error,
        [
            "port \"body\" takes files that include /body.txt, but stage \"sizes\" exports files",
            "stage \"pair\" makes files that include /body.txt",
        ],
    );
}
