from dataclasses import replace

import numpy as np
import pytest
from correspondences import planar_correspondence
from surfaces import planar, rings

from solver import Correspondence, TriangleMesh
from solver.carry.fitted import folds, frames_of, in_shape_of, is_reflected, wrapped
from solver.carry.frames import local_similarities


def bent(vertices: np.ndarray) -> np.ndarray:
    """A plane rolled about one axis, with waves: nearly without stretch."""
    x, y = vertices[:, 0], vertices[:, 1]
    return np.stack([np.sin(1.2 * x) / 1.2, y, 0.5 * (1 - np.cos(1.2 * x)) + 0.2 * np.sin(3 * y)], axis=1)


@pytest.fixture(scope="module", params=[1, -1], ids=["straight", "mirrored"])
def case(request: pytest.FixtureRequest) -> tuple[TriangleMesh, TriangleMesh, Correspondence, np.ndarray, int]:
    """A plane, a bent copy elsewhere in another triangulation, and where the plane's vertices belong on it."""
    source, flat = planar(rings(30, jitter=0.4, seed=1)), planar(0.9 * rings(20, jitter=0.4, seed=2))
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= request.param * np.sign(np.linalg.det(turn))

    def move(vertices: np.ndarray) -> np.ndarray:
        return 3 * bent(vertices) @ turn.T + 5

    target = TriangleMesh(move(flat.vertices), flat.faces[:, :: request.param])
    return source, target, planar_correspondence(source, flat), move(source.vertices), request.param


def errors(found: np.ndarray, truth: np.ndarray, target: TriangleMesh) -> np.ndarray:
    return np.linalg.norm(found - truth, axis=1) / target.diagonal


def test_a_wrapped_surface_lies_where_it_belongs(case):
    source, target, correspondence, truth, mirror = case
    found = wrapped(correspondence, source, target)
    assert found.reflected == (mirror < 0) == is_reflected(correspondence, source, target)
    radius = np.linalg.norm(source.vertices[:, :2], axis=1)
    off = errors(found.vertices, truth, target)
    # facets of a twentieth of the radius stand off the curve by a thousandth of it
    assert off[radius < 0.85].max() < 1e-3
    assert off.max() < 0.03  # beyond the rim the displacement is only continued
    assert found.matched[radius < 0.8].all()
    assert not found.matched[radius > 0.99].any()
    assert found.folded == 0


def test_what_is_unmatched_is_filled_smoothly_and_says_nothing(case):
    source, target, correspondence, truth, _ = case
    gap = np.linalg.norm(planar(0.9 * rings(20, jitter=0.4, seed=2)).vertices[:, :2] - [0.3, 0.2], axis=1) < 0.25
    partial = replace(
        correspondence, matched=~gap, barycentric=np.where(gap[:, None], [1, 0, 0], correspondence.barycentric)
    )
    found = wrapped(partial, source, target)
    middle = np.linalg.norm(source.vertices[:, :2] - [0.3, 0.2], axis=1) < 0.1
    assert not found.matched[middle].any()
    assert errors(found.vertices, truth, target)[middle].max() < 0.01
    assert found.folded == 0


def test_the_target_takes_the_shape_of_the_source_and_stays_in_its_place(case):
    source, target, correspondence, _, mirror = case
    found = in_shape_of(correspondence, source, target)
    assert found.matched.all()
    flat = planar(0.9 * rings(20, jitter=0.4, seed=2)).vertices
    edges = target.edges
    lengths = [np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1) for x in (found.vertices, flat)]
    assert np.ptp(lengths[0] / lengths[1]) < 1e-9 * lengths[0].max() / lengths[1].max() + 1e-6  # similar to the plane
    assert np.linalg.norm(found.vertices.mean(axis=0) - target.vertices.mean(axis=0)) < 0.01 * target.diagonal
    flown = TriangleMesh(found.vertices, target.faces)
    # it looks the same way as before
    assert (flown.face_vectors * target.face_vectors).sum(axis=1).mean() > 0
    assert mirror in (1, -1)


@pytest.mark.parametrize("seed", range(4))
def test_wrong_places_make_no_folds(case, seed):
    """Of the vertices 5 % are sent to where others belong, and say that they are certain."""
    source, target, correspondence, _, _ = case
    rng = np.random.default_rng(seed)
    wrong = rng.random(len(correspondence.face)) < 0.05
    near = np.roll(np.arange(len(wrong)), 3)
    confused = replace(
        correspondence,
        face=np.where(wrong, correspondence.face[near], correspondence.face),
        barycentric=np.where(wrong[:, None], correspondence.barycentric[near], correspondence.barycentric),
    )
    found = wrapped(confused, source, target)
    assert found.folded == folds(source, found.vertices).sum() <= 0.002 * len(source.faces)


def test_a_loose_part_rides_along(case):
    source, target, correspondence, _, _ = case
    there = np.array([[0.2, 0.1, 0.1], [0.25, 0.1, 0.1], [0.2, 0.15, 0.1]])
    count = len(source.vertices)
    whole = TriangleMesh(np.vstack([source.vertices, there]), np.vstack([source.faces, np.arange(count, count + 3)]))
    found = wrapped(replace(correspondence, source_size=count + 3), whole, target)
    below = np.argmin(np.linalg.norm(source.vertices - there[0], axis=1))
    assert np.linalg.norm(found.vertices[count] - found.vertices[below]) < 0.6  # 0.1 times the scale, 3, and the roll


def test_frames_turn_with_the_surface(case):
    source, target, correspondence, _, mirror = case
    found = wrapped(correspondence, source, target)
    after = TriangleMesh(found.vertices, source.faces[:, ::mirror])
    rotation, scale = local_similarities(frames_of(source), source, after)
    assert np.sign(np.linalg.det(rotation)).tolist() == [mirror] * len(rotation)
    inside = np.linalg.norm(source.vertices[:, :2], axis=1) < 0.8
    assert np.median(scale[inside]) == pytest.approx(3, rel=0.1)
    outward = np.einsum("nab,nb->na", rotation, source.vertex_normals())
    assert ((outward * after.vertex_normals()).sum(axis=1) > 0.99).all()


def test_three_matched_vertices_are_needed(case):
    source, target, correspondence, _, _ = case
    few = replace(correspondence, matched=np.arange(len(correspondence.face)) < 2)
    for fit in (wrapped, in_shape_of):
        with pytest.raises(ValueError, match="fewer than three"):
            fit(few, source, target)
