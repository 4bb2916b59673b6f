"""The surfaces of the last pairs, prepared: Align again, Swap and further targets do not begin anew."""

from __future__ import annotations

from ..solver import Surface, TriangleMesh
from ..solver.surface.mesh import Floats
from ..solver.surface.tidy import Piece

KEPT = 4
"""Surfaces whose flattening, curvature and points are kept: those of the last pair, and of the one before."""

# a cache, never the truth: it can be emptied at any time
_kept: dict[tuple[object, ...], Surface] = {}


def surface_of(
    mesh: TriangleMesh,
    *,
    fill_holes: bool,
    largest_part: bool,
    outer_vertex: int | None,
    keys: Floats | None = None,
    within: Piece | None = None,
) -> Surface:
    """Return the surface that a mesh is, as it was prepared before if name, positions and faces are the same."""
    moved, piece = (None if x is None else x.tobytes() for x in (keys, within))
    key = mesh.fingerprint, mesh.name, fill_holes, largest_part, outer_vertex, moved, piece
    surface = _kept.pop(key, None)
    if surface is None:
        surface = Surface(
            mesh,
            fill_holes=fill_holes,
            largest_part=largest_part,
            outer_vertex=outer_vertex,
            keys=keys,
            within=within,
        )
    _kept[key] = surface  # the one used last comes last
    while len(_kept) > KEPT:
        del _kept[next(iter(_kept))]
    return surface


def register() -> None:
    """Begin with none."""


def unregister() -> None:
    """Keep none."""
    _kept.clear()
