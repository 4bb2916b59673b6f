"""The demo's two pictures, rendered by Cycles in a scene of their own that is gone afterwards."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import addon_utils
import bpy
import numpy as np
from mathutils import Matrix, Vector
from scipy.spatial.transform import Rotation

from ...solver.surface.mesh import Complexes, Floats, Integers
from ..mesh_data import Refusal
from .scans import read_vertices, write_vertices

PIXELS_ACROSS = 1400
PAPER = (0.90, 0.90, 0.89)
INK = (0.02, 0.02, 0.025)
CLAY = (0.42, 0.43, 0.45)
GRID_LINES = 28
CAPTION_PIXELS = 25


@dataclass(frozen=True)
class Sitter:
    """One head in the group picture.

    Attributes
    ----------
    mesh : bpy.types.Mesh
        What to show.
    material : bpy.types.Material
        What it wears there.
    turn : Rotation
        How to hold it; the camera looks along +Y, with Z upwards.
    caption : str
        What stands below it.
    """

    mesh: bpy.types.Mesh
    material: bpy.types.Material
    turn: Rotation
    caption: str


@dataclass(frozen=True, eq=False)
class Disc:
    """One flattened surface in the picture of the discs.

    Attributes
    ----------
    mesh : bpy.types.Mesh
        The surface.
    material : bpy.types.Material
        What it wears there.
    disc : (n,) complex
        Where each of its vertices lies in the unit disc.
    points : (p,) complex
        The matched points.
    point_colors : (p, 3) float64
        Linear RGB of each.
    caption : str
        What stands below it.
    """

    mesh: bpy.types.Mesh
    material: bpy.types.Material
    disc: Complexes
    points: Complexes
    point_colors: Floats
    caption: str


def render_heads(sitters: Sequence[Sitter], path: Path, *, samples: int = 16) -> None:
    """Render the heads side by side into a PNG file at `path`."""
    width, height = 2.9, 2.8
    with studio(width * len(sitters), height, samples) as scene:
        light(scene, energy=2.6, angle=0.5, rotation=(0.75, 0.15, 0.55))
        light(scene, energy=0.8, angle=1.0, rotation=(1.2, 0.0, -1.0))
        three_quarters = Rotation.from_euler("zx", (-0.22, 0.10))
        for column, sitter in enumerate(sitters):
            left = width * (column - len(sitters) / 2)
            frame = np.array([[left + 0.12, -height / 2 + 0.42], [left + width - 0.12, height / 2 - 0.1]])
            put(scene, sitter.mesh, sitter.material, fit(sitter.mesh, three_quarters * sitter.turn, frame))
            write(scene, sitter.caption, (left + width / 2, -height / 2 + 0.14))
        render(scene, path)


def render_discs(discs: Sequence[Disc], path: Path, *, samples: int = 8) -> None:
    """Render the discs side by side, with the matched points on them, into a PNG file at `path`."""
    spacing, height = 2.3, 2.45
    with studio(spacing * len(discs), height, samples) as scene:
        ink, dot_color = flat_material(None), flat_material("Color")
        for column, disc in enumerate(discs):
            # nearer the camera one after the other: surface, circle, points
            layers = [
                Vector((spacing * (column - (len(discs) - 1) / 2), -depth, 0.1)) for depth in (0.0, 0.1, 0.2, 0.3)
            ]
            surface = put(scene, disc.mesh.copy(), disc.material, Matrix.Translation(layers[0]))
            surface.shape_key_clear()
            write_vertices(surface.data, upright(disc.disc))
            put(scene, rings(np.zeros(1, complex), 0.995, 1.005), ink, Matrix.Translation(layers[1]))
            put(scene, rings(disc.points, 0.0, 0.015), ink, Matrix.Translation(layers[2]))
            put(scene, rings(disc.points, 0.0, 0.010, disc.point_colors), dot_color, Matrix.Translation(layers[3]))
            write(scene, disc.caption, (layers[0].x, -height / 2 + 0.08))
        render(scene, path)


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


def paint_material(color_attribute: str, uv_map: str, *, lit: bool = True) -> bpy.types.Material:
    """Return a material that shows a color attribute and, as thin dark lines, the grid of a UV map."""
    material = bpy.data.materials.new(color_attribute)
    nodes, links = fresh_tree(material)
    color = nodes.new("ShaderNodeVertexColor")
    color.layer_name = color_attribute
    uv = nodes.new("ShaderNodeUVMap")
    uv.uv_map = uv_map
    cells = nodes.new("ShaderNodeVectorMath")
    cells.operation = "SCALE"
    cells.inputs["Scale"].default_value = GRID_LINES
    links.new(uv.outputs[0], cells.inputs[0])
    axes = nodes.new("ShaderNodeSeparateXYZ")
    links.new(cells.outputs[0], axes.inputs[0])
    distances = []
    for axis in range(2):
        distance = nodes.new("ShaderNodeMath")
        distance.operation = "PINGPONG"
        distance.inputs[1].default_value = 0.5
        links.new(axes.outputs[axis], distance.inputs[0])
        distances.append(distance.outputs[0])
    nearest, is_line = nodes.new("ShaderNodeMath"), nodes.new("ShaderNodeMath")
    nearest.operation = "MINIMUM"
    links.new(distances[0], nearest.inputs[0])
    links.new(distances[1], nearest.inputs[1])
    is_line.operation = "LESS_THAN"
    is_line.inputs[1].default_value = 0.045
    links.new(nearest.outputs[0], is_line.inputs[0])
    darkened = darken(nodes, links, color.outputs["Color"], is_line.outputs[0], 0.45)
    (cover if lit else glow)(nodes, links, darkened)
    return material


def clay_material() -> bpy.types.Material:
    """Return a grey material that shows the triangulation."""
    material = bpy.data.materials.new("Clay")
    nodes, links = fresh_tree(material)
    clay = nodes.new("ShaderNodeRGB")
    clay.outputs[0].default_value = (*CLAY, 1.0)
    edges = nodes.new("ShaderNodeWireframe")
    edges.use_pixel_size = True
    edges.inputs[0].default_value = 0.7
    cover(nodes, links, darken(nodes, links, clay.outputs[0], edges.outputs[0], 0.5))
    return material


def flat_material(color_attribute: str | None) -> bpy.types.Material:
    """Return a material that needs no light: a color attribute, or ink where there is none."""
    material = bpy.data.materials.new("Studio flat")
    nodes, links = fresh_tree(material)
    if color_attribute:
        color = nodes.new("ShaderNodeVertexColor")
        color.layer_name = color_attribute
    else:
        color = nodes.new("ShaderNodeRGB")
        color.outputs[0].default_value = (*INK, 1.0)
    glow(nodes, links, color.outputs["Color"])
    return material


def fresh_tree(owner: bpy.types.Material | bpy.types.World) -> tuple[bpy.types.Nodes, bpy.types.NodeLinks]:
    """Return the emptied nodes of a new material or world."""
    if owner.node_tree is None:  # from Blender 5.0 on they are born with one
        owner.use_nodes = True
    tree: Any = owner.node_tree
    tree.nodes.clear()
    return tree.nodes, tree.links


def darken(
    nodes: bpy.types.Nodes,
    links: bpy.types.NodeLinks,
    color: bpy.types.NodeSocket,
    where: bpy.types.NodeSocket,
    brightness: float,
) -> bpy.types.NodeSocket:
    """Multiply `color` by `brightness` where the mask `where` is 1."""
    factor = nodes.new("ShaderNodeMapRange")
    factor.inputs["To Min"].default_value = 1.0
    factor.inputs["To Max"].default_value = brightness
    links.new(where, factor.inputs["Value"])
    product = nodes.new("ShaderNodeVectorMath")
    product.operation = "SCALE"
    links.new(color, product.inputs[0])
    links.new(factor.outputs[0], product.inputs["Scale"])
    return product.outputs[0]


def cover(nodes: bpy.types.Nodes, links: bpy.types.NodeLinks, color: bpy.types.NodeSocket) -> None:
    """Make a half-glossy surface of `color`."""
    surface = nodes.new("ShaderNodeBsdfPrincipled")
    surface.inputs["Roughness"].default_value = 0.55
    links.new(color, surface.inputs["Base Color"])
    links.new(surface.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])


def glow(nodes: bpy.types.Nodes, links: bpy.types.NodeLinks, color: bpy.types.NodeSocket) -> None:
    """Make a surface show `color` as it is, without light."""
    emission = nodes.new("ShaderNodeEmission")
    links.new(color, emission.inputs["Color"])
    links.new(emission.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])


def rings(centres: Complexes, inner: float, outer: float, colors: Floats | None = None) -> bpy.types.Mesh:
    """Return a round ring about each centre (p,), in one mesh; a filled dot where `inner` is 0."""
    turns = 24 if inner == 0 else 180
    circle = np.exp(2j * np.pi * np.arange(turns) / turns)
    ring = np.concatenate([inner * circle, outer * circle])
    k = np.arange(turns)
    after = (k + 1) % turns
    quads = np.stack([k, k + turns, after + turns, after], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    offsets = np.arange(len(centres))[:, None, None] * len(ring)
    places = (np.asarray(centres)[:, None] + ring).ravel()
    shade = np.zeros((len(centres), 3)) if colors is None else colors
    return colored_mesh(upright(places), (triangles + offsets).reshape(-1, 3), np.repeat(shade, len(ring), axis=0))


def colored_mesh(vertices: Floats, triangles: Integers, colors: Floats) -> bpy.types.Mesh:
    """Return a mesh with the color attribute "Color"."""
    mesh = bpy.data.meshes.new("Studio")
    mesh.from_pydata(vertices.tolist(), [], triangles.tolist())
    rgba = np.column_stack([colors, np.ones(len(colors))]).astype(np.float32)
    mesh.color_attributes.new("Color", "FLOAT_COLOR", "POINT").data.foreach_set("color", rgba.ravel())
    return mesh


def upright(places: Complexes) -> Floats:
    """Return points of the complex plane as points of the XZ plane, (n, 3)."""
    return np.column_stack([places.real, np.zeros(len(places)), places.imag])


def hues(points: Complexes) -> Floats:
    """Return a color per point, (p, 3): its angle as the hue, paler towards the middle."""
    phases = np.angle(points)[:, None] - 2 * np.pi * np.arange(3) / 3
    return 1 - np.minimum(1, 0.25 + np.abs(points))[:, None] * (0.5 - 0.5 * np.cos(phases))
