import numpy as np
import pytest
from scans import bumps, mirrored, percent, posed, remeshed, shuffled

from solver import Flattening, Mobius, TriangleMesh, flatten
from solver.align.result.overlap import piece
from solver.bend.bend import bent, finished
from solver.bend.draft import drafted
from solver.bend.plate import CUT_REACH, RIM_REACH
from solver.bend.unfold import in_order, injective, mean_value_weights
from solver.flatten.distortion import signed_areas
from solver.flatten.locate import TriangulatedDisc


@pytest.fixture(scope="module")
def source():
    return flatten(bumps(2000, seed=1))


def places(carried: np.ndarray, source: Flattening) -> np.ndarray:
    """Where points of the source's disc lie on the source, (q, 3)."""
    face, barycentric = TriangulatedDisc.of(source.disc, source.mesh.faces).locate(carried)
    return np.einsum("qk,qkd->qd", barycentric, source.mesh.vertices[source.mesh.faces[face]])


def stretched(mesh: TriangleMesh) -> TriangleMesh:
    """A smooth deformation that no Möbius map follows: wider on one side, higher in the middle."""
    x, y, z = mesh.vertices.T
    return TriangleMesh(
        np.column_stack([x * (1 + 0.15 * y), y * (1 - 0.1 * x), z + 0.15 * np.exp(-4 * (x**2 + y**2))]), mesh.faces
    )


def onto(truth: np.ndarray, disc: np.ndarray, reflected: bool = False) -> Mobius:
    """The best rotation, with z = 0, from the source's disc to the target's, by the truth."""
    start = np.conj(truth) if reflected else truth
    return Mobius(0, float(np.angle(np.vdot(start, disc))), reflected)


@pytest.mark.parametrize("reflected", [False, True])
def test_a_smooth_deformation_is_followed_without_folds(source, reflected):
    """Another triangulation, pose and scale, deformed, perhaps mirrored: nearer than Möbius, and injective."""
    target, vertex = remeshed(stretched(source.mesh), 0.7, 1)
    target = flatten(posed(mirrored(target) if reflected else target, 2))
    mobius = onto(source.disc[vertex], target.disc, reflected)
    found = bent(mobius, source, target)
    truth = source.mesh.vertices[vertex]
    conformal = percent(places(mobius.inverse()(target.disc), source), truth, source.mesh).mean()
    error = percent(places(found.carried, source), truth, source.mesh)
    assert error.mean() < 0.7 * conformal
    areas = signed_areas(found.carried, target.mesh.faces)
    assert (areas * (-1 if reflected else 1) > 0).all()
    assert np.median(found.offset) < 0.01


def test_a_strip_that_is_missing_stays_missing_where_boundaries_hardly_reach(source):
    """A twentieth of its width cut off, less on one side: drawn to the other's edge unless that reaches less far."""
    within = np.linalg.norm(source.mesh.vertices[:, :2], axis=1) < 0.93 + 0.05 * source.mesh.vertices[:, 0]
    part = piece(source, within)
    assert part is not None
    mesh, vertex = remeshed(posed(part.mesh, 1), 0.8, 2)
    target, own = flatten(mesh), part.vertices[vertex]
    mobius = onto(source.disc[own], target.disc)
    draft = drafted(mobius, source, target)
    near, far = (
        percent(
            places(finished(draft, source, target, reach=reach).carried, source),
            source.mesh.vertices[own],
            source.mesh,
        ).mean()
        for reach in (CUT_REACH, RIM_REACH)
    )
    assert near < 0.5 * far


def test_itself_stays_itself(source):
    found = bent(Mobius(), source, source)
    assert percent(places(found.carried, source), source.mesh.vertices, source.mesh).max() < 0.1
    assert found.offset.max() < 1e-3
    assert found.repaired == 0


@pytest.mark.parametrize("angle", [2.6, np.pi])
def test_a_rolled_sheet_is_followed(source, angle):
    """Up to half around: no rigid pose fits it."""
    target = flatten(posed(bumps(1500, seed=1, bend=angle), 3))
    flat = bumps(1500, seed=1)
    near = np.hypot(*(flat.vertices[:, None, :2] - source.mesh.vertices[:, :2]).transpose(2, 0, 1)).argmin(axis=1)
    mobius = onto(source.disc[near], target.disc)
    found = bent(mobius, source, target)
    conformal = percent(places(mobius.inverse()(target.disc), source), flat.vertices, source.mesh)
    error = percent(places(found.carried, source), flat.vertices, source.mesh)
    # rolling stretches what is high, so that neither map can be exact
    assert error.mean() < 0.85 * conformal.mean()
    assert (signed_areas(found.carried, target.mesh.faces) > 0).all()


@pytest.mark.parametrize("angle", [np.pi, 4.5])
def test_a_flat_sheet_is_rolled_up(angle):
    """Tighter than rotations are averaged over at first."""
    rolled, flat = bumps(2000, seed=1, bend=angle), bumps(2000, seed=1)
    source, target = flatten(rolled), flatten(posed(flat, 3))
    mobius = onto(source.disc, target.disc)
    found = bent(mobius, source, target)
    conformal = percent(places(mobius.inverse()(target.disc), source), rolled.vertices, source.mesh)
    error = percent(places(found.carried, source), rolled.vertices, source.mesh)
    assert error.mean() < 0.85 * conformal.mean()
    assert (signed_areas(found.carried, target.mesh.faces) > 0).all()


@pytest.mark.parametrize("side", ["source", "target"])
def test_pose_scale_and_order_do_not_matter(source, side):
    """A similarity of either surface and another order of its vertices: the same map."""
    mesh, vertex = remeshed(stretched(source.mesh), 0.7, 1)
    target = flatten(mesh)
    mobius = onto(source.disc[vertex], target.disc)
    expected = places(bent(mobius, source, target).carried, source)
    moved, order = shuffled(posed(source.mesh if side == "source" else mesh, 5), 6)
    if side == "target":
        again = flatten(moved)
        found = places(bent(onto(source.disc[vertex[order]], again.disc), source, again).carried, source)
        expected = expected[order]
    else:
        again = flatten(moved)
        carried = bent(onto(again.disc[np.argsort(order)][vertex], target.disc), again, target).carried
        face, barycentric = TriangulatedDisc.of(again.disc, moved.faces).locate(carried)
        found = np.einsum("qk,qkd->qd", barycentric, source.mesh.vertices[order][moved.faces[face]])
    assert percent(found, expected, source.mesh).mean() < 0.005


def test_a_plane_may_slide_along_itself():
    """Nothing but the Möbius map says where: tangent planes leave three ways of moving open."""
    mesh = bumps(500, seed=1)
    level = flatten(TriangleMesh(mesh.vertices * np.array([1, 1, 0]), mesh.faces))
    found = bent(Mobius(), level, level)
    assert percent(places(found.carried, level), level.mesh.vertices, level.mesh).max() < 0.1


def test_loose_vertices_go_nowhere(source):
    mesh = TriangleMesh(np.vstack([[[9, 9, 9]], source.mesh.vertices]), source.mesh.faces + 1)
    found = bent(Mobius(), source, flatten(mesh))
    assert np.isnan(found.carried[0])
    assert np.isfinite(found.carried[1:]).all()


def test_progress_rises_and_may_end_it(source):
    seen = []
    bent(Mobius(), source, source, seen.append)
    assert seen == sorted(seen)
    assert 0 <= seen[0] <= seen[-1] <= 1

    def stop(_: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bent(Mobius(), source, source, stop)


def test_mean_value_weights_reproduce_the_plane():
    flattening = flatten(bumps(200, seed=0))
    weights = mean_value_weights(flattening.disc, flattening.mesh.faces)
    inside = np.setdiff1d(np.arange(len(flattening.disc)), flattening.boundary)
    mean = (weights @ flattening.disc) / weights.sum(axis=1)
    assert weights.data.min() > 0
    assert mean[inside] == pytest.approx(flattening.disc[inside], abs=1e-9)


def test_folds_are_undone_near_where_they_are(source):
    """Some vertices thrown about in one place, the boundary crumpled in another: the rest stays."""
    rng = np.random.default_rng(4)
    disc, faces = source.disc, source.mesh.faces
    thrown = np.flatnonzero(np.abs(disc - 0.2) < 0.08)
    tangled = disc.copy()
    tangled[thrown] += 0.05 * (rng.normal(size=len(thrown)) + 1j * rng.normal(size=len(thrown)))
    crumpled = source.boundary[10:16]
    tangled[crumpled] = tangled[crumpled[::-1]]
    assert (signed_areas(tangled, faces) <= 0).sum() > 10
    result, moved = injective(tangled, disc, faces, source.boundary, ())
    assert (signed_areas(result, faces) > 0).all()
    assert 0 < moved < len(disc) / 4
    assert moved == (result != tangled).sum()


def swirled(disc: np.ndarray) -> np.ndarray:
    """The inside turned by two and a half radians, the boundary not."""
    return disc * np.exp(2.5j * (1 - np.abs(disc)))


def noisy(disc: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(8)
    return disc + 0.1 * (rng.normal(size=len(disc)) + 1j * rng.normal(size=len(disc)))


HARD = {
    "all in one point": lambda disc: np.full_like(disc, 0.3 + 0.1j),
    "overhanging": lambda disc: np.minimum(disc.real, 0.3) + 1j * disc.imag,
    "pleated": lambda disc: disc + 0.2 * np.sin(15 * disc.real),
    "mirrored": np.conj,
    "noisy": noisy,
    "swirled": swirled,
}


@pytest.mark.parametrize("holes", [0, 1])
@pytest.mark.parametrize("kind", HARD)
def test_hard_maps_become_injective(source, kind, holes):
    """Whatever closest points gave: no triangle is turned over or collapsed, also around an opening."""
    flattening = source
    if holes:
        mesh = source.mesh
        away = np.hypot(*(mesh.vertices[mesh.faces].mean(axis=1)[:, :2] - [0.2, 0.1]).T) > 0.15
        flattening = flatten(TriangleMesh(mesh.vertices, mesh.faces[away]), fill_holes=True)
    faces = flattening.mesh.faces
    used = np.unique(faces)
    disc = flattening.disc.copy()
    disc[used] = HARD[kind](disc[used])
    disc[used] /= np.maximum(np.abs(disc[used]), 1)
    assert len(flattening.holes) == holes
    result, moved = injective(disc, flattening.disc, faces, flattening.boundary, flattening.holes)
    assert (signed_areas(result, faces) > 0).all()
    assert np.abs(result[used]).max() < 1 + 1e-9
    assert moved == (np.abs(result - disc)[used] > 0).sum()


def test_the_boundary_is_put_in_order():
    conformal = np.exp(2j * np.pi * np.arange(40) / 40)
    moved = conformal * np.exp(0.3j * np.sin(3 * np.angle(conformal)))
    assert in_order(moved, conformal) == pytest.approx(moved)
    swapped = moved.copy()
    swapped[[5, 6]] = moved[[6, 5]]
    found = in_order(swapped, conformal)
    steps = np.angle(np.roll(found, -1) / found)
    assert steps.min() > 0
    assert np.delete(found, [5, 6]) == pytest.approx(np.delete(moved, [5, 6]))
    assert np.conj(in_order(np.conj(swapped), np.conj(conformal))) == pytest.approx(found)
