import numpy as np
import pytest
from instances import disc_points, planted

from solver import Mobius
from solver.search.measures import mutually_closest, q_bnb, q_mv, q_truth


def test_exact_copies_score_everything_at_the_true_transformation_alone():
    rng = np.random.default_rng(0)
    f = Mobius(0.4 - 0.3j, 2.0)
    source = disc_points(rng, 30, 0.95)
    order = rng.permutation(30)
    target = f(source)[order]
    truth = np.stack([order, np.arange(30)], axis=1)
    assert q_bnb(f, source, target, 1e-6) == 30
    assert q_mv(f, source, target) == 30
    assert q_truth(f, source, target, truth) == 30
    assert q_truth(f, source, f(source)) == 30
    other = Mobius(-0.5, 0.1)
    assert q_bnb(other, source, target, 1e-6) == 0
    assert q_truth(other, source, target, truth) < 10


def test_mutually_closest_against_the_definition():
    rng = np.random.default_rng(1)
    for metric in ("hyperbolic", "euclidean"):
        x, y = disc_points(rng, 25), disc_points(rng, 40)
        d = [[abs(a - b) / (abs(1 - np.conj(b) * a) if metric == "hyperbolic" else 1) for b in y] for a in x]
        expected = [
            [j, k] for j in range(25) for k in range(40) if d[j][k] == min(d[j]) and d[j][k] == min(row[k] for row in d)
        ]
        found = mutually_closest(x, y, metric=metric)
        assert found.tolist() == expected
        back = mutually_closest(y, x, metric=metric)
        assert sorted(found.tolist()) == sorted(back[:, ::-1].tolist())


def test_hyperbolic_counts_do_not_depend_on_the_frame():
    rng = np.random.default_rng(2)
    f, frame = Mobius(0.2, 0.5), Mobius(0.6j, -1.0)
    source, target = planted(rng, f, 40, 0.25, 0.01)
    assert q_mv(f, source, target) == q_mv(frame @ f, source, frame(target))
    assert q_bnb(f, source, target, 0.05) == q_bnb(frame @ f, source, frame(target), 0.05)


def test_points_on_the_rim_are_closest_to_themselves():
    rim = np.exp(2j * np.pi * np.arange(7) / 7)
    assert mutually_closest(rim, rim).tolist() == [[k, k] for k in range(7)]


def test_what_cannot_be_counted_is_refused():
    with pytest.raises(ValueError, match="3 source points and 2 target points"):
        q_truth(Mobius(), [0, 0.1, 0.2], [0, 0.1])
    with pytest.raises(ValueError, match="unknown metric"):
        q_mv(Mobius(), [0], [0], metric="geodesic")
