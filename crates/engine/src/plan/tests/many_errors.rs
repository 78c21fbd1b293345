//! A manifest with thousands of errors, as a program may generate one, is refused quickly: every error is
//! found and counted, and help that takes long to find is added only to those that are shown.

use std::cell::Cell;

use super::*;

/// With so many errors it would take minutes to compare each with all the others.
const MANY: usize = 5000;

/// Stages `s0`, `s1`, ... with a body each.
fn stages(body: impl Fn(usize) -> String) -> String {
    (0..MANY).map(|n| format!("[stage.s{n}]\n{}\n", body(n))).collect()
}

/// Checks that a manifest has `count` errors, and that each of those that are shown contains some words.
fn check_many(manifest: &str, count: usize, words: &str) {
    let sources = "[stage.text]\nkind = \"text-source\"\nsource = \"*.txt\"\n";
    let Err(errors) = load("a.txt", &format!("{sources}{manifest}")) else { panic!("no error: {words}") };
    assert_eq!(errors.errors.len(), count, "{words}");
    assert_eq!((errors.shown().len(), errors.more()), (Diagnostics::SHOWN, count - Diagnostics::SHOWN));
    for error in errors.shown() {
        let text = format!("{} {}", error.message, error.help.as_deref().unwrap_or_default());
        assert!(text.contains(words), "no {words:?} in {text:?}");
    }
    assert_eq!(errors.to_string().lines().count(), Diagnostics::SHOWN + 1);
}

#[test]
fn unknown_words() {
    check_many(&stages(|_| "kind = \"uper\"\ninput = \"text\"".into()), MANY, "did you mean \"upper\"?");
    check_many(&stages(|n| format!("kind = \"upper\"\ninput = \"r{n}\"")), MANY, "did you mean \"s");
    check_many(
        &stages(|_| "kind = \"upper\"\ninputs = { txt = \"text\" }".into()),
        MANY,
        "did you mean \"text\"?",
    );
    let path = |_| "kind = \"write\"\ninput = \"text\"\npath = \"{txet}\"".into();
    check_many(&stages(path), MANY, "did you mean {text}?");
    let keys = (0..MANY).map(|n| format!("k{n} = 1\n")).collect::<String>();
    check_many(&format!("[stage.s]\nkind = \"upper\"\ninput = \"text\"\n{keys}"), MANY, "unknown key \"k");
}

#[test]
fn connections_that_do_not_fit() {
    check_many(&stages(|_| "kind = \"upper\"".into()), MANY, "makes text");
    let wrong = stages(|_| "kind = \"upper\"\ninput = \"count\"".into());
    check_many(&format!("{wrong}[stage.count]\nkind = \"count\"\ninput = \"text\""), MANY, "makes text");
    check_many(&stages(|n| format!("kind = \"upper\"\ninput = \"s{n}\"")), MANY, "needs itself");
}

#[test]
fn paths_that_clash() {
    let same = stages(|_| "kind = \"write\"\ninput = \"text\"\npath = \"x\"".into());
    check_many(&same, MANY - 1, "change the path of one of the stages");
    let below = stages(|n| format!("kind = \"write\"\ninput = \"text\"\npath = \"x.txt/{n}\""));
    let above = "[stage.file]\nkind = \"write\"\ninput = \"text\"\npath = \"x\"";
    check_many(&format!("{below}{above}"), MANY, "needs a folder of that name");
}

#[test]
fn syntax_errors() {
    check_many(&stages(|_| "kind = ".into()), MANY, "a value is missing");
    let twice = (0..2 * MANY).map(|n| format!("[stage.s{}]\n", n / 2)).collect::<String>();
    check_many(&twice, MANY, "the first is on line ");
    let keys = (0..2 * MANY).map(|n| format!("k{} = 1\n", n / 2)).collect::<String>();
    check_many(&format!("[stage.s]\n{keys}"), MANY, "the first is on line ");
}

/// Folders that count how often they are listed.
struct Counting(Tree, Cell<usize>);

impl Folders for Counting {
    fn list(&self, folder: &Path) -> io::Result<Vec<Name>> {
        self.1.set(self.1.get() + 1);
        self.0.list(folder)
    }

    fn find(&self, path: &Path) -> Option<Found> {
        self.0.find(path)
    }
}

#[test]
fn sources_that_do_not_exist() {
    let files = (0..500).map(|n| format!("f{n}.txt ")).collect::<String>();
    let folders = Counting(Tree::new(&files), Cell::new(0));
    let text =
        format!("schema = 1\n{}", stages(|n| format!("kind = \"text-source\"\nsource = \"g{n}.txt\"")));
    let found = Plan::of_bytes(&manifest_file(), text.as_bytes(), &kinds(), &folders);
    let errors = found.map(|_| ()).unwrap_err();
    assert_eq!(errors.errors.len(), MANY);
    for error in errors.shown() {
        let help = error.help.as_deref().unwrap_or_default();
        assert!(help.contains("and 492 more; did you mean"), "{error:?}");
    }
    assert!(folders.1.get() < 500, "the folder was listed {} times", folders.1.get());
}
