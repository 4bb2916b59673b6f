"""Joints of a skeleton carried along with the surface that they move."""

from __future__ import annotations

import numpy as np

from ..align.parts.space import MOST_POINTS, Similarities, SpaceMap
from ..surface.mesh import Booleans, Floats, Integers, TriangleMesh
from .correspond import Correspondence

_ELSEWHERE = 0.01
"""How much of the surface counts for a joint that does not move it, beside what it moves fully: enough for a turn
where a joint moves a few vertices in a row, and next to nothing where it moves more."""


def carried_joints(
    correspondence: Correspondence,
    source: TriangleMesh,
    target: TriangleMesh,
    joints: Floats,
    reach: Floats,
    influence: Floats,
    *,
    mirrored: bool = False,
) -> Similarities:
    """Return the similarity by which each joint goes from the source to the target.

    It is the moving least squares similarity at the joint (`SpaceMap`) between the places of the target's vertices on
    the source and these vertices, each counting by its area and by how much the joint moves it. An eye's is therefore
    that of the eyeball, wherever the lids go, and a joint that moves nothing follows the surface that is nearest.

    Parameters
    ----------
    correspondence : Correspondence
    source, target : TriangleMesh
        In the shapes in which the skeleton is at rest.
    joints : (q, 3) float64
        Places in the space of the source.
    reach : (q,) float64
        Distance beyond the nearest vertex up to which a vertex counts a quarter or more: the length of a bone.
    influence : (n_source, q) float
        How much a joint moves each vertex of the source, in [0, 1].
    mirrored : bool
        Whether the map mirrors the source.

    Raises
    ------
    ValueError
        No vertex of the target has a counterpart.
    """
    known = _of_its_own(correspondence)
    if not known.any():
        raise ValueError("no vertex of the target has a counterpart")
    matrix = correspondence.matrix()[np.flatnonzero(known)]
    here, there = matrix @ source.vertices, target.vertices[known]
    areas = target.vertex_areas[known]
    certainty = correspondence.confidence[known]
    found = []
    for joint, far, column in zip(joints, reach, np.asarray(influence, dtype=np.float64).T, strict=True):
        chosen, weights = _drawn(areas * (matrix @ column + _ELSEWHERE))
        space = SpaceMap(here[chosen], there[chosen], weights, certainty[chosen], mirrored)
        found.append(space.at(joint[None], np.array([far])))
    return Similarities(
        *(
            np.concatenate([getattr(x, name) for x in found]) if found else np.zeros((0, *shape))
            for name, shape in (("turn", (3, 3)), ("scale", ()), ("here", (3,)), ("there", (3,)), ("certainty", ()))
        )
    )


def _of_its_own(correspondence: Correspondence) -> Booleans:
    """Return which target vertices, (n,), have a counterpart of their own: riders have that of another part."""
    known = correspondence.face >= 0
    return known if correspondence.leader is None else known & (correspondence.leader < 0)


def _drawn(weights: Floats) -> tuple[Integers, Floats]:
    """Return at most `MOST_POINTS` rows, drawn evenly along the sum of the weights, and how much each stands for."""
    if len(weights) <= MOST_POINTS:
        return np.arange(len(weights)), weights
    total = np.cumsum(weights)
    steps = (np.arange(MOST_POINTS) + 0.5) * total[-1] / MOST_POINTS
    chosen, counts = np.unique(np.searchsorted(total, steps), return_counts=True)
    return chosen, counts.astype(np.float64)
