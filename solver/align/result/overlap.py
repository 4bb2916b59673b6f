"""Partial overlap: which parts of two surfaces show the same, and these parts as surfaces of their own.

Where two discs show different pieces their conformal maps differ by no Möbius transformation, and the error grows
towards the cuts. A bent draft shows what of either surface lies beyond the other's boundary; the discs of the rest do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...bend.draft import Draft
from ...bend.plate import RIM_REACH
from ...flatten.sphere import Flat
from ...surface.barycentric import interpolated
from ...surface.mesh import Booleans, Floats, Integers, TriangleMesh
from ...surface.nearest import SurfacePoints
from ...surface.topology import regions

BEYOND = 0.01
"""How far past the other's boundary, in roots of the source's area, a point has no counterpart: what drafts err by."""

LARGE = 30_000
"""Points from which on those far from all boundaries of the other surface are not asked for their nearest one."""


def shared(
    draft: Draft, source: Flat, target: Flat, progress: Callable[[float], None] | None = None
) -> tuple[Booleans, Booleans]:
    """Return which source vertices, (n_source,), and target vertices, (n_target,), have a counterpart in the other.

    `progress` is called with the share of the work done, in [0, 1], and may raise to end it.
    """
    if not (source.loops or target.loops):
        return np.ones(len(source.places), bool), np.ones(len(target.places), bool)
    tell = progress or (lambda _: None)
    places = draft.places()
    bent = draft.whole.moved(places)
    onto = draft.onto
    back = SurfacePoints(bent, (target.boundary, *target.holes), onto.normal_weight)
    here = ~_left_over(onto.mesh, back, lambda share: tell(share / 2))
    return here, ~_left_over(bent, onto, lambda share: tell((1 + share) / 2))


def shared_nodes(draft: Draft, source: Flat, target: Flat) -> Booleans:
    """Return which nodes of a draft, (q,), have a counterpart on the source, by themselves: nearly as `shared` says."""
    if not (source.loops or target.loops):
        return np.ones(len(draft.now), bool)
    return ~_left_over(TriangleMesh(draft.now, draft.flat.faces), draft.onto, lambda _: None)


def _left_over(mesh: TriangleMesh, surface: SurfacePoints, progress: Callable[[float], None]) -> Booleans:
    """Return which vertices of the mesh, (n,), lie more than `BEYOND` past a boundary of the surface.

    A strip all of which lies within `RIM_REACH` is not left over: boundaries so near each other are the same one.
    """
    depth = depth_beyond(mesh.vertices, mesh.vertex_normals(), surface, progress)
    past = depth > BEYOND
    i, j = mesh.edges[past[mesh.edges].all(axis=1)].T
    count = len(depth)
    label = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(count, count)), directed=False)[1]
    deepest = np.zeros(count)
    np.maximum.at(deepest, label, depth)
    return past & (deepest[label] > RIM_REACH)


def depth_beyond(
    points: Floats, normals: Floats, surface: SurfacePoints, progress: Callable[[float], None] | None = None
) -> Floats:
    """Return how far each point, (q,), lies past a boundary of the surface, measured along it; 0 over the surface."""
    faces, vertices = surface.mesh.faces, surface.mesh.vertices
    depth = np.zeros(len(points))
    asked = np.arange(len(points))
    tell = progress or (lambda _: None)
    if len(points) >= LARGE:
        asked = np.flatnonzero(surface.may_be_beyond(points, normals, lambda share: tell(share / 2)))
        points, normals = points[asked], normals[asked]
    face, barycentric = surface.nearest_point(points, normals, progress=lambda share: tell((1 + share) / 2))
    on_rim = np.zeros(len(vertices), bool)
    on_rim[np.concatenate(surface.loops)] = True
    edge = np.flatnonzero((on_rim[faces[face]] | (barycentric < 1e-9)).all(axis=1))
    at = interpolated(vertices, faces[face[edge]], barycentric[edge])
    up = surface.mesh.face_vectors[face[edge]]
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), np.finfo(float).tiny)
    step = points[edge] - at
    step -= (step * up).sum(axis=1, keepdims=True) * up
    depth[asked[edge]] = np.linalg.norm(step, axis=1)
    return depth


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a surface that is a disc itself.

    Attributes
    ----------
    mesh : TriangleMesh
    vertices, faces : (n,) int, (m,) int
        What vertices and faces of the whole surface they are.
    cut : (n,) bool
        Vertices on its outer boundary that are inside the whole surface.
    outer : int
        A vertex on its outer boundary.
    """

    mesh: TriangleMesh
    vertices: Integers
    faces: Integers
    cut: Booleans
    outer: int


def piece(whole: Flat, kept: Booleans) -> Piece | None:
    """Return the disc that consists of about the faces between `kept` vertices, (n,); None where hardly any is left.

    The largest part of them, with what it encloses (openings of the surface stay open), less the corners by which parts
    merely touch.
    """
    mesh = whole.mesh
    neighbour = np.where(mesh.twins < 0, -1, mesh.twins // 3).reshape(-1, 3)
    outside = np.zeros(len(mesh.vertices), bool)
    outside[whole.boundary] = True
    # across a side on the outer boundary lies the outside
    at_rim = ((neighbour < 0) & outside[mesh.faces[:, [1, 2, 0]]] & outside[mesh.faces[:, [2, 0, 1]]]).any(axis=1)
    wanted = kept[mesh.faces].all(axis=1)
    while True:
        if not wanted.any():
            return None
        label = regions(mesh, wanted)
        area = np.bincount(label, mesh.face_areas * wanted)
        largest = label == np.argmax(area)
        label = regions(mesh, largest)
        open_parts = np.zeros(label.max() + 1, bool)
        open_parts[label[at_rim]] = True
        inside = largest | ~open_parts[label]
        sides = inside[:, None] & ~((neighbour >= 0) & inside[neighbour])
        rim = np.concatenate([mesh.faces[:, [1, 2, 0]][sides], mesh.faces[:, [2, 0, 1]][sides]])
        touching = np.bincount(rim, minlength=len(mesh.vertices)) > 2
        if not touching.any():
            break
        wanted = inside & ~touching[mesh.faces].any(axis=1)
    faces = np.flatnonzero(inside)
    vertices, place = np.unique(mesh.faces[faces], return_inverse=True)
    cut_sides = sides & (neighbour >= 0)
    on_cut = np.zeros(len(mesh.vertices), bool)
    on_cut[mesh.faces[:, [1, 2, 0]][cut_sides]] = True
    on_cut[mesh.faces[:, [2, 0, 1]][cut_sides]] = True
    outer = np.flatnonzero((on_cut | outside)[vertices])
    return Piece(
        TriangleMesh(mesh.vertices[vertices], place.reshape(-1, 3), mesh.name),
        vertices,
        faces,
        on_cut[vertices],
        int(outer[0]),
    )
