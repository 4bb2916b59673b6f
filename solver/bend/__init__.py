"""Beyond Möbius: the target bent onto the source, smoothly, until the surfaces meet in position and normal.

From a Möbius map come pose, scale and coarse bend; closest points and a plate that softens do the rest, without folds.
"""

from .bend import Bending, bent, finished
from .draft import Draft, drafted

__all__ = ["Bending", "Draft", "bent", "drafted", "finished"]
