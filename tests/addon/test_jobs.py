"""Long work in the window: it ends at once on ESC, and no result is used that nobody waits for."""

import threading
import time
from types import SimpleNamespace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import jobs  # noqa: E402
from mobius_extension.solver import MeshError, Progress  # noqa: E402


class Window:
    """What an operator needs of a window's context, noting what was done to it."""

    def __init__(self) -> None:
        self.timers = 0
        self.status: list[str | None] = []
        self.window, self.windows = None, []
        self.window_manager = self.workspace = self

    def event_timer_add(self, _seconds: float, *, window: Any) -> str:
        self.timers += 1
        return "timer"

    def event_timer_remove(self, timer: str) -> None:
        assert timer == "timer"
        self.timers -= 1

    def modal_handler_add(self, _operator: Any) -> None:
        pass

    def status_text_set(self, text: str | None) -> None:
        self.status.append(text)


class Operator(jobs.JobOperator):
    """Work that goes on until the test lets it."""

    job_title = "Test"
    options = SimpleNamespace(is_invoke=True)

    def __init__(self, error: Exception | None = None) -> None:
        self.free, self.heard, self.asked = threading.Event(), threading.Event(), []
        self.written: list[Any] = []
        self.said: list[tuple[set[str], str]] = []
        self.report = lambda kind, text: self.said.append((kind, text))
        self.wrong = error

    def prepare(self, context: Any) -> jobs.Work:
        def work(report: jobs.Report) -> str:
            report(Progress("Searching", 0.25, 3.0, 4.0, 10))
            self.heard.set()
            self.free.wait(20)  # a long call that says nothing
            self.asked.append(report(Progress("Bending", 0.5)))
            if self.wrong:
                raise self.wrong
            return "result"

        return work

    def finish(self, context: Any, result: Any) -> None:
        self.written.append(result)


@pytest.fixture(autouse=True)
def in_window(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "bpy", SimpleNamespace(app=SimpleNamespace(background=False), types=bpy.types))


def event(kind: str) -> Any:
    return SimpleNamespace(type=kind, value="PRESS")


def ended(operator: Operator) -> None:
    for _ in range(1000):
        if operator._job.done:
            return
        time.sleep(0.01)
    raise AssertionError("the thread goes on")


def test_the_window_goes_on_while_the_work_does() -> None:
    operator, window = Operator(), Window()
    assert operator.execute(window) == {"RUNNING_MODAL"}
    assert operator.heard.wait(5)
    assert operator.modal(window, event("TIMER")) == {"RUNNING_MODAL", "PASS_THROUGH"}
    assert window.status[-1] == "Test: Searching: 3.0 of at most 4.0, gap 1.0   |   ESC: Stop"
    for kind in ("MOUSEMOVE", "MIDDLEMOUSE", "A"):
        assert operator.modal(window, event(kind)) == {"RUNNING_MODAL", "PASS_THROUGH"}
    assert jobs.why_busy() == "Test is under way: press ESC to stop it"
    operator.free.set()
    ended(operator)
    assert operator.modal(window, event("TIMER")) == {"FINISHED"}
    assert operator.written == ["result"]
    assert (window.timers, window.status[-1], jobs.why_busy()) == (0, None, None)


def test_esc_ends_at_once_though_the_work_is_in_a_long_call() -> None:
    operator, window = Operator(), Window()
    operator.execute(window)
    assert operator.heard.wait(5)
    assert operator.modal(window, event("ESC")) == {"CANCELLED"}
    assert not operator._job.done  # the thread is still in its call
    assert (window.timers, window.status[-1], jobs.why_busy()) == (0, None, None)
    assert operator.said == [({"INFO"}, "Test stopped: nothing was changed")]
    operator.free.set()
    ended(operator)
    assert operator.asked == [False]  # it was told to stop when it asked
    assert operator.written == []


def test_the_panels_button_stops_like_esc() -> None:
    operator, window = Operator(), Window()
    operator.execute(window)
    assert bpy.ops.mobius.stop() == {"FINISHED"}
    assert operator.modal(window, event("TIMER")) == {"CANCELLED"}
    operator.free.set()
    assert not bpy.ops.mobius.stop.poll()


@pytest.mark.parametrize("way", ["another file", "the extension is switched off"])
def test_the_end_of_the_file_or_the_extension_ends_the_work(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    operator, window = Operator(), Window()
    operator.execute(window)
    if way == "another file":
        operator.cancel(window)
        assert (window.timers, window.status[-1]) == (0, None)
    else:
        monkeypatch.setattr(jobs, "_unregister", lambda: None)
        jobs.unregister()
    assert jobs.Job.current is None
    operator.free.set()
    ended(operator)
    assert operator.asked == [False]
    assert operator.written == []


def test_an_older_works_end_does_not_hide_a_newer_one() -> None:
    first, second, window = Operator(), Operator(), Window()
    first.execute(window)
    second.execute(window)
    first.modal(window, event("ESC"))
    assert jobs.Job.current is second._job
    second.modal(window, event("ESC"))
    assert jobs.Job.current is None
    first.free.set()
    second.free.set()


def test_what_goes_wrong_in_the_thread_is_reported() -> None:
    operator, window = Operator(MeshError("'Scan' is closed")), Window()
    operator.execute(window)
    operator.free.set()
    ended(operator)
    assert operator.modal(window, event("TIMER")) == {"CANCELLED"}
    assert operator.said == [({"ERROR"}, "'Scan' is closed")]
    operator = Operator(ZeroDivisionError("a fault of ours"))
    operator.execute(window)
    operator.free.set()
    ended(operator)
    with pytest.raises(ZeroDivisionError):
        operator.modal(window, event("TIMER"))
    assert (window.timers, jobs.Job.current) == (0, None)
