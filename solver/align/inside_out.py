"""Surfaces that are inside out beside each other: found where the map of the two as they are is doubtful.

A disc has no outside that could be told from itself alone: what is a hill on one side is a dent on the other. Beside
another surface of its kind it has: turned round it matches better.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..flatten.sphere import Flat
from ..stages import Part
from ..surface.mesh import Integers, MeshError
from .alignment import Alignment
from .dense import bent_densely, drafted_from
from .mobius_map import challenged, searched
from .prepared import Surface
from .reconsider import DOUBTFUL
from .remark import Remark

MOSTLY = 0.6
"""Mean confidence over the whole target, 0 where it has no counterpart, up to which the other side is tried."""


def turned_round(
    found: Alignment, source: Surface, target: Surface, clock: Part, landmarks: Integers | None
) -> tuple[Alignment, Surface] | None:
    """Return what comes of a doubtful map if the target is turned inside out, and it so; None where that is no better.

    Doubtful is also one that leaves much of the target without a counterpart. Its samples have to match better by
    `AlignSettings.reflect_margin`, before it is bent, and more of its map has to be sure than of the other, after.
    """
    if found.source.domain.closed:  # it has an outside by itself: see `Surface.cleaned`
        return None
    if found.mean_confidence > DOUBTFUL and _sure(found) > MOSTLY:
        return None
    part = clock.part(0.0, 0.5, "inside out")
    part.begin("inside out", "Trying the other side", 0.0)
    turned = Surface(
        target.original, fill_holes=target.fill_holes, outer_vertex=target.outer_vertex, tidy=target.cleaned.turned()
    )
    try:
        matched = searched(source, turned, found.settings, part, landmarks)
    except MeshError:
        return None
    if matched.search.value - found.search.value <= found.settings.reflect_margin * len(found.source_samples):
        return None
    matched = challenged(matched, part)
    part = clock.part(0.5, 1.0, "inside out")
    other = bent_densely(matched, drafted_from(matched, part), part, landmarks)
    if _sure(other) <= max(DOUBTFUL, _sure(found)):
        return None
    one, two = found.source, found.target
    if _bulge(one) < 0 <= _bulge(two):
        one, two = two, one
    said = f"'{two.mesh.name}' seems to be inside out beside '{one.mesh.name}': turned for the computation only"
    return replace(other, remarks=(Remark("done", said), *other.remarks)), turned


def _sure(found: Alignment) -> float:
    """Return the mean confidence over the target's whole area."""
    return float(found.confidence @ found.target.mesh.vertex_areas / found.target.mesh.area)


def _bulge(flattening: Flat) -> float:
    """Return the volume between a surface and the cone over its rim; negative where it bulges inwards."""
    mesh = flattening.mesh
    corners = mesh.vertices[mesh.faces] - mesh.vertices[flattening.boundary].mean(axis=0)
    return float(np.linalg.det(corners).sum() / 6)
