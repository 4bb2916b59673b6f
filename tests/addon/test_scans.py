"""Scans that are no clean discs: what is repaired for the computation, what is refused, and what stays as it was."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import QUICK, bumps, corner_values, everything, make_object, make_sheet, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files, topology_cache  # noqa: E402
from mobius_extension.mobius_addon.command_line import main  # noqa: E402
from mobius_extension.mobius_addon.computation import Repair, aligned, in_order  # noqa: E402
from mobius_extension.mobius_addon.heat_maps import DISC_MEASURES, Measure, vertex_dilatations  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.solver import AlignSettings, Flattening, MeshError, TriangleMesh  # noqa: E402

DATA = Path(os.environ.get("MOBIUS_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
QUICK_FLAGS = ["--samples", "50", "--targets", "300", "--reflect", "never", "--refine", "mobius"]


def holed(name: str = "Holed", n: int = 12) -> Any:
    """A sheet with an opening of three by two quads in the middle and one of one quad."""
    return make_sheet(name, n, keep=lambda i, j: not (5 <= i <= 7 and 5 <= j <= 6) and (i, j) != (2, 2))


def untidy(name: str, n: int) -> Any:
    """A sheet whose first quad is there twice, with every fifth quad turned over and a face without a third corner."""
    side = np.linspace(-1, 1, n)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    quads = [
        (i * n + j, i * n + j + 1, (i + 1) * n + j + 1, (i + 1) * n + j) for i in range(n - 1) for j in range(n - 1)
    ]
    faces = [quads[0], *(q[::-1] if k % 5 == 3 else q for k, q in enumerate(quads))]
    return make_object(name, np.stack([x, y, bumps(x, y)], axis=1).tolist(), faces)


def shape(obj: Any) -> list[Any]:
    """Vertices and polygons of a mesh: what no computation may change."""
    return [positions(obj).tolist(), [list(polygon.vertices) for polygon in obj.data.polygons]]


def disc_of(obj: Any) -> np.ndarray:
    """Place of each face corner in the disc, (c,) complex."""
    u, v = (corner_values(obj, "Mobius Disc") - 0.5).T * 2
    return u + 1j * v


def reported(capfd: pytest.CaptureFixture[str], operator: Callable[..., Any], **options: Any) -> str:
    """What an operator says."""
    capfd.readouterr()
    assert operator(**options) == {"FINISHED"}
    return capfd.readouterr().out


# openings


def test_flatten_closes_openings_on_request_and_not_in_the_mesh() -> None:
    obj = holed()
    with pytest.raises(RuntimeError, match=r"'Holed' has 3 boundary loops \(44, 10 and 4 edges\)"):
        bpy.ops.mobius.flatten(fill_holes=False)
    before = shape(obj)
    assert bpy.ops.mobius.flatten(fill_holes=True) == {"FINISHED"}
    assert shape(obj) == before
    disc = disc_of(obj)
    at_rim = (np.abs(positions(obj)[:, :2]).max(axis=1) == 1)[[loop.vertex_index for loop in obj.data.loops]]
    assert np.abs(disc[at_rim]) == pytest.approx(1, abs=1e-6)
    assert np.abs(disc[~at_rim]).max() < 1
    # the opening in the middle keeps its room: no vertex of its rim is near the middle of it
    for polygon in obj.data.polygons:
        z = disc[list(polygon.loop_indices)]
        assert np.imag(np.conj(z) * np.roll(z, -1)).sum() > 0


def test_flatten_says_what_it_closed(capfd: pytest.CaptureFixture[str]) -> None:
    holed()
    said = reported(capfd, bpy.ops.mobius.flatten, fill_holes=True)
    assert "'Holed': 2 openings (10, 4 edges) closed, for the computation only" in said


def test_the_outer_boundary_can_be_the_selected_one() -> None:
    obj = holed()
    vertices = obj.data.vertices

    def select(*chosen: int) -> None:
        vertices.foreach_set("select", np.isin(np.arange(len(vertices)), chosen))

    options = {"fill_holes": True, "outer_loop": "selected"}
    inner = 5 * 12 + 5
    select(inner)
    assert bpy.ops.mobius.flatten(**options) == {"FINISHED"}
    on_circle = np.abs(np.abs(disc_of(obj)) - 1) < 1e-6
    corner_vertex = np.array([loop.vertex_index for loop in obj.data.loops])
    assert len(set(corner_vertex[on_circle])) == 10
    assert inner in corner_vertex[on_circle]

    before = everything(obj)
    for chosen, reason in (((), "on no boundary loop"), ((0, inner), "on 2 boundary loops")):
        select(*chosen)
        with pytest.raises(RuntimeError, match=f"'Holed' has selected vertices {reason}: in Edit Mode, select"):
            bpy.ops.mobius.flatten(**options)
    select(*[k for k, chosen in enumerate(before["selected"]) if chosen])
    assert everything(obj) == before


def test_one_undo_takes_back_a_flattening_with_openings_and_colors() -> None:
    holed()
    bpy.ops.ed.undo_push(message="before")
    before = everything(bpy.data.objects["Holed"])
    assert bpy.ops.mobius.flatten("EXEC_DEFAULT", True, fill_holes=True, distortion="factor") == {"FINISHED"}
    assert everything(bpy.data.objects["Holed"]) != before
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Holed"]) == before


def test_align_and_transfer_with_openings(pair: tuple[Any, Any]) -> None:
    source, _ = pair
    target = holed("Holed", 21)
    bpy.context.scene.mobius.target = target
    with pytest.raises(RuntimeError, match="'Holed' has 3 boundary loops"):
        bpy.ops.mobius.align(**QUICK, fill_holes=False)
    before = shape(source), shape(target)
    settings = QUICK | {"samples": 40, "targets": 300, "refine": "mobius"}
    assert bpy.ops.mobius.align(**settings, fill_holes=True) == {"FINISHED"}
    assert (shape(source), shape(target)) == before
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    used = np.unique([loop.vertex_index for loop in target.data.loops])
    error = np.abs(weights(target, "Right") - (positions(target)[:, 0] + 1) / 2)[used]
    assert error.mean() < 0.06
    figures = json.loads(target.data.mobius_alignment.report)
    assert "'Holed': 2 openings (10, 4 edges) closed, for the computation only" in figures["warnings"]


def test_the_panel_says_whether_the_mesh_can_be_used_with_what_is_switched_on() -> None:
    obj = holed()
    assert topology_cache.line_of(obj, Repair(fill_holes=False)).is_disc is False
    assert topology_cache.line_of(obj, Repair()).rows == ("3 boundary loops:", "2 will be filled")
    parts = make_sheet("Parts", 7, keep=lambda i, j: j != 2)
    assert topology_cache.line_of(parts, Repair(largest_part=False)).is_disc is False
    rows = "disc, 28 vertices", "1 smaller part beside it"
    assert topology_cache.line_of(parts, Repair()).rows == rows


# parts


def test_the_largest_part_is_kept_unless_that_is_switched_off() -> None:
    obj = make_sheet("Parts", 7, keep=lambda i, j: j != 2)
    before = shape(obj)
    with pytest.raises(RuntimeError, match="'Parts' has 2 separate parts"):
        bpy.ops.mobius.flatten(largest_part=False)
    assert bpy.ops.mobius.flatten(distortion="dilatation") == {"FINISHED"}
    assert shape(obj) == before
    small = np.array([loop.vertex_index % 7 <= 2 for loop in obj.data.loops])
    uv = corner_values(obj, "Mobius Disc")
    assert (uv[small] == 0).all()
    assert np.abs(disc_of(obj)[~small]).max() == pytest.approx(1, abs=1e-6)
    colors = np.array([value.color[:] for value in obj.data.color_attributes["Mobius Disc Angles"].data])
    assert np.isfinite(colors).all()
    assert colors[0] == pytest.approx([0.05, 0.05, 0.05, 1])


def test_transfer_leaves_other_parts_of_the_target_alone_if_asked(pair: tuple[Any, Any]) -> None:
    target = make_sheet("Parts", 16, keep=lambda i, j: j != 2)
    bpy.context.scene.mobius.target = target
    assert bpy.ops.mobius.align(**QUICK, parts="main") == {"FINISHED"}
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    column = np.arange(256) % 16
    group = target.vertex_groups["Right"].index
    members = np.array([any(g.group == group for g in vertex.groups) for vertex in target.data.vertices])
    assert not members[column <= 2].any()
    assert members[column > 4].all()
    # otherwise a part without a counterpart has what is beside it
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    group = target.vertex_groups["Right"].index
    members = np.array([any(g.group == group for g in vertex.groups) for vertex in target.data.vertices])
    assert members[column <= 2].any()


# faces


def test_duplicate_and_turned_faces_are_put_in_order_for_the_computation(capfd: pytest.CaptureFixture[str]) -> None:
    obj = untidy("Untidy", 12)
    before = shape(obj)
    said = reported(capfd, bpy.ops.mobius.flatten)
    assert "'Untidy': 2 duplicate faces left out, 48 faces turned over, for the computation only" in said
    assert shape(obj) == before
    other = make_sheet("Tidy", 12)
    assert bpy.ops.mobius.flatten() == {"FINISHED"}
    places = []
    for each in (obj, other):
        place = np.zeros(144, complex)
        place[[loop.vertex_index for loop in each.data.loops]] = disc_of(each)
        places.append(place)
    # Blender may cut a quad along the other diagonal when it is turned
    turn = np.vdot(*places)
    assert np.abs(places[0] * turn / abs(turn) - places[1]).max() < 0.02


def test_a_face_that_uses_a_vertex_twice_is_left_out() -> None:
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    mesh = TriangleMesh(corners, np.array([(0, 1, 2), (0, 1, 1), (0, 2, 3)]), "Scan")
    tidy = in_order(mesh, Repair())
    assert tidy.mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert tidy.changes == ("1 face with a vertex used twice left out",)


def test_a_map_from_an_untidy_source_names_the_triangles_that_blender_has() -> None:
    source, target = (read_surface(make(name, n)).mesh for make, name, n in ((untidy, "A", 21), (make_sheet, "B", 16)))
    _, found = aligned(source, target, AlignSettings(**QUICK | {"refine": "mobius"}))
    assert (found.source_triangles == source.faces).all()
    there = np.einsum("qk,qkd->qd", found.barycentric, source.vertices[source.faces[found.face]])
    assert np.linalg.norm(there - target.vertices, axis=1).mean() < 0.05


def test_transfer_from_an_untidy_source(pair: tuple[Any, Any]) -> None:
    _, target = pair
    source = untidy("Untidy", 21)
    group = source.vertex_groups.new(name="Right")
    for vertex in source.data.vertices:
        group.add((vertex.index,), (vertex.co.x + 1) / 2, "REPLACE")
    bpy.context.scene.mobius.source = source
    assert bpy.ops.mobius.align(**QUICK | {"refine": "mobius"}) == {"FINISHED"}
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    assert np.abs(weights(target, "Right") - (positions(target)[:, 0] + 1) / 2).max() < 0.06


def branching() -> Any:
    """Two triangles on one edge in the same direction, and two more on it."""
    corners = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)]
    return make_object("Bad", corners, [(0, 1, 2), (0, 1, 3), (0, 1, 4), (0, 1, 5)])


@pytest.mark.parametrize("options", [{}, {"fill_holes": True}, {"fill_holes": True, "largest_part": True}])
def test_edges_of_three_faces_are_refused_with_their_count_and_check_selects_them(options: dict[str, bool]) -> None:
    obj = branching()
    before = everything(obj)
    with pytest.raises(RuntimeError, match="'Bad' has 1 edge in three or more faces"):
        bpy.ops.mobius.flatten(**options)
    assert everything(obj) == before
    assert bpy.ops.mobius.check() == {"FINISHED"}
    assert [edge.vertices[:] for edge in obj.data.edges if edge.select] == [(0, 1)]


def test_a_surface_with_one_side_is_refused() -> None:
    n = 12
    turn = np.arange(n) * 2 * np.pi / n
    corners = [
        ((1 + s * np.cos(a / 2)) * np.cos(a), (1 + s * np.cos(a / 2)) * np.sin(a), s * np.sin(a / 2))
        for s in (-0.3, 0.3)
        for a in turn
    ]
    quads = [(k, k + 1, n + k + 1, n + k) for k in range(n - 1)] + [(n - 1, n, 0, 2 * n - 1)]
    make_object("Strip", corners, quads)
    with pytest.raises(RuntimeError, match="'Strip' has one side only, like a Möbius strip: cut it open"):
        bpy.ops.mobius.flatten(fill_holes=True)


def test_a_clean_mesh_is_not_copied() -> None:
    mesh = read_surface(make_sheet("Sheet", 5)).mesh
    assert in_order(mesh, Repair(True, True)).mesh is mesh
    with pytest.raises(MeshError, match="has only faces that use a vertex twice"):
        in_order(TriangleMesh(mesh.vertices, np.array([(0, 0, 1)]), "Bad"), Repair())


def test_a_concave_polygon_is_cut_as_blender_draws_it() -> None:
    """A star: a fan from its first corner would leave it and turn triangles over."""
    angle = np.arange(10) * np.pi / 5
    radius = np.where(np.arange(10) % 2, 0.35, 1.0)
    star = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(10)], axis=1)
    obj = make_object("Star", star.tolist(), [tuple(range(10))])
    mesh = read_surface(obj).mesh
    obj.data.calc_loop_triangles()
    assert mesh.faces.tolist() == [list(triangle.vertices) for triangle in obj.data.loop_triangles]
    assert (mesh.face_vectors[:, 2] > 0).all()
    outline = star[:, 0] + 1j * star[:, 1]
    assert mesh.area == pytest.approx(np.imag(np.conj(outline) * np.roll(outline, -1)).sum() / 2, rel=1e-6)
    assert bpy.ops.mobius.flatten() == {"FINISHED"}
    disc = disc_of(obj)
    assert np.abs(disc) == pytest.approx(1, abs=1e-6)
    assert (np.imag(np.conj(disc) * np.roll(disc, -1)) > 0).all()


# methods and distortion


def test_the_two_methods_agree_up_to_a_few_hundredths() -> None:
    obj = make_sheet("Sheet", 20)
    discs = []
    for method in ("harmonic", "mid-edge"):
        assert bpy.ops.mobius.flatten(method=method) == {"FINISHED"}
        discs.append(disc_of(obj))
    turn = np.vdot(*discs)
    apart = np.abs(discs[0] * turn / abs(turn) - discs[1])
    assert 1e-5 < apart.max() < 0.06


def square(stretch: complex = 1) -> Flattening:
    """The unit square, sent to the plane with its width times the real part and its height times the imaginary."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (9, 9, 9)], float)
    plane = corners[:, 0] * stretch.real + 1j * corners[:, 1] * stretch.imag
    mesh = TriangleMesh(corners, np.array([(0, 1, 2), (0, 2, 3)]), "Square")
    return Flattening(mesh, np.where(np.arange(5) < 4, plane, np.nan), np.arange(4))


def test_colors_measure_the_distortion() -> None:
    angles, sizes = DISC_MEASURES
    wide = square(3 + 1j)
    assert vertex_dilatations(wide.mesh, wide.disc)[:4] == pytest.approx(3)
    for stretch, stop in ((1 + 1j, 0), (np.sqrt(2) + 1j, 2), (2 + 1j, 4), (1 + 5j, 4), (1 - 1j, 4)):
        linear, known = angles.color(square(complex(stretch)))
        assert known.tolist() == [True] * 4 + [False]
        srgb = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
        assert srgb[:4, :3] == pytest.approx(np.tile(angles.stops[stop], (4, 1)), abs=1e-6)
    # the whole disc has the area pi, so a square of this side has its share everywhere
    for grow, stop in ((1, 2), (2, 3), (0.5, 1), (4, 4), (100, 4), (0.01, 0)):
        linear, _ = sizes.color(square(grow * np.sqrt(np.pi) * (1 + 1j)))
        srgb = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
        assert srgb[:4, :3] == pytest.approx(np.tile(sizes.stops[stop], (4, 1)), abs=1e-6)


@pytest.mark.parametrize("measure", DISC_MEASURES, ids=lambda measure: measure.identifier)
def test_flatten_writes_its_distortion_on_request(measure: Measure, capfd: pytest.CaptureFixture[str]) -> None:
    obj = make_sheet("Sheet", 10)
    assert bpy.ops.mobius.flatten() == {"FINISHED"}
    assert obj.data.color_attributes.keys() == []
    said = reported(capfd, bpy.ops.mobius.flatten, distortion=measure.identifier)
    color = obj.data.color_attributes[measure.attribute]
    assert (color.data_type, color.domain) == ("FLOAT_COLOR", "POINT")
    assert obj.data.attributes.active_color_name == measure.attribute
    assert np.ptp([value.color[:3] for value in color.data], axis=0).max() > 0.1
    for words in ("angles are off by", "dilatation", "lengths times", f"'{measure.attribute}'"):
        assert words in said


def test_the_colors_need_their_name() -> None:
    obj = make_sheet("Sheet", 5)
    obj.vertex_groups.new(name="Mobius Disc Sizes")
    before = everything(obj)
    with pytest.raises(RuntimeError, match="'Sheet' has something named 'Mobius Disc Sizes' that is no color"):
        bpy.ops.mobius.flatten(distortion="factor")
    assert everything(obj) == before


# commands


@pytest.fixture
def scans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to be in, with a clean sheet, one with openings, one in parts and one that branches."""
    for name, make in (
        ("sheet", lambda: make_sheet("Sheet", 16)),
        ("holed", lambda: holed("Holed", 21)),
        ("parts", lambda: make_sheet("Parts", 16, keep=lambda i, j: j != 2)),
        ("branching", branching),
    ):
        files.export_mesh(make(), tmp_path / f"{name}.obj")
        files.new_scene()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    capsys.readouterr()
    status = main(list(arguments))
    out, err = capsys.readouterr()
    return status, out, err


def strict(path: Path) -> Any:
    """The content of a file that must be JSON as the standard has it."""

    def refuse(text: str) -> None:
        raise AssertionError(f"{text} is not JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


DISTORTION = {
    "mean_angle_error", "median_angle_error", "percentile_99_angle_error", "max_angle_error",
    "mean_dilatation", "max_dilatation", "min_log_factor", "max_log_factor", "flips", "circularity",
}  # fmt: skip


def test_flatten_command(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(
        capsys, "flatten", "holed.obj", "-o", "flat.blend", "--report", "r.json",
        "--fill-holes", "--method", "mid-edge", "--distortion", "dilatation",
    )  # fmt: skip
    assert status == 0
    assert err == "mobius: warning: 'holed.obj': 2 openings (10, 4 edges) closed, for the computation only\n"
    assert "dilatation 1." in out
    found = strict(scans / "r.json")
    assert set(found["distortion"]) == DISTORTION
    assert (found["method"], found["holes"], found["distortion"]["flips"]) == ("mid-edge", [10, 4], 0)
    obj = files.import_mesh("flat.blend").obj
    assert len(obj.data.polygons) == 400 - 7
    assert obj.data.color_attributes.keys() == ["Mobius Disc Angles"]
    status, _, err = run(capsys, "flatten", "sheet.obj", "-o", "flat.stl", "--distortion", "factor")
    assert status == 0
    assert "'flat.stl' is without UV map 'Mobius Disc'; color attribute 'Mobius Disc Sizes'" in err


def test_flatten_command_takes_the_named_boundary(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    places = positions(files.import_mesh("holed.obj").obj)  # y is up in the file
    inner = int(np.argmin(np.linalg.norm(places[:, [0, 2]] - (-0.5, 0.5), axis=1)))
    arguments = ["flatten", "holed.obj", "-o", "flat.blend", "--report", "r.json", "--fill-holes"]
    assert run(capsys, *arguments)[0] == 0
    assert strict(scans / "r.json")["holes"] == [10, 4]
    assert run(capsys, *arguments, "--outer", str(inner))[0] == 0
    assert strict(scans / "r.json")["holes"] == [80, 4]


def test_align_and_transfer_commands(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "align", "holed.obj", "sheet.obj", "--fill-holes", "--report", "r.json", *QUICK_FLAGS)
    assert status == 0
    # so coarse a sheet may add that it is in doubt
    first = "mobius: warning: 'holed.obj': 2 openings (10, 4 edges) closed, for the computation only"
    assert err.splitlines()[0] == first
    found = strict(scans / "r.json")
    assert set(found["distortion"]["source"]) == set(found["distortion"]["target"]) == DISTORTION
    assert found["settings"]["fill_holes"] is True
    assert [f"mobius: warning: {said}" for said in found["warnings"]] == err.splitlines()
    status, _, err = run(
        capsys, "transfer", "sheet.obj", "parts.obj", "-o", "o.blend", "--report", "r.json",
        "--map", "m.npz", "--largest-part", "--only", "uv", *QUICK_FLAGS,
    )  # fmt: skip
    assert status == 1
    assert "has no UV maps" in err
    assert not (scans / "o.blend").exists()


@pytest.mark.parametrize(
    ("status", "arguments", "reason"),
    [
        (1, ["flatten", "holed.obj", "-o", "o.obj", "--keep-holes"], "'holed.obj' has 3 boundary loops"),
        (1, ["flatten", "parts.obj", "-o", "o.obj", "--keep-parts"], "'parts.obj' has 2 separate parts"),
        (1, ["flatten", "branching.obj", "-o", "o.obj", "--fill-holes"], "has 1 edge in three or more faces"),
        (1, ["align", "sheet.obj", "holed.obj", "--keep-holes"], "'holed.obj' has 3 boundary loops"),
        (1, ["flatten", "holed.obj", "-o", "o.obj", "--fill-holes", "--outer", "25"], "on none of its boundary loops"),
        (
            2,
            ["flatten", "holed.obj", "-o", "o.obj", "--keep-holes", "--outer", "1"],
            "--outer chooses among several boundaries, which --keep-holes refuses",
        ),
        (2, ["flatten", "holed.obj", "-o", "o.obj", "--fill-holes", "--outer", "-1"], "--outer -1: 'holed.obj' has"),
        (
            2,
            ["align", "sheet.obj", "holed.obj", "--fill-holes", "--target-outer", "9999"],
            "--target-outer 9999: 'holed.obj' has the vertices 0 to 438",
        ),
        (2, ["flatten", "sheet.obj", "-o", "o.obj", "--method", "magic"], "invalid choice: 'magic'"),
        (2, ["flatten", "sheet.obj", "-o", "o.obj", "--report", "no/r.json"], "there is no folder 'no'"),
        (2, ["flatten", "sheet.obj", "-o", "o.obj", "--report", "o.obj"], "two outputs have the same name"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_bad_input_is_a_sentence_and_writes_nothing(
    status: int, arguments: list[str], reason: str, scans: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(os.listdir(scans))
    found, _, err = run(capsys, *arguments)
    assert found == status
    assert reason in err
    assert len(err.splitlines()) == 1 or err.startswith("usage:")
    assert sorted(os.listdir(scans)) == before


def test_a_face_with_open_mouth_and_eyes_aligns_with_another_expression(tmp_path: Path) -> None:
    """Vertex i is vertex i where neither is filling."""
    folder = DATA / "faces_ict"
    if not folder.is_dir():
        pytest.skip(f"real data '{folder}' is absent: set MOBIUS_DATA to the folder that holds it")
    row = np.array(json.loads((folder / "ict_ground_truth.json").read_text())["ict_vertex_of_row"])
    source, target = (
        read_surface(files.import_mesh(str(folder / f"{name}.obj")).obj).mesh
        for name in ("ict_neutral_with_holes", "ict_M_happy_level4")
    )
    settings = AlignSettings(reflect="never", fill_holes=True)
    alignment, found = aligned(source, target, settings)
    assert sorted(len(loop) for loop in alignment.source.holes) == [42, 42, 74]
    there = found.matrix() @ source.vertices
    real = np.flatnonzero((row >= 0) & (row < 9409))
    real = real[real < len(source.vertices)]
    error = 100 * np.linalg.norm(there[real] - source.vertices[real], axis=1) / source.diagonal
    assert np.median(error) < 3
    # what closes the mouth and the eyes of the one has no counterpart on the other
    filling = np.setdiff1d(np.arange(len(target.vertices)), real)
    assert found.matched[real].mean() > 0.6
    assert found.matched[filling].mean() < 0.3
