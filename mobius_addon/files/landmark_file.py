"""Pairs of points that the user knows, in a file: vertex numbers, or coordinates as the mesh files have them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from ...solver import TriangleMesh
from ...solver.align.result.confidence import BOUND
from ...solver.surface.barycentric import interpolated
from ...solver.surface.mesh import Floats, Integers
from ...solver.surface.nearest import SurfacePoints
from .reading import Imported
from .unreadable import Unreadable

FAR = BOUND
"""Share of the diagonal beyond which a landmark is not on a surface: by so much a map errs that is called wrong."""

_SAMPLES = 16
"""Vertices and centres of faces around which the nearest point of the surface is looked for."""


@dataclass(frozen=True, eq=False)
class _Pair:
    """A line of the file: a point, (3,), or the number of a vertex on each side."""

    line: int
    sides: tuple[Floats, Floats] | tuple[int, int]

    @property
    def by_number(self) -> bool:
        return isinstance(self.sides[0], int)


def read_landmarks(
    path: Path, files: tuple[Imported, Imported], meshes: tuple[TriangleMesh, TriangleMesh]
) -> tuple[Integers, list[str]]:
    """Return the (source vertex, target vertex) rows, (l, 2), of a text file, and warnings.

    Each line has two vertex numbers, or six coordinates: a point on the source and one on the target, in the axes and
    units of their files, each standing for the nearest vertex. Commas, semicolons and spaces separate; what follows #
    is a remark. Points farther than `FAR` off a surface are left out.

    Parameters
    ----------
    path : Path
    files : (Imported, Imported)
        Source and target.
    meshes : (TriangleMesh, TriangleMesh)
        Their surfaces.

    Raises
    ------
    Unreadable
        It cannot be read, or is no such file; a vertex is not there; no landmark is left.
    """
    found = _placed(path, files, meshes)
    return np.stack(found.vertices, axis=1), found.warnings


def read_point_pairs(
    path: Path, files: tuple[Imported, Imported], meshes: tuple[TriangleMesh, TriangleMesh]
) -> tuple[tuple[Floats, Floats], list[str]]:
    """Return the points on the source and on the target, (l, 3) each, of such a file, and warnings.

    As `read_landmarks`, but for points that stay where they are rather than go to the nearest vertex.
    """
    found = _placed(path, files, meshes)
    return found.points, found.warnings


@dataclass(frozen=True, eq=False)
class _Placed:
    """The pairs of a file that are on both surfaces: vertex numbers, (l,), and points, (l, 3), of each."""

    vertices: tuple[Integers, Integers]
    points: tuple[Floats, Floats]
    warnings: list[str]


def _placed(path: Path, files: tuple[Imported, Imported], meshes: tuple[TriangleMesh, TriangleMesh]) -> _Placed:
    pairs = _parse(path)
    warnings: list[str] = []
    rows = np.full((2, len(pairs)), -1, np.intp)
    spots = np.full((2, len(pairs), 3), np.nan)
    for side, (imported, mesh) in enumerate(zip(files, meshes, strict=True)):
        numbered = [k for k, pair in enumerate(pairs) if pair.by_number]
        for k in numbered:
            number = int(pairs[k].sides[side])
            if not 0 <= number < len(mesh.vertices):
                raise Unreadable(
                    f"'{path}', line {pairs[k].line}: '{mesh.name}' has no vertex {number:,}: "
                    f"it has 0 to {len(mesh.vertices) - 1:,}"
                )
            rows[side, k], spots[side, k] = number, mesh.vertices[number]
        if numbered and (reason := imported.order_change()):
            warnings.append(f"'{path}' may count the vertices of '{imported.path}' otherwise: {reason}")
        placed = np.array([k for k, pair in enumerate(pairs) if not pair.by_number], np.intp)
        if len(placed):
            points = np.array([pairs[k].sides[side] for k in placed])
            vertices, points, off, remark = _on_surface(points, imported, mesh)
            near = off <= FAR
            rows[side, placed[near]], spots[side, placed[near]] = vertices[near], points[near]
            warnings += [remark] if remark else []
            if not near.all():
                lines = [f"{pairs[placed[k]].line} ({off[k]:.0%})" for k in np.flatnonzero(~near)]
                warnings.append(
                    f"landmarks off '{mesh.name}' left out, by the line of '{path}' and how far, in % of the diagonal: "
                    + _few(lines)
                )
    kept = (rows >= 0).all(axis=0)
    if not kept.any():
        raise Unreadable(
            f"no landmark of '{path}' is on both surfaces: give coordinates in the axes and units of the mesh files "
            f"({'; '.join(warnings)})"
        )
    return _Placed((rows[0, kept], rows[1, kept]), (spots[0, kept], spots[1, kept]), warnings)


def _parse(path: Path) -> list[_Pair]:
    """Return the lines that hold a pair."""
    if not path.is_file():
        raise Unreadable(f"'{path}' is not a file" if path.exists() else f"there is no file '{path}'")
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise Unreadable(f"'{path}' cannot be read: {error.strerror}") from error
    pairs = []
    for number, line in enumerate(text.splitlines(), 1):
        words = re.split(r"[,;\s]+", line.split("#")[0].strip(" \t\r\n,;"))
        if words == [""]:
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) == 2 and all(value.is_integer() for value in values):
            pairs.append(_Pair(number, (int(values[0]), int(values[1]))))
        elif len(values) == 6 and np.isfinite(values).all():
            pairs.append(_Pair(number, (np.array(values[:3]), np.array(values[3:]))))
        else:
            raise Unreadable(f"'{path}', line {number}: give two vertex numbers, or a point of each mesh by x y z")
    if not pairs:
        raise Unreadable(f"'{path}' holds no landmarks: give a pair on each line")
    return pairs


def _on_surface(points: Floats, imported: Imported, mesh: TriangleMesh) -> tuple[Integers, Floats, Floats, str | None]:
    """Return the nearest vertex in a face of each point, where the mesh has the point, how far off, and a remark.

    How far off the surface it is, is in diagonals.
    """
    surface = SurfacePoints(mesh, (), 0.0)
    found = []
    for what, placed in imported.readings(points):
        face, weights = surface.nearest_point(placed, np.zeros_like(placed), _SAMPLES)
        nearest = interpolated(mesh.vertices, mesh.faces[face], weights)
        off = np.linalg.norm(placed - nearest, axis=1) / mesh.diagonal
        found.append((what, placed, off, int((off <= FAR).sum())))
    best = 0
    if found[0][3] < len(points) / 2:
        # others than the mesh's own coordinates where they alone fit, by more than two points and so hardly by chance
        best = max(range(len(found)), key=lambda k: (found[k][3], -k))
        best = best if found[best][3] >= max(3, len(points) / 2) else 0
    what, placed, off, _ = found[best]
    used = np.unique(mesh.faces)
    vertices = used[KDTree(mesh.vertices[used]).query(placed)[1]]
    remark = f"most landmarks are on '{mesh.name}' only as {what}, and are taken so" if best else None
    return vertices, placed, off, remark


def _few(texts: list[str]) -> str:
    return ", ".join(texts[:8]) + (f" and {len(texts) - 8} more" if len(texts) > 8 else "")
