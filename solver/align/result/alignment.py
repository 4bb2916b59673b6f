"""What `align` returns."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...bend.bend import Bending
from ...flatten.sphere import Flat
from ...mobius import Mobius, SphereMobius
from ...search.matching import Objective
from ...search.outcome import SearchResult
from ...search.rival import Rival
from ...surface.mesh import Booleans, Floats, Integers, Places
from ...surface.tidy import Cleaned
from ..surfaces.objective import usual_difference
from ..surfaces.remark import Remark
from ..surfaces.settings import AlignSettings
from .confidence import evidence, probability, unmatched_share
from .overlap import Piece
from .whole import Whole


@dataclass(frozen=True, eq=False)
class Alignment:
    """Two flattened surfaces and the transformation between their discs.

    Attributes
    ----------
    mobius : Mobius
        Carries the source's disc to the target's.
    search : SearchResult
        The certified search that found it; `mobius` may be refined beyond `search.mobius`.
    source, target : Flat
    source_cleaned, target_cleaned : Cleaned or None
        How they were put in order for the computation, and how vertices and triangles relate to those of the meshes as
        they came; None if these were taken as they are. All else here is about vertices of the meshes in order.
    source_samples, target_samples : (N1,), (N2,) int
        Vertices that stood for the surfaces in the search; `matches` index into these.
    source_descriptors, target_descriptors : (n, d) float64
        Standardised descriptors of all vertices.
    objective : Objective
        What was searched: the samples in the discs, match discs and weights.
    settings : AlignSettings
    bending : Bending or None
        Where the target's vertices go in the source's disc when it is bent beyond `mobius`; None if it was not, or not
        as a whole.
    overlap : Overlap or None
        The parts that both surfaces show, aligned by themselves; None if that is all of them, or was not asked.
    counterpart : (n_target,) bool or None
        Which target vertices have a counterpart on the source: those not beyond its boundary; None if it was not asked.
    other : SearchResult or None
        The search in the other orientation; None if only one was searched.
    rival : Rival or None
        The best transformation that maps everything elsewhere; None if it was not searched for.
    taken : Rival or None
        Which rival was gone on with in place of the search's best; None: the best.
    whole : Whole or None
        The other parts of the meshes and what belongs to what there; all else here is about the main parts. None if
        there are no others, or were not asked.
    seconds : dict of str to float
        Wall-clock time per stage.
    remarks : tuple of Remark
        What the user should know, each a sentence with its kind; `warnings` are the sentences.
    causes : tuple of str
        Why the map is doubtful, if it is and that is known: kinds of remarks: see `diagnosis.causes`.
    """

    mobius: Mobius | SphereMobius
    search: SearchResult
    source: Flat
    target: Flat
    source_samples: Integers
    target_samples: Integers
    source_descriptors: Floats
    target_descriptors: Floats
    objective: Objective
    settings: AlignSettings
    bending: Bending | None = None
    overlap: Overlap | None = None
    counterpart: Booleans | None = None
    other: SearchResult | None = None
    rival: Rival | None = None
    taken: Rival | None = None
    whole: Whole | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    remarks: tuple[Remark, ...] = ()
    causes: tuple[str, ...] = ()
    source_cleaned: Cleaned | None = None
    target_cleaned: Cleaned | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know, each a sentence."""
        return tuple(remark.sentence for remark in self.remarks)

    @property
    def margin(self) -> float | None:
        """By how much of the samples the chosen orientation beat the other, at least; None if only one was searched."""
        if self.other is None:
            return None
        most = self.other.value if self.other.out_of_time else self.other.upper_bound
        return (self.search.value - most) / len(self.source_samples)

    @property
    def rival_margin(self) -> float | None:
        """By how much of the samples the winner beats whatever maps everything elsewhere, at least.

        None if that was not looked at, or if time ran out over it: the same pair always has the same margin, or none.
        """
        if self.rival is None or self.rival.out_of_time or self.search.out_of_time:
            return None
        return (self.search.value - self.rival.upper_bound) / len(self.source_samples)

    def annotated(self, **said: Any) -> Alignment:
        """Return it with other `seconds`, `remarks`, `causes` or `whole`; what is known of the map is kept."""
        same = replace(self, **said)
        kept = ("matched_weights", "difference", "carried", "evidence", "confidence", "located")
        same.__dict__.update({name: self.__dict__[name] for name in kept if name in self.__dict__})
        return same

    @property
    def value(self) -> float:
        """Q of the search's map that was gone on with."""
        return (self.taken or self.search).value

    @property
    def matches(self) -> Integers:
        """Its matches, (k, 2): rows of `source_samples` and `target_samples`."""
        return (self.taken or self.search).matches

    @property
    def certified(self) -> bool:
        """Whether it is proved that no Möbius transformation of its orientation with |z| <= z_max has a larger Q."""
        return self.taken is None and self.search.certified

    @cached_property
    def matched_weights(self) -> Floats:
        """The weight, (N1,), with which each source sample matched; 0 where it did not."""
        rows, columns = self.matches.T
        result = np.zeros(len(self.source_samples))
        result[rows] = self.objective.weights[rows, columns]
        return result

    @cached_property
    def difference(self) -> float:
        """By how much descriptors of points that belong together differ, from the samples that matched."""
        rows, columns = self.matches.T
        return usual_difference(
            self.source_descriptors[self.source_samples[rows]], self.target_descriptors[self.target_samples[columns]]
        )

    @cached_property
    def carried(self) -> Places:
        """Where each target vertex goes in the source's disc, (n_target,); nan at vertices in no face."""
        if self.bending is not None:
            return self.bending.carried
        if self.overlap is not None:
            places = self.target.domain.nowhere(len(self.target.places))
            face, barycentric = self.located
            has = np.flatnonzero(face >= 0)
            corners = self.source.mesh.faces[face[has]]
            places[has] = self.source.domain.mean(self.source.places, corners, barycentric[has])
            return places
        places = self.target.places.copy()
        used = self.target.mesh.used
        places[used] = self.mobius.inverse()(places[used])
        return places

    @cached_property
    def evidence(self) -> Floats:
        """What speaks against the map at each target vertex in use, (q, 8): see `confidence.evidence`."""
        return evidence(
            self.source,
            self.target,
            self.source_descriptors,
            self.target_descriptors,
            self.located,
            self.carried,
            unmatched_share(self.value, len(self.source_samples)),
            None if self.bending is None else (self.mobius, self.bending.offset, self.unfolded),
        )

    @cached_property
    def confidence(self) -> Floats:
        """Probability that each target vertex errs by less than `confidence.BOUND`, (n_target,).

        0 at vertices in no face, and at those that were found to have no counterpart.
        """
        result = np.zeros(len(self.target.places))
        if self.overlap is not None:
            result[self.overlap.target.vertices] = self.overlap.alignment.confidence
        else:
            used = self.target.mesh.used
            result[used] = probability(self.evidence, bent=self.bending is not None)
        if self.counterpart is not None:
            result[~self.counterpart] = 0
        return result

    @property
    def unfolded(self) -> float:
        """Share of the vertices that were moved so that no triangle is folded; 0 if nothing was bent."""
        bent = self if self.overlap is None else self.overlap.alignment
        return 0.0 if bent.bending is None else bent.bending.repaired / len(bent.target.places)

    @property
    def mean_confidence(self) -> float:
        """Mean confidence, by area, where the map claims anything; 0 if that is nowhere."""
        areas = self.target.mesh.vertex_areas * (self.confidence > 0)
        return float(self.confidence @ areas / max(areas.sum(), np.finfo(float).tiny))

    @cached_property
    def located(self) -> tuple[Integers, Floats]:
        """The source's face, (n_target,), and the barycentric coordinates in it, (n_target, 3), of each target vertex.

        -1 and 0 at vertices in no face. Target vertices beyond the source's boundary are at the nearest point of it.
        """
        size = len(self.target.places)
        face, barycentric = np.full(size, -1), np.zeros((size, 3))
        if self.overlap is None:
            used = np.flatnonzero(self.target.mesh.used)
            face[used], barycentric[used] = self.source.triangles.locate(self.carried[used])
            return face, barycentric
        parts = self.overlap
        inner, weights = parts.alignment.located
        outside = np.setdiff1d(np.flatnonzero(self.target.mesh.used), parts.target.vertices)
        face[outside], barycentric[outside] = parts.nearest_face[outside], parts.nearest_barycentric[outside]
        face[parts.target.vertices] = parts.source.faces[inner]
        barycentric[parts.target.vertices] = weights
        return face, barycentric


@dataclass(frozen=True, eq=False)
class Overlap:
    """The parts that two surfaces have in common.

    Attributes
    ----------
    alignment : Alignment
        Of the two parts, as surfaces of their own.
    source, target : Piece
        What they are of the whole surfaces.
    source_share, target_share : float
        Of the whole surfaces' areas.
    nearest_face, nearest_barycentric : (n_target,) int, (n_target, 3) float64
        The point of the whole source next to each target vertex in the draft; what lies beyond is next to the boundary.
    """

    alignment: Alignment
    source: Piece
    target: Piece
    source_share: float
    target_share: float
    nearest_face: Integers
    nearest_barycentric: Floats
