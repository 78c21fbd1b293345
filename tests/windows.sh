#!/usr/bin/env bash
# Builds the program for Windows and runs its tests in Wine: the engine's and the end-to-end tests of what a system may
# change; with --all those of every crate, also with the corpus. Says aloud what it cannot. On Debian 12:
# gcc-mingw-w64-x86-64 and wine64, and the target of rustup or, if its server cannot be reached, rustc-web, cargo-web
# and rust-web-src.
set -euo pipefail
cd "$(dirname "$0")/.."
target=x86_64-pc-windows-gnu
skip() { echo "SKIPPED windows: $1"; exit 0; }

wine=$(command -v wine64 || ls /usr/lib/wine/wine64 2>/dev/null) || skip "no wine64"
command -v x86_64-w64-mingw32-gcc >/dev/null || skip "no x86_64-w64-mingw32-gcc"
cargo=(cargo)
std=()
if [ ! -d "$(rustc --print target-libdir --target $target)" ] && ! rustup target add $target 2>/dev/null; then
    # Debian's compiler builds the standard library from its source.
    [ -d /usr/lib/rustlib/src/rust/library ] || [ -d "$(/usr/bin/rustc --print sysroot 2>/dev/null)/lib/rustlib/src/rust/library" ] ||
        skip "no standard library for $target, nor its source (rust-web-src)"
    cargo=(env RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 /usr/bin/cargo)
    std=(-Zbuild-std=std,panic_unwind,test)
fi

# What Wine needs: an empty Windows 10, and beside the programs what Wine 8 lacks.
home=$PWD/target/windows
mkdir -p "$home"
x86_64-w64-mingw32-gcc -shared -O1 -o "$home/bcryptprimitives.dll" tests/windows/bcryptprimitives.c -ladvapi32
x86_64-w64-mingw32-gcc -O1 -municode -o "$home/interrupt.exe" tests/windows/interrupt.c
export WINEPREFIX=$home/prefix WINEDEBUG=-all
windows_path() { printf 'Z:%s' "${1//\//\\}"; }
# With slashes, since tests write these into manifests.
for folder in SPECULA_CORPUS SPECULA_REFERENCE; do
    [ -z "${!folder:-}" ] || export "$folder=Z:${!folder}"
done
export WINEPATH=$(windows_path "$home") SPECULA_INTERRUPT=$(windows_path "$home/interrupt.exe")
# One server for all programs, which would otherwise start and end with each.
server=$(command -v wineserver || echo /usr/lib/wine/wineserver)
mkdir -p "$WINEPREFIX"
"$server" -p >"$home/server.log" 2>&1 </dev/null || true # one may be there
trap '"$server" -k || true' EXIT
[ -f "$WINEPREFIX/system.reg" ] || "$wine" winecfg -v win10 >"$home/services.log" 2>&1 </dev/null
"$wine" cmd /c exit >"$home/services.log" 2>&1 </dev/null

export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUNNER=$wine
# Wine cannot do all that Windows does: tests say what they skip. What only tests of Unix use is unused here.
unset SPECULA_REQUIRE RUSTFLAGS
# Wine starts programs slowly and most tests wait, so more of them run than there are processors.
export RUST_TEST_THREADS=${RUST_TEST_THREADS:-$((2 * $(nproc)))}
# `tests OPTIONS -- FILTERS` runs tests. Now and then Wine cannot start a program ("Internal error"), and its events of
# folders come late when much happens, so what failed is run again, alone.
tests() {
    local options=() failed
    while [ $# -gt 0 ] && [ "$1" != -- ]; do options+=("$1") && shift; done
    [ $# = 0 ] || shift
    options=("${cargo[@]}" test "${std[@]}" --target $target --locked --no-fail-fast "${options[@]}" --)
    # Not a pipe, which the services of Wine would hold open.
    "${options[@]}" "$@" >"$home/tests.log" 2>&1 && failed=0 || failed=$?
    cat "$home/tests.log"
    [ "$failed" != 0 ] || return 0
    mapfile -t failed < <(tr -d '\r' <"$home/tests.log" | sed -n 's/^test \(.*\) \.\.\. FAILED$/\1/p' | sort -u)
    [ ${#failed[@]} -gt 0 ] && [ ${#failed[@]} -lt 10 ] || return 1
    echo "AGAIN: ${failed[*]}"
    RUST_TEST_THREADS=1 "${options[@]}" --exact "${failed[@]}"
}

if [ "${1:-}" = --all ]; then
    # Benchmarks count with what Linux has.
    tests --workspace --exclude custom-kind --exclude bench
    # The fixture of `exec` is a script of Unix.
    SPECULA_DIGESTS_TO=$(windows_path "$home/digests.txt") tests -p stages --test kinds -- \
        --exact same_bytes::every_kind_makes_the_same_bytes_on_every_machine
    grep -v '^exec: ' crates/stages/tests/kinds/digests.txt | diff - "$home/digests.txt"
    echo "Windows makes the same bytes"
    "${cargo[@]}" check "${std[@]}" --target $target --locked -p cli --features window,remote
else
    # Long tests are shortened or left to --all, and light is computed elsewhere: so are the examples, what is said of
    # manifests, reasons and pictures, which no system changes, and those that damage or cut each of many files, which
    # Wine writes slowly. Those of files that are being written ask how long things take, which Wine's events and file
    # locks do not do alike each time.
    unset CI SPECULA_CORPUS SPECULA_REFERENCE
    skipped=()
    for test in tests::watch::writing a_hundred_thousand_lines builds_all_day changed_while_it_is_published \
        readers_are_not_disturbed after_any_loss_or_damage killed_after_any_line_of_the_journal \
        collection_killed_at_any_moment every_truncated_length an_index_that_is_damaged a_forged_index \
        builds_that_know_all_changes many_errors::unknown_words; do
        skipped+=(--skip "$test")
    done
    tests -p engine --lib -- "${skipped[@]}"
    skipped=()
    for test in examples_build no_stage_that_fails inspect_picture:: junit:: manifest_errors:: many_failures:: schema:: \
        timings:: why::; do
        skipped+=(--skip "$test")
    done
    tests -p cli --test end_to_end -- "${skipped[@]}"
fi
