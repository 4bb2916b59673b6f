"""Section 5.2: points of a silhouette, a planted transformation, noise and outliers.

The silhouette car-01 is packed with circles and so flattened; N of its points are the source, their images under a
random Möbius transformation, with Gaussian noise and a share of random points in their place, the target.
"""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from solver import Flattening, Mobius, flatten, silhouette_mesh
from solver.mobius import hyperbolic_distance
from tests.solver.gif import read_gif

from . import figures, quoted
from .data import DATA, absent
from .methods import GRID, INVARIANT, METHODS, OBJECTIVES, PRINTED, Problem, literal_stop, result, row, truth_by_pairs
from .tables import as_text, averaged, write_csv

SILHOUETTE = "silhouettes/car-01.gif"
EPSILON = SIGMA = 0.01
READINGS = {"sigma per coordinate": SIGMA, "sigma in all": SIGMA / np.sqrt(2)}
"""Standard deviation of each coordinate of the noise, for the two ways to read a Gaussian of sigma = 0.01."""
OUTLIERS = (0.0, 0.25, 0.5)
LARGEST_Z = 0.7
MILD_Z, MILD_THETA = 0.1, np.radians(10)
"""Bounds of |z| and |theta| in the mild transformation of ICP2; the paper's own are not stated here."""
SEARCH_ALONE = (200, 400)
"""More numbers of points, for the search's run time."""


@dataclass(frozen=True)
class Setting:
    """One instance of the experiment, drawn from its seed."""

    objective: str
    reading: str
    outliers: float
    n: int
    trial: int = 0
    mild: bool = False


@cache
def silhouette() -> tuple[Flattening, str]:
    """Return the flattened shape and its name; one drawn in code where the file is absent."""
    if reason := absent(SILHOUETTE):
        y, x = np.mgrid[120:0:-1, 0:256]
        body = (np.abs(x - 128) < 112) & (np.abs(y - 52) < 24)
        cabin = (y >= 70) & (y < 108) & (np.abs(x - 120) < 96 - 0.9 * (y - 70))
        wheels = [(x - centre) ** 2 + (y - 30) ** 2 < 20**2 for centre in (66, 190)]
        shape, name = body | cabin | wheels[0] | wheels[1], f"a stand-in drawn in code, as {reason}"
    else:
        shape, name = read_gif(DATA / SILHOUETTE) > 127, SILHOUETTE
    return flatten(
        silhouette_mesh(shape, 2000, Path(SILHOUETTE).stem if not reason else "stand-in"), "circle-packing"
    ), name


def drawn(setting: Setting) -> tuple[Problem, Mobius, np.ndarray]:
    """Return the problem, the planted transformation and which source points are inliers.

    Noise and match discs are Euclidean for the printed objective and hyperbolic for the invariant one.
    """
    flat = silhouette()[0]
    inside = np.setdiff1d(np.arange(len(flat.disc)), flat.boundary)
    rng = np.random.default_rng([setting.trial, setting.n, round(100 * setting.outliers), setting.mild])
    source = flat.disc[rng.choice(inside, setting.n, replace=False)]
    if setting.mild:
        planted = Mobius(MILD_Z * _in_disc(rng, 1)[0], rng.uniform(-MILD_THETA, MILD_THETA))
    else:
        planted = Mobius(LARGEST_Z * _in_disc(rng, 1)[0], rng.uniform(0, 2 * np.pi))
    image = planted(source)
    noise = READINGS[setting.reading] * (rng.normal(size=setting.n) + 1j * rng.normal(size=setting.n))
    hyperbolic = setting.objective == INVARIANT
    target = (image + noise) / (1 + np.conj(image) * noise) if hyperbolic else image + noise
    wrong = rng.permutation(setting.n)[: round(setting.outliers * setting.n)]
    target[wrong] = _in_disc(rng, len(wrong))
    target /= np.maximum(1, np.abs(target) / (1 - 1e-6))
    order = rng.permutation(setting.n)
    pairs = np.stack([order, np.arange(setting.n)], axis=1)[~np.isin(order, wrong)]
    metric = "hyperbolic" if hyperbolic else "euclidean"
    truth = truth_by_pairs(source, target[order], pairs, metric)
    good = np.setdiff1d(np.arange(setting.n), wrong)
    return Problem(source, target[order], EPSILON, setting.objective, truth), planted, good


def _in_disc(rng: np.random.Generator, count: int) -> np.ndarray:
    return np.sqrt(rng.random(count)) * np.exp(2j * np.pi * rng.random(count))


def measured(setting: Setting) -> list[dict[str, Any]]:
    """Return the rows of one instance: every method, the planted transformation, and ICP2 on a mild one."""
    problem, planted, good = drawn(setting)
    known = {
        "objective": setting.objective,
        "noise": setting.reading,
        "outliers": setting.outliers,
        "N": setting.n,
        "trial": setting.trial,
    }
    proven = result(problem, "Möbius search")
    rows = []

    def add(name: str, found: Any, problem: Problem, planted: Mobius, optimum: float, good: np.ndarray) -> None:
        off = hyperbolic_distance(found.mobius(problem.source[good]), planted(problem.source[good]))
        rows.append(
            known
            | row(problem, name, found)
            | {
                "share_of_optimum": found.value / optimum,
                "inliers": len(good),
                "planted_Q": int(_value(problem, planted)),
                "error": float(np.median(off)),
                "right": bool(np.median(off) < 5 * SIGMA),
            }
        )

    for name in METHODS:
        found = proven if name == "Möbius search" else result(problem, name)
        add("ICP1" if name == "ICP" else name, found, problem, planted, proven.value, good)
    literal = literal_stop(problem)
    add("Algorithm 1, stop as printed", _valued(problem, literal), problem, planted, proven.value, good)
    mild, gentle, inliers = drawn(replace(setting, mild=True))
    optimum = result(mild, "Möbius search").value
    add("ICP2 (mild)", result(mild, "ICP"), mild, gentle, optimum, inliers)
    return rows


def _value(problem: Problem, mobius: Mobius) -> float:
    return _valued(problem, mobius).value


def _valued(problem: Problem, mobius: Mobius) -> Any:
    """Return a given transformation as a result: closest points, stopped before their first round."""
    return result(problem, "ICP", start=mobius, iterations=0)


def timed(setting: Setting, grid: bool) -> dict[str, Any]:
    """Return size and seconds of the search alone or of brute force on the papers' grid of rotations."""
    problem, *_ = drawn(setting)
    found = result(problem, "brute force", rotations=GRID) if grid else result(problem, "Möbius search")
    name = f"brute force, {GRID} rotations" if grid else "Möbius search"
    return {"objective": setting.objective, "N": setting.n} | row(problem, name, found)


def collapsing(setting: Setting, z_max: float) -> dict[str, Any]:
    """Return what the proven optimum is if |z| is bounded by z_max."""
    problem, planted, good = drawn(setting)
    found = result(problem, "Möbius search", z_max=z_max)
    off = hyperbolic_distance(found.mobius(problem.source[good]), planted(problem.source[good]))
    return {
        "objective": setting.objective,
        "z_max": z_max,
        "N": setting.n,
        "inliers": len(good),
        "planted_Q": int(_value(problem, planted)),
        "Q_bnb": int(found.value),
        "certified": found.certified,
        "one_to_one": int(found.one_to_one),
        "Q_truth": problem.truth(found.mobius),
        "abs_z": abs(found.mobius.z),
        "error": float(np.median(off)),
        "seconds": found.seconds,
    }


def run(folder: Path, sizes: list[int], trials: int, jobs: int) -> None:
    """Write the tables and figures of the experiment."""
    _, name = silhouette()
    print(f"Silhouette: {name}")
    settings = [
        Setting(objective, reading, outliers, n, trial)
        for n in sorted(sizes, reverse=True)
        for objective in OBJECTIVES
        for reading in READINGS
        for outliers in OUTLIERS
        for trial in range(trials)
    ]
    plain = next(iter(READINGS))
    with ProcessPoolExecutor(jobs) as pool:
        grids = [pool.submit(timed, Setting(INVARIANT, plain, 0.25, n), True) for n in sorted(sizes, reverse=True)]
        rows = []
        for k, more in enumerate(pool.map(measured, settings)):
            rows += more
            print(f"{k + 1} of {len(settings)}: {settings[k]}", flush=True)
        alone = [
            pool.submit(timed, Setting(objective, plain, 0.25, n), False)
            for objective in OBJECTIVES
            for n in SEARCH_ALONE
        ]
        bounded = [
            pool.submit(collapsing, Setting(objective, plain, 0.25, max(sizes)), z_max)
            for objective in (PRINTED, INVARIANT)
            for z_max in (0.7, 0.9, 0.95, 0.99, 0.999, 0.9999)
        ]
        times = [job.result() for job in grids + alone]
        collapse = [job.result() for job in bounded]

    write_csv(folder / "synthetic.csv", rows)
    write_csv(folder / "times.csv", times)
    write_csv(folder / "collapse.csv", collapse)
    mean = [
        "Q_bnb",
        "share_of_optimum",
        "inliers",
        "planted_Q",
        "Q_mv",
        "Q_truth",
        "abs_z",
        "error",
        "right",
        "seconds",
    ]
    table = averaged(rows, ["objective", "noise", "outliers", "N", "method"], mean)
    summary = averaged(rows, ["objective", "N", "method"], ["share_of_optimum", "error", "right", "seconds"])
    overall = averaged(rows, ["objective", "method"], ["share_of_optimum", "right"])
    text = [
        f"Silhouette: {name}\neps = sigma = {EPSILON}; {trials} instances of each setting, means.\n{quoted.NOTE}\n",
        as_text(overall, "All settings together (right: the median inlier is off by less than 0.05)"),
        as_text(summary, "All noise and outlier levels together"),
        as_text(table, "Each setting"),
        as_text(times, f"Run times, {plain}, 25 % outliers"),
        as_text(collapse, f"The optimum under a bound on |z|, {plain}, 25 % outliers"),
    ]
    (folder / "synthetic.txt").write_text("\n".join(text), encoding="utf-8")
    print("\n".join([*text[:3], *text[4:]]))
    figures.run_times(folder / "synthetic_times.png", summary, times)
    figures.collapse(folder / "synthetic_collapse.png", collapse)
    for objective, end in ((INVARIANT, "correspondences"), (PRINTED, "as_printed")):
        problem, planted, good = drawn(Setting(objective, plain, 0.25, max(sizes)))
        figures.on_silhouette(
            folder / f"synthetic_{end}.png",
            f"{silhouette()[0].mesh.name}, {objective}",
            silhouette()[0],
            problem,
            result(problem, "Möbius search"),
            planted,
            good,
        )
