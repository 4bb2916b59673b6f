"""Brute force: every pairing of a source point with a target point, and every rotation that this leaves free.

Boyer, Lipman et al., "Algorithms to automatically quantify the geometric similarity of anatomical surfaces" (2011), as
Le, Chin and Suter (2016) use it. A transformation that carries m_j to b_k has one more parameter: with both moved to
the centre of the disc, a rotation.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ...mobius import Mobius
from ...stages import SearchProgress
from ...surface.mesh import Complexes, Floats
from ..bounds import exact_arcs
from ..matching import Matching, Rows
from ..outcome import SearchResult
from ..stabbing import stab
from .incumbent import Incumbent, incumbent

ARCS_AT_ONCE = 1 << 21
"""Pairs times pairings whose arcs are computed together; bounds the memory."""


def brute_force(
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
    rotations: int | None = None,
) -> SearchResult:
    """Return the best of the transformations that carry a source point exactly to a compatible target point.

    Parameters
    ----------
    source, target, radius, metric, weights, z_max, reflect, time_limit, threads, progress
        As in `search`; one thread is used.
    rotations : int, optional
        Try this many equally spaced rotations of each pairing, as the papers do. Default: the best rotation of each is
        found exactly, by the sort and sweep of `stabbing`, which no grid can beat.

    Returns
    -------
    SearchResult
        Not certified; `nodes` counts pairings, times rotations if these are on a grid.

    Notes
    -----
    A target point so near the unit circle that its disc reaches out of it is replaced by the nearest point to which
    the exact sweep applies, which is still in the disc.
    """
    if rotations is not None and rotations < 1:
        raise ValueError(f"rotations must be at least 1, not {rotations}")
    best = incumbent(
        source, target, radius, metric=metric, weights=weights, z_max=z_max, reflect=reflect, time_limit=time_limit,
        threads=threads, progress=progress,
    )  # fmt: skip
    anchors = _anchors(best)
    for reflected in best.sides:
        points = best.source(reflected)
        inside = np.abs(points) < 1
        for k, anchor in enumerate(anchors.tolist()):
            if not best.goes_on():
                return best.result()
            zs = points[inside & (best.weights[:, k] > 0)]
            framed = _framed(best, points, anchor)
            for some in np.array_split(zs, -(-len(zs) * len(framed.point) // ARCS_AT_ONCE)) if len(zs) else []:
                if rotations is None:
                    z, theta, reached = _swept(framed, some)
                else:
                    z, theta, reached = _tried(framed, some, rotations)
                best.nodes += len(some) * (rotations or 1)
                if reached > best.value:
                    best.offer(Mobius(anchor, 0.0).inverse() @ Mobius(z, theta), reflected)
    return best.result()


def _anchors(best: Incumbent) -> Complexes:
    """Return where source points are carried, (N2,): the target points, but off the circle.

    The transformation that moves b to the centre has its pole at 1 / conj(b), which must lie in no match disc.
    """
    reach = float((np.abs(best.problem.centres) + best.problem.radii).max(initial=0.0))
    length = np.abs(best.target)
    return best.target * np.minimum(1, (1 - 1e-9) / (np.maximum(reach, 1) * np.maximum(length, 1e-300)))


def _framed(best: Incumbent, points: Complexes, anchor: complex) -> Matching:
    """Return the problem with `anchor` moved to the centre of the target's disc, and |z| <= z_max as one more pair.

    |z| = |f(0)| for every f; so 0 joins the source points, and the image of the disc |x| <= z_max the match discs. Its
    weight is that of all others together and 1.
    """
    problem = best.problem
    centre = np.append(problem.centres, 0)
    radius = np.append(problem.radii, best.z_max)
    # where x -> (x - b) / (1 - conj(b) x) carries the discs, eq. 20-22 of the paper
    facing = 1 - np.conj(anchor) * centre
    span = np.abs(facing) ** 2 - abs(anchor) ** 2 * radius**2
    pairs = np.append(problem.weight, np.ceil(problem.limit) + 1) / problem.unit
    return Matching(
        source=np.append(points, 0),
        centres=((centre - anchor) * np.conj(facing) + anchor * radius**2) / span,
        radii=radius * (1 - abs(anchor) ** 2) / span,
        rows=Rows(
            np.append(problem.starts, problem.count + 1),
            np.append(problem.target, len(problem.centres)).astype(np.int32),
            pairs.astype(np.uint32),
        ),
        unit=problem.unit,
    )


def _swept(framed: Matching, z: Complexes) -> tuple[complex, float, float]:
    """Return the best of the transformations (z, theta) over some z and all theta, and its value; to rounding error."""
    row, pair, middle, half_width = exact_arcs(framed, z)
    values, thetas = stab(
        row, framed.point[pair], middle, half_width, framed.weight[pair], len(z), len(framed.source)
    )  # fmt: skip
    k = int(np.argmax(values))
    return complex(z[k]), float(thetas[k]), float(values[k] - framed.weight[-1])


def _tried(framed: Matching, z: Complexes, rotations: int) -> tuple[complex, float, float]:
    """Return the best of the transformations (z, theta) over some z and a grid of theta, and its value."""
    theta = 2 * np.pi * np.arange(rotations) / rotations
    turns = np.exp(1j * theta)
    best = (0j, 0.0, -np.inf)
    for at in z.tolist():
        image = Mobius(at, 0.0)(framed.source)[framed.point]
        within = np.flatnonzero(np.abs(np.abs(image) - np.abs(framed.centre)) <= framed.radius)
        if len(within) == 0:
            continue
        matched = np.abs(image[within, None] * turns - framed.centre[within, None]) <= framed.radius[within, None]
        worth: Floats = np.where(matched, framed.weight[within, None], 0.0)
        first = np.flatnonzero(np.diff(framed.point[within], prepend=-1))
        total = np.maximum.reduceat(worth, first, axis=0).sum(axis=0) - framed.weight[-1]
        k = int(np.argmax(total))
        if total[k] > best[2]:
            best = (at, float(theta[k]), float(total[k]))
    return best
