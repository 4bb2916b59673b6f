"""A piece cut out of a surface that no disc carries as a whole, as a head out of a body: the one that the other shows.

On the disc of a whole body most of the skin shrinks to nothing, and a closed surface beside an open one has no disc at
all (two closed ones go to the sphere). What sticks out of it is cut off where the loop around is shortest, each such
piece is tried beside the other surface, and the one that fits takes the place of the whole; the rest has no
counterpart.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...flatten.sphere import Flat
from ...stages import Part
from ...surface.mesh import Floats, MeshError, TriangleMesh, plural
from ...surface.necks import Neck, necks
from ...surface.sheets import is_thick_sheet
from ...surface.topology import topology
from ..doubt.reconsider import UNLIKE, unlike
from ..maps.dense import drafted_from
from ..maps.mobius_map import roughly_aligned
from ..surfaces.prepared import Surface
from ..surfaces.remark import Remark
from ..surfaces.settings import AlignSettings
from ..surfaces.side_by_side import flattened, put_in_order

SHRUNK, MUCH = 1e-6, 0.2
"""A surface is too deep for a disc or sphere where this share of its area shrinks there to less than this, beside the
average: of bodies with a hole in the foot or the crown 0.5 to 0.8 does, of closed ones on the sphere 0.24 and 0.26, of
hands, the deepest that are aligned well whole, 0.13."""

TRIED = 4
"""Pieces that are tried beside the other surface, those most alike in their distances first: of two heads beside a body
the right one came first and second. If none fits, as many that are cut beside the shortest loops."""

CLOSED = "is closed"
"""Why a surface beside an open one has no disc."""

PAIRS = 20_000
"""Pairs of points whose distances tell the shape of a piece: their quantiles are known to 0.4 % of the range."""


def fitting_pieces(
    source: Surface, target: Surface, settings: AlignSettings, clock: Part
) -> tuple[Surface, Surface, tuple[Remark, ...]]:
    """Return the surfaces, of one that no disc carries the piece that fits the other, and what is to be said of that.

    Raises
    ------
    MeshError
        A surface cannot be used as a whole, and has no piece that fits.
    """
    clock.begin("flatten source", "Flattening the source", 0.0)
    put_in_order(source, target, settings, clock.within(0.0, 0.1))
    closed = [_is_closed(surface) for surface in (source, target)]
    if closed[0] == closed[1]:
        flattened(source, target, settings, clock.within(0.1, 0.3))
    if all(closed):
        if not settings.cut or all(_goes_to_sphere(surface) for surface in (source, target)):
            return source, target, ()
        return like_pieces(source, target, settings, clock) or (source, target, ())  # the sphere says why not
    first = _why_cut(source)
    clock.begin("flatten target", "Flattening the target", 0.3)
    second = _why_cut(target)
    if not settings.cut or (first is None) == (
        second is None
    ):  # neither, or none that tells which piece of the other is shown
        return source, target, ()
    rest = clock.part(0.6, 1.0, "cut")
    if first is not None:
        found, said = _piece_like(source, target, first, settings, rest, is_source=True)
        return found or source, target, said
    found, said = _piece_like(target, source, str(second), settings, rest, is_source=False)
    return source, found or target, said


def _why_cut(surface: Surface) -> str | None:
    """Return why a disc cannot carry the surface as a whole, as the rest of a sentence; None if it can."""
    if _is_closed(surface):
        return CLOSED
    try:
        share = shrunk(surface.flattening)
    except MeshError:
        other = topology(surface.cleaned.mesh).problems(fill_holes=surface.fill_holes)
        return None if other else "is too deep or narrow for one disc"  # what is wrong with it is said elsewhere
    if share > MUCH:
        return f"is too deep for one disc, where {share:.0%} of it would shrink by more than a million"
    return None


def _is_closed(surface: Surface) -> bool:
    return bool((surface.cleaned.mesh.twins >= 0).all())


def _goes_to_sphere(surface: Surface) -> bool:
    try:
        return surface.flattening.domain.closed
    except MeshError:
        return False


def shrunk(flattening: Flat) -> float:
    """Return the share of a surface's area that is smaller in its disc or sphere than `SHRUNK` times evenly."""
    mesh = flattening.mesh
    whole = 4 * np.pi if flattening.domain.closed else np.pi
    there = flattening.domain.flat_areas(flattening.places, mesh.faces)
    scale = there / np.maximum(mesh.face_areas, np.finfo(float).tiny)
    return float(mesh.face_areas[scale < SHRUNK * whole / mesh.area].sum() / mesh.area)


def _piece_like(
    whole: Surface, other: Surface, reason: str, settings: AlignSettings, clock: Part, *, is_source: bool
) -> tuple[Surface | None, tuple[Remark, ...]]:
    """Return the piece of a surface that is most like the other one, and what is to be said of it.

    None where no piece is, and a disc carries the whole, if badly.
    """
    name = whole.original.name
    clock.begin("cut", "Looking where to cut", 0.0)
    mesh = whole.cleaned.mesh
    hanging = necks(mesh, width(other.flattening))
    pieces = sorted(hanging, key=lambda neck: _shape_difference(_submesh(mesh, neck), other.mesh))
    best: tuple[tuple[bool, float], Surface, Neck] | None = None
    for shortest, stage in ((True, clock.part(0.1, 0.5)), (False, clock.part(0.5, 1.0))):
        chosen = [neck for neck in pieces if neck.shortest is shortest][:TRIED]
        for number, neck in enumerate(chosen):
            piece = whole.piece(neck.beyond, _cut(neck))
            pair = (piece, other) if is_source else (other, piece)
            fit = _fit(*pair, settings, stage.part(number / TRIED, (number + 1) / TRIED))
            if fit is not None and (best is None or fit < best[0]):
                best = fit, piece, neck
        if best is not None:
            break
    if best is None and reason == CLOSED:
        if not pieces:
            if is_thick_sheet(mesh):
                raise MeshError(
                    f"'{name}' {CLOSED}: a sheet with thickness, of which one side is enough: take away its Solidify "
                    "modifier, or delete its inner side and its rim"
                )
            raise MeshError(
                f"'{name}' {CLOSED} (it has no boundary), and nothing hangs on it by a neck where it could be cut: "
                "delete some faces to open it into a disc"
            )
        count = plural(sum(neck.shortest for neck in pieces), "piece")
        raise MeshError(
            f"'{name}' {CLOSED}, and of {count} that hang on it by a neck none fits '{other.original.name}': "
            "cut out what is to be matched, or name a vertex group of it"
        )
    if best is None:
        return None, ()
    said = f"'{name}' {reason}: the piece that fits was found, {best[2].length:.3g} around where it was cut"
    return best[1], (Remark("piece", said),)


def like_pieces(
    source: Surface, target: Surface, settings: AlignSettings, clock: Part
) -> tuple[Surface, Surface, tuple[Remark, ...]] | None:
    """Return those pieces of two surfaces too deep to go whole that have most vertices and fit, and what is to be said.

    Of bodies that people model this is the head. None where no two pieces fit.
    """
    clock.begin("cut", "Looking where to cut", 0.0)
    ours, theirs = (necks(surface.cleaned.mesh) for surface in (source, target))
    for number, neck in enumerate(sorted(ours, key=lambda neck: -int(neck.beyond.sum()))[:TRIED]):
        mine = source.piece(neck.beyond, _cut(neck))
        if _why_cut(mine) is not None:
            continue
        stage = clock.part(0.1 + 0.9 * number / TRIED, 0.1 + 0.9 * (number + 1) / TRIED)
        own, mesh = mine.cleaned.mesh, target.cleaned.mesh
        alike = [(_shape_difference(own, _submesh(mesh, other)), k) for k, other in enumerate(theirs)]
        best: tuple[tuple[bool, float], Surface, Neck] | None = None
        for place, (_, k) in enumerate(sorted(alike)[:TRIED]):
            yours = target.piece(theirs[k].beyond, _cut(theirs[k]))
            part = stage.part(place / TRIED, (place + 1) / TRIED)
            fit = _fit(mine, yours, settings, part) if _why_cut(yours) is None else None
            if fit is not None and (best is None or fit < best[0]):
                best = fit, yours, theirs[k]
        if best is not None:
            said = (
                f"'{source.original.name}' and '{target.original.name}' jut out too far to be aligned whole: of the "
                f"pieces that fit each other those with most vertices are, {neck.length:.3g} and {best[2].length:.3g} "
                "around where they were cut; for others name vertex groups"
            )
            return mine, best[1], (Remark("piece", said),)
    return None


def _cut(neck: Neck) -> str:
    return f"cut where it is narrow, to a piece of {neck.share:.1%} of its area; the rest has no counterpart"


def _fit(source: Surface, target: Surface, settings: AlignSettings, clock: Part) -> tuple[bool, float] | None:
    """Return whether two pieces fit mirrored only, and how little they are alike in a first draft; None: no fit."""
    clock.begin("cut", "Trying a piece", 0.0)
    try:
        rough = roughly_aligned(source, target, replace(settings, take_rival=False), clock.part(0.0, 0.7), None)
    except MeshError:  # no disc either
        return None
    draft, _, there = drafted_from(rough, clock.part(0.7, 1.0))
    found = unlike(rough, draft, there)
    # of a left and a right one the one that need not be mirrored
    return (rough.mobius.reflected, found) if found <= UNLIKE else None


def width(flattening: Flat) -> float:
    """Return the squared length of a surface's rim over its area."""
    rim = flattening.mesh.vertices[flattening.boundary]
    length = np.sqrt(((rim - np.roll(rim, 1, axis=0)) ** 2).sum(axis=1)).sum()
    return float(length**2 / flattening.mesh.area)


def _submesh(mesh: TriangleMesh, neck: Neck) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces[neck.beyond])


def _shape_difference(one: TriangleMesh, other: TriangleMesh) -> float:
    """Return by how much the distances between the points of two surfaces differ, in roots of their areas."""
    return float(np.abs(_distances(one) - _distances(other)).mean())


def _distances(mesh: TriangleMesh) -> Floats:
    """Return the distances between random points of a surface, (PAIRS,), sorted, in roots of its area.

    Osada et al., "Shape distributions" (2002), their D2.
    """
    rng = np.random.default_rng(0)
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    one, two = rng.choice(len(middle), (2, PAIRS), p=mesh.face_areas / mesh.area)
    return np.sort(np.sqrt(((middle[one] - middle[two]) ** 2).sum(axis=1) / mesh.area))
