"""A spike that tears a cut open, along which the surface would be joined."""

from collections.abc import Callable

import numpy as np
import pytest
from damages import Damage, Damaged, handle, islands, loose_triangles, mirror_halves, undamaged
from scans import bumps

from solver import cleaned
from solver.surface.mesh import TriangleMesh
from solver.surface.spikes import without_spikes
from solver.surface.topology import topology


def torn(old: Damaged, sheet: TriangleMesh, rng: np.random.Generator) -> tuple[Damaged, np.ndarray]:
    """Two vertices on a cut put far off, away from the rim, from where cuts meet, and from each other."""
    faces, times = old.mesh.faces, np.bincount(old.clean)
    rim = np.unique(sheet.edges[np.bincount(sheet.edge_of_side) == 1])
    fits, taken, chosen = (times[old.clean] > 1) & (old.mesh.used), set(), []
    for vertex in rng.permutation(np.flatnonzero(fits)).tolist():
        around = np.unique(sheet.faces[(sheet.faces == old.clean[vertex]).any(axis=1)])
        meet = (times[around] > 2).any() and len(faces) * 3 != len(old.clean)
        if not (meet or np.isin(around, rim).any() or set(around.tolist()) & taken):
            taken |= set(around.tolist())
            chosen.append(vertex)
    chosen = np.array(chosen[:2])
    vertices = old.mesh.vertices.copy()
    vertices[chosen] += rng.uniform(2, 20, (2, 1)) * old.mesh.diagonal
    return Damaged(TriangleMesh(vertices, faces, old.mesh.name), old.clean), chosen


@pytest.mark.parametrize("cut", [loose_triangles, islands, mirror_halves], ids=lambda cut: cut.__name__)
@pytest.mark.parametrize("seed", [2, 3])
def test_a_spike_on_a_cut_is_put_where_the_other_side_is(cut: Damage, seed: int) -> None:
    rng = np.random.default_rng(seed)
    sheet = bumps(600, seed=2)
    new, chosen = torn(cut(undamaged(sheet), rng), sheet, rng)
    tidy = cleaned(new.mesh, largest_part=True, fill_holes=True)
    assert [said for said in tidy.changes if "far off" in said] == ["2 vertices far off the surface put back"]
    assert np.allclose(tidy.mesh.vertices[tidy.vertex_of[chosen]], sheet.vertices[new.clean[chosen]])
    assert len(tidy.mesh.faces) == len(sheet.faces)
    assert (tidy.mesh.twins < 0).sum() == (sheet.twins < 0).sum()


@pytest.mark.parametrize("directions", [(1, 2), (1, -1), (3, 1)])
def test_spikes_beside_each_other_on_the_rim_are_put_back(directions: tuple[int, int]) -> None:
    """One may lie in the course of the other, and neither be a neighbour to go by."""
    sheet = bumps(600, seed=2)
    edge = sheet.edges[np.flatnonzero(np.bincount(sheet.edge_of_side) == 1)[7]]
    vertices = sheet.vertices.copy()
    vertices[edge] += 5 * sheet.diagonal * np.array(directions)[:, None] * np.ones(3)
    tidy = cleaned(TriangleMesh(vertices, sheet.faces, "Scan"))
    assert tidy.changes == ("2 vertices far off the surface put back",)
    assert np.linalg.norm(tidy.mesh.vertices[edge] - sheet.vertices[edge], axis=1).max() < 0.1 * sheet.diagonal


def test_a_spike_does_not_make_a_part_the_largest() -> None:
    sheet, small = bumps(600, seed=2), bumps(300, seed=3)
    inner = int(small.faces[0, 0])
    other = small.vertices * 0.3 + [3, 0, 0]
    other[inner] += [0, 0, 60]
    mesh = TriangleMesh(
        np.concatenate([sheet.vertices, other]), np.concatenate([sheet.faces, small.faces + len(sheet.vertices)]), "Two"
    )
    tidy = cleaned(mesh, largest_part=True)
    assert tidy.changes == ("1 smaller part left out",)
    assert np.array_equal(tidy.mesh.faces, sheet.faces)


def test_parts_turned_at_random_are_joined_all_along() -> None:
    """What touches along little while it is many pieces touches along more once some are joined."""
    rng = np.random.default_rng(4)
    sheet = bumps(1500, seed=2)
    faces = sheet.faces.copy()
    turned = rng.uniform(size=len(faces)) < 0.4
    faces[turned] = faces[turned][:, [0, 2, 1]]
    loose = loose_triangles(undamaged(TriangleMesh(sheet.vertices, faces, "Loose")), rng)
    tidy = cleaned(loose.mesh, fill_holes=True)
    assert len(topology(tidy.mesh).boundary_loops) == 1
    assert (tidy.mesh.twins < 0).sum() == (sheet.twins < 0).sum()


@pytest.mark.parametrize("name", [f"hand_{k}_{side}" for k in (0, 1, 2) for side in "ab"] + ["foot_3_a", "ear_7_a"])
def test_thin_triangles_at_the_rim_of_hand_and_ear_are_no_spikes(
    real_mesh: Callable[[str], TriangleMesh], name: str
) -> None:
    mesh = real_mesh(f"bodyparts/{name}.obj")
    assert without_spikes(mesh)[1].size == 0
    rim = np.unique(mesh.edges[np.bincount(mesh.edge_of_side) == 1])
    vertices = mesh.vertices.copy()
    vertices[rim[5]] += 4 * mesh.diagonal
    assert without_spikes(TriangleMesh(vertices, mesh.faces, name))[1].tolist() == [rim[5]]


@pytest.mark.parametrize("seed", [2, 3, 5])
def test_nothing_is_left_of_a_thin_tube(seed: int) -> None:
    sheet = bumps(600, seed=2)
    new = handle(undamaged(sheet), np.random.default_rng(seed))
    tidy = cleaned(new.mesh, fill_holes=True)
    assert topology(tidy.mesh).is_disc
    assert {tuple(sorted(face)) for face in tidy.origin[tidy.mesh.faces].tolist()} == {
        tuple(sorted(face)) for face in sheet.faces.tolist()
    }
    normals = [mesh.face_vectors[np.lexsort(np.sort(faces, axis=1).T)] for mesh, faces in (
        (tidy.mesh, tidy.origin[tidy.mesh.faces]), (sheet, sheet.faces)
    )]  # fmt: skip
    assert np.allclose(normals[0], normals[1])
    assert tidy.vertex_of[np.unique(sheet.faces)].min() >= 0
