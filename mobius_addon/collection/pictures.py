"""Small pictures of surfaces, and the files that hold them, without any library of pictures."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np

from ...solver.surface.barycentric import interpolated
from ...solver.surface.mesh import Floats, Integers

SIDE = 132
"""Pixels of a picture's side."""

FINER = 3
"""Points in each direction that a pixel is the mean of."""

DENSE = 4.0
"""Points of the surface per finer pixel that it may cover: so many leave hardly a hole."""

_LIGHT = np.array([0.35, 0.45, 0.82])


def view(points: Floats, weights: Floats) -> Floats:
    """Return the rotation, (3, 3), that shows points, (n, 3), broadly: rows are right, up and towards the eye."""
    centred = points - weights @ points / weights.sum()
    _, _, axes = np.linalg.svd((weights[:, None] * centred).T @ centred)
    if np.linalg.det(axes) < 0:
        axes[0] *= -1
    return axes


def thumbnail(vertices: Floats, faces: Integers, colors: Floats, axes: Floats, *, turned: bool = False) -> Floats:
    """Return a picture of a surface, (SIDE, SIDE, 4), red, green, blue and opacity in [0, 1].

    The surface is covered with points, of which each finer pixel shows the one nearest to the eye.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    colors : (n, 3) float64
        In [0, 1].
    axes : (3, 3) float64
        See `view`.
    turned : bool
        Whether the faces are clockwise from outside.
    """
    seen = (vertices - vertices.mean(axis=0)) @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    pixels = SIDE * FINER
    scale = 0.94 * pixels / max(float((high - low)[:2].max()), 1e-300)
    seen = (seen - (low + high) / 2) * scale
    corners = seen[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * (-1 if turned else 1)
    areas = np.linalg.norm(normal, axis=1) / 2
    # smooth shading: normals at vertices, as means
    smooth = np.stack([np.bincount(faces.ravel(), np.repeat(normal[:, k], 3), len(vertices)) for k in range(3)], axis=1)
    smooth /= np.maximum(np.linalg.norm(smooth, axis=1), 1e-300)[:, None]
    rng = np.random.default_rng(0)
    numbers = rng.poisson(DENSE * areas)
    face = np.repeat(np.arange(len(faces)), numbers)
    weights = rng.dirichlet(np.ones(3), len(face))
    point = interpolated(seen, faces[face], weights)
    shade = interpolated(smooth, faces[face], weights) @ _LIGHT
    tint = interpolated(colors, faces[face], weights) * (0.35 + 0.65 * np.clip(shade, 0, 1))[:, None]
    column = np.clip((point[:, 0] + pixels / 2).astype(int), 0, pixels - 1)
    row = np.clip((pixels / 2 - point[:, 1]).astype(int), 0, pixels - 1)
    order = np.argsort(point[:, 2], kind="stable")  # the nearest is written last
    fine = np.zeros((pixels, pixels, 4))
    fine[row[order], column[order], :3] = tint[order]
    fine[row[order], column[order], 3] = 1
    sums = fine.reshape(SIDE, FINER, SIDE, FINER, 4).sum(axis=(1, 3))
    return np.concatenate([sums[..., :3] / np.maximum(sums[..., 3:], 1), sums[..., 3:] / FINER**2], axis=2)


def png(picture: Floats) -> bytes:
    """Return a picture, (h, w, 4) in [0, 1], as a PNG file."""
    data = (np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8)
    height, width = data.shape[:2]
    rows = np.concatenate([np.zeros((height, 1), np.uint8), data.reshape(height, -1)], axis=1)  # filter 0 of each row

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    parts = [chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)), chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def inline(picture: Floats) -> str:
    """Return a picture as an address that holds it."""
    return "data:image/png;base64," + base64.b64encode(png(picture)).decode("ascii")
