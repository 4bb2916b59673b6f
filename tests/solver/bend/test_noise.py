from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, posed
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import eigsh

from solver import TriangleMesh, align, flatten
from solver.bend.noise import POWER, shortest
from solver.surface.laplacian import laplacian


def test_displacements_and_noise_have_the_same_power_at_the_shortest_wave() -> None:
    """Of noise drawn anew, in the modes of the Laplacian; in roots of the area, whatever the scale."""
    clean = bumps(3000, seed=1)
    deviation = 0.003 * clean.diagonal
    fields = np.random.default_rng(0).normal(scale=deviation, size=(len(clean.vertices), 20))
    rough = clean.vertices + fields[:, :1] * clean.vertex_normals()
    surface = flatten(clean)
    areas = clean.vertex_areas
    values, modes = eigsh(
        csc_array(laplacian(clean)), 60, csc_array(diags_array(areas)), sigma=-0.1, v0=np.ones(len(areas))
    )
    # coefficients and eigenvalues of the same surface with an area of 1
    power = float(((modes.T @ (areas[:, None] * fields)) ** 2).mean()) / clean.area**2
    assert values.min() < 1e-6
    found = shortest(surface, replace(surface, exact=rough))
    assert found == pytest.approx((power / POWER) ** 0.25, rel=0.1)
    both = shortest(replace(surface, exact=rough), replace(surface, exact=rough))
    assert both == pytest.approx(2**0.25 * found)
    assert shortest(surface, surface) == 0


def test_noise_is_not_followed() -> None:
    """Noise of 0.3 % of the diagonal on either side: a sheet errs by 0.43 %, by 0.65 where noise is followed."""
    clean = bumps(3000, seed=4)
    rng = np.random.default_rng(1)
    source, target = (
        TriangleMesh(clean.vertices + rng.normal(scale=0.003 * clean.diagonal, size=clean.vertices.shape), clean.faces)
        for _ in range(2)
    )
    found = align(source, posed(target, 3))
    assert found.bending is not None
    face, barycentric = found.located
    places = np.einsum("qk,qkd->qd", barycentric, clean.vertices[clean.faces[face]])
    error = 100 * np.linalg.norm(places - clean.vertices, axis=1).mean() / clean.diagonal
    assert error < 0.55
