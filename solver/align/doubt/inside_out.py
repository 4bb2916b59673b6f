"""Surfaces that are inside out beside each other: found where the map of the two as they are is doubtful.

A disc has no outside that could be told from itself alone: what is a hill on one side is a dent on the other. Beside
another surface of its kind it has: turned round it matches better.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...flatten.flatten import Flattening
from ...flatten.sphere import Flat
from ...stages import Part
from ...surface.mesh import Integers, TriangleMesh
from ..result.alignment import Alignment
from ..surfaces.prepared import Surface
from ..surfaces.remark import Remark
from .otherwise import doubted, otherwise


def turned_round(
    found: Alignment, source: Surface, target: Surface, clock: Part, landmarks: Integers | None
) -> tuple[Alignment, Surface] | None:
    """Return what comes of a doubtful map if the target is turned inside out, and it so; None where it is no better."""
    if found.source.domain.closed or not doubted(found):  # what is closed has an outside: see `Surface.cleaned`
        return None
    part = clock.part(0.0, 1.0, "inside out")
    part.begin("inside out", "Trying the other side", 0.0)
    turned = _turned(target, found.target)
    other = otherwise(found, source, turned, part, landmarks)
    if other is None:
        return None
    one, two = found.source, found.target
    if _bulge(one) < 0 <= _bulge(two):
        one, two = two, one
    said = f"'{two.mesh.name}' seems to be inside out beside '{one.mesh.name}': turned for the computation only"
    return other.annotated(remarks=(Remark("done", said), *other.remarks)), turned


def _turned(target: Surface, flattening: Flat) -> Surface:
    """Return a surface inside out, its disc mirrored; the same vertices stand for it."""
    tidy = target.cleaned.turned()
    turned = Surface(target.original, fill_holes=target.fill_holes, outer_vertex=target.outer_vertex, tidy=tidy)
    if isinstance(flattening, Flattening):
        mesh = flattening.mesh
        fair = (
            tidy.mesh
            if mesh is target.cleaned.mesh
            else TriangleMesh(mesh.vertices, mesh.faces[:, [0, 2, 1]], mesh.name)
        )
        rim, holes = flattening.boundary[::-1], tuple(hole[::-1] for hole in flattening.holes)
        turned.known(replace(flattening, mesh=fair, disc=flattening.disc.conj(), boundary=rim, holes=holes))
        turned.points["target"].update(target.points["target"])
    return turned


def _bulge(flattening: Flat) -> float:
    """Return the volume between a surface and the cone over its rim; negative where it bulges inwards."""
    mesh = flattening.mesh
    corners = mesh.vertices[mesh.faces] - mesh.vertices[flattening.boundary].mean(axis=0)
    return float(np.linalg.det(corners).sum() / 6)
