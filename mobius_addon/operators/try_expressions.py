"""Play the target's shape keys through, beside those of the source that they were carried from."""

from __future__ import annotations

import time
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from .. import last_transfer
from ..jobs import redraw, why_busy
from ..playing import Play, stop
from ..usable import why_not, why_not_mode

INTERVAL = 1 / 30
"""Seconds between pictures."""

_LOOKING = (
    "MIDDLEMOUSE",
    "WHEEL",
    "TRACKPAD",
    "NUMPAD",
    "NDOF",
    "MOUSE",
    "TIMER",
    "WINDOW",
    "LEFT_",
    "RIGHT_",
    "OSKEY",
)
"""Beginnings of the kinds of events by which a person looks around: LEFT_SHIFT and the like go with them."""


def playable(target: bpy.types.Object, source: bpy.types.Object | None) -> list[tuple[str, str | None]]:
    """Return the keys of a target that can be played, each with that of the source that it was carried from, or None.

    Those that the last transfer has written; all of them if it has written none.
    """
    keys = target.data.shape_keys
    if keys is None or not keys.use_relative:
        return []
    there = [key.name for key in keys.key_blocks if key != keys.reference_key and not key.mute]
    written = last_transfer.of_mesh(target.data)
    carried = [layer for layer in written.layers if layer.kind == "shape-keys"] if written else []
    origin = {layer.name: layer.source_name for layer in carried if layer.name in there}
    others = source.data.shape_keys if source is not None and source.type == "MESH" else None
    known = set(others.key_blocks.keys()) if others is not None and others.use_relative else set()
    return [(name, found if (found := origin.get(name, name)) in known else None) for name in origin or there]


class PlayOperator:
    """Mixin for what plays: `begin` and what follows it."""

    _play: Play
    _told: int
    _time: float

    def begin(self, context: bpy.types.Context) -> set[str]:
        """Take what is played, and have Blender wake us."""
        settings, manager = context.scene.mobius, context.window_manager
        source = settings.source if _is_free(settings.source, context) else None
        timer = manager.event_timer_add(INTERVAL, window=context.window)
        workspace = context.workspace

        def free() -> None:
            manager.event_timer_remove(timer)
            workspace.status_text_set(None)

        self._play = Play(playable(settings.target, source), settings.target, source, free)
        self._told = -1
        self._time = time.monotonic()
        manager.modal_handler_add(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Go on with each tick; what is no looking around ends it, and then does what it does otherwise."""
        if Play.current is not self._play:  # something ended it, as saving does
            redraw(context)
            return {"FINISHED", "PASS_THROUGH"}
        if event.type == "TIMER":
            now = time.monotonic()
            seconds, self._time = now - self._time, now
            return self._go(context, self._play.go_on(seconds)) - {"RUNNING_MODAL"} | {"PASS_THROUGH"}
        if event.value == "PRESS" and event.type in ("LEFT_ARROW", "RIGHT_ARROW"):
            return self._go(context, self._play.step(1 if event.type == "RIGHT_ARROW" else -1))
        if event.value != "PRESS" or event.type.startswith(_LOOKING):
            return {"PASS_THROUGH"}  # with RUNNING_MODAL beside it Blender passes nothing on
        self._play.end()
        redraw(context)
        # the click that would press the button again has done so
        over = event.type in ("ESC", "RET", "SPACE", "LEFTMOUSE", "RIGHTMOUSE")
        return {"FINISHED"} if over else {"FINISHED", "PASS_THROUGH"}

    def cancel(self, _context: bpy.types.Context) -> None:
        """Blender ends the operator itself: another file is opened, or the window closes."""
        if Play.current is self._play:
            self._play.end()

    def _go(self, context: bpy.types.Context, on: bool) -> set[str]:
        if on:
            self._tell(context)
        else:
            self._play.end()
        redraw(context)
        return {"RUNNING_MODAL"} if on else {"FINISHED"}

    def _tell(self, context: bpy.types.Context) -> None:
        """Say in the status bar which expression it is."""
        if (number := self._play.number) == self._told:
            return
        self._told, names = number, self._play.names
        text = iface_("{} ({} of {})").format(names[number][0], number + 1, len(names))
        context.workspace.status_text_set(f"{text}   |   {iface_('ESC: Stop')}")


class MOBIUS_OT_try_expressions(PlayOperator, bpy.types.Operator):
    """Play the target's shape keys one after the other, beside those of the source that they come from. Nothing is
    changed: any key ends it, arrows go on and back."""  # noqa: D205, D209  (the tooltip)

    bl_idname = "mobius.try_expressions"
    bl_label = "Try Expressions"
    bl_options = {"INTERNAL"}  # no UNDO: all is as it was before

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for a target with shape keys, in a window."""
        reason = why_not_played(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Begin; where it plays already, end."""
        if bpy.app.background:
            self.report({"ERROR"}, rpt_("Blender runs without a window"))
            return {"CANCELLED"}
        if Play.current is None:
            return self.begin(context)
        stop()
        redraw(context)
        return {"FINISHED"}


def why_not_played(context: bpy.types.Context) -> str | None:
    """Return why the target's expressions cannot be played, or None if they can."""
    if Play.current is not None:
        return None  # it can be ended
    target = context.scene.mobius.target
    reason = why_not(target, "target mesh", context.scene) or why_not_mode(context) or why_busy()
    if reason is None and target.data.shape_keys is not None and not target.data.shape_keys.use_relative:
        return rpt_("The shape keys of '{}' are absolute: play them in the timeline").format(target.name)
    if reason is None and not playable(target, None):
        return rpt_("'{}' has no shape keys: transfer some first").format(target.name)
    return reason


def _is_free(source: Any, context: bpy.types.Context) -> bool:
    """Return whether the source can be played along."""
    target = context.scene.mobius.target
    return source is not None and why_not(source, "source mesh", context.scene) is None and source.data != target.data
