"""Boundary vertices put in order along the other surface's boundary, where nearest points have mixed them up.

On a jagged rim the nearest point of a vertex may lie on the next jag. To put them in order by their angles in the disc,
where jags are far apart, would move vertices by whole jags, right ones too: distances on the surface say which.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..flatten.sphere import Flat
from ..surface.mesh import Complexes, Floats

PER_SIDE = 4
"""Places that are tried on each side of the boundary."""

MOST = 20_000_000
"""Pairs of a vertex and a place up to which boundaries are put in order here: 80 MB, rims of some 2,000 vertices."""


@dataclass(frozen=True, eq=False)
class Rim:
    """The places along a surface's outer boundary to which vertices may go.

    Attributes
    ----------
    disc : (k,) complex128
    position : (k, 3) float64
    """

    disc: Complexes
    position: Floats

    @classmethod
    def of(cls, surface: Flat, vertices: Floats) -> Rim:
        """Return those of a surface whose vertices are at the given places, (n, 3)."""
        share = np.arange(PER_SIDE) / PER_SIDE
        loop, after = surface.boundary, np.roll(surface.boundary, -1)

        def along(values: np.ndarray) -> np.ndarray:
            start, end = values[loop][:, None], values[after][:, None]
            weight = share.reshape(1, -1, *(1,) * (values.ndim - 1))
            return ((1 - weight) * start + weight * end).reshape(-1, *values.shape[1:])

        return cls(along(surface.places), along(vertices))

    def ordered(self, carried: Complexes, conformal: Complexes, bent: Floats, offset: Floats) -> Complexes:
        """Return boundary places, (k,), in the order of the Möbius map's: each its own or one on the rim.

        The sum of distances on the surface from where the vertices were bent to is the least there is (dynamic
        programming along the boundary from the `surest` on). As they were where there are more than `MOST` pairs.

        Parameters
        ----------
        carried, conformal : (k,) complex128
            Where the vertices of a boundary go, in order, and where the Möbius map puts them.
        bent, offset : (k, 3), (k,) float64
            Where they were bent to, and how far their own places are from there.
        """
        way = -1.0 if np.angle(np.roll(conformal, -1) / conformal).sum() < 0 else 1.0
        if (way * np.angle(np.roll(carried, -1) / carried) > 0).all():
            return carried
        if len(carried) * (len(carried) + len(self.disc)) > MOST:
            return carried
        first = surest(carried, conformal)
        cut = way * np.angle(carried[first])
        order = np.roll(np.arange(len(carried)), -first)
        tried = np.concatenate([carried[order], self.disc])
        angle = (way * np.angle(tried) - cut) % (2 * np.pi)
        rank = np.argsort(angle, kind="stable")
        own = np.argsort(rank, kind="stable")[: len(order)]
        before, total = np.empty((len(order), len(tried)), np.int32), np.zeros(len(tried))
        for k, vertex in enumerate(order):
            apart = np.full(len(tried), np.inf)
            apart[len(order) :] = np.linalg.norm(self.position - bent[vertex], axis=1)
            apart[k] = offset[vertex]
            if k:
                least = np.minimum.accumulate(total)
                place = np.maximum.accumulate(np.where(total <= least, np.arange(len(total)), 0))
                # strictly before
                before[k, 1:], before[k, 0] = place[:-1], -1
                total = np.concatenate([[np.inf], least[:-1]])
            total = total + apart[rank]
        chosen = np.empty(len(order), np.intp)
        if not np.isfinite(total.min()):
            return carried
        chosen[-1] = total.argmin()
        for k in range(len(order) - 1, 0, -1):
            chosen[k - 1] = before[k, chosen[k]]
        result = carried.copy()
        moved = chosen != own
        result[order[moved]] = tried[rank[chosen[moved]]]
        return result


def surest(carried: Complexes, conformal: Complexes) -> int:
    """Return the boundary vertex, of (k,), that is in the Möbius map's order with most others up to half way around.

    As in `unfold.in_order` places are turned by less than half a turn from where the Möbius map puts them.
    """
    count = len(carried)
    turns = np.angle(np.roll(conformal, -1) / conformal)
    way = -1.0 if turns.sum() < 0 else 1.0
    run = np.concatenate([[0.0], np.cumsum(way * turns)[:-1]])
    run += way * np.angle(carried / conformal)
    later = (np.arange(count)[:, None] + np.arange(1, count // 2 + 1)) % count
    ahead = run[later] + 2 * np.pi * (later <= np.arange(count)[:, None]) > run[:, None]
    agreeing = ahead.sum(axis=1) + np.bincount(later[ahead], minlength=count)
    return int(agreeing.argmax())
