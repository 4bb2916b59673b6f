"""Scenes made at random, through `transfer` into a .blend: everything that was there before is there after."""

import os
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from rich_scene import Scene, add_source, build, make_source
from whole_file import differences, whole_file

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.command_line import main  # noqa: E402

COUNT = int(os.environ.get("MOBIUS_ROUND_TRIPS", "15"))
QUICK = ["--samples", "40", "--targets", "100", "--reflect", "never", "--refine", "none"]

SCENES = st.builds(
    Scene,
    parent=st.sampled_from(["NONE", "EMPTY", "ARMATURE", "BONE"]),
    scale=st.sampled_from([(1, 1, 1), (100, 100, 100), (-1, 1, 1), (0.5, 2, 1)]),
    place=st.sampled_from(["SHOWN", "EXCLUDED", "HIDDEN", "DISABLED", "UNSELECTABLE", "OTHER SCENE", "NO SCENE"]),
    modifiers=st.lists(
        st.sampled_from(["ARMATURE", "SUBSURF", "SHRINKWRAP", "DISPLACE", "NODES", "MIRROR", "SOLIDIFY"]),
        max_size=3, unique=True,
    ).map(tuple),
    keys=st.integers(0, 2),
    key_driver=st.booleans(),
    key_action=st.booleans(),
    groups=st.integers(0, 3),
    pictures=st.lists(st.sampled_from(["FILE", "PACKED", "TILED", "SEQUENCE"]), max_size=3).map(tuple),
    others=st.lists(
        st.sampled_from(["CAMERA", "LIGHT", "TEXT", "CURVE", "SPEAKER", "SHARED", "LINKED", "OVERRIDE"]),
        max_size=4, unique=True,
    ).map(tuple),
    mode=st.sampled_from(["OBJECT", "OBJECT", "EDIT", "WEIGHT_PAINT", "SCULPT", "VERTEX_PAINT"]),
    unit_scale=st.sampled_from([1.0, 0.01]),
    frame=st.integers(1, 30),
    constraint=st.booleans(),
    compressed=st.booleans(),
)  # fmt: skip

# of the target's own data-blocks, which receive layers: what is the sum or the choice of all layers
CHANGES = ("/active", "is_active", "/material_index", "/groups", "/index", "/color_index", "attributes/.")


@pytest.mark.timeout(300 + 20 * COUNT)
@settings(
    max_examples=COUNT, deadline=None, derandomize="MOBIUS_ROUND_TRIPS" not in os.environ, print_blob=False,
    suppress_health_check=list(HealthCheck), phases=[Phase.generate, Phase.shrink],
)  # fmt: skip
@given(scene=SCENES, whence=st.sampled_from(["SAME", "BLEND", "OBJ"]), elsewhere=st.booleans())
def test_everything_that_was_there_is_there_after(scene: Scene, whence: str, elsewhere: bool) -> None:
    with tempfile.TemporaryDirectory() as made:
        check_round_trip(scene, whence, Path(made), Path(made) / ("results" if elsewhere else "scene"))


def check_round_trip(scene: Scene, whence: str, folder: Path, results: Path) -> None:
    results.mkdir(exist_ok=True)
    path = build(scene, folder / "scene")
    source = f"{path}:Source"
    if whence == "SAME":
        bpy.ops.wm.open_mainfile(filepath=str(path))
        add_source(path.parent / "source pictures")
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=scene.compressed)
    else:
        (folder / "other").mkdir()
        blend = folder / "other" / "other.blend"
        make_source(blend)
        source = str(blend)
        if whence == "OBJ":
            source = str(blend.with_suffix(".obj"))
            bpy.ops.wm.obj_export(filepath=source, path_mode="RELATIVE")
    before = whole_file(path)
    view = _view()
    out = results / "out.blend"
    # an .obj brings normals too, which change what is computed of the target's own layers
    only = ["--only", "uv,materials"] if whence == "OBJ" else []
    assert main(["transfer", source, f"{path}:Target", "-o", str(out), *only, *QUICK]) == 0
    assert (out.read_bytes()[:4] == b"\x28\xb5\x2f\xfd") == scene.compressed
    after = whole_file(out)
    assert _view() == view
    changed = set(_receiving(before))
    lost = [x for block, fields in before.items() if block not in changed
            for x in differences(fields, after.get(block), where=str(block))]  # fmt: skip
    for block in changed:
        found = differences(before[block], after.get(block), more=True, where=str(block))
        lost += [x for x in found if not any(name in x.partition(":")[0] for name in CHANGES)]
    # where to render and bake to, which Blender's own remapping leaves as it is
    lost = [x for x in lost if "/render/" not in x or "filepath:" not in x]
    assert not lost, "\n".join(lost[:20])
    added = {kind for kind, *_ in after.keys() - before.keys()}
    assert added <= {"Material", "Image", "ShaderNodeTree", "Key"}
    missing = [x.filepath for x in bpy.data.images if x.source == "FILE" and not x.packed_file
               and not Path(bpy.path.abspath(x.filepath)).is_file()]  # fmt: skip
    assert not missing


def _receiving(before: dict) -> list:
    """The data-blocks that receive something: the target, its mesh and its keys, and who shares them."""
    target = before["Object", "Target", ""]
    mesh = target["data"]
    keys = before[mesh]["shape_keys"]
    return [x for x, fields in before.items() if x in (mesh, keys) or fields.get("data") == mesh]


def _view() -> list:
    window = bpy.context.window
    spaces = [area.spaces.active for area in window.screen.areas if area.type == "VIEW_3D"]
    looks = [(space.camera and space.camera.name, space.region_3d.view_perspective) for space in spaces]
    return [window.scene.name, window.view_layer.name, bpy.data.workspaces.keys(), looks]
