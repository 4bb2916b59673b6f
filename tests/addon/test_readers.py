"""Kinds of files that are only read: .vrm, .usdz, .off, .vtk and .gii."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scenes import make_object, make_sheet, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402

POINTS = np.array([[0, 0, 0], [1, 0, 0.5], [1, 1, 0], [0, 1, 0.25], [2, 1, 0]])
ROWS = "0 0 0\n1 0 .5\n1 1 0\n0 1 .25\n2 1 0\n"
TEXT = b"POINTS 5 float\n" + ROWS.encode()
BLOCK = np.array([[0, 0, 0], [1, 0, 0.5], [1, 1, 0], [0, 1, 0.25], [2, 1, 0]]).astype(">f4").tobytes()
VTK = b"# vtk DataFile Version %b\nany title\n%b\nDATASET %b\n"


def polygons(path: Path) -> list[list[int]]:
    """Read a file, look at its points, and return its polygons."""
    files.new_scene()
    obj = files.import_mesh(str(path)).obj
    assert obj.name == path.stem
    assert np.array_equal(positions(obj), POINTS)
    assert np.array_equal(np.array(obj.matrix_world), np.eye(4))
    return [list(polygon.vertices) for polygon in obj.data.polygons]


@pytest.mark.parametrize(
    "text",
    [
        "OFF\n5 2 0\n" + ROWS + "4 0 1 2 3\n3 1 4 2\n",
        "OFF 5 2 0\n" + ROWS + "4 0 1 2 3\n3 1 4 2\n",
        "# a remark\nOFF # another\n\n5 2 0\n\n" + ROWS + "4 0 1 2 3 255 0 0\n3 1 4 2 0.5 0.5 0.5\n",
        "5 2 0\n" + ROWS + "4 0 1 2 3\n3 1 4 2\n",
        "COFF\n5 2 7\n" + ROWS.replace("\n", " 255 0 0 255\n") + "4 0 1 2 3\n3 1 4 2\n",
        "NOFF\r\n5 2 7\r\n" + ROWS.replace("\n", " 0 0 1\r\n") + "4 0 1 2 3\r\n3 1 4 2\r\n",
        "STOFF\n5 2 7\n" + ROWS.replace("\n", " 0.5 0.5\n") + "4 0 1 2 3\n3 1 4 2",
    ],
)
def test_off(text: str, tmp_path: Path) -> None:
    (tmp_path / "sheet.OFF").write_bytes(text.encode())
    assert polygons(tmp_path / "sheet.OFF") == [[0, 1, 2, 3], [1, 4, 2]]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("4OFF\n1 0 0\n0 0 0 1\n", "more than three coordinates"),
        ("OFF BINARY\n", "save it as text"),
        ("OFF\n5 two 0\n", "does not begin with OFF and the number of points"),
        ("OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", r"line 4, is damaged: '1 0' are not 3 numbers"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n", r"line 6, is damaged"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\nx 0 1\n", r"line 6, is damaged"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "a polygon has vertex -1"),
    ],
)
def test_a_damaged_off_file_is_a_sentence(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "sheet.off").write_text(text)
    with pytest.raises(files.Unreadable, match=reason):
        files.import_mesh(str(tmp_path / "sheet.off"))


@pytest.mark.parametrize(
    "content",
    [
        VTK % (b"2.0", b"ASCII", b"POLYDATA") + TEXT + b"POLYGONS 2 9\n4 0 1 2 3\n3 1 4 2\n",
        # numbers anyhow on the lines; lines and points beside the polygons; values after them
        VTK % (b"3.0", b"ascii", b"POLYDATA")
        + b"POINTS 5 double\n0 0 0 1 0 .5 1 1\n0 0 1 .25 2 1 0\n\nMETADATA\nINFORMATION 0\n\nVERTICES 1 2\n1 0\n"
        + b"LINES 1 3\n2 0 4\n\nPOLYGONS 2 9\n4 0 1 2 3 3\n1 4 2\nPOINT_DATA 5\nSCALARS s float\nLOOKUP_TABLE d\n",
        VTK % (b"4.2", b"BINARY", b"POLYDATA")
        + b"POINTS 5 float\n%b\nPOLYGONS 2 9\n%b\n" % (BLOCK, np.array([4, 0, 1, 2, 3, 3, 1, 4, 2], ">i4").tobytes()),
        VTK % (b"5.1", b"BINARY", b"POLYDATA")
        + b"POINTS 5 float\n%b\nMETADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtk\nDATA 2 0 1\n\n" % BLOCK
        + b"POLYGONS 3 7\nOFFSETS vtktypeint64\n%b\n" % np.array([0, 4, 7], ">i8").tobytes()
        + b"CONNECTIVITY vtktypeint64\n%b\n" % np.array([0, 1, 2, 3, 1, 4, 2], ">i8").tobytes(),
        VTK % (b"5.1", b"ASCII", b"UNSTRUCTURED_GRID")
        + TEXT + b"CELLS 4 9\nOFFSETS vtktypeint64\n0 2 6 9\n"
        + b"CONNECTIVITY vtktypeint64\n0 4 0 1 2 3 1 4 2\nCELL_TYPES 3\n3\n9\n5\n",
    ],
    ids=["polygons", "mixed", "binary", "binary 5.1", "grid"],
)  # fmt: skip
def test_vtk(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "sheet.vtk").write_bytes(content)
    assert polygons(tmp_path / "sheet.vtk") == [[0, 1, 2, 3], [1, 4, 2]]


def test_strips_of_a_vtk_file_are_triangles_of_one_side(tmp_path: Path) -> None:
    content = VTK % (b"3.0", b"ASCII", b"POLYDATA") + b"POINTS 5 float\n" + ROWS.encode()
    (tmp_path / "sheet.vtk").write_bytes(content + b"TRIANGLE_STRIPS 1 6\n5 0 1 3 2 4\n")
    assert polygons(tmp_path / "sheet.vtk") == [[0, 1, 3], [3, 1, 2], [3, 2, 4]]


@pytest.mark.parametrize(
    ("rest", "reason"),
    [
        (b"DATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n", r"holds no surface \(POLYDATA\) but 'STRUCTURED_POINTS'"),
        (b"DATASET UNSTRUCTURED_GRID\n" + TEXT + b"CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n",
         "its cells are no triangles, quads or polygons"),
        (b"DATASET POLYDATA\nPOINTS five float\n", "'POINTS five float' is not understood"),
        (b"DATASET POLYDATA\nPOINTS 5 flaot\n", "the unknown type 'flaot'"),
        (b"DATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 zero 0\n", "could not convert string"),
        (b"DATASET POLYDATA\n" + TEXT + b"POLYGONS 2 9\n4 0 1 2 3 9 1 4 2\n", "not understood"),
        (b"DATASET POLYDATA\n" + TEXT + b"POLYGONS 1 4\n3 0 1 5\n", "a polygon has vertex 5"),
    ],
)  # fmt: skip
def test_a_damaged_vtk_file_is_a_sentence(rest: bytes, reason: str, tmp_path: Path) -> None:
    (tmp_path / "sheet.vtk").write_bytes(b"# vtk DataFile Version 3.0\ntitle\nASCII\n" + rest)
    with pytest.raises(files.Unreadable, match=reason):
        files.import_mesh(str(tmp_path / "sheet.vtk"))


@pytest.mark.parametrize("encoding", ["ASCII", "B64BIN", "B64GZ"])
def test_gii(encoding: str, tmp_path: Path) -> None:
    gifti = pytest.importorskip("nibabel", reason="nibabel, which reads .gii, is not installed").gifti
    arrays = [
        gifti.GiftiDataArray(values, intent=f"NIFTI_INTENT_{intent}", encoding=f"GIFTI_ENCODING_{encoding}")
        for values, intent in (
            (POINTS.astype(np.float32), "POINTSET"),
            (np.array([[0, 1, 2], [1, 4, 2]], np.int32), "TRIANGLE"),
        )
    ]
    gifti.GiftiImage(darrays=arrays).to_filename(str(tmp_path / "sheet.gii"))
    assert polygons(tmp_path / "sheet.gii") == [[0, 1, 2], [1, 4, 2]]
    gifti.GiftiImage(darrays=arrays[:1]).to_filename(str(tmp_path / "values.gii"))
    with pytest.raises(files.Unreadable, match="holds no surface, but values on one"):
        files.import_mesh(str(tmp_path / "values.gii"))


def test_without_its_reader_gii_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sheet.gii").write_text("<?xml?>")
    for name in ("nibabel", "nibabel.gifti", "nibabel.gifti.gifti"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(files.Unreadable, match=r"'nibabel', which is not installed here: run 'uv run python \.'"):
        files.import_mesh(str(tmp_path / "sheet.gii"))


def test_vrm_is_a_glb(tmp_path: Path) -> None:
    files.export_mesh(make_sheet("Sheet", 7), tmp_path / "sheet.glb")
    (tmp_path / "sheet.glb").rename(tmp_path / "sheet.vrm")
    files.new_scene()
    assert len(files.import_mesh(str(tmp_path / "sheet.vrm")).obj.data.polygons) == 2 * 36


def test_usdz_is_read(tmp_path: Path) -> None:
    make_sheet("Sheet", 7)
    bpy.ops.wm.usd_export(filepath=str(tmp_path / "sheet.usdz"), selected_objects_only=True)
    files.new_scene()
    assert len(files.import_mesh(str(tmp_path / "sheet.usdz")).obj.data.vertices) == 49


@pytest.mark.parametrize("ending", files.READ_ONLY)
def test_they_are_not_written(ending: str, tmp_path: Path) -> None:
    with pytest.raises(files.Unreadable, match=f"{ending} files are read, but not written: use one of .blend"):
        files.export_mesh(make_sheet("Sheet", 3), tmp_path / f"out{ending}")


@pytest.mark.parametrize("name", ["S.BLEND:Scan", "s.Blend:Scan", "a.obj/S.bLeNd:Scan", "S.GlB:Scan", "S.VRM:Scan"])
def test_endings_in_any_case_end_the_files_name(name: str) -> None:
    assert files.split_object_name(name) == (Path(name.rpartition(":")[0]), "Scan")


def test_shapes_of_bones_are_no_scans(tmp_path: Path) -> None:
    sheet = make_sheet("Face", 5)
    shape = make_object("A Widget", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("Head").tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.pose.bones["Head"].custom_shape = shape
    sheet.vertex_groups.new(name="Head").add(range(25), 1.0, "REPLACE")
    sheet.parent = rig
    sheet.modifiers.new("Armature", "ARMATURE").object = rig
    for obj in (sheet, rig, shape):
        obj.select_set(True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "rig.blend"), copy=True)
    shape.select_set(False)
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "rig.glb"), use_selection=True)
    for name in ("rig.blend", "rig.glb"):  # for the .glb Blender's importer makes a shape of its own
        files.new_scene()
        found = files.import_mesh(str(tmp_path / name))
        assert found.name == "Face"
        assert sum(obj.type == "MESH" for obj in bpy.data.objects) == 2
        with pytest.raises(files.Unreadable, match=r"it has 'Face'$"):
            files.import_mesh(f"{tmp_path / name}:A Widget")
    make_sheet("Body", 3)
    bpy.data.objects["Face"].select_set(True)
    next(obj for obj in bpy.data.objects if obj.type == "ARMATURE").select_set(True)
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "two.glb"), use_selection=True)
    files.new_scene()
    with pytest.raises(files.Unreadable, match=r"has 2 mesh objects \('Body', 'Face'\): name one"):
        files.import_mesh(str(tmp_path / "two.glb"))
