"""The confidence calibrated: coefficients fitted on pairs of known correspondence, checked on kinds left out.

    python -m tests.bench.confidence -o FOLDER [--sets simpop,teeth,...] [--pairs K] [--plot PICTURE]

Prints the coefficients of `solver.confidence`, and for each kind of surface how well the confidence fits that the other
kinds give: the share of points that err by less than `BOUND`, the mean confidence, and the mean difference of both in
bins of confidence. The picture is of these predictions too. FOLDER, outside the repository, keeps what was computed.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from solver import Alignment, AlignSettings, align
from solver.align.result.confidence import BOUND, COLUMNS
from solver.surface.barycentric import interpolated

from .correspondence.pairs import Pair
from .correspondence.sets import SETS
from .correspondence.store import Store, code

FITTED = ["simpop", "ict", "ict-open", "one-open", "teeth", "hard-teeth", "brain", "bent", "partial", "cropped"]
FITTED += ["bodyparts", "noise", "depth", "coarse"]
"""Kinds of surface that the confidence is fitted to."""

BINS = 10

MAPS = ("dense", "mobius")


WRONG = ("rival", "turned")
"""Maps that are as a rule wrong: the best that sends everything elsewhere, and the best of the other orientation."""

SYMMETRIC = {"simpop", "ict", "ict-open", "one-open", "partial", "cropped", "noise", "depth"}
"""Kinds, faces, whose other orientation is nearly as right: which points of it err says nothing about maps."""


def observed(pair: Pair, store: Store, wrong: str = "") -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return evidence at points of a pair, (q, d), and their errors as shares of the source's diagonal, (q,).

    For the "dense" map and the "mobius" one before it; of one of `WRONG` in place of the best map, if wanted. Points
    found to lie beyond the source are left out: these are not matched, whatever the evidence.
    """

    def made() -> dict[str, np.ndarray]:
        reflect = "always" if pair.reflected != (wrong == "turned") else "never"
        settings = AlignSettings(fill_holes=pair.openings, reflect=reflect, take_rival=wrong == "rival")
        found = align(pair.source, pair.target, settings)
        before = replace(found, bending=None, overlap=None, counterpart=None)
        result = {}
        for name, alignment in (("dense", found), ("mobius", before)):
            face, barycentric = alignment.located
            places = interpolated(pair.source.vertices, pair.source.faces[face], barycentric)
            missed = pair.known.carried(pair.target, places) - pair.known.truth
            result[f"{name}_error"] = np.linalg.norm(missed, axis=1) / pair.source.diagonal
            result[f"{name}_evidence"] = pair.known.carried(pair.target, _evidence(alignment))
        return result

    kept = store.kept(f"evidence {wrong} {pair.kind} {pair.digest} {code('report', 'baselines', 'correspond')}", made)
    result = {}
    for name in MAPS:
        seen, error = kept[f"{name}_evidence"], kept[f"{name}_error"]
        there = np.isfinite(seen).all(axis=1)
        result[name] = seen[there], error[there]
    return result


def _evidence(found: Alignment) -> np.ndarray:
    """Return the evidence at all target vertices, (n, d); nan at those without a counterpart."""
    inner, vertices = found, np.arange(len(found.target.disc))
    if found.overlap is not None:
        inner, vertices = found.overlap.alignment, found.overlap.target.vertices
    used = vertices[np.isfinite(inner.target.disc.real)]
    result = np.full((len(found.target.disc), len(COLUMNS)), np.nan)
    result[used] = inner.evidence
    if found.counterpart is not None:
        result[~found.counterpart] = np.nan
    return result


def fitted(pairs: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Return the coefficients of the logistic model, (d,), most likely for pairs of evidence and error.

    Each pair counts alike. Nothing that speaks against a map may speak for it: all but the constant are at most 0. A
    weak ridge keeps what the data leaves open near 0.
    """
    x = np.concatenate([seen for seen, _ in pairs])
    good = np.concatenate([error < BOUND for _, error in pairs])
    weight = np.concatenate([np.full(len(error), 1 / len(error) / len(pairs)) for _, error in pairs])
    size = np.maximum(np.sqrt(weight @ x**2), 1e-12)

    def loss(b: np.ndarray) -> tuple[float, np.ndarray]:
        score = x / size @ b
        likelihood = weight @ np.logaddexp(0, np.where(good, -score, score))
        slope = (x / size).T @ (weight * (expit(score) - good))
        return likelihood + 1e-4 * (b[1:] @ b[1:]), slope + 2e-4 * np.concatenate([[0], b[1:]])

    bounds = [(None, None), *[(None, 0.0)] * (x.shape[1] - 1)]
    return minimize(loss, np.zeros(x.shape[1]), jac=True, method="L-BFGS-B", bounds=bounds).x / size


def calibration(trust: np.ndarray, good: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean confidence, share of good points and weight in each bin of confidence, (BINS,) each."""
    bins = np.minimum((trust * BINS).astype(int), BINS - 1)
    total = np.bincount(bins, weight, BINS)
    with np.errstate(invalid="ignore"):
        return (
            np.bincount(bins, weight * trust, BINS) / total,
            np.bincount(bins, weight * good, BINS) / total,
            total / total.sum(),
        )


def checked(
    seen: dict[str, list[tuple[np.ndarray, np.ndarray]]],
) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return confidence, error and weight of the points of each kind, (q,) each, by the model of the other kinds."""
    held = {}
    for kind, pairs in seen.items():
        others = fitted([found for other, some in seen.items() if other != kind for found in some])
        trust = np.concatenate([expit(x @ others) for x, _ in pairs])
        error = np.concatenate([e for _, e in pairs])
        weight = np.concatenate([np.full(len(e), 1 / len(e) / len(pairs)) for _, e in pairs])
        said, right, share = calibration(trust, error < BOUND, weight)
        print(
            f"    {kind:12s} below {100 * BOUND:g} %: {weight @ (error < BOUND):.3f}, confidence {weight @ trust:.3f}, "
            f"apart {np.nansum(share * np.abs(said - right)):.3f}"
        )
        held[kind] = trust, error, weight
    return held


def picture(path: Path, held: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]) -> None:
    """Draw errors against confidence, and how often the confidence is right, each kind by the model of the others."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    columns = (len(held) + 2) // 2
    figure, grid = plt.subplots(2, columns, figsize=(3 * columns, 6), layout="constrained", squeeze=False)
    axes = grid.ravel()
    for ax, (kind, (trust, error, _)) in zip(axes, held.items(), strict=False):
        some = np.random.default_rng(0).permutation(len(trust))[:3000]
        ax.plot(trust[some], 100 * error[some], ".", color="#9fb4c7", markersize=1.5)
        bins = np.minimum((trust * BINS).astype(int), BINS - 1)
        for share, style in ((0.5, "-"), (0.9, "--")):
            middle = [np.quantile(error[bins == k], share) if (bins == k).sum() > 9 else np.nan for k in range(BINS)]
            ax.plot((np.arange(BINS) + 0.5) / BINS, 100 * np.array(middle), style, color="#1b4f7d", marker=".")
        ax.axhline(100 * BOUND, color="#b3452c", linewidth=0.8)
        ax.set(title=kind, xlim=(0, 1), ylim=(0.01, 30), yscale="log", xlabel="confidence")
    for ax in grid[:, 0]:
        ax.set_ylabel("error, % of the diagonal")
    for ax in axes[len(held) + 1 :]:
        ax.remove()
    last = axes[len(held)]
    for kind, (trust, error, weight) in held.items():
        said, right, share = calibration(trust, error < BOUND, weight)
        last.plot(said[share > 0.005], right[share > 0.005], marker=".", label=kind)
    last.plot([0, 1], [0, 1], color="#888888", linewidth=0.8)
    last.set(title=f"share below {100 * BOUND:g} %", xlim=(0, 1), ylim=(0, 1.02), xlabel="confidence")
    last.legend(fontsize=7)
    figure.suptitle(
        "Error against confidence, each kind of surface by what the others taught (line: half, dashed: 90 %)"
    )
    figure.savefig(path, dpi=110)


def main() -> None:
    """Fit, check and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--sets", default=",".join(FITTED))
    parser.add_argument("--pairs", type=int)
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    store, kinds = Store(options.output), {}
    for kind in options.sets.split(","):
        for pair in SETS[kind](store, options.pairs):
            kinds.setdefault(kind, []).append(observed(pair, store))
            good = [f"{100 * (kinds[kind][-1][name][1] < BOUND).mean():.1f} % {name}" for name in MAPS]
            print(f"{kind} {pair.name}: below {100 * BOUND:g} %: {', '.join(good)}", flush=True)
        # what is wrong must be seen too: a few of each kind
        for number, pair in enumerate(SETS[kind](store, 2)):
            wrong = WRONG[0] if kind in SYMMETRIC else WRONG[number % len(WRONG)]
            kinds[kind].append(observed(pair, store, wrong))
    for name in MAPS:
        seen = {kind: [found[name] for found in pairs] for kind, pairs in kinds.items()}
        coefficients = fitted([found for pairs in seen.values() for found in pairs])
        print(f"{name}: " + ", ".join(f"{c} {v:.4g}" for c, v in zip(COLUMNS, coefficients, strict=True)))
        held = checked(seen)
        if options.plot and name == "dense":
            picture(options.plot, held)


if __name__ == "__main__":
    main()
