"""The commands: their output, exit status and files, in this process and as a program of their own."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scenes import bumps, corner_values, make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.command_line import main  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
QUICK = ["--samples", "50", "--targets", "200", "--reflect", "never", "--refine", "none"]


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """A folder with two sheets as .blend (the source carries data) and .obj, and bad ones."""
    source = make_sheet("Source", 21)
    group = source.vertex_groups.new(name="Right")
    for vertex in source.data.vertices:
        group.add((vertex.index,), (vertex.co.x + 1) / 2, "REPLACE")
    source.data.uv_layers.new(name="UVMap")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "source.blend"))
    files.export_mesh(source, tmp_path / "source.obj")
    for name, n, keep in (
        ("target", 16, None),
        ("hole", 6, lambda i, j: (i, j) != (2, 2)),
        ("parts", 7, lambda i, j: j != 2),
    ):
        files.new_scene()
        files.export_mesh(make_sheet(name.title(), n, bumps, keep), tmp_path / f"{name}.obj")
    files.new_scene()
    (tmp_path / "source.mtl").unlink(missing_ok=True)
    return tmp_path


def listing(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*"))


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    """Exit status, standard output and errors of one command."""
    capsys.readouterr()
    status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return status, out, err


# check


def test_check_prints_a_line_per_mesh(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target = scans / "source.blend", scans / "target.obj"
    status, out, err = run(capsys, "check", source, target)
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        f"{source}: disc, 441 vertices, boundary of 80 edges",
        f"{target}: disc, 256 vertices, boundary of 60 edges",
    ]


def test_check_exits_1_for_what_is_no_disc_and_2_for_what_is_unreadable(
    scans: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, err = run(capsys, "check", scans / "hole.obj", scans / "parts.obj", scans / "target.obj")
    assert (status, err) == (1, "")
    assert "hole.obj: not a disc: it has 2 boundary loops (20 and 4 edges)" in out
    assert "parts.obj: not a disc: it has 2 separate parts" in out
    assert len(out.splitlines()) == 3
    status, out, err = run(capsys, "check", scans / "gone.obj", scans / "target.obj")
    assert status == 2
    assert err == f"mobius: there is no file '{scans / 'gone.obj'}'\n"
    assert len(out.splitlines()) == 1


def test_check_prints_every_object_of_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_sheet("One", 4)
    make_sheet("Two", 5)
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    status, out, _ = run(capsys, "check", path)
    assert status == 0
    assert [line.split(": disc")[0] for line in out.splitlines()] == [f"{path}:One", f"{path}:Two"]
    assert run(capsys, "check", f"{path}:Two")[1].startswith(f"{path}:Two: disc, 25 vertices")


# flatten


def test_flatten_writes_a_mesh_with_the_disc(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, "flatten", scans / "source.blend", "-o", scans / "flat.blend")
    assert (status, err) == (0, "")
    assert "UV map 'Mobius Disc', angles off by" in out
    obj = files.import_mesh(str(scans / "flat.blend")).obj
    radius = np.hypot(*(corner_values(obj, "Mobius Disc") - 0.5).T * 2)
    assert radius.max() == pytest.approx(1, abs=1e-6)
    assert obj.data.uv_layers.keys() == ["UVMap", "Mobius Disc"]


def test_flatten_into_an_obj_writes_the_disc_as_its_uv_map(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "flatten", scans / "target.obj", "-o", scans / "flat.obj")[0] == 0
    files.new_scene()
    (layer,) = files.import_mesh(str(scans / "flat.obj")).obj.data.uv_layers
    uv = np.array([value.vector[:] for value in layer.uv])
    assert np.hypot(*(uv - 0.5).T * 2).max() == pytest.approx(1, abs=1e-5)


def test_flatten_says_what_a_format_cannot_hold(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "flatten", scans / "target.obj", "-o", scans / "flat.stl")
    assert status == 0
    assert err == "mobius: warning: .stl files cannot hold UV maps: write a .blend to keep them\n"


# align


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


# transfer


def test_transfer_carries_everything_into_a_blend(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out_file = scans / "out.blend"
    # Blender 4.2 imports a file without normals as flat, which the source is too; later ones as smooth
    smooth = any(polygon.use_smooth for polygon in files.import_mesh(str(scans / "target.obj")).obj.data.polygons)
    arguments = ["-o", out_file, "--report", scans / "r.json", "--map", scans / "m.npz", *QUICK]
    status, out, err = run(capsys, "transfer", scans / "source.blend", scans / "target.obj", *arguments)
    assert (status, err) == (0, "")
    carried = "1 vertex group, 1 UV map" + (", 1 smooth flag" if smooth else "")
    assert f"{out_file}: {carried} from {scans / 'source.blend'}" in out
    assert json.loads((scans / "r.json").read_text())["transferred"] == [
        {"kind": "vertex-groups", "source": "Right", "target": "Right"},
        *([{"kind": "smoothness", "source": "sharp_face", "target": "sharp_face"}] if smooth else []),
        {"kind": "uv", "source": "UVMap", "target": "UVMap"},
    ]
    bpy.ops.wm.open_mainfile(filepath=str(out_file))
    assert bpy.context.scene.objects.keys() == ["Target"]
    target = bpy.context.scene.objects["Target"]
    x = positions(target)[:, 0]
    assert np.median(np.abs(weights(target, "Right") - (x + 1) / 2)) < 0.05

    # the same through the map that was written: no second search, the same weights
    status, _, err = run(
        capsys, "transfer", scans / "source.blend", scans / "target.obj",
        "-o", scans / "again.blend", "--use-map", scans / "m.npz", "--only", "vertex-groups",
    )  # fmt: skip
    assert (status, err) == (0, "")
    bpy.ops.wm.open_mainfile(filepath=str(out_file))
    first = weights(bpy.data.objects["Target"], "Right")
    bpy.ops.wm.open_mainfile(filepath=str(scans / "again.blend"))
    again = bpy.data.objects["Target"]
    assert (weights(again, "Right") == first).all()
    assert len(again.data.uv_layers) == 0


def test_transfer_to_several_targets(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One that cannot be done is named and the others are done."""
    results = scans / "results"
    results.mkdir()
    second, ball = scans / "second.obj", scans / "ball.obj"
    second.write_bytes((scans / "target.obj").read_bytes())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add()
    bpy.ops.wm.obj_export(filepath=str(ball), export_materials=False)
    targets = [scans / "target.obj", ball, second]
    status, out, err = run(
        capsys, "transfer", scans / "source.blend", *targets, "-o", results, "--map", results, "--report", results,
        "--only", "vertex-groups", *QUICK,
    )  # fmt: skip
    assert status == 1
    assert err.startswith(f"mobius: {ball}: ")
    assert "closed" in err
    for name in ("target", "second"):
        assert f"{results / name}.blend: 1 vertex group from" in out
    names = {f"{name}.{kind}" for name in ("target", "second") for kind in ("blend", "npz", "json")}
    assert {x.name for x in results.iterdir()} == names
    bpy.ops.wm.open_mainfile(filepath=str(results / "second.blend"))
    obj = bpy.context.scene.objects[0]
    assert np.median(np.abs(weights(obj, "Right") - (positions(obj)[:, 0] + 1) / 2)) < 0.05


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["-o", "{}/new"], "'{}/new' is no folder, which several targets need"),
        (["-o", "{}", "--use-map", "{}/m.npz"], "--use-map is about one target"),
        (["-o", "{}", "--report", "{}/r.json"], "--report '{}/r.json' is no folder"),
    ],
)
def test_several_targets_need_folders(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], flags: list[str], said: str
) -> None:
    given = [x.format(tmp_path) for x in flags]
    status, _, err = run(capsys, "transfer", "source.obj", "a.obj", "b.obj", *given)
    assert status == 2
    assert said.format(tmp_path) in err


def test_two_targets_of_one_name_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "transfer", "source.obj", "x/a.obj", "y/a.ply", "-o", tmp_path)
    assert (status, list(tmp_path.iterdir())) == (2, [])
    assert "would both be written to" in err


def test_transfer_says_what_a_format_cannot_hold(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(
        capsys, "transfer", scans / "source.blend", scans / "target.obj", "-o", scans / "out.obj", *QUICK
    )  # fmt: skip
    assert status == 0
    assert err == "mobius: warning: .obj files cannot hold vertex groups: write a .blend to keep them\n"


def test_every_choice_of_a_transfer_is_a_flag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target = make_sheet("Source", 16), make_sheet("Target", 14)
    for obj, weight in ((source, 0.5), (target, 0.25)):
        for name in ("Head", "Head 2", "Neck"):
            obj.vertex_groups.new(name=name).add(range(len(obj.data.vertices)), weight, "REPLACE")
    right = [v.index for v in target.data.vertices if v.co.x > 0]
    target.vertex_groups.new(name="Right").add(right, 1.0, "REPLACE")
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    status, out, err = run(
        capsys, "transfer", f"{path}:Source", f"{path}:Target", "-o", tmp_path / "out.blend", "--report",
        tmp_path / "r.json", "--only", "vertex-groups", "--names", "Head*", "--mix", "add", "--mix-factor", "0.5",
        "--target-mask", "Right", "--invert-target-mask", "--unmatched", "fill", "--smallest-weight", "0.01",
        "--limit", "4", "--evaluated", *QUICK,
    )  # fmt: skip
    assert status == 0, err
    assert "2 vertex groups from" in out
    assert set(json.loads((tmp_path / "r.json").read_text())["unmatched"]) == {"vertices", "area", "outcome", "bare"}
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    obj = bpy.data.objects["Target"]
    expected = np.where(np.isin(np.arange(len(obj.data.vertices)), right), 0.25, 0.5)
    for name in ("Head", "Head 2"):
        assert weights(obj, name) == pytest.approx(expected, abs=1e-5)
    assert weights(obj, "Neck") == pytest.approx(0.25)
    status, _, err = run(
        capsys, "transfer", f"{path}:Source", f"{path}:Target", "-o", tmp_path / "both.blend",
        "--only", "vertex-groups", "--collisions", "number", "--active", "--normalize", *QUICK,
    )  # fmt: skip
    assert status == 0, err
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "both.blend"))
    assert len(bpy.data.objects["Target"].vertex_groups) == 5


def test_two_objects_of_one_blend(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_sheet("Scan", 16).vertex_groups.new(name="Head").add(range(256), 0.5, "REPLACE")
    make_sheet("Scan.001", 14)
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    status, _, err = run(
        capsys, "transfer", f"{path}:Scan", f"{path}:Scan.001", "-o", tmp_path / "out.blend", *QUICK
    )  # fmt: skip
    assert (status, err) == (0, "")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert bpy.data.objects.keys() == ["Scan.001"]
    assert np.allclose(weights(bpy.data.objects["Scan.001"], "Head"), 0.5)


# bad input: status 1 or 2, one line on stderr, nothing written


@pytest.mark.parametrize(
    ("status", "arguments", "reason"),
    [
        (1, ["align", "hole.obj", "target.obj"], "'hole.obj' has 2 boundary loops (20 and 4 edges)"),
        (1, ["align", "target.obj", "parts.obj"], "'parts.obj' has 2 separate parts"),
        (1, ["align", "target.obj", "./target.obj"], "is both source and target: give two meshes"),
        (1, ["flatten", "hole.obj", "-o", "out.obj"], "'hole.obj' has 2 boundary loops"),
        (1, ["transfer", "hole.obj", "target.obj", "-o", "out.obj"], "'hole.obj' has 2 boundary loops"),
        (1, ["transfer", "target.obj", "source.obj", "-o", "o.blend", "--only", "colors", *QUICK], "has no color attr"),
        (2, ["align", "gone.obj", "target.obj"], "there is no file 'gone.obj'"),
        (2, ["align", "target.obj", "notes.txt"], "'notes.txt' has an ending that is not known"),
        (2, ["align", "target.obj", "words.ply"], "'words.ply' could not be read"),
        (2, ["align", "source.blend:Nobody", "target.obj"], "has no mesh object named 'Nobody': it has 'Source'"),
        (2, ["align", "source.obj", "target.obj", "--report", "no/r.json"], "there is no folder 'no'"),
        (2, ["align", "source.obj", "target.obj", "--samples", "1"], "must be at least 3"),
        (2, ["align", "source.obj", "target.obj", "--map", "x", "--report", "x"], "two outputs have the same name"),
        (2, ["flatten", "target.obj", "-o", "out.xyz"], "'out.xyz' has an ending that is not known"),
        (2, ["flatten", "target.obj", "-o", "folder"], "'folder' has an ending that is not known"),
        (2, ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--only", "hats"], "--only does not know 'hats'"),
        (2, ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--mix-factor", "2"], "the mix factor lies from 0"),
        (2, ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--limit", "-1"], "the limit of groups per vertex"),
        (
            2,
            ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--invert-source-mask"],
            "--invert-source-mask inverts --source-mask: give both",
        ),
        (
            1,
            ["transfer", "source.blend", "target.obj", "-o", "o.blend", "--source-mask", "Hat", *QUICK],
            "has no vertex group and no attribute of single numbers named 'Hat' for its mask",
        ),
        (
            2,
            ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--use-map", "no.npz"],
            "there is no file 'no.npz'",
        ),
        (2, ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--use-map", "notes.txt"], "is not a map that"),
        (2, ["align", "source.obj"], "the following arguments are required: TARGET"),
        (2, ["dance"], "invalid choice: 'dance'"),
        (2, [], "the following arguments are required: COMMAND"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_bad_input_is_a_sentence_and_writes_nothing(
    status: int,
    arguments: list[str],
    reason: str,
    scans: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(scans)
    (scans / "notes.txt").write_text("a note")
    (scans / "words.ply").write_text("only words")
    (scans / "folder").mkdir()
    before = listing(scans)
    found, out, err = run(capsys, *arguments)
    assert found == status
    assert reason in err
    assert len(err.splitlines()) == 1 or err.startswith("usage:")
    assert "Traceback" not in err
    assert listing(scans) == before
    assert "certified" not in out or status == 1


def test_a_map_of_other_meshes_is_refused(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target, map_file = scans / "source.obj", scans / "target.obj", scans / "m.npz"
    assert run(capsys, "align", source, target, "--map", map_file, *QUICK)[0] == 0
    common = ["-o", scans / "o.blend", "--use-map", map_file]
    status, _, err = run(capsys, "transfer", target, source, *common)
    assert (status, err) == (2, f"mobius: '{map_file}' was made for another source than '{target}'\n")
    status, _, err = run(capsys, "transfer", source, scans / "hole.obj", *common)
    assert status == 2
    assert f"was made for a target of 256 vertices, but '{scans / 'hole.obj'}' has 36" in err
    assert not (scans / "o.blend").exists()


def test_help_needs_no_mesh(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "--help")
    assert status == 0
    assert all(name in out for name in ("demo", "check", "flatten", "align", "transfer"))


def test_what_the_commands_read_is_what_the_window_reads(scans: Path) -> None:
    found = read_surface(files.import_mesh(str(scans / "source.obj")).obj).mesh
    stored = read_surface(files.import_mesh(str(scans / "source.blend")).obj).mesh
    assert (found.faces == stored.faces).all()


# as a program


def program(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT), *map(str, arguments)],
        cwd=cwd, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def test_the_program_says_its_result_and_nothing_else(scans: Path) -> None:
    done = program("check", "source.blend", "hole.obj", cwd=scans)
    assert done.returncode == 1
    assert done.stderr == ""
    assert done.stdout.splitlines() == [
        "source.blend: disc, 441 vertices, boundary of 80 edges",
        "hole.obj: not a disc: it has 2 boundary loops (20 and 4 edges): fill all but the outer one",
    ]


def test_the_program_refuses_with_one_line(scans: Path) -> None:
    before = listing(scans)
    done = program("align", "gone.obj", "target.obj", "--map", "m.npz", cwd=scans)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "mobius: there is no file 'gone.obj'\n"
    assert listing(scans) == before


def test_without_blenders_module_there_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "bpy.py").write_text("raise ModuleNotFoundError(\"No module named 'bpy'\", name='bpy')\n")
    code = f"import sys, runpy; sys.path.insert(0, {str(tmp_path)!r}); sys.argv = ['.', 'check', 'x.obj']; "
    code += f"runpy.run_path({str(ROOT / '__main__.py')!r}, run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("mobius: the Python package 'bpy' is missing or not for this Python")
    assert "Traceback" not in done.stderr
