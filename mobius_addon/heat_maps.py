"""Heat maps: figures at vertices as colors, of a flattening or of the map between two surfaces, and their legends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from bpy.app.translations import pgettext_n as n_

from ..solver import Correspondence, Flattening, TriangleMesh
from ..solver.flatten.distortion import dilatations, log_conformal_factor
from ..solver.surface.mesh import Booleans, Complexes, Floats

WORST_DILATATION = 2.0
"""Where the scale of the dilatation ends: the larger stretch is twice the smaller one."""

LARGEST_FACTOR = 4.0
"""Where the scale of the conformal factor ends, both ways: lengths four times or a quarter of the average."""

# sRGB, from dark to light and even steps between, so that they are told apart without hues too
SEQUENTIAL = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)]) / 255
DIVERGING = np.array([(33, 102, 172), (146, 197, 222), (247, 247, 247), (244, 165, 130), (178, 24, 43)]) / 255


def srgb(shares: Floats, stops: Floats) -> Floats:
    """Return the colors, (n, 3), at places on a scale, (n,) in [0, 1], with evenly spaced stops, (k, 3)."""
    places = np.linspace(0, 1, len(stops))
    return np.stack([np.interp(shares, places, channel) for channel in stops.T], axis=1)


@dataclass(frozen=True)
class Measure:
    """One thing to see as colors.

    Attributes
    ----------
    identifier, label, description : str
        For the operator's enumeration; the description says what the colors mean.
    attribute : str
        Name of the color attribute.
    shares : callable
        Returns where on the scale each vertex is, (n,), 0 to 1; nan at vertices without a value. Takes a `Flattening`,
        or for maps between surfaces a `Correspondence` and the meshes of source and target.
    stops : (k, 3) float64
        The scale's sRGB colors, evenly spaced.
    title : str
        What stands above the legend.
    ticks : tuple of str
        What the scale's values mean, evenly spaced from its begin to its end.
    """

    identifier: str
    label: str
    description: str
    attribute: str
    shares: Callable[..., Floats]
    stops: Floats
    title: str
    ticks: tuple[str, ...]

    def color(self, *of: Flattening | Correspondence | TriangleMesh) -> tuple[Floats, Booleans]:
        """Return linear colors, (n, 4), and which vertices, (n,), have one."""
        shares = self.shares(*of)
        known = np.isfinite(shares)
        color = srgb(np.where(known, shares, 0), self.stops)
        linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
        return np.concatenate([linear, np.ones((len(linear), 1))], axis=1), known


def vertex_dilatations(mesh: TriangleMesh, image: Complexes | Floats) -> Floats:
    """Return the dilatation at each vertex, (n,), >= 1: the mean of the faces around it by area; nan without any."""
    # on the scale's range, so that one collapsed face does not hide the rest
    dilatation = np.minimum(dilatations(mesh, image), 10 * WORST_DILATATION)
    weight = np.where(np.isfinite(dilatation), mesh.face_areas, 0)
    n, corners = len(mesh.vertices), mesh.faces.ravel()
    total = np.bincount(corners, np.repeat(np.nan_to_num(dilatation) * weight, 3), minlength=n)
    around = np.bincount(corners, np.repeat(weight, 3), minlength=n)
    return np.divide(total, around, out=np.full(n, np.nan), where=around > 0)


def _on_dilatation_scale(dilatation: Floats) -> Floats:
    return np.clip(np.log(dilatation) / np.log(WORST_DILATATION), 0, 1)


def _on_factor_scale(log_factor: Floats) -> Floats:
    return np.clip(0.5 + 0.5 * log_factor / np.log(LARGEST_FACTOR), 0, 1)


def _dilatation_of_disc(flattening: Flattening) -> Floats:
    return _on_dilatation_scale(vertex_dilatations(flattening.mesh, flattening.disc))


def _factor_of_disc(flattening: Flattening) -> Floats:
    mesh = flattening.mesh
    return _on_factor_scale(log_conformal_factor(mesh, flattening.disc) - 0.5 * np.log(np.pi / mesh.area))


def _confidence(found: Correspondence, _source: TriangleMesh, _target: TriangleMesh) -> Floats:
    return np.where(found.face >= 0, found.confidence, np.nan)


def _places(found: Correspondence, source: TriangleMesh) -> Floats:
    """Return the point on the source of each target vertex, (n_target, 3); nan where there is none."""
    return np.where((found.face >= 0)[:, None], found.matrix() @ source.vertices, np.nan)


def _dilatation_of_map(found: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Floats:
    return _on_dilatation_scale(vertex_dilatations(target, _places(found, source)))


def _factor_of_map(found: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Floats:
    factor = log_conformal_factor(target, _places(found, source))
    known = np.isfinite(factor)
    # by area, so that the average does not depend on the triangulation
    average = np.average(factor[known], weights=target.vertex_areas[known]) if known.any() else 0.0
    return _on_factor_scale(factor - average)


_ANGLE_TICKS = ("1", f"{WORST_DILATATION**0.5:.1f}", f"≥ {WORST_DILATATION:g}")
_SIZE_TICKS = (f"≤ 1/{LARGEST_FACTOR:g}", "1", f"≥ {LARGEST_FACTOR:g}")

DISC_MEASURES = (
    Measure(
        "dilatation",
        "Angles",
        "Quasi-conformal dilatation, the larger over the smaller stretch: dark violet where angles are kept (1), "
        f"green at {WORST_DILATATION**0.75:.1f}, yellow from {WORST_DILATATION:g} on",
        "Mobius Disc Angles",
        _dilatation_of_disc,
        SEQUENTIAL,
        n_("Angles: ratio of stretches"),
        _ANGLE_TICKS,
    ),
    Measure(
        "factor",
        "Sizes",
        "Conformal factor, how much lengths grow: white as on average, "
        f"red {LARGEST_FACTOR:g} times as long or more, blue a quarter as long or less",
        "Mobius Disc Sizes",
        _factor_of_disc,
        DIVERGING,
        n_("Sizes: factor of lengths"),
        _SIZE_TICKS,
    ),
)
"""What can be seen of the map from a surface to its disc."""

MAP_MEASURES = (
    Measure(
        "confidence",
        "Confidence",
        "How well the surfaces agree at corresponding points, from 0 (dark violet) to 1 (yellow); "
        "points count as matched from 0.5 on",
        "Mobius Confidence",
        _confidence,
        SEQUENTIAL,
        "Confidence",
        ("0", "0.5", "1"),
    ),
    Measure(
        "dilatation",
        "Angles",
        "Conformal distortion, the larger over the smaller stretch from target to source: "
        f"dark violet where angles are kept (1), yellow from {WORST_DILATATION:g} on",
        "Mobius Map Angles",
        _dilatation_of_map,
        SEQUENTIAL,
        n_("Angles: ratio of stretches"),
        _ANGLE_TICKS,
    ),
    Measure(
        "factor",
        "Sizes",
        "Conformal factor, how lengths change from target to source: white as on average, "
        f"red {LARGEST_FACTOR:g} times as long or more, blue a quarter as long or less",
        "Mobius Map Sizes",
        _factor_of_map,
        DIVERGING,
        n_("Sizes: factor of lengths"),
        _SIZE_TICKS,
    ),
)
"""What can be seen of the map between two aligned surfaces."""


def shown_by(attribute: str) -> Measure | None:
    """Return the measure that a color attribute of this name shows."""
    return next((x for x in (*MAP_MEASURES, *DISC_MEASURES) if x.attribute == attribute), None)


def measure(identifier: str, among: tuple[Measure, ...]) -> Measure:
    """Return the measure of this identifier."""
    return next(x for x in among if x.identifier == identifier)
