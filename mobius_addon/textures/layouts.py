"""UV layouts and tangent frames at the corners of triangles."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...solver import MeshError
from ...solver.carry.textures import LayoutError, TangentFrames, place_in_tiles
from ...solver.surface.mesh import Floats, Integers
from ..attributes.access import OWN_NAMES
from ..attributes.carrier import Carrier
from ..computation import Repair, flattened
from ..mesh_data import Refusal, Surface, foreach, is_mirrored, mirrored
from .settings import TextureSettings

_DISC_NAME = "Disc"


@dataclass(frozen=True, eq=False)
class TargetLayout:
    """The layout that pictures of a target are made for.

    Attributes
    ----------
    name : str
        Of the UV map.
    new : (c, 2) float64 or None
        Its values at face corners, if it is not on the target yet.
    tile : (m,) int
        UDIM number of each triangle, 0 for those without area.
    corners : (m, 3, 2) float64
        Corners of triangles in their tiles.
    source_name : str
        The source's UV map that it was carried from; empty: it was not.
    """

    name: str
    new: Floats | None
    tile: Integers
    corners: Floats
    source_name: str = ""

    def in_tile(self, number: int) -> Floats:
        """Return the corners of triangles, (m, 3, 2), nan for those in other tiles."""
        return np.where((self.tile == number)[:, None, None], self.corners, np.nan)


def rendered_uv(mesh: bpy.types.Mesh) -> str:
    """Return the name of the UV map that a mesh is rendered with, empty if it has none of the person's."""
    layers = [x for x in mesh.uv_layers if x.name not in OWN_NAMES]
    return next((x.name for x in layers if x.active_render), layers[0].name if layers else "")


def corner_uv(mesh: bpy.types.Mesh, name: str) -> Floats:
    """Return a UV map, (c, 2)."""
    return foreach(mesh.uv_layers[name].uv, "vector", 2, np.float32).astype(np.float64)


def target_layout(
    source: bpy.types.Object, target: bpy.types.Object, carrier: Carrier, settings: TextureSettings
) -> TargetLayout:
    """Return the layout that is chosen, or the first that there is.

    Raises
    ------
    Refusal
        There is none, or it cannot hold a picture.
    """
    own, given = rendered_uv(target.data), rendered_uv(source.data)
    kind = settings.layout
    if kind == "auto":
        kind = "own" if own and _has_area(target, own) else "carried" if given else "disc"
    surface = carrier.target
    if kind == "own":
        if not own:
            raise Refusal(f"'{target.name}' has no UV map: unwrap it, or take the source's or the disc")
        return _placed(target.name, own, None, corner_uv(target.data, own), surface)
    if kind == "carried":
        if not given:
            raise Refusal(f"'{source.name}' has no UV map to carry: take the target's own or the disc")
        values, covered = carrier.corners(corner_uv(source.data, given))
        values = np.where(covered[:, None], values, 0.0)
        return _placed(target.name, given, values, values, surface, given)
    values = _disc(target, surface)
    return _placed(target.name, _DISC_NAME, values, values, surface)


def _has_area(obj: bpy.types.Object, name: str) -> bool:
    return bool(np.ptp(corner_uv(obj.data, name), axis=0).all())


def _placed(
    owner: str, name: str, new: Floats | None, values: Floats, surface: Surface, source_name: str = ""
) -> TargetLayout:
    try:
        tile, corners = place_in_tiles(values[surface.triangle_corners])
    except LayoutError as error:
        raise Refusal(f"The UV map '{name}' of '{owner}' {error}") from error
    return TargetLayout(name, new, tile, corners, source_name)


def _disc(target: bpy.types.Object, surface: Surface) -> Floats:
    """Return the conformal layout of a target at its face corners, (c, 2), within the picture."""
    try:
        flat = flattened(surface.mesh, "harmonic", Repair(), keys=surface.keys)
    except MeshError as error:
        raise Refusal(f"'{target.name}' has no UV map, and no disc: {error}") from error
    disc = flat.tidy.at_corners(flat.flattening.disc, np.nan)
    values = np.full((len(surface.corner_vertex), 2), np.nan)
    values[surface.triangle_corners.ravel()] = np.stack([disc.real.ravel(), disc.imag.ravel()], axis=1) * 0.49 + 0.5
    bare = np.bincount(surface.corner_polygon, np.isnan(values[:, 0])) > 0
    return np.where(bare[surface.corner_polygon, None], 0.0, values)


def tangent_frames(obj: bpy.types.Object, surface: Surface, uv: Floats) -> TangentFrames:
    """Return Blender's tangent frames of a mesh for a layout at its face corners, (c, 2), at its triangles' corners.

    By MikkTSpace, as Blender has it, which knows triangles and quads only; a mesh with other polygons is cut into the
    triangles that are drawn.
    """
    mesh = obj.data.copy()
    try:
        if len(mesh.polygons) and foreach(mesh.polygons, "loop_total", 1, np.int32).max() > 4:
            rows = surface.triangle_corners[:, ::-1] if is_mirrored(obj) else surface.triangle_corners
            normals = foreach(mesh.corner_normals, "vector", 3, np.float32)[rows.ravel()]
            whole = mesh
            mesh = bpy.data.meshes.new("mobius")
            places = foreach(whole.vertices, "co", 3, np.float32)
            bpy.data.meshes.remove(whole)
            mesh.from_pydata(places, [], surface.corner_vertex[rows].tolist(), shade_flat=False)
            mesh.normals_split_custom_set(normals.tolist())
            uv = uv[rows.ravel()]
            order = np.arange(rows.size).reshape(-1, 3)
            corners = order[:, ::-1] if is_mirrored(obj) else order
        else:
            corners = surface.triangle_corners
        while mesh.uv_layers:
            mesh.uv_layers.remove(mesh.uv_layers[0])
        layer = mesh.uv_layers.new(name="mobius")
        layer.uv.foreach_set("vector", uv.astype(np.float32).ravel())
        mesh.calc_tangents(uvmap="mobius")
        normal, tangent = (mirrored(obj, foreach(mesh.loops, x, 3, np.float32)) for x in ("normal", "tangent"))
        sign = foreach(mesh.loops, "bitangent_sign", 1, np.float32).astype(np.float64)
        if is_mirrored(obj):
            sign = -sign
        return TangentFrames(normal[corners], tangent[corners], sign[corners])
    finally:
        bpy.data.meshes.remove(mesh)
