#!/usr/bin/env bash
# Makes docs/images/preview.png: the window of `specula preview` on a virtual screen, with the sample's
# lacquered knot half by its local SHRM and half by Kautz and McCool's texture.
#
#   research/preview-picture.sh PROGRAM OUT.png
#
# PROGRAM is a `specula` with the Cargo feature `window`. This needs Xvfb, xdotool, ImageMagick, and a driver
# for Vulkan, which may be lavapipe. The sample is built first, in a copy. The status line is cut off, because
# its time and its renderer are those of the machine that draws. WAIT is how many seconds the picture gets to
# become final, by default 60.
set -euo pipefail

program=$(realpath "$1")
out=$(realpath -m "$2")
source=$(realpath "$(dirname "$0")/..")
folder=$(mktemp -d)
cp -r "$source/assets" "$source/pipeline.toml" "$folder"
cd "$folder"
"$program" build

Xvfb -displayfd 3 -screen 0 1280x800x24 -nolisten tcp 3>"$folder/display" 2>/dev/null &
server=$!
window=
trap 'kill $window $server 2>/dev/null || true; rm -rf "$folder"' EXIT
until [ -s "$folder/display" ]; do sleep 0.1; done
DISPLAY=:$(cat "$folder/display")
export DISPLAY XDG_RUNTIME_DIR="$folder"
unset WAYLAND_DISPLAY WAYLAND_SOCKET

echo '{"version":1,"settings":{"size":[1280,800]}}' >.specula/preview.json
"$program" preview --item environment=studio,material=lacquer,mesh=torus-knot --mode local-shrm &
window=$!
until id=$(xdotool search --onlyvisible --name "Specula preview"); do sleep 0.5; done
sleep 5
xdotool mousemove 570 400 windowfocus --sync "$id" key --delay 500 s shift+4
xdotool mousemove 85 700 # away from what would show a tip or a scroll bar
sleep "${WAIT:-60}"
import -silent -window root -crop 1280x769+0+0 +repage "$out"
