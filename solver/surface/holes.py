"""Openings of a surface closed by flat patches that exist in lengths alone.

A hole is closed by the convex planar polygon with corners on a circle whose sides are as long as the hole's edges. It
cannot fold, whatever shape the hole has in space, and it depends on nothing but those lengths: a mouth that opens
without stretching keeps its patch, so it keeps its place in the disc too.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.optimize import brentq

from .mesh import Complexes, Floats, Integers, TriangleMesh


def filled(mesh: TriangleMesh, loops: Iterable[Integers]) -> tuple[Integers, Floats, int]:
    """Return the surface of a mesh with holes closed: faces, (m, 3), side lengths, (m, 3), and the vertex count.

    Parameters
    ----------
    mesh : TriangleMesh
        Its faces come first in the result, its vertices too.
    loops : iterable of (k,) int
        Boundary loops to close, in the direction of the surface's boundary.
    """
    faces, lengths, count = [mesh.faces], [mesh.edge_lengths], len(mesh.vertices)
    for loop in loops:
        rim = loop[::-1]
        sides = np.linalg.norm(mesh.vertices[np.roll(rim, -1)] - mesh.vertices[rim], axis=1)
        patch, points = _patch(cyclic_polygon(sides))
        names = np.concatenate([rim, count + np.arange(len(points) - len(rim))])
        faces.append(names[patch])
        lengths.append(_patch_lengths(patch, points, sides))
        count += len(points) - len(rim)
    return np.concatenate(faces), np.concatenate(lengths), count


def cyclic_polygon(sides: Floats) -> Complexes:
    """Return the corners, (k,), counter-clockwise, of the convex polygon with these side lengths and a circumcircle.

    Side i runs from corner i to corner i + 1. One side as long as all others together (a slit) is shortened by a
    hundredth, so that the polygon has an inside.

    >>> np.abs(np.diff(cyclic_polygon(np.array([3.0, 4.0, 5.0])))).round(9).tolist()
    [3.0, 4.0]
    """
    longest = int(np.argmax(sides))
    sides = sides.copy()
    sides[longest] = min(sides[longest], 0.99 * np.delete(sides, longest).sum())
    longest = int(np.argmax(sides))
    share = sides / sides[longest]

    # half the angle of a side seen from the centre is asin(share reach), reach = the longest side over the diameter
    if np.arcsin(share).sum() >= np.pi:
        reach = brentq(lambda r: float(np.arcsin(share * r).sum() - np.pi), 1e-12, 1, xtol=1e-15)
        half = np.arcsin(share * reach)
    else:  # the centre lies outside, beyond the longest side
        reach = brentq(lambda r: float(np.arcsin(share * r).sum() - 2 * np.arcsin(r)), 1e-6, 1, xtol=1e-15)
        half = np.arcsin(share * reach)
        half[longest] = np.pi - half[longest]
    around = 2 * np.concatenate([[0], np.cumsum(half[:-1])])
    return sides[longest] / (2 * reach) * np.exp(1j * around)


def _patch(rim: Complexes) -> tuple[Integers, Complexes]:
    """Triangulate a convex polygon: rings towards its centre, each with half the corners of the one around it.

    Harmonic functions vary over lengths that grow with the distance from the rim; so do the triangles. Returns faces,
    (m, 3), counter-clockwise, and points, (p,): the rim first.
    """
    points, faces = [rim], []
    ring, first = rim, 0
    while (k := len(ring)) > 6:
        kept = ring[::2]
        centre = _centroid(kept)
        inner = centre + (1 - 5 / k if k > 8 else 0.4) * (kept - centre)
        outer = first + np.arange(k)
        after = np.roll(outer, -1)
        below = first + k + np.arange(k) // 2
        below_after = first + k + (np.arange(k) // 2 + 1) % len(inner)
        odd = np.arange(k) % 2 == 1
        faces.append(np.stack([outer, after, np.where(odd, below_after, below)], axis=1))
        faces.append(np.stack([outer, below_after, below], axis=1)[odd])
        if k % 2:
            faces.append(np.stack([after, below_after, below], axis=1)[-1:])
        points.append(inner)
        ring, first = inner, first + k
    outer = first + np.arange(len(ring))
    faces.append(np.stack([outer, np.roll(outer, -1), np.full(len(ring), first + len(ring))], axis=1))
    return np.concatenate(faces), np.concatenate([*points, [_centroid(ring)]])


def _centroid(polygon: Complexes) -> complex:
    """Return the centre of mass of a polygon's inside."""
    start = polygon - polygon[0]
    stop = np.roll(start, -1)
    cross = np.imag(np.conj(start) * stop)
    return complex(polygon[0] + ((start + stop) * cross).sum() / (3 * cross.sum()))


def _patch_lengths(patch: Integers, points: Complexes, rim: Floats) -> Floats:
    """Return the side lengths of a patch, (m, 3): on the rim the given ones, so that both faces of an edge agree."""
    corners = points[patch]
    lengths = np.abs(corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]])
    start, stop = patch[:, [1, 2, 0]], patch[:, [2, 0, 1]]
    on_rim = (start < len(rim)) & (stop < len(rim))
    lengths[on_rim] = rim[start[on_rim]]
    # a slit's long side may be longer than its place in the polygon: the sides inside grow to reach its ends
    lack = (2 * lengths * on_rim).sum(axis=1) - lengths.sum(axis=1)
    grow = float(lack[on_rim.any(axis=1)].max()) / 2 + 1e-6 * rim.max()
    return np.where(on_rim, lengths, lengths + max(grow, 0.0))
