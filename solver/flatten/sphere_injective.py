"""Maps to the sphere without triangles turned over: their repair in gnomonic charts, and their proof."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..surface.mesh import Booleans, Complexes, Floats, Integers, MeshError, TriangleMesh, directed_edges, plural
from .distortion import signed_volumes
from .injective import shrinkage, untangled

CHART = 0.4
"""Cosine of the radius of a chart, some 66 degrees: beyond, a gnomonic chart stretches more than sixfold."""

COARSE = 6
"""Powers of 10 that areas shrink by up to which it is not numbers that fail: geodesics between few vertices, some of
them far apart, cross where the straight lines of the plane do not."""

LITTLE, CROWDED = 1e-6, 0.1
"""A surface has no room on a sphere where more than this share of its area shrinks there to less than that of what it
would have evenly: of two whole bodies 0.23 and 0.25 does, of hands up to 0.05, of heads, feet and cortices none."""

DIGITS, LOST = 16, 0.01
"""And where this share shrinks by more than a double has digits: the bodies' legs and arms, by 10^17 and more. A thigh
bone, of which 0.63 shrinks by a million and nothing by more than 10^13, still goes, if doubtfully."""

MOST_CHARTS = 100
"""Repairs of places where triangles are turned over; more are no map to be repaired."""


def require_injective(mesh: TriangleMesh, sphere: Floats) -> None:
    """Raise `MeshError` unless a map to the sphere, (n, 3), is injective.

    It is if every triangle is counter-clockwise, which is decided in exact arithmetic where rounding leaves it open,
    and all of them cover the sphere once: a map that is nowhere turned over covers it a whole number of times, its
    degree, with branch points where that is more than 1. The degree is the sum of the solid angles over 4 pi.
    """
    if np.isfinite(sphere[mesh.used]).all():
        count = int(collapsed(sphere, mesh.faces).sum())
        if not count and round(float(solid_angles(sphere, mesh.faces).sum()) / (4 * np.pi)) == 1:
            return
        what = f"{plural(count, 'triangle')} would be turned over or lost" if count else "it would be covered twice"
    else:
        what = "parts of it would be lost"
    covered = np.abs(solid_angles(np.nan_to_num(sphere), mesh.faces)) / (4 * np.pi)
    power = shrinkage(mesh, covered)
    if power < COARSE:
        raise MeshError(f"'{mesh.name}' is too coarse for a map to the sphere: {what}: subdivide it")
    raise MeshError(
        f"'{mesh.name}' juts out too far for a sphere: {what}, as parts shrink to 1/10^{power} of their area there: "
        "cut off what juts out, as arms and legs"
    )


def require_room(mesh: TriangleMesh, sphere: Floats) -> None:
    """Raise `MeshError` if a map to the sphere, (n, 3), leaves much of the surface hardly any room, and some none."""
    covered = np.abs(solid_angles(sphere, mesh.faces)) / (4 * np.pi)
    areas = mesh.face_areas / mesh.area
    crowded, lost = (float(areas[covered < areas * least].sum()) for least in (LITTLE, 10.0**-DIGITS))
    if crowded > CROWDED and lost > LOST:
        raise MeshError(
            f"'{mesh.name}' juts out too far for a sphere: {crowded:.0%} of it would shrink there by more than a "
            f"million, parts to 1/10^{shrinkage(mesh, covered)} of their area: cut off what juts out, as arms and legs"
        )


def solid_angles(sphere: Floats, faces: Integers) -> Floats:
    """Return the signed area of each triangle of geodesics, (m,), on the unit sphere.

    Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle" (1983).
    """
    a, b, c = (sphere[faces[:, k]] for k in range(3))
    under = 1 + (a * b).sum(axis=1) + (b * c).sum(axis=1) + (c * a).sum(axis=1)
    result: Floats = 2.0 * np.arctan2(signed_volumes(sphere, faces), under)
    return result


def collapsed(sphere: Floats, faces: Integers) -> Booleans:
    """Return which triangles, (m,), are not counter-clockwise seen from outside, in exact arithmetic.

    Lengths of the points do not matter: det(a, b, c) has the same sign for all positive multiples.
    """
    a, b, c = (sphere[faces[:, k]] for k in range(3))
    volumes = signed_volumes(sphere, faces)
    result = volumes <= 0
    # two differences, six products and five sums: off by less than 16 units in the last place of what this bounds
    sizes = [np.abs(x).max(axis=1) for x in (a, b - a, c - a)]
    bound = 1e-14 * np.maximum(sizes[0] * sizes[1] * sizes[2], np.finfo(float).tiny)
    for face in np.flatnonzero(np.abs(volumes) <= bound).tolist():
        x, y, z = ([Fraction(float(v)) for v in p[face]] for p in (a, b, c))
        minors = [y[i - 2] * z[i - 1] - y[i - 1] * z[i - 2] for i in range(3)]
        result[face] = sum(u * v for u, v in zip(x, minors, strict=True)) <= 0
    return result


def untangled_sphere(mesh: TriangleMesh, lengths: Floats, sphere: Floats) -> Floats:
    """Return the map, (n, 3), with no triangle turned over, changed around the turned ones alone, as far as it goes.

    In a gnomonic chart geodesics are straight, so that what puts a plane map right (`injective.untangled`) does it
    here, place by place.

    Parameters
    ----------
    mesh : TriangleMesh
    lengths : (m, 3) float64
        Of its sides, each triangle inequality strict.
    sphere : (n, 3) float64
    """

    def repaired(chosen: Integers, plane: Complexes, rim: Integers) -> Complexes:
        return untangled(mesh.faces[chosen], lengths[chosen], plane, rim)

    return in_charts(mesh.faces, sphere, repaired)


def in_charts(
    faces: Integers, sphere: Floats, repaired: Callable[[Integers, Complexes, Integers], Complexes]
) -> Floats:
    """Return the map, (n, 3), put right around its turned triangles, one connected place of them after another.

    `repaired` takes the faces of a chart, the places, (n,), of all vertices in it, and the vertices that have to stay,
    and returns the places.
    """
    result = sphere.copy()
    for _ in range(MOST_CHARTS):
        turned = signed_volumes(result, faces) <= 0
        if not turned.any():
            break
        corners = faces[turned]
        size = len(result)
        links = coo_array(
            (np.ones(corners.size, np.int8), (corners.ravel(), np.roll(corners, 1, 1).ravel())), (size,) * 2
        )
        part = connected_components(links, directed=False)[1][corners[:, 0]]
        place = corners[part == part[0]]
        axis = result[np.unique(place)].mean(axis=0)
        if not np.linalg.norm(axis) > 0.5:  # a place as large as that is no place
            break
        axis = axis / np.linalg.norm(axis)
        height = result @ axis
        chosen = np.flatnonzero((height[faces] > CHART).all(axis=1))
        away = np.eye(3)[np.argmin(np.abs(axis))]
        right = np.cross(away, axis)
        right /= np.linalg.norm(right)
        up = np.cross(axis, right)
        inside = np.zeros(size, bool)
        inside[faces[chosen]] = True
        flat = np.zeros(size, np.complex128)
        flat[inside] = (result[inside] @ right + 1j * (result[inside] @ up)) / height[inside]
        moved = repaired(chosen, flat, _rim(faces[chosen]))
        changed = np.flatnonzero(inside & (moved != flat))
        before = int(turned.sum())
        trial = result.copy()
        points = axis + moved[changed, None].real * right + moved[changed, None].imag * up
        trial[changed] = points / np.linalg.norm(points, axis=1, keepdims=True)
        if int((signed_volumes(trial, faces) <= 0).sum()) >= before:
            break
        result = trial
    return result


def _rim(faces: Integers) -> Integers:
    """Return the vertices on the boundary of some faces, (k,)."""
    sides = np.sort(directed_edges(faces), axis=1)
    ends, count = np.unique(sides, axis=0, return_counts=True)
    return np.unique(ends[count == 1])
