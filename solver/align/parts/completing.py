"""The whole mesh from the map of its main part: the others, each on its counterpart or beside what it rides with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...surface.barycentric import interpolated
from ...surface.mesh import Floats, Integers
from ...surface.parts import Part, Parts
from ..result.alignment import Alignment
from ..result.confidence import BOUND
from ..result.whole import Pair, Whole
from .counterparts import assigned, certainty_of, costs
from .part_map import PartMap, part_maps
from .riding import Known, ride
from .space import MOST_POINTS, Similarities, SpaceMap

ROUNDS = 2
"""Times that parts are assigned: first by the main part alone, then by those that were found too."""

SPREAD = 3.0
"""Standard deviation of the parts' centres in the second round, in medians over 1.54, which is the median length of
normal deviations of 1 in space. Neighbouring teeth are told apart where most parts are at the right place to a tenth of
a tooth, and one that is farther off than most, as a tongue, is still found."""

LEAST = 0.25
"""Least of that deviation, in `BOUND`: three of them are less than from tooth to tooth, 2 % of a head's diagonal, and
that is four times what those of two good heads are off."""


def completed(
    found: Alignment, source: Parts, target: Parts, progress: Callable[[float], None] | None = None
) -> Whole | None:
    """Return what belongs to what beyond the main parts; None if the target has no others.

    Parameters
    ----------
    found : Alignment
        Of the main parts.
    source, target : Parts
        Of the meshes as they came.
    progress : callable, optional
        Called with the share of the work done, in [0, 1]; may raise to end it.
    """
    if max(len(source), len(target)) < 2:
        return None
    tell = progress or (lambda _: None)
    main = _Main.of(found, source, target)
    work = _Work(source, target, main.space(found.mobius.reflected))
    for number in range(ROUNDS):
        tell(0.1 * number)
        work.assign()
    size = len(target.of_vertex)
    face, barycentric = np.full(size, -1), np.zeros((size, 3))
    confidence, leader = np.zeros(size), np.full(size, -1)
    offsets: dict[int, float] = {}
    several = [(source.part(one), target.part(other)) for one, other in work.pairs]
    near = [
        (its, mine, work.space_at.only(other, mine.mesh.vertices))
        for (its, mine), other in zip(several, work.pairs[:, 1], strict=True)
    ]
    maps = part_maps(near, lambda share: tell(0.2 + 0.7 * share))
    for (its, mine), other, own in zip(several, work.pairs[:, 1].tolist(), maps, strict=True):
        # where parts touch a vertex is the first one's
        rows, vertices = _first(mine, target, other)
        face[vertices], barycentric[vertices] = its.in_own_corners(own.face[rows], own.barycentric[rows])
        confidence[vertices] = _confidence(own, work, other)[rows]
        area = max(mine.mesh.area, np.finfo(float).tiny)
        offsets[other] = float(own.offset @ mine.mesh.vertex_areas / area) / work.diagonal
    tell(0.9)
    _ride(work, main, face, barycentric, leader)
    return Whole(source, target, work.listed(offsets), face, barycentric, confidence, leader)


@dataclass(frozen=True, eq=False)
class _Main:
    """The map of the main parts in vertices and faces of the meshes as they came.

    Attributes
    ----------
    vertices : (k,) int
        The target's that are located.
    face, barycentric : (k,) int, (k, 3) float64
    places, there : (k, 3) float64
        Where they are, and where they go.
    weight, certainty : (k,) float64
    """

    vertices: Integers
    face: Integers
    barycentric: Floats
    places: Floats
    there: Floats
    weight: Floats
    certainty: Floats

    @staticmethod
    def of(found: Alignment, source: Parts, target: Parts) -> _Main:
        from_tidy, to_tidy = found.source_cleaned, found.target_cleaned
        face, barycentric = found.located
        rows = np.flatnonzero(face >= 0)
        face, barycentric = face[rows], barycentric[rows]
        weight, certainty = found.target.mesh.vertex_areas[rows], found.confidence[rows]
        if to_tidy is not None and to_tidy.changes:
            every = to_tidy.vertex_of
            vertices = np.flatnonzero(every >= 0)
            at = np.full(len(to_tidy.origin), -1)
            at[rows] = np.arange(len(rows))
            at = at[every[vertices]]
            vertices, at = vertices[at >= 0], at[at >= 0]
            share = np.bincount(at, minlength=len(rows))
            face, barycentric, weight, certainty = (
                face[at],
                barycentric[at],
                (weight / np.maximum(share, 1))[at],
                certainty[at],
            )
        else:
            vertices = rows
        if from_tidy is not None and from_tidy.changes:
            turned = from_tidy.reversed[face]
            barycentric = np.where(turned[:, None], barycentric[:, [0, 2, 1]], barycentric)
            face = from_tidy.faces[face]
        there = interpolated(source.mesh.vertices, source.mesh.faces[face], barycentric)
        return _Main(vertices, face, barycentric, target.mesh.vertices[vertices], there, weight, certainty)

    def space(self, mirrored: bool) -> SpaceMap:
        some = slice(None, None, -(-len(self.vertices) // MOST_POINTS))
        return SpaceMap(self.places[some], self.there[some], self.weight[some], self.certainty[some], mirrored)


class _Work:
    """The assignment while it is made."""

    def __init__(self, source: Parts, target: Parts, space: SpaceMap) -> None:
        self.source, self.target, self.space = source, target, space
        corner = source.mesh.vertices[source.mesh.used]
        self.diagonal = float(np.linalg.norm(np.ptp(corner, axis=0)))
        self.main_size = float(np.linalg.norm(np.ptp(space.here, axis=0)))
        self.off = BOUND * self.diagonal
        self.pairs = np.empty((0, 2), np.intp)
        self.certainty = np.empty(0)
        self.space_at = self._at()

    def _at(self) -> Similarities:
        """Return the similarity at each of the target's parts, from the main part and all pairs but their own."""
        centre, about = self.target.moments
        radius = np.sqrt(np.trace(about, axis1=1, axis2=2))
        reach = np.sqrt(radius**2 + (BOUND * self.main_size) ** 2)
        if not len(self.pairs):
            return self.space.at(centre, reach)
        points, there = centre[self.pairs[:, 1]], self.source.moments[0][self.pairs[:, 0]]
        old = len(self.space.here)
        space = SpaceMap(
            np.concatenate([self.space.here, points]),
            np.concatenate([self.space.there, there]),
            np.concatenate([self.space.weights, self.target.area[self.pairs[:, 1]]]),
            np.concatenate([self.space.certainty, self.certainty]),
            self.space.mirrored,
        )
        omitted = np.zeros((len(centre), old + len(points)), bool)
        omitted[self.pairs[:, 1], old + np.arange(len(points))] = True
        return space.at(centre, reach, omitted)

    def assign(self) -> None:
        """Pair parts anew, from where the map that is known so far puts them."""
        if min(len(self.source), len(self.target)) < 2:
            return
        self.space_at = self._at()
        centre, about = self.target.moments
        here, of_source = self.source.moments
        carried = self.space_at(centre)
        if len(self.pairs):
            apart = np.linalg.norm(here[self.pairs[:, 0]] - carried[self.pairs[:, 1]], axis=1)
            usual = max(SPREAD * float(np.median(apart)) / 1.54, LEAST * BOUND * self.diagonal)
            self.off = min(self.off, usual)
        pairs, cost = costs(
            (here[1:], of_source[1:], self.source.shape[1:]),
            (carried[1:], self.space_at.covariances(about)[1:], self.target.shape[1:]),
            self.off,
        )
        chosen = assigned(pairs, cost)
        chosen = chosen[np.argsort(pairs[chosen, 1])]
        if len(chosen):
            self.certainty = certainty_of(pairs, cost, chosen, here[1:], self.diagonal)
        else:
            self.certainty = np.empty(0)
        self.pairs = pairs[chosen] + 1

    def listed(self, offsets: dict[int, float]) -> tuple[Pair, ...]:
        """Return all parts with their counterparts."""
        found = [Pair(0, 0, 1.0, 0.0)]
        found += [
            Pair(int(one), int(other), float(sure), offsets[int(other)])
            for (one, other), sure in zip(self.pairs, self.certainty, strict=True)
        ]
        found += [Pair(None, int(k), 0.0, 0.0) for k in np.setdiff1d(np.arange(1, len(self.target)), self.pairs[:, 1])]
        found += [Pair(int(k), None, 0.0, 0.0) for k in np.setdiff1d(np.arange(1, len(self.source)), self.pairs[:, 0])]
        return tuple(found)


def _first(part: Part, parts: Parts, number: int) -> tuple[Integers, Integers]:
    """Return the vertices of a part that are in none before, by its own numbers and by those of the whole mesh."""
    own = parts.of_vertex[part.vertices] == number
    return part.rows[own], part.vertices[own]


def _confidence(own: PartMap, work: _Work, number: int) -> Floats:
    """Return the probability, (q,), that the vertices of a part err by less than `confidence.BOUND`.

    That of the surface around it, or that of the pair if it is less, which an offset of the bound makes less as two
    standard deviations do.
    """
    pair = work.certainty[np.flatnonzero(work.pairs[:, 1] == number)[0]]
    fit = np.exp(-2 * (own.offset / (BOUND * work.diagonal)) ** 2)
    return np.minimum(work.space_at.certainty[number], pair * fit)


def _ride(work: _Work, main: _Main, face: Integers, barycentric: Floats, leader: Integers) -> None:
    """Give the vertices of parts without a counterpart the point of what they ride with, (n,) arrays."""
    known_face, known_place = face.copy(), barycentric.copy()
    known_face[main.vertices], known_place[main.vertices] = main.face, main.barycentric
    known = Known(known_face, known_place, work.pairs, work.space_at, work.main_size, BOUND * work.diagonal)
    if (found := ride(known, work.source, work.target)) is not None:
        rows = found.vertices
        face[rows], barycentric[rows], leader[rows] = found.face, found.barycentric, found.leader
