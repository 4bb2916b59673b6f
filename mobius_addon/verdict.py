"""Whether an alignment can be believed, how much matched and how far off it is to be expected, in an artist's words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_

from ..solver.align.judgement import Judgement, judged
from ..solver.align.surfaces.remark import Remark

LEVELS = {
    "good": (n_("Good: {:.0%} matched"), "CHECKMARK"),
    "check": (n_("Check: {:.0%} matched"), "QUESTION"),
    "doubtful": (n_("Doubtful: {:.0%} matched"), "ERROR"),
}


COUNTS = {"good": n_("Good: {:,}"), "check": n_("Check: {:,}"), "doubtful": n_("Doubtful: {:,}")}


def counted(levels: Iterable[str]) -> str:
    """Return how many verdicts there are of each level, those that there are none of left out.

    >>> counted(["doubtful", "good", "good"])
    'Good: 2, Doubtful: 1'
    """
    number = Counter(levels)
    return ", ".join(iface_(text).format(number[level]) for level, text in COUNTS.items() if number[level])


def judgement_of(found: dict[str, Any]) -> Judgement:
    """Return the verdict that a report holds; of reports of earlier versions, what it would be."""
    if "verdict" not in found:
        said = (Remark("other", text) for text in found.get("warnings", ()))
        return judged(found.get("mean_confidence", 0.0), found["coverage"], said)
    concerns = tuple(Remark(**one) for one in found["concerns"])
    return Judgement(found["verdict"], concerns, tuple(found["notes"]))


def verdict_lines(scene: bpy.types.Scene, source: bpy.types.Object, found: dict[str, Any], level: str) -> list[str]:
    """Return the verdict, the mean error that is to be expected in the scene's units, and whether it is mirrored."""
    lines = [iface_(LEVELS[level][0]).format(found["coverage"])]
    if (error := found.get("expected_error")) is not None:
        length = _length(scene, error * _diagonal(source))
        lines.append(iface_("Mean error about {} ({:.1%})").format(length, error))
    lines.append(iface_("mirrored") if found["mobius"]["reflected"] else iface_("not mirrored"))
    return lines


def verdict_sentence(
    scene: bpy.types.Scene, source: bpy.types.Object, target: bpy.types.Object, found: dict[str, Any]
) -> str:
    """Return the same as one line, with the names of both meshes."""
    lines = verdict_lines(scene, source, found, judgement_of(found).level)
    return f"'{source.name}' → '{target.name}': {'; '.join(lines)}"


def _diagonal(obj: bpy.types.Object) -> float:
    """Return the length of the diagonal of an object's bounding box in the world, as it is scaled there."""
    return float(np.linalg.norm(np.ptp(np.array(obj.bound_box), axis=0) * np.array(obj.matrix_world.to_scale())))


def _length(scene: bpy.types.Scene, length: float) -> str:
    """Return a length of the scene in its units."""
    units = scene.unit_settings
    if units.system == "NONE":
        return f"{length:.2g}"
    return bpy.utils.units.to_string(units.system, "LENGTH", length * units.scale_length, precision=2)
