"""Reads the files that stages write, as numpy arrays with their metadata.

Frames, signs and row orders are those of CONVENTIONS.md: right-handed with +Z up, real orthonormal harmonics
without the Condon-Shortley phase, row l*l + l + m.
"""

from __future__ import annotations

import json
import math
import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import FileError

__all__ = ["BrdfTable", "Sh", "Shrm", "read_sh", "read_shrm", "read_table"]

_TYPES = {
    "F64": "<f8",
    "F32": "<f4",
    "F16": "<f2",
    "I64": "<i8",
    "I32": "<i4",
    "I16": "<i2",
    "I8": "i1",
    "U64": "<u8",
    "U32": "<u4",
    "U16": "<u2",
    "U8": "u1",
    "BOOL": "?",
}

#: Other files that a stage writes, by how they begin.
_OTHERS = {b"\xabKTX": "KTX2", b"\x76\x2f\x31\x01": "OpenEXR", b"DDS ": "DDS", b"#?": "Radiance"}

#: The longest header that readers of safetensors accept.
_LONGEST_HEADER = 100_000_000


@dataclass(frozen=True, eq=False)
class Sh:
    """Light in spherical harmonics, of `export-sh` or `project-sh`."""

    #: [(degree + 1)^2, 3] f64, radiance.
    coefficients: NDArray[np.float64]
    #: Suns and lamps that are not in the coefficients, [n, 7] f64: direction x, y, z, angular radius in
    #: radians, and the irradiance r, g, b of a surface that faces it.
    lights: NDArray[np.float64]
    #: What the file says about itself; the recipe is in `specula`.
    metadata: Mapping[str, str]

    @property
    def degree(self) -> int:
        """The highest l."""
        return math.isqrt(len(self.coefficients)) - 1


@dataclass(frozen=True, eq=False)
class Shrm:
    """A spherical harmonic reflection map, of `export-shrm`."""

    #: [faces, height, width, (degree + 1)^2, 3] f32: one face if the layout is `lat-long`, six if it is
    #: `cube`.
    coefficients: NDArray[np.float32]
    #: `lat-long` or `cube`.
    layout: str
    #: `local` if the harmonics are over the view in each texel's own frame, `global` if they are over the
    #: view itself.
    view: str
    #: What the map is looked up by: `reflection`, `normal` or `tangent`.
    centre: str
    #: Suns and lamps that are not in the map, as in `Sh`.
    lights: NDArray[np.float64]
    #: What the file says about itself; the recipe is in `specula`.
    metadata: Mapping[str, str]

    @property
    def degree(self) -> int:
        """P, the highest p."""
        return math.isqrt(self.coefficients.shape[3]) - 1


@dataclass(frozen=True, eq=False)
class BrdfTable:
    """The coefficients of materials for every view, of `export-brdf-table` or `tabulate-brdf`."""

    #: [materials, N, N, (degree + 1)^2, channels] f32: 1 channel if the materials are grey, else 3.
    coefficients: NDArray[np.float32]
    #: Where a view from below the horizon is looked up: `clamped` to the horizon, or `mirrored`.
    below: str
    #: Where the light comes from that is reflected: the `hemisphere` above the surface, or the `sphere`.
    incident: str
    #: What the file says about itself; the recipe is in `specula`.
    metadata: Mapping[str, str]

    @property
    def degree(self) -> int:
        """The highest l."""
        return math.isqrt(self.coefficients.shape[3]) - 1


def read_sh(path: str | os.PathLike[str]) -> Sh:
    """Reads the light of `export-sh`, as safetensors or as JSON with `preset = "specula"`, or of
    `project-sh`.

    Raises FileError.
    """
    if Path(path).suffix == ".json":
        return _read_sh_json(path)
    file = Tensors.read(path, "lighting")
    sh = file.tensor("sh", "F64", "[(F+1)^2, 3]")
    if sh.ndim != 2 or sh.shape[1] != 3 or not _is_square(sh.shape[0]):
        raise file.wrong_shape("sh", "[(F+1)^2, 3]")
    return Sh(sh, file.lights(), file.metadata)


def read_shrm(path: str | os.PathLike[str]) -> Shrm:
    """Reads the map of `export-shrm` with `format = "safetensors"`.

    Raises FileError.
    """
    file = Tensors.read(path, "shrm")
    layout = file.choice("layout", "lat-long", "cube")
    expected = "[6, edge, edge, (P+1)^2, 3]" if layout == "cube" else "[1, height, width, (P+1)^2, 3]"
    values = file.tensor("shrm", "F32", expected)
    shape = values.shape
    fits = len(shape) == 5 and shape[4] == 3 and 0 not in shape and _is_square(shape[3])
    if not fits or (shape[0] != 6 or shape[1] != shape[2] if layout == "cube" else shape[0] != 1):
        raise file.wrong_shape("shrm", f"{expected} of the layout {layout}")
    return Shrm(
        values,
        layout,
        file.choice("view", "local", "global"),
        file.choice("centre", "reflection", "normal", "tangent"),
        file.lights(),
        file.metadata,
    )


def read_table(path: str | os.PathLike[str]) -> BrdfTable:
    """Reads the table of `export-brdf-table` with `format = "safetensors"`, or of `tabulate-brdf`.

    Raises FileError.
    """
    expected = "[Q, N, N, (F+1)^2, 1 or 3]"
    file = Tensors.read(path, "brdf-table")
    values = file.tensor("c", "F32", expected)
    shape = values.shape
    fits = len(shape) == 5 and shape[1] == shape[2] and shape[4] in (1, 3) and 0 not in shape
    if not fits or not _is_square(shape[3]):
        raise file.wrong_shape("c", expected)
    below = file.choice("below", "clamped", "mirrored")
    return BrdfTable(values, below, file.choice("incident", "hemisphere", "sphere"), file.metadata)


def _is_square(rows: int) -> bool:
    return rows > 0 and math.isqrt(rows) ** 2 == rows


@dataclass(frozen=True, eq=False)
class Tensors:
    """The tensors of a safetensors file, and its metadata."""

    path: str | os.PathLike[str]
    arrays: Mapping[str, NDArray[Any]]
    metadata: Mapping[str, str]

    @classmethod
    def read(cls, path: str | os.PathLike[str], kind: str) -> Tensors:
        """Reads a file that a stage wrote, of this kind."""
        data = Path(path).read_bytes()
        for start, name in _OTHERS.items():
            if data.startswith(start):
                raise FileError(
                    path,
                    f'expected safetensors, found {name}; `format = "safetensors"` of the stage writes it',
                )
        if len(data) < 8:
            raise FileError(
                path, f"the file is truncated: expected the header of safetensors, found {len(data)} bytes"
            )
        (length,) = struct.unpack_from("<Q", data)
        if length > min(len(data) - 8, _LONGEST_HEADER):
            message = f"expected a header of {length} bytes at byte 8, found {len(data) - 8} bytes"
            raise FileError(path, f"the file is truncated or not safetensors: {message}")
        try:
            header = json.loads(data[8 : 8 + length])
            metadata = header.pop("__metadata__", {})
            spans = [(name, _TYPES.get(entry["dtype"]), entry) for name, entry in header.items()]
            spans.sort(key=lambda span: span[2]["data_offsets"])
            arrays = _arrays(path, spans, memoryview(data)[8 + length :])
        except FileError:
            raise
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise FileError(path, f"expected the header of safetensors at byte 8 ({error!r})") from error
        if not isinstance(metadata, dict) or not all(isinstance(value, str) for value in metadata.values()):
            raise FileError(path, "metadata: expected texts")
        found = metadata.get("kind")
        if found != kind:
            found = "no `kind` in the metadata" if found is None else f"the kind `{found}`"
            raise FileError(path, f"expected a file of the kind `{kind}`, found {found}")
        return cls(path, arrays, metadata)

    def tensor(self, name: str, dtype: str, shape: str) -> NDArray[Any]:
        """A tensor of finite numbers of this type."""
        array = self.arrays.get(name)
        if array is None:
            found = ", ".join(sorted(self.arrays)) or "none"
            raise FileError(
                self.path, f"expected a tensor `{name}` {shape} {dtype}, found the tensors: {found}"
            )
        if array.dtype != np.dtype(_TYPES[dtype]):
            raise FileError(self.path, f"tensor `{name}`: expected {dtype}, found {array.dtype}")
        _check_finite(self.path, name, array)
        return array

    def wrong_shape(self, name: str, expected: str) -> FileError:
        """The error of a tensor of another shape."""
        found = list(self.arrays[name].shape)
        return FileError(self.path, f"tensor `{name}`: expected the shape {expected}, found {found}")

    def choice(self, key: str, *words: str) -> str:
        """An entry of the metadata, which has to be one of these words."""
        word = self.metadata.get(key)
        if word not in words:
            found = "none" if word is None else repr(word)
            raise FileError(self.path, f"metadata `{key}`: expected {' or '.join(words)}, found {found}")
        return word

    def lights(self) -> NDArray[np.float64]:
        """The lights beside the coefficients; none if there is no such tensor."""
        if "lights" not in self.arrays:
            return np.zeros((0, 7))
        lights = self.tensor("lights", "F64", "[lights, 7]")
        if lights.ndim != 2 or lights.shape[1] != 7:
            raise self.wrong_shape("lights", "[lights, 7]")
        return lights


def _arrays(
    path: str | os.PathLike[str], spans: list[tuple[str, str | None, Any]], data: memoryview
) -> dict[str, NDArray[Any]]:
    """The tensors, which have to follow one another to the end of the file."""
    arrays: dict[str, NDArray[Any]] = {}
    at = 0
    for name, dtype, entry in spans:
        shape, (start, end) = entry["shape"], entry["data_offsets"]
        if dtype is None:
            raise FileError(path, f"tensor `{name}`: the type {entry['dtype']!r} is not known")
        if any(type(number) is not int or number < 0 for number in (*shape, start, end)):
            raise FileError(
                path, f"tensor `{name}`: expected whole numbers, found {shape} and {[start, end]}"
            )
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if start != at or end != at + size:
            expected = f"the bytes {at} to {at + size} for the shape {shape} of {entry['dtype']}"
            raise FileError(path, f"tensor `{name}`: expected {expected}, found {start} to {end}")
        if end > len(data):
            message = f"tensor `{name}` ends at byte {end} of the data, which has {len(data)}"
            raise FileError(path, f"the file is truncated: {message}")
        arrays[name] = np.frombuffer(data[start:end], dtype).reshape(shape).copy()
        at = end
    if at != len(data):
        raise FileError(path, f"expected {at} bytes of data, found {len(data)}")
    return arrays


def _check_finite(path: str | os.PathLike[str], name: str, array: NDArray[Any]) -> None:
    wrong = ~np.isfinite(array)
    if wrong.any():
        place = [int(index) for index in np.unravel_index(int(wrong.argmax()), array.shape)]
        raise FileError(
            path, f"tensor `{name}`: expected finite numbers, found {array[tuple(place)]} at {place}"
        )


def _read_sh_json(path: str | os.PathLike[str]) -> Sh:
    """The JSON of `export-sh`."""
    try:
        text = json.loads(Path(path).read_bytes())
    except ValueError as error:
        raise FileError(path, f"expected JSON ({error})") from error
    if not isinstance(text, dict) or text.get("preset") != "specula":
        found = text.get("preset") if isinstance(text, dict) else None
        hint = "" if found is None else f"; `specula convert-sh {os.fspath(path)} --to specula` converts it"
        raise FileError(path, f"`preset`: expected 'specula', found {found!r}{hint}")

    def rows(key: str, columns: int, default: Any) -> NDArray[np.float64]:
        try:
            array = np.array(text.get(key, default), dtype=np.float64)
        except (ValueError, TypeError) as error:
            raise FileError(path, f"`{key}`: expected rows of {columns} numbers ({error})") from error
        if array.size == 0 and key != "coefficients":
            return np.zeros((0, columns))
        if array.ndim != 2 or array.shape[1] != columns:
            raise FileError(
                path, f"`{key}`: expected rows of {columns} numbers, found the shape {list(array.shape)}"
            )
        _check_finite(path, key, array)
        return array

    coefficients = rows("coefficients", 3, [])
    degree = text.get("degree")
    if not _is_square(len(coefficients)) or math.isqrt(len(coefficients)) - 1 != degree:
        raise FileError(
            path,
            f"`coefficients`: expected (degree + 1)^2 rows of degree {degree!r}, found {len(coefficients)}",
        )
    metadata = {key: value for key, value in text.items() if isinstance(value, str)}
    if "specula" in text:
        metadata["specula"] = json.dumps(text["specula"])
    return Sh(coefficients, rows("lights", 7, []), metadata)
