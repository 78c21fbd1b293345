"""Integrals over pictures, written down as plainly as possible and without the package."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import sph_harm_y

Array = NDArray[np.float64]


def directions(height: int, width: int) -> Array:
    """The directions of a lat-long picture's pixels, by CONVENTIONS.md."""
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = 2.0 * np.pi * (0.5 - (np.arange(width) + 0.5) / width)
    theta, phi = np.meshgrid(theta, phi, indexing="ij")
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def solid_angles(height: int, width: int) -> Array:
    """Their solid angles, [height, 1]."""
    borders = np.cos(np.pi * np.arange(height + 1) / height)
    return ((borders[:-1] - borders[1:]) * 2.0 * np.pi / width)[:, None]


def cube_directions(edge: int) -> Array:
    """The directions of a cube's texels, [6, edge, edge, 3]: CONVENTIONS.md and the table of KTX2."""
    t, s = np.meshgrid(*[2.0 * (np.arange(edge) + 0.5) / edge - 1.0] * 2, indexing="ij")
    one = np.ones_like(s)
    faces = [(one, -t, -s), (-one, -t, s), (s, one, t), (s, -one, -t), (s, -t, one), (-s, -t, -one)]
    return unit(np.stack([np.stack([z, -x, y], axis=-1) for x, y, z in faces]))


def harmonics(degree: int, w: Array) -> Array:
    """Real orthonormal harmonics without the Condon-Shortley phase, from SciPy's complex ones with it."""
    theta, phi = np.arccos(np.clip(w[..., 2], -1.0, 1.0)), np.arctan2(w[..., 1], w[..., 0])
    rows = []
    for l in range(degree + 1):
        for m in range(-l, l + 1):
            y = (-1) ** m * sph_harm_y(l, abs(m), theta, phi)
            rows.append(y.real if m == 0 else np.sqrt(2.0) * (y.real if m > 0 else y.imag))
    return np.stack(rows, axis=-1)


def unit(vectors: Array) -> Array:
    """Vectors of length 1."""
    result: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result


def some_directions(count: int, seed: int) -> Array:
    """Directions anywhere."""
    return unit(np.random.default_rng(seed).normal(size=(count, 3)))


def lambert(incident: Array, normal: Array, view: Array) -> Array:
    """The BRDF times the cosine, of albedo 1."""
    return np.maximum(incident @ normal, 0.0) / np.pi


def phong(exponent: float, incident: Array, normal: Array, view: Array) -> Array:
    """Not cut at the horizon."""
    mirrored = 2.0 * (normal @ view) * normal - view
    return (exponent + 1.0) / (2.0 * np.pi) * np.maximum(incident @ mirrored, 0.0) ** exponent


def microfacet(sigma: float, incident: Array, normal: Array, view: Array) -> Array:
    """Ramamoorthi and Hanrahan 2002, equation 11."""
    half = incident + view
    cosine = np.clip(half @ normal / np.maximum(np.linalg.norm(half, axis=-1), 1e-300), -1.0, 1.0)
    lobe = np.exp(-((np.arccos(cosine) / sigma) ** 2)) / (4.0 * np.pi * sigma**2)
    return np.where(incident @ normal > 0.0, lobe, 0.0)
