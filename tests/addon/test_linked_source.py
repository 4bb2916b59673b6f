"""A source of another file, which is only read: an alignment is written on the target alone."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import QUICK, corner_values, everything, make_sheet, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mathutils import Vector  # noqa: E402
from mobius_extension.mobius_addon import stored_alignment  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402

SHARED = ["Mobius", "Mobius Color", "Mobius Matched"]


def link(library: Path) -> Any:
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.objects = ["Body"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    return wanted.objects[0]


def linked(library: Path) -> Any:
    return link(library)


def overridden_object(library: Path) -> Any:
    return link(library).override_create(remap_local_usages=True)


def overridden_mesh(library: Path) -> Any:
    own = overridden_object(library)
    own.data.override_create(remap_local_usages=True)
    return own


def linked_mesh(library: Path) -> Any:
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.meshes = ["Body"]
    own = bpy.data.objects.new("Body", wanted.meshes[0])
    bpy.context.scene.collection.objects.link(own)
    return own


@pytest.fixture(params=[linked, overridden_object, overridden_mesh, linked_mesh], ids=lambda way: way.__name__)
def shot(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[], tuple[Any, Any]]:
    """A saved file whose source is another file's; gives the chosen pair."""
    body = make_sheet("Body", 13)
    body.vertex_groups.new(name="Right").add(range(80), 0.5, "REPLACE")
    body.shape_key_add(name="Basis")
    body.shape_key_add(name="Up").points[5].co.z += 0.1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "people.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    source, target = request.param(tmp_path / "people.blend"), make_sheet("Cloth", 12)
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))

    def chosen() -> tuple[Any, Any]:
        settings = bpy.context.scene.mobius
        return settings.source, settings.target

    return chosen


def left_on(obj: Any) -> list[str]:
    names = [*obj.data.attributes.keys(), *obj.vertex_groups.keys()]
    return sorted(name for name in names if name in SHARED)


def test_align_writes_on_the_target_alone_and_transfer_works_after_reopening(shot: Any, tmp_path: Path) -> None:
    source, target = shot()
    before, meshes = everything(source), len(bpy.data.meshes)
    library = (tmp_path / "people.blend").read_bytes()
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    assert everything(source) == before
    assert len(bpy.data.meshes) == meshes
    assert (left_on(source), left_on(target)) == ([], SHARED)
    assert not source.data.mobius_alignment.target_fingerprint
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    source, target = shot()
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    assert 0.4 < weights(target, "Right").max() < 0.6
    assert target.data.shape_keys.key_blocks.keys() == ["Basis", "Up"]
    assert library == (tmp_path / "people.blend").read_bytes()


def test_the_map_is_that_of_a_source_that_can_be_written(shot: Any) -> None:
    source, target = shot()
    bpy.ops.mobius.align(**QUICK)
    surfaces = read_surface(source), read_surface(target)
    found, disc = stored_alignment.load(target, source, surfaces), corner_values(target, "Mobius")
    local = bpy.data.objects.new("Local", source.data.copy())
    local.data.make_local(clear_liboverride=True)  # a copy of an override is one too
    bpy.context.scene.collection.objects.link(local)
    bpy.context.scene.mobius.source = local
    bpy.ops.mobius.align(**QUICK)
    assert left_on(local) == SHARED
    same = stored_alignment.load(target, local, (read_surface(local), surfaces[1]))
    assert np.array_equal(found.face, same.face)
    assert np.array_equal(found.barycentric, same.barycentric)
    assert np.array_equal(disc, corner_values(target, "Mobius"))


def test_one_undo_takes_it_back_and_what_paints_both_refuses(shot: Any) -> None:
    names = [obj.name for obj in shot()]
    before = everything(shot()[1])
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.mobius.align("EXEC_DEFAULT", True, **QUICK)
    with pytest.raises(RuntimeError, match="'Body' is linked from another file: make it local first"):
        bpy.ops.mobius.side_by_side()
    bpy.ops.ed.undo()
    assert [obj.name for obj in shot()] == names
    assert everything(shot()[1]) == before
    assert not shot()[1].data.mobius_alignment.target_fingerprint


def test_a_point_pair_bends_the_map_and_says_that_the_layout_does_not_follow(
    shot: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    source, target = shot()
    bpy.ops.mobius.align(**QUICK)
    before, there = everything(source), bytes(target.data.mobius_alignment.packed)
    layout = corner_values(target, "Mobius")
    place = source.data.vertices[84].co + Vector((0.02, 0, 0))
    point = min((v.co for v in target.data.vertices), key=lambda co: (co - source.data.vertices[84].co).length)
    assert bpy.ops.mobius.add_pair(source_point=place, target_point=point, follow_all=True) == {"FINISHED"}
    assert "the shared layout and colors stay as Align left them" in capfd.readouterr().out
    assert bytes(target.data.mobius_alignment.packed) != there
    assert np.array_equal(layout, corner_values(target, "Mobius"))
    assert everything(source) == before


def test_several_targets_and_the_one_step_transfer(shot: Any) -> None:
    source, target = shot()
    more = make_sheet("More", 11)
    before = everything(source)
    for obj in (target, more):
        obj.select_set(True)
    assert bpy.ops.mobius.align_selected(**QUICK) == {"FINISHED"}
    assert left_on(target) == left_on(more) == SHARED
    assert stored_alignment.exists(more, source)
    target.select_set(False)
    source.select_set(True)
    bpy.context.view_layer.objects.active = source
    assert bpy.ops.mobius.conformal_transfer(**QUICK) == {"FINISHED"}
    assert weights(more, "Right").max() > 0.4
    assert everything(source) == before
