"""Files of stages are read as another reader reads them, and damaged ones are errors that say where."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import GOLD_UNDER_STUDIO, ROOT, Build
from safetensors import safe_open

import specula

MANIFEST = GOLD_UNDER_STUDIO + """table_file = { kind = "export-brdf-table", input = "table", path = "table" }
[stage.sh]
kind = "export-sh"
input = "lighting"
lamps = "separate"
format = "safetensors"
degree = 6
path = "sh"
[stage.sh_json]
kind = "export-sh"
input = "lighting"
preset = "three"
path = "three"
[stage.shrm]
kind = "export-shrm"
input = "reflection"
resolution = 4
lamps = "separate"
path = "shrm"
[stage.shrm_image]
kind = "export-shrm"
input = "reflection"
layout = "lat-long"
resolution = 4
path = "image"
[stage.shrm_ktx2]
kind = "export-shrm"
input = "reflection"
resolution = 4
format = "ktx2"
path = "shrm"
"""


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory, build: Build) -> Path:
    folder = tmp_path_factory.mktemp("files")
    (folder / "studio.exr").write_bytes((ROOT / "assets/environments/studio.exr").read_bytes())
    (folder / "gold.toml").write_text(
        'model = "standard"\nbase_color = [1, 0.77, 0.34]\nmetallic = 1\nroughness = 0.5\n'
    )
    return build(folder, MANIFEST)


READERS: dict[str, tuple[Any, str]] = {
    "sh": (specula.read_sh, "sh"),
    "shrm": (specula.read_shrm, "shrm"),
    "image": (specula.read_shrm, "shrm"),
    "table": (specula.read_table, "c"),
}


@pytest.mark.parametrize("name", READERS)
def test_files_are_read_as_the_reader_of_safetensors_reads_them(out: Path, name: str) -> None:
    path, (read, tensor) = out / f"{name}.safetensors", READERS[name]
    found = read(path)
    with safe_open(path, "np") as file:
        np.testing.assert_array_equal(found.coefficients, file.get_tensor(tensor))
        assert found.metadata == file.metadata()
        lights = "lights" in file.keys()
        if lights:
            np.testing.assert_array_equal(found.lights, file.get_tensor("lights"))
    assert lights == (name in ("sh", "shrm"))
    assert found.degree == {"sh": 6}.get(name, 2)
    assert json.loads(found.metadata["specula"])["kind"].startswith("export-")
    found.coefficients[...] = 0.0  # An array of one's own.


def test_properties_are_those_of_the_file(out: Path) -> None:
    cube, image = specula.read_shrm(out / "shrm.safetensors"), specula.read_shrm(out / "image.safetensors")
    assert (cube.layout, cube.view, cube.centre, cube.coefficients.shape) == (
        "cube",
        "local",
        "reflection",
        (6, 4, 4, 9, 3),
    )
    assert (image.layout, image.coefficients.shape, image.lights.shape) == (
        "lat-long",
        (1, 4, 8, 9, 3),
        (0, 7),
    )
    table = specula.read_table(out / "table.safetensors")
    assert (table.below, table.incident, table.coefficients.shape) == (
        "clamped",
        "hemisphere",
        (1, 8, 8, 9, 3),
    )


def _parts(path: Path) -> tuple[Any, bytes]:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<Q", data)
    return json.loads(data[8 : 8 + length]), data[8 + length :]


def _write(path: Path, header: Any, data: bytes) -> Path:
    text = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + data)
    return path


@pytest.mark.parametrize("name", READERS)
def test_a_truncated_file_is_an_error_at_every_length(out: Path, tmp_path: Path, name: str) -> None:
    data, path = (out / f"{name}.safetensors").read_bytes(), tmp_path / "cut.safetensors"
    lengths = {
        *range(0, min(len(data), 3000), 7),
        *range(0, len(data), max(1, len(data) // 200)),
        len(data) - 1,
    }
    for length in lengths:
        path.write_bytes(data[:length])
        with pytest.raises(specula.FileError, match="cut.safetensors: .*(truncated|expected)"):
            READERS[name][0](path)
    path.write_bytes(data + b"\0")
    with pytest.raises(
        specula.FileError, match=f"expected {len(_parts(out / f'{name}.safetensors')[1])} bytes of data"
    ):
        READERS[name][0](path)


def test_errors_name_the_file_the_place_and_what_was_expected(out: Path, tmp_path: Path) -> None:
    path = tmp_path / "wrong.safetensors"

    def check(name: str, change: Any, expected: str, poke: tuple[int, bytes] = (0, b"")) -> None:
        header, data = _parts(out / f"{name}.safetensors")
        start = header[READERS[name][1]]["data_offsets"][0]
        change(header)
        at, piece = start + poke[0], poke[1]
        _write(path, header, data[:at] + piece + data[at + len(piece) :])
        with pytest.raises(specula.FileError) as caught:
            READERS[name][0](path)
        assert caught.value.path == path and str(caught.value) == f"{path}: {expected}", str(caught.value)

    def keep(header: Any) -> None:
        pass

    def nan(code: str) -> bytes:
        return struct.pack(f"<{code}", float("nan"))

    check("sh", keep, "tensor `sh`: expected finite numbers, found nan at [2, 1]", (7 * 8, nan("d")))
    check(
        "shrm",
        keep,
        "tensor `shrm`: expected finite numbers, found nan at [0, 0, 1, 0, 2]",
        (29 * 4, nan("f")),
    )
    check(
        "table",
        keep,
        "tensor `c`: expected finite numbers, found inf at [0, 0, 0, 0, 1]",
        (4, struct.pack("<f", np.inf)),
    )
    with pytest.raises(
        specula.FileError, match="expected a file of the kind `shrm`, found the kind `lighting`"
    ):
        specula.read_shrm(out / "sh.safetensors")
    check(
        "sh",
        lambda h: h["__metadata__"].pop("kind"),
        "expected a file of the kind `lighting`, found no `kind` in the metadata",
    )
    check(
        "sh",
        lambda h: h.update(other=h.pop("sh")),
        "expected a tensor `sh` [(F+1)^2, 3] F64, found the tensors: lights, other",
    )
    check("sh", lambda h: h["sh"].update(dtype="I64"), "tensor `sh`: expected F64, found int64")
    check("sh", lambda h: h["sh"].update(dtype="F8_E4M3"), "tensor `sh`: the type 'F8_E4M3' is not known")
    check(
        "sh",
        lambda h: h["sh"].update(shape=[21, 7]),
        "tensor `sh`: expected the shape [(F+1)^2, 3], found [21, 7]",
    )
    check(
        "sh",
        lambda h: h["sh"].update(shape=[-49, -3]),
        "tensor `sh`: expected whole numbers, found [-49, -3] and [0, 1176]",
    )
    check(
        "sh", lambda h: h["sh"].update(shape=[2**62, 2**62]), ANY_BYTES.format(2**127, [2**62, 2**62], 1176)
    )
    check("sh", lambda h: h["sh"].update(shape=[48, 3]), ANY_BYTES.format(48 * 24, [48, 3], 1176))
    # A hole between two tensors.
    hole = "tensor `shrm`: expected the bytes 0 to 10368 for the shape [6, 4, 4, 9, 3] of F32, found {} to {}"
    lights = _parts(out / "shrm.safetensors")[0]["lights"]["data_offsets"][1]
    check("shrm", lambda h: h.pop("lights"), hole.format(lights, lights + 10368))
    check(
        "shrm",
        lambda h: h["__metadata__"].update(layout="lat-long"),
        "tensor `shrm`: expected the shape [1, height, width, (P+1)^2, 3] of the layout lat-long, "
        "found [6, 4, 4, 9, 3]",
    )
    check(
        "shrm",
        lambda h: h["__metadata__"].update(view="sideways"),
        "metadata `view`: expected local or global, found 'sideways'",
    )
    check(
        "shrm",
        lambda h: h["__metadata__"].pop("centre"),
        "metadata `centre`: expected reflection or normal or tangent, found none",
    )
    check(
        "table",
        lambda h: h["c"].update(shape=[1, 8, 4, 18, 3]),
        "tensor `c`: expected the shape [Q, N, N, (F+1)^2, 1 or 3], found [1, 8, 4, 18, 3]",
    )
    check("table", lambda h: h["__metadata__"].update(below=7), "metadata: expected texts")


ANY_BYTES = "tensor `sh`: expected the bytes 0 to {} for the shape {} of F64, found 0 to {}"


def test_other_files_are_named(out: Path, tmp_path: Path) -> None:
    with pytest.raises(specula.FileError, match='expected safetensors, found KTX2; `format = "safetensors"`'):
        specula.read_shrm(out / "shrm.ktx2")
    with pytest.raises(
        specula.FileError,
        match="`preset`: expected 'specula', found 'three'; `specula convert-sh .* --to specula`",
    ):
        specula.read_sh(out / "three.json")
    with pytest.raises(FileNotFoundError):
        specula.read_table(tmp_path / "absent")
    path = tmp_path / "light.json"
    rows = [[1.0, 2.0, 3.0]] * 4
    texts: list[tuple[str | dict[str, Any], str]] = [
        ("[1", "expected JSON"),
        ("[]", "`preset`: expected 'specula', found None"),
        ({"coefficients": rows, "degree": 2}, "expected (degree + 1)^2 rows of degree 2, found 4"),
        ({"coefficients": rows[:3], "degree": 1}, "expected (degree + 1)^2 rows of degree 1, found 3"),
        ({"degree": 1}, "`coefficients`: expected rows of 3 numbers, found the shape [0]"),
        ({"coefficients": [[1.0, 2.0], [1.0]], "degree": 0}, "`coefficients`: expected rows of 3 numbers"),
        (
            {"coefficients": rows, "degree": 1, "lights": [[1.0] * 6]},
            "`lights`: expected rows of 7 numbers, found the shape [1, 6]",
        ),
        (
            {"coefficients": [[1.0, float("nan"), 3.0]], "degree": 0},
            "expected finite numbers, found nan at [0, 1]",
        ),
    ]
    for text, expected in texts:
        path.write_text(text if isinstance(text, str) else json.dumps({"preset": "specula"} | text))
        with pytest.raises(specula.FileError) as caught:
            specula.read_sh(path)
        assert str(path) in str(caught.value) and expected in str(caught.value), str(caught.value)
    path.write_text(
        json.dumps(
            {"preset": "specula", "coefficients": rows, "degree": 1, "frame": "f", "specula": {"kind": "x"}}
        )
    )
    sh = specula.read_sh(path)
    assert (sh.degree, sh.lights.shape, sh.metadata["frame"], sh.metadata["specula"]) == (
        1,
        (0, 7),
        "f",
        '{"kind": "x"}',
    )


@pytest.mark.parametrize(
    "header",
    [
        "{",
        "[]",
        '{"a": 1}',
        '{"a": {"dtype": "F64"}}',
        '{"__metadata__": 1}',
        '{"a": {"dtype": "F64", "shape": 1, "data_offsets": [0, 8]}}',
        '{"a": {"dtype": "F64", "shape": [], "data_offsets": [0]}}',
        "[" * 100_000,
    ],
)
def test_a_damaged_header_is_an_error(tmp_path: Path, header: str) -> None:
    path = tmp_path / "damaged.safetensors"
    path.write_bytes(struct.pack("<Q", len(header)) + header.encode())
    with pytest.raises(specula.FileError, match="header of safetensors at byte 8|metadata"):
        specula.read_sh(path)
    path.write_bytes(struct.pack("<Q", 2**63) + b"{}")
    with pytest.raises(specula.FileError, match="truncated or not safetensors"):
        specula.read_sh(path)
