"""One run of the program: the arguments, the command they name, and the exit status."""

from __future__ import annotations

import signal
from contextlib import suppress

from ..streams import NOT_ALIGNED, STOPPED, UNUSABLE, Unheard, say_error, take_streams
from .parser import Usage, build_parser


def main(arguments: list[str], prog: str = "python .") -> int:
    """Run one command.

    Parameters
    ----------
    arguments : list of str
        The command line after the program's name.
    prog : str
        What help calls the program.

    Returns
    -------
    int
        0 done; 1 could not be done with these meshes, the reason is on stderr; 2 wrong usage or unreadable input; 130
        stopped by Ctrl C; 141 the reader of the output has gone.
    """
    try:
        return _run(arguments, prog)
    except Unheard as unheard:
        with suppress(Unheard):
            if unheard.reason:
                say_error(f"mobius: {unheard.reason}")
        return unheard.status


def _run(arguments: list[str], prog: str) -> int:
    """Run one command and return its exit status."""
    try:
        options = build_parser(prog).parse_args(arguments)
    except Usage as usage:
        return usage.status

    from ...solver import MeshError
    from ..files import Unreadable
    from ..mesh_data import Refusal

    try:
        if signal.getsignal(signal.SIGINT) == signal.SIG_DFL:  # Ctrl C, from now on, takes back what was begun
            signal.signal(signal.SIGINT, signal.default_int_handler)
        return options.run(options)
    except Unreadable as error:
        say_error(f"mobius: {error}")
        return UNUSABLE
    except (MeshError, Refusal) as error:
        say_error(f"mobius: {error}")
        return NOT_ALIGNED
    except KeyboardInterrupt as stop:
        say_error(f"mobius: stopped, {str(stop) or 'nothing was written'}")
        return STOPPED


def main_quietly(arguments: list[str], prog: str = "python .") -> int:
    """Run one command with standard output and errors to itself: what Blender's importers say there goes nowhere."""
    take_streams()
    return main(arguments, prog)
