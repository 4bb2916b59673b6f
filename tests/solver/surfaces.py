"""Surfaces whose conformal map to the disc is known, for the solver's tests."""

import numpy as np
from scipy.optimize import brentq
from scipy.spatial import Delaunay
from scipy.special import ellipj, ellipk

from solver import Mobius, TriangleMesh
from solver.flatten.barycentre import conformal_barycentre


def rings(count: int, jitter: float = 0.0, seed: int = 0) -> np.ndarray:
    """Points of the closed unit disc, complex: the centre and `count` rings, the last on the circle."""
    rng = np.random.default_rng(seed)
    points = [np.zeros(1, complex)]
    for k in range(1, count + 1):
        n = 6 * k
        ring = k / count * np.exp(2j * np.pi * (np.arange(n) + 0.5 * (k % 2)) / n)
        if k < count:
            ring += jitter / count * (rng.uniform(-1, 1, n) + 1j * rng.uniform(-1, 1, n))
        points.append(ring)
    return np.concatenate(points)


def planar(points: np.ndarray) -> TriangleMesh:
    """Delaunay triangulation of complex points in the plane, counter-clockwise."""
    flat = np.stack([points.real, points.imag], axis=1)
    faces = Delaunay(flat).simplices.astype(int)
    a, b, c = (points[faces[:, k]] for k in range(3))
    area = np.imag(np.conj(b - a) * (c - a))
    faces = faces[np.abs(area) > 1e-12]
    area = area[np.abs(area) > 1e-12]
    faces[area < 0] = faces[area < 0][:, ::-1]
    return TriangleMesh(np.column_stack([flat, np.zeros(len(flat))]), faces, "planar")


def spherical_cap(count: int, polar_angle: float, jitter: float = 0.0) -> tuple[TriangleMesh, np.ndarray]:
    """Return the cap of the unit sphere within `polar_angle` of a pole and its stereographic image in the disc."""
    points = rings(count, jitter)
    polar = polar_angle * np.abs(points)
    around = np.exp(1j * np.angle(points))
    on_sphere = np.column_stack([(np.sin(polar) * around).real, (np.sin(polar) * around).imag, np.cos(polar)])
    # seen from outside, the pole towards the eye: counter-clockwise stays counter-clockwise
    mesh = TriangleMesh(on_sphere, planar(points).faces, "cap")
    return mesh, np.tan(polar / 2) / np.tan(polar_angle / 2) * around


def half_disc(count: int) -> np.ndarray:
    """Points of the closed upper half of the unit disc, complex, the diameter included."""
    arcs = [k / count * np.exp(1j * np.pi * np.arange(3 * k + 1) / (3 * k)) for k in range(1, count + 1)]
    return np.concatenate([np.zeros(1, complex), *arcs])


def half_disc_to_disc(z: np.ndarray) -> np.ndarray:
    """Riemann map of the upper half of the unit disc: to a quadrant, squared to the half-plane, to the disc."""
    return ((1 + z) ** 2 - 1j * (1 - z) ** 2) / ((1 + z) ** 2 + 1j * (1 - z) ** 2)


def rectangle(columns: int, height: float, jitter: float = 0.0) -> np.ndarray:
    """Points of the closed rectangle |x| <= 1, |y| <= height, complex, `columns` squares wide."""
    rows = round(columns * height)
    x, y = np.meshgrid(np.linspace(-1, 1, columns + 1), np.linspace(-height, height, rows + 1))
    rng = np.random.default_rng(0)
    inside = (np.abs(x) < 1 - 1e-9) & (np.abs(y) < height - 1e-9)
    x, y = (a + inside * jitter * 2 / columns * rng.uniform(-1, 1, a.shape) for a in (x, y))
    return (x + 1j * y).ravel()


def rectangle_to_disc(z: np.ndarray, height: float) -> np.ndarray:
    """Riemann map of the rectangle |x| <= 1, |y| <= height: sn to the half-plane, then the disc, centre to centre."""
    m = brentq(lambda m: ellipk(1 - m) - 2 * height * ellipk(m), 1e-12, 1 - 1e-12)
    scale = ellipk(m)
    over, under = _sn(scale * z.real, scale * (z.imag + height), m)
    at, unit = _sn(np.zeros(1), np.full(1, scale * height), m)
    middle = at[0] / unit[0]
    return (over - middle * under) / (over - np.conj(middle) * under)


def _sn(x: np.ndarray, y: np.ndarray, m: float) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator of sn(x + i y | m)."""
    s, c, d, _ = ellipj(x, m)
    s1, c1, d1, _ = ellipj(y, 1 - m)
    return s * d1 + 1j * c * d * s1 * c1, c1**2 + m * s**2 * s1**2


def turned_onto(disc: np.ndarray, truth: np.ndarray, mesh: TriangleMesh) -> np.ndarray:
    """Return `truth` centred as a Flattening is, and `disc` turned onto it by a rotation, stacked (2, n)."""
    centred = Mobius(conformal_barycentre(truth, mesh.vertex_areas), 0.0)(truth)
    turn = np.vdot(disc, mesh.vertex_areas * centred)
    return np.stack([centred, disc * turn / abs(turn)])


def largest_error(disc: np.ndarray, truth: np.ndarray, mesh: TriangleMesh) -> float:
    """Largest distance in the disc from a known conformal map, up to a Möbius transformation."""
    centred, turned = turned_onto(disc, truth, mesh)
    return float(np.abs(centred - turned).max())
