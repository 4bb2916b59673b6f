"""Möbius voting: random minimal correspondences, each voting for the pairs that its transformation brings together.

Lipman and Funkhouser, "Möbius voting for surface correspondence" (2009). Automorphisms of the disc have three degrees
of freedom instead of six, so two correspondences take the place of three.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ...mobius import Mobius
from ...stages import SearchProgress
from ...surface.mesh import Complexes, Floats, Integers
from ..fit import residuals
from ..outcome import SearchResult
from .incumbent import Incumbent, incumbent

DISTANCES_AT_ONCE = 1 << 18
"""Distances computed together; bounds the memory."""


def voting(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    metric: str = "hyperbolic",
    weights: npt.ArrayLike | None = None,
    z_max: float = 0.95,
    reflect: bool = False,
    time_limit: float | None = None,
    threads: int | None = None,
    progress: Callable[[SearchProgress], bool | None] | None = None,
    ballot: str = "own",
    samples: int | None = None,
    smallest_share: float = 0.4,
    epsilon: float = 0.01,
    seed: int = 0,
) -> SearchResult:
    """Return the sampled transformation whose mutually closest pairs have the most votes between them.

    Parameters
    ----------
    source, target, radius, metric, weights, z_max, reflect, time_limit, threads, progress
        As in `search`; one thread is used. Only compatible pairs are sampled and voted for, by their weight.
    ballot : str
        "shared": a pair has the votes of all transformations that bring it together, which is the table of votes in
        Möbius voting. "own": only those of the transformation in question, so that the many wrong ones do not outvote
        the few right ones.
    samples : int, optional
        Transformations drawn for each orientation. Default: ten times the number of compatible pairs, so that on
        average ten start from two right ones if each source point has one right partner.
    smallest_share : float
        A transformation takes part if it has at least this share of the smaller point set in mutually closest pairs.
    epsilon : float
        Deformation error at which a vote counts half: each vote is epsilon / (epsilon + mean distance of the pairs).
    seed : int
        Of the random draws.

    Returns
    -------
    SearchResult
        Not certified; `nodes` counts sampled transformations.
    """
    if ballot not in ("own", "shared"):
        raise ValueError(f"unknown ballot '{ballot}': use 'own' or 'shared'")
    best = incumbent(
        source, target, radius, metric=metric, weights=weights, z_max=z_max, reflect=reflect, time_limit=time_limit,
        threads=threads, progress=progress,
    )  # fmt: skip
    count = 10 * len(best.problem.point) if samples is None else samples
    at_once = max(1, DISTANCES_AT_ONCE // best.weights.size)
    fewest = max(2, smallest_share * min(best.weights.shape))
    rng = np.random.default_rng(seed)
    for reflected in best.sides:
        points = best.source(reflected)
        everyone = np.arange(len(points))
        table = np.zeros(best.weights.shape)
        voters: list[tuple[Complexes, Floats, Integers, Floats]] = []
        for first in range(0, count, at_once):
            if not best.goes_on():
                break
            z, theta = _sampled(best, points, min(at_once, count - first), rng)
            best.nodes += len(z)
            partner, distance = _mutually_closest(best, points, z, theta)
            number = (partner >= 0).sum(axis=1)
            enough = number >= fewest
            z, theta, partner, distance = z[enough], theta[enough], partner[enough], distance[enough]
            mean = np.where(partner >= 0, distance, 0).sum(axis=1) / number[enough]
            vote = epsilon / (epsilon + mean)[:, None] * best.weights[everyone, partner]
            vote = np.where(partner >= 0, vote, 0)
            np.add.at(table, (everyone, partner), vote)
            voters.append((z, theta, partner, vote.sum(axis=1)))
        if sum(len(z) for z, *_ in voters):
            z, theta, partner, votes = (np.concatenate(x) for x in zip(*voters, strict=True))
            if ballot == "shared":
                votes = np.where(partner >= 0, table[everyone, partner], 0).sum(axis=1)
            winner = int(np.argmax(votes))
            best.offer(Mobius(complex(z[winner]), float(theta[winner])), reflected)
    return best.result()


def _sampled(best: Incumbent, points: Complexes, count: int, rng: np.random.Generator) -> tuple[Complexes, Floats]:
    """Return z and theta of up to `count` transformations, each through two random compatible pairs."""
    j, k = best.problem.point, best.problem.target
    inside = np.flatnonzero((np.abs(points[j]) < 1) & (np.abs(best.target[k]) < 1))
    if len(inside) == 0:
        return np.empty(0, np.complex128), np.empty(0)
    p, q = rng.choice(inside, (2, count))
    different = (j[p] != j[q]) & (k[p] != k[q])
    p, q = p[different], q[different]
    z, theta = through_two_pairs(points[j[p]], points[j[q]], best.target[k[p]], best.target[k[q]])
    allowed = np.abs(z) <= best.z_max
    return z[allowed], theta[allowed]


def through_two_pairs(x1: Complexes, x2: Complexes, y1: Complexes, y2: Complexes) -> tuple[Complexes, Floats]:
    """Return z and theta, (n,), of the transformations that carry x1 to y1 and x2 to y2 as nearly as possible.

    Exactly if the pairs are equally far apart; else the geodesic through x1 and x2 goes to that through y1 and y2 and
    midpoint to midpoint, which divides the error evenly.
    """

    def midway(a: Complexes, b: Complexes) -> tuple[Floats, Floats]:
        """Return direction and Euclidean length of the way from a half to b, seen with a at the centre."""
        there = (b - a) / (1 - np.conj(a) * b)
        length = np.minimum(np.abs(there), 1.0)
        return np.angle(there), length / (1 + np.sqrt(1 - length**2))

    from_angle, from_half = midway(x1, x2)
    to_angle, to_half = midway(y1, y2)
    along = (from_half - to_half) / (1 - from_half * to_half)
    turn = np.exp(0.5j * (to_angle - from_angle))
    # as matrices [[a, b], [conj(b), conj(a)]]: x1 to the centre; along the geodesic, then turned; the centre to y1
    steps = [(1, -x1), (turn, -along * np.exp(0.5j * (to_angle + from_angle))), (1, y1)]
    a, b = steps[0]
    for next_a, next_b in steps[1:]:
        a, b = next_a * a + next_b * np.conj(b), next_a * b + next_b * np.conj(a)
    return -b / a, 2 * np.angle(a)


def _mutually_closest(best: Incumbent, points: Complexes, z: Complexes, theta: Floats) -> tuple[Integers, Floats]:
    """Return, for each transformation and source point, (n, N1), the mutually closest target point or -1, how far."""
    z, turn = z[:, None], np.exp(1j * theta)[:, None]
    image, target = turn * (points - z) / (1 - points * np.conj(z)), best.target
    rows = np.stack([image.real, image.imag, np.abs(image) ** 2, np.ones(image.shape)], axis=2)
    columns = np.stack([-2 * target.real, -2 * target.imag, np.ones(len(target)), np.abs(target) ** 2])
    if best.metric == "hyperbolic":
        # |x - y|^2 / ((1 - |x|^2) (1 - |y|^2)) grows with the distance
        rows /= np.maximum(1 - np.abs(image) ** 2, 1e-12)[:, :, None]
        columns /= np.maximum(1 - np.abs(target) ** 2, 1e-12)
    square = rows.astype(np.float32) @ columns.astype(np.float32)  # single precision, as it only ranks the pairs
    if not best.weights.all():
        square[:, best.weights == 0] = np.inf
    forth = square.argmin(axis=2)
    nearest = np.take_along_axis(square, forth[:, :, None], axis=2)[:, :, 0]
    mutual = nearest == np.take_along_axis(square.min(axis=1), forth, axis=1)
    mutual &= best.weights[np.arange(len(points)), forth] > 0
    return np.where(mutual, forth, -1), np.abs(residuals(image, target[forth], best.metric)[0])
