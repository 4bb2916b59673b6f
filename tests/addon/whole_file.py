"""Everything that is in a .blend file, field by field, as Blender's own description of its data lists it."""

from pathlib import Path
from typing import Any

Fields = dict[str, Any]

# what is no content: how often something is used, what is computed, what a window shows at the moment
_PASSING = {
    "rna_type", "users", "session_uid", "is_evaluated", "original", "id_data", "tag", "preview", "asset_data",
    "is_dirty", "frame_duration", "has_data", "is_valid", "is_runtime_data", "active_operator", "depsgraph",
    "view_layers_depsgraph", "bindcode", "select_keyed", "is_missing", "library_weak_reference",
    "show_region_hud", "statusbar", "render_slots", "channels_scope", "scopes", "eval_time", "execution_time",
    "users_scene", "users_collection", "children_recursive", "rigidbody_world", "is_editmode",
}  # fmt: skip
_PATHS = {"FILE_PATH", "DIR_PATH", "FILEPATH", "DIRPATH"}
_LEFT_OUT = {"window_managers", "screens", "workspaces"}


def whole_file(path: Path) -> dict[tuple[str, str, str], Fields]:
    """Open a .blend and return the fields of each data-block, by its type, name and library."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
    bpy.context.view_layer.update()
    found: dict[tuple[str, str, str], Fields] = {}
    for prop in bpy.data.bl_rna.properties:
        if prop.type == "COLLECTION" and prop.identifier not in _LEFT_OUT:
            for block in getattr(bpy.data, prop.identifier):
                found[_reference(block)] = _fields(block, block, {block.as_pointer()})
    return found


def differences(before: Any, after: Any, where: str = "") -> list[str]:
    """Return where two such values differ, one line each."""
    if isinstance(before, dict) and isinstance(after, dict):
        keys = [*before, *(key for key in after if key not in before)]
        return [x for key in keys for x in differences(before.get(key), after.get(key), f"{where}/{key}")]
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        pairs = enumerate(zip(before, after, strict=True))
        return [x for number, (old, new) in pairs for x in differences(old, new, f"{where}[{number}]")]
    return [] if before == after else [f"{where}: {before!r:.200} -> {after!r:.200}"]


def _reference(block: Any) -> tuple[str, str, str]:
    import bpy

    library = block.library
    return (
        block.rna_type.identifier,
        block.name,
        str(_absolute(bpy.path.abspath(library.filepath))) if library else "",
    )


def _absolute(path: str) -> str:
    import os

    return os.path.normpath(path) if path else ""


def _fields(struct: Any, owner: Any, seen: set[int]) -> Fields:
    result: Fields = {}
    for prop in struct.bl_rna.properties:
        if prop.identifier in _PASSING or (prop.is_skip_save and prop.type in ("POINTER", "COLLECTION")):
            continue
        try:
            value = getattr(struct, prop.identifier)
        except (AttributeError, RuntimeError, ValueError, SystemError, TypeError):
            continue
        result[prop.identifier] = _value(prop, value, owner, seen)
    if hasattr(struct, "keys"):
        try:
            result["custom"] = {
                key: _custom(struct[key]) for key in struct.keys() if key not in struct.bl_rna.properties
            }
        except (TypeError, KeyError):
            pass
    return result


def _custom(value: Any) -> Any:
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if hasattr(value, "to_list"):
        return value.to_list()
    return value if isinstance(value, (str, int, float, bool, bytes)) else repr(value)


def _value(prop: Any, value: Any, owner: Any, seen: set[int]) -> Any:
    import bpy

    if prop.type == "POINTER":
        return _pointed(value, owner, seen)
    if prop.type == "COLLECTION":
        return [_pointed(item, owner, seen) for item in value]
    if prop.type == "STRING":
        if prop.subtype in _PATHS and value and isinstance(value, str):
            return _absolute(bpy.path.abspath(value, library=getattr(owner, "library", None)))
        return value
    if getattr(prop, "is_array", False):
        return [_plain(x) for x in _flat(value)]
    return _plain(value)


def _flat(value: Any) -> list[Any]:
    return [y for x in value for y in (_flat(x) if hasattr(x, "__len__") else [x])]


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.5g}") if abs(value) > 1e-6 else 0.0
    return sorted(value) if isinstance(value, (set, frozenset)) else value


def _pointed(value: Any, owner: Any, seen: set[int]) -> Any:
    import bpy

    if value is None:
        return None
    embedded = isinstance(value, bpy.types.ID) and value.is_embedded_data
    if isinstance(value, bpy.types.ID) and not embedded:
        return _reference(value)
    # a struct may begin at the address of the one that holds it
    key = hash((value.as_pointer(), value.bl_rna.identifier))
    if key in seen or not hasattr(value, "bl_rna"):
        return "above"
    seen.add(key)
    return _fields(value, value if embedded else owner, seen)
