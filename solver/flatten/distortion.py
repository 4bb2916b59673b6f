"""How far a map of a mesh to the plane, or to the sphere, is from conformal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..surface.laplacian import cotangents
from ..surface.mesh import Complexes, Floats, Integers, Places, TriangleMesh


@dataclass(frozen=True)
class Distortion:
    """Distortion of a map from a mesh to the plane, or to the unit sphere with flat triangles between the vertices.

    Attributes
    ----------
    mean_angle_error, median_angle_error, percentile_99_angle_error, max_angle_error : float
        Over all corners, |angle in the plane - angle on the surface|, in degrees.
    mean_dilatation, max_dilatation : float
        Quasi-conformal dilatation, >= 1: the larger over the smaller stretch of a triangle; the mean is weighted by
        area on the surface. Triangles turned over, and those without area on the surface, do not count.
    min_log_factor, max_log_factor : float
        Natural logarithm of the conformal factor at the vertices, relative to a map that keeps areas in proportion.
    flips : int
        Triangles turned over or collapsed in the plane.
    circularity : float
        4 pi area / perimeter^2 of the boundary's image: 1 for a circle, less for any other curve; 1 on the sphere.
    """

    mean_angle_error: float
    median_angle_error: float
    percentile_99_angle_error: float
    max_angle_error: float
    mean_dilatation: float
    max_dilatation: float
    min_log_factor: float
    max_log_factor: float
    flips: int
    circularity: float


def signed_areas(plane: Complexes, faces: Integers) -> Floats:
    """Return the signed area of each triangle in the plane, (m,); positive is counter-clockwise."""
    return _areas(plane, faces)


def signed_volumes(sphere: Floats, faces: Integers) -> Floats:
    """Return det(a, b, c) of each triangle's corners, (m,): positive is counter-clockwise seen from outside.

    Six times the volume of the tetrahedron between the triangle and the centre; points are (n, 3).
    """
    a, b, c = (sphere[faces[:, k]] for k in range(3))
    return (a * np.cross(b - a, c - a)).sum(axis=1)


def corner_angles(corners: Floats) -> Floats:
    """Return the angle at each corner in radians, (m, 3), of triangles (m, 3, d); pi/3 where a triangle is a point."""
    left = np.roll(corners, -1, axis=1) - corners
    right = np.roll(corners, -2, axis=1) - corners
    dot = (left * right).sum(axis=2)
    cross = np.sqrt(np.maximum((left**2).sum(axis=2) * (right**2).sum(axis=2) - dot**2, 0))
    return np.where((dot == 0) & (cross == 0), np.pi / 3, np.arctan2(cross, dot))


def angle_errors(mesh: TriangleMesh, image: Places) -> Floats:
    """Return |angle in the image - angle on the surface| at each corner, (m, 3), in degrees."""
    flat = np.stack([image.real, image.imag], axis=1) if image.ndim == 1 else image
    return np.degrees(np.abs(corner_angles(flat[mesh.faces]) - corner_angles(mesh.vertices[mesh.faces])))


def vertex_angle_errors(mesh: TriangleMesh, plane: Complexes) -> Floats:
    """Return the mean angle error of the corners at each vertex, (n,), in degrees; nan where unused."""
    n = len(mesh.vertices)
    corners = np.bincount(mesh.faces.ravel(), minlength=n)
    total = np.bincount(mesh.faces.ravel(), angle_errors(mesh, plane).ravel(), minlength=n)
    return np.divide(total, corners, out=np.full(n, np.nan), where=corners > 0)


def dilatations(mesh: TriangleMesh, image: Complexes | Floats) -> Floats:
    """Return the quasi-conformal dilatation of each triangle, (m,), the larger over the smaller stretch, >= 1.

    Infinite where a triangle is turned over or collapsed, nan where it has no area on the surface.

    Parameters
    ----------
    mesh : TriangleMesh
    image : (n,) complex128 or (n, 3) float64
        Where the vertices go: in the plane, or in space, where no triangle counts as turned over.
    """
    corners = image[mesh.faces]
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    squares = (sides**2).sum(axis=2) if image.ndim == 2 else np.abs(sides) ** 2
    # the integral of |grad f|^2 over a triangle: half the cotangents times the squared sides of its image
    energy = 0.5 * (cotangents(mesh.edge_lengths) * squares).sum(axis=1)
    area = _areas(image, mesh.faces)
    ratio: Floats = np.divide(energy, 2 * area, out=np.full(len(area), np.inf), where=area > 0)
    np.maximum(ratio, 1, out=ratio)
    ratio[mesh.face_areas <= 1e-12 * mesh.edge_lengths.max(axis=1) ** 2] = np.nan
    return ratio + np.sqrt((ratio - 1.0) * (ratio + 1.0))


def _areas(image: Complexes | Floats, faces: Integers) -> Floats:
    """Return the area of each triangle, (m,): signed in the plane, not in space."""
    a, b, c = (image[faces[:, k]] for k in range(3))
    if image.ndim == 1:
        return 0.5 * np.imag(np.conj(b - a) * (c - a))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def log_conformal_factor(mesh: TriangleMesh, image: Complexes | Floats) -> Floats:
    """Return half the log of the image's area over the area around each vertex, (n,); nan where unused.

    The image, (n,) complex or (n, 3), lies in the plane or in space.
    """
    covered = np.abs(_areas(image, mesh.faces))
    around = np.bincount(mesh.faces.ravel(), np.repeat(covered / 3, 3), minlength=len(mesh.vertices))
    tiny = np.finfo(float).tiny
    factor = 0.5 * np.log(np.maximum(around, tiny) / np.maximum(mesh.vertex_areas, tiny))
    factor[np.bincount(mesh.faces.ravel(), minlength=len(factor)) == 0] = np.nan
    return factor


def distortion(mesh: TriangleMesh, plane: Complexes, boundary: Integers) -> Distortion:
    """Return the distortion of a map of `mesh` to the plane.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    plane : (n,) complex128
        Image of each vertex in use.
    boundary : (k,) int
        Vertices of the outer boundary in order.
    """
    rim = plane[boundary]
    perimeter = np.abs(np.roll(rim, -1) - rim).sum()
    circularity = float(2 * np.pi * np.imag(np.conj(rim) * np.roll(rim, -1)).sum() / perimeter**2)
    return _distortion(mesh, plane, int((signed_areas(plane, mesh.faces) <= 0).sum()), circularity)


def spherical_distortion(mesh: TriangleMesh, sphere: Floats) -> Distortion:
    """Return the distortion of a map of `mesh` to the unit sphere, (n, 3)."""
    return _distortion(mesh, sphere, int((signed_volumes(sphere, mesh.faces) <= 0).sum()), 1.0)


def _distortion(mesh: TriangleMesh, image: Complexes | Floats, flips: int, circularity: float) -> Distortion:
    error = angle_errors(mesh, image)
    dilatation = dilatations(mesh, image)
    counted = np.isfinite(dilatation)
    weight = mesh.face_areas[counted]
    factor = log_conformal_factor(mesh, image)
    covered = np.abs(_areas(image, mesh.faces)).sum()
    factor = factor[np.isfinite(factor)] - 0.5 * np.log(max(covered, np.finfo(float).tiny) / mesh.area)
    median, percentile_99 = np.percentile(error, [50, 99])
    return Distortion(
        mean_angle_error=float(error.mean()),
        median_angle_error=float(median),
        percentile_99_angle_error=float(percentile_99),
        max_angle_error=float(error.max()),
        mean_dilatation=float((dilatation[counted] * weight).sum() / weight.sum()) if counted.any() else 1.0,
        max_dilatation=float(dilatation[counted].max(initial=1.0)),
        min_log_factor=float(factor.min()),
        max_log_factor=float(factor.max()),
        flips=flips,
        circularity=circularity,
    )
