"""The pictures of the guide and the README that show Blender's window, from what the window's tests have left.

MOBIUS_WINDOW=1 MOBIUS_SHOTS=shots uv run pytest tests/window -k sid
uv run --group bench python -m release.pictures shots/sid
"""

import sys
from pathlib import Path

from PIL import Image

from .guide import DOCS

PICTURES = {
    "panel.png": ("shown.png", (0, 28, 1312, 1182)),
    "guide-pairs.png": ("point-pairs.png", (0, 28, 1312, 1182)),
    "overlay.png": ("discs.png", (0, 28, 1312, 1182)),
}
"""By name in docs: which picture of the tests, and which part of it: the viewport, left, top, right and bottom."""

WIDTH = 990


def make(shots: Path) -> None:
    """Cut the pictures out of those that are there, as small as they look well."""
    for name, (shot, box) in PICTURES.items():
        path = shots / shot
        if path.is_file():
            whole = Image.open(path).convert("RGB").crop(box)
            small = whole.resize((WIDTH, round(WIDTH * whole.height / whole.width)), Image.Resampling.LANCZOS)
            small.save(DOCS / name, optimize=True)


if __name__ == "__main__":
    make(Path(sys.argv[1]))
