"""Both orientations searched side by side: the better one to its end, the other as far as decides between them.

What is worth less than the better one's value by more than a margin is not looked for in the other, which mostly takes
longer to prove than the better one: its optimum is lower, and more cells could hold that much.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np

from ..stages import SearchProgress
from .frontier import Search
from .matching import Objective, matching
from .outcome import SearchResult
from .watch import watched


def search_both(
    objective: Objective,
    *,
    z_max: float,
    margin: float,
    time_limit: float | None = None,
    threads: int | None = None,
    progress: Callable[[SearchProgress], bool | None] | None = None,
    most_nodes: int | None = None,
) -> tuple[SearchResult, SearchResult]:
    """Return the outcomes of a search on the source and of one on the conjugated source.

    The better one is what `search` finds. The other is, too, if its best value comes within `margin` of the better
    one's; if not, its `upper_bound` says so, and its `value` is of the best that was met.

    Parameters
    ----------
    objective : Objective
        Of discs.
    z_max, threads, progress, most_nodes
        As for `search`.
    margin : float
        In the unit of Q.
    time_limit : float, optional
        Seconds for each of the two.

    Raises
    ------
    ValueError
        As by `search`.
    """
    started = time.perf_counter()
    deadline = None if time_limit is None else started + 2 * time_limit
    most = np.inf if most_nodes is None else most_nodes
    limit = float(len(objective.source))
    states = [Search(float(z_max), limit, lambda value, bound, nodes: nodes >= most) for _ in range(2)]
    halt = states[1].halt = states[0].halt

    def work() -> None:
        plain = matching(
            objective.source, objective.target, objective.radius, weights=objective.weights, check=states[0].check
        )
        states[0].begin(plain, False)
        states[1].kernels = [states[0].kernels[0].reflected()]  # the same tables
        states[1].begin(plain.reflected(), False)
        until = np.inf if deadline is None else deadline
        walks = [iter(state.rounds(until, threads or os.cpu_count() or 1)) for state in states]
        left = [0, 1]
        while left:
            # whichever could be worth more
            k = max(left, key=lambda k: states[k].upper_bound)
            states[k].floor = states[1 - k].value - margin
            states[k].close()
            if next(walks[k], "ended") == "ended":
                left.remove(k)

    def told() -> bool | None:
        assert progress is not None
        value, bound, nodes = np.array([state.proved for state in states]).T
        now = SearchProgress(value.max(), bound.max(), int(nodes.sum()), time.perf_counter() - started)
        return progress(now)

    cancelled = watched(work, halt, deadline, None if progress is None else told)
    seconds = time.perf_counter() - started
    plain, turned = (state.result(seconds, cancelled) for state in states)
    return plain, turned
