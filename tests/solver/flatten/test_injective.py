import numpy as np
import pytest
from surfaces import planar, rings

from solver import topology
from solver.flatten.distortion import signed_areas
from solver.flatten.injective import untangled


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
    collapsed = np.zeros_like(points)
    collapsed[boundary] = points[boundary]
    repaired = untangled(mesh.faces, mesh.edge_lengths, collapsed, boundary)
    assert (signed_areas(repaired, mesh.faces) > 0).all()
    assert (repaired[boundary] == points[boundary]).all()
