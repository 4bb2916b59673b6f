"""The two parameter domains, disc and sphere: what differs between them, so that all that follows is written once.

Places are points of a domain: (n,) complex128 in the disc, (n, 3) float64 on the sphere.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from ..mobius import Mobius, SphereMobius
from ..surface.barycentric import interpolated
from ..surface.mesh import Floats, Integers, Places, TriangleMesh
from .distortion import signed_areas, signed_volumes
from .locate import TriangulatedDisc, TriangulatedSphere, plane


class Domain(Protocol):
    """What a conformal map goes to."""

    closed: bool

    def nowhere(self, count: int) -> Places:
        """Return places that are nan, (count,)."""
        ...

    def coordinates(self, places: Places) -> Floats:
        """Return places as points of the plane, (n, 2), or of space, (n, 3)."""
        ...

    def mean(self, places: Places, corners: Integers, barycentric: Floats) -> Places:
        """Return the places in triangles, (q,), given by their corners, (q, 3), and barycentric coordinates, (q, 3)."""
        ...

    def areas(self, places: Places, faces: Integers) -> Floats:
        """Return for each triangle, (m,), a number that is positive where it is not turned over."""
        ...

    def flat_areas(self, places: Places, faces: Integers) -> Floats:
        """Return the areas of flat triangles, (m,); in the disc negative where they are turned over."""
        ...

    def reflected(self, places: Places) -> Places:
        """Return places as a reflected transformation sees them."""
        ...

    def moved(self, places: Places, motion: Places) -> Places:
        """Return where places, (n,), come by a motion, (n,), along the domain, which they do not leave."""
        ...

    def triangulated(self, places: Places, faces: Integers) -> TriangulatedDisc:
        """Prepare a triangulation for point location."""
        ...

    def delaunay(self, places: Places) -> Integers:
        """Return the Delaunay triangles of places, (f, 3), without slivers; none is turned over."""
        ...

    def gradients(self, places: Places, faces: Integers, values: Floats) -> Places:
        """Return the gradient of values, (n, d), that are linear in each triangle, for `jacobian`."""
        ...

    def jacobian(self, place: Places, gradient: Places) -> Floats:
        """Return how values change with the step of `near_identity`, (q, d, p), where places have these gradients."""
        ...

    def near_identity(self, step: Floats) -> Any:
        """Return the transformation that a small step, (p,), makes."""
        ...

    def depth(self, places: Places) -> Floats:
        """Return the distance of places from the rim, (n,)."""
        ...


class Disc:
    """The unit disc."""

    closed = False

    def nowhere(self, count: int) -> Places:
        """Return places that are nan."""
        return np.full(count, complex(np.nan, np.nan))

    def coordinates(self, places: Places) -> Floats:
        """Return places as points of the plane."""
        return plane(places)

    def mean(self, places: Places, corners: Integers, barycentric: Floats) -> Places:
        """Return the places in triangles."""
        return (places[corners] * barycentric).sum(axis=1)

    def areas(self, places: Places, faces: Integers) -> Floats:
        """Return signed areas."""
        return signed_areas(places, faces)

    def flat_areas(self, places: Places, faces: Integers) -> Floats:
        """Return signed areas."""
        return signed_areas(places, faces)

    def reflected(self, places: Places) -> Places:
        """Return the conjugates."""
        return np.conj(places)

    def moved(self, places: Places, motion: Places) -> Places:
        """Return places after a motion; beyond the circle they stay on it."""
        there = places + motion
        return there / np.maximum(np.abs(there), 1.0)

    def triangulated(self, places: Places, faces: Integers) -> TriangulatedDisc:
        """Prepare a triangulation for point location."""
        return TriangulatedDisc.of(places, faces)

    def delaunay(self, places: Places) -> Integers:
        """Return the Delaunay triangles."""
        faces = Delaunay(plane(places)).simplices.astype(np.intp)
        turned = signed_areas(places, faces)
        return np.where((turned < 0)[:, None], faces[:, [0, 2, 1]], faces)[np.abs(turned) > 1e-12]

    def gradients(self, places: Places, faces: Integers, values: Floats) -> Places:
        """Return gradients, (m, d): along x and y as real and imaginary part."""
        corner = places[faces]
        opposite = corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]]
        twice_area = np.imag(np.conj(corner[:, 1] - corner[:, 0]) * (corner[:, 2] - corner[:, 0]))
        # the gradient of a corner's hat function is its opposite side turned by a right angle, over twice the area
        hat = 1j * opposite / np.where(twice_area > 0, twice_area, np.inf)[:, None]
        return np.einsum("mk,mkd->md", hat, values[faces])

    def jacobian(self, place: Places, gradient: Places) -> Floats:
        """Return how values change: the transformations next to the identity move x by a - conj(a) x^2 + i t x."""
        moves = np.stack([1 - place**2, 1j * (1 + place**2), 1j * place], axis=1)
        return np.einsum("qd,qp->qdp", gradient.real, moves.real) + np.einsum("qd,qp->qdp", gradient.imag, moves.imag)

    def near_identity(self, step: Floats) -> Mobius:
        """Return the transformation for a step (re a, im a, t)."""
        a, turn = complex(step[0], step[1]), float(step[2])
        return Mobius(-a, turn)

    def depth(self, places: Places) -> Floats:
        """Return the distance from the circle."""
        return 1.0 - np.abs(places).astype(np.float64)


class Sphere:
    """The unit sphere, triangulated by geodesics."""

    closed = True

    def nowhere(self, count: int) -> Places:
        """Return places that are nan."""
        return np.full((count, 3), np.nan)

    def coordinates(self, places: Places) -> Floats:
        """Return places as points of space."""
        return places

    def mean(self, places: Places, corners: Integers, barycentric: Floats) -> Places:
        """Return the places in triangles."""
        points = interpolated(places, corners, barycentric)
        return points / np.linalg.norm(points, axis=1, keepdims=True)

    def areas(self, places: Places, faces: Integers) -> Floats:
        """Return det(a, b, c) of the corners."""
        return signed_volumes(places, faces)

    def flat_areas(self, places: Places, faces: Integers) -> Floats:
        """Return the areas of the triangles that the geodesics' corners span."""
        return TriangleMesh(np.nan_to_num(places), faces).face_areas

    def reflected(self, places: Places) -> Places:
        """Return places with the sign of y changed."""
        return places * [1.0, -1.0, 1.0]

    def moved(self, places: Places, motion: Places) -> Places:
        """Return places after a motion, drawn back to the sphere."""
        there = places + motion
        return there / np.linalg.norm(there, axis=1, keepdims=True)

    def triangulated(self, places: Places, faces: Integers) -> TriangulatedDisc:
        """Prepare a triangulation for point location."""
        return TriangulatedSphere.of(places, faces)

    def delaunay(self, places: Places) -> Integers:
        """Return the faces of the convex hull."""
        faces = ConvexHull(places).simplices.astype(np.intp)
        return np.where((signed_volumes(places, faces) < 0)[:, None], faces[:, [0, 2, 1]], faces)

    def gradients(self, places: Places, faces: Integers, values: Floats) -> Places:
        """Return gradients along the flat triangles, (m, 3, d)."""
        corner = places[faces]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        opposite = corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]]
        square = (normal**2).sum(axis=1)
        hat = np.cross(normal[:, None], opposite) / np.where(square > 0, square, np.inf)[:, None, None]
        return np.einsum("mkx,mkd->mxd", hat, values[faces])

    def jacobian(self, place: Places, gradient: Places) -> Floats:
        """Return how values change: for a step (h, w) the image x moves by -2 (h - (h.x) x) + w x x."""
        tilt = 2 * (place[:, :, None] * place[:, None] - np.eye(3))
        turn = -np.cross(place[:, None], np.eye(3)).transpose(0, 2, 1)
        return np.einsum("qxd,qxp->qdp", gradient, np.concatenate([tilt, turn], axis=2))

    def near_identity(self, step: Floats) -> SphereMobius:
        """Return the transformation for a step (h, w): w is an axis times an angle."""
        x, y, z, a, b, c = step.tolist()
        return SphereMobius((x, y, z), (1.0, a / 2, b / 2, c / 2))

    def depth(self, places: Places) -> Floats:
        """Return 1: there is no rim."""
        return np.ones(len(places))


DISC, SPHERE = Disc(), Sphere()
