#!/usr/bin/env bash
# Draws in Bevy, without a window, what Specula writes for it, and reads the pixels back.
#   tests/engines/bevy/run.sh [SPECULA]
# Bevy is compiled into target/engines, which takes minutes and 3 GB; .ci/run does not run this. Without a GPU it needs a
# software Vulkan driver (mesa-vulkan-drivers).
set -euo pipefail
cd "$(dirname "$0")/../../.."
specula=$(realpath "${1:-target/debug/specula}")
files=target/engines/bevy-files
rm -rf "$files" && mkdir -p "$files"
"$specula" test-pattern --preset bevy --format rgba16f "$files/pattern/"
"$specula" test-pattern --preset blender "$files/image/"
"$specula" convert "$files/image/pattern-orient.exr" --engine bevy --format rgba16f -o "$files/sky/"
cargo run --manifest-path tests/engines/bevy/Cargo.toml --locked --target-dir target/engines -- "$files"
