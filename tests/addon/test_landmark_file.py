"""Landmarks in a file: vertex numbers, and points in the axes and units of the mesh files."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import make_sheet, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.command_line import main  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402

MARKED = (3, 50, 77, 118, 201)


def written(folder: Path, ending: str, change: Any = None) -> Path:
    """A sheet in a file, named by its ending, and changed before."""
    obj = make_sheet("Sheet", 15)
    if change:
        change(obj)
        bpy.context.view_layer.update()
    files.export_mesh(obj, folder / f"sheet{ending}")
    return folder / f"sheet{ending}"


def move(obj: Any) -> None:
    obj.location, obj.rotation_euler, obj.scale = (3, 1, 2), (0.3, 0.2, 1), (2, 2, 2)


def turned(points: np.ndarray) -> np.ndarray:
    """Points of Blender in a file whose y points up."""
    return points[:, [0, 2, 1]] * [1, 1, -1]


def pairs_file(path: Path, source: np.ndarray, target: np.ndarray) -> Path:
    path.write_text("\n".join(" ".join(f"{c:.7f}" for c in np.r_[a, b]) for a, b in zip(source, target, strict=True)))
    return path


def read(path: Path, source: Path, target: Path) -> tuple[np.ndarray, list[str], tuple[Any, Any]]:
    """The pairs, what is said, and both surfaces."""
    files.new_scene()
    sides = files.import_mesh(str(source)), files.import_mesh(str(target))
    meshes = read_surface(sides[0].obj, "source").mesh, read_surface(sides[1].obj, "target").mesh
    return *files.read_landmarks(path, sides, meshes), meshes


@pytest.mark.parametrize("ending", [".blend", ".glb", ".gltf", ".obj", ".ply", ".stl", ".fbx", ".usda"])
def test_points_are_those_of_the_file(ending: str, tmp_path: Path) -> None:
    source = written(tmp_path, ending)
    points = positions(make_sheet("Sheet", 15))[list(MARKED)]
    stored = turned(points) if ending in (".glb", ".gltf", ".obj") else points
    pairs, warnings, meshes = read(pairs_file(tmp_path / "pairs.txt", stored, stored), source, source)
    assert warnings == []
    for side in (0, 1):
        found = meshes[side].vertices[pairs[:, side]]
        inside = turned(points) if ending == ".obj" else points
        assert np.abs(found - inside).max() < 1e-5


@pytest.mark.parametrize("ending", [".blend", ".glb"])
@pytest.mark.parametrize("mirror", [1, -1])
def test_in_a_scene_they_may_be_places_there_or_on_the_mesh(ending: str, mirror: int, tmp_path: Path) -> None:
    def change(obj: Any) -> None:
        move(obj)
        obj.scale.x *= mirror

    source = written(tmp_path, ending, change)
    obj = make_sheet("Sheet", 15)
    change(obj)
    bpy.context.view_layer.update()
    own = positions(obj)[list(MARKED)]
    there = np.array([obj.matrix_world @ obj.data.vertices[k].co for k in MARKED])
    in_file = turned if ending == ".glb" else np.array
    expected = own * [mirror, 1, 1]
    for points, said in ((in_file(own), False), (in_file(there), True)):
        pairs, warnings, meshes = read(pairs_file(tmp_path / "pairs.txt", points, in_file(own)), source, source)
        assert np.abs(meshes[0].vertices[pairs[:, 0]] - expected).max() < 1e-5
        assert warnings == (
            ["most landmarks are on 'source' only as places in the file's scene, and are taken so"] if said else []
        )


@pytest.mark.parametrize("ending", [".blend", ".glb"])
def test_in_a_scene_that_is_not_the_targets_they_are_places_there_too(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "target").mkdir()
    target = written(tmp_path / "target", ".ply")
    own = positions(bpy.data.objects["Sheet"])[list(MARKED)]
    files.new_scene()

    def under_another(obj: Any) -> None:
        holder = bpy.data.objects.new("Holder", None)
        bpy.context.scene.collection.objects.link(holder)
        move(holder)
        obj.parent = holder
        obj.location = (1, 2, 3)

    source = written(tmp_path, ending, under_another if ending == ".blend" else move)
    obj = bpy.data.objects["Sheet"]
    there = np.array([obj.matrix_world @ obj.data.vertices[k].co for k in MARKED])
    pairs = pairs_file(tmp_path / "pairs.txt", turned(there) if ending == ".glb" else there, own)
    quick = ["--samples", "50", "--targets", "200", "--reflect", "never", "--refine", "none"]
    assert main(["align", str(source), str(target), "--landmarks", str(pairs), *quick]) == 0
    said = capsys.readouterr().err
    assert f"on '{source}' only as places in the file's scene" in said
    assert "landmarks off" not in said


def test_points_as_blender_shows_the_file_are_understood_and_said(tmp_path: Path) -> None:
    source = written(tmp_path, ".glb")
    points = positions(make_sheet("Sheet", 15))[list(MARKED)]
    pairs, warnings, meshes = read(pairs_file(tmp_path / "pairs.txt", points, turned(points)), source, source)
    assert np.abs(meshes[0].vertices[pairs[:, 0]] - points).max() < 1e-5
    assert warnings == ["most landmarks are on 'source' only as places as Blender shows the file, and are taken so"]


def test_those_off_a_surface_are_named_and_left_out(tmp_path: Path) -> None:
    source = written(tmp_path, ".ply")
    points = positions(make_sheet("Sheet", 15))[list(MARKED)]
    wrong = points.copy()
    wrong[1] += [0, 0, 0.5]
    wrong[3] += [0, 0, 3]
    near = points + np.array([0, 0, 0.02])  # as measured: a little off, in a triangle or not
    pairs, warnings, _ = read(pairs_file(tmp_path / "pairs.txt", near, wrong), source, source)
    assert pairs[:, 0].tolist() == [k for k in MARKED if k not in (50, 118)]
    [said] = warnings
    assert "landmarks off 'target' left out, by the line of" in said
    assert re.search(r": 2 \(16%\), 4 \(98%\)$", said)
    with pytest.raises(files.Unreadable, match=r"no landmark of .* is on both surfaces: give coordinates"):
        read(pairs_file(tmp_path / "pairs.txt", points * 1000, points), source, source)


def test_points_between_the_vertices_of_a_coarse_mesh_are_on_it(tmp_path: Path) -> None:
    make_sheet("Coarse", 2, lambda x, _y: 0 * x)
    files.export_mesh(bpy.context.object, tmp_path / "coarse.ply")
    points = np.array([[0.1, 0.2, 0], [-0.3, -0.4, 0]])
    pairs, warnings, _ = read(
        pairs_file(tmp_path / "pairs.txt", points, points), tmp_path / "coarse.ply", tmp_path / "coarse.ply"
    )
    assert (len(pairs), warnings) == (2, [])


def test_numbers_and_points_may_be_mixed(tmp_path: Path) -> None:
    source = written(tmp_path, ".ply")
    at = positions(make_sheet("Sheet", 15))[30]
    path = tmp_path / "pairs.txt"
    path.write_text(
        f"\ufeff# source, target\n3, 4\n\n5 6  # a remark\n{at[0]};{at[1]};{at[2]};{at[0]};{at[1]};{at[2]};\n"
    )
    assert read(path, source, source)[0].tolist() == [[3, 4], [5, 6], [30, 30]]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"1 2 3\n", "line 1: give two vertex numbers"),
        (b"# pairs\n1.5 2\n", "line 2: give two vertex numbers"),
        (b"0 0 0 nan 0 0\n", "line 1: give two"),
        (b"# nothing\n", "holds no landmarks"),
        (b"", "holds no landmarks"),
        (b"0 1\n2 3\n4 225\n", "line 3: 'target' has no vertex 225: it has 0 to 224"),
        (b"0 1\n-1 3\n", "line 2: 'source' has no vertex -1"),
        (b"1e300 3\n", "line 1: 'source' has no vertex 1"),
        (bytes(range(256)), "give two vertex numbers"),
    ],
)
def test_a_wrong_line_is_named(content: bytes, reason: str, tmp_path: Path) -> None:
    source = written(tmp_path, ".ply")
    (tmp_path / "pairs.txt").write_bytes(content)
    with pytest.raises(files.Unreadable, match=reason):
        read(tmp_path / "pairs.txt", source, source)


def test_numbers_in_a_file_whose_vertices_blender_counts_otherwise_are_doubted(tmp_path: Path) -> None:
    (tmp_path / "loose.obj").write_text("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 2 3 4\nf 2 4 5\n")
    (tmp_path / "pairs.txt").write_text("0 1\n1 2\n")
    _, warnings, _ = read(tmp_path / "pairs.txt", tmp_path / "loose.obj", written(tmp_path, ".ply"))
    [said] = warnings
    assert "may count the vertices of" in said
    assert "Blender leaves out 1 that no face" in said


def test_what_is_no_file_of_landmarks_ends_with_status_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = written(tmp_path, ".ply")
    (tmp_path / "other.ply").write_bytes(source.read_bytes())
    for path, reason in (
        (tmp_path, "is not a file"),
        (tmp_path / "gone.txt", "there is no file"),
        (Path("/dev/zero"), "is not a file"),
    ):
        if path.exists() or path.name == "gone.txt":
            assert main(["align", str(source), str(tmp_path / "other.ply"), "--landmarks", str(path)]) == 2
            assert reason in capsys.readouterr().err
