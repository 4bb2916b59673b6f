"""How right what arrived on a target is, as a whole and part by part."""

from dataclasses import dataclass

import numpy as np

from solver import Correspondence
from solver.surface.barycentric import interpolated, weighted

from .people import Head
from .scenes import Arrived, groups_of
from .targets import Target

WEIGHT = 0.1
"""Difference up to which a weight is right."""

UV = 0.02
"""Distance in the UV square up to which a corner is right."""

MOVING = 0.05
"""Share of the largest displacement of a key from which on a part is moved by it."""


@dataclass(frozen=True)
class Score:
    """Figures of one part, or of several.

    Attributes
    ----------
    error : float
        Mean distance from the truth, in % of the source's diagonal; nan without a truth.
    weights, uv, material : float
        Shares of vertices, corners and triangles that have what they should have.
    keys : float
        Median over the shape keys that move it, of the relative error of their displacements.
    """

    error: float
    weights: float
    uv: float
    material: float
    keys: float


def errors(head: Head, target: Target, found: Correspondence) -> np.ndarray:
    """Return each vertex's distance from where it belongs, (n,), in % of the source's diagonal; nan: no counterpart."""
    apart = np.linalg.norm(found.matrix() @ head.vertices - truth(head, target), axis=1)
    own = (found.face >= 0) & ~riding(found)
    return np.where(own, 100 * apart / head.mesh.diagonal, np.nan)


def truth(head: Head, target: Target) -> np.ndarray:
    """Return where each vertex belongs on the source, (n, 3)."""
    return carried(head, target, head.vertices)


def carried(head: Head, target: Target, values: np.ndarray) -> np.ndarray:
    """Return values of the source's vertices, (n_source, ...), where the target's vertices belong."""
    return interpolated(values, head.mesh.faces[target.face], target.barycentric)


def riding(found: Correspondence) -> np.ndarray:
    """Which vertices only ride along, (n,)."""
    return np.zeros(len(found.face), bool) if found.leader is None else found.leader >= 0


def scores(head: Head, target: Target, error: np.ndarray, there: Arrived) -> list[Score]:
    """Return the score of each part, the skin first."""
    wanted = np.stack([carried(head, target, weights) for weights in groups_of(head).values()], axis=1)
    nothing = np.zeros(len(target.part))
    got = np.stack([there.groups.get(name, nothing) for name in groups_of(head)], axis=1)
    weights = np.abs(wanted - got).max(axis=1) < WEIGHT
    uv = _right_corners(head, target, there)
    part_of_face = target.part[target.mesh.faces[:, 0]]
    material = np.array(there.material) == [f"part {k}" for k in part_of_face]
    keys = _key_errors(head, target, there)
    rows = []
    for part in range(int(head.part.max()) + 1):
        own, faces = target.part == part, part_of_face == part
        moved = keys[:, part][np.isfinite(keys[:, part])] if len(keys) else np.empty(0)
        rows.append(
            Score(
                float(np.nanmean(error[own])) if np.isfinite(error[own]).any() else np.nan,
                float(weights[own].mean()),
                float(uv[faces].mean()),
                float(material[faces].mean()),
                float(np.median(moved)) if len(moved) else np.nan,
            )
        )
    return rows


def _right_corners(head: Head, target: Target, there: Arrived) -> np.ndarray:
    """Return which corners of the target's triangles, (m, 3), have a UV that the source has at that place.

    On a seam that is either side's: the UV of any polygon around the vertices of the triangle that it belongs in.
    """
    at = head.uv[head.triangle_corners]
    own = weighted(at[target.face], target.barycentric)
    apart = np.linalg.norm(there.uv - own[target.mesh.faces], axis=2)
    right = apart < UV
    # beside seams: the other values at the nearest of the three vertices
    vertex = head.mesh.faces[target.face, target.barycentric.argmax(axis=1)]
    order = np.argsort(head.corner, kind="stable")
    start = np.searchsorted(head.corner[order], np.arange(len(head.vertices) + 1))
    for face, corner in np.argwhere(~right):
        nearest = vertex[target.mesh.faces[face, corner]]
        values = head.uv[order[start[nearest] : start[nearest + 1]]]
        right[face, corner] = np.linalg.norm(values - there.uv[face, corner], axis=1).min() < 2 * UV
    return right


def _key_errors(head: Head, target: Target, there: Arrived) -> np.ndarray:
    """Return the relative error of each key on each part, (keys, parts); nan where it does not move it.

    The root of the mean squared difference from the truth (the same template's displacement, in the target's pose and
    size), over that of the truth.
    """
    parts = range(int(head.part.max()) + 1)
    rows = []
    for name, offset in head.keys.items():
        wanted = target.scale * carried(head, target, offset) @ target.turn
        got = there.keys.get(name, np.zeros_like(wanted))
        size, apart = (np.linalg.norm(x, axis=1) for x in (wanted, got - wanted))
        row = []
        for part in parts:
            own = target.part == part
            moves = size[own].max() > MOVING * size.max()
            row.append(np.sqrt((apart[own] ** 2).sum() / (size[own] ** 2).sum()) if moves else np.nan)
        rows.append(row)
    return np.array(rows)
