"""How near a carried expression comes to the target's own, where it should close and which lip it moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.carry.contacts import Contacts, facing, find_contacts
from solver.surface.barycentric import interpolated
from tests.bench.heads.targets import Target

MOVING = 0.05
"""Share of the largest displacement of a key from which on the parts beside the skin are moved by it."""

FEWEST = 10
"""Vertices from which on something meets."""

APART = 0.5
"""Share of the longest displacement from which on two lips move differently."""

THROUGH = 0.05
"""Share of the opening from which on a vertex that is behind what it should meet has passed through."""


def relative_error(wanted: np.ndarray, got: np.ndarray) -> float:
    """Return the root of the summed squared difference over that of what is wanted, (n, 3) each."""
    size = float(np.linalg.norm(wanted))
    return float(np.linalg.norm(got - wanted)) / size if size > 0 else np.nan


def likeness(wanted: np.ndarray, got: np.ndarray) -> float:
    """Return the cosine between two fields of displacements: 1 where one is the other, at any strength."""
    size = float(np.linalg.norm(wanted) * np.linalg.norm(got))
    return float((wanted * got).sum()) / size if size > 0 else np.nan


def size_likeness(wanted: np.ndarray, got: np.ndarray) -> float:
    """Return the correlation between how far each vertex moves in two fields of displacements."""
    sizes = [np.linalg.norm(values, axis=1) for values in (wanted, got)]
    return float(np.corrcoef(*sizes)[0, 1]) if min(size.std() for size in sizes) > 0 else np.nan


@dataclass(frozen=True)
class Score:
    """Figures of one expression, carried in one way; nan where there is nothing to be measured.

    Attributes
    ----------
    whole, skin, parts : float
        Relative errors over all vertices, those of the skin, and the others.
    like : float
        The cosine on the skin.
    far : float
        The correlation of how far the skin's vertices move.
    gap : float
        Of what meets in the target's own expression, the median of the gap left over, beyond that in the target's own,
        for the opening.
    through : float
        Share of that which has passed through.
    wrong : float
        Share of the lips' vertices that move as the other lip does, in a jaw that opens.
    """

    whole: float
    skin: float
    parts: float
    like: float
    far: float
    gap: float
    through: float
    wrong: float


def meeting_lips(places: np.ndarray, opening: np.ndarray, faces: np.ndarray) -> Contacts:
    """Return the lips, which are what meets when a jaw closes that a displacement, (n, 3), opens."""
    lips = find_contacts(places + opening, -opening, faces)
    other = interpolated(opening, lips.corners, lips.barycentric)
    longest = np.linalg.norm(opening, axis=1).max()  # near the corners of the mouth both move alike
    return lips.chosen(np.linalg.norm(opening[lips.vertex] - other, axis=1) > APART * longest)


class Judge:
    """Who knows the target's own displacement of an expression, (n, 3)."""

    def __init__(self, target: Target, wanted: np.ndarray, opens: bool) -> None:
        self.target, self.wanted = target, wanted
        self.skin = target.part == 0
        self.faces = target.mesh.faces[self.skin[target.mesh.faces].all(axis=1)]
        places = target.mesh.vertices
        size = np.linalg.norm(wanted, axis=1)
        self.moves_parts = bool((size[~self.skin] > MOVING * size.max()).any())
        found = find_contacts(places, np.where(self.skin[:, None], wanted, 0), self.faces)
        self.meeting = found if len(found.vertex) >= FEWEST else None
        lips = meeting_lips(places, np.where(self.skin[:, None], wanted, 0), self.faces) if opens else None
        self.lips = lips if lips is not None and len(lips.vertex) >= FEWEST else None

    def score(self, got: np.ndarray) -> Score:
        """Judge what was carried, (n, 3)."""
        wanted, skin = self.wanted, self.skin
        gap, through = (np.nan, np.nan) if self.meeting is None else self._gap(self.meeting, got)
        return Score(
            relative_error(wanted, got),
            relative_error(wanted[skin], got[skin]),
            relative_error(wanted[~skin], got[~skin]) if self.moves_parts else np.nan,
            likeness(wanted[skin], got[skin]),
            size_likeness(wanted[skin], got[skin]),
            gap,
            through,
            np.nan if self.lips is None else self._wrong(self.lips, got),
        )

    def _gap(self, meeting: Contacts, got: np.ndarray) -> tuple[float, float]:
        places, vertex = self.target.mesh.vertices, meeting.vertex
        met = np.zeros(len(places), bool)
        met[meeting.corners] = True
        among = np.flatnonzero(met[self.faces].any(axis=1))
        now = facing(places, places + got, self.faces, vertex, 0.5 * meeting.opening, among)
        row = np.full(len(places), -1)
        row[now.vertex] = np.arange(len(now.vertex))
        at = row[vertex]
        # what faces nothing that was far off is as open as it was
        left, behind = np.ones(len(vertex)), np.zeros(len(vertex), bool)
        left[at >= 0] = now.distance[at[at >= 0]] / meeting.opening[at >= 0]
        depth = np.minimum(meeting.clearance, 0) - THROUGH * meeting.opening
        behind[at >= 0] = now.clearance[at[at >= 0]] < depth[at >= 0]
        return float(np.median(np.maximum(left - meeting.distance / meeting.opening, 0))), float(behind.mean())

    def _wrong(self, lips: Contacts, got: np.ndarray) -> float:
        own = self.wanted[lips.vertex]
        other = interpolated(self.wanted, lips.corners, lips.barycentric)
        carried = got[lips.vertex]
        # as strong as the target's own is, since artists open jaws to different widths
        strength = max(float((carried * own).sum()) / max(float((carried**2).sum()), 1e-300), 0.0)
        apart = (np.linalg.norm(strength * carried - place, axis=1) for place in (own, other))
        return float(np.greater(*apart).mean())
