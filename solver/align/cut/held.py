"""How well a disc holds a mesh, which is known before anything is aligned with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...surface.mesh import MeshError
from ...surface.necks import necks
from ...surface.tidy import Cleaned
from ..surfaces.prepared import LITTLE, Surface
from .cutting import MUCH, shrunk, width


@dataclass(frozen=True)
class Held:
    """What is to be said of a mesh that a disc holds badly.

    Attributes
    ----------
    kind : str
        "narrow", "deep" or "too deep", as in `remark.Kind`.
    text : str
        The rest of a sentence about the mesh: what it is, and after a colon what to do about it.
    """

    kind: str
    text: str


def held(tidy: Cleaned, *, fill_holes: bool = True) -> Held | None:
    """Return what is to be said of a disc in order, None if a disc holds it well.

    Raises
    ------
    MeshError
        No disc holds it, and no piece of it hangs by a neck where it could be cut; or too few vertices are inside its
        boundary. The text says what to do.
    """
    surface = Surface(tidy.mesh, fill_holes=fill_holes, tidy=tidy)
    try:
        found = surface.flattening
    except MeshError:
        if not necks(tidy.mesh):
            raise
        if (tidy.mesh.twins >= 0).all():
            return Held(
                "too deep", "juts out too far for a sphere: beside an open surface a piece that fits it is cut out"
            )
        return Held("too deep", "too deep for one disc: a piece that fits the other surface is cut out, if it has one")
    surface.require_inside()
    if found.domain.closed:
        return None
    if found.rim_lost > LITTLE:
        return Held("narrow", f"long and narrow: less exact, as angles are lost along {found.rim_lost:.0%} of its rim")
    # of a band the ends shrink as much, and it is aligned well; its rim is longer than that of a flat disc
    if (share := shrunk(found)) > MUCH and width(found) < 4 * np.pi:
        return Held("deep", f"deep, {share:.0%} of it has hardly any room in a disc: cut out what is to be matched")
    return None
