"""What a file does not hold of an object is found by reading it again; nothing else is said to be lost."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich_scene import _material, save_picture
from scenes import make_object, make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402


def rich() -> Any:
    """A sheet of triangles, so that only layers can be lost, with one of everything."""
    obj = make_sheet("Rich", 9)
    mesh = obj.data
    rng = np.random.default_rng(0)
    for name in ("First", "Second"):
        layer = mesh.uv_layers.new(name=name)
        layer.uv.foreach_set("vector", rng.random(2 * len(mesh.loops)).astype(np.float32))
    colors = mesh.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    colors.data.foreach_set("color", np.append(rng.random((81, 3)), np.ones((81, 1)), 1).astype(np.float32).ravel())
    mesh.attributes.new("Density", "FLOAT", "POINT").data.foreach_set("value", rng.random(81).astype(np.float32))
    obj.vertex_groups.new(name="Group").add(range(40), 0.5, "REPLACE")
    obj.shape_key_add(name="Basis", from_mix=False)
    obj.shape_key_add(name="Key", from_mix=False).points[40].co.z += 0.3
    mesh.edges[10].use_seam = True
    mesh.attributes.new("crease_edge", "FLOAT", "EDGE")
    obj.modifiers.new("Sub", "SUBSURF")
    obj.parent = bpy.data.objects.new("Holder", None)
    bpy.context.scene.collection.objects.link(obj.parent)
    obj["owner"] = "me"
    mesh["kind"] = 3
    obj.constraints.new("COPY_LOCATION").name = "Follow"
    obj.keyframe_insert("location", frame=1)
    return obj


def lost(obj: Any, path: Path) -> str:
    with files.outputs() as written:
        (said,) = files.write_mesh(obj, path, written) or [""]
    return said.partition(" is without ")[2].removesuffix(": write a .blend to keep all")


@pytest.mark.parametrize(
    ("ending", "gone", "kept"),
    [
        (
            ".obj",
            ["UV map '", "attribute 'Density'", "vertex group 'Group'", "shape key 'Key'", "seams", "creases",
             "modifier 'Sub'", "parent 'Holder'", "custom properties 'owner', 'kind'", "constraint 'Follow'", "action"],
            ["UV maps", "material", "quads", "corners", "color attribute"],
        ),
        (".ply", ["vertex group 'Group'", "shape key 'Key'", "seams", "modifier 'Sub'"], ["attribute 'Density'"]),
        (".stl", ["UV maps 'First', 'Second'", "color attribute 'Paint'", "shape key 'Key'", "corners"], []),
        (".glb", ["vertex group 'Group'", "modifier 'Sub'", "corners", "seams"], ["UV map", "shape key"]),
        (".fbx", ["vertex group 'Group'", "modifier 'Sub'"], ["UV map", "shape key", "color attribute", "corners"]),
        (".usda", ["vertex group 'Group'", "modifier 'Sub'", "seams"], ["UV map", "attribute 'Density'", "corners"]),
    ],
)  # fmt: skip
def test_what_each_format_loses_is_said(ending: str, gone: list[str], kept: list[str], tmp_path: Path) -> None:
    said = lost(rich(), tmp_path / f"rich{ending}")
    assert [x for x in gone if x not in said] == [], said
    assert [x for x in kept if x in said] == [], said


@pytest.mark.parametrize("ending", [".obj", ".ply", ".glb", ".gltf", ".fbx", ".usda", ".usdz"])
def test_nothing_is_said_where_nothing_is_lost(ending: str, tmp_path: Path) -> None:
    side = np.linspace(-1, 1, 9)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    corners = [9 * i + j for i in range(8) for j in range(8)]
    triangles = [t for a in corners for t in ((a, a + 1, a + 10), (a, a + 10, a + 9))]
    obj = make_object("Plain sheet.001", np.stack([x, y, 0.1 * x * y], axis=1).tolist(), triangles)
    layer = obj.data.uv_layers.new(name="Own layout")
    vertex = np.array([loop.vertex_index for loop in obj.data.loops])
    layer.uv.foreach_set("vector", np.stack([x, y], axis=1)[vertex].astype(np.float32).ravel())
    if ending != ".ply":  # which has no normals
        obj.data.shade_smooth()
    obj.scale, obj.location = (3, 3, 3), (100, 5, -20)
    if ending != ".ply":
        _material(obj, "A material, with: signs", save_picture(tmp_path / "in" / "skin.png", (1, 0, 0)))
    bpy.context.view_layer.update()
    assert lost(obj, tmp_path / f"plain{ending}") == ""


def test_values_that_a_file_changes_are_lost(tmp_path: Path) -> None:
    obj = make_sheet("Sheet", 9)
    bright = obj.data.color_attributes.new("Bright", "FLOAT_COLOR", "POINT")
    bright.data.foreach_set("color", np.full(4 * 81, 40, np.float32))
    assert "color attribute 'Bright'" in lost(obj, tmp_path / "sheet.ply")


def test_a_file_that_is_cut_short_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a full disk leaves it when an exporter does not look."""
    from mobius_extension.mobius_addon.mesh_data import Refusal

    whole = files.FORMATS[".obj"]

    def cut(path: str) -> None:
        whole.exporter(path)
        text = Path(path).read_text()
        Path(path).write_text(text[: int(0.9 * len(text))])

    monkeypatch.setitem(files.FORMATS, ".obj", files.Format(whole.importer, cut))
    with pytest.raises(Refusal, match="was not written whole"):
        lost(make_sheet("Sheet", 9), tmp_path / "sheet.obj")
    assert list(tmp_path.iterdir()) == []
