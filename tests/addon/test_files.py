"""Meshes in and out of files."""

from pathlib import Path

import numpy as np
import pytest
from scenes import make_object, make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.solver import verdict  # noqa: E402


@pytest.mark.parametrize("ending", files.FORMATS)
def test_a_sheet_survives_each_format(ending: str, tmp_path: Path) -> None:
    obj = make_sheet("Sheet", 7)
    obj.data.uv_layers.new(name="UVMap")
    make_object("Other", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    expected = positions(obj)
    files.export_mesh(obj, tmp_path / f"sheet{ending}")
    files.new_scene()
    # a .blend holds the other object too
    name = ":Sheet" if ending == ".blend" else ""
    found = files.import_mesh(f"{tmp_path / 'sheet'}{ending}{name}").obj
    assert verdict(read_surface(found).mesh, fill_holes=False).topology.is_disc
    # in the world, because importers may turn the object; in any order, because some renumber
    world = np.array([found.matrix_world @ vertex.co for vertex in found.data.vertices])
    repeated = ending in (".ply", ".glb", ".gltf")  # one vertex for each of its UVs: every quad is an island
    assert len(world) == (4 * 36 if repeated else len(expected))
    assert np.abs(world[:, None] - expected).max(axis=2).min(axis=1).max() < 1e-5
    assert bool(found.data.uv_layers) == (ending not in (".stl", ".gii"))


@pytest.mark.parametrize("ending", [".obj", ".ply", ".blend"])
def test_vertices_keep_the_files_order(ending: str, tmp_path: Path) -> None:
    obj = make_sheet("Sheet", 7)
    expected = read_surface(obj).mesh
    files.export_mesh(obj, tmp_path / f"sheet{ending}")
    files.new_scene()
    found = read_surface(files.import_mesh(str(tmp_path / f"sheet{ending}")).obj).mesh
    assert np.allclose(np.linalg.norm(found.vertices, axis=1), np.linalg.norm(expected.vertices, axis=1), atol=1e-5)
    assert (found.faces == expected.faces).all()


def test_a_blend_keeps_vertex_groups_and_the_other_objects(tmp_path: Path) -> None:
    obj = make_sheet("Sheet", 5)
    obj.vertex_groups.new(name="Head").add((3,), 0.5, "REPLACE")
    make_sheet("Other", 5)
    files.export_mesh(obj, tmp_path / "sheet.blend")
    files.new_scene()
    found = files.import_mesh(f"{tmp_path / 'sheet.blend'}:Sheet").obj
    assert weights(found, "Head")[3] == 0.5
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "sheet.blend"))
    assert sorted(bpy.context.scene.objects.keys()) == ["Other", "Sheet"]


@pytest.fixture
def two(tmp_path: Path) -> Path:
    """A .blend with two meshes of like names."""
    make_sheet("Scan", 4)
    make_sheet("Scan.003", 5)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two.blend"))
    files.new_scene()
    return tmp_path / "two.blend"


def test_an_object_is_chosen_by_its_name_in_the_file(two: Path) -> None:
    first = files.import_mesh(f"{two}:Scan.003").obj
    second = files.import_mesh(f"{two}:Scan").obj
    third = files.import_mesh(f"{two}:Scan.003").obj
    assert [len(obj.data.vertices) for obj in (first, second, third)] == [25, 16, 25]
    assert first.name == "Scan.003"


def test_an_object_in_another_format_than_blend_can_be_named_too(tmp_path: Path) -> None:
    path = tmp_path / "two.obj"
    path.write_text(
        "o A\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no B\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 2 2 2\nf 4 5 6\nf 5 7 6\n"
    )
    assert len(files.import_mesh(f"{path}:B").obj.data.vertices) == 4
    with pytest.raises(files.Unreadable, match=r"has 2 mesh objects \('A', 'B'\): name one as .*two.obj:NAME"):
        files.import_mesh(str(path))


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("gone.obj", None, "there is no file"),
        ("text.txt", "hello", "has an ending that is not known: use one of .blend .obj"),
        ("empty.obj", "", "is empty"),
        ("words.obj", "these are only words\n", "holds no mesh"),
        ("words.ply", "these are only words\n", "could not be read: it does not begin with the header of a PLY file"),
        ("words.glb", "these are only words\n", "is cut short or damaged: its JSON ends in an error"),
        ("words.fbx", "these are only words\n", "could not be read: "),
        ("words.usda", "these are only words\n", "could not be read: "),
        ("words.blend", "these are only words\n", "could not be read: "),
    ],
)
def test_an_unreadable_file_is_one_sentence(name: str, content: str | None, reason: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(files.Unreadable, match=reason) as caught:
        files.import_mesh(str(tmp_path / name))
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_outputs_appear_together_or_not_at_all(tmp_path: Path) -> None:
    final = [tmp_path / "a.txt", tmp_path / "b.txt"]
    final[0].write_text("old")

    def fail() -> None:
        with files.outputs() as written:
            for path in final:
                written.path(path).write_text("new")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert final[0].read_text() == "old"
    with files.outputs() as written:
        for path in final:
            written.path(path).write_text("new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.txt", "b.txt"]
    assert final[0].read_text() == "new"


def test_names_with_colons_and_files_that_exist_are_told_apart(tmp_path: Path) -> None:
    assert files.split_object_name("a/scan.blend:Scan: left") == (Path("a/scan.blend"), "Scan: left")
    assert files.split_object_name("scan.obj") == (Path("scan.obj"), None)
    assert files.split_object_name("SCAN.BLEND:Scan") == (Path("SCAN.BLEND"), "Scan")
    odd = tmp_path / "odd.obj:name.obj"
    odd.write_text("")
    assert files.split_object_name(str(odd)) == (odd, None)
    assert files.split_object_name(f"{odd}:Scan") == (odd, "Scan")


def test_what_a_file_repeats_along_seams_stays_on_the_mesh_and_is_joined_for_the_computation(tmp_path: Path) -> None:
    obj = make_sheet("Sheet", 7)
    obj.data.uv_layers.new(name="UVMap")  # every quad its own island
    for ending in (".ply", ".glb"):
        files.export_mesh(obj, tmp_path / f"sheet{ending}")
    for ending in (".ply", ".glb"):
        imported = files.import_mesh(str(tmp_path / f"sheet{ending}"))
        assert len(imported.obj.data.vertices) == 4 * 36
        assert imported.order_change() is None
        found = verdict(read_surface(imported.obj).mesh)
        assert found.topology.vertices == 49
        assert found.repairs == ("60 edges joined along which it is cut open",)


def test_lips_that_a_shape_key_opens_stay_apart(tmp_path: Path) -> None:
    """A cut inside the sheet: closed for the computation, unless a key moves its sides apart."""
    n, row = 11, 5
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    corners = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1).tolist()
    quads = [(i * n + j, i * n + j + 1, (i + 1) * n + j + 1, (i + 1) * n + j) for i in range(10) for j in range(10)]
    upper = {row * n + j: len(corners) + j - 3 for j in range(3, 8)}
    corners += [corners[v] for v in upper]
    quads = [tuple(upper.get(v, v) for v in quad) if k // 10 >= row else quad for k, quad in enumerate(quads)]
    obj = make_object("Face", corners, quads)
    assert verdict(read_surface(obj).mesh).repairs == ("6 edges joined along which it is cut open",)
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Open")
    for v in upper.values():
        key.data[v].co.y += 0.2
    for _ in range(2):
        surface = read_surface(obj)
        assert surface.keys is not None
        assert verdict(surface.mesh, keys=surface.keys).repairs == ("1 opening (12 edges) closed",)
        files.export_mesh(obj, tmp_path / "face.glb")
        files.new_scene()
        obj = files.import_mesh(str(tmp_path / "face.glb")).obj


def test_vertices_that_blender_leaves_out_of_an_obj_are_said(tmp_path: Path) -> None:
    path = tmp_path / "loose.obj"
    path.write_text("v 0 0 0\nv 9 9 9\nv 1 0 0\nv 0 1 0\nf 1 3 4\n")
    imported = files.import_mesh(str(path))
    assert imported.order_change() == "Blender leaves out 1 that no face of this object uses"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert files.import_mesh(str(path)).order_change() is None
