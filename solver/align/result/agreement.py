"""How well two surfaces agree at the points that a map brings together: in descriptors and in local scale."""

from __future__ import annotations

import numpy as np

from ...flatten.distortion import log_conformal_factor
from ...flatten.sphere import Flat
from ...mobius import Mobius, SphereMobius
from ...surface.barycentric import interpolated
from ...surface.mesh import Floats, Integers, Places
from ...surface.statistics import weighted_median

STRETCH = 0.3
"""Standard deviation of the log of how much a right map stretches lengths, beyond the surfaces' difference in size: on
pairs of faces and teeth that show the same piece it is 0.05 to 0.25."""


def descriptor_distance(
    source: Flat, source_descriptors: Floats, target_descriptors: Floats, face: Integers, barycentric: Floats
) -> Floats:
    """Return the distance, (q,), of descriptors of target points, (q, d), from those at points of the source."""
    there = interpolated(source_descriptors, source.mesh.faces[face], barycentric)
    return np.sqrt(((there - target_descriptors) ** 2).sum(axis=1))


def log_stretch(
    source: Flat, target: Flat, carried: Places, face: Integers, barycentric: Floats, used: Integers
) -> Floats:
    """Return the log of length on the source over length on the target around target vertices `used`, (q,).

    Parameters
    ----------
    source, target : Flat
    carried : (n,) complex128
        Where each target vertex goes in the source's disc.
    face, barycentric : (q,) int, (q, 3) float64
        The same for `used`, in the source's triangles.
    used : (q,) int
    """
    source_factor = log_conformal_factor(source.mesh, source.places)
    carried_factor = log_conformal_factor(target.mesh, carried)[used]
    return carried_factor - interpolated(source_factor, source.mesh.faces[face], barycentric)


def trust(
    mobius: Mobius | SphereMobius,
    source: Flat,
    target: Flat,
    source_descriptors: Floats,
    target_descriptors: Floats,
    scale: float,
) -> Floats:
    """Return how far a Möbius map is to be believed at each target vertex, (n,), in (0, 1].

    Where the surfaces show different pieces it is wrong near the cuts, and there descriptors disagree and lengths are
    stretched. 1e-3 at vertices in no face.

    Parameters
    ----------
    mobius : Mobius
        From the source's disc to the target's.
    source, target : Flat
    source_descriptors, target_descriptors : (n, d) float64
        Standardised descriptors of the vertices.
    scale : float
        Standard deviation of the Gaussian that weighs their differences.
    """
    used = np.flatnonzero(target.mesh.used)
    carried = target.domain.nowhere(len(target.places))
    carried[used] = mobius.inverse()(target.places[used])
    face, barycentric = source.triangles.locate(carried[used])
    distance = descriptor_distance(source, source_descriptors, target_descriptors[used], face, barycentric)
    agreement = np.exp(-(distance**2) / (2 * scale**2))
    stretch = log_stretch(source, target, carried, face, barycentric, used)
    stretch -= weighted_median(stretch, agreement + 1e-9)
    result = np.full(len(target.places), 1e-3)
    result[used] += (1 - 1e-3) * agreement * np.exp(-(stretch**2) / (2 * STRETCH**2))
    return result
