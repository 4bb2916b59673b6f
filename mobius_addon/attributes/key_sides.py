"""Sides of expressions: halves of those that are one for both, and keys that are each other's mirror images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...solver.carry.symmetry import Mirror, left_share
from ...solver.surface.mesh import Floats, TriangleMesh
from .access import Layer
from .expression_names import WHOLE, understood
from .plan import Carried

ACROSS = 0.3
"""Width in which one half goes over into the other, for that of what the expression moves: so it is in the four
expressions of two people that their artist has split (0.296 to 0.321)."""

MOVED = 0.05
"""Share of the largest displacement from which on a vertex is moved."""


def with_halves(layers: Sequence[Layer], places: Floats) -> tuple[list[Layer], dict[str, str]]:
    """Return layers in which expressions that are one for both sides are two, and the names these come from.

    Parameters
    ----------
    layers : sequence of Layer
        Shape keys. What has halves already is left alone.
    places : (n, 3) float64
        The source's vertices.

    Returns
    -------
    list of Layer
        'browInnerUpLeft' and 'browInnerUpRight' for 'browInnerUp', whose sum it is; with its slider.
    dict of str to str
        The layer that each of these is half of.
    """
    known = {layer.name: understood(layer.name) for layer in layers}
    halved = {base for meaning in known.values() if meaning is not None and (base := meaning[0]) and meaning[1]}
    normal, middle = _sides(layers, known, places)
    result, origin = [], {}
    for layer in layers:
        meaning = known[layer.name]
        if meaning is None or meaning[0] not in WHOLE or meaning[1] or meaning[0] in halved:
            result.append(layer)
            continue
        size = np.linalg.norm(layer.values, axis=1)
        moved = places[size > MOVED * size.max(initial=0)]
        width = ACROSS * float(np.ptp(moved @ normal)) if len(moved) else 1.0
        left = left_share(places, normal, middle, width)[:, None]
        for share, side in ((left, "Left"), (1 - left, "Right")):
            name = f"{layer.name}_{side[0]}" if set("_. ") & set(layer.name) else layer.name + side
            origin[name] = layer.name
            result.append(replace(layer, name=name, values=share * layer.values))
    return result, origin


def _sides(
    layers: Sequence[Layer], known: Mapping[str, tuple[str, str] | None], places: Floats
) -> tuple[Floats, Floats]:
    """Return the unit normal of the plane between the sides, which points to the left, and a point of it.

    From the middles of what expressions of the left and of the right move; without any it is x = 0, +x on the left.
    """
    middles: dict[tuple[str, str], Floats] = {}
    for layer in layers:
        meaning, weight = known[layer.name], (layer.values**2).sum(axis=1)
        if meaning is not None and meaning[1] and weight.sum() > 0:
            middles[meaning] = weight @ places / weight.sum()
    named = sorted({base for base, _ in middles})
    both = [(middles[x, "L"], middles[x, "R"]) for x in named if {(x, "L"), (x, "R")} <= middles.keys()]
    if not both:
        return np.array([1.0, 0.0, 0.0]), np.zeros(3)
    left, right = np.mean(both, axis=0)
    apart = left - right
    return apart / max(float(np.linalg.norm(apart)), 1e-300), (left + right) / 2


def symmetric(
    layers: Sequence[Carried], twins: Mapping[str, str], target: TriangleMesh
) -> tuple[list[Carried], list[str]]:
    """Return carried shape keys of which those that are meant to be are symmetric, and a sentence if none can be.

    Parameters
    ----------
    layers : sequence of Carried
        Of any kind.
    twins : mapping of str to str
        The name of each key's mirror image, which may be its own; by names on the target.
    target : TriangleMesh
        In the shape that keys depart from.
    """
    keys = {layer.name: layer for layer in layers if layer.row.kind == "shape-keys"}
    mirror = Mirror.of(target) if keys else None
    if mirror is None:
        return list(layers), [f"'{target.name}' is not symmetric: its shape keys stay as they came"] if keys else []
    done: dict[str, Floats] = {}
    for name, layer in keys.items():
        twin = keys.get(twins.get(name, ""))
        if name in done or twin is None:
            continue
        values = [np.where(one.covered[:, None], one.values, 0.0) for one in (layer, twin)]
        if mirror.alike(*values):
            done[name], done[twin.name] = mirror.symmetric(*values)
    return [replace(x, values=done[x.name]) if x.row.kind == "shape-keys" and x.name in done else x for x in layers], []
