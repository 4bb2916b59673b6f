"""Two closed surfaces: the searches on the sphere that `mobius_map` makes in the disc."""

from __future__ import annotations

from ...search.matching import Objective
from ...search.outcome import SphereSearchResult
from ...search.sphere_search import sphere_search
from ...stages import Cancelled, Part
from ..surfaces.remark import Remark
from ..surfaces.settings import AlignSettings

GAP = 0.01
"""Share of the value within which the joint search stops: rotations are proved exactly, and what is left of the way to
the right map is for all vertices to find (`refine`, `bend`)."""

MOST_CELLS = 1_000_000
"""Cells of both searches, some five seconds of two processors; a number of cells, so that every machine ends with the
same. Cortices, a head and a brain take 270,000 to 680,000 to that gap."""


def searched_sphere(
    problem: Objective, settings: AlignSettings, clock: Part
) -> tuple[SphereSearchResult, SphereSearchResult | None, list[Remark]]:
    """Search the orientations that the settings ask for; return the one to take, the other, and what is to be said.

    Rotations decide which orientation it is, and are proved; then all transformations of that one are searched.
    """
    results: dict[bool, SphereSearchResult] = {}
    sides = {"never": [False], "always": [True], "auto": [False, True]}[settings.reflect]
    for position, reflected in enumerate(sides):
        text = "Searching the reflection" if reflected else "Searching"
        clock.begin("search reflected" if reflected else "search", text, 0.4 + 0.1 * position)
        results[reflected] = _side(problem, settings, clock, reflected, 0.0)
    said: list[Remark] = []
    chosen = sides[0]
    if len(results) == 2:
        advantage = (results[True].value - results[False].value) / len(problem.source)
        chosen = advantage > settings.reflect_margin
        if abs(advantage) <= settings.reflect_margin:
            said += tied_orientations(advantage)
    clock.begin("search", "Searching", 0.6)
    found = _side(problem, settings, clock, chosen, settings.h_max) if settings.h_max else results[chosen]
    if not found.rotations_certified:
        text = "not proved optimal: time ran out before the rotations were searched to their end"
        said.append(Remark("unproved", text))
    return found, results.get(not chosen), said


def tied_orientations(advantage: float) -> list[Remark]:
    """Say that the orientations differ by too small a share of the samples, to be taken as mirrored."""
    share = 100 * abs(advantage)
    said = f"ambiguous orientation: mirrored and not mirrored differ by {share:.1f} % of the samples; "
    return [Remark("orientation", said + "taken as not mirrored")]


def _side(
    problem: Objective, settings: AlignSettings, clock: Part, reflected: bool, h_max: float
) -> SphereSearchResult:
    """Search one orientation."""
    found = sphere_search(
        problem.source * [1.0, -1.0, 1.0] if reflected else problem.source,
        problem.target,
        problem.radius,
        weights=problem.weights,
        h_max=h_max,
        time_limit=settings.time_limit,
        progress=clock.searching(0.15),
        gap=GAP,
        most_nodes=min(MOST_CELLS, settings.most_nodes or MOST_CELLS),
    )
    if found.cancelled:
        raise Cancelled
    return found.as_reflected() if reflected else found
