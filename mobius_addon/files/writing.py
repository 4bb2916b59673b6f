"""Meshes into files, through Blender's own exporters; what a file does not hold is found by reading it again."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..attributes import armature_of, forget_written
from ..mesh_data import Refusal
from ..streams import quiet
from .contents import Contents, contents_of, losses
from .formats import first_message, format_of
from .parts import free_name
from .pictures import separate_gltf_pictures, separate_pictures
from .publishing import Outputs, real_place
from .reading import new_scene


def write_mesh(obj: bpy.types.Object, final: Path, written: Outputs, *, backup: bool = False) -> list[str]:
    """Write a mesh object to what is to become a file, the whole file that is open if that is a .blend.

    Into another format the object goes alone, with its armature if the format has any; the file is read again, for
    which the one that is open is closed.

    Parameters
    ----------
    obj : bpy.types.Object
    final : Path
    written : Outputs
    backup : bool
        Keep a .blend that is there as Blender does.

    Returns
    -------
    list of str
        A sentence about what the object has and the file does not, if there is anything.

    Raises
    ------
    Refusal
        The file cannot be written, or not whole.
    """
    backup = backup and final.suffix.lower() == ".blend"
    path = written.path(final, free_name(real_place(final)), backup=backup)
    if path.suffix == ".blend":
        _require_no_library(final)
        export_mesh(obj, path)
        _require_whole(path, obj.name)
        return _newer(final)
    forget_written(obj.data)  # a property that is of no use there
    before = contents_of(obj)
    export_mesh(obj, path, real_place(final).parent)
    lost = losses(before, _read_again(path, before))
    return [f"'{final}' is without {lost}: write a .blend to keep all"] if lost else []


def export_mesh(obj: bpy.types.Object, path: Path, folder: Path | None = None) -> None:
    """Write one object to a file, or the whole file that is open if that is a .blend.

    Parameters
    ----------
    obj : bpy.types.Object
        For another format than .blend it is changed where exporters need it (not hidden, without parent), so that the
        file that is open is not to be saved afterwards.
    path : Path
    folder : Path, optional
        Where the file will lie in the end, whose other files keep their names; by default where it is written.

    Raises
    ------
    Refusal
        The exporter failed.
    """
    try:
        with quiet():
            if path.suffix.lower() == ".blend":
                format_of(path).exporter(str(path.absolute()))
            else:
                _export_alone(obj, path.absolute(), folder or path.absolute().parent)
    except (RuntimeError, OSError) as error:
        raise Refusal(f"'{path.name}' could not be written: {first_message(error)}") from error


def _export_alone(obj: bpy.types.Object, path: Path, folder: Path) -> None:
    ending = path.suffix.lower()
    copies = {".fbx": f"{path.stem}.fbm", ".usd": "textures", ".usda": "textures", ".usdc": "textures"}
    rigged = ending in (".glb", ".gltf", ".fbx")
    with _alone(obj, armature_of(obj) if rigged else None), tempfile.TemporaryDirectory(dir=bpy.app.tempdir) as stage:
        if ending not in (".glb", ".gltf", ".ply", ".stl"):
            separate_pictures(obj, folder / copies.get(ending, "."), Path(stage))
        format_of(path).exporter(str(path))
        if ending == ".gltf":
            separate_gltf_pictures(path, folder)


@contextmanager
def _alone(obj: bpy.types.Object, armature: bpy.types.Object | None = None) -> Iterator[None]:
    """Show an object, wherever it is and whatever hides it, in a scene of its own, selected and active.

    Its armature, if one is given, is there too, in its rest pose.
    """
    scene, window = bpy.context.scene, bpy.context.window
    own = bpy.data.scenes.new(scene.name)
    own.unit_settings.system, own.unit_settings.scale_length = (
        scene.unit_settings.system,
        scene.unit_settings.scale_length,
    )
    own.frame_set(scene.frame_current)
    for one in [obj] if armature is None else [armature, obj]:
        at = one.matrix_world.copy()
        own.collection.objects.link(one)
        one.hide_viewport = one.hide_render = one.hide_select = False
        if one == armature or one.parent != armature:
            one.parent = None
            one.matrix_world = at
        for constraint in one.constraints:
            constraint.mute = True
    if armature is not None:
        armature.data.pose_position = "REST"
    shown = [modifier for modifier in obj.modifiers if modifier.show_viewport or modifier.show_render]
    for modifier in shown:
        if armature is not None and modifier.type == "ARMATURE" and modifier.object == armature:
            continue
        modifier.show_viewport = modifier.show_render = False
    window.scene = own
    try:
        bpy.context.view_layer.update()
        obj.select_set(True)
        if armature is not None:
            armature.select_set(True)
        bpy.context.view_layer.objects.active = obj
        yield
    finally:
        window.scene = scene
        bpy.data.scenes.remove(own)


def _read_again(path: Path, before: Contents) -> Contents:
    """Return what a file that was just written holds.

    Raises
    ------
    Refusal
        It cannot be read, or faces are missing: the disk is full, or the exporter failed without a word.
    """
    new_scene()
    try:
        with quiet():
            format_of(path).importer(str(path))
    except (RuntimeError, OSError) as error:
        raise Refusal(f"'{path.name}' was not written whole: {first_message(error)}") from error
    bpy.context.view_layer.update()
    # importers draw bones as a mesh
    drawn = {bone.custom_shape for x in bpy.data.objects if x.type == "ARMATURE" for bone in x.pose.bones}
    found = [obj for obj in bpy.data.objects if obj.type == "MESH" and obj not in drawn]
    if len(found) != 1:
        raise Refusal(f"'{path.name}' was not written whole: {len(found)} meshes are in it")
    after = contents_of(found[0])
    if after.triangles < before.triangles:
        gone = before.triangles - after.triangles
        raise Refusal(f"'{path.name}' was not written whole: {gone:,} of {before.triangles:,} triangles are missing")
    return after


def _require_no_library(final: Path) -> None:
    """Raise `Refusal` if a .blend would take the place of one that it links."""
    for library in bpy.data.libraries:
        if real_place(Path(bpy.path.abspath(library.filepath))) == real_place(final):
            raise Refusal(f"'{final}' is linked by the file that would be written there: name another one")


def _require_whole(path: Path, name: str) -> None:
    """Raise `Refusal` if a .blend that was just written does not hold an object of this name."""
    try:
        with bpy.data.libraries.load(str(path)) as (stored, _):
            there = name in stored.objects
    except (OSError, RuntimeError) as error:
        raise Refusal(f"'{path.name}' was not written whole: {first_message(error)}") from error
    if not there:
        raise Refusal(f"'{path.name}' was written without '{name}'")


def _newer(final: Path) -> list[str]:
    """Return a sentence if the open file was made by a later Blender, which may have stored what this one drops."""
    made = tuple(bpy.data.version)[:2]
    if made <= bpy.app.version[:2]:
        return []
    its, ours = ".".join(map(str, made)), bpy.app.version_string
    return [f"'{final}' lacks what only Blender {its} knows, which wrote the file: this is Blender {ours}"]
