"""One run of the program: the arguments, the command they name, and the exit status."""

from __future__ import annotations

from contextlib import suppress

from ..streams import NOT_ALIGNED, UNUSABLE, Unheard, say_error, take_streams
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
        0 done; 1 could not be done with these meshes, the reason is on stderr; 2 wrong usage or unreadable input; 141
        the reader of the output has gone.
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
        return options.run(options)
    except Unreadable as error:
        say_error(f"mobius: {error}")
        return UNUSABLE
    except (MeshError, Refusal) as error:
        say_error(f"mobius: {error}")
        return NOT_ALIGNED
    except KeyboardInterrupt:
        say_error("mobius: stopped, nothing was written")
        return NOT_ALIGNED


def main_quietly(arguments: list[str], prog: str = "python .") -> int:
    """Run one command with standard output and errors to itself: what Blender's importers say there goes nowhere."""
    take_streams()
    return main(arguments, prog)
