import numpy as np
import pytest
from scans import bumps, posed, remeshed

from solver import TriangleMesh, flatten
from solver.bend.moments import posed as in_best_pose
from solver.bend.plate import NORMAL_WEIGHT
from solver.surface.nearest import SurfacePoints


def prepared(mesh: TriangleMesh) -> SurfacePoints:
    """The mesh in roots of its area, ready to be lain on."""
    unit = TriangleMesh(mesh.vertices / np.sqrt(mesh.area), mesh.faces)
    return SurfacePoints(unit, (flatten(mesh).boundary,), NORMAL_WEIGHT)


@pytest.mark.parametrize("seed", range(6))
def test_a_turned_and_remeshed_surface_is_put_back(seed):
    """Whatever the pose: a round sheet, whose two long axes have nearly the same moment."""
    source = bumps(1500, seed=seed)
    target, kept = remeshed(posed(source, seed), 0.3, seed)
    onto = prepared(source)
    places, apart = in_best_pose(TriangleMesh(target.vertices / np.sqrt(target.area), target.faces), onto, onto)
    expected = source.vertices[kept] / np.sqrt(source.area)
    assert np.linalg.norm(places - expected, axis=1).mean() < 0.01
    assert apart < 0.02


def test_the_mirror_image_lies_worse():
    source = bumps(1500, seed=1)
    onto = prepared(source)
    image = TriangleMesh(onto.mesh.vertices * [-1, 1, 1], onto.mesh.faces[:, ::-1])
    assert in_best_pose(image, onto, onto)[1] > 3 * in_best_pose(onto.mesh, onto, onto)[1]
