"""What specimens of a collection lack, in the files that are written."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.collection import results  # noqa: E402
from mobius_extension.mobius_addon.collection.landmark_tables import (  # noqa: E402
    read_marks,
    write_csv,
    write_markups,
    write_morphologika,
    write_tps,
)
from mobius_extension.solver.collection.shapes import Marks, Shapes  # noqa: E402

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def lacking(**shares: bool) -> Shapes:
    """Squares, of which the first is the template, and some others lack a corner."""
    known = np.ones((1 + len(shares), 4), bool)
    known[1:, 3] = [not lacks for lacks in shares.values()]
    names, count = ["template", *shares], len(known)
    return Shapes(names, FACES, np.stack([SQUARE] * count), known, [False] * count, np.full(4, 0.25), [1.0] * count)


def test_meshes_say_which_vertices_are_completed(tmp_path: Path) -> None:
    common = lacking(whole=False, cut=True)
    for number, name in enumerate(common.names):
        results.write_ply(tmp_path / f"{name}.ply", SQUARE, FACES, common.known[number])
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.ply_import(filepath=str(tmp_path / f"{name}.ply"))
        mesh = bpy.context.scene.objects[0].data
        assert len(mesh.vertices) == 4
        assert [x.value for x in mesh.attributes["counterpart"].data] == [1, 1, 1, name != "cut"]
    results._write_blend(tmp_path / "all.blend", common)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "all.blend"))
    mesh = bpy.data.objects["Collection"].data
    assert [x.name for x in mesh.attributes if x.name.startswith("completed")] == ["completed cut"]
    assert [x.value for x in mesh.attributes["completed cut"].data] == [False, False, False, True]


def test_the_sentence_names_the_worst() -> None:
    assert results._lacking(lacking(a=False, b=False)) == []
    (said,) = results._lacking(lacking(a=True, b=False, c=True, d=True, e=True))
    assert said.startswith("no counterpart for a part of 'template' on '")
    assert "25%" in said
    assert "and 1 more" in said


def test_a_landmark_without_a_counterpart_is_missing(tmp_path: Path) -> None:
    places = np.stack([SQUARE[:3], SQUARE[:3] + 1])
    marks = Marks(["a", "b", "c"], ["x", "y"], places, np.array([[True] * 3, [True, False, True]]), np.zeros(3))
    write_csv(tmp_path / "all.csv", marks)
    rows = list(csv.reader((tmp_path / "all.csv").open(encoding="utf-8")))
    assert rows[4:] == [["y", "a", "1", "1", "1"], ["y", "b", "", "", ""], ["y", "c", "2", "2", "1"]]
    write_tps(tmp_path / "all.tps", marks)
    assert "LM3=3\n1 1 1\nNA NA NA\n2 2 1\nID=y" in (tmp_path / "all.tps").read_text(encoding="utf-8")
    write_morphologika(tmp_path / "all.txt", marks)
    assert "'y\n1 1 1\nNA NA NA\n2 2 1\n" in (tmp_path / "all.txt").read_text(encoding="utf-8")
    write_markups(tmp_path / "y.mrk.json", marks.labels, marks.places[1], marks.known[1])
    points = json.loads((tmp_path / "y.mrk.json").read_text(encoding="utf-8"))["markups"][0]["controlPoints"]
    assert [point["positionStatus"] for point in points] == ["defined", "missing", "defined"]
    labels, found = read_marks(tmp_path / "y.mrk.json")
    assert labels == ["a", "c"]
    np.testing.assert_allclose(found, places[1][[0, 2]])
