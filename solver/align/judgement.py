"""Whether a map can be believed, in one word: the one place that decides, for panel, command line and collections.

A pure function of how sure the map is where it claims anything, of how much of the target it matches, and of the
remarks that `align` makes beside it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from .diagnosis import CROPPED
from .doubt.decision import FITS
from .result.alignment import Alignment
from .result.confidence import DOUBTFUL, MATCHED
from .surfaces.remark import Kind, Remark

Level = Literal["good", "check", "doubtful"]

ENOUGH = 1 - CROPPED
"""Share of the target that has to be matched for a map to be called good: as far as cropped scans came out right."""

DONE: frozenset[Kind] = frozenset({"done", "no counterpart", "piece", "partial"})
"""Kinds of remarks that speak neither for nor against a map; how much is missing counts as coverage."""


@dataclass(frozen=True)
class Judgement:
    """How far a map can be believed.

    Attributes
    ----------
    level : "good", "check" or "doubtful"
        Good: nothing speaks against it. Check: something is open, so look before it is used. Doubtful: more likely
        wrong than right.
    concerns : tuple of Remark
        What speaks against it, each once, without what leads to it.
    notes : tuple of str
        What was done, which speaks for or against nothing.
    """

    level: Level
    concerns: tuple[Remark, ...]
    notes: tuple[str, ...]


def judged(confidence: float, coverage: float, remarks: Iterable[Remark]) -> Judgement:
    """Return how far a map can be believed.

    Parameters
    ----------
    confidence : float
        Mean confidence where the map claims anything: `Alignment.mean_confidence`.
    coverage : float
        Share of the target, or of the piece of it that was to be matched, that is matched.
    remarks : iterable of Remark
        `Alignment.remarks`.

    >>> judged(0.96, 0.99, [Remark("done", "'Head': 1 opening (12 edges) closed, for the computation only")]).level
    'good'
    >>> judged(0.96, 0.4, []).level
    'check'
    >>> judged(0.4, 0.99, []).level
    'doubtful'
    """
    found = list(dict.fromkeys(replace(remark, before="") for remark in remarks))
    concerns = tuple(one for one in found if one.kind not in DONE)
    if confidence <= DOUBTFUL or coverage <= 0 or any(one.kind == "doubtful" for one in concerns):
        level: Level = "doubtful"
    elif confidence < FITS or coverage < ENOUGH or concerns:
        level = "check"
    else:
        level = "good"
    return Judgement(level, concerns, tuple(one.text for one in found if one.kind in DONE))


def judge(found: Alignment) -> Judgement:
    """Return how far an alignment can be believed: `judged` of its main parts."""
    return judged(found.mean_confidence, coverage(found), found.remarks)


def coverage(found: Alignment) -> float:
    """Return the share of the aligned target's area that is matched."""
    areas = found.target.mesh.vertex_areas
    return float(areas[np.asarray(found.confidence >= MATCHED)].sum() / areas.sum())
