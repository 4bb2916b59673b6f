"""Triangle meshes as two arrays, with the geometry that every later stage reads from them."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import blake2b
from typing import Any

import numpy as np
import numpy.typing as npt

from .kept import kept

Floats = npt.NDArray[np.float64]

Integers = npt.NDArray[np.intp]

Booleans = npt.NDArray[np.bool_]

Complexes = npt.NDArray[np.complex128]

Places = npt.NDArray[Any]
"""Points of a parameter domain: (n,) complex128 in the disc, (n, 3) float64 on the sphere."""


class MeshError(ValueError):
    """A mesh cannot be used as it is; the text is one sentence that begins with the mesh's quoted name."""


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """An indexed triangle mesh.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions in any length unit.
    faces : (m, 3) integer
        Vertex indices of each triangle, counter-clockwise seen from outside.
    name : str
        What error messages call the mesh.

    Raises
    ------
    MeshError
        Wrong shapes, no vertices or faces, a position that is not finite, an index out of range.

    Examples
    --------
    >>> TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).area
    0.5
    """

    vertices: Floats
    faces: Integers
    name: str = "mesh"

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        faces = np.asarray(self.faces)
        if vertices.size == 0:
            raise MeshError(f"'{self.name}' has no vertices")
        if faces.size == 0:
            raise MeshError(f"'{self.name}' has no faces")
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise MeshError(f"'{self.name}' needs vertices of shape (n, 3), not {vertices.shape}")
        if faces.ndim != 2 or faces.shape[1] != 3 or not np.issubdtype(faces.dtype, np.integer):
            raise MeshError(f"'{self.name}' needs integer faces of shape (m, 3), not {faces.dtype} {faces.shape}")
        bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
        if bad.size:
            raise MeshError(
                f"'{self.name}' has {plural(bad.size, 'vertex')} whose position is not a finite "
                f"number (the first is vertex {bad[0]}): delete or repair {'it' if bad.size == 1 else 'them'}"
            )
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise MeshError(
                f"'{self.name}' has faces that name vertices outside 0 to {len(vertices) - 1}: the file is damaged"
            )
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", np.ascontiguousarray(faces, dtype=np.intp))

    def moved(self, vertices: Floats) -> TriangleMesh:
        """Return the mesh with its vertices, (n, 3), elsewhere; what is known of its edges stays known."""
        result = TriangleMesh(vertices, self.faces, self.name)
        known = ("_edges_of_sides", "twins", "used")
        result.__dict__.update({name: self.__dict__[name] for name in known if name in self.__dict__})
        return result

    @property
    def neighbours(self) -> Integers:
        """The face across the side opposite each corner, (m, 3); -1 where there is none, or several."""
        return np.where(self.twins < 0, -1, self.twins // 3).reshape(-1, 3)

    @kept
    def fingerprint(self) -> str:
        """32 hexadecimal digits of the positions and faces, in their order; the same on every platform.

        Notes
        -----
        Meshes with the same numbers have the same fingerprint, whatever their name and whichever types the arrays had:
        blake2b over the two lengths, then positions as little-endian float64, then faces as little-endian int64. A
        position of -0.0 counts as 0.0.
        """
        digest = blake2b(np.array([len(self.vertices), len(self.faces)], "<i8").tobytes(), digest_size=16)
        digest.update((self.vertices + 0.0).astype("<f8", copy=False).tobytes())  # -0.0 + 0.0 is 0.0
        digest.update(self.faces.astype("<i8", copy=False).tobytes())
        return digest.hexdigest()

    @kept
    def face_vectors(self) -> Floats:
        """Cross product of two sides per face, (m, 3): the face normal times twice the area."""
        a = self.vertices[self.faces[:, 0]]
        (ux, uy, uz), (vx, vy, vz) = ((self.vertices[self.faces[:, k]] - a).T for k in (1, 2))
        return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1)

    @kept
    def face_areas(self) -> Floats:
        """Area of each face, (m,), in squared length units."""
        return 0.5 * np.sqrt((self.face_vectors**2).sum(axis=1))

    @kept
    def area(self) -> float:
        """Area of the surface, in squared length units."""
        return float(self.face_areas.sum())

    @kept
    def vertex_areas(self) -> Floats:
        """Barycentric dual area of each vertex, (n,): a third of the faces around it."""
        third = np.repeat(self.face_areas / 3, 3)
        return np.bincount(self.faces.ravel(), third, len(self.vertices)).astype(np.float64, copy=False)

    @kept
    def used(self) -> Booleans:
        """Whether each vertex is in a face, (n,)."""
        used = np.zeros(len(self.vertices), bool)
        used[self.faces] = True
        return used

    @kept
    def edge_lengths(self) -> Floats:
        """Length of the side opposite each corner, (m, 3), in length units."""
        low, high = self.edges.T
        difference = self.vertices[low] - self.vertices[high]
        length: Floats = np.sqrt((difference**2).sum(axis=1))
        return length[self.edge_of_side].reshape(-1, 3)

    @property
    def edges(self) -> Integers:
        """Undirected edges, (e, 2), each once, smaller index first."""
        return self._edges_of_sides[0]

    @property
    def edge_of_side(self) -> Integers:
        """Row in `edges` of each side, (3 m,); side 3 f + k is opposite corner k of face f."""
        return self._edges_of_sides[1]

    @kept
    def _edges_of_sides(self) -> tuple[Integers, Integers]:
        return edges_of_sides(self.faces, len(self.vertices))

    @kept
    def twins(self) -> Integers:
        """The other side of each side's edge, (3 m,); -1 where the edge has one side, or more than two."""
        return twin_sides(self.edge_of_side)

    @property
    def diagonal(self) -> float:
        """Length of the bounding box diagonal of the vertices in use, in length units."""
        return float(np.linalg.norm(np.ptp(self.vertices[self.used], axis=0)))

    def vertex_normals(self) -> Floats:
        """Unit normal of each vertex, (n, 3), area weighted; zero at vertices in no face."""
        total = np.stack(
            [
                np.bincount(self.faces.ravel(), np.repeat(component, 3), minlength=len(self.vertices))
                for component in self.face_vectors.T
            ],
            axis=1,
        )
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return np.divide(total, length, out=np.zeros_like(total), where=length > 0)


def directed_edges(faces: Integers) -> Integers:
    """Return the three sides of each face in its own direction, (3 m, 2); row 3 f + k is opposite corner k.

    >>> directed_edges(np.array([[7, 8, 9]])).tolist()
    [[8, 9], [9, 7], [7, 8]]
    """
    return np.stack([faces[:, [1, 2, 0]], faces[:, [2, 0, 1]]], axis=2).reshape(-1, 2)


def edges_of_sides(faces: Integers, vertex_count: int) -> tuple[Integers, Integers]:
    """Return undirected edges, (e, 2), each once, sorted, and the edge of each side in `directed_edges`, (3 m,)."""
    keys = _edge_keys(faces, vertex_count)
    # as np.unique does, but for the stable order, which takes half the time on numbers that lie nearly in order
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    first = np.ones(len(keys), bool)
    first[1:] = keys[1:] != keys[:-1]
    edge_of_side = np.empty(len(keys), np.intp)
    edge_of_side[order] = np.cumsum(first) - 1
    return np.stack(np.divmod(keys[first], vertex_count), axis=1), edge_of_side


def _edge_keys(faces: Integers, vertex_count: int) -> Integers:
    start, stop = directed_edges(faces).T
    return np.minimum(start, stop) * vertex_count + np.maximum(start, stop)


def twin_sides(edge_of_side: Integers) -> Integers:
    """Return the other side of each side's edge, (3 m,); -1 where the edge has one side, or more than two.

    >>> twin_sides(edges_of_sides(np.array([[0, 1, 2], [2, 1, 3]]), 4)[1]).tolist()
    [5, -1, -1, -1, -1, 0]
    """
    side = np.arange(len(edge_of_side))
    both = np.bincount(edge_of_side, side).astype(np.intp)[edge_of_side]
    return np.where(np.bincount(edge_of_side)[edge_of_side] == 2, both - side, -1)


def plural(number: int, noun: str) -> str:
    """Return the number with its noun: '1 face', '2,000 vertices'.

    >>> plural(1, "face"), plural(2000, "vertex")
    ('1 face', '2,000 vertices')
    """
    if number == 1:
        return f"1 {noun}"
    return f"{number:,} {noun[:-2] + 'ices' if noun.endswith('vertex') else noun + 's'}"


def first_corners(faces: Integers, vertex_count: int) -> tuple[Integers, Integers]:
    """Return the vertices in use, (k,), and for each the first corner of the faces, (m, 3), that it is.

    >>> first_corners(np.array([[3, 1, 0], [1, 3, 4]]), 5)
    (array([0, 1, 3, 4]), array([2, 1, 0, 5]))
    """
    first = np.full(vertex_count, -1)
    corners = faces.ravel()[::-1]
    first[corners] = np.arange(len(corners) - 1, -1, -1)  # of several writes the last one stays
    used = np.flatnonzero(first >= 0)
    return used, first[used]


def face_neighbours(faces: Integers, vertex_count: int) -> Integers:
    """Return the face across the side opposite each corner, (m, 3), -1 on the boundary, of a manifold mesh."""
    sides = directed_edges(faces)
    key = sides.min(axis=1) * vertex_count + sides.max(axis=1)
    order = np.argsort(key, kind="stable")
    twin = np.flatnonzero(key[order][1:] == key[order][:-1])
    result = np.full(len(sides), -1)
    left, right = order[twin], order[twin + 1]
    result[left], result[right] = right // 3, left // 3
    return result.reshape(-1, 3)
