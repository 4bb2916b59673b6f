"""The plane in which a part of a surface is its own mirror image: what a mirrored map of two halves of a thing hides.

Two scans of one symmetric thing, from its left and from its right, match mirrored as well as a scan matches itself:
each shows of one side what the other shows of the other. Without mirroring they share the middle alone. The source's
own plane of symmetry tells where the target would lie then.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...surface.mesh import Floats
from ...surface.nearest import SurfacePoints
from .own_fit import FAR, OwnFit

DIRECTIONS, BETWEEN = 400, 0.05
"""Directions in which planes are tried, 7 degrees from each other, and roots of the area from one to the next."""

ROUGHLY_ASKED = 200
"""Points, about, whose mirror images are looked for where planes are tried."""

TURNED, SHIFTED = 0.2, 0.1
"""Difference of normals, and distance in roots of the area, up to which two planes are the same one."""

PLANES = (3, 3)
"""Planes that are fitted, each another one than those before: those of most worth, and those best borne out."""

ROUNDS = 15
"""Closest point rounds in which a plane settles."""

ASIDE = 0.05
"""Distance from the plane, in roots of the area, from which on a point tells anything of it."""

LEAST = 0.15
"""Share of the points whose mirror images have to lie on the surface, aside of the plane, if that is to be believed: of
12 faces that lack 35 % at one side 0.16 or more; smooth ends of faces, as a forehead, are symmetric too, with 0.14."""

BORNE_OUT = 0.93
"""Share of the mirror images on the surface, among those not past its boundaries, from which on a plane is believed: of
24 faces that lack 20 or 35 % at one side 0.98 or more in the right plane, 0.89 in another of `LEAST`; of hands, feet,
ears, teeth and cortices 0.63 or less in the best one."""


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
    for normal, middle in _likely(own):
        normal, middle = _settled(own, normal, middle)
        image, facing = mirrored(own.points, normal, middle), _turned(own.normals, normal)
        aside = np.abs((own.points - middle) @ normal) > ASIDE
        borne_out, share = own.borne_out(image, facing, aside)
        if borne_out > BORNE_OUT and share > LEAST:
            found.append((normal, middle))
            worth.append(borne_out**4 * share)
    return found[int(np.argmax(worth))] if found else None


def mirrored(points: Floats, normal: Floats, middle: Floats) -> Floats:
    """Return points, (n, 3), mirrored in a plane."""
    return points - 2 * ((points - middle) @ normal)[:, None] * normal


def _turned(normals: Floats, across: Floats) -> Floats:
    return normals - 2 * (normals @ across)[:, None] * across


def _likely(own: OwnFit) -> Iterator[tuple[Floats, Floats]]:
    """Yield planes, each another one, that the cells bear out best: a normal and a point each."""
    every = -(-len(own.points) // ROUGHLY_ASKED)
    points, facing = own.points[::every], own.normals[::every]
    centre = points.mean(axis=0)
    # directions of a hemisphere in a spiral, each as far from the next
    height = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    angle = np.pi * (1 + np.sqrt(5)) * np.arange(DIRECTIONS)
    flat = np.sqrt(1 - height**2)
    directions = np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)
    planes, shares = [], []
    for normal in directions:
        along = (points - centre) @ normal
        least, most = np.quantile(along, (0.1, 0.9))
        offsets = np.arange(least, most, BETWEEN)
        away = along - offsets[:, None]
        image = points - 2 * away[..., None] * normal
        lies, beyond, _ = own.roughly(image, np.broadcast_to(_turned(facing, normal), image.shape))
        told = (np.abs(away) > ASIDE) & ~beyond
        lies &= told
        shares.append(np.stack([lies.sum(axis=1) / np.maximum(told.sum(axis=1), 1), lies.mean(axis=1)]))
        planes.append(np.concatenate([np.broadcast_to(normal, (len(offsets), 3)), offsets[:, None]], axis=1))
    every_plane, (share, lying) = np.concatenate(planes), np.concatenate(shares, axis=1)
    tried = np.zeros(len(share), bool)
    for worth in [share**4 * lying] * PLANES[0] + [np.where(lying > LEAST / 2, share, 0.0)] * PLANES[1]:
        first = int(np.argmax(np.where(tried, 0.0, worth)))
        if tried[first] or worth[first] <= 0:
            continue
        normal, offset = every_plane[first, :3], every_plane[first, 3]
        yield normal, centre + offset * normal
        for sign in (1, -1):
            turned = np.linalg.norm(every_plane[:, :3] - sign * normal, axis=1)
            tried |= (turned < TURNED) & (np.abs(every_plane[:, 3] - sign * offset) < SHIFTED)


def _settled(own: OwnFit, normal: Floats, middle: Floats) -> tuple[Floats, Floats]:
    """Return the plane fitted to points of a surface and the nearest ones to their mirror images."""
    for _ in range(ROUNDS):
        image = mirrored(own.points, normal, middle)
        other, lies = own.lying(image, _turned(own.normals, normal), FAR)
        if lies.sum() < 4:
            break
        # least squares of where mirrored points miss theirs: beside each other, and off the plane, which counts twice
        across, between = (own.points - other)[lies], ((own.points + other) / 2)[lies]
        middle = between.mean(axis=0)
        arm = between - middle
        normal = np.linalg.eigh(across.T @ across - 4 * arm.T @ arm)[1][:, -1]
    return normal, middle
