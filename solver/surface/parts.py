"""The parts that a mesh falls into: eyeballs, teeth, lashes, cards of hair beside a skin, each as a mesh of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .gluing import Glue, glue_of, sides_to_turn, vertices_of_glue
from .joining import coinciding
from .kept import kept
from .mesh import Booleans, Floats, Integers, TriangleMesh, twin_sides
from .numbers import computable
from .tidy import Cleaned


@dataclass(frozen=True, eq=False)
class Part:
    """One part as a mesh of its own.

    Attributes
    ----------
    mesh : TriangleMesh
        With the vertices of this part only.
    faces : (k,) int
        Its faces among those of the whole mesh.
    reversed : (k,) bool
        Faces whose second and third corners changed places, so that all of the part face one side.
    vertices, rows : (q,) int, (q,) int
        Vertices of the whole mesh that are in it, and which of its own each one is.
    """

    mesh: TriangleMesh
    faces: Integers
    reversed: Booleans
    vertices: Integers
    rows: Integers

    def turned(self) -> Part:
        """Return it with all faces turned round."""
        mesh = TriangleMesh(self.mesh.vertices, self.mesh.faces[:, [0, 2, 1]], self.mesh.name)
        return Part(mesh, self.faces, ~self.reversed, self.vertices, self.rows)

    def in_own_corners(self, face: Integers, barycentric: Floats) -> tuple[Integers, Floats]:
        """Return points of it, (q,) and (q, 3), as points of the whole mesh."""
        turned = self.reversed[face]
        return self.faces[face], np.where(turned[:, None], barycentric[:, [0, 2, 1]], barycentric)


@dataclass(frozen=True, eq=False)
class Parts:
    """The parts of a mesh, the main one first, the others by falling area.

    Attributes
    ----------
    mesh : TriangleMesh
        As it came; moved and scaled where arithmetic needs that.
    of_face : (m,) int
        The part of each face; -1: a face that uses a vertex twice.
    of_vertex : (n,) int
        The part of each vertex: of several the first; -1 in no part.
    area : (p,) float64
        Of each part.
    """

    mesh: TriangleMesh
    of_face: Integers
    of_vertex: Integers
    area: Floats
    _faces: Integers
    _reversed: Booleans
    _vertex_of: Integers
    _place: Floats

    def __len__(self) -> int:
        return len(self.area)

    @staticmethod
    def of(original: TriangleMesh, main: Cleaned, keys: Floats | None = None) -> Parts:
        """Find the parts of a mesh beside the one that was put in order.

        Faces hang together across the edges that they share. Edges that merely coincide join parts only if they do so
        within the main part: a file cuts all surfaces open along seams or none, and parts that touch are not one.

        Parameters
        ----------
        original : TriangleMesh
        main : Cleaned
            Its main part in order.
        keys : (n, d) float64, optional
            As for `surface.cleaned`.
        """
        mesh = computable(original)[0]
        good = np.flatnonzero((mesh.faces != mesh.faces[:, [1, 2, 0]]).all(axis=1))
        faces = mesh.faces[good]
        if len(good) == len(mesh.faces):
            edge, twins = mesh.edge_of_side, mesh.twins
        else:
            whole = TriangleMesh(mesh.vertices, faces)
            edge, twins = whole.edge_of_side, whole.twins
        glue = glue_of(faces, twins)
        order = np.argsort(edge, kind="stable")
        beside = edge[order[1:]] == edge[order[:-1]]
        everywhere = Glue(order[1:][beside], order[:-1][beside], np.ones(int(beside.sum()), bool))
        label = everywhere.parts(len(faces))
        is_main = np.zeros(len(mesh.faces), bool)
        is_main[main.faces] = True
        if _joined(main, mesh.faces, label, is_main[good]):
            glue = glue.with_others(coinciding(mesh.vertices, faces, glue, keys))
            label = everywhere.with_others(glue).parts(len(faces))
        area = mesh.face_areas[good]
        size = np.bincount(label, area)
        in_main = np.bincount(label, is_main[good]) > 0
        label = np.where(in_main[label], len(size), label)
        size = np.bincount(label, area, len(size) + 1)
        size[-1] = np.inf
        there = np.flatnonzero(np.bincount(label, minlength=len(size)))
        rank = np.full(len(size), -1)
        rank[there[np.argsort(-size[there], kind="stable")]] = np.arange(len(there))
        of_face = np.full(len(mesh.faces), -1)
        of_face[good] = label = rank[label]
        of_vertex = np.full(len(mesh.vertices), len(there))
        np.minimum.at(of_vertex, faces.ravel(), np.repeat(label, 3))
        of_vertex[of_vertex == len(there)] = -1
        turned = np.zeros(len(mesh.faces), bool)
        turned[good] = sides_to_turn(glue, area)
        named, vertex_of, origin = vertices_of_glue(faces, glue, len(mesh.vertices))
        welded = mesh.faces.copy()
        welded[good] = named
        return Parts(
            mesh,
            of_face,
            of_vertex,
            np.bincount(label, area).astype(np.float64),
            np.where(turned[:, None], welded[:, [0, 2, 1]], welded),
            turned,
            vertex_of,
            mesh.vertices[origin],
        )

    @kept
    def _sorted(self) -> tuple[Integers, Integers]:
        """The faces by parts, and where each part begins among them."""
        order = np.argsort(self.of_face, kind="stable")
        return order, np.searchsorted(self.of_face[order], np.arange(len(self) + 1))

    def part(self, number: int) -> Part:
        """Return one of them as a mesh of its own, closed ones with their faces turned outward."""
        order, start = self._sorted
        faces = order[start[number] : start[number + 1]]
        own, local = np.unique(self._faces[faces], return_inverse=True)
        local = local.reshape(-1, 3)
        original = np.unique(self.mesh.faces[faces])
        # a vertex in which parts touch is another one in each of them
        rows = np.searchsorted(own, self._vertex_of[original])
        here = own[np.minimum(rows, len(own) - 1)] == self._vertex_of[original]
        mesh = TriangleMesh(self._place[own], local, f"{self.mesh.name}, part {number}")
        part = Part(mesh, faces, self._reversed[faces], original[here], rows[here])
        closed = bool((mesh.twins >= 0).all())
        middle = mesh.vertices - mesh.vertices.mean(axis=0)
        inside_out = closed and np.einsum("mi,mi->", mesh.face_vectors, middle[mesh.faces[:, 0]]) < 0
        return part.turned() if inside_out else part

    @kept
    def moments(self) -> tuple[Floats, Floats]:
        """Centre of the surface, (p, 3), and covariance about it, (p, 3, 3), of each part, by area.

        Exact: of the integral of x x^T over a triangle of area A with corners v and their sum s, which is
        A/12 (sum v v^T + s s^T).
        """
        good = self.of_face >= 0
        label = self.of_face[good]
        # faces without area count alike where there are no others
        weight = np.where(self.area[label] > 0, self.mesh.face_areas[good], 1.0)
        total = np.bincount(label, weight, len(self))[:, None]

        def means(values: Floats) -> Floats:
            return np.stack([np.bincount(label, weight * column, len(self)) for column in values.T], axis=1) / total

        corner = self.mesh.vertices[self.mesh.faces[good]]
        centre = means(corner.mean(axis=1))
        corner = corner - centre[label, None]
        along = corner.sum(axis=1)
        square = np.einsum("mki,mkj->mij", corner, corner) + along[:, :, None] * along[:, None, :]
        return centre, means(square.reshape(-1, 9) / 12).reshape(-1, 3, 3)

    @kept
    def shape(self) -> Integers:
        """Euler characteristic, and whether it has a boundary, of each part: (p, 2)."""
        good = np.flatnonzero(self.of_face >= 0)
        label, faces = self.of_face[good], self._faces[good]
        count = len(self._place)
        vertices = np.unique(np.repeat(label, 3) * count + faces.ravel()) // count
        whole = TriangleMesh(self._place, faces)
        single = twin_sides(whole.edge_of_side) < 0
        edges = np.zeros(len(whole.edges), np.intp)
        edges[whole.edge_of_side] = np.repeat(label, 3)
        euler = (
            np.bincount(vertices, minlength=len(self))
            - np.bincount(edges, minlength=len(self))
            + np.bincount(label, minlength=len(self))
        )
        rim = np.bincount(np.repeat(label, 3)[single], minlength=len(self))
        return np.stack([euler, (rim > 0).astype(np.intp)], axis=1)


def _joined(main: Cleaned, faces: Integers, label: Integers, chosen: Booleans) -> bool:
    """Return whether edges that coincide were joined in the main part, (m,) `chosen` of the faces in pieces `label`."""
    if not main.changes:
        return False
    if len(np.unique(label[chosen])) > 1:
        return True
    used = np.unique(faces[main.faces])
    return len(np.unique(main.vertex_of[used])) < len(used)
