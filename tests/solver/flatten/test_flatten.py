from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import QhullError
from surfaces import (
    half_disc,
    half_disc_to_disc,
    largest_error,
    planar,
    rectangle,
    rectangle_to_disc,
    rings,
    spherical_cap,
)

from solver import Flattening, MeshError, Mobius, TriangleMesh, flatten, topology
from solver.flatten.barycentre import conformal_barycentre

DISCS = """
scans/human_face.obj scans/chinese_lion.obj scans/human_brain.obj
teeth/H10.obj teeth/H19.obj teeth/K04.obj teeth/K05.obj teeth/P31.obj teeth/P35.obj teeth/T14.obj
teeth/U02.obj teeth/U08.obj teeth/i14.obj teeth/i15.obj teeth/x02.obj teeth/x07.obj teeth/x17.obj
teeth_mit/a.ply teeth_mit/b.ply teeth_mit/c.ply teeth_mit/AMNH-M-76882_M786.ply teeth_mit/MCZ-5344_M794.ply
faces_simpop/SIMPOP_01.obj faces_simpop/SIMPOP_02.obj faces_simpop/SIMPOP_10.obj
faces_simpop/SIMPOP_15.obj faces_simpop/SIMPOP_20.obj faces_simpop/SIMPOP_30.obj
faces_ict/ict_M_neutral.obj faces_ict/ict_M_happy_level1.obj faces_ict/ict_M_happy_level4.obj
faces_ict/ict_M_sad_level1.obj faces_ict/ict_M_sad_level2.obj
faces_ict/ict_F_neutral.obj faces_ict/ict_F_disgust_level1.obj faces_ict/ict_F_disgust_level2.obj
brain/conte69_L_cortex.obj brain/conte69_R_cortex_mirrored.obj
"""


def assert_injective(flattening: Flattening) -> None:
    """No triangle is turned over, and the boundary lies on the circle strictly in order."""
    assert flattening.distortion.flips == 0
    rim = flattening.disc[flattening.boundary]
    assert np.abs(np.abs(rim) - 1).max() < 1e-15
    gaps = np.angle(np.roll(rim, -1) / rim) % (2 * np.pi)
    assert gaps.min() > 0
    assert gaps.sum() == pytest.approx(2 * np.pi)
    areas = flattening.mesh.vertex_areas[~np.isnan(flattening.disc)]
    if flattening.flips_repaired == 0:
        assert abs(conformal_barycentre(flattening.disc[~np.isnan(flattening.disc)], areas)) < 1e-6


def test_a_planar_disc_stays_what_it_is():
    points = rings(24, jitter=0.3)
    mesh = planar(points)
    flattening = flatten(mesh)
    assert largest_error(flattening.disc, points, mesh) < 2e-3
    assert flattening.distortion.flips == 0


def test_a_disc_moved_by_a_mobius_transformation_comes_back():
    points = Mobius(0.4 + 0.2j, 1.0)(rings(30))
    mesh = planar(points)
    assert largest_error(flatten(mesh).disc, points, mesh) < 4e-3


@pytest.mark.parametrize("polar_angle", [0.5, 1.5, 2.5])
def test_a_spherical_cap_is_projected_stereographically(polar_angle):
    mesh, truth = spherical_cap(40, polar_angle, jitter=0.2)
    assert largest_error(flatten(mesh).disc, truth, mesh) < 5e-3


def test_the_boundary_is_on_the_circle_in_order():
    mesh, _ = spherical_cap(20, 2.0)
    flattening = flatten(mesh)
    rim = flattening.disc[flattening.boundary]
    assert np.abs(np.abs(rim) - 1).max() < 1e-15
    gaps = np.angle(np.roll(rim, -1) / rim)
    assert gaps.min() > 0
    assert gaps.sum() == pytest.approx(2 * np.pi)
    interior = np.setdiff1d(np.arange(len(mesh.vertices)), flattening.boundary)
    assert np.abs(flattening.disc[interior]).max() < 1


def test_it_is_centred():
    mesh, _ = spherical_cap(12, 1.0)
    lopsided = TriangleMesh(mesh.vertices * [1, 2, 0.5] + [0, 0, 3], mesh.faces)
    disc = flatten(lopsided).disc
    assert abs(conformal_barycentre(disc, lopsided.vertex_areas)) < 1e-9


def test_loose_vertices_have_no_image():
    mesh, _ = spherical_cap(6, 1.0)
    loose = TriangleMesh(np.concatenate([[[9, 9, 9]], mesh.vertices]), mesh.faces + 1)
    disc = flatten(loose).disc
    assert np.isnan(disc[0])
    assert disc[1:] == pytest.approx(flatten(mesh).disc, abs=1e-12)


def test_what_is_no_disc_is_refused():
    closed = TriangleMesh(np.eye(4)[:, :3], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], "Scan")
    with pytest.raises(MeshError, match=r"^'Scan' is closed"):
        flatten(closed)
    with pytest.raises(ValueError, match="'conformal'"):
        flatten(planar(rings(3)), "conformal")


def test_a_half_disc_has_its_riemann_map():
    errors = []
    for count in (10, 20, 40):
        points = half_disc(count)
        errors.append(largest_error(flatten(planar(points)).disc, half_disc_to_disc(points), planar(points)))
    assert errors[0] > 1.4 * errors[1] > 1.9 * errors[2]
    assert errors[2] < 0.02


@pytest.mark.parametrize("height", [1.0, 0.5, 0.25])
def test_a_rectangle_has_its_riemann_map(height):
    points = rectangle(80, height, jitter=0.2)
    assert largest_error(flatten(planar(points)).disc, rectangle_to_disc(points, height), planar(points)) < 0.01


def test_a_patch_of_a_cylinder_is_mapped_as_the_rectangle_it_unrolls_to():
    points = rectangle(60, 0.5, jitter=0.2)
    bent = np.stack([np.sin(1.5 * points.real) / 1.5, points.imag, np.cos(1.5 * points.real) / 1.5], axis=1)
    mesh = TriangleMesh(bent, planar(points).faces)
    assert largest_error(flatten(mesh).disc, rectangle_to_disc(points, 0.5), mesh) < 0.01


@pytest.mark.parametrize("method", ["harmonic", "mid-edge"])
def test_the_angle_error_falls_with_the_triangles(method):
    errors = [
        flatten(spherical_cap(count, 1.5, jitter=0.2)[0], method).distortion.mean_angle_error
        for count in (8, 16, 32, 64)
    ]
    for coarse, fine in pairwise(errors):
        assert coarse > 1.6 * fine


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_a_similarity_changes_nothing(scale):
    mesh, _ = spherical_cap(15, 1.4, jitter=0.3)
    turn, _ = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))
    turn *= np.linalg.det(turn)
    moved = TriangleMesh(scale * (mesh.vertices @ turn.T + [5, -3, 2]), mesh.faces)
    assert flatten(moved).disc == pytest.approx(flatten(mesh).disc, abs=1e-8)


def test_the_order_of_vertices_and_faces_changes_a_rotation_at_most():
    mesh, _ = spherical_cap(15, 1.4, jitter=0.3)
    rng = np.random.default_rng(4)
    order = rng.permutation(len(mesh.vertices))
    turned = np.stack(
        [np.roll(face, k) for face, k in zip(mesh.faces, rng.integers(3, size=len(mesh.faces)), strict=True)]
    )
    shuffled = TriangleMesh(mesh.vertices[order], rng.permutation(np.argsort(order)[turned]))
    one, other = flatten(mesh).disc[order], flatten(shuffled).disc
    turn = np.vdot(one, other)
    assert np.abs(one * turn / abs(turn) - other).max() < 1e-8


def test_a_mirror_image_is_mapped_to_the_mirror_image():
    mesh, _ = spherical_cap(15, 1.4, jitter=0.3)
    mirrored = TriangleMesh(mesh.vertices * [1, -1, 1], mesh.faces[:, ::-1])
    one, other = flatten(mesh).disc.conj(), flatten(mirrored).disc
    turn = np.vdot(one, other)
    assert np.abs(one * turn / abs(turn) - other).max() < 1e-6


def test_the_smallest_discs():
    triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    flattening = flatten(triangle)
    assert_injective(flattening)
    # three points of the circle with barycentre 0, weighted alike
    assert flattening.disc.sum() == pytest.approx(0, abs=1e-9)
    assert_injective(flatten(TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])))
    strip = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]], [[0, 1, 2], [1, 3, 2], [2, 3, 4]])
    assert_injective(flatten(strip))
    fan = TriangleMesh([[0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 1, 2], [0, 2, 3], [0, 3, 1]])
    assert_injective(flatten(fan))


def test_two_parts_joined_by_one_edge_both_count():
    """Between two halves that share one edge of two boundary vertices, no half may be squeezed to nothing."""
    points = np.concatenate([rings(6) - 1.2, rings(6) + 1.2])
    left, right = planar(rings(6) - 1.2), planar(rings(6) + 1.2)
    n = len(left.vertices)
    rim = topology(left).boundary_loops[0]
    x = left.vertices[rim]
    near = rim[np.argsort(-x[:, 0] + 10 * (np.abs(x[:, 1]) > 0.4))[:2]]
    low, high = near[np.argsort(left.vertices[near, 1])]
    across = topology(right).boundary_loops[0]
    y = right.vertices[across]
    near = across[np.argsort(y[:, 0] + 10 * (np.abs(y[:, 1]) > 0.4))[:2]]
    low_right, high_right = n + near[np.argsort(right.vertices[near, 1])]
    bridge = [[low, low_right, high], [low_right, high_right, high]]
    vertices = np.stack([points.real, points.imag, 0 * points.real], axis=1)
    mesh = TriangleMesh(vertices, np.concatenate([left.faces, right.faces + n, bridge]))
    flattening = flatten(mesh)
    assert_injective(flattening)
    sizes = [float(np.abs(half - half.mean()).max()) for half in (flattening.disc[:n], flattening.disc[n:])]
    assert min(sizes) > 0.05


@pytest.mark.parametrize("aspect", [4, 8, 40])
def test_long_thin_surfaces(aspect):
    mesh = planar(rectangle(20 * aspect, 1 / aspect, jitter=0.3))
    assert_injective(flatten(mesh))


@pytest.mark.parametrize("power", [2, 4, 8])
def test_very_uneven_triangles(power):
    points = rings(25, jitter=0.3)
    graded = points * np.abs(points) ** (power - 1)
    mesh = TriangleMesh(np.stack([graded.real, graded.imag, 0 * graded.real], axis=1), planar(points).faces)
    assert_injective(flatten(mesh))
    stretched = TriangleMesh(mesh.vertices * [1, 10.0**power, 1], mesh.faces)
    assert_injective(flatten(stretched))


lattice = st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=3, max_size=60, unique=True)


@settings(max_examples=200, deadline=None)
@given(lattice, st.integers(-3, 3), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.01, 3.0]))
def test_no_triangle_turns_over(points, stretch, seed, height):
    plane = np.array([complex(x, y) for x, y in points])
    try:
        flat = planar(plane)
    except QhullError:
        assume(False)
        return
    bumps = height * np.random.default_rng(seed).uniform(-1, 1, len(plane))
    mesh = TriangleMesh(flat.vertices * [10.0**stretch, 1, 0] + bumps[:, None] * [0, 0, 1], flat.faces)
    assume(topology(mesh).is_disc)
    assert_injective(flatten(mesh))


@pytest.mark.parametrize("name", DISCS.split())
def test_real_surfaces_are_mapped_without_a_fold(real_mesh, name):
    assert_injective(flatten(real_mesh(name)))


@pytest.mark.parametrize(("name", "target"), [("human_face", 1.2149), ("chinese_lion", 1.42), ("human_brain", 1.46)])
def test_the_angle_error_is_the_best_published(real_mesh, name, target):
    assert flatten(real_mesh(f"scans/{name}.obj")).distortion.mean_angle_error < target
