"""A page of pictures of a collection, in one file: the paths that topology was carried along, distances, specimens."""

from __future__ import annotations

from html import escape

import numpy as np
from scipy.cluster.hierarchy import average, leaves_list
from scipy.spatial.distance import squareform

from ...solver.collection import Collection
from ...solver.collection.cycles import SUSPECT
from ...solver.collection.shapes import Shapes
from ...solver.surface.mesh import Floats, Integers, plural
from .paths import draw_paths, short
from .pictures import inline, thumbnail, view

MOST_PICTURES = 120
"""Specimens that are shown, at most: a page of some 5 MB."""

MOST_ROWS = 200
"""Maps not to be trusted that are listed, at most; pairs.csv has all."""

COMPLETED = 0.8
"""Grey of what a specimen lacks."""

LABELLED, LEGIBLE = 200, 11.0
"""Rows of a matrix up to which they have names, and pixels that each then has at least: what does not fit scrolls."""

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1080px; padding: 0 1em; color: #222; }
figure { margin: 1.2em 0; } figcaption { color: #555; margin-top: .4em; } svg { max-width: 100%; height: auto; }
.wide { overflow: auto; max-height: 900px; } .wide svg { max-width: none; }
.few { display: flex; flex-wrap: wrap; gap: 10px; } .few div { width: 140px; text-align: center; font-size: 12px; }
.bad { color: #b3261e; } td, th { padding: .1em .8em .1em 0; text-align: left; } h2 { margin-top: 1.8em; }
"""


def page(collection: Collection, shapes: Shapes) -> str:
    """Return the page as HTML that needs no other file."""
    order = _order(collection.distances())
    pictures = _pictures(shapes)
    parts = [
        f"<p>{escape(_summary(collection))}</p>",
        _figure("Paths", draw_paths(collection, pictures, _suspects(collection)), _paths_caption(collection)),
        _figure(
            "Distances",
            _matrix(
                collection.distances(), [short(collection.names[k], 24) for k in order], order, _suspects(collection)
            ),
            "Continuous Procrustes distances, most alike beside each other; darker is nearer, and a dot marks a pair "
            "whose map is suspect. White: not aligned. The numbers are in distances.csv.",
        ),
        _shown(collection, shapes, pictures),
        _problems(collection),
    ]
    body = "\n".join(part for part in parts if part)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Collection</title>'
        f"<style>{_STYLE}</style></head><body>\n<h1>{plural(len(collection.names), 'specimen')}</h1>\n{body}\n"
        "</body></html>\n"
    )


def _summary(collection: Collection) -> str:
    certified = sum(known.certified for known in collection.figures)
    mirrored = sum(known.mobius.reflected for known in collection.figures)
    levels = [known.judgement.level for known in collection.figures]
    said = f"{plural(len(collection.edges), 'pair')} aligned: {levels.count('good'):,} good, "
    said += f"{levels.count('check'):,} to be checked, {levels.count('doubtful'):,} doubtful by themselves; "
    said += f"{certified:,} certified, {mirrored:,} mirrored. "
    triangles = len(collection.cycles[0])
    if triangles:
        open_ = int((collection.cycles[1] > SUSPECT).sum())
        said += f"Of {plural(triangles, 'three-cycle')} {open_:,} do not close within {SUSPECT:.0%} of the diagonal: "
        said += f"{plural(int(collection.suspects.sum()), 'map')} suspect."
    else:
        said += "There are no three-cycles, so that no map was checked by others."
    return said


def _figure(title: str, picture: str, caption: str) -> str:
    return f"<h2>{escape(title)}</h2><figure>{picture}<figcaption>{escape(caption)}</figcaption></figure>"


def _paths_caption(collection: Collection) -> str:
    root = collection.names[collection.root]
    said = f"How the topology of '{root}', in bold, came to each specimen: every line is one map."
    lost = [name for number, name in enumerate(collection.names) if number not in collection.routes]
    return said + (f" No path leads to {', '.join(lost)}." if lost else "")


def _suspects(collection: Collection) -> set[tuple[int, int]]:
    return {edge for edge, bad in zip(collection.edges, collection.suspects, strict=True) if bad}


# -- distances ---------------------------------------------------------------------------------------------------------


def _order(distances: Floats) -> list[int]:
    """Return the rows of a matrix in an order in which those that are alike come together."""
    known = distances[np.isfinite(distances)]
    whole = np.where(np.isfinite(distances), distances, known.max(initial=1.0))
    return leaves_list(average(squareform(whole, checks=False))).tolist()


def _matrix(distances: Floats, names: list[str], order: list[int], bad: set[tuple[int, int]]) -> str:
    """Draw the matrix: dark for near, light for far."""
    found = distances[np.ix_(order, order)]
    off = found[~np.eye(len(found), dtype=bool)]
    off = off[np.isfinite(off)]
    low, high = (float(off.min()), float(off.max())) if len(off) else (0.0, 1.0)
    share = np.clip((found - low) / max(high - low, 1e-300), 0, 1)
    colors = np.ones((*found.shape, 4))
    near, far = np.array([0.07, 0.16, 0.33]), np.array([0.91, 0.95, 0.98])
    known = np.isfinite(found)
    colors[known, :3] = near + np.sqrt(share[known])[:, None] * (far - near)
    named = len(names) <= LABELLED
    cell = max(LEGIBLE if named else 3.0, min(28.0, 900 / len(names)))
    side = cell * len(names)
    letters = min(12.0, 0.85 * cell)
    label = 8 / 12 * letters * max(map(len, names)) if named else 0.0
    parts = [
        f'<image href="{inline(colors)}" width="{side:.1f}" height="{side:.1f}" style="image-rendering: pixelated" '
        'preserveAspectRatio="none"/>'
    ]
    place = {number: k for k, number in enumerate(order)}
    for a, b in bad:
        for row, column in ((place[a], place[b]), (place[b], place[a])):
            parts.append(
                f'<circle cx="{(column + 0.5) * cell:.1f}" cy="{(row + 0.5) * cell:.1f}" r="{cell / 6:.1f}" '
                'fill="#d9604f"/>'
            )
    if label:
        for k, name in enumerate(names):
            middle = (k + 0.5) * cell
            text = f'font-size="{letters:.1f}" dominant-baseline="central"'
            parts.append(f'<text x="{side + 5:.1f}" y="{middle:.1f}" {text}>{escape(name)}</text>')
            parts.append(
                f'<text transform="translate({middle:.1f} {side + 5:.1f}) rotate(90)" {text}>{escape(name)}</text>'
            )
    parts.append(
        f'<text x="0" y="{side + label + 18:.1f}" font-size="12">nearest {low:.3g}, farthest {high:.3g}</text>'
    )
    width, height = side + label + 8, side + label + 26
    return (
        f'<div class="wide"><svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" font-family="system-ui, sans-serif">{"".join(parts)}</svg></div>'
    )


# -- specimens ---------------------------------------------------------------------------------------------------------


def corresponding_colors(mean: Floats, axes: Floats) -> Floats:
    """Return a color for each point of the mean shape, (n, 3), by where it is there: alike on every specimen."""
    seen = (mean - mean.mean(axis=0)) @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    share = (seen - low) / np.maximum(high - low, 1e-300)
    # a fine check, so that more than the large is seen
    check = (np.floor(10 * share[:, 0]) + np.floor(10 * share[:, 1])) % 2
    colors = np.stack([0.25 + 0.75 * share[:, 0], 0.3 + 0.6 * share[:, 1], 1 - 0.6 * share[:, 0]], axis=1)
    return colors * (0.72 + 0.28 * check)[:, None]


def _pictures(shapes: Shapes) -> dict[str, str]:
    """Return pictures of the specimens in the mean's pose, each colored as the others are, by name."""
    mean, poses = shapes.superimposed
    axes = view(mean, shapes.areas)
    axes = _upright(mean, shapes.faces, axes)
    colors = corresponding_colors(mean, axes)
    return {
        shapes.names[k]: inline(
            thumbnail(
                poses[k](shapes.vertices[k]),
                shapes.faces,
                np.where(shapes.known[k][:, None], colors, COMPLETED),
                axes,
            )
        )
        for k in range(min(len(shapes.names), MOST_PICTURES))
    }


def _upright(mean: Floats, faces: Integers, axes: Floats) -> Floats:
    """Return the view from outside: the side to which the surface, as a whole, faces."""
    corners = mean[faces]
    out = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    return axes if out @ axes[2] >= 0 else axes * np.array([1, -1, -1])[:, None]


def _shown(collection: Collection, shapes: Shapes, pictures: dict[str, str]) -> str:
    errors = dict(zip(collection.names, collection.specimen_errors, strict=True))
    parts = []
    told = zip(shapes.names, shapes.mirrored, shapes.certainty, shapes.missing, strict=True)
    for name, turned, certainty, missing in told:
        if name not in pictures:
            continue
        about = [f"certainty {certainty:.2f}"]
        if np.isfinite(errors[name]):
            about.append(f"cycles {100 * errors[name]:.1f} %")
        if turned:
            about.append("mirrored")
        if missing >= 0.005:
            about.append(f"lacks {100 * missing:.0f} %")
        label = f'<span title="{escape(name)}">{escape(short(name, 22))}</span>'
        parts.append(f'<div><img src="{pictures[name]}" width="132" alt=""><br>{label}<br>{", ".join(about)}</div>')
    caption = (
        "All specimens on one topology, in one pose; equal colors are corresponding points, and grey is what a "
        "specimen lacks, completed by the template. Certainty: the mean confidences along the path, multiplied. "
        "Cycles: how far from closed the three-cycles of its maps are."
    )
    if len(parts) < len(shapes.names):
        caption += f" The first {len(parts)} of {len(shapes.names)}."
    return _figure("Specimens", f'<div class="few">{"".join(parts)}</div>', caption)


def _problems(collection: Collection) -> str:
    rows = [f"<tr><td>{escape(name)}</td><td>{escape(why)}</td></tr>" for name, why in collection.failures.items()]
    for (a, b), known, error, bad in zip(
        collection.edges, collection.figures, collection.errors, collection.suspects, strict=True
    ):
        why = [f"suspect: off by {100 * error:.0f} %"] if bad else []
        if known.judgement.level == "doubtful":
            why += [f"doubtful: {one.text}" for one in known.judgement.concerns if one.kind != "doubtful"] or [
                "doubtful"
            ]
        if why:
            pair = f"{collection.names[a]} to {collection.names[b]}"
            rows.append(f'<tr><td class="bad">{escape(pair)}</td><td>{escape("; ".join(why))}</td></tr>')
    if len(rows) > MOST_ROWS:
        rows[MOST_ROWS:] = [f"<tr><td>and {len(rows) - MOST_ROWS:,} more</td><td>see pairs.csv</td></tr>"]
    return f"<h2>Not done, and not to be trusted</h2><table>{''.join(rows)}</table>" if rows else ""
