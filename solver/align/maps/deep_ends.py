"""The ends of what is deep, as a sleeve or a sock: on the disc a point each, which a Möbius transformation can match.

Around its deepest place the disc of a tube shrinks by a factor of e for each radius of its length. A transformation
that takes that place a thousandth of the disc beside the other surface's is right for seven radii and wrong for all
beyond; one that takes it to the very place leaves a rotation, which the wide end tells.
"""

from __future__ import annotations

import numpy as np

from ...flatten.distortion import signed_areas
from ...flatten.flatten import Flattening
from ...mobius import Mobius
from ...surface.mesh import Complexes, Floats

DEEPEST = 0.01
"""Share of the area that is the end of what is deep: of a tube of 16 radii the last sixth of a radius."""

SAME_END = 0.1
"""Hyperbolic distance, as |x - y| / |1 - x conj(y)|, up to which two ends may be one: what lies deeper than two radii
in one tube is nearer together, since exp(-2.3) is a tenth."""


def end_to_end(mobius: Mobius, source: Flattening, target: Flattening) -> Mobius | None:
    """Return the transformation next to one that takes the deepest place of the source to the target's deepest there.

    None where the target has none there.
    """
    ours, weights = _deepest(source)
    ours, weights = _around(ours, weights, ours[0])
    image = complex(mobius(_middle(ours, weights)))
    theirs, weights = _around(*_deepest(target), image)
    if not len(theirs):
        return None
    theirs, weights = _around(theirs, weights, theirs[0])
    goal = _middle(theirs, weights)
    # the image to the middle and the middle to the goal turn nothing that lies on the way
    return Mobius(goal).inverse() @ Mobius(image) @ mobius


def _deepest(flattening: Flattening) -> tuple[Complexes, Floats]:
    """Return the places of the triangles that shrink most in the disc, the deepest first, and their areas, (k,)."""
    mesh = flattening.mesh
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.abs(signed_areas(flattening.disc, mesh.faces)) / mesh.face_areas
    middle = flattening.disc[mesh.faces].mean(axis=1)
    # a conformal map shrinks towards the rim too, as 1 - |x|^2 does
    scale /= (1 - np.abs(middle) ** 2) ** 2
    order = np.argsort(np.where(mesh.face_areas > 0, scale, np.inf), kind="stable")
    count = int(np.searchsorted(np.cumsum(mesh.face_areas[order]), DEEPEST * mesh.area)) + 1
    return middle[order[:count]], mesh.face_areas[order[:count]]


def _around(places: Complexes, weights: Floats, place: complex) -> tuple[Complexes, Floats]:
    near = np.abs(places - place) < SAME_END * np.abs(1 - places * np.conj(place))
    return places[near], weights[near]


def _middle(places: Complexes, weights: Floats) -> complex:
    return complex((weights * places).sum() / weights.sum())
