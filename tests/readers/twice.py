"""Writes a .gltf of a .glb with one mesh, in which two nodes show the mesh: one is turned, the other moved and made smaller.

python twice.py IN.glb OUT: writes OUT.gltf and OUT.bin.
"""

import json
import pathlib
import struct
import sys

source, target = sys.argv[1:]
data = pathlib.Path(source).read_bytes()
end = 20 + struct.unpack_from("<I", data, 12)[0]
asset = json.loads(data[20:end])
pathlib.Path(f"{target}.bin").write_bytes(data[end + 8:])
asset["buffers"][0]["uri"] = pathlib.Path(target).name + ".bin"
asset["nodes"] = [
    {"name": "parent", "rotation": [0.5, 0.1, -0.3, 0.8062258], "children": [1, 2]},
    {"name": "turned", "mesh": 0, "rotation": [0, 0.6, 0, 0.8], "translation": [0, 0.6, 0], "scale": [0.7, 0.7, 0.7]},
    {"name": "moved", "mesh": 0, "translation": [0.3, -0.8, 0.2], "scale": [0.5, 0.5, 0.5]},
]
asset["scenes"] = [{"nodes": [0]}]
pathlib.Path(f"{target}.gltf").write_text(json.dumps(asset))
