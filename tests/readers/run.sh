#!/usr/bin/env bash
# Reads what Specula writes with the readers of other programs, by values: a table of readers and files with the largest
# error. Fails if a reader that is here reads wrong values; readers that cannot be installed are SKIPPED aloud.
# The layout of pages is measured in a browser, pages.mjs, and a live page compared with stills, page.mjs, also when it is
# served, live.mjs, with textures, textured.mjs, and in Firefox, firefox.mjs. Skies are shown there, sky.html, meshes are
# relit, relight.html, light probes read back, probes.html, and lit from their transport, transport.mjs, and compact maps are
# drawn with, three.html and babylon.html; screenshots lie in target/readers/files/relight and taps.
#   tests/readers/run.sh [--all] [SPECULA]     --all: also Blender's bpy, which is 350 MB
# Readers come from npm, PyPI and, as root, Debian (install.sh).
set -euo pipefail
cd "$(dirname "$0")/../.."
all=(); [ "${1:-}" = --all ] && { all=(--all); shift; }
specula=$(realpath "${1:-target/debug/specula}")
here=$PWD/tests/readers
assets=$PWD/assets/environments
tests/readers/install.sh "${all[@]}"
cd target/readers

skip() { echo "SKIPPED $1: $2"; }
browser() { command -v chromium || command -v chromium-browser || command -v google-chrome || true; }
chromium=$(browser)

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

# Compact maps of a metal, of a brushed one, and of one that is brushed askew, whose table has no symmetry. Brute force in
# the browser adds up images that are small.
mkdir -p taps/environments taps/small taps/materials
cp "$here/taps.toml" taps/pipeline.toml
printf 'model = "standard"\nbase_color = [0.95, 0.64, 0.54]\nmetallic = 1\nroughness = 0.3\n' > taps/materials/copper.toml
printf 'model = "ggx"\nn = [0.21, 0.91, 1.1]\nk = [3.9, 2.4, 2.1]\nroughness_x = 0.3\nroughness_y = 0.5\n' > taps/materials/brushed.toml
../py/bin/python "$here/askew.py" > taps/materials/askew.csv
cp "$assets/studio.exr" taps/environments/
if [ -d "${SPECULA_CORPUS:-}" ]; then
    cat "$here/photographs.toml" >> taps/pipeline.toml
    for name in studio sunrise; do
        convert "$SPECULA_CORPUS/env/cc0/$name.hdr" -o taps/environments/corpus-$name.exr --resolution 256 --precision float
    done
else
    skip "compact maps under photographs" "SPECULA_CORPUS is not set"
fi
for file in taps/environments/*.exr; do
    convert "$file" -o "${file%.exr}.hdr"
    convert "$file" -o "taps/small/$(basename "$file")" --resolution 64 --precision float
done
# Meshes with numbers at their vertices, in files of their own and in the assets that they came from.
mkdir gltf
cp "$here/gltf.toml" gltf/pipeline.toml
../py/bin/python "$here/asset.py" gltf
if [ -d "${SPECULA_CORPUS:-}" ]; then
    cp "$SPECULA_CORPUS"/mesh/FlightHelmet/* gltf/
else
    skip "a helmet with six materials" "SPECULA_CORPUS is not set"
fi
"$specula" -C gltf build >gltf/build.log 2>&1 || { cat gltf/build.log; exit 1; }

# Meshes with transfer, matte and glossy, for the code of docs/relighting.md.
mkdir -p relight/meshes relight/assets relight/materials
cp "$here/relight.toml" relight/pipeline.toml
cp "$assets/studio.exr" "$assets/../white.toml" relight/
cp "$assets"/../brushed/*.toml relight/materials/
cp "$assets/../meshes/knot.glb" relight/meshes/
../py/bin/python "$here/twice.py" relight/meshes/knot.glb relight/assets/twice
if [ -d "${SPECULA_CORPUS:-}" ]; then
    cp "$SPECULA_CORPUS/mesh/suzi.glb" relight/meshes/
    cp "$SPECULA_CORPUS"/mesh/FlightHelmet/* relight/assets/
else
    skip "a monkey and a helmet that are relit" "SPECULA_CORPUS is not set"
fi
"$specula" -C relight build >relight/build.log 2>&1 || { cat relight/build.log; exit 1; }

# Patterns of light probes, and the transport of a room.
mkdir -p probes
cp "$here/probes.toml" probes/pipeline.toml
cp "$here/../../examples/probes/"{room.glb,skies/morning.toml} probes/
"$specula" -C probes build >probes/build.log 2>&1 || { cat probes/build.log; exit 1; }

# Skies of engines, as the command without a manifest writes them.
"$specula" test-pattern --preset blender pattern >/dev/null 2>&1
for engine in three babylon filament; do
    convert pattern/pattern-orient.exr --engine $engine -o sky/$engine/
done
for engine in three babylon filament blender; do
    convert sun.hdr --engine $engine --sun light --lights 1 -o sun-light/$engine/
done
# A report and a page of timings, with names as long as those of photographs.
mkdir -p pages/environments pages/materials
cp "$here/pages.toml" pages/pipeline.toml
cp soft.hdr pages/environments/
cp sun.hdr pages/environments/a_small_sun_over_an_uneven_sky_4k.hdr
cp plastic.toml pages/materials/
cp taps/materials/brushed.toml pages/materials/brushed-metal-with-a-name-that-is-long.toml
"$specula" -C pages build --timings=timings >pages/build.log 2>&1 || { cat pages/build.log; exit 1; }
# A live page, and stills of what it draws.
mkdir -p page/environments page/materials
cp "$here/page.toml" page/pipeline.toml
cp "$assets/sky.exr" page/environments/
cp taps/materials/copper.toml plastic.toml page/materials/
cp "$assets/../meshes/knot.glb" "$assets/../white.toml" page/
"$specula" -C page build >page/build.log 2>&1 || { cat page/build.log; exit 1; }
# The same of meshes with textures.
mkdir -p textured/environments textured/materials textured/meshes
cp "$here/textured.toml" textured/pipeline.toml
cp "$assets/sky.exr" textured/environments/
../py/bin/python "$here/textured.py" textured/meshes
for name in paint metal; do
    printf 'model = "gltf"\nfile = "../meshes/dressed.gltf"\nmaterial = "%s"\n' $name > textured/materials/$name.toml
done
"$specula" -C textured build >textured/build.log 2>&1 || { cat textured/build.log; exit 1; }
"$specula" -C taps build --verbose >taps/build.log 2>&1 || { cat taps/build.log; exit 1; }
cd ..

: > results
py/bin/python "$here/readers.py" files >> results || echo "readers.py	ended early	WRONG" >> results
if command -v glslangValidator >/dev/null; then
    "$here/inspect.sh" "$specula" files/out/shrm-{array,cubes,components}.ktx2 >> results || echo "inspect.sh	ended early	WRONG" >> results
else
    skip "shaders of maps" "no glslangValidator"
fi
if [ -d node_modules/gltf-validator ]; then
    node "$here/gltf.mjs" files/gltf >> results || echo "gltf.mjs	ended early	WRONG" >> results
fi
if [ -d node_modules/three ]; then
    node "$here/readers.mjs" files >> results || echo "readers.mjs	ended early	WRONG" >> results
    if [ -z "$chromium" ]; then
        skip "pages, skies, meshes and compact maps in browsers" "no Chromium"
    elif [ ! -d node_modules/puppeteer-core ]; then
        skip "pages, skies, meshes and compact maps in browsers" "npm cannot install what drives Chromium"
    else
        node "$here/sky.mjs" files "$chromium" >> results || echo "sky.mjs	ended early	WRONG" >> results
        node "$here/relight.mjs" files/relight "$chromium" "$here/../../docs/relighting.md" >> results || echo "relight.mjs	ended early	WRONG" >> results
        node "$here/probes.mjs" files/probes "$chromium" >> results || echo "probes.mjs	ended early	WRONG" >> results
        node "$here/transport.mjs" files/probes "$chromium" >> results || echo "transport.mjs	ended early	WRONG" >> results
        node "$here/pages.mjs" files "$chromium" >> results || echo "pages.mjs	ended early	WRONG" >> results
        node "$here/page.mjs" files "$chromium" >> results || echo "page.mjs	ended early	WRONG" >> results
        node "$here/textured.mjs" files "$chromium" "$specula" >> results || echo "textured.mjs	ended early	WRONG" >> results
        if command -v firefox-esr >/dev/null && command -v Xvfb >/dev/null; then
            node "$here/firefox.mjs" files "$(command -v firefox-esr)" >> results || echo "firefox.mjs	ended early	WRONG" >> results
        else
            skip "a page in Firefox" "no firefox-esr or no Xvfb"
        fi
        node "$here/live.mjs" files "$chromium" "$specula" >> results || echo "live.mjs	ended early	WRONG" >> results
        node "$here/taps.mjs" files/taps "$chromium" >> results || echo "taps.mjs	ended early	WRONG" >> results
        if command -v glslangValidator >/dev/null && command -v naga >/dev/null; then
            node "$here/shaders.mjs" files/taps "$chromium" >> results || echo "shaders.mjs	ended early	WRONG" >> results
        else
            skip "shaders of compact maps for other engines" "no glslangValidator or no naga"
        fi
    fi
fi
# A line is a reader, a file and the largest error in shares of a pixel's largest channel, or why not; of skies, meshes and
# compact maps, what sky.mjs, relight.mjs and taps.mjs say; of pages, the number of faults of their layout.
printf '%-14s %-34s %s\n' reader file "largest error"
awk -F'\t' '{ printf "%-14s %-34s %s\n", $1, $2, $3 }' results
! grep -q WRONG results
