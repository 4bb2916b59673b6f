"""The methods that are compared, and one row of a table for what each finds."""

import time
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from solver import Mobius, search
from solver.search.baselines import brute_force, gradient_descent, graph_matching, icp, voting
from solver.search.kernels import kernels_for
from solver.search.matching import matching
from solver.search.measures import q_mv, q_truth
from solver.search.outcome import SearchResult

TIME_LIMIT = 300.0
"""Seconds, by the clock, after which the search gives the gap instead of the certificate."""

METHODS = {
    "Möbius search": partial(search, time_limit=TIME_LIMIT, threads=1),
    "brute force": brute_force,
    "Möbius voting": voting,
    "graph matching": graph_matching,
    "gradient descent": gradient_descent,
    "ICP": icp,
}
GRID = 360
"""Rotations of brute force as the paper has it; the default finds the best rotation exactly."""

PRINTED, BOUNDED, INVARIANT = "eq. 3 as printed", "eq. 3, |z| <= 0.9", "hyperbolic"
OBJECTIVES: dict[str, dict[str, Any]] = {
    PRINTED: {"metric": "euclidean", "z_max": 0.9999},
    BOUNDED: {"metric": "euclidean", "z_max": 0.9},
    INVARIANT: {"metric": "hyperbolic", "z_max": 0.95},
}
"""The printed objective bounds |z| by 1 alone; the other two are what keeps it from collapsing."""


@dataclass(frozen=True)
class Problem:
    """What a method is given, and what is known about the answer.

    Attributes
    ----------
    source, target : (N1,), (N2,) complex128
    radius : float
    objective : str
        One of the OBJECTIVES.
    truth : callable
        Counts the true pairs that a transformation makes mutually closest, Q_truth.
    """

    source: np.ndarray
    target: np.ndarray
    radius: float
    objective: str
    truth: Any

    @property
    def options(self) -> dict[str, Any]:
        """The metric and the bound on |z|."""
        return OBJECTIVES[self.objective]


def result(problem: Problem, name: str, **more: Any) -> SearchResult:
    """Run one of the METHODS; its seconds are those of the processor, so that what else runs does not count."""
    started = time.process_time()
    found = METHODS[name](problem.source, problem.target, problem.radius, **(problem.options | more))
    return replace(found, seconds=time.process_time() - started)


def row(problem: Problem, name: str, found: SearchResult) -> dict[str, Any]:
    """Return the measures of section 5.1 for what a method found."""
    metric = problem.options["metric"]
    return {
        "method": name,
        "Q_bnb": int(found.value),
        "bound": int(found.upper_bound) if found.certified or name == "Möbius search" else "",
        "certified": found.certified,
        "one_to_one": int(found.one_to_one),
        "Q_mv": q_mv(found.mobius, problem.source, problem.target, metric=metric),
        "Q_truth": problem.truth(found.mobius),
        "abs_z": round(abs(found.mobius.z), 4),
        "seconds": round(found.seconds, 3),
    }


def literal_stop(problem: Problem) -> Mobius:
    """Return what Algorithm 1 returns if it stops where U(z0) = u*, as printed: the best rotation about the first z0.

    u* starts as U(z0) of the first square, whose centre is 0.
    """
    plain = matching(problem.source, problem.target, problem.radius, metric=problem.options["metric"])
    _, theta = kernels_for(plain, problem.options["z_max"], 2.0**-38).rotations(np.zeros(1, np.complex128))
    return Mobius(0, float(theta[0]))


def truth_by_pairs(problem_source: np.ndarray, problem_target: np.ndarray, pairs: np.ndarray, metric: str) -> Any:
    """Return Q_truth for pairs of the points that the methods see."""
    return lambda mobius: q_truth(mobius, problem_source, problem_target, pairs, metric=metric)
