"""The Möbius transformation improved on all vertices: where the descriptors of the two surfaces agree best."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..flatten.domain import Domain
from ..flatten.flatten import Flattening
from ..flatten.locate import TriangulatedDisc
from ..flatten.sphere import Flat
from ..surface.mesh import Floats, Integers, Places
from ..surface.sampling import HORIZON
from .deep_ends import end_to_end

MOST_VERTICES = 3000
"""Of larger sources every so many-th vertex is used: three parameters need no more."""


def refined(
    mobius: Any,
    source: Flat,
    target: Flat,
    source_descriptors: Floats,
    target_descriptors: Floats,
    scale: float,
    progress: Callable[[float], None] | None = None,
) -> Any:
    """Return the transformation near `mobius` at which the descriptors of all vertices agree best.

    Maximises the area-weighted sum over source vertices of exp(-|d_j - d(f(m_j))|^2 / (2 scale^2)), d on the target
    linear in each triangle, by Gauss and Newton's method with Levenberg's damping; the Gaussian makes it the robust
    (Welsch) fit, so each step weighs a vertex by the term it contributes.

    Parameters
    ----------
    mobius : Mobius or SphereMobius
        Where to begin.
    source, target : Flat
    source_descriptors, target_descriptors : (n, d) float64
        Standardised descriptors of the vertices.
    scale : float
        Standard deviation of the Gaussian.
    progress : callable, optional
        Called before each evaluation with a share of the work, in [0, 1]; may raise to end it.
    """
    used = np.flatnonzero(source.mesh.used)
    used = used[:: -(-len(used) // MOST_VERTICES)]
    share = source.mesh.vertex_areas[used] / source.mesh.vertex_areas[used].sum()
    domain = target.domain
    slopes = domain.gradients(target.places, target.mesh.faces, target_descriptors)
    depth = domain.depth(source.places[used])
    stages = _stages(depth, share)
    for number, seen in enumerate(stages):
        chosen = used[seen]
        mobius = _improved(
            mobius,
            source.places[chosen],
            source_descriptors[chosen],
            share[seen],
            domain,
            target.triangles,
            target_descriptors,
            slopes,
            scale,
            None if progress is None else lambda done, n=number: progress((n + done) / len(stages)),
        )
    if not (isinstance(source, Flattening) and isinstance(target, Flattening)):
        return mobius
    met = end_to_end(mobius, source, target)

    def value(trial: Any) -> float:
        face, barycentric = target.triangles.locate(trial(source.places[used]))
        there = np.einsum("qk,qkd->qd", barycentric, target_descriptors[target.triangles.faces[face]])
        apart = ((source_descriptors[used] - there) ** 2).sum(axis=1)
        return float((share * np.exp(-apart / (2 * scale**2))).sum())

    return met if met is not None and value(met) > value(mobius) else mobius


def _stages(depth: Floats, share: Floats) -> list[Integers]:
    """Return the points to use one stage after another, the last time all: (k,) int each.

    The nearer a point lies to the rim, the farther it moves for a small change of the transformation, so what is far
    inside comes first and brings the rest into reach. There is one stage where less than a hundredth of the area lies
    outside the search's horizon: surfaces about as wide as long.

    Parameters
    ----------
    depth : (n,) float64
        Distance of each point from the rim.
    share : (n,) float64
        Of the area.
    """
    stages, reach = [], 1 - HORIZON
    inside = depth > 1e-9  # the boundary's own vertices are only in the last stage
    while share[inside & (depth < reach)].sum() > 0.01:
        stages.append(np.flatnonzero(depth >= reach))
        reach /= 4
    return [*stages, np.arange(len(depth))]


def _improved(
    mobius: Any,
    points: Places,
    expected: Floats,
    weights: Floats,
    domain: Domain,
    disc: TriangulatedDisc,
    target_descriptors: Floats,
    slopes: Places,
    scale: float,
    progress: Callable[[float], None] | None,
) -> Any:
    """Return the transformation near `mobius` at which the descriptors of the given source points agree best."""
    faces = disc.faces

    def agreement(trial: Any, near: Integers | None = None) -> tuple[float, Places, Integers, Floats, Floats]:
        place = trial(points)
        face, barycentric = disc.locate(place, near)
        residual = expected - np.einsum("qk,qkd->qd", barycentric, target_descriptors[faces[face]])
        term = weights * np.exp(-(residual**2).sum(axis=1) / (2 * scale**2))
        return float(term.sum()), place, face, residual, term

    value, place, face, residual, term = agreement(mobius)
    damping = 1e-4
    for step_number in range(30):
        jacobian = domain.jacobian(place, slopes[face])
        weighted = jacobian * term[:, None, None]
        normal = np.einsum("qdp,qdr->pr", weighted, jacobian)
        force = np.einsum("qdp,qd->p", weighted, residual)
        while damping < 1e6:
            if progress:
                progress(step_number / 30)
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)) + 1e-12 * np.eye(len(force)), force)
            step *= min(1.0, 0.1 / max(float(np.abs(step).max()), 1e-300))
            trial = domain.near_identity(step) @ mobius
            found = agreement(trial, face)
            if found[0] > value:
                break
            damping *= 10
        else:
            return mobius
        gain = found[0] - value
        mobius, damping = trial, max(damping / 10, 1e-6)
        value, place, face, residual, term = found
        if gain < 1e-5 * value:
            break
    return mobius
