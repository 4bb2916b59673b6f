"""The pipeline: two meshes in, the best Möbius transformation between their discs out, with what is proved about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from .agreement import descriptor_distance, trust
from .alignment import Alignment, AlignSettings, Overlap
from .confidence import BOUND
from .descriptors import diffused_curvatures, standardised
from .distortion import signed_areas
from .fit import algebraic_fit
from .flatten import Flattening, flatten
from .landmarks import usable_landmarks, with_landmarks
from .mesh import Booleans, Floats, Integers, MeshError, TriangleMesh
from .mobius import Mobius, hyperbolic_distance
from .nonrigid import ROUNDS, Draft, drafted, finished
from .objective import Objective, compatibility, covering_radius, interior, source_points
from .overlap import Piece, piece, shared
from .refine import refined
from .rival import ELSEWHERE, Rival, best_rival
from .sampling import farthest_points
from .search import SearchResult, search
from .stages import Cancelled, Part, Progress, Stages

PARTIAL = 0.02
"""Share of either surface's area without a counterpart from which on the rest is cut out and aligned anew."""

SMALLEST_OVERLAP = 0.1
"""Share of either surface's area below which an overlap is no ground to go on from."""

SURE = 1.645
"""Standard errors by which the overlap has to match better by itself than the whole surfaces: one-sided, 95 %."""

SETTLED = 0.005
"""Change of the shares without a counterpart below which an overlap is settled."""

DOUBTFUL = 0.5
"""Mean confidence up to which the whole map is doubted aloud."""

FITS = 0.75
"""Mean confidence from which on another map than the search's best is taken.

Of 36 maps of faces that lack 30 % each, and of teeth, the right ones had 0.72 or more, the wrong ones that were not
mirrored 0.31 or less; a sheet, not mirrored where mirrored is right, 0.55.
"""

HYPOTHESES = 3
"""Maxima of the search that are bent, at most, in place of a map that is doubtful, or mirrored."""

UNLIKE = 0.7
"""Mean difference of the descriptors in the first draft above which another map is given up.

Of 36 maps of faces that lack 30 % each, and of teeth, the right ones had 0.57 or less, all but one wrong 0.75 to 1.2.
"""

DRAFTS = 4
"""Drafts at most until the overlap is settled."""


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
    draft of the bending, cut out of both, and aligned by itself: `Alignment.overlap`. And a map that is doubtful, or
    mirrored, is compared with other maxima of the search, of which one that fits is taken, unless landmarks decide.

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
    clock = Stages(progress)
    found = matched = _matched(source_mesh, target_mesh, settings, clock.part(0, 0.7), landmarks)
    if settings.refine == "dense":
        part = clock.part(0.7, 0.95)
        found = _bent(matched, _drafted(matched, part), part, landmarks)
        if not settings.take_rival and (landmarks is None or np.size(landmarks) == 0):  # these decide
            found = _reconsidered(found, matched, clock.part(0.95, 1))
    clock.end()
    found = replace(found, seconds=clock.seconds)
    if _mean_confidence(found) <= DOUBTFUL:
        said = f"doubtful: more likely than not the map errs by more than {100 * BOUND:.0f} % of the source's diagonal"
        found = replace(found, warnings=(*found.warnings, said))
    return found


def _mean_confidence(found: Alignment) -> float:
    """Return the mean confidence of the map where it claims anything; 0 if that is nowhere."""
    areas = found.target.mesh.vertex_areas * (found.confidence > 0)
    return float(found.confidence @ areas / max(areas.sum(), np.finfo(float).tiny))


def _reconsidered(found: Alignment, matched: Alignment, clock: Part) -> Alignment:
    """Return what another maximum of the search leads to, where the best is doubtful, or mirrored without need.

    A hundred samples may prefer a wrong map, as where both scans lack a part, or where one lacks the left and one the
    right of something symmetric. All vertices, once bent, tell whether another fits.

    Parameters
    ----------
    found, matched : Alignment
        What the search's best led to, and this before it was bent.
    """

    def sure(alignment: Alignment) -> float:
        return float(alignment.confidence @ alignment.target.mesh.vertex_areas)

    if matched.other is not None and matched.margin is not None and matched.mobius.reflected:
        # what was said is of the mirrored search and its rival
        said = tuple(_unproved(matched.other))
        upright = replace(matched, search=matched.other, other=matched.search, rival=None, warnings=said)
        other = _fitting(upright, clock.part(0.0, 0.5, "reconsider"), best=True)
        if other is not None and sure(other) > DOUBTFUL * sure(found):
            said = (
                f"ambiguous orientation: mirrored scores {100 * matched.margin:.1f} % of the samples more, but not "
                "mirrored fits too; taken as not mirrored"
            )
            return replace(other, warnings=(said, *other.warnings))
        if found.overlap is not None:
            said = (
                "ambiguous orientation: what the surfaces have in common matches only mirrored; if they show something "
                "symmetric, these are opposite sides of it"
            )
            found = replace(found, warnings=(*found.warnings, said))
    if _mean_confidence(found) <= DOUBTFUL:
        other = _fitting(matched, clock.part(0.5, 1.0, "reconsider"), best=False)
        if other is not None and sure(other) > sure(found):
            behind = 100 * (matched.search.value - other.value) / len(matched.source_samples)
            said = f"reconsidered: the best map does not fit; one that scores {behind:.1f} % of the samples less does"
            return replace(other, warnings=(said, *other.warnings))
    return found


def _fitting(matched: Alignment, clock: Part, *, best: bool) -> Alignment | None:
    """Return what the first of the search's maxima leads to that fits; `best`: it may be the best itself."""
    known = [] if best else [matched.search.mobius]
    for number in range(HYPOTHESES):
        part = clock.part(number / HYPOTHESES, (number + 1) / HYPOTHESES)
        part.begin("reconsider", "Trying the next best map", 0.0)
        rival = _rival(matched, known, None, part) if known else None
        known.append((rival or matched.search).mobius)
        found = _taking(matched, rival, part.within(0.2, 0.4))
        part = part.part(0.4, 1.0)
        first = _drafted(found, part)
        if _unlike(found, first[0], first[2]) > UNLIKE:
            continue
        found = _bent(found, first, part, None)
        if _mean_confidence(found) >= FITS:
            return found
    return None


def _matched(
    source_mesh: TriangleMesh,
    target_mesh: TriangleMesh,
    settings: AlignSettings,
    clock: Part,
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
    source_samples = source_points(source, source_descriptors, settings.samples)
    target_samples = farthest_points(
        target_mesh, settings.targets, np.empty(0, np.intp), interior(target), clock.within(0.3, 0.4)
    )
    problem = Objective(
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
        problem = Objective(source.disc[source_samples], target.disc[target_samples], radius, weights)
    found, other, said = _searched(problem, settings, clock)
    warnings += said
    warnings += _unproved(found)
    alignment = Alignment(
        mobius=found.mobius,
        search=found,
        source=source,
        target=target,
        source_samples=source_samples,
        target_samples=target_samples,
        source_descriptors=source_descriptors,
        target_descriptors=target_descriptors,
        objective=problem,
        settings=settings,
        other=other,
    )
    clock.begin("rival", "Looking for a rival", 0.75)
    near = settings.reflect_margin * len(source_samples)
    rival = _rival(alignment, [found.mobius], found.value - near, clock)
    if rival.value >= found.value - near:
        warnings.append(
            f"ambiguous: a map that sends everything elsewhere scores within "
            f"{100 * max(found.value - rival.value, 0) / len(source_samples):.1f} % of the samples of the best; is the "
            "surface symmetric?" + (" The rival is taken, as asked" if settings.take_rival else "")
        )
    alignment = replace(alignment, rival=rival, warnings=tuple(warnings))
    clock.begin("refine", "Refining", 0.9)
    return _taking(alignment, rival if settings.take_rival else None, clock.within(0.9, 1.0))


def _unproved(found: SearchResult) -> list[str]:
    """Say it if a search ran out of time before its proof."""
    if found.certified:
        return []
    share = 100 * found.gap / max(found.upper_bound, 1e-300)
    return [f"not proved optimal: a value up to {share:.1f} % larger was not excluded in the time given"]


def _rival(found: Alignment, known: list[Mobius], enough: float | None, clock: Part) -> Rival:
    """Look for the best transformation that maps everything elsewhere than those known."""
    rival = best_rival(
        found.objective,
        known,
        z_max=found.settings.z_max,
        enough=enough,
        time_limit=found.settings.time_limit,
        progress=clock.searching(0.15),
    )
    if rival is None:
        raise Cancelled
    return rival


def _taking(found: Alignment, rival: Rival | None, tell: Callable[[float], None]) -> Alignment:
    """Go on with a rival, or with the best if that is None: refine it on all vertices."""
    found = replace(found, taken=rival, mobius=(rival or found.search).mobius)
    if found.settings.refine == "none":
        return found
    descriptors = found.source_descriptors, found.target_descriptors
    mobius = refined(found.mobius, found.source, found.target, *descriptors, found.difference, tell)
    return replace(found, mobius=mobius)


def _drafted(found: Alignment, clock: Part) -> tuple[Draft, Booleans, Booleans]:
    """Return a first draft of the bending, and the vertices of source and target that have a counterpart by it."""
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
    return draft, *shared(draft, source, target, clock.within(0.15, 0.2))


def _unlike(found: Alignment, draft: Draft, there: Booleans) -> float:
    """Return by how much descriptors differ on average, in the draft, where it finds a counterpart; inf if nowhere."""
    used = np.flatnonzero(there & np.isfinite(found.target.disc.real))
    if len(used) == 0:
        return np.inf
    face, barycentric = draft.located(found.target)
    distance = descriptor_distance(
        found.source, found.source_descriptors, found.target_descriptors[used], face[used], barycentric[used]
    )
    areas = found.target.mesh.vertex_areas[used]
    return float(distance @ areas / areas.sum() / np.sqrt(found.source_descriptors.shape[1]))


def _bent(
    found: Alignment,
    first: tuple[Draft, Booleans, Booleans],
    clock: Part,
    landmarks: npt.ArrayLike | None,
) -> Alignment:
    """Bend the target onto the source from a first draft; where they show different pieces, what they share."""
    source, target = found.source, found.target
    draft, here, there = first
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
    found = replace(found, overlap=overlap, warnings=warnings)
    # straight sides may cross the jags of a cut, though none is turned over in the piece's own disc
    areas = signed_areas(found.carried, target.mesh.faces) * (-1 if found.mobius.reflected else 1)
    counterpart[target.mesh.faces[areas <= 0]] = False
    return replace(found, counterpart=counterpart)


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
    clock: Part,
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
    if not _surely_better(inner.matched_weights, found.matched_weights):
        return None
    face, barycentric = draft.located(found.target)
    inner = _consistent(inner, source_part, face[target_part.vertices], barycentric[target_part.vertices])

    clock.begin("bend", "Bending", 0.5)
    scale = np.sqrt(found.source.mesh.area / source_part.mesh.area)
    middle = draft.onto.mesh.vertices[source_part.vertices[inner.source.boundary]].mean(axis=0)
    start = scale * (draft.places(found.target)[target_part.vertices] - middle)
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


def _surely_better(parts: Floats, whole: Floats) -> bool:
    """Return whether the samples of the parts, (k,), match better than those of the whole, (l,), beyond chance.

    The difference of the means in its standard errors (Welch 1947), against `SURE`: rims that merely differ a bit, or a
    draft that was mistaken, gain no more than other samples would.
    """
    error = np.sqrt(parts.var() / len(parts) + whole.var() / len(whole))
    return bool(parts.mean() - whole.mean() > SURE * error)


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


def _searched(
    problem: Objective, settings: AlignSettings, clock: Part
) -> tuple[SearchResult, SearchResult | None, list[str]]:
    """Search the orientations that the settings ask for; return the one to take, the other, and warnings."""
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
    return results[chosen], results[not chosen], warnings


def _mirrored(result: SearchResult) -> SearchResult:
    """Return the result of a search on the conjugated source as one on the source itself."""
    return replace(result, mobius=Mobius(result.mobius.z, result.mobius.theta, True))
