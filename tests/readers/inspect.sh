#!/usr/bin/env bash
# Compiles what `specula inspect --shader` prints of maps, in GLSL and HLSL: inspect.sh SPECULA MAP... Prints lines as
# readers.mjs does. Other tests run the shaders in WGSL and Metal.
set -euo pipefail
specula=$1; shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
compiled() { glslangValidator "$@" >"$work/said" 2>&1 && echo compiles || echo "WRONG: $(grep -m1 ERROR "$work/said")"; }
for map in "$@"; do
    name=$(basename "$map")
    { echo "#version 310 es"; "$specula" inspect "$map" --shader glsl
      echo "out vec4 o; void main() { o = vec4(reflected(vec3(0, 0, 1), vec3(0, 0.6, 0.8)), 1.0); }"; } >"$work/map.frag"
    printf 'glslang\t%s, GLSL\t%s\n' "$name" "$(compiled -S frag "$work/map.frag")"
    { "$specula" inspect "$map" --shader hlsl
      echo "float4 main() : SV_Target { return float4(reflected(float3(0, 0, 1), float3(0, 0.6, 0.8)), 1.0); }"; } >"$work/map.hlsl"
    printf 'glslang\t%s, HLSL\t%s\n' "$name" "$(compiled -D -V --auto-map-bindings -S frag -e main "$work/map.hlsl" -o "$work/spv")"
done
