import numpy as np
import pytest
from scans import bumps, similarity
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from solver import TriangleMesh
from solver.surface import sampling
from solver.surface.sampling import edge_graph, extrema, farthest_points, thinned


@pytest.fixture(scope="module")
def mesh():
    return bumps(400, seed=4)


def test_extrema_are_above_or_below_all_neighbours(mesh):
    values = np.random.default_rng(0).normal(size=len(mesh.vertices))
    allowed = np.arange(len(values)) % 5 != 0
    neighbours = [set() for _ in values]
    for i, j in mesh.edges.tolist():
        neighbours[i].add(j)
        neighbours[j].add(i)
    expected = {
        v
        for v, around in enumerate(neighbours)
        if allowed[v] and (values[v] > max(values[list(around)]) or values[v] < min(values[list(around)]))
    }
    found = extrema(mesh, values, allowed)
    assert set(found.tolist()) == expected
    assert (np.diff(np.abs(values[found])) <= 0).all()


def test_farthest_points_against_brute_force(mesh):
    distance = dijkstra(edge_graph(mesh))
    allowed = np.hypot(*mesh.vertices[:, :2].T) < 0.95
    chosen = [7, 50]
    while len(chosen) < 40:
        to_chosen = np.where(allowed, distance[chosen].min(axis=0), -1)
        chosen.append(int(np.argmax(to_chosen)))
    assert farthest_points(mesh, 40, np.array([7, 50]), allowed).tolist() == chosen


def test_the_first_is_the_deepest_inside(mesh):
    allowed = np.hypot(*mesh.vertices[:, :2].T) < 0.95
    depth = dijkstra(edge_graph(mesh))[~allowed].min(axis=0)
    first = farthest_points(mesh, 1, np.empty(0, np.intp), allowed)
    assert depth[first[0]] == depth.max()


def test_no_more_than_there_are(mesh):
    allowed = np.zeros(len(mesh.vertices), bool)
    allowed[[3, 9, 11]] = True
    found = farthest_points(mesh, 10, np.empty(0, np.intp), allowed)
    assert sorted(found.tolist()) == [3, 9, 11]


def test_edge_graph_holds_lengths():
    triangle = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    assert edge_graph(triangle).toarray().tolist() == [[0, 3, 4], [3, 0, 5], [4, 5, 0]]


@pytest.mark.parametrize("spacing", [0.02, 0.1, 0.5, 5.0])
def test_thinned_points_keep_apart_and_near_all_others(spacing):
    points = np.concatenate([bumps(20000, seed=4).vertices, np.zeros((3, 3))])
    kept = thinned(points, spacing)
    assert (np.diff(kept) > 0).all()
    tree = KDTree(points[kept])
    assert len(tree.query_pairs(spacing)) == 0
    assert tree.query(points)[0].max() < 2 * spacing


def test_thinned_points_do_not_depend_on_pose_or_order():
    points = bumps(3000, seed=2).vertices
    rng = np.random.default_rng(1)
    scale, turn, shift = similarity(rng)
    order = rng.permutation(len(points))
    kept = thinned((scale * points @ turn + shift)[order], scale * 0.1)
    assert sorted(order[kept].tolist()) == thinned(points, 0.1).tolist()


@pytest.mark.parametrize("seed", range(3))
def test_on_large_meshes_the_same_points_are_farthest(monkeypatch: pytest.MonkeyPatch, seed: int):
    """With two parts, of which one has no point at first, and a vertex in no face."""
    one, other = bumps(1500, seed=seed), bumps(300, seed=seed + 10)
    vertices = np.concatenate([one.vertices, other.vertices + 9, [[0, 0, 7]]])
    mesh = TriangleMesh(vertices, np.concatenate([one.faces, other.faces + len(one.vertices)]))
    allowed = np.random.default_rng(seed).random(len(vertices)) < 0.7
    for first in (np.empty(0, np.intp), np.flatnonzero(allowed)[:3]):
        plain = farthest_points(mesh, 200, first, allowed)
        with monkeypatch.context() as patch:
            patch.setattr(sampling, "LARGE", 1)
            assert farthest_points(mesh, 200, first, allowed).tolist() == plain.tolist()
