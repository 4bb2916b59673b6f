"""What a command puts into a folder: all of it or nothing, and nothing of anyone else's is touched."""

import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import QUICK, ROOT, listing, run
from rich_scene import _material, save_picture
from scenes import make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.command_line.output_files import write_report  # noqa: E402

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def sheet_with_pictures(path: Path, *colors: tuple[float, float, float], packed: bool = False) -> Path:
    """A .blend with a sheet of as many materials, whose pictures are all called skin.png."""
    files.new_scene()
    obj = make_sheet("Sheet", 9)
    obj.data.uv_layers.new(name="UVMap")
    for number, color in enumerate(colors):
        image = save_picture(path.parent / f"in {path.stem} {number}" / "skin.png", color)
        if packed:
            image.pack()
        _material(obj, f"Material {number}", image)
    index = np.arange(len(obj.data.polygons)) % len(colors)
    obj.data.polygons.foreach_set("material_index", index.astype(np.int32))
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    if packed:
        for number in range(len(colors)):
            shutil.rmtree(path.parent / f"in {path.stem} {number}")
    return path


def colors_in(path: Path) -> set[tuple[float, ...]]:
    """The colors of the pictures that a mesh file shows."""
    files.new_scene()
    obj = files.import_mesh(str(path)).obj
    images = [
        node.image for slot in obj.material_slots for node in slot.material.node_tree.nodes if node.type == "TEX_IMAGE"
    ]
    return {tuple(round(x) for x in image.pixels[:3]) for image in images}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("ending", [".obj", ".gltf", ".glb", ".fbx", ".usda", ".usdc"])
def test_pictures_of_one_name_stay_two(
    ending: str, packed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = sheet_with_pictures(tmp_path / "sheet.blend", RED, GREEN, packed=packed)
    other = sheet_with_pictures(tmp_path / "other.blend", BLUE, packed=packed)
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "skin.png").write_text("another's")
    for name in ("one", "two"):
        status, _, err = run(capsys, "flatten", path if name == "one" else other, "-o", folder / f"{name}{ending}")
        assert status == 0, err
        assert "picture '" not in err
        assert "pictures '" not in err
    names = listing(folder)
    for _ in range(2):  # a later run over what is there
        assert run(capsys, "flatten", path, "-o", folder / f"one{ending}")[0] == 0
    assert listing(folder) == names
    assert (folder / "skin.png").read_text() == "another's"
    # the files that were read are gone: each file shows its own pictures
    for number in range(2):
        shutil.rmtree(tmp_path / f"in sheet {number}", ignore_errors=True)
        shutil.rmtree(tmp_path / f"in other {number}", ignore_errors=True)
    moved = shutil.move(folder, tmp_path / "moved")
    assert colors_in(Path(moved) / f"one{ending}") == {RED, GREEN}
    assert colors_in(Path(moved) / f"two{ending}") == {BLUE}


@pytest.mark.parametrize(("ending", "part"), [(".obj", ".mtl"), (".gltf", ".bin")])
def test_what_stands_beside_is_not_written_over(
    ending: str, part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = sheet_with_pictures(tmp_path / "sheet.blend", RED)
    bystander = tmp_path / f"out{part}"
    bystander.write_text("another's")
    for _ in range(2):
        assert run(capsys, "flatten", path, "-o", tmp_path / f"out{ending}")[0] == 0
        assert bystander.read_text() == "another's"
        assert {x.name for x in tmp_path.glob(f"out*{part}")} == {f"out{part}", f"out.001{part}"}
    assert colors_in(tmp_path / f"out{ending}") == {RED}
    # its own is replaced with it
    for _ in range(2):
        assert run(capsys, "flatten", path, "-o", tmp_path / f"own{ending}")[0] == 0
    assert {x.name for x in tmp_path.glob(f"own*{part}")} == {f"own{part}"}


def test_usd_puts_its_pictures_beside_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = sheet_with_pictures(tmp_path / "sheet.blend", RED)
    (tmp_path / "textures").mkdir()
    (tmp_path / "textures" / "mine.txt").write_text("keep")
    (tmp_path / "textures" / "skin.png").write_text("another's")
    for _ in range(2):
        assert run(capsys, "flatten", path, "-o", tmp_path / "out.usda")[0] == 0
    assert listing(tmp_path / "textures") == ["mine.txt", "skin.001.png", "skin.png"]
    assert (tmp_path / "textures" / "skin.png").read_text() == "another's"


@pytest.mark.parametrize("ending", [*files.FORMATS])
def test_endings_may_be_large(ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = sheet_with_pictures(tmp_path / "sheet.blend", RED)
    out = tmp_path / f"OUT{ending.upper()}"
    status, _, err = run(capsys, "flatten", path, "-o", out)
    assert status == 0, err
    assert out.is_file()
    assert {x.suffix for x in tmp_path.glob("OUT*")} <= {ending.upper(), ".mtl", ".bin", ".fbm"}
    assert run(capsys, "check", out)[0] == 0
    assert run(capsys, "check", f"{out}:Sheet")[0] in (0, 2)  # some files do not keep the object's name


def test_a_report_of_a_name_that_is_no_utf_8_is_json(tmp_path: Path) -> None:
    name = b"na\xefve.obj".decode(errors="surrogateescape")
    write_report(tmp_path / "report.json", {"source": name})
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8")) == {"source": name}


def test_a_name_that_is_too_long_is_refused_before_the_work(tmp_path: Path) -> None:
    with pytest.raises(files.Unreadable, match="cannot be written: File name too long"):
        files.require_place(tmp_path / ("x" * 300 + ".ply"))


def test_a_link_is_followed_and_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = sheet_with_pictures(tmp_path / "sheet.blend", RED)
    (tmp_path / "else").mkdir()
    for ending in (".ply", ".blend"):
        real, link = tmp_path / "else" / f"real{ending}", tmp_path / f"link{ending}"
        bystander = tmp_path / "else" / f"link{ending}"
        bystander.write_text("another's")
        real.write_text("old")
        real.chmod(0o640)
        link.symlink_to(Path("else") / real.name)
        assert run(capsys, "flatten", path, "-o", link)[0] == 0
        assert link.is_symlink()
        assert real.stat().st_mode & 0o777 == 0o640
        assert bystander.read_text() == "another's"
        assert run(capsys, "check", real)[0] == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "else" / "real.blend"))
    assert Path(bpy.path.abspath(bpy.data.images["skin.png"].filepath)).is_file()
    dangling = tmp_path / "dangling.stl"
    dangling.symlink_to("else/new.stl")
    assert run(capsys, "flatten", path, "-o", dangling)[0] == 0
    assert (tmp_path / "else" / "new.stl").is_file()
    (tmp_path / "circle.stl").symlink_to("circle.stl")
    status, _, err = run(capsys, "flatten", path, "-o", tmp_path / "circle.stl")
    assert (status, len(err.splitlines())) == (2, 1)


def test_what_cannot_be_replaced_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = sheet_with_pictures(tmp_path / "sheet.blend", RED)
    os.mkfifo(tmp_path / "pipe.stl")
    (tmp_path / "folder.stl").mkdir()

    def unreached(*_: Any) -> None:
        raise AssertionError("the work has begun")

    monkeypatch.setattr(files.opening, "_open_file", unreached)
    for name, reason in (("pipe.stl", "is no file that can be replaced"), ("folder.stl", "is a folder")):
        status, _, err = run(capsys, "flatten", path, "-o", tmp_path / name)
        assert (status, len(err.splitlines())) == (2, 1)
        assert reason in err
    # nobody, the administrator neither, makes files in this one
    locked = Path("/proc/self/fd") if os.geteuid() == 0 else tmp_path / "locked"
    locked.mkdir(exist_ok=True)
    locked.chmod(0o555) if os.geteuid() else None
    status, _, err = run(capsys, "flatten", path, "-o", locked / "out.stl")
    assert (status, len(err.splitlines())) == (2, 1)
    assert "nothing can be written in the folder" in err


KILLED = """
import os, signal, sys
sys.path.insert(0, {tests!r})
import conftest
from mobius_extension.mobius_addon.files import Outputs
def die(*_): os.kill(os.getpid(), signal.SIGKILL)
Outputs.publish = die
from mobius_extension.mobius_addon.command_line import main
main(sys.argv[1:])
"""


def test_a_killed_run_leaves_the_old_file_and_the_next_one_clears(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = sheet_with_pictures(tmp_path / "sheet.blend", RED)
    folder = tmp_path / "out"
    folder.mkdir()
    code = KILLED.format(tests=str(ROOT / "tests" / "addon"))
    for name in ("out.blend", "out.obj"):
        (folder / name).write_text("old")
        done = subprocess.run(
            [sys.executable, "-c", code, "flatten", str(path), "-o", str(folder / name)],
            capture_output=True, timeout=120, check=False,
        )  # fmt: skip
        assert done.returncode == -signal.SIGKILL, done.stderr
        assert (folder / name).read_text() == "old"
        assert len(list(folder.glob(".mobius-*"))) >= 1
    # one that still runs, and what is not ours, are left alone
    alive, strange, strangest = folder / ".mobius-abcdefgh", folder / ".mobius-strange_", folder / ".mobius-12345678"
    for other in (alive, strange, strangest):
        other.mkdir()
    left = next(x for x in folder.glob(".mobius-*/owner"))
    shutil.copy(left, alive / "owner")
    (strangest / "owner").write_text("me")
    with (alive / "owner").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert run(capsys, "flatten", path, "-o", folder / "out.stl")[0] == 0
    assert {x.name for x in folder.glob(".mobius-*")} == {alive.name, strange.name, strangest.name}
    assert run(capsys, "flatten", path, "-o", folder / "out.stl")[0] == 0
    assert not alive.exists()


@pytest.mark.parametrize("ending", [".blend", ".obj", ".ply", ".stl", ".glb", ".fbx", ".usdc"])
def test_a_full_disk_is_a_sentence_and_the_old_file_stays(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    path = tmp_path / "sheet.obj"
    files.new_scene()
    files.export_mesh(make_sheet("Sheet", 40), path)
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=32k", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip("a small disk can be made by the administrator only")
    try:
        out = disk / f"out{ending}"
        out.write_text("old")
        status, _, err = run(capsys, "flatten", path, "-o", out)
        assert status == 1
        assert (len(err.splitlines()), "Traceback" in err) == (1, False), err
        assert listing(disk) == [out.name]
        assert out.read_text() == "old"
    finally:
        subprocess.run(["umount", "--lazy", str(disk)], check=True)


def test_a_map_or_report_on_a_full_disk_takes_the_rest_with_it(
    scans: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = listing(scans)

    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mobius_extension.solver.save_map", full)
    status, _, err = run(
        capsys, "transfer", scans / "source.blend", scans / "target.obj", "-o", scans / "out.blend",
        "--map", scans / "m.npz", *QUICK,
    )  # fmt: skip
    assert (status, err) == (1, "mobius: nothing was written: No space left on device\n")
    assert listing(scans) == before
