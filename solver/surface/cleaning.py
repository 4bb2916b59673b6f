"""Faces of a scan put in order: degenerate and duplicate ones left out, one orientation, one part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .mesh import Booleans, Integers, MeshError, TriangleMesh, directed_edges, edges_of_sides, plural
from .topology import topology


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A mesh in order and how its faces relate to those of the mesh it came from.

    Attributes
    ----------
    mesh : TriangleMesh
        On the same vertices; the original itself where there was nothing to do.
    faces : (m,) int
        The original face that each face was.
    reversed : (m,) bool
        Faces whose second and third corners changed places.
    changes : tuple of str
        What was done, each as the rest of a sentence about the mesh.
    original_faces : (m_original, 3) int
        The faces as they came.
    """

    mesh: TriangleMesh
    faces: Integers
    reversed: Booleans
    changes: tuple[str, ...]
    original_faces: Integers


def cleaned(mesh: TriangleMesh, *, largest_part: bool = False) -> Cleaned:
    """Leave out degenerate and duplicate faces, turn faces to one side and, on request, keep the largest part alone.

    Vertices stay, in use or not, so that vertex indices keep their meaning.

    Parameters
    ----------
    mesh : TriangleMesh
        Any mesh.
    largest_part : bool
        Keep the part of largest area, where faces that share an edge are connected.

    Raises
    ------
    MeshError
        No face is left, or the faces cannot agree about the outside (a Möbius strip).

    Examples
    --------
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> result = cleaned(TriangleMesh(square, [[0, 1, 2], [0, 1, 1], [0, 3, 2]], "Scan"))
    >>> result.mesh.faces.tolist(), result.changes
    ([[0, 1, 2], [0, 2, 3]], ('1 face with a vertex used twice left out', '1 face turned over'))
    """
    changes: list[str] = []
    degenerate = (mesh.faces == mesh.faces[:, [1, 2, 0]]).any(axis=1)
    if n := int(degenerate.sum()):
        changes.append(f"{plural(n, 'face')} with a vertex used twice left out")
    kept = np.flatnonzero(~degenerate)
    if not kept.size:
        raise MeshError(f"'{mesh.name}' has only faces that use a vertex twice: the file is damaged")
    _, first = np.unique(np.sort(mesh.faces[kept], axis=1), axis=0, return_index=True)
    if n := len(kept) - len(first):
        changes.append(f"{plural(n, 'duplicate face')} left out")
    kept = kept[np.sort(first)]

    if largest_part:
        part = _parts(mesh, kept)
        area = np.bincount(part, mesh.face_areas[kept])
        if len(area) > 1:
            changes.append(f"{plural(len(area) - 1, 'smaller part')} left out")
            kept = kept[part == np.argmax(area)]

    turned = _to_turn(mesh, kept)
    if n := int(turned.sum()):
        changes.append(f"{plural(n, 'face')} turned over")
    if not changes:
        return Cleaned(mesh, kept, turned, (), mesh.faces)
    faces = mesh.faces[kept]
    faces[turned] = faces[turned][:, [0, 2, 1]]
    return Cleaned(TriangleMesh(mesh.vertices, faces, mesh.name), kept, turned, tuple(changes), mesh.faces)


def in_order(mesh: TriangleMesh, *, largest_part: bool = False) -> Cleaned:
    """Return `cleaned` of a mesh that needs it; of one in order, itself.

    Raises
    ------
    MeshError
        It cannot be put in order.
    """
    found = topology(mesh)
    untidy = len(found.degenerate_faces) or len(found.duplicate_faces) or len(found.inconsistent_edges)
    if not untidy and (found.parts == 1 or not largest_part):
        count = len(mesh.faces)
        return Cleaned(mesh, np.arange(count), np.zeros(count, bool), (), mesh.faces)
    try:
        return cleaned(mesh, largest_part=largest_part)
    except MeshError as error:
        if n := len(found.non_manifold_edges):  # why no side can be told
            raise MeshError(
                f"'{mesh.name}' has {plural(n, 'edge')} in three or more faces: delete the extra faces"
            ) from error
        raise


def _pairs(mesh: TriangleMesh, kept: Integers) -> tuple[Integers, Integers, Booleans]:
    """Return pairs of faces, as positions in `kept`, with a common edge, and whether they agree about the outside."""
    faces = mesh.faces[kept]
    edge = edges_of_sides(faces, len(mesh.vertices))[1]
    order = np.argsort(edge, kind="stable")
    shared = edge[order[1:]] == edge[order[:-1]]
    left, right = order[:-1][shared], order[1:][shared]
    start = directed_edges(faces)[:, 0]
    return left // 3, right // 3, start[left] != start[right]


def _parts(mesh: TriangleMesh, kept: Integers) -> Integers:
    left, right, _ = _pairs(mesh, kept)
    links = coo_array((np.ones(len(left), np.int8), (left, right)), shape=(len(kept), len(kept)))
    return connected_components(links, directed=False)[1]


def _to_turn(mesh: TriangleMesh, kept: Integers) -> Booleans:
    """Return which faces to turn, (m,), so that neighbours agree: in each part those with less area.

    Each face exists in both orientations; neighbours that agree connect like with like, others crosswise. A part that
    can be oriented falls into two components, one with every face turned.
    """
    left, right, agree = _pairs(mesh, kept)
    m = len(kept)
    if agree.all():
        return np.zeros(m, bool)
    across = np.where(agree, right, right + m)
    back = np.where(agree, right + m, right)
    links = np.concatenate([left, left + m]), np.concatenate([across, back])
    graph = coo_array((np.ones(len(links[0]), np.int8), links), shape=(2 * m, 2 * m))
    label = connected_components(graph, directed=False)[1]
    if (label[:m] == label[m:]).any():
        raise MeshError(f"'{mesh.name}' has one side only, like a Möbius strip: cut it open")
    area = mesh.face_areas[kept]
    as_is = np.bincount(label, np.concatenate([area, np.zeros(m)]))
    # equal areas: the first face of a part stays
    tie = np.isclose(as_is[label[:m]], as_is[label[m:]], rtol=1e-12)
    return np.where(tie, label[:m] > label[m:], as_is[label[:m]] < as_is[label[m:]])
