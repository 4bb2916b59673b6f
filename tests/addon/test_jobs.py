"""Long work in the window: it ends at once on ESC, and no result is used that nobody waits for."""

import threading
import time
from types import SimpleNamespace
from typing import Any

import pytest
from scenes import make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import job, jobs  # noqa: E402
from mobius_extension.solver import MeshError, Progress  # noqa: E402


class Workspace:
    """Notes what its status bar said."""

    def __init__(self, number: int) -> None:
        self.session_uid = number
        self.status: list[str | None] = [None]

    def status_text_set(self, text: str | None) -> None:
        self.status.append(text)


WORKSPACES = [Workspace(1), Workspace(2)]


class Window:
    """What an operator needs of a window's context, noting what was done to it."""

    def __init__(self) -> None:
        self.timers = 0
        self.window, self.windows = None, []
        self.window_manager = self
        self.scene, self.workspace, self.view_layer = bpy.context.scene, WORKSPACES[0], bpy.context.view_layer

    def event_timer_add(self, _seconds: float, *, window: Any) -> str:
        self.timers += 1
        return "timer"

    def event_timer_remove(self, timer: str) -> None:
        assert timer == "timer"
        self.timers -= 1

    def modal_handler_add(self, _operator: Any) -> None:
        pass

    @property
    def status(self) -> list[str | None]:
        return self.workspace.status


class Operator(jobs.JobOperator):
    """Work that goes on until the test lets it."""

    job_title = "Test"
    options = SimpleNamespace(is_invoke=True, is_repeat=False, is_repeat_last=False)

    def __init__(self, error: Exception | None = None) -> None:
        self.free, self.heard, self.asked = threading.Event(), threading.Event(), []
        self.written: list[Any] = []
        self.said: list[tuple[set[str], str]] = []
        self.report = lambda kind, text: self.said.append((kind, text))
        self.wrong = error

    def prepare(self, context: Any) -> job.Work:
        def work(report: job.Report) -> str:
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
    data = SimpleNamespace(scenes=bpy.data.scenes, objects=bpy.data.objects, workspaces=WORKSPACES)
    app = SimpleNamespace(background=False)
    monkeypatch.setattr(jobs, "bpy", SimpleNamespace(app=app, types=bpy.types, data=data, ops=bpy.ops))


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
    assert operator.modal(window, event("TIMER")) == {"PASS_THROUGH"}
    assert window.status[-1] == "Test: Searching: 3.0 of at most 4.0, gap 1.0   |   ESC: Stop"
    for kind in ("MOUSEMOVE", "MIDDLEMOUSE", "A"):
        assert operator.modal(window, event(kind)) == {"PASS_THROUGH"}
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
    assert operator.heard.wait(5)
    operator.modal(window, event("TIMER"))
    assert window.status[-1] is not None
    if way == "another file":
        operator.cancel(window)
    else:
        monkeypatch.setattr(jobs, "_unregister", lambda: None)
        jobs.bpy.context = SimpleNamespace(window_manager=window)
        jobs.unregister()
    assert (window.timers, window.status[-1]) == (0, None)
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
    # in the status bar: a popup would take the next key
    assert operator.said == [({"WARNING"}, "'Scan' is closed")]
    assert jobs.Job.refused == job.Refused("Test", "'Scan' is closed", ())
    operator = Operator(ZeroDivisionError("a fault of ours"))
    operator.execute(window)
    operator.free.set()
    ended(operator)
    with pytest.raises(ZeroDivisionError):
        operator.modal(window, event("TIMER"))
    assert (window.timers, jobs.Job.current) == (0, None)


# what a person does meanwhile, and afterwards


def finished(operator: Operator) -> None:
    """Let the thread come to its end."""
    operator.free.set()
    ended(operator)


def test_the_redo_panel_repeats_without_becoming_modal() -> None:
    operator, window = Operator(), Window()
    operator.options = SimpleNamespace(is_invoke=True, is_repeat=True, is_repeat_last=False)
    operator.free.set()
    window.progress_begin = window.progress_update = lambda *_: None
    window.progress_end = lambda: None
    assert operator.execute(window) == {"FINISHED"}
    assert (operator.written, window.timers, jobs.Job.current) == (["result"], 0, None)


def test_repeat_last_is_an_operator_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    operator, window = Operator(), Window()
    operator.options = SimpleNamespace(is_invoke=True, is_repeat=False, is_repeat_last=True)
    operator.bl_idname, operator.limit, operator.mix = "MOBIUS_OT_test", 3, "add"
    rna = SimpleNamespace(properties=[SimpleNamespace(identifier=name) for name in ("rna_type", "limit", "mix")])
    operator.properties = SimpleNamespace(bl_rna=rna, is_property_set=lambda name: name != "mix")
    called: list[Any] = []
    ops = SimpleNamespace(mobius=SimpleNamespace(test=lambda *how, **given: called.append((how, given))))
    monkeypatch.setattr(jobs.bpy, "ops", ops)
    assert operator.execute(window) == {"CANCELLED"}  # of the one that is done already
    assert called == [(("INVOKE_DEFAULT", True), {"limit": 3})]
    assert (operator.written, window.timers, jobs.Job.current) == ([], 0, None)

    def refuses(*_: Any, **__: Any) -> None:
        raise RuntimeError("Error: Choose a target mesh first\n")

    ops.mobius.test = refuses
    assert operator.execute(window) == {"CANCELLED"}
    assert operator.said == [({"ERROR"}, "Choose a target mesh first")]


def test_the_status_is_cleared_where_it_was_set() -> None:
    operator, window = Operator(), Window()
    operator.execute(window)
    assert operator.heard.wait(5)
    first, second = WORKSPACES
    operator.modal(window, event("TIMER"))
    assert str(first.status[-1]).startswith("Test: Searching")
    window.workspace = second
    operator.modal(window, event("TIMER"))
    assert first.status[-1] is None
    assert str(second.status[-1]).startswith("Test: Searching")
    window.workspace = first
    operator.modal(window, event("ESC"))
    assert (first.status[-1], second.status[-1]) == (None, None)
    operator.free.set()


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "WEIGHT_PAINT"])
def test_the_result_waits_for_object_mode_and_is_then_written(mode: str) -> None:
    operator, window = Operator(), Window()
    sheet = make_sheet("Sheet", 5)
    operator.objects_read = (sheet.session_uid,)
    operator.execute(window)
    bpy.ops.object.mode_set(mode=mode)
    sheet.name = "Renamed"
    finished(operator)
    for _ in range(3):
        assert operator.modal(window, event("TIMER")) == {"PASS_THROUGH"}
    assert operator.written == []
    assert window.status[-1] == "Test: Waiting: 'Renamed' has to be in Object Mode   |   ESC: Stop"
    assert jobs.Job.current is operator._job
    bpy.ops.object.mode_set(mode="OBJECT")
    assert operator.modal(window, event("TIMER")) == {"FINISHED"}
    assert operator.written == ["result"]
    assert (window.timers, window.status[-1], jobs.Job.current) == (0, None, None)


def test_the_result_waits_for_other_objects_modes_a_twin_and_the_scene() -> None:
    operator, window = Operator(), Window()
    sheet, other = make_sheet("Sheet", 5), make_sheet("Other", 4)
    operator.objects_read = (sheet.session_uid,)
    operator.execute(window)
    finished(operator)

    def waits_for(what: str) -> None:
        assert operator.modal(window, event("TIMER")) == {"PASS_THROUGH"}
        assert what in str(window.status[-1])

    window.windows = [SimpleNamespace(view_layer=bpy.context.view_layer, screen=SimpleNamespace(areas=[]))]
    bpy.ops.object.mode_set(mode="EDIT")
    waits_for("'Other' has to be in Object Mode")
    bpy.ops.object.mode_set(mode="OBJECT")
    twin = bpy.data.objects.new("Twin", sheet.data)
    bpy.context.scene.collection.objects.link(twin)
    bpy.context.view_layer.objects.active = twin
    other.select_set(False)
    bpy.ops.object.mode_set(mode="EDIT")
    window.windows = []
    waits_for("'Sheet' has to be in Object Mode")
    bpy.ops.object.mode_set(mode="OBJECT")
    window.scene = bpy.data.scenes.new("Elsewhere")
    waits_for(f"the scene '{bpy.context.scene.name}' has to be shown")
    assert operator.written == []
    window.scene = bpy.context.scene
    assert operator.modal(window, event("TIMER")) == {"FINISHED"}
    assert operator.written == ["result"]


def test_esc_ends_the_waiting_and_a_removed_object_does_not_begin_it() -> None:
    operator, window = Operator(), Window()
    sheet = make_sheet("Sheet", 5)
    operator.objects_read = (sheet.session_uid,)
    operator.execute(window)
    bpy.ops.object.mode_set(mode="EDIT")
    finished(operator)
    operator.modal(window, event("TIMER"))
    assert operator.modal(window, event("ESC")) == {"CANCELLED"}
    assert (operator.written, window.status[-1], jobs.Job.current) == ([], None, None)
    bpy.ops.object.mode_set(mode="OBJECT")

    operator, window = Operator(), Window()
    operator.objects_read = (sheet.session_uid,)
    operator.execute(window)
    bpy.data.objects.remove(sheet)
    finished(operator)
    assert operator.modal(window, event("TIMER")) == {"FINISHED"}  # where `finish` refuses, which this one does not
