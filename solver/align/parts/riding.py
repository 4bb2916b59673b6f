"""Parts without a counterpart: with which surface each rides, and at which point of the source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...surface.barycentric import interpolated, weighted
from ...surface.mesh import Floats, Integers, TriangleMesh
from ...surface.nearest import SurfacePoints
from ...surface.parts import Parts
from .space import Similarities

STIFF = 0.1
"""Extent, in diagonals, below which a part that rides along does so as one piece: buttons and teeth are not bent."""

ROUND = 0.2, 0.2
"""Extent up to which what is round does so too, and least ratio of its second moments for that: an eyeball is 0.12 to
0.15 of a head, and half of a ball's shell has a quarter."""

CONCENTRIC = 0.2
"""Distance of middles, in standard deviations of where the surface is, up to which parts have one: shells of eyes in
heads at hand have 0.01 to 0.03, teeth that touch 2."""


@dataclass(frozen=True, eq=False)
class Known:
    """Where vertices of the target belong, as far as that is known before anything rides.

    Attributes
    ----------
    face, barycentric : (n,) int, (n, 3) float64
        Point of the source; -1 where there is none.
    pairs : (k, 2) int
        Parts of source and target that belong together.
    space : Similarities
        Where each part of the target is in the source's space.
    main_size : float
        Diagonal of the target's main part.
    bound : float
        How far the map of space may be off, in the source's lengths.
    """

    face: Integers
    barycentric: Floats
    pairs: Integers
    space: Similarities
    main_size: float
    bound: float


@dataclass(frozen=True, eq=False)
class Riding:
    """What rides.

    Attributes
    ----------
    vertices : (q,) int
    face, barycentric : (q,) int, (q, 3) float64
        Point of the source that each has.
    leader : (q,) int
        The vertex of the target's surface in whose frame it is moved.
    """

    vertices: Integers
    face: Integers
    barycentric: Floats
    leader: Integers


def ride(known: Known, source: Parts, target: Parts) -> Riding | None:
    """Return what rides with the surface next to it, on the target; None if nothing does or can.

    A small part rides as one piece with the part that most of its vertices lie next to: a lash with the lash below it
    and not with the eye behind the middle of both. Where one of the source's own without a counterpart is, within what
    the map of space may be off, it is a piece of that: a row of teeth may be one part there and many here, with gums
    around them that are paired with a tongue.
    """
    riding = np.setdiff1d(np.arange(1, len(target)), known.pairs[:, 1])
    rows = np.flatnonzero((known.face[target.mesh.faces] >= 0).all(axis=1) & (target.of_face >= 0))
    if not len(riding) or not len(rows):
        return None
    surface = SurfacePoints(TriangleMesh(target.mesh.vertices, target.mesh.faces[rows]), (), 0.0)
    own = np.setdiff1d(np.arange(1, len(source)), known.pairs[:, 0])
    alone = np.flatnonzero(np.isin(source.of_face, own))
    beside = (
        SurfacePoints(TriangleMesh(source.mesh.vertices, source.mesh.faces[alone]), (), 0.0) if len(alone) else None
    )
    found = []
    for number in riding.tolist():
        part = target.part(number)
        vertices = part.vertices[target.of_vertex[part.vertices] == number]
        if not len(vertices):
            continue
        here = target.mesh.vertices[vertices]
        if not _is_stiff(part.mesh, target.moments[1][number], known.main_size):
            found.append(_beside(known, source, surface, vertices, here))
            continue
        centre = target.moments[0][number]
        at, distance = _nearest(surface, here)
        label = target.of_face[rows[at]]
        if beside is not None:
            there, apart = _nearest(beside, known.space.only(number, here))
            near = apart < np.maximum(known.space.scale[number] * distance, known.bound)
            label = np.where(near, -source.of_face[alone[there]], label)
        values, count = np.unique(label, return_counts=True)
        chosen = _around(known, target, number) or int(values[count.argmax()])
        some = rows[target.of_face[rows] == max(chosen, 0)]
        of_part = SurfacePoints(TriangleMesh(target.mesh.vertices, target.mesh.faces[some]), (), 0.0)
        one = _beside(known, source, of_part if chosen >= 0 else surface, vertices[:1], centre[None])
        if chosen < 0:
            one = Riding(vertices[:1], *_on_part(source, -chosen, known.space.only(number, centre[None])), one.leader)
        size = len(vertices)
        found.append(
            Riding(vertices, one.face.repeat(size), one.barycentric.repeat(size, axis=0), one.leader.repeat(size))
        )
    if not found:
        return None
    parts = zip(*((x.vertices, x.face, x.barycentric, x.leader) for x in found), strict=True)
    return Riding(*(np.concatenate(several) for several in parts))


def _around(known: Known, target: Parts, number: int) -> int | None:
    """Return the part with a counterpart that has one middle with a round part, as the shells of an eye do."""
    centre, about = target.moments
    least, _, most = np.linalg.eigvalsh(about[number])
    if not len(known.pairs) or least <= ROUND[1] * most:
        return None
    apart = np.linalg.norm(centre[known.pairs[:, 1]] - centre[number], axis=1)
    nearest = int(apart.argmin())
    return int(known.pairs[nearest, 1]) if apart[nearest] < CONCENTRIC * np.sqrt(most) else None


def _is_stiff(mesh: TriangleMesh, about: Floats, main_size: float) -> bool:
    """Return whether a part rides as one piece; `about` is its covariance, (3, 3)."""
    extent = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))) / main_size
    least, _, most = np.linalg.eigvalsh(about)
    return extent < STIFF or (extent < ROUND[0] and least > ROUND[1] * most)


def _beside(known: Known, source: Parts, surface: SurfacePoints, vertices: Integers, here: Floats) -> Riding:
    """Return the points of the source that a surface of the target has where it is nearest to places, (q, 3)."""
    at, weights = surface.nearest_point(here, np.zeros_like(here))
    corner = surface.mesh.faces[at]
    leader = corner[np.arange(len(at)), weights.argmax(axis=1)]
    # the point between the places of three vertices, in the part of the source that these lie in
    mesh = source.mesh
    there = np.einsum("qkj,qkjd->qkd", known.barycentric[corner], mesh.vertices[mesh.faces[known.face[corner]]])
    point = weighted(there, weights)
    face, barycentric = np.empty(len(here), np.intp), np.empty((len(here), 3))
    part_of = source.of_face[known.face[leader]]
    for one in np.unique(part_of):
        mine = np.flatnonzero(part_of == one)
        face[mine], barycentric[mine] = _on_part(source, int(one), point[mine])
    return Riding(vertices, face, barycentric, leader)


def _on_part(source: Parts, number: int, points: Floats) -> tuple[Integers, Floats]:
    """Return the faces and coordinates of the points of a part of the source that are nearest to some, (q, 3)."""
    faces = np.flatnonzero(source.of_face == number)
    own = SurfacePoints(TriangleMesh(source.mesh.vertices, source.mesh.faces[faces]), (), 0.0)
    found, where = own.nearest_point(points, np.zeros_like(points))
    return faces[found], where


def _nearest(surface: SurfacePoints, points: Floats) -> tuple[Integers, Floats]:
    """Return the face that is nearest to each of some points, (q, 3), and how far off it is, (q,)."""
    at, weights = surface.nearest_point(points, np.zeros_like(points))
    reached = interpolated(surface.mesh.vertices, surface.mesh.faces[at], weights)
    return at, np.linalg.norm(reached - points, axis=1)
