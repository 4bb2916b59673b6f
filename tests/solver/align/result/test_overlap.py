from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scans import bumps, mirrored, percent, places, posed, remeshed
from scipy.spatial import KDTree
from surfaces import planar, rings

from solver import AlignSettings, Progress, TriangleMesh, align, correspond, flatten, report, topology
from solver.align.doubt.decision import FITS
from solver.align.maps.pieces import _surely_better
from solver.align.result import overlap
from solver.align.result.confidence import DOUBTFUL
from solver.align.result.overlap import depth_beyond, piece
from solver.flatten.distortion import signed_areas
from solver.surface.nearest import SurfacePoints

SMALL = AlignSettings(samples=60, targets=400, reflect="never")


def cropped(mesh: TriangleMesh, direction: float, share: float) -> tuple[TriangleMesh, np.ndarray]:
    """The mesh without the `share` of its area that lies farthest in a direction of the plane, and its old vertices."""
    height = mesh.vertices[:, :2] @ [np.cos(direction), np.sin(direction)]
    order = np.argsort(-height)
    kept = np.ones(len(height), bool)
    kept[order[np.cumsum(mesh.vertex_areas[order]) < share * mesh.area]] = False
    part = piece(flatten(mesh), kept)
    assert part is not None
    return part.mesh, part.vertices


@given(st.integers(0, 10**6), st.floats(0.02, 0.9))
@settings(max_examples=40, deadline=None)
def test_a_piece_is_a_disc_of_the_wanted_vertices(seed, level):
    """Whatever is left out: islands, holes, strips, corners that merely touch."""
    rng = np.random.default_rng(seed)
    whole = flatten(planar(rings(8, jitter=0.2, seed=seed)))
    place = whole.mesh.vertices[:, :2] @ [1, 1j]
    waves = sum(np.cos((place * np.conj(rng.normal(size=2) @ [4, 4j])).real + rng.uniform(0, 7)) for _ in range(3))
    kept = waves > np.quantile(waves, level)
    part = piece(whole, kept)
    if part is None:
        assert not kept[whole.mesh.faces].all(axis=1).any()
        return
    found = topology(part.mesh)
    assert found.parts == 1
    assert len(found.boundary_loops) == 1
    assert len(found.non_manifold_vertices) == 0
    assert np.array_equal(part.mesh.vertices, whole.mesh.vertices[part.vertices])
    assert np.array_equal(part.vertices[part.mesh.faces], whole.mesh.faces[part.faces])
    rim = np.zeros(len(part.vertices), bool)
    rim[found.boundary_loops[0]] = True
    assert rim[part.outer]
    assert not (part.cut & ~rim).any()
    assert (part.cut | np.isin(part.vertices, whole.boundary))[rim].all()


def test_a_piece_of_everything_is_everything():
    whole = flatten(planar(rings(5)))
    part = piece(whole, np.ones(len(whole.disc), bool))
    assert part is not None
    assert np.array_equal(part.faces, np.arange(len(whole.mesh.faces)))
    assert not part.cut.any()


def test_openings_of_a_piece_stay_open():
    mesh = planar(rings(8))
    place = mesh.vertices[:, :2] @ [1, 1j]
    opened = TriangleMesh(mesh.vertices, mesh.faces[(np.abs(place[mesh.faces] - 0.3) > 0.15).all(axis=1)])
    part = piece(flatten(opened, fill_holes=True), place.real > -0.4)
    assert part is not None
    assert len(topology(part.mesh).boundary_loops) == 2
    assert part.cut.sum() > 3


def test_depth_is_measured_along_the_surface():
    mesh = planar(rings(10))
    surface = SurfacePoints(mesh, (flatten(mesh).boundary,), 0.03)
    points = np.array([[0, 0, 0], [0.2, 0.1, 0.3], [1.5, 0, 0], [0, -1.2, 0.4]])
    depth = depth_beyond(points, np.tile([0.0, 0, 1], (4, 1)), surface)
    assert depth == pytest.approx([0, 0, 0.5, 0.2], abs=0.01)


def test_of_many_points_those_inside_need_not_be_asked(monkeypatch):
    mesh = planar(rings(30))
    surface = SurfacePoints(mesh, (flatten(mesh).boundary,), 0.03)
    rng = np.random.default_rng(3)
    points = np.column_stack([1.3 * rng.normal(size=(800, 2)) / 2, 0.02 * rng.normal(size=800)])
    normals = np.tile([0.0, 0, 1], (800, 1))
    plain = depth_beyond(points, normals, surface)
    assert 100 < (plain > 0).sum() < 700
    monkeypatch.setattr(overlap, "LARGE", 1)
    assert (depth_beyond(points, normals, surface) == plain).all()
    assert not surface.may_be_beyond(points, normals).all()


@pytest.mark.parametrize(
    ("source_cut", "target_cut", "reflected"),
    [(0.05, 0.0, False), (0.3, 0.0, False), (0.0, 0.3, True), (0.15, 0.15, False)],
)
def test_where_each_shows_more_than_the_other_the_rest_is_right(source_cut, target_cut, reflected):
    """Each sheet cut at another side: right where both are, unmatched where there is no counterpart, and said."""
    sheet = bumps(2500, seed=1)
    source, here = cropped(sheet, 0.4, source_cut)
    target, there = cropped(sheet, 2.9, target_cut)
    target, kept = remeshed(posed(mirrored(target) if reflected else target, 2), 0.7, 3)
    chosen = AlignSettings(samples=60, targets=400, reflect="always") if reflected else SMALL
    alignment = align(source, target, chosen)
    found = correspond(alignment)
    vertex = there[kept]
    has = np.isin(vertex, here)
    error = percent(places(found, source), sheet.vertices[vertex], sheet)
    assert error[has].mean() < 0.3
    assert found.matched[has].mean() > 0.9
    if not has.all():
        assert found.matched[~has].mean() < 0.15
    assert any(warning.startswith("partial overlap: ") for warning in alignment.warnings)
    if max(source_cut, target_cut) < 0.1:
        return
    overlap = alignment.overlap
    assert overlap is not None
    assert overlap.alignment.search.certified
    common = sheet.vertex_areas[np.intersect1d(here, there)].sum()
    assert overlap.source_share * source.area == pytest.approx(common, rel=0.05)
    assert overlap.target_share * (1 - target_cut) == pytest.approx(common / sheet.area, rel=0.05)
    assert alignment.counterpart is not None
    both = target.faces[alignment.counterpart[target.faces].all(axis=1)]
    turned = signed_areas(alignment.carried, both) * (-1 if reflected else 1)
    assert (turned > 0).all()
    inner = overlap.alignment
    areas = signed_areas(inner.carried, inner.target.mesh.faces)
    assert ((areas < 0) if reflected else (areas > 0)).all()
    assert np.isfinite(alignment.carried).all()
    assert (np.abs(alignment.carried) <= 1 + 1e-9).all()


def test_where_each_lacks_a_third_the_map_is_doubted():
    """The middle thirds alone show the same: too little for the search, which must not pass for right."""
    sheet = bumps(2500, seed=1)
    source, here = cropped(sheet, 0.4, 0.3)
    target, there = cropped(sheet, 2.9, 0.3)
    alignment = align(source, posed(target, 2), SMALL)
    found = correspond(alignment)
    error = percent(places(found, source), sheet.vertices[there], sheet)
    assert (error[np.isin(there, here)].mean() < 1) != any(said.startswith("doubtful: ") for said in alignment.warnings)
    assert (error < 2)[found.matched].mean() > 0.9 or found.matched.mean() < 0.1


@pytest.mark.parametrize("seed", [3, 4])
def test_where_the_best_map_does_not_fit_the_next_is_taken(seed):
    """The middle alone shows the same, and another place of the other sheet has more samples like it."""
    sheet = bumps(2500, seed=seed)
    source, here = cropped(sheet, 2.0, 0.3)
    target, there = cropped(sheet, 4.5, 0.3)
    target, kept = remeshed(posed(target, 2), 0.7, 3)
    told: list[Progress] = []
    alignment = align(source, target, SMALL, told.append)
    assert any(step.stage == "Trying another map" for step in told)
    assert (np.diff([step.fraction for step in told]) >= 0).all()
    assert told[-1].fraction <= 1
    assert alignment.search.certified
    assert alignment.taken is not None
    assert alignment.value == alignment.taken.value < alignment.search.value
    assert not alignment.certified
    said = report(alignment, correspond(alignment))
    assert said["rival_taken"]
    assert not said["certified"]
    assert said["value"] == alignment.value
    assert said["gap"] == alignment.search.upper_bound - alignment.value > 0
    assert any(warning.startswith("reconsidered: ") for warning in alignment.warnings)
    error = percent(places(correspond(alignment), source), sheet.vertices[there[kept]], sheet)
    assert error[np.isin(there[kept], here)].mean() < 0.3
    # the search's best, as asked for by whoever does not want it reconsidered
    winner = align(source, target, replace(SMALL, refine="mobius"))
    assert winner.taken is None
    assert winner.search.value == alignment.search.value


@pytest.mark.parametrize(("cut", "unlike", "vertices", "seed"), [(0.3, 0.15, 2500, 5), (0.25, 0.02, 900, 0)])
def test_opposite_sides_of_something_symmetric_are_not_taken_for_mirror_images(cut, unlike, vertices, seed):
    """The left of one scan and the right of the other are missing, so that mirrored they have more in common.

    The second pair's map is found by the source's plane of symmetry alone: the search shows none near it.
    """
    disc = bumps(vertices, seed=1)
    x, y = disc.vertices[:, :2].T
    rng, height = np.random.default_rng(seed), np.zeros(len(x))
    for _ in range(7):
        (u, v), size, width = rng.uniform((0.15, -0.7), (0.8, 0.7)), rng.uniform(-0.25, 0.25), rng.uniform(6, 40)
        for side in (1, -1):
            height += (1 + unlike * side) * size * np.exp(-width * ((x - side * u) ** 2 + (y - v) ** 2))
    sheet = TriangleMesh(np.column_stack([x, y, height]), disc.faces)
    source, here = cropped(sheet, np.pi - 0.1, cut)
    target, there = cropped(sheet, 0.1, cut)
    target, kept = remeshed(posed(target, 2), 0.7, 3)
    alignment = align(source, target, replace(SMALL, reflect="auto"))
    assert alignment.other is not None
    assert alignment.other.mobius.reflected
    assert alignment.margin < -alignment.settings.reflect_margin
    assert not alignment.mobius.reflected
    assert alignment.warnings[0].startswith("ambiguous orientation: mirrored, ")
    # nothing is said of the mirrored search and its rival
    assert not any(said.startswith(("ambiguous: ", "not proved")) for said in alignment.warnings)
    error = percent(places(correspond(alignment), source), sheet.vertices[there[kept]], sheet)
    assert error[np.isin(there[kept], here)].mean() < 2
    # landmarks have the last word, and whoever asks for one orientation
    chosen = np.arange(100, len(source.vertices), 300)
    image = sheet.vertices[here[chosen], :2] * [-1, 1]
    pairs = np.stack([chosen, KDTree(sheet.vertices[there[kept], :2]).query(image)[1]], axis=1)
    assert align(source, target, replace(SMALL, reflect="auto"), landmarks=pairs).mobius.reflected
    assert align(source, target, replace(SMALL, reflect="always")).mobius.reflected


def test_bent_sheets_may_overlap_in_part():
    """Rolled up by 150 degrees, and the flat one cropped: no rigid pose fits, and yet it is seen what is missing."""
    flat, rolled = bumps(2500, seed=1), bumps(2500, seed=1, bend=2.6)
    source, here = cropped(flat, 0.4, 0.15)
    alignment = align(source, posed(rolled, 9), SMALL)
    found = correspond(alignment)
    has = np.isin(np.arange(len(rolled.vertices)), here)
    assert percent(places(found, source), flat.vertices, flat)[has].mean() < 1
    assert found.matched[~has].mean() < 0.15
    assert alignment.counterpart is not None
    assert alignment.counterpart[has].mean() > 0.95


def test_surfaces_that_show_the_same_are_left_whole():
    """Though the boundary of one is ragged."""
    sheet = bumps(2500, seed=1)
    rng = np.random.default_rng(0)
    kept = np.ones(len(sheet.vertices), bool)
    rim = flatten(sheet).boundary
    kept[rng.choice(rim, len(rim) // 3, replace=False)] = False
    part = piece(flatten(sheet), kept)
    assert part is not None
    alignment = align(part.mesh, posed(sheet, 2), SMALL)
    assert alignment.overlap is None
    assert alignment.bending is not None
    assert not any("partial" in warning for warning in alignment.warnings)


def test_pieces_that_match_no_better_than_chance_are_not_cut_out():
    """Half the samples here and half there differ from the same half by nothing; other shares by their spread."""
    half, rng = np.repeat([0.0, 1.0], 50), np.random.default_rng(0)
    assert not _surely_better(half, half)
    assert not _surely_better(np.repeat([0.0, 1.0], [45, 55]), half)
    assert _surely_better(np.repeat([0.0, 1.0], [30, 70]), half)
    taken = [_surely_better(rng.random(100), rng.random(100)) for _ in range(2000)]
    assert np.mean(taken) == pytest.approx(0.05, abs=0.02)


def test_a_cropped_face_is_found_on_another_persons(real_mesh):
    """The lower 15 % of one face cut off, the other posed and remeshed."""
    source, other = (real_mesh(f"faces_simpop/SIMPOP_{number}.obj") for number in ("01", "10"))
    height = source.vertices[:, 1]
    part = piece(flatten(source), height > np.quantile(height, 0.15))
    assert part is not None
    target, vertex = remeshed(posed(other, 1), 0.7, 2)
    alignment = align(part.mesh, target, AlignSettings(reflect="never"))
    found = correspond(alignment)
    has = np.isin(vertex, part.vertices)
    assert percent(places(found, part.mesh), source.vertices[vertex], source)[has].mean() < 0.5
    assert found.matched[~has].mean() < 0.1
    assert found.matched[has].mean() > 0.95


def test_what_may_only_be_stretched_is_not_missing_without_a_word(real_mesh):
    """Teeth of two genera: a landmark on the one's edge has its counterpart well within the other's."""
    source, target = (real_mesh(f"teeth/{name}.obj") for name in ("T14", "x17"))
    alignment = align(source, target)
    assert any(warning.startswith("partial overlap: ") for warning in alignment.warnings)
    assert DOUBTFUL < alignment.mean_confidence < FITS
    assert any(warning.startswith("unsure: ") for warning in alignment.warnings)


def test_what_is_surely_missing_is_said_to_be(real_mesh):
    source = real_mesh("faces_simpop/SIMPOP_01.obj")
    face = source.vertices[source.faces].mean(axis=1)
    axis = np.linalg.svd(source.vertices - source.vertices.mean(axis=0), full_matrices=False)[2][0]
    kept = source.faces[face @ axis > np.quantile(face @ axis, 0.2)]
    used, corners = np.unique(kept, return_inverse=True)
    part = TriangleMesh(source.vertices[used], corners.reshape(-1, 3), "part")
    alignment = align(source, part)
    assert alignment.overlap is not None
    assert not any(warning.startswith("unsure: ") for warning in alignment.warnings)
