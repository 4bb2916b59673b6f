"""A picture of a map: both surfaces in their discs, or on their spheres, in one frame, with the matched points."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..solver import Alignment
from ..solver.flatten.sphere import Flat
from ..solver.surface.mesh import Floats, Integers
from .studio.materials import flat_material
from .studio.scene import put, render, studio, write
from .studio.shapes import colored_mesh, hues, rings, upright

RELIEF = 0.35
"""How much darker furrows are than ridges, so that one sees the surface on its disc or sphere."""

SPACE, CAPTION = 2.3, 0.3
"""Of each disc or sphere, whose diameter is 2, and of what stands below."""


LONGEST = 28
"""Letters of a name in a caption: half a picture has room for some 60."""


@dataclass(frozen=True, eq=False)
class Side:
    """One surface as it is drawn.

    Attributes
    ----------
    places : (n, 3) float64
        Its vertices on the sphere, or in the disc, upright; both surfaces' in one frame.
    faces : (m, 3) int
    colors : (n, 3) float64
        Linear RGB: where each vertex lies, and furrows darker.
    points : (p, 3) float64
        The matched points among them.
    caption : str
    """

    places: Floats
    faces: Integers
    colors: Floats
    points: Floats
    caption: str


def sides_of(found: Alignment) -> tuple[Side, Side]:
    """Return source and target in the target's frame: the source carried there by the transformation alone."""
    rows, columns = found.matches.T
    shown = (
        (found.source, found.mobius(found.source.places), found.source_samples[rows], found.source_descriptors),
        (found.target, found.target.places, found.target_samples[columns], found.target_descriptors),
    )
    captions = (", carried by the map", f": {len(rows)} of {len(found.source_samples)} points matched")
    first, second = (
        _side(flat, places, some, bends[:, 0], f"{_short(Path(flat.mesh.name).name)}{caption}")
        for (flat, places, some, bends), caption in zip(shown, captions, strict=True)
    )
    return first, second


def _short(name: str) -> str:
    """Return a name that has room below half of a picture."""
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"


def _side(flat: Flat, places: Any, points: Any, bend: Floats, caption: str) -> Side:
    upon = np.nan_to_num(places)
    if flat.domain.closed:
        color = 0.5 + 0.5 * upon
    else:
        color, upon = hues(upon), upright(upon)
    shade = 1 - RELIEF * (0.5 - 0.5 * np.tanh(np.nan_to_num(bend)))
    return Side(upon, flat.mesh.faces, color * shade[:, None], upon[points], caption)


def render_map(found: Alignment, path: Path, *, samples: int = 8) -> None:
    """Render the two discs, or the two spheres from in front and from behind, into a PNG file at `path`.

    Raises
    ------
    Refusal
        The file could not be written.
    """
    closed = found.source.domain.closed
    views = (1.0, -1.0) if closed else (1.0,)
    width = 2 * len(views) * SPACE
    with studio(width, SPACE + CAPTION, samples) as scene:
        for number, side in enumerate(sides_of(found)):
            left = SPACE * len(views) * number - width / 2
            for column, view in enumerate(views):
                turned = np.array([view, view, 1.0])  # by half a turn about the vertical
                middle = (left + SPACE * (column + 0.5), 0.0, CAPTION / 2)
                _put_side(scene, side, turned, middle, closed)
            write(scene, side.caption, (left + SPACE * len(views) / 2, -(SPACE + CAPTION) / 2 + 0.1))
        render(scene, path)


def _put_side(
    scene: bpy.types.Scene, side: Side, turned: Floats, middle: tuple[float, float, float], closed: bool
) -> None:
    """Put a surface into the scene, with those of its points that are on the side of the camera, at y < 0."""
    x, y, z = middle
    surface = colored_mesh(side.places * turned, side.faces, side.colors)
    put(scene, surface, flat_material("Color"), Matrix.Translation((x, y, z)))
    points = side.points * turned
    points = points[points[:, 1] < 0.05] if closed else points
    dots = points[:, 0] + 1j * points[:, 2]
    put(scene, rings(dots, 0.0, 0.022), flat_material(None), Matrix.Translation((x, y - 1.2, z)))
    white = np.ones((len(dots), 3))
    put(scene, rings(dots, 0.0, 0.012, white), flat_material("Color"), Matrix.Translation((x, y - 1.3, z)))
    put(scene, rings(np.zeros(1, complex), 0.995, 1.005), flat_material(None), Matrix.Translation((x, y - 1.1, z)))
