#!/usr/bin/env bash
# The arithmetic of another processor: on aarch64, under qemu-user, the functions of crate `math` have their golden bits.
# With --kinds, which takes long, also the fixtures of all kinds have their golden digests. Skips aloud if a compiler for
# aarch64 or qemu is missing: `rustup target add aarch64-unknown-linux-gnu`, and Debian's gcc-aarch64-linux-gnu,
# libc6-dev-arm64-cross and qemu-user.
set -euo pipefail
cd "$(dirname "$0")/.."
target=aarch64-unknown-linux-gnu
skip() { echo "SKIPPED aarch64: $1"; exit 0; }

command -v qemu-aarch64 >/dev/null || skip "no qemu-aarch64"
command -v aarch64-linux-gnu-gcc >/dev/null || skip "no aarch64-linux-gnu-gcc"
library=$("${RUSTC:-rustc}" --print target-libdir --target "$target")
[ -d "$library" ] || rustup target add "$target" 2>/dev/null || skip "no std for $target in $library"

export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu"
export CC_aarch64_unknown_linux_gnu=aarch64-linux-gnu-gcc

cargo test --target "$target" --locked -p math --lib
[ "${1:-}" = --kinds ] || exit 0

# The test's own child: qemu cannot start the children that it would start itself.
found=$(mktemp)
trap 'rm -f "$found"' EXIT
SPECULA_DIGESTS_TO=$found cargo test --target "$target" --locked -p stages --test kinds -- \
    --exact same_bytes::every_kind_makes_the_same_bytes_on_every_machine
diff crates/stages/tests/kinds/digests.txt "$found"
echo "aarch64 makes the same bytes"
