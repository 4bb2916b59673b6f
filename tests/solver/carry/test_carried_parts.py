"""Nothing of one part is carried to another, however near they lie; files hold which part each vertex is in."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from assembled import assembled, ball
from correspondences import on_itself, sheet
from scans import bumps

from solver import Alignment, AlignSettings, Correspondence, TriangleMesh, align, interpolate_corners
from solver.carry.elements import source_of_corners, source_of_edges, source_of_faces
from solver.carry.frames import local_similarities
from solver.carry.map_file import load_map, save_map
from solver.carry.parts import drawn_apart, pieces, without_riders


def layers(count: int = 3, gap: float = 1e-7) -> tuple[TriangleMesh, np.ndarray]:
    """Sheets on each other, nearer than anything tells them apart, and the layer of each vertex."""
    flat = sheet(6)[0]
    stacked = [TriangleMesh(flat.vertices + np.array([0, 0, gap * k]), flat.faces) for k in range(count)]
    return assembled(*stacked), np.repeat(np.arange(count), len(flat.vertices))


def in_layers(seed: int) -> tuple[TriangleMesh, Correspondence]:
    """A stack on itself, each layer on the one above, the last on the first."""
    mesh, part = layers()
    found = on_itself(mesh, seed)
    size, faces = len(mesh.vertices) // 3, len(mesh.faces) // 3
    face = (found.face + faces) % len(mesh.faces)
    there = Correspondence(face, found.barycentric, found.matched, found.confidence, mesh.faces, 3 * size, part, part)
    return mesh, there


def test_elements_come_from_the_counterpart_alone() -> None:
    mesh, found = in_layers(0)
    places = drawn_apart(found, mesh.vertices, mesh.faces)
    layer_of_face = np.repeat(np.arange(3), len(mesh.faces) // 3)
    above = (layer_of_face + 1) % 3
    groups = np.arange(len(mesh.faces))
    assert (layer_of_face[source_of_faces(found, places, mesh.faces, groups)] == above).all()
    corner = source_of_corners(found, places, mesh.faces, groups)
    assert (layer_of_face[corner // 3] == np.repeat(above, 3)).all()
    edge = source_of_edges(found, places, mesh.edges, mesh.edges)
    layer_of_edge = mesh.edges[:, 0] // (len(mesh.vertices) // 3)
    assert (layer_of_edge[edge] == (layer_of_edge + 1) % 3).all()


def test_corner_values_do_not_bleed_along_seams() -> None:
    mesh, found = in_layers(1)
    places = drawn_apart(found, mesh.vertices, mesh.faces)
    layer_of_face = np.repeat(np.arange(3), len(mesh.faces) // 3)
    island = mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 0
    values = np.repeat(10.0 * layer_of_face + island, 3)[:, None]
    quads = np.arange(len(mesh.faces)) // 2
    carried = interpolate_corners(found, places, values, mesh.faces, quads).reshape(-1, 3)
    above = (layer_of_face + 1) % 3
    assert (np.floor(carried / 10) == above[:, None]).all()
    assert np.isin(np.round(carried % 10, 6), [0, 1]).all()


def test_one_part_stays_where_it_is() -> None:
    mesh = sheet(5)[0]
    found = on_itself(mesh, 0)
    assert drawn_apart(found, mesh.vertices, mesh.faces) is mesh.vertices


def test_parts_that_touch_stay_together() -> None:
    mesh = assembled(ball((0, 0, 0), 1), ball((0, 0, 2), 1), ball((5, 0, 0), 1))
    size = len(mesh.vertices) // 3
    top, bottom = size - 2, 2 * size - 1
    faces = np.where(mesh.faces == bottom, top, mesh.faces)
    mesh = TriangleMesh(mesh.vertices, faces)
    part = np.repeat(np.arange(3), size)
    part[bottom] = -1
    face = np.zeros(3 * size, int)
    face[faces.ravel()] = np.repeat(np.arange(len(faces)), 3)
    barycentric = (faces[face] == np.arange(3 * size)[:, None]).astype(float)
    face[bottom] = -1
    known = face >= 0
    found = Correspondence(face, barycentric, known, known.astype(float), faces, 3 * size, part, part)
    moved = drawn_apart(found, mesh.vertices, faces) - mesh.vertices
    assert not moved[part < 2].any()
    assert (moved[part == 2, 0] > 10).all()


def test_riders_have_their_leaders_frame_and_nothing_else() -> None:
    mesh, found = in_layers(2)
    size = len(mesh.vertices) // 3
    leader = np.where(np.arange(3 * size) >= 2 * size, np.arange(3 * size) - 2 * size, -1)
    riding = Correspondence(
        found.face, found.barycentric, found.matched, found.confidence, mesh.faces, 3 * size, found.part, found.part,
        leader,
    )  # fmt: skip
    turned = TriangleMesh(mesh.vertices @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], mesh.faces)
    squeezed = turned.vertices.copy()
    squeezed[2 * size :] = 0.0  # nothing could be told from it
    rotation, scale = local_similarities(riding, mesh, TriangleMesh(squeezed, mesh.faces))
    assert np.allclose(rotation[2 * size :], rotation[:size])
    assert np.allclose(scale[2 * size :], scale[:size])
    alone = without_riders(riding)
    assert (alone.face[2 * size :] == -1).all()
    assert alone.leader is None
    assert (alone.face[: 2 * size] == riding.face[: 2 * size]).all()


def test_pieces() -> None:
    mesh = assembled(ball((0, 0, 0), 1), ball((5, 0, 0), 1))
    found = pieces(mesh.faces, len(mesh.vertices) + 2)
    half = len(mesh.vertices) // 2
    assert found.tolist() == [0] * half + [1] * half + [-1, -1]


def test_a_map_file_holds_the_parts(aligned_sheets: Alignment, tmp_path: Path) -> None:
    mesh, found = in_layers(3)
    leader = np.full(len(found.face), -1)
    leader[5] = 40
    whole = replace(found, leader=leader)
    path = tmp_path / "map.npz"
    save_map(path, aligned_sheets, whole, mesh, mesh)
    back = load_map(path, mesh, mesh)
    for name in ("face", "part", "source_part", "leader"):
        assert np.array_equal(getattr(back, name), getattr(whole, name)), name
    with np.load(path) as file:
        arrays = dict(file)
    for name, wrong in (("source_part", arrays["source_part"][:-1]), ("leader", np.full(len(leader), 1000)),
                        ("part", arrays["part"] - 5)):  # fmt: skip
        np.savez(path, **(arrays | {name: wrong}))
        with pytest.raises(ValueError, match="damaged"):
            load_map(path)


@pytest.fixture(scope="module")
def aligned_sheets() -> Alignment:
    return align(bumps(500, 1), bumps(400, 1), AlignSettings(samples=30, targets=200, reflect="never", refine="none"))
