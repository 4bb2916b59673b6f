"""Where the errors are, on the surfaces; and whether the confidence knows."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection, PolyCollection
from scipy.spatial import KDTree

from .pairs import Pair
from .score import errors
from .tables import TITLES, Row

mpl.use("Agg")
mpl.rcParams.update({"font.size": 8})
WORST = 6.0
"""Error in % at the end of the scale."""


def sheet(path: Path, rows: list[Row]) -> None:
    """Draw a set: a row per pair, a column per method, the source coloured by the error of what is mapped there."""
    pairs = list(dict.fromkeys(row.pair for row in rows))[::2]  # one direction shows enough
    methods = list(dict.fromkeys(row.method for row in rows))
    figure, axes = plt.subplots(
        len(pairs), len(methods), figsize=(1.9 * len(methods), 2.1 * len(pairs)), squeeze=False, layout="constrained"
    )
    for line, pair in zip(axes, pairs, strict=True):
        for ax, name in zip(line, methods, strict=True):
            row = next(r for r in rows if r.pair is pair and r.method == name)
            _errors(ax, row)
            marks = "" if row.score.marks is None else f", {row.score.marks}/{row.score.of}"
            ax.set_title(f"{TITLES[name].replace('*', '')}\n{row.score.mean:.2f} %{marks}", fontsize=7)
        line[0].text(-0.05, 0.5, pair.name, rotation=90, ha="right", va="center", transform=line[0].transAxes)
    scale = mpl.cm.ScalarMappable(mpl.colors.Normalize(0, WORST), "YlOrRd")
    figure.colorbar(scale, ax=axes, shrink=0.5, label="error, % of the diagonal", extend="max")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _errors(ax: Any, row: Row) -> None:
    pair, source = row.pair, row.pair.source
    view = _view(pair)
    seen = source.vertices @ view.T
    corners = seen[source.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = 0.35 + 0.65 * np.abs(normal @ [0.3, 0.3, 0.9]) / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
    error = errors(pair, row.found, pair.known)
    if pair.surface is not None:
        near = KDTree(pair.surface.truth).query(source.vertices[source.faces].mean(axis=1), k=3)[1]
        colour = plt.get_cmap("YlOrRd")(np.clip(error[near].mean(axis=1) / WORST, 0, 1))[:, :3] * light[:, None]
    else:
        colour = np.repeat(light[:, None], 3, axis=1) * 0.95
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    faces = PolyCollection(list(corners[order, :, :2]), facecolors=colour[order], linewidths=0.0, rasterized=True)
    faces.set_antialiased(False)
    ax.add_collection(faces)
    if pair.surface is None:
        places = pair.known
        found = places.carried(pair.target, row.found.at(pair, source.vertices)) @ view.T
        true = places.truth @ view.T
        ax.add_collection(
            LineCollection(list(np.stack([found, true], axis=1)[:, :, :2]), colors="black", linewidths=0.8)
        )
        ax.scatter(*true[:, :2].T, s=9, c=np.clip(error / WORST, 0, 1), cmap="YlOrRd", vmin=0, vmax=1, zorder=3)
    ax.autoscale()
    ax.set_aspect("equal")
    ax.axis("off")


def _view(pair: Pair) -> np.ndarray:
    """Return the axes, (3, 3), of a look at the side to which the source faces, its file's y axis up."""
    mesh = pair.source
    normal = (mesh.vertex_normals() * mesh.vertex_areas[:, None]).sum(axis=0)
    normal /= np.linalg.norm(normal)
    up = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.9 else np.array([0.0, 0.0, 1.0])
    up -= up @ normal * normal
    up /= np.linalg.norm(up)
    return np.stack([np.cross(up, normal), up, normal])


def confidence(path: Path, rows: list[Row]) -> None:
    """Draw the error against the confidence, each set by itself: quantiles in bins of confidence, and how many."""
    said = [row for row in rows if row.found.confidence is not None and row.pair.surface is not None]
    said = [row for row in said if row.method == said[-1].method]
    kinds = list(dict.fromkeys(row.pair.kind for row in said))
    figure, axes = plt.subplots(1, len(kinds), figsize=(2.9 * len(kinds), 3), squeeze=False, layout="constrained")
    edges = np.linspace(0, 1, 11)
    for ax, kind in zip(axes[0], kinds, strict=True):
        trust, error = [], []
        for row in said:
            if row.pair.kind == kind:
                trust.append(row.pair.surface.carried(row.pair.target, row.found.confidence))
                error.append(errors(row.pair, row.found, row.pair.surface))
        trust, error = np.concatenate(trust), np.concatenate(error)
        which = np.clip(np.digitize(trust, edges) - 1, 0, 9)
        share = np.bincount(which, minlength=10) / len(which)
        ax.bar(edges[:-1] + 0.05, share * WORST, width=0.09, color="#d8dbe0", label="share of the points")
        for q, style in ((0.5, "-"), (0.9, "--")):
            value = [np.quantile(error[which == k], q) if share[k] > 1e-3 else np.nan for k in range(10)]
            ax.plot(
                edges[:-1] + 0.05, value, style, color="#1b4f7d", marker=".", label=f"{100 * q:.0f} % have less error"
            )
        ax.set(title=kind, xlabel="confidence", ylim=(0, WORST), xlim=(0, 1))
    axes[0, 0].set_ylabel("error, % of the diagonal")
    axes[0, 0].legend(fontsize=6)
    figure.suptitle(f"Error against confidence, {TITLES[said[-1].method].replace('*', '')}")
    figure.savefig(path, dpi=110)
    plt.close(figure)
