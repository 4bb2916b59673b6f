"""The search on the sphere: bounds, exactness, and what it promises."""

import time

import numpy as np
import pytest
from attacks import libraries, violations
from hypothesis import given, settings
from hypothesis import strategies as st
from sphere_attacks import attack, cells_of, kernels_of, searched, seen_through_wider_caps
from spheres import even_points, random_mobius, sphere_points, unit

from solver.mobius import SphereMobius
from solver.search.frontier import SMALLEST_CELL
from solver.search.kernels.nodes import HALF
from solver.search.kernels.sphere_kernels import CompiledSphereKernels, bound_sphere_cells
from solver.search.kernels.sphere_nodes import FACE, new_sphere_nodes, whole_sphere
from solver.search.sphere_bounds import FACES, frames, images, transformation
from solver.search.sphere_certificate import certify_sphere
from solver.search.sphere_matching import sphere_matching, surely_within
from solver.search.sphere_search import sphere_search


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**9))
def test_no_bound_is_below_a_value(seed):
    assert not violations(cells_of(seed, 60))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**9))
def test_no_search_claims_what_is_not_so(seed):
    assert not violations(searched(seed, 0.05))


def test_the_attack_sees_what_is_wrong():
    assert seen_through_wider_caps(attack, rotation=True) > 20


def test_frames_and_transformations_agree():
    rng = np.random.default_rng(0)
    nodes = new_sphere_nodes(60)
    nodes[:, :2], nodes[:, FACE] = rng.uniform(-1, 1, (60, 2)), rng.integers(0, 6, 60)
    assert np.abs(np.linalg.det(FACES) - 1).max() < 1e-15
    for node, frame in zip(nodes, frames(nodes), strict=True):
        phi = rng.uniform(-9, 9)
        about = np.array([[np.cos(phi), -np.sin(phi), 0], [np.sin(phi), np.cos(phi), 0], [0, 0, 1]])
        assert np.abs(transformation(node, phi).matrix - about @ frame).max() < 1e-14
        axis = np.linalg.inv(FACES[int(node[FACE])]) @ [*node[:2], 1]
        assert np.abs(frame @ unit(axis) - [0, 0, 1]).max() < 1e-14


def test_compiled_images_are_those_of_numpy():
    rng = np.random.default_rng(1)
    nodes = new_sphere_nodes(100)
    nodes[:, :2], nodes[:, FACE] = rng.uniform(-1, 1, (100, 2)), rng.integers(0, 6, 100)
    nodes[:, HALF] = 10.0 ** rng.uniform(-9, -0.5, 100)
    source = sphere_points(rng, 50)
    problem = sphere_matching(source, source, 0.1)
    expected = images(source, nodes)
    for library in libraries().values():
        with kernels_of(library):
            kernels = CompiledSphereKernels(problem, SMALLEST_CELL)
        for k, node in enumerate(nodes):
            alpha, delta, near, far = kernels.images_of(node)
            want_alpha, want_delta, want_near, want_far = (x[k] for x in expected)
            assert np.abs(np.angle(np.exp(1j * (alpha * 2 * np.pi - want_alpha)))).max() < 1e-9
            seen = want_delta < np.pi
            # the polynomials of C exceed the arcsine by up to some per cent of large angles
            assert (delta * 2 * np.pi >= want_delta - 1e-9)[seen].all()
            assert (delta * 2 * np.pi <= 1.2 * want_delta + 1e-9)[seen & (delta < 0.5)].all()
            assert max(np.abs(near - want_near).max(), np.abs(far - want_far).max()) < 1e-4


def test_at_a_point_bound_and_value_are_the_same():
    rng = np.random.default_rng(2)
    for _ in range(20):
        source, target = sphere_points(rng, 8), sphere_points(rng, 9)
        problem = sphere_matching(source, target, rng.uniform(0.1, 0.8, 9), weights=rng.integers(0, 5, (8, 9)) / 4)
        nodes = new_sphere_nodes(10)
        nodes[:, :2], nodes[:, FACE] = rng.uniform(-1, 1, (10, 2)), rng.integers(0, 6, 10)
        bounds, angles = bound_sphere_cells(problem, nodes)
        for node, bound, phi in zip(nodes, bounds, angles, strict=True):
            assert problem.value(transformation(node, float(phi))) == bound


def brute_force(source: np.ndarray, target: np.ndarray, radius: float, weights: np.ndarray) -> float:
    """The best rotation by trying those that carry two points onto rims or centres of two caps, and some between."""
    problem = sphere_matching(source, target, radius, weights=weights)
    rng = np.random.default_rng(0)
    best = 0.0
    for j in range(len(source)):
        for k in range(len(target)):
            for spot in [
                target[k],
                *unit(target[k] + 0.999 * radius * unit(np.cross(target[k], sphere_points(rng, 12)))),
            ]:
                onto = SphereMobius(rotation=(1 + float(source[j] @ spot), *np.cross(source[j], spot).tolist()))
                for turn in np.linspace(0, np.pi, 40, endpoint=False):
                    x, y, z = (np.sin(turn) * spot).tolist()
                    best = max(best, problem.value(SphereMobius(rotation=(float(np.cos(turn)), x, y, z)) @ onto))
    return best


def test_rotations_against_brute_force():
    rng = np.random.default_rng(3)
    for _ in range(3):
        source, target = sphere_points(rng, 4), sphere_points(rng, 5)
        weights = rng.integers(0, 5, (4, 5)) / 4
        found = sphere_search(source, target, 0.3, weights=weights, h_max=0)
        assert found.certified
        tried = brute_force(source, target, 0.3, weights)
        assert found.value >= tried
        assert found.value <= tried + 0.5


@pytest.mark.parametrize("h", [0.0, 0.1, 0.19])
@pytest.mark.parametrize("reflected", [False, True])
def test_a_planted_transformation_is_found(h, reflected):
    rng = np.random.default_rng(int(100 * h))
    source = sphere_points(rng, 40)
    x, y, z = (h * sphere_points(rng, 1)[0]).tolist()
    planted = SphereMobius((x, y, z), tuple(rng.normal(size=4).tolist()), reflected)
    target = planted(source)
    found = sphere_search(source, target, 0.05, reflect=True, time_limit=20)
    assert found.value == 40
    assert found.certified
    assert found.mobius.reflected == reflected
    assert np.linalg.norm(found.mobius(source) - target, axis=1).max() <= 0.05 + 1e-12
    if h > 0.1:
        assert found.rotation_value < 40


def weighted(seed: int = 0, n1: int = 60, n2: int = 400) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points that stand for two surfaces alike, radii to the second nearest neighbour, weights from noisy features."""
    rng = np.random.default_rng(seed)
    target = even_points(n2)
    source = unit(target[rng.permutation(n2)[:n1]] + 0.03 * rng.normal(size=(n1, 3)))
    image = random_mobius(rng, 0.04, reflect=False)(source)
    waves, phase = 3 * rng.normal(size=(8, 3)), rng.uniform(0, 7, 8)
    a, b = np.sin(image @ waves.T + phase) + 0.4 * rng.normal(size=(n1, 8)), np.sin(target @ waves.T + phase)
    rank = np.argsort(np.argsort(((a[:, None] - b) ** 2).sum(axis=2), axis=1), axis=1)
    radius = np.sort(np.linalg.norm(target[:, None] - target, axis=2), axis=1)[:, 2]
    return source, target, radius, np.maximum(1 - rank / (0.1 * n2), 0)


def test_the_result_does_not_depend_on_threads():
    source, target, radius, weights = weighted()
    found = [sphere_search(source, target, radius, weights=weights, gap=0.06, threads=k) for k in (1, 2, 5)]
    assert len({(x.mobius, x.value, x.upper_bound, x.nodes) for x in found}) == 1
    assert found[0].relative_gap <= 0.06
    assert found[0].rotations_certified


def test_the_trace_runs_from_nothing_to_the_outcome():
    source, target, radius, weights = weighted()
    found = sphere_search(source, target, radius / 2, weights=weights, most_nodes=30_000, threads=1)
    seconds, nodes, value, bound = np.array([(x.seconds, x.nodes, x.value, x.upper_bound) for x in found.trace]).T
    assert len(found.trace) >= 4
    assert (np.diff(seconds) >= 0).all()
    assert (np.diff(nodes) >= 0).all()
    assert (np.diff(value) >= 0).all()
    assert (np.diff(bound) <= 0).all()
    assert (value[-1], bound[-1], nodes[-1]) == (found.value, found.upper_bound, found.nodes)


def test_pose_does_not_matter():
    source, target, radius, weights = weighted(1)
    first = sphere_search(source, target, radius, weights=weights, h_max=0)
    turn = SphereMobius(rotation=(0.3, 0.5, -0.2, 0.9))
    moved = sphere_search(turn(source), target, radius, weights=weights, h_max=0)
    other = sphere_search(source, turn(target), radius, weights=weights, h_max=0)
    assert first.certified
    assert moved.value == pytest.approx(first.value, abs=0.02)
    assert other.value == pytest.approx(first.value, abs=0.02)


def test_numpy_and_c_agree():
    source, target, radius, weights = weighted(2, 12, 60)
    values = set()
    for library in (*libraries().values(), None):
        with kernels_of(library):
            found = sphere_search(source, target, radius, weights=weights, h_max=0)
        assert found.certified
        values.add(found.value)
    assert len(values) == 1


def test_the_search_ends_when_it_is_told_to():
    source, target, radius, weights = weighted(3, 100, 1000)
    begun = time.perf_counter()
    found = sphere_search(source, target, radius, weights=weights, time_limit=0.7)
    assert time.perf_counter() - begun < 2
    assert found.out_of_time
    assert found.upper_bound >= found.value > 0
    assert found.upper_bound >= found.rotation_bound
    calls = []

    def stop(state):
        calls.append(state)
        return len(calls) < 3

    cancelled = sphere_search(source, target, radius, weights=weights, progress=stop)
    assert cancelled.cancelled
    assert cancelled.upper_bound >= cancelled.value


def test_the_check_proves_a_bound_again_and_refuses_a_wrong_one():
    rng = np.random.default_rng(5)
    source, target = sphere_points(rng, 3), sphere_points(rng, 3)
    found = sphere_search(source, target, 0.4, h_max=0)
    claim = found.mobius, found.value, found.upper_bound, source, target, 0.4
    assert certify_sphere(*claim, h_max=0, prove=True).bound_holds
    assert not certify_sphere(claim[0], claim[1] + 1, *claim[2:], h_max=0).value_holds
    assert certify_sphere(*claim[:2], claim[1] - 1, *claim[3:], h_max=0).bound_holds is False
    two = sphere_search(source[:2], target[:2], 0.2, h_max=0.05)
    assert certify_sphere(two.mobius, two.value, two.upper_bound, source[:2], target[:2], 0.2, h_max=0.05).value_holds
    reflected = SphereMobius((0.1, 0, 0), reflected=True)
    assert len(certify_sphere(reflected, 0, 3, source, target, 0.4, h_max=0.05).objections) >= 2


@pytest.mark.parametrize(
    "wrong",
    [
        {"radius": -0.4},
        {"radius": np.nan},
        {"radius": 5},
        {"radius": [0.4, 0.4]},
        {"h_max": -0.1},
        {"h_max": np.nan},
        {"source": 2 * np.eye(3)},
        {"source": np.eye(3)[:, :2]},
        {"target": np.full((3, 3), np.nan)},
        {"weights": np.full((3, 3), 2)},
        {"weights": np.full((3, 3), np.nan)},
        {"weights": np.ones(3)},
    ],
)
def test_nothing_is_certified_about_what_cannot_be_searched(wrong):
    given = {"source": np.eye(3), "target": np.eye(3), "radius": 0.4, "h_max": 0.0}
    assert certify_sphere(SphereMobius(), 3, 3, **given, prove=True).bound_holds
    with pytest.raises(ValueError, match=next(iter(wrong)).removesuffix("s")):
        certify_sphere(SphereMobius(), 3, 3, **given | wrong, prove=True)


def test_pairs_on_the_rim_are_decided_exactly():
    """A quaternion of whole numbers and points of Pythagoras: the distance is the root of 2 to the last digit."""
    f = SphereMobius(rotation=(1, 0, 0, 1))  # x to y
    m, b = np.array([[1.0, 0, 0]]), np.array([[1.0, 0, 0]])
    root = np.sqrt(2.0)
    assert surely_within(f, m, b, np.array([np.nextafter(root, 2)])).all()
    assert not surely_within(f, m, b, np.array([np.nextafter(root, 0)])).any()
    assert surely_within(f, m, np.array([[0, 1.0, 0]]), np.array([0.0])).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[1, 0]], [[1, 0, 0]], 0.1), r"shape \(n, 3\)"),
        ((np.zeros((0, 3)), [[1, 0, 0]], 0.1), r"shape \(n, 3\)"),
        (([[1, 0, 0]], [[2, 0, 0]], 0.1), "target has points off the unit sphere"),
        (([[np.nan, 0, 0]], [[1, 0, 0]], 0.1), "not finite"),
        (([[1, 0, 0]], [[1, 0, 0]], 0.0), "chord"),
        (([[1, 0, 0]], [[1, 0, 0]], 2.5), "chord"),
        (([[1, 0, 0]], [[1, 0, 0]], [0.1, 0.2]), "one per target point"),
    ],
)
def test_what_cannot_be_searched_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        sphere_search(*arguments)
    points = [[1.0, 0, 0]]
    for options in ({"h_max": 0.95}, {"h_max": -1}, {"time_limit": -1}, {"threads": 0}, {"gap": -0.1}):
        with pytest.raises(ValueError, match=next(iter(options))):
            sphere_search(points, points, 0.1, **options)
    with pytest.raises(ValueError, match="weight"):
        sphere_search(points, points, 0.1, weights=[[2.0]])


def test_all_cells_together_are_the_whole_sphere():
    rng = np.random.default_rng(0)
    nodes = whole_sphere(1.0)
    for x in sphere_points(rng, 200):
        inside = [np.abs((FACES[f] @ x)[:2]).max() <= (FACES[f] @ x)[2] for f in nodes[:, FACE].astype(int)]
        assert any(inside)
