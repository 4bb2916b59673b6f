"""Whether a map can be believed, in one word: the one place that decides, for panel, command line and collections.

A pure function of how sure the map is where it claims anything, of how much of the target it matches, and of the
sentences that `align` says beside it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .alignment import Alignment
from .confidence import MATCHED
from .diagnosis import CROPPED
from .reconsider import DOUBTFUL, FITS

Level = Literal["good", "check", "doubtful"]

ENOUGH = 1 - CROPPED
"""Share of the target that has to be matched for a map to be called good: as far as cropped scans came out right."""

_KINDS: tuple[tuple[str, str], ...] = (
    ("note", r"for the computation only$"),
    ("note", r"no counterpart on '.*'(: vertex groups and shape keys come from the surface next to them.*)?$"),
    ("note", r"(: the piece that fits was found, .* where it was cut|a piece of .* of its area; the rest has no)"),
    ("note", r"^partial overlap: "),
    ("doubtful", r"^doubtful: "),
    ("orientation", r"^ambiguous orientation"),
    ("rival", r"^ambiguous: "),
    ("unproved", r"^not proved optimal"),
    ("reconsidered", r"^reconsidered: "),
    ("other parts", r"^the largest parts do not belong together"),
    ("landmarks", r" on a boundary or in no face left out$"),
    ("coarse", r" is coarse, with "),
    ("one way", r"^only one orientation was searched"),
    ("steps", r" has coordinates too coarse for its details"),
    ("rough", r" is rough or noisy"),
    ("slit", r" is cut open along edges: "),
    ("spike", r" has vertices far off the surface: "),
    ("handle", r" has handles, as a cup has: "),
    ("unsure", r"^unsure: "),
    ("narrow", r" is long and narrow: "),
    ("deep", r" is deep, .* hardly any room in a disc"),
    ("cropped", r"^the surfaces have little in common"),
    ("unlike", r"^curvatures differ by "),
)
"""Kinds of sentences, causes named as `diagnosis.Cause.kind`; the first pattern that is found counts.

How much is missing, which "partial overlap" tells, counts as coverage.
"""

_PREFIX = re.compile(r"^(in the overlap: |doubtful, perhaps because )+")


@dataclass(frozen=True)
class Concern:
    """One sentence about a map, and its kind.

    Attributes
    ----------
    kind : str
        "note" for what was merely done, a kind of `_KINDS`, or "other".
    text : str
        The sentence, without what leads to it.
    """

    kind: str
    text: str


@dataclass(frozen=True)
class Judgement:
    """How far a map can be believed.

    Attributes
    ----------
    level : "good", "check" or "doubtful"
        Good: nothing speaks against it. Check: something is open, so look before it is used. Doubtful: more likely
        wrong than right.
    concerns : tuple of Concern
        What speaks against it, each once.
    notes : tuple of str
        What was done, which speaks for or against nothing.
    """

    level: Level
    concerns: tuple[Concern, ...]
    notes: tuple[str, ...]


def concern(warning: str) -> Concern:
    """Return a warning of `align` with its kind."""
    text = _PREFIX.sub("", warning)
    return Concern(next((kind for kind, pattern in _KINDS if re.search(pattern, text)), "other"), text)


def judged(confidence: float, coverage: float, warnings: Iterable[str]) -> Judgement:
    """Return how far a map can be believed.

    Parameters
    ----------
    confidence : float
        Mean confidence where the map claims anything: `Alignment.mean_confidence`.
    coverage : float
        Share of the target, or of the piece of it that was to be matched, that is matched.
    warnings : iterable of str
        `Alignment.warnings`.

    >>> judged(0.96, 0.99, ["'Head': 1 opening (12 edges) closed, for the computation only"]).level
    'good'
    >>> judged(0.96, 0.4, []).level
    'check'
    >>> judged(0.4, 0.99, []).level
    'doubtful'
    """
    found = list(dict.fromkeys(concern(said) for said in warnings))
    concerns = tuple(one for one in found if one.kind != "note")
    if confidence <= DOUBTFUL or coverage <= 0 or any(one.kind == "doubtful" for one in concerns):
        level: Level = "doubtful"
    elif confidence < FITS or coverage < ENOUGH or concerns:
        level = "check"
    else:
        level = "good"
    return Judgement(level, concerns, tuple(one.text for one in found if one.kind == "note"))


def judge(found: Alignment) -> Judgement:
    """Return how far an alignment can be believed: `judged` of its main parts."""
    return judged(found.mean_confidence, coverage(found), found.warnings)


def coverage(found: Alignment) -> float:
    """Return the share of the aligned target's area that is matched."""
    areas = found.target.mesh.vertex_areas
    return float(areas[np.asarray(found.confidence >= MATCHED)].sum() / areas.sum())
