"""Reads the files of run.sh with the readers of Python, FreeImage and ImageMagick, and prints a line for each."""

import ctypes
import ctypes.util
import importlib
import json
import os
import shutil
import struct
import subprocess
import sys

import numpy

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
folder = sys.argv[1]
HALF, RGBE = 2.0**-11, 2.0**-8


def said(reader, file, text):
    print(f"{reader}\t{file}\t{text}", flush=True)


def package(name, reader):
    try:
        return importlib.import_module(name)
    except ImportError as error:
        said(reader, "SKIPPED", f"not installed: {error}")


def expected(name):
    return numpy.fromfile(f"{folder}/{name}.f32", dtype="<f4").reshape(32, 64, 3)


def compare(reader, file, read, wanted, most):
    """The largest error of a channel, in relation to its pixel's largest."""
    try:
        found = numpy.asarray(read(f"{folder}/{file}"), dtype=numpy.float64)[..., :3].reshape(wanted.shape)
        largest = numpy.abs(wanted).max(axis=-1, keepdims=True).clip(1e-20)
        error = float((numpy.abs(found - wanted) / largest).max())
    except Exception as failure:
        return said(reader, file, f"WRONG: {type(failure).__name__}: {failure}")
    said(reader, file, f"{error:.1e}" + ("" if error <= most else f" WRONG: more than {most:.1e}"))


def pictures(reader, read, kinds, names=("soft", "dim", "sun")):
    """`read` on the pictures of known values: exact in RGBE and in floats, within a rounding in halves."""
    for name in names:
        if "hdr" in kinds:
            compare(reader, f"{name}/picture.hdr", read, expected(name), 0.0)
        if "exr" in kinds:
            # `sun` does not fit halves, and is in floats by itself.
            compare(reader, f"{name}/picture.exr", read, expected(name), 0.0)
            compare(reader, f"{name}/float.exr", read, expected(name), 0.0)


def open_exr(path):
    channels = OpenEXR.File(path, separate_channels=True).channels()
    return numpy.stack([channels[name].pixels for name in "RGB"], axis=-1)


OpenEXR = package("OpenEXR", "OpenEXR")
if OpenEXR:
    pictures("OpenEXR", open_exr, ["exr"])
    layers = {name: {key: value.pixels for key, value in OpenEXR.File(f"{folder}/out/{name}.exr", separate_channels=True).channels().items()}
              for name in ("shrm-half", "shrm-float")}
    scale = max(numpy.abs(layer).max() for layer in layers["shrm-float"].values())
    same = layers["shrm-half"].keys() == layers["shrm-float"].keys()
    error = max(float(numpy.abs(layers["shrm-half"][key].astype(float) - layer).max() / scale) for key, layer in layers["shrm-float"].items()) if same else 1.0
    said("OpenEXR", f"out/shrm-half.exr ({len(layers['shrm-float'])} channels)", f"{error:.1e}" + ("" if error < HALF else " WRONG"))
    # One map after the other, each of six faces: the order of an array of cubes.
    maps = OpenEXR.File(f"{folder}/out/shrm-cube-layers.exr", separate_channels=True)
    planes, rows = maps.channels(), maps.header()["specula.rows"].split(" ")
    cubes = [[planes[f"{row}.{c}" if place else c].pixels for c in "RGB"] for place, row in enumerate(rows)]
    numpy.stack([numpy.stack(cube, axis=-1) for cube in cubes]).astype("<f4").tofile(f"{folder}/out/shrm-cubes.f32")
    for name in ("soft", "sun"):
        strip = open_exr(f"{folder}/{name}/strip.exr").astype(float).reshape(6, 16, 16, 3)
        strip.astype("<f4").tofile(f"{folder}/{name}/strip.f32")
        for index, face in enumerate(["px", "nx", "py", "ny", "pz", "nz"]):
            compare("OpenEXR", f"{name}/cube/{face}.exr", open_exr, strip[index], 0.0 if name == "sun" else HALF)

        def dds(path):
            """As DirectXTex lays it out: a DX10 header of 148 bytes, then faces one after the other."""
            data = open(path, "rb").read()
            format, dimension, flags, count, _ = struct.unpack("<5I", data[128:148])
            assert data[:4] == b"DDS " and data[84:88] == b"DX10" and (dimension, flags, count) == (3, 4, 1), "header"
            kind = {10: "<f2", 2: "<f4"}[format]
            return numpy.frombuffer(data, kind, offset=148).reshape(6, 16, 16, 4)

        compare("DX10 layout", f"{name}/cube.dds", dds, strip, 0.0 if name == "sun" else HALF)

OpenImageIO = package("OpenImageIO", "OpenImageIO")
if OpenImageIO:
    def oiio(path):
        file = OpenImageIO.ImageInput.open(path)
        assert file, OpenImageIO.geterror()
        return file.read_image(format="float")

    pictures("OpenImageIO", oiio, ["hdr", "exr"])

cv2 = package("cv2", "OpenCV")
if cv2:
    def opencv(path):
        image = cv2.imread(path, cv2.IMREAD_UNCHANGED)
        assert image is not None, "not read"
        return image[..., 2::-1]

    if "OpenEXR:                     NO" in cv2.getBuildInformation():
        said("OpenCV", "SKIPPED", "OpenEXR: built without it")
        pictures("OpenCV", opencv, ["hdr"])
    else:
        pictures("OpenCV", opencv, ["hdr", "exr"])

tiny = package("pytinyexr", "tinyexr")
if tiny:
    pictures("tinyexr", lambda path: tiny.PyEXRImage(path).get()[..., :3], ["exr"])

bpy = package("bpy", "Blender")
if bpy:
    def blender(path):
        image = bpy.data.images.load(os.path.abspath(path))
        image.colorspace_settings.name = "Non-Color"
        return numpy.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[::-1]

    pictures("Blender", blender, ["hdr", "exr"])

    # The image and the sun as one import of USD: where and how bright the sun is, and that the image is not turned.
    light_file = "sun-light/blender/environment-lights.usda"
    bpy.ops.wm.read_factory_settings()
    bpy.ops.wm.usd_import(filepath=os.path.abspath(f"{folder}/{light_file}"))
    wanted = json.load(open(f"{folder}/sun-light/blender/environment-lights.json"))["lights"][0]
    sun = next(thing for thing in bpy.data.objects if thing.type == "LIGHT" and thing.data.type == "SUN")
    away = numpy.array(sun.matrix_world.col[2][:3]) - wanted["direction"]
    strength = sun.data.energy * numpy.array(sun.data.color) / wanted["intensity"] - wanted["colour"]
    nodes = {node.type: node for node in bpy.context.scene.world.node_tree.nodes}
    turned = numpy.abs(nodes["MAPPING"].inputs["Rotation"].default_value).max()
    angle = numpy.degrees(sun.data.angle) / wanted["angular_diameter"] - 1
    error = max(numpy.abs(away).max(), numpy.abs(strength).max(), turned, abs(angle))
    shows = nodes["TEX_ENVIRONMENT"].image.name == "environment.exr"
    said("Blender", light_file, f"{error:.1e}" + ("" if error < 1e-5 and shows else " WRONG"))

library = ctypes.util.find_library("freeimage")
if not library:
    said("FreeImage", "SKIPPED", "not installed")
else:
    free = ctypes.CDLL(library)
    free.FreeImage_Load.restype = free.FreeImage_GetScanLine.restype = free.FreeImage_ConvertToRGBF.restype = ctypes.c_void_p
    for function in (free.FreeImage_GetWidth, free.FreeImage_GetHeight, free.FreeImage_ConvertToRGBF, free.FreeImage_Unload):
        function.argtypes = [ctypes.c_void_p]
    free.FreeImage_GetScanLine.argtypes = [ctypes.c_void_p, ctypes.c_int]

    def freeimage(path):
        image = free.FreeImage_Load(free.FreeImage_GetFileType(path.encode(), 0), path.encode(), 0)
        assert image, "not read"
        image = free.FreeImage_ConvertToRGBF(image)
        width, height = free.FreeImage_GetWidth(image), free.FreeImage_GetHeight(image)
        rows = [ctypes.string_at(free.FreeImage_GetScanLine(image, row), 12 * width) for row in reversed(range(height))]
        return numpy.frombuffer(b"".join(rows), "<f4").reshape(height, width, 3)

    pictures("FreeImage", freeimage, ["hdr", "exr"])

magick = shutil.which("magick") or shutil.which("convert")
if not magick:
    said("ImageMagick", "SKIPPED", "not installed")
else:
    def imagemagick(path):
        # The values as they are, without a curve.
        raw = subprocess.run([magick, path, "-set", "colorspace", "sRGB", "-depth", "16", "-endian", "LSB", "rgb:-"], capture_output=True, check=True).stdout
        return numpy.frombuffer(raw, "<u2").reshape(32, 64, 3) / 65535.0

    # It may be built for 16 bits, so that values end at 1.
    compare("ImageMagick", "dim/picture.hdr", imagemagick, expected("dim"), 1e-4)
