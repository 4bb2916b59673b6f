import numpy as np
import pytest
from scans import bumps
from scipy.spatial.transform import Rotation
from surfaces import planar, rings

from solver import TriangleMesh, prepare
from solver.align.doubt.own_mirror import mirror_plane
from solver.surface.nearest import SurfacePoints


def sheet(seed: int) -> TriangleMesh:
    """A symmetric sheet with hills, of which a strip at one side is missing, turned and moved."""
    disc = bumps(900, seed=1)
    x, y = disc.vertices[:, :2].T
    rng, height = np.random.default_rng(seed), np.zeros(len(x))
    for _ in range(14):
        (u, v), size, width = rng.uniform((0.1, -0.7), (0.8, 0.7)), rng.uniform(-0.3, 0.3), rng.uniform(10, 60)
        height += size * np.exp(-width * ((x - u) ** 2 + (y - v) ** 2))
        height += size * np.exp(-width * ((x + u) ** 2 + (y - v) ** 2))
    points = Rotation.from_rotvec([0.4, -1, 2]).apply(np.column_stack([x, y, height]))
    return TriangleMesh(points + np.array([3, 1, -2]), disc.faces[(x[disc.faces] > -0.45).all(axis=1)])


@pytest.mark.parametrize("seed", range(3))
def test_the_plane_of_a_part_is_found(seed: int):
    surface = prepare(sheet(seed))
    mesh = surface.flattening.mesh
    scale = 1 / np.sqrt(mesh.area)
    onto = SurfacePoints(TriangleMesh(mesh.vertices * scale, mesh.faces), (), 0.1)
    plane = mirror_plane(onto, surface.descriptors())
    assert plane is not None
    normal, middle = plane
    turn = Rotation.from_rotvec([0.4, -1, 2])
    assert abs(normal @ turn.apply([1, 0, 0])) > np.cos(np.radians(2))
    assert abs((middle / scale - [3, 1, -2]) @ turn.apply([1, 0, 0])) < 0.02


def test_a_screw_has_none():
    """Every part of it winds the same way."""
    disc = planar(rings(14)).vertices
    radius, angle = 0.8 + 0.5 * disc[:, 0], 2 * disc[:, 1]
    screw = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.8 * angle])
    surface = prepare(TriangleMesh(screw, planar(rings(14)).faces))
    mesh = surface.flattening.mesh
    onto = SurfacePoints(TriangleMesh(mesh.vertices / np.sqrt(mesh.area), mesh.faces), (), 0.1)
    assert mirror_plane(onto, surface.descriptors()) is None
