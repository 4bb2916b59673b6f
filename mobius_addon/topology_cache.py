"""What each mesh is, in one line for the panel, computed once per mesh and edit and not at every redraw."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_

from ..solver import Cleaned, MeshError, Topology, topology
from ..solver.align.cut.held import held
from ..solver.surface.cleaning import LEFT_OUT
from . import edits
from .computation import Repair, in_order
from .mesh_data import Surface, foreach, read_surface
from .translation import told

MAX_POLYGONS = 200_000
"""Larger meshes are checked when asked only, so that drawing the panel never takes noticeable time."""

MAX_FLATTENED = 40_000
"""Triangles up to which the disc is looked at too, in 0.3 s of the processor; of others the button *Check* tells."""

HELD = {
    "narrow": n_("long and narrow: less exact"),
    "deep": n_("deep: better cut out a piece"),
    "too deep": n_("too deep: a piece will be cut out"),
}


@dataclass(frozen=True)
class Line:
    """What the panel says about a mesh.

    Attributes
    ----------
    rows : tuple of str
        Short texts, for one row each: what it is, or what is in the way and then what to do about it.
    is_disc : bool or None
        Whether it can be used, openings that will be filled included; None if that is not known yet.
    selectable : bool
        Whether there is something to select: what is in the way, or the loops that will be filled.
    remedy : str
        The setting that helps when it is turned on; empty if none does.
    edits : tuple of str
        What would mend the mesh itself, as `operators.mend` calls it; for the computation it need not be done.
    """

    rows: tuple[str, ...]
    is_disc: bool | None
    selectable: bool = False
    remedy: str = ""
    edits: tuple[str, ...] = ()


# a cache, never the truth: it can be emptied at any time
_lines: dict[tuple[int | str, ...], Line] = {}


def line_of(obj: bpy.types.Object, repair: Repair) -> Line:
    """Return the line about a mesh object in Object Mode, with the repairs that flatten and align will do."""
    key = _key(obj, repair)
    if key not in _lines:
        if len(obj.data.polygons) > MAX_POLYGONS:
            count = iface_("{:,} vertices").format(len(obj.data.vertices))
            return Line((count, iface_("not checked yet")), None, True)
        try:
            store(obj, read_surface(obj), repair)
        except MeshError as error:
            _lines[key] = Line(_rows(error, obj.name), False)
    return _lines[key]


def store(obj: bpy.types.Object, surface: Surface, repair: Repair) -> None:
    """Find out and keep what an object's mesh is."""
    line = _line(surface, repair)
    seams = foreach(obj.data.edges, "use_seam", 1, np.bool_).any()
    _lines[_key(obj, repair)] = replace(line, edits=_edits(topology(surface.mesh), line, has_seams=bool(seams)))


def _edits(found: Topology, line: Line, *, has_seams: bool) -> tuple[str, ...]:
    """Return what may mend a mesh of this topology; nothing of a clean one."""
    troubled = not line.is_disc or line.selectable
    fitting = {
        "largest": found.parts > 1,
        "fill": found.parts == 1 and len(found.boundary_loops) > 1,
        "inner": len(found.non_manifold_edges) > 0,
        "cut": has_seams and (not line.is_disc or not found.boundary_loops),
        "normals": len(found.inconsistent_edges) > 0,
        "join": troubled,
        "flip": troubled,
    }
    return tuple(how for how, fits in fitting.items() if fits)


def _line(surface: Surface, repair: Repair) -> Line:
    mesh, changes, tidy = surface.mesh, 0, None
    try:
        tidy = in_order(mesh, repair, surface.keys)
        mesh, changes = tidy.mesh, len(tidy.changes)
    except MeshError as error:
        refused = _rows(error, mesh.name)
    else:
        refused = None
    found = topology(mesh)
    if problem := _problem(found, repair):
        return Line(problem[:2], False, True, problem[2])
    if refused:  # such as a band with one side only
        return Line(refused, False)
    beside = [said for said in tidy.changes if said.endswith(LEFT_OUT)] if tidy else []
    mended = tuple(told(said.removesuffix("left out") + "beside it") for said in beside)
    if changes > len(beside):
        mended += (iface_("mended for the computation: {:,}").format(changes - len(beside)),)
    try:
        mended += _held(tidy, repair) if tidy else ()
    except MeshError as error:
        return Line(_rows(error, mesh.name), False)
    if not found.boundary_loops:
        return Line((iface_("closed, {:,} vertices").format(found.vertices), *mended), True, bool(changes))
    if openings := len(found.boundary_loops) - 1:
        loops = iface_("{:,} boundary loops:").format(openings + 1)
        return Line((loops, iface_("{:,} will be filled").format(openings), *mended), True, True)
    return Line((iface_("disc, {:,} vertices").format(found.vertices), *mended), True, bool(changes))


def _held(tidy: Cleaned, repair: Repair) -> tuple[str, ...]:
    """Return what is to be said of a surface that a disc holds badly; raises `MeshError` where none does."""
    if len(tidy.mesh.faces) > MAX_FLATTENED:
        return ()
    found = held(tidy, fill_holes=repair.fill_holes)
    return () if found is None else (iface_(HELD[found.kind]),)


def _problem(found: Topology, repair: Repair) -> tuple[str, str, str] | None:
    """Return the first thing that is in the way, what to do about it, and the setting that does it, if one does."""
    loops = found.boundary_loops
    parts = found.parts if found.parts > 1 else 0
    for count, what, remedy, setting in (
        (len(found.non_manifold_edges), n_("{:,} edges with over 2 faces:"), n_("delete the extra faces"), ""),
        (len(found.non_manifold_vertices), n_("{:,} points where parts touch:"), n_("split them"), ""),
        (parts, n_("{:,} separate parts:"), n_("keep one, or turn on Largest Part"), "largest_part"),
        (0 if repair.fill_holes else len(loops[1:]), n_("{:,} openings:"), n_("turn on Fill Holes"), "fill_holes"),
        (found.handles, n_("{:,} handles, as of a cup:"), n_("cut through them and fill"), ""),
    ):
        if count:
            return iface_(what).format(count), iface_(remedy), setting
    return None


def _rows(error: MeshError, name: str) -> tuple[str, ...]:
    """Split what is wrong with a mesh, without its name, which stands above, from what to do about it."""
    start, _, rest = told(str(error)).partition(name)
    # the quotes are those of the language
    return tuple((rest[1:].lstrip() if len(start) == 1 else start + name + rest).split(": ", 1))


def _key(obj: bpy.types.Object, repair: Repair) -> tuple[int | str, ...]:
    mesh = obj.data
    counts = len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons)
    # the texts are in the language of the interface
    language = bpy.app.translations.locale
    return mesh.session_uid, *counts, repair.fill_holes, repair.largest_part, language


def _forget(edited: int | None) -> None:
    for key in [key for key in _lines if edited is None or key[0] == edited]:
        del _lines[key]


def register() -> None:
    """Watch for edits."""
    edits.listen(_forget)


def unregister() -> None:
    """Stop watching."""
    edits.ignore(_forget)
    _lines.clear()
