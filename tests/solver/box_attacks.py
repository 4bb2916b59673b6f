"""Attacks on bounds of boxes of transformations of the sphere, where everything is at the edge of what is allowed."""

from __future__ import annotations

from collections import Counter

import numpy as np
from attacks import libraries
from sphere_attacks import cornered_problem, kernels_of

from solver.mobius import SphereMobius
from solver.search.box_bounds import bounds_of, place_of
from solver.search.frontier import SMALLEST_CELL
from solver.search.kernels.box_kernels import CompiledBoxKernels, most_of
from solver.search.kernels.boxes import BOUND, FACE, LARGEST, MIDDLE, SIDES
from solver.search.sphere_matching import SphereMatching
from solver.search.sphere_search import h_within

EACH = 10
"""Boxes around one transformation: to count what it is worth takes longer than their bounds."""


def boxes_around(
    rng: np.random.Generator, planted: SphereMobius, h_max: float, count: int
) -> tuple[np.ndarray, list[SphereMobius]]:
    """Boxes, and a transformation in each that may match much; often on an edge or corner of the box."""
    known = [_near(rng, planted, h_max) for _ in range(-(-count // EACH))]
    boxes = np.repeat([place_of(f) for f in known], EACH, axis=0)[:count]
    even = 2.0 ** -rng.integers(0, 34, (count, 1)) * np.ones(6)
    half = np.where(rng.random((count, 1)) < 0.3, 2.0 ** -rng.integers(0, 34, (count, 6)), even)
    half = np.where(rng.random((count, 6)) < 0.1, 0, half)
    aside = rng.uniform(-1, 1, (count, 6))
    aside = np.where(rng.random((count, 6)) < 0.3, np.sign(aside), aside)
    boxes[:, SIDES], boxes[:, LARGEST], boxes[:, BOUND] = half, half.max(axis=1), 2.0**20
    boxes[:, MIDDLE] += aside * half
    return boxes, [known[k // EACH] for k in range(count)]


def _near(rng: np.random.Generator, planted: SphereMobius, h_max: float) -> SphereMobius:
    """The transformation that is planted, or another near it, with |h| <= h_max."""
    near = planted
    if rng.random() < 0.5:
        small = 10.0 ** rng.uniform(-12, 0.3)
        h = np.array(planted.h) + rng.choice([0, 1e-3, 1]) * small * rng.normal(size=3)
        x, y, z = (h * min(1, h_max * (1 - 1e-15) / max(float(np.linalg.norm(h)), 1e-300))).tolist()
        near = SphereMobius(rotation=(1.0, *(small * rng.normal(size=3)).tolist())) @ SphereMobius(
            (x, y, z), planted.rotation
        )
    return near if h_within(near.h, h_max) else SphereMobius(rotation=near.rotation)


def holding(boxes: np.ndarray, mobius: SphereMobius) -> np.ndarray:
    """Which boxes hold a transformation."""
    place = place_of(mobius)
    near = np.abs(place[MIDDLE] - boxes[:, MIDDLE]) <= boxes[:, SIDES] + 1e-13
    return (boxes[:, FACE] == place[FACE]) & near.all(axis=1)


def attack(
    rng: np.random.Generator,
    problem: SphereMatching,
    planted: SphereMobius,
    h_max: float,
    count: int,
    looser: SphereMatching | None = None,
) -> Counter[str]:
    """Count boxes of one problem, and what of each kind of bound lies below a value in it: WRONG."""
    boxes, known = boxes_around(rng, planted, h_max, count)
    value = np.repeat([(looser or problem).value(f) for f in known[::EACH]], EACH)[:count]
    counts: Counter[str] = Counter({"cells": len(boxes), "cells that match": int((value > 0).sum())})
    counts["WRONG in numpy"] = int((bounds_of(problem, boxes, most_of(h_max)) < value).sum())
    for name, library in libraries().items():
        with kernels_of(library):
            kernels = CompiledBoxKernels(problem, h_max, SMALLEST_CELL)
        counts[f"WRONG {name}"] += int((kernels.bounds(boxes) < value).sum())
        for k in np.flatnonzero(value > 0)[:6].tolist():
            start, low = boxes[k : k + 1], float(value[k]) * 0.999
            counts[f"WRONG {name}, told a value"] += int(kernels.bounds(start, low)[0] < value[k])
            enough = low * float(rng.choice([1, 1.2, 3]))
            rows = np.concatenate([start, np.zeros((1, kernels.width - start.shape[1]))], axis=1)
            left, _ = kernels.expand(rows, low, enough, int(rng.integers(1, 200)))
            left, _ = kernels.expand(left, low, low, int(rng.integers(1, 50)))  # with what the first has left in them
            counts[f"subtrees, {name}"] += 1
            counts[f"WRONG {name}, subtree"] += not holding(left[left[:, BOUND] >= value[k]], known[k]).any()
    return counts


def cells_of(number: int, count: int) -> Counter[str]:
    """Attack some boxes of one problem."""
    rng = np.random.default_rng([number, 33])
    return attack(rng, *cornered_problem(rng), count)
