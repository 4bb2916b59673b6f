import pytest
from correspondences import planar_correspondence
from surfaces import planar, rings

from solver import Correspondence, TriangleMesh


@pytest.fixture(scope="module")
def pair() -> tuple[TriangleMesh, TriangleMesh, Correspondence]:
    source, target = planar(rings(12, jitter=0.4, seed=1)), planar(0.9 * rings(9, jitter=0.4, seed=2))
    return source, target, planar_correspondence(source, target)
