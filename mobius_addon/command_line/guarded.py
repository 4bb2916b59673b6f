"""A run in a process of its own, where that can be had, so that a crash of Blender's readers is a sentence too."""

from __future__ import annotations

import ctypes
import mmap
import os
import signal
import sys
from collections.abc import Callable

from .. import streams
from ..streams import STOPPED, UNUSABLE, say_error

_DIE_WITH_PARENT = 1
"""Of prctl in <linux/prctl.h>: the signal that a process gets when its parent ends."""


def guarded(run: Callable[[], int]) -> int:
    """Return the exit status of a run; if it crashes, say what was being read, with the status of unreadable input.

    Only on Linux: on macOS what is loaded after a fork may fail, and Windows has none. Blender must not be loaded yet.
    """
    if sys.platform != "linux":
        return run()
    board = mmap.mmap(-1, mmap.PAGESIZE)  # shared with the child
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != parent:  # it has ended before
            os._exit(1)
        streams.pin(board)
        return run()
    # the child gets what is typed too, and ends as it does alone
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    signal.signal(signal.SIGINT, before)
    if status >= 0:
        return status
    if status == -signal.SIGINT:
        return STOPPED
    how = signal.strsignal(-status) or f"signal {-status}"
    if path := streams.pinned(board):
        say_error(f"mobius: '{path}' could not be read: it ends Blender ({how}), so it is damaged or too large")
        return UNUSABLE
    say_error(f"mobius: ended: {how}")
    return 128 - status
