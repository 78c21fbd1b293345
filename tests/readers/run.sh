#!/usr/bin/env bash
# Reads what Specula writes with the readers of other programs, by values: a table of readers and files with the largest
# error. Fails if a reader that is here reads wrong values; readers that cannot be installed are SKIPPED aloud.
#   tests/readers/run.sh [--all] [SPECULA]     --all: also Blender's bpy, which is 350 MB
# Readers come from npm, PyPI and, as root, Debian, into target/readers; remove that folder to try again what was missing.
set -euo pipefail
cd "$(dirname "$0")/../.."
all=; [ "${1:-}" = --all ] && { all=1; shift; }
specula=$(realpath "${1:-target/debug/specula}")
here=$PWD/tests/readers
mkdir -p target/readers
cd target/readers

skip() { echo "SKIPPED $1: $2"; }

if ! command -v node >/dev/null || ! command -v npm >/dev/null; then
    skip "three.js, Babylon.js, ktx-parse" "no node"
elif [ ! -d node_modules/three ] || ! cmp -s "$here/package.json" package.json; then
    cp "$here/package.json" . && npm install --silent --no-audit --no-fund || skip "three.js, Babylon.js, ktx-parse" "npm cannot install them"
fi
# Each version's loaders use that version, and not the newest.
for version in three150 three170 three183; do
    sed -i "s/from 'three'/from '$version'/" node_modules/$version/examples/jsm/loaders/{RGBE,HDR,EXR}Loader.js 2>/dev/null || true
done

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

rm -rf files && mkdir files
py/bin/python "$here/make.py" files
cp "$here/pipeline.toml" files/
printf 'model = "standard"\nbase_color = [0.2, 0.4, 0.6]\nroughness = 0.6\n' > files/plastic.toml
cd files
convert() { "$specula" convert "$@" >/dev/null 2>>convert.log || { cat convert.log; exit 1; }; }
for name in soft dim sun; do
    mkdir $name
    convert $name.hdr -o $name/picture.hdr
    convert $name.hdr -o $name/picture.exr
    convert $name.hdr -o $name/float.exr --precision float
    convert $name.hdr -o $name/picture.ktx2
    convert $name.hdr -o $name/picture.dds
    # Cubes are compared with the strip of floats, which holds the same texels.
    convert $name.hdr -o $name/strip.exr --layout cube-strip --resolution 16 --precision float
    convert $name.hdr -o $name/cube --layout cube --resolution 16 --format exr
    convert $name.hdr -o $name/cube.ktx2 --layout cube --resolution 16
    convert $name.hdr -o $name/cube.dds --layout cube --resolution 16
done
"$specula" build >build.log 2>&1 || { cat build.log; exit 1; }
cd ..

: > results
py/bin/python "$here/readers.py" files >> results || echo "readers.py	ended early	WRONG" >> results
if [ -d node_modules/three ]; then
    node "$here/readers.mjs" files >> results || echo "readers.mjs	ended early	WRONG" >> results
fi
# A line is a reader, a file and the largest error in shares of a pixel's largest channel, or why not.
printf '%-14s %-34s %s\n' reader file "largest error"
awk -F'\t' '{ printf "%-14s %-34s %s\n", $1, $2, $3 }' results
! grep -q WRONG results
