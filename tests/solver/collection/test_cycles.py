"""Three-cycles, on maps that are known: which are wrong is found, and paths go round them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scans import bumps, posed

from solver import Mobius, TriangleMesh, flatten
from solver.align.surfaces.prepared import Surface
from solver.collection.chart import Chart, ChartMap, carried_along, mirrored
from solver.collection.cycles import (
    SUSPECT,
    closing_error,
    edge_errors,
    specimen_errors,
    step,
    suspect,
    triangles,
)
from solver.collection.routes import medoid, star_routes, tree_routes
from solver.flatten.domain import DISC
from solver.surface.tidy import Cleaned


@pytest.fixture(scope="module")
def chart() -> Chart:
    mesh = bumps(900, seed=1)
    flat = flatten(mesh)
    samples = np.flatnonzero(np.abs(flat.disc) < 0.9)[::7]
    tidy = Cleaned.unchanged(mesh)
    return Chart(DISC, mesh.vertices, flat.disc, mesh.faces, mesh.vertex_areas, samples, mesh.diagonal, tidy)


def known_maps(chart: Chart, count: int, wrong: set[tuple[int, int]], noise: float, seed: int):
    """Specimens are the same surface, their discs turned at random; maps are right up to noise, but the wrong ones."""
    rng = np.random.default_rng(seed)
    gauges = [
        Mobius(0.5 * np.sqrt(rng.random()) * np.exp(2j * np.pi * rng.random()), 2 * np.pi * rng.random())
        for _ in range(count)
    ]
    charts = [
        Chart(
            DISC,
            chart.vertices,
            g(chart.places),
            chart.faces,
            chart.areas,
            chart.samples,
            chart.diagonal,
            chart.cleaned,
        )
        for g in gauges
    ]
    maps = {}
    for a in range(count):
        for b in range(a + 1, count):
            error = Mobius(noise * (rng.normal() + 1j * rng.normal()), noise * rng.normal())
            if (a, b) in wrong:
                error = Mobius(0.3 * np.exp(2j * np.pi * rng.random()), rng.uniform(1.5, 4.5), bool(rng.random() < 0.4))
            maps[a, b] = ChartMap(charts[a], charts[b], gauges[b] @ error @ gauges[a].inverse())
    return maps


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 8))
def test_wrong_maps_are_found_and_no_others(chart: Chart, seed: int, number: int) -> None:
    count = 9
    rng = np.random.default_rng(seed)
    every = [(a, b) for a in range(count) for b in range(a + 1, count)]
    wrong = {every[k] for k in rng.choice(len(every), number, replace=False)}
    maps = known_maps(chart, count, wrong, 0.01, seed)
    cycles = triangles(every)
    assert len(cycles) == count * (count - 1) * (count - 2) // 6
    errors = edge_errors(every, cycles, np.array([closing_error(maps, cycle) for cycle in cycles.tolist()]))
    found = {edge for edge, bad in zip(every, suspect(errors), strict=True) if bad}
    assert found == wrong
    for path in (
        *star_routes(count, every, np.ones(len(every)), suspect(errors).tolist(), 0).values(),
        *tree_routes(count, every, np.ones(len(every)), suspect(errors).tolist(), 0).values(),
    ):
        # a specimen of which all maps are wrong is reached by one of them
        steps = [(min(a, b), max(a, b)) for a, b in pairwise(path)]
        for edge in steps:
            if edge in wrong:
                assert any(_all_wrong(k, every, wrong) for k in edge)


def _all_wrong(specimen: int, every: list, wrong: set) -> bool:
    return all(edge in wrong for edge in every if specimen in edge)


def test_a_path_carries_points_where_the_truth_is(chart: Chart) -> None:
    maps = known_maps(chart, 5, set(), 0.0, 3)
    path = [step(maps, a, b) for a, b in ((0, 3), (3, 1), (1, 4), (4, 2))]
    start = maps[0, 1].source.places[chart.samples]
    end = maps[1, 2].target
    np.testing.assert_allclose(end.positions(carried_along(start, path)[0]), chart.vertices[chart.samples], atol=1e-9)
    assert not mirrored(path)
    assert closing_error(maps, (0, 1, 2)) < 1e-9


@pytest.mark.parametrize("reflected", [False, True])
def test_a_dense_map_goes_both_ways(chart: Chart, reflected: bool) -> None:
    mobius = Mobius(0.2 + 0.1j, 1.0, reflected)
    target = replace(chart, places=mobius(chart.places))
    if reflected:
        target = replace(target, faces=chart.faces[:, ::-1])
    dense = ChartMap(chart, target, mobius, carried=chart.places)
    points = chart.places[chart.samples]
    there, known = dense.forward(points)
    assert known.all()
    np.testing.assert_allclose(there, mobius(points), atol=1e-9)
    np.testing.assert_allclose(dense.backward(there)[0], points, atol=1e-9)


def test_a_cycle_that_mirrors_cannot_close(chart: Chart) -> None:
    maps = known_maps(chart, 3, set(), 0.0, 1)
    right = maps[0, 1]
    turned = right.mobius @ Mobius(0, 0, True)
    assert closing_error({**maps, (0, 1): ChartMap(right.source, right.target, turned)}, (0, 1, 2)) == 1.0


def test_a_sample_of_triangles_has_some_of_every_pair() -> None:
    every = [(a, b) for a in range(25) for b in range(a + 1, 25)]
    cycles = triangles(every, most=400)
    assert len(cycles) == 400
    assert (np.diff(cycles, axis=1) > 0).all()
    covered = {(a, b) for t in cycles.tolist() for a, b in ((t[0], t[1]), (t[1], t[2]), (t[0], t[2]))}
    assert len(covered) > 0.95 * len(every)
    assert triangles([(0, 1), (1, 2)]).shape == (0, 3)


def test_what_is_in_no_triangle_is_not_known() -> None:
    edges = [(0, 1), (1, 2), (0, 2), (2, 3)]
    errors = edge_errors(edges, triangles(edges), np.array([0.02]))
    np.testing.assert_allclose(errors[:3], 0.02)
    assert np.isnan(errors[3])
    assert not suspect(errors).any()
    assert suspect(np.array([SUSPECT * 1.1])).all()
    by_specimen = specimen_errors(4, edges, errors)
    np.testing.assert_allclose(by_specimen[:3], 0.02)
    assert np.isnan(by_specimen[3])


def test_the_medoid_is_nearest_to_all() -> None:
    places = np.array([0.0, 1.0, 2.1, 3.0, 9.0])
    edges = [(a, b) for a in range(5) for b in range(a + 1, 5)]
    costs = np.array([abs(places[a] - places[b]) for a, b in edges])
    assert medoid(5, edges, costs) == 2
    paths = tree_routes(5, edges, costs, [False] * 10, 2)
    assert paths == {0: [2, 1, 0], 1: [2, 1], 2: [2], 3: [2, 3], 4: [2, 3, 4]}


def test_a_chart_is_of_the_mesh_as_it_is() -> None:
    mesh = posed(bumps(900, seed=2), 1)
    extra = TriangleMesh(np.concatenate([mesh.vertices, [[0, 0, 0]]]), mesh.faces)  # in no face
    chart = Chart.of(Surface(extra, fill_holes=True, largest_part=True), 30)
    np.testing.assert_allclose(chart.positions(chart.places[chart.samples]), chart.vertices[chart.samples], atol=1e-9)
