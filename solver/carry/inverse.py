"""The map the other way: for each vertex of the source, the point of the target that has it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from ..surface.barycentric import interpolated
from ..surface.mesh import Integers, TriangleMesh
from ..surface.nearest import SurfacePoints
from .correspond import Correspondence

ALIKE = 0.03
"""A difference of 1 between unit normals counts as this share of the diagonal, so that of two lips that touch each
keeps to its own; `bend.plate` counts it so, in roots of the area."""


def inverted(found: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Correspondence:
    """Return the correspondence from the target to the source: its rows are the source's vertices.

    The target lies on the source, triangle by triangle; each vertex of the source takes the place in the triangle that
    is nearest. What lies farther off than half the longest side of that triangle has no counterpart: confidence 0.

    Parameters
    ----------
    found : Correspondence
        From `source` to `target`.
    source, target : TriangleMesh
        The meshes that it was made for.

    Raises
    ------
    ValueError
        No triangle of the target lies on the source.
    """
    places = found.matrix() @ source.vertices
    known = (found.face >= 0)[target.faces].all(axis=1)
    if found.leader is not None:  # what rides along lies on nothing
        known &= (found.leader < 0)[target.faces].all(axis=1)
    rows = np.flatnonzero(known)
    if not rows.size:
        raise ValueError("no triangle of the target lies on the source")
    own = source.face_vectors[found.face[target.faces[rows, 0]]]
    there = TriangleMesh(places, target.faces[rows])
    turned = np.median(np.sign(np.einsum("td,td->t", own, there.face_vectors))) < 0
    corners = target.faces[rows][:, [0, 2, 1]] if turned else target.faces[rows]
    size = len(source.vertices)
    face, weights, confidence = np.full(size, -1), np.zeros((size, 3)), np.zeros(size)
    normals, used = source.vertex_normals(), source.used
    part = np.where(used, 0, -1) if found.source_part is None else found.source_part
    of_row = np.zeros(len(rows), np.intp) if found.source_part is None else _part_of(found, target, rows)
    leader = None if found.part is None else np.full(size, -1)
    for one in np.unique(part[part >= 0]):
        mine = np.flatnonzero((part == one) & used)
        with_it = np.flatnonzero(of_row == one)
        if not with_it.size or not mine.size:
            continue
        surface = SurfacePoints(TriangleMesh(places, corners[with_it]), (), ALIKE * source.diagonal)
        at, where = surface.nearest_point(source.vertices[mine], normals[mine])
        near = interpolated(places, corners[with_it][at], where)
        off = np.linalg.norm(near - source.vertices[mine], axis=1)
        face[mine] = rows[with_it[at]]
        weights[mine] = where[:, [0, 2, 1]] if turned else where
        sure = (found.confidence[target.faces[face[mine]]] * weights[mine]).sum(axis=1)
        longest = surface.mesh.edge_lengths[at].max(axis=1)
        confidence[mine] = np.where(off <= longest / 2, sure, 0.0)
    if leader is not None:
        _ride(source, part, face, weights, leader)
    return Correspondence(
        face=face,
        barycentric=weights,
        matched=confidence >= 0.5,
        confidence=confidence,
        source_triangles=target.faces,
        source_size=len(target.vertices),
        part=found.source_part,
        source_part=found.part,
        leader=leader,
    )


def _part_of(found: Correspondence, target: TriangleMesh, rows: Integers) -> Integers:
    """Return the part of the source that triangles of the target lie on, (r,); -1 where corners lie on several."""
    assert found.source_part is not None
    of_vertex = np.where(found.face >= 0, found.source_part[found.source_triangles[found.face, 0]], -1)
    first, *others = of_vertex[target.faces[rows]].T
    return np.where((first == others[0]) & (first == others[1]), first, -1)


def _ride(source: TriangleMesh, part: Integers, face: Integers, weights: np.ndarray, leader: Integers) -> None:
    """Give parts without a counterpart the point of the nearest vertex that has one, which leads them; in place."""
    riding, known = np.flatnonzero((part >= 0) & source.used & (face < 0)), np.flatnonzero(face >= 0)
    if riding.size and known.size:
        leader[riding] = known[KDTree(source.vertices[known]).query(source.vertices[riding])[1]]
        face[riding], weights[riding] = face[leader[riding]], weights[leader[riding]]


def inverse_figures(figures: dict, coverage: float, mean_confidence: float) -> dict:
    """Return what `report` says of an alignment as it holds for the map the other way: what is proved is the same."""
    told = dict(figures)
    for name in ("source", "target"):
        told[name] = figures["target" if name == "source" else "source"]
    for name in ("cut_to", "distortion", "flips_repaired"):
        told[name] = {"source": figures[name]["target"], "target": figures[name]["source"]}
    if figures["overlap"]:
        shares = figures["overlap"]["source_share"], figures["overlap"]["target_share"]
        told["overlap"] = figures["overlap"] | {"source_share": shares[1], "target_share": shares[0]}
    if figures.get("parts"):
        told["parts"] = [pair | {"source": pair["target"], "target": pair["source"]} for pair in figures["parts"]]
    return told | {"coverage": coverage, "mean_confidence": mean_confidence, "inverse": True}
