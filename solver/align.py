"""The pipeline: two meshes in, the best Möbius transformation between their discs out, with what is proved about it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from .agreement import trust
from .confidence import BOUND, confidence
from .descriptors import diffused_curvatures, standardised
from .fit import algebraic_fit
from .flatten import Flattening, flatten
from .landmarks import usable_landmarks, with_landmarks
from .locate import TriangulatedDisc
from .mesh import Booleans, Complexes, Floats, Integers, MeshError, TriangleMesh
from .mobius import Mobius, hyperbolic_distance
from .nonrigid import ROUNDS, Bending, Draft, drafted, finished
from .overlap import Piece, piece, shared
from .refine import refined
from .rival import ELSEWHERE, Rival, best_rival
from .sampling import HORIZON, extrema, farthest_points
from .search import SearchProgress, SearchResult, search


class Cancelled(Exception):  # noqa: N818  (not an error: the user's own wish)
    """The progress callback ended the work."""


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
        Share of the target that a source point may match, in (0, 1]: what is most like it.
    reflect : str
        "never", "always" or "auto": both orientations are searched; the reflected one is taken where it wins clearly.
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


@dataclass(frozen=True)
class Progress:
    """Where `align` is: the stage, the share of the work done in [0, 1], and what the search has proved."""

    stage: str
    fraction: float
    value: float | None = None
    upper_bound: float | None = None
    nodes: int | None = None


PARTIAL = 0.02
"""Share of either surface's area without a counterpart from which on the rest is cut out and aligned anew."""

SMALLEST_OVERLAP = 0.1
"""Share of either surface's area below which an overlap is no ground to go on from."""

SETTLED = 0.005
"""Change of the shares without a counterpart below which an overlap is settled."""

DOUBTFUL = 0.5
"""Mean confidence up to which the whole map is doubted aloud."""

DRAFTS = 4
"""Drafts at most until the overlap is settled."""


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
        Vertices that stood for the surfaces in the search; `search.matches` index into these.
    source_descriptors, target_descriptors : (n, d) float64
        Standardised descriptors of all vertices.
    difference : float
        By how much descriptors of points that belong together differ, from the search's matches.
    settings : AlignSettings
    bending : Bending or None
        Where the target's vertices go in the source's disc when it is bent beyond `mobius`; None if it was not, or not
        as a whole.
    overlap : Overlap or None
        The parts that both surfaces show, aligned by themselves; None if that is all of them, or was not asked.
    counterpart : (n_target,) bool or None
        Which target vertices have a counterpart on the source: those not beyond its boundary; None if it was not asked.
    margin : float or None
        By how much of the samples the chosen orientation beat the other; None if only one was searched.
    rival : Rival or None
        The best transformation that maps everything elsewhere; None if it was not searched for.
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
    difference: float
    settings: AlignSettings
    bending: Bending | None = None
    overlap: Overlap | None = None
    counterpart: Booleans | None = None
    margin: float | None = None
    rival: Rival | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def rival_margin(self) -> float | None:
        """By how much of the samples the winner beats whatever maps everything elsewhere, at least."""
        if self.rival is None:
            return None
        return (self.search.value - self.rival.upper_bound) / len(self.source_samples)

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


def align(
    source_mesh: TriangleMesh,
    target_mesh: TriangleMesh,
    settings: AlignSettings | None = None,
    progress: Callable[[Progress], bool | None] | None = None,
    *,
    landmarks: npt.ArrayLike | None = None,
) -> Alignment:
    """Find where every point of the target belongs on the source; landmarks are not needed.

    With dense refinement the surfaces may show different pieces of the same thing. The overlap is found from a stiff
    draft of the bending, cut out of both, and aligned by itself: `Alignment.overlap`.

    Parameters
    ----------
    source_mesh, target_mesh : TriangleMesh
        Triangulated discs in any pose, scale and triangulation.
    settings : AlignSettings, optional
    progress : callable, optional
        Called with a `Progress` at each stage and a few times a second in the search; returns False to cancel.
    landmarks : (l, 2) int, optional
        Source vertex and target vertex of pairs that are known. They join the search as points of more weight, so that
        a few wrong ones are outvoted.

    Raises
    ------
    MeshError
        A mesh is no disc.
    ValueError
        Landmarks that are no pairs of vertices.
    Cancelled
        The progress callback returned False.
    """
    settings = settings or AlignSettings()
    clock = _Stages(progress)
    found = _matched(source_mesh, target_mesh, settings, clock.part(0, 0.7), landmarks)
    if settings.refine == "dense":
        found = _bent(found, clock.part(0.7, 1), landmarks)
    clock.end()
    found = replace(found, seconds=clock.seconds)
    areas = target_mesh.vertex_areas * (found.confidence > 0)
    if found.confidence @ areas <= DOUBTFUL * areas.sum():
        said = f"doubtful: more likely than not the map errs by more than {100 * BOUND:.0f} % of the source's diagonal"
        found = replace(found, warnings=(*found.warnings, said))
    return found


def _matched(
    source_mesh: TriangleMesh,
    target_mesh: TriangleMesh,
    settings: AlignSettings,
    clock: _Part,
    landmarks: npt.ArrayLike | None,
) -> Alignment:
    """Flatten, search, and refine the transformation."""
    clock.begin("flatten source", "Flattening the source", 0.0)
    source = flatten(source_mesh, fill_holes=settings.fill_holes, outer_vertex=settings.source_outer)
    clock.begin("flatten target", "Flattening the target", 0.1)
    target = flatten(target_mesh, fill_holes=settings.fill_holes, outer_vertex=settings.target_outer)
    clock.begin("descriptors", "Measuring curvature", 0.2)
    measured = diffused_curvatures(source_mesh, progress=clock.within(0.2, 0.25))
    source_descriptors = standardised(measured, source_mesh.vertex_areas)
    measured = diffused_curvatures(target_mesh, progress=clock.within(0.25, 0.3))
    target_descriptors = standardised(measured, target_mesh.vertex_areas)
    clock.begin("sampling", "Choosing points", 0.3)
    source_samples = _samples(source, source_descriptors, settings.samples)
    target_samples = farthest_points(
        target_mesh, settings.targets, np.empty(0, np.intp), _interior(target), clock.within(0.3, 0.4)
    )
    problem = _Problem(
        source.disc[source_samples],
        target.disc[target_samples],
        covering_radius(target.disc[target_samples])
        if settings.radius is None
        else np.full(len(target_samples), settings.radius),
        compatibility(source_descriptors[source_samples], target_descriptors[target_samples], settings.compatible),
    )
    pairs, warnings = usable_landmarks(() if landmarks is None else landmarks, source, target)
    if len(pairs):
        rows, radius, weights = with_landmarks(pairs, problem.source, problem.target, problem.radius, problem.weights)
        source_samples = np.concatenate([source_samples, pairs[rows, 0]])
        target_samples = np.concatenate([target_samples, pairs[:, 1]])
        problem = _Problem(source.disc[source_samples], target.disc[target_samples], radius, weights)
    found, margin, said = _searched(problem, settings, clock)
    warnings += said
    rival = _rival(problem, found, settings, clock)
    if rival.value >= found.value - settings.reflect_margin * len(source_samples):
        warnings.append(
            f"ambiguous: a map that sends everything elsewhere scores within "
            f"{100 * max(found.value - rival.value, 0) / len(source_samples):.1f} % of the samples of the best; is the "
            "surface symmetric?" + (" The rival is taken, as asked" if settings.take_rival else "")
        )
    mobius = rival.mobius if settings.take_rival else found.mobius
    difference = _usual_difference(
        source_descriptors[source_samples[found.matches[:, 0]]], target_descriptors[target_samples[found.matches[:, 1]]]
    )
    if settings.refine != "none":
        clock.begin("refine", "Refining", 0.9)
        mobius = refined(
            mobius,
            source,
            target,
            source_descriptors,
            target_descriptors,
            difference,
            clock.within(0.9, 1.0),
        )
    if not found.certified:
        share = 100 * found.gap / max(found.upper_bound, 1e-300)
        warnings.append(f"not proved optimal: a value up to {share:.1f} % larger was not excluded in the time given")
    return Alignment(
        mobius=mobius,
        search=found,
        source=source,
        target=target,
        source_samples=source_samples,
        target_samples=target_samples,
        source_descriptors=source_descriptors,
        target_descriptors=target_descriptors,
        difference=difference,
        settings=settings,
        margin=margin,
        rival=rival,
        warnings=tuple(warnings),
    )


def _bent(found: Alignment, clock: _Part, landmarks: npt.ArrayLike | None) -> Alignment:
    """Bend the target onto the source; where they show different pieces, the pieces that they share."""
    clock.begin("bend", "Bending", 0.0)
    source, target = found.source, found.target
    believed = trust(
        found.mobius,
        source,
        target,
        found.source_descriptors,
        found.target_descriptors,
        found.difference,
    )
    draft = drafted(found.mobius, source, target, believed, progress=clock.within(0.0, 0.15))
    here, there = shared(draft, source, target, clock.within(0.15, 0.2))
    overlap = None
    if max(_left_out(source, target, here, there)) > PARTIAL:
        clock.begin("overlap", "Finding the overlap", 0.2)
        still = clock.within(0.2, 0.2)
        for _ in range(DRAFTS - 1):
            # pose and scale again, from where the surfaces meet
            believed = np.where(there, 1.0, 1e-3)
            draft = drafted(found.mobius, source, target, believed, draft.places(target), ROUNDS, still)
            before = here, there
            here, there = shared(draft, source, target, still)
            if max(_left_out(source, target, here == before[0], there == before[1])) < SETTLED:
                break
        if max(_left_out(source, target, here, there)) > PARTIAL:
            overlap = _overlap(found, draft, piece(source, here), piece(target, there), clock, landmarks)
    warnings = found.warnings
    missing = _left_out(source, target, here, there)
    if max(missing) > PARTIAL:
        apart = " and ".join(
            f"{100 * share:.0f} % of the {name}"
            for share, name in zip(missing, ("source", "target"), strict=True)
            if share > SETTLED
        )
        warnings += (f"partial overlap: {apart} without a counterpart on the other surface",)
    if overlap is None:
        clock.begin("bend", "Bending", 0.5)
        bending = finished(draft, source, target, progress=clock.within(0.5, 1.0))
        return replace(found, bending=bending, counterpart=there, warnings=warnings)
    # what the whole discs left open the pieces may decide
    warnings = tuple(said for said in warnings if not said.startswith("ambiguous: "))
    warnings += tuple(f"in the overlap: {said}" for said in overlap.alignment.warnings)
    counterpart = np.zeros(len(target.disc), bool)
    counterpart[overlap.target.vertices] = overlap.alignment.counterpart
    return replace(found, overlap=overlap, counterpart=counterpart, warnings=warnings)


def _left_out(source: Flattening, target: Flattening, here: Booleans, there: Booleans) -> tuple[float, float]:
    """Return the shares of the surfaces' areas around vertices that are not `here`, and not `there`."""
    first, second = (
        float(surface.mesh.vertex_areas[~kept].sum() / surface.mesh.area)
        for surface, kept in ((source, here), (target, there))
    )
    return first, second


def _overlap(
    found: Alignment,
    draft: Draft,
    source_part: Piece | None,
    target_part: Piece | None,
    clock: _Part,
    landmarks: npt.ArrayLike | None,
) -> Overlap | None:
    """Align the parts that the surfaces seem to share, by a draft of the whole; None if it was mistaken."""
    if source_part is None or target_part is None:
        return None
    source_share = source_part.mesh.area / found.source.mesh.area
    target_share = target_part.mesh.area / found.target.mesh.area
    if min(source_share, target_share) < SMALLEST_OVERLAP:
        return None
    settings = replace(
        found.settings,
        reflect="always" if found.mobius.reflected else "never",
        take_rival=False,
        source_outer=source_part.outer,
        target_outer=target_part.outer,
    )
    try:
        pairs = _within(landmarks, source_part, target_part)
        inner = _matched(source_part.mesh, target_part.mesh, settings, clock.part(0.2, 0.5, "overlap"), pairs)
    except MeshError:  # too small a piece to flatten
        return None
    if _share(inner) <= _share(found):
        return None  # what matches less by itself is no better founded
    used = np.flatnonzero(np.isfinite(found.target.disc.real))
    places = draft.places(found.target)
    normals = TriangleMesh(places, draft.whole.faces).vertex_normals()
    face, barycentric = np.full(len(places), -1), np.zeros((len(places), 3))
    face[used], barycentric[used] = draft.onto.nearest_point(places[used], normals[used])
    inner = _consistent(inner, source_part, face[target_part.vertices], barycentric[target_part.vertices])

    clock.begin("bend", "Bending", 0.5)
    scale = np.sqrt(found.source.mesh.area / source_part.mesh.area)
    middle = draft.onto.mesh.vertices[source_part.vertices[inner.source.boundary]].mean(axis=0)
    start = scale * (places[target_part.vertices] - middle)
    again = drafted(inner.mobius, inner.source, inner.target, start=start, progress=clock.within(0.5, 0.6))
    _, there = shared(again, inner.source, inner.target, clock.within(0.6, 0.6))
    bending = finished(
        again,
        inner.source,
        inner.target,
        _alike(again, inner, source_part.cut, target_part.cut),
        clock.within(0.6, 1.0),
    )
    inner = replace(inner, bending=bending, counterpart=there)
    return Overlap(inner, source_part, target_part, source_share, target_share, face, barycentric)


def _share(found: Alignment) -> float:
    """Return the share of the samples that match."""
    return found.search.value / len(found.source_samples)


def _within(landmarks: npt.ArrayLike | None, source: Piece, target: Piece) -> Integers | None:
    """Return the landmarks that lie in both pieces, as vertices of these."""
    if landmarks is None or np.size(landmarks) == 0:
        return None
    pairs = np.asarray(landmarks)
    rows = [np.searchsorted(part.vertices, column) for part, column in zip((source, target), pairs.T, strict=True)]
    inside = [
        part.vertices[np.minimum(row, len(part.vertices) - 1)] == column
        for part, row, column in zip((source, target), rows, pairs.T, strict=True)
    ]
    return np.stack(rows, axis=1)[inside[0] & inside[1]]


def _consistent(inner: Alignment, source: Piece, face: Integers, barycentric: Floats) -> Alignment:
    """Return the pieces' alignment, with the transformation that the draft of the whole implies if it found another.

    `face`, (k,), and `barycentric`, (k, 3), are where the draft puts the target piece's vertices on the whole source.
    """
    place = np.searchsorted(source.faces, face)
    place = np.minimum(place, len(source.faces) - 1)
    there = np.flatnonzero((source.faces[place] == face) & np.isfinite(inner.target.disc.real))
    expected = (inner.source.disc[source.mesh.faces[place[there]]] * barycentric[there]).sum(axis=1)
    disc = inner.target.disc[there]
    inside = (np.abs(expected) < 1 - 1e-6) & (np.abs(disc) < 1 - 1e-6)
    expected, disc = expected[inside], disc[inside]
    apart = hyperbolic_distance(inner.mobius.inverse()(disc), expected)
    if len(apart) < 3 or np.median(apart) < ELSEWHERE:
        return inner
    reflected = inner.mobius.reflected
    fit = algebraic_fit(np.conj(expected) if reflected else expected, disc, np.ones(len(disc)))
    mobius = refined(
        replace(fit, reflected=reflected),
        inner.source,
        inner.target,
        inner.source_descriptors,
        inner.target_descriptors,
        inner.difference,
    )
    said = "ambiguous: the best map of the pieces by themselves sends everything elsewhere"
    return replace(inner, mobius=mobius, warnings=(*inner.warnings, said))


def _alike(draft: Draft, inner: Alignment, source_cut: Booleans, target_cut: Booleans) -> Booleans:
    """Return the target vertices, (n,), that are near a boundary that the whole surfaces have, not one of a cut."""
    places = draft.places(inner.target)
    loops = np.concatenate([inner.source.boundary, *inner.source.holes])
    nearest = loops[KDTree(draft.onto.mesh.vertices[loops]).query(places)[1]]
    return ~target_cut & ~source_cut[nearest]


def compatibility(source: Floats, target: Floats, share: float) -> Floats:
    """Return the weight, (N1, N2), of each pair of descriptors, from how rare it is to be so alike.

    1 - p / share, at least 0, where p is the share of the target that is more like the source point. So weights need no
    unit of likeness: whatever the noise, each source point may match as much of the target.
    """
    square = (source**2).sum(axis=1)[:, None] + (target**2).sum(axis=1) - 2 * source @ target.T
    rank = np.empty(square.shape)
    np.put_along_axis(rank, np.argsort(square, axis=1, kind="stable"), 0.5 + np.arange(square.shape[1])[None], axis=1)
    return np.maximum(1 - rank / (share * square.shape[1]), 0)


def _usual_difference(source: Floats, target: Floats) -> float:
    """Return the median distance of matched descriptors, (m, d) each: how alike these two surfaces are.

    At least a tenth of what their standard deviation makes of it; the standard deviation itself where nothing matched.
    """
    most = float(np.sqrt(source.shape[1]))
    if not len(source):
        return most
    return max(float(np.median(np.linalg.norm(source - target, axis=1))), 0.1 * most)


def covering_radius(points: Complexes) -> Floats:
    """Return each point's pseudo-hyperbolic distance to its second nearest neighbour, (n,), at most 0.5.

    Discs of these radii around evenly spread points cover the region between them.
    """
    distance = hyperbolic_distance(points[:, None], points)
    return np.clip(np.sort(distance, axis=1)[:, min(2, len(points) - 1)], 1e-6, 0.5)


def _interior(flattening: Flattening) -> np.ndarray:
    """Return which vertices, (n,), are in use and far enough inside the disc for the search."""
    inside = np.isfinite(flattening.disc.real) & (np.abs(flattening.disc) < HORIZON)
    inside[flattening.boundary] = False
    return inside


def _samples(flattening: Flattening, descriptors: Floats, count: int) -> Integers:
    """Return the source points: up to half of them extrema of curvature, the others far from these and each other."""
    inside = _interior(flattening)
    peaks = extrema(flattening.mesh, descriptors[:, 1], inside)[: count // 2]
    return farthest_points(flattening.mesh, count, peaks, inside)


@dataclass(frozen=True, eq=False)
class _Problem:
    """What is searched: points of both discs, the radii of the match discs and the weights of the pairs."""

    source: Complexes
    target: Complexes
    radius: Floats
    weights: Floats


def _searched(problem: _Problem, settings: AlignSettings, clock: _Part) -> tuple[SearchResult, float | None, list[str]]:
    """Search the orientations that the settings ask for; return the one to take, its margin, and warnings."""
    results: dict[bool, SearchResult] = {}
    sides = {"never": [False], "always": [True], "auto": [False, True]}[settings.reflect]
    for position, reflected in enumerate(sides):
        begin = 0.4 + 0.35 * position / len(sides)
        clock.begin(
            "search reflected" if reflected else "search",
            "Searching the reflection" if reflected else "Searching",
            begin,
        )
        result = search(
            np.conj(problem.source) if reflected else problem.source,
            problem.target,
            problem.radius,
            weights=problem.weights,
            z_max=settings.z_max,
            time_limit=settings.time_limit,
            progress=clock.searching(0.35 / len(sides)),
        )
        if result.cancelled:
            raise Cancelled
        results[reflected] = _mirrored(result) if reflected else result
    if len(results) == 1:
        return results[sides[0]], None, []
    advantage = (results[True].value - results[False].value) / len(problem.source)
    chosen = advantage > settings.reflect_margin
    warnings = []
    if abs(advantage) <= settings.reflect_margin:
        warnings.append(
            f"ambiguous orientation: mirrored and not mirrored differ by {100 * abs(advantage):.1f} % of the samples; "
            "taken as not mirrored"
        )
    return results[chosen], advantage if chosen else -advantage, warnings


def _rival(problem: _Problem, winner: SearchResult, settings: AlignSettings, clock: _Part) -> Rival:
    """Look for a transformation that is as good as the winner and maps everything elsewhere."""
    clock.begin("rival", "Looking for a rival", 0.75)
    rival = best_rival(
        problem.source,
        problem.target,
        problem.radius,
        problem.weights,
        winner,
        z_max=settings.z_max,
        close=settings.reflect_margin * len(problem.source),
        time_limit=settings.time_limit,
        progress=clock.searching(0.15),
    )
    if rival is None:
        raise Cancelled
    return rival


def _mirrored(result: SearchResult) -> SearchResult:
    """Return the result of a search on the conjugated source as one on the source itself."""
    return replace(result, mobius=Mobius(result.mobius.z, result.mobius.theta, True))


class _Stages:
    """Times the stages and passes them to the progress callback."""

    def __init__(self, progress: Callable[[Progress], bool | None] | None) -> None:
        self.progress = progress
        self.seconds: dict[str, float] = {}
        self._key, self._text, self._fraction, self._since = "", "", 0.0, 0.0

    def part(self, begin: float, end: float, key: str | None = None) -> _Part:
        """Return the stages of a part of the work, between shares `begin` and `end`; their times under one `key`."""
        return _Part(self, begin, end, key)

    def begin(self, key: str, text: str, fraction: float) -> None:
        self.end()
        self._key, self._text, self._fraction, self._since = key, text, fraction, time.perf_counter()
        self.tell(fraction)

    def tell(self, fraction: float) -> None:
        if self.progress is not None and self.progress(Progress(self._text, fraction)) is False:
            raise Cancelled

    def end(self) -> None:
        if self._key:
            spent = time.perf_counter() - self._since
            self.seconds[self._key] = self.seconds.get(self._key, 0.0) + spent
        self._key = ""

    def searching(self, share: float) -> Callable[[SearchProgress], bool | None] | None:
        progress = self.progress
        if progress is None:
            return None

        def report(state: SearchProgress) -> bool | None:
            done = state.value / state.upper_bound if state.upper_bound > 0 else 1.0
            fraction = self._fraction + share * min(max(done, 0.0), 1.0)
            return progress(Progress(self._text, fraction, state.value, state.upper_bound, state.nodes))

        return report


@dataclass(frozen=True)
class _Part:
    """The stages of a part of the work: their shares of it become shares of the whole."""

    stages: _Stages
    first: float
    last: float
    key: str | None

    def _whole(self, fraction: float) -> float:
        return self.first + fraction * (self.last - self.first)

    def part(self, begin: float, end: float, key: str | None = None) -> _Part:
        return _Part(self.stages, self._whole(begin), self._whole(end), key or self.key)

    def begin(self, key: str, text: str, fraction: float) -> None:
        self.stages.begin(self.key or key, text, self._whole(fraction))

    def within(self, begin: float, end: float) -> Callable[[float], None]:
        """Return what turns shares of the present stage's work into progress; it may raise `Cancelled`."""
        return lambda share: self.stages.tell(self._whole(begin + share * (end - begin)))

    def searching(self, share: float) -> Callable[[SearchProgress], bool | None] | None:
        return self.stages.searching(share * (self.last - self.first))
