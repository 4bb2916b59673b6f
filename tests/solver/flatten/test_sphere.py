"""The conformal map of closed surfaces to the sphere."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from spheres import ball, even_points, hull, random_mobius, sphere_points, turned_onto

from solver import MeshError, TriangleMesh
from solver.flatten.barycentre import spherical_barycentre
from solver.flatten.distortion import signed_volumes
from solver.flatten.locate import TriangulatedSphere
from solver.flatten.sphere import SphereFlattening, flatten_sphere
from solver.flatten.sphere_injective import collapsed, require_injective, solid_angles, untangled_sphere


def assert_injective(found: SphereFlattening) -> None:
    """Every triangle is counter-clockwise in exact arithmetic, computed here once more, and they cover once."""
    points, faces = found.sphere, found.mesh.faces
    for face in faces[:: max(len(faces) // 300, 1)].tolist():
        a, b, c = ([Fraction(float(v)) for v in points[k]] for k in face)
        assert (
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        ) > 0
    assert found.distortion.flips == 0
    assert solid_angles(points, faces).sum() == pytest.approx(4 * np.pi)
    used = found.mesh.used
    mean = found.mesh.vertex_areas[used] @ points[used] / found.mesh.area
    assert np.abs(mean).max() < 1e-9
    assert np.abs(np.linalg.norm(points[used], axis=1) - 1).max() < 1e-15


def test_a_sphere_stays_what_it_is():
    mesh = hull(even_points(2000))
    found = flatten_sphere(mesh)
    assert_injective(found)
    apart = np.linalg.norm(turned_onto(found.sphere, mesh.vertices, mesh.vertex_areas) - mesh.vertices, axis=1)
    assert apart.max() < 0.04  # half an edge, around the vertex that was taken out
    assert apart.mean() < 5e-3


def test_a_sphere_moved_by_a_mobius_transformation_comes_back():
    points = even_points(4000)
    moved = random_mobius(np.random.default_rng(3), 0.6, reflect=False)(points)
    mesh = hull(moved)  # another triangulation, dense elsewhere
    found = flatten_sphere(mesh)
    centred = spherical_barycentre(moved, mesh.vertex_areas)(moved)
    apart = np.linalg.norm(turned_onto(found.sphere, centred, mesh.vertex_areas) - centred, axis=1)
    assert apart.mean() < 5e-3
    assert apart.max() < 0.03


def test_an_ellipsoid_of_revolution_is_mapped_as_the_formula_says():
    """Conformal: d(polar angle) / sin is the arc of the meridian over the distance from the axis."""
    points = even_points(6000)
    stretch = np.array([1.0, 1.0, 1.8])
    mesh = TriangleMesh(points * stretch, hull(points).faces)
    found = flatten_sphere(mesh)
    t = np.linspace(-1, 1, 200_001)[1:-1]
    rho = np.sqrt(1 - t**2)
    speed = np.sqrt(stretch[2] ** 2 + t**2 / (1 - t**2)) / rho
    mercator = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(t))])
    mercator -= np.interp(0, t, mercator)
    z = np.tanh(np.interp(points[:, 2], t, mercator))
    ring = np.sqrt(1 - z**2)[:, None] * points[:, :2] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    truth = np.column_stack([ring, z])
    apart = np.linalg.norm(turned_onto(found.sphere, truth, mesh.vertex_areas) - truth, axis=1)
    assert apart.mean() < 6e-3


def test_pose_scale_and_order_of_vertices_do_not_matter():
    rng = np.random.default_rng(1)
    mesh = ball(1500)
    first = flatten_sphere(mesh)
    order = rng.permutation(len(mesh.vertices))
    turn = random_mobius(rng, 0, reflect=False).matrix
    place = np.argsort(order)
    moved = TriangleMesh((mesh.vertices @ turn.T * 7 + 3)[order], place[mesh.faces])
    again = flatten_sphere(moved).sphere[place]
    assert np.abs(turned_onto(again, first.sphere, mesh.vertex_areas) - first.sphere).max() < 0.04


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6))
def test_any_closed_surface_is_mapped_injectively(seed):
    rng = np.random.default_rng(seed)
    points = sphere_points(rng, int(rng.integers(4, 400)))
    mesh = hull(points)
    lumps = TriangleMesh(points * rng.uniform(0.4, 2.5, (len(points), 1)), mesh.faces)
    try:
        found = flatten_sphere(lumps)
    except MeshError:
        if len(points) < 60:  # only what is coarse may be refused
            return
        raise
    assert_injective(found)


def test_what_is_no_sphere_is_refused_by_name():
    mesh = ball(300, name="egg")
    with pytest.raises(MeshError, match="'egg' has 1 boundary loop where a closed surface is needed"):
        flatten_sphere(TriangleMesh(mesh.vertices, mesh.faces[1:], "egg"))
    two = TriangleMesh(
        np.concatenate([mesh.vertices, mesh.vertices + 9]), np.concatenate([mesh.faces, mesh.faces + 300])
    )
    with pytest.raises(MeshError, match="2 separate parts"):
        flatten_sphere(two)


def test_what_juts_out_too_far_is_refused_with_the_figure():
    """A needle: its tip shrinks by e^(2 pi length / girth) lengthwise."""
    rings, around = 300, 8
    z = np.concatenate([[0], np.linspace(1, 150, rings), [151]])
    turn = 2 * np.pi * np.arange(around) / around
    tube = np.stack(np.broadcast_arrays(np.cos(turn), np.sin(turn), z[1:-1, None]), axis=2).reshape(-1, 3)
    vertices = np.concatenate([[[0, 0, 0]], tube, [[0, 0, 151]]])
    k = np.arange(around)
    grid = 1 + around * np.arange(rings - 1)[:, None] + k
    ahead = 1 + around * np.arange(rings - 1)[:, None] + (k + 1) % around
    sides = np.concatenate(
        [
            np.stack([grid, ahead, grid + around], 2).reshape(-1, 3),
            np.stack([ahead, ahead + around, grid + around], 2).reshape(-1, 3),
        ]
    )
    last = 1 + around * (rings - 1)
    caps = np.concatenate(
        [
            np.stack([np.zeros_like(k), 1 + (k + 1) % around, 1 + k], 1),
            np.stack([np.full_like(k, len(vertices) - 1), last + k, last + (k + 1) % around], 1),
        ]
    )
    needle = TriangleMesh(vertices, np.concatenate([sides, caps]), "needle")
    with pytest.raises(MeshError, match=r"'needle' juts out too far for a sphere: .* shrink to 1/10\^\d\d"):
        flatten_sphere(needle)


@pytest.mark.parametrize("name", ["mpfb_woman_body", "mpfb_man_body"])
def test_a_body_has_no_room_on_a_sphere(name, data_path):
    with np.load(data_path(f"heads/{name}.npz")) as data:
        corners = data["corner"].reshape(-1, 4)[data["part"] == data["part"][0]].astype(int)
        skin = TriangleMesh(data["vertices"], np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]), name)
    said = r"sphere: 2\d% of it would shrink there by more than a million, parts to 1/10\^2\d of their area: cut off"
    with pytest.raises(MeshError, match=said):
        flatten_sphere(skin)


def test_turned_triangles_are_put_right_and_others_stay():
    mesh = hull(even_points(1000))
    points = mesh.vertices.copy()
    ring = np.flatnonzero(points @ points[500] > 0.985)
    rng = np.random.default_rng(0)
    points[ring] = points[rng.permutation(ring)]
    assert (signed_volumes(points, mesh.faces) <= 0).any()
    result = untangled_sphere(mesh, mesh.edge_lengths, points)
    assert not (signed_volumes(result, mesh.faces) <= 0).any()
    far = points @ mesh.vertices[500] < 0.4
    assert (result[far] == points[far]).all()


def test_a_double_cover_is_refused():
    """Z -> z^2 on the sphere: away from both poles no triangle is turned over, and everything is covered twice."""
    rng = np.random.default_rng(0)
    around, rows = 24, 9
    z = np.linspace(0.8, -0.8, rows)
    turn = 2 * np.pi * np.arange(around) / around
    ring = np.stack(
        np.broadcast_arrays(
            np.sqrt(1 - z[:, None] ** 2) * np.cos(turn), np.sqrt(1 - z[:, None] ** 2) * np.sin(turn), z[:, None]
        ),
        2,
    )
    points = np.concatenate([ring.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    mesh = hull(points / np.linalg.norm(points, axis=1, keepdims=True))
    x, y = points[:, 0], points[:, 1]
    angle = 2 * np.arctan2(y, x)
    size = np.hypot(x, y)
    twice = np.stack([size * np.cos(angle), size * np.sin(angle), points[:, 2]], axis=1)
    assert not collapsed(twice, mesh.faces).any()
    with pytest.raises(MeshError, match="covered twice"):
        require_injective(mesh, twice)
    del rng


def test_exact_arithmetic_decides_what_floats_do_not():
    a, b = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    for sign in (1, -1, 0):
        points = np.array([a, b, [0.6, 0.8, sign * 2.0**-1070]])
        assert collapsed(points, np.array([[0, 1, 2]]))[0] == (sign <= 0)


def test_points_are_located_where_they_came_from():
    rng = np.random.default_rng(2)
    found = flatten_sphere(ball(1200))
    faces = found.mesh.faces
    face = rng.integers(0, len(faces), 3000)
    weights = rng.dirichlet(np.ones(3), 3000)
    points = np.einsum("qk,qkd->qd", weights, found.sphere[faces[face]])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    located, barycentric = TriangulatedSphere.of(found.sphere, faces).locate(points)
    assert np.mean(located == face) > 0.999
    same = located == face
    assert np.abs(barycentric[same] - weights[same]).max() < 1e-9
    at_vertices, weight = TriangulatedSphere.of(found.sphere, faces).locate(found.sphere)
    back = np.einsum("qk,qkd->qd", weight, found.sphere[faces[at_vertices]])
    assert np.abs(back - found.sphere).max() < 1e-12


@pytest.mark.parametrize("name", ["david", "conte69_L", "conte69_R_mirrored", "brain"])
def test_real_closed_surfaces(real_mesh, name):
    found = flatten_sphere(real_mesh(f"closed/{name}.ply"))
    assert_injective(found)
    assert found.distortion.mean_angle_error < 1.4
