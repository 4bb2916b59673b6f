"""Long work: a worker thread that sees only arrays, and operators that run it blocking or in the background.

The way of Blender's own extension operators: one `execute` serves scripts, which wait, and the window, where the
operator goes on as a modal one with a timer. Results are written once, at the end, by the main thread.

ESC ends the operator at once. The thread is told to stop, which it does when the solver next says how far it is: within
a fraction of a second mostly, up to some seconds in a long factorisation. Nobody waits for it, and nobody takes its
result.

The window stays usable meanwhile: mode, scene, workspace and names may be others when the work is done. The result
waits until it can be written, and objects are told by Blender's number of the session, which undo and renaming leave
alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..solver import Cancelled, MeshError, Progress
from .job import Job, Refused, Work, describe_left, describe_proof
from .mesh_data import Refusal, settle
from .registration import register_factory
from .translation import told
from .usable import by_uid, why_not_now

INTERVAL = 0.1
"""Seconds between looks at the worker."""


def why_busy() -> str | None:
    """Return why no other long work can begin now, or None if it can."""
    return rpt_("{} is under way: press ESC to stop it").format(rpt_(Job.current.title)) if Job.current else None


class JobOperator:
    """Mixin for operators whose work is long. Subclasses say what to compute and what to write.

    The window stays usable meanwhile, so `finish` has to look its objects up again, by their numbers in `objects_read`,
    and make sure that they are what `prepare` read.
    """

    job_title: ClassVar[str]
    bl_idname: ClassVar[str]
    options: Any
    properties: Any
    report: Callable[[set[str], str], None]
    objects_read: tuple[int, ...] = ()
    _scene: int | None = None

    def prepare(self, context: bpy.types.Context) -> Work:
        """Read everything the work needs into arrays and return the work. May raise `Refusal` or `MeshError`."""
        raise NotImplementedError

    def finish(self, context: bpy.types.Context, result: Any) -> None:
        """Write the result and report it. May raise `Refusal`, before it writes."""
        raise NotImplementedError

    @property
    def is_persons(self) -> bool:
        """Whether a person called it in a window and looks on, not a script or the redo panel."""
        return not bpy.app.background and self.options.is_invoke and not self.options.is_repeat

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Do the work: at once for a script and for the redo panel, in the background for a person."""
        self._scene = context.scene.session_uid
        settle(context)
        in_window = not bpy.app.background and self.options.is_invoke
        if in_window and self.options.is_repeat_last:
            return self._invoke_anew()
        try:
            work = self.prepare(context)
        except (Refusal, MeshError) as error:
            return self._refused(error)
        manager = context.window_manager
        # a repeated operator belongs to Blender's list of those that are done: as a modal one it would be freed twice
        if in_window and not self.options.is_repeat:
            self._job = Job.current = Job(work, self.job_title)
            Job.refused = None
            self._shown: tuple[str, int] | None = None
            self._job.timer = manager.event_timer_add(INTERVAL, window=context.window)
            manager.modal_handler_add(self)
            redraw(context)
            return {"RUNNING_MODAL"}
        manager.progress_begin(0, 1)

        def show(progress: Progress) -> None:
            manager.progress_update(progress.fraction)

        try:
            self.finish(context, work(show))
        except (Cancelled, KeyboardInterrupt):
            return self._stopped()
        except (Refusal, MeshError) as error:
            return self._refused(error)
        finally:
            manager.progress_end()
        return {"FINISHED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Follow the worker; everything but ESC passes through: with RUNNING_MODAL beside it Blender passes nothing."""
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
        if self._job.cancelled:  # by ESC or the panel's button
            self._close(context)
            return self._stopped()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self._job.done:
            self._job.waits = self._why_wait(context) if self._job.error is None else None
        if not self._job.done or self._job.waits:
            self._show(context, self._job.progress)
            return {"PASS_THROUGH"}
        self._close(context)
        try:
            if self._job.error is not None:
                raise self._job.error
            self.finish(context, self._job.result)
            redraw(context)
        except (Refusal, MeshError) as refusal:
            Job.refused = Refused(self.job_title, told(str(refusal)), self.objects_read)
            # an error would pop up under the mouse, long after the click, and take the next key: an undo most likely
            return self._refused(refusal, "WARNING")
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator itself: another file is opened, or the window closes."""
        self._job.cancel()
        self._close(context)

    def _invoke_anew(self) -> set[str]:
        """Answer Repeat Last, a new wish for what is chosen now, by an operator of its own, which may become modal."""
        names = [prop.identifier for prop in self.properties.bl_rna.properties if prop.identifier != "rna_type"]
        given = {name: getattr(self, name) for name in names if self.properties.is_property_set(name)}
        name = self.bl_idname.partition("_OT_")[2]  # a registered class has it as Blender spells types
        try:
            getattr(bpy.ops.mobius, name)("INVOKE_DEFAULT", True, **given)
        except RuntimeError as error:  # it was refused
            self.report({"ERROR"}, str(error).removeprefix("Error: ").strip())
        return {"CANCELLED"}

    def _why_wait(self, context: bpy.types.Context) -> str | None:
        """Return why the result cannot be written yet, or None if it can, or never will."""
        scene = by_uid(bpy.data.scenes, self._scene)
        if scene is not None and scene != context.scene:
            return rpt_("the scene '{}' has to be shown").format(scene.name)
        return why_not_now(context, [by_uid(bpy.data.objects, uid) for uid in self.objects_read])

    def _show(self, context: bpy.types.Context, progress: Progress) -> None:
        """Say in the status bar and the panel where the work is, if that is news."""
        stage = iface_("Waiting") if self._job.waits else told(progress.stage)
        now = ": ".join(filter(None, (iface_(self.job_title), stage, self._job.waits or describe_proof(progress))))
        left = describe_left(self._job)
        shown = f"{now}, {left}" if left else now, round(100 * progress.fraction)
        workspace = context.workspace
        if shown != self._shown or workspace.session_uid != self._job.told:
            if workspace.session_uid != self._job.told:  # the text belongs to a workspace, and another is shown now
                clear_status(self._job)
            self._shown, self._job.told = shown, workspace.session_uid
            workspace.status_text_set(f"{shown[0]}   |   {iface_('ESC: Stop')}")
            redraw(context)

    def _close(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._job.timer)
        if Job.current is self._job:
            Job.current = None
        clear_status(self._job)
        redraw(context)

    def _refused(self, error: Exception, kind: str = "ERROR") -> set[str]:
        self.report({kind}, told(str(error)))
        return {"CANCELLED"}

    def _stopped(self) -> set[str]:
        self.report({"INFO"}, rpt_("{} stopped: nothing was changed").format(rpt_(self.job_title)))
        return {"CANCELLED"}


def clear_status(job: Job) -> None:
    """Have the status bar say what it says by itself, in the workspace where it spoke of the job."""
    if job.told is not None and (workspace := by_uid(bpy.data.workspaces, job.told)) is not None:
        workspace.status_text_set(None)
    job.told = None


def redraw(context: bpy.types.Context, types: tuple[str, ...] = ("VIEW_3D",)) -> None:
    """Have all editors of these types drawn again."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in types:
                area.tag_redraw()


class MOBIUS_OT_stop(bpy.types.Operator):
    """Stop the work under way; nothing is changed."""

    bl_idname = "mobius.stop"
    bl_label = "Stop"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Allow while work is under way."""
        if Job.current is None:
            cls.poll_message_set(rpt_("Nothing is being computed"))
        return Job.current is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Ask the work to stop; its operator notices at once."""
        assert Job.current is not None
        Job.current.cancel()
        return {"FINISHED"}


_register, _unregister = register_factory((MOBIUS_OT_stop,))


def register() -> None:
    """Register the operator."""
    _register()


def unregister() -> None:
    """Undo `register`, and stop the work under way: Blender quits or the extension is switched off."""
    if Job.current is not None:
        Job.current.cancel()
        # Blender takes the operator away without a word to it
        clear_status(Job.current)
        bpy.context.window_manager.event_timer_remove(Job.current.timer)
        Job.current = None
    _unregister()
