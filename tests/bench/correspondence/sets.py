"""The sets of pairs by name."""

from collections.abc import Callable, Iterator

from . import kinds
from .pairs import (
    BRAIN,
    HARD_TEETH,
    ICT,
    SIMPOP,
    TEETH,
    Pair,
    bent,
    brain,
    cropped,
    ict,
    ict_open,
    of_kind,
    one_open,
    partial,
    simpop,
    tooth,
)
from .store import Store
from .trimmed import trimmed

SETS: dict[str, Callable[[Store, int | None], Iterator[Pair]]] = {
    "simpop": of_kind("simpop", SIMPOP, simpop, True, "faces_simpop/SIMPOP_01.obj"),
    "ict": of_kind("ict", ICT, ict, True, "faces_ict/ict_ground_truth.json"),
    "simpop-moved": of_kind("simpop-moved", SIMPOP, simpop, True, "faces_simpop/SIMPOP_01.obj", True),
    "ict-moved": of_kind("ict-moved", ICT, ict, True, "faces_ict/ict_ground_truth.json", True),
    "ict-open": of_kind("ict-open", ICT, ict_open, True, "faces_ict/ict_ground_truth.json"),
    "one-open": one_open,
    "teeth": of_kind("teeth", TEETH, tooth, False, "teeth/landmarks.json"),
    "hard-teeth": of_kind("hard-teeth", HARD_TEETH, tooth, False, "teeth/landmarks.json"),
    "brain": of_kind("brain", BRAIN, brain, True, "brain/conte69_L_cortex.obj"),
    "bent": bent,
    "partial": partial,
    "cropped": cropped,
    "trimmed": trimmed,
    "bodyparts": kinds.bodyparts,
    "noise": kinds.noisy,
    "depth": kinds.depth_scans,
    "coarse": kinds.coarse,
}
"""Each set by its name: pairs in both directions, of the first `count` if given."""
