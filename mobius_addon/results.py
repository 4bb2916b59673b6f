"""What flatten, align and show write on a mesh for people to see, and how it goes away again.

UV layouts, colors and the group of matched points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from scipy.spatial.transform import Rotation

from ..solver.surface.mesh import Booleans, Complexes, Floats
from .attributes import (
    DISC_LAYOUT,
    LIVE_NAMES,
    MATCHED_GROUP,
    MAX_UV_MAPS,
    OWN_NAMES,
    SHARED_LAYOUT,
    AttributeAccess,
    VertexGroupAccess,
    note,
    persons_own,
)
from .live import remove_live
from .mesh_data import Refusal, Surface, foreach

_LAYOUT = AttributeAccess("FLOAT2", "CORNER", "vector", 2)
_COLOR = AttributeAccess("FLOAT_COLOR", "POINT", "color", 4)

CHECKS = 12
"""Of the pattern, along the diagonal of the source."""

NO_COUNTERPART = (0.05, 0.05, 0.05, 1.0)
"""Linear color of points that correspond to nothing."""


def require_room(obj: bpy.types.Object, layouts: Sequence[str], colors: Sequence[str] = ()) -> None:
    """Make sure that UV layouts and colors of these names can be written.

    Raises
    ------
    Refusal
        Another kind of attribute or a vertex group bears the name, or all UV maps that Blender allows are there.
    """
    for access, what, names in ((_LAYOUT, "UV map", layouts), (_COLOR, "color attribute", colors)):
        for name in names:
            if access.place(obj, name, frozenset()) != name:
                raise Refusal(f"'{obj.name}' has something named '{name}' that is no {what}: rename it")
    if len({x.name for x in obj.data.uv_layers} | set(layouts)) > MAX_UV_MAPS:
        raise Refusal(f"'{obj.name}' has {MAX_UV_MAPS} UV maps, and Blender allows no more: delete one")


def write_layout(obj: bpy.types.Object, name: str, disc: Complexes, surface: Surface) -> None:
    """Write points of the unit disc as a UV map, uv = (disc + 1) / 2, and make it the active one.

    `disc`, (m, 3), is at the triangles' corners. Faces that have no place in the disc, nan, are put into its corner
    (0, 0), outside the disc.

    Raises
    ------
    Refusal
        As `require_room`; nothing is written.
    """
    require_room(obj, [name])
    note(obj)
    render = next((x.name for x in obj.data.uv_layers if x.active_render), None)
    at_corner = np.full(len(surface.corner_vertex), complex(np.nan, np.nan))
    placed = np.isfinite(disc.real)
    at_corner[surface.triangle_corners[placed]] = disc[placed]
    plane = np.stack([at_corner.real, at_corner.imag], axis=1) / 2 + 0.5
    bare = np.bincount(surface.corner_polygon, np.isnan(at_corner.real)) > 0
    values = np.where(bare[surface.corner_polygon, None], 0.0, plane)
    _LAYOUT.write(obj, name, values, np.ones(len(values), bool))
    layers = obj.data.uv_layers
    layers.active = layers[name]
    if render is not None:  # what is rendered stays as it was
        layers[render].active_render = True


@dataclass(frozen=True, eq=False)
class Layout:
    """A mesh in the shared layout, as `write_layout` wrote it.

    Attributes
    ----------
    disc : (n,) complex128
        Each vertex's place; nan where it has none.
    edges : (e, 2) int32
        The mesh's edges between vertices that have a place.
    """

    disc: Complexes
    edges: np.ndarray


def read_layout(obj: bpy.types.Object) -> Layout | None:
    """Return a mesh, not in Edit Mode, in the shared layout; None if it has none."""
    mesh = obj.data
    layer = mesh.uv_layers.get(SHARED_LAYOUT)
    if layer is None or not len(layer.uv):
        return None
    places = np.full((len(mesh.vertices), 2), np.nan)
    places[foreach(mesh.loops, "vertex_index", 1, np.int32)] = foreach(layer.uv, "vector", 2, np.float32)
    places[(places == 0).all(axis=1)] = np.nan
    disc = 2 * (places[:, 0] + 1j * places[:, 1]) - (1 + 1j)
    edges = foreach(mesh.edges, "vertices", 2, np.int32)
    return Layout(disc, edges[np.isfinite(disc)[edges].all(axis=1)])


def pattern_color(disc: Complexes, places: Floats) -> Floats:
    """Return linear colors, (n, 4), of a pattern of checks in all directions of space.

    The edges of the checks are soft, as colors at vertices are, and hues tell them apart.

    Parameters
    ----------
    disc : (n,) complex128
        Points of the unit disc, for the hues.
    places : (n, 3) float64
        Points in space, for the checks: `CHECKS` to the unit.
    """
    # along axes askew to those of the object, which flat parts of it may lie across
    waves = np.sin(np.pi * CHECKS * places @ Rotation.from_euler("xyz", (0.5, 0.7, 0.3)).as_matrix())
    light = 0.5 + 0.5 * np.prod(np.tanh(4 * waves), axis=1)
    # nearer to the rim, where hues are fuller
    color = disc_color(disc / np.sqrt(np.maximum(np.abs(disc), 1e-12)))
    color[:, :3] *= (0.25 + 0.75 * light)[:, None]
    return color


def disc_color(disc: Complexes) -> Floats:
    """Return a linear color, (n, 4), for each point of the unit disc, (n,): grey in the middle, full hues at the rim.

    Each channel is a linear function of position, so that interpolating colors interpolates positions.
    """
    hues = np.exp(2j * np.pi * np.arange(3) / 3)
    channels = 0.5 + 0.5 * np.real(disc[:, None] * np.conj(hues))
    return np.concatenate([channels, np.ones((len(disc), 1))], axis=1)


def write_color(obj: bpy.types.Object, name: str, color: Floats, covered: Booleans) -> None:
    """Write a linear color per vertex, (n, 4), `NO_COUNTERPART` where not covered, and make it the active one."""
    note(obj)
    attributes = obj.data.attributes
    render = attributes.default_color_name
    _COLOR.write(obj, name, np.where(covered[:, None], color, NO_COUNTERPART), np.ones(len(color), bool))
    attributes.active_color_name = name
    if render:
        attributes.default_color_name = render


def write_group(obj: bpy.types.Object, name: str, weights: Floats) -> None:
    """Write weights, (n,), as a vertex group made anew, and leave the person's active group active."""
    note(obj)
    groups = obj.vertex_groups
    active = groups.active.name if groups.active else None
    if name in groups:
        groups.remove(groups[name])
    VertexGroupAccess().write(obj, name, weights, np.ones(len(weights), bool))
    if active is not None and active in groups:
        groups.active = groups[active]


def clear_results(obj: bpy.types.Object) -> int:
    """Remove all of these from an object's mesh, with the alignment it keeps, and return how many things there were.

    What was active before is so again; what the person has made active since stays so. Something of another kind that
    has one of the names is not ours and stays.
    """
    mesh, groups, own = obj.data, obj.vertex_groups, persons_own(obj)
    layouts = OWN_NAMES & {DISC_LAYOUT, SHARED_LAYOUT}
    kinds = ((_LAYOUT, layouts), (_COLOR, OWN_NAMES - layouts - {MATCHED_GROUP, *LIVE_NAMES}))
    names = [name for access, of_kind in kinds for name in access.existing(obj, sorted(of_kind))]
    for name in names:
        if name in layouts:
            mesh.uv_layers.remove(mesh.uv_layers[name])
        else:
            mesh.attributes.remove(mesh.attributes[name])
    removed = len(names) + bool(mesh.mobius_alignment.target_fingerprint) + remove_live(obj)
    if MATCHED_GROUP in groups:
        groups.remove(groups[MATCHED_GROUP])
        removed += 1
    own.put_back(obj)
    mesh.property_unset("mobius_alignment")
    mesh.property_unset("mobius_before")
    mesh.property_unset("mobius_transferred")
    mesh.update()
    return removed
