import threading
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scans import bumps, posed

from solver import AlignSettings, TriangleMesh, align
from solver.align.doubt import reconsider
from solver.align.surfaces import side_by_side as module
from solver.align.surfaces.side_by_side import side_by_side
from solver.stages import Cancelled, Progress


def waiting_for(other: threading.Event, own: threading.Event) -> Callable[[Callable[[float], None]], None]:
    """Work that ends only if other work runs at the same time."""

    def work(note: Callable[[float], None]) -> None:
        own.set()
        assert other.wait(10)
        note(1.0)

    return work


def test_both_run_at_the_same_time_and_the_caller_is_told():
    one, other = threading.Event(), threading.Event()
    here, told = threading.current_thread(), []
    side_by_side([waiting_for(one, other), waiting_for(other, one)], told.append, threads=True)

    def slow(note: Callable[[float], None]) -> None:
        assert threading.current_thread() is not here
        note(0.5)
        time.sleep(0.25)

    def tell(share: float) -> None:
        assert threading.current_thread() is here
        told.append(share)

    side_by_side([slow, slow], tell, threads=True)
    assert told[-1] == 0.5


def test_one_after_the_other_the_shares_grow():
    told: list[float] = []
    side_by_side([lambda note: note(0.5), lambda note: note(1.0)], told.append, threads=False)
    assert told == [0.25, 1.0]


def test_a_cancel_ends_the_works_and_leaves_no_thread():
    ended: list[bool] = []

    def endless(note: Callable[[float], None]) -> None:
        try:
            while True:
                time.sleep(0.01)
                note(0.1)
        finally:
            ended.append(True)

    def cancel(_: float) -> None:
        raise Cancelled

    before = threading.active_count()
    with pytest.raises(Cancelled):
        side_by_side([endless, endless], cancel, threads=True)
    assert len(ended) == 2
    assert threading.active_count() == before


def test_what_a_work_raises_is_raised_that_of_the_first_before():
    def wrong(text: str) -> Callable[[object], None]:
        def work(_: object) -> None:
            raise ValueError(text)

        return work

    for threads in (False, True):
        with pytest.raises(ValueError, match="one"):
            side_by_side([wrong("one"), wrong("two")], lambda _: None, threads=threads)


SMALL = AlignSettings(samples=40, targets=200)


def pair() -> tuple[TriangleMesh, TriangleMesh]:
    mesh = bumps(300, seed=6)
    return mesh, posed(mesh, seed=1)


def test_two_threads_find_the_same_to_the_last_bit(monkeypatch: pytest.MonkeyPatch):
    """Also where other maps are tried, as if the first were in doubt."""
    monkeypatch.setattr(reconsider, "FITS", 2.0)
    plain = align(*pair(), replace(SMALL, threads=1))
    monkeypatch.setattr(module, "LARGE", 1)
    told: list[Progress] = []
    found = align(*pair(), replace(SMALL, threads=2), lambda state: told.append(state))
    assert "reconsider" in found.seconds
    assert np.array_equal(found.carried, plain.carried, equal_nan=True)
    assert found.mobius == plain.mobius
    assert (found.confidence == plain.confidence).all()
    assert set(found.seconds) == set(plain.seconds)
    shares = [state.fraction for state in told]
    assert shares == sorted(shares)


def test_any_word_of_progress_may_cancel_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "LARGE", 1)
    monkeypatch.setattr(module, "EVERY", 1e-4)
    monkeypatch.setattr(reconsider, "FITS", 2.0)
    before = threading.active_count()
    for last, stage in ((3, ""), (8, ""), (20, ""), (5, "Trying another map")):
        told: list[str] = []

        def until(state: Progress, told: list[str] = told, last: int = last, stage: str = stage) -> bool:
            told.append(state.stage)
            return (told.count(stage) if stage else len(told)) < last

        with pytest.raises(Cancelled):
            align(*pair(), SMALL, until)
        assert (told.count(stage) if stage else len(told)) == last
        assert threading.active_count() == before


def test_what_is_wrong_with_a_surface_is_said_of_the_first(monkeypatch: pytest.MonkeyPatch):
    mesh = bumps(100, seed=2)
    wrong = [TriangleMesh(mesh.vertices * 0, mesh.faces, name) for name in ("one", "two")]
    monkeypatch.setattr(module, "LARGE", 1)
    with pytest.raises(ValueError, match="'one'"):
        align(*wrong)
