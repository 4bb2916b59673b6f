"""Whether a mirrored map may be of two opposite sides of one symmetric thing: to be said, as nothing else tells it."""

from __future__ import annotations

from ...bend.draft import ready
from ...flatten.sphere import Flat
from ..result.alignment import Alignment
from ..surfaces.remark import Remark
from .own_mirror import mirror_plane


def with_sides_open(found: Alignment, symmetric: bool | None) -> Alignment:
    """Return a map, with a word if it is mirrored though a surface is its own mirror image as far as it reaches.

    `symmetric`: whether the source is, None if nobody has asked. Surfaces of which that is said by chance are none of
    those measured (`BORNE_OUT`); nothing is said where the orientation was asked for, or is called open already.
    """
    said = any(one.kind == "orientation" for one in found.remarks)
    if not found.mobius.reflected or found.other is None or said:
        return found
    if symmetric is None:
        symmetric = _symmetric(found.source)
    surface = found.source if symmetric else found.target if _symmetric(found.target) else None
    if surface is None:
        return found
    text = (
        f"ambiguous orientation: mirrored, but '{surface.mesh.name}' is its own mirror image as far as it reaches: "
        "these may be opposite sides of one thing"
    )
    return found.annotated(remarks=(Remark("orientation", text), *found.remarks))


def _symmetric(surface: Flat) -> bool:
    return mirror_plane(ready(surface)) is not None
