"""The plane in which a part of a surface is its own mirror image: what a mirrored map of two halves of a thing hides.

Two scans of one symmetric thing, from its left and from its right, match mirrored as well as a scan matches itself:
each shows of one side what the other shows of the other. Without mirroring they share the middle alone. The source's
own plane of symmetry tells where the target would lie then.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...surface.mesh import Booleans, Floats, Integers
from ...surface.nearest import SurfacePoints
from .own_fit import FAR, OwnFit

DIRECTIONS, BETWEEN = 400, 0.05
"""Directions in which planes are tried, 7 degrees from each other, and roots of the area from one to the next."""

ROUGHLY_ASKED = 200
"""Points, about, whose mirror images are looked for first."""

TURNED, SHIFTED = 0.2, 0.1
"""Difference of normals, and distance in roots of the area, up to which two planes are the same one."""

ROUGH_PLANES, ROUGH_ROUNDS = 64, 8
"""Planes that are fitted by cells, each another one, and rounds of that: some degrees off, the planes of six faces that
lack 37 to 40 % at one side are borne out by 0.74 to 1, and come up to 33rd: twice as many."""

PLANES = (6, 6)
"""Planes that are fitted, each another one than those before: those of most worth, and those best borne out."""

ROUNDS, LAST_ROUNDS = 15, 5
"""Closest point rounds in which a plane settles, by `ROUGHLY_ASKED` points, and then by all."""

ASIDE = 0.05
"""Distance from the plane, in roots of the area, from which on a point tells anything of it."""

LEAST = 0.15
"""Share of the points whose mirror images have to lie on the surface, aside of the plane, if that is to be believed: of
12 faces that lack 35 % at one side 0.16 or more; smooth ends of faces, as a forehead, are symmetric too, with 0.14."""

BORNE_OUT = 0.93
"""Share of the mirror images on the surface, among those not past its boundaries, from which on a plane is believed: of
24 faces that lack 20 or 35 % at one side 0.98 or more in the right plane, 0.89 in another of `LEAST`; of hands, feet,
ears, teeth and cortices 0.63 or less in the best one."""

ROUGHLY_BORNE_OUT = 0.8
"""The same by `ROUGHLY_ASKED` points, of which some 40 are on the surface: three standard deviations less."""


def mirror_plane(onto: SurfacePoints) -> tuple[Floats, Floats] | None:
    """Return the plane in which a surface mirrors itself as far as it reaches: its normal and a point, (3,) each.

    None if there is none. What has its mirror image past a boundary of the surface speaks neither for nor against a
    plane. All planes are tried, some degrees apart, and the best ones fitted to the surface and its mirror image.

    Parameters
    ----------
    onto : SurfacePoints
        The surface, of about unit area.
    """
    own = OwnFit(onto)
    found: list[tuple[Floats, Floats]] = []
    worth = []
    few, every = _few(own), slice(None)
    for normal, middle in _likely(own):
        normal, middle = _settled(own, few, normal, middle, ROUNDS)
        if _borne_out(own, few, normal, middle)[0] < ROUGHLY_BORNE_OUT:
            continue
        normal, middle = _settled(own, every, normal, middle, LAST_ROUNDS)
        borne_out, share = _borne_out(own, every, normal, middle)
        if borne_out > BORNE_OUT and share > LEAST:
            found.append((normal, middle))
            worth.append(borne_out**4 * share)
    return found[int(np.argmax(worth))] if found else None


def mirrored(points: Floats, normal: Floats, middle: Floats) -> Floats:
    """Return points, (..., 3), mirrored in planes, each a unit normal and a point, (..., 3)."""
    return points - 2 * ((points - middle) * normal).sum(axis=-1, keepdims=True) * normal


def _few(own: OwnFit) -> slice:
    """Return which of the points answer first: `ROUGHLY_ASKED`, about."""
    return slice(None, None, -(-len(own.points) // ROUGHLY_ASKED))


def _borne_out(own: OwnFit, some: slice, normal: Floats, middle: Floats) -> tuple[float, float]:
    """Return which share of some points' mirror images is on the surface, as of `OwnFit.borne_out`."""
    points, facing = own.points[some], own.normals[some]
    aside = np.abs((points - middle) @ normal) > ASIDE
    return own.borne_out(mirrored(points, normal, middle), _turned(facing, normal), aside)


def _turned(normals: Floats, across: Floats) -> Floats:
    return mirrored(normals, across, np.zeros(3))


def _likely(own: OwnFit) -> Iterator[tuple[Floats, Floats]]:
    """Yield planes, each another one, that the cells bear out best: a normal and a point each."""
    points, facing = own.points[_few(own)], own.normals[_few(own)]
    centre = points.mean(axis=0)
    # directions of a hemisphere in a spiral, each as far from the next
    height = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    angle = np.pi * (1 + np.sqrt(5)) * np.arange(DIRECTIONS)
    flat = np.sqrt(1 - height**2)
    directions = np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)
    normals, offsets, shares = [], [], []
    for normal in directions:
        least, most = np.quantile((points - centre) @ normal, (0.1, 0.9))
        steps = np.arange(least, most, BETWEEN)
        normals.append(np.broadcast_to(normal, (len(steps), 3)))
        offsets.append(steps)
        shares.append(_roughly(own, points, facing, normals[-1], centre + steps[:, None] * normal)[1:])
    normal, offset = np.concatenate(normals), np.concatenate(offsets)
    borne_out, share = np.concatenate(shares, axis=1)
    first = list(_each_another(normal, offset, [borne_out**4 * share] * ROUGH_PLANES))
    normal, middle = normal[first], centre + offset[first, None] * normal[first]
    for _ in range(ROUGH_ROUNDS):
        near = _roughly(own, points, facing, normal, middle)[0]
        fitted = np.count_nonzero(near >= 0, axis=1) >= 4
        other = own.onto.mesh.vertices[near[fitted]]
        normal[fitted], middle[fitted] = _between(points, other, near[fitted] >= 0)
    _, borne_out, share = _roughly(own, points, facing, normal, middle)
    worths = [borne_out**4 * share] * PLANES[0] + [np.where(share > LEAST / 2, borne_out, 0.0)] * PLANES[1]
    for k in _each_another(normal, ((middle - centre) * normal).sum(axis=1), worths):
        yield normal[k], middle[k]


def _roughly(
    own: OwnFit, points: Floats, facing: Floats, normal: Floats, middle: Floats
) -> tuple[Integers, Floats, Floats]:
    """Return what the cells say of planes, each a normal and a point, (k, 3): by points of the surface, (q, 3).

    Vertices near their mirror images, (k, q), -1 where these do not lie on the surface; and, (k,) each, which share of
    the images does, of those not past a boundary, and of all.
    """
    image = mirrored(points, normal[:, None], middle[:, None])
    lies, beyond, near = own.roughly(image, _turned(facing, normal[:, None]))
    told = (np.linalg.norm(image - points, axis=2) > 2 * ASIDE) & ~beyond
    lies &= told
    borne_out = np.count_nonzero(lies, axis=1) / np.maximum(np.count_nonzero(told, axis=1), 1)
    return np.where(lies, near, -1), borne_out, lies.mean(axis=1)


def _each_another(normal: Floats, offset: Floats, worths: list[Floats]) -> Iterator[int]:
    """Yield the best plane by each worth, (k,), of those that are none that was yielded before."""
    tried = np.zeros(len(offset), bool)
    for worth in worths:
        first = int(np.argmax(np.where(tried, 0.0, worth)))
        if tried[first] or worth[first] <= 0:
            continue
        yield first
        for sign in (1, -1):
            turned = np.linalg.norm(normal - sign * normal[first], axis=1)
            tried |= (turned < TURNED) & (np.abs(offset - sign * offset[first]) < SHIFTED)


def _settled(own: OwnFit, some: slice, normal: Floats, middle: Floats, rounds: int) -> tuple[Floats, Floats]:
    """Return the plane fitted to some points of a surface and the nearest ones to their mirror images."""
    points, facing = own.points[some], own.normals[some]
    for _ in range(rounds):
        other, lies = own.lying(mirrored(points, normal, middle), _turned(facing, normal), FAR)
        if lies.sum() < 4:
            break
        normal, middle = _between(points, other, lies)
    return normal, middle


def _between(points: Floats, other: Floats, lies: Booleans) -> tuple[Floats, Floats]:
    """Return planes between points, (q, 3), and what their mirror images lie on, (..., q, 3): normals and points.

    Least squares, of those that `lies`, (..., q), of where mirrored points miss theirs: beside each other, and off the
    plane, which counts twice.
    """
    count = np.count_nonzero(lies, axis=-1)[..., None, None]
    across, between = (points - other) * lies[..., None], (points + other) / 2
    middle = (between * lies[..., None]).sum(axis=-2, keepdims=True) / count
    arm = (between - middle) * lies[..., None]
    products = np.swapaxes(across, -1, -2) @ across - 4 * np.swapaxes(arm, -1, -2) @ arm
    return np.linalg.eigh(products)[1][..., -1], middle[..., 0, :]
