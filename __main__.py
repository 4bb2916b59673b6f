"""`python . COMMAND`: the extension's commands on Blender's Python module from PyPI, without an installed Blender."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import os
import shutil
import signal
import sys
from pathlib import Path

PACKAGE = "mobius_extension"

STOPPED = 130
"""Exit status after Ctrl C, as shells have it."""


def load_extension() -> None:
    """Make this folder importable as the package `PACKAGE`, as Blender does under a name of its own."""
    root = Path(__file__).resolve().parent
    spec = importlib.util.spec_from_file_location(PACKAGE, root / "__init__.py", submodule_search_locations=[str(root)])
    if spec is None or spec.loader is None:
        raise ImportError(f"no extension in {root}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = module
    spec.loader.exec_module(module)


def main() -> int:
    """Run the command line; a missing package or a wrong Python is a sentence and exit status 2."""
    version = ".".join(map(str, sys.version_info[:2]))
    if sys.version_info < (3, 11):  # noqa: UP036  (whoever runs it may have an older one)
        sys.stderr.write(f"mobius: this is Python {version}; Blender's module needs 3.11 or 3.13: 'uv run python .'\n")
        return 2
    load_extension()
    try:
        if sys.argv[1:2] == ["build"]:
            return importlib.import_module(f"{PACKAGE}.release.build").main(sys.argv[2:])
        command_line = importlib.import_module(f"{PACKAGE}.mobius_addon.command_line")
        return command_line.guarded(lambda: command_line.main_quietly(sys.argv[1:]))
    except ImportError as error:
        missing = (error.name or "").partition(".")[0]
        if missing not in ("bpy", "numpy", "scipy"):
            raise
        sys.stderr.write(
            f"mobius: the Python package '{missing}' is missing or not for this Python {version} ({error}).\n"
            "'uv run python . demo' installs what is needed; Blender's module 'bpy' exists for Python 3.11 and 3.13.\n"
        )
        return 2


def leave(status: int) -> None:
    """End the process now, its output written and Blender's temporary folder removed.

    Blender's module, once loaded, sometimes waits for its own threads for ever in the C library's exit handlers.
    """
    for stream in (sys.stdout, sys.stderr):
        # closed, or its reader has gone
        with contextlib.suppress(AttributeError, OSError):
            stream.flush()
    if "bpy" in sys.modules and (folder := sys.modules["bpy"].app.tempdir):
        shutil.rmtree(folder, ignore_errors=True)
    if status == STOPPED and os.name == "posix":  # by the signal itself, so that a script's loop over files ends too
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    os._exit(status)


if __name__ == "__main__":
    # until a command runs: inside Blender's start an exception would end in a crash, or be swallowed
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    leave(main())
