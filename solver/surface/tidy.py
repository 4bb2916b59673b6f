"""A mesh in order, and how what is computed on it is told on the mesh as it came."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from .gluing import glue_of, vertices_of_glue
from .mesh import Booleans, Floats, Integers, MeshError, TriangleMesh

Value = TypeVar("Value", bound=np.generic)


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A mesh in order and how its faces and vertices relate to those of the mesh it came from.

    Attributes
    ----------
    mesh : TriangleMesh
        The original itself where there was nothing to do. Its first vertices are the original's, in use or not, so that
        their numbers keep their meaning; further ones are where a vertex of the original has become several.
    faces : (m,) int
        The original face that each face was.
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
        result[self.faces] = own
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


def piece_within(tidy: Cleaned, inside: Booleans) -> Cleaned:
    """Return the largest piece of a mesh in order that lies among some of the original's vertices, (n_original,).

    Raises
    ------
    MeshError
        No face does.
    """
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
