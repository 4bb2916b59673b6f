import json
from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, mirrored, mutual_pairs, percent, places, posed, remeshed, shuffled

from solver import Alignment, AlignSettings, Cancelled, MeshError, TriangleMesh, align, correspond, report
from solver.align.maps import mobius_map
from solver.align.surfaces.objective import compatibility, covering_radius
from solver.mobius import hyperbolic_distance

SMALL = AlignSettings(samples=40, targets=300, reflect="never")
"""Enough for the surfaces here, and fast."""


@pytest.fixture(scope="module")
def sheet():
    return bumps(900, seed=1)


@pytest.fixture(scope="module")
def found(sheet):
    """The sheet carried to its posed and remeshed self."""
    target, vertex = remeshed(posed(sheet, 5), 0.6, 6)
    return align(sheet, target, SMALL), vertex


def distance_apart(a: Alignment, b: Alignment, mesh: TriangleMesh) -> np.ndarray:
    """How far apart, in % of the source's diagonal, the target's vertices land."""
    return percent(places(correspond(a), mesh), places(correspond(b), mesh), mesh)


@pytest.mark.parametrize("second", ["ict_M_happy_level4", "ict_F_neutral"])
def test_faces_of_one_family_come_out_right(real_mesh, second):
    """Another expression, another person; the target posed, scaled, with 60 % of the vertices, triangulated anew."""
    source, other = real_mesh("faces_ict/ict_M_neutral.obj"), real_mesh(f"faces_ict/{second}.obj")
    target, vertex = remeshed(posed(other, 1), 0.6, 2)
    alignment = align(source, target, SMALL)
    error = percent(places(correspond(alignment), source), source.vertices[vertex], source)
    assert alignment.search.certified
    assert error.mean() < 3
    assert np.quantile(error, 0.95) < 6


def test_teeth_of_one_genus_come_out_right(real_mesh, data_path):
    source, other = real_mesh("teeth/K04.obj"), real_mesh("teeth/K05.obj")
    landmarks = json.loads(data_path("teeth/landmarks.json").read_text())
    here, there = (np.array(landmarks[name]["landmark_vertex"]) for name in ("K04", "K05"))
    target, vertex = remeshed(posed(other, 3), 0.7, 4)
    # landmarks are vertices that may be gone: the nearest that stayed
    stayed = np.linalg.norm(other.vertices[vertex][None] - other.vertices[there][:, None], axis=2).argmin(axis=1)
    alignment = align(source, target, SMALL)
    assert alignment.search.certified
    assert mutual_pairs(places(correspond(alignment), source)[stayed], source.vertices[here]) >= 16


def test_a_surface_matches_itself(sheet):
    alignment = align(sheet, sheet, SMALL)
    assert percent(places(correspond(alignment), sheet), sheet.vertices, sheet).max() < 0.1
    assert abs(alignment.mobius.z) < 1e-3
    assert abs(np.angle(np.exp(1j * alignment.mobius.theta))) < 1e-3


def test_pose_scale_and_triangulation_do_not_matter(sheet, found):
    alignment, vertex = found
    assert percent(places(correspond(alignment), sheet), sheet.vertices[vertex], sheet).mean() < 0.7


def test_a_similarity_of_the_source_changes_nothing(sheet, found):
    alignment, _ = found
    moved = align(posed(sheet, 7), alignment.target.mesh, SMALL)
    assert moved.search.value == pytest.approx(alignment.search.value, abs=1e-3)
    assert distance_apart(alignment, moved, sheet).max() < 0.05


def test_the_order_of_vertices_and_faces_changes_nothing(sheet, found):
    alignment, _ = found
    mixed, vertex = shuffled(sheet, 8)
    other = align(mixed, alignment.target.mesh, SMALL)
    assert np.array_equal(np.sort(vertex[other.source_samples]), np.sort(alignment.source_samples))
    apart = percent(places(correspond(alignment), sheet), places(correspond(other), mixed), sheet)
    assert apart.mean() < 0.05
    assert apart.max() < 0.5


def test_there_and_back(sheet, found):
    """align(A, B) and align(B, A) are inverse to within the sampling."""
    alignment, _ = found
    back = align(alignment.target.mesh, sheet, SMALL)
    round_trip = (back.mobius @ alignment.mobius)(alignment.source.disc)
    assert np.abs(round_trip - alignment.source.disc).max() < 0.03


def test_bending_does_not_matter():
    """Rolled up by 150 degrees no rigid motion fits, but lengths and angles stay nearly what they were."""
    flat, rolled = bumps(900, seed=1), bumps(900, seed=1, bend=2.6)
    alignment = align(flat, posed(rolled, 9), SMALL)
    assert percent(places(correspond(alignment), flat), flat.vertices, flat).mean() < 3


def test_a_reflected_copy_is_found_and_named(sheet):
    alignment = align(sheet, posed(mirrored(sheet), 10), AlignSettings(samples=40, targets=300, reflect="auto"))
    assert alignment.mobius.reflected
    assert alignment.search.mobius.reflected
    assert alignment.margin is not None
    assert alignment.margin > alignment.settings.reflect_margin
    assert percent(places(correspond(alignment), sheet), sheet.vertices, sheet).max() < 0.1


def test_a_mirror_symmetric_surface_is_not_reflected_and_a_tie_of_the_samples_is_no_news():
    """Bent, the map that is not mirrored is as sure as can be; before that it is not known, and said."""
    sheet = bumps(900, seed=1)
    x, y = sheet.vertices[:, :2].T
    even = TriangleMesh(np.column_stack([x, y, 0.2 * np.exp(-8 * (x - 0.4) ** 2 - 8 * y**2)]), sheet.faces)
    chosen = AlignSettings(samples=30, targets=200, reflect="auto")
    alignment = align(even, posed(even, 11), chosen)
    assert not alignment.mobius.reflected
    assert not any("ambiguous orientation" in warning for warning in alignment.warnings)
    before = align(even, posed(even, 11), replace(chosen, refine="mobius"))
    assert any("ambiguous orientation" in warning for warning in before.warnings)


@pytest.mark.parametrize("folds", [2, 3])
def test_a_rotational_symmetry_is_called_ambiguous(folds):
    """The rival is the winner and a turn by a symmetry, and can be had instead."""
    even = bumps(900, seed=1, folds=folds)
    alignment = align(even, posed(even, 11), SMALL)
    assert any(warning.startswith("ambiguous: ") for warning in alignment.warnings)
    assert alignment.rival is not None
    assert alignment.rival_margin is not None
    assert alignment.rival_margin < alignment.settings.reflect_margin
    step = alignment.rival.mobius.inverse() @ alignment.mobius
    turn = step.theta * folds / (2 * np.pi)
    assert abs(step.z) < 0.1
    assert abs(turn - round(turn)) < 0.1
    assert round(turn) % folds != 0
    other = align(even, posed(even, 11), replace(SMALL, take_rival=True))
    middle = np.abs(other.source.disc) < 0.5
    assert (
        np.abs((other.mobius.inverse() @ other.rival.mobius)(other.source.disc) - other.source.disc)[middle].max() < 0.1
    )


def test_an_odd_sheet_is_not_ambiguous(found):
    alignment, _ = found
    assert not any("ambiguous" in warning for warning in alignment.warnings)
    assert alignment.rival_margin > 2 * alignment.settings.reflect_margin


def test_a_margin_that_time_decided_is_not_told(found):
    alignment, _ = found
    late = replace(alignment, rival=replace(alignment.rival, out_of_time=True))
    assert late.rival_margin is None
    assert report(late, correspond(late))["rival_margin"] is None
    assert replace(alignment, search=replace(alignment.search, out_of_time=True)).rival_margin is None
    assert alignment.rival_margin == (alignment.search.value - alignment.rival.upper_bound) / 40


def test_landmarks_decide_what_the_surface_leaves_open():
    """On a sheet with a two-fold symmetry ten landmarks, two of them wrong, choose the half turn or none."""
    even = bumps(900, seed=1, folds=2)
    rng = np.random.default_rng(0)
    place = even.vertices[:, :2] @ [1, 1j]
    inner = np.flatnonzero(np.abs(place) < 0.8)
    chosen = rng.choice(inner, 10, replace=False)
    for half_turn in (False, True):
        there = np.array([np.abs(place - (-place[v] if half_turn else place[v])).argmin() for v in chosen])
        there[:2] = rng.choice(inner, 2)
        alignment = align(even, posed(even, 12), SMALL, landmarks=np.column_stack([chosen, there]))
        expected = even.vertices * ([-1, -1, 1] if half_turn else [1, 1, 1])
        assert percent(places(correspond(alignment), even), expected, even).mean() < 2
        assert not any(warning.startswith("ambiguous: ") for warning in alignment.warnings)


def test_landmarks_that_cannot_be_used(sheet, found):
    target = found[0].target
    for wrong, named in (([[1, 2, 3]], "shape"), ([[0.5, 1]], "whole"), ([[0, 10**6]], "outside")):
        with pytest.raises(ValueError, match=named):
            align(sheet, target.mesh, SMALL, landmarks=wrong)
    on_rim = align(sheet, target.mesh, SMALL, landmarks=[[5, target.boundary[0]]])
    assert any("1 landmark on a boundary" in warning for warning in on_rim.warnings)


def test_matches_are_pairs_of_samples_near_each_other(found):
    alignment, _ = found
    source = alignment.source.disc[alignment.source_samples]
    target = alignment.target.disc[alignment.target_samples]
    j, k = alignment.search.matches.T
    assert len(j) > len(source) / 2
    apart = hyperbolic_distance(alignment.search.mobius(source[j]), target[k])
    assert (apart <= covering_radius(target)[k] + 1e-9).all()


def test_compatibility_is_how_rare_it_is_to_be_so_alike():
    there = np.arange(10.0)[:, None]
    weights = compatibility(np.array([[0.0], [20.0]]), there, 0.4)
    expected = np.array([7, 5, 3, 1, 0, 0, 0, 0, 0, 0]) / 8
    assert weights == pytest.approx(np.stack([expected, expected[::-1]]))
    assert compatibility(np.array([[0.0], [2000.0]]), 100 * there, 0.4) == pytest.approx(weights)


def test_progress_runs_forward_and_can_cancel(sheet, found):
    seen = []
    target = found[0].target.mesh
    align(sheet, target, SMALL, lambda state: seen.append(state))
    fractions = [state.fraction for state in seen]
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] <= fractions[-1] <= 1
    assert len({state.stage for state in seen}) >= 4
    with pytest.raises(Cancelled):
        align(sheet, target, SMALL, lambda state: state.stage != "Searching")


def test_no_time_still_gives_a_map_and_says_so(sheet, found):
    hurried = AlignSettings(samples=40, targets=300, reflect="never", time_limit=0.0)
    alignment = align(sheet, found[0].target.mesh, hurried)
    assert not alignment.search.certified
    assert alignment.search.upper_bound >= found[0].search.value
    assert any("not proved optimal" in warning for warning in alignment.warnings)


@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_a_search_that_takes_long_ends_within_its_gap_and_says_so(sheet, found, monkeypatch, gap: float):
    monkeypatch.setattr(mobius_map, "PROVING", 1)
    alignment = align(sheet, found[0].target.mesh, replace(SMALL, gap=gap))
    best = found[0].search.value
    assert alignment.search.value <= best <= alignment.search.upper_bound <= (1 + gap) * alignment.search.value
    assert alignment.search.certified == (gap == 0)
    assert any("not proved optimal" in warning for warning in alignment.warnings) == (gap > 0)


def test_report_is_plain_data(found):
    alignment, _ = found
    said = json.loads(json.dumps(report(alignment, correspond(alignment))))
    assert said["certified"] is True
    assert said["value"] == said["upper_bound"]
    assert 0.8 < said["coverage"] <= 1
    assert sum(said["seconds"].values()) > 0


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"reflect": "maybe"}, "reflect"),
        ({"refine": "twice"}, "refine"),
        ({"samples": 2}, "samples"),
        ({"targets": 0}, "targets"),
        ({"z_max": 1.0}, "z_max"),
        ({"radius": 1.5}, "radius"),
        ({"compatible": 0.0}, "compatible"),
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong, named):
    with pytest.raises(ValueError, match=named):
        AlignSettings(**wrong)


def test_what_is_no_disc_is_refused(sheet):
    closed = TriangleMesh(np.eye(4)[:, :3], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], "Scan")
    with pytest.raises(MeshError, match=r"^'Scan' is closed"):
        align(sheet, closed, SMALL)
