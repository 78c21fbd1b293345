//! Random edits, as editors make them, for a while: after each burst of edits the watcher makes `out` equal
//! to that of a clean build, byte for byte, and it stays so. A missed event would leave `out` different for
//! good.
//!
//! `SPECULA_SOAK_SECONDS` sets the time (20 seconds with `CI`, otherwise 4), `SPECULA_SOAK_SEED` repeats a
//! sequence of edits.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../src/testkit.rs"]
#[allow(dead_code, reason = "the kinds of the engine's own tests, which need more of it")]
mod testkit;
mod watching;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

// The kinds expect the engine's names at the root of the crate.
#[allow(unused_imports, reason = "some of them")]
use engine::*;
use test_data::{length, say};
use watching::{Random, TIMEOUT, Watcher, clean_build, copy_sources, files_below};

const MANIFEST: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = ["texts/**/*.txt", "!**/nothing.txt"] }
word = { kind = "text-source", source = "words/*.{txt,md}" }
single = { kind = "text-source", source = "single.txt" }
names = { kind = "text-source", source = "faces" }
upper = { kind = "upper", input = "text" }
checked = { kind = "refuse", input = "upper", word = "BAD" }
marked = { kind = "suffix", input = "checked", text = "!", times = 1 }
pair = { kind = "concat", inputs = { left = "marked", right = "word", end = "single" } }
pair-file = { kind = "write", input = "pair", path = "pairs/{text}/{word}" }
body = { kind = "write-pair", input = "marked", path = "bodies/{text}" }
list = { kind = "collect", inputs = { texts = "marked", title = "names" } }
list-file = { kind = "write", input = "list", path = "list" }
"#;

const MORE: &str = r#"count = { kind = "count", input = "word" }
count-file = { kind = "write", input = "count", path = "counts/{word}" }
"#;

/// The number of files that a checkout changes.
const BRANCH: usize = 12;

/// A way in which editors, exporters or version control change files, with its name.
type EditPattern = (&'static str, fn(&mut EditedProject));

const PATTERNS: &[EditPattern] = &[
    ("write in place", |project| {
        let (path, text) = (project.any_text(), project.text());
        project.write(&path, &text);
    }),
    ("truncate, then write slowly", |project| {
        let (path, text) = (project.any_text(), project.text());
        project.write(&path, "");
        project.pause(8);
        project.write(&path, &text[..text.len() / 2]);
        project.pause(8);
        project.write(&path, &text);
    }),
    ("write temporary, rename over", |project| {
        let (path, text) = (project.any_text(), project.text());
        project.replace(&path, &text);
    }),
    ("write elsewhere, link", |project| {
        let (path, text) = (project.new_text(), project.text());
        let hidden = project.path("texts/.unnamed");
        project.write(&hidden, &text);
        let _ = fs::remove_file(&path);
        fs::hard_link(&hidden, &path).unwrap();
        project.remove(&hidden);
    }),
    ("delete, then create", |project| {
        let (path, text) = (project.any_text(), project.text());
        project.remove(&path);
        project.pause(8);
        project.write(&path, &text);
    }),
    ("touch", |project| {
        let path = project.any_text();
        project.set_time(&path, SystemTime::now());
    }),
    ("save twice", |project| {
        let (path, first, second) = (project.any_text(), project.text(), project.text());
        project.replace(&path, &first);
        project.pause(5);
        project.replace(&path, &second);
    }),
    ("swap and backup files", |project| {
        let path = project.any_text();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let beside = [format!(".{name}.swp"), format!("{name}~"), format!("{name}.tmp"), "4913".into()];
        for name in &beside {
            project.write(&path.with_file_name(name), "ignored");
        }
        for name in &beside[project.random.below(3)..] {
            project.remove(&path.with_file_name(name));
        }
    }),
    ("an old time restored", |project| {
        let path = project.any_text();
        let time = fs::metadata(&path).unwrap().modified().unwrap();
        // The size stays the same as well: only the first letter changes.
        let text = fs::read_to_string(&path).unwrap();
        let letter = if text.starts_with('a') { 'e' } else { 'a' };
        project.write(&path, &format!("{letter}{}", &text[1..]));
        project.set_time(&path, time);
    }),
    ("a new file", |project| {
        let (path, text) = (project.new_text(), project.text());
        project.write(&path, &text);
    }),
    ("a file removed", |project| {
        if project.texts().len() > 3 {
            let path = project.any_text();
            project.remove(&path);
        }
    }),
    ("a file renamed", |project| {
        let (from, to) = (project.any_text(), project.new_text());
        project.rename(&from, &to);
    }),
    ("another ending of the same stem", |project| {
        let (text, markdown) = (project.path("words/w0.txt"), project.path("words/w0.md"));
        let (from, to) = if text.exists() { (text, markdown) } else { (markdown, text) };
        let word = project.word();
        // For a moment there are two files with one stem, which is an error of the manifest.
        project.write(&to, &word);
        project.pause(3);
        project.remove(&from);
    }),
    ("a word", |project| {
        let (path, word) = (project.path("words/w1.txt"), project.word());
        project.replace(&path, &word);
    }),
    ("a file that others include", |project| {
        let path = project.part();
        let word = project.word();
        project.replace(&path, &word);
    }),
    ("a folder made and written to at once", |project| {
        let name = format!("texts/made{}", project.random.below(3));
        let folder = project.path(&name);
        let _ = fs::remove_dir_all(&folder);
        let text = project.text();
        fs::create_dir_all(folder.join("deep")).unwrap();
        let name = format!("deep/made{}.txt", project.serial());
        project.write(&folder.join(name), &text);
    }),
    ("a folder moved", |project| {
        let (here, there) = (project.path("texts/here"), project.path("texts/there"));
        let (from, to) = if here.exists() { (here, there) } else { (there, here) };
        project.rename(&from, &to);
    }),
    ("a folder moved away and back", |project| {
        let (texts, away) = (project.path("texts"), project.path("away"));
        project.rename(&texts, &away);
        project.pause(6);
        project.rename(&away, &texts);
    }),
    ("a folder's listing", |project| {
        let name = format!("faces/{}.png", project.random.below(4));
        let path = project.path(&name);
        if path.exists() { project.remove(&path) } else { project.write(&path, "") }
    }),
    ("the only file of a stage", |project| {
        let (path, word) = (project.path("single.txt"), project.word());
        project.replace(&path, &word);
    }),
    ("a checkout", |project| {
        let branch = project.path("texts/branch");
        if branch.exists() {
            project.edits += BRANCH;
            fs::remove_dir_all(&branch).unwrap();
        } else {
            fs::create_dir(&branch).unwrap();
            for index in 0..BRANCH {
                let text = project.text();
                project.write(&branch.join(format!("b{index}.txt")), &text);
            }
        }
    }),
    #[cfg(unix)]
    ("a link replaced", |project| {
        let target = format!("../versions/{}.txt", project.random.one_of(&["a", "b"]));
        let (link, temporary) = (project.path("words/link.txt"), project.path("words/.link"));
        let _ = fs::remove_file(&temporary);
        std::os::unix::fs::symlink(target, &temporary).unwrap();
        project.rename(&temporary, &link);
    }),
    #[cfg(unix)]
    ("the file behind a link", |project| {
        let name = format!("versions/{}.txt", project.random.one_of(&["a", "b"]));
        let (path, word) = (project.path(&name), project.word());
        project.write(&path, &word);
    }),
    #[cfg(unix)]
    ("a link to nothing for a moment", |project| {
        let (link, temporary) = (project.path("words/link.txt"), project.path("words/.link"));
        for target in ["../versions/none.txt", "../versions/b.txt"] {
            std::os::unix::fs::symlink(target, &temporary).unwrap();
            project.rename(&temporary, &link);
            project.pause(20);
        }
    }),
    #[cfg(unix)]
    ("a link to a folder replaced", |project| {
        let target = project.random.one_of(&["faces-a", "faces-b"]).to_owned();
        let (link, temporary) = (project.path("faces"), project.path(".faces"));
        std::os::unix::fs::symlink(target, &temporary).unwrap();
        project.rename(&temporary, &link);
    }),
    ("a glob that is left out", |project| {
        let left_out = *project.random.one_of(&[
            "!**/nothing.txt",
            "!texts/branch",
            "!**/b[0-4].txt",
            "!texts/made*/**",
        ]);
        project.edit_manifest(|text| {
            let (before, after) = text.split_once("\"!").unwrap();
            let (_, after) = after.split_once('"').unwrap();
            format!("{before}\"{left_out}\"{after}")
        });
    }),
    ("exports removed", |project| {
        let name = *project.random.one_of(&["out", "out/pairs", "out/list.txt"]);
        let path = project.path(name);
        // The watcher may be writing there.
        let _ = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        project.edits += 1;
    }),
    ("the project moved away and back", |project| {
        let (here, away) = (project.path(""), project.folder.path().join("away"));
        project.rename(&here, &away);
        project.pause(30);
        project.rename(&away, &here);
    }),
    ("a new clone in the project's place", |project| {
        let (here, away) = (project.path(""), project.folder.path().join("away"));
        let clone = project.folder.path().join("clone");
        copy_sources(&here, &clone);
        project.rename(&here, &away);
        project.pause(30);
        project.rename(&clone, &here);
        // The watcher may be writing there.
        while away.exists() {
            let _ = fs::remove_dir_all(&away);
        }
    }),
    ("a parameter", |project| {
        let times = 1 + project.random.below(9);
        project.edit_manifest(|text| {
            let (before, after) = text.split_once("times = ").unwrap();
            format!("{before}times = {times}{}", &after[1..])
        });
    }),
    ("a stage more or less", |project| {
        project.edit_manifest(|text| match text.strip_suffix(MORE) {
            Some(less) => less.to_owned(),
            None => text + MORE,
        });
    }),
    ("a manifest broken and repaired", |project| {
        let valid = fs::read_to_string(project.path("pipeline.toml")).unwrap();
        project.edit_manifest(|text| text.replace("kind = \"upper\"", "kind = \"uper"));
        project.pause(10);
        project.edit_manifest(|_| valid.clone());
    }),
];

struct EditedProject {
    /// The project is in a folder of this one, so that another one can take its place.
    folder: tempfile::TempDir,
    random: Random,
    serial: usize,
    edits: usize,
}

impl EditedProject {
    fn new(seed: u64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut project = Self { folder, random: Random(seed), serial: 0, edits: 0 };
        for folder in ["texts/here", "words", "versions", "parts", "faces-a", "faces-b"] {
            fs::create_dir_all(project.path(folder)).unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink("faces-a", project.path("faces")).unwrap();
        #[cfg(not(unix))]
        fs::create_dir(project.path("faces")).unwrap();
        let names = ["texts/t0.txt", "texts/t1.txt", "texts/here/t2.txt", "words/w0.txt", "words/w1.txt"];
        let parts = ["parts/0.inc", "parts/1.inc", "versions/a.txt", "versions/b.txt", "single.txt"];
        for name in names.iter().chain(&parts) {
            let (path, word) = (project.path(name), project.word());
            project.write(&path, &word);
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink("../versions/a.txt", project.path("words/link.txt")).unwrap();
        let manifest = project.path("pipeline.toml");
        project.write(&manifest, MANIFEST);
        project.edits = 0;
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join("project").join(name)
    }

    /// Every text that the glob matches.
    fn texts(&self) -> Vec<PathBuf> {
        let root = self.path("texts");
        let found = files_below(&root).into_keys().map(|name| root.join(name));
        let hidden = |path: &Path| path.file_name().unwrap().to_string_lossy().starts_with('.');
        found.filter(|path| path.extension().is_some_and(|end| end == "txt") && !hidden(path)).collect()
    }

    fn any_text(&mut self) -> PathBuf {
        let texts = self.texts();
        self.random.one_of(&texts).clone()
    }

    fn new_text(&mut self) -> PathBuf {
        let serial = self.serial();
        self.path(&format!("texts/n{serial}.txt"))
    }

    fn part(&mut self) -> PathBuf {
        let index = self.random.below(2);
        self.path(&format!("parts/{index}.inc"))
    }

    fn serial(&mut self) -> usize {
        self.serial += 1;
        self.serial
    }

    fn word(&mut self) -> String {
        format!("a word of {} letters, the {}th\n", self.random.below(40), self.serial())
    }

    /// A text; sometimes one that a stage refuses, or that includes a file, which may be missing.
    fn text(&mut self) -> String {
        let word = self.word();
        match self.random.below(12) {
            0 => format!("{word}this one is bad\n"),
            1 => format!("{word}include {}\n", self.path("parts/missing.inc").display()),
            2..4 => format!("{word}include {}\n", self.part().display()),
            _ => word,
        }
    }

    fn write(&mut self, path: &Path, text: &str) {
        self.edits += 1;
        fs::write(path, text).unwrap();
    }

    fn replace(&mut self, path: &Path, text: &str) {
        let name = format!(".{}.new", path.file_name().unwrap().to_string_lossy());
        let temporary = path.with_file_name(name);
        fs::write(&temporary, text).unwrap();
        self.rename(&temporary, path);
    }

    fn rename(&mut self, from: &Path, to: &Path) {
        self.edits += 1;
        // On Windows a build that reads the file is in the way for a moment.
        let deadline = Instant::now() + Duration::from_secs(5);
        while let Err(error) = fs::rename(from, to) {
            assert!(cfg!(windows) && Instant::now() < deadline, "{}: {error}", to.display());
        }
    }

    fn remove(&mut self, path: &Path) {
        self.edits += 1;
        fs::remove_file(path).unwrap();
    }

    fn set_time(&mut self, path: &Path, time: SystemTime) {
        self.edits += 1;
        fs::File::options().write(true).open(path).unwrap().set_modified(time).unwrap();
    }

    fn edit_manifest(&mut self, change: impl Fn(String) -> String) {
        let path = self.path("pipeline.toml");
        let text = change(fs::read_to_string(&path).unwrap());
        self.replace(&path, &text);
    }

    fn pause(&mut self, milliseconds: usize) {
        let milliseconds = self.random.below(milliseconds + 1) as u64;
        std::thread::sleep(Duration::from_millis(milliseconds));
    }

    /// An item that fails keeps its last good output, which a clean build does not have. So before `out` is
    /// compared, all texts that fail are replaced. If there are too many texts, some are removed.
    fn repair(&mut self) {
        // One that is never left out.
        let (path, word) = (self.path("texts/kept.txt"), self.word());
        if !path.exists() {
            self.write(&path, &word);
        }
        let mut texts = self.texts();
        while texts.len() > 25 {
            let path = texts.swap_remove(self.random.below(texts.len()));
            self.remove(&path);
        }
        for path in texts {
            let text = fs::read_to_string(&path).unwrap();
            if text.contains("bad") || text.contains("missing") {
                let word = self.word();
                self.write(&path, &word);
            }
        }
    }
}

/// Edits and compares for some time. Returns the numbers of rounds and of edits, and how often each pattern
/// was used.
fn soak(seed: u64, time: Duration, poll: Option<Duration>) -> (usize, usize, BTreeMap<&'static str, usize>) {
    let start = Instant::now();
    let kinds = testkit::kinds();
    let mut project = EditedProject::new(seed);
    let manifest = project.path("pipeline.toml");
    let mut watcher = Watcher::start(manifest, testkit::kinds(), poll, 1 << 20);
    watcher.wait("start", |event| matches!(event, Event::Watching { .. }));
    let (mut rounds, mut turns) = (0, BTreeMap::new());
    // It ends when every pattern was used and the time is over.
    let mut due = PATTERNS.iter().collect::<Vec<_>>();
    while !due.is_empty() || start.elapsed() < time {
        let mut burst = Vec::new();
        for _ in 0..1 + project.random.below(20) {
            let next = match due.len() {
                0 => project.random.one_of(PATTERNS),
                left => due.swap_remove(project.random.below(left)),
            };
            burst.push(next.0);
            *turns.entry(next.0).or_default() += 1;
            next.1(&mut project);
            if project.random.below(3) == 0 {
                project.pause(30);
            }
        }
        project.repair();
        rounds += 1;
        let (summary, wanted) = clean_build(&project.path(""), &kinds);
        assert_eq!((summary.failed, summary.skipped), (0, 0), "the clean build of round {rounds}: {burst:?}");
        let moment = format!("round {rounds} of seed {seed}, after {burst:?}");
        await_equality(&project, &mut watcher, &wanted, &moment);
    }
    watcher.stop();
    (rounds, project.edits, turns)
}

/// Waits until `out` is as wanted, and then until no more events come, after which it must be the same.
fn await_equality(
    project: &EditedProject,
    watcher: &mut Watcher,
    wanted: &BTreeMap<PathBuf, Vec<u8>>,
    moment: &str,
) {
    let out = project.path("out");
    let deadline = Instant::now() + TIMEOUT;
    loop {
        // `out` is compared after each batch of events, and from time to time without one.
        watcher.next(Duration::from_millis(100));
        while watcher.next(Duration::ZERO).is_some() {}
        let found = files_below(&out);
        if found == *wanted {
            break;
        }
        if Instant::now() > deadline {
            panic!("{moment}: {}\n{}", differences(&found, wanted), watcher.log());
        }
    }
    while watcher.next(Duration::from_millis(50)).is_some() {
        assert!(Instant::now() < deadline, "{moment}: it does not come to rest\n{}", watcher.log());
    }
    let found = files_below(&out);
    assert!(found == *wanted, "{moment}, at rest: {}\n{}", differences(&found, wanted), watcher.log());
}

fn differences(found: &BTreeMap<PathBuf, Vec<u8>>, wanted: &BTreeMap<PathBuf, Vec<u8>>) -> String {
    let shown = |bytes: Option<&Vec<u8>>| bytes.map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let names = found.keys().chain(wanted.keys()).filter(|name| found.get(*name) != wanted.get(*name));
    let names = names.collect::<std::collections::BTreeSet<_>>();
    let lines = names.iter().take(8).map(|name| {
        let (found, wanted) = (shown(found.get(*name)), shown(wanted.get(*name)));
        format!("\n  {}: {found:?}, a clean build has {wanted:?}", name.display())
    });
    format!("{} files differ{}", names.len(), lines.collect::<String>())
}

#[test]
fn after_every_burst_of_edits_out_equals_a_clean_build() {
    const TEST: &str = "after_every_burst_of_edits_out_equals_a_clean_build";
    let number = |name: &str| std::env::var(name).ok().map(|text| text.parse::<u64>().unwrap());
    let seconds = number("SPECULA_SOAK_SECONDS").unwrap_or_else(|| length(TEST, "seconds", 20, 4));
    let clock = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_millis();
    let seed = number("SPECULA_SOAK_SEED").unwrap_or(u64::try_from(clock).unwrap());
    say(&format!("soak: seed {seed}"));
    // It polls for a sixth of the time.
    let listening = Duration::from_secs(seconds) * 5 / 6;
    for (way, time, poll) in [
        ("listening", listening, None),
        ("polling", Duration::from_secs(seconds) - listening, Some(Duration::from_millis(20))),
    ] {
        let (rounds, edits, turns) = soak(seed, time, poll);
        say(&format!("soak: {way}, {edits} edits in {rounds} rounds, each equal to a clean build"));
        for (pattern, times) in turns {
            say(&format!("soak:   {times:>5}  {pattern}"));
        }
    }
}
