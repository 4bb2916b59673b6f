"""Which parts are the main ones where the largest do not belong together: a cape may be larger than the skin."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from ...surface.cleaning import cleaned
from ...surface.mesh import MeshError, TriangleMesh, plural
from .prepared import Surface

LARGE = 0.25
"""Share of the largest part's area from which on another may be the main one: a skin under a coat has more."""

CANDIDATES = 2
"""Parts of each mesh that are tried, the largest included: each pair takes as long as an alignment."""


def other_mains(source: Surface, target: Surface) -> list[tuple[Surface, Surface]]:
    """Return the meshes with other parts as their main ones, the pairs of largest parts first.

    None if each has one large part, or none but the largest can be put in order.
    """
    sides = [[surface, *_with_other_mains(surface)] for surface in (source, target)]
    pairs = sorted(product(*(range(len(side)) for side in sides)), key=sum)
    return [(sides[0][i], sides[1][j]) for i, j in pairs[1:]]


def _with_other_mains(surface: Surface) -> list[Surface]:
    if surface.within is not None or not surface.largest_part:
        return []
    try:
        parts, found = surface.parts, []
    except MeshError:  # which is said elsewhere
        return []
    for number in range(1, min(len(parts), CANDIDATES)):
        if parts.area[number] < LARGE * parts.area[0]:
            break
        try:
            found.append(with_main(surface, number))
        except MeshError:
            continue
    return found


def with_main(surface: Surface, number: int) -> Surface:
    """Return the mesh with another of its parts as the main one; raises `MeshError` if that cannot be put in order."""
    original, parts = surface.original, surface.parts
    rows = np.flatnonzero(parts.of_face == number)
    alone = TriangleMesh(original.vertices, original.faces[rows], original.name)
    tidy = cleaned(alone, largest_part=True, fill_holes=surface.fill_holes, keys=surface.keys)
    said = f"{plural(len(parts) - 1, 'other part')} left out"
    tidy = replace(tidy, faces=rows[tidy.faces], original_faces=original.faces, changes=(said, *tidy.changes))
    return Surface(original, fill_holes=surface.fill_holes, largest_part=True, keys=surface.keys, tidy=tidy)
