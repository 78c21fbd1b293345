//! Completions in the shells themselves: each sources its script and is asked as if somebody pressed Tab.

use std::process::Command;

use crate::support::Project;

/// What is typed, and words that must be offered. In bash and fish all others that are offered begin in the
/// same way, unless they are files.
const LINES: [(&str, &[&str]); 9] = [
    ("specula bu", &["build"]),
    ("specula build --", &["--fail-fast", "--manifest", "--timings"]),
    ("specula build li", &["lighting"]),
    ("specula stages export-s", &["export-sh", "export-shrm"]),
    ("specula stages ", &["convolve", "project-sh"]),
    ("specula preview --m", &["--manifest", "--max-cache", "--memory", "--mode"]),
    ("specula preview --mode=br", &["brute-force"]),
    ("specula inspect as", &["assets"]),
    ("specula preview two", &["two words.hdr"]),
];

/// Bash splits the words itself, also at `=`.
const BASH: &str = r#"
source "$SCRIPT"
complete -p specula >&2 || exit 1
complete_line() {
    local line=$1
    [[ $line == *' ' ]] && line+="''"
    line=${line//=/ = }
    eval "COMP_WORDS=($line)"
    COMP_CWORD=$(( ${#COMP_WORDS[@]} - 1 ))
    COMPREPLY=()
    _specula specula "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD-1]}"
    printf '%s\n' "${COMPREPLY[@]}"
}
for line in "$@"; do echo ">$line"; complete_line "$line"; done
"#;

const FISH: &str = r#"
source "$SCRIPT"
for line in $argv
    echo ">$line"
    complete -C "$line" | string replace -r '\t.*' ''
end
"#;

/// A zsh on a pseudo-terminal. What it would insert or list is written to a file.
const ZSH: &str = r#"
zmodload zsh/zpty || exit 1
zpty z zsh -f -i
zpty -w z 'autoload -Uz compinit && compinit -u -D && source $SCRIPT'
zpty -w z 'compadd() {
    local -a found
    [[ $* == *-[OAD]\ * ]] || { builtin compadd -A found "$@"; print -rl -- ${(Q)found} >> $OUT }
    builtin compadd "$@"
}'
zpty -w z 'ask() { zle complete-word; print -r -- "<" >> $OUT }; zle -N ask; bindkey "^X" ask'
for line in "$@"; do
    : > $OUT
    zpty -w -n z "$line"$'\C-X'
    for (( wait = 0; wait < 600; wait++ )); do
        grep -q '^<$' $OUT && break
        sleep 0.1
    done
    print -r -- ">$line"
    grep -v '^<$' $OUT
    zpty -w -n z $'\C-U'
done
zpty -d z
"#;

/// What a shell offers for each line; `None` if the shell is not there.
fn offered(project: &Project, shell: &str, script: &str, arguments: &[&str]) -> Option<Vec<Vec<String>>> {
    let test = format!("completions_work_in_{shell}");
    if Command::new(shell).arg("--version").output().is_err() {
        test_data::skip(&test, &format!("there is no {shell}"));
        return None;
    }
    project.write("script", &project.ok(&["completions", shell]).stdout);
    let binary = std::path::Path::new(env!("CARGO_BIN_EXE_specula")).parent().unwrap();
    let path = std::env::join_paths(
        [binary.to_path_buf()].into_iter().chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    );
    let output = Command::new(shell)
        .args(arguments)
        .arg(script)
        .args((shell == "bash" || shell == "zsh").then_some("test"))
        .args(LINES.map(|(line, _)| line))
        .current_dir(project.path(""))
        .env("PATH", path.unwrap())
        .env("SCRIPT", project.path("script"))
        .env("OUT", project.path("offered"))
        .env("HOME", project.path("home"))
        .env("TERM", "dumb")
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    let mut lines = Vec::new();
    for line in text.lines() {
        if line.starts_with('>') {
            lines.push(Vec::new());
        } else if let Some(last) = lines.last_mut() {
            last.push(line.to_owned());
        }
    }
    assert_eq!(lines.len(), LINES.len(), "{shell}: {text}\n{errors}");
    Some(lines)
}

fn check(shell: &str, script: &str, arguments: &[&str]) {
    let project = Project::small();
    project.write("two words.hdr", "");
    std::fs::create_dir(project.path("home")).unwrap();
    let Some(offered) = offered(&project, shell, script, arguments) else { return };
    for ((line, words), found) in LINES.iter().zip(offered) {
        for word in *words {
            let is_it = |found: &String| {
                let found = found.replace('\\', "");
                // A folder's name may have a slash, and an option its name before the value.
                let found = found.trim_end_matches('/');
                found == *word || found.ends_with(&format!("={word}"))
            };
            assert!(found.iter().any(is_it), "{shell}: {line:?} offers {found:?}, not {word:?}");
        }
        let typed = line.rsplit([' ', '=']).next().unwrap();
        let begins = |found: &String| found.rsplit('=').next().is_some_and(|word| word.starts_with(typed));
        assert!(found.iter().all(begins), "{shell}: {line:?} offers {found:?}");
    }
}

#[test]
fn completions_work_in_bash() {
    check("bash", BASH, &["--norc", "-c"]);
}

#[test]
fn completions_work_in_zsh() {
    check("zsh", ZSH, &["-f", "-c"]);
}

#[test]
fn completions_work_in_fish() {
    check("fish", FISH, &["--no-config", "-c"]);
}

/// `man` finds a page for every command.
#[test]
fn every_command_has_a_manual_page() {
    let project = Project::new("");
    project.ok(&["man", "pages"]);
    let help = project.ok(&["--help"]).stdout;
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands =
        commands.take_while(|line| !line.is_empty()).filter_map(|line| line.split_whitespace().next());
    let mut found = 0;
    for command in commands.filter(|command| *command != "help") {
        let page = std::fs::read_to_string(project.path(&format!("pages/specula-{command}.1"))).unwrap();
        assert!(page.contains(".SH SYNOPSIS") && page.contains(command), "{command}");
        found += 1;
    }
    assert!(found > 10 && project.path("pages/specula.1").exists());
    assert!(!project.path("pages/specula-complete.1").exists(), "that command is for scripts");
}
