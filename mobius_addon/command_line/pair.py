"""Source and target of a command: opened, read as arrays, and aligned."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ..streams import say
from .mesh_options import require_outer
from .output_files import warn

if TYPE_CHECKING:
    from ...solver import Alignment, AlignSettings, Correspondence, TriangleMesh
    from ...solver.carry.pairs import PointPairs
    from ...solver.surface.mesh import Integers
    from ..files import Imported
    from ..mesh_data import Surface


@contextmanager
def opened_pair(options: argparse.Namespace, *, write: bool) -> Iterator[tuple[Imported, Imported, list[str]]]:
    """Open the target's file, to be written or not, with the source beside it; see `files.opened`.

    Yields
    ------
    source, target : Imported
    notes : list of str
        Sentences to be said after the context.
    """
    from ..files import opened
    from ..mesh_data import Refusal

    if _same_mesh(options.source, options.target):
        raise Refusal(f"'{options.source}' is both source and target: give two meshes")
    with opened(options.target, options.source, write=write, whole=True) as found:
        assert found.source is not None
        warn(found.notes)
        found.notes.clear()
        yield found.source, found.target, found.notes


def read_pair(options: argparse.Namespace, source: Imported, target: Imported) -> tuple[Surface, Surface]:
    """Return source and target as arrays, named as on the command line, and say where they look otherwise."""
    from ..mesh_data import read_surface, unseen_warning

    warn(filter(None, (unseen_warning(imported.obj) for imported in (source, target))))
    return read_surface(source.obj, options.source), read_surface(target.obj, options.target)


def align_pair(
    options: argparse.Namespace,
    files: tuple[Imported, Imported],
    surfaces: tuple[Surface, Surface],
    settings: AlignSettings,
) -> tuple[Alignment, Correspondence]:
    """Align two surfaces, which were read from these files, and say what was found."""
    from ..attributes import piece_of
    from ..computation import aligned
    from ..operators.align import summary

    source, target = surfaces
    require_outer(settings.source_outer, options, "--source-outer", source)
    require_outer(settings.target_outer, options, "--target-outer", target)
    pairs = _landmarks(options, files, (source.mesh, target.mesh))
    corrections = _corrections(options, files, (source.mesh, target.mesh))
    alignment, correspondence = aligned(
        source.mesh,
        target.mesh,
        settings,
        largest_part=options.largest_part,
        keys=(source.keys, target.keys),
        landmarks=pairs,
        within=(piece_of(files[0].obj, options.source_cut), piece_of(files[1].obj, options.target_cut)),
    )
    warn(alignment.warnings)
    say(summary(options.source, options.target, alignment, correspondence))
    say(", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in alignment.seconds.items()))
    return alignment, _corrected(options, correspondence, (source.mesh, target.mesh), corrections)


def require_something_to_write(options: argparse.Namespace) -> None:
    """Raise `Unreadable` where a map is given and one that would be made is to be written."""
    from ..files import Unreadable

    if options.use_map and (options.map or options.report):
        raise Unreadable("--use-map aligns nothing, so there is no --map or --report to write")


def matched_pair(
    options: argparse.Namespace,
    files: tuple[Imported, Imported],
    surfaces: tuple[Surface, Surface],
    settings: AlignSettings,
) -> tuple[Alignment | None, Correspondence]:
    """Return the correspondence of two surfaces: of the map that was given, or of an alignment made for it."""
    if options.use_map:
        meshes = surfaces[0].mesh, surfaces[1].mesh
        corrections = _corrections(options, files, meshes)
        return None, _corrected(options, _fitting_map(options, surfaces), meshes, corrections)
    return align_pair(options, files, surfaces, settings)


def _fitting_map(options: argparse.Namespace, surfaces: tuple[Surface, Surface]) -> Correspondence:
    """Load the map that was given, and make sure that it is one between these two meshes."""
    from ...solver import load_map
    from ..files import Unreadable

    path = options.use_map
    if not path.is_file():
        raise Unreadable(f"there is no file '{path}'")
    try:
        return load_map(path, *(surface.rest for surface in surfaces))
    except OSError as error:
        raise Unreadable(f"'{path}' cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise Unreadable(str(error)) from error


def _landmarks(
    options: argparse.Namespace, files: tuple[Imported, Imported], meshes: tuple[TriangleMesh, TriangleMesh]
) -> Integers | None:
    """Return the pairs of the file that was given, if any, and say what is left out."""
    from ..files import read_landmarks

    if options.landmarks is None:
        return None
    pairs, warnings = read_landmarks(options.landmarks, files, meshes)
    warn(warnings)
    return pairs


def _corrections(
    options: argparse.Namespace, files: tuple[Imported, Imported], meshes: tuple[TriangleMesh, TriangleMesh]
) -> PointPairs | None:
    """Return the pairs of points by which the map is to be corrected, if any, and say what is left out."""
    from ...solver.carry.pairs import PointPairs
    from ..files import read_point_pairs

    if options.pairs is None:
        return None
    points, warnings = read_point_pairs(options.pairs, files, meshes)
    warn(warnings)
    return PointPairs.near(*meshes, *points)


def _corrected(
    options: argparse.Namespace,
    found: Correspondence,
    meshes: tuple[TriangleMesh, TriangleMesh],
    pairs: PointPairs | None,
) -> Correspondence:
    """Return a map bent through pairs of points, if there are any, and say what came of it."""
    from ...solver.carry.pairs import through_pairs
    from ..point_pairs import describe

    if pairs is None:
        return found
    bent = through_pairs(found, *meshes, pairs, follow_all=options.follow_all)
    kind, said = describe([f"pair {k + 1}" for k in range(len(pairs.source_face))], bent)
    if kind == "WARNING":
        warn([said])
    else:
        say(said)
    return bent.correspondence


def _same_mesh(source: str, target: str) -> bool:
    from ..files import split_object_name

    (source_path, source_name), (target_path, target_name) = split_object_name(source), split_object_name(target)
    return source_path.resolve() == target_path.resolve() and source_name == target_name
