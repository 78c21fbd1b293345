//! A manifest with thousands of faults, as a program that writes manifests may leave one, is refused in a moment: each fault
//! is found and counted, and what takes long to find is found for those that are shown.

use std::cell::Cell;

use super::*;

/// So many would take minutes if each fault looked at all the others.
const MANY: usize = 5000;

/// Stages `s0`, `s1`, ... with a body each.
fn stages(body: impl Fn(usize) -> String) -> String {
    (0..MANY).map(|n| format!("[stage.s{n}]\n{}\n", body(n))).collect()
}

/// The faults of a manifest, of which there are so many; each that is shown has this help, or this in its message.
fn check_many(manifest: &str, count: usize, told: &str) {
    let sources = "[stage.text]\nkind = \"text-source\"\nsource = \"*.txt\"\n";
    let Err(faults) = load("a.txt", &format!("{sources}{manifest}")) else { panic!("no fault: {told}") };
    assert_eq!(faults.faults.len(), count, "{told}");
    assert_eq!((faults.shown().len(), faults.more()), (Diagnostics::SHOWN, count - Diagnostics::SHOWN));
    for fault in faults.shown() {
        let text = format!("{} {}", fault.message, fault.help.as_deref().unwrap_or_default());
        assert!(text.contains(told), "no {told:?} in {text:?}");
    }
    assert_eq!(faults.to_string().lines().count(), Diagnostics::SHOWN + 1);
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
    check_many(&same, MANY - 1, "give one of them another path");
    let below = stages(|n| format!("kind = \"write\"\ninput = \"text\"\npath = \"x.txt/{n}\""));
    let above = "[stage.file]\nkind = \"write\"\ninput = \"text\"\npath = \"x\"";
    check_many(&format!("{below}{above}"), MANY, "needs a folder of that name");
}

#[test]
fn errors_of_syntax() {
    check_many(&stages(|_| "kind = ".into()), MANY, "a value is missing");
    let twice = (0..2 * MANY).map(|n| format!("[stage.s{}]\n", n / 2)).collect::<String>();
    check_many(&twice, MANY, "the first is in line ");
    let keys = (0..2 * MANY).map(|n| format!("k{} = 1\n", n / 2)).collect::<String>();
    check_many(&format!("[stage.s]\n{keys}"), MANY, "the first is in line ");
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
fn sources_that_are_not_there() {
    let files = (0..500).map(|n| format!("f{n}.txt ")).collect::<String>();
    let folders = Counting(Tree::new(&files), Cell::new(0));
    let text =
        format!("schema = 1\n{}", stages(|n| format!("kind = \"text-source\"\nsource = \"g{n}.txt\"")));
    let found = Plan::of_bytes(Path::new(MANIFEST), text.as_bytes(), &kinds(), &folders);
    let faults = found.map(|_| ()).unwrap_err();
    assert_eq!(faults.faults.len(), MANY);
    for fault in faults.shown() {
        assert!(
            fault.help.as_ref().is_some_and(|help| help.contains("and 492 more; did you mean")),
            "{fault:?}"
        );
    }
    assert!(folders.1.get() < 500, "the folder was listed {} times", folders.1.get());
}
