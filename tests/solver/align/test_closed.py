"""Closed surfaces through the whole pipeline: aligned on the sphere, bent, carried, reported, kept in files."""

import json
from dataclasses import replace

import numpy as np
import pytest
from spheres import ball, hull, random_mobius, sphere_points, unit

from solver import (
    AlignSettings,
    MeshError,
    SphereMobius,
    TriangleMesh,
    align,
    correspond,
    interpolate,
    load_map,
    load_surface,
    prepare,
    report,
    save_map,
    save_surface,
    verdict,
)
from solver.align.doubt.hypotheses import by_pose
from solver.align.maps.dense import drafted_from
from solver.flatten.distortion import signed_volumes
from solver.flatten.locate import TriangulatedSphere
from solver.stages import Stages

FEW = AlignSettings(samples=60, targets=400, reflect="never")


def bent(mesh: TriangleMesh, seed: int, count: int, mirror: bool = False) -> tuple[TriangleMesh, np.ndarray]:
    """The star-shaped surface meshed anew at random places, bent, turned and scaled; and where these are on it."""
    rng = np.random.default_rng(seed)
    places = unit(sphere_points(rng, count * 4))
    chosen = [0]
    for k in range(1, len(places)):  # spread out a little
        if np.linalg.norm(places[chosen] - places[k], axis=1).min() > 2.2 / np.sqrt(count):
            chosen.append(k)
    places = places[chosen]
    directions, faces = unit(mesh.vertices), mesh.faces
    face, barycentric = TriangulatedSphere.of(directions, faces).locate(places)
    truth = np.einsum("qk,qkd->qd", barycentric, mesh.vertices[faces[face]])
    x = truth + 0.05 * np.sin(2 * truth[:, [1, 2, 0]] + seed)
    turn = random_mobius(rng, 0, reflect=False).matrix
    mirrored = [-1.0, 1, 1] if mirror else [1.0, 1, 1]
    order = [0, 2, 1] if mirror else [0, 1, 2]
    return TriangleMesh((x * mirrored) @ turn.T * 3 + 5, hull(places).faces[:, order], "bent"), truth


@pytest.mark.parametrize("mirror", [False, True])
def test_a_bent_closed_surface_is_found_again(mirror):
    source = ball(1500, seed=4, name="ball")
    target, truth = bent(source, 1, 800, mirror)
    found = align(source, target, AlignSettings(samples=60, targets=400, reflect="auto", time_limit=3.0))
    assert found.mobius.reflected == mirror
    assert isinstance(found.mobius, SphereMobius)
    carried = correspond(found)
    places = interpolate(carried, source.vertices)
    error = np.linalg.norm(places - truth, axis=1) / source.diagonal
    assert error.mean() < 0.015
    assert carried.confidence.mean() > 0.7
    order = [0, 2, 1] if mirror else [0, 1, 2]
    assert (signed_volumes(found.carried, target.faces[:, order]) > 0).all()
    said = report(found, carried)
    assert said["rotation"]["value"] == said["rotation"]["upper_bound"]
    assert said["certified_for"] == "|h| <= 0.2000"
    assert "no " in said["proved"]
    json.dumps(said)


def test_the_same_surface_matches_itself():
    mesh = ball(1200, seed=2)
    found = align(mesh, mesh, FEW)
    carried = correspond(found)
    assert np.abs(interpolate(carried, mesh.vertices) - mesh.vertices).max() < 0.01
    assert found.search.rotations_certified


def test_a_closed_surface_inside_out_is_turned():
    mesh = ball(1200, seed=2)
    other = TriangleMesh(mesh.vertices, mesh.faces[:, [0, 2, 1]], "inside out")
    found = align(mesh, other, FEW)
    assert np.abs(interpolate(correspond(found), mesh.vertices) - mesh.vertices).max() < 0.01


def test_landmarks_join_the_search():
    mesh = ball(1200, seed=2)
    found = align(mesh, mesh, FEW, landmarks=[[5, 5], [300, 300], [900, 900]])
    assert len(found.source_samples) > 60
    assert np.abs(interpolate(correspond(found), mesh.vertices) - mesh.vertices).max() < 0.01


def test_a_rigid_pose_implies_a_transformation_of_the_sphere():
    mesh = ball(1200, seed=2)
    turn = random_mobius(np.random.default_rng(3), 0, reflect=False).matrix
    matched = align(mesh, TriangleMesh(2 * mesh.vertices @ turn.T + 1, mesh.faces), replace(FEW, refine="mobius"))
    clock = Stages(None).part(0.0, 1.0)
    wrong = replace(matched, mobius=random_mobius(np.random.default_rng(4), 0.1, reflect=False))
    hypothesis = by_pose(wrong, drafted_from(wrong, clock)[0].onto, lambda _: False)
    assert hypothesis is not None
    found = hypothesis.alignment
    assert isinstance(found.mobius, SphereMobius)
    there = found.mobius(found.source.places)
    assert np.linalg.norm(there - found.target.places, axis=1).max() < 0.01
    assert found.taken is not None
    assert found.taken.value >= 0.9 * matched.value


def test_closed_and_open_do_not_go_together():
    mesh = ball(600, name="egg")
    opened = TriangleMesh(mesh.vertices, mesh.faces[30:], "bowl")
    with pytest.raises(MeshError, match="'egg' is closed"):
        align(mesh, opened, AlignSettings(samples=20, targets=100, fill_holes=True))


@pytest.mark.parametrize("refine", ["none", "mobius"])
def test_without_bending(refine):
    source = ball(1500, seed=4)
    target, truth = bent(source, 3, 900)
    found = align(source, target, AlignSettings(samples=60, targets=400, reflect="never", refine=refine))
    places = interpolate(correspond(found), source.vertices)
    assert np.linalg.norm(places - truth, axis=1).mean() / source.diagonal < {"none": 0.06, "mobius": 0.03}[refine]


def test_maps_and_surfaces_are_kept_in_files(tmp_path):
    mesh = ball(900, seed=2)
    surface = prepare(mesh, FEW)
    save_surface(tmp_path / "ball.npz", surface)
    again = load_surface(tmp_path / "ball.npz")
    assert (again.flattening.places == surface.flattening.places).all()
    found = align(again, surface, FEW)
    carried = correspond(found)
    save_map(tmp_path / "map.npz", found, carried)
    loaded = load_map(tmp_path / "map.npz", mesh, mesh)
    assert (loaded.face == carried.face).all()
    with np.load(tmp_path / "map.npz") as file:
        assert file["source_disc"].shape == (900, 3)
        assert file["h"].shape == (3,)


def test_cortex_left_and_right(real_mesh):
    source, target = real_mesh("closed/conte69_L.ply"), real_mesh("closed/conte69_R_mirrored.ply")
    found = align(source, target, AlignSettings(reflect="never"))
    carried = correspond(found)
    error = np.linalg.norm(interpolate(carried, source.vertices) - source.vertices, axis=1) / source.diagonal
    assert error.mean() < 0.01
    assert (signed_volumes(found.carried, target.faces) > 0).all()
    assert found.search.rotations_certified
    assert found.search.relative_gap <= 0.05


def test_a_closed_mesh_is_called_usable():
    assert verdict(ball(300)).describe() == "closed, 300 vertices: goes to the sphere, beside another closed one"
    assert verdict(ball(300)).repairs == ()
