"""What `align` can be told, and what it returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .confidence import confidence
from .flatten import Flattening
from .locate import TriangulatedDisc
from .mesh import Booleans, Complexes, Floats, Integers
from .mobius import Mobius
from .nonrigid import Bending
from .objective import Objective, usual_difference
from .overlap import Piece
from .rival import Rival
from .search import SearchResult


@dataclass(frozen=True)
class AlignSettings:
    """What `align` can be told; the defaults suit scans of one kind of object.

    Attributes
    ----------
    samples : int
        Source points of the search.
    targets : int
        Target points of the search; the match discs around them cover the target.
    radius : float, optional
        Hyperbolic radius of the match discs, in (0, 1). Default: each point's distance to its second nearest neighbour.
    z_max : float
        Bound on |z|, in (0, 1): how far the centres of the two discs may lie apart.
    compatible : float
        Share of the target that a source point may match, in (0, 1]: what is most like it. On 7 sets of pairs 87 to
        98 % of the counterparts are within 0.2, and beyond they are no likelier than chance (`tests/bench/ranks.py`).
    reflect : str
        "never", "always" or "auto": both orientations are searched; the reflected one is taken where it wins clearly
        and, with dense refinement, no map that is not reflected fits.
    reflect_margin : float
        Share of the samples by which a reflection has to win, and below which an orientation, or a rival that maps
        everything elsewhere, is called ambiguous. On 8 pairs of nearly mirror symmetric faces the orientations
        differ by at most 0.02, on 8 pairs of teeth the right one wins by at least 0.10; rivals lie 0.14 or more below
        the winner on all 16, at most 0.013 on sheets with a rotational symmetry.
    take_rival : bool
        Continue with the best rival in place of the winner, where the winner is the wrong one of an ambiguous pair.
    time_limit : float, optional
        Seconds for each search.
    refine : str
        "none": the search's transformation; "mobius": improved on all vertices; "dense": then the target is bent onto
        the source, smoothly and without folds.
    fill_holes : bool
        Allow meshes with openings: all boundary loops but the outer one are closed for the computation.
    source_outer, target_outer : int, optional
        A vertex on the loop that is to be the outer one; by default the longest loop is.
    """

    samples: int = 100
    targets: int = 1000
    radius: float | None = None
    z_max: float = 0.8337  # tanh(1.2)
    compatible: float = 0.2
    reflect: str = "auto"
    reflect_margin: float = 0.06
    take_rival: bool = False
    time_limit: float | None = 60.0
    refine: str = "dense"
    fill_holes: bool = False
    source_outer: int | None = None
    target_outer: int | None = None

    def __post_init__(self) -> None:
        for name, allowed in (("reflect", ("never", "always", "auto")), ("refine", ("none", "mobius", "dense"))):
            if getattr(self, name) not in allowed:
                raise ValueError(f"{name} must be one of {', '.join(allowed)}, not '{getattr(self, name)}'")
        if self.samples < 3 or self.targets < 3:
            raise ValueError("samples and targets must be at least 3: a Möbius transformation has three parameters")
        if not 0 < self.z_max < 1:
            raise ValueError(f"z_max must lie between 0 and 1, not {self.z_max}")
        if self.radius is not None and not 0 < self.radius < 1:
            raise ValueError(f"radius must lie between 0 and 1, not {self.radius}")
        if not 0 < self.compatible <= 1:
            raise ValueError(f"compatible must be a share above 0 and at most 1, not {self.compatible}")


@dataclass(frozen=True, eq=False)
class Alignment:
    """Two flattened surfaces and the transformation between their discs.

    Attributes
    ----------
    mobius : Mobius
        Carries the source's disc to the target's.
    search : SearchResult
        The certified search that found it; `mobius` may be refined beyond `search.mobius`.
    source, target : Flattening
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
    seconds : dict of str to float
        Wall-clock time per stage.
    warnings : tuple of str
        What the user should know, each a sentence.
    """

    mobius: Mobius
    search: SearchResult
    source: Flattening
    target: Flattening
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
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def margin(self) -> float | None:
        """By how much of the samples the chosen orientation beat the other; None if only one was searched."""
        return None if self.other is None else (self.search.value - self.other.value) / len(self.source_samples)

    @property
    def rival_margin(self) -> float | None:
        """By how much of the samples the winner beats whatever maps everything elsewhere, at least.

        None if that was not looked at, or if time ran out over it: the same pair always has the same margin, or none.
        """
        if self.rival is None or self.rival.out_of_time or self.search.out_of_time:
            return None
        return (self.search.value - self.rival.upper_bound) / len(self.source_samples)

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
    def carried(self) -> Complexes:
        """Where each target vertex goes in the source's disc, (n_target,); nan at vertices in no face."""
        if self.bending is not None:
            return self.bending.carried
        if self.overlap is not None:
            places = np.full(len(self.target.disc), complex(np.nan, np.nan))
            face, barycentric = self.located
            has = np.flatnonzero(face >= 0)
            places[has] = (self.source.disc[self.source.mesh.faces[face[has]]] * barycentric[has]).sum(axis=1)
            return places
        places = self.target.disc.copy()
        used = np.isfinite(places.real)
        places[used] = self.mobius.inverse()(places[used])
        return places

    @cached_property
    def confidence(self) -> Floats:
        """Probability that each target vertex errs by less than `confidence.BOUND`, (n_target,)."""
        return confidence(self)

    @cached_property
    def located(self) -> tuple[Integers, Floats]:
        """The source's face, (n_target,), and the barycentric coordinates in it, (n_target, 3), of each target vertex.

        -1 and 0 at vertices in no face. Target vertices beyond the source's boundary are at the nearest point of it.
        """
        size = len(self.target.disc)
        face, barycentric = np.full(size, -1), np.zeros((size, 3))
        if self.overlap is None:
            used = np.flatnonzero(np.isfinite(self.target.disc.real))
            disc = TriangulatedDisc.of(self.source.disc, self.source.mesh.faces)
            face[used], barycentric[used] = disc.locate(self.carried[used])
            return face, barycentric
        parts = self.overlap
        inner, weights = parts.alignment.located
        outside = np.setdiff1d(np.flatnonzero(np.isfinite(self.target.disc.real)), parts.target.vertices)
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
