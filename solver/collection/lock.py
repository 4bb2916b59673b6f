"""One run at a time in a folder: a lock that the system takes back, however the one that has it ends."""

from __future__ import annotations

import errno
import sys
from pathlib import Path
from typing import IO

TAKEN = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)
"""Errors of a lock that another process has; others are of file systems without locks."""


def locked(path: Path) -> IO[bytes]:
    """Return a file that no other process can lock until it is closed.

    Raises
    ------
    ValueError
        Another process has it.
    """
    file = path.open("ab")
    try:
        if sys.platform == "win32":
            import msvcrt  # there alone

            file.seek(0)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl  # everywhere else

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in TAKEN:
            file.close()
            there = path.parent
            raise ValueError(f"another run is at work in '{there}': wait for its end, or use another folder") from error
    return file
