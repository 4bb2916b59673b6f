"""Necks: where the loop around what sticks out of a surface is shortest, as between a head and its body.

The extremities are the minima of a Green's function: the potential of a source at one point, drained evenly from the
surface. Away from its pole it has no maximum (its Laplacian is positive there), so what lies above a level is one
piece around the pole, and grows from the pole on. From each extremity's own pole the levels are followed over the
surface; where their length has a minimum there is a neck, and the cut of least length between the levels where it is
longest on either side, by maximum flow and minimum cut (Ford and Fulkerson 1956), is the shortest loop there is around
it along edges. To find extremities and follow levels around them is the idea of Zhang, Mischaikow and Turk,
"Feature-based surface parameterization and texture mapping" (2005), there with geodesic distances.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_flow

from .cholesky import factorised
from .intrinsic_delaunay import IntrinsicTriangulation, edge_weights, intrinsic_delaunay, non_negative_laplacian
from .laplacian import mollified_lengths
from .mesh import Booleans, Floats, TriangleMesh

LEVELS = 80
"""Levels followed from each extremity, evenly in the logarithm of the area above them: 6 % from one to the next."""

SMALLEST, LARGEST = 0.01, 0.95
"""Shares of the area between which a piece is worth cutting off: a hand is 0.02 of a body, a finger 0.005."""

NARROW = np.pi
"""Squared length of the loop over the area beyond it: that of a tube as long as its radius, closed by half a sphere.
Half a sphere alone has twice as much; a head, hand or foot at its neck has 0.5 to 1."""

CONSTRICTED = 1.2
"""Times by which levels on both sides of a neck are longer. Along two bodies necks have 2.0 to 2.6, wrists 2.3 to 2.7,
ankles and waists 1.3 to 1.7; what comes of muscles and of the course of the mesh stays below 1.2."""

SAME = 0.8
"""Share of the area that two pieces have in common, of what they have together, from which on they are one."""

MOST_TIPS = 64
"""Extremities followed, lowest first: a body has 20 with its fingers, toes, ears and mouth."""

PRECISION = 1 << 20
"""Steps in which capacities, which are integers, tell the length of the longest edge."""


@dataclass(frozen=True, eq=False)
class Neck:
    """A piece of a surface that hangs on it by a neck.

    Attributes
    ----------
    beyond : (m,) bool
        The faces beyond the neck.
    length : float
        Of the loop around it, in the mesh's length unit.
    share : float
        Of the surface's area, what lies beyond.
    shortest : bool
        Whether it is the shortest loop around; else one beside it.
    """

    beyond: Booleans
    length: float
    share: float
    shortest: bool = True


def necks(mesh: TriangleMesh, wide: float | None = None) -> tuple[Neck, ...]:
    """Return the necks of a manifold surface in one part, largest pieces first.

    It may be closed or have a boundary, which counts for nothing in the length of a loop.

    Parameters
    ----------
    mesh : TriangleMesh
    wide : float, optional
        Squared length of a loop over the area beyond it: around each neck also the loops next to the shortest, to
        either side, that are as wide as that. Discs of pieces that are cut at different places of a neck differ by no
        Möbius transformation, and a tube as long as its radius makes them differ by a factor of e.
    """
    potential = _Potential(mesh)
    found: list[Neck] = []
    beside: list[Neck] = []
    for tip in potential.tips():
        for neck, others in _along(mesh, potential.from_pole(tip), potential.areas, tip, wide, found):
            if not any(_alike(mesh, neck, other) for other in found):
                found.append(neck)
                beside += others
    return tuple(sorted(found + beside, key=lambda neck: -neck.share))


def _alike(mesh: TriangleMesh, one: Neck, other: Neck) -> bool:
    both = mesh.face_areas[one.beyond & other.beyond].sum()
    return bool(both > SAME * mesh.face_areas[one.beyond | other.beyond].sum())


class _Potential:
    """Green's functions of the Laplacian on a surface, drained evenly: any number of poles, one factorisation."""

    def __init__(self, mesh: TriangleMesh) -> None:
        sides = mollified_lengths(mesh.edge_lengths)
        surface = intrinsic_delaunay(IntrinsicTriangulation(mesh.faces, sides, mesh.twins, len(mesh.vertices)))
        self.areas = surface.vertex_areas
        self.used = np.flatnonzero(mesh.used)
        first, second, _ = edge_weights(surface)
        self.links = first[first != second], second[first != second]
        # the potential has no zero of its own: it is set to 0 at the first vertex
        inner = non_negative_laplacian(surface)[self.used[1:]][:, self.used[1:]]
        self.solve: Callable[[Floats], Floats] = factorised(csc_array(inner))

    def from_pole(self, pole: int) -> Floats:
        """Return the potential, (n,), of a unit source at a vertex."""
        right = -self.areas / self.areas.sum()
        right[pole] += 1
        result = np.zeros(len(right))
        result[self.used[1:]] = self.solve(right[self.used[1:]])
        return result

    def tips(self) -> list[int]:
        """Return the extremities: the minima of the potential as seen from the one that is farthest from the others."""
        pole = int(self.used[0])
        for _ in range(2):  # from anywhere to an extremity, and to the one opposite
            pole = int(self.used[np.argmin(self.from_pole(pole)[self.used])])
        value = self.from_pole(pole)
        low = np.zeros(len(value), bool)
        low[self.used] = True
        for one, other in (self.links, self.links[::-1]):
            low[one[value[one] >= value[other]]] = False
        minima = np.flatnonzero(low)
        return [pole, *minima[np.argsort(value[minima], kind="stable")][: MOST_TIPS - 1].tolist()]


def _along(
    mesh: TriangleMesh, value: Floats, areas: Floats, tip: int, wide: float | None, known: list[Neck]
) -> list[tuple[Neck, list[Neck]]]:
    """Return the necks passed on the way from a tip, the pole of a potential, (n,), and the loops beside each.

    Those are left out that were passed on the way from another tip, as a wrist is from each finger.
    """
    at_tip = int(np.flatnonzero((mesh.faces == tip).any(axis=1))[0])
    passed = np.array([neck.share for neck in known if neck.beyond[at_tip]])
    order = np.flatnonzero(mesh.used)
    order = order[np.argsort(-value[order], kind="stable")]
    share = np.cumsum(areas[order]) / areas.sum()
    shares = np.geomspace(SMALLEST, LARGEST, LEVELS)
    levels = value[order[np.minimum(np.searchsorted(share, shares), len(order) - 1)]]
    lengths = np.array([_level_length(mesh, value, float(level)) for level in levels])
    width = lengths**2 / (shares * mesh.area)
    corner = value[mesh.faces]
    found: list[tuple[Neck, list[Neck]]] = []
    for low, inner, outer in _dips(lengths):
        if width[low] > NARROW or (np.abs(passed - shares[low]) < (1 - SAME) * shares[low]).any():
            continue
        neck = _shortest(mesh, corner, float(levels[inner]), float(levels[outer]), tip)
        if neck is None or neck.length**2 > NARROW * neck.share * mesh.area:
            continue
        beside: list[int] = []
        if wide is not None:
            beside += (low - 1 - np.flatnonzero(width[max(inner, 1) : low][::-1] >= wide)[:1]).tolist()
            beside += (low + 1 + np.flatnonzero(width[low + 1 : min(outer + 1, LEVELS - 1)] >= wide)[:1]).tolist()
        # between the next levels, or the loop would follow every jag of the mesh
        pieces = [_shortest(mesh, corner, float(levels[k - 1]), float(levels[k + 1]), tip) for k in beside]
        found.append((neck, [replace(piece, shortest=False) for piece in pieces if piece is not None]))
    return found


def _dips(lengths: Floats) -> list[tuple[int, int, int]]:
    """Return the minima of a sequence that is `CONSTRICTED` times as high on both sides: where, and where it is that.

    >>> _dips(np.array([1.0, 3.0, 2.0, 1.0, 2.0, 1.9, 4.0]))
    [(3, 1, 6)]
    """
    found: list[tuple[int, int, int]] = []
    for k in range(1, len(lengths) - 1):
        if lengths[k] > lengths[k - 1] or lengths[k] >= lengths[k + 1]:
            continue
        lower = np.flatnonzero(lengths < lengths[k])
        before, after = lower[lower < k], lower[lower > k]
        start = int(before[-1]) + 1 if before.size else 0
        stop = int(after[0]) if after.size else len(lengths)
        inner, outer = start + int(np.argmax(lengths[start:k])), k + int(np.argmax(lengths[k:stop]))
        if min(lengths[inner], lengths[outer]) > CONSTRICTED * lengths[k]:
            found.append((k, inner, outer))
    return found


def _level_length(mesh: TriangleMesh, value: Floats, level: float) -> float:
    """Return the length of the line on which values, (n,), linear in each triangle, are at a level."""
    above = value[mesh.faces] > level
    count = above.sum(axis=1)
    crossed = np.flatnonzero((count == 1) | (count == 2))
    faces, above = mesh.faces[crossed], above[crossed]
    alone = np.where(above.sum(axis=1) == 1, np.argmax(above, axis=1), np.argmin(above, axis=1))
    row = np.arange(len(crossed))
    apex = faces[row, alone]
    ends = []
    for step in (1, 2):
        other = faces[row, (alone + step) % 3]
        along = (level - value[apex]) / (value[other] - value[apex])
        ends.append(mesh.vertices[apex] + along[:, None] * (mesh.vertices[other] - mesh.vertices[apex]))
    return float(np.sqrt(((ends[0] - ends[1]) ** 2).sum(axis=1)).sum())


def _shortest(mesh: TriangleMesh, corner: Floats, inner: float, outer: float, tip: int) -> Neck | None:
    """Return the shortest cut between what lies above a level and what lies below another; None if that is no piece.

    `corner`, (m, 3), are the values at the corners of the faces.
    """
    mean = corner.mean(axis=1)
    inside, outside = mean >= inner, mean <= outer
    band = np.flatnonzero(~inside & ~outside)
    if not (inside.any() and outside.any() and band.size):
        return None
    # nodes: 0 what is inside for sure, 1 what is outside, then the faces between
    node = np.where(inside, 0, 1)
    node[band] = 2 + np.arange(len(band))
    sides = np.flatnonzero(mesh.twins > np.arange(len(mesh.twins)))
    one, other = node[sides // 3], node[mesh.twins[sides] // 3]
    differ = one != other
    one, other, sides = one[differ], other[differ], sides[differ]
    length = mesh.edge_lengths.ravel()[sides]
    capacity = np.maximum(np.rint(length / length.max() * PRECISION), 1)
    count = 2 + len(band)
    ends = np.concatenate([one, other]).astype(np.int32), np.concatenate([other, one]).astype(np.int32)
    summed = csr_array(coo_array((np.concatenate([capacity, capacity]), ends), shape=(count, count)))
    summed.data = np.minimum(summed.data, np.iinfo(np.int32).max)  # no cut crosses what is that wide
    network = csr_array((summed.data.astype(np.int32), summed.indices, summed.indptr), shape=summed.shape)
    left = csr_array(network - maximum_flow(network, 0, 1).flow)
    left.eliminate_zeros()
    reached = np.zeros(count, bool)
    reached[breadth_first_order(left, 0, return_predecessors=False)] = True
    neck = _piece(mesh, reached[node], tip)
    return neck if SMALLEST <= neck.share <= LARGEST else None


def _piece(mesh: TriangleMesh, chosen: Booleans, tip: int) -> Neck:
    """Return the piece around a vertex of chosen faces, (m,)."""
    beyond = _around(mesh, chosen, tip)
    paired = np.flatnonzero(mesh.twins >= 0)
    cut = paired[beyond[paired // 3] & ~beyond[mesh.twins[paired] // 3]]
    length = float(mesh.edge_lengths.ravel()[cut].sum())
    return Neck(beyond, length, float(mesh.face_areas[beyond].sum()) / mesh.area)


def _around(mesh: TriangleMesh, chosen: Booleans, tip: int) -> Booleans:
    """Return the connected part of chosen faces, (m,), that is around a vertex."""
    paired = np.flatnonzero(mesh.twins >= 0)
    left, right = paired // 3, mesh.twins[paired] // 3
    same = chosen[left] == chosen[right]
    count = len(mesh.faces)
    links = coo_array((np.ones(int(same.sum()), np.int8), (left[same], right[same])), shape=(count, count))
    label = connected_components(links, directed=False)[1]
    return label == label[int(np.flatnonzero((mesh.faces == tip).any(axis=1))[0])]
