"""Beyond Möbius: the target bent onto the source, smoothly, until the surfaces meet in position and normal.

The Möbius map says where everything goes, roughly but whatever the pose; the bending then finds the places more
accurately than a conformal map can. It is a non-rigid closest point method: distances to tangent planes let the
surfaces slide along each other, and the resistance of a thin plate, relaxed from stiff to soft, decides how they slide.

Lengths are in roots of the source's area. The constants were chosen by the mean errors over eleven pairs of faces and
teeth (tests/bench/correspondence measures more). Tried without gain: springs along the slopes of the descriptors, whose
differences between people say less than the surfaces do; springs back from the source; twice the rounds or nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..flatten.sphere import Flat
from ..mobius import Mobius, SphereMobius
from ..surface.mesh import Booleans, Floats, Integers, Places, TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.statistics import weighted_median
from .coarse import Coarse, coarse
from .least_moved import unfolded
from .noise import shortest
from .plate import NORMAL_WEIGHT, SOLVER_STEPS, TENSION, relaxed
from .pose import ASKED, FEW, MOST, ROUGHLY_BY, in_pose, misfit, rigidly, settled
from .rotations import NEAR_BEND_LENGTH, coarsely_bent, turned_like
from .unfold_sphere import injective_on_sphere

NODES = 1500
"""Target vertices that are bent; all others follow them."""

FINE_NODES = 6000
"""Target vertices of the last rounds, which put right what depends on single triangles (folds fall to a half)."""

STIFFEST, SOFTEST, ROUNDS = 0.5, 0.005, 20
"""The wavelength over 2 pi below which the plate resists: from half the width of the surface to some edges."""

DRAFT_ROUNDS = 10
"""Rounds before boundaries attract each other; by then it is clear which of them correspond."""

FINEST, FINE_ROUNDS = 0.01, 3
"""The least such wavelength after the draft: two and a half distances between nodes, which carry no shorter waves.
Noise makes it longer (`noise.shortest`)."""


@dataclass(frozen=True, eq=False)
class Bending:
    """The target bent onto the source.

    Attributes
    ----------
    carried : (n,) complex128
        Where each target vertex goes in the source's disc; nan at vertices in no face.
    offset : (n,) float64
        How far from the source the bent vertex remains, in roots of the source's area.
    repaired : int
        Vertices that were moved so that no triangle is folded.
    """

    carried: Places
    offset: Floats
    repaired: int


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
    lengths = _lengths(STIFFEST, SOFTEST, ROUNDS)[:rounds]
    now = relaxed(rest, rest, faces, onto, lengths, np.zeros(len(nodes), bool), tell)
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


def finished(
    draft: Draft,
    source: Flat,
    target: Flat,
    alike: Booleans | None = None,
    progress: Callable[[float], None] | None = None,
) -> Bending:
    """Bend a draft the rest of the way.

    Parameters
    ----------
    draft : Draft
    source, target : Flat
        As for `drafted`.
    alike : (n,) bool, optional
        Target vertices that are drawn to the source's boundaries where they are on a boundary themselves; not those
        along which the target alone was cut. Default: all.
    progress : callable, optional
        Called with the share of the work done, in [0, 1]; may raise to end it.

    Returns
    -------
    Bending
        Keeps the orientation of every triangle in the source's disc.
    """
    tell = progress or (lambda _: None)
    onto, unbent, flat, few, conformal = draft.onto, draft.unbent, draft.flat, draft.few, draft.conformal
    drawn = np.ones(len(target.places), bool) if alike is None else alike
    used = np.flatnonzero(target.mesh.used)
    order = [0, 2, 1] if (draft.whole.faces != target.mesh.faces).any() else [0, 1, 2]
    finest = max(FINEST, shortest(source, target))
    lengths = np.maximum(_lengths(STIFFEST, SOFTEST, ROUNDS)[DRAFT_ROUNDS:], finest)
    taut = partial(relaxed, tension=TENSION, steps=SOLVER_STEPS)
    now = taut(draft.rest, draft.now, flat.faces, onto, lengths, drawn[few.nodes], lambda share: tell(0.5 * share))

    tell(0.5)
    fine = coarse(target, FINE_NODES, order)
    tell(0.5)
    followed = few.following(flat.vertices, now, unbent)[fine.nodes]
    start = few.following(flat.vertices, draft.rest, unbent)[fine.nodes]
    lengths = np.full(FINE_ROUNDS, finest)
    drawn = drawn[fine.nodes]
    now = taut(start, followed, fine.faces, onto, lengths, drawn, lambda share: tell(0.5 + 0.3 * share))
    tell(0.8)
    exact = unbent
    if target.exact is not None:  # where smoothing has moved it along the surface it would go astray by as much
        exact = target.exact * ([-1, 1, 1] if order == [0, 2, 1] else [1, 1, 1]) * draft.growth
    all_places = fine.following(unbent[fine.nodes], now, exact)
    if exact is unbent:
        all_places[fine.nodes] = now
    smooth = all_places if exact is unbent else fine.following(unbent[fine.nodes], now, unbent)
    normals = TriangleMesh(smooth, draft.whole.faces).vertex_normals()
    face, barycentric = onto.nearest_point(
        all_places[used], normals[used], progress=lambda share: tell(0.8 + 0.15 * share)
    )
    reached = np.einsum("qk,qkd->qd", barycentric, onto.mesh.vertices[source.mesh.faces[face]])
    offset = np.zeros(len(target.places))
    offset[used] = np.linalg.norm(reached - all_places[used], axis=1)
    carried = conformal.copy()
    carried[used] = source.domain.mean(source.places, source.mesh.faces[face], barycentric)
    tell(0.95)
    faces = target.mesh.faces[:, order]
    if source.domain.closed:
        carried, repaired = injective_on_sphere(carried, conformal, faces, lambda: tell(0.95))
    else:
        vertices = onto.mesh.vertices
        carried, repaired = unfolded(
            carried, conformal, faces, source, target, vertices, all_places, lambda: tell(0.95)
        )
    return Bending(carried, offset, repaired)


def bent(
    mobius: Mobius | SphereMobius,
    source: Flat,
    target: Flat,
    progress: Callable[[float], None] | None = None,
) -> Bending:
    """Bend the target onto the source, all of it: `drafted`, then `finished`."""
    tell = progress or (lambda _: None)
    draft = drafted(mobius, source, target, progress=lambda share: tell(0.4 * share))
    return finished(draft, source, target, progress=lambda share: tell(0.4 + 0.6 * share))


def _lengths(stiffest: float, softest: float, rounds: int) -> Floats:
    """Return the plate's wavelength in each round, (rounds,), falling by equal factors."""
    return np.geomspace(stiffest, softest, rounds)


def _positions(places: Places, source: Flat, onto: SurfacePoints) -> Floats:
    """Return where points of the source's domain lie on the scaled source, (q, 3)."""
    face, barycentric = source.triangles.locate(places)
    return np.einsum("qk,qkd->qd", barycentric, onto.mesh.vertices[source.mesh.faces[face]])


def _growth(mesh: TriangleMesh, places: Floats, trust: Floats) -> float:
    """Return how much longer edges are in `places`, (n, 3), than in the mesh: the median ratio, by trust, (n,)."""
    i, j = mesh.edges.T
    own = np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1)
    there = np.linalg.norm(places[i] - places[j], axis=1)
    some = (own > 0) & (there > 0)
    if not some.any():
        return 1.0
    return weighted_median(there[some] / own[some], (trust[i] * trust[j])[some])
