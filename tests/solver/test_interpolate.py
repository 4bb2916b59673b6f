import numpy as np
import pytest
from surfaces import planar, rings

from solver import Correspondence, TriangleMesh, interpolate, interpolate_corners
from solver.interpolate import (
    CornerInterpolation,
    edges_in_reach,
    local_similarities,
    nearest_orthogonal,
    source_of_corners,
    source_of_edges,
    source_of_faces,
    value_islands,
)
from solver.locate import TriangulatedDisc


def planar_correspondence(source: TriangleMesh, target: TriangleMesh) -> Correspondence:
    """The correspondence of two triangulations of one plane region: each point to itself."""
    plane = [mesh.vertices[:, 0] + 1j * mesh.vertices[:, 1] for mesh in (source, target)]
    face, barycentric = TriangulatedDisc.of(plane[0], source.faces).locate(plane[1])
    everywhere = np.ones(len(face), bool)
    return Correspondence(face, barycentric, everywhere, everywhere.astype(float), source.faces, len(source.vertices))


@pytest.fixture(scope="module")
def pair() -> tuple[TriangleMesh, TriangleMesh, Correspondence]:
    source, target = planar(rings(12, jitter=0.4, seed=1)), planar(0.9 * rings(9, jitter=0.4, seed=2))
    return source, target, planar_correspondence(source, target)


def test_a_linear_function_is_exact(pair):
    source, target, correspondence = pair
    coefficients = np.array([[2.0, -1.0], [0.5, 3.0], [0.0, 0.0]])
    carried = interpolate(correspondence, source.vertices @ coefficients + 7)
    assert carried == pytest.approx(target.vertices @ coefficients + 7, abs=1e-12)


def test_weights_stay_a_partition_of_unity(pair):
    source, _, correspondence = pair
    weights = np.random.default_rng(0).dirichlet([1, 1, 1, 1], len(source.vertices))
    carried = interpolate(correspondence, weights)
    assert carried.min() >= 0
    assert carried.sum(axis=1) == pytest.approx(1)


def test_a_vertex_without_counterpart_gets_nothing(pair):
    source, _, whole = pair
    face, barycentric = whole.face.copy(), whole.barycentric.copy()
    face[3], barycentric[3] = -1, 0
    part = Correspondence(face, barycentric, whole.matched, whole.confidence, source.faces, len(source.vertices))
    carried = interpolate(part, np.ones(len(source.vertices)))
    assert carried[3] == 0
    assert np.delete(carried, 3) == pytest.approx(1)


def test_the_wrong_number_of_values_is_refused(pair):
    with pytest.raises(ValueError, match="5 values do not fit"):
        interpolate(pair[2], np.zeros(5))


def test_continuous_corner_values_are_one_island_and_linear(pair):
    source, target, correspondence = pair
    uv = source.vertices[source.faces.ravel(), :2] @ np.array([[1.0, 2.0], [-1.0, 0.5]])
    assert value_islands(source.faces, uv).max() == 0
    carried = interpolate_corners(correspondence, source.vertices, uv, target.faces)
    expected = target.vertices[target.faces.ravel(), :2] @ np.array([[1.0, 2.0], [-1.0, 0.5]])
    assert carried == pytest.approx(expected, abs=1e-12)


def test_no_value_is_a_mean_of_two_islands(pair):
    source, target, correspondence = pair
    right = source.vertices[source.faces, 0].mean(axis=1) > 0
    # two charts: the left half around u = 0, the right half around u = 100
    uv = source.vertices[source.faces.ravel(), :2] + 100 * np.repeat(right, 3)[:, None]
    assert len(np.unique(value_islands(source.faces, uv))) == 2
    carried = interpolate_corners(correspondence, source.vertices, uv, target.faces)
    u = carried[:, 0].reshape(-1, 3)
    chart = u > 50
    assert (chart.all(axis=1) | ~chart.any(axis=1)).all()
    assert chart.any()
    assert not chart.all()
    true = target.vertices[target.faces, 0]
    # a corner beyond the seam takes the nearest value of its chart: off by no more than two source edges
    assert np.abs(u - 100 * chart - true).max() < 2 * source.edge_lengths.max()


def test_islands_are_those_of_a_walk_over_equal_sides():
    mesh = planar(rings(4))
    uv = np.random.default_rng(0).integers(0, 2, (3 * len(mesh.faces), 1)).astype(float)
    label = value_islands(mesh.faces, uv)
    values = uv.reshape(-1, 3)
    for f in range(len(mesh.faces)):
        for g in range(f):
            shared = set(mesh.faces[f]) & set(mesh.faces[g])
            if len(shared) == 2 and all(
                values[f][list(mesh.faces[f]).index(v)] == values[g][list(mesh.faces[g]).index(v)] for v in shared
            ):
                assert label[f] == label[g]


def sheet(n: int, m: int | None = None) -> tuple[TriangleMesh, np.ndarray]:
    """A square sheet over [-1, 1] squared of n x m vertices, and the quad of each triangle."""
    m = m or n
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, m))
    at = np.arange(n * m).reshape(m, n)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(n * m)], axis=1)
    return TriangleMesh(vertices, triangles), np.repeat(np.arange(len(quads)), 2)


def on_itself(mesh: TriangleMesh, seed: int) -> Correspondence:
    """Each vertex at itself, located in any of the triangles around it: nothing prefers one side of a seam."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(mesh.faces.size)
    face = np.empty(len(mesh.vertices), int)
    face[mesh.faces.ravel()[order]] = order // 3
    barycentric = (mesh.faces[face] == np.arange(len(mesh.vertices))[:, None]).astype(float)
    everywhere = np.ones(len(face), bool)
    return Correspondence(face, barycentric, everywhere, everywhere.astype(float), mesh.faces, len(mesh.vertices))


def two_charts(mesh: TriangleMesh) -> np.ndarray:
    right = mesh.vertices[mesh.faces, 0].mean(axis=1) > 0
    return mesh.vertices[mesh.faces.ravel(), :2] * 0.2 + np.repeat(np.where(right, 0.75, 0.25), 3)[:, None]


def charts_in_one_place(mesh: TriangleMesh) -> np.ndarray:
    # the right half lies turned on top of the left one, as mirrored parts of a texture do
    right = np.repeat(mesh.vertices[mesh.faces, 0].mean(axis=1) > 0, 3)
    uv = mesh.vertices[mesh.faces.ravel(), :2].copy()
    uv[right] = np.array([-0.5, 0.1]) - uv[right]
    return uv


def fan(mesh: TriangleMesh) -> np.ndarray:
    """One island with a slit along the negative x axis: the angle and the distance from a place on the axis."""
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    place = mesh.vertices[mesh.faces.ravel()] - [0.012, 0, 0]
    angle = np.arctan2(place[:, 1], place[:, 0])
    turned = np.repeat(np.sign(middle[:, 1]), 3) * angle < -np.pi / 2
    return np.stack([angle + 2 * np.pi * turned * np.repeat(np.sign(middle[:, 1]), 3), np.hypot(*place[:, :2].T)], 1)


def each_polygon_its_own(mesh: TriangleMesh) -> np.ndarray:
    return np.random.default_rng(5).random((len(mesh.faces) // 2, 1)).repeat(6, axis=0)


@pytest.mark.parametrize("values", [two_charts, charts_in_one_place, fan, each_polygon_its_own])
@pytest.mark.parametrize("seed", range(3))
def test_onto_an_identical_mesh_every_corner_comes_back_bit_for_bit(values, seed):
    mesh, quad = sheet(21)
    given = values(mesh)
    carried = interpolate_corners(on_itself(mesh, seed), mesh.vertices, given, mesh.faces, quad)
    assert (carried == given).all()


def test_one_interpolation_carries_layers_with_the_same_and_with_other_seams():
    source, _ = sheet(20)
    target, quad = sheet(13, 14)
    found = planar_correspondence(source, target)
    carry = CornerInterpolation(found, source.vertices, target.faces, quad)
    charts = two_charts(source)
    mirrored = charts * [-1, 2]  # broken at the same sides
    for values in (charts, mirrored, fan(source), source.vertices[source.faces.ravel()], mirrored, charts):
        at_vertex, corners, beside = carry(values)
        result = at_vertex[target.faces.ravel()]
        result[corners] = beside
        assert (result == interpolate_corners(found, source.vertices, values, target.faces, quad)).all()


def test_the_triangles_of_a_group_stay_together():
    source, _ = sheet(20)
    target, quad = sheet(13, 14)
    carried = interpolate_corners(
        planar_correspondence(source, target), source.vertices, two_charts(source), target.faces, quad
    )
    right = (carried[:, 0] > 0.5).reshape(-1, 6)
    assert (right == right[:, :1]).all()
    # a polygon on one side of the seam takes that side
    x = target.vertices[target.faces, 0].reshape(-1, 6)
    assert right[x.min(axis=1) > 0.06].all()
    assert not right[x.max(axis=1) < -0.06].any()


@pytest.mark.parametrize("n", [7, 12, 33])
def test_no_triangle_is_stretched_across_a_slit(n):
    source, _ = sheet(41)
    target, quad = sheet(n, n + 1)
    carried = interpolate_corners(
        planar_correspondence(source, target), source.vertices, fan(source), target.faces, quad
    )
    angle = carried[:, 0].reshape(-1, 6)
    x, y = np.moveaxis(target.vertices[target.faces].reshape(-1, 6, 3), 2, 0)[:2]
    away = (x.max(axis=1) < -0.3) | (x.min(axis=1) > 0.3) | (np.abs(y).min(axis=1) > 0.3)
    assert away.sum() > 0.5 * len(away)
    # seen from the tip a polygon that far away covers no more than this; across the slit it would be 2 pi
    assert np.ptp(angle[away], axis=1).max() < 1.3
    true = np.arctan2(y, x - 0.012)
    apart = (np.abs(y).min(axis=1) > 0.06) & (np.abs(np.sign(y).sum(axis=1)) == 6)
    assert np.abs(np.angle(np.exp(1j * (angle - true))))[away & apart].max() < 0.02


def test_a_corner_without_counterpart_does_not_choose_the_side():
    mesh, quad = sheet(21)
    whole = on_itself(mesh, 0)
    face, barycentric = whole.face.copy(), whole.barycentric.copy()
    bare = np.random.default_rng(0).choice(len(face), 40, replace=False)
    face[bare], barycentric[bare] = -1, 0
    part = Correspondence(face, barycentric, whole.matched, whole.confidence, mesh.faces, len(mesh.vertices))
    given = two_charts(mesh)
    carried = interpolate_corners(part, mesh.vertices, given, mesh.faces, quad)
    gone = np.isin(mesh.faces.ravel(), bare)
    assert (carried[gone] == 0).all()
    whole_quads = np.repeat(~gone.reshape(-1, 6).any(axis=1), 6)
    assert (carried[whole_quads] == given[whole_quads]).all()


def test_faces_corners_and_edges_of_an_identical_mesh_are_their_own_source():
    mesh, quad = sheet(17)
    found = on_itself(mesh, 3)
    assert (source_of_faces(found, mesh.vertices, mesh.faces, quad) // 2 == np.arange(256)).all()
    alone = np.arange(len(mesh.faces))
    assert (source_of_faces(found, mesh.vertices, mesh.faces, alone) == alone).all()
    corner = source_of_corners(found, mesh.vertices, mesh.faces, quad)
    assert (mesh.faces.ravel()[corner] == mesh.faces.ravel()).all()
    assert (quad[corner // 3] == np.repeat(quad, 3)).all()
    edges = np.unique(
        np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])), axis=0
    )
    assert (source_of_edges(found, mesh.vertices, edges, edges) == np.arange(len(edges))).all()


def test_a_target_edge_takes_the_source_edge_that_runs_along_it(pair):
    source, _ = sheet(41)
    target, _ = sheet(14, 13)
    edges = [np.unique(np.sort(m.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0) for m in (source, target)]
    found = source_of_edges(planar_correspondence(source, target), source.vertices, *edges)
    run = [m.vertices[e[:, 1]] - m.vertices[e[:, 0]] for m, e in zip((source, target), edges, strict=True)]
    middle = [m.vertices[e].mean(axis=1) for m, e in zip((source, target), edges, strict=True)]
    cosine = np.abs((run[0][found] * run[1]).sum(axis=1)) / np.prod(
        [np.linalg.norm(x, axis=1) for x in (run[0][found], run[1])], axis=0
    )
    assert cosine.min() > 0.99
    assert np.linalg.norm(middle[0][found] - middle[1], axis=1).max() < 0.06


@pytest.mark.parametrize("mirror", [1, -1])
def test_the_local_similarity_of_a_similar_surface_is_the_similarity(mirror):
    flat, _ = sheet(15)
    source = TriangleMesh(flat.vertices + [0, 0, 1] * np.sin(2 * flat.vertices[:, :1]), flat.faces)
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turn *= mirror * np.sign(np.linalg.det(turn))
    target = TriangleMesh(2.5 * source.vertices @ turn.T + [1, 2, 3], source.faces[:, ::mirror])
    rotation, scale = local_similarities(on_itself(source, 0), source, target)
    assert np.abs(rotation - turn).max() < 1e-9
    assert scale == pytest.approx(2.5)


@pytest.mark.parametrize("sizes", [(41, 30), (14, 30), (30, 7)])
def test_no_edge_out_of_reach_comes_from_a_marked_one(sizes):
    rng = np.random.default_rng(0)
    source, target = sheet(sizes[0])[0], sheet(sizes[1], sizes[1] + 2)[0]
    edges = [m.edges for m in (source, target)]
    marked = rng.random(len(edges[0])) < 0.01
    found = planar_correspondence(source, target)
    origin = source_of_edges(found, source.vertices, *edges)
    near = edges_in_reach(found, source.vertices, edges[0], marked, edges[1])
    assert not marked[origin[~near]].any()
    if sizes[0] > 20 and sizes[1] > 20:
        assert near.mean() < 0.9
    assert not edges_in_reach(found, source.vertices, edges[0], 0 * marked > 0, edges[1]).any()


@pytest.mark.parametrize("kind", [1, -1])
def test_nearest_orthogonal_matrices_are_those_of_the_singular_values(kind):
    rng = np.random.default_rng(1)
    matrices = rng.normal(size=(400, 3, 3))
    handed = np.sign(np.linalg.det(matrices))
    matrices[(handed != kind) & (np.arange(400) > 40), 0] *= -1  # most are of the kind, a tenth is not
    matrices[:3] = np.outer([1, 2, 3], [1, 0, -1])  # of rank one
    matrices[3:6, 2] = matrices[3:6, 1]  # of rank two
    left, _, right = np.linalg.svd(matrices)
    left[np.sign(np.linalg.det(left @ right)) != kind, :, 2] *= -1
    found = nearest_orthogonal(matrices)
    assert np.sign(np.linalg.det(found)) == pytest.approx(kind)
    assert np.abs(found @ found.transpose(0, 2, 1) - np.eye(3)).max() < 1e-12
    # that of rank one is not determined; the others are the best there are
    assert np.abs(found - left @ right)[3:].max() < 1e-9
    assert (nearest_orthogonal(np.eye(3)[None]) == np.eye(3)).all()
    # nor does it matter how they lie in memory, and they stay as they are
    other = np.ascontiguousarray(matrices.transpose(1, 2, 0)).transpose(2, 0, 1)
    assert (nearest_orthogonal(other) == found).all()
    assert (other == matrices).all()


def test_nearest_orthogonal_matrices_of_many_are_those_of_each():
    matrices = np.random.default_rng(2).normal(size=(5000, 3, 3))
    matrices[np.linalg.det(matrices) < 0, 0] *= -1
    left, _, right = np.linalg.svd(matrices)
    assert np.abs(nearest_orthogonal(matrices) - left @ right).max() < 1e-9
