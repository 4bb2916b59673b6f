"""One pair of prepared specimens: aligned, measured, and told in plain figures."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from ..align.judgement import Judgement, coverage, judged
from ..align.result.alignment import Alignment
from ..align.surfaces.remark import Remark
from ..mobius import Mobius, SphereMobius, as_plain, from_plain
from .distance import EvenFlow, continuous_procrustes


@dataclass(frozen=True)
class Figures:
    """What is known of a pair.

    Attributes
    ----------
    value, upper_bound : float
        Q of the map, and what no other in its orientation exceeds.
    certified : bool
        Whether the two are the same, and this the map gone on with.
    samples : int
        What Q is at most.
    mobius : Mobius or SphereMobius
        The map from the source's disc or sphere to the target's: of what was aligned, which may be pieces of them.
    mean_confidence : float
        Where the map claims anything.
    coverage : float
        Share of the target that is matched.
    distance : float
        Continuous Procrustes distance by this map.
    dense : bool
        Whether the map was bent beyond Möbius.
    written : bool
        Whether it is in a file: a dense one, and one of other discs than the specimens were prepared with.
    seconds : float
        Of one processor.
    remarks : tuple of Remark
    """

    value: float
    upper_bound: float
    certified: bool
    samples: int
    mobius: Mobius | SphereMobius
    mean_confidence: float
    coverage: float
    distance: float
    dense: bool
    written: bool
    seconds: float
    remarks: tuple[Remark, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be known of the map, each a sentence."""
        return tuple(one.sentence for one in self.remarks)

    @property
    def judgement(self) -> Judgement:
        """How far the map can be believed, by itself."""
        return judged(self.mean_confidence, self.coverage, self.remarks)

    @property
    def cost(self) -> float:
        """Share of the samples that did not match, in [0, 1]: what a spanning tree is minimal in."""
        return 1 - self.value / self.samples

    def plain(self) -> dict[str, Any]:
        """Return the figures as JSON-ready data."""
        return {**vars(self), "mobius": as_plain(self.mobius), "remarks": [asdict(one) for one in self.remarks]}

    @staticmethod
    def read(data: dict[str, Any]) -> Figures:
        """Return the figures from what `plain` gave."""
        remarks = tuple(Remark(**one) for one in data["remarks"])
        return Figures(**{**data, "mobius": from_plain(data["mobius"]), "remarks": remarks})


def figures(alignment: Alignment, flow: EvenFlow, seconds: float, *, written: bool) -> Figures:
    """Return what is known of a pair that was aligned; `flow` is that of its source."""
    decisive = alignment if alignment.overlap is None else alignment.overlap.alignment
    distance = continuous_procrustes(
        flow,
        alignment.target,
        alignment.located,
        mirrored=alignment.mobius.reflected,
        points=alignment.target_samples[: alignment.settings.targets],
    )
    return Figures(
        value=alignment.value,
        upper_bound=alignment.search.upper_bound,
        certified=alignment.certified,
        samples=len(alignment.source_samples),
        mobius=alignment.mobius,
        mean_confidence=alignment.mean_confidence,
        coverage=coverage(alignment),
        distance=distance,
        dense=decisive.bending is not None,
        written=written,
        seconds=seconds,
        remarks=alignment.remarks,
    )
