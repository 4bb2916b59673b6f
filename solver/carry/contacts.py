"""What meets in a displaced source, as lids in a blink, meets on the target, and does not pass through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np
from scipy.spatial import KDTree

from ..surface.barycentric import interpolated
from ..surface.mesh import Booleans, Floats, Integers, TriangleMesh
from ..surface.nearest import nearest_in_triangle
from .gradients import GradientTransfer

CLOSED = 0.3
"""Points meet that are left apart by less than this share of how far they were.

In heads with sockets, eyelids of a blink leave 0.05 to 0.3 of the opening between the rounded rims."""

APPROACH = 0.25
"""Points that come nearer to each other by less than this share of the longest displacement only happen to."""

NEARBY = 16
"""Triangles whose middles are nearest to a point, among which the one that it meets is looked for."""

SOFTNESS = 0.02
"""How much a contact gives way, in displacements by a unit of force: a vertex of the surface itself by about 0.5."""

STEPS = 40
"""Conjugate gradient steps at most."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """Vertices of a displaced surface, each beside a point of the surface that was far off before.

    Attributes
    ----------
    vertex : (c,) int
    corners, barycentric : (c, 3) int and float64
        The nearest such point, in a triangle.
    opening : (c,) float64
        How far the two were apart.
    clearance : (c,) float64
        How far the vertex now is before the triangle's plane; negative: behind it.
    distance : (c,) float64
        How far the two are apart now.
    normal : (c, 3) float64
        Unit normal of the displaced triangle.
    """

    vertex: Integers
    corners: Integers
    barycentric: Floats
    opening: Floats
    clearance: Floats
    distance: Floats
    normal: Floats

    def chosen(self, which: Booleans) -> Contacts:
        """Return some of them, (c,)."""
        return Contacts(*(getattr(self, field.name)[which] for field in fields(self)))

    def across(self, values: Floats) -> Floats:
        """Return by how much values at vertices, (n, 3), take each vertex away from the plane, (c,)."""
        there = interpolated(values, self.corners, self.barycentric)
        return np.einsum("cd,cd->c", values[self.vertex] - there, self.normal)

    def spread(self, force: Floats, size: int) -> Floats:
        """Return the forces on vertices, (size, 3), of forces across the planes, (c,): the transpose of `across`."""
        along = force[:, None] * self.normal
        result = np.zeros((size, 3))
        np.add.at(result, self.vertex, along)
        np.add.at(result, self.corners, -self.barycentric[:, :, None] * along[:, None])
        return result


def facing(
    places: Floats, now: Floats, faces: Integers, vertex: Integers, apart: Floats, among: Integers | None = None
) -> Contacts:
    """Return what lies beside displaced vertices: the nearest point that faces the vertex and was far off before.

    Parameters
    ----------
    places, now : (n, 3) float64
        The surface before and after.
    faces : (m, 3) int
    vertex : (q,) int
    apart : (q,) float64
        How far off it must have been.
    among : (k,) int, optional
        The triangles that are looked at; all of them by default.

    Returns
    -------
    Contacts
        At most one for each vertex: triangles count whose side of the surface is turned to that of the vertex.
    """
    mesh = TriangleMesh(now, faces)
    normals = mesh.vertex_normals()
    across = mesh.face_vectors / np.maximum(2 * mesh.face_areas[:, None], np.finfo(float).tiny)
    if among is None:
        among = np.arange(len(faces))
    count = min(NEARBY, len(among))
    near = among[KDTree(now[faces[among]].mean(axis=1)).query(now[vertex], k=count)[1].reshape(len(vertex), count)]
    best, found = np.full(len(vertex), np.inf), np.full(len(vertex), -1)
    barycentric, opening = np.zeros((len(vertex), 3)), np.zeros(len(vertex))
    for face in near.T:
        corners = faces[face]
        weights = nearest_in_triangle(now[vertex], now[corners])
        distance = np.linalg.norm(interpolated(now, corners, weights) - now[vertex], axis=1)
        before = np.linalg.norm(interpolated(places, corners, weights) - places[vertex], axis=1)
        fits = (np.einsum("qd,qd->q", across[face], normals[vertex]) < 0) & (before > apart) & (distance < best)
        best[fits], found[fits], barycentric[fits], opening[fits] = (
            distance[fits],
            face[fits],
            weights[fits],
            before[fits],
        )
    kept = found >= 0
    result = Contacts(
        vertex[kept],
        faces[found[kept]],
        barycentric[kept],
        opening[kept],
        np.zeros(int(kept.sum())),
        best[kept],
        across[found[kept]],
    )
    return replace(result, clearance=result.across(now))


def find_contacts(places: Floats, moved: Floats, faces: Integers) -> Contacts:
    """Return where a displacement, (n, 3), of points, (n, 3), brings parts of a surface together, face to face."""
    size = np.linalg.norm(moved, axis=1)
    longest = float(size.max(initial=0))
    used = np.zeros(len(places), bool)
    used[faces] = True
    vertex = np.flatnonzero(used & (size > 0.1 * longest))
    found = facing(places, places + moved, faces, vertex, np.full(len(vertex), APPROACH * longest))
    closed = (found.distance < CLOSED * found.opening) & (found.opening - found.distance > APPROACH * longest)
    return found.chosen(closed)


def brought_together(transfer: GradientTransfer, carried: Floats, moved: Floats) -> Floats:
    """Return a carried displacement, (n, 3), by which what meets on the source meets.

    Parameters
    ----------
    transfer : GradientTransfer
        What carried it.
    carried : (n, 3) float64
        Displacements of the target's vertices.
    moved : (n, 3) float64
        Those of their places on the source.

    Notes
    -----
    A vertex that meets something on the source shall be no farther from it, for how far it was, than there; and
    behind it no deeper than there. It may slide. Of all corrections the one is taken that the system of `transfer`
    resists least, where each vertex counts as far as it moves: in a blink the upper lid gives way, and the brow stays.
    It is found in terms of the forces at the contacts, softened so that contacts that contradict each other share the
    difference, and once more for what lies beside the vertices then. Only the largest part meets itself: teeth, eyes
    and lashes lie beside others without touching them, and would be moved as a whole.
    """
    if not moved.any():
        return carried
    places, faces = transfer.target.vertices, transfer.largest
    there = find_contacts(transfer.places, moved, faces)
    if len(there.vertex) == 0:
        return carried
    size = np.linalg.norm(carried, axis=1)
    share = (size / (size + 0.1 * max(float(size.max()), 1e-300)))[:, None]
    met = np.zeros(len(places), bool)
    met[there.corners] = True
    among = np.flatnonzero(met[faces].any(axis=1))
    vertex, apart = there.vertex, 0.5 * there.opening
    # looked for on both surfaces in the same way, so that what is alike stays as it is
    there = facing(transfer.places, transfer.places + moved, faces, vertex, apart, among)
    row = np.full(len(places), -1)
    row[there.vertex] = np.arange(len(there.vertex))
    for _ in range(2):
        here = facing(places, places + carried, faces, vertex, transfer.scale[vertex] * apart, among)
        here = here.chosen(row[here.vertex] >= 0)
        model = there.chosen(row[here.vertex])
        most = np.maximum(model.clearance / model.opening, 0) * here.opening
        least = np.minimum(model.clearance / model.opening, 0) * here.opening
        lack = np.clip(here.clearance, least, most) - here.clearance
        lack[np.abs(lack) < 1e-3 * here.opening] = 0
        if not lack.any():
            break

        yielded = partial(_yielded, transfer, share, here)
        carried = carried + yielded(_solved(partial(_response, yielded, here), lack))
    return carried


def _yielded(transfer: GradientTransfer, share: Floats, contacts: Contacts, force: Floats) -> Floats:
    """Return the displacement, (n, 3), that yields to forces at contacts, (c,); vertices move by shares, (n, 1)."""
    return share * transfer.yielding(share * contacts.spread(force, len(share)))


def _response(yielded: Callable[[Floats], Floats], contacts: Contacts, force: Floats) -> Floats:
    """Return how far forces at contacts, (c,), move them across, (c,)."""
    return contacts.across(yielded(force)) + SOFTNESS * force


def _solved(response: Callable[[Floats], Floats], right: Floats) -> Floats:
    """Return x with response(x) = right, (c,), by conjugate gradients."""
    x = np.zeros_like(right)
    residual, direction = right, right
    square = float((residual**2).sum())
    enough = 1e-4 * square
    for _ in range(STEPS):
        if square <= enough:
            break
        image = response(direction)
        step = square / float((direction * image).sum())
        x, residual = x + step * direction, residual - step * image
        before, square = square, float((residual**2).sum())
        direction = residual + square / before * direction
    return x
