"""The extension's icon, as the extensions platform takes it beside the zip: 256 by 256 texels, transparent around.

    uv run --group bench python -m release.icon

A disc with rings and rays, carried by a Möbius map of the disc: what the extension is about, drawn by its own maps.
"""

from pathlib import Path

import numpy as np
from PIL import Image

from solver.mobius import Mobius

PATH = Path(__file__).parents[1] / "docs" / "icon.png"
SIDE = 256
FINER = 4
"""So many texels are drawn for each one of the icon, and averaged."""

RINGS, RAYS = 5, 16
HUES = np.array([[0.16, 0.47, 0.86], [0.95, 0.55, 0.16]])
"""Blue and orange, told apart by everybody."""


def icon() -> np.ndarray:
    """Return the icon, (256, 256, 4) uint8."""
    side = SIDE * FINER
    x, y = np.meshgrid(np.linspace(-1.04, 1.04, side), np.linspace(1.04, -1.04, side))
    place = x + 1j * y
    inside = np.abs(place) <= 1
    there = Mobius(0.42 * np.exp(0.6j), 0.3)(np.where(inside, place, 0))
    # rings of one hyperbolic width, cut by rays: a chequered disc
    ring = np.floor(RINGS * np.arctanh(np.minimum(np.abs(there), 1 - 1e-9)) / np.arctanh(0.97))
    ray = np.floor(RAYS * (np.angle(there) / (2 * np.pi) + 0.5))
    odd = ((ring + ray) % 2).astype(bool)
    share = np.clip(np.abs(there), 0, 1)[..., None]
    color = (1 - share) * HUES[1] + share * HUES[0]
    color = np.where(odd[..., None], color, 0.25 * color + 0.75)
    alpha = inside.astype(float)[..., None]
    drawn = np.concatenate([color * alpha, alpha], axis=2)
    mean = drawn.reshape(SIDE, FINER, SIDE, FINER, 4).mean(axis=(1, 3))
    mean[..., :3] /= np.maximum(mean[..., 3:], 1e-9)
    return np.round(255 * mean).astype(np.uint8)


if __name__ == "__main__":
    Image.fromarray(icon()).save(PATH, optimize=True)
