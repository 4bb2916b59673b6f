"""What the last transfer to a mesh has written, kept on the mesh for the panel: saved with it, undone with it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from .attributes import KINDS, Transfer
from .translation import told


@dataclass(frozen=True)
class LayerWritten:
    """A layer that was written: its kind, its names on both meshes, and on what share of its elements, in [0, 1]."""

    kind: str
    source_name: str
    name: str
    share: float


@dataclass(frozen=True)
class LastTransfer:
    """What a transfer has written: from which object, which layers, and sentences about what was left out."""

    source: str
    layers: tuple[LayerWritten, ...]
    warnings: tuple[str, ...]
    uncertain: float


def announce(report: Callable[[set[str], str], None], target: bpy.types.Object, source: str, plan: Transfer) -> None:
    """Report what a transfer has written, and keep it on the target's mesh for the panel.

    The status bar shows the last report alone, which therefore says that there are others.
    """
    for warning in plan.warnings:
        report({"WARNING"}, told(warning))
    text = rpt_("'{}' has {} from '{}'{}")
    said = text.format(target.name, told(describe_counts(plan.counts())), source, told(plan.unmatched.remark()))
    if plan.warnings:
        said += rpt_(" (warnings: {}, see Last Transfer)").format(len(plan.warnings))
    report({"WARNING" if plan.warnings else "INFO"}, said)
    layers = [
        (x.row.kind, x.source_name, x.name, float(x.covered.mean()) if len(x.covered) else 1.0) for x in plan.layers
    ]
    if plan.textures is not None:
        names = [*(one.channel.label for one in plan.textures.made), *plan.textures.colors]
        layers += [("textures", name, name, 1.0) for name in names]
    uncertain = plan.unmatched.area if plan.unmatched.outcome == "carry" else 0.0
    about = {"source": source, "layers": layers, "warnings": plan.warnings, "uncertain": uncertain}
    target.data.mobius_transferred = json.dumps(about)


def of_mesh(mesh: bpy.types.Mesh) -> LastTransfer | None:
    """Return what the last transfer to a mesh has written, None if there was none."""
    return _parsed(mesh.mobius_transferred)


def describe_counts(counts: dict[str, int]) -> str:
    """Return what a transfer carried, as in '3 vertex groups, 1 UV map'."""
    nouns = {kind.identifier: kind.noun for kind in KINDS} | {"data": "files of data"}
    return ", ".join(f"{n} {nouns[kind] if n > 1 else nouns[kind].removesuffix('s')}" for kind, n in counts.items())


@lru_cache(maxsize=8)
def _parsed(kept: str) -> LastTransfer | None:
    try:
        about: dict[str, Any] = json.loads(kept)
        layers = tuple(LayerWritten(*layer) for layer in about["layers"])
        return LastTransfer(about["source"], layers, tuple(about["warnings"]), about["uncertain"])
    except (ValueError, TypeError, KeyError):  # of no transfer, or somebody has typed into it
        return None
