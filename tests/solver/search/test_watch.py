"""A search is on time, tells how it goes, can be ended at any moment, and takes the memory that it says."""

import sys
import threading
import time
import tracemalloc

import numpy as np
import pytest
from instances import disc_points, planted

from solver import Mobius, search
from solver.search.kernels import ReferenceKernels
from solver.search.matching import Objective, matching
from solver.search.rival import best_rival

LATE = 0.5
"""Seconds: 0.2 on a machine that has time; tests share theirs."""


def problem(kind):
    """Arguments of searches that take long: in laying arcs, in the improvement, in the set-up, on ties."""
    rng = np.random.default_rng(1)
    if kind == "wide":
        return (disc_points(rng, 2000, 0.97), disc_points(rng, 2000, 0.97), 0.4), {}
    if kind == "many":
        return (disc_points(rng, 5000, 0.97), disc_points(rng, 5000, 0.97), 0.01), {"reflect": True}
    if kind == "weighted":
        weights = rng.random((3000, 3000), dtype=np.float32)
        return (disc_points(rng, 3000, 0.97), disc_points(rng, 3000, 0.97), 0.3), {"weights": weights}
    return (np.full(3000, 0.3 + 0.1j), np.full(3000, 0.3 + 0.15j), 0.05), {"metric": "euclidean"}


KINDS = ["wide", "many", "weighted", "ties"]


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_time_limit_and_progress_are_kept(kind, threads):
    given, options = problem(kind)
    calls, here = [time.perf_counter()], threading.get_ident()

    def tell(progress):
        calls.append(time.perf_counter())
        assert threading.get_ident() == here
        assert progress.value <= progress.upper_bound

    found = search(*given, time_limit=0.6, threads=threads, progress=tell, **options)
    calls.append(time.perf_counter())
    assert calls[-1] - calls[0] < 0.6 + LATE
    assert np.diff(calls).max() < LATE
    assert found.value <= found.upper_bound
    assert found.certified == (found.value == found.upper_bound)
    assert found.out_of_time != found.certified


@pytest.mark.parametrize("kind", KINDS)
def test_cancelling_takes_no_time(kind):
    given, options = problem(kind)
    begun = []

    def stop(progress):
        begun.append(time.perf_counter())
        return progress.seconds < 0.4

    found = search(*given, progress=stop, **options)
    assert found.cancelled
    assert time.perf_counter() - begun[-1] < LATE
    assert not found.out_of_time


def test_the_fallback_in_numpy_is_on_time(monkeypatch):
    monkeypatch.setattr(sys.modules["solver.search.frontier"], "kernels_for", ReferenceKernels)
    given, options = problem("wide")
    begun = time.perf_counter()
    found = search(*given, time_limit=0.3, **options)
    assert time.perf_counter() - begun < 0.3 + LATE
    assert found.value <= found.upper_bound <= 2000


def test_without_time_there_is_an_answer_all_the_same():
    given, options = problem("many")
    begun = time.perf_counter()
    found = search(*given, time_limit=0.0, **options)
    assert time.perf_counter() - begun < LATE
    assert found.out_of_time
    assert found.mobius == Mobius()
    assert found.value <= found.upper_bound == 5000
    small = search([0.1, 0.5], [0.1, 0.5], 0.01, time_limit=0.0)
    assert (small.value, small.certified) == (2, True)


def test_what_is_raised_inside_comes_out_and_ends_the_search():
    def fail(progress):
        raise KeyboardInterrupt

    given, options = problem("wide")
    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        search(*given, progress=fail, **options)
    assert threading.active_count() == before
    with pytest.raises(ValueError, match="every weight"):
        search([0.1], [0.2], 0.1, weights=[[2.0]], time_limit=1.0)


def peak(*given, **options):
    """Megabytes that a search asked for at most."""
    tracemalloc.start()
    try:
        search(*given, threads=1, time_limit=1.0, **options)
        return tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()


def test_memory_is_as_documented():
    rng = np.random.default_rng(2)
    places = disc_points(rng, 4000, 0.97), disc_points(rng, 4000, 0.97)
    fixed = 16 + 8 + 30
    assert peak(*places, 0.01) < fixed + 17
    some = tuple(x[:2000] for x in places)
    weights = rng.random((2000, 2000))
    assert peak(*some, 0.01, weights=weights) < fixed + 2000 * 16384 / 2**20 + 20 * 4e6 / 2**20
    problem = matching(*some, 0.01, weights=weights)
    assert problem.rows is not None
    assert problem.rows.target.nbytes + problem.rows.units.nbytes == 8 * problem.count


def test_more_pairs_than_can_be_numbered_are_refused_with_the_figure():
    many = np.full(66_000, 0.1)
    with pytest.raises(ValueError, match=r"4,356,000,000 pairs may match, more than the 4,294,967,295"):
        search(many, many, 0.1)


def test_a_gap_that_is_allowed_ends_the_search_earlier():
    rng = np.random.default_rng(3)
    source, target = planted(rng, Mobius(0.3, 1.0), 40, 0.4, 0.02)
    weights = rng.random((40, 40))
    whole = search(source, target, 0.05, weights=weights, z_max=0.8)
    near = search(source, target, 0.05, weights=weights, z_max=0.8, gap=0.1)
    assert whole.certified
    assert near.nodes < whole.nodes
    assert not near.certified
    assert whole.value <= near.upper_bound <= 1.1 * near.value
    assert 0 < near.relative_gap <= 0.1
    assert whole.relative_gap == 0
    assert (near.cancelled, near.out_of_time) == (False, False)
    with pytest.raises(ValueError, match="gap must be a share"):
        search(source, target, 0.05, gap=-0.1)


def test_a_search_ends_when_it_is_decided_whether_enough_is_reached():
    rng = np.random.default_rng(4)
    source, target = planted(rng, Mobius(0.3, 1.0), 40, 0.4, 0.005)
    whole = search(source, target, 0.03, z_max=0.8)
    for enough in (whole.value - 5, whole.value, whole.value + 1, whole.value + 5):
        found = search(source, target, 0.03, z_max=0.8, enough=enough)
        assert found.nodes <= whole.nodes
        # decided, and rightly: what is just reached is reached, and the bound is one
        assert (found.value >= enough) == (whole.value >= enough)
        assert found.value >= enough or whole.value <= found.upper_bound < enough


def test_rivals_do_not_depend_on_machine_or_threads(monkeypatch):
    rng = np.random.default_rng(5)
    source, target = planted(rng, Mobius(0.2, 1.0), 50, 0.5, 0.01)
    objective = Objective(source, target, np.full(50, 0.1), rng.random((50, 50)))
    module = sys.modules["solver.search.frontier"]
    kernels_for, found = module.kernels_for, []
    monkeypatch.setattr(sys.modules["solver.search.rival"], "LOOKED_AT", 0)  # decided long before it is over
    for threads, pause in ((1, 0), (2, 0), (2, 0.03)):

        def slow(*given, pause=pause):
            kernels = kernels_for(*given)
            expand = kernels.expand
            kernels.expand = lambda *x: (time.sleep(pause), expand(*x))[1]
            return kernels

        monkeypatch.setattr(module, "kernels_for", slow)
        monkeypatch.setattr("os.cpu_count", lambda threads=threads: threads)
        rival = best_rival(
            objective, [Mobius(0.2, 1.0)], z_max=0.8, enough=25.0, time_limit=None, progress=lambda _: None
        )
        found.append((rival.value, rival.upper_bound, rival.mobius, rival.out_of_time))
    assert len(set(found)) == 1
    assert best_rival(objective, [Mobius(0.2, 1.0)], z_max=0.8, time_limit=0.0).out_of_time
