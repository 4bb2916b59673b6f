"""What is asked of a collection, and what is told while it is worked on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..surface.mesh import Floats, TriangleMesh


@dataclass(frozen=True)
class Specimen:
    """A surface of a collection.

    Attributes
    ----------
    name : str
        A file may have it.
    stamp : str
        Changes with the file or array that it is read from.
    read : callable
        Returns the mesh, and further coordinates of its vertices, (n, d), or None; see `surface.cleaned`. May raise
        `MeshError` or OSError.
    """

    name: str
    stamp: str
    read: Callable[[], tuple[TriangleMesh, Floats | None]]


@dataclass(frozen=True)
class Plan:
    """Which pairs are aligned, and how.

    Attributes
    ----------
    pairs : str
        "all": each with each, by `settings.refine`. "star": one with each of the others. "tree": all pairs by Möbius
        maps, then those of their minimum spanning tree by `settings.refine`.
    template : str or None
        The one of a star, and where the tree's paths begin; None: the medoid, for which all pairs are aligned by
        Möbius maps.
    check : bool
        Of a star with a named template: also align each with the next by Möbius maps, so that there are three-cycles.
    largest_part : bool
        Leave out all parts of a specimen but the one of largest area.
    """

    pairs: str = "all"
    template: str | None = None
    check: bool = True
    largest_part: bool = True

    def __post_init__(self) -> None:
        if self.pairs not in ("all", "star", "tree"):
            raise ValueError(f"pairs must be all, star or tree, not '{self.pairs}'")


@dataclass(frozen=True)
class Told:
    """How far a collection is.

    Attributes
    ----------
    stage : str
    done, total : int
        Of the stage's tasks, those done before included.
    fresh : int
        Of them, those that this run has done.
    failed : int
    name : str
        What was done last.
    error : str or None
        Why it could not be done.
    """

    stage: str
    done: int
    total: int
    fresh: int
    failed: int
    name: str = ""
    error: str | None = None
