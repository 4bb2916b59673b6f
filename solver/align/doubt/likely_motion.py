"""Motions by which a surface may lie on itself elsewhere: tried some degrees apart, the best of them by cells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...surface.mesh import Floats, Integers
from ...surface.sampling import spread
from .deep_inside import FELT, difference, explained, felt_inside
from .own_fit import OwnFit

ROUGHLY_ASKED = 100
"""Points of the target, about, that are moved where motions are tried."""

PLACES, TURNS = 200, 36
"""Points of the source to which one is moved, and turns there, 10 degrees from each other."""

ANCHORS = 8
"""Points of the target that are moved to what is like them, each to as many as are `PLACES` together."""

MOTIONS = 8
"""Motions that are fitted, each another one than those before, of either kind: of the middle, and of what is alike."""

ELSEWHERE = 0.2
"""Mean distance, in roots of the area, by which points are moved if another motion is meant: some of those tried."""

BORNE_OUT = 0.75
"""Share of the moved points that lie on the source, of those not past its boundaries, from which on it may be alike
there. Of 18 partial pairs of faces none has any such motion of `OPPOSITE` of what is matched."""

LEAST = 0.25
"""Share of what is matched that has to lie there for anything to be said of it. On 98 pairs of faces and brains, whose
maps are right, smooth ends lie elsewhere and are alike there by chance with 0.19 or less."""


@dataclass(frozen=True, eq=False)
class Likely:
    """A surface, and what of another one lies on it and may be moved.

    Attributes
    ----------
    own : OwnFit
    points, normals : (q, 3) float64
        What is moved.
    wanted : (q, d) and (q,) float64
        Its descriptors, and how far it is from the next boundary of either surface, in roots of the area.
    there : (n, d) and (n,) float64
        The same of all vertices of the surface.
    """

    own: OwnFit
    points: Floats
    normals: Floats
    wanted: tuple[Floats, Floats]
    there: tuple[Floats, Floats]

    def motions(self, share: float) -> Iterator[tuple[Floats, Floats]]:
        """Yield motions, each another one, that the cells bear out best: a rotation, (3, 3), and a shift, (3,), each.

        First those by which as much as a share of the points lies on the surface; where it has boundaries then those by
        which fewer may, and are alike.
        """
        # what is tried is some degrees away from what is borne out
        yield from self._best([self._from_middle()], BORNE_OUT**2 * share, alike=False)
        if self.own.onto.loops:
            yield from self._best(self._alike(), BORNE_OUT**4 * LEAST / 2, alike=True)

    def _from_middle(self) -> tuple[int, Integers]:
        """Return the middle point, and to which of the surface's points it is moved: those spread over it."""
        middle = int(np.argmin(((self.points - self.points.mean(axis=0)) ** 2).sum(axis=1)))
        return middle, np.arange(0, len(self.own.points), -(-len(self.own.points) // PLACES))

    def _alike(self) -> Iterator[tuple[int, Integers]]:
        """Yield points deep inside, and to which of the surface's points each is moved: those most like it."""
        (wanted, depth), (descriptors, deep) = self.wanted, (values[self.own.some] for values in self.there)
        inside = np.flatnonzero(depth >= min(FELT[2], float(np.median(depth))))
        if len(inside) > ANCHORS:
            inside = inside[spread(self.points[inside], ANCHORS)]
        for one in inside:
            tells = felt_inside(np.minimum(depth[one], deep))
            apart = difference(wanted[one] - descriptors, tells)
            near = np.linalg.norm(self.own.points - self.points[one], axis=1) < ELSEWHERE / 2
            apart[near | ~tells.any(axis=1)] = np.inf
            ends = np.argsort(apart)[: PLACES // ANCHORS]
            yield int(one), ends[np.isfinite(apart[ends])]

    def _best(
        self, starts: Iterable[tuple[int, Integers]], least: float, *, alike: bool
    ) -> Iterator[tuple[Floats, Floats]]:
        """Yield the best motions of points, by their numbers, to points of the surface, by theirs.

        They are worth the share that lies there, times how far that is borne out and, if it is to be `alike`, found
        again; `least` is the least worth.
        """
        points, every = self.points, slice(None, None, -(-len(self.points) // ROUGHLY_ASKED))
        some, facing, wanted, depth = (values[every] for values in (points, self.normals, *self.wanted))
        descriptors, deep = self.there
        spins = Rotation.from_rotvec(np.outer(2 * np.pi * np.arange(TURNS) / TURNS, [0.0, 0.0, 1.0])).as_matrix()
        turns, shifts, worths = [], [], []
        for begin, ends in starts:
            here = _frames(self.normals[[begin]])[0]
            for end, there in zip(ends, _frames(self.own.normals[ends]), strict=True):
                turn = there @ spins @ here.T
                shift = self.own.points[end] - points[begin] @ turn.transpose(0, 2, 1)
                moved = some @ turn.transpose(0, 2, 1) + shift[:, None]
                lies, beyond, near = self.own.roughly(moved, facing @ turn.transpose(0, 2, 1))
                lies &= ~beyond
                lying, told = np.count_nonzero(lies, axis=1), np.count_nonzero(~beyond, axis=1)
                borne_out = lying / np.maximum(told, 1)
                worth = lying / len(some) * borne_out ** (4 if alike else 1)
                rows = np.flatnonzero(worth >= least)
                elsewhere = np.linalg.norm(moved[rows] - some, axis=2).mean(axis=1) > ELSEWHERE
                worth[rows[~elsewhere]] = 0
                if alike:  # no more than all can be found again
                    rows = rows[elsewhere]
                    tells = felt_inside(np.minimum(depth, deep[near[rows]])) & lies[rows, :, None]
                    worth[rows] *= explained(wanted, wanted - descriptors[near[rows]], tells)
                worths.append(worth)
                turns.append(turn)
                shifts.append(shift)
        if not turns:
            return
        turn, shift, worth = np.concatenate(turns), np.concatenate(shifts), np.concatenate(worths)
        for _ in range(MOTIONS):
            first = int(np.argmax(worth))
            if worth[first] < least:
                return
            yield turn[first], shift[first]
            moved = some[::10] @ turn.transpose(0, 2, 1) + shift[:, None]
            worth[np.linalg.norm(moved - moved[first], axis=2).mean(axis=1) < ELSEWHERE / 2] = 0


def _frames(up: Floats) -> Floats:
    """Return right-handed frames, (q, 3, 3), in columns, the third of which are unit vectors, (q, 3)."""
    side = np.cross(up, np.eye(3)[np.argmin(np.abs(up), axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return np.stack([side, np.cross(up, side), up], axis=2)
