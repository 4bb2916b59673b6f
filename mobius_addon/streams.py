"""What the commands write for people, how they end, and where the chatter of Blender and its importers goes.

And what they are reading, in case that ends them.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from mmap import mmap
from pathlib import Path
from typing import TextIO

DONE, NOT_ALIGNED, UNUSABLE = 0, 1, 2
"""Exit statuses: done; could not do it with these meshes; wrong usage or unreadable input."""


STOPPED = 130
"""Exit status after Ctrl C, as shells have it."""

NOT_HEARD = 141
"""Exit status where nobody reads any more, as after `| head`: that of the usual tools, which a signal ends there."""


class Unheard(Exception):  # noqa: N818  (no error of the program)
    """What the program says cannot be written.

    Parameters
    ----------
    status : int
        The exit status.
    reason : str, optional
        Why, unless the reader has gone, which is no news to anyone.
    """

    def __init__(self, status: int, reason: str | None = None) -> None:
        super().__init__(reason)
        self.status, self.reason = status, reason


def say(text: str) -> None:
    """Write a line of a command's result.

    Raises
    ------
    Unheard
        It cannot be written.
    """
    _write(sys.stdout, text)


def say_error(text: str) -> None:
    """Write a line about what went wrong.

    Raises
    ------
    Unheard
        It cannot be written.
    """
    _write(sys.stderr, text)


def _write(stream: TextIO | None, text: str) -> None:
    if stream is None:  # closed before the program began
        return
    try:
        stream.write(text + "\n")
        stream.flush()
    except OSError as error:
        silence(stream)
        if isinstance(error, BrokenPipeError):
            raise Unheard(NOT_HEARD) from error
        raise Unheard(NOT_ALIGNED, f"the output cannot be written: {error.strerror}") from error


def silence(stream: TextIO) -> None:
    """Let what a stream still holds go nowhere, so that the program's end does not fail at it again."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def take_streams() -> None:
    """Leave Blender, which writes past Python to the file descriptors, without an audience.

    They are not given back: what Blender holds in its buffers comes out when the process ends.
    """
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            # closed: the next file to be opened would take its number, and Blender's chatter
            os.open(os.devnull, os.O_RDWR)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        if (stream := getattr(sys, name)) is not None:
            stream.flush()
            setattr(sys, name, os.fdopen(os.dup(descriptor), "w", encoding="utf-8", errors="replace", buffering=1))
        os.dup2(nowhere, descriptor)
    os.close(nowhere)


_board: mmap | None = None


def pin(board: mmap) -> None:
    """Note from now on what is being read on a board that another process looks at, should this one end."""
    global _board
    _board = board


def pinned(board: mmap) -> str:
    """Return what was being read when the process that noted it ended; empty if nothing was."""
    return board[:].split(b"\0", 1)[0].decode("utf-8", "replace")


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Note that a file is being read by something that may end the process."""
    if _board is None:
        yield
        return
    noted = os.fsencode(path)[: len(_board) - 1] + b"\0"
    _board[: len(noted)] = noted
    try:
        yield
    finally:
        _board[:1] = b"\0"


@contextmanager
def quiet() -> Iterator[None]:
    """Keep what Python importers print to themselves."""
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        yield
