"""An empty scene with camera and paper, what is put into it, and its rendering into a file."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import addon_utils
import bpy
import numpy as np
from mathutils import Matrix
from scipy.spatial.transform import Rotation

from ...solver.surface.mesh import Floats
from ..mesh_data import Refusal, read_vertices
from .materials import flat_material, fresh_tree

PIXELS_ACROSS = 1400
PAPER = (0.90, 0.90, 0.89)
CAPTION_PIXELS = 25


@contextlib.contextmanager
def studio(width: float, height: float, samples: int) -> Iterator[bpy.types.Scene]:
    """Give an empty Cycles scene with a camera that sees `width` by `height` units of the XZ plane; remove it later."""
    before = {collection: set(collection) for collection in made_here()}
    scene = bpy.data.scenes.new("Studio")
    try:
        scene.render.engine = "CYCLES"
        scene.cycles.device = "CPU"
        scene.cycles.samples = samples
        scene.cycles.use_denoising = False
        scene.cycles.use_adaptive_sampling = True
        scene.cycles.adaptive_threshold = 0.02
        scene.cycles.max_bounces = 1
        scene.cycles.diffuse_bounces = 1
        scene.render.resolution_x = PIXELS_ACROSS
        scene.render.resolution_y = round(PIXELS_ACROSS * height / width)
        scene.render.image_settings.file_format = "PNG"
        scene.render.image_settings.color_mode = "RGB"
        scene.render.dither_intensity = 0.0
        scene.view_settings.view_transform = "Standard"
        scene.world = paper_world()
        camera = bpy.data.objects.new("Studio camera", bpy.data.cameras.new("Studio camera"))
        camera.data.type = "ORTHO"
        camera.data.ortho_scale = width
        camera.location = (0, -20, 0)
        camera.rotation_euler = (np.pi / 2, 0, 0)
        scene.collection.objects.link(camera)
        scene.camera = camera
        yield scene
    finally:
        bpy.data.scenes.remove(scene)
        for collection, kept in before.items():
            for block in set(collection) - kept:
                collection.remove(block)


def made_here() -> tuple[Any, ...]:
    """Return the collections of data blocks that pictures put something into."""
    data = bpy.data
    return (data.objects, data.meshes, data.curves, data.cameras, data.lights, data.worlds, data.materials)


def require_cycles() -> None:
    """Make sure that the renderer is there, for this session only where a person has switched it off.

    Raises
    ------
    Refusal
        This Blender is built without it.
    """
    if not addon_utils.check("cycles")[1] and addon_utils.enable("cycles") is None:
        raise Refusal("the pictures need the renderer Cycles, which this Blender does not have: use another build")


def render(scene: bpy.types.Scene, path: Path) -> None:
    """Render `scene` into the PNG file `path`.

    Raises
    ------
    Refusal
        The file could not be written.
    """
    scene.render.filepath = str(path)
    try:
        bpy.ops.render.render(scene=scene.name, write_still=True)
    except RuntimeError as error:
        raise Refusal(f"'{path.name}' could not be rendered: {error}") from error
    if not path.is_file():
        raise Refusal(f"'{path.name}' could not be written")


def fit(mesh: bpy.types.Mesh, turn: Rotation, frame: Floats) -> Matrix:
    """Return the 4 by 4 matrix that turns `mesh` and centres it in a `frame` [[left, bottom], [right, top]]."""
    seen = turn.apply(read_vertices(mesh))
    low, high = seen.min(axis=0), seen.max(axis=0)
    scale = (np.diff(frame, axis=0)[0] / (high - low)[[0, 2]]).min()
    middle = frame.mean(axis=0)
    matrix = np.eye(4)
    matrix[:3, :3] = scale * turn.as_matrix()
    matrix[:3, 3] = [middle[0], 0, middle[1]] - scale * (low + high) / 2
    return Matrix(matrix.tolist())


def put(scene: bpy.types.Scene, data: bpy.types.ID, material: bpy.types.Material, matrix: Matrix) -> bpy.types.Object:
    """Place `data` in the scene; the object wears `material` over the data's own."""
    obj = bpy.data.objects.new("Studio", data)
    scene.collection.objects.link(obj)
    if not obj.material_slots:
        data.materials.append(None)
    slot = obj.material_slots[0]
    slot.link = "OBJECT"
    slot.material = material
    obj.matrix_world = matrix
    return obj


def write(scene: bpy.types.Scene, text: str, place: tuple[float, float]) -> None:
    """Write one line of text, centred at `place` on the XZ plane."""
    line = bpy.data.curves.new("Studio caption", "FONT")
    line.body = text
    line.size = CAPTION_PIXELS * scene.camera.data.ortho_scale / PIXELS_ACROSS
    line.align_x = "CENTER"
    turned = Matrix.Translation((place[0], -2.0, place[1])) @ Matrix.Rotation(np.pi / 2, 4, "X")
    put(scene, line, flat_material(None), turned)


def light(scene: bpy.types.Scene, *, energy: float, angle: float, rotation: tuple[float, float, float]) -> None:
    """Add a sun; `angle` in radians softens its shadows."""
    sun = bpy.data.lights.new("Studio sun", "SUN")
    sun.energy = energy
    sun.angle = angle
    lamp = bpy.data.objects.new("Studio sun", sun)
    lamp.rotation_euler = rotation
    scene.collection.objects.link(lamp)


def paper_world() -> bpy.types.World:
    """Return a world that lights evenly and looks like paper from the camera."""
    world = bpy.data.worlds.new("Studio paper")
    nodes, links = fresh_tree(world)
    sky, paper = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeBackground")
    sky.inputs["Color"].default_value = (0.85, 0.92, 1.0, 1.0)
    sky.inputs["Strength"].default_value = 0.45
    paper.inputs["Color"].default_value = (*PAPER, 1.0)
    choice, rays = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeLightPath")
    links.new(rays.outputs["Is Camera Ray"], choice.inputs[0])
    links.new(sky.outputs[0], choice.inputs[1])
    links.new(paper.outputs[0], choice.inputs[2])
    links.new(choice.outputs[0], nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    return world
