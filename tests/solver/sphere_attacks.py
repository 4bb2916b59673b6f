"""Attacks on bounds and certificates on the sphere, where everything is at the edge of what is allowed."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from attacks import libraries, violations
from spheres import random_mobius, sphere_points, unit

from solver.mobius import SphereMobius
from solver.search.frontier import SMALLEST_CELL
from solver.search.kernels.nodes import BOUND, FROM, HALF, WIDTH, X, Y
from solver.search.kernels.sphere_kernels import CompiledSphereKernels, bound_sphere_cells
from solver.search.kernels.sphere_nodes import FACE, new_sphere_nodes
from solver.search.sphere_bounds import FACES, enclosing_arcs, frames, transformation
from solver.search.sphere_certificate import certify_sphere
from solver.search.sphere_matching import SphereMatching, sphere_matching
from solver.search.sphere_search import sphere_search

TURN = 2 * np.pi


@contextmanager
def kernels_of(library: object | None) -> Iterator[None]:
    """Have searches on the sphere use one compiled library, or numpy."""
    modules = [sys.modules[f"solver.search.kernels.{name}"] for name in ("sphere_kernels", "box_kernels", "compiled")]
    kept = [module.library for module in modules]
    for module in modules:
        module.library = lambda: library
    try:
        yield
    finally:
        for module, before in zip(modules, kept, strict=True):
            module.library = before


def cornered_points(rng: np.random.Generator, count: int) -> np.ndarray:
    """Points with, at random, poles, points next to them, corners and edges of the cube, and coincident ones."""
    x = sphere_points(rng, count)
    kind = rng.integers(0, 8, count)
    x[kind == 0] = rng.choice([[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0], [0, -1.0, 0]], (kind == 0).sum())
    near = kind == 1
    x[near] = unit(
        np.array([0, 0, 1.0]) * rng.choice([1, -1], (near.sum(), 1)) + 10.0 ** rng.uniform(-12, -1) * x[near]
    )
    x[kind == 2] = x[0]
    corner = kind == 3
    x[corner] = unit(rng.choice([-1.0, 1.0, 0.3], (corner.sum(), 3)))
    return x


def cornered_problem(
    rng: np.random.Generator, most: int = 8, *, rotation: bool = False
) -> tuple[SphereMatching, SphereMobius, float]:
    """A matching where everything is at the edge, a transformation, or rotation, that matches much, and h_max."""
    n1, n2 = rng.integers(1, most + 1, 2)
    h_max = 0.0 if rotation else float(rng.choice([0.0, 0.05, 0.2, 0.5, 0.9]))
    planted = random_mobius(rng, h_max, reflect=False)
    if rng.random() < 0.3 and h_max:
        x, y, z = (np.array(planted.h) * h_max * (1 - 1e-15) / max(np.linalg.norm(planted.h), 1e-9)).tolist()
        planted = SphereMobius((x, y, z), planted.rotation)
    if rng.random() < 0.3:
        planted = SphereMobius(planted.h, (*tuple(rng.choice([0.0, 1.0, -1.0], 4).tolist()[:3]), 1.0))
    source, target = cornered_points(rng, n1), cornered_points(rng, n2)
    image = planted(source[rng.integers(0, n1, n2)])
    target = unit(np.where((rng.random(n2) < 0.5)[:, None], image, target))
    radius = 10.0 ** rng.uniform(-6, 0.3, n2)
    apart = np.linalg.norm(image - target, axis=1)
    tie = (rng.random(n2) < 0.5) & (apart > 1e-5)
    radius[tie] = apart[tie] * rng.choice([1, 1, 1 - 1e-15, 1 + 1e-15, 1 - 1e-9], tie.sum())
    radius = np.clip(radius, 1e-6, 2)
    kind, weights = rng.integers(0, 4), None
    if kind == 1:
        weights = rng.integers(0, 2, (n1, n2)).astype(float)
    elif kind == 2:
        weights = rng.integers(0, 5, (n1, n2)) / 4
    elif kind == 3:
        weights = rng.choice([0, 1, 2.0**-20, 1e-9, 1 - 1e-9, rng.random()], (n1, n2))
    return sphere_matching(source, target, radius, weights=weights), planted, h_max


def axis_of(mobius: SphereMobius) -> np.ndarray:
    """The point that the rotation carries to the upper pole."""
    return mobius.matrix.T @ [0.0, 0.0, 1.0]


def cells_around(
    rng: np.random.Generator, problem: SphereMatching, planted: SphereMobius, count: int
) -> tuple[np.ndarray, list[SphereMobius]]:
    """Cells, and a rotation in each that may match much; often on an edge or corner of the cell."""
    nodes = new_sphere_nodes(count)
    nodes[:, HALF] = 2.0 ** -rng.integers(0, 30, count)
    nodes[:, WIDTH], nodes[:, BOUND] = 1, 2.0**20
    middles = nodes.copy()
    about = np.where((rng.random(count) < 0.5)[:, None], axis_of(planted), cornered_points(rng, count))
    face = np.argmax(np.einsum("fj,cj->cf", FACES[:, 2], about), axis=1)
    nodes[:, FACE] = middles[:, FACE] = face
    turned = np.einsum("cij,cj->ci", FACES[face], about)
    place = np.clip(turned[:, :2] / turned[:, 2:], -1, 1)
    grid = 2 * nodes[:, [HALF]]
    nodes[:, [X, Y]] = np.clip((np.floor(place / grid) + 0.5) * grid, -1 + grid / 2, 1 - grid / 2)
    side = rng.uniform(-1, 1, (count, 2))
    side = np.where(rng.random(side.shape) < 0.3, np.sign(side), side)
    inside = np.abs(place - nodes[:, [X, Y]]).max(axis=1) <= nodes[:, HALF]
    keep = inside & (rng.random(count) < 0.5)
    middles[:, [X, Y]] = np.where(keep[:, None], place, nodes[:, [X, Y]] + side * nodes[:, [HALF]])
    middles[:, HALF] = 0
    angles = bound_sphere_cells(problem, middles)[1]
    row, _, centre, width = enclosing_arcs(problem, middles)
    some = rng.permutation(len(row))[: len(row) // 3]
    angles[row[some]] = centre[some] + rng.choice([-1, 1], len(some)) * width[some] * (1 - rng.choice([1e-11, 1e-9]))
    return nodes, [transformation(cell, phi) for cell, phi in zip(middles, angles.tolist(), strict=True)]


def angle_in(node: np.ndarray, mobius: SphereMobius) -> float:
    """The angle phi of a transformation in the frame of a cell: R = Rz(phi) S_c0 M(c, c0)."""
    middle = new_sphere_nodes(1)
    middle[0] = node
    c0, c = np.linalg.inv(frames(middle)[0]) @ [0, 0, 1.0], axis_of(mobius)
    onto = SphereMobius(rotation=(1 + float(c @ c0), *np.cross(c, c0).tolist())).matrix
    turn = mobius.matrix @ (frames(middle)[0] @ onto).T
    return float(np.arctan2(turn[1, 0], turn[0, 0]))


def holds(node: np.ndarray, mobius: SphereMobius) -> bool:
    """Whether a cell and its window hold a rotation."""
    turned = FACES[int(node[FACE])] @ axis_of(mobius)
    if turned[2] <= 0 or np.abs(turned[:2] / turned[2] - node[[X, Y]]).max() > node[HALF] + 1e-14:
        return False
    turned = (angle_in(node, mobius) / TURN - node[FROM]) % 1
    return bool(node[WIDTH] >= 1 or turned <= node[WIDTH] + 1e-12 or turned >= 1 - 1e-12)


def seen_through_wider_caps(attack: Callable[..., Counter[str]], *, rotation: bool = False) -> int:
    """How often an attack finds values of wider caps above bounds of narrow ones, as it has to somewhere."""
    seen = 0
    for number in range(12):
        rng = np.random.default_rng(number)
        problem, planted, h_max = cornered_problem(rng, rotation=rotation)
        looser = replace(problem, radii=np.minimum(problem.radii * 1.5 + 0.05, 2))
        seen += sum(violations(attack(rng, problem, planted, h_max, 60, looser)).values())
    return seen


def attack(
    rng: np.random.Generator,
    problem: SphereMatching,
    planted: SphereMobius,
    h_max: float,
    count: int,
    looser: SphereMatching | None = None,
) -> Counter[str]:
    """Count cells of one problem, and what of each kind of bound lies below a value in it: WRONG."""
    assert h_max == 0
    nodes, known = cells_around(rng, problem, planted, count)
    value = np.array([(looser or problem).value(f) for f in known])
    counts: Counter[str] = Counter({"cells": len(nodes), "cells that match": int((value > 0).sum())})
    counts["WRONG swept in numpy"] = int((bound_sphere_cells(problem, nodes)[0] < value).sum())
    windows = nodes.copy()
    windows[:, WIDTH] = 2.0 ** -rng.uniform(0.5, 30, count)
    phi = np.array([angle_in(node, f) for node, f in zip(nodes, known, strict=True)]) / TURN
    place = np.where(rng.random(count) < 0.5, rng.random(count), rng.choice([0, 1], count)) * windows[:, WIDTH]
    windows[:, FROM] = phi - np.clip(place, np.minimum(1e-13, windows[:, WIDTH] / 2), windows[:, WIDTH] - 1e-13)
    for name, library in libraries().items():
        with kernels_of(library):
            kernels = CompiledSphereKernels(problem, SMALLEST_CELL)
        for raster in (False, True) if kernels.rasters else (False,):
            how = f"{name}, {kernels.rasters + ' raster' if raster else 'pairs'}"
            counts[f"WRONG {how}"] += int((kernels.bounds(nodes, raster)[:, BOUND] < value).sum())
            counts[f"WRONG {how}, window"] += int((kernels.bounds(windows, raster)[:, BOUND] < value).sum())
        for k in np.flatnonzero(value > 0)[:6].tolist():
            start = (nodes, windows)[k % 2][k : k + 1]
            left, _ = kernels.expand(start, float(value[k]) * 0.999, int(rng.integers(1, 200)))
            counts[f"subtrees, {name}"] += 1
            good = [node for node in left if node[BOUND] >= value[k]]
            counts[f"WRONG {name}, subtree"] += not any(holds(node, known[k]) for node in good)
    return counts


def cells_of(number: int, count: int) -> Counter[str]:
    """Attack some cells of one problem."""
    rng = np.random.default_rng([number, 31])
    return attack(rng, *cornered_problem(rng, rotation=True), count)


def searched(number: int, time_limit: float | None = 0.2) -> Counter[str]:
    """Search one instance by all kernels, and hold the outcome against what was planted and against a check."""
    rng = np.random.default_rng([number, 32])
    problem, planted, h_max = cornered_problem(rng, 6)
    weights = np.zeros((len(problem.source), len(problem.centres)))
    weights[problem.point, problem.target] = problem.weight
    given = problem.source, problem.centres, problem.radii
    options = {"weights": weights, "h_max": h_max, "reflect": bool(rng.random() < 0.3)}
    known = problem.value(planted)
    counts: Counter[str] = Counter(instances=1)
    for name, library in {**libraries(), "numpy": None}.items():
        with kernels_of(library):
            found = sphere_search(*given, time_limit=time_limit, threads=1, **options)
        checked = certify_sphere(found.mobius, found.value, found.upper_bound, *given, **options)
        counts[f"searches, {name}"] += 1
        counts[f"certified, {name}"] += found.certified
        counts[f"rotations certified, {name}"] += found.rotations_certified
        counts[f"WRONG {name}: bound below what is planted"] += found.upper_bound < known
        counts[f"WRONG {name}: bound below value"] += found.upper_bound < found.value
        plain = problem.value(SphereMobius(rotation=planted.rotation))
        counts[f"WRONG {name}: bound of rotations below one"] += found.rotation_bound < plain
        counts[f"WRONG {name}: claim refused"] += not checked.value_holds or bool(checked.objections)
    return counts
