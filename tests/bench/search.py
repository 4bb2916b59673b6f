"""The certified search against the paper's Algorithm 1, its limits, and how its time grows.

Run::

    uv run --group bench python tests/bench/search.py [--quick] [--seed N] [--plot docs/search-growth.png]

prints one table, of instances drawn anew in every run unless a seed is given. Ratios to Algorithm 1 are of processor
time on one thread, which a busy machine changes little; what two threads gain is of time passed, for which the machine
should have nothing else to do. The picture shows processor time of one thread as well.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).resolve().parent)]

from algorithm_1 import algorithm_1  # noqa: E402

from solver import Mobius, search  # noqa: E402
from solver.search.frontier import SMALLEST_CELL  # noqa: E402
from solver.search.kernels import CompiledKernels, compiled  # noqa: E402
from solver.search.kernels.nodes import BOUND, FROM, HALF, WIDTH, X, Y, new_nodes  # noqa: E402
from solver.search.matching import Matching, matching  # noqa: E402
from solver.search.outcome import SearchResult  # noqa: E402


def evenly(rng: np.random.Generator, count: int, largest: float = 0.95) -> np.ndarray:
    """Points spread evenly over |x| <= largest."""
    return largest * np.sqrt(rng.random(count)) * np.exp(2j * np.pi * rng.random(count))


def paper_instance(seed: int, count: int, outliers: float, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Points, and their images under a Möbius map with normal noise, a fraction replaced by points anywhere."""
    rng = np.random.default_rng(seed)
    source = evenly(rng, count)
    f = Mobius(complex(evenly(rng, 1, 0.6)[0]), rng.uniform(0, 2 * np.pi))
    target = f(source) + noise * (rng.standard_normal(count) + 1j * rng.standard_normal(count))
    wrong = rng.permutation(count)[: round(outliers * count)]
    target[wrong] = evenly(rng, len(wrong))
    return source, target / np.maximum(1, np.abs(target) / 0.999)


def dense_instance(seed: int, n1: int, n2: int, share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A dense target, sparse source points on the same surface, and weights from four noisy smooth descriptors."""
    rng = np.random.default_rng(seed)
    target = evenly(rng, n2, 0.97)
    f = Mobius(0.3 + 0.1j, 1.0)
    source = f.inverse()(evenly(rng, n1, 0.9))
    waves, shares = 4 * rng.standard_normal((12, 2)), rng.standard_normal((12, 4))

    def descriptors(x: np.ndarray) -> np.ndarray:
        smooth = np.sin(np.stack([x.real, x.imag], axis=1) @ waves.T + np.arange(12)) @ shares
        return smooth + 0.3 * rng.standard_normal((len(x), 4))

    apart = ((descriptors(f(source))[:, None] - descriptors(target)[None]) ** 2).sum(axis=2)
    limit = np.quantile(apart, share)
    return source, target, np.where(apart < limit, np.exp(-apart / limit), 0)


class Clock:
    """Times the kernels' calls, over all threads."""

    def __init__(self) -> None:
        self.seconds = {"__init__": 0.0, "expand": 0.0, "rotations": 0.0}

    def wrap(self, name: str) -> None:
        original: Callable = getattr(CompiledKernels, name)

        def clocked(*arguments: object, **options: object) -> object:
            begun = time.perf_counter()
            try:
                return original(*arguments, **options)
            finally:
                self.seconds[name] += time.perf_counter() - begun

        setattr(CompiledKernels, name, clocked)


def row(label: str, found: SearchResult, base: tuple[float, float, int, float] | None, clock: Clock) -> str:
    """Return a line of the table."""
    spent = clock.seconds
    total = max(sum(spent.values()), 1e-9)
    shares = " ".join(f"{100 * spent[name] / total:3.0f}%" for name in ("__init__", "expand", "rotations"))
    line = (
        f"{label:34s} {found.value:8.2f} {found.upper_bound:8.2f} {'yes' if found.certified else 'NO':3s} "
        f"{found.nodes:8d} {found.seconds:8.3f} {found.nodes / found.seconds:9.0f}   {shares}"
    )
    if base is not None:
        same = "" if base[0] == found.value else "  OPTIMA DIFFER"
        line += f"   {base[2]:8d} {base[3]:8.2f} {base[3] / found.seconds:6.1f}{same}"
    for name in spent:
        spent[name] = 0.0
    return line


def leaves(problem: Matching, value: float, z_max: float, samples: int = 60) -> float:
    """Return about how many dyadic cells of z it takes to prove `value` with the bound as sharp as it is.

    A leaf of half side h stands for 1 / (4 h^2) of its area; the mean over random z of that, times the area, is their
    number. The bound is taken in 16 windows of 512 stretches each, close to sweeping; cells around the optimum, which
    take more, are given up at 2^-14.
    """
    kernels, windows = CompiledKernels(problem, z_max, SMALLEST_CELL), 16
    z = evenly(np.random.default_rng(0), samples, z_max)
    count = 0.0
    for depth in range(4, 15):  # greater cells are never excluded
        half = 2.0**-depth
        nodes = new_nodes(len(z) * windows)
        nodes[:, X], nodes[:, Y] = (
            np.repeat((np.floor(x / (2 * half)) + 0.5) * 2 * half, windows) for x in (z.real, z.imag)
        )
        nodes[:, HALF], nodes[:, WIDTH] = half, 1 / windows
        nodes[:, FROM] = np.tile(np.arange(windows) / windows, len(z))
        dead = kernels.bounds(nodes)[:, BOUND].reshape(len(z), windows).max(axis=1) <= value
        count += np.count_nonzero(dead) / samples * np.pi * z_max**2 / (4 * half**2)
        z = z[~dead]
    return count


def limit(label: str, given: tuple[np.ndarray, np.ndarray], radius: float, z_max: float) -> None:
    """Print how far one search is from what any cover takes, on one thread, and the same without AVX2."""
    problem = matching(*given, radius, metric="euclidean")
    search(*given, radius, metric="euclidean", z_max=z_max, threads=1)
    begun = time.process_time()
    found = search(*given, radius, metric="euclidean", z_max=z_max, threads=1)
    spent = time.process_time() - begun
    fast = compiled.library
    plain = compiled.opened(importlib.import_module("mobius_kernels").LIBRARIES[0])
    compiled.library = lambda: plain
    begun = time.process_time()
    search(*given, radius, metric="euclidean", z_max=z_max, threads=1)
    slow = time.process_time() - begun
    compiled.library = fast
    needed, nanoseconds = leaves(problem, found.value, z_max), 1e9 * spent / found.nodes / len(given[0])
    print(
        f"{label}: about {needed:.0f} leaves needed, {found.nodes} bounds computed; a bound takes "
        f"{nanoseconds:.0f} ns per source point; {slow / spent:.2f} times that without AVX2",
        flush=True,
    )


def timed(run: Callable, times: int = 3) -> tuple[float, float, object]:
    """Return the least seconds of the processor and by the clock that some runs took, and what they returned."""
    processor, clock, found = np.inf, np.inf, None
    for _ in range(times):
        begun = time.process_time(), time.perf_counter()
        found = run()
        processor = min(processor, time.process_time() - begun[0])
        clock = min(clock, time.perf_counter() - begun[1])
    return processor, clock, found


def against_algorithm_1(quick: bool, first: int) -> None:
    """Print N = 100 at six noise levels and three outlier rates: each beside Algorithm 1, on one thread and two."""
    print(f"N = 100, eps = .01, |z| <= .8, seeds from {first} on: milliseconds of the processor; ratio;", end=" ")
    print("two threads to one")
    ratios, threads, ours = [], [], []
    for outliers in (0, 0.25, 0.5):
        for noise in (0, 0.001, 0.002, 0.003, 0.005, 0.01):
            for seed in range(first, first + (1 if quick else 3)):
                given = paper_instance(seed, 100, outliers, noise)
                run = partial(search, *given, 0.01, metric="euclidean", z_max=0.8)
                one, one_clock, found = timed(partial(run, threads=1))
                _, two_clock, _ = timed(partial(run, threads=2))
                base, _, plain = timed(lambda given=given: algorithm_1(*given, 0.01, 0.8), 1)
                assert found.value == plain[0], "optima differ"
                assert found.certified
                ratios.append(base / one)
                threads.append(two_clock / one_clock)
                ours.append(1000 * one)
                print(
                    f"  {outliers:4.0%} outliers, noise {noise:5.3f}: {found.nodes:6d} bounds {1000 * one:7.1f}"
                    f"   Algorithm 1 {plain[2]:6d} bounds {1000 * base:7.1f}   {base / one:5.1f}",
                    f"  {two_clock / one_clock:4.2f}",
                    flush=True,
                )
    for name, x in (("ratio", ratios), ("two threads to one", threads), ("milliseconds", ours)):
        print(f"{name}: median {np.median(x):.2f}, {min(x):.2f} to {max(x):.2f}")


def table(quick: bool) -> None:
    """Print the table of what the time goes to."""
    clock = Clock()
    for name in clock.seconds:
        clock.wrap(name)
    for name in clock.seconds:
        clock.seconds[name] = 0.0
    print(f"{'':34s} {'value':>8s} {'bound':>8s} {'ok':3s} {'nodes':>8s} {'seconds':>8s} {'bounds/s':>9s}", end="")
    print("   raster, cells, rotations   Algorithm 1: nodes, seconds, ratio")
    ratios = []
    for outliers in (0, 0.25, 0.5):
        for seed in range(1 if quick else 5):
            given = paper_instance(seed, 100, outliers, 0.01)
            found = search(*given, 0.01, metric="euclidean", z_max=0.8)
            base = algorithm_1(*given, 0.01, 0.8)
            ratios.append(base[3] / found.seconds)
            print(row(f"N = 100, eps = .01, {outliers:.0%} outliers", found, base, clock), flush=True)
    print(f"median ratio {np.median(ratios):.1f}, least {min(ratios):.1f}, most {max(ratios):.1f}")
    for outliers in (0, 0.25, 0.5):
        found = search(*paper_instance(0, 1000, outliers, 0.004), 0.004, metric="euclidean", z_max=0.8, time_limit=60)
        print(row(f"N = 1000, eps = .004, {outliers:.0%} outliers", found, None, clock), flush=True)
    for seed in range(1 if quick else 3):
        source, target, weights = dense_instance(seed, 150, 2000, 0.05)
        found = search(source, target, 0.03, weights=weights, z_max=0.83, time_limit=30)
        print(row("150 x 2000, 5 %, tau = .03", found, None, clock), flush=True)
        both = search(source, target, 0.05, weights=weights, z_max=0.83, time_limit=30, reflect=True)
        print(row("  the same, tau = .05, reflected too", both, None, clock), flush=True)
    limit("N = 100, 25 % outliers", paper_instance(0, 100, 0.25, 0.01), 0.01, 0.8)
    limit("N = 1000, 25 % outliers", paper_instance(0, 1000, 0.25, 0.004), 0.004, 0.8)


def plot(path: Path) -> None:
    """Draw processor time against the number of points, the radius, the outliers and the size of a dense target."""
    import matplotlib.pyplot as plt

    def seconds(run: Callable[[int], SearchResult]) -> float:
        spent = []
        for seed in range(3):
            begun = time.process_time()
            assert run(seed).certified, "only what is proved is drawn"
            spent.append(time.process_time() - begun)
        return float(np.median(spent))

    def paper(count: int, eps: float, outliers: float) -> float:
        return seconds(
            lambda seed: search(
                *paper_instance(seed, count, outliers, eps), eps, metric="euclidean", z_max=0.8, threads=1
            )
        )

    def dense(n1: int, n2: int) -> float:
        def run(seed: int) -> SearchResult:
            source, target, weights = dense_instance(seed, n1, n2, 0.05)
            return search(source, target, 0.05, weights=weights, z_max=0.83, threads=1)

        return seconds(run)

    counts, sizes = [25, 50, 100, 200, 400], [500, 1000, 2000, 4000]
    radii, outliers = [0.04, 0.02, 0.01, 0.005], [0, 0.15, 0.3, 0.45, 0.6]
    panels = [
        ("points N1 = N2 (eps = .01, 25 % outliers)", counts, [paper(n, 0.01, 0.25) for n in counts], "log"),
        ("target points N2 (N1 = 150, 5 % compatible)", sizes, [dense(150, n) for n in sizes], "log"),
        ("radius eps (N = 100, 25 % outliers)", radii, [paper(100, e, 0.25) for e in radii], "log"),
        ("outliers (N = 100, eps = .01)", outliers, [paper(100, 0.01, o) for o in outliers], "linear"),
    ]
    figure, axes = plt.subplots(1, 4, figsize=(15, 3.4), sharey=True, layout="constrained")
    for axis, (label, x, y, scale) in zip(axes, panels, strict=True):
        axis.plot(x, y, "o-", color="#3465a4")
        axis.set(xlabel=label, xscale=scale, yscale="log")
        axis.set_xticks(x, [f"{v:g}" for v in x], minor=False)
        axis.minorticks_off()
        axis.grid(alpha=0.3)
        print(label, [f"{a:g}: {b:.3f} s" for a, b in zip(x, y, strict=True)], flush=True)
    axes[0].set_ylabel("seconds to the certificate, one core")
    figure.savefig(path, dpi=110)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description="Benchmark of the certified search.")
    parser.add_argument("--quick", action="store_true", help="one instance of each kind")
    parser.add_argument("--seed", type=int, help="of the first instance at N = 100 (default: drawn anew)")
    parser.add_argument("--plot", type=Path, help="draw the growth of the time into this file as well")
    arguments = parser.parse_args()
    algorithm_1(*paper_instance(0, 5, 0, 0.01), 0.01, 0.8)  # compiles
    search(*paper_instance(0, 5, 0, 0.01), 0.01, metric="euclidean")
    anew = int(np.random.default_rng().integers(1000, 2**31)) if arguments.seed is None else arguments.seed
    against_algorithm_1(arguments.quick, anew)
    table(arguments.quick)
    if arguments.plot:
        plot(arguments.plot)


if __name__ == "__main__":
    main()
