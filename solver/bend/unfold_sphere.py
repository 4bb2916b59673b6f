"""A map into the sphere made injective: turned triangles put right in charts, or faded towards the Möbius map."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import KDTree

from ..flatten.distortion import signed_volumes
from ..flatten.injective import untangled
from ..flatten.sphere_injective import in_charts
from ..surface.laplacian import mollified_lengths
from ..surface.mesh import Complexes, Floats, Integers, TriangleMesh


def injective_on_sphere(
    carried: Floats, conformal: Floats, faces: Integers, tell: Callable[[], None] = lambda: None
) -> tuple[Floats, int]:
    """Return the map, (n, 3), with no triangle turned over or collapsed, and how many vertices were moved for it.

    Around what is turned over vertices become means of their neighbours, with the weights of the Möbius map. Where that
    does not come to an end, places fade towards the Möbius map around them, by quarters and over ever wider
    surroundings, until at last that is left, which is injective.
    """
    used = np.unique(faces)
    lengths = mollified_lengths(TriangleMesh(np.nan_to_num(conformal), faces).edge_lengths)

    def repaired(chosen: Integers, plane: Complexes, rim: Integers) -> Complexes:
        tell()
        return untangled(faces[chosen], lengths[chosen], plane, rim)

    result = in_charts(faces, carried, repaired)
    turned = signed_volumes(result, faces) <= 0
    reach = 0.0
    near = np.zeros(len(carried), bool)
    while turned.any() and reach < 8:  # from 4 on nothing but the Möbius map is left
        near[faces[turned]] = True
        reach = max(2 * reach, 4 * float(np.linalg.norm((carried - conformal)[near], axis=1).max()), 1e-3)
        distance = np.full(len(carried), np.inf)
        distance[used] = KDTree(conformal[near]).query(conformal[used])[0]
        share = np.clip(2 - 2 * distance / reach, 0, 1)[:, None]
        for quarters in range(1, 5):
            faded = carried + quarters / 4 * share * (conformal - carried)
            faded /= np.linalg.norm(faded, axis=1, keepdims=True)
            result = in_charts(faces, faded, repaired)
            turned = signed_volumes(result, faces) <= 0
            if not turned.any():
                break
    moved = np.abs(result[used] - carried[used]).max(axis=1) > 0
    return result, int(moved.sum())
