"""How far a map of a mesh to the plane is from conformal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import Complexes, Floats, Integers, TriangleMesh


@dataclass(frozen=True)
class Distortion:
    """Distortion of a map from a mesh to the plane.

    Attributes
    ----------
    mean_angle_error, median_angle_error, max_angle_error : float
        Over all corners, |angle in the plane - angle on the surface|, in degrees.
    flips : int
        Triangles turned over or collapsed in the plane.
    """

    mean_angle_error: float
    median_angle_error: float
    max_angle_error: float
    flips: int


def signed_areas(plane: Complexes, faces: Integers) -> Floats:
    """Return the signed area of each triangle in the plane, (m,); positive is counter-clockwise."""
    a, b, c = (plane[faces[:, k]] for k in range(3))
    return 0.5 * np.imag(np.conj(b - a) * (c - a))


def corner_angles(corners: Floats) -> Floats:
    """Return the angle at each corner in radians, (m, 3), of triangles (m, 3, d); pi/3 where a triangle is a point."""
    left = np.roll(corners, -1, axis=1) - corners
    right = np.roll(corners, -2, axis=1) - corners
    dot = (left * right).sum(axis=2)
    cross = np.sqrt(np.maximum((left**2).sum(axis=2) * (right**2).sum(axis=2) - dot**2, 0))
    return np.where((dot == 0) & (cross == 0), np.pi / 3, np.arctan2(cross, dot))


def log_conformal_factor(mesh: TriangleMesh, plane: Complexes) -> Floats:
    """Return half the log of area in the plane over area on the surface around each vertex, (n,); nan where unused."""
    flat = np.abs(signed_areas(plane, mesh.faces))
    around = np.bincount(mesh.faces.ravel(), np.repeat(flat / 3, 3), minlength=len(mesh.vertices))
    tiny = np.finfo(float).tiny
    factor = 0.5 * np.log(np.maximum(around, tiny) / np.maximum(mesh.vertex_areas, tiny))
    factor[np.setdiff1d(np.arange(len(factor)), mesh.faces)] = np.nan
    return factor


def distortion(mesh: TriangleMesh, plane: Complexes) -> Distortion:
    """Return the distortion of the map of `mesh` to the points `plane`, (n,) complex128."""
    flat = np.stack([plane.real, plane.imag], axis=1)
    error = np.degrees(np.abs(corner_angles(flat[mesh.faces]) - corner_angles(mesh.vertices[mesh.faces])))
    return Distortion(
        mean_angle_error=float(error.mean()),
        median_angle_error=float(np.median(error)),
        max_angle_error=float(error.max()),
        flips=int((signed_areas(plane, mesh.faces) <= 0).sum()),
    )
