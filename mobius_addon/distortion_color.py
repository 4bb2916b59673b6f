"""Distortion of a flattening as linear colors on its vertices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..solver import Flattening
from ..solver.distortion import dilatations, log_conformal_factor
from ..solver.mesh import Booleans, Floats

WORST_DILATATION = 2.0
"""Where the scale of the dilatation ends: the larger stretch is twice the smaller one."""

LARGEST_FACTOR = 4.0
"""Where the scale of the conformal factor ends, both ways: lengths four times or a quarter of the average."""

# sRGB, from dark to light and even steps between, so that they are told apart without hues too
_SEQUENTIAL = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)]) / 255
_DIVERGING = np.array([(33, 102, 172), (146, 197, 222), (247, 247, 247), (244, 165, 130), (178, 24, 43)]) / 255


@dataclass(frozen=True)
class Measure:
    """One way to see distortion.

    Attributes
    ----------
    identifier, label, description : str
        For the operator's enumeration; the description says what the colors mean.
    shares : callable
        Returns where on the scale each vertex of a flattening is, (n,), 0 to 1; nan at vertices in no face.
    stops : (k, 3) float64
        The scale's sRGB colors, evenly spaced.
    """

    identifier: str
    label: str
    description: str
    shares: Callable[[Flattening], Floats]
    stops: Floats

    def color(self, flattening: Flattening) -> tuple[Floats, Booleans]:
        """Return linear colors, (n, 4), and which vertices, (n,), have one."""
        shares = self.shares(flattening)
        known = np.isfinite(shares)
        places = np.linspace(0, 1, len(self.stops))
        at = np.where(known, shares, 0)
        srgb = np.stack([np.interp(at, places, channel) for channel in self.stops.T], axis=1)
        linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
        return np.concatenate([linear, np.ones((len(linear), 1))], axis=1), known


def vertex_dilatations(flattening: Flattening) -> Floats:
    """Return the dilatation at each vertex, (n,), >= 1: the mean of the faces around it by area; nan without any."""
    mesh = flattening.mesh
    # on the scale's range, so that one collapsed face does not hide the rest
    dilatation = np.minimum(dilatations(mesh, flattening.disc), 10 * WORST_DILATATION)
    weight = np.where(np.isfinite(dilatation), mesh.face_areas, 0)
    n, corners = len(mesh.vertices), mesh.faces.ravel()
    total = np.bincount(corners, np.repeat(np.nan_to_num(dilatation) * weight, 3), minlength=n)
    around = np.bincount(corners, np.repeat(weight, 3), minlength=n)
    return np.divide(total, around, out=np.full(n, np.nan), where=around > 0)


def _dilatation_shares(flattening: Flattening) -> Floats:
    return np.clip(np.log(vertex_dilatations(flattening)) / np.log(WORST_DILATATION), 0, 1)


def _factor_shares(flattening: Flattening) -> Floats:
    mesh = flattening.mesh
    factor = log_conformal_factor(mesh, flattening.disc) - 0.5 * np.log(np.pi / mesh.area)
    return np.clip(0.5 + 0.5 * factor / np.log(LARGEST_FACTOR), 0, 1)


MEASURES = (
    Measure(
        "dilatation",
        "Angles",
        "Quasi-conformal dilatation, the larger over the smaller stretch: dark violet where angles are kept (1), "
        f"green at {WORST_DILATATION**0.75:.1f}, yellow from {WORST_DILATATION:g} on",
        _dilatation_shares,
        _SEQUENTIAL,
    ),
    Measure(
        "factor",
        "Sizes",
        "Conformal factor, how much lengths grow: white as on average, "
        f"red {LARGEST_FACTOR:g} times as long or more, blue a quarter as long or less",
        _factor_shares,
        _DIVERGING,
    ),
)
