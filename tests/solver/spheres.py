"""Closed surfaces whose conformal map to the sphere is known, and random points and transformations of the sphere."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from solver import TriangleMesh
from solver.mobius import SphereMobius


def unit(x: np.ndarray) -> np.ndarray:
    """Points moved onto the unit sphere."""
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def sphere_points(rng: np.random.Generator, count: int) -> np.ndarray:
    """Points spread evenly over the sphere at random."""
    return unit(rng.normal(size=(count, 3)))


def even_points(count: int) -> np.ndarray:
    """Points spread evenly over the sphere, on a spiral."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)


def hull(points: np.ndarray, name: str = "sphere") -> TriangleMesh:
    """The sphere's Delaunay triangulation, counter-clockwise from outside."""
    faces = ConvexHull(points).simplices.astype(int)
    a, b, c = (points[faces[:, k]] - points.mean(axis=0) for k in range(3))
    inward = (a * np.cross(b, c)).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return TriangleMesh(points, faces, name)


def random_mobius(rng: np.random.Generator, h_max: float = 0.9, reflect: bool = True) -> SphereMobius:
    """A transformation with |h| <= h_max."""
    x, y, z = (h_max * rng.random() * sphere_points(rng, 1)[0]).tolist()
    return SphereMobius((x, y, z), tuple(rng.normal(size=4).tolist()), bool(reflect and rng.random() < 0.5))


def turned_onto(points: np.ndarray, truth: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Points after the rotation that brings them nearest to the truth (Kabsch 1976)."""
    left, _, right = np.linalg.svd((truth * weights[:, None]).T @ points)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    return points @ (left @ right).T


def ball(count: int = 800, bumps: float = 0.25, seed: int = 0, waves: int = 12, name: str = "ball") -> TriangleMesh:
    """A sphere with smooth hills and dents at random, without symmetry."""
    rng = np.random.default_rng(seed)
    points = even_points(count)
    about, height = sphere_points(rng, waves), rng.uniform(-1, 1, waves)
    wide = rng.uniform(0.2, 0.5, waves)
    radius = 1 + bumps * (height * np.exp((points @ about.T - 1) / wide**2)).sum(axis=1)
    return TriangleMesh(points * radius[:, None], hull(points).faces, name)
