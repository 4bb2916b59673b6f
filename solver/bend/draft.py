"""A draft of the bending: the target brought into the source's pose and coarse bend, and bent with a stiff plate.

Lengths are in roots of the source's area.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..flatten.sphere import Flat
from ..mobius import Mobius, SphereMobius
from ..surface.barycentric import interpolated
from ..surface.mesh import Floats, Integers, Places, TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.statistics import weighted_median
from .coarse import Coarse, coarse
from .plate import NORMAL_WEIGHT, relaxed
from .pose import ASKED, FEW, MOST, ROUGHLY_BY, in_pose, misfit, rigidly, settled
from .rotations import NEAR_BEND_LENGTH, coarsely_bent, turned_like

NODES = 1500
"""Target vertices that are bent; all others follow them."""

STIFFEST, SOFTEST, ROUNDS = 0.5, 0.005, 20
"""The wavelength over 2 pi below which the plate resists: from half the width of the surface to some edges."""

DRAFT_ROUNDS = 10
"""Rounds before boundaries attract each other; by then it is clear which of them correspond."""


@dataclass(frozen=True, eq=False)
class Draft:
    """The target bent onto the source by the stiffer half of the rounds, its boundaries left alone.

    Attributes
    ----------
    onto : SurfacePoints
        The source about the middle of its boundary, in roots of its area.
    whole : TriangleMesh
        The target; mirrored, with its faces turned, where the Möbius transformation is reflected.
    conformal : (n,) complex128
        Where the Möbius transformation carries each target vertex in the source's disc; nan at vertices in no face.
    growth : float
        What brings the target to the source's scale.
    unbent : (n, 3) float64
        The target's vertices in the source's scale.
    few : Coarse
        The target by the vertices that are bent.
    flat : TriangleMesh
        The nodes among `unbent`, with faces between them.
    rest, now : (q, 3) float64
        The nodes in the source's pose, and bent.
    count : int
        How many nodes were asked for.
    way : int or None
        Which way of beginning was taken, of `_best_start`; None where it began at given places.
    """

    onto: SurfacePoints
    whole: TriangleMesh
    conformal: Places
    growth: float
    unbent: Floats
    few: Coarse
    flat: TriangleMesh
    rest: Floats
    now: Floats
    count: int
    way: int | None

    def places(self) -> Floats:
        """Return where all target vertices are, (n, 3), in the frame of `onto`; 0 at vertices in no face."""
        return self.few.following(self.flat.vertices, self.now, self.unbent)

    def located(self, target: Flat) -> tuple[Integers, Floats]:
        """Return the source's face nearest to each target vertex, (n,), and where in it, (n, 3).

        -1 and 0 at vertices in no face.
        """
        places = self.places()
        normals = TriangleMesh(places, self.whole.faces).vertex_normals()
        used = np.flatnonzero(target.mesh.used)
        face, barycentric = np.full(len(places), -1), np.zeros((len(places), 3))
        face[used], barycentric[used] = self.onto.nearest_point(places[used], normals[used])
        return face, barycentric


def drafted(
    mobius: Mobius | SphereMobius,
    source: Flat,
    target: Flat,
    trust: Floats | None = None,
    start: Floats | None = None,
    rounds: int = DRAFT_ROUNDS,
    count: int = NODES,
    progress: Callable[[float], None] | None = None,
    like: Draft | None = None,
    way: int | None = None,
) -> Draft:
    """Bend the target onto the source with a stiff plate, beginning at the Möbius map.

    The target is first given the source's pose and coarse bend: an embedding with the lengths of the target whose
    surroundings are turned like their Möbius images (Sorkine and Alexa 2007, with rotations averaged over
    `BEND_LENGTH`, or less where that would undo a tighter bend: a coil would be flattened).

    Parameters
    ----------
    mobius : Mobius
        From the source's disc to the target's.
    source, target : Flat
    trust : (n,) float64, optional
        How far the Möbius map is to be believed at each target vertex, in (0, 1]: scale, pose and coarse bend are taken
        from where it is. Default: everywhere.
    start : (n, 3) float64, optional
        Where target vertices are nearly, in the frame of `Draft.onto`: an earlier draft's `places`. Default: where the
        Möbius map puts them.
    rounds : int
        At most `ROUNDS`: how far the plate is relaxed.
    count : int
        Target vertices that are bent.
    progress : callable, optional
        Called with the share of the work done, in [0, 1]; may raise to end it.
    like : Draft, optional
        Another draft of the same surfaces, from whatever map: what does not depend on that is taken from it.
    way : int, optional
        `Draft.way` of a draft of the same map by another number of nodes: no other way of beginning is tried.
    """
    tell = progress or (lambda _: None)
    onto = ready(source) if like is None else like.onto
    used = np.flatnonzero(target.mesh.used)
    conformal = target.domain.nowhere(len(target.places))
    conformal[used] = mobius.inverse()(target.places[used])
    whole, order = facing(target.mesh, mobius.reflected)

    tell(0.0)
    if like is None or like.count != count:
        few = coarse(target, count, order)
    else:
        few = like.few if np.array_equal(like.whole.faces, whole.faces) else like.few.turned()
    nodes, faces = few.nodes, few.faces
    tell(0.0)
    places = _positions(conformal[nodes], source, onto) if start is None else start[nodes]
    believed = np.ones(len(nodes)) if trust is None else trust[nodes]
    growth = _growth(TriangleMesh(whole.vertices[nodes], faces), places, believed)
    flat = TriangleMesh(whole.vertices[nodes] * growth, faces)
    if start is None:
        same_area = 1 / np.sqrt(whole.area)
        flat, rest, growth, way = _best_start(flat, growth, places, believed, same_area, onto, count < NODES, way)
    else:
        way = None
        rest = settled(TriangleMesh(turned_like(flat, places, believed, NEAR_BEND_LENGTH), faces), onto)
    unbent = whole.vertices * growth
    tell(0.0)
    stiff = lengths(STIFFEST, SOFTEST, ROUNDS)[:rounds]
    now = relaxed(rest, rest, faces, onto, stiff, np.zeros(len(nodes), bool), tell)
    return Draft(onto, whole, conformal, growth, unbent, few, flat, rest, now, count, way)


def ready(source: Flat) -> SurfacePoints:
    """Return the source about the middle of its boundary, in roots of its area, for what is bent onto it."""
    about = source.boundary if len(source.boundary) else source.mesh.used
    middle = source.mesh.vertices[about].mean(axis=0)
    places = (source.mesh.vertices - middle) / np.sqrt(source.mesh.area)
    return SurfacePoints(source.mesh.moved(places), source.loops, NORMAL_WEIGHT)


def facing(mesh: TriangleMesh, reflected: bool) -> tuple[TriangleMesh, list[int]]:
    """Return the mesh, mirrored back with its faces turned if it is reflected, so that normals agree; their order."""
    if not reflected:
        return mesh, [0, 1, 2]
    return TriangleMesh(mesh.vertices * [-1, 1, 1], mesh.faces[:, [0, 2, 1]]), [0, 2, 1]


def _best_start(
    flat: TriangleMesh,
    growth: float,
    places: Floats,
    trust: Floats,
    same_area: float,
    onto: SurfacePoints,
    few: bool,
    known: int | None,
) -> tuple[TriangleMesh, Floats, float, int]:
    """Return the nodes at rest, (q, 3) both unbent and as the bending begins, their scale, and which way that is.

    Bent as their Möbius images, (q, 3), are, or in one rigid pose with most of these: what is hardly bent is better off
    unbent, above all where the images err. In the images' scale, `growth`, or in that in which the areas are the same.
    The one is taken that lies on the source best (`misfit`), if it is not `known`. Where there are `few`
    nodes few points are asked.
    """
    best, least = None, np.inf
    for way in range(4) if known is None else (known,):
        scale = (growth, same_area)[way // 2]
        scaled = TriangleMesh(flat.vertices * (scale / growth), flat.faces)
        there = (coarsely_bent, rigidly)[way % 2](scaled, places, trust)
        rest = in_pose(TriangleMesh(there, flat.faces), onto, most=FEW if few else ROUGHLY_BY)
        apart = 0.0 if known is not None else misfit(TriangleMesh(rest, flat.faces), onto, ASKED if few else MOST)
        if best is None or apart < least:
            best, least = (scaled, rest, scale, way), apart
    assert best is not None
    scaled, rest, scale, way = best
    return scaled, in_pose(TriangleMesh(rest, flat.faces), onto), scale, way


def _positions(places: Places, source: Flat, onto: SurfacePoints) -> Floats:
    """Return where points of the source's domain lie on the scaled source, (q, 3)."""
    face, barycentric = source.triangles.locate(places)
    return interpolated(onto.mesh.vertices, source.mesh.faces[face], barycentric)


def _growth(mesh: TriangleMesh, places: Floats, trust: Floats) -> float:
    """Return how much longer edges are in `places`, (n, 3), than in the mesh: the median ratio, by trust, (n,)."""
    i, j = mesh.edges.T
    own = np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1)
    there = np.linalg.norm(places[i] - places[j], axis=1)
    some = (own > 0) & (there > 0)
    if not some.any():
        return 1.0
    return weighted_median(there[some] / own[some], (trust[i] * trust[j])[some])


def lengths(stiffest: float, softest: float, rounds: int) -> Floats:
    """Return the plate's wavelength in each round, (rounds,), falling by equal factors."""
    return np.geomspace(stiffest, softest, rounds)
