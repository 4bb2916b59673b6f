"""One surface bent into the shape of another through their correspondence, each with the triangles that it has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ..surface.barycentric import weighted
from ..surface.cholesky import factorised
from ..surface.laplacian import laplacian
from ..surface.mesh import Booleans, Floats, Integers, TriangleMesh
from ..surface.superimposing import superimposing
from .correspond import Correspondence
from .fill import nearest_known
from .interpolate import places
from .seams import nearest_triangles

REACH = 1 / np.sqrt(3)
"""How far from a known place a vertex still counts as matched, in the longest side of its triangles: no point of
a triangle is farther from its nearest corner, and that of an equilateral one is."""

UNFOLD_ROUNDS = 10
"""Attempts to take folds out, each listening to less of what lies around them."""

_ABSENT = 1e-9
"""What holds vertices that nothing is known about, as a share of what holds others: the system stays regular."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A surface in the shape of another.

    Attributes
    ----------
    vertices : (n, 3) float64
        Where its vertices lie.
    matched : (n,) bool
        Whether that comes from the correspondence; the others were filled in smoothly.
    reflected : bool
        Whether the correspondence mirrors the surface: its faces have to be turned round to keep their outside.
    folded : int
        Triangles that are folded over and are not on the surface as it was.
    """

    vertices: Floats
    matched: Booleans
    reflected: bool
    folded: int


def wrapped(correspondence: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Fitted:
    """Return the source in the shape of the target: its own triangles, wrapped onto the other surface.

    The source, in the best pose, is displaced such that the places that target vertices have on it come to lie at those
    vertices: least squares, plus l^4 times the integral of the squared Laplacian of the displacement (a thin plate),
    which fills in what is unmatched. pi l is the distance between target vertices, so that waves that these cannot
    show (Nyquist) are halved at least. Then vertices go to the nearest point of the target. Where triangles fold, the
    places around are hardly listened to any more.

    Parameters
    ----------
    correspondence : Correspondence
        Of target vertices; those that are not `matched` say nothing.
    source, target : TriangleMesh
        In one unit of length or in different ones.

    Raises
    ------
    ValueError
        Fewer than three vertices are matched.
    """
    known = _known(correspondence)
    place = places(correspondence, source.vertices)[1]
    reflected = is_reflected(correspondence, source, target)
    weight = np.where(known, target.vertex_areas * correspondence.confidence, 0)
    pose = superimposing(place[known], target.vertices[known], weight[known], mirrored=reflected, scaled=True)
    rest = TriangleMesh(pose(source.vertices), source.faces)
    spacing = np.sqrt(target.vertex_areas[known].mean())
    matched = _near_places(source, target, place, known)
    rows = csr_array(correspondence.matrix()[known])
    aims = target.vertices[known]
    plate = _Plate(rest, spacing / np.pi)
    listened = weight[known]
    vertices = plate.drawn(rows, aims, listened)
    for rounds in range(UNFOLD_ROUNDS):
        over = folds(rest, vertices)
        if not over.any():
            break
        near = _around(source, over, 1 + rounds // 2)
        listened = np.where(rows @ near.astype(float) > 0, listened * 0.01, listened)
        vertices = plate.drawn(rows, aims, listened)
    vertices = _onto(rest, vertices, target, matched, spacing, reflected)
    return Fitted(vertices, matched, reflected, int(folds(rest, vertices).sum()))


def in_shape_of(correspondence: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Fitted:
    """Return the target in the shape of the source: its own triangles, each vertex at its place on the source.

    The source is in the pose, of one scale, that lies best on the target, mirrored if the correspondence mirrors it.
    The displacement of unmatched vertices is that of a thin plate through the others.

    Raises
    ------
    ValueError
        Fewer than three vertices are matched.
    """
    known = _known(correspondence)
    place = places(correspondence, source.vertices)[1]
    reflected = is_reflected(correspondence, source, target)
    areas = target.vertex_areas[known]
    posed = superimposing(place[known], target.vertices[known], areas, mirrored=reflected, scaled=True)(place)
    rows = csr_array(diags_array(np.ones(len(known))))[known]
    # exact where known, but for a hundredth of the distance between vertices
    plate = _Plate(target, 0.01 * np.sqrt(target.vertex_areas[known].mean()))
    vertices = np.where(known[:, None], posed, plate.drawn(rows, posed[known], target.vertex_areas[known]))
    over = folds(target, vertices)
    free = np.zeros(len(known), bool)
    for rounds in range(UNFOLD_ROUNDS):
        if not over.any():
            break
        free |= _around(target, over, 1 + rounds // 2)
        held = known & ~free
        if held.sum() < 3:
            break
        rows = csr_array(diags_array(np.ones(len(held))))[held]
        vertices = np.where(held[:, None], posed, plate.drawn(rows, posed[held], target.vertex_areas[held]))
        over = folds(target, vertices)
    return Fitted(vertices, known & ~free, False, int(over.sum()))


def is_reflected(correspondence: Correspondence, source: TriangleMesh, target: TriangleMesh) -> bool:
    """Return whether most of the matched area is turned over by the correspondence: it mirrors the surface."""
    known = correspondence.matched & (correspondence.face >= 0)
    whole = target.faces[known[target.faces].all(axis=1)]
    image = TriangleMesh(places(correspondence, source.vertices)[1], whole) if len(whole) else None
    if image is None:
        return False
    outward = places(correspondence, source.vertex_normals())[1][whole].sum(axis=1)
    return bool((image.face_vectors * outward).sum() < 0)


def folds(before: TriangleMesh, vertices: Floats) -> Booleans:
    """Return which triangles, (m,), look against the surface around them, and did not before."""

    def against(mesh: TriangleMesh) -> Booleans:
        around = mesh.vertex_normals()[mesh.faces].sum(axis=1)
        return (mesh.face_vectors * around).sum(axis=1) < 0

    return against(TriangleMesh(vertices, before.faces)) & ~against(before)


def _known(correspondence: Correspondence) -> Booleans:
    """Return which target vertices, (n,), are matched; raises ValueError if they tell no pose."""
    known = correspondence.matched & (correspondence.face >= 0)
    if known.sum() < 3:
        raise ValueError("fewer than three vertices are matched")
    return known


class _Plate:
    """A thin plate on a surface, drawn to places."""

    def __init__(self, rest: TriangleMesh, length: float) -> None:
        self.rest = rest
        stiffness, self.areas = laplacian(rest), rest.vertex_areas
        floor = 1e-3 * self.areas[rest.used].mean()
        self.energy = length**4 * (stiffness @ diags_array(1 / np.maximum(self.areas, floor)) @ stiffness)
        self.held = diags_array(_ABSENT * np.maximum(self.areas, floor))
        self.part = connected_components(stiffness, directed=False)[1]

    def drawn(self, rows: csr_array, aims: Floats, weight: Floats) -> Floats:
        """Return the vertices, (n, 3), that bring points of the surface, `rows` (k, n), to `aims` (k, 3), by weight."""
        drawn = csr_array(rows.T @ diags_array(weight))
        system = csc_array(drawn @ rows + self.energy + self.held)
        shift = factorised(system)(drawn @ (aims - rows @ self.rest.vertices))
        told = (np.bincount(self.part, drawn.sum(axis=1)) > 0)[self.part]
        if not told.all():  # parts of which nothing is known ride along with what is nearest
            shift = shift[nearest_known(self.rest, told & self.rest.used)]
        return self.rest.vertices + shift


def _around(mesh: TriangleMesh, faces: Booleans, rings: int) -> Booleans:
    """Return which vertices, (n,), are in some faces, (m,), or up to so many rings around them."""
    near = np.zeros(len(mesh.vertices), bool)
    for _ in range(rings + 1):
        near[mesh.faces[faces]] = True
        faces = near[mesh.faces].any(axis=1)
    return near


def _near_places(source: TriangleMesh, target: TriangleMesh, place: Floats, known: Booleans) -> Booleans:
    """Return which source vertices, (n_source,), lie among the places, (n_target, 3), of known target vertices."""
    whole = target.faces[known[target.faces].all(axis=1)]
    if len(whole) == 0:
        return np.zeros(len(source.vertices), bool)
    longest = np.zeros(len(place))
    np.maximum.at(longest, whole.ravel(), np.repeat(TriangleMesh(place, whole).edge_lengths.max(axis=1), 3))
    there = np.flatnonzero(known & (longest > 0))
    distance, nearest = KDTree(place[there]).query(source.vertices)
    return (distance <= REACH * longest[there][nearest]) & source.used


def _onto(
    rest: TriangleMesh, vertices: Floats, target: TriangleMesh, matched: Booleans, spacing: float, reflected: bool
) -> Floats:
    """Return vertices, (n, 3), of which the matched ones lie on the target, but for those that would fold a triangle.

    What lies beyond the target's rim, on its other side or farther off than its vertices from each other stays.
    """
    chosen = np.flatnonzero(matched)
    corners = target.vertices[target.faces]
    face, barycentric = nearest_triangles(corners, vertices[chosen], np.empty((len(chosen), 0), int))
    point = weighted(corners[face], barycentric)
    normals = TriangleMesh(vertices, rest.faces).vertex_normals()[chosen] * (-1 if reflected else 1)
    at_rim = ((barycentric <= 1e-12) & (target.twins.reshape(-1, 3)[face] < 0)).any(axis=1)
    near = np.linalg.norm(point - vertices[chosen], axis=1) <= spacing
    fits = near & ~at_rim & ((normals * target.face_vectors[face]).sum(axis=1) > 0)
    result, snapped = vertices.copy(), chosen[fits]
    result[snapped] = point[fits]
    for _ in range(UNFOLD_ROUNDS):
        more = folds(rest, result) & ~folds(rest, vertices)
        if not more.any():
            break
        back = _around(rest, more, 0)
        result[back] = vertices[back]
    return result


def frames_of(mesh: TriangleMesh) -> Correspondence:
    """Return the correspondence of a surface with itself, each vertex at itself.

    With it `local_similarities` tells how directions turn from one of the surface's shapes to another.
    """
    face = np.full(len(mesh.vertices), -1)
    corner: Integers = mesh.faces.ravel()
    face[corner] = np.arange(len(corner)) // 3
    barycentric = (mesh.faces[face] == np.arange(len(face))[:, None]).astype(float) * (face >= 0)[:, None]
    known = face >= 0
    return Correspondence(face, barycentric, known, known.astype(float), mesh.faces, len(mesh.vertices))
