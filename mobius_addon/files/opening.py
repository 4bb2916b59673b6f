"""A mesh in the scene that it comes from, and another beside it that is read and leaves nothing behind."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import bpy

from ..joined import joined
from ..mesh_data import Refusal
from ..streams import quiet, reading
from .blend import require_local, with_shown
from .formats import first_message, split_object_name
from .reading import Imported, choose, import_meshes, new_scene, require_readable, scans
from .together import together
from .unreadable import Unreadable


@dataclass(frozen=True, eq=False)
class Opened:
    """A mesh of the file that is open now and, if one was asked for, a second mesh of this file or another.

    Attributes
    ----------
    target : Imported
    source : Imported or None
        If it came from another file it is gone after the context, with all of its that the target does not use.
    notes : list of str
        Sentences about what could not be as it was.
    """

    target: Imported
    source: Imported | None = None
    notes: list[str] = field(default_factory=list)


@contextmanager
def opened(target: str, source: str | None = None, *, write: bool = True, whole: bool = False) -> Iterator[Opened]:
    """Open the file of a mesh with all that is in it, for a mesh to be read and written wherever it is, hidden or not.

    In the context both objects are in a scene of their own, in Object Mode; afterwards all is as it was but for what
    was written. A failure leaves the file open as it stands.

    Parameters
    ----------
    target, source : str
        FILE or FILE:Object; of a .blend the file is opened, of others the meshes are imported into an empty one.
    write : bool
        The target is to be written.
    whole : bool
        Without a name all of a file's meshes are meant that are one thing, joined in the context; see `together`.

    Raises
    ------
    Unreadable
        As `import_meshes`, `choose` and `together`.
    Refusal
        The target is to be written and another file's; or both are one mesh.
    """
    target_path, target_name = split_object_name(target)
    source_path, source_name = split_object_name(source) if source is not None else (None, None)
    one_file = source_path is not None and _same(source_path, target_path)
    pick = together if whole and not one_file else _alone
    with ExitStack() as stack:
        given: list[Imported] = []
        notes: list[str] = []
        lent = None
        if source_path is not None and not one_file:
            given, notes = pick(_open_file(source_path), source_path, source_name)
            lent = stack.enter_context(_library(given))
        meshes = _open_file(target_path)
        goals, more = pick(meshes, target_path, target_name)
        notes += more
        if write:
            for goal in goals:
                require_local(goal.obj, target_path)
        before = {block.session_uid for block in _everything()}
        if source_path is not None and one_file:
            given, _ = pick(meshes, source_path, source_name)
            if given[0].obj == goals[0].obj:
                raise Refusal(f"'{source}' and '{target}' are one mesh: give two")
            if given[0].obj.data == goals[0].obj.data:
                raise Refusal(f"'{source}' and '{target}' share one mesh: make it single-user, or there is one only")
        elif lent is not None:
            found = _append(*lent)
            given = [replace(x, obj=obj) for x, obj in zip(given, found, strict=True)]
        objects = [x.obj for x in (*goals, *given)]
        with _object_mode(objects), _bench(objects), ExitStack() as wholes:
            goal = wholes.enter_context(_as_one(goals))
            yield Opened(goal, wholes.enter_context(_as_one(given)) if given else None, notes)
            if lent is not None and given:
                for obj in goal.objects:
                    notes += _leave_foreign_drivers(obj, before, given[0].path)
        if lent is not None:
            _remove_unused(before)


def _alone(meshes: list[Imported], path: Path, wanted: str | None) -> tuple[list[Imported], list[str]]:
    return [choose(meshes, path, wanted)], []


@contextmanager
def _as_one(found: list[Imported]) -> Iterator[Imported]:
    """Lend several objects of a file joined, one as it is."""
    if len(found) == 1:
        yield found[0]
        return
    with joined([x.obj for x in found], found[0].path.stem) as (whole, members):
        yield Imported(found[0].path, whole.name, whole, members)


def _same(path: Path, other: Path) -> bool:
    return path.resolve() == other.resolve()


def _open_file(path: Path) -> list[Imported]:
    """Open a .blend, or import another file into an empty one, and return its meshes; see `scans`."""
    if path.suffix.lower() != ".blend":
        new_scene()
        return import_meshes(path)
    require_readable(path)
    try:
        with quiet(), reading(path):
            # as the person would open it: relative paths belong to the folder of a link, not of what that points to
            bpy.ops.wm.open_mainfile(
                filepath=str(path.absolute()), load_ui=True, use_scripts=False, display_file_selector=False
            )
    except RuntimeError as error:
        raise Unreadable(f"'{path}' could not be read: {first_message(error)}") from error
    own, scenes = ([x for x in found if x.library is None] for found in (bpy.data.objects, bpy.data.scenes))
    bpy.context.view_layer.update()
    return scans(path, [Imported(path, obj.name, obj) for obj in with_shown(own, scenes)])


@contextmanager
def _library(found: list[Imported]) -> Iterator[tuple[list[Path], list[str]]]:
    """Lend the .blend files that hold objects of the file that is open, one for each, and their names there."""
    names = [x.obj.name for x in found]
    with tempfile.TemporaryDirectory(prefix="mobius-") as folder:
        path = Path(bpy.data.filepath) if bpy.data.filepath else Path(folder) / "imported.blend"
        if not bpy.data.filepath and any(x.obj.library is None for x in found):
            with quiet():
                bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, relative_remap=False, check_existing=False)
        libraries = (x.obj.library for x in found)
        yield [path if x is None else Path(bpy.path.abspath(x.filepath)) for x in libraries], names


def _append(paths: list[Path], names: list[str]) -> list[bpy.types.Object]:
    """Return objects of .blend files; those of one file come together, with one of what they share."""
    found: dict[tuple[Path, str], bpy.types.Object] = {}
    for path in dict.fromkeys(paths):
        own = [name for other, name in zip(paths, names, strict=True) if other == path]
        if not path.is_file():  # its library is packed
            raise Unreadable(
                f"'{own[0]}' is linked from '{path}', which is not there: put it back, or make '{own[0]}' local first "
                "(Object > Relations > Make Local > All)"
            )
        try:
            with quiet(), bpy.data.libraries.load(str(path)) as (_, wanted):
                wanted.objects = list(own)  # whose names become objects
        except (OSError, RuntimeError) as error:
            raise Unreadable(f"'{own[0]}' could not be read from '{path}': {first_message(error)}") from error
        for name, obj in zip(own, wanted.objects, strict=True):
            if obj is None:
                raise Unreadable(f"'{name}' could not be read from '{path}'")
            found[path, name] = obj
    return [found[key] for key in zip(paths, names, strict=True)]


@contextmanager
def _object_mode(objects: list[bpy.types.Object]) -> Iterator[None]:
    """Leave the modes that the file was saved in, and enter them again.

    Edit Mode hides layers, and weights are shown by the tool settings of a scene, of which `_bench` has none.
    """
    view = bpy.context.view_layer
    if all(obj.mode == "OBJECT" for obj in objects):
        yield
        return
    busy = [(obj, obj.mode) for obj in view.objects if obj in objects and obj.mode != "OBJECT"]
    edited = [obj for obj in view.objects if obj.mode == "EDIT"]
    active, selected = view.objects.active, [obj for obj in view.objects if obj.select_get()]
    for obj, mode in busy:
        view.objects.active = obj
        if obj.mode == mode:  # all leave Edit Mode together
            bpy.ops.object.mode_set(mode="OBJECT")
    if left := [obj.name for obj in objects if obj.mode != "OBJECT"]:
        raise Refusal(f"'{left[0]}' was saved in another mode than Object Mode: leave it and save again")
    view.objects.active = active
    yield
    for obj, mode in busy:
        if obj.mode == "OBJECT":
            for other in view.objects:  # all that are selected enter Edit Mode together
                other.select_set(other in edited if mode == "EDIT" else other == obj)
            view.objects.active = obj
            bpy.ops.object.mode_set(mode=mode)
    view.objects.active = active
    for obj in view.objects:
        obj.select_set(obj in selected)


@contextmanager
def _bench(objects: list[bpy.types.Object]) -> Iterator[None]:
    """Have a scene with nothing but these objects, shown, for the context; what the person has open stays as it is."""
    of = next(iter(objects[0].users_scene), bpy.context.scene)
    scene = bpy.data.scenes.new("Mobius")
    scene.frame_current, scene.frame_subframe = of.frame_current, of.frame_subframe
    hidden = [obj for obj in objects if obj.hide_viewport]
    for obj in objects:
        scene.collection.objects.link(obj)
        obj.hide_viewport = False
    with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0], collection=scene.collection):
        bpy.context.view_layer.update()
        yield
    for obj in hidden:
        obj.hide_viewport = True
    bpy.data.scenes.remove(scene)


def _everything() -> list[Any]:
    """Return all data-blocks of the file that is open."""
    lists = [prop.identifier for prop in bpy.data.bl_rna.properties if prop.type == "COLLECTION"]
    # each once: later Blenders have a list of all beside those of each type
    return list(dict.fromkeys(block for name in lists for block in getattr(bpy.data, name)))


def _leave_foreign_drivers(obj: bpy.types.Object, before: set[int], source: Path) -> list[str]:
    """Remove drivers of shape keys that point into the source's file, and return a sentence for each.

    One that points at a scene points at the target's.
    """
    keys = obj.data.shape_keys
    if keys is None or keys.animation_data is None:
        return []
    known = before | {obj.data.session_uid, keys.session_uid}
    scene = next((x for x in obj.users_scene if x.session_uid in known), None)
    notes = []
    for curve in list(keys.animation_data.drivers):
        ends = [end for variable in curve.driver.variables for end in variable.targets]
        foreign = [end for end in ends if end.id is not None and end.id.session_uid not in known]
        for end in foreign:
            if isinstance(end.id, bpy.types.Scene) and scene is not None:
                end.id = scene
        names = [end.id.name for end in foreign if end.id.session_uid not in known]
        if names:
            notes.append(
                f"the driver of {curve.data_path} points at '{names[0]}' in '{source}', which does not come along: "
                "the value stays as it is"
            )
            keys.animation_data.drivers.remove(curve)
    return notes


def _remove_unused(before: set[int]) -> None:
    """Remove what has come since but for what the file's own data uses now."""
    new = [block for block in _everything() if block.session_uid not in before]
    users = bpy.data.user_map(subset=set(new))
    known = set(before)
    while more := [x for x in new if x.session_uid not in known and any(y.session_uid in known for y in users[x])]:
        known |= {block.session_uid for block in more}
        libraries = [block.library for block in more if block.library is not None]
        known |= {library.session_uid for library in libraries}
    bpy.data.batch_remove([block for block in new if block.session_uid not in known])
