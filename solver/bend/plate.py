"""A plate on springs: the target drawn to the source's surface and boundaries, resisting to be bent.

Distances to tangent planes let the surfaces slide along each other; how they slide, the resistance of a thin plate
decides, relaxed from stiff to soft.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_array, diags_array

from ..flatten.harmonic import factorised
from ..surface.laplacian import laplacian
from ..surface.mesh import Booleans, Floats, Integers, TriangleMesh
from ..surface.nearest import SurfacePoints

NORMAL_WEIGHT = 0.03
"""A difference of 1 between unit normals counts like this length when points are paired."""

SLIP = 0.01
"""Resistance to sliding along a boundary, as a share of that to leaving it. There is none along the surface:
drawn to vertices, meshes of one template fit better and scans worse (the sets "-moved" of tests/bench)."""

OUTLIER = 2.385
"""Cauchy's weight at 95 % efficiency: residuals of this many standard deviations count half."""

RIM_REACH = 0.03
"""How far boundaries attract each other: the error that Möbius maps have, so that boundaries cut alike are found and
others leave each other alone. Without it errors are 15 to 50 % larger where boundaries correspond."""

CUT_REACH = 0.005
"""The same between what two surfaces share, cut out of them, where not all boundaries correspond: those do that a draft
puts within 0.01 of each other (`overlap.BEYOND`), where the pull has fallen to e^-2. Faces seen by a camera err by a
tenth to a half less so, scans cut by 15 or 30 % as much. Of wholes, reliefs and feet, whose boundaries have farther to
go, would err by a quarter to three times more."""

TENSION = 0.2
"""Wavelength over 2 pi, in roots of the area, from which on the plate resists like a membrane. Measured: with this the
true displacements of surfaces in pose, by their power in the first 60 modes of the Laplacian, are likeliest: 0.08 on
eight pairs of faces (ICT), 0.35 on six (SIMPOP), 0.07 on three of feet, 0.03 on two of brains; between the faces'."""

SOLVER_STEPS = 20
"""Conjugate gradient steps per round, at most. Long waves along the surface come last: after 12, cheeks that a smile
has moved are left behind by a tenth of the error; after 60, faces seen by a camera, which tell nothing of what is
hidden, err by a twentieth more, and the others hardly less."""

DRAFT_STEPS = 12
"""The same for a draft, whose places are rough all the same."""

SETTLED = 1e-3
"""Share of the forces that may be left when a round ends. With a tenth of that faces in motion err by a tenth less,
teeth and brains by a hundredth more, and it takes a third longer."""


def pulls(
    x: Floats, faces: Integers, areas: Floats, onto: SurfacePoints, drawn: Booleans, reach: float = RIM_REACH
) -> tuple[Floats, Floats]:
    """Return how the source pulls at each vertex: stiffness, (n, 3, 3), and force, (n, 3), of a spring.

    Towards the tangent plane of the point that suits in position and normal; less if the normals differ or the distance
    is an outlier, not at all where that point is on the edge.
    Vertices on a boundary that are `drawn`, (n,), are pulled to the source's boundary too, if it is within `reach`.
    """
    mesh = TriangleMesh(x, faces)
    weight, normal, distance = planes(x, mesh.vertex_normals(), areas, onto)
    stiffness, force = _along(normal, weight), (weight * distance)[:, None] * normal
    if not drawn.any():
        return stiffness, force
    rim = np.unique(mesh.edges[np.bincount(mesh.edge_of_side, minlength=len(mesh.edges)) == 1])
    rim = rim[drawn[rim]]
    if not len(rim):
        return stiffness, force
    point, tangent = onto.nearest_on_boundary(x[rim])
    weight = areas[rim] * np.exp(-(((point - x[rim]) ** 2).sum(axis=1) / reach**2) / 2)
    across = weight[:, None, None] * np.eye(3) - _along(tangent, weight * (1 - SLIP))
    stiffness[rim] += across
    force[rim] += np.einsum("nij,nj->ni", across, point - x[rim])
    return stiffness, force


def planes(x: Floats, own: Floats, areas: Floats, onto: SurfacePoints) -> tuple[Floats, Floats, Floats]:
    """Return how strongly, (..., n), vertices, (..., n, 3), with normals `own` are drawn to which planes.

    Then the planes' normals, (..., n, 3), and distances, (..., n). What is usual is asked of each n by themselves.
    """
    point, normal, beyond = onto.at(*onto.most_alike(x.reshape(-1, 3), own.reshape(-1, 3)))
    point, normal, beyond = point.reshape(x.shape), normal.reshape(x.shape), beyond.reshape(x.shape[:-1])
    weight = np.where(beyond, 0.0, np.clip((own * normal).sum(axis=-1), 0, 1) ** 2) * areas
    distance = ((point - x) * normal).sum(axis=-1)
    square = (weight[..., None, :] @ (distance**2)[..., None])[..., 0]
    deviation = np.sqrt(square / np.maximum(weight.sum(axis=-1, keepdims=True), 1e-12))
    return weight / (1 + (distance / np.maximum(OUTLIER * deviation, 1e-6)) ** 2), normal, distance


def relaxed(
    rest: Floats,
    now: Floats,
    faces: Integers,
    onto: SurfacePoints,
    lengths: Floats,
    drawn: Booleans,
    tell: Callable[[float], None],
    tension: float = np.inf,
    steps: int = DRAFT_STEPS,
    reach: float = RIM_REACH,
) -> Floats:
    """Return the vertices, (n, 3), bent from `rest` onto the source, beginning at `now`.

    Each round minimises the energy of the springs (`pulls`) plus l^4 times the integral of the squared Laplacian of
    the displacement from `rest`, and of its squared gradient over `tension`^2, for l in `lengths`: a plate under
    tension. Boundary vertices that are `drawn` go to the source's boundaries within `reach`.
    """
    mesh = TriangleMesh(rest, faces)
    stiffness, areas = laplacian(mesh), mesh.vertex_areas / mesh.area
    bending = stiffness @ diags_array(1 / np.maximum(areas, 1e-3 * areas.mean())) @ stiffness
    plate = csc_array(bending + stiffness / tension**2)
    shift = now - rest
    for k, length in enumerate(lengths):
        tell(k / len(lengths))
        stiff = length**4
        pull, force = pulls(rest + shift, faces, areas, onto, drawn, reach)
        # the same system with the same pull in all directions, which one factorisation solves
        even = np.einsum("nii->n", pull) / 3 + 1e-4 * areas
        shift = _conjugate_gradients(
            lambda u, pull=pull, stiff=stiff: np.einsum("nij,nj->ni", pull, u) + stiff * (plate @ u),
            factorised(csc_array(diags_array(even) + stiff * plate)),
            force + np.einsum("nij,nj->ni", pull, shift),
            shift,
            steps,
        )
    return rest + shift


def _along(direction: Floats, weight: Floats) -> Floats:
    """Return weight times the projection on each unit vector, (n, 3, 3)."""
    return weight[:, None, None] * direction[:, :, None] * direction[:, None, :]


def _conjugate_gradients(
    apply: Callable[[Floats], Floats],
    precondition: Callable[[Floats], Floats],
    right: Floats,
    x: Floats,
    steps: int,
) -> Floats:
    """Return x after some steps towards apply(x) = right, for arrays of shape (n, 3): until `SETTLED` of it is left."""
    residual = right - apply(x)
    direction = better = precondition(residual)
    size = float((residual * better).sum())
    enough = SETTLED * np.linalg.norm(right)
    for _ in range(steps):
        image = apply(direction)
        curvature = float((direction * image).sum())
        if curvature <= 0:
            break
        x = x + size / curvature * direction
        residual = residual - size / curvature * image
        if np.linalg.norm(residual) < enough:
            break
        better = precondition(residual)
        before, size = size, float((residual * better).sum())
        direction = better + size / before * direction
    return x
