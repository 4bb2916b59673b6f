"""The demo: its scans, its ground truth, its files, and an error that no wrong alignment reaches."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import weights
from scipy.spatial import cKDTree

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension import solver  # noqa: E402
from mobius_extension.mobius_addon import demo, stored_alignment  # noqa: E402
from mobius_extension.mobius_addon.command_line import main  # noqa: E402
from mobius_extension.mobius_addon.demo import accuracy, paint, pictures, scans  # noqa: E402
from mobius_extension.mobius_addon.demo.paint import FACE_PAINT, GRID_UV, SMILE, face_paint, front_view  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import Refusal, foreach, read_surface  # noqa: E402
from mobius_extension.mobius_addon.studio import scene as studio  # noqa: E402

FILES = ["REPORT.json", "correspondence.png", "demo.blend", "discs.png"]

Built = tuple[Any, Any, Any]


@pytest.fixture
def built(empty_scene: Any) -> Built:
    """The painted source, the bare target and the truth between them."""
    return demo.build_objects(empty_scene)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory, registered: None) -> Iterator[Path]:
    """The folder that a whole run leaves, with smaller pictures than usual."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(studio, "PIXELS_ACROSS", 280)
        folder = tmp_path_factory.mktemp("demo") / "new" / "folder"
        assert main(["demo", "-o", str(folder)]) == 0
        yield folder


def load(folder: Path) -> tuple[Any, Any]:
    """The two objects of the demo's .blend."""
    with bpy.data.libraries.load(str(folder / "demo.blend")) as (stored, wanted):
        assert sorted(stored.objects) == ["Source scan", "Target scan"]
        wanted.objects = ["Source scan", "Target scan"]
    source, target = wanted.objects
    for obj in (source, target):
        bpy.context.scene.collection.objects.link(obj)
    return source, target


def pixels(path: Path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], -1)[..., :3]


def test_both_scans_are_discs_of_different_triangulations(built: Built) -> None:
    source, target, truth = built
    for obj in (source, target):
        mesh = read_surface(obj).mesh
        found = solver.topology(mesh)
        assert found.is_disc, found.describe()
        assert not len(found.unused_vertices)
        assert 5_000 < len(mesh.vertices) < 10_000
        assert solver.flatten(mesh).distortion.flips == 0
    rest = truth.positions(read_surface(source).mesh.vertices)
    apart = cKDTree(read_surface(source).mesh.vertices).query(rest)[0]
    assert (apart < 1e-4).mean() < 0.01  # hardly any vertex in common


def test_the_truth_is_exact_and_covers_the_target(built: Built) -> None:
    source, target, truth = built
    surfaces = read_surface(source), read_surface(target)
    assert (truth.triangles == surfaces[0].mesh.faces).all()
    assert truth.barycentric.min() >= 0
    np.testing.assert_allclose(truth.barycentric.sum(axis=1), 1)
    rest = truth.positions(surfaces[0].mesh.vertices)
    np.testing.assert_allclose(scans.POSE(scans.deform(rest)), surfaces[1].mesh.vertices, atol=1e-5)
    # the target at rest is the source's surface and no other: hardly any of its faces turned over in the laying
    at_rest = solver.TriangleMesh(rest, surfaces[1].mesh.faces)
    here, there = at_rest.face_vectors, surfaces[0].mesh.face_vectors[truth.face[at_rest.faces[:, 0]]]
    assert ((here * there).sum(axis=1) > 0).mean() > 0.99
    assert abs(at_rest.area / surfaces[0].mesh.area - 1) < 0.03


def test_the_exact_map_has_no_error_and_no_rigid_pose_comes_near(built: Built) -> None:
    source, target, truth = built
    surfaces = read_surface(source), read_surface(target)
    n = len(truth.face)
    exact = solver.Correspondence(
        face=truth.face,
        barycentric=truth.barycentric,
        matched=np.ones(n, bool),
        confidence=np.ones(n),
        source_triangles=truth.triangles,
        source_size=len(surfaces[0].mesh.vertices),
    )
    assert accuracy.transfer_error(exact, *surfaces).most < 1e-4
    rigid = accuracy.best_rigid_error(truth, *surfaces)
    assert rigid.mean > 1.5
    assert rigid.most > 4


def test_a_bend_keeps_lengths_on_its_neutral_sheet_and_moves_the_rest_rigidly() -> None:
    bend = scans.Bend(along=0, towards=2, start=1.0, end=2.0, angle=0.7, neutral=0.5)
    line = np.column_stack([np.linspace(0, 4, 4001), np.zeros(4001), np.full(4001, 0.5)])
    steps = np.linalg.norm(np.diff(bend(line), axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.001, rtol=1e-5)
    np.testing.assert_allclose(bend(line[:1001]), line[:1001], atol=1e-12)
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    beyond = points + np.array([3.5, 0, 0])
    before, after = (x[:, None] - x for x in (beyond, bend(beyond)))
    np.testing.assert_allclose(np.linalg.norm(before, axis=2), np.linalg.norm(after, axis=2), atol=1e-12)


def test_a_run_leaves_its_files_and_nothing_else(finished: Path) -> None:
    assert sorted(path.name for path in finished.iterdir()) == FILES
    for name, aspect in (("correspondence.png", 3), ("discs.png", 1.9)):
        picture = pixels(finished / name)
        height, width = picture.shape[:2]
        assert width == 280
        assert width / height == pytest.approx(aspect, rel=0.1)
        # paint, ink and paper: full hues, dark and light
        assert np.ptp(picture, axis=2).max() > 0.5
        assert picture.min() < 0.25
        assert picture.max() > 0.85


def test_the_error_is_one_that_no_wrong_alignment_reaches(finished: Path, built: Built) -> None:
    report = json.loads((finished / "REPORT.json").read_text(encoding="utf-8"))
    error = report["ground_truth"]["error_percent"]
    assert error["mean"] < 1.8
    assert error["percentile_95"] < 4
    assert error["mean"] < report["ground_truth"]["best_rigid_error_percent"]["mean"]
    assert report["certified"]
    assert report["value"] == pytest.approx(report["upper_bound"])
    # the same measure on other maps: turned a little, moved a little, mirrored
    surfaces = tuple(read_surface(obj) for obj in built[:2])
    settings = replace(demo.SETTINGS, samples=12, targets=80, refine="none")
    alignment = solver.align(surfaces[0].mesh, surfaces[1].mesh, settings)
    right = solver.Mobius(complex(*report["mobius"]["z"]), report["mobius"]["theta"])
    wrong = (
        solver.Mobius(0.0, 0.3) @ right,
        solver.Mobius(0.15, 0.0) @ right,
        solver.Mobius(right.z, right.theta, reflected=True),
    )
    for mobius in wrong:
        found = accuracy.transfer_error(solver.correspond(replace(alignment, mobius=mobius)), *surfaces)
        assert found.mean > 3


def test_the_blend_holds_the_two_scans_and_what_was_carried(finished: Path, built: Built) -> None:
    truth = built[2]
    source, target = load(finished)
    rest = truth.positions(read_surface(source).mesh.vertices)
    assert GRID_UV in target.data.uv_layers
    carried = foreach(target.data.color_attributes[FACE_PAINT].data, "color", 4, np.float32)[:, :3]
    missed = np.abs(carried - face_paint(rest)).max(axis=1)
    assert np.median(missed) < 0.01
    assert missed.mean() < 0.08
    corner_vertex = foreach(target.data.loops, "vertex_index", 1, np.int32)
    uv = foreach(target.data.uv_layers[GRID_UV].uv, "vector", 2, np.float32)
    assert np.linalg.norm(uv - front_view(rest)[corner_vertex], axis=1).mean() < 0.02
    for group in ("Jaw", "Brow.L", "Brow.R", "Ear.L", "Ear.R"):
        true = paint.weights(rest)[group]
        assert np.abs(weights(target, group) - true).mean() < 0.02
        assert true.max() == pytest.approx(1, abs=0.01)
    for obj in (source, target):
        (material,) = obj.data.materials
        assert {node.layer_name for node in material.node_tree.nodes if node.type == "VERTEX_COLOR"} == {FACE_PAINT}
    assert source.data.shape_keys.key_blocks[SMILE].value == 0
    kept = target.data.mobius_alignment
    assert (kept.source, kept.source_name) == (None, "Source scan")
    assert stored_alignment.exists(target, source)
    assert kept.target_fingerprint == read_surface(target).rest.fingerprint


def test_pictures_leave_no_data_behind(built: Built, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(studio, "PIXELS_ACROSS", 64)
    scene, kept = bpy.context.scene, [sorted(x.name for x in blocks) for blocks in studio.made_here()]
    render_one(built[0], tmp_path / "head.png")
    assert [sorted(x.name for x in blocks) for blocks in studio.made_here()] == kept
    assert list(bpy.data.scenes) == [scene]
    assert bpy.context.scene == scene


def render_one(obj: Any, path: Path) -> None:
    material = pictures.clay_material()
    pictures.render_heads([pictures.Sitter(obj.data, material, scans.POSE.rotation, "head")], path)
    bpy.data.materials.remove(material)


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_a_folder_that_cannot_be_is_one_sentence(
    place: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("kept", encoding="utf-8")
    assert main(["demo", "-o", str(tmp_path / place)]) == 2
    message = capsys.readouterr().err
    assert message.startswith(f"mobius: nothing can be written in the folder '{tmp_path / place}'")
    assert len(message.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_failure_on_the_way_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise Refusal("the pictures failed")

    monkeypatch.setattr(demo, "SETTINGS", replace(demo.SETTINGS, samples=12, targets=80, refine="none"))
    monkeypatch.setattr(studio, "PIXELS_ACROSS", 64)
    monkeypatch.setattr(demo, "render_discs", refuse)
    old = tmp_path / "old"
    old.mkdir()
    (old / "discs.png").write_bytes(b"mine")
    for folder in (tmp_path / "new" / "folder", old):
        assert main(["demo", "-o", str(folder)]) == 1
        assert capsys.readouterr().err.endswith("mobius: the pictures failed\n")
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert [path.name for path in old.iterdir()] == ["discs.png"]
    assert (old / "discs.png").read_bytes() == b"mine"
