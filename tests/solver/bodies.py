"""Closed surfaces from which something sticks out: a body of revolution with a hilly head on a neck."""

import numpy as np

from solver import TriangleMesh

WAIST = 0.45
"""Radius of the neck."""


def revolved(heights: np.ndarray, radii: np.ndarray, segments: int) -> TriangleMesh:
    """A closed surface of revolution about z: rings of vertices between two poles at the first and last height."""
    around = 2 * np.pi * np.arange(segments) / segments
    rings = [
        np.stack([r * np.cos(around), r * np.sin(around), np.full(segments, z)], 1)
        for z, r in zip(heights, radii, strict=True)
    ]
    rings = rings[1:-1]
    vertices = np.concatenate([*rings, [[0, 0, heights[0]], [0, 0, heights[-1]]]])
    faces = []
    here, after = np.arange(segments), (np.arange(segments) + 1) % segments
    for k in range(len(rings) - 1):
        a, b = k * segments + here, k * segments + after
        faces += [np.stack([a, b, b + segments], 1), np.stack([a, b + segments, a + segments], 1)]
    low, high, last = len(vertices) - 2, len(vertices) - 1, (len(rings) - 1) * segments
    faces += [np.stack([np.full(segments, low), after, here], 1)]
    faces += [np.stack([np.full(segments, high), last + here, last + after], 1)]
    return TriangleMesh(vertices, np.concatenate(faces), "Body")


def snowman(rings: int = 60, segments: int = 48, seed: int | None = None) -> TriangleMesh:
    """A ball of radius 2 and on it a head of radius 1, on a neck of radius `WAIST`; with a seed a hilly head."""
    reach = np.sqrt(1 - WAIST**2)
    turn = np.linspace(0, 1, rings)
    low, high = np.arccos(np.sqrt(1 - (WAIST / 2) ** 2)), np.arccos(reach)
    body, head = np.pi - turn * (np.pi - low), (np.pi - high) * (1 - turn)
    below = np.sqrt(4 - WAIST**2)
    heights = np.concatenate([2 * np.cos(body) - below, [0.25, 0.5], 0.75 + reach + np.cos(head)])
    radii = np.concatenate([2 * np.sin(body), [WAIST * 0.98, WAIST * 0.98], np.sin(head)])
    mesh = revolved(heights, radii, segments)
    if seed is None:
        return mesh
    rng = np.random.default_rng(seed)
    centre = np.array([0, 0, 0.75 + reach])
    out = mesh.vertices - centre
    ball = out[:, 2] > -0.8
    for _ in range(9):
        to = rng.normal(size=3)
        to[2] = abs(to[2]) - 0.3
        to /= np.linalg.norm(to)
        away = np.arccos(np.clip(out @ to / np.maximum(np.linalg.norm(out, axis=1), 1e-9), -1, 1))
        out[ball] *= (1 + rng.uniform(0.1, 0.3) * np.exp(-((away / rng.uniform(0.2, 0.4)) ** 2)))[ball, None]
    return TriangleMesh(centre + out, mesh.faces, "Body")
