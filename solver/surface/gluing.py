"""A surface as triangles glued along pairs of sides: which corners are one vertex follows from that.

So vertices that a file repeats become one where their sides are glued, and one vertex in which parts merely touch
becomes several.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .mesh import Booleans, Floats, Integers


@dataclass(frozen=True, eq=False)
class Glue:
    """Pairs of sides, as `directed_edges` numbers them, that are one edge.

    Attributes
    ----------
    left, right : (p,) int
        The two sides of each pair.
    opposed : (p,) bool
        Whether the two run in opposite directions, as those of faces that agree about the outside do.
    """

    left: Integers
    right: Integers
    opposed: Booleans

    def with_others(self, others: Glue) -> Glue:
        """Return both."""
        return Glue(
            np.concatenate([self.left, others.left]),
            np.concatenate([self.right, others.right]),
            np.concatenate([self.opposed, others.opposed]),
        )

    def without(self, sides: Integers) -> Glue:
        """Return the pairs that have none of the sides."""
        cut = np.zeros(1 + max(self.left.max(initial=0), self.right.max(initial=0), sides.max(initial=0)), bool)
        cut[sides] = True
        kept = ~(cut[self.left] | cut[self.right])
        return Glue(self.left[kept], self.right[kept], self.opposed[kept])

    def single_sides(self, face_count: int) -> Integers:
        """Return the sides in no pair: those of the boundary."""
        single = np.ones(3 * face_count, bool)
        single[self.left] = single[self.right] = False
        return np.flatnonzero(single)

    def among(self, chosen: Booleans) -> Glue:
        """Return the glue of the chosen faces, (m,), alone, with their numbers among each other."""
        place = np.cumsum(chosen) - 1
        inside = chosen[self.left // 3] & chosen[self.right // 3]
        left, right = self.left[inside], self.right[inside]
        return Glue(3 * place[left // 3] + left % 3, 3 * place[right // 3] + right % 3, self.opposed[inside])

    def parts(self, face_count: int) -> Integers:
        """Return the number of the part that each face is in, (m,)."""
        links = (self.left // 3, self.right // 3)
        graph = coo_array((np.ones(len(self.left), np.int8), links), shape=(face_count, face_count))
        return connected_components(graph, directed=False)[1].astype(np.intp)


def glue_of(faces: Integers, twins: Integers) -> Glue:
    """Return the pairs of sides that `twins`, (3 m,), names."""
    left = np.flatnonzero(twins > np.arange(len(twins)))
    right = twins[left]
    start = starts(faces)
    return Glue(left, right, start[left] != start[right])


def starts(faces: Integers) -> Integers:
    """Return the vertex that each side begins at, (3 m,)."""
    return faces[:, [1, 2, 0]].ravel()


def stops(faces: Integers) -> Integers:
    """Return the vertex that each side ends at, (3 m,)."""
    return faces[:, [2, 0, 1]].ravel()


def turned_glue(glue: Glue, turned: Booleans) -> Glue:
    """Return the same glue after the second and third corners of the faces `turned`, (m,), changed places."""

    def place(side: Integers) -> Integers:
        face, k = np.divmod(side, 3)
        return np.where(turned[face], 3 * face + np.array([0, 2, 1])[k], side)

    opposed = glue.opposed ^ turned[glue.left // 3] ^ turned[glue.right // 3]
    return Glue(place(glue.left), place(glue.right), opposed)


def vertices_of_glue(faces: Integers, glue: Glue, vertex_count: int) -> tuple[Integers, Integers, Integers]:
    """Return the faces, (m, 3), with the vertices that the glue makes, and how these relate to the old ones.

    A vertex that stays whole keeps its number. Of several that become one the first number stays; of one that becomes
    several the largest fan of faces keeps the number, and the others get new ones after all old.

    Returns
    -------
    faces : (m, 3) int
    vertex_of : (n,) int
        The new vertex of each old one; -1 for vertices in no face.
    origin : (n_new,) int
        An old vertex of each new one; for the first n themselves.
    """
    fan = _fans(len(faces), glue)
    old = faces.ravel()
    size = np.bincount(fan)
    # the largest fan of each old vertex; of equal ones the first
    best = np.full(vertex_count, -1)
    order = np.lexsort((-fan, size[fan]))
    best[old[order]] = fan[order]
    name = np.full(len(size), -1)
    used = np.flatnonzero(best >= 0)[::-1]
    name[best[used]] = used  # the first vertex is written last
    nameless = np.flatnonzero(name < 0)
    name[nameless] = vertex_count + np.arange(len(nameless))
    a_corner = np.empty(len(size), np.intp)
    a_corner[fan[::-1]] = np.arange(len(fan))[::-1]
    origin = np.concatenate([np.arange(vertex_count), old[a_corner[nameless]]])
    vertex_of = np.where(best >= 0, name[best], -1)
    return name[fan].reshape(-1, 3), vertex_of, origin


def shape_of(face_count: int, glue: Glue) -> tuple[int, int]:
    """Return the number of boundary loops and of handles of a surface in one part."""
    fan = _fans(face_count, glue)
    corner = np.arange(3 * face_count).reshape(-1, 3)
    rim = glue.single_sides(face_count)
    start, stop = fan[starts(corner)[rim]], fan[stops(corner)[rim]]
    count = int(fan.max()) + 1
    around = coo_array((np.ones(len(rim), np.int8), (start, stop)), shape=(count, count))
    loops = len(np.unique(connected_components(around, directed=False)[1][start]))
    euler = count - (3 * face_count - len(glue.left)) + face_count
    return loops, (2 - loops - euler) // 2


def _fans(face_count: int, glue: Glue) -> Integers:
    """Label each corner, (3 m,), so that those agree which glued sides bring together."""
    corner = np.arange(3 * face_count).reshape(-1, 3)
    start, stop = starts(corner), stops(corner)
    begin, end = start[glue.right], stop[glue.right]
    links = (
        np.concatenate([start[glue.left], stop[glue.left]]),
        np.concatenate([np.where(glue.opposed, end, begin), np.where(glue.opposed, begin, end)]),
    )
    graph = coo_array((np.ones(len(links[0]), np.int8), links), shape=(corner.size, corner.size))
    return connected_components(graph, directed=False)[1].astype(np.intp)


def sides_to_turn(glue: Glue, areas: Floats) -> Booleans:
    """Return which faces, (m,), to turn so that neighbours agree: in each part those with less area.

    Each face exists in both orientations; neighbours that agree connect like with like, others crosswise. A part that
    can be oriented falls into two components, one with every face turned; a Möbius strip does not, and stays as it is.
    """
    m = len(areas)
    if glue.opposed.all():
        return np.zeros(m, bool)
    left, right = glue.left // 3, glue.right // 3
    across, back = np.where(glue.opposed, right, right + m), np.where(glue.opposed, right + m, right)
    links = np.concatenate([left, left + m]), np.concatenate([across, back])
    graph = coo_array((np.ones(len(links[0]), np.int8), links), shape=(2 * m, 2 * m))
    label = connected_components(graph, directed=False)[1]
    one_sided = label[:m] == label[m:]
    as_is = np.bincount(label, np.concatenate([areas, np.zeros(m)]))
    # equal areas: the first face of a part stays
    tie = np.isclose(as_is[label[:m]], as_is[label[m:]], rtol=1e-12)
    turned = np.where(tie, label[:m] > label[m:], as_is[label[:m]] < as_is[label[m:]])
    return turned & ~one_sided
