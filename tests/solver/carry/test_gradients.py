import numpy as np
import pytest
from correspondences import on_itself, planar_correspondence, sheet

from solver import TriangleMesh
from solver.carry.fill import without
from solver.carry.frames import local_similarities
from solver.carry.gradients import GradientTransfer


def curved(flat: TriangleMesh) -> TriangleMesh:
    x, y, _ = flat.vertices.T
    return TriangleMesh(np.stack([x, y, 0.3 * np.sin(2 * x) + 0.2 * y**2], axis=1), flat.faces)


def similar(mesh: TriangleMesh, mirror: int, seed: int) -> tuple[TriangleMesh, np.ndarray, float]:
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn *= mirror * np.sign(np.linalg.det(turn))
    return TriangleMesh(2.5 * mesh.vertices @ turn.T + [1, 2, 3], mesh.faces[:, ::mirror]), turn, 2.5


@pytest.mark.parametrize("mirror", [1, -1])
def test_on_a_similar_surface_any_displacement_is_turned_and_scaled(mirror):
    source = curved(sheet(15)[0])
    target, turn, scale = similar(source, mirror, 4)
    correspondence = on_itself(source, 0)
    rotation, found = local_similarities(correspondence, source, target, 1.0)
    assert np.abs(rotation - turn).max() < 1e-9
    assert found == pytest.approx(scale)
    displacement = np.random.default_rng(5).normal(0, 0.02, source.vertices.shape)
    carried = GradientTransfer.of(correspondence, source, target)(displacement)
    assert np.abs(carried - scale * displacement @ turn.T).max() < 1e-9


def test_the_whole_of_a_nearly_flat_mirrored_surface_is_known_to_be_a_reflection():
    flat = sheet(12)[0]
    source = TriangleMesh(flat.vertices + [0, 0, 1e-6] * np.sin(3 * flat.vertices[:, :1]), flat.faces)
    target, turn, _ = similar(source, -1, 7)
    rotation, _ = local_similarities(on_itself(source, 1), source, target, 1.0)
    assert np.linalg.det(rotation) == pytest.approx(-1)
    assert np.abs(rotation - turn).max() < 1e-4


def test_a_stretched_target_is_deformed_as_the_source_is():
    # a sheet of twice the width: bending it along x lifts it as steeply, hence in the middle twice as high
    source = sheet(41)[0]
    target = TriangleMesh(source.vertices * [2, 1, 1], source.faces)
    slope = 0.1
    displacement = np.zeros_like(source.vertices)
    displacement[:, 2] = slope * (1 - np.abs(source.vertices[:, 0]))
    transfer = GradientTransfer.of(on_itself(source, 0), source, target)
    carried = transfer(displacement)[:, 2]
    copied = transfer.copied(displacement)[:, 2]
    near = np.abs(target.vertices[:, 0]) < 0.03  # the ridge
    assert carried[near].max() > copied[near].max()  # between a copy and twice as high, since both count
    across = np.abs(np.abs(target.vertices[:, 0]) - 0.2) < 0.03
    found = (carried[near].mean() - carried[across].mean()) / 0.2
    plain = (copied[near].mean() - copied[across].mean()) / 0.2
    assert abs(found - slope) < abs(plain - slope)


def test_parts_that_hang_together_with_nothing_go_where_they_went_and_turn_about_their_own_middle():
    main = curved(sheet(15)[0])
    ball = curved(sheet(7)[0])
    small = 0.1 * ball.vertices + [0, 0, 1]
    vertices = np.concatenate([main.vertices, small])
    source = TriangleMesh(vertices, np.concatenate([main.faces, ball.faces + len(main.vertices)]))
    own = slice(len(main.vertices), None)
    # the target's part is half as large again about its own middle
    grown = vertices.copy()
    areas = source.vertex_areas[own] / source.vertex_areas[own].sum()
    middle = areas @ small
    grown[own] = middle + 1.5 * (small - middle)
    target = TriangleMesh(grown, source.faces)
    angle = 0.3
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    displacement = np.zeros_like(vertices)
    displacement[own] = (small - middle) @ (turn - np.eye(3)).T + [0, 0.2, 0]
    transfer = GradientTransfer.of(on_itself(source, 2), source, target)
    carried = transfer(displacement)
    rotation, scale = transfer.rotation[own][0], transfer.scale[own][0]
    wanted = (grown[own] - middle) @ (turn - np.eye(3)).T + scale * rotation @ [0, 0.2, 0]
    assert np.abs(carried[own] - wanted).max() < 2e-3 * np.abs(wanted).max()
    assert np.abs(carried[: len(main.vertices)]).max() < 1e-12


def test_a_bump_on_a_sheet_stands_upright_on_the_sheet_rolled_up():
    flat = sheet(61)[0]
    x, y, _ = flat.vertices.T
    rolled = TriangleMesh(np.stack([np.sin(1.5 * x) / 1.5, y, np.cos(1.5 * x) / 1.5], axis=1), flat.faces)
    bump = np.exp(-40 * ((x - 0.7) ** 2 + y**2))[:, None] * [0, 0, 0.2]
    carried = GradientTransfer.of(on_itself(flat, 0), flat, rolled)(bump)
    outward = np.stack([np.sin(1.5 * x), 0 * y, np.cos(1.5 * x)], axis=1)
    high = bump[:, 2] > 0.1
    assert np.linalg.norm(carried - outward * bump[:, 2:], axis=1)[high].max() < 0.05  # unturned: 0.2


def test_vertices_without_a_counterpart_get_nothing_and_spoil_nothing():
    source, target = curved(sheet(25)[0]), curved(sheet(18)[0])
    whole = planar_correspondence(sheet(25)[0], sheet(18)[0])
    excluded = target.vertices[:, 0] > 0.8
    x, y, _ = source.vertices.T
    displacement = np.exp(-4 * (x + 0.5) ** 2 - 4 * y**2)[:, None] * [0.1, 0, 0.2]
    everywhere = GradientTransfer.of(whole, source, target)(displacement)
    carried = GradientTransfer.of(without(whole, excluded), source, target)(displacement)
    assert not carried[excluded].any()
    far = target.vertices[:, 0] < 0.4
    assert np.abs(carried - everywhere)[far].max() < 0.02 * np.abs(everywhere).max()


def test_squeezed_triangles_say_nothing():
    flat = sheet(21)[0]
    source, target = curved(flat), curved(flat)
    correspondence = on_itself(source, 0)
    # a column of target vertices corresponds to the line beside it, the triangles between to nothing wide
    column = np.abs(flat.vertices[:, 0] - flat.vertices[10, 0]) < 1e-9
    face, barycentric = correspondence.face.copy(), correspondence.barycentric.copy()
    face[np.flatnonzero(column)] = face[np.flatnonzero(column) - 1]
    barycentric[np.flatnonzero(column)] = barycentric[np.flatnonzero(column) - 1]
    from dataclasses import replace

    squeezed = replace(correspondence, face=face, barycentric=barycentric)
    displacement = np.zeros_like(source.vertices)
    displacement[:, 2] = 0.1 * np.cos(np.pi / 2 * source.vertices[:, 0]) * np.cos(np.pi / 2 * source.vertices[:, 1])
    carried = GradientTransfer.of(squeezed, source, target)(displacement)
    assert np.isfinite(carried).all()
    assert np.abs(carried - displacement).max() < 0.02
