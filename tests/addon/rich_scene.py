"""A .blend file as people have them, with a sheet in it that is to receive something."""

import shutil
import wave
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scenes import make_sheet


@dataclass(frozen=True)
class Scene:
    """What is in the file beside the sheet 'Target' and what holds it."""

    parent: str = "NONE"  # or EMPTY, ARMATURE, BONE
    scale: tuple[float, float, float] = (1, 1, 1)
    place: str = "SHOWN"  # or EXCLUDED, HIDDEN, DISABLED, UNSELECTABLE, OTHER SCENE, NO SCENE
    modifiers: tuple[str, ...] = ()
    keys: int = 0
    key_driver: bool = False
    key_action: bool = False
    groups: int = 0
    pictures: tuple[str, ...] = ()  # FILE, PACKED, TILED, SEQUENCE: a material each
    others: tuple[str, ...] = ()  # CAMERA, LIGHT, TEXT, CURVE, LATTICE, LINKED, OVERRIDE, SPEAKER, SHARED
    mode: str = "OBJECT"
    unit_scale: float = 1.0
    frame: int = 1
    constraint: bool = False
    compressed: bool = False


def build(scene: Scene, folder: Path, name: str = "scene.blend") -> Path:
    """Make the file, with its pictures and its library beside it, and return it."""
    import bpy

    folder.mkdir(exist_ok=True)
    path = folder / name
    if {"LINKED", "OVERRIDE"} & set(scene.others):
        _library(folder / "library.blend")
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.data.orphans_purge(do_recursive=True)
    # saved first, so that paths can be relative to it
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    here = bpy.context.scene
    here.unit_settings.scale_length, here.frame_current = scene.unit_scale, scene.frame
    here["note"] = [1, 2.5]
    bpy.data.texts.new("Notes").write("keep me")
    bpy.data.texts["Notes"].use_fake_user = True
    target = make_sheet("Target", 12)
    target["weight"], target.data["kind"] = 3.5, "sheet"
    target.scale, target.rotation_euler = scene.scale, (0.1, 0.2, 0.3)
    _parent(target, scene)
    _layers(target, scene)
    _materials(target, scene, folder)
    for kind in scene.others:
        _other(kind, target, folder)
    for kind in scene.modifiers:
        _modifier(kind, target)
    if scene.constraint:
        target.constraints.new("LIMIT_SCALE").use_max_x = True
        target.keyframe_insert("location", frame=1)
        target.keyframe_insert("location", frame=20)
    bpy.context.view_layer.update()  # drivers have given their values before the target is hidden
    view = _place(target, scene)
    bpy.context.view_layer.update()
    if scene.mode != "OBJECT" and view is not None:
        view.objects.active = target
        target.select_set(True)
        bpy.ops.object.mode_set(mode=scene.mode)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=scene.compressed)
    return path


def make_source(path: Path) -> None:
    """Make a file with a sheet 'Source' that has groups, a UV map, a key and a material with a picture."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    add_source(path.parent / "source pictures")
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def add_source(folder: Path) -> Any:
    """Put the source into the scene that is open."""
    source = make_sheet("Source", 13)
    source.vertex_groups.new(name="From Source").add(range(100), 0.5, "REPLACE")
    source.data.uv_layers.new(name="Source UV")
    source.shape_key_add(name="Basis", from_mix=False)
    key = source.shape_key_add(name="Source Key", from_mix=False)
    key.value = 0  # Blender 5 begins with 1
    key.points[80].co.z += 0.1
    _material(source, "Source Material", save_picture(folder / "skin.png", (1, 0, 0)))
    return source


def save_picture(path: Path, color: tuple[float, float, float], size: int = 4) -> Any:
    """Save a picture of one color and load it."""
    import bpy

    path.parent.mkdir(parents=True, exist_ok=True)
    made = bpy.data.images.new("made", size, size)
    made.pixels.foreach_set(np.tile(np.array([*color, 1], np.float32), size * size))
    made.filepath_raw, made.file_format = str(path), "PNG"
    made.save()
    bpy.data.images.remove(made)
    image = bpy.data.images.load(str(path))
    if bpy.data.filepath:
        image.filepath = bpy.path.relpath(str(path))
    return image


def _library(path: Path) -> None:
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    make_sheet("Linked", 11).vertex_groups.new(name="From Library").add(range(60), 0.5, "REPLACE")
    collection = bpy.data.collections.new("Library")
    collection.objects.link(bpy.data.objects["Linked"])
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Linked"])
    bpy.context.scene.collection.children.link(collection)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def _rig() -> Any:
    import bpy

    if "Rig" in bpy.data.objects:
        return bpy.data.objects["Rig"]
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("Own 0").tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.scale = (0.01,) * 3
    return rig


def _parent(target: Any, scene: Scene) -> None:
    import bpy

    if scene.parent == "NONE":
        return
    if scene.parent == "EMPTY":
        target.parent = bpy.data.objects.new("Holder", None)
        bpy.context.scene.collection.objects.link(target.parent)
    else:
        target.parent = _rig()
        if scene.parent == "BONE":
            target.parent_type, target.parent_bone = "BONE", "Own 0"
    target.matrix_parent_inverse[0][3] = 2.0


def _layers(target: Any, scene: Scene) -> None:
    rng = np.random.default_rng(3)
    for number in range(scene.groups):
        group = target.vertex_groups.new(name=f"Own {number}")
        for vertex in range(0, 144, 3):
            group.add([vertex], float(rng.uniform(0.1, 1)), "REPLACE")
    if scene.keys:
        target.shape_key_add(name="Basis", from_mix=False)
    for number in range(scene.keys):
        key = target.shape_key_add(name=f"Own Key {number}", from_mix=False)
        key.points[number].co.z += 0.5
        key.value = 0.25
    keys = target.data.shape_keys
    if keys and scene.key_driver:
        driver = keys.key_blocks["Own Key 0"].driver_add("value").driver
        variable = driver.variables.new()
        variable.type, variable.targets[0].id = "TRANSFORMS", _rig()
        driver.expression = "var * 0.5"
    if keys and scene.key_action:
        keys.key_blocks[-1].keyframe_insert("value", frame=1)
        keys.key_blocks[-1].keyframe_insert("value", frame=9)
    layer = target.data.uv_layers.new(name="Own UV")
    layer.uv.foreach_set("vector", rng.random(2 * len(target.data.loops)).astype(np.float32))
    attribute = target.data.attributes.new("own numbers", "FLOAT", "POINT")
    attribute.data.foreach_set("value", rng.random(144).astype(np.float32))


def _material(obj: Any, name: str, image: Any) -> None:
    import bpy

    material = bpy.data.materials.new(name)
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    shader = next(x for x in material.node_tree.nodes if x.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(node.outputs[0], shader.inputs["Base Color"])
    inner = bpy.data.node_groups.new(f"{name} Group", "ShaderNodeTree")
    inner.nodes.new("ShaderNodeTexNoise")
    material.node_tree.nodes.new("ShaderNodeGroup").node_tree = inner
    obj.data.materials.append(material)


def _materials(target: Any, scene: Scene, folder: Path) -> None:
    for number, kind in enumerate(scene.pictures):
        place = folder / "pictures" / str(number)
        if kind == "TILED":
            for tile in (1001, 1002):
                image = save_picture(place / f"skin.{tile}.png", (0, 1, 0))
            image.source, image.filepath = "TILED", image.filepath.replace("1002", "<UDIM>")
            image.tiles.new(1002)
        elif kind == "SEQUENCE":
            for frame in (1, 2):
                image = save_picture(place / f"skin_{frame:03d}.png", (0, frame / 2, 0))
            image.source = "SEQUENCE"
        else:
            image = save_picture(place / "skin.png", (0, 0, 1))
        if kind == "PACKED":
            image.pack()
        _material(target, f"Own {kind} {number}", image)
    if scene.pictures:
        own = np.arange(len(target.data.polygons)) % len(scene.pictures)
        target.data.polygons.foreach_set("material_index", own.astype(np.int32))


def _other(kind: str, target: Any, folder: Path) -> None:
    import bpy

    link = bpy.context.scene.collection.objects.link
    if kind == "CAMERA":
        link(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
        bpy.context.scene.camera = bpy.data.objects["Camera"]
        for area in bpy.context.screen.areas:
            if area.type == "VIEW_3D":
                area.spaces.active.region_3d.view_perspective = "CAMERA"
    elif kind == "LIGHT":
        link(bpy.data.objects.new("Light", bpy.data.lights.new("Light", "SPOT")))
    elif kind == "TEXT":
        text = bpy.data.curves.new("Text", "FONT")
        own = next((Path(bpy.utils.system_resource("DATAFILES")) / "fonts").glob("*.woff2"))
        text.font = bpy.data.fonts.load(shutil.copyfile(own, str(folder / own.name)))
        text.font.filepath = bpy.path.relpath(text.font.filepath)
        link(bpy.data.objects.new("Text", text))
    elif kind == "CURVE":
        bpy.ops.curve.primitive_bezier_curve_add()
    elif kind == "SPEAKER":
        with wave.open(str(folder / "sound.wav"), "wb") as sound:
            sound.setparams((1, 1, 8000, 8, "NONE", ""))
            sound.writeframes(bytes(8))
        speaker = bpy.data.speakers.new("Speaker")
        speaker.sound = bpy.data.sounds.load(str(folder / "sound.wav"))
        speaker.sound.filepath = bpy.path.relpath(speaker.sound.filepath)
        link(bpy.data.objects.new("Speaker", speaker))
    elif kind == "SHARED":
        link(bpy.data.objects.new("Twin", target.data))
    elif kind in ("LINKED", "OVERRIDE"):
        with bpy.data.libraries.load(str(folder / "library.blend"), link=True, relative=True) as (_, wanted):
            wanted.collections = ["Library"]
        if kind == "LINKED":
            bpy.context.scene.collection.children.link(wanted.collections[0])
        else:
            wanted.collections[0].override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    else:
        raise ValueError(kind)


def _modifier(kind: str, target: Any) -> None:
    import bpy

    modifier = target.modifiers.new(kind.title(), kind)
    if kind == "ARMATURE":
        modifier.object = _rig()
    elif kind == "SHRINKWRAP":
        modifier.target = make_sheet("Other", 4)
    elif kind == "DISPLACE":
        modifier.texture = bpy.data.textures.new("Clouds", "CLOUDS")
    elif kind == "NODES":
        tree = bpy.data.node_groups.new("Own Nodes", "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        ends = tree.nodes.new("NodeGroupInput").outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0]
        tree.links.new(*ends)
        modifier.node_group = tree


def _place(target: Any, scene: Scene) -> Any:
    """Put the target where it is to be, and return the view layer that shows it, if any does."""
    import bpy

    here, view = bpy.context.scene, bpy.context.view_layer
    target.hide_select = scene.place == "UNSELECTABLE"
    if scene.place in ("EXCLUDED", "OTHER SCENE", "NO SCENE"):
        here.collection.objects.unlink(target)
        collection = bpy.data.collections.new("Away")
        collection.objects.link(target)
        collection.use_fake_user = scene.place == "NO SCENE"
        if scene.place == "EXCLUDED":
            here.collection.children.link(collection)
            view.layer_collection.children["Away"].exclude = True
        elif scene.place == "OTHER SCENE":
            bpy.data.scenes.new("Second").collection.children.link(collection)
        return None
    if scene.place == "HIDDEN":
        target.hide_set(True)
        return None
    target.hide_viewport = scene.place == "DISABLED"
    return view if scene.place in ("SHOWN", "UNSELECTABLE") and target.visible_get() else None
