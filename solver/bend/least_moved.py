"""A bent map made injective in the way that moves it least on the source: in the disc, small and large look alike."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..flatten.distortion import signed_areas
from ..flatten.injective import relocated
from ..flatten.sphere import Flat
from ..surface.barycentric import interpolated
from ..surface.mesh import Complexes, Floats, Integers
from .rim import Rim
from .unfold import in_order, injective

FEW = 100
"""Turned triangles up to which their vertices are also tried one by one: each takes some milliseconds."""


def unfolded(
    carried: Complexes,
    conformal: Complexes,
    faces: Integers,
    source: Flat,
    target: Flat,
    vertices: Floats,
    bent: Floats,
    tell: Callable[[], None],
) -> tuple[Complexes, int]:
    """Return the map with no triangle turned over or collapsed, and how many vertices were moved for it.

    Of several ways (`injective`, with the rim put in order in the disc or on the surface, with or without single
    vertices moved first) the one that moves the vertices least from where they were bent to, on the source.

    Parameters
    ----------
    carried, conformal : (n,) complex128
        Where the target's vertices go, and where the Möbius map puts them.
    faces : (m, 3) int
        The target's, turned where the map is reflected.
    source, target : Flat
    vertices, bent : (n_source, 3), (n, 3) float64
        The source's vertices, and where the target's were bent to, in one frame.
    """
    best, least, count = None, np.inf, 0
    for way in _ways(carried, conformal, faces, source, target, vertices, bent):
        trial, _ = injective(way, conformal, faces, target.boundary, target.holes, tell)
        moved = np.flatnonzero(np.abs(trial - carried) > 0)
        if not len(moved):  # the map itself is injective, and there is no other way
            return trial, 0
        apart = _distance(trial[moved], bent[moved], source, vertices) - _distance(
            carried[moved], bent[moved], source, vertices
        )
        far = float(target.mesh.vertex_areas[moved] @ apart)
        if best is None or far < least:
            best, least, count = trial, far, len(moved)
    assert best is not None
    return best, count


def _ways(
    carried: Complexes,
    conformal: Complexes,
    faces: Integers,
    source: Flat,
    target: Flat,
    vertices: Floats,
    bent: Floats,
) -> Iterator[Complexes]:
    """Yield what may be made injective: the map itself, and what is nearer to being so already."""
    yield carried
    rim = target.boundary
    own = _distance(carried[rim], bent[rim], source, vertices)
    places = Rim.of(source, vertices).ordered(carried[rim], conformal[rim], bent[rim], own)
    ordered = carried
    if (places != carried[rim]).any():
        ordered = carried.copy()
        ordered[rim] = places
        yield ordered
    ordered = ordered.copy()
    ordered[rim] = in_order(ordered[rim], conformal[rim])
    if 0 < (signed_areas(ordered, faces) <= 0).sum() <= FEW:
        yield relocated(ordered, faces, np.concatenate([rim, *target.holes]))


def _distance(places: Complexes, points: Floats, source: Flat, vertices: Floats) -> Floats:
    """Return how far places of the source's disc, (k,), are on it from points, (k, 3)."""
    if not len(places):
        return np.zeros(0)
    face, barycentric = source.triangles.locate(places)
    return np.linalg.norm(interpolated(vertices, source.mesh.faces[face], barycentric) - points, axis=1)
