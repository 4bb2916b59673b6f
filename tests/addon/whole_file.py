"""Everything that is in a .blend file, field by field, as Blender's own description of its data lists it."""

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

Block = tuple[str, str, str]
Fields = dict[str, Any]

# what is no content: how often something is used, and what is computed
_PASSING = {
    "rna_type", "users", "session_uid", "is_evaluated", "original", "id_data", "tag", "preview", "is_dirty",
    "frame_duration", "has_data", "depsgraph", "bindcode", "library_weak_reference", "eval_time", "execution_time",
    "users_scene", "users_collection", "children_recursive", "pixels", "uv_layer_clone", "uv_layer_stencil",
    "vertex_selection", "edge_selection", "pin", "pin_uv", "select_edge", "is_library_indirect",
    "particle_edit",  # whose object Blender sets when it evaluates
    "uv_sculpt",  # which ends Blender 4.2
}  # fmt: skip
_PATHS = {"FILE_PATH", "DIR_PATH", "FILEPATH", "DIRPATH"}
_LEFT_OUT = {"WindowManager", "Screen", "WorkSpace"}


def whole_file(path: Path) -> dict[Block, Fields]:
    """Open a .blend and return the fields of each data-block, by its type, name and library."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
    return whole_session()


def whole_session() -> dict[Block, Fields]:
    """Return the fields of each data-block that is open, as `whole_file` does."""
    import bpy

    bpy.context.view_layer.update()
    found: dict[Block, Fields] = {}
    for prop in bpy.data.bl_rna.properties:
        for block in getattr(bpy.data, prop.identifier) if prop.type == "COLLECTION" else ():
            if block.rna_type.identifier not in _LEFT_OUT:
                found[_reference(block)] = _fields(block, block, {_key(block)})
    return found


def differences(before: Any, after: Any, more: bool = False, where: str = "") -> Iterator[str]:
    """Yield where two such values differ, a line each; with `more` the second may have more than the first."""
    if more and before in (None, [], {}, "nothing"):
        return
    if more and isinstance(before, list) and isinstance(after, list):
        after = after[: len(before)]
    if isinstance(before, dict) and isinstance(after, dict):
        for key in [*before, *(key for key in after if key not in before and not more)]:
            yield from differences(before.get(key, "nothing"), after.get(key, "nothing"), more, f"{where}/{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, (old, new) in enumerate(zip(before, after, strict=True)):
            yield from differences(old, new, more, f"{where}[{number}]")
    elif before != after:
        yield f"{where}: {before!r:.200} -> {after!r:.200}"


def _reference(block: Any) -> Block:
    import bpy

    library = block.library
    return block.rna_type.identifier, block.name, _normal(bpy.path.abspath(library.filepath)) if library else ""


def _normal(path: str) -> str:
    return os.path.normpath(path) if path else ""


def _key(struct: Any) -> int:
    """What tells a struct from the one that it is in, which may begin at the same address."""
    return hash((struct.as_pointer(), struct.bl_rna.identifier))


def _fields(struct: Any, owner: Any, seen: set[int]) -> Fields:
    result: Fields = {}
    # what is in a collection is told there, and where something points at it only that it does
    for prop in sorted(struct.bl_rna.properties, key=lambda prop: prop.type != "COLLECTION"):
        if prop.identifier in _PASSING:
            continue
        with suppress(AttributeError, RuntimeError, ValueError, SystemError, TypeError):
            result[prop.identifier] = _value(prop, getattr(struct, prop.identifier), owner, seen)
    with suppress(AttributeError, TypeError, KeyError):
        known = struct.bl_rna.properties
        result["custom properties"] = {key: _custom(value) for key, value in struct.items() if key not in known}
    return result


def _custom(value: Any) -> Any:
    for turn in ("to_dict", "to_list"):
        if hasattr(value, turn):
            return getattr(value, turn)()
    return value if isinstance(value, str | int | float | bool | bytes) else type(value).__name__


def _value(prop: Any, value: Any, owner: Any, seen: set[int]) -> Any:
    import bpy

    if prop.type == "POINTER":
        return _pointed(value, owner, seen)
    if prop.type == "COLLECTION":
        items = [_pointed(item, owner, seen) for item in value]
        names = [item.get("name") if isinstance(item, dict) else None for item in items]
        if items and all(names) and len(set(names)) == len(names):
            return dict(zip(names, items, strict=True))
        return items
    if prop.type == "STRING":
        is_path = prop.subtype in _PATHS and isinstance(value, str)
        return _normal(bpy.path.abspath(value, library=getattr(owner, "library", None))) if is_path else value
    return _plain(list(_flat(value)) if getattr(prop, "is_array", False) else value)


def _flat(value: Any) -> Iterator[Any]:
    for item in value:
        yield from _flat(item) if hasattr(item, "__len__") else [item]


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(x) for x in value]
    if isinstance(value, float):
        return float(f"{value:.5g}") if abs(value) > 1e-6 else 0.0
    return sorted(value) if isinstance(value, set | frozenset) else value


def _pointed(value: Any, owner: Any, seen: set[int]) -> Any:
    import bpy

    if value is None:
        return None
    embedded = isinstance(value, bpy.types.ID) and value.is_embedded_data
    if isinstance(value, bpy.types.ID) and not embedded:
        return _reference(value)
    if _key(value) in seen:
        return "above"
    seen.add(_key(value))
    return _fields(value, value if embedded else owner, seen)
