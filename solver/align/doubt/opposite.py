"""Whether a mirrored map may be of two opposite sides of one symmetric thing: to be said, as nothing else tells it."""

from __future__ import annotations

from ...bend.draft import ready
from ...flatten.sphere import Flat
from ..result.alignment import Alignment
from ..surfaces.remark import Remark
from .own_mirror import mirror_plane


def with_sides_open(found: Alignment, symmetric: bool) -> Alignment:
    """Return a map, with a word if it is mirrored though a surface is its own mirror image as far as it reaches.

    `symmetric`: whether that is known of the source. Surfaces of which that is said by chance are none of those
    measured (`BORNE_OUT`); nothing is said where the orientation was asked for, or is called open already.
    """
    said = any(one.kind == "orientation" for one in found.remarks)
    if not found.mobius.reflected or found.other is None or said:
        return found
    surface = found.source if symmetric else next(filter(_symmetric, (found.source, found.target)), None)
    if surface is None:
        return found
    text = (
        f"ambiguous orientation: mirrored, but '{surface.mesh.name}' is its own mirror image as far as it reaches: "
        "these may be opposite sides of one thing"
    )
    return found.annotated(remarks=(Remark("orientation", text), *found.remarks))


def _symmetric(surface: Flat) -> bool:
    return mirror_plane(ready(surface)) is not None
