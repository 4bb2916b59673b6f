"""Landmarks: where they come from in a scene, and that they decide."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import QUICK, everything, make_sheet, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import landmarks  # noqa: E402
from mobius_extension.mobius_addon.command_line import main  # noqa: E402
from mobius_extension.mobius_addon.files import export_mesh  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402


def even(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A surface that looks the same after half a turn."""
    return 0.4 * np.exp(-8 * ((x - 0.4) ** 2 + (y - 0.2) ** 2)) + 0.4 * np.exp(-8 * ((x + 0.4) ** 2 + (y + 0.2) ** 2))


@pytest.fixture
def pair() -> tuple[Any, Any]:
    source, target = make_sheet("Source", 21, even), make_sheet("Target", 16, even)
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = source, target
    target.location, target.rotation_euler, target.scale = (3, 1, 2), (0.3, 0.2, 1), (2, 2, 2)
    bpy.context.view_layer.update()
    return source, target


POINTS = np.array([[0.4, 0.2], [-0.5, 0.5], [0.6, -0.6], [0, -0.5], [-0.4, -0.2]])


def mark(obj: Any, name: str, point: np.ndarray, by: str) -> int:
    """Put a landmark at the vertex nearest to a point of the plane, and return that vertex."""
    at = positions(obj)
    vertex = int(np.linalg.norm(at[:, :2] - point, axis=1).argmin())
    if by == "groups":
        obj.vertex_groups.new(name=name).add((vertex,), 1.0, "REPLACE")
    else:
        empty = bpy.data.objects.new(name, None)
        bpy.context.scene.collection.objects.link(empty)
        empty.parent = obj
        empty.location = at[vertex] + [0.001, 0, 0]
        bpy.context.view_layer.update()
    return vertex


def mean_x(target: Any, source: Any) -> float:
    """Mean product of where target vertices are and where they go: 1/3 for the identity, -1/3 for the half turn."""
    shared = [
        np.array([value.vector[:] for value in obj.data.uv_layers["Mobius"].uv])[
            np.unique([loop.vertex_index for loop in obj.data.loops], return_index=True)[1]
        ]
        for obj in (source, target)
    ]
    nearest = np.linalg.norm(shared[1][:, None] - shared[0][None], axis=2).argmin(axis=1)
    return float((positions(source)[nearest, 0] * positions(target)[:, 0]).mean())


@pytest.mark.parametrize("by", ["empties", "groups"])
@pytest.mark.parametrize("half_turn", [False, True])
def test_they_decide_what_the_surface_leaves_open(pair: tuple[Any, Any], by: str, half_turn: bool) -> None:
    source, target = pair
    for number, point in enumerate(POINTS):
        mark(source, f"mark {number}", point, by)
        mark(target, f"mark {number}", -point if half_turn else point, by)
    assert bpy.ops.mobius.align(**QUICK, landmarks=by) == {"FINISHED"}
    product = mean_x(target, source)
    assert product < -0.2 if half_turn else product > 0.2


@pytest.mark.parametrize("scale", [2, -2])
@pytest.mark.parametrize("by", ["empties", "groups"])
def test_pairs_are_those_of_equal_names(pair: tuple[Any, Any], by: str, scale: float) -> None:
    source, target = pair
    target.scale.x = scale
    bpy.context.view_layer.update()
    expected = []
    for number, point in enumerate(POINTS):
        vertices = [mark(obj, f"mark {number}", point, by) for obj in pair]
        expected.append(vertices)
    mark(source, "alone", POINTS[0], by)
    source.vertex_groups.new(name="wide").add((1, 2, 3), 1.0, "REPLACE")
    target.vertex_groups.new(name="wide").add((1, 2, 3), 1.0, "REPLACE")
    meshes = read_surface(source).mesh, read_surface(target).mesh
    assert landmarks.from_scene(source, target, meshes, by).tolist() == expected
    assert len(landmarks.from_scene(source, target, meshes, "none")) == 0


def test_without_any_it_is_refused_and_nothing_changes(pair: tuple[Any, Any]) -> None:
    before = [everything(obj) for obj in pair]
    with pytest.raises(RuntimeError, match="have no empties parented to them with equal names"):
        bpy.ops.mobius.align(**QUICK, landmarks="empties")
    assert [everything(obj) for obj in pair] == before


def test_on_the_command_line(pair: tuple[Any, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    quick = ["--samples", "12", "--targets", "80", "--reflect", "never", "--refine", "none"]
    rows = [
        [
            int(np.linalg.norm(positions(obj)[:, :2] - sign * point, axis=1).argmin())
            for obj, sign in zip(pair, (1, -1), strict=True)
        ]
        for point in POINTS
    ]
    files = [tmp_path / "source.obj", tmp_path / "target.obj"]
    for obj, path in zip(pair, files, strict=True):
        export_mesh(obj, path)
    (tmp_path / "pairs.txt").write_text("".join(f"{a} {b}\n" for a, b in rows))
    maps = []
    for extra in (["--landmarks", tmp_path / "pairs.txt"], ["--take-rival", "--landmarks", tmp_path / "pairs.txt"]):
        arguments = ["align", *files, *quick, *extra, "--map", tmp_path / "map.npz"]
        assert main([str(argument) for argument in arguments]) == 0
        with np.load(tmp_path / "map.npz") as stored:
            maps.append(complex(stored["z"]) + 1j * stored["theta"])
    assert maps[0] != maps[1]
    gone = ["align", *files, *quick, "--landmarks", tmp_path / "gone.txt"]
    assert main([str(argument) for argument in gone]) == 2
    assert "there is no file" in capsys.readouterr().err
