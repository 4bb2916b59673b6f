"""Random matching problems, easy and nasty, and slow references to hold the search against."""

import dataclasses

import numpy as np

from solver import Mobius
from solver.search.matching import Matching, matching


def disc_points(rng: np.random.Generator, count: int, largest: float = 1.0) -> np.ndarray:
    """Points spread evenly over |x| <= largest."""
    return largest * np.sqrt(rng.random(count)) * np.exp(2j * np.pi * rng.random(count))


def nasty_points(rng: np.random.Generator, count: int, largest: float = 1.0) -> np.ndarray:
    """Points of the disc with, at random, the centre, points of the rim or next to it, and coincident ones."""
    x = disc_points(rng, count)
    kind = rng.integers(0, 10, count)
    x[kind == 0] = 0
    rim = kind == 1
    x[rim] /= np.abs(x[rim])
    near = kind == 2
    x[near] *= (1 - 10.0 ** rng.uniform(-12, -2, near.sum())) / np.abs(x[near])
    x[kind == 3] = x[0]
    axis = kind == 4
    x[axis] = rng.choice([0.5, -0.5, 0.25j, -0.75j, 0.96875], axis.sum())
    return x * np.minimum(1, largest / np.maximum(np.abs(x), 1e-300))


def random_problem(rng: np.random.Generator, most: int = 9) -> Matching:
    """A matching with every option drawn at random: metric, radii, weights, special points."""
    n1, n2 = rng.integers(1, most + 1, 2)
    metric = str(rng.choice(["hyperbolic", "euclidean"]))
    source = nasty_points(rng, n1)
    target = nasty_points(rng, n2, 1 - 1e-9 if metric == "hyperbolic" else 1.0)
    radius = 10.0 ** rng.uniform(-4, -0.2, n2 if rng.random() < 0.5 else 1)
    weights = None
    if rng.random() < 0.5:
        weights = rng.random((n1, n2)) * (rng.random((n1, n2)) < 0.7)
        weights[rng.random((n1, n2)) < 0.2] = 1
    return matching(source, target, radius if len(radius) > 1 else radius[0], metric=metric, weights=weights)


def planted(
    rng: np.random.Generator, mobius: Mobius, count: int, outliers: float, noise: float
) -> tuple[np.ndarray, np.ndarray]:
    """Source and target of `count` points, related by `mobius` up to noise but for a fraction of outliers."""
    source = disc_points(rng, count, 0.95)
    target = mobius(source) + noise * disc_points(rng, count)
    wrong = rng.permutation(count)[: round(outliers * count)]
    target[wrong] = disc_points(rng, len(wrong), 0.95)
    return source, rng.permutation(target / np.maximum(1, np.abs(target) / 0.999))


def grown(problem: Matching, factor: float) -> Matching:
    """The same problem with every radius multiplied."""
    return dataclasses.replace(problem, radii=problem.radii * factor, given=None)


def quadratic_best(problem: Matching, z: complex, inward: float = 1e-10) -> float:
    """U(z) the slow way: Q at both ends and the middle of every pair's arc, which circle intersection gives."""
    h = Mobius(z, 0.0)(problem.source)[problem.point]
    rotations = [0.0]
    for x, c, e in zip(h, problem.centre, problem.radius, strict=True):
        middle = np.angle(c) - np.angle(x)
        a, b = abs(x), abs(c)
        if a > 0 and b > 0 and abs(a - b) <= e < a + b:
            # law of cosines by half angles
            half = 2 * np.arcsin(np.sqrt(np.clip((e - a + b) * (e + a - b) / (4 * a * b), 0, 1)))
            rotations += [middle - half * (1 - inward), middle + half * (1 - inward)]
        rotations.append(middle)
    return max(problem.value(Mobius(z, theta)) for theta in rotations)


def hypotheses(problem: Matching, z_max: float) -> np.ndarray:
    """The z of Möbius maps that carry two source points to the centres of two of their match discs: 1,500 at most."""
    found = [0j]
    inside = np.abs(problem.source[problem.point]) < 1 - 1e-6
    pairs = list(zip(problem.point[inside].tolist(), problem.centre[inside].tolist(), strict=True))
    for j, c in pairs:
        first, last = Mobius(problem.source[j], 0.0), Mobius(c * min(1, (1 - 1e-6) / max(abs(c), 1e-9)), 0.0)
        for k, d in pairs:
            if j != k:  # carry m_j to 0, turn so that m_k points at d seen from c, carry 0 to c
                theta = float(np.angle(last(d)) - np.angle(first(problem.source[k])))
                found.append((last.inverse() @ Mobius(0, theta) @ first).z)
    inside = np.array([z for z in found if abs(z) <= z_max])
    return inside[np.random.default_rng(0).permutation(len(inside))[:1500]]


def brute_force(problem: Matching, z_max: float, steps: int) -> float:
    """The best value over a fine grid of z and pair hypotheses, every theta exactly: a lower bound of the optimum."""
    axis = np.linspace(-z_max, z_max, steps)
    z = (axis[:, None] + 1j * axis).ravel()
    z = np.concatenate([z[np.abs(z) <= z_max], hypotheses(problem, z_max)])
    return max(quadratic_best(problem, complex(x)) for x in z)
