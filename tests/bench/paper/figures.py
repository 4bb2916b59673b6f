"""Pictures of the experiments: correspondences on the discs and on the surfaces, and run times."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection, PolyCollection
from PIL import Image

from solver import Flattening, Mobius, TriangleMesh
from solver.mobius import hyperbolic_distance
from solver.search.outcome import SearchResult

from . import quoted
from .methods import Problem

mpl.use("Agg")
mpl.rcParams.update({"font.size": 9, "savefig.dpi": 130, "savefig.bbox": "tight"})
RIGHT, WRONG, POINT = "#1b7f4d", "#c8352b", "#8a8f98"


def run_times(path: Path, rows: list[dict[str, Any]], times: list[dict[str, Any]]) -> None:
    """Draw seconds against N on logarithmic axes: means of each method in the invariant objective, and the quotes."""
    figure, axes = plt.subplots(figsize=(6.4, 4.2))
    objective = rows[-1]["objective"]
    shown = [row for row in rows if row["objective"] == objective and not row["method"].startswith("Algorithm")]
    shown += [row for row in times if row["objective"] == objective and row["N"] not in {r["N"] for r in rows}]
    shown += [row for row in times if row["method"].startswith("brute")]
    for name in dict.fromkeys(row["method"] for row in shown):
        points = sorted((row["N"], row["seconds"]) for row in shown if row["method"] == name)
        axes.plot(*zip(*points, strict=True), "o-", markersize=4, label=name)
    axes.vlines(100, *quoted.SEARCH_SECONDS_AT_100, color="black", linewidth=3, alpha=0.5)
    axes.annotate("search, quoted", (100, 10), (106, 30), fontsize=7)
    axes.axhline(quoted.BRUTE_FORCE_SECONDS, color="black", linewidth=0.8, linestyle=":")
    axes.annotate("brute force, quoted: 3 hours an instance", (20, 5e3), fontsize=7)
    axes.set(xscale="log", yscale="log", xlabel="N", ylabel="seconds of one core", title=f"Run time, {objective}")
    axes.set_xticks(sorted({row["N"] for row in shown}), [str(n) for n in sorted({row["N"] for row in shown})])
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.02, 0.5))
    _save(figure, path)


def collapse(path: Path, rows: list[dict[str, Any]]) -> None:
    """Draw the proven optimum against the bound on |z|: how many points it matches, and how many pairs are right."""
    figure, axes = plt.subplots(figsize=(6.4, 3.4))
    for objective, colour in zip(dict.fromkeys(row["objective"] for row in rows), (WRONG, RIGHT), strict=True):
        shown = [row for row in rows if row["objective"] == objective]
        bound = [1 - row["z_max"] for row in shown]
        axes.plot(bound, [row["Q_bnb"] for row in shown], "o-", color=colour, label=f"{objective}: matched")
        right = [row["Q_truth"] for row in shown]
        axes.plot(bound, right, "s:", color=colour, markersize=4, label=f"{objective}: right pairs")
    axes.axhline(rows[0]["inliers"], color="black", linewidth=0.8, linestyle="--")
    axes.annotate("inliers", (0.4, rows[0]["inliers"] + 2), fontsize=7)
    axes.set(xscale="log", xlabel="1 - bound on |z|", ylabel="points", title="The optimum as the bound is lifted")
    axes.invert_xaxis()
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.02, 0.5))
    _save(figure, path)


def on_silhouette(
    path: Path,
    title: str,
    flat: Flattening,
    problem: Problem,
    found: SearchResult,
    planted: Mobius,
    good: np.ndarray,
) -> None:
    """Draw the shape with its points, the two discs, and the source carried over: matched right, matched wrong, not."""
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.9), width_ratios=[1.5, 1, 1])
    vertex = np.array([int(np.argmin(np.abs(flat.disc - x))) for x in problem.source])
    image, expected = found.mobius(problem.source), planted(problem.source)
    # right: the target point lies where the planted transformation, within noise, puts the source point
    off = hyperbolic_distance(problem.target[found.matches[:, 1]], expected[found.matches[:, 0]])
    near = dict(zip(found.matches[:, 0].tolist(), off < 5 * problem.radius, strict=True))
    colours = [POINT if j not in near else RIGHT if near[j] and j in good else WRONG for j in range(len(image))]
    axes[0].triplot(*flat.mesh.vertices[:, :2].T, flat.mesh.faces, linewidth=0.2, color="#b9bec6")
    axes[0].scatter(*flat.mesh.vertices[vertex, :2].T, s=14, c=colours, zorder=3)
    axes[0].set_title(title)
    _disc(axes[1], "source, packed with circles")
    axes[1].scatter(problem.source.real, problem.source.imag, s=12, c=colours)
    _disc(axes[2], "target (rings), source carried over")
    axes[2].scatter(
        problem.target.real, problem.target.imag, s=34, facecolors="none", edgecolors="black", linewidths=0.6
    )
    axes[2].scatter(image.real, image.imag, s=8, c=colours)
    axes[0].set_aspect("equal")
    axes[0].axis("off")
    _key(figure, found)
    _save(figure, path)


def on_surfaces(
    path: Path,
    title: str,
    meshes: tuple[TriangleMesh, TriangleMesh],
    samples: tuple[np.ndarray, np.ndarray],
    landmarks: tuple[np.ndarray, np.ndarray],
    problem: Problem,
    marks: tuple[np.ndarray, np.ndarray],
    found: SearchResult,
) -> None:
    """Draw two surfaces with the matched samples joined, and the target's disc with the landmarks of both.

    Parameters
    ----------
    samples, landmarks : pairs of int arrays
        Vertices of source and target.
    marks : pair of complex arrays
        Landmarks in the discs, the source's as the problem has it.
    """
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.4), width_ratios=[1.9, 1])
    first, last = _extremes(meshes[0], landmarks[0])
    views = [_projected(mesh, marked[first], marked[last]) for mesh, marked in zip(meshes, landmarks, strict=True)]
    shift = views[0][:, 0].max() - views[1][:, 0].min() + 0.15
    views[1] = views[1] + [shift, 0, 0]
    for mesh, view in zip(meshes, views, strict=True):
        _shaded(axes[0], mesh, view)
    ends = np.stack([views[0][samples[0][found.matches[:, 0]]], views[1][samples[1][found.matches[:, 1]]]], axis=1)
    colours = plt.get_cmap("hsv")(np.linspace(0, 1, len(ends), endpoint=False))
    axes[0].add_collection(LineCollection(list(ends[:, :, :2]), colors=colours, linewidths=0.6, alpha=0.7))
    for k in range(2):
        axes[0].scatter(*ends[:, k, :2].T, s=14, c=colours, edgecolors="black", linewidths=0.3, zorder=4)
        axes[0].scatter(*views[k][landmarks[k], :2].T, s=10, c="black", marker="x", linewidths=0.7, zorder=4)
    axes[0].autoscale()
    axes[0].set_aspect("equal")
    axes[0].axis("off")
    axes[0].set_title(title)
    _disc(axes[1], "landmarks: target (rings), source carried over (dots)")
    image = found.mobius(marks[0])
    both = np.stack([image, marks[1]], axis=1)
    axes[1].add_collection(LineCollection(list(np.stack([both.real, both.imag], axis=2)), colors=POINT, linewidths=0.8))
    axes[1].scatter(marks[1].real, marks[1].imag, s=40, facecolors="none", edgecolors="black", linewidths=0.8)
    axes[1].scatter(image.real, image.imag, s=10, c=RIGHT)
    proved = "proved optimal" if found.certified else f"upper bound {found.upper_bound:.0f}"
    text = f"{found.value:.0f} of {len(problem.source)} matched ({found.one_to_one:.0f} one to one), {proved}"
    figure.text(0.5, 0.06, text, ha="center")
    _save(figure, path)


def _disc(axes: Any, title: str) -> None:
    axes.add_patch(plt.Circle((0, 0), 1, fill=False, color="black", linewidth=0.8))
    axes.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.05), aspect="equal", title=title)
    axes.axis("off")


def _key(figure: Any, found: SearchResult) -> None:
    figure.text(0.3, 0.1, "matched as planted", color=RIGHT, ha="center")
    figure.text(0.5, 0.1, "matched otherwise", color=WRONG, ha="center")
    rest = f"not matched ({found.value:.0f} are, at most {found.upper_bound:.0f} can be)"
    figure.text(0.7, 0.1, rest, color=POINT, ha="center")


def _extremes(mesh: TriangleMesh, landmarks: np.ndarray) -> tuple[int, int]:
    """Return which landmarks are the lowest, by the file's y, and the farthest from that."""
    marked = mesh.vertices[landmarks]
    lowest = int(np.argmin(marked[:, 1]))
    return lowest, int(np.argmax(np.linalg.norm(marked - marked[lowest], axis=1)))


def _projected(mesh: TriangleMesh, bottom: int, top: int) -> np.ndarray:
    """Return positions seen from the side to which the surface faces, (n, 3), one unit high, `top` above `bottom`."""
    normal = (mesh.vertex_normals() * mesh.vertex_areas[:, None]).sum(axis=0)
    normal /= np.linalg.norm(normal)
    up = mesh.vertices[top] - mesh.vertices[bottom]
    up -= (up @ normal) * normal
    up /= np.linalg.norm(up)
    seen = (mesh.vertices - mesh.vertices.mean(axis=0)) @ np.stack([np.cross(up, normal), up, normal], axis=1)
    return seen / np.ptp(seen[:, 1])


def _shaded(axes: Any, mesh: TriangleMesh, view: np.ndarray) -> None:
    """Paint the faces from the farthest to the nearest."""
    corners = view[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = np.abs(normal @ [0.3, 0.3, 0.9]) / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    grey = plt.get_cmap("Greys_r")(0.35 + 0.6 * np.clip(light, 0, 1))
    faces = PolyCollection(list(corners[order, :, :2]), facecolors=grey[order], edgecolors="face", linewidths=0.2)
    axes.add_collection(faces)


def _save(figure: Any, path: Path) -> None:
    figure.savefig(path)
    plt.close(figure)
    Image.open(path).convert("RGB").quantize(192).save(path, optimize=True)  # a third of the size
