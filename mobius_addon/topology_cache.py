"""What each mesh is, in one line for the panel, computed once per mesh and edit and not at every redraw."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..solver import MeshError, TriangleMesh, topology
from ..solver.mesh import plural
from .computation import Repair, in_order
from .mesh_data import read_surface

MAX_POLYGONS = 200_000
"""Larger meshes are checked when asked only, so that drawing the panel never takes noticeable time."""


@dataclass(frozen=True)
class Line:
    """What the panel says about a mesh.

    Attributes
    ----------
    rows : tuple of str
        Short texts, for one row each: what it is, or what is in the way and then what to do about it.
    is_disc : bool or None
        None if it is not known yet.
    """

    rows: tuple[str, ...]
    is_disc: bool | None


# a cache, never the truth: it can be emptied at any time
_lines: dict[tuple[int, ...], Line] = {}


def line_of(obj: bpy.types.Object, repair: Repair) -> Line:
    """Return the line about a mesh object in Object Mode, with the repairs that flatten and align will do."""
    key = _key(obj, repair)
    if key not in _lines:
        if len(obj.data.polygons) > MAX_POLYGONS:
            return Line((f"{len(obj.data.vertices):,} vertices, not checked yet",), None)
        try:
            store(obj, read_surface(obj).mesh, repair)
        except MeshError as error:
            _lines[key] = Line(_rows(str(error).removeprefix(f"'{obj.name}' ")), False)
    return _lines[key]


def store(obj: bpy.types.Object, mesh: TriangleMesh, repair: Repair) -> None:
    """Find out and keep what an object's mesh is."""
    _lines[_key(obj, repair)] = _line(mesh, repair)


def _line(mesh: TriangleMesh, repair: Repair) -> Line:
    try:
        found = topology(in_order(mesh, repair).mesh)
    except MeshError as error:
        return Line(_rows(str(error).removeprefix(f"'{mesh.name}' ")), False)
    if problems := found.problems(fill_holes=repair.fill_holes):
        return Line(tuple(row for problem in problems for row in _rows(problem)), False)
    openings = len(found.boundary_loops) - 1
    what = f"disc with {plural(openings, 'opening')}" if openings else "disc"
    return Line((f"{what}, {found.vertices:,} vertices",), True)


def _rows(problem: str) -> tuple[str, ...]:
    """Split what is wrong from what to do about it."""
    return tuple(problem.split(": ", 1))


def _key(obj: bpy.types.Object, repair: Repair) -> tuple[int, ...]:
    mesh = obj.data
    counts = len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons)
    return mesh.session_uid, *counts, repair.fill_holes, repair.largest_part


@bpy.app.handlers.persistent
def _forget_edited(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not _lines:
        return
    for update in depsgraph.updates:
        if update.is_updated_geometry:
            data = getattr(update.id.original, "data", update.id.original)
            uid = getattr(data, "session_uid", None)
            for key in [key for key in _lines if key[0] == uid]:
                del _lines[key]


@bpy.app.handlers.persistent
def _forget_all(*_: object) -> None:
    _lines.clear()


def register() -> None:
    """Watch for edits."""
    bpy.app.handlers.depsgraph_update_post.append(_forget_edited)
    for handlers in (bpy.app.handlers.load_post, bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        handlers.append(_forget_all)


def unregister() -> None:
    """Stop watching."""
    bpy.app.handlers.depsgraph_update_post.remove(_forget_edited)
    for handlers in (bpy.app.handlers.load_post, bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        handlers.remove(_forget_all)
    _lines.clear()
