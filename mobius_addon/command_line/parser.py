"""The commands and what they take, by a parser that does not end Blender."""

from __future__ import annotations

import argparse
from typing import Any

from ..streams import say_error
from . import align, check, collection, demo, flatten, transfer, wrap

_COMMANDS = {
    "demo": demo,
    "check": check,
    "flatten": flatten,
    "align": align,
    "transfer": transfer,
    "wrap": wrap,
    "collection": collection,
}


class Usage(Exception):  # noqa: N818  (carries argparse's own exit)
    """Help or wrong usage, with the exit status that argparse means."""

    def __init__(self, status: int) -> None:
        super().__init__(status)
        self.status = status


class Parser(argparse.ArgumentParser):
    """A parser that does not end Blender."""

    def exit(self, status: int = 0, message: str | None = None) -> Any:
        """Say the message and raise `Usage` instead of ending the process."""
        if message:
            say_error(message.rstrip())
        raise Usage(status)


def build_parser(prog: str) -> argparse.ArgumentParser:
    """Return a parser whose result has the chosen command's `run`; help and wrong usage raise `Usage`."""
    parser = Parser(prog=prog, description="Certified conformal correspondence between two surfaces, and transfer.")
    if prog == "python .":
        parser.epilog = "'python . build' makes the extension's zips, from the sources only."
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=Parser)
    for name, command in _COMMANDS.items():
        added = commands.add_parser(name, help=command.HELP, description=command.HELP)
        command.add_arguments(added)
        added.set_defaults(run=command.run)
    return parser
