"""`collection`: tables, meshes, landmarks and a page from a folder of scans."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from commands import program, run
from scenes import bumps, make_sheet, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

QUICK = ["--samples", "50", "--targets", "200", "--refine", "mobius", "--reflect", "never"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Four scans of one sheet in one place, and a file that holds none."""
    from mobius_extension.mobius_addon import files

    scans = tmp_path / "scans"
    scans.mkdir()
    for name, n in (("a", 21), ("b", 16), ("c", 18), ("d", 24)):
        files.new_scene()
        files.export_mesh(make_sheet(name, n, bumps), scans / f"{name}.ply")
    (scans / "broken.ply").write_text("no mesh at all")
    files.new_scene()
    return tmp_path


def test_a_folder_of_scans(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    marks = folder / "a.csv"
    marks.write_text("label,x,y,z\ntip,0.25,0.25,0.1\nrim,-0.5,0.5,0\n")
    arguments = ["collection", folder / "scans", "-o", out, "--pairs", "tree", "--landmarks", marks, "--jobs", "2"]
    status, said, err = run(capsys, *arguments, *QUICK)
    assert status == 1  # one could not be read
    assert re.search("broken.*broken.ply", err)
    assert "4 specimens, 6 pairs, 6 certified, 0 suspect" in said

    names = ["a", "b", "c", "d"]
    table = list(csv.reader((out / "distances.csv").open(encoding="utf-8")))
    assert table[0] == ["", *names]
    assert np.array([row[1:] for row in table[1:]], float).max() < 0.02
    assert len(list(csv.reader((out / "pairs.csv").open(encoding="utf-8")))) == 7

    # one topology: each vertex is where the template's is, since all scans lie in one place
    meshes = []
    for name in names:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.ply_import(filepath=str(out / "meshes" / f"{name}.ply"))
        meshes.append(positions(bpy.context.scene.objects[0]))
    assert len({len(mesh) for mesh in meshes}) == 1
    for mesh in meshes:
        assert np.median(np.linalg.norm(mesh - meshes[0], axis=1)) < 0.08
    bpy.ops.wm.open_mainfile(filepath=str(out / "collection.blend"))
    assert set(bpy.data.objects["Collection"].data.shape_keys.key_blocks.keys()) == {"Mean", *names}

    # landmarks
    rows = list(csv.DictReader((out / "landmarks.csv").open(encoding="utf-8")))
    assert [row["specimen"] for row in rows] == [name for name in names for _ in range(2)]
    for row in rows:
        place = np.array([float(row[axis]) for axis in "xyz"])[:2]
        assert np.linalg.norm(place - {"tip": [0.25, 0.25], "rim": [-0.5, 0.5]}[row["landmark"]]) < 0.15
    slicer = json.loads((out / "landmarks" / "c.mrk.json").read_text())["markups"][0]["controlPoints"]
    assert [point["label"] for point in slicer] == ["tip", "rim"]
    assert (out / "landmarks.tps").read_text().startswith("LM3=2\n")
    morphologika = (out / "landmarks-morphologika.txt").read_text().splitlines()
    assert morphologika[:7] == ["[individuals]", "4", "[landmarks]", "2", "[dimensions]", "3", "[names]"]
    page = (out / "page.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "")

    # again: nothing is computed, and the results are the same
    before = {path.name: path.read_bytes() for path in (out / "pairs.jsonl", out / "distances.csv")}
    assert run(capsys, *arguments, *QUICK)[0] == 1
    assert {path.name: path.read_bytes() for path in (out / "pairs.jsonl", out / "distances.csv")} == before


def test_wrong_use(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    scan = folder / "scans" / "a.ply"
    for given, sentence in (
        ((folder / "none", "-o", out), "there is no file"),
        ((scan, scan, "-o", out), "would both be called 'a'"),
        ((folder / "scans", "-o", out, "--jobs", "0"), "--jobs must be at least 1"),
        ((folder / "scans", "-o", out, "--landmarks", folder / "none.csv"), "there is no file"),
        ((folder / "scans", "-o", out, "--samples", "1"), "samples and targets must be at least 3"),
    ):
        status, _, err = run(capsys, "collection", *given)
        assert status == 2
        assert sentence in err
    status, _, err = run(capsys, "collection", folder / "scans", "-o", out, "--template", "z", "--jobs", "1", *QUICK)
    assert status == 1
    assert "the template 'z' is none of the specimens" in err


def test_who_stops_it_is_told_that_it_goes_on(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("mobius_extension.solver.collection.collect", stopped)
    status, _, err = run(capsys, "collection", folder / "scans", "-o", folder / "out", "--jobs", "1")
    assert (status, err) == (130, "mobius: stopped, the same command goes on from here\n")


def test_the_program_spawns_processes_that_know_no_blender(folder: Path) -> None:
    (folder / "scans" / "broken.ply").unlink()
    done = program("collection", "scans", "-o", "out", "--pairs", "star", "--template", "b", *QUICK, cwd=folder)
    assert done.returncode == 0
    assert done.stderr == ""
    assert done.stdout.endswith("all on the topology of 'b'\n")
