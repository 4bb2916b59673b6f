"""Meshes with flaws, put in order: what is joined and what stays apart, and how that is told on the mesh as it came."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from damages import (
    Damaged,
    bow_ties,
    closed_lips,
    debris,
    duplicate_faces,
    edges_without_length,
    extreme_size,
    far_away,
    handle,
    inner_faces,
    islands,
    loose_triangles,
    mirror_halves,
    slit,
    some_turned,
    spikes,
    stray_vertices,
    two_sides,
    undamaged,
)
from scans import bumps
from surfaces import planar, rings, spherical_cap

from solver import MeshError, TriangleMesh, cleaned, topology, verdict
from solver.surface.verdict import Verdict


@pytest.fixture(scope="module")
def sheet() -> TriangleMesh:
    return bumps(700, seed=2)


def repaired(damage, sheet: TriangleMesh, seed: int = 3, **asked: bool) -> Verdict:
    new = damage(undamaged(sheet), np.random.default_rng(seed))
    found = verdict(new.mesh, keys=new.keys, **asked)
    tidy = found.tidy
    # the first vertices and the faces are still told by their numbers
    assert tidy.size == len(new.mesh.vertices)
    assert (tidy.origin[: tidy.size] == np.arange(tidy.size)).all()
    kept = tidy.faces >= 0
    own = new.mesh.faces[tidy.faces[kept]].copy()
    own[tidy.reversed[kept]] = own[tidy.reversed[kept]][:, [0, 2, 1]]
    if damage is edges_without_length:
        assert (new.mesh.vertices[tidy.origin[tidy.mesh.faces[kept]]] == new.mesh.vertices[own]).all()
    else:
        assert (new.clean[tidy.origin[tidy.mesh.faces[kept]]] == new.clean[own]).all()
    return found


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "damage",
    [
        loose_triangles,
        mirror_halves,
        islands,
        slit,
        two_sides,
        edges_without_length,
        duplicate_faces,
        inner_faces,
        some_turned,
        stray_vertices,
        debris,
        far_away,
        extreme_size,
    ],
)
def test_a_repaired_disc_is_the_disc_it_was(damage, seed: int, sheet: TriangleMesh) -> None:
    found = repaired(damage, sheet, seed)
    clean = topology(sheet)
    assert found.topology.vertices == clean.vertices
    assert [len(loop) for loop in found.topology.boundary_loops] == [len(clean.boundary_loops[0])]
    assert len(found.tidy.faces) == len(sheet.faces)
    if damage is not stray_vertices:  # no obstacle, and nothing to do
        assert found.repairs


def test_missing_triangles_are_put_in(sheet: TriangleMesh) -> None:
    rim = np.isin(sheet.faces, topology(sheet).boundary_loops[0]).any(axis=1)
    gone = np.flatnonzero(~rim)[[10, 200, 400]]

    def pierced(old: Damaged, _rng: np.random.Generator) -> Damaged:
        return Damaged(TriangleMesh(old.mesh.vertices, np.delete(old.mesh.faces, gone, axis=0), "Pierced"), old.clean)

    found = repaired(pierced, sheet)
    assert found.repairs == ("3 missing triangles put in",)
    first = [{tuple(np.roll(face, -int(np.argmin(face)))) for face in x.faces} for x in (sheet, found.tidy.mesh)]
    assert first[0] == first[1]
    # corners of the faces as they came, the added ones are none of these
    corners = found.tidy.at_corners(np.arange(len(sheet.vertices)), -1)
    assert (corners == found.tidy.original_faces).all()
    with pytest.raises(MeshError, match="4 boundary loops"):
        verdict(pierced(undamaged(sheet), np.random.default_rng()).mesh, fill_holes=False)


def test_bow_ties_become_openings(sheet: TriangleMesh) -> None:
    found = repaired(bow_ties, sheet)
    assert found.repairs == ("1 vertex split in which parts touch in a point only", "1 opening (6 edges) closed")
    tidy, n = found.tidy, len(sheet.vertices)
    assert len(tidy.origin) == n + 1
    # values at the corners of the faces as they came are those of the fan that each is in
    corner = tidy.at_corners(np.arange(n + 1), -1)
    assert (corner[tidy.faces] == tidy.mesh.faces).all()
    assert (tidy.at_vertices(np.arange(n + 1), -1) == np.arange(n)).all()


def test_lips_that_a_shape_opens_stay_apart_and_others_do_not(sheet: TriangleMesh) -> None:
    new = closed_lips(undamaged(sheet), np.random.default_rng(5))
    assert len(verdict(new.mesh, keys=new.keys).topology.boundary_loops) == 2
    assert len(verdict(new.mesh).topology.boundary_loops) == 1


def test_two_sides_of_cloth_are_not_sewn_together(sheet: TriangleMesh) -> None:
    n = len(sheet.vertices)
    both = np.concatenate([sheet.faces, sheet.faces[:, [0, 2, 1]] + n])
    cloth = TriangleMesh(np.concatenate([sheet.vertices] * 2), both, "Cloth")
    assert verdict(cloth).repairs == ("1 smaller part aligned beside it",)
    loose = TriangleMesh(cloth.vertices[both.ravel()], np.arange(both.size).reshape(-1, 3), "Cloth")
    assert topology(cleaned(loose).mesh).parts == 2
    with pytest.raises(MeshError, match="'Cloth' has 2 separate parts"):
        verdict(cloth, largest_part=False)


def test_holes_in_both_sides_of_cloth_do_not_join_them(sheet: TriangleMesh) -> None:
    n, faces = len(sheet.vertices), sheet.faces
    inner = int(np.flatnonzero((sheet.twins.reshape(-1, 3) >= 0).all(axis=1))[0])
    beside = int(sheet.twins[3 * inner]) // 3
    back = np.delete(faces, beside, axis=0)[:, [0, 2, 1]] + n
    both = np.concatenate([np.delete(faces, inner, axis=0), back])
    cloth = TriangleMesh(np.concatenate([sheet.vertices] * 2), both, "Cloth")
    assert verdict(cloth).repairs == ("1 smaller part aligned beside it", "1 missing triangle put in")


def test_a_surface_that_was_cut_open_on_purpose_stays_open() -> None:
    """A globe cut along half a meridian: joined it would be closed again."""
    n, m = 12, 16
    t, p = np.meshgrid(np.linspace(0.2, np.pi - 0.2, n), np.linspace(0, 2 * np.pi, m))
    globe = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=2).reshape(-1, 3)
    globe[-n:] = globe[:n]
    i = (np.arange(m - 1)[:, None] * n + np.arange(n - 1)).ravel()
    poles = [[0, 0, 1], [0, 0, -1]]
    top, bottom = m * n, m * n + 1
    column = np.arange(m - 1) * n
    faces = np.concatenate(
        [
            np.stack([i, i + 1, i + n + 1], axis=1),
            np.stack([i, i + n + 1, i + n], axis=1),
            np.stack([np.full(m - 1, top), column, column + n], axis=1),
            np.stack([np.full(m - 1, bottom), column + 2 * n - 1, column + n - 1], axis=1),
        ]
    )
    mesh = TriangleMesh(np.concatenate([globe, poles]), faces, "Globe")
    assert topology(mesh).is_disc
    assert cleaned(mesh).mesh is mesh
    corner = faces.ravel()
    loose = TriangleMesh(mesh.vertices[corner], np.arange(len(corner)).reshape(-1, 3), "Globe")
    assert verdict(loose).topology.is_sphere


def test_a_thin_handle_is_cut_and_a_wide_one_refused(sheet: TriangleMesh) -> None:
    found = repaired(handle, sheet)
    assert found.repairs == ("1 handle cut through", "2 missing triangles put in")
    with pytest.raises(MeshError, match="has 1 handle like a torus"):
        repaired(handle, sheet, fill_holes=False)
    n = 24
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(n) * 2 * np.pi / n)
    ring = np.stack([(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)], axis=2).reshape(-1, 3)
    i, j = (x.ravel() for x in np.mgrid[:n, :n])
    a, b, c, d = i * n + j, i * n + (j + 1) % n, (i + 1) % n * n + (j + 1) % n, (i + 1) % n * n + j
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    torus = TriangleMesh(ring, faces[5:], "Torus")  # opened a little
    with pytest.raises(MeshError, match="'Torus' has 1 handle"):
        verdict(torus)


@pytest.mark.parametrize("seed", range(4))
def test_the_shortest_loop_is_found_around_a_handle(seed: int) -> None:
    """A sheet with a tube bent over it, narrow in one place: the loop is there, whatever the numbering."""
    from scans import shuffled

    base = planar(rings(12) * 10)
    centre = base.vertices[base.faces].mean(axis=1)
    away = [np.argmin(np.linalg.norm(centre - place, axis=1)) for place in ([-5, 0, 0], [5, 0, 0])]
    one, two = base.faces[away[0]], base.faces[away[1]][[0, 2, 1]]
    lifted, middle = base.vertices[one] + [0, 0, 3], base.vertices[two] + [0, 0, 3]
    waist = (lifted + middle) / 2
    waist = waist.mean(axis=0) + 0.2 * (waist - waist.mean(axis=0)) + 0.05 * np.eye(3)
    n = len(base.vertices)
    rows = [one, n + np.arange(3), n + 3 + np.arange(3), n + 6 + np.arange(3), two]
    faces = [np.delete(base.faces, away, axis=0)]
    for below, above in pairwise(rows):
        ahead, over = np.roll(below, -1), np.roll(above, -1)
        faces += [np.stack([below, ahead, over], axis=1), np.stack([below, over, above], axis=1)]
    mesh = TriangleMesh(np.concatenate([base.vertices, lifted, waist, middle]), np.concatenate(faces), "Cup")
    assert topology(mesh).handles == 1
    mixed, order = shuffled(mesh, seed)
    found = verdict(mixed)
    assert found.repairs[0] == "1 handle cut through"
    cut = order[found.tidy.origin[mixed.vertices.shape[0] :]]
    assert set(cut.tolist()) == {n + 3, n + 4, n + 5}


def test_spikes_are_put_back_and_cones_stay(sheet: TriangleMesh) -> None:
    new = spikes(undamaged(sheet), np.random.default_rng(1))
    found = cleaned(new.mesh)
    assert found.changes == ("2 vertices far off the surface put back",)
    assert np.linalg.norm(found.mesh.vertices - sheet.vertices, axis=1).max() < 0.03 * sheet.diagonal
    k = 24
    around = np.stack([np.cos(np.arange(k) * 2 * np.pi / k), np.sin(np.arange(k) * 2 * np.pi / k), np.zeros(k)], axis=1)
    fan = np.stack([np.arange(k), (np.arange(k) + 1) % k, np.full(k, k)], axis=1)
    cone = TriangleMesh(np.concatenate([around, [[0, 0, 12]]]), fan, "Cone")
    assert cleaned(cone).mesh is cone


def test_thin_triangles_among_thin_ones_are_no_spikes(real_mesh: Callable[[str], TriangleMesh]) -> None:
    """Ears cut out of heads have rims of long thin triangles."""
    for number in (6, 7, 8):
        for side in "ab":
            mesh = real_mesh(f"bodyparts/ear_{number}_{side}.obj")
            assert not any("far off" in said for said in cleaned(mesh).changes)


def test_a_spike_of_the_rim_is_put_back(sheet: TriangleMesh) -> None:
    rim = sheet.edges[np.bincount(sheet.edge_of_side, minlength=len(sheet.edges)) == 1]
    vertices = sheet.vertices.copy()
    vertices[rim[3, 0]] += 5 * sheet.diagonal
    found = cleaned(TriangleMesh(vertices, sheet.faces, "Sheet"))
    assert found.changes == ("1 vertex far off the surface put back",)
    assert np.linalg.norm(found.mesh.vertices - sheet.vertices, axis=1).max() < 0.05 * sheet.diagonal


def test_a_mesh_far_away_in_single_precision_is_said_to_be_coarse(sheet: TriangleMesh) -> None:
    place = np.array([500_000, 4_000_000, 800.0])
    coarse = TriangleMesh((sheet.vertices + place).astype(np.float32), sheet.faces, "Terrain")
    with pytest.raises(
        MeshError, match=r"^'Terrain' lies so far from the origin that its coordinates have steps of 0.25"
    ):
        cleaned(coarse)
    usable = TriangleMesh((40 * sheet.vertices + place).astype(np.float32), sheet.faces, "Terrain")
    said = cleaned(usable).changes
    assert said[0] == "far from the origin, moved there"
    assert said[1].startswith("coordinates in steps of 0.25 at edges of ")
    assert cleaned(TriangleMesh(sheet.vertices + place, sheet.faces)).changes == ("far from the origin, moved there",)


@pytest.mark.parametrize("size", [0.0, 1e-170, 1.0, 1e170])
def test_no_surface_is_refused(size: float) -> None:
    flat = planar(rings(4))
    for name, vertices in (("Line", flat.vertices * [1, 0, 0]), ("Point", 0 * flat.vertices + 1)):
        with pytest.raises(MeshError, match=rf"^'{name}' has (only faces without area|all its faces in one point)"):
            cleaned(TriangleMesh(size * vertices, flat.faces, name))


def test_a_large_wall_is_no_flaw_to_be_left_out() -> None:
    cap, _ = spherical_cap(8, 1.2)
    rim = topology(cap).boundary_loops[0]
    middle = len(cap.vertices)
    floor = np.stack([rim, np.roll(rim, -1), np.full(len(rim), middle)], axis=1)
    outer = np.stack([np.roll(rim, -1), rim, np.full(len(rim), middle + 1)], axis=1)
    mesh = TriangleMesh(
        np.concatenate([cap.vertices, [[0, 0, 0.3], [0, 0, -0.5]]]), np.concatenate([cap.faces, floor, outer]), "Pod"
    )
    with pytest.raises(MeshError, match=r"'Pod' has .* edges in three or more faces"):
        cleaned(mesh)
