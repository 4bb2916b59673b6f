"""The Möbius transformation improved on all vertices: where the descriptors of the two surfaces agree best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...flatten.domain import Domain
from ...flatten.flatten import Flattening
from ...flatten.locate import TriangulatedDisc
from ...flatten.sphere import Flat
from ...surface.barycentric import weighted
from ...surface.mesh import Floats, Integers, Places
from ...surface.sampling import HORIZON
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

    def agreement(some: Integers) -> _Agreement:
        return _Agreement(
            source.places[used[some]],
            source_descriptors[used[some]],
            share[some],
            target.triangles,
            target_descriptors,
            scale,
        )

    for number, seen in enumerate(stages):
        tell = None if progress is None else lambda done, n=number: progress((n + done) / len(stages))
        mobius = _improved(mobius, agreement(seen), domain, slopes, tell)
    if not (isinstance(source, Flattening) and isinstance(target, Flattening)):
        return mobius
    met = end_to_end(mobius, source, target)
    of_all = agreement(stages[-1])
    return met if met is not None and of_all.at(met)[0] > of_all.at(mobius)[0] else mobius


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


@dataclass(frozen=True, eq=False)
class _Agreement:
    """How well descriptors of source points, at places of its domain, agree with the target's where they are taken."""

    points: Places
    expected: Floats
    weights: Floats
    disc: TriangulatedDisc
    target_descriptors: Floats
    scale: float

    def at(self, trial: Any, near: Integers | None = None) -> tuple[float, Places, Integers, Floats, Floats]:
        """Return the sum that is maximised; the points' images and triangles, what descriptors differ by, the terms."""
        place = trial(self.points)
        face, barycentric = self.disc.locate(place, near)
        there = self.target_descriptors[self.disc.faces[face]]
        residual = self.expected - weighted(there, barycentric)
        term = self.weights * np.exp(-(residual**2).sum(axis=1) / (2 * self.scale**2))
        return float(term.sum()), place, face, residual, term


def _improved(
    mobius: Any, agreement: _Agreement, domain: Domain, slopes: Places, progress: Callable[[float], None] | None
) -> Any:
    """Return the transformation near `mobius` at which the descriptors of the given source points agree best."""
    value, place, face, residual, term = agreement.at(mobius)
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
            found = agreement.at(trial, face)
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
