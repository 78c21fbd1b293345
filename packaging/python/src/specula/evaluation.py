"""Values of what stages write, for any direction."""

from __future__ import annotations

from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .files import BrdfTable, Sh, Shrm

__all__ = ["evaluate", "harmonics"]

#: Harmonics and texels are computed for so many numbers at a time.
_BLOCK = 1 << 22

Array = NDArray[np.float64]


def harmonics(degree: int, directions: ArrayLike) -> Array:
    """The real orthonormal harmonics without the Condon-Shortley phase: [..., (degree + 1)^2], in row order
    l*l + l + m, for directions [..., 3], which may have any length."""
    x, y, z = np.moveaxis(_unit("directions", directions), -1, 0)
    sine = np.hypot(x, y)
    azimuth = np.where(sine > 0.0, x, 1.0) + 1j * y
    azimuth /= np.abs(azimuth)
    # sin^m(theta) e^(i m phi) times the constants of P_mm, by m.
    sectoral = np.empty((degree + 1, *z.shape), dtype=np.complex128)
    sectoral[0] = np.sqrt(0.25 / np.pi)
    for m in range(1, degree + 1):
        constant = np.sqrt((2 * m + 1) / (2 * m) * (2 if m == 1 else 1))
        sectoral[m] = constant * sine * azimuth * sectoral[m - 1]
    rows = np.zeros(((degree + 1) ** 2, *z.shape))
    before, last = np.zeros_like(sectoral), np.zeros_like(sectoral)
    for l in range(degree + 1):
        # P_lm = a (z P_(l-1)m - b P_(l-2)m), of which P_mm is the start.
        squares = np.arange(l, dtype=np.float64).reshape(-1, *[1] * z.ndim) ** 2
        a = np.sqrt((4 * l * l - 1) / (l * l - squares))
        b = np.sqrt(((l - 1) ** 2 - squares) / (4 * (l - 1) ** 2 - 1)) if l > 1 else 0.0 * squares
        before[:l] = a * (z * last[:l] - b * before[:l])
        before[l] = sectoral[l]
        before, last = last, before
        rows[l * l + l : (l + 1) ** 2] = last[: l + 1].real
        rows[l * l : l * l + l] = last[l:0:-1].imag
    return np.moveaxis(rows, 0, -1)


@overload
def evaluate(of: Sh, directions: ArrayLike, /) -> Array: ...
@overload
def evaluate(of: Shrm, normal: ArrayLike, view: ArrayLike, /) -> Array: ...
@overload
def evaluate(
    of: BrdfTable, view: ArrayLike, incident: ArrayLike | None = None, /, *, blend: float = 0.0
) -> Array: ...
def evaluate(
    of: Sh | Shrm | BrdfTable, first: ArrayLike, second: ArrayLike | None = None, /, *, blend: float = 0.0
) -> Array:
    """The value of what a file holds.

    - `evaluate(sh, directions)`: the radiance from directions [..., 3], without `sh.lights`: [..., 3].
    - `evaluate(shrm, normal, view)`: the radiance that a surface reflects toward the viewer, without
      `shrm.lights`: [..., 3]. If `shrm.centre` is `tangent`, give the tangent instead of the normal. Texels
      are blended as the shader of `specula inspect FILE --shader` does; each is Ramamoorthi and Hanrahan's
      B(C, V), the sum of b_pq(C) Y_pq, which may be negative where the light is low.
    - `evaluate(table, view)`: the coefficients c_i of the material for a view in the frame of the surface, in
      which x is the tangent and z the normal: [..., (degree + 1)^2, channels]. With `incident` it is the BRDF
      times the cosine of the incident angle, as far as the coefficients hold it: [..., channels]. `blend`
      chooses between the materials of the table, from 0, the first, to 1, the last.

    Directions point away from the surface, in the frame of CONVENTIONS.md, and may have any length.
    """
    if isinstance(of, Sh):
        return _expansion(of, _unit("directions", first))
    if second is not None or isinstance(of, Shrm):
        names = ("normal", "view") if isinstance(of, Shrm) else ("view", "incident")
        a, b = np.broadcast_arrays(_unit(names[0], first), _unit(names[1], second))
        if isinstance(of, Shrm):
            return _reflected(of, a, b)
        value: Array = np.einsum("...rc,...r->...c", _table(of, a, blend), harmonics(of.degree, b))
        return value
    return _table(of, _unit("view", first), blend)


def _unit(name: str, directions: ArrayLike | None) -> Array:
    """Directions of length 1."""
    vectors = np.asarray(directions, dtype=np.float64)
    if vectors.ndim == 0 or vectors.shape[-1] != 3:
        raise ValueError(f"{name}: expected directions [..., 3], found the shape {list(vectors.shape)}")
    # Twice, because the square of a tiny or a huge number is none.
    largest = np.abs(vectors).max(axis=-1, keepdims=True, initial=0.0)
    wrong = ~((largest > 0.0) & np.isfinite(largest))[..., 0]
    if wrong.any():
        place = np.unravel_index(int(wrong.argmax()), wrong.shape)
        raise ValueError(
            f"{name}: expected directions, found {vectors[place]} at {[int(index) for index in place]}"
        )
    vectors = vectors / largest
    unit: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def _blocks(count: int, numbers: int) -> list[slice]:
    """The parts of `count` places with `numbers` numbers each."""
    step = max(1, _BLOCK // numbers)
    return [slice(start, start + step) for start in range(0, count, step)]


def _expansion(sh: Sh, directions: Array) -> Array:
    flat = directions.reshape(-1, 3)
    values = np.empty((len(flat), 3))
    for block in _blocks(len(flat), len(sh.coefficients)):
        values[block] = harmonics(sh.degree, flat[block]) @ sh.coefficients
    return values.reshape(directions.shape)


def _reflected(shrm: Shrm, normal: Array, view: Array) -> Array:
    shape = normal.shape
    normal, view = normal.reshape(-1, 3), view.reshape(-1, 3)
    central = normal
    if shrm.centre == "reflection":
        central = 2.0 * (normal * view).sum(axis=1, keepdims=True) * normal - view
    _, height, width, rows, _ = shrm.coefficients.shape
    texels = shrm.coefficients.reshape(-1, rows, 3)
    values = np.zeros((len(central), 3))
    for block in _blocks(len(central), 4 * rows):
        if shrm.layout == "cube":
            index, weight = _cube_taps(width, central[block])
        else:
            index, weight = _lat_long_taps(height, width, central[block])
        for k in range(4):
            seen = view[block]
            if shrm.view == "local":
                of_cube = shrm.layout == "cube"
                at = _cube_texel(width, index[k]) if of_cube else _lat_long_texel(height, width, index[k])
                seen = _into_frame(at, seen)
            colours = np.einsum("nr,nrc->nc", harmonics(shrm.degree, seen), texels[index[k]])
            values[block] += weight[k][:, None] * colours
    return values.reshape(shape)


def _into_frame(central: Array, view: Array) -> Array:
    """R^-1 V, R = R_z(phi) R_y(theta) of the central direction; at a pole phi is 0."""
    sine = np.hypot(central[:, 0], central[:, 1])
    safe = np.where(sine > 0.0, sine, 1.0)
    x, y = np.where(sine > 0.0, central[:, 0] / safe, 1.0), central[:, 1] / safe
    south = np.stack([central[:, 2] * x, central[:, 2] * y, -sine], axis=1)
    east = np.stack([-y, x, np.zeros_like(x)], axis=1)
    return np.stack([(axis * view).sum(axis=1) for axis in (south, east, central)], axis=1)


_Taps = tuple[NDArray[np.intp], Array]


def _lat_long_taps(height: int, width: int, directions: Array) -> _Taps:
    """The four texels about each direction, [4, n], and their weights. Over a pole lies the first row, half
    a turn on."""
    x, y, z = directions.T
    column = (0.5 - np.arctan2(y, x) / (2.0 * np.pi)) * width - 0.5
    row = np.arctan2(np.hypot(x, y), z) / np.pi * height - 0.5
    top = np.floor(row).astype(np.intp)
    index, weight = [], []
    for down in (0, 1):
        at = top + down
        past = (at < 0) | (at >= height)
        turned = np.where(past, column + 0.5 * width, column)
        left = np.floor(turned).astype(np.intp)
        share = 1.0 - np.abs(row - at)
        for right in (0, 1):
            index.append(np.clip(at, 0, height - 1) * width + (left + right) % width)
            weight.append(share * (1.0 - np.abs(turned - (left + right))))
    return np.stack(index), np.stack(weight)


def _lat_long_texel(height: int, width: int, index: NDArray[np.intp]) -> Array:
    """The directions of texels."""
    theta = np.pi * (index // width + 0.5) / height
    phi = 2.0 * np.pi * (0.5 - (index % width + 0.5) / width)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)


#: The axes of the faces +X -X +Y -Y +Z -Z in cube coordinates: to the right, downward, and to the face.
_FACES = np.array(
    [
        [[0, 0, -1], [0, -1, 0], [1, 0, 0]],
        [[0, 0, 1], [0, -1, 0], [-1, 0, 0]],
        [[1, 0, 0], [0, 0, 1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, -1], [0, -1, 0]],
        [[1, 0, 0], [0, -1, 0], [0, 0, 1]],
        [[-1, 0, 0], [0, -1, 0], [0, 0, -1]],
    ],
    dtype=np.float64,
)


def _cube_place(cube: Array) -> tuple[NDArray[np.intp], Array]:
    """The face on which each direction in cube coordinates falls, and its place there, [n, 2] from 0 to 1."""
    axis = np.argmax(np.abs(cube), axis=1)
    face: NDArray[np.intp] = 2 * axis + (np.take_along_axis(cube, axis[:, None], 1)[:, 0] <= 0.0)
    right, down, ahead = np.moveaxis(np.einsum("nij,nj->ni", _FACES[face], cube), 1, 0)
    return face, 0.5 + 0.5 * np.stack([right, down], axis=1) / ahead[:, None]


def _cube_taps(edge: int, directions: Array) -> _Taps:
    """The four texels about each direction, [4, n], and their weights. Over an edge lies the texel beside it
    on the next face, at a corner the mean of the other three."""
    x, y, z = directions.T
    face, place = _cube_place(np.stack([-y, z, x], axis=1))
    at = place * edge - 0.5
    first = np.floor(at).astype(np.intp)
    index, weight, missing = [], [], []
    for step in ([0, 0], [1, 0], [0, 1], [1, 1]):
        texel = first + step
        past: NDArray[np.bool_] = (texel < 0) | (texel >= edge)
        # Places along an edge are the same on both faces: a tiny step past it finds the neighbour.
        beside = np.clip((texel + 0.5) / edge, -1e-9, 1.0 + 1e-9)
        axes = _FACES[face]
        onto = axes[:, 2] + np.einsum("nk,nkj->nj", 2.0 * beside - 1.0, axes[:, :2])
        there, moved = _cube_place(onto)
        column, row = np.clip((moved * edge).astype(np.intp), 0, edge - 1).T
        index.append((there * edge + row) * edge + column)
        weight.append((1.0 - np.abs(at - texel)).prod(axis=1))
        missing.append(past.all(axis=1))
    weights, lost = np.stack(weight), np.stack(missing)
    share = np.where(lost, weights, 0.0).sum(axis=0) / 3.0
    return np.stack(index), np.where(lost, 0.0, weights + share)


def _cube_texel(edge: int, index: NDArray[np.intp]) -> Array:
    """The directions of texels."""
    axes = _FACES[index // (edge * edge)]
    place = np.stack([index % edge, index // edge % edge], axis=1)
    cube = axes[:, 2] + np.einsum("nk,nkj->nj", 2.0 * (place + 0.5) / edge - 1.0, axes[:, :2])
    cube /= np.linalg.norm(cube, axis=1, keepdims=True)
    return np.stack([cube[:, 2], -cube[:, 0], cube[:, 1]], axis=1)


def _table(table: BrdfTable, view: Array, blend: float) -> Array:
    """The coefficients for each view, interpolated between texels and between materials."""
    count, size, _, rows, channels = table.coefficients.shape
    if not 0.0 <= blend <= 1.0:
        raise ValueError(f"blend: expected a number from 0 to 1, found {blend}")
    flat = view.reshape(-1, 3)
    height = np.abs(flat[:, 2]) if table.below == "mirrored" else np.maximum(flat[:, 2], 0.0)
    across = np.where(
        height > 0.0, 1.0 + height, np.maximum(np.hypot(flat[:, 0], flat[:, 1]), np.finfo(np.float64).tiny)
    )
    place = np.clip((flat[:, :2] * [1.0, -1.0] / across[:, None] + 1.0) * 0.5 * size - 0.5, 0.0, size - 1.0)
    first = np.minimum(place.astype(np.intp), max(size - 2, 0))
    part = place - first
    low = min(int(blend * (count - 1)), max(count - 2, 0))
    values = np.zeros((len(flat), rows, channels))
    for material, share in ((low, 1.0 - (blend * (count - 1) - low)), (low + 1, blend * (count - 1) - low)):
        if share == 0.0:
            continue
        texels = table.coefficients[material]
        for x, y in ((0, 0), (1, 0), (0, 1), (1, 1)):
            weight = np.abs(1 - x - part[:, 0]) * np.abs(1 - y - part[:, 1]) * share
            column, row = np.minimum(first[:, 0] + x, size - 1), np.minimum(first[:, 1] + y, size - 1)
            values += weight[:, None, None] * texels[row, column]
    return values.reshape(*view.shape[:-1], rows, channels)
