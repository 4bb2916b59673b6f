"""Attacks on bounds and certificates, where everything is at the edge of what is allowed; used by the benchmark too."""

from __future__ import annotations

import importlib
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np
from instances import disc_points, nasty_points

from solver import Mobius, search
from solver.search.bounds import exact_arcs
from solver.search.certificate import certify
from solver.search.frontier import SMALLEST_CELL
from solver.search.kernels import CompiledKernels, ReferenceKernels, compiled
from solver.search.kernels.nodes import BOUND, FROM, HALF, KAPPA_X, KAPPA_Y, WIDTH, X, Y, new_nodes
from solver.search.kernels.reference import best_rotations, bound_cells
from solver.search.matching import Matching, matching

TURN = 2 * np.pi


def near_one(rng: np.random.Generator, count: int, smallest: float) -> np.ndarray:
    """1 less a number between `smallest` and 0.1, even on a logarithmic scale."""
    return 1 - 10.0 ** rng.uniform(np.log10(smallest), -1, count)


def pushed_out(rng: np.random.Generator, points: np.ndarray) -> np.ndarray:
    """The points, a third of them moved to within 1e-16 to 0.1 of the circle."""
    edge = rng.random(len(points)) < 0.3
    return np.where(edge, points * near_one(rng, len(points), 1e-16) / np.maximum(np.abs(points), 1e-300), points)


def cornered_problem(rng: np.random.Generator, most: int = 8) -> tuple[Matching, Mobius, float]:
    """A matching where everything is at the edge of what is allowed, a transformation that matches much, and z_max.

    Points on the rim, 1e-16 from it and coincident; discs of 1e-12 and of nearly everything, with the images of source
    points, or 0, on their edges; weights of 0, of 1, next to these, and equal ones.
    """
    n1, n2 = rng.integers(1, most + 1, 2)
    z_max = float(rng.choice([0.3, 0.9, 0.95, 1 - 1e-6, 1 - 1e-12]))
    z = z_max * np.exp(2j * np.pi * rng.random()) * rng.choice([1, rng.random(), 1 - 1e-9])
    while not abs(z) < z_max:
        z *= 1 - 2.0**-52
    planted = Mobius(z, rng.choice([0, np.pi, rng.uniform(-7, 7)]))
    source = pushed_out(rng, nasty_points(rng, n1))
    pole = rng.random(n1) < 0.2  # next to z, so that cells hold m and, for z near the rim, 1 / conj(m)
    source[pole] = planted.z * rng.choice([1, 1 - 1e-9, 1 + 1e-13], pole.sum())
    target = pushed_out(rng, nasty_points(rng, n2))
    image = planted(source[rng.integers(0, n1, n2)])
    target = np.where(rng.random(n2) < 0.5, image, target)
    through = rng.random(n2) < 0.25
    target[through] *= 10.0 ** rng.uniform(-8, 0, through.sum())
    metric = str(rng.choice(["hyperbolic", "euclidean"]))
    hyperbolic = metric == "hyperbolic"
    target *= np.minimum(1, (1 - 2.0**-51 if hyperbolic else 1) / np.maximum(np.abs(target), 1e-300))
    radius = 10.0 ** rng.uniform(-12, -0.1, n2)
    wide = rng.random(n2) < 0.2
    radius[wide] = near_one(rng, wide.sum(), 1e-15) if hyperbolic else rng.uniform(0.5, 2, wide.sum())
    with np.errstate(invalid="ignore", divide="ignore"):
        apart = np.abs(image - target) / (np.abs(1 - np.conj(target) * image) if hyperbolic else 1)
    tie = (rng.random(n2) < 0.5) & (apart > 0) & (apart < 1)
    radius[tie] = np.minimum(apart[tie] * rng.choice([1, 1, 1 - 1e-15, 1 + 1e-15, 1 - 1e-9], tie.sum()), 1 - 1e-16)
    # an edge through 0, next to it, or around it
    radius[through] = np.abs(target[through]) * rng.choice([1, 1 - 1e-9, 1 + 1e-9, 1.5, 1 - 1e-4], through.sum())
    radius = np.clip(radius, 1e-12, 1 - 1e-16 if hyperbolic else 2)
    kind, weights = rng.integers(0, 4), None
    if kind == 1:
        weights = rng.integers(0, 2, (n1, n2)).astype(float)
    elif kind == 2:
        weights = rng.integers(0, 5, (n1, n2)) / 4
    elif kind == 3:
        weights = rng.choice([0, 1, 2.0**-20, 1e-9, 1 - 1e-9, rng.random()], (n1, n2))
    return matching(source, target, radius, metric=metric, weights=weights), planted, z_max


def cornered_cells(
    rng: np.random.Generator, problem: Matching, planted: Mobius, z_max: float, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Dyadic cells (centre, half), and a z of each with |z| <= z_max and a rotation that may match much there.

    They lie around the planted z, source points, poles and the bound on |z|; z is often on an edge or corner or there.
    """
    half = 2.0 ** -rng.integers(0, 39, count)
    kind = rng.integers(0, 4, count)
    about = np.where(kind == 1, problem.source[rng.integers(0, len(problem.source), count)], planted.z)
    about = np.where(kind == 2, z_max * np.exp(2j * np.pi * rng.random(count)), about)
    about = np.where(kind == 3, disc_points(rng, count), about)
    grid = 2 * half
    centre = (np.floor(about.real / grid) + 0.5) * grid + 1j * (np.floor(about.imag / grid) + 0.5) * grid
    side = rng.uniform(-1, 1, (2, count))
    side = np.where(rng.random(side.shape) < 0.3, np.sign(side), side)
    z = np.where(rng.random(count) < 0.5, about, centre + half * (side[0] + 1j * side[1]))
    allowed = z.real**2 + z.imag**2 <= z_max**2 * (1 - 2.0**-50)
    centre, half, z = centre[allowed], half[allowed], z[allowed]
    theta = best_rotations(problem, z)[1]
    row, _, middle, width = exact_arcs(problem, z)
    order = rng.permutation(len(row))[: len(row) // 3]
    # ends of arcs, moved inward by little
    inward = 1 - rng.choice([0, 1e-15, 1e-9], len(order))
    theta[row[order]] = middle[order] + rng.choice([-1, 1], len(order)) * width[order] * inward
    return centre, half, z, np.where(z == planted.z, planted.theta, theta)


@cache
def libraries() -> dict[str, object]:
    """The compiled libraries that run here."""
    try:
        paths = importlib.import_module("mobius_kernels").LIBRARIES
    except ImportError:
        return {}
    opened = {path.stem.removeprefix("mobius_kernels_"): compiled.opened(path) for path in paths}
    return {name: library for name, library in opened.items() if "v3" not in name or library.mobius_runs_v3()}


@contextmanager
def kernels_of(library: object | None) -> Iterator[None]:
    """Have searches use one compiled library, or numpy."""
    module, before = sys.modules["solver.search.frontier"], compiled.library
    kept = module.kernels_for
    compiled.library = lambda: library
    module.kernels_for = CompiledKernels if library else ReferenceKernels
    try:
        yield
    finally:
        compiled.library, module.kernels_for = before, kept


def nodes_of(centre: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Cells with all rotations."""
    nodes = new_nodes(len(centre))
    nodes[:, X], nodes[:, Y], nodes[:, HALF], nodes[:, WIDTH] = centre.real, centre.imag, half, 1
    nodes[:, BOUND] = 2.0**20
    return nodes


def windows_of(rng: np.random.Generator, nodes: np.ndarray, z: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """The same cells with a kappa and a window each that holds (z, theta), often next to an end."""
    windows, count = nodes.copy(), len(nodes)
    kappa = 2 * disc_points(rng, count)
    windows[:, KAPPA_X], windows[:, KAPPA_Y] = kappa.real, kappa.imag
    windows[:, WIDTH] = 2.0 ** -rng.uniform(0.5, 30, count)
    phi = (theta + np.imag(kappa * (z - nodes[:, X] - 1j * nodes[:, Y]))) / TURN
    place = np.where(rng.random(count) < 0.5, rng.random(count), rng.choice([0, 1], count)) * windows[:, WIDTH]
    # as near to an end as phi is known
    windows[:, FROM] = phi - np.clip(place, 1e-14, windows[:, WIDTH] - 1e-14)
    return windows


def held(left: np.ndarray, z: complex, theta: float, value: float) -> bool:
    """Whether nodes hold a transformation, with a bound of at least its value."""
    inside = np.maximum(np.abs(left[:, X] - z.real), np.abs(left[:, Y] - z.imag)) <= left[:, HALF]
    kappa = left[:, KAPPA_X] + 1j * left[:, KAPPA_Y]
    phi = theta + np.imag(kappa * (z - left[:, X] - 1j * left[:, Y]))
    turned = np.remainder(phi / TURN - left[:, FROM], 1)
    # phi is computed in floats here
    seen = (turned <= left[:, WIDTH] + 1e-14) | (turned >= 1 - 1e-14) | (left[:, WIDTH] >= 1)
    return bool((inside & seen & (left[:, BOUND] >= value)).any())


def attack(
    rng: np.random.Generator,
    problem: Matching,
    planted: Mobius,
    z_max: float,
    count: int,
    looser: Matching | None = None,
) -> Counter[str]:
    """Count cells of one problem, and what of each kind of bound lies below a value in it: WRONG.

    looser: a problem to take the values from; more than the problem's own ones prove that the attack sees something.
    """
    centre, half, z, theta = cornered_cells(rng, problem, planted, z_max, count)
    known = [Mobius(x, t) for x, t in zip(z.tolist(), theta.tolist(), strict=True)]
    value = np.array([(looser or problem).value(f) for f in known])
    counts: Counter[str] = Counter({"cells": len(z), "cells that match": int((value > 0).sum())})
    counts["WRONG swept in numpy"] = int((bound_cells(problem, centre, half) < value).sum())
    nodes = nodes_of(centre, half)
    windows = windows_of(rng, nodes, z, theta)
    for name, library in libraries().items():
        with kernels_of(library):
            kernels = CompiledKernels(problem, z_max, SMALLEST_CELL)
        for raster in (False, True) if kernels.rasters else (False,):
            how = f"{name}, {kernels.rasters + ' raster' if raster else 'pairs'}"
            counts[f"WRONG {how}"] += int((kernels.bounds(nodes, raster)[:, BOUND] < value).sum())
            counts[f"WRONG {how}, window"] += int((kernels.bounds(windows, raster)[:, BOUND] < value).sum())
        for k in np.flatnonzero(value > 0)[:4]:
            left, _ = kernels.expand(nodes[k : k + 1], float(value[k]) * 0.999, int(rng.integers(1, 100)))
            counts[f"subtrees, {name}"] += 1
            counts[f"WRONG {name}, subtree"] += not held(left, complex(z[k]), float(theta[k]), float(value[k]))
    return counts


def cells_of(number: int, count: int) -> Counter[str]:
    """Attack some cells of one problem."""
    rng = np.random.default_rng([number, 21])
    return attack(rng, *cornered_problem(rng), count)


def searched(number: int, time_limit: float | None = 0.2) -> Counter[str]:
    """Search one instance by all kernels, and hold the outcome against what was planted and against `certify`."""
    rng = np.random.default_rng([number, 22])
    problem, planted, z_max = cornered_problem(rng, 6)
    discs = problem.given
    b, tau = (discs.centre, discs.radius) if discs else (problem.centres, problem.radii)
    weights = np.zeros((len(problem.source), len(b)))
    weights[problem.point, problem.target] = problem.weight
    options = {
        "metric": "hyperbolic" if discs else "euclidean",
        "weights": None if problem.rows is None else weights,
        "z_max": z_max,
        "reflect": bool(rng.random() < 0.3),
    }
    known = problem.value(planted)
    counts: Counter[str] = Counter(instances=1)
    certified = set()
    for name, library in {**libraries(), "numpy": None}.items():
        with kernels_of(library):
            found = search(problem.source, b, tau, time_limit=time_limit, threads=1, **options)
        claim = found.mobius, found.value, found.upper_bound
        # the work of a proof grows with the pairs and the cube of 1 / radius
        small = found.certified and len(problem.source) * len(b) <= 8 and tau.min() > 0.1 and z_max < 0.96
        checked = certify(*claim, problem.source, b, tau, prove=small, most_boxes=200_000, **options)
        counts[f"searches, {name}"] += 1
        counts[f"certified, {name}"] += found.certified
        counts[f"bounds proved again, {name}"] += checked.bound_holds is True
        counts[f"WRONG {name}: bound below what is planted"] += found.upper_bound < known
        counts[f"WRONG {name}: bound below value"] += found.upper_bound < found.value
        counts[f"WRONG {name}: claim refused"] += not checked.value_holds or bool(checked.objections)
        counts[f"WRONG {name}: value not for certain"] += checked.value < found.value
        if found.certified:
            certified.add(found.value)
    counts["WRONG certified values differ"] += len(certified) > 1
    return counts


def tried(number: int, attempt: Callable[[int], Counter[str]]) -> Counter[str]:
    """Make an attempt, or count what it raises as a violation, with its number."""
    try:
        return attempt(number)
    except Exception as error:
        return Counter({f"WRONG {type(error).__name__} in {number}: {error}": 1})


def violations(counts: Counter[str]) -> dict[str, int]:
    """What is wrong."""
    return {name: count for name, count in counts.items() if name.startswith("WRONG") and count}
