"""How alike descriptors are, as far as they are so deep inside both surfaces that they feel no boundary.

Descriptors are diffused curvatures, and nothing diffuses in from past a boundary: beside a cut they are others than
they would be if the surface went on. Of two places that are alike, one beside a cut and one far from any, they say that
they are not.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from ...flatten.sphere import Flat
from ...surface.descriptors import DIFFUSION_TIMES
from ...surface.mesh import Booleans, Floats

FELT = 2 * np.tile(np.sqrt(DIFFUSION_TIMES), 2)
"""How far from a boundary each column of the descriptors feels it, (d,), in roots of the area: what one implicit step
of diffusion by a time t carries falls by e each root of t, here to a seventh."""


def depths(flat: Flat, points: Floats) -> Floats:
    """Return how far points, (q, 3), are from the next vertex of a boundary, in roots of the area; inf without any."""
    if not flat.loops:
        return np.full(len(points), np.inf)
    rim = KDTree(flat.mesh.vertices[np.concatenate(flat.loops)])
    return rim.query(points)[0] / np.sqrt(flat.mesh.area)


def felt_inside(depth: Floats) -> Booleans:
    """Return which columns of the descriptors, (..., d), feel no boundary that is so far away, (...,)."""
    return depth[..., None] > FELT


def difference(unlike: Floats, tells: Booleans) -> Floats:
    """Return the root mean square, (...,), of differences of descriptors, (..., d), that tell anything; 0 if none."""
    count = np.maximum(tells.sum(axis=-1), 1)
    return np.sqrt((unlike**2 * tells).sum(axis=-1) / count)


def explained(wanted: Floats, unlike: Floats, tells: Booleans) -> Floats:
    """Return which share of the variance of descriptors is found again, (...,); 0 where none tells anything.

    Parameters
    ----------
    wanted : (q, d) float64
    unlike : (..., q, d) float64
        By how much those differ that may be alike.
    tells : (..., q, d) bool
        Which of them tell anything.
    """
    count = np.maximum(tells.sum(axis=-2), 1)
    sums = (tells * wanted).sum(axis=-2)
    whole = ((tells * wanted**2).sum(axis=-2) - sums**2 / count).sum(axis=-1)
    left = (tells * unlike**2).sum(axis=(-2, -1))
    return np.where(whole > 0, 1 - left / np.where(whole > 0, whole, 1.0), 0.0)
