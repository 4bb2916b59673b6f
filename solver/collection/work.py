"""A collection's tasks: those that are not done yet are handed to an executor, and each result is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from ..align.surfaces.settings import AlignSettings
from ..surface.mesh import MeshError
from .cycles import Edge
from .engine import Open, completed
from .folder import PREPARING, Folder, digest, figures_of
from .pair import Figures
from .plan import Plan, Specimen, Told
from .tasks import Compare, Prepare, Result, Task, write_mesh


@dataclass(frozen=True, eq=False)
class Work:
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
        given = {name: getattr(settings, name) for name in PREPARING}
        count = _Count("preparing", len(specimens), len(specimens) - len(new), self.tell)

        def tasks() -> Iterator[tuple[str, Task]]:
            for specimen in new:
                try:
                    mesh, keys = specimen.read()
                except (MeshError, OSError) as error:
                    self.failures[specimen.name] = str(error)
                    count.one(specimen.name, str(error))
                    continue
                handed, path = self.folder.handed(specimen.name), self.folder.surface(specimen.name)
                write_mesh(handed, mesh, keys)
                task = Prepare(specimen.name, str(handed.resolve()), given, plan.largest_part, str(path.resolve()))
                yield specimen.name, task

        for name, result in completed(tasks(), self.opened, self.at_a_time):
            self.folder.handed(name).unlink(missing_ok=True)
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
            if line is None or line.get("again") or self._map_is_missing(line):
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
                yield edge, Compare(here, there, given, str(self.folder.dense_map(source, target).resolve()))

        for edge, result in completed(tasks(), self.opened, self.at_a_time):
            line = self.folder.add_pair(names[edge[0]], names[edge[1]], asked, result)
            self._take(edge, line, found)
            count.one(_pair_name(line), line.get("error"))
        return found

    def _map_is_missing(self, line: Result) -> bool:
        return bool(line.get("written")) and not self.folder.dense_map(line["source"], line["target"]).is_file()

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
