"""What a process of its own does: prepare a specimen, or align a pair of prepared ones. All of it by files."""

from __future__ import annotations

import os
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

import numpy as np

from ..align.pipeline import align
from ..align.surfaces.prepared import Surface, prepare
from ..align.surfaces.settings import AlignSettings
from ..align.surfaces.surface_file import load_surface, save_surface
from ..carry.correspond import correspond
from ..carry.map_file import save_map
from ..surface.mesh import Floats, MeshError, TriangleMesh
from .distance import EvenFlow
from .pair import figures

KEPT = 24
"""Prepared surfaces that a process keeps in memory: 13 MB each, of 10,000 triangles (`tests/bench/growth.py`)."""

Result = dict[str, Any]
"""Plain data: what a task found, or "error", why it found nothing, and "again", if that is no fault of the surfaces."""


@dataclass(frozen=True)
class Prepare:
    """Put the mesh in a file in order, flatten it, measure curvature and choose points; write that to `path`."""

    name: str
    mesh: str
    settings: dict[str, Any]
    largest_part: bool
    path: str


@dataclass(frozen=True)
class Compare:
    """Align the prepared surfaces in two files; write the map to `map_path` if these alone do not tell it."""

    source: str
    target: str
    settings: dict[str, Any]
    map_path: str


Task = Prepare | Compare


def run(task: dict[str, Any]) -> Result:
    """Do a task, given by its kind and its fields, and return plain data, whatever happens.

    Nothing of this package crosses to another process: there it may have another name.
    """
    work = {
        "prepare": lambda **given: _prepare(Prepare(**given)),
        "compare": lambda **given: _compare(Compare(**given)),
    }
    try:
        return work[task["kind"]](**task["given"])
    except (MeshError, ValueError) as error:
        return {"error": str(error) or type(error).__name__}
    except OSError as error:
        return {"error": str(error) or type(error).__name__, "again": True}
    except MemoryError:
        return {"error": "there is not enough memory for it", "again": True}
    except Exception as error:  # a fault of the program: named, and the others go on
        where = traceback.extract_tb(error.__traceback__)[-1]
        return {"error": f"{type(error).__name__} in {Path(where.filename).name}, line {where.lineno}: {error}"}


def plain(task: Task) -> dict[str, Any]:
    """Return a task as what `run` takes."""
    return {"kind": type(task).__name__.lower(), "given": dict(vars(task))}


def begin() -> None:
    """Begin a process for tasks: it ends with the one that began it, however that ends."""
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.join,), daemon=True).start()


def _end_with(ended: Callable[[], object]) -> None:
    ended()
    os._exit(1)


def write_mesh(path: Path, mesh: TriangleMesh, keys: Floats | None) -> None:
    """Write a mesh for `Prepare`, and the further coordinates of its vertices."""
    held = {} if keys is None else {"keys": keys}
    with path.open("wb") as file:
        np.savez(file, vertices=mesh.vertices, faces=mesh.faces, **held)


def _read_mesh(path: Path, name: str) -> tuple[TriangleMesh, Floats | None]:
    with np.load(path, allow_pickle=False) as held:
        return TriangleMesh(held["vertices"], held["faces"], name), held.get("keys")


def _prepare(task: Prepare) -> Result:
    begun = time.process_time()
    mesh, keys = _read_mesh(Path(task.mesh), task.name)
    surface = prepare(mesh, AlignSettings(**task.settings), largest_part=task.largest_part, keys=keys)
    _ = surface.flattening  # or why there is none
    with whole_file(Path(task.path)) as path:
        save_surface(path, surface)
    return {
        "fingerprint": mesh.fingerprint,
        "notes": list(surface.notes),
        "vertices": len(mesh.vertices),
        "faces": len(mesh.faces),
        "seconds": time.process_time() - begun,
    }


@dataclass(frozen=True, eq=False)
class _Known:
    """A prepared surface, and what is computed of it for any pair."""

    surface: Surface

    @cached_property
    def flow(self) -> EvenFlow:
        return EvenFlow(self.surface.flattening)


@lru_cache(maxsize=KEPT)
def _loaded(path: str, _changed: int) -> _Known:
    return _Known(load_surface(path))


def _known(path: str) -> _Known:
    return _loaded(path, Path(path).stat().st_mtime_ns)


def _compare(task: Compare) -> Result:
    source, target = _known(task.source), _known(task.target)
    begun = time.process_time()
    alignment = align(source.surface, target.surface, AlignSettings(**task.settings))
    # of pieces, or of surfaces joined at the lips, there are other discs than those that were prepared
    prepared = [alignment.source is source.surface.flattening, alignment.target is target.surface.flattening]
    written = alignment.settings.refine == "dense" or not all(prepared)
    if written:
        with whole_file(Path(task.map_path)) as path:
            originals = source.surface.original, target.surface.original
            save_map(path, alignment, correspond(alignment), *originals)
    flow = source.flow if prepared[0] else EvenFlow(alignment.source)
    found = figures(alignment, flow, 0.0, written=written)
    return {**found.plain(), "seconds": time.process_time() - begun}


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a path to write to, in the same folder, and move what was written to `path` at the end: all or nothing."""
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.unfinished")
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
