"""Displacements carried by their gradients: how the source's triangles deform, the target's do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from ..surface.cholesky import factorised
from ..surface.laplacian import cotangent_laplacian, cotangents, mollified_lengths
from ..surface.mesh import Booleans, Floats, Integers, TriangleMesh, directed_edges
from .correspond import Correspondence
from .frames import local_similarities, nearest_orthogonal
from .parts import pieces
from .riders import Riders

REACH = 0.02
"""Length up to which gradients count more than the displacement itself, in square roots of the target's area.

On one pair of heads of one template (MPFB, woman to man) 0.02 errs least of 0.02, 0.1 and 0.5; where two faces differ
in proportions a longer one adds up their differences, and a shorter one copies displacements point by point."""

AROUND = 0.2
"""Range over which turn and scale of the surfaces to each other are one, in square roots of the target's area: as a
face is on another as a whole, but a piece of cloth along its bends."""

SQUEEZED = 0.05
"""A triangle that the map makes narrower than this, relative to the surfaces' sizes, says nothing about gradients."""

WEAK = 1e-3
"""Weight of the gradients of triangles that say nothing: there what surrounds them is continued."""


@dataclass(frozen=True, eq=False)
class GradientTransfer:
    """Deformation transfer between two surfaces, prepared once for any number of displacements.

    The source is seen through the map: as the target's triangles with their corners where these correspond to.
    A displacement deforms each of these triangles and its normal by a matrix S. On the target the displacement w is
    sought that is nearest to the integral of |T - S|^2 over all triangles (Sumner and Popović 2004, equation 7; with
    areas as Botsch et al. 2006, where it is a Poisson equation), T being how w deforms a triangle, plus that of
    |w - w0|^2 / l^2: w0 is the displacement itself, turned and scaled as the surface is far around, which says where
    parts go that hang together with nothing.

    Attributes
    ----------
    rotation, scale : (n, 3, 3) and (n,) float64
        How the surface far around each vertex of the target comes from the source.
    places : (n, 3) float64
        Where the target's vertices lie on the source.
    target : TriangleMesh
    known : (n,) bool
        Target vertices that have a counterpart.
    riders : Riders or None
        What moves as one piece with what lies beside it.
    """

    rotation: Floats
    scale: Floats
    places: Floats
    target: TriangleMesh
    known: Booleans
    riders: Riders | None
    _turn: Floats
    _matrix: csr_array
    _coordinates: Floats
    _weight: Floats
    _solve: Callable[[Floats], Floats]

    @staticmethod
    def of(correspondence: Correspondence, source: TriangleMesh, target: TriangleMesh) -> GradientTransfer:
        """Factorise the system of a target of n vertices.

        Parameters
        ----------
        correspondence : Correspondence
        source, target : TriangleMesh
            In the shapes that displacements depart from.
        """
        known = correspondence.face >= 0
        matrix = correspondence.matrix()
        places = matrix @ source.vertices
        rotation, scale = local_similarities(correspondence, source, target, AROUND * np.sqrt(target.area))
        faces, size = target.faces, len(target.vertices)
        basis = _with_normal(places, faces)
        whole = known[faces].all(axis=1)
        telling = whole & _tells(basis, target, scale[faces].mean(axis=1))
        inverse = np.zeros_like(basis)
        inverse[telling] = np.linalg.inv(basis[telling])
        lengths = mollified_lengths(target.edge_lengths)
        counts = np.where(telling, 1.0, np.where(whole, WEAK, 1e-9))  # 0 would leave vertices that nothing holds
        weight = 0.5 * cotangents(lengths) * counts[:, None]
        stiffness = cotangent_laplacian(faces, lengths, size, counts)
        mass = _masses(target)
        start, stop = directed_edges(faces).T
        sides = (target.vertices[stop] - target.vertices[start]).reshape(-1, 3, 3)
        # the target's sides in the source's frame, and there in the triangle's own sides and normal
        turn = nearest_orthogonal(rotation[faces].sum(axis=1))
        coordinates = np.einsum("mab,mkb->mka", inverse, sides @ turn)
        return GradientTransfer(
            rotation=rotation,
            scale=scale,
            places=places,
            target=target,
            known=known,
            riders=Riders.of(correspondence, source, target, rotation, scale),
            _turn=turn,
            _matrix=matrix,
            _coordinates=coordinates,
            _weight=weight,
            _solve=factorised(csc_array(stiffness + diags_array(mass))),
        )

    def copied(self, displacements: Floats) -> Floats:
        """Return displacements of the source's vertices, (n_source, 3), turned and scaled as the surface around."""
        moved = self._matrix @ displacements
        return np.einsum("nij,nj->ni", self.rotation, moved) * self.scale[:, None]

    @cached_property
    def largest(self) -> Integers:
        """The triangles of the target's largest part, (k, 3)."""
        return self.target.faces[parts_of(self.target)[1] == 0]

    def __call__(self, displacements: Floats) -> Floats:
        """Return displacements of target vertices, (n, 3), for some of source vertices, (n_source, 3).

        0 at target vertices without a counterpart.
        """
        moved = self._matrix @ displacements
        faces = self.target.faces
        change = _with_normal(self.places + moved, faces) - _with_normal(self.places, faces)
        wanted = np.einsum("mab,mkb->mka", self._turn @ change, self._coordinates)
        result = self.copied(displacements)
        # what is solved for is the difference to the copy, which is exactly 0 where nothing is to change
        start, stop = directed_edges(faces).T
        result += self._solve(self._divergence(wanted - (result[stop] - result[start]).reshape(wanted.shape)))
        result[~self.known] = 0
        if self.riders is not None:
            result[self.riders.vertices] = self.riders(displacements)
        return result

    def moved_places(self, displacements: Floats) -> Floats:
        """Return displacements of the source's vertices, (n_source, 3), at the places of the target's, (n, 3)."""
        return self._matrix @ displacements

    def yielding(self, force: Floats) -> Floats:
        """Return the displacement, (n, 3), that yields to forces on vertices, (n, 3), as this system resists them."""
        return self._solve(force)

    def _divergence(self, wanted: Floats) -> Floats:
        """Return the right side, (n, 3), of a wish for the difference along each side of each triangle, (m, 3, 3)."""
        size = len(self.target.vertices)
        flow = (self._weight[:, :, None] * wanted).reshape(-1, 3)
        start, stop = directed_edges(self.target.faces).T
        columns = [np.bincount(stop, f, size) - np.bincount(start, f, size) for f in flow.T]
        return np.stack(columns, axis=1).astype(np.float64, copy=False)


def _with_normal(points: Floats, faces: Integers) -> Floats:
    """Return two sides of each triangle and its normal, in the columns of (m, 3, 3) (Sumner and Popović, equation 1).

    The normal, u x v / sqrt(|u x v|), is as long as the triangle is wide.
    """
    a, b, c = (points[faces[:, k]] for k in range(3))
    u, v = b - a, c - a
    normal = np.cross(u, v)
    normal /= np.sqrt(np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny))
    return np.stack([u, v, normal], axis=2)


def _tells(basis: Floats, target: TriangleMesh, scale: Floats) -> Booleans:
    """Return which triangles, (m,), the map leaves wide enough: the smaller singular value of the map is `SQUEEZED`."""
    u, v = basis[:, :, 0] * scale[:, None], basis[:, :, 1] * scale[:, None]
    corners = target.vertices[target.faces]
    own = corners[:, 1:] - corners[:, :1]
    metric = np.einsum("mia,mja->mij", own, own)
    there = np.stack([u, v], axis=1)
    there = np.einsum("mia,mja->mij", there, there)
    determinant = metric[:, 0, 0] * metric[:, 1, 1] - metric[:, 0, 1] ** 2
    positive = determinant > 1e-12 * (metric[:, 0, 0] + metric[:, 1, 1]) ** 2
    ratio = np.zeros(len(basis))
    # eigenvalues of the inverse of one metric by the other: squares of the singular values
    product = np.linalg.solve(metric[positive], there[positive])
    trace = product[:, 0, 0] + product[:, 1, 1]
    square = np.maximum(product[:, 0, 0] * product[:, 1, 1] - product[:, 0, 1] * product[:, 1, 0], 0)
    ratio[positive] = 0.5 * (trace - np.sqrt(np.maximum(trace**2 - 4 * square, 0)))
    return ratio > SQUEEZED**2


def parts_of(target: TriangleMesh) -> tuple[Integers, Integers]:
    """Return the number of the part that each vertex, (n,), and each triangle, (m,), is in; 0 is the largest."""
    part = pieces(target.faces, len(target.vertices))
    part[part < 0] = part.max(initial=-1) + 1  # what is in no triangle has no area
    order = np.argsort(-np.bincount(part, target.vertex_areas), kind="stable")
    number = np.argsort(order, kind="stable")[part]
    return number, number[target.faces[:, 0]]


def _masses(target: TriangleMesh) -> Floats:
    """Return how much the displacement itself counts at each vertex, (n,).

    In parts beside the largest only its mean counts: they turn and stretch as their gradients say.
    """
    areas, part = target.vertex_areas, parts_of(target)[0]
    own = np.bincount(part, areas)
    weight = np.full(len(own), 1e-3) / np.maximum(own, np.finfo(float).tiny)
    weight[0] = 1 / (REACH**2 * own[0])
    mass = areas * weight[part]
    return np.maximum(mass, 1e-9 * mass.mean())
