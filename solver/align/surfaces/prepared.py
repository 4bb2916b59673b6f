"""A surface prepared once for any number of alignments: put in order, flattened, its curvature measured, points chosen.

None of this depends on what it is aligned with, so that many targets, pieces and repeated calls share it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...flatten.flatten import flatten
from ...flatten.sphere import Flat, flatten_sphere
from ...stages import Progress, Stages
from ...surface.cleaning import LEFT_OUT, cleaned
from ...surface.descriptors import diffused_curvatures
from ...surface.fairing import faired
from ...surface.kept import kept
from ...surface.mesh import Booleans, Floats, Integers, MeshError, TriangleMesh, plural
from ...surface.parts import Parts
from ...surface.sampling import farthest_points
from ...surface.statistics import standardised
from ...surface.tidy import Cleaned, Piece, piece_within
from ...surface.topology import topology
from ...surface.verdict import closing
from .objective import covering_radius, interior, source_points
from .remark import Remark
from .settings import AlignSettings

LITTLE = 0.02
"""Share of the rim in the disc without its angles that is not worth a word."""

LOST = 0.35
"""Share of the rim in the disc without its angles from which on nothing is aligned: bands of 1:12 have 0.32 and are
still aligned right, of 1:14 0.41 and are not."""

FEWEST = 3
"""Vertices inside the disc that a surface needs: a Möbius transformation has three parameters."""


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
    keys : (n, d) float64 or None
        Further coordinates of the vertices; see `surface.cleaned`.
    tidy : Cleaned or None
        The mesh in order, if it is already.
    within : (n,) bool, (k, 2) int or None
        Vertices among which the piece lies that is to be used, or edges along which the mesh is cut open, its largest
        piece being used; None: all of the mesh is.
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
        keys: Floats | None = None,
        tidy: Cleaned | None = None,
        within: Piece | None = None,
    ) -> None:
        self.original = original
        self.fill_holes, self.outer_vertex, self.largest_part = fill_holes, outer_vertex, largest_part
        self.keys, self.tidy, self.within = keys, tidy, within
        self.measured: Floats | None = None
        self.points: dict[str, dict[int, Integers]] = {"source": {}, "target": {}}
        self._radii: dict[int, Floats] = {}

    def known(self, flattening: Flat) -> None:
        """Take from elsewhere what would be computed when it is first asked for."""
        self.__dict__["flattening"] = flattening

    @kept
    def cleaned(self) -> Cleaned:
        """The mesh, put in order for the computation; raises `MeshError`."""
        if self.tidy is not None:
            return self.tidy
        found = cleaned(self.original, largest_part=self.largest_part, fill_holes=self.fill_holes, keys=self.keys)
        if _closed(found.mesh) and np.linalg.det(_tetrahedra(found.mesh)).sum() < 0:
            found = found.turned()  # a closed surface has an outside by itself
        return found if self.within is None else piece_within(found, self.within)

    def piece(self, chosen: Booleans, said: str) -> Surface:
        """Return what some of its faces, (m,) of the mesh in order, are by themselves."""
        return Surface(self.original, fill_holes=self.fill_holes, keys=self.keys, tidy=self.cleaned.only(chosen, said))

    @kept
    def parts(self) -> Parts:
        """All parts of the mesh as it was given, the one that is in order first."""
        return Parts.of(self.original, self.cleaned, self.keys)

    @kept
    def flattening(self) -> Flat:
        """Of the mesh in order, made fair where it is rough; raises `MeshError`, as for what is too long for a disc."""
        outer = None if self.outer_vertex is None else self.cleaned.vertex_for(self.outer_vertex)
        if self.outer_vertex is None and _closed(self.cleaned.mesh):
            closed = flatten_sphere(faired(self.cleaned.mesh))
            return closed if closed.mesh is self.cleaned.mesh else replace(closed, exact=self.cleaned.mesh.vertices)
        found = flatten(faired(self.cleaned.mesh), fill_holes=self.fill_holes, outer_vertex=outer)
        if found.rim_lost > LOST:
            raise MeshError(
                f"'{found.mesh.name}' is too long and narrow to be aligned in a disc, where {found.rim_lost:.0%} of "
                "its rim would fall together in points: cut it into pieces that are at most eight times as long as wide"
            )
        tidy = self.cleaned.mesh
        return found if found.mesh is tidy else replace(found, exact=tidy.vertices)

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

    def source_points(self, count: int, progress: Callable[[float], None] | None = None) -> Integers:
        """Return up to `count` vertices that stand for it as a source; `progress` as for `descriptors`."""
        if count not in self.points["source"]:
            self.require_inside()
            self.points["source"][count] = source_points(self.flattening, self.descriptors(), count, progress)
        return self.points["source"][count]

    def target_points(self, count: int, progress: Callable[[float], None] | None = None) -> Integers:
        """Return up to `count` vertices that stand for it as a target; `progress` as for `descriptors`."""
        if count not in self.points["target"]:
            self.require_inside()
            nowhere = np.empty(0, np.intp)
            self.points["target"][count] = farthest_points(
                self.mesh, count, nowhere, interior(self.flattening), progress
            )
        return self.points["target"][count]

    def target_radii(self, count: int) -> Floats:
        """Return the radii of the match discs around the `target_points`, (k,), where none is set."""
        if count not in self._radii:
            self._radii[count] = covering_radius(self.flattening.places[self.target_points(count)])
        return self._radii[count]

    def require_inside(self) -> None:
        """Raise `MeshError` if too few vertices are inside the disc to tell one map from another."""
        inside = int(interior(self.flattening).sum())
        if inside < FEWEST:
            raise MeshError(
                f"'{self.mesh.name}' has {plural(inside, 'vertex')} inside its boundary, and {FEWEST} are the fewest "
                "that tell how it lies: subdivide it"
            )

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done to the mesh for the computation, each a sentence."""
        return tuple(one.sentence for one in self.remarks(other_parts=False))

    def remarks(self, *, other_parts: bool) -> tuple[Remark, ...]:
        """Return what was done to the mesh, and whether it is narrow; not what was left out, if that is aligned too."""
        rough = f"'{self.mesh.name}' is rough or noisy: smoothed, for the computation only"
        smoothed = (rough,) if self.mesh is not self.cleaned.mesh else ()
        done = (*cleaning_notes(self.cleaned, other_parts), *smoothed, *_opening_notes(self.flattening))
        return (*(Remark("done", said) for said in done), *_narrow(self.flattening))


def cleaning_notes(tidy: Cleaned, other_parts: bool = False) -> tuple[str, ...]:
    """Say what was put in order for the computation; not what of it was left out, if `other_parts` are aligned too."""
    changes = [said for said in tidy.changes if not (other_parts and said.endswith(LEFT_OUT))]
    return (f"'{tidy.mesh.name}': {', '.join(changes)}, for the computation only",) if changes else ()


def _closed(mesh: TriangleMesh) -> bool:
    """Return whether a mesh is a sphere."""
    return bool((mesh.twins >= 0).all()) and topology(mesh).is_sphere


def _tetrahedra(mesh: TriangleMesh) -> Floats:
    """Return the corners of the triangles about the middle, (m, 3, 3)."""
    return mesh.vertices[mesh.faces] - mesh.vertices[mesh.used].mean(axis=0)


def flattening_notes(found: Flat) -> tuple[str, ...]:
    """Say which openings were closed for the computation, and where the disc is too narrow for the surface."""
    return (*_opening_notes(found), *(one.sentence for one in _narrow(found)))


def _opening_notes(found: Flat) -> tuple[str, ...]:
    return (f"'{found.mesh.name}': {closing(found.holes)}, for the computation only",) if found.holes else ()


def _narrow(found: Flat) -> tuple[Remark, ...]:
    said = f"'{found.mesh.name}' is long and narrow: angles are lost in the disc along {found.rim_lost:.0%} of its rim"
    return (Remark("narrow", said),) if found.rim_lost > LITTLE else ()


def prepare(
    mesh: TriangleMesh,
    settings: AlignSettings | None = None,
    *,
    outer_vertex: int | None = None,
    largest_part: bool = True,
    keys: Floats | None = None,
    within: Piece | None = None,
    progress: Callable[[Progress], bool | None] | None = None,
) -> Surface:
    """Compute all that `align` needs of one mesh, whichever it is aligned with, as source or as target.

    Parameters
    ----------
    mesh : TriangleMesh
        A surface that `surface.cleaned` can make a disc.
    settings : AlignSettings, optional
        `fill_holes`, `samples` and `targets` count.
    outer_vertex : int, optional
        A vertex on the loop that is to be the outer one, for `fill_holes`; by default the longest loop is.
    largest_part : bool
        Leave out all parts but the one of largest area.
    keys : (n, d) float64, optional
        Further coordinates of the vertices, as by shape keys; see `surface.cleaned`.
    within : (n,) bool or (k, 2) int, optional
        Vertices among which the piece lies that is to be used, such as those of a head; or edges along which the mesh
        is cut open, such as seams, of which what is not the largest piece has no counterpart.
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
    surface = Surface(
        mesh,
        fill_holes=settings.fill_holes,
        outer_vertex=outer_vertex,
        largest_part=largest_part,
        keys=keys,
        within=within,
    )
    _ = surface.flattening
    whole.begin("descriptors", "Measuring curvature", 0.3)
    surface.descriptors(whole.within(0.3, 0.6))
    whole.begin("sampling", "Choosing points", 0.6)
    surface.source_points(settings.samples)
    surface.target_points(settings.targets, whole.within(0.6, 1.0))
    clock.end()
    return surface
