"""Surfaces of brains and the values on them: .gii in and out of `transfer`, `flatten` and `wrap`."""

import sys
from pathlib import Path

import numpy as np
import pytest
from commands import run
from scenes import positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")
nibabel = pytest.importorskip("nibabel", reason="nibabel, which reads and writes .gii, is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from nibabel.gifti import (  # noqa: E402
    GiftiCoordSystem,
    GiftiDataArray,
    GiftiImage,
    GiftiLabel,
    GiftiLabelTable,
    GiftiMetaData,
)

FEW = ["--samples", "40", "--targets", "200", "--reflect", "never"]
STRUCTURE = "AnatomicalStructurePrimary"


def ball(rings: int, around: int, turn: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a sphere with hills and no symmetry."""
    latitude = np.pi * np.arange(1, rings) / rings
    longitude = 2 * np.pi * np.arange(around) / around + turn
    up, east = (each.ravel() for each in np.meshgrid(latitude, longitude, indexing="ij"))
    points = np.stack([np.sin(up) * np.cos(east), np.sin(up) * np.sin(east), np.cos(up)], axis=1)
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]])
    hills = np.array([[0.8, 0.6, 0.0], [-0.6, 0.0, 0.8], [0.0, -0.96, 0.28], [0.1, 0.3, -0.95]])
    height = np.exp((points @ hills.T - 1) / 0.15) @ [0.5, -0.3, 0.4, 0.3]
    last, faces = (rings - 1) * around, []
    for ring in range(0, last - around, around):
        for k in range(around):
            a, b, c, d = ring + k, ring + around + k, ring + around + (k + 1) % around, ring + (k + 1) % around
            faces += [(a, b, c), (a, c, d)]
    faces += [(last, k, (k + 1) % around) for k in range(around)]
    faces += [(last + 1, last - around + (k + 1) % around, last - around + k) for k in range(around)]
    return points * (1 + height)[:, None], np.array(faces)


def write_surface(path: Path, vertices: np.ndarray, faces: np.ndarray, structure: str) -> None:
    space = GiftiCoordSystem(2, 2, np.eye(4) + np.eye(4, k=3))
    meta = GiftiMetaData({STRUCTURE: structure, "GeometricType": "Anatomical"})
    arrays = [
        GiftiDataArray(vertices.astype(np.float32), "pointset", coordsys=space, meta=meta),
        GiftiDataArray(faces.astype(np.int32), "triangle"),
    ]
    GiftiImage(darrays=arrays, meta=GiftiMetaData({"Subject": "somebody"})).to_filename(str(path))


def write_values(path: Path, *columns: np.ndarray, intent: str = "shape", labels: dict[int, str] | None = None) -> None:
    table = GiftiLabelTable()
    for key, name in (labels or {}).items():
        label = GiftiLabel(key, red=0.5, green=0.25, blue=1.0, alpha=1.0)
        label.label = name
        table.labels.append(label)
    arrays = [GiftiDataArray(x, intent, meta=GiftiMetaData({"Name": f"column {k}"})) for k, x in enumerate(columns)]
    meta = GiftiMetaData({STRUCTURE: "CortexLeft"})
    GiftiImage(darrays=arrays, labeltable=table, meta=meta).to_filename(str(path))


def surface(path: Path) -> tuple[np.ndarray, np.ndarray]:
    image = nibabel.load(path)
    return np.float64(image.agg_data("pointset")), image.agg_data("triangle")


@pytest.fixture
def halves(tmp_path: Path) -> Path:
    """A folder with two halves of a brain, meshed differently, and values on the left one."""
    vertices, faces = ball(20, 32, 0.0)
    write_surface(tmp_path / "left.surf.gii", vertices, faces, "CortexLeft")
    other, triangles = ball(18, 28, 0.07)
    write_surface(tmp_path / "right.surf.gii", other * 2 + 5, triangles, "CortexRight")
    x, y, z = vertices.T.astype(np.float32)
    holed = x.copy()
    holed[z > 0.9] = np.nan
    write_values(tmp_path / "height.shape.gii", z)
    write_values(tmp_path / "run.func.gii", x, y, holed, intent="time series")
    parts = np.where(z > 0, 7, 3).astype(np.int32)
    write_values(tmp_path / "parts.label.gii", parts, intent="label", labels={0: "???", 3: "low", 7: "high"})
    return tmp_path


def test_values_are_carried_beside_the_surface(halves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = halves / "out.surf.gii"
    data = [halves / name for name in ("height.shape.gii", "run.func.gii", "parts.label.gii")]
    status, said, err = run(
        capsys, "transfer", halves / "left.surf.gii", halves / "right.surf.gii", "-o", out, "--data", *data, *FEW
    )
    assert (status, err) == (0, "")
    assert f"{out}: 3 files of data from" in said
    # the target's surface comes back as it was, with all that its file says
    for one, two in zip(surface(out), surface(halves / "right.surf.gii"), strict=True):
        assert (one == two).all()
    image = nibabel.load(out)
    assert dict(image.meta)["Subject"] == "somebody"
    points = image.get_arrays_from_intent("pointset")[0]
    assert points.meta[STRUCTURE] == "CortexRight"
    assert (points.coordsys.dataspace, points.coordsys.xform[0, 3]) == (2, 1.0)

    x, y, z = ((surface(out)[0] - 5) / 2).T
    height = nibabel.load(halves / "out_data" / "height.shape.gii")
    assert dict(height.meta)[STRUCTURE] == "CortexRight"
    assert height.darrays[0].meta["Name"] == "column 0"
    assert np.abs(height.agg_data() - z).mean() < 0.01
    columns = nibabel.load(halves / "out_data" / "run.func.gii").agg_data("time series").T
    assert len(columns) == 3
    for found, expected in zip(columns, (x, y), strict=False):
        assert np.abs(found - expected).mean() < 0.01
    assert np.isnan(columns[2][z > 1.0]).all()
    assert np.abs(columns[2] - x)[z < 0.8].mean() < 0.01
    parts = nibabel.load(halves / "out_data" / "parts.label.gii")
    assert parts.labeltable.get_labels_as_dict() == {0: "???", 3: "low", 7: "high"}
    assert parts.labeltable.labels[1].rgba == (0.5, 0.25, 1.0, 1.0)
    keys = parts.agg_data()
    assert keys.dtype == np.int32
    assert (keys[z > 0.1] == 7).all()
    assert (keys[z < -0.1] == 3).all()


def test_onto_an_identical_surface_values_come_back(halves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    vertices, faces = surface(halves / "left.surf.gii")
    write_surface(halves / "again.surf.gii", vertices, faces, "CortexLeft")
    status, _, err = run(
        capsys, "transfer", halves / "left.surf.gii", halves / "again.surf.gii", "-o", halves / "out.blend",
        "--data", halves / "run.func.gii", halves / "parts.label.gii", *FEW,
    )  # fmt: skip
    assert (status, err) == (0, "")
    for name in ("run.func.gii", "parts.label.gii"):
        before, after = (nibabel.load(folder / name).darrays for folder in (halves, halves / "out_data"))
        for one, two in zip(before, after, strict=True):
            assert np.allclose(one.data, two.data, rtol=0, atol=1e-6, equal_nan=True)
            assert (one.intent, one.datatype) == (two.intent, two.datatype)


def test_what_cannot_be_carried_is_said_before_any_work(halves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pair = ["transfer", halves / "left.surf.gii", halves / "right.surf.gii", "-o", halves / "out.surf.gii", "--data"]
    write_values(halves / "few.shape.gii", np.zeros(7, np.float32))
    assert "has 7 values, but" in run(capsys, *pair, halves / "few.shape.gii")[2]
    assert "holds no values" in run(capsys, *pair, halves / "left.surf.gii")[2]
    assert "is no .gii file" in run(capsys, *pair, halves / "values.csv")[2]
    assert "there is no file" in run(capsys, *pair, halves / "none.shape.gii")[2]
    (halves / "torn.shape.gii").write_bytes((halves / "height.shape.gii").read_bytes()[:400])
    assert "could not be read" in run(capsys, *pair, halves / "torn.shape.gii")[2]
    (halves / "else").mkdir()
    write_values(halves / "else" / "height.shape.gii", np.zeros(7, np.float32))
    twins = run(capsys, *pair, halves / "height.shape.gii", halves / "else" / "height.shape.gii")[2]
    assert "two files of --data are called 'height.shape.gii'" in twins
    (halves / "out_data").write_text("mine")
    assert "the folder for --data, is a file" in run(capsys, *pair, halves / "height.shape.gii")[2]
    assert not (halves / "out.surf.gii").exists()


def test_the_wrapped_surface_is_where_the_target_is(halves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = halves / "wrapped.surf.gii"
    assert run(capsys, "wrap", halves / "left.surf.gii", halves / "right.surf.gii", "-o", out, *FEW)[0] == 0
    vertices, faces = surface(out)
    own, triangles = surface(halves / "left.surf.gii")
    assert (faces == triangles).all()
    assert np.linalg.norm(vertices - (2 * own + 5), axis=1).mean() < 0.05
    assert nibabel.load(out).get_arrays_from_intent("pointset")[0].meta[STRUCTURE] == "CortexRight"


def test_a_closed_surface_is_written_on_a_sphere(halves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = halves / "left.sphere.surf.gii"
    status, said, err = run(capsys, "flatten", halves / "left.surf.gii", "-o", out, "--sphere")
    assert (status, err) == (0, "")
    assert "on a sphere of radius 100, angles off by" in said
    vertices, faces = surface(out)
    assert (faces == surface(halves / "left.surf.gii")[1]).all()
    assert np.allclose(np.linalg.norm(vertices, axis=1), 100, atol=1e-3)
    assert (np.linalg.det(vertices[faces]) > 0).all()
    meta = nibabel.load(out).get_arrays_from_intent("pointset")[0].meta
    assert (meta["GeometricType"], meta[STRUCTURE]) == ("Spherical", "CortexLeft")
    # in a .blend the mesh itself stays as it is
    assert run(capsys, "flatten", halves / "left.surf.gii", "-o", halves / "out.blend", "--sphere")[0] == 0
    bpy.ops.wm.open_mainfile(filepath=str(halves / "out.blend"))
    (name,) = (x for x in bpy.data.objects.keys() if x.endswith("on the sphere"))  # noqa: SIM118
    assert np.allclose(np.linalg.norm(positions(bpy.data.objects[name]), axis=1), 1, atol=1e-5)
    assert np.ptp(np.linalg.norm(positions(bpy.data.objects[name.removesuffix(" on the sphere")]), axis=1)) > 0.1
    (halves / "open.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    status, _, err = run(capsys, "flatten", halves / "open.off", "-o", halves / "never.ply", "--sphere")
    assert status == 1
    assert "has a boundary: only what is closed goes to a sphere" in err


def test_the_picture_shows_both_spheres_in_one_frame(halves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture, pair = halves / "spheres.png", (halves / "left.surf.gii", halves / "right.surf.gii")
    assert run(capsys, "align", *pair, "--picture", halves / "spheres.jpg", *FEW)[0] == 2
    assert run(capsys, "align", *pair, "--picture", picture, *FEW)[0] == 0
    image = bpy.data.images.load(str(picture))
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    rgb = pixels.reshape(height, width, 4)[..., :3]
    # source from in front and from behind, then the target: alike one by one, and no others
    views = np.split(rgb[height // 5 :, : width // 4 * 4], 4, axis=1)
    apart = np.array([[np.abs(one - two).mean() for two in views] for one in views])
    assert apart[0, 2] < 0.03
    assert apart[1, 3] < 0.03
    assert apart[0, 1] > 0.1
    assert apart[0, 3] > 0.1


def test_polygons_are_written_as_triangles_in_the_world(tmp_path: Path) -> None:
    mesh = bpy.data.meshes.new("Quad")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new("Quad", mesh)
    bpy.context.scene.collection.objects.link(obj)
    obj.location, obj.scale = (1, 2, 3), (-2, 1, 1)
    bpy.context.view_layer.update()
    files.export_mesh(obj, tmp_path / "quad.gii")
    vertices, faces = surface(tmp_path / "quad.gii")
    assert vertices.tolist() == [[1, 2, 3], [-1, 2, 3], [-1, 3, 3], [1, 3, 3]]
    corners = vertices[faces]
    # seen from where it was seen from before it was mirrored
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0).all()
    files.new_scene()
    assert np.allclose(positions(files.import_mesh(str(tmp_path / "quad.gii")).obj), vertices)


def test_without_nibabel_it_is_a_sentence(
    halves: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    obj = files.import_mesh(str(halves / "left.surf.gii")).obj
    files.export_mesh(obj, halves / "left.ply")
    for name in ("nibabel", "nibabel.gifti"):
        monkeypatch.setitem(sys.modules, name, None)
    pair = ["transfer", halves / "left.ply", halves / "left.ply", "-o"]
    for arguments in ([halves / "out.gii"], [halves / "out.ply", "--data", halves / "height.shape.gii"]):
        status, _, err = run(capsys, *pair, *arguments)
        assert status == 2
        assert "the Python package 'nibabel', which is not installed here: run 'uv run python .'" in err
