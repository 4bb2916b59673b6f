"""What is proved about an alignment, term by term: properties that cannot be set, for which Blender shows tooltips."""

# no postponed annotations here: Blender reads the properties from them
from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from . import stored_alignment

Value = Callable[[dict[str, Any]], str | None]


def _certificate(found: dict[str, Any]) -> str:
    if found["certified"]:
        return iface_("none matches more")
    gap = found["gap"]
    if "rotation" in found and found["rotation"]["upper_bound"] <= found["value"]:
        share = 100 * gap / max(found["value"], 1e-9)
        return iface_("no rotation matches more, no map with {} over {:.1f} % more").format(
            found["certified_for"], share
        )
    return (iface_("not the best, gap {:.2f}") if found["rival_taken"] else iface_("open, gap {:.2f}")).format(gap)


def _other_way(found: dict[str, Any]) -> str | None:
    margin = found["orientation_margin"]
    return None if margin is None else _behind(margin)


def _rival(found: dict[str, Any]) -> str | None:
    # its search ends as soon as it is decided, so that this is only a bound
    margin = found["rival_margin"]
    return None if margin is None else ("≥ " if margin >= 0 else "") + _behind(margin)


def _behind(margin: float) -> str:
    """Say how far another map lies behind the one taken, as a share of the samples."""
    return iface_("{:.1%} behind").format(margin) if margin >= 0 else iface_("{:.1%} ahead").format(-margin)


def _shared(role: str) -> Value:
    return lambda found: f"{found['overlap'][f'{role}_share']:.0%}" if found["overlap"] else None


def _there(found: dict[str, Any]) -> str | None:
    parts = found["overlap"]
    return iface_("{:.2f} of {:.2f}").format(parts["value"], parts["upper_bound"]) if parts else None


def _parts(found: dict[str, Any]) -> str | None:
    several = found.get("parts")
    if not several:
        return None
    paired = sum(bool(pair["source"] and pair["target"]) for pair in several)
    return iface_("{:,} of {:,}").format(paired, sum(bool(pair["target"]) for pair in several))


TERMS: dict[str, tuple[str, str, Value]] = {
    "certificate": (
        "Certificate",
        "Whether it is proved that no other conformal map within the search range matches more points; if not, how "
        "much better another one could be at most, in points",
        _certificate,
    ),
    "matches": (
        "Matched Points",
        "How many of the points that stand for the source in the search found a counterpart. The rest of the surface "
        "follows when the target is bent, so that much more of it can match in the end",
        lambda found: iface_("{:,} of {:,}").format(found["matches"], found["samples"]),
    ),
    "value": (
        "Matched Value",
        "The matched points, each counting the less the more the surfaces differ around it",
        lambda found: f"{found['value']:.2f}",
    ),
    "bound": (
        "Proven Bound",
        "The most that any map within the search range can reach; equal to the matched value where that is certified",
        lambda found: f"{found['upper_bound']:.2f}",
    ),
    "confidence": (
        "Mean Confidence",
        "How probable it is, on average over the target, that a point is less than 2 % of the source's size off; 0 "
        "where there is no counterpart",
        lambda found: f"{found['mean_confidence']:.0%}",
    ),
    "other_way": (
        "Other Orientation",
        "How many fewer points the best map matches that mirrors where this one does not, or the other way round, as a "
        "share of all. Where the two are close, the bent surfaces decide",
        _other_way,
    ),
    "rival": (
        "Next Rival",
        "How many fewer points the best map matches that sends everything elsewhere, as a share of all. Near 0 for "
        "surfaces with a symmetry, which fit themselves in several ways",
        _rival,
    ),
    "shared_source": ("Shared Source", "How much of the source the target shows too", _shared("source")),
    "shared_target": ("Shared Target", "How much of the target the source shows too", _shared("target")),
    "value_there": (
        "Value There",
        "Matched value and proven bound of the search among what both show, which decides where it was made",
        _there,
    ),
    "parts": ("Parts", "How many of the target's parts, such as eyes and teeth, have a counterpart", _parts),
    "time": (
        "Time",
        "How long the alignment took",
        lambda found: iface_("{:.1f} s").format(sum(found["seconds"].values())),
    ),
}
"""Name, tooltip and text of each, of a report; None where there is none."""


def shown(target: bpy.types.Object, term: str) -> str:
    """Return the text of a term for the alignment that a target keeps; empty where there is none."""
    found = stored_alignment.figures(target) if target is not None and target.type == "MESH" else None
    return (TERMS[term][2](found) or "") if found else ""


def _term(identifier: str, name: str, description: str) -> Any:
    return bpy.props.StringProperty(
        name=name,
        description=description,
        get=lambda owner: shown(owner.id_data.mobius.target, identifier),
        options={"SKIP_SAVE"},
    )


class MobiusProof(bpy.types.PropertyGroup):
    """What is proved about the alignment of the chosen pair."""

    __annotations__ = {identifier: _term(identifier, *texts[:2]) for identifier, texts in TERMS.items()}
