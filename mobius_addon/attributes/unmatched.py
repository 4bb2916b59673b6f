"""The part of the target that corresponds to nothing with certainty: how large it is and what becomes of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...solver import Correspondence, interpolate
from ...solver.carry.fill import without
from ...solver.surface.mesh import Booleans, Floats, plural
from ..mesh_data import Surface
from .carrier import Carrier
from .settings import Outcome

_OUTCOMES = {
    "leave": "have no certain counterpart and are left as they were",
    "nearest": "have no certain counterpart and got the value of the nearest vertex that has one",
    "fill": "have no certain counterpart and were filled smoothly between those that have one",
}


@dataclass(frozen=True)
class Unmatched:
    """What a transfer did about target vertices without a certain counterpart.

    Attributes
    ----------
    vertices : int
        How many there are, of those in faces.
    area : float
        Their share of the target's area, in [0, 1].
    outcome : str
        What they got, as in `TransferSettings.unmatched`.
    bare : int
        Vertices that got nothing: in no face, or with no counterpart and nothing to fill from.
    """

    vertices: int
    area: float
    outcome: str
    bare: int

    @staticmethod
    def of(carrier: Carrier) -> Unmatched:
        """Describe what a carrier does, nothing being said about certainty."""
        return Unmatched(0, 0.0, carrier.gap, int((carrier.correspondence.face < 0).sum()))

    def remark(self) -> str:
        """Return what to add to a transfer's result where uncertain values were carried, or nothing."""
        return f", {self.area:.1%} of its area uncertain" if self.vertices and self.outcome == "carry" else ""

    def warnings(self, target: str) -> list[str]:
        """Return sentences for the person about vertices that do not have what the map carried there."""
        found = []
        if self.vertices and self.outcome != "carry":
            number = plural(self.vertices, "vertex")
            found.append(f"{number} of '{target}' ({self.area:.1%} of its area) {_OUTCOMES[self.outcome]}")
        if self.bare:
            number = plural(self.bare, "vertex")
            found.append(f"{number} of '{target}' have no counterpart and are left as they were")
        return found


def unmatched_vertices(found: Correspondence, target: Surface, gives: Floats | None = None) -> Booleans:
    """Return which target vertices in faces, (n,), have no certain counterpart in the part of the source that gives.

    `gives` is the source's mask, (n_source,); None: all of it.
    """
    used = np.zeros(len(found.face), bool)
    used[target.mesh.faces] = True
    certain = found.matched & (found.face >= 0)
    if gives is not None:
        certain &= interpolate(found, gives) >= 0.5 - 1e-9
    return used & ~certain


def carrier_between(
    found: Correspondence, source: Surface, target: Surface, outcome: Outcome, gives: Floats | None = None
) -> tuple[Carrier, Unmatched]:
    """Return who carries values, with what is to become of unmatched vertices, and how much of the target they are.

    Parameters
    ----------
    found : Correspondence
    source, target : Surface
    outcome : str
        As `TransferSettings.unmatched`.
    gives : (n_source,) float, optional
        The source's mask. What corresponds to the rest of the source is never carried.
    """
    unmatched = unmatched_vertices(found, target, gives)
    excluded = unmatched
    if outcome == "carry":
        excluded = np.zeros(len(unmatched), bool)
        if gives is not None:
            excluded = interpolate(found, gives) < 0.5 - 1e-9
    kept = without(found, excluded | (found.face < 0))
    carrier = Carrier(kept, source, target, "leave" if outcome == "carry" else outcome)
    area = target.mesh.vertex_areas
    counted = unmatched & ~excluded if outcome == "carry" else unmatched
    share = float(area[counted].sum() / max(area.sum(), np.finfo(float).tiny))
    bare = ~carrier.reached & ~(counted if outcome == "leave" else np.zeros(len(counted), bool))
    return carrier, Unmatched(int(counted.sum()), share, outcome, int(bare.sum()))
