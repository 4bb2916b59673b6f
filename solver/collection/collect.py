"""From many surfaces to maps between them: what is done in which order, and what is known in the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..align.settings import AlignSettings
from ..surface.mesh import Booleans, Floats, MeshError, TriangleMesh
from .atlas import Atlas
from .cycles import Edge, closing_error, edge_errors, specimen_errors, suspect, triangles
from .engine import Open, completed
from .folder import Folder, digest, figures_of
from .pair import Figures
from .routes import medoid, star_routes, tree_routes
from .tasks import Compare, Prepare, Result, Task


@dataclass(frozen=True)
class Specimen:
    """A surface of a collection.

    Attributes
    ----------
    name : str
        A file may have it.
    stamp : str
        Changes with the file or array that it is read from.
    read : callable
        Returns the mesh, and further coordinates of its vertices, (n, d), or None; see `surface.cleaned`. May raise
        `MeshError` or OSError.
    """

    name: str
    stamp: str
    read: Callable[[], tuple[TriangleMesh, Floats | None]]


@dataclass(frozen=True)
class Plan:
    """Which pairs are aligned, and how.

    Attributes
    ----------
    pairs : str
        "all": each with each, by `settings.refine`. "star": one with each of the others. "tree": all pairs by Möbius
        maps, then those of their minimum spanning tree by `settings.refine`.
    template : str or None
        The one of a star, and where the tree's paths begin; None: the medoid, for which all pairs are aligned by
        Möbius maps.
    check : bool
        Of a star with a named template: also align each with the next by Möbius maps, so that there are three-cycles.
    largest_part : bool
        Leave out all parts of a specimen but the one of largest area.
    """

    pairs: str = "all"
    template: str | None = None
    check: bool = True
    largest_part: bool = True

    def __post_init__(self) -> None:
        if self.pairs not in ("all", "star", "tree"):
            raise ValueError(f"pairs must be all, star or tree, not '{self.pairs}'")


@dataclass(frozen=True)
class Told:
    """How far a collection is.

    Attributes
    ----------
    stage : str
    done, total : int
        Of the stage's tasks, those done before included.
    fresh : int
        Of them, those that this run has done.
    failed : int
    name : str
        What was done last.
    error : str or None
        Why it could not be done.
    """

    stage: str
    done: int
    total: int
    fresh: int
    failed: int
    name: str = ""
    error: str | None = None


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

    @property
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
        Threads are one for each task, whatever it says.
    at_a_time : int
        How many tasks the executor works on at a time.
    tell : callable, optional
        Called with a `Told` after each task.

    Raises
    ------
    ValueError
        Fewer than two specimens could be prepared; two have one name; the template is none of them.
    """
    plan, settings = plan or Plan(), replace(settings or AlignSettings(), threads=1)
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
    work = _Work(folder, opened, at_a_time, tell or (lambda told: None), {})
    try:
        names = work.prepared(specimens, settings, plan)
        if len(names) < 2:
            why = "; ".join(f"{name}: {error}" for name, error in list(work.failures.items())[:3])
            raise ValueError(f"fewer than two specimens could be prepared ({why})")
        return _collected(work, names, plan, settings)
    finally:
        folder.close()


def _collected(work: _Work, names: list[str], plan: Plan, settings: AlignSettings) -> Collection:
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
    costs = np.array([found[edge].cost for edge in edges])
    bad = suspect(errors)
    if root is None:
        root = medoid(count, edges, np.where(bad, costs + 1, costs))
    routes = _routes(plan, count, edges, costs, bad, root)
    if plan.pairs != "all" and settings.refine == "dense":
        steps = {(min(a, b), max(a, b)) for path in routes.values() for a, b in pairwise(path)}
        found |= work.aligned("dense maps", names, sorted(steps), settings)
        errors, cycles = _checked(work.folder, names, found, edges, settings)
        bad = suspect(errors)
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
    return edge_errors(edges, cycles, open_by), (cycles, open_by)


@dataclass(frozen=True, eq=False)
class _Work:
    """What is done by tasks."""

    folder: Folder
    opened: Open
    at_a_time: int
    tell: Callable[[Told], None]
    failures: dict[str, str]

    def prepared(self, specimens: Sequence[Specimen], settings: AlignSettings, plan: Plan) -> list[str]:
        """Prepare what is not, and return the names of all that are."""
        asked = digest(settings, prepare_only=True, largest_part=plan.largest_part)
        new = [x for x in specimens if not self.folder.prepared(x.name, x.stamp, asked)]
        stamps = {specimen.name: specimen.stamp for specimen in specimens}
        given = {
            name: value for name, value in asdict(settings).items() if name in ("samples", "targets", "fill_holes")
        }
        count = _Count("preparing", len(specimens), len(specimens) - len(new), self.tell)

        def tasks() -> Iterator[tuple[str, Task]]:
            for specimen in new:
                try:
                    mesh, keys = specimen.read()
                except (MeshError, OSError) as error:
                    self.failures[specimen.name] = str(error)
                    count.one(specimen.name, str(error))
                    continue
                path = str(self.folder.surface(specimen.name).resolve())
                yield (
                    specimen.name,
                    Prepare(specimen.name, mesh.vertices, mesh.faces, keys, given, plan.largest_part, path),
                )

        for name, result in completed(tasks(), self.opened, self.at_a_time):
            if (error := result.get("error")) is not None:
                self.failures[name] = error
            else:
                self.folder.add_specimen(name, stamps[name], asked, result)
            count.one(name, error)
        return [specimen.name for specimen in specimens if specimen.name not in self.failures]

    def aligned(self, stage: str, names: list[str], edges: list[Edge], settings: AlignSettings) -> dict[Edge, Figures]:
        """Align the pairs that are not, and return what is known of those that could be."""
        asked = digest(settings)
        known = self.folder.pairs()
        found: dict[Edge, Figures] = {}
        new: list[Edge] = []
        for edge in edges:
            line = known.get((names[edge[0]], names[edge[1]], asked))
            if line is None or self._map_is_missing(line):
                new.append(edge)
            else:
                self._take(edge, line, found)
        del known
        count = _Count(stage, len(edges), len(edges) - len(new), self.tell)
        given = asdict(settings)

        def tasks() -> Iterator[tuple[Edge, Task]]:
            for edge in _in_blocks(new):
                source, target = (names[k] for k in edge)
                here, there = (str(self.folder.surface(name).resolve()) for name in (source, target))
                dense = str(self.folder.dense_map(source, target).resolve()) if settings.refine == "dense" else None
                yield edge, Compare(here, there, given, dense)

        for edge, result in completed(tasks(), self.opened, self.at_a_time):
            line = self.folder.add_pair(names[edge[0]], names[edge[1]], asked, result)
            self._take(edge, line, found)
            count.one(_pair_name(line), line.get("error"))
        return found

    def _map_is_missing(self, line: Result) -> bool:
        return bool(line.get("dense")) and not self.folder.dense_map(line["source"], line["target"]).is_file()

    def _take(self, edge: Edge, line: dict[str, Any], found: dict[Edge, Figures]) -> None:
        known = figures_of(line)
        if known is None:
            self.failures[_pair_name(line)] = line["error"]
        else:
            found[edge] = known


class _Count:
    """Counts the tasks of a stage and tells of each."""

    def __init__(self, stage: str, total: int, before: int, tell: Callable[[Told], None]) -> None:
        self.now = Told(stage, before, total, 0, 0)
        self.tell = tell
        tell(self.now)

    def one(self, name: str, error: str | None) -> None:
        now = self.now
        failed = now.failed + (error is not None)
        self.now = replace(now, done=now.done + 1, fresh=now.fresh + 1, failed=failed, name=name, error=error)
        self.tell(self.now)


BLOCK = 12
"""Specimens of a block of pairs: those of two blocks fit among the surfaces that a process keeps in memory."""


def _in_blocks(edges: list[Edge]) -> list[Edge]:
    """Return pairs in an order in which the same specimens come soon again."""
    return sorted(edges, key=lambda edge: (edge[0] // BLOCK, edge[1] // BLOCK, edge))


def _pair_name(line: dict[str, Any]) -> str:
    return f"{line['source']} to {line['target']}"
