"""What the commands write for people, how they end, and where the chatter of Blender and its importers goes."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout

DONE, NOT_ALIGNED, UNUSABLE = 0, 1, 2
"""Exit statuses: done; could not do it with these meshes; wrong usage or unreadable input."""


def say(text: str) -> None:
    """Write a line of a command's result."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def say_error(text: str) -> None:
    """Write a line about what went wrong."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def take_streams() -> None:
    """Leave Blender, which writes past Python to the file descriptors, without an audience.

    They are not given back: what Blender holds in its buffers comes out when the process ends.
    """
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        getattr(sys, name).flush()
        setattr(sys, name, os.fdopen(os.dup(descriptor), "w", encoding="utf-8", errors="replace", buffering=1))
        os.dup2(nowhere, descriptor)
    os.close(nowhere)


@contextmanager
def quiet() -> Iterator[None]:
    """Keep what Python importers print to themselves."""
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        yield
