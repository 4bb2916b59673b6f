"""What teeth and faces have in common: pairs of flattened surfaces, every method on their sample points, the tables."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from solver import Mobius, TriangleMesh, align
from solver.flatten.barycentre import conformal_barycentre
from solver.search.fit import algebraic_fit, fitted
from solver.search.measures import q_truth

from . import figures, quoted
from .methods import BOUNDED, INVARIANT, METHODS, PRINTED, Problem, literal_stop, result, row
from .tables import as_text, averaged, write_csv

EPSILON = {PRINTED: 0.04, BOUNDED: 0.04, INVARIANT: 0.05}
"""Radii of the match discs; the paper does not state its own."""


LARGEST_Z = 0.7
"""Bound of |z| in the random transformation that each source disc is put through."""


@dataclass(frozen=True)
class Side:
    """One surface of a pair.

    Attributes
    ----------
    mesh : TriangleMesh
    disc : (n,) complex128
        Its conformal map; conjugated where the pair needs a reflection.
    samples : (k,) int
        Vertices inside, the most significant first, of which the first N stand for the surface.
    landmarks : (l,) int
        Vertices that correspond to the other side's of the same number.
    """

    mesh: TriangleMesh
    disc: np.ndarray
    samples: np.ndarray
    landmarks: np.ndarray


@dataclass(frozen=True)
class Pair:
    """Two surfaces of which landmarks are known."""

    name: str
    source: Side
    target: Side

    def problem(self, objective: str, n: int) -> Problem:
        """Return the search for the first n samples."""
        return Problem(
            self.source.disc[self.source.samples[:n]],
            self.target.disc[self.target.samples[:n]],
            EPSILON[objective],
            objective,
            self.truth,
        )

    @property
    def marks(self) -> tuple[np.ndarray, np.ndarray]:
        """The landmarks in the discs."""
        return self.source.disc[self.source.landmarks], self.target.disc[self.target.landmarks]

    def truth(self, mobius: Mobius) -> int:
        """Return Q_truth: landmark pairs that are mutually closest."""
        return q_truth(mobius, *self.marks)


def centred(disc: np.ndarray, mesh: TriangleMesh) -> np.ndarray:
    """Return a disc with its area-weighted conformal barycentre moved to the centre; unused vertices are nan."""
    used = np.isfinite(disc.real)
    return Mobius(conformal_barycentre(disc[used], mesh.vertex_areas[used]), 0.0)(disc)


def moved(side: Side, seed: int) -> Side:
    """Return a surface with its disc through a random Möbius transformation, as flattening leaves it undetermined."""
    rng = np.random.default_rng(seed)
    z = LARGEST_Z * np.sqrt(rng.random()) * np.exp(2j * np.pi * rng.random())
    return replace(side, disc=Mobius(z, rng.uniform(0, 2 * np.pi))(side.disc))


def measured(pair: Pair, objective: str, n: int) -> list[dict[str, Any]]:
    """Return the rows of one pair: every method, and the first step of Algorithm 1."""
    problem = pair.problem(objective, n)
    known = {"pair": pair.name, "objective": objective, "N": min(n, len(problem.source)), "of": len(pair.marks[0])}
    rows = [known | row(problem, name, result(problem, name)) for name in METHODS]
    literal = result(problem, "ICP", start=literal_stop(problem), iterations=0)
    return [*rows, known | row(problem, "Algorithm 1, stop as printed", literal)]


def beside(pair: Pair) -> list[dict[str, Any]]:
    """Return Q_truth without the samples' objective: of the best Möbius for the landmarks themselves, of a rotation of
    discs that are centred on their conformal barycentres, and of this project's `align` on the meshes.
    """
    x, y = pair.marks
    even = np.ones(len(x))
    best = fitted(x, y, even, algebraic_fit(x, y, even), metric="hyperbolic", z_max=0.999)
    found = align(pair.source.mesh, pair.target.mesh)
    a, b = found.source.disc[pair.source.landmarks], found.target.disc[pair.target.landmarks]
    level = replace(pair.source, disc=centred(pair.source.disc, pair.source.mesh))
    centred_pair = replace(pair, source=level)
    turn = literal_stop(centred_pair.problem(INVARIANT, 100))
    known = {"pair": pair.name, "of": len(x)}
    return [
        known | {"method": "fitted to the landmarks", "Q_truth": pair.truth(best)},
        known | {"method": "centred discs, best rotation", "Q_truth": centred_pair.truth(turn)},
        known
        | {
            "method": "solver.align",
            "certified": found.search.certified,
            "Q_truth": q_truth(found.mobius, a, b),
        },
    ]


def run(name: str, pairs: list[Pair], note: str, folder: Path, sizes: list[int], jobs: int) -> None:
    """Write the tables and figures of one kind of surface."""
    tasks = [(p, objective, n) for n in sorted(sizes, reverse=True) for objective in EPSILON for p in pairs]
    rows: list[dict[str, Any]] = []
    with ProcessPoolExecutor(jobs) as pool:
        running = [pool.submit(measured, *task) for task in tasks]
        others = [pool.submit(beside, pair) for pair in pairs]
        for k, job in enumerate(running):
            rows += job.result()
            print(f"{k + 1} of {len(tasks)}: {tasks[k][0].name}, {tasks[k][1]}, N = {tasks[k][2]}", flush=True)
        context = [line for job in others for line in job.result()]
    write_csv(folder / f"{name}.csv", rows)
    write_csv(folder / f"{name}_context.csv", context)
    summary = averaged(
        rows, ["objective", "N", "method"], ["Q_bnb", "one_to_one", "Q_mv", "Q_truth", "abs_z", "seconds", "certified"]
    )
    landmarks = averaged(context, ["method"], ["Q_truth"])
    head = (
        f"{note}\neps = {EPSILON[PRINTED]} ({PRINTED}), tau = {EPSILON[INVARIANT]} ({INVARIANT}). "
        f"Pairs: {', '.join(p.name for p in pairs)}.\n{quoted.NOTE}\n"
    )
    of = len(pairs[0].marks[0])
    text = [
        head,
        as_text(summary, f"Means over {len(pairs)} pairs; Q_truth is of {of} landmarks (certified: share of pairs)"),
        as_text(
            landmarks,
            f"Beside them, Q_truth of {of}: the best Möbius there is, centring alone, this project's pipeline",
        ),
        as_text(context, "The same, pair by pair"),
        as_text(rows, "Each pair"),
    ]
    (folder / f"{name}.txt").write_text("\n".join(text), encoding="utf-8")
    print("\n".join(text[:4]))
    drawn = [(pair, INVARIANT, "correspondences") for pair in pairs] + [(pairs[0], PRINTED, "as_printed")]
    for pair, objective, end in drawn:
        problem = pair.problem(objective, max(sizes))
        figures.on_surfaces(
            folder / f"{name}_{end}_{pair.name.replace(' ', '_')}.png",
            f"{pair.name}, {objective}",
            (pair.source.mesh, pair.target.mesh),
            (pair.source.samples, pair.target.samples),
            (pair.source.landmarks, pair.target.landmarks),
            problem,
            pair.marks,
            result(problem, "Möbius search"),
        )
