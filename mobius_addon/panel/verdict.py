"""The first lines of a result: whether it can be believed, how much matched, and how far off it is to be expected."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_

from ...solver.align.judgement import Judgement, judged
from ...solver.align.remark import Remark

LEVELS = {
    "good": (n_("Good: {:.0%} matched"), "CHECKMARK"),
    "check": (n_("Check: {:.0%} matched"), "QUESTION"),
    "doubtful": (n_("Doubtful: {:.0%} matched"), "ERROR"),
}


def judgement_of(found: dict[str, Any]) -> Judgement:
    """Return the verdict that a report holds; of reports of earlier versions, what it would be."""
    if "verdict" not in found:
        said = (Remark("other", text) for text in found.get("warnings", ()))
        return judged(found.get("mean_confidence", 0.0), found["coverage"], said)
    concerns = tuple(Remark(**one) for one in found["concerns"])
    return Judgement(found["verdict"], concerns, tuple(found["notes"]))


def draw_verdict(layout: bpy.types.UILayout, context: bpy.types.Context, found: dict[str, Any], level: str) -> None:
    """Draw the verdict, the mean error that is to be expected in the scene's units, and whether it is mirrored."""
    column = layout.column(align=True)
    text, icon = LEVELS[level]
    column.label(text=iface_(text).format(found["coverage"]), icon=icon, translate=False)
    if (error := found.get("expected_error")) is not None:
        length = lengths(context, error * diagonal(context.scene.mobius.source))
        text = iface_("Mean error about {} ({:.1%})").format(length, error)
        column.label(text=text, icon="BLANK1", translate=False)
    text = iface_("mirrored") if found["mobius"]["reflected"] else iface_("not mirrored")
    column.label(text=text, icon="BLANK1", translate=False)


def diagonal(obj: bpy.types.Object) -> float:
    """Return the length of the diagonal of an object's bounding box in the world, as it is scaled there."""
    return float(np.linalg.norm(np.ptp(np.array(obj.bound_box), axis=0) * np.array(obj.matrix_world.to_scale())))


def lengths(context: bpy.types.Context, length: float) -> str:
    """Return a length of the scene in its units."""
    units = context.scene.unit_settings
    if units.system == "NONE":
        return f"{length:.2g}"
    return bpy.utils.units.to_string(units.system, "LENGTH", length * units.scale_length, precision=2)
