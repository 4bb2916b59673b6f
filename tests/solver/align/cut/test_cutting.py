"""Bodies beside heads: the head is cut out, and the rest has no counterpart."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import revolved, snowman
from garments import tube_form, woven
from scans import bumps, percent, places, posed, remeshed

from solver import (
    AlignSettings,
    MeshError,
    TriangleMesh,
    align,
    cleaned,
    correspond,
    load_surface,
    prepare,
    report,
    save_surface,
    topology,
)
from solver.align.cut.cutting import MUCH, like_pieces, shrunk
from solver.align.judgement import judge
from solver.align.surfaces.prepared import Surface
from solver.flatten.flatten import flatten
from solver.stages import Stages

SMALL = AlignSettings(samples=60, targets=400, reflect="never")


def head_of(body: TriangleMesh, lowest: float = 0.6) -> TriangleMesh:
    """What of a body lies above its neck."""
    return TriangleMesh(body.vertices, body.faces[body.vertices[body.faces][:, :, 2].min(axis=1) > lowest], "Head")


@pytest.fixture(scope="module")
def pair() -> tuple[TriangleMesh, TriangleMesh, np.ndarray]:
    """A body, its head remeshed in another pose, and the body's vertex of each of the head's."""
    body = snowman(seed=3)
    part = head_of(body)
    used = np.unique(part.faces)
    alone = TriangleMesh(body.vertices[used], np.searchsorted(used, part.faces), "Head")
    head, kept = remeshed(posed(alone, 1), 0.7, 2)
    return body, head, used[kept]


def test_the_head_is_found_on_a_closed_body(pair: tuple[TriangleMesh, TriangleMesh, np.ndarray]) -> None:
    body, head, _ = pair
    alignment = align(head, body, SMALL)
    found = correspond(alignment)
    assert any(said.startswith("'Body' is closed: the piece that fits was found") for said in alignment.warnings)
    above, below = body.vertices[:, 2] > 0.8, body.vertices[:, 2] < 0.2
    assert found.matched[above].mean() > 0.9
    assert not found.matched[below].any()
    assert (found.face[below] == -1).all()
    there = above & found.matched
    assert percent(places(found, head)[there], posed(body, 1).vertices[there], head).mean() < 1.5
    figures = report(alignment, found)
    assert figures["coverage"] == pytest.approx(body.vertex_areas[found.matched].sum() / body.area, abs=0.01)


def test_the_body_may_be_the_source(pair: tuple[TriangleMesh, TriangleMesh, np.ndarray]) -> None:
    body, head, vertex = pair
    found = correspond(align(body, head, SMALL))
    assert found.source_size == len(body.vertices)
    assert percent(places(found, body)[found.matched], body.vertices[vertex[found.matched]], head_of(body)).mean() < 1.5
    assert found.matched.mean() > 0.85


def test_a_vertex_group_says_where_to_cut(pair: tuple[TriangleMesh, TriangleMesh, np.ndarray]) -> None:
    body, head, _ = pair
    cut = prepare(body, SMALL, within=body.vertices[:, 2] > 0.6)
    alignment = align(head, cut, SMALL)
    assert any("cut to a piece of" in said and "as asked" in said for said in alignment.warnings)
    found = correspond(alignment)
    assert found.matched[body.vertices[:, 2] > 0.8].mean() > 0.9
    assert not found.matched[body.vertices[:, 2] < 0.55].any()
    with pytest.raises(MeshError, match="no face among the vertices"):
        prepare(body, SMALL, within=np.zeros(len(body.vertices), bool))


def test_a_person_does_not_go_to_one_disc(data_path: Callable[[str], Path]) -> None:
    """A disc by its topology once the sole of a foot is open, and nearly all of it shrinks to nothing."""
    data = np.load(data_path("heads/mpfb_man_body.npz"))
    corner = data["corner"].reshape(-1, 4)
    skin = corner[data["part"] == data["part"][0]]
    faces = np.concatenate([skin[:, [0, 1, 2]], skin[:, [0, 2, 3]]])
    opened = faces[data["vertices"][faces][:, :, 1].mean(axis=1) > -8.1]
    tidy = cleaned(TriangleMesh(data["vertices"], opened, "Man"), largest_part=True, fill_holes=True)
    assert shrunk(flatten(tidy.mesh, fill_holes=True)) > 2 * MUCH


def person(path: Path) -> tuple[TriangleMesh, np.ndarray]:
    """The skin of a whole body, and which of its vertices are of the head."""
    data = np.load(path)
    corner = data["corner"].reshape(-1, 4)
    skin = corner[data["part"] == data["part"][0]]
    faces = np.concatenate([skin[:, [0, 1, 2]], skin[:, [0, 2, 3]]])
    start, number = data["group_start"], list(data["group_names"]).index("head")
    rows = slice(start[number], start[number + 1])
    inside = np.zeros(len(data["vertices"]), bool)
    inside[data["group_vertex"][rows][data["group_weight"][rows] >= 0.5]] = True
    return TriangleMesh(data["vertices"], faces, path.stem), inside


def test_no_sphere_holds_two_people_and_their_heads_are_aligned(data_path: Callable[[str], Path]) -> None:
    """What is to be done about two whole bodies works: they share their vertices, which is the truth."""
    (woman, of_woman), (man, of_man) = (person(data_path(f"heads/mpfb_{who}_body.npz")) for who in ("woman", "man"))
    for body in (woman, man):
        with pytest.raises(MeshError, match=f"'{body.name}' juts out too far for a sphere: 2.*: cut off what juts out"):
            _ = Surface(body, fill_holes=True, largest_part=True).flattening
    pieces = prepare(woman, SMALL, within=of_woman), prepare(posed(man, 4), SMALL, within=of_man)
    alignment = align(*pieces, SMALL)
    assert judge(alignment).level != "doubtful"
    found = correspond(alignment)
    errors = percent(places(found, woman)[found.matched], woman.vertices[found.matched], alignment.source.mesh)
    assert errors.mean() < 3


def test_of_two_bodies_pieces_that_fit_are_cut_out() -> None:
    """Neither tells which piece of the other is shown: those with most vertices that fit are taken."""
    one, two = snowman(40, 30, seed=3), posed(snowman(36, 28, seed=3), 4)
    surfaces = (Surface(body, fill_holes=True, largest_part=True) for body in (one, two))
    found = like_pieces(*surfaces, replace(SMALL, samples=40, targets=200), Stages(None).part(0, 1))
    assert found is not None
    source, target, (said,) = found
    assert 0.1 < source.cleaned.share < 0.9
    assert abs(source.cleaned.share - target.cleaned.share) < 0.02
    assert said.text.startswith("'Body' and 'Body' jut out too far to be aligned whole")


def test_a_head_goes_to_one_disc(pair: tuple[TriangleMesh, TriangleMesh, np.ndarray]) -> None:
    assert shrunk(flatten(pair[1])) < 0.1 * MUCH


def test_what_does_not_fit_is_refused(pair: tuple[TriangleMesh, TriangleMesh, np.ndarray]) -> None:
    body, head, _ = pair
    with pytest.raises(MeshError, match=r"^'Body' is closed, and of 2 pieces .* none fits 'bumps'"):
        align(bumps(700, seed=3), body, SMALL)
    turn = np.linspace(0, np.pi, 24)
    ball = revolved(-np.cos(turn), np.sin(turn), 24)
    with pytest.raises(MeshError, match=r"^'Body' is closed .*nothing hangs on it by a neck"):
        align(head, ball, SMALL)
    with pytest.raises(MeshError, match="is closed"):
        align(head, body, replace(SMALL, cut=False))


def test_a_sheet_with_thickness_is_called_so() -> None:
    """As Solidify makes it: two sides, and faces between their rims."""
    sheet = bumps(400, seed=3)
    loop, count = topology(sheet).boundary_loops[0], len(sheet.vertices)
    beside = np.roll(loop, -1)
    inner = sheet.vertices - 0.01 * sheet.diagonal * sheet.vertex_normals()
    rim = [np.stack([beside, loop, loop + count], axis=1), np.stack([beside, loop + count, beside + count], axis=1)]
    faces = np.concatenate([sheet.faces, sheet.faces[:, ::-1] + count, *rim])
    thick = TriangleMesh(np.concatenate([sheet.vertices, inner]), faces, "Thick")
    assert not topology(thick).boundary_loops
    with pytest.raises(MeshError, match=r"^'Thick' is closed: a sheet with thickness"):
        align(sheet, thick, SMALL)


def hose(rows: int, columns: int, angle: float, seed: int) -> tuple[TriangleMesh, np.ndarray, np.ndarray]:
    """A tube of 44 radii, its parameters, and the edges along it where it is sewn."""
    mesh, place = woven(tube_form(44, 1.0, seed=2), rows, columns, angle, seed, tube=True)
    line = np.arange(rows) * columns
    return mesh, place, np.stack([line[:-1], line[1:]], axis=1)


def test_what_no_disc_holds_is_cut_open_along_its_seam() -> None:
    (source, _, sewn), (target, place, other) = hose(150, 16, 0.0, 1), hose(130, 14, 1.0, 2)
    with pytest.raises(MeshError, match="'Cloth' is too deep or too long for a disc"):
        align(source, target, SMALL)
    alignment = align(prepare(source, SMALL, within=sewn), prepare(posed(target, 3), SMALL, within=other), SMALL)
    assert "'Cloth': cut open along 149 edges, as asked, for the computation only" in alignment.warnings
    found = correspond(alignment)
    assert len(found.face) == len(target.vertices)
    truth = tube_form(44, 1.0, seed=2)(place[:, 0], place[:, 1], 0.0)
    # on the seam itself either side may be meant
    assert percent(places(found, source), truth, source).mean() < 1.0
    assert found.matched.mean() > 0.95


def test_a_closed_surface_is_cut_open_along_its_seams() -> None:
    body = snowman(seed=3)
    rim = np.flatnonzero(np.isclose(body.vertices[:, 2], 0.5))
    turn = rim[np.argsort(np.arctan2(body.vertices[rim, 1], body.vertices[rim, 0]))]
    cut = prepare(body, SMALL, within=np.stack([turn, np.roll(turn, -1)], axis=1))
    flipped = TriangleMesh(body.vertices, body.faces[:, [0, 2, 1]], "Body")
    again = prepare(flipped, SMALL, within=np.stack([turn, np.roll(turn, -1)], axis=1))
    for surface in (cut, again):
        kept = np.unique(surface.cleaned.origin[surface.cleaned.mesh.faces])
        assert len(surface.flattening.boundary) == len(turn)
        assert body.vertices[kept, 2].max() <= 0.5 + 1e-9  # the body is larger than its head
        assert "to a piece of" in surface.notes[0]
        assert surface.notes[0].endswith("the rest has no counterpart, for the computation only")
    # either way its outside is outside
    inner = cut.mesh.vertices[cut.mesh.faces[0]], again.mesh.vertices[again.mesh.faces[0]]
    assert np.sign(np.linalg.det(inner[0])) == np.sign(np.linalg.det(inner[1]))


def test_seams_that_are_not_inside_are_refused() -> None:
    sheet = bumps(300, seed=1)
    rim = flatten(sheet).boundary
    with pytest.raises(MeshError, match="'bumps' has none of the edges inside along which it was to be cut open"):
        prepare(sheet, SMALL, within=np.stack([rim, np.roll(rim, -1)], axis=1))


def test_a_cut_surface_is_saved_with_its_seam(tmp_path: Path) -> None:
    mesh, _, sewn = hose(40, 10, 0.0, 1)
    one = prepare(mesh, SMALL, within=sewn)
    save_surface(tmp_path / "one.npz", one)
    again = load_surface(tmp_path / "one.npz")
    assert again.within is not None
    assert np.array_equal(again.within, sewn)
    assert np.array_equal(again.flattening.places, one.flattening.places, equal_nan=True)
