"""Writes a glTF asset with clothes into a folder: asset.gltf, two files of numbers and a picture beside it.

Two nodes show one mesh of two primitives, one of them without normals; a material has a texture and two extensions, and a
node is animated. What Specula does not read is there, too: cameras, extras, a light.
"""

import json
import struct
import sys
import zlib

folder = sys.argv[1]
floats = lambda *numbers: struct.pack(f"<{len(numbers)}f", *numbers)

# A square in the plane of the file's X and Z, facing +Y, and a wall at its edge.
floor = floats(-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1)
wall = floats(-1, 0, -1, 1, 0, -1, 1, 1, -1, -1, 1, -1)
numbers = [floor, floats(*[0, 1, 0] * 4), floats(0, 0, 0, 1, 1, 1, 1, 0), wall, struct.pack("<6H", 0, 1, 2, 0, 2, 3)]
times = [floats(0, 1), floats(0, 0, 0, 1, 0, 0.7071068, 0, 0.7071068)]
views, accessors = [], []
for buffer, parts in enumerate([numbers, times]):
    offset = 0
    for part in parts:
        views.append({"buffer": buffer, "byteOffset": offset, "byteLength": len(part)})
        offset += len(part)
    with open(f"{folder}/asset{buffer}.bin", "wb") as file:
        file.write(b"".join(parts))


def accessor(view, count, kind, **more):
    accessors.append({"bufferView": view, "componentType": 5126, "count": count, "type": kind, **more})
    return len(accessors) - 1


places = [accessor(0, 4, "VEC3", min=[-1, 0, -1], max=[1, 0, 1]), accessor(3, 4, "VEC3", min=[-1, 0, -1], max=[1, 1, -1])]
normals, coordinates = accessor(1, 4, "VEC3"), accessor(2, 4, "VEC2")
corners = accessor(4, 6, "SCALAR", componentType=5123)
moments = [accessor(5, 2, "SCALAR", min=[0], max=[1]), accessor(6, 2, "VEC4")]

row = b"\0" + bytes([200, 60, 20, 20, 60, 200])
chunk = lambda name, data: struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
with open(f"{folder}/paint.png", "wb") as file:
    header = struct.pack(">2I5B", 2, 2, 8, 2, 0, 0, 0)
    file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(row * 2)) + chunk(b"IEND", b""))

asset = {
    "asset": {"version": "2.0", "generator": "tests/readers", "extras": {"note": "kept"}},
    "scene": 0,
    "scenes": [{"name": "all", "nodes": [0, 1]}],
    "nodes": [
        {"name": "here", "mesh": 0, "children": [2]},
        {"name": "there", "mesh": 0, "translation": [4, 0, 0]},
        {"name": "eye", "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
    "meshes": [{"name": "corner", "primitives": [
        {"attributes": {"POSITION": places[0], "NORMAL": normals, "TEXCOORD_0": coordinates}, "indices": corners, "material": 0},
        {"attributes": {"POSITION": places[1]}, "indices": corners, "material": 1},
    ]}],
    "materials": [
        {"name": "Paint", "doubleSided": True, "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.5}},
         "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1, 0.30000001, 1]}},
        {"name": "Wall", "pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": {"KHR_materials_ior": {"ior": 1.45}}},
    ],
    "textures": [{"source": 0, "sampler": 0}],
    "samplers": [{"wrapS": 33071}],
    "images": [{"uri": "paint.png", "name": "paint"}],
    "animations": [{"name": "turn", "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
                    "samplers": [{"input": moments[0], "output": moments[1]}]}],
    "accessors": accessors,
    "bufferViews": views,
    "buffers": [{"uri": f"asset{index}.bin", "byteLength": sum(map(len, parts))} for index, parts in enumerate([numbers, times])],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 40}]}},
    "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_clearcoat", "KHR_materials_ior"],
}
with open(f"{folder}/asset.gltf", "w") as file:
    json.dump(asset, file, indent=2)
