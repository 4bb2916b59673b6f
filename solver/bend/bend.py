"""Beyond Möbius: the target bent onto the source, smoothly, until the surfaces meet in position and normal.

The Möbius map says where everything goes, roughly but whatever the pose; the bending then finds the places more
accurately than a conformal map can. It is a non-rigid closest point method: distances to tangent planes let the
surfaces slide along each other, and the resistance of a thin plate, relaxed from stiff to soft, decides how they slide.

Lengths are in roots of the source's area. The constants were chosen by the mean errors over eleven pairs of faces and
teeth (tests/bench/correspondence measures more). Tried without gain: springs along the slopes of the descriptors, whose
differences between people say less than the surfaces do; springs back from the source; twice the rounds or nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..flatten.sphere import Flat
from ..mobius import Mobius, SphereMobius
from ..surface.barycentric import interpolated
from ..surface.mesh import Booleans, Floats, Places, TriangleMesh
from .coarse import coarse
from .draft import DRAFT_ROUNDS, ROUNDS, SOFTEST, STIFFEST, Draft, drafted, lengths
from .least_moved import unfolded
from .noise import shortest
from .plate import RIM_REACH, SOLVER_STEPS, TENSION, relaxed
from .unfold_sphere import injective_on_sphere

FINE_NODES = 6000
"""Target vertices of the last rounds, which put right what depends on single triangles (folds fall to a half)."""

FINEST, FINE_ROUNDS = 0.01, 3
"""The least such wavelength after the draft: two and a half distances between nodes, which carry no shorter waves.
Noise makes it longer (`noise.shortest`)."""


@dataclass(frozen=True, eq=False)
class Bending:
    """The target bent onto the source.

    Attributes
    ----------
    carried : (n,) complex128
        Where each target vertex goes in the source's disc; nan at vertices in no face.
    offset : (n,) float64
        How far from the source the bent vertex remains, in roots of the source's area.
    repaired : int
        Vertices that were moved so that no triangle is folded.
    """

    carried: Places
    offset: Floats
    repaired: int


def finished(
    draft: Draft,
    source: Flat,
    target: Flat,
    alike: Booleans | None = None,
    progress: Callable[[float], None] | None = None,
    reach: float = RIM_REACH,
) -> Bending:
    """Bend a draft the rest of the way.

    Parameters
    ----------
    draft : Draft
    source, target : Flat
        As for `drafted`.
    alike : (n,) bool, optional
        Target vertices that are drawn to the source's boundaries where they are on a boundary themselves; not those
        along which the target alone was cut. Default: all.
    progress : callable, optional
        Called with the share of the work done, in [0, 1]; may raise to end it.
    reach : float
        How far boundaries are drawn to each other, in roots of the source's area.

    Returns
    -------
    Bending
        Keeps the orientation of every triangle in the source's disc.
    """
    tell = progress or (lambda _: None)
    onto, unbent, flat, few, conformal = draft.onto, draft.unbent, draft.flat, draft.few, draft.conformal
    drawn = np.ones(len(target.places), bool) if alike is None else alike
    used = np.flatnonzero(target.mesh.used)
    order = [0, 2, 1] if (draft.whole.faces != target.mesh.faces).any() else [0, 1, 2]
    finest = max(FINEST, shortest(source, target))
    waves = np.maximum(lengths(STIFFEST, SOFTEST, ROUNDS)[DRAFT_ROUNDS:], finest)
    taut = partial(relaxed, tension=TENSION, steps=SOLVER_STEPS, reach=reach)
    now = taut(draft.rest, draft.now, flat.faces, onto, waves, drawn[few.nodes], lambda share: tell(0.5 * share))

    tell(0.5)
    fine = coarse(target, FINE_NODES, order)
    tell(0.5)
    followed = few.following(flat.vertices, now, unbent)[fine.nodes]
    start = few.following(flat.vertices, draft.rest, unbent)[fine.nodes]
    waves = np.full(FINE_ROUNDS, finest)
    drawn = drawn[fine.nodes]
    now = taut(start, followed, fine.faces, onto, waves, drawn, lambda share: tell(0.5 + 0.3 * share))
    tell(0.8)
    exact = unbent
    if target.exact is not None:  # where smoothing has moved it along the surface it would go astray by as much
        exact = target.exact * ([-1, 1, 1] if order == [0, 2, 1] else [1, 1, 1]) * draft.growth
    all_places = fine.following(unbent[fine.nodes], now, exact)
    if exact is unbent:
        all_places[fine.nodes] = now
    smooth = all_places if exact is unbent else fine.following(unbent[fine.nodes], now, unbent)
    normals = TriangleMesh(smooth, draft.whole.faces).vertex_normals()
    face, barycentric = onto.nearest_point(
        all_places[used], normals[used], progress=lambda share: tell(0.8 + 0.15 * share)
    )
    reached = interpolated(onto.mesh.vertices, source.mesh.faces[face], barycentric)
    offset = np.zeros(len(target.places))
    offset[used] = np.linalg.norm(reached - all_places[used], axis=1)
    carried = conformal.copy()
    carried[used] = source.domain.mean(source.places, source.mesh.faces[face], barycentric)
    tell(0.95)
    faces = target.mesh.faces[:, order]
    if source.domain.closed:
        carried, repaired = injective_on_sphere(carried, conformal, faces, lambda: tell(0.95))
    else:
        vertices = onto.mesh.vertices
        carried, repaired = unfolded(
            carried, conformal, faces, source, target, vertices, all_places, lambda: tell(0.95)
        )
    return Bending(carried, offset, repaired)


def bent(
    mobius: Mobius | SphereMobius,
    source: Flat,
    target: Flat,
    progress: Callable[[float], None] | None = None,
) -> Bending:
    """Bend the target onto the source, all of it: `drafted`, then `finished`."""
    tell = progress or (lambda _: None)
    draft = drafted(mobius, source, target, progress=lambda share: tell(0.4 * share))
    return finished(draft, source, target, progress=lambda share: tell(0.4 + 0.6 * share))
