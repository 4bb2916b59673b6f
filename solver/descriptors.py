"""Intrinsic descriptors: the mean curvature of the surface at several stages of its diffusion.

They do not depend on pose, scale or triangulation, nor on orientation as long as normals point outwards.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_array

from .cholesky import factorised
from .laplacian import laplacian, mass
from .mesh import Floats, TriangleMesh

DIFFUSION_TIMES = (0.0005, 0.002, 0.008, 0.03)
"""Diffusion times as fractions of the surface's area: from a fiftieth to a sixth of its width in standard deviation."""


def diffused_mean_curvature(
    mesh: TriangleMesh,
    times: tuple[float, ...] = DIFFUSION_TIMES,
    progress: Callable[[float], None] | None = None,
) -> Floats:
    """Return the mean curvature of the surface after diffusion, (n, len(times)), times the root of the area.

    Positions are diffused by one implicit step of (M + t A L) x_t = M x, as in Desbrun et al. (1999); mean curvature is
    L x_t / (2 M) along the normal, positive where the surface is convex. 0 at vertices in no face. `progress` is called
    with the share of the work done, in [0, 1], and may raise to end it.
    """
    area = mesh.area
    stiffness, masses = laplacian(mesh), mesh.vertex_areas
    used = np.unique(mesh.faces)
    inner = csc_array(stiffness[used][:, used])
    weights = csc_array(mass(mesh))[used][:, used]
    positions = mesh.vertices[used]
    result = np.zeros((len(mesh.vertices), len(times)))
    for k, t in enumerate(times):
        if progress:
            progress(k / len(times))
        diffused = mesh.vertices.copy()
        diffused[used] = factorised(csc_array(weights + (t * area) * inner))(weights @ positions)
        normals = TriangleMesh(diffused, mesh.faces).vertex_normals()[used]
        vector = inner @ diffused[used]
        result[used, k] = (vector * normals).sum(axis=1) / (2 * masses[used]) * np.sqrt(area)
    return result


def standardised(values: Floats, weights: Floats) -> Floats:
    """Return each column of `values`, (n, d), with weighted mean 0 and weighted standard deviation 1."""
    weights = weights / weights.sum()
    centred = values - weights @ values
    deviation = np.sqrt(weights @ centred**2)
    return centred / np.where(deviation > 0, deviation, 1)
