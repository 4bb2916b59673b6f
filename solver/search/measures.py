"""How good a transformation is: the three counts of Le, Chin and Suter (2016), section 5.1.

Q_bnb is what the search maximises, Q_mv what Möbius voting counts, and Q_truth what a user wants: how much of a known
correspondence is found again. All are read off the disc.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..mobius import Mobius, hyperbolic_distance
from ..surface.mesh import Complexes, Floats, Integers
from .matching import matching


def q_bnb(
    mobius: Mobius,
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    radius: npt.ArrayLike,
    *,
    metric: str = "hyperbolic",
    weights: npt.ArrayLike | None = None,
) -> float:
    """Return the objective of `search`, whose parameters these are: the weight of source points in match discs."""
    return matching(source, target, radius, metric=metric, weights=weights).value(mobius)


def q_mv(mobius: Mobius, source: npt.ArrayLike, target: npt.ArrayLike, *, metric: str = "hyperbolic") -> int:
    """Return how many pairs (source point, target point) are mutually closest under `mobius`, at whatever distance.

    Parameters
    ----------
    mobius : Mobius
    source, target : (N1,), (N2,) complex
        Points of the closed unit disc.
    metric : str
        "hyperbolic" or "euclidean": what closest means.

    Examples
    --------
    >>> q_mv(Mobius(), [0, 0.5, 0.52], [0.01j, 0.53])
    2
    """
    return len(mutually_closest(mobius(source), target, metric=metric))


def q_truth(
    mobius: Mobius,
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    truth: npt.ArrayLike | None = None,
    *,
    metric: str = "hyperbolic",
) -> int:
    """Return how many pairs of the ground truth are mutually closest under `mobius`.

    Parameters
    ----------
    mobius : Mobius
    source, target : (N1,), (N2,) complex
        Points of the closed unit disc, such as landmarks.
    truth : (t, 2) int, optional
        Source and target point of each true pair. Default: each source point and the target point of the same number.
    metric : str
        "hyperbolic" or "euclidean".

    Raises
    ------
    ValueError
        Without `truth`, where source and target differ in number.

    Examples
    --------
    >>> q_truth(Mobius(), [0, 0.5, 0.52], [0.01j, 0.53, 0.9])
    1
    """
    source, target = np.asarray(source), np.asarray(target)
    if truth is None:
        if len(source) != len(target):
            raise ValueError(
                f"{len(source)} source points and {len(target)} target points do not pair off: pass the true pairs"
            )
        truth = np.stack([np.arange(len(source))] * 2, axis=1)
    pairs = mutually_closest(mobius(source), target, metric=metric)
    partner = np.full(len(source), -1)
    partner[pairs[:, 0]] = pairs[:, 1]
    j, k = np.asarray(truth, dtype=np.intp).reshape(-1, 2).T
    return int((partner[j] == k).sum())


def mutually_closest(points: npt.ArrayLike, others: npt.ArrayLike, *, metric: str = "hyperbolic") -> Integers:
    """Return the pairs, (p, 2), of which each is the other's closest; (n,) and (m,) complex in, the first on a tie."""
    table = distances(np.asarray(points, np.complex128), np.asarray(others, np.complex128), metric)
    forth, back = table.argmin(axis=1), table.argmin(axis=0)
    mutual = np.flatnonzero(back[forth] == np.arange(len(table)))
    return np.stack([mutual, forth[mutual]], axis=1)


def distances(points: Complexes, others: Complexes, metric: str) -> Floats:
    """Return the distances, (..., n, m), of points (..., n) from others (m,) in the search's metric.

    Raises
    ------
    ValueError
        An unknown metric.
    """
    if metric == "hyperbolic":
        with np.errstate(invalid="ignore"):  # 0 / 0: one point of the rim with itself
            return np.nan_to_num(hyperbolic_distance(points[..., None], others))
    if metric == "euclidean":
        return np.abs(points[..., None] - others)
    raise ValueError(f"unknown metric '{metric}': use 'hyperbolic' or 'euclidean'")
