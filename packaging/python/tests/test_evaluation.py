"""Values against SciPy, brute force in numpy, and values that other code computed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import brute_force
import numpy as np
import pytest
from brute_force import Array
from conftest import Build, write_pfm

import specula

LIGHT = """
[stage.environment]
kind = "import-environment"
source = "{picture}"
resolution = {rows}
[stage.lighting]
kind = "project-sh"
input = "environment"
degree = {degree}
[stage.picture]
kind = "export-environment"
input = "environment"
format = "exr"
precision = "float"
path = "picture"
[stage.sh]
kind = "export-sh"
input = "lighting"
window = "none"
format = "{format}"
path = "light"
"""

REFLECTED = """
[stage.material]
kind = "import-material"
source = "materials/*.toml"
[stage.brdf]
kind = "project-brdf"
input = "material"
degree = [{degree}, {p}]
[stage.reflection]
kind = "convolve"
inputs = {{ lighting = "lighting", brdf = "brdf" }}
"""

SHRM = """
[stage.{name}]
kind = "export-shrm"
input = "reflection"
layout = "{layout}"
view = "{view}"
resolution = {resolution}
path = "{{material}}/{name}"
"""


def test_harmonics_are_those_of_scipy() -> None:
    w = np.concatenate([brute_force.some_directions(60, 1), np.eye(3), -np.eye(3)])
    for degree in (0, 1, 2, 7, 40):
        values = specula.harmonics(degree, 3.0 * w)
        assert values.shape == (66, (degree + 1) ** 2)
        # SciPy's own recurrence loses a digit for each ten degrees.
        np.testing.assert_allclose(values, brute_force.harmonics(degree, w), atol=1e-12)
    assert specula.harmonics(3, [0.0, 0.0, 1.0]).shape == (16,)
    # CONVENTIONS.md: the rows of l = 1 are 0.488603 (y, z, x).
    np.testing.assert_allclose(
        specula.harmonics(1, w)[:, 1:], np.sqrt(0.75 / np.pi) * w[:, [1, 2, 0]], atol=1e-15
    )


def test_high_degrees_obey_the_addition_theorem() -> None:
    values = specula.harmonics(1200, brute_force.some_directions(6, 2))
    for l in range(0, 1201, 100):
        sums = (values[:, l * l : (l + 1) ** 2] ** 2).sum(axis=1)
        np.testing.assert_allclose(sums, (2 * l + 1) / (4.0 * np.pi), rtol=1e-11)


def test_directions_may_have_any_length_and_errors_name_their_place() -> None:
    tiny = specula.harmonics(2, [[3e-200, 4e-200, 0.0], [3e200, 4e200, 0.0]])
    np.testing.assert_allclose(tiny, specula.harmonics(2, [[0.6, 0.8, 0.0]] * 2), atol=1e-15)
    for wrong in ([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0], [np.nan, 0.0, 1.0]]):
        with pytest.raises(ValueError, match=r"directions: expected directions, found .* at \[1\]"):
            specula.harmonics(2, wrong)
    with pytest.raises(ValueError, match=r"\[\.\.\., 3\], found the shape \[2\]"):
        specula.harmonics(2, [1.0, 2.0])


def _lighting(reference: Path) -> Any:
    return json.loads((reference / "lighting.json").read_bytes())


def _radiance(lighting: Any, w: Array) -> Array:
    value = np.full(w.shape, lighting["constant"])
    for lobe in lighting["lobes"]:
        falloff = np.exp(lobe["sharpness"] * (w @ np.array(lobe["direction"]) - 1.0))
        value = value + falloff[..., None] * np.array(lobe["amplitude"])
    return value


def test_a_series_is_the_reference_light(tmp_path: Path, reference: Path, build: Build) -> None:
    lighting = _lighting(reference)
    write_pfm(tmp_path / "light.pfm", _radiance(lighting, brute_force.directions(256, 512)))
    manifest = LIGHT.format(picture="light.pfm", rows=256, degree=12, format="safetensors")
    sh = specula.read_sh(build(tmp_path, manifest) / "light.safetensors")
    # Pixels are 0.7 degrees wide, and a cut at degree 12 is exact in the coefficients.
    np.testing.assert_allclose(sh.coefficients, lighting["sh"], atol=2e-4)
    w = brute_force.some_directions(200, 3).reshape(10, 20, 3)
    expected = brute_force.harmonics(12, w) @ np.array(lighting["sh"])
    assert specula.evaluate(sh, w).shape == (10, 20, 3)
    np.testing.assert_allclose(specula.evaluate(sh, w), expected, atol=2e-3)


def _picture(file: Path) -> Array:
    """The colours of an OpenEXR file, by another reader."""
    import OpenEXR  # type: ignore[import-not-found, unused-ignore]

    with OpenEXR.File(str(file)) as picture:
        return np.asarray(picture.channels()["RGB"].pixels, dtype=np.float64)


MATERIALS: dict[str, tuple[str, Callable[[Array, Array, Array], Array]]] = {
    "matte": ('model = "lambert"\nalbedo = 1\n', brute_force.lambert),
    "glossy": ('model = "phong"\nexponent = 12\n', lambda i, n, v: brute_force.phong(12.0, i, n, v)),
    "rough": ('model = "microfacet"\nsigma = 0.5\n', lambda i, n, v: brute_force.microfacet(0.5, i, n, v)),
}

MAPS = [
    ("local_cube", "cube", "local", 48),
    ("local_image", "lat-long", "local", 48),
    ("global_cube", "cube", "global", 48),
    ("global_image", "lat-long", "global", 48),
]


def test_light_and_maps_of_a_photograph_are_brute_force(tmp_path: Path, corpus: Path, build: Build) -> None:
    photograph = corpus / "env/cc0/apartment.hdr"
    (tmp_path / "apartment.hdr").write_bytes(photograph.read_bytes())
    for name, (text, _) in MATERIALS.items():
        (materials(tmp_path) / f"{name}.toml").write_text(text)
    manifest = LIGHT.format(picture="apartment.hdr", rows=64, degree=24, format="json")
    manifest += REFLECTED.format(degree=24, p=10)
    for name, layout, view, resolution in MAPS:
        manifest += SHRM.format(name=name, layout=layout, view=view, resolution=resolution)
    out = build(tmp_path, manifest)
    picture = _picture(out / "picture.exr")
    height, width, _ = picture.shape
    assert (height, width) == (64, 128)
    light = picture * solid(height, width)
    w = brute_force.directions(height, width)

    # A pixel is as small as a sixth of the last harmonic's wave.
    sh = specula.read_sh(out / "light.json")
    low = specula.Sh(sh.coefficients[:36], sh.lights, sh.metadata)
    projected = np.einsum("hwr,hwc->rc", brute_force.harmonics(5, w), light)
    error = np.abs(low.coefficients - projected).max() / np.abs(projected).max()
    assert error < 3e-3, error
    some = brute_force.some_directions(50, 5)
    expected = brute_force.harmonics(5, some) @ low.coefficients
    np.testing.assert_allclose(specula.evaluate(low, some), expected, atol=1e-12)

    normals, views = brute_force.some_directions(300, 6), brute_force.some_directions(300, 7)
    facing = (normals * views).sum(axis=1) > 0.15
    normals, views = normals[facing], views[facing]
    assert len(normals) > 100
    for name, (_, rho_hat) in MATERIALS.items():
        exact = np.stack(
            [np.einsum("hw,hwc->c", rho_hat(w, n, v), light) for n, v in zip(normals, views, strict=True)]
        )
        scale = np.sqrt((exact**2).mean())
        for kind, _, _, _ in MAPS:
            shrm = specula.read_shrm(out / name / f"{kind}.safetensors")
            error = np.sqrt(((specula.evaluate(shrm, normals, views) - exact) ** 2).mean()) / scale
            assert error < 0.006, f"{name}, {kind}: {error}"


def materials(folder: Path) -> Path:
    """The folder of a project's materials."""
    (folder / "materials").mkdir(exist_ok=True)
    return folder / "materials"


def solid(height: int, width: int) -> Array:
    """Solid angles beside colours."""
    return brute_force.solid_angles(height, width)[..., None]


@pytest.mark.parametrize("file", ["lambert-0", "phong-1", "microfacet-3", "kajiya-kay-4"])
def test_maps_have_the_reference_radiance(tmp_path: Path, reference: Path, build: Build, file: str) -> None:
    case = json.loads((reference / f"{file}.json").read_bytes())
    write_pfm(tmp_path / "light.pfm", _radiance(_lighting(reference), brute_force.directions(128, 256)))
    numbers = "".join(f"{key} = {value}\n" for key, value in case["parameters"].items())
    (materials(tmp_path) / "it.toml").write_text(f'model = "{case["model"]}"\n{numbers}')
    manifest = LIGHT.format(picture="light.pfm", rows=128, degree=24, format="safetensors")
    manifest += REFLECTED.format(degree=24, p=12)
    for name, layout, view, _ in MAPS[:2]:
        manifest += SHRM.format(name=name, layout=layout, view=view, resolution=64)
    out = build(tmp_path, manifest)
    rows = case["rows"]
    central, seen, radiance = (
        np.array([row[key] for row in rows]) for key in ("central", "view", "radiance")
    )
    for name, _, _, _ in MAPS[:2]:
        shrm = specula.read_shrm(out / "it" / f"{name}.safetensors")
        reflects = case["model"] in ("phong", "microfacet")
        assert shrm.centre == ("reflection" if reflects else "tangent" if "kajiya" in file else "normal")
        # A map is looked up by the reflection vector, which has the normal half way to the view.
        values = specula.evaluate(shrm, brute_force.unit(central + seen) if reflects else central, seen)
        error = np.abs(values - radiance).max() / np.sqrt((radiance**2).mean())
        assert error < 0.005, f"{name}: {error}"


def test_a_texel_is_the_sum_of_its_coefficients_and_look_ups_have_no_seams() -> None:
    random = np.random.default_rng(8)
    grids = [("cube", (6, 5, 5)), ("lat-long", (1, 7, 14)), ("lat-long", (1, 6, 9)), ("cube", (6, 1, 1))]
    for layout, (faces, height, width) in grids:
        for frame in ("local", "global"):
            values = random.normal(size=(faces, height, width, 9, 3)).astype(np.float32)
            shrm = specula.Shrm(values, layout, frame, "normal", np.zeros((0, 7)), {})
            seen = brute_force.some_directions(1, 9)[0]
            # At texels, the direct sum of equation 7.
            image = brute_force.directions(height, width)[None]
            w = image if layout == "lat-long" else brute_force.cube_directions(width) + 0.0
            flat = w.reshape(-1, 3)
            local = np.stack([_in_frame(z, seen) for z in flat]).reshape(w.shape)
            basis = brute_force.harmonics(2, local if frame == "local" else np.broadcast_to(seen, w.shape))
            expected = np.einsum("fhwr,fhwrc->fhwc", basis, values)
            np.testing.assert_allclose(specula.evaluate(shrm, w, seen), expected, atol=1e-5)
            # Steps over seams, edges and corners, and over rows beside a pole, are as small as all others.
            t = np.linspace(0.0, 2.0 * np.pi, 40_001)
            for axes in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
                circle = np.stack([np.cos(t), np.sin(t), 0.3 * np.sin(3.0 * t) + 0.1], axis=1)[:, axes]
                steps = np.abs(np.diff(specula.evaluate(shrm, circle, seen), axis=0)).max()
                assert steps < 0.03, (layout, frame, axes, steps)
            # Across a pole.
            if layout == "lat-long":
                beside = np.stack([1e-7 * np.cos(t[::997]), 1e-7 * np.sin(t[::997]), np.ones(41)], axis=1)
                for pole in ([1.0, 1.0, 1.0], [1.0, 1.0, -1.0]):
                    there, here = (
                        specula.evaluate(shrm, beside * pole * [s, s, 1.0], seen) for s in (1.0, -1.0)
                    )
                    np.testing.assert_allclose(there, here, atol=1e-5)
            # The weights sum to 1 everywhere, at corners too.
            values = np.ones((faces, height, width, 1, 3), np.float32)
            plain = specula.Shrm(values, layout, frame, "normal", np.zeros((0, 7)), {})
            w = brute_force.some_directions(2000, 12)
            np.testing.assert_allclose(specula.evaluate(plain, w, seen), np.sqrt(0.25 / np.pi), rtol=1e-12)


def _in_frame(z: Array, view: Array) -> Array:
    """The view in the frame R_z(phi) R_y(theta) of a direction."""
    theta, phi = np.arccos(z[2]), np.arctan2(z[1], z[0])
    about_y = np.array([[np.cos(theta), 0, np.sin(theta)], [0, 1, 0], [-np.sin(theta), 0, np.cos(theta)]])
    about_z = np.array([[np.cos(phi), -np.sin(phi), 0], [np.sin(phi), np.cos(phi), 0], [0, 0, 1]])
    result: Array = (about_z @ about_y).T @ view
    return result


def test_tables_have_the_reference_coefficients(tmp_path: Path, reference: Path, build: Build) -> None:
    cases = json.loads((reference / "prt-tables.json").read_bytes())["cases"]
    for case in cases:
        lines = [f'model = "{case["model"]}"']
        parameters = dict(case["parameters"])
        for key in ("roughness", "exponent"):
            if f"{key}_x" in parameters:
                parameters.pop(key, None)
        lines += [f"{key} = {value}" for key, value in parameters.items()]
        (materials(tmp_path) / f"{case['model']}.toml").write_text("\n".join(lines) + "\n")
    manifest = """
[stage.material]
kind = "import-material"
source = "materials/*.toml"
[stage.table]
kind = "tabulate-brdf"
input = "material"
[stage.file]
kind = "export-brdf-table"
input = "table"
path = "{material}"
"""
    out = build(tmp_path, manifest)
    for case in cases:
        table = specula.read_table(out / f"{case['model']}.safetensors")
        assert (table.degree, table.coefficients.shape[:3]) == (4, (1, 128, 128))
        views = np.array([texel["direction"] for texel in case["texels"]])
        c = np.array([texel["c"] for texel in case["texels"]])
        values = specula.evaluate(table, views)
        assert values.shape == (len(views), 25, table.coefficients.shape[4])
        np.testing.assert_allclose(values[..., 0], c, atol=2e-6 * np.abs(c).max())
        # At an angle: the series of the coefficients, seen from a view and lit from a direction.
        incident = brute_force.some_directions(len(views), 10)
        series = (brute_force.harmonics(4, incident) * c).sum(axis=1)
        np.testing.assert_allclose(specula.evaluate(table, views, incident)[..., 0], series, atol=1e-5)
        assert table.below == ("mirrored" if case["model"] == "kajiya-kay" else "clamped")


def test_tables_are_blended_between_texels_and_materials() -> None:
    def of(z: Array) -> Array:
        return np.stack([1.0 + z[..., 0], 2.0 * z[..., 1] - z[..., 2]], axis=-1)

    size = 64
    column, row = np.meshgrid(
        (np.arange(size) + 0.5) / size * 2.0 - 1.0, 1.0 - (np.arange(size) + 0.5) / size * 2.0
    )
    square = column**2 + row**2
    view = np.stack([2.0 * column, 2.0 * row, 1.0 - square], axis=-1) / (1.0 + square)[..., None]
    values = np.zeros((3, size, size, 4, 1), np.float32)
    for material in range(3):
        values[material, :, :, :2, 0] = (material + 1) * of(view)
    table = specula.BrdfTable(values, "clamped", "hemisphere", {})
    views = brute_force.some_directions(200, 11)
    views = views[views[:, 2] > 0.2]
    for blend, factor in ((0.0, 1.0), (0.25, 1.5), (0.5, 2.0), (1.0, 3.0)):
        # The largest second derivative of these functions over a texel is 2e-3.
        result = specula.evaluate(table, views, blend=blend)[:, :2, 0]
        np.testing.assert_allclose(result, factor * of(views), atol=factor * 2e-3)
    below = np.array([[0.6, 0.8, -0.5], [-1.0, 0.0, -2.0], [0.0, 0.0, -1.0]])
    rim = np.array([[0.6, 0.8, 1e-12], [-1.0, 0.0, 1e-12]])
    np.testing.assert_allclose(specula.evaluate(table, below)[:2], specula.evaluate(table, rim), atol=1e-6)
    assert np.isfinite(specula.evaluate(table, below)).all()
    mirrored = specula.BrdfTable(values, "mirrored", "sphere", {})
    up = below * [1.0, 1.0, -1.0]
    np.testing.assert_array_equal(specula.evaluate(mirrored, below), specula.evaluate(mirrored, up))
    with pytest.raises(ValueError, match="blend"):
        specula.evaluate(table, views, blend=1.5)
