"""A surface prepared once for any number of alignments: put in order, flattened, its curvature measured, points chosen.

None of this depends on what it is aligned with, so that many targets, pieces and repeated calls share it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from ..flatten.flatten import Flattening, flatten
from ..stages import Progress, Stages
from ..surface.cleaning import Cleaned, in_order
from ..surface.descriptors import diffused_curvatures
from ..surface.fairing import faired
from ..surface.mesh import Floats, Integers, TriangleMesh, plural
from ..surface.sampling import farthest_points
from ..surface.statistics import standardised
from .objective import interior, source_points
from .settings import AlignSettings


class Surface:
    """A mesh and what `align` needs of it, found when it is first asked for, and kept.

    Attributes
    ----------
    original : TriangleMesh
        The mesh as it was given.
    fill_holes : bool
        Whether openings are closed for the computation.
    outer_vertex : int or None
        A vertex on the outer boundary; None: the longest boundary is.
    largest_part : bool
        Whether all parts but the one of largest area are left out.
    measured : (n, d) float64 or None
        The descriptors, once they are there.
    points : dict of str to dict of int to (k,) int
        As "source" and as "target", the points chosen so far, by how many were asked for.
    """

    def __init__(
        self,
        original: TriangleMesh,
        *,
        fill_holes: bool = False,
        outer_vertex: int | None = None,
        largest_part: bool = False,
    ) -> None:
        self.original = original
        self.fill_holes, self.outer_vertex, self.largest_part = fill_holes, outer_vertex, largest_part
        self.measured: Floats | None = None
        self.points: dict[str, dict[int, Integers]] = {"source": {}, "target": {}}

    def known(self, cleaned: Cleaned, flattening: Flattening) -> None:
        """Take from elsewhere what would be computed when it is first asked for."""
        self.__dict__["cleaned"], self.__dict__["flattening"] = cleaned, flattening

    @cached_property
    def cleaned(self) -> Cleaned:
        """The mesh, put in order for the computation; raises `MeshError`."""
        return in_order(self.original, largest_part=self.largest_part)

    @cached_property
    def flattening(self) -> Flattening:
        """Of the mesh in order, made fair where it is rough; raises `MeshError`."""
        return flatten(faired(self.cleaned.mesh), fill_holes=self.fill_holes, outer_vertex=self.outer_vertex)

    @property
    def mesh(self) -> TriangleMesh:
        """The mesh in order, made fair where it is rough: what everything is computed on."""
        return self.flattening.mesh

    def descriptors(self, progress: Callable[[float], None] | None = None) -> Floats:
        """Return the standardised descriptors of all vertices, (n, d).

        `progress` is called with the share of the work done, in [0, 1], and may raise to end it.
        """
        if self.measured is None:
            measured = diffused_curvatures(self.mesh, progress=progress)
            self.measured = standardised(measured, self.mesh.vertex_areas)
        return self.measured

    def source_points(self, count: int) -> Integers:
        """Return up to `count` vertices that stand for it as a source."""
        if count not in self.points["source"]:
            self.points["source"][count] = source_points(self.flattening, self.descriptors(), count)
        return self.points["source"][count]

    def target_points(self, count: int, progress: Callable[[float], None] | None = None) -> Integers:
        """Return up to `count` vertices that stand for it as a target; `progress` as for `descriptors`."""
        if count not in self.points["target"]:
            nowhere = np.empty(0, np.intp)
            self.points["target"][count] = farthest_points(
                self.mesh, count, nowhere, interior(self.flattening), progress
            )
        return self.points["target"][count]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done to the mesh for the computation, each a sentence."""
        rough = f"'{self.mesh.name}' is rough or noisy: smoothed, for the computation only"
        smoothed = (rough,) if self.mesh is not self.cleaned.mesh else ()
        return (*cleaning_notes(self.cleaned), *smoothed, *opening_notes(self.flattening))


def cleaning_notes(tidy: Cleaned) -> tuple[str, ...]:
    """Say what was put in order for the computation."""
    return (f"'{tidy.mesh.name}': {', '.join(tidy.changes)}, for the computation only",) if tidy.changes else ()


def opening_notes(found: Flattening) -> tuple[str, ...]:
    """Say which openings were closed for the computation."""
    if not found.holes:
        return ()
    edges = ", ".join(f"{len(loop):,}" for loop in found.holes[:6]) + (", ..." if len(found.holes) > 6 else "")
    number = plural(len(found.holes), "opening")
    return (f"'{found.mesh.name}': {number} ({edges} edges) closed, for the computation only",)


def prepare(
    mesh: TriangleMesh,
    settings: AlignSettings | None = None,
    *,
    outer_vertex: int | None = None,
    largest_part: bool = False,
    progress: Callable[[Progress], bool | None] | None = None,
) -> Surface:
    """Compute all that `align` needs of one mesh, whichever it is aligned with, as source or as target.

    Parameters
    ----------
    mesh : TriangleMesh
        A triangulated disc; faces used twice or turned round are put in order.
    settings : AlignSettings, optional
        `fill_holes`, `samples` and `targets` count.
    outer_vertex : int, optional
        A vertex on the loop that is to be the outer one, for `fill_holes`; by default the longest loop is.
    largest_part : bool
        Leave out all parts but the one of largest area.
    progress : callable, optional
        As for `align`.

    Raises
    ------
    MeshError
        The mesh is no disc and cannot be made one.
    Cancelled
        The progress callback returned False.
    """
    settings = settings or AlignSettings()
    clock = Stages(progress)
    whole = clock.part(0, 1)
    whole.begin("flatten", "Flattening", 0.0)
    surface = Surface(mesh, fill_holes=settings.fill_holes, outer_vertex=outer_vertex, largest_part=largest_part)
    _ = surface.flattening
    whole.begin("descriptors", "Measuring curvature", 0.3)
    surface.descriptors(whole.within(0.3, 0.6))
    whole.begin("sampling", "Choosing points", 0.6)
    surface.source_points(settings.samples)
    surface.target_points(settings.targets, whole.within(0.6, 1.0))
    clock.end()
    return surface
