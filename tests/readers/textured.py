"""Writes two spheres with textures of base colours into a folder, as glTF.

dressed.gltf has two materials: paint on its upper half, whose texture is turned, repeated in a mirror and has more texels
than a picture has pixels, and metal on its lower one. bare.gltf is the same in one material without a texture.
"""

import json
import math
import struct
import sys
import zlib

folder = sys.argv[1]
COLUMNS, ROWS, SIDE = 96, 48, 256


def vertex(column, row):
    """Position and normal, and the place in a texture."""
    phi, theta = 2 * math.pi * column / COLUMNS, math.pi * row / ROWS
    normal = [math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi)]
    return normal, [column / COLUMNS, row / ROWS]


vertices = [vertex(column, row) for row in range(ROWS + 1) for column in range(COLUMNS + 1)]
corners = [[], []]
for row in range(ROWS):
    for column in range(COLUMNS):
        a = row * (COLUMNS + 1) + column
        b = a + COLUMNS + 1
        corners[row >= ROWS // 2] += [a, b, a + 1] * (row > 0) + [a + 1, b, b + 1] * (row < ROWS - 1)

normals = b"".join(struct.pack("<3f", *normal) for normal, _ in vertices)
places = b"".join(struct.pack("<2f", *place) for _, place in vertices)
indices = [struct.pack(f"<{len(of)}H", *of) for of in corners]
numbers = [normals, places, *indices]
with open(f"{folder}/sphere.bin", "wb") as file:
    file.write(b"".join(numbers))

chunk = lambda name, data: struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def picture(name, texel):
    rows = (b"\0" + bytes(code for x in range(SIDE) for code in texel(x, y)) for y in range(SIDE))
    header = struct.pack(">2I5B", SIDE, SIDE, 8, 2, 0, 0, 0)
    with open(f"{folder}/{name}.png", "wb") as file:
        data = zlib.compress(b"".join(rows))
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


wave = lambda at: math.sin(2 * math.pi * at / SIDE)
# Squares of a texel, which are seen as their mean.
square = lambda x, y: 15 if (x + y) % 2 else -15
picture("paint", lambda x, y: [round(130 + 50 * wave(x)) + square(x, y), round(110 + 40 * wave(y)) + square(x, y), 90])
picture("metal", lambda x, y: [round(200 + 40 * wave(x)), round(150 + 50 * wave(x + y)), round(120 + 60 * wave(y))])

offsets = [sum(map(len, numbers[:place])) for place in range(len(numbers) + 1)]
views = [{"buffer": 0, "byteOffset": offsets[place], "byteLength": len(of)} for place, of in enumerate(numbers)]
accessors = [
    {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3", "min": [-1, -1, -1], "max": [1, 1, 1]},
    {"bufferView": 1, "componentType": 5126, "count": len(vertices), "type": "VEC2"},
    *({"bufferView": 2 + place, "componentType": 5123, "count": len(of), "type": "SCALAR"} for place, of in enumerate(corners)),
]
turned = {"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [3, 2]}}
materials = [
    {"name": "paint", "pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0, "extensions": turned}, "baseColorFactor": [0.9, 1, 1, 1],
        "metallicFactor": 0, "roughnessFactor": 0.5}},
    {"name": "metal", "pbrMetallicRoughness": {
        "baseColorTexture": {"index": 1}, "metallicFactor": 1, "roughnessFactor": 0.4}},
]
primitive = lambda half, material: {
    "attributes": {"POSITION": 0, "NORMAL": 0, "TEXCOORD_0": 1}, "indices": 2 + half, "material": material}


def write(name, materials, worn):
    asset = {
        "asset": {"version": "2.0", "generator": "tests/readers"},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive(half, material) for half, material in enumerate(worn)]}],
        "materials": materials,
        "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 1}],
        "samplers": [{"wrapS": 33648, "wrapT": 33648}, {"wrapS": 10497, "wrapT": 33071}],
        "images": [{"uri": "paint.png"}, {"uri": "metal.png"}],
        "accessors": accessors, "bufferViews": views,
        "buffers": [{"uri": "sphere.bin", "byteLength": offsets[-1]}],
        "extensionsUsed": ["KHR_texture_transform"],
    }
    with open(f"{folder}/{name}.gltf", "w") as file:
        json.dump(asset, file, indent=2)


write("dressed", materials, [0, 1])
write("bare", [{"name": "clay", "pbrMetallicRoughness": {"metallicFactor": 0}}], [0, 0])
