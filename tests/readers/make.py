"""Writes Radiance pictures of known values, and those values as 32-bit floats (.f32), into a folder.

A picture is flat RGBE, so that each value is a mantissa times a power of two, exactly. `soft` stays below the largest half,
`sun` has a pixel far past it, of which sun.json has the direction and the irradiance, and `dim` stays below 1, for readers that clamp there.
"""

import array
import json
import math
import random
import sys

WIDTH, HEIGHT = 64, 32
folder = sys.argv[1]


def write(name, pixel):
    rgbe, values = bytearray(), array.array("f")
    for row in range(HEIGHT):
        for column in range(WIDTH):
            *mantissas, exponent = pixel(row, column)
            rgbe += bytes([*mantissas, exponent])
            values.extend(m * 2.0 ** (exponent - 136) for m in mantissas)
    with open(f"{folder}/{name}.hdr", "wb") as file:
        # Pixels that do not begin with (2, 2) are flat.
        file.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {HEIGHT} +X {WIDTH}\n".encode() + rgbe)
    with open(f"{folder}/{name}.f32", "wb") as file:
        file.write(values.tobytes())


numbers = random.Random(33)
mantissas = [[[numbers.randrange(128, 256), numbers.randrange(256), 0 if numbers.randrange(9) == 0 else numbers.randrange(256)]
              for _ in range(WIDTH)] for _ in range(HEIGHT)]
write("soft", lambda row, column: [*mantissas[row][column], 126 + (row + column) % 6])
write("dim", lambda row, column: [*mantissas[row][column], 127 + (row + column) % 2])
ROW, COLUMN = SUN = 9, 20
write("sun", lambda row, column: [*mantissas[row][column], 146 if (row, column) == SUN else 126 + (row + column) % 6])
# +Y is up, and the centre of the picture along +Z.
above, theta, below = (math.pi * (ROW + part) / HEIGHT for part in (0, 0.5, 1))
phi = 2 * math.pi * (0.5 - (COLUMN + 0.5) / WIDTH)
solid_angle = 2 * math.pi / WIDTH * (math.cos(above) - math.cos(below))
with open(f"{folder}/sun.json", "w") as file:
    json.dump({
        "direction": [math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi)],
        "irradiance": [mantissa * 2.0 ** (146 - 136) * solid_angle for mantissa in mantissas[ROW][COLUMN]],
    }, file)
