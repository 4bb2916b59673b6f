"""Temporary folders beside what they become, which a run that was killed leaves behind and the next one clears."""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

_PREFIX = ".mobius-"
_NAME = re.compile(re.escape(_PREFIX) + r"[a-z0-9_]{8}")
_OWNER = "owner"
_MARK = b"Temporary files of Mobius. Whoever can lock this file may remove the folder: its process has ended.\n"


@contextmanager
def temporary_folder(parent: Path) -> Iterator[Path]:
    """Lend a hidden folder in `parent`; it goes again, with all files beside it that bear its name and an ending.

    What earlier runs left there that were killed is cleared first.

    Raises
    ------
    OSError
        Nothing can be written in `parent`.
    """
    clear_abandoned(parent)
    folder = Path(tempfile.mkdtemp(dir=parent, prefix=_PREFIX))
    try:
        with (folder / _OWNER).open("wb") as owner:
            # the system takes the lock from a process that ends, however it ends
            _lock(owner, wait=True)
            owner.write(_MARK)
            owner.flush()
            yield folder
    finally:
        _remove(folder)


def clear_abandoned(parent: Path) -> None:
    """Remove temporary folders in `parent` that are surely ours and whose process has ended."""
    with suppress(OSError):
        for folder in [x for x in parent.iterdir() if _NAME.fullmatch(x.name)]:
            if _is_abandoned(folder):
                _remove(folder)


def _is_abandoned(folder: Path) -> bool:
    owner = folder / _OWNER
    if folder.is_symlink() or not owner.is_file():
        return False
    try:
        with owner.open("r+b") as file:
            return _lock(file, wait=False) and file.read() == _MARK
    except OSError:
        return False


def _remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    for beside in folder.parent.glob(f"{folder.name}.*"):
        with suppress(OSError):
            beside.unlink()


def _lock(file: IO[bytes], *, wait: bool) -> bool:
    """Lock a file for this process alone and return whether that was possible."""
    try:
        if sys.platform == "win32":
            import msvcrt

            # a byte beyond the text, which stays readable
            file.seek(1 << 20)
            msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
            file.seek(0)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:
        return False
    return True
