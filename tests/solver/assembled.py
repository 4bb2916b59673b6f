"""Meshes of several parts: a sheet with things beside it."""

import numpy as np
from scipy.spatial.transform import Rotation

from solver import TriangleMesh


def assembled(*parts: TriangleMesh, name: str = "whole") -> TriangleMesh:
    """One mesh of several, their vertices and faces one after the other."""
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, first, strict=False)]
    return TriangleMesh(np.concatenate([part.vertices for part in parts]), np.concatenate(faces), name)


def ball(centre: tuple[float, float, float], size: float, rings: int = 6) -> TriangleMesh:
    """A closed ball, its poles in the direction of z, with `rings` rings of as many times two vertices."""
    around = 2 * rings
    polar, turn = np.meshgrid(
        np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(around) / around, indexing="ij"
    )
    points = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    at = np.arange((rings - 1) * around).reshape(rings - 1, around)
    after = np.roll(at, -1, axis=1)
    quads = np.stack([at[:-1], at[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    north, south = at.size, at.size + 1
    faces = [
        *quads[:, [0, 1, 2]],
        *quads[:, [0, 2, 3]],
        *np.stack([np.full(around, north), at[0], after[0]], axis=1),
        *np.stack([np.full(around, south), after[-1], at[-1]], axis=1),
    ]
    vertices = np.concatenate([points.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    return TriangleMesh(size * vertices + centre, np.array(faces))


def card(
    centre: tuple[float, float, float], size: tuple[float, float], turn: float = 0.0, cells: int = 4
) -> TriangleMesh:
    """A card that stands on a sheet: `size` wide and high, turned about z."""
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, cells + 1), np.linspace(-0.5, 0.5, cells + 1))
    flat = np.stack([size[0] * x, 0.1 * size[0] * x**2, size[1] * z], axis=-1).reshape(-1, 3)
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    faces = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return TriangleMesh(Rotation.from_euler("z", turn).apply(flat) + centre, faces)
