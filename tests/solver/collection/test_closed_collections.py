"""Closed surfaces in collections, and specimens that lack a part: what is not there is said, and completed."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from families import grown, specimen
from scans import mirrored, posed
from scipy.spatial.transform import Rotation
from spheres import ball, even_points, hull

from solver import AlignSettings, TriangleMesh
from solver.collection import Plan, collect
from solver.collection.distance import EvenFlow, continuous_procrustes
from solver.collection.shapes import completed, marks, shapes
from solver.flatten.sphere import flatten_sphere
from solver.mobius import SphereMobius

SETTINGS = AlignSettings(samples=60, targets=300, most_nodes=20_000)


def collected(meshes: list[TriangleMesh], root: Path, **given):
    specimens = [specimen(mesh.name, mesh) for mesh in meshes]
    return collect(specimens, root, lambda: ThreadPoolExecutor(2), settings=SETTINGS, at_a_time=2, **given)


def test_a_ball_by_any_conformal_map_is_itself() -> None:
    # an area-preserving map that turns about an axis with the sphere keeps heights (Archimedes)
    flat = flatten_sphere(hull(even_points(2000)))
    axis = np.array([0.6, 0.0, 0.8])
    found = flat.triangles.locate(SphereMobius(tuple(0.3 * axis))(flat.sphere))
    flow = EvenFlow(flat)
    areas = flat.mesh.vertex_areas / flat.mesh.area
    there = flat.domain.mean(flat.sphere, flat.mesh.faces[found[0]], found[1])
    moved = flow.evened(there, *found, areas)
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 1, atol=1e-12)
    assert np.abs((there - flat.sphere) @ axis).mean() > 0.35
    assert np.abs((moved - flat.sphere) @ axis).mean() < 0.03  # a third of that on four times as many vertices
    assert continuous_procrustes(flow, flat, found, mirrored=False) < 0.02


def bent_ball(number: int) -> TriangleMesh:
    """One of a family of closed surfaces, by their vertices the same: every third is mirrored."""
    mesh = ball(700, seed=3)
    bend = 0.15 * np.random.default_rng(number).normal(size=(3, 3))
    moved = posed(TriangleMesh(mesh.vertices + 0.3 * np.sin(mesh.vertices @ bend), mesh.faces), number)
    moved = mirrored(moved) if number % 3 == 2 else moved
    return TriangleMesh(moved.vertices, moved.faces, f"ball-{number}")


def test_closed_surfaces_come_onto_one_topology(tmp_path: Path) -> None:
    meshes = [bent_ball(number) for number in range(3)]
    found = collected(meshes, tmp_path)
    assert not found.failures
    assert not found.suspects.any()
    for (a, b), known in zip(found.edges, found.figures, strict=True):
        assert known.mobius.reflected == ((a % 3 == 2) != (b % 3 == 2))
    common = shapes(found)
    assert common.known.all()
    for row, name in enumerate(common.names):
        truth = meshes[int(name[-1])]
        apart = np.linalg.norm(common.vertices[row] - truth.vertices, axis=1)
        assert apart.mean() < 0.02 * truth.diagonal
        # the template's triangles, turned round where it is mirrored
        assert np.einsum("md,md->m", *_outward(common.mesh(row))).mean() > 0
    # the same folder once more: nothing is done again, and the same comes out
    again = collected(meshes, tmp_path)
    assert again.figures == found.figures
    placed = marks(found, found.names.index("ball-1"), ["tip"], meshes[1].vertices[:1])
    for name, places in zip(placed.names, placed.places, strict=True):
        truth = meshes[int(name[-1])]
        assert np.linalg.norm(places[0] - truth.vertices[0]) < 0.03 * truth.diagonal


def _outward(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return np.cross(b - a, c - a), middle - mesh.vertices.mean(axis=0)


def test_an_open_surface_among_closed_ones_is_named(tmp_path: Path) -> None:
    meshes = [bent_ball(0), bent_ball(1), TriangleMesh(grown(0).vertices, grown(0).faces, "sheet")]
    found = collected(meshes, tmp_path)
    assert list(found.failures) == ["ball-0 to sheet", "ball-1 to sheet"]
    assert sorted(shapes(found).names) == ["ball-0", "ball-1"]


@pytest.mark.parametrize("template", ["sheet-0", "cut"])
def test_what_a_specimen_lacks_is_said_and_completed(template: str, tmp_path: Path) -> None:
    whole, other = grown(0), grown(5)  # the same vertices
    local = grown(0).vertices  # in which a third of the area lies on one side
    middle = whole.vertices[whole.faces].mean(axis=1)
    direction = np.linalg.svd(local - local.mean(axis=0), full_matrices=False)[2][0]
    kept = middle @ direction < np.quantile(middle @ direction, 0.75)
    meshes = [
        TriangleMesh(other.vertices, other.faces[kept], "cut"),
        TriangleMesh(whole.vertices, whole.faces, "sheet-0"),
    ]
    found = collected(meshes, tmp_path, plan=Plan("star", template))
    assert not found.failures
    common = shapes(found)
    truths = {"cut": other, "sheet-0": whole}
    numbers = np.arange(len(whole.vertices)) if template == "sheet-0" else np.flatnonzero(meshes[0].used)
    for row, name in enumerate(common.names):
        truth, here = truths[name], numbers
        apart = np.linalg.norm(common.vertices[row] - truth.vertices[here], axis=1) / truth.diagonal
        assert apart[common.known[row]].mean() < 0.02
        if name != "cut" or template == "cut":
            assert common.known[row].mean() > 0.97
            continue
        lacking = ~np.isin(here, meshes[0].faces)
        assert (common.known[row] == ~lacking).mean() > 0.93
        assert common.missing[row] == pytest.approx(0.25, abs=0.05)
        # completed as the template has it, which is near; not drawn together on the cut
        assert apart[lacking].mean() < 0.06
    at = whole.vertices[[int(np.argmax(whole.vertices @ direction)), int(np.argmin(whole.vertices @ direction))]]
    placed = marks(found, found.names.index("sheet-0"), ["gone", "there"], at)
    assert placed.known[placed.names.index("cut")].tolist() == [False, True]


def test_what_is_known_stays_and_the_rest_follows_by_a_similarity() -> None:
    mesh = grown(0)
    turn = Rotation.from_rotvec([0.3, 1.0, -0.4]).as_matrix()
    for sign in (1.0, -1.0):
        there = 2.5 * mesh.vertices @ turn * [sign, 1, 1] + [1, 2, 3]
        known = mesh.vertices[:, 0] < np.median(mesh.vertices[:, 0])
        found = completed(np.where(known[:, None], there, 0.0), known, mesh, mesh.vertex_areas, mirrored=sign < 0)
        np.testing.assert_allclose(found, there, atol=1e-9)
    assert completed(there, np.zeros_like(known), mesh, mesh.vertex_areas, mirrored=False) is there
