"""Lips that only a shape key opens, beside a surface that has no opening: they are joined for the computation.

Kept apart they are an opening, and a surface with one has another conformal structure than without: its map is another.
What has no opening has the same there for both lips, so that nothing is lost by joining them.
"""

from __future__ import annotations

from ...surface.cleaning import cleaned
from ...surface.mesh import TriangleMesh, plural
from ...surface.tidy import piece_within
from ...surface.topology import topology
from .prepared import Surface
from .remark import Remark


def with_lips_joined(source: Surface, target: Surface) -> tuple[Surface, Surface, tuple[Remark, ...]]:
    """Return the surfaces, each with its lips joined if the other has no opening, and what is to be said of that."""
    first, second = _joined(source, target), _joined(target, source)
    said = tuple(
        Remark(
            "done",
            f"'{own.original.name}': {plural((_rim(own.cleaned.mesh) - _rim(new.cleaned.mesh)) // 2, 'edge')} that a "
            f"shape key opens joined, as '{other.original.name}' has no opening, for the computation only",
        )
        for own, new, other in ((source, first, target), (target, second, source))
        if new is not own
    )
    return first, second, said


def _joined(own: Surface, other: Surface) -> Surface:
    """Return the surface with its lips joined; itself if it has none, or the other may have an opening for them."""
    if own.keys is None or own.tidy is not None or own.outer_vertex is not None or not own.fill_holes:
        return own
    apart = _loops(own.cleaned.mesh)
    if apart < 2 or _loops(other.cleaned.mesh) != 1:
        return own
    tidy = cleaned(own.original, largest_part=own.largest_part, fill_holes=True)
    if own.within is not None:
        tidy = piece_within(tidy, own.within)
    if _loops(tidy.mesh) >= apart:  # the openings are others
        return own
    return Surface(own.original, fill_holes=True, largest_part=own.largest_part, keys=own.keys, tidy=tidy)


def _loops(mesh: TriangleMesh) -> int:
    return len(topology(mesh).boundary_loops)


def _rim(mesh: TriangleMesh) -> int:
    """Return how many edges are on a boundary."""
    return int((mesh.twins < 0).sum())
