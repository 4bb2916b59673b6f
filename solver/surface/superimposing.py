"""Corresponding points superimposed: the rotation, or similarity, that brings them nearest to each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import Floats


@dataclass(frozen=True, eq=False)
class Pose:
    """A similarity: x -> scale * x @ turn + shift.

    Attributes
    ----------
    turn : (3, 3) float64
        Orthogonal; of determinant -1 where it mirrors.
    shift : (3,) float64
    scale : float
    """

    turn: Floats
    shift: Floats
    scale: float = 1.0

    def __call__(self, points: Floats) -> Floats:
        """Return the images of points, (q, 3)."""
        return self.scale * points @ self.turn + self.shift

    @property
    def matrix(self) -> Floats:
        """The same of column vectors, (4, 4)."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.scale * self.turn.T, self.shift
        return matrix


def superimposing(
    points: Floats, onto: Floats, weights: Floats | None = None, *, mirrored: bool = False, scaled: bool = False
) -> Pose:
    """Return the pose that brings points nearest to others, in the sum of weighted squares.

    Kabsch, "A solution for the best rotation to relate two sets of vectors" (1976); the scale by Umeyama (1991).

    Parameters
    ----------
    points, onto : (q, 3) float64
    weights : (q,) float64, optional
        Non-negative, with a positive sum; by default all points count alike.
    mirrored : bool
        Whether the pose is to turn orientation round.
    scaled : bool
        Whether it may change size.
    """
    share = np.full(len(points), 1 / len(points)) if weights is None else weights / weights.sum()
    middle, other = share @ points, share @ onto
    left, stretch, right = np.linalg.svd((share[:, None] * (points - middle)).T @ (onto - other))
    sign = np.ones(3)
    if (np.linalg.det(left @ right) < 0) != mirrored:
        sign[2] = -1
    turn = (left * sign) @ right
    square = float(share @ ((points - middle) ** 2).sum(axis=1))
    scale = float(stretch @ sign) / square if scaled and square > 0 else 1.0
    return Pose(turn, other - scale * middle @ turn, scale)
