"""From many surfaces to maps between them: what is done in which order, and what is known in the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..align.surfaces.settings import AlignSettings
from ..surface.mesh import Booleans, Floats
from .atlas import Atlas
from .cycles import Edge, closing_error, edge_errors, specimen_errors, suspect, triangles
from .engine import Open
from .folder import Folder
from .pair import Figures
from .plan import Plan, Specimen, Told
from .routes import medoid, star_routes, tree_routes
from .work import Work

MOST_CELLS = 1 << 21
"""Cells of a search: a minute's, at 30 microseconds each on 10 pairs of teeth, which take 18,000 at most."""

ROUNDS = 4
"""Times that paths are laid anew when dense maps turn out to be suspect: each time round more of them."""


@dataclass(frozen=True, eq=False)
class Collection:
    """What is known of a collection.

    Attributes
    ----------
    folder : Folder
    names : list of str
        Specimens that could be prepared, in alphabetical order; all else is in theirs.
    edges : list of (int, int)
        Pairs that could be aligned: source and target.
    figures : list of Figures
        Of the pairs, by their best maps.
    errors : (e,) float64
        How wrong each map is by three-cycles, in diagonals; nan where it is in none.
    suspects : (e,) bool
    cycles : (t, 3) int, (t,) float64
        The triangles that were walked, and how far from closed they are.
    root : int
        Where paths begin.
    routes : dict of int to list of int
        Path from the root to each specimen that can be reached.
    failures : dict of str to str
        Names of specimens, or "A to B" of pairs, and why they could not be prepared or aligned.
    settings : AlignSettings
    """

    folder: Folder
    names: list[str]
    edges: list[Edge]
    figures: list[Figures]
    errors: Floats
    suspects: Booleans
    cycles: tuple[Any, Floats]
    root: int
    routes: dict[int, list[int]]
    failures: dict[str, str]
    settings: AlignSettings

    @cached_property
    def atlas(self) -> Atlas:
        """The maps."""
        known = dict(zip(self.edges, self.figures, strict=True))
        return Atlas(self.folder, self.names, known, self.settings.samples)

    @property
    def specimen_errors(self) -> Floats:
        """How wrong the maps of each specimen are, (n,), on average."""
        return specimen_errors(len(self.names), self.edges, self.errors)

    def distances(self) -> Floats:
        """Return the continuous Procrustes distances, (n, n); nan for pairs that were not aligned."""
        found = np.full((len(self.names), len(self.names)), np.nan)
        np.fill_diagonal(found, 0)
        for (a, b), known in zip(self.edges, self.figures, strict=True):
            found[a, b] = found[b, a] = known.distance
        return found


def collect(
    specimens: Sequence[Specimen],
    root: Path,
    opened: Open,
    *,
    plan: Plan | None = None,
    settings: AlignSettings | None = None,
    at_a_time: int = 1,
    tell: Callable[[Told], None] | None = None,
) -> Collection:
    """Prepare specimens, align the pairs that a plan asks for, and find out which maps to trust.

    What a folder holds of an earlier run with the same specimens and settings is not done again.

    Parameters
    ----------
    specimens : sequence of Specimen
        At least two, of different names.
    root : Path
        The folder for all that is written. Processes on other machines must see it under the same path.
    opened : callable
        Begins a `concurrent.futures.Executor`; see `engine.processes`.
    plan : Plan, optional
    settings : AlignSettings, optional
        Threads are one for each task, no more is searched than what decides (`thorough`), and searches end after
        `MOST_CELLS`, or `most_nodes`, not after a time, whatever it says: results do not depend on what else the
        processors do.
    at_a_time : int
        How many tasks the executor works on at a time.
    tell : callable, optional
        Called with a `Told` after each task.

    Raises
    ------
    ValueError
        Fewer than two specimens could be prepared; two have one name; the template is none of them.
    """
    plan, settings = plan or Plan(), settings or AlignSettings()
    most = settings.most_nodes or MOST_CELLS
    settings = replace(settings, threads=1, thorough=False, time_limit=None, most_nodes=most)
    # a pair's direction is the same whatever is added later
    specimens = sorted(specimens, key=lambda specimen: specimen.name)
    names = [specimen.name for specimen in specimens]
    if twins := {name for name in names if names.count(name) > 1}:
        raise ValueError(f"two specimens are called '{min(twins)}': rename one")
    if plan.template is not None and plan.template not in names:
        raise ValueError(f"the template '{plan.template}' is none of the specimens: {', '.join(names[:8])}")
    folder = Folder(root)
    folder.write_manifest(
        {
            "settings": asdict(settings),
            "plan": asdict(plan),
            "specimens": [{"name": specimen.name, "stamp": specimen.stamp} for specimen in specimens],
        }
    )
    work = Work(folder, opened, at_a_time, tell or (lambda told: None), {})
    try:
        names = work.prepared(specimens, settings, plan)
        if len(names) < 2:
            why = "; ".join(f"{name}: {error}" for name, error in list(work.failures.items())[:3])
            raise ValueError(f"fewer than two specimens could be prepared ({why})")
        return _collected(work, names, plan, settings)
    finally:
        folder.close()


def _collected(work: Work, names: list[str], plan: Plan, settings: AlignSettings) -> Collection:
    count = len(names)
    rough = replace(settings, refine="mobius" if settings.refine == "dense" else settings.refine)
    root = None
    if plan.template is not None:
        if plan.template not in names:
            raise ValueError(f"the template '{plan.template}' could not be prepared: {work.failures[plan.template]}")
        root = names.index(plan.template)
    every = [(a, b) for a in range(count) for b in range(a + 1, count)]
    if plan.pairs == "star" and root is not None:
        wanted = [(min(root, k), max(root, k)) for k in range(count) if k != root]
        leaves = [k for k in range(count) if k != root]
        ring = zip(leaves, [*leaves[1:], leaves[0]], strict=True)
        extra = {(min(a, b), max(a, b)) for a, b in ring if a != b}
        first = wanted + (sorted(extra) if plan.check else [])
    else:
        first = every
    found = work.aligned("pairs", names, first, settings if plan.pairs == "all" else rough)
    edges = sorted(found)
    if not edges:
        why = "; ".join(f"{name}: {error}" for name, error in list(work.failures.items())[:3])
        raise ValueError(f"no pair could be aligned ({why})")
    errors, cycles = _checked(work.folder, names, found, edges, settings)
    # what costs are of Möbius maps: dense ones of some pairs are no cheaper for it
    costs = np.array([found[edge].cost for edge in edges])
    bad = suspect(errors)
    if root is None:
        root = medoid(count, edges, np.where(bad, costs + 1, costs))
    routes = _routes(plan, count, edges, costs, bad, root)
    if plan.pairs != "all" and settings.refine == "dense":
        dense: set[Edge] = set()
        for left in reversed(range(ROUNDS)):
            steps = {(min(a, b), max(a, b)) for path in routes.values() for a, b in pairwise(path)} - dense
            if not steps:
                break
            found |= work.aligned("dense maps", names, sorted(steps), settings)
            dense |= steps
            errors, cycles = _checked(work.folder, names, found, edges, settings)
            bad = suspect(errors)
            if left:  # the last paths stay: all their maps are dense
                routes = _routes(plan, count, edges, costs, bad, root)
    return Collection(
        folder=work.folder,
        names=names,
        edges=edges,
        figures=[found[edge] for edge in edges],
        errors=errors,
        suspects=bad,
        cycles=cycles,
        root=root,
        routes=routes,
        failures=work.failures,
        settings=settings,
    )


def _routes(plan: Plan, count: int, edges: list[Edge], costs: Floats, bad: Booleans, root: int) -> dict[int, list[int]]:
    if plan.pairs == "star":
        return star_routes(count, edges, costs, bad.tolist(), root)
    return tree_routes(count, edges, costs, bad.tolist(), root)


def _checked(
    folder: Folder, names: list[str], found: dict[Edge, Figures], edges: list[Edge], settings: AlignSettings
) -> tuple[Floats, tuple[Any, Floats]]:
    """Return how wrong each map is, and the triangles it is known from."""
    atlas = Atlas(folder, names, found, settings.samples)
    cycles = triangles(edges)
    open_by = np.array([closing_error(atlas, cycle) for cycle in cycles.tolist()], np.float64)
    told = np.isfinite(open_by)  # the others have nothing in common
    cycles, open_by = cycles[told], open_by[told]
    return edge_errors(edges, cycles, open_by), (cycles, open_by)
