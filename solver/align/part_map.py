"""One part brought onto its counterpart: which point of it each vertex corresponds to.

Eyeballs and teeth are no discs, and lashes are too simple for a search: where the map of space puts a part it lies on
its counterpart nearly, turned as it should be, and the bending that is used for discs (`bend`) does the rest. No rigid
closest points before it: they turn what is nearly round, as an eyeball, at random (on two persons' eyes by 15 degrees),
and make no tooth or lash better than the bending alone does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bend.plate import NORMAL_WEIGHT, relaxed
from ..surface.mesh import Floats, Integers, TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.parts import Part

LENGTHS = np.geomspace(0.5, 0.05, 6)
"""Wavelengths below which the part resists to be bent, in roots of its area, round by round: from half its width on,
as for discs (`bend.STIFFEST`), down to ten to its width: parts are small, with few triangles."""

MOST = 6000
"""Vertices up to which a part is bent: as many nodes as a disc has (`bend.FINE_NODES`). Others are moved, turned and
scaled."""

FEWEST = 4
"""Faces from which on there is something to bend."""


@dataclass(frozen=True, eq=False)
class PartMap:
    """Points of one part for the vertices of another.

    Attributes
    ----------
    face, barycentric : (q,) int, (q, 3) float64
        Of the source part, for each of the target part's own vertices.
    offset : (q,) float64
        How far from it the vertex remains, in the source's lengths.
    """

    face: Integers
    barycentric: Floats
    offset: Floats


def part_map(source: Part, target: Part, places: Floats) -> PartMap:
    """Return the points of `source` that the vertices of `target` correspond to.

    Parameters
    ----------
    source, target : Part
    places : (q, 3) float64
        Where the target's vertices are in the source's space, nearly, and turned as they should be.
    """
    size = np.sqrt(max(source.mesh.area, np.finfo(float).tiny))
    middle = _middle(source.mesh)
    onto = SurfacePoints(
        TriangleMesh((source.mesh.vertices - middle) / size, source.mesh.faces), _rim(source.mesh), NORMAL_WEIGHT
    )
    faces = target.mesh.faces
    there = TriangleMesh(places, faces)
    growth = np.sqrt(source.mesh.area / max(there.area, np.finfo(float).tiny))
    x = (places - _middle(there)) * (growth / size)
    if _runs_against(TriangleMesh(x, faces), onto):
        faces = faces[:, [0, 2, 1]]
    if min(len(faces), len(source.mesh.faces)) >= FEWEST and len(x) <= MOST:
        drawn = np.full(len(x), bool(onto.loops))
        x = relaxed(x, x, faces, onto, LENGTHS, drawn, lambda _: None)
    face, barycentric = onto.nearest_point(x, TriangleMesh(x, faces).vertex_normals())
    reached = np.einsum("qk,qkd->qd", barycentric, onto.mesh.vertices[source.mesh.faces[face]])
    return PartMap(face, barycentric, size * np.linalg.norm(reached - x, axis=1))


def _middle(mesh: TriangleMesh) -> Floats:
    """Return the middle of the surface, (3,)."""
    return mesh.vertex_areas @ mesh.vertices / max(mesh.area, np.finfo(float).tiny)


def _rim(mesh: TriangleMesh) -> tuple[Integers, ...]:
    """Return the ends of each boundary side, (2,) each: as loops of two vertices, whatever hangs together."""
    single = np.flatnonzero(mesh.twins < 0)
    face, corner = np.divmod(single, 3)
    return tuple(np.stack([mesh.faces[face, corner - 2], mesh.faces[face, corner - 1]], axis=1))


def _runs_against(mesh: TriangleMesh, onto: SurfacePoints) -> bool:
    """Return whether the normals of two surfaces that lie on each other point to opposite sides."""
    normals = mesh.vertex_normals()
    nothing = np.zeros_like(normals)
    _, normal, beyond = onto.at(*onto.nearest_point(mesh.vertices, nothing))
    alike = np.einsum("qi,qi->q", normals, normal) * mesh.vertex_areas
    return float(alike[~beyond].sum() if (~beyond).any() else alike.sum()) < 0
