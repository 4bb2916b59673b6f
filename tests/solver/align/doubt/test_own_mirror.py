from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from scans import bumps
from scipy.spatial.transform import Rotation
from surfaces import planar, rings

from solver import AlignSettings, TriangleMesh, align, prepare
from solver.align.doubt.opposite import with_sides_open
from solver.align.doubt.own_mirror import mirror_plane
from solver.align.judgement import judge
from solver.bend.draft import ready


def sheet(seed: int, least: float = -0.45) -> TriangleMesh:
    """A symmetric sheet with hills, of which a strip at one side is missing, turned and moved."""
    disc = bumps(900, seed=1)
    x, y = disc.vertices[:, :2].T
    rng, height = np.random.default_rng(seed), np.zeros(len(x))
    for _ in range(14):
        (u, v), size, width = rng.uniform((0.1, -0.7), (0.8, 0.7)), rng.uniform(-0.3, 0.3), rng.uniform(10, 60)
        height += size * np.exp(-width * ((x - u) ** 2 + (y - v) ** 2))
        height += size * np.exp(-width * ((x + u) ** 2 + (y - v) ** 2))
    points = Rotation.from_rotvec([0.4, -1, 2]).apply(np.column_stack([x, y, height]))
    return TriangleMesh(points + np.array([3, 1, -2]), disc.faces[(x[disc.faces] > least).all(axis=1)])


@pytest.mark.parametrize(("seed", "least"), [*product(range(3), [-1.0, -0.45, -0.3]), (0, -0.22), (1, -0.22)])
def test_the_plane_of_a_part_is_found(seed: int, least: float):
    """Also where little of what is on one side is on the other too: of the third sheet with least it is missed."""
    onto = ready(prepare(sheet(seed, least)).flattening)
    plane = mirror_plane(onto)
    assert plane is not None
    normal, middle = plane
    turn = Rotation.from_rotvec([0.4, -1, 2])
    mesh = prepare(sheet(seed, least)).flattening.mesh
    shift = mesh.vertices[0] / np.sqrt(mesh.area) - onto.mesh.vertices[0]
    assert abs(normal @ turn.apply([1, 0, 0])) > np.cos(np.radians(2))
    assert abs(((middle + shift) * np.sqrt(mesh.area) - [3, 1, -2]) @ turn.apply([1, 0, 0])) < 0.02


@pytest.mark.parametrize("name", ["01", "02", "10", "15", "20", "30"])
def test_the_plane_of_a_face_that_lacks_two_fifths_is_found(name: str, real_mesh: Callable[[str], TriangleMesh]):
    """Of which two, cut at opposite sides, share a fifth; of the same six cut at their other side one is missed."""
    whole = real_mesh(f"faces_simpop/SIMPOP_{name}.obj")
    order = np.argsort(-whole.vertices[whole.faces][:, :, 0].min(axis=1))
    kept = order[np.cumsum(whole.face_areas[order]) < 0.6 * whole.area]
    plane = mirror_plane(ready(prepare(TriangleMesh(whole.vertices, whole.faces[kept])).flattening))
    assert plane is not None
    assert abs(plane[0][0]) > np.cos(np.radians(5))


@pytest.mark.parametrize("count", [14, 17, 20])
def test_a_screw_has_none(count: int):
    """Every part of it winds the same way; of less than a turn the ends lie on their mirror images, nearly."""
    disc = planar(rings(count))
    radius, angle = 0.8 + 0.5 * disc.vertices[:, 0], 4 * disc.vertices[:, 1]
    screw = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.8 * angle])
    assert mirror_plane(ready(prepare(TriangleMesh(screw, disc.faces)).flattening)) is None


def test_a_sheet_with_hills_anywhere_has_none():
    assert mirror_plane(ready(prepare(bumps(900, seed=4)).flattening)) is None


@pytest.mark.parametrize(("one", "open_"), [(sheet(1, -0.2), True), (bumps(600, seed=4), False)])
def test_a_mirrored_map_of_what_may_be_sides_is_called_open(one: TriangleMesh, open_: bool):
    """One half of something symmetric looks like the other in a mirror; anything else that does is mirrored."""
    other = TriangleMesh(one.vertices * [-1, 1, 1], one.faces[:, ::-1])
    found = align(one, other, AlignSettings(samples=30, targets=150, refine="mobius"))
    assert found.mobius.reflected
    decided = with_sides_open(found, None)
    assert (judge(decided).level == "check") == open_ == any("opposite sides" in text for text in decided.warnings)
