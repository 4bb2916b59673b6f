"""What else a map might be, where the search's best is in doubt: maps to be bent and compared with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...bend.coarse import coarse
from ...bend.draft import Draft, facing
from ...bend.moments import posed
from ...bend.pose import FAR, misfit
from ...flatten.sphere import Flat
from ...search.outcome import SearchResult
from ...stages import Part
from ...surface.barycentric import interpolated
from ...surface.mesh import Booleans, Floats, Integers, TriangleMesh
from ...surface.nearest import SurfacePoints
from ...surface.superimposing import superimposing
from ...surface.topology import topology
from ..maps.mobius_map import implied, improved, rival_of, taking, unproved, valued
from ..result.agreement import descriptor_distance
from ..result.alignment import Alignment
from ..result.overlap import shared_nodes
from .own_mirror import mirror_plane, mirrored

POSE_NODES = 300
"""Vertices of the target that look for a rigid pose."""

SIDES = "one of opposite sides of something symmetric"
"""What `by_own_mirror` leads to."""

ROUGH_NODES = 1000
"""Vertices of the source, about, by which poses are compared: on 14 hands, feet, ears, heads and teeth the pose is the
same by all of them, in half the time."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A map that might be the right one, not bent yet.

    Attributes
    ----------
    alignment : Alignment
    start : (n, 3) float64 or None
        Where the bending begins, if not at the Möbius map: see `dense.drafted_from`.
    what : str
        What it is, for people.
    """

    alignment: Alignment
    start: Floats | None
    what: str


def turned(matched: Alignment) -> Alignment | None:
    """Return the best of the orientation that was not taken, refined on all vertices; None if it was not searched."""
    return None if matched.other is None else taking(_other_side(matched, matched.other), None, lambda _: None)


def _other_side(matched: Alignment, other: SearchResult) -> Alignment:
    """Return the alignment by the search of the other orientation; what was said is of the one and its rival."""
    return replace(matched, search=other, other=matched.search, rival=None, remarks=tuple(unproved(other)))


def further(matched: Alignment, count: int, clock: Part) -> Iterator[Hypothesis]:
    """Yield so many further maxima of a search, each far from those before, as some thousand cells show them."""
    known: list[Any] = [matched.search.mobius]
    for number in range(count):
        part = clock.part(number / count, (number + 1) / count)
        part.begin("reconsider", "Trying another map", 0.0)
        rival = rival_of(matched, known, 0.0, part)
        known.append(rival.mobius)
        behind = 100 * (matched.search.value - rival.value) / len(matched.source_samples)
        yield Hypothesis(
            taking(matched, rival, part.within(0.5, 1.0)), None, f"one that scores {behind:.1f} % of the samples less"
        )


def by_pose(matched: Alignment, onto: SurfacePoints, known: Callable[[Floats], bool]) -> Hypothesis | None:
    """Return what the rigid pose leads to in which the target lies best on the source, mirrored or not if both may be.

    None if it is `known` where that puts the target's vertices, (n, 3).

    Parameters
    ----------
    matched : Alignment
    onto : SurfacePoints
        As of `Draft`.
    """
    target = matched.target
    roughly = _by_few(matched.source, onto)
    sides = [matched.mobius.reflected] if matched.other is None else [False, True]
    poses = []
    for reflected in sides:
        whole, order = facing(target.mesh, reflected)
        all_vertices = whole.vertices / np.sqrt(whole.area)
        few = coarse(target, POSE_NODES, order)
        x, apart = posed(TriangleMesh(all_vertices[few.nodes], few.faces), onto, roughly)
        pose = superimposing(all_vertices[few.nodes], x)
        poses.append((apart, reflected, pose(all_vertices), whole.faces))
    _, reflected, start, faces = min(poses, key=lambda pose: pose[:2])
    if known(start):
        return None
    return _in_pose(matched, onto, TriangleMesh(start, faces), reflected, "one that a rigid pose implies")


def _by_few(source: Flat, onto: SurfacePoints) -> SurfacePoints:
    """Return the source, ready for what is bent onto it, by `ROUGH_NODES` of its vertices."""
    few = coarse(source, ROUGH_NODES, [0, 1, 2])
    mesh = TriangleMesh(onto.mesh.vertices[few.nodes], few.faces)
    return SurfacePoints(mesh, topology(mesh).boundary_loops, onto.normal_weight)


def by_own_mirror(matched: Alignment, draft: Draft) -> Hypothesis | None:
    """Return the map that is not mirrored of what may be opposite sides of something symmetric; None if nothing is.

    Where a mirrored map, drafted, puts the target, the source's own plane of symmetry mirrors it once more.
    """
    plane = mirror_plane(draft.onto) if matched.other is not None else None
    if plane is None:
        return None
    target = matched.target.mesh
    whole, _ = facing(target, False)
    rest, there = whole.vertices / np.sqrt(whole.area), mirrored(draft.places(), *plane)
    used = target.used
    pose = superimposing(rest[used], there[used], target.vertex_areas[used])
    start = TriangleMesh(pose(rest), whole.faces)
    return _in_pose(matched, draft.onto, start, False, SIDES)


def _in_pose(matched: Alignment, onto: SurfacePoints, start: TriangleMesh, reflected: bool, what: str) -> Hypothesis:
    """Return what the target in a pose, its faces turned to the source's side, leads to."""
    target = matched.target
    found = matched
    if reflected != matched.mobius.reflected:
        assert matched.other is not None
        found = _other_side(matched, matched.other)
    used = np.flatnonzero(target.mesh.used)
    x = start.vertices[used]
    face, barycentric = onto.nearest_point(x, start.vertex_normals()[used])
    corners = onto.mesh.faces[face]
    near = np.linalg.norm(interpolated(onto.mesh.vertices, corners, barycentric) - x, axis=1) < FAR
    there = found.source.domain.mean(found.source.places, corners, barycentric)
    weights = target.mesh.vertex_areas[used] * near * (found.source.domain.depth(there) > 1e-6)
    mobius = implied(there, target.places[used], weights, reflected)
    found = improved(replace(found, mobius=mobius), found.difference)
    return Hypothesis(replace(found, taken=valued(found.objective, found.mobius)), start.vertices, what)


def unlike(found: Alignment, draft: Draft, there: Booleans) -> float:
    """Return by how much descriptors differ on average, in the draft, where it finds a counterpart; inf if nowhere."""
    used = np.flatnonzero(there & found.target.mesh.used)
    if len(used) == 0:
        return np.inf
    face, barycentric = draft.located(found.target)
    return _difference(found, used, face[used], barycentric[used], found.target.mesh.vertex_areas[used])


def roughly_unlike(found: Alignment, draft: Draft) -> float:
    """Return the same by the nodes of the draft alone."""
    some = shared_nodes(draft, found.source, found.target)
    if not some.any():
        return np.inf
    nodes = TriangleMesh(draft.now, draft.flat.faces)
    face, barycentric = draft.onto.nearest_point(draft.now[some], nodes.vertex_normals()[some])
    return _difference(found, draft.few.nodes[some], face, barycentric, draft.flat.vertex_areas[some])


def _difference(found: Alignment, vertices: Integers, face: Integers, barycentric: Floats, areas: Floats) -> float:
    """Return by how much descriptors of target vertices, (q,), differ from those of source points, by areas, (q,)."""
    there = found.target_descriptors[vertices]
    distance = descriptor_distance(found.source, found.source_descriptors, there, face, barycentric)
    return float(distance @ areas / areas.sum() / np.sqrt(found.source_descriptors.shape[1]))


def apart(draft: Draft) -> float:
    """Return how badly the two surfaces lie on each other in the draft."""
    return misfit(TriangleMesh(draft.now, draft.flat.faces), draft.onto)
