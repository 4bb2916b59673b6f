"""Clear Möbius Data: everything that Align, Flatten and Show leave goes, what was transferred stays, and no pointer."""

import hashlib
from typing import Any

import numpy as np
import pytest
from scenes import QUICK, everything, make_sheet, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import earlier_version, stored_alignment  # noqa: E402
from mobius_extension.mobius_addon.attributes import ActiveLayers  # noqa: E402


def dress(obj: Any) -> None:
    """Several layers of each kind, none of those that Blender would mark by itself."""
    mesh = obj.data
    for letter in "abc":
        mesh.uv_layers.new(name=f"UV {letter}")
        mesh.color_attributes.new(f"Color {letter}", "BYTE_COLOR", "CORNER")
        obj.vertex_groups.new(name=f"Group {letter}").add((0, 1), 0.5, "REPLACE")
    mesh.attributes.new("Weather", "FLOAT", "POINT")
    mesh.attributes.active = mesh.attributes["Weather"]
    mesh.uv_layers.active = mesh.uv_layers["UV b"]
    mesh.uv_layers["UV c"].active_render = True
    mesh.uv_layers["UV b"].active_clone = True
    mesh.uv_layer_stencil = mesh.uv_layers["UV c"]
    mesh.attributes.active_color_name = "Color b"
    mesh.attributes.default_color_name = "Color c"
    obj.vertex_groups.active = obj.vertex_groups["Group b"]


def traces() -> list[str]:
    """Everything in the file that bears our name or was made by us."""
    found = [f"collection {x.name}" for x in bpy.data.collections if "Mobius" in x.name]
    found += [f"object {x.name}" for x in bpy.data.objects if "side by side" in x.name]
    for mesh in bpy.data.meshes:
        found += [f"{mesh.name}: {x.name}" for x in mesh.attributes if "Mobius" in x.name]
        found += [f"{mesh.name}: {key}" for key in mesh.keys() if "mobius" in key]  # noqa: SIM118
        kept = mesh.mobius_alignment
        found += [f"{mesh.name}: {x}" for x in ("packed", "report", "source_name") if getattr(kept, x)]
        found += [f"{mesh.name}: before"] if mesh.mobius_before else []
    for obj in bpy.data.objects:
        found += [f"{obj.name}: {group.name}" for group in obj.vertex_groups if "Mobius" in group.name]
    return found


def use_everything(source: Any, target: Any) -> None:
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    for measure in ("confidence", "dilatation", "factor"):
        assert bpy.ops.mobius.heat_map(measure=measure) == {"FINISHED"}
    for obj in (source, target):
        bpy.context.view_layer.objects.active = obj
        for measure in ("dilatation", "factor"):
            assert bpy.ops.mobius.flatten(distortion=measure) == {"FINISHED"}
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}


@pytest.mark.parametrize("dressed", [True, False])
def test_everything_goes_and_what_was_active_is_so_again(dressed: bool) -> None:
    pair = make_sheet("Source", 21), make_sheet("Target", 16)
    if dressed:
        for obj in pair:
            dress(obj)
    before = [(everything(obj), ActiveLayers.of(obj)) for obj in pair]
    use_everything(*pair)
    use_everything(*pair)
    assert len(traces()) > 20
    assert bpy.ops.mobius.clear() == {"FINISHED"}
    assert traces() == []
    for obj, (was, active) in zip(pair, before, strict=True):
        now = everything(obj)
        assert {key: now[key] for key in was if key != "selected"} == {
            key: was[key] for key in was if key != "selected"
        }
        assert ActiveLayers.of(obj) == active
    assert bpy.ops.mobius.clear() == {"CANCELLED"}  # there is nothing any more


def test_what_was_transferred_stays(pair: tuple[Any, Any]) -> None:
    _, target = pair
    bpy.ops.mobius.align(**QUICK)
    bpy.ops.mobius.transfer()
    carried = weights(target, "Right")
    bpy.ops.mobius.clear()
    assert (weights(target, "Right") == carried).all()
    assert target.data.uv_layers.keys() == ["UVMap"]
    assert target.data.uv_layers.active.name == "UVMap"


def test_what_the_person_has_made_active_since_stays_active() -> None:
    pair = make_sheet("Source", 21), make_sheet("Target", 16)
    for obj in pair:
        dress(obj)
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = pair
    bpy.ops.mobius.align(**QUICK)
    mesh = pair[1].data
    mesh.uv_layers.active = mesh.uv_layers["UV a"]
    mesh.attributes.active_color_name = "Color a"
    bpy.ops.mobius.align(**QUICK)  # which makes ours active once more
    assert mesh.uv_layers.active.name == "Mobius"
    mesh.attributes.active_color_name = "Color c"
    bpy.ops.mobius.clear()
    active = ActiveLayers.of(pair[1])
    assert (active.uv, active.color, active.uv_render) == ("UV a", "Color c", "UV c")


def test_a_layer_that_is_gone_is_no_harm() -> None:
    pair = make_sheet("Source", 21), make_sheet("Target", 16)
    for obj in pair:
        dress(obj)
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = pair
    bpy.ops.mobius.align(**QUICK)
    mesh = pair[1].data
    mesh.uv_layers.remove(mesh.uv_layers["UV b"])
    pair[0].data.mobius_before = "{damaged"
    assert bpy.ops.mobius.clear() == {"FINISHED"}
    assert traces() == []
    assert mesh.uv_layers.active.name in ("UV a", "UV c")
    # nor is the name of a removed color kept
    assert pair[0].data.attributes.active_color_name in pair[0].data.color_attributes


def test_something_of_another_kind_under_our_name_is_not_ours() -> None:
    sheet = make_sheet("Sheet", 5)
    bpy.ops.mobius.flatten()
    sheet.data.attributes.new("Mobius", "FLOAT", "POINT")
    sheet.data.color_attributes.new("Mobius Color", "BYTE_COLOR", "CORNER")
    assert bpy.ops.mobius.clear(clear_from="selected") == {"FINISHED"}
    names = {x.name for x in sheet.data.attributes}
    assert {"Mobius", "Mobius Color"} <= names
    assert "Mobius Disc" not in names


@pytest.mark.parametrize("which", ["selected", "all"])
def test_meshes_can_be_chosen_otherwise(which: str) -> None:
    sheets = [make_sheet(name, 6) for name in ("A", "B", "C")]
    for obj in sheets:
        bpy.context.view_layer.objects.active = obj
        bpy.ops.mobius.flatten()
        obj.select_set(obj != sheets[2])
    sheets[0].select_set(True)
    elsewhere = bpy.data.scenes.new("Elsewhere")
    elsewhere.collection.objects.link(sheets[1])
    bpy.context.scene.collection.objects.unlink(sheets[1])
    assert bpy.ops.mobius.clear(clear_from=which) == {"FINISHED"}
    left = [obj.name for obj in sheets if "Mobius Disc" in obj.data.uv_layers]
    assert left == (["B", "C"] if which == "selected" else [])


def test_one_undo_takes_clear_back(pair: tuple[Any, Any]) -> None:
    use_everything(*pair)
    bpy.ops.ed.undo_push(message="before")
    before = [str(everything(obj)) for obj in pair], traces()
    assert bpy.ops.mobius.clear("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.ed.undo()
    objects = [bpy.data.objects[name] for name in ("Source", "Target")]
    assert ([str(everything(obj)) for obj in objects], traces()) == before


def test_clear_leaves_what_it_cannot_write_and_says_so(pair: tuple[Any, Any], tmp_path: Any) -> None:
    source, target = pair
    bpy.ops.mobius.align(**QUICK)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"), copy=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Target"]
    linked = wanted.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    bpy.context.scene.mobius.source = linked
    assert bpy.ops.mobius.clear() == {"FINISHED"}
    assert "Mobius" in linked.data.uv_layers
    assert "Mobius" not in target.data.uv_layers
    assert "Mobius" in source.data.uv_layers
    bpy.context.view_layer.objects.active = source
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Switch to Object Mode first"):
        bpy.ops.mobius.clear()


def test_the_active_layer_to_transfer_is_the_persons_not_ours(pair: tuple[Any, Any]) -> None:
    source, target = pair
    source.data.uv_layers.new(name="Second")
    source.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    bpy.ops.mobius.align(**QUICK)
    assert source.data.uv_layers.active.name == "Mobius"
    bpy.ops.mobius.transfer(layers="active", kinds={"UV", "COLORS"})
    assert {x.name for x in target.data.uv_layers} == {"Mobius", "UVMap"}
    assert "Paint" in target.data.color_attributes


# no pointer to the source


def test_a_deleted_source_can_be_purged(pair: tuple[Any, Any]) -> None:
    source, target = pair
    mesh = source.data.name
    bpy.ops.mobius.align(**QUICK)
    assert bpy.context.scene.mobius.source == source
    for obj in bpy.context.scene.objects:
        obj.select_set(obj == source)
    bpy.ops.object.delete()  # as in the viewport: an object that is still used would only leave the scene
    bpy.context.view_layer.update()
    bpy.data.orphans_purge(do_recursive=True)
    assert "Source" not in bpy.data.objects
    assert mesh not in bpy.data.meshes
    assert bpy.context.scene.mobius.source is None
    assert target.data.mobius_alignment.source_name == "Source"


def test_the_panel_keeps_what_is_in_another_scene_or_excluded(pair: tuple[Any, Any]) -> None:
    source, target = pair
    bpy.data.scenes.new("Other").collection.objects.link(source)
    bpy.context.scene.collection.objects.unlink(source)
    collection = bpy.data.collections.new("Away")
    bpy.context.scene.collection.children.link(collection)
    bpy.context.scene.collection.objects.unlink(target)
    collection.objects.link(target)
    bpy.context.view_layer.layer_collection.children["Away"].exclude = True
    bpy.context.view_layer.update()
    settings = bpy.context.scene.mobius
    assert (settings.source, settings.target) == (source, target)


def test_undo_of_the_deletion_brings_the_choice_back(pair: tuple[Any, Any]) -> None:
    bpy.ops.ed.undo_push(message="before")
    for obj in bpy.context.scene.objects:
        obj.select_set(obj == pair[0])
    bpy.ops.object.delete("EXEC_DEFAULT", True)
    bpy.context.view_layer.update()
    assert bpy.context.scene.mobius.source is None
    bpy.ops.ed.undo()
    assert bpy.context.scene.mobius.source == bpy.data.objects["Source"]


def test_an_appended_target_brings_no_source_along(pair: tuple[Any, Any], tmp_path: Any) -> None:
    bpy.ops.mobius.align(**QUICK)
    path = str(tmp_path / "aligned.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(path) as (_, wanted):
        wanted.objects = ["Target"]
    assert bpy.data.objects.keys() == ["Target"]
    assert bpy.data.objects["Target"].data.mobius_alignment.source_name == "Source"


def test_an_alignment_is_with_a_mesh_of_this_name_or_shape(pair: tuple[Any, Any]) -> None:
    source, target = pair
    bpy.ops.mobius.align(**QUICK)
    other = make_sheet("Other", 21)
    assert stored_alignment.exists(target, other)  # the same shape
    other.data.vertices[0].co.z += 1
    other.data.update()
    bpy.context.view_layer.update()
    assert not stored_alignment.exists(target, other)
    other.name, source.name = "Source", "Renamed"
    other.name = "Source"
    assert stored_alignment.exists(target, source)
    bpy.context.scene.mobius.source = other
    with pytest.raises(RuntimeError, match="'Source' has been edited since it was aligned: press Align again"):
        bpy.ops.mobius.transfer()


def as_version_0_1_kept_it(source: Any, target: Any) -> None:
    """Make an alignment one of version 0.1: a pointer, and its own fingerprints of float32 and int32."""
    from mobius_extension.mobius_addon.mesh_data import read_surface

    kept = target.data.mobius_alignment
    kept.property_unset("source_name")
    kept.property_unset("source_size")
    kept.source = source
    for obj, name in ((source, "source_fingerprint"), (target, "target_fingerprint")):
        mesh = read_surface(obj).mesh
        own = mesh.vertices.astype(np.float32).tobytes() + mesh.faces.astype(np.int32).tobytes()
        setattr(kept, name, hashlib.blake2b(own, digest_size=16).hexdigest())


def test_files_of_version_0_1_are_read_and_their_pointer_is_dropped(pair: tuple[Any, Any], tmp_path: Any) -> None:
    bpy.ops.mobius.align(**QUICK)
    as_version_0_1_kept_it(*pair)
    path = str(tmp_path / "earlier.blend")
    earlier_version.unregister()
    try:  # as that version left it
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        assert bpy.data.objects["Target"].data.mobius_alignment.source == bpy.data.objects["Source"]
    finally:
        earlier_version.register()
    bpy.ops.wm.open_mainfile(filepath=path)
    source, target = bpy.data.objects["Source"], bpy.data.objects["Target"]
    kept = target.data.mobius_alignment
    assert (kept.source, kept.source_name, kept.source_size) == (None, "Source", 441)
    assert stored_alignment.exists(target, source)
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    assert "Right" in target.vertex_groups
    target.data.vertices[0].co.z += 0.01
    with pytest.raises(RuntimeError, match="'Target' has been edited since it was aligned"):
        bpy.ops.mobius.transfer()
    bpy.context.scene.mobius.source = None
    bpy.data.objects.remove(source)
    bpy.data.orphans_purge(do_recursive=True)
    assert "Source" not in bpy.data.meshes


def test_the_pointer_of_version_0_1_is_dropped_from_what_is_saved(pair: tuple[Any, Any], tmp_path: Any) -> None:
    # as of a mesh that was appended, or open when the extension was updated
    bpy.ops.mobius.align(**QUICK)
    as_version_0_1_kept_it(*pair)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    kept = pair[1].data.mobius_alignment
    assert (kept.source, kept.source_name) == (None, "Source")
    assert stored_alignment.exists(pair[1], pair[0])


def test_a_linked_target_of_version_0_1_is_known_by_its_pointer(pair: tuple[Any, Any], tmp_path: Any) -> None:
    bpy.ops.mobius.align(**QUICK)
    as_version_0_1_kept_it(*pair)
    path = str(tmp_path / "library.blend")
    earlier_version.unregister()
    try:
        bpy.ops.wm.save_as_mainfile(filepath=path)
    finally:
        earlier_version.register()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = ["Source", "Target"]
    source, target = wanted.objects
    earlier_version.drop_pointers()
    assert stored_alignment.exists(target, source)
    assert not stored_alignment.exists(target, make_sheet("Source", 21))
