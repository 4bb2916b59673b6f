import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surfaces import planar, rings

from solver import topology
from solver.flatten.distortion import signed_areas
from solver.flatten.injective import collapsed, relocated, untangled


def test_a_map_without_folds_is_left_alone():
    points = rings(8)
    mesh = planar(points)
    assert untangled(mesh.faces, mesh.edge_lengths, points, topology(mesh).boundary_loops[0]) is points


@pytest.mark.parametrize("seed", range(5))
def test_a_fold_is_put_right_and_the_rest_stays(seed):
    points = rings(20, jitter=0.3)
    mesh = planar(points)
    boundary = topology(mesh).boundary_loops[0]
    rng = np.random.default_rng(seed)
    bad = rng.integers(200)
    folded = points.copy()
    folded[bad] += 0.15 * np.exp(2j * np.pi * rng.uniform())
    assert (signed_areas(folded, mesh.faces) <= 0).any()
    repaired = untangled(mesh.faces, mesh.edge_lengths, folded, boundary)
    assert (signed_areas(repaired, mesh.faces) > 0).all()
    assert (repaired[np.abs(points - points[bad]) > 0.5] == points[np.abs(points - points[bad]) > 0.5]).all()


def test_everything_in_one_point_is_put_right():
    points = rings(10)
    mesh = planar(points)
    boundary = topology(mesh).boundary_loops[0]
    together = np.zeros_like(points)
    together[boundary] = points[boundary]
    repaired = untangled(mesh.faces, mesh.edge_lengths, together, boundary)
    assert (signed_areas(repaired, mesh.faces) > 0).all()
    assert (repaired[boundary] == points[boundary]).all()


def test_what_only_rounding_keeps_apart_counts_as_collapsed():
    """Two vertices within a last digit: floats say of triangles between them that they are not turned, wrongly."""
    points = rings(10)
    mesh = planar(points)
    boundary = topology(mesh).boundary_loops[0]
    inner = np.setdiff1d(mesh.edges[~np.isin(mesh.edges, boundary).any(axis=1)], boundary)
    found = 0
    for vertex in inner.tolist():
        other = next(x for x in mesh.edges[(mesh.edges == vertex).any(axis=1)].ravel() if x in inner and x != vertex)
        for last in (1, -1, 1j, -1j):
            near = points.copy()
            near[vertex] = points[other] + last * 1e-17
            near = np.exp(0.3j) * near
            wrong = collapsed(near, mesh.faces) & (signed_areas(near, mesh.faces) > 0)
            if wrong.any() and not (signed_areas(near, mesh.faces) < 0).any():
                found += 1
                repaired = untangled(mesh.faces, mesh.edge_lengths, near, boundary)
                assert not collapsed(repaired, mesh.faces).any()
    assert found


def test_slivers_far_apart_are_put_right_by_their_own_vertices_alone():
    points = rings(30, jitter=0.3)
    mesh = planar(points)
    boundary = topology(mesh).boundary_loops[0]
    rng = np.random.default_rng(3)
    apart = [k for k in rng.permutation(len(points)) if abs(points[k]) < 0.85][:12]
    turned = points.copy()
    for vertex in apart:  # across the side opposite it
        face = mesh.faces[(mesh.faces == vertex).any(axis=1)][0]
        others = points[face[face != vertex]].mean()
        turned[vertex] += 1.3 * (others - turned[vertex])
    before = signed_areas(turned, mesh.faces) <= 0
    assert before.sum() >= 12
    repaired = untangled(mesh.faces, mesh.edge_lengths, turned, boundary)
    assert (signed_areas(repaired, mesh.faces) > 0).all()
    assert set(np.flatnonzero(repaired != turned)) <= set(mesh.faces[before].ravel())


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6), st.floats(0.001, 0.05))
def test_what_is_hardly_tangled_comes_right_with_no_vertex_of_the_rim_moved(seed, amount):
    points = rings(6, jitter=0.2)  # edges of a sixth
    mesh = planar(points)
    boundary = topology(mesh).boundary_loops[0]
    rng = np.random.default_rng(seed)
    tangled = points + amount * np.exp(2j * np.pi * rng.random(len(points))) * (rng.random(len(points)) < 0.3)
    tangled[boundary] = points[boundary]
    found = relocated(tangled, mesh.faces, boundary)
    assert (found[boundary] == points[boundary]).all()
    assert (signed_areas(found, mesh.faces) > 0).all()
