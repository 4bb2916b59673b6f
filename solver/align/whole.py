"""What belongs to what in meshes of several parts, beyond the main one of each."""

from __future__ import annotations

from dataclasses import dataclass

from ..surface.mesh import Floats, Integers
from ..surface.parts import Parts


@dataclass(frozen=True)
class Pair:
    """A part and its counterpart.

    Attributes
    ----------
    source, target : int or None
        Numbers among `Parts`; None: it has no counterpart.
    certainty : float
        Of the pair, in [0, 1].
    offset : float
        Mean distance at which the parts remain after bending, in diagonals of the source.
    """

    source: int | None
    target: int | None
    certainty: float
    offset: float


@dataclass(frozen=True, eq=False)
class Whole:
    """What belongs to what beyond the main parts, in vertices and faces of the meshes as they came.

    Attributes
    ----------
    source, target : Parts
    pairs : tuple of Pair
        The main pair first, then pairs by the number of the target's part, parts of the target without a counterpart
        and those of the source.
    face, barycentric : (n,) int, (n, 3) float64
        Point of the source for each vertex of the target's other parts; -1 and 0 at those of the main one.
    confidence : (n,) float64
        0 where there is no counterpart.
    leader : (n,) int
        The vertex of the target's surface that each vertex without a counterpart rides with; -1: it does not.
    """

    source: Parts
    target: Parts
    pairs: tuple[Pair, ...]
    face: Integers
    barycentric: Floats
    confidence: Floats
    leader: Integers
