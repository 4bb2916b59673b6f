"""What belongs to what in meshes of several parts, beyond the main one of each."""

from __future__ import annotations

from dataclasses import dataclass

from ...surface.mesh import Floats, Integers
from ...surface.parts import Parts
from ..surfaces.remark import Remark


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

    def counts(self) -> tuple[int, int, int]:
        """Return how many parts have a counterpart, how many of the target's have none, and of the source's."""
        paired = sum(pair.source is not None and pair.target is not None for pair in self.pairs)
        return paired, len(self.target) - paired, len(self.source) - paired

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What the person should know about parts without a counterpart, each a sentence."""
        _, here, there = self.counts()
        target, source = (parts.mesh.name for parts in (self.target, self.source))
        notes = []
        if here:
            notes.append(
                f"'{target}': {_of_parts(here, len(self.target))} no counterpart on '{source}': vertex groups and "
                "shape keys come from the surface next to them, all else stays as it is"
            )
        if there:
            notes.append(f"'{source}': {_of_parts(there, len(self.source))} no counterpart on '{target}'")
        return tuple(Remark("no counterpart", said) for said in notes)


def _of_parts(count: int, total: int) -> str:
    return f"{count:,} of {total:,} parts {'has' if count == 1 else 'have'}"
