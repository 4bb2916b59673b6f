"""The globally optimal Möbius transformation by branch and bound over z, with the rotation found exactly for each z.

Le, Chin and Suter (2016), Algorithm 1, with the stopping rule that proves: the search ends when no cell that is left
can hold a better value than the one in hand (`frontier`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ..stages import SearchProgress
from .frontier import Search
from .matching import matching
from .outcome import SearchResult
from .watch import watched


def search(
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
    gap: float = 0.0,
    enough: float | None = None,
    at_least: int = 0,
    most_nodes: int | None = None,
) -> SearchResult:
    """Find the Möbius transformation that brings the greatest weight of source points into match discs of the target.

    Parameters
    ----------
    source : (N1,) complex
        Points of the closed unit disc.
    target : (N2,) complex
        Points of the closed unit disc; of the open one for the hyperbolic metric.
    radius : float or (N2,) float
        Radius of the match discs in the metric; hyperbolic: |x - b| / |1 - conj(b) x| <= radius < 1.
    metric : str
        "hyperbolic" (invariant under Möbius transformations) or "euclidean" (the paper's).
    weights : (N1, N2) float, optional
        In [0, 1]; 0 means incompatible. Rounded to multiples of 2^-20 or less (`Matching.unit`). Default: all 1.
    z_max : float
        Bound on |z|, in (0, 1).
    reflect : bool
        Search the transformations of the conjugated source as well.
    time_limit : float, optional
        Seconds after which the best so far is returned, with the bound proved by then, at most 0.2 s later.
    threads : int, optional
        At most; default: one per processor. The result does not depend on it, unless time runs out.
    progress : callable, optional
        Called ten times a second with a `SearchProgress`, in the calling thread; returns False to end the search, which
        then takes 0.2 s at most.
    gap : float
        The search ends as soon as `upper_bound` is proved to exceed `value` by at most this share of it: within 0.005
        of the optimum, say, which is not `certified`, but as far as it goes proved. Weights that differ by little leave
        a last percent that takes most of the time.
    enough : float, optional
        The search ends as soon as it is decided whether some transformation reaches this value. Without `at_least`
        nothing below it is looked for, so that `upper_bound` says no more than that none does.
    at_least : int
        Cells whose bound is computed before `enough` or `gap` ends the search: what is small is finished.
    most_nodes : int, optional
        Cells, about, after which the search ends: a limit that finds the same on every machine.

    Returns
    -------
    SearchResult
        Valid at whatever moment the search ended.

    Raises
    ------
    ValueError
        Wrong shapes or values out of range; the text names which.

    Notes
    -----
    Memory: some `FRONTIER` open cells of 64 bytes are kept, 16 MB. When there are more, the smallest are taken on
    instead of the best, depth first, until there are fewer. On top come 8 MB per thread for lists of pairs, and a
    raster of the target: up to 17 MB if all pairs may match, else 16 kB per source point, up to 128 MB. Pairs take
    nothing if all may match with weight 1, else 20 bytes for each of positive weight; 2^32 are refused. While one
    transformation is looked at, 30 MB more. Without the compiled kernels, up to 300 bytes for every pair that some
    rotation matches, whatever its weight.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> source = 0.9 * np.sqrt(rng.random(12)) * np.exp(2j * np.pi * rng.random(12))
    >>> found = search(source, Mobius(0.3 + 0.2j, 1.0)(source), 0.01)
    >>> found.value, found.certified
    (12.0, True)
    """
    if not 0 < z_max < 1:
        raise ValueError(f"z_max must lie between 0 and 1, not {z_max}")
    require_ends(time_limit, threads, gap)
    started = time.perf_counter()

    def until(value: float, bound: float, nodes: int) -> bool:
        if most_nodes is not None and nodes >= most_nodes:
            return True
        decided = enough is not None and (value >= enough or bound < enough)
        return nodes >= at_least and (decided or (gap > 0 and bound <= value * (1 + gap)))

    def work() -> None:
        state.begin(matching(source, target, radius, metric=metric, weights=weights, check=state.check), reflect)
        state.run(np.inf if time_limit is None else started + time_limit, threads or os.cpu_count() or 1)

    state = Search(float(z_max), float(np.size(source)), until)
    if enough is not None and at_least == 0:
        state.floor = float(np.nextafter(enough, -np.inf))
    deadline = None if time_limit is None else started + time_limit
    tell = None if progress is None else lambda: progress(state.progress(time.perf_counter() - started))
    cancelled = watched(work, state.halt, deadline, tell)
    return state.result(time.perf_counter() - started, cancelled)


def require_ends(time_limit: float | None, threads: int | None, gap: float) -> None:
    """Raise ValueError unless these can end a search."""
    if time_limit is not None and not time_limit >= 0:
        raise ValueError(f"time_limit must be a number of seconds, not {time_limit}")
    if threads is not None and threads < 1:
        raise ValueError(f"threads must be at least 1, not {threads}")
    if not gap >= 0:
        raise ValueError(f"gap must be a share of the value, 0 or more, not {gap}")
