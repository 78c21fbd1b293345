//! Random edits between builds, as artists, version control and machines make them: links, folders that are
//! renamed, exclusions, programs in PATH, files with two names. After each round `specula build` makes `out`
//! equal to that of a clean build in another folder, byte for byte.
//!
//! `SPECULA_ROUNDS` sets the number of rounds, `SPECULA_SEED` repeats them.

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::support::{files_below, uniform};
use test_data::{length, say};

const MANIFEST: &str = r#"
schema = 1
[stage.env]
kind = "import-environment"
source = ["env/**/*.hdr", "env/linked/*.hdr", "!**/none_*"]

[stage.light]
kind = "project-sh"
input = "env"
degree = 2

[stage.sh]
kind = "export-sh"
input = "light"
path = "{env}/sh"

[stage.graded]
kind = "exec"
command = ["grade", "{folder}/tools/word.txt", "--lut={folder}/luts/film.cube", "{input.env}", "{output}"]
inputs = { env = "env" }
output = { type = "file", format = "txt" }
path = "{env}/graded"
"#;

/// A change of the project or of what is around it, with its name.
type Edit = (&'static str, fn(&mut Edited));

const EDITS: &[Edit] = &[
    ("an image saved", |project| {
        let path = project.any_image();
        project.draw(&path);
    }),
    ("an image with an old time", |project| {
        let path = project.any_image();
        let time = fs::metadata(&path).unwrap().modified().unwrap();
        project.draw(&path);
        fs::File::options().write(true).open(&path).unwrap().set_modified(time).unwrap();
    }),
    ("a new image", |project| {
        let name = format!("env/n{}.hdr", project.below(5));
        let path = project.path(&name);
        project.draw(&path);
    }),
    ("an image deleted", |project| {
        let name = format!("env/n{}.hdr", project.below(5));
        let _ = fs::remove_file(project.path(&name));
    }),
    ("an image renamed", |project| {
        let [from, to] = [(); 2].map(|()| format!("env/n{}.hdr", project.below(5)));
        let _ = fs::rename(project.path(&from), project.path(&to));
    }),
    ("a folder renamed", |project| {
        let (here, there) = (project.path("env/here"), project.path("env/there"));
        let (from, to) = if here.exists() { (here, there) } else { (there, here) };
        fs::rename(from, to).unwrap();
    }),
    ("a link to an image replaced", |project| {
        let target = format!("../store/{}.hdr", project.one_of(&["a", "b"]));
        project.link(&target, "env/link.hdr");
    }),
    ("a link to a folder of images replaced", |project| {
        let target = format!("../store/{}", project.one_of(&["one", "two"]));
        project.link(&target, "env/linked");
    }),
    ("an image behind a link", |project| {
        let name = *project.one_of(&["store/a.hdr", "store/b.hdr", "store/one/in.hdr", "store/two/in.hdr"]);
        let path = project.path(name);
        project.draw(&path);
    }),
    ("an image edited by its other name", |project| {
        let path = project.path("store/second-name.hdr");
        project.draw(&path);
    }),
    ("an exclusion", |project| {
        let excluded =
            *project.one_of(&["**/none_*", "env/n[0-2].hdr", "env/here", "env/linked", "**/link.*"]);
        project.edit_manifest(|text| {
            let (before, after) = text.split_once("\"!").unwrap();
            format!("{before}\"!{excluded}\"{}", after.split_once('"').unwrap().1)
        });
    }),
    ("a parameter", |project| {
        let degree = project.below(4);
        project.edit_manifest(|text| {
            let (before, after) = text.split_once("degree = ").unwrap();
            format!("{before}degree = {degree}{}", &after[1..])
        });
    }),
    ("a tool file", |project| project.write("tools/word.txt")),
    ("a file inside an argument", |project| {
        let name = *project.one_of(&["luts-a/film.cube", "luts-b/film.cube"]);
        project.write(name);
    }),
    ("a link to a folder in an argument replaced", |project| {
        let target = *project.one_of(&["luts-a", "luts-b"]);
        project.link(target, "luts");
    }),
    ("PATH", |project| {
        let folders: &[&[&str]] = &[&["one", "two"], &["two", "one"], &["one"], &["two"], &["none", "two"]];
        project.programs = project.one_of(folders).to_vec();
    }),
    ("a program", |project| {
        let name = *project.one_of(&["one", "two"]);
        project.program(name);
    }),
    ("a program that may not be run", |project| {
        let mode = *project.one_of(&[0o644, 0o755]);
        let program = project.folder.path().join("one/grade");
        fs::set_permissions(program, fs::Permissions::from_mode(mode)).unwrap();
    }),
    ("exports deleted", |project| {
        let name = *project.one_of(&["out", "out/kept", "out/kept/sh.json"]);
        let path = project.path(name);
        let _ = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
    }),
    ("the project moved", |project| {
        let next = if project.name == "project" { "moved" } else { "project" };
        fs::rename(project.path(""), project.folder.path().join(next)).unwrap();
        project.name = next;
    }),
];

/// A project, the programs around it, and the folders of PATH.
struct Edited {
    folder: tempfile::TempDir,
    name: &'static str,
    programs: Vec<&'static str>,
    seed: u64,
}

impl Edited {
    fn new(seed: u64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut project = Self { folder, name: "project", programs: vec!["one", "two"], seed };
        for folder in ["env/here", "store/one", "store/two", "tools", "luts-a", "luts-b"] {
            fs::create_dir_all(project.path(folder)).unwrap();
        }
        let images = ["env/kept.hdr", "env/here/deep.hdr", "store/a.hdr", "store/b.hdr"];
        for name in images.iter().chain(&["store/one/in.hdr", "store/two/in.hdr", "store/second-name.hdr"]) {
            let path = project.path(name);
            project.draw(&path);
        }
        fs::hard_link(project.path("store/second-name.hdr"), project.path("env/twice.hdr")).unwrap();
        symlink("../store/a.hdr", project.path("env/link.hdr")).unwrap();
        symlink("../store/one", project.path("env/linked")).unwrap();
        symlink("luts-a", project.path("luts")).unwrap();
        for name in ["tools/word.txt", "luts-a/film.cube", "luts-b/film.cube"] {
            project.write(name);
        }
        for name in ["one", "two"] {
            fs::create_dir(project.folder.path().join(name)).unwrap();
            project.program(name);
        }
        fs::write(project.path("pipeline.toml"), MANIFEST).unwrap();
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(self.name).join(name)
    }

    fn below(&mut self, bound: usize) -> usize {
        self.seed += 1;
        (uniform(self.seed) * bound as f64) as usize
    }

    fn one_of<'a, T>(&mut self, things: &'a [T]) -> &'a T {
        &things[self.below(things.len())]
    }

    /// An image of one colour, as a file that keeps its other names.
    fn draw(&mut self, path: &Path) {
        let colour = [(); 3].map(|()| 64 + self.below(192) as u8);
        let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n".to_vec();
        bytes.extend([colour[0], colour[1], colour[2], 128].repeat(32));
        fs::write(path, bytes).unwrap();
    }

    fn any_image(&mut self) -> PathBuf {
        let images = files_below(&self.path("env")).into_keys().collect::<Vec<_>>();
        let name = self.one_of(&images).clone();
        self.path("env").join(name)
    }

    /// Writes a text that was never there before.
    fn write(&mut self, name: &str) {
        self.seed += 1;
        fs::write(self.path(name), format!("{}\n", self.seed)).unwrap();
    }

    /// Another version of the program in a folder.
    fn program(&mut self, folder: &str) {
        self.seed += 1;
        let script = format!(
            "#!/bin/sh\n{{ echo {}; cat \"$1\" \"${{2#--lut=}}\"; cksum < \"$3\"; }} > \"$4\"\n",
            self.seed
        );
        let file = self.folder.path().join(folder).join("grade");
        fs::write(&file, script).unwrap();
        fs::set_permissions(file, fs::Permissions::from_mode(0o755)).unwrap();
    }

    /// Replaces a link in one step.
    fn link(&mut self, target: &str, name: &str) {
        symlink(target, self.path(".link")).unwrap();
        fs::rename(self.path(".link"), self.path(name)).unwrap();
    }

    fn edit_manifest(&mut self, change: impl Fn(String) -> String) {
        let path = self.path("pipeline.toml");
        let text = change(fs::read_to_string(&path).unwrap());
        fs::write(path, text).unwrap();
    }

    fn path_variable(&self) -> OsString {
        let own = env::var_os("PATH").unwrap();
        let folders = self.programs.iter().map(|name| self.folder.path().join(name));
        env::join_paths(folders.chain(env::split_paths(&own))).unwrap()
    }

    /// Builds a project, and returns what is in its `out`.
    fn build(&self, folder: &Path, moment: &str) -> BTreeMap<String, Vec<u8>> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specula"));
        let output = command.arg("-C").arg(folder).args(["build", "-q"]).env("PATH", self.path_variable());
        let output = output.output().unwrap();
        let messages = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{moment}: {messages}");
        files_below(&folder.join("out"))
    }
}

/// Copies a project without what builds made of it.
fn copy_sources(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (path, copy) = (entry.path(), to.join(entry.file_name()));
        let kind = entry.file_type().unwrap();
        if entry.file_name() == "out" || entry.file_name() == ".specula" {
            continue;
        } else if kind.is_symlink() {
            symlink(fs::read_link(&path).unwrap(), copy).unwrap();
        } else if kind.is_dir() {
            copy_sources(&path, &copy);
        } else {
            fs::copy(path, copy).unwrap();
        }
    }
}

#[test]
fn after_every_round_of_edits_a_build_equals_a_clean_one() {
    const TEST: &str = "after_every_round_of_edits_a_build_equals_a_clean_one";
    let number = |name: &str| env::var(name).ok().map(|text| text.parse::<u64>().unwrap());
    let rounds = number("SPECULA_ROUNDS").unwrap_or_else(|| length(TEST, "rounds", 40, 15));
    let clock = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_millis();
    let seed = number("SPECULA_SEED").unwrap_or(u64::try_from(clock).unwrap());
    let mut project = Edited::new(seed);
    let mut turns = BTreeMap::<_, usize>::new();
    for round in 0..rounds {
        let edits = (0..1 + project.below(5)).map(|_| *project.one_of(EDITS)).collect::<Vec<_>>();
        for (name, edit) in &edits {
            edit(&mut project);
            *turns.entry(*name).or_default() += 1;
        }
        // A program that may not be run must not be the only one.
        if project.programs == ["one"] {
            project.program("one");
        }
        let names = edits.iter().map(|(name, _)| *name).collect::<Vec<_>>();
        let moment = format!("round {round} of seed {seed}, after {names:?}");
        let built = project.build(&project.path(""), &moment);
        let clean = tempfile::tempdir().unwrap();
        copy_sources(&project.path(""), clean.path());
        let wanted = project.build(clean.path(), &format!("the clean build of {moment}"));
        let differing =
            wanted.keys().chain(built.keys()).filter(|name| wanted.get(*name) != built.get(*name));
        let differing = differing.collect::<Vec<_>>();
        assert!(differing.is_empty(), "{moment}: these differ from a clean build: {differing:?}");
        assert!(!wanted.is_empty());
    }
    say(&format!("random edits: {rounds} rounds of seed {seed}, each equal to a clean build"));
    for (name, times) in turns {
        say(&format!("random edits:   {times:>4}  {name}"));
    }
}
