"""A map into the disc made injective: turned triangles interpolated away, around them alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import isotonic_regression
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.spatial import KDTree

from ..flatten.distortion import signed_areas
from ..flatten.harmonic import factorised
from ..surface.mesh import Booleans, Complexes, Integers

REPAIR_ROUNDS = 20
"""Attempts to unfold, each on patches one ring larger."""


def injective(
    carried: Complexes,
    conformal: Complexes,
    faces: Integers,
    boundary: Integers,
    holes: tuple[Integers, ...],
    tell: Callable[[], None] = lambda: None,
) -> tuple[Complexes, int]:
    """Return the map with no triangle turned over or collapsed, and how many vertices were moved for it.

    The boundary is put in order first, and the displacement from the Möbius map interpolated across patches around what
    is turned over (`_interpolated`). Where these do not come to an end, the displacement fades around them: by
    quarters, and over ever wider surroundings, until at last the Möbius map itself is left, which is injective.
    """
    ordered = carried.copy()
    ordered[boundary] = in_order(carried[boundary], conformal[boundary])
    links = mean_value_weights(conformal, faces)
    result = _interpolated(ordered, conformal, faces, links, boundary, holes, tell)
    turned = _turned(result, faces)
    near = np.zeros(len(carried), bool)
    reach = 0.0
    while turned.any() and reach < 8:  # from 4 on nothing but the Möbius map is left
        near[faces[turned]] = True
        # steep enough fading would turn triangles over by itself
        reach = max(2 * reach, 4 * float(np.abs(ordered - conformal)[near].max()), 1e-3)
        distance = np.full(len(carried), np.inf)
        used = np.flatnonzero(np.isfinite(conformal.real))
        tree = KDTree(np.stack([conformal[near].real, conformal[near].imag], axis=1))
        distance[used] = tree.query(np.stack([conformal[used].real, conformal[used].imag], axis=1))[0]
        share = np.clip(2 - 2 * distance / reach, 0, 1)
        for quarters in range(1, 5):
            faded = ordered - quarters / 4 * share * (ordered - conformal)
            result = _interpolated(faded, conformal, faces, links, boundary, holes, tell)
            turned = _turned(result, faces)
            if not turned.any():
                break
    return result, int((np.abs(result - carried) > 0).sum())


def _interpolated(
    start: Complexes,
    conformal: Complexes,
    faces: Integers,
    links: csr_array,
    boundary: Integers,
    holes: tuple[Integers, ...],
    tell: Callable[[], None],
) -> Complexes:
    """Return the map with its displacement from the Möbius map interpolated across patches around turned triangles.

    Inside, vertices become those means of their neighbours that they are in the Möbius map; on the boundary the
    logarithm of the ratio to it is linear in the angle between the vertices that stay. Patches grow, a ring at a time,
    where they hold a turned triangle; one that is the whole disc holds none (Floater 2003), if there are no openings.
    """
    size = len(start)
    inside = np.zeros(size, bool)
    inside[faces] = True
    inside[np.concatenate([boundary, *holes])] = False
    result, free = start, np.zeros(size, bool)
    for _ in range(REPAIR_ROUNDS):
        tell()
        turned = _turned(result, faces)
        if not turned.any():
            break
        near = np.zeros(size, bool)
        near[faces[turned]] = True
        free |= near | (links @ (near & free) > 0)
        result = start.copy()
        result[boundary] = _along_boundary(start[boundary], conformal[boundary], free[boundary])
        patch = np.flatnonzero(free & inside)
        if patch.size:
            rows = links[patch]
            held = np.where(np.isfinite(result.real), result, 0)
            held[patch] = 0
            pulled = rows @ np.stack([held.real, held.imag], axis=1)
            mean = factorised(csc_array(diags_array(rows.sum(axis=1)) - rows[:, patch]))(pulled)
            result[patch] = mean[:, 0] + 1j * mean[:, 1]
    return result


def _along_boundary(places: Complexes, conformal: Complexes, free: Booleans) -> Complexes:
    """Return boundary places, (k,), the free ones' log ratio to the Möbius map's interpolated between the others'."""
    if not free.any():
        return places
    ratio = np.log(places / conformal)
    if free.all():
        return conformal * np.exp(ratio.mean())
    angle = np.abs(np.unwrap(np.angle(conformal / conformal[0])))
    held = np.flatnonzero(~free)
    filled = [np.interp(angle, angle[held], part[held], period=2 * np.pi) for part in (ratio.real, ratio.imag)]
    return np.where(free, conformal * np.exp(filled[0] + 1j * filled[1]), places)


def in_order(carried: Complexes, conformal: Complexes) -> Complexes:
    """Return boundary places, (k,), whose angles run on like those of the Möbius map, by 1/20 of its steps or more.

    Least squares under that condition (isotonic regression); the distances from the centre stay.
    """
    # from the widest gap on, so that the seam is not where angles have to change
    gaps = np.angle(np.roll(conformal, -1) / conformal)
    way = -1.0 if gaps.sum() < 0 else 1.0
    first = (int(np.argmax(way * np.angle(np.roll(carried, -1) / carried))) + 1) % len(carried)
    order = np.roll(np.arange(len(carried)), -first)
    own = np.unwrap(way * np.angle(conformal[order]))
    moved = own + way * np.angle(carried[order] / conformal[order])
    low = 0.05 * own
    angle = isotonic_regression(moved - low).x + low
    result = carried.copy()
    far = np.abs(angle - moved) > 1e-12
    result[order[far]] = np.abs(carried[order[far]]) * np.exp(1j * way * angle[far])
    return result


def mean_value_weights(plane: Complexes, faces: Integers) -> csr_array:
    """Return positive weights, (n, n), with which each vertex inside is a mean of its neighbours in the plane.

    Floater, "Mean value coordinates" (2003); of a map without turned triangles.
    """
    corner = plane[faces]
    to_next, to_last = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    half = np.tan(np.abs(np.angle(to_last / to_next)) / 2)
    rows = np.concatenate([faces.ravel(), faces.ravel()])
    columns = np.concatenate([np.roll(faces, -1, axis=1).ravel(), np.roll(faces, 1, axis=1).ravel()])
    values = np.concatenate([(half / np.abs(to_next)).ravel(), (half / np.abs(to_last)).ravel()])
    return csr_array(coo_array((values, (rows, columns)), shape=(len(plane), len(plane))))


def _turned(disc: Complexes, faces: Integers) -> Booleans:
    """Return which faces, (m,), are turned over or collapsed in the disc."""
    return signed_areas(disc, faces) <= 0
