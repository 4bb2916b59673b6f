import numpy as np
import pytest
from instances import disc_points, nasty_points, random_problem

from solver import Mobius, search
from solver.mobius import hyperbolic_distance
from solver.search.matching import matching

rng = np.random.default_rng(3)
GOOD = disc_points(rng, 4, 0.9), disc_points(rng, 3, 0.9)


def plain_value(source, target, radius, metric, weights, mobius):
    """Q by two loops."""
    total = 0.0
    for j, x in enumerate(mobius(source)):
        best = 0.0
        for k, b in enumerate(target):
            distance = abs(x - b) if metric == "euclidean" else hyperbolic_distance(x, b)
            if distance <= np.broadcast_to(radius, len(target))[k]:
                best = max(best, 1.0 if weights is None else weights[j, k])
        total += best
    return total


@pytest.mark.parametrize("metric", ["hyperbolic", "euclidean"])
@pytest.mark.parametrize("weighted", [False, True])
def test_value_is_the_definition(metric, weighted):
    rng = np.random.default_rng(5)
    for _ in range(50):
        source, target = nasty_points(rng, 8), disc_points(rng, 9, 0.99)
        radius = rng.uniform(0.05, 0.4, 9)
        weights = rng.integers(0, 5, (8, 9)) / 4 if weighted else None
        problem = matching(source, target, radius, metric=metric, weights=weights)
        f = Mobius(complex(disc_points(rng, 1, 0.9)[0]), rng.uniform(-4, 4))
        assert problem.value(f) == plain_value(source, target, radius, metric, weights, f)
        assert problem.value(f) <= problem.limit


def test_matches_list_each_matched_source_point_once_with_its_heaviest_pair():
    target = np.array([0.3, 0.31, -0.5])
    weights = np.array([[0.5, 0.25, 0], [0, 1, 0], [1, 1, 1]])
    problem = matching(np.array([0.3, 0.3, 0.9]), target, 0.1, metric="euclidean", weights=weights)
    assert problem.matches(Mobius()).tolist() == [[0, 0], [1, 1]]
    even = matching(np.array([0.304, 0.309]), target, 0.1, metric="euclidean")
    assert even.matches(Mobius()).tolist() == [[0, 0], [1, 1]], "of equal weights the nearest"


def test_weights_are_rounded_so_that_sums_are_exact():
    rng = np.random.default_rng(0)
    weights = rng.random((200, 1))
    problem = matching(disc_points(rng, 200, 0.9), [0.1], 0.5, weights=weights)
    assert np.abs(problem.weight - weights[:, 0]).max() <= problem.unit / 2 <= 2.0**-21
    assert np.sum(problem.weight) == sum(problem.weight[rng.permutation(200)].tolist()) == problem.limit


def test_reflected_conjugates_the_source():
    problem = random_problem(np.random.default_rng(11))
    f = Mobius(0.2 - 0.3j, 0.8)
    assert problem.reflected().value(f) == problem.value(Mobius(f.z, f.theta, reflected=True))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"source": [0.1, np.nan]}, "source has points that are not finite"),
        ({"target": [0.1, complex(0, np.inf)]}, "target has points that are not finite"),
        ({"source": [0.5, 1.5]}, r"source has points outside the unit disc \(the first is number 1\)"),
        ({"target": [0.5, -1.01]}, "target has points outside the unit disc"),
        ({"source": []}, "source must be a flat, non-empty array"),
        ({"target": np.zeros((2, 2))}, "target must be a flat"),
        ({"radius": 0.0}, "every radius must be a finite number above 0"),
        ({"radius": -0.1}, "every radius must be a finite number above 0"),
        ({"radius": np.nan}, "every radius must be a finite number above 0"),
        ({"radius": np.inf, "metric": "euclidean"}, "every radius must be a finite number above 0"),
        ({"radius": [0.1, 0.1]}, r"one number or one per target point \(3\), not of shape \(2,\)"),
        ({"radius": 1.0}, "hyperbolic radius .* must be below 1"),
        ({"target": [1.0, 0.5]}, "target points inside the unit circle"),
        ({"weights": np.ones((3, 4))}, r"weights must be of shape \(4, 3\), not \(3, 4\)"),
        ({"weights": np.full((4, 3), 1.5)}, r"every weight must lie in \[0, 1\]"),
        ({"weights": np.full((4, 3), -0.5)}, r"every weight must lie in \[0, 1\]"),
        ({"weights": np.full((4, 3), np.nan)}, r"every weight must lie in \[0, 1\]"),
        ({"metric": "taxicab"}, "unknown metric 'taxicab'"),
    ],
)
def test_absurd_input_is_refused_by_name(change, words):
    given = {"source": GOOD[0], "target": GOOD[1], "radius": 0.1} | change
    source, target, radius = given.pop("source"), given.pop("target"), given.pop("radius")
    with pytest.raises(ValueError, match=words):
        matching(source, target, radius, **given)


def test_the_smallest_and_the_largest_radii_are_taken_as_they_are():
    """A disc that floats have no radius for holds its centre; a huge one holds everything."""
    tiny = matching([0, 0.5], [0, 0.5], 5e-324)
    assert tiny.evaluated(Mobius())[0] == 2
    assert tiny.matches(Mobius()).tolist() == [[0, 0], [1, 1]]
    found = search([0, 0.5j], [0.5], 1e300, metric="euclidean")
    assert found.value == found.upper_bound == 2
