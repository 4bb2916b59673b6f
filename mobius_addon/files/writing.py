"""Meshes into files, through Blender's own exporters; what a file does not hold is found by reading it again."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...solver.surface.mesh import plural
from ..attributes import armature_of, forget_written
from ..mesh_data import Refusal
from ..streams import quiet
from .contents import Contents, contents_of, losses, plain_letters
from .formats import FORMATS, ONE_MESH, first_message, format_of
from .parts import free_name
from .pictures import separate_gltf_pictures, separate_pictures
from .publishing import Outputs, real_place
from .reading import new_scene


def write_mesh(
    obj: bpy.types.Object,
    final: Path,
    written: Outputs,
    *,
    backup: bool = False,
    others: Sequence[bpy.types.Object] = (),
) -> list[str]:
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
    others : sequence of bpy.types.Object
        Mesh objects that come along.

    Returns
    -------
    list of str
        A sentence about what an object has and the file does not, for each where there is anything.

    Raises
    ------
    Refusal
        The file cannot be written, or not whole.
    """
    backup = backup and final.suffix.lower() == ".blend"
    objects = [obj, *others]
    path = written.path(final, free_name(real_place(final)), backup=backup)
    if path.suffix == ".blend":
        _require_no_library(final)
        export_mesh(obj, path)
        for one in objects:
            _require_whole(path, one.name)
        return _newer(final)
    for one in objects:
        forget_written(one.data)  # a property that is of no use there
    before = [contents_of(one) for one in objects]
    names = [one.name for one in objects]
    export_mesh(obj, path, real_place(final).parent, others)
    lost = [losses(x, y) for x, y in zip(before, _read_again(path, before, names), strict=True)]
    sharing: dict[str, list[str]] = {}
    for name, x in zip(names, lost, strict=True):
        sharing.setdefault(x, []).append(f"'{name}'")
    said = []
    for x, who in sharing.items():
        whose = f"{', '.join(who)} in '{final}'" if len(objects) > 1 else f"'{final}'"
        said += [f"{whose} {'is' if len(who) == 1 else 'are'} without {x}: write a .blend to keep all"] if x else []
    return said


def require_room(number: int, final: Path) -> None:
    """Raise `Refusal` where a kind of file does not hold as many meshes."""
    if number > 1 and final.suffix.lower() in ONE_MESH:
        raise Refusal(
            f"'{final}' can hold one mesh and not {number}: write one of "
            f"{' '.join(ending for ending in FORMATS if ending not in ONE_MESH)}"
        )


def export_mesh(
    obj: bpy.types.Object, path: Path, folder: Path | None = None, others: Sequence[bpy.types.Object] = ()
) -> None:
    """Write one object, and others with it, to a file, or the whole file that is open if that is a .blend.

    Parameters
    ----------
    obj : bpy.types.Object
        For another format than .blend it is changed where exporters need it (not hidden, without parent), so that the
        file that is open is not to be saved afterwards.
    path : Path
    folder : Path, optional
        Where the file will lie in the end, whose other files keep their names; by default where it is written.
    others : sequence of bpy.types.Object

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
                _export_alone([obj, *others], path.absolute(), folder or path.absolute().parent)
    except (RuntimeError, OSError) as error:
        raise Refusal(f"'{path.name}' could not be written: {first_message(error)}") from error


def _export_alone(objects: Sequence[bpy.types.Object], path: Path, folder: Path) -> None:
    ending = path.suffix.lower()
    copies = {".fbx": f"{path.stem}.fbm", ".usd": "textures", ".usda": "textures", ".usdc": "textures"}
    rigged = ending in (".glb", ".gltf", ".fbx")
    armatures = [armature_of(obj) if rigged else None for obj in objects]
    with _alone(objects, armatures), tempfile.TemporaryDirectory(dir=bpy.app.tempdir) as stage:
        if ending not in (".glb", ".gltf", ".ply", ".stl"):
            for obj in objects:
                separate_pictures(obj, folder / copies.get(ending, "."), Path(stage))
        format_of(path).exporter(str(path))
        if ending == ".gltf":
            separate_gltf_pictures(path, folder)


@contextmanager
def _alone(objects: Sequence[bpy.types.Object], armatures: Sequence[bpy.types.Object | None]) -> Iterator[None]:
    """Show objects, wherever they are and whatever hides them, in a scene of their own, selected, the first active.

    The armature of each, if one is given, is there too, in its rest pose.
    """
    scene, window = bpy.context.scene, bpy.context.window
    own = bpy.data.scenes.new(scene.name)
    own.unit_settings.system, own.unit_settings.scale_length = (
        scene.unit_settings.system,
        scene.unit_settings.scale_length,
    )
    own.frame_set(scene.frame_current)
    movers = list(dict.fromkeys(x for x in armatures if x is not None))
    of = dict(zip(objects, armatures, strict=True))
    for one in [*movers, *objects]:
        at = one.matrix_world.copy()
        own.collection.objects.link(one)
        one.hide_viewport = one.hide_render = one.hide_select = False
        if one in movers or of[one] is None or one.parent != of[one]:
            one.parent = None
            one.matrix_world = at
        for constraint in one.constraints:
            constraint.mute = True
    for armature in movers:
        armature.data.pose_position = "REST"
    for obj, armature in of.items():
        for modifier in obj.modifiers:
            if armature is not None and modifier.type == "ARMATURE" and modifier.object == armature:
                continue
            if modifier.show_viewport or modifier.show_render:
                modifier.show_viewport = modifier.show_render = False
    window.scene = own
    try:
        bpy.context.view_layer.update()
        for one in [*objects, *movers]:
            one.select_set(True)
        bpy.context.view_layer.objects.active = objects[0]
        yield
    finally:
        window.scene = scene
        bpy.data.scenes.remove(own)


def _read_again(path: Path, before: Sequence[Contents], names: Sequence[str]) -> list[Contents]:
    """Return what a file that was just written holds of each object.

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
    if len(found) != len(before):
        raise Refusal(f"'{path.name}' was not written whole: {plural(len(found), 'mesh')} are in it")
    if len(found) > 1:  # formats have letters of their own for what they do not allow in names
        plain = {plain_letters(obj.name): obj for obj in found}
        if len(plain) < len(found) or any(plain_letters(name) not in plain for name in names):
            raise Refusal(f"'{path.name}' names its objects otherwise: write a .blend")
        found = [plain[plain_letters(name)] for name in names]
    after = [contents_of(obj) for obj in found]
    for one, other in zip(before, after, strict=True):
        if other.triangles < one.triangles:
            gone = one.triangles - other.triangles
            raise Refusal(f"'{path.name}' was not written whole: {gone:,} of {one.triangles:,} triangles are missing")
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
