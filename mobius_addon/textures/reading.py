"""Pictures that are prepared: everything is read first, then carried."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...solver import TriangleMesh
from ...solver.carry.frames import local_similarities
from ...solver.carry.in_place import settled
from ...solver.carry.textures import Carrying, FromCorners, MapPaint, Stacked, TurnedNormals, Turns, picture_size
from ..attributes.carrier import Carrier
from ..mesh_data import mirrored
from .carrying import TextureReading
from .layouts import TargetLayout, corner_uv, rendered_uv, tangent_frames, target_layout
from .settings import TextureSettings
from .source import TextureReader


def read_textures(
    source: bpy.types.Object,
    target: bpy.types.Object,
    carrier: Carrier,
    settings: TextureSettings,
    *,
    shown: bpy.types.Object | None = None,
    keeps_map: bool = False,
) -> TextureReading | None:
    """Read the pictures of a source and the layout of a target; None: the source shows no picture.

    Parameters
    ----------
    source, target : bpy.types.Object
    carrier : Carrier
    settings : TextureSettings
    shown : bpy.types.Object, optional
        What is evaluated of the source.
    keeps_map : bool
        A transfer map is made too.

    Raises
    ------
    Refusal
        A picture is missing, or a layout cannot be used.
    """
    obj = shown or source
    reader = TextureReader(obj, carrier)
    plans = reader.plans()
    if not plans and not keeps_map:
        return None
    layout = target_layout(obj, target, carrier, settings)
    meshes = (_in_world(obj, carrier.source.mesh), _in_world(target, carrier.target.mesh))
    carrier = replace(carrier, correspondence=settled(carrier.correspondence, *meshes))
    carrying = Carrying(carrier.correspondence, carrier.source.mesh, carrier.target.mesh)
    size = settings.size or _size(reader, carrying, layout)
    found = carrier.correspondence
    certain = (found.matched & (found.face >= 0)).astype(np.float64)[carrying.target.faces]
    normals = [k for k, plan in enumerate(plans) if plan.channel.identifier == "normal"]
    turns = None
    if normals or (keeps_map and rendered_uv(obj.data)):
        uv = layout.new if layout.new is not None else corner_uv(target.data, layout.name)
        frames = tangent_frames(target, carrier.target, uv), tangent_frames(obj, carrier.source, reader.normal_uv())
        rotation = local_similarities(found, carrier.source.rest, carrier.target.rest)[0]
        turns = Turns(carrying, frames[1], frames[0], rotation)
        for k in normals:
            plans[k] = replace(plans[k], paint=TurnedNormals(plans[k].paint, turns))
    alpha = next((plan for plan in plans if plan.channel.identifier == "alpha"), None)
    color = next((k for k, plan in enumerate(plans) if plan.channel.identifier == "base_color"), None)
    transparent = carrier.gap == "leave" and not carrying.known.all()
    if color is not None and (alpha is not None or transparent):
        opaque = FromCorners(np.ones((len(carrying.source.faces), 3, 1)))
        both = Stacked((plans[color].paint, alpha.paint if alpha is not None else opaque))
        plans[color] = replace(plans[color], paint=both)
        plans = [plan for plan in plans if plan is not alpha]
    uv = reader.uv(rendered_uv(obj.data))
    return TextureReading(
        tuple(plans),
        carrier,
        carrying,
        layout,
        size,
        settings,
        MapPaint(uv, reader.slot, found.confidence[carrying.target.faces]),
        turns,
        certain,
        reader.main_material(),
        (source.name, target.name),
        alpha is not None,
        keeps_map,
        tuple(reader.notes),
    )


def _size(reader: TextureReader, carrying: Carrying, layout: TargetLayout) -> int:
    """Return the side of pictures in which the target has as many texels as the part of the source that it shows."""
    place = carrying.place[carrying.target.faces[carrying.known]]
    shown = 0.5 * np.linalg.norm(np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]), axis=1).sum()
    density = reader.texels() / max(carrying.source.area, 1e-300)
    return picture_size(density * shown, layout.corners[layout.tile > 0])


def _in_world(obj: bpy.types.Object, mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh where its object is in the world."""
    matrix = np.array(obj.matrix_world)
    return TriangleMesh(mirrored(obj, mesh.vertices) @ matrix[:3, :3].T + matrix[:3, 3], mesh.faces, mesh.name)
