"""Long work: a worker thread that sees only arrays, and operators that run it blocking or in the background.

The way of Blender's own extension operators: one `execute` serves scripts, which wait, and the window, where the
operator goes on as a modal one with a timer. ESC asks the worker to stop; results are written once, at the end, by the
main thread.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, ClassVar

import bpy

from ..solver import Cancelled, MeshError, Progress
from .mesh_data import Refusal

Report = Callable[[Progress], bool | None]
Work = Callable[[Report], Any]


class Job:
    """A computation in a thread of its own.

    Parameters
    ----------
    work : callable
        Called with a progress callback; may touch arrays only, never bpy.
    """

    def __init__(self, work: Work) -> None:
        self.progress: Progress | None = None
        self.result: Any = None
        self.error: BaseException | None = None
        self._work = work
        self._stop = threading.Event()
        # a daemon, so that quitting Blender never waits for it
        self._thread = threading.Thread(target=self._run, name="mobius", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self.result = self._work(self._note)
        except BaseException as error:  # handed to the main thread, which reports it
            self.error = error

    def _note(self, progress: Progress) -> bool:
        self.progress = progress
        return not self._stop.is_set()

    def cancel(self) -> None:
        """Ask the work to stop at its next progress call."""
        self._stop.set()

    @property
    def cancelled(self) -> bool:
        """Whether the work was asked to stop."""
        return self._stop.is_set()

    @property
    def done(self) -> bool:
        """Whether the thread has ended."""
        return not self._thread.is_alive()


def describe_proof(progress: Progress) -> str:
    """Return what the search has proved so far, or nothing outside the search."""
    if progress.value is None or progress.upper_bound is None:
        return ""
    return f"matched {progress.value:.1f} of at most {progress.upper_bound:.1f}"


class JobOperator:
    """Mixin for operators whose work is long. Subclasses say what to compute and what to write.

    The window stays usable meanwhile, so `finish` has to look its objects up again and make sure that they are what
    `prepare` read.
    """

    job_title: ClassVar[str]
    options: Any
    report: Callable[[set[str], str], None]

    def prepare(self, context: bpy.types.Context) -> Work:
        """Read everything the work needs into arrays and return the work. May raise `Refusal` or `MeshError`."""
        raise NotImplementedError

    def finish(self, context: bpy.types.Context, result: Any) -> None:
        """Write the result and report it. May raise `Refusal`, before it writes."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Do the work: at once for a script, in the background for a person."""
        try:
            work = self.prepare(context)
        except (Refusal, MeshError) as error:
            return self._refused(error)
        if not bpy.app.background and self.options.is_invoke:
            self._job = Job(work)
            manager = context.window_manager
            manager.mobius_job.start(self.job_title)
            self._timer = manager.event_timer_add(0.1, window=context.window)
            manager.modal_handler_add(self)
            return {"RUNNING_MODAL"}
        manager = context.window_manager
        manager.progress_begin(0, 1)

        def show(progress: Progress) -> None:
            manager.progress_update(progress.fraction)

        try:
            result = work(show)
            self.finish(context, result)
        except Cancelled:
            return self._stopped()
        except KeyboardInterrupt:
            return self._stopped()
        except (Refusal, MeshError) as error:
            return self._refused(error)
        finally:
            manager.progress_end()
        return {"FINISHED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Follow the worker; everything but ESC passes through."""
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
            context.window_manager.mobius_job.show("Stopping", "", 0.0)
            _redraw_sidebars(context)
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL", "PASS_THROUGH"}
        if not self._job.done:
            if self._job.progress is not None and not self._job.cancelled:
                progress = self._job.progress
                proved = describe_proof(progress)
                if context.window_manager.mobius_job.show(progress.stage, proved, progress.fraction):
                    now = ": ".join(filter(None, (self.job_title, progress.stage, proved)))
                    context.workspace.status_text_set(f"{now} (ESC: stop)")
                    _redraw_sidebars(context)
            return {"RUNNING_MODAL", "PASS_THROUGH"}
        self._close(context)
        error = self._job.error
        if self._job.cancelled or isinstance(error, Cancelled):
            return self._stopped()
        try:
            if error is not None:
                raise error
            self.finish(context, self._job.result)
        except (Refusal, MeshError) as refusal:
            return self._refused(refusal)
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator itself: another file is opened, or the window closes."""
        self._job.cancel()
        self._close(context)

    def _close(self, context: bpy.types.Context) -> None:
        manager = context.window_manager
        manager.event_timer_remove(self._timer)
        manager.mobius_job.stop()
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        _redraw_sidebars(context)

    def _refused(self, error: Exception) -> set[str]:
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def _stopped(self) -> set[str]:
        self.report({"INFO"}, f"{self.job_title} stopped: nothing was changed")
        return {"CANCELLED"}


def _redraw_sidebars(context: bpy.types.Context) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
