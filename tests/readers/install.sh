#!/usr/bin/env bash
# Installs the readers of other programs that run.sh asks, from npm, PyPI and, as root, Debian, into target/readers, as far as
# this machine can; what is there stays. Remove that folder to try again what was missing.
#   tests/readers/install.sh [--all]     --all: also Blender's bpy, which is 350 MB
set -euo pipefail
cd "$(dirname "$0")/../.."
all=; [ "${1:-}" = --all ] && all=1
here=$PWD/tests/readers
mkdir -p target/readers
cd target/readers

skip() { echo "SKIPPED $1: $2"; }

if ! command -v node >/dev/null || ! command -v npm >/dev/null; then
    skip "three.js, Babylon.js, ktx-parse, compact maps" "no node"
elif [ ! -d node_modules/three ] || ! cmp -s "$here/package.json" package.json; then
    cp "$here/package.json" . && npm install --silent --no-audit --no-fund || skip "three.js, Babylon.js, ktx-parse, compact maps" "npm cannot install them"
fi
# Each version's loaders use that version, and not the newest.
for version in three150 three170 three183; do
    sed -i "s/from 'three'/from '$version'/" node_modules/$version/examples/jsm/loaders/{RGBE,HDR,EXR}Loader.js 2>/dev/null || true
done
# The browser would ask for the files of Babylon.js one by one, which are 3,000.
if [ -x node_modules/.bin/esbuild ] && [ ! -e node_modules/babylon.js ]; then
    node_modules/.bin/esbuild @babylonjs/core --bundle --minify --format=esm --log-level=error --outfile=node_modules/babylon.js
fi

[ -x py/bin/python ] || python3 -m venv py || skip "OpenImageIO, OpenCV, OpenEXR, FreeImage" "python3 has no venv"
# OpenCV 5 is built without OpenEXR.
for package in numpy OpenEXR OpenImageIO "opencv-python-headless<5" pytinyexr ${all:+bpy}; do
    stamp=py/$package
    [ -e "$stamp" ] || { py/bin/pip install --quiet "$package" >/dev/null 2>&1 && echo here > "$stamp" || echo missing > "$stamp"; }
done
if ! ldconfig -p | grep -q libfreeimage.so.3 && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null && [ ! -e freeimage ]; then
    touch freeimage
    apt-get install -y -q --no-install-recommends libfreeimage3 >/dev/null 2>&1 || true
fi

# matc of Debian is older than Filament's and compiles the same language.
for tool in glslangValidator:glslang-tools matc:libfilament-tools; do
    if ! command -v "${tool%:*}" >/dev/null && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null && [ ! -e "${tool#*:}" ]; then
        touch "${tool#*:}"
        apt-get install -y -q --no-install-recommends "${tool#*:}" >/dev/null 2>&1 || true
    fi
done
# Firefox has WebGL on a screen only, which Xvfb is without a device; Mesa is its graphics device in software.
if ! command -v firefox-esr >/dev/null && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null && [ ! -e firefox-esr ]; then
    touch firefox-esr
    apt-get install -y -q --no-install-recommends firefox-esr libegl1 libgl1 libgl1-mesa-dri xvfb >/dev/null 2>&1 || true
fi
browser() { command -v chromium || command -v chromium-browser || command -v google-chrome || true; }
if [ -z "$(browser)" ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null && [ ! -e chromium ]; then
    touch chromium
    apt-get install -y -q --no-install-recommends chromium >/dev/null 2>&1 || true
fi
