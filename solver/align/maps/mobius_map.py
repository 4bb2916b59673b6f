"""Two surfaces, flattened, searched for the best Möbius transformation, and this refined on all vertices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...flatten.sphere import Flat
from ...mobius import Mobius, SphereMobius
from ...search.both_sides import search_both
from ...search.branch_and_bound import search
from ...search.fit import algebraic_fit
from ...search.matching import Objective
from ...search.outcome import SearchResult, SphereSearchResult
from ...search.rival import LOOKED_AT, Rival, best_rival, scored
from ...search.sphere_rival import best_sphere_rival, scored_on_sphere
from ...stages import Cancelled, Part
from ...surface.mesh import Floats, Integers, MeshError, Places
from ..result.alignment import Alignment
from ..surfaces.landmarks import usable_landmarks, with_landmarks
from ..surfaces.objective import compatibility
from ..surfaces.prepared import Surface
from ..surfaces.remark import Remark
from ..surfaces.settings import AlignSettings
from ..surfaces.side_by_side import flattened, measured
from .refine import refined
from .sphere_map import searched_sphere, tied_orientations

PROVING = 100_000
"""Cells after which a search that is not proved ends within `AlignSettings.gap`: no search on real pairs of seven kinds
needs more than 37,000. Where weights of something symmetric tie but for rounding, as both legs of trousers, the
rest takes all the time there is: within a 5,000th after 2 s, and no nearer after 60."""


def roughly_aligned(
    source_surface: Surface,
    target_surface: Surface,
    settings: AlignSettings,
    clock: Part,
    landmarks: Integers | None,
) -> Alignment:
    """Flatten, search, look for a rival, and refine the transformation."""
    return challenged(searched(source_surface, target_surface, settings, clock, landmarks), clock)


def searched(
    source_surface: Surface,
    target_surface: Surface,
    settings: AlignSettings,
    clock: Part,
    landmarks: Integers | None,
    enough: float | None = None,
) -> Alignment:
    """Flatten and search; of prepared surfaces the rest is there already.

    `enough`: share of the samples of which it is asked in discs, with dense refinement, whether more match, and no more
    than that.
    """
    clock.begin("flatten source", "Flattening the source", 0.0)
    flattened(source_surface, target_surface, settings, clock.within(0.0, 0.1))
    source = source_surface.flattening
    clock.begin("flatten target", "Flattening the target", 0.1)
    target = target_surface.flattening
    _require_alike(source, target)
    clock.begin("descriptors", "Measuring curvature", 0.2)
    measured(source_surface, target_surface, settings, clock.within(0.2, 0.3))
    source_descriptors, target_descriptors = source_surface.descriptors(), target_surface.descriptors()
    clock.begin("sampling", "Choosing points", 0.3)
    source_samples = source_surface.source_points(settings.samples, clock.within(0.3, 0.33))
    target_samples = target_surface.target_points(settings.targets, clock.within(0.33, 0.4))
    problem = Objective(
        source.places[source_samples],
        target.places[target_samples],
        target_surface.target_radii(settings.targets)
        if settings.radius is None
        else np.full(len(target_samples), settings.radius),
        compatibility(source_descriptors[source_samples], target_descriptors[target_samples], settings.compatible),
    )
    pairs, remarks = usable_landmarks(landmarks, source, target)
    if len(pairs):
        rows, radius, weights = with_landmarks(pairs, problem.source, problem.target, problem.radius, problem.weights)
        source_samples = np.concatenate([source_samples, pairs[rows, 0]])
        target_samples = np.concatenate([target_samples, pairs[:, 1]])
        problem = Objective(source.places[source_samples], target.places[target_samples], radius, weights)
    if source.domain.closed:
        found, other, said = searched_sphere(problem, settings, clock)
    else:
        found, other, said = _both_sides(problem, settings, clock, enough)
    return Alignment(
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
        source_cleaned=source_surface.cleaned,
        target_cleaned=target_surface.cleaned,
        remarks=(*remarks, *said, *unproved(found)),
    )


def challenged(alignment: Alignment, clock: Part) -> Alignment:
    """Look for a rival of what the search found, and refine what is gone on with on all vertices."""
    found, settings, remarks = alignment.search, alignment.settings, alignment.remarks
    source_samples = alignment.source_samples
    clock.begin("rival", "Looking for a rival", 0.75)
    near = settings.reflect_margin * len(source_samples)
    rival = rival_of(alignment, [found.mobius], found.value - near, clock)
    if rival.value >= found.value - near:
        said = (
            f"ambiguous: a map that sends everything elsewhere scores within "
            f"{100 * max(found.value - rival.value, 0) / len(source_samples):.1f} % of the samples of the best; is the "
            "surface symmetric?" + (" The rival is taken, as asked" if settings.take_rival else "")
        )
        remarks = (*remarks, Remark("rival", said))
    alignment = replace(alignment, rival=rival, remarks=remarks)
    clock.begin("refine", "Refining", 0.9)
    return taking(alignment, rival if settings.take_rival else None, clock.within(0.9, 1.0))


def _require_alike(source: Flat, target: Flat) -> None:
    """Raise `MeshError` if one of the surfaces is closed and the other is not."""
    if source.domain.closed != target.domain.closed:
        one, two = (source, target) if source.domain.closed else (target, source)
        raise MeshError(
            f"'{one.mesh.name}' is closed and '{two.mesh.name}' is not: cut the first open where the second is, or "
            "close the second"
        )


def unproved(found: SearchResult) -> list[Remark]:
    """Say it if a search ran out of time before its proof."""
    if found.certified or isinstance(found, SphereSearchResult):  # which says itself what it has proved
        return []
    share = 100 * found.gap / max(found.upper_bound, 1e-300)
    given = "in the time given" if found.out_of_time else "with the work given"
    said = f"not proved optimal: a value up to {np.ceil(100 * share) / 100:.2f} % larger was not excluded {given}"
    return [Remark("unproved", said)]


def rival_of(found: Alignment, known: list[Any], enough: float | None, clock: Part) -> Rival:
    """Look for the best transformation that maps everything elsewhere than those known."""
    if found.source.domain.closed:
        rival = best_sphere_rival(
            found.objective, known, time_limit=found.settings.time_limit, progress=clock.searching(0.15)
        )
        if rival is None:
            raise Cancelled
        return rival
    rival = best_rival(
        found.objective,
        known,
        z_max=found.settings.z_max,
        enough=enough,
        at_least=LOOKED_AT if _thorough(found.settings) else 0,
        time_limit=found.settings.time_limit,
        threads=found.settings.threads,
        most_nodes=found.settings.most_nodes,
        progress=clock.searching(0.15),
    )
    if rival is None:
        raise Cancelled
    return rival


def valued(objective: Objective, mobius: Mobius | SphereMobius) -> Rival:
    """Return a transformation with its Q."""
    return scored(objective, mobius) if isinstance(mobius, Mobius) else scored_on_sphere(objective, mobius)


def taking(found: Alignment, rival: Rival | None, tell: Callable[[float], None]) -> Alignment:
    """Go on with a rival, or with the best if that is None: refine it on all vertices."""
    found = replace(found, taken=rival, mobius=(rival or found.search).mobius)
    return found if found.settings.refine == "none" else improved(found, found.difference, tell)


def improved(found: Alignment, difference: float, tell: Callable[[float], None] | None = None) -> Alignment:
    """Refine the transformation on all vertices; `difference`: of descriptors of points that belong together."""
    descriptors = found.source_descriptors, found.target_descriptors
    return replace(found, mobius=refined(found.mobius, found.source, found.target, *descriptors, difference, tell))


def implied(source: Places, target: Places, weights: Floats, reflected: bool) -> Mobius | SphereMobius:
    """Return the transformation nearest to bringing points of the source's domain to the target's, (k,) or (k, 3) each.

    On the sphere the nearest rotation: both are centred, so that a small step of all vertices leads on from there.
    """
    if source.ndim == 2:
        seen = source * [1.0, -1.0, 1.0] if reflected else source
        x, y, z, w = Rotation.align_vectors(target, seen, weights)[0].as_quat().tolist()
        return SphereMobius((0.0, 0.0, 0.0), (w, x, y, z), reflected)
    return replace(algebraic_fit(np.conj(source) if reflected else source, target, weights), reflected=reflected)


def _both_sides(
    problem: Objective, settings: AlignSettings, clock: Part, enough: float | None
) -> tuple[SearchResult, SearchResult | None, list[Remark]]:
    """Search the orientations that the settings ask for; return the one to take, the other, and what is to be said."""
    if settings.reflect == "auto" and not _thorough(settings):
        clock.begin("search", "Searching", 0.4)
        plain, turned = search_both(
            problem,
            z_max=settings.z_max,
            margin=settings.reflect_margin * len(problem.source),
            time_limit=settings.time_limit,
            threads=settings.threads,
            most_nodes=settings.most_nodes,
            progress=clock.searching(0.35),
        )
        if plain.cancelled:
            raise Cancelled
        return _decided(plain, _mirrored(turned), problem, settings)
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
            threads=settings.threads,
            most_nodes=settings.most_nodes,
            gap=settings.gap if enough is None else 0.0,
            enough=None if enough is None else enough * len(problem.source),
            at_least=PROVING if enough is None else 0,
            progress=clock.searching(0.35 / len(sides)),
        )
        if result.cancelled:
            raise Cancelled
        results[reflected] = _mirrored(result) if reflected else result
    if len(results) == 1:
        return results[sides[0]], None, []
    return _decided(results[False], results[True], problem, settings)


def _thorough(settings: AlignSettings) -> bool:
    return settings.thorough or settings.refine == "dense"


def _decided(
    plain: SearchResult, turned: SearchResult, problem: Objective, settings: AlignSettings
) -> tuple[SearchResult, SearchResult, list[Remark]]:
    """Return the orientation to take, the other, and that they are hardly apart, if they are."""
    advantage = (turned.value - plain.value) / len(problem.source)
    chosen = advantage > settings.reflect_margin
    said = tied_orientations(advantage) if abs(advantage) <= settings.reflect_margin else []
    return (turned, plain, said) if chosen else (plain, turned, said)


def _mirrored(result: SearchResult) -> SearchResult:
    """Return the result of a search on the conjugated source as one on the source itself."""
    return replace(result, mobius=Mobius(result.mobius.z, result.mobius.theta, True))
