"""Parts brought onto their counterparts: which point of these each vertex corresponds to.

Eyeballs and teeth are no discs, and lashes are too simple for a search: where the map of space puts a part it lies on
its counterpart nearly, turned as it should be, and the bending that is used for discs (`bend`) does the rest. No rigid
closest points before it: they turn what is nearly round, as an eyeball, at random (on two persons' eyes by 15 degrees),
and make no tooth or lash better than the bending alone does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...bend.plate import NORMAL_WEIGHT, relaxed
from ...surface.barycentric import interpolated
from ...surface.mesh import Floats, Integers, TriangleMesh
from ...surface.nearest import SurfacePoints
from ...surface.parts import Part

LENGTHS = np.geomspace(0.5, 0.05, 6)
"""Wavelengths below which the part resists to be bent, in roots of its area, round by round: from half its width on,
as for discs (`bend.STIFFEST`), down to ten to its width: parts are small, with few triangles."""

TOGETHER = 6000
"""Vertices that are bent at once: as many nodes as a disc has (`bend.FINE_NODES`)."""

MOST = 20000
"""Vertices up to which a part is bent; larger ones are moved, turned and scaled alone."""

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


@dataclass(frozen=True, eq=False)
class _Near:
    """A part that lies on its counterpart nearly, both about the middle of the latter, which has an area of 1.

    Attributes
    ----------
    source : TriangleMesh
    target : TriangleMesh
        With its faces turned to the counterpart's side.
    size : float
        A length of 1, in the source's lengths.
    """

    source: TriangleMesh
    target: TriangleMesh
    size: float

    @staticmethod
    def of(source: Part, target: Part, places: Floats) -> _Near:
        size = _length(source.mesh)
        onto = TriangleMesh((source.mesh.vertices - _middle(source.mesh)) / size, source.mesh.faces)
        there = TriangleMesh(places, target.mesh.faces)
        growth = 1 / _length(there)
        own = TriangleMesh((places - _middle(there)) * growth, target.mesh.faces)
        if _runs_against(own, SurfacePoints(onto, (), NORMAL_WEIGHT)):
            own = TriangleMesh(own.vertices, own.faces[:, [0, 2, 1]])
        return _Near(onto, own, size)

    @property
    def bends(self) -> bool:
        """Whether there is something to bend, and not too much."""
        enough = min(len(self.target.faces), len(self.source.faces)) >= FEWEST
        wide = min(self.target.area, self.source.area) > 0.5  # else it is a line, or a point
        return enough and wide and len(self.target.vertices) <= MOST

    @property
    def extent(self) -> float:
        """Largest coordinate of either."""
        return float(max(np.abs(self.source.vertices).max(), np.abs(self.target.vertices).max()))

    def located(self, bent: Floats) -> PartMap:
        """Return the points of the counterpart that the vertices, (q, 3), are nearest to."""
        onto = SurfacePoints(self.source, (), NORMAL_WEIGHT)
        face, barycentric = onto.nearest_point(bent, TriangleMesh(bent, self.target.faces).vertex_normals())
        reached = interpolated(self.source.vertices, self.source.faces[face], barycentric)
        return PartMap(face, barycentric, self.size * np.linalg.norm(reached - bent, axis=1))


def part_maps(
    pairs: Sequence[tuple[Part, Part, Floats]], progress: Callable[[float], None] | None = None
) -> list[PartMap]:
    """Return the points of each part's counterpart that its vertices correspond to.

    Parameters
    ----------
    pairs : sequence of (Part, Part, (q, 3) float64)
        Source, target, and where the target's vertices are in the source's space, nearly, turned as they should be.
    progress : callable, optional
        Called with the share of the work done, in [0, 1]; may raise to end it.
    """
    tell = progress or (lambda _: None)
    near = [_Near.of(*pair) for pair in pairs]
    bent = [one.target.vertices for one in near]
    bending = [k for k, one in enumerate(near) if one.bends]
    total = np.cumsum([len(bent[k]) for k in bending])
    done = 0
    while done < len(bending):
        before = total[done - 1] if done else 0
        some = bending[done : max(done + 1, int(np.searchsorted(total, before + TOGETHER, side="right")))]
        tell(0.8 * done / len(bending))
        for k, places in zip(some, _bent_together([near[k] for k in some]), strict=True):
            bent[k] = places
        done += len(some)
    result = []
    for k, one in enumerate(near):
        tell(0.8 + 0.2 * k / len(near))
        result.append(one.located(bent[k]))
    return result


def _bent_together(several: list[_Near]) -> list[Floats]:
    """Return the vertices of each part, (q, 3), bent onto its counterpart: all in one system, far apart.

    A part has the same share of the area of all as any other, so that the plate's share of the energy is as in one part
    alone once lengths are divided by the root of their number.
    """
    step = 8 * max(one.extent for one in several)
    shift = [np.array([step * k, 0.0, 0.0]) for k in range(len(several))]
    source = _together([one.source for one in several], shift)
    target = _together([one.target for one in several], shift)
    onto = SurfacePoints(source, _rim(source), NORMAL_WEIGHT)
    closed = [bool((one.source.twins >= 0).all()) for one in several]
    drawn = ~np.repeat(closed, [len(one.target.vertices) for one in several])
    x = target.vertices
    bent = relaxed(x, x, target.faces, onto, LENGTHS / np.sqrt(len(several)), drawn, lambda _: None)
    ends = np.cumsum([len(one.target.vertices) for one in several])
    return [places - by for places, by in zip(np.split(bent, ends[:-1]), shift, strict=True)]


def _together(meshes: list[TriangleMesh], shift: list[Floats]) -> TriangleMesh:
    """Return one mesh of several, each moved."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, first, strict=False)]
    vertices = [mesh.vertices + by for mesh, by in zip(meshes, shift, strict=True)]
    return TriangleMesh(np.concatenate(vertices), np.concatenate(faces))


def _length(mesh: TriangleMesh) -> float:
    """Return the root of the area; of a line a thousandth of its length; 1 for a point."""
    return float(np.sqrt(max(mesh.area, 1e-6 * mesh.diagonal**2))) or 1.0


def _middle(mesh: TriangleMesh) -> Floats:
    """Return the middle of the surface, (3,); of the vertices where it has no area."""
    if mesh.area <= 0:
        return mesh.vertices.mean(axis=0)
    return mesh.vertex_areas @ mesh.vertices / mesh.area


def _rim(mesh: TriangleMesh) -> tuple[Integers, ...]:
    """Return the ends of each boundary side, (2,) each: as loops of two vertices, whatever hangs together."""
    single = np.flatnonzero(mesh.twins < 0)
    face, corner = np.divmod(single, 3)
    return tuple(np.stack([mesh.faces[face, corner - 2], mesh.faces[face, corner - 1]], axis=1))


def _runs_against(mesh: TriangleMesh, onto: SurfacePoints) -> bool:
    """Return whether the normals of two surfaces that lie on each other point to opposite sides."""
    normals = mesh.vertex_normals()
    face, barycentric = onto.nearest_point(mesh.vertices, np.zeros_like(normals))
    there = interpolated(onto.mesh.vertex_normals(), onto.mesh.faces[face], barycentric)
    return float(np.einsum("qi,qi->q", normals, there) @ mesh.vertex_areas) < 0
