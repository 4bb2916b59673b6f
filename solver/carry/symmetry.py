"""The plane in which a surface is its own mirror image, nearly: mirrored displacements, and the halves of one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from ..surface.mesh import Floats, TriangleMesh
from ..surface.nearest import SurfacePoints

ALIKE = 0.02
"""Median distance of a mirrored surface from itself, in diagonals, up to which it is symmetric: faces of real people
have 0.003 to 0.01, a head turned to one side more."""

POINTS = 2000
"""Vertices by which the plane is found, at most."""

SAME = 0.5
"""Relative difference from its mirror image from which on a displacement is not meant to be symmetric."""


@dataclass(frozen=True, eq=False)
class Mirror:
    """A plane of symmetry.

    Attributes
    ----------
    normal, middle : (3,) float64
        Of the plane; the normal's largest component is positive.
    partner : (n, n) sparse
        Values of the vertices at the places of their mirror images.
    """

    normal: Floats
    middle: Floats
    partner: csr_array

    @staticmethod
    def of(mesh: TriangleMesh) -> Mirror | None:
        """Return the plane of symmetry of a surface, None if it has none.

        The principal axes are tried, of which one is the plane's normal if a surface is symmetric, and the axes of
        space through the origin, as is usual in modelling; then the plane is fitted to nearest points.
        """
        used = np.flatnonzero(mesh.used)
        places = mesh.vertices[used]
        weight = mesh.vertex_areas[used] / max(mesh.area, 1e-300)
        centre = weight @ places
        axes = np.linalg.eigh((places - centre).T @ ((places - centre) * weight[:, None]))[1].T
        tree, some = KDTree(places), places[:: -(-len(places) // POINTS)]
        tries = [(axis, centre) for axis in axes] + [(axis, np.zeros(3)) for axis in np.eye(3)]
        fits = [_fitted(tree, places, some, normal, middle) for normal, middle in tries]
        apart, normal, middle = min(fits, key=lambda fit: fit[0])
        if apart > ALIKE * mesh.diagonal:
            return None
        normal = normal * np.sign(normal[np.abs(normal).argmax()])
        surface = SurfacePoints(mesh, (), ALIKE * mesh.diagonal)
        face, weights = surface.nearest_point(
            _mirrored(mesh.vertices, normal, middle), _mirrored(mesh.vertex_normals(), normal, 0 * middle)
        )
        count = len(mesh.vertices)
        ends = np.arange(0, 3 * count + 1, 3)
        partner = csr_array((weights.ravel(), mesh.faces[face].ravel(), ends), shape=(count, count))
        return Mirror(normal, middle, partner)

    def image(self, displacements: Floats) -> Floats:
        """Return the mirror image of displacements, (n, 3)."""
        return _mirrored(self.partner @ displacements, self.normal, np.zeros(3))

    def alike(self, first: Floats, second: Floats) -> bool:
        """Return whether one of two displacements, (n, 3), is meant to be the mirror image of the other."""
        size = float(np.linalg.norm(first) * np.linalg.norm(second))
        return size > 0 and float(np.linalg.norm(first - self.image(second))) ** 2 < SAME**2 * size

    def symmetric(self, first: Floats, second: Floats) -> tuple[Floats, Floats]:
        """Return two displacements, (n, 3), as mirror images of each other: each the mean of what both say."""
        return (first + self.image(second)) / 2, (second + self.image(first)) / 2


def left_share(places: Floats, normal: Floats, middle: Floats, width: float) -> Floats:
    """Return how much of what moves places, (n, 3), is the half's on the normal's side, (n,): smooth across the plane.

    1 minus it is the other half's. It goes from 0 to 1 within `width`.
    """
    share = np.clip(0.5 + (places - middle) @ normal / max(width, 1e-300), 0, 1)
    return share * share * (3 - 2 * share)


def _mirrored(points: Floats, normal: Floats, middle: Floats) -> Floats:
    return points - 2 * ((points - middle) @ normal)[:, None] * normal


def _fitted(tree: KDTree, places: Floats, some: Floats, normal: Floats, middle: Floats) -> tuple[float, Floats, Floats]:
    """Return how far the mirror image of some points is off, and the plane fitted to them and their nearest points."""
    for _ in range(10):
        image = _mirrored(some, normal, middle)
        apart, at = tree.query(image)
        other = places[at]
        trusted = apart <= 2 * np.median(apart) + 1e-300
        between, across = (some + other)[trusted] / 2, (some - other)[trusted]
        along = np.linalg.eigh(across.T @ across)[1][:, -1]
        at_middle = between.mean(axis=0)
        # the plane holds the middles of points and their images
        spread = np.linalg.eigh((between - at_middle).T @ (between - at_middle))[1][:, 0]
        new: Floats = np.array(spread if abs(spread @ normal) > abs(along @ normal) else along, np.float64)
        if abs(new @ normal) < 0.9:
            break
        new = np.array(new * np.sign(new @ normal), np.float64)
        still = abs(new @ normal) > 1 - 1e-12 and abs((at_middle - middle) @ new) < 1e-9 * np.ptp(places)
        normal, middle = new, at_middle
        if still:
            break
    return float(np.median(tree.query(_mirrored(some, normal, middle))[0])), normal, middle
