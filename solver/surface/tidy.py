"""A mesh in order, and how what is computed on it is told on the mesh as it came."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from .gluing import glue_of, vertices_of_glue
from .mesh import Booleans, Floats, Integers, MeshError, TriangleMesh, directed_edges, plural

Value = TypeVar("Value", bound=np.generic)

Piece: TypeAlias = Booleans | Integers
"""What is used of a mesh: the largest piece among these vertices, (n,) bool, or between these edges, (k, 2) int."""


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A mesh in order and how its faces and vertices relate to those of the mesh it came from.

    Attributes
    ----------
    mesh : TriangleMesh
        The original itself where there was nothing to do. Its first vertices are the original's, in use or not, so that
        their numbers keep their meaning; further ones are where a vertex of the original has become several.
    faces : (m,) int
        The original face that each face was; -1 for one that was put where a single one is missing.
    reversed : (m,) bool
        Faces whose second and third corners changed places.
    changes : tuple of str
        What was done, each as the rest of a sentence about the mesh.
    original_faces : (m_original, 3) int
        The faces as they came.
    vertex_of : (n_original,) int
        The vertex that each original vertex became; -1 where it is in no face that was kept.
    origin : (n,) int
        The original vertex of each vertex; for the first ones themselves.
    share : float
        Of the area of the surface that this is a piece of, if it was cut out of one; 1 for the whole.
    """

    mesh: TriangleMesh
    faces: Integers
    reversed: Booleans
    changes: tuple[str, ...]
    original_faces: Integers
    vertex_of: Integers
    origin: Integers
    share: float = 1.0

    @staticmethod
    def unchanged(mesh: TriangleMesh) -> Cleaned:
        """Return a mesh that is taken as it is."""
        count, every = len(mesh.faces), np.arange(len(mesh.vertices))
        vertex_of = np.where(mesh.used, every, -1)
        return Cleaned(mesh, np.arange(count), np.zeros(count, bool), (), mesh.faces, vertex_of, every)

    def turned(self) -> Cleaned:
        """Return it with all faces turned round."""
        mesh = TriangleMesh(self.mesh.vertices, self.mesh.faces[:, [0, 2, 1]], self.mesh.name)
        return replace(self, mesh=mesh, reversed=~self.reversed)

    def only(self, chosen: Booleans, said: str) -> Cleaned:
        """Return what some of its faces, (m,), are by themselves, and `said` among the changes."""
        mesh = self.mesh
        glue = glue_of(mesh.faces, mesh.twins).among(chosen)
        faces, vertex_of, origin = vertices_of_glue(mesh.faces[chosen], glue, len(mesh.vertices))
        return replace(
            self,
            mesh=TriangleMesh(mesh.vertices[origin], faces, mesh.name),
            faces=self.faces[chosen],
            reversed=self.reversed[chosen],
            changes=(*self.changes, said),
            vertex_of=np.where(self.vertex_of >= 0, vertex_of[self.vertex_of], -1),
            origin=self.origin[origin],
            share=self.share * float(mesh.face_areas[chosen].sum() / mesh.area),
        )

    def without_pinholes(self) -> Cleaned:
        """Return it with a face in each opening of three edges, but for the longest boundary.

        What hangs on the surface by three edges about such a face, as what is left of a tube that was cut through does,
        gives way to one.
        """
        mesh = self.mesh
        loops = pinholes(mesh)
        if not len(loops):
            return self
        said = f"{plural(len(loops), 'missing triangle')} put in"
        whole = replace(
            self,
            mesh=TriangleMesh(mesh.vertices, np.concatenate([mesh.faces, loops]), mesh.name),
            faces=np.concatenate([self.faces, np.full(len(loops), -1)]),
            reversed=np.concatenate([self.reversed, np.zeros(len(loops), bool)]),
            changes=(*self.changes, said),
        )
        kept, feet = _without_stubs(whole.mesh, loops)
        if not len(feet):
            return whole
        gone = whole.mesh.faces[~kept]
        faces = np.concatenate([whole.mesh.faces[kept], feet])
        used = np.zeros(len(mesh.vertices), bool)
        used[faces] = True
        lost = np.setdiff1d(gone, np.flatnonzero(used))
        return replace(
            whole,
            mesh=TriangleMesh(mesh.vertices, faces, mesh.name),
            faces=np.concatenate([whole.faces[kept], np.full(len(feet), -1)]),
            reversed=np.concatenate([whole.reversed[kept], np.zeros(len(feet), bool)]),
            vertex_of=np.where(np.isin(self.vertex_of, lost), -1, self.vertex_of),
        )

    @property
    def size(self) -> int:
        """Vertices of the original."""
        return len(self.vertex_of)

    def at_vertices(self, values: npt.NDArray[Value], absent: complex) -> npt.NDArray[Value]:
        """Return values, (n, ...), at the original's vertices, (n_original, ...); `absent` where it has none."""
        if not self.changes:
            return values
        result = values[np.maximum(self.vertex_of, 0)]
        result[self.vertex_of < 0] = absent
        return result

    def at_corners(self, values: npt.NDArray[Value], absent: complex) -> npt.NDArray[Value]:
        """Return values, (n, ...), at the corners of the original's faces, (m_original, 3, ...).

        Faces that were left out, such as duplicates, have those of their vertices.
        """
        result = self.at_vertices(values, absent)[self.original_faces]
        own = values[self.mesh.faces]
        own[self.reversed] = own[self.reversed][:, [0, 2, 1]]
        kept = self.faces >= 0
        result[self.faces[kept]] = own[kept]
        return result

    def vertices_for(self, original: Integers) -> Integers:
        """Return the vertices that original vertices became; those left out keep their number, in no face."""
        found = self.vertex_of[original]
        return np.where(found < 0, original, found)

    def vertex_for(self, original: int) -> int:
        """Return the vertex that an original one became, if it is one; else the number itself."""
        return int(self.vertices_for(np.array([original]))[0]) if 0 <= original < self.size else original

    def area_at_vertices(self) -> Floats:
        """Return the area around each original vertex, (n_original,), of what was kept.

        The first of several that became one has all of it.
        """
        areas = self.mesh.vertex_areas
        return np.bincount(self.origin, areas, self.size).astype(np.float64, copy=False) if self.changes else areas


def piece_within(tidy: Cleaned, within: Piece) -> Cleaned:
    """Return the largest piece of a mesh in order among some of the original's vertices, or between some of its edges.

    Raises
    ------
    MeshError
        No face lies among the vertices, or none of the edges is inside the surface.
    """
    if within.dtype == np.bool_:
        return _among(tidy, within.astype(np.bool_, copy=False))
    return _cut_open(tidy, within.astype(np.int64, copy=False))


def _among(tidy: Cleaned, inside: Booleans) -> Cleaned:
    mesh = tidy.mesh
    chosen = inside[tidy.origin][mesh.faces].all(axis=1)
    if not chosen.any():
        raise MeshError(f"'{mesh.name}' has no face among the vertices that it was to be cut to: choose others")
    place = np.flatnonzero(chosen)
    part = glue_of(mesh.faces, mesh.twins).among(chosen).parts(len(place))
    area = np.bincount(part, mesh.face_areas[place])
    chosen[place[part != np.argmax(area)]] = False
    share = float(mesh.face_areas[chosen].sum() / mesh.area)
    return tidy.only(chosen, f"cut to a piece of {share:.1%} of its area, as asked; the rest has no counterpart")


def _cut_open(tidy: Cleaned, edges: Integers) -> Cleaned:
    mesh, size = tidy.mesh, len(tidy.mesh.vertices)
    whole = glue_of(mesh.faces, mesh.twins)
    # by the vertices as they came, so that those that became several are told as one
    ends = np.sort(tidy.origin[tidy.vertices_for(edges)], axis=1)
    sides = np.sort(tidy.origin[directed_edges(mesh.faces)], axis=1)
    marked = np.isin(sides @ [tidy.size, 1], ends @ [tidy.size, 1])
    inner = int((marked & (mesh.twins >= 0)).sum()) // 2
    if not inner:
        raise MeshError(f"'{mesh.name}' has none of the edges inside along which it was to be cut open: mark others")
    faces, vertex_of, origin = vertices_of_glue(mesh.faces, whole.without(np.flatnonzero(marked)), size)
    opened = replace(
        tidy,
        mesh=TriangleMesh(mesh.vertices[origin], faces, mesh.name),
        changes=(*tidy.changes, f"cut open along {plural(inner, 'edge')}, as asked"),
        vertex_of=np.where(tidy.vertex_of >= 0, vertex_of[tidy.vertex_of], -1),
        origin=tidy.origin[origin],
    )
    part = glue_of(faces, opened.mesh.twins).parts(len(faces))
    area = np.bincount(part, mesh.face_areas)
    if len(area) == 1:
        return opened
    largest = area.argmax()
    share = area[largest] / mesh.area
    return opened.only(part == largest, f"to a piece of {share:.1%} of its area; the rest has no counterpart")


def _without_stubs(mesh: TriangleMesh, caps: Integers) -> tuple[Booleans, Integers]:
    """Return which faces, (m,), are not about one of some faces and hang on the rest by three edges; and these, (k, 3).

    None where a vertex of the cap is one of the three edges'.
    """
    kept, feet = np.ones(len(mesh.faces), bool), []
    ends = directed_edges(mesh.faces)
    for cap in caps:
        stub = np.isin(mesh.faces, cap).any(axis=1)
        sides = np.flatnonzero(np.repeat(stub, 3))
        out = sides[(mesh.twins[sides] < 0) | ~stub[mesh.twins[sides] // 3]]
        start, stop = ends[out].T
        ring = len(out) == 3 and (mesh.twins[out] >= 0).all() and set(start.tolist()) == set(stop.tolist())
        if ring and kept[stub].all() and not np.isin(start, cap).any():
            kept[stub] = False
            first = start[0]
            second = stop[0]
            feet.append([first, second, stop[start == second][0]])
    return kept, np.array(feet, np.intp).reshape(-1, 3)


def pinholes(mesh: TriangleMesh) -> Integers:
    """Return the openings of three edges of a manifold mesh as the faces that are missing there, (k, 3).

    None where the mesh has no other boundary.
    """
    start, stop = directed_edges(mesh.faces)[mesh.twins < 0].T
    ahead = np.full(len(mesh.vertices), -1)
    ahead[start] = stop
    second = ahead[start]
    third = ahead[second]
    once = np.bincount(start, minlength=len(ahead)) == 1  # where parts touch nothing is clear
    around = (ahead[third] == start) & once[start] & once[second] & once[third] & (start < np.minimum(second, third))
    if 3 * int(around.sum()) == len(start):
        return np.empty((0, 3), np.intp)
    return np.stack([start, third, second], axis=1)[around]
