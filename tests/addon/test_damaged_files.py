"""Files that are cut short, damaged, or no files: a sentence each, and no importer is asked for more than there is."""

import json
import os
import random
import re
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.files.headers import require_sound  # noqa: E402

WRITTEN = {
    "text.ply": lambda path: bpy.ops.wm.ply_export(filepath=path, ascii_format=True, export_selected_objects=True),
    "text.stl": lambda path: bpy.ops.wm.stl_export(filepath=path, ascii_format=True, export_selected_objects=True),
    "packed.blend": lambda path: bpy.ops.wm.save_as_mainfile(filepath=path, compress=True, copy=True),
}
MAY_END_BLENDER = re.compile(r"\.usd|\.blend")
"""Files of which Blender's own readers follow pointers and offsets without looking, and now and then crash."""
ROOT = Path(__file__).resolve().parents[2]
KINDS = [f"sheet{ending}" for ending in files.FORMATS] + [*WRITTEN, "sheet.off", "text.vtk", "binary.vtk", "sheet.gii"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A sheet in every kind of file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    folder = tmp_path_factory.mktemp("whole")
    obj = make_sheet("Sheet", 7)
    obj.data.uv_layers.new(name="UVMap")
    for name in KINDS:
        path = folder / name
        if name in WRITTEN:
            WRITTEN[name](str(path))
        elif path.suffix in files.FORMATS and path.suffix != ".blend":
            files.export_mesh(obj, path)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "sheet.blend"), compress=False, copy=True)
    points = np.array([vertex.co[:] for vertex in obj.data.vertices])
    quads = np.array([polygon.vertices[:] for polygon in obj.data.polygons])
    write_off(folder / "sheet.off", points, quads)
    write_vtk(folder / "text.vtk", points, quads, binary=False)
    write_vtk(folder / "binary.vtk", points, quads, binary=True)
    write_gifti(folder / "sheet.gii", points, quads)
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def write_off(path: Path, points: np.ndarray, quads: np.ndarray) -> None:
    lines = ["OFF", f"{len(points)} {len(quads)} 0"]
    lines += [" ".join(map(str, point)) for point in points] + [f"4 {' '.join(map(str, quad))}" for quad in quads]
    path.write_text("\n".join(lines) + "\n")


def write_vtk(path: Path, points: np.ndarray, quads: np.ndarray, *, binary: bool) -> None:
    sized = np.c_[np.full(len(quads), 4), quads]

    def block(values: np.ndarray, form: str) -> bytes:
        return values.astype(form).tobytes() if binary else " ".join(map(str, values.ravel())).encode()

    path.write_bytes(
        b"# vtk DataFile Version 3.0\nsheet\n" + (b"BINARY" if binary else b"ASCII") + b"\nDATASET POLYDATA\n"
        b"POINTS %d double\n%b\n"
        % (len(points), block(points, ">f8"))
        + b"POLYGONS %d %d\n%b\n" % (len(quads), sized.size, block(sized, ">i4"))
    )


def write_gifti(path: Path, points: np.ndarray, quads: np.ndarray) -> None:
    nibabel = pytest.importorskip("nibabel", reason="nibabel, which reads .gii, is not installed")
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    arrays = [
        nibabel.gifti.GiftiDataArray(values, intent=f"NIFTI_INTENT_{intent}")
        for values, intent in ((points.astype(np.float32), "POINTSET"), (triangles.astype(np.int32), "TRIANGLE"))
    ]
    nibabel.save(nibabel.gifti.GiftiImage(darrays=arrays), str(path))


def damaged(folder: Path, name: str, content: bytes, whole: dict[str, bytes]) -> Path:
    """Write one file, with what belongs beside it, into a folder."""
    folder.mkdir(exist_ok=True)
    for beside in ("sheet.bin", "sheet.mtl"):
        (folder / beside).write_bytes(whole.get(beside, b""))
    (folder / name).write_bytes(content)
    return folder / name


def outcome(path: Path) -> str:
    """Read a file; return its error, '' if it is read after all. Nothing but `Unreadable` may be raised.

    Both ways: into a scene, and with what else is in it.
    """
    files.new_scene()
    said = ""
    try:
        files.import_mesh(str(path))
        with files.opened(str(path), write=False):
            pass
    except files.Unreadable as error:
        said = str(error)
    assert said == "" or str(path) in said
    assert "\n" not in said
    assert "Traceback" not in said
    return said


@pytest.mark.parametrize("name", KINDS)
def test_the_whole_file_is_read(name: str, whole: dict[str, bytes], tmp_path: Path) -> None:
    assert outcome(damaged(tmp_path, name, whole[name], whole)) == ""


@pytest.mark.parametrize("name", KINDS)
def test_a_file_cut_short_is_a_sentence(name: str, whole: dict[str, bytes], tmp_path: Path) -> None:
    content = whole[name]
    for share in (0, 0.02, 0.3, 0.5, 0.9, 0.98):
        length = max(1, int(share * len(content)))
        said = outcome(damaged(tmp_path, name, content[:length], whole))
        if name == "sheet.obj":  # does not say how long it is
            assert said == "" or "holds no mesh" in said
        else:
            assert said, f"{length} of {len(content)} bytes were read"


def with_damage(content: bytes, chance: random.Random) -> bytes:
    """Turn a few bits of a file over, half of them near its beginning."""
    turned = bytearray(content)
    for _ in range(chance.choice((1, 3))):
        turned[chance.randrange(min(len(turned), 500))] ^= 1 << chance.randrange(8)
        turned[chance.randrange(len(turned))] ^= 1 << chance.randrange(8)
    return bytes(turned)


@pytest.mark.parametrize("name", [name for name in KINDS if not MAY_END_BLENDER.search(name)])
def test_damage_anywhere_is_a_sentence_or_another_shape(name: str, whole: dict[str, bytes], tmp_path: Path) -> None:
    chance = random.Random(name)
    for _ in range(12):
        outcome(damaged(tmp_path, name, with_damage(whole[name], chance), whole))


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a run has no process of its own")
@pytest.mark.parametrize("name", [name for name in KINDS if MAY_END_BLENDER.search(name)])
def test_where_damage_may_end_blender_the_program_says_so(name: str, whole: dict[str, bytes], tmp_path: Path) -> None:
    chance = random.Random(name)
    for _ in range(2):
        damaged(tmp_path, name, with_damage(whole[name], chance), whole)
        done = subprocess.run(
            [sys.executable, str(ROOT), "check", name], cwd=tmp_path, capture_output=True, text=True, timeout=120
        )  # fmt: skip
        assert done.returncode in (0, 1, 2), done.stderr
        assert "Traceback" not in done.stderr
        assert done.returncode == 0 or name in done.stdout + done.stderr


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("content", [bytes(5000), b"these are only words\n" * 9, random.Random(1).randbytes(5000)])
def test_what_is_no_mesh_is_a_sentence(name: str, content: bytes, whole: dict[str, bytes], tmp_path: Path) -> None:
    assert outcome(damaged(tmp_path, name, content, whole))


def replaced(old: bytes, new: bytes) -> Callable[[bytes], bytes]:
    return lambda content: content.replace(old, new, 1)


def patched(place: int, form: str, value: int) -> Callable[[bytes], bytes]:
    return lambda content: content[:place] + struct.pack(form, value) + content[place + struct.calcsize(form) :]


def without_bytes(content: bytes) -> bytes:
    """Let the first accessor of a .gltf be of zeros, as many as no machine has room for."""
    description = json.loads(content)
    del description["accessors"][0]["bufferView"]
    description["accessors"][0]["count"] = 10**12
    return json.dumps(description).encode()


def longer_array(content: bytes) -> bytes:
    """Let an FBX file's packed array of doubles say that it is a thousand million long."""
    place = content.index(b"d", content.index(b"Vertices"))
    return patched(place + 1, "<I", 10**9)(content)


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        ("sheet.ply", replaced(b"element vertex ", b"element vertex 9999999"), "its header asks for 9,999,999"),
        ("text.ply", replaced(b"element face ", b"element face 1000000000000"), "its header asks for"),
        ("sheet.ply", replaced(b"element vertex ", b"element vertex -"), "its header says 'element vertex -"),
        ("sheet.ply", replaced(b"element vertex ", b"element vertex\xa0"), "which PLY does not know"),
        ("sheet.ply", replaced(b"vertex_indices", b"vertex_indikes"), "its faces have no list of vertices"),
        (
            "sheet.ply",
            replaced(b"property float x", b"property flaot x"),
            "'property flaot x', which PLY does not know",
        ),
        ("sheet.ply", lambda content: content[:-4] + b"\xff\xff\xff\x00", "it joins vertex 16,777,215"),
        ("text.ply", lambda content: content.rstrip() + b"9999\n", "it joins vertex"),
        ("sheet.stl", patched(80, "<I", 4_000_000_000), "its header asks for 4,000,000,000 triangles"),
        ("sheet.stl", lambda content: content + bytes(7), "but it is 3,691 long"),
        ("text.stl", replaced(b"endsolid", b"end"), "does not end with 'endsolid'"),
        ("sheet.off", replaced(b"49 36 0", b"4900000000 36 0"), "its header asks for 4,900,000,000 points"),
        ("sheet.off", replaced(b"4 0 1 8 7", b"4 0 1 8 99"), "a polygon has vertex 99, but there are 49"),
        ("binary.vtk", replaced(b"POINTS 49", b"POINTS 4999999999"), "its header asks for 14,999,999,997 numbers"),
        ("text.vtk", replaced(b"POINTS 49", b"POINTS 4999999999"), "its header asks for 14,999,999,997 numbers"),
        ("binary.vtk", replaced(b"POLYGONS 36 180", b"POLYGONS 36 -180"), "its header asks for -180 numbers"),
        ("sheet.glb", patched(8, "<I", 4_000_000_000), "which takes 4,000,000,000 bytes"),
        ("sheet.gltf", replaced(b'"count":', b'"count":9'), "it asks for 9"),
        ("sheet.gltf", replaced(b'"byteLength":', b'"byteLength":9'), "a part of a buffer goes on"),
        ("sheet.gltf", replaced(b"sheet.bin", b"gone.bin"), "needs 'gone.bin' beside it, which is not there"),
        ("sheet.gltf", without_bytes, "asks for 1,000,000,000,000 values and holds no bytes of them"),
        ("sheet.fbx", patched(27, "<I", 4_000_000_000), "a record at byte 27 goes on, which takes 4,000,000,000"),
        ("sheet.fbx", longer_array, "it asks for 1,000,000,000 values"),
        ("sheet.usdc", patched(16, "<q", 1 << 40), "its table of contents is at byte 1,099,511,627,776"),
    ],
    ids=lambda value: value if isinstance(value, str) and "." in value[-5:] else "",
)
def test_a_header_that_asks_for_too_much_is_refused_unread(
    name: str, change: Callable[[bytes], bytes], reason: str, whole: dict[str, bytes], tmp_path: Path
) -> None:
    content = change(whole[name])
    assert content != whole[name]
    path = damaged(tmp_path, name, content, whole)
    if not name.endswith((".off", ".vtk")):  # these are read here, not by Blender
        with pytest.raises(files.Unreadable, match=reason):
            require_sound(path)
    with pytest.raises(files.Unreadable, match=reason):
        files.import_mesh(str(path))


def test_an_old_blend_in_gzip_is_followed_to_its_end(whole: dict[str, bytes], tmp_path: Path) -> None:
    import gzip

    packed = gzip.compress(whole["sheet.blend"])
    require_sound(damaged(tmp_path, "old.blend", packed, whole))
    for content in (packed[:-2000], gzip.compress(whole["sheet.blend"][:-2000])):
        with pytest.raises(files.Unreadable, match="is cut short"):
            require_sound(damaged(tmp_path, "old.blend", content, whole))


@pytest.mark.parametrize("compressed", [False, True], ids=["plain", "draco"])
def test_a_glb_with_changes_of_shape_is_sound(compressed: bool, tmp_path: Path) -> None:
    obj = make_sheet("Sheet", 7)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Up").points[3].co.z += 1  # stored as a sparse accessor
    export: Any = bpy.ops.export_scene.gltf
    try:
        export(
            filepath=str(tmp_path / "keys.glb"),
            export_draco_mesh_compression_enable=compressed,
            export_try_sparse_sk=True,
        )
    except RuntimeError as error:
        pytest.skip(f"this Blender does not write it: {error}")
    require_sound(tmp_path / "keys.glb")


def nan_at(place: Callable[[bytes], int]) -> Callable[[bytes], bytes]:
    return lambda content: patched(place(content), "<f", float("nan"))(content)


@pytest.mark.parametrize(
    ("name", "change", "where"),
    [
        ("sheet.obj", lambda content: re.sub(rb"(?m)^v \S+", b"v nan", content, count=3), "3 points.*first is on line"),
        ("sheet.ply", nan_at(lambda content: content.index(b"end_header") + 11 + 20 * 7 + 4), "a point .*vertex 7"),
        ("text.ply", replaced(b"end_header\n", b"end_header\ninf"), "a point.*vertex 0"),
        ("sheet.stl", nan_at(lambda _: 84 + 50 * 9 + 12), "a point.*in triangle 9"),
        ("text.stl", lambda content: re.sub(rb"vertex \S+", b"vertex -inf", content, count=1), "first is on line"),
        ("sheet.glb", nan_at(lambda content: content.index(b"BIN\0") + 4 + 12 * 5), "a point.*vertex 5"),
        ("sheet.off", replaced(b"49 36 0\n", b"49 36 0\nnan "), "a point.*vertex 0"),
        (
            "sheet.obj",
            lambda content: re.sub(rb"(?m)^v \S+", b"v 1e400", content, count=1),
            "a point.*first is on line",
        ),
        ("text.ply", replaced(b"end_header\n", b"end_header\n1e39 "), "a point.*vertex 0"),
        ("text.ply", replaced(b"end_header\n", b"end_header\n" + b"7" * 39 + b" "), "a point.*vertex 0"),
        (
            "sheet.obj",
            lambda content: re.sub(rb"(?m)^v \S+", b"v -4" + 38 * b"0" + b".5", content, count=2),
            "2 points.*first is on line",
        ),
        ("text.stl", lambda content: re.sub(rb"vertex \S+", b"vertex 12345e35", content, count=1), "first is on line"),
        ("sheet.off", replaced(b"49 36 0\n", b"49 36 0\n" + b"4" * 39 + b" "), "a point.*vertex 0"),
        ("text.stl", lambda content: re.sub(rb"vertex \S+", b"vertex -4.1E+038", content, count=1), "first is on line"),
        ("sheet.off", replaced(b"49 36 0\n", b"49 36 0\n1e39 "), "a point.*vertex 0"),
        ("binary.vtk", lambda content: patched(content.index(b"double") + 7, ">d", float("inf"))(content), "vertex 0"),
    ],
    ids=lambda value: value if isinstance(value, str) and value[-4] == "." else "",
)
def test_positions_that_are_no_numbers_are_named(
    name: str, change: Callable[[bytes], bytes], where: str, whole: dict[str, bytes], tmp_path: Path
) -> None:
    said = outcome(damaged(tmp_path, name, change(whole[name]), whole))
    assert re.search(rf"the coordinates of .*{where}", said), said


def test_other_values_may_be_no_numbers(tmp_path: Path) -> None:
    path = tmp_path / "quality.ply"
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    header += "property float quality\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_text(header + "0 0 0 nan\n1 0 0 0\n0 1 0 inf\n3 0 1 2\n")
    assert outcome(path) == ""


@pytest.mark.parametrize("number", [38 * "3", "0." + 45 * "9", "12345e33", "0000" + 36 * "1"])
def test_long_numbers_that_are_places_are_read(number: str, tmp_path: Path) -> None:
    path = tmp_path / "long.obj"
    path.write_text(f"v 0 0 0\nv 1 0 {number}\nv 0 1 0\nf 1 2 3\n")
    assert outcome(path) == ""


def test_what_is_no_file_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "folder.obj").mkdir()
    assert "is not a file" in outcome(tmp_path / "folder.obj")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.ply")  # reading it would wait for ever
        assert "is not a file" in outcome(tmp_path / "pipe.ply")
    if Path("/dev/zero").exists():
        (tmp_path / "device.stl").symlink_to("/dev/zero")
        assert "is not a file" in outcome(tmp_path / "device.stl")
    (tmp_path / "lost.glb").symlink_to("nowhere.glb")
    assert "there is no file" in outcome(tmp_path / "lost.glb")
    assert "cannot be read: File name too long" in outcome(tmp_path / ("long" * 100 + ".ply"))
    (tmp_path / "none.ply").write_bytes(b"")
    assert "is empty" in outcome(tmp_path / "none.ply")
