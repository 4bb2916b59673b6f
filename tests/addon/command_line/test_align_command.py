"""`align`: its map, its report and what it says."""

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from commands import QUICK, listing, run


def test_align_writes_map_and_report(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    map_file, report_file = scans / "map.npz", scans / "report.json"
    arguments = ["--map", map_file, "--report", report_file, *QUICK]
    status, out, err = run(capsys, "align", scans / "source.obj", scans / "target.obj", *arguments)
    assert (status, err) == (0, "")
    assert "certified: no Möbius map with |z| <= 0.83 matches more" in out
    report = json.loads(report_file.read_text())
    assert report["certified"] is True
    assert report["upper_bound"] == pytest.approx(report["value"])
    assert set(report["distortion"]) == {"source", "target"}
    with np.load(map_file) as stored:
        arrays = dict(stored)
    assert arrays["face"].shape == (256,)
    assert arrays["barycentric"].shape == (256, 3)
    assert arrays["source_disc"].shape == (441,)
    assert arrays["target_disc"].dtype == np.complex128
    # the triangles index the file's own vertices: read them without Blender and compare the places
    lines = (scans / "source.obj").read_text().splitlines()
    vertices = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
    there = np.einsum("qk,qkd->qd", arrays["barycentric"], vertices[arrays["source_triangles"][arrays["face"]]])
    lines = (scans / "target.obj").read_text().splitlines()
    own = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
    assert np.median(np.linalg.norm(there - own, axis=1)) < 0.05


def test_align_without_outputs_says_what_it_found(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = listing(scans)
    status, out, _ = run(capsys, "align", scans / "source.obj", scans / "target.obj", *QUICK)
    assert status == 0
    assert "matched value" in out
    assert "search " in out  # the time of each stage
    assert listing(scans) == before


def test_a_vertex_group_names_the_piece_that_is_matched(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report_file = scans / "report.json"
    pair = scans / "source.blend", scans / "target.obj"
    status, _, err = run(capsys, "align", *pair, "--source-cut", "Right", "--report", report_file, *QUICK)
    assert status == 0
    assert "cut to a piece of 5" in err
    assert "of its area, as asked; the rest has no counterpart" in err
    assert 0.45 < json.loads(report_file.read_text())["cut_to"]["source"] < 0.55
    status, _, err = run(capsys, "align", *pair, "--source-cut", "Left", *QUICK)
    assert status == 1
    assert "has no vertex group and no attribute of single numbers named 'Left'" in err


def test_marked_seams_say_where_a_mesh_is_cut_open(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(scans / "source.blend"))
    mesh = next(obj for obj in bpy.data.objects if obj.type == "MESH").data
    middle = {v.index for v in mesh.vertices if abs(v.co.x) < 1e-4}
    along = [edge for edge in mesh.edges if set(edge.vertices) <= middle]
    for edge in along:
        edge.use_seam = True
    bpy.ops.wm.save_as_mainfile(filepath=str(scans / "sewn.blend"))
    report_file = scans / "report.json"
    pair = scans / "sewn.blend", scans / "target.obj"
    status, _, err = run(capsys, "align", *pair, "--source-cut", "seams", "--report", report_file, *QUICK)
    assert status == 0
    assert f"cut open along {len(along)} edges, as asked, to a piece of " in err
    assert 0.45 < json.loads(report_file.read_text())["cut_to"]["source"] < 0.55
    status, _, err = run(capsys, "align", *pair, "--target-cut", "seams", *QUICK)
    assert status == 1
    assert "has no edge marked as a seam: mark some in Edit Mode (Edge > Mark Seam)" in err
