"""A smooth map of space around two surfaces of which is known what belongs to what: a similarity at every place.

Moving least squares (Schaefer, McPhail and Warren 2006, in space Zhu and Gortler 2007): at each place the similarity
that fits best what lies around, near points counting most. Of maps that interpolate it is the one that stays a
similarity between and beyond the points, as radial basis functions do not, where what it carries may lie outside the
surface or within it; and it says how things are turned and scaled there, not only where they go.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...surface.mesh import Floats

MOST_POINTS = 8000
"""Pairs of points, at most: each counts at each place."""

_PLACES = 64
"""Places that are done at once, so that their weights fit in the cache."""


@dataclass(frozen=True, eq=False)
class Similarities:
    """A similarity at each of some places: x -> scale turn (x - here) + there.

    Attributes
    ----------
    turn : (q, 3, 3) float64
        Rotations; with a reflection in each where the map mirrors.
    scale : (q,) float64
    here, there : (q, 3) float64
    certainty : (q,) float64
        Mean certainty of the pairs that decided, weighed as they were.
    """

    turn: Floats
    scale: Floats
    here: Floats
    there: Floats
    certainty: Floats

    def __call__(self, points: Floats) -> Floats:
        """Return where points, (q, 3), one for each similarity, go."""
        return self.scale[:, None] * np.einsum("qij,qj->qi", self.turn, points - self.here) + self.there

    def only(self, number: int, points: Floats) -> Floats:
        """Return where points, (k, 3), go by one of the similarities."""
        return self.scale[number] * (points - self.here[number]) @ self.turn[number].T + self.there[number]

    def covariances(self, about: Floats) -> Floats:
        """Return what covariances, (q, 3, 3), become."""
        return self.scale[:, None, None] ** 2 * (self.turn @ about @ self.turn.transpose(0, 2, 1))


@dataclass(frozen=True, eq=False)
class SpaceMap:
    """Pairs of points, from which the map is made at each place that is asked for.

    Attributes
    ----------
    here, there : (n, 3) float64
    weights : (n,) float64
        How much each pair counts, as by its share of the surface.
    certainty : (n,) float64
        In [0, 1]; counts as a factor.
    mirrored : bool
        Whether the map mirrors.
    """

    here: Floats
    there: Floats
    weights: Floats
    certainty: Floats
    mirrored: bool

    def at(self, places: Floats, reach: Floats, omitted: Floats | None = None) -> Similarities:
        """Return the similarity at each place, (q, 3).

        Parameters
        ----------
        places : (q, 3) float64
        reach : (q,) float64
            Distance at which a pair counts a quarter of what it does at the place itself, beyond the nearest pair.
        omitted : (q, n) bool, optional
            Pairs that do not count at a place.
        """
        count = len(places)
        turn, scale = np.empty((count, 3, 3)), np.empty(count)
        here, there, certainty = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
        middle, other = self.here.mean(axis=0), self.there.mean(axis=0)
        x, y = self.here - middle, self.there - other
        values = np.hstack(
            [x, y, (y[:, :, None] * x[:, None, :]).reshape(-1, 9), (x**2).sum(axis=1)[:, None], self.certainty[:, None]]
        )
        own = self.weights * np.maximum(self.certainty, 1e-3)
        square = (x**2).sum(axis=1)
        for first in range(0, count, _PLACES):
            rows = slice(first, first + _PLACES)
            place = places[rows] - middle
            apart = np.maximum((place**2).sum(axis=1)[:, None] - 2 * place @ x.T + square, 0)
            counts = own if omitted is None else np.where(omitted[rows], 0.0, own)
            nearest = np.where(counts > 0, apart, np.inf).min(axis=1)
            weight = counts / (apart + (nearest + reach[rows] ** 2)[:, None]) ** 2
            weight /= weight.sum(axis=1, keepdims=True)
            means = weight @ values
            a, b = means[:, :3], means[:, 3:6]
            products = means[:, 6:15].reshape(-1, 3, 3) - b[:, :, None] * a[:, None, :]
            spread = means[:, 15] - (a**2).sum(axis=1)
            left, size, right = np.linalg.svd(products)  # Umeyama 1991
            sign = np.sign(np.linalg.det(left @ right)) * (-1 if self.mirrored else 1)
            left[:, :, 2] *= sign[:, None]
            size[:, 2] *= sign
            turn[rows], here[rows], there[rows] = left @ right, a + middle, b + other
            scale[rows] = size.sum(axis=1) / np.maximum(spread, np.finfo(float).tiny)
            certainty[rows] = means[:, 16]
        return Similarities(turn, scale, here, there, certainty)
