"""`demo`: two scans of a head, aligned and transferred, with pictures and a report."""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "Build two scans, align and transfer, and leave pictures, a .blend and a report."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `demo` takes."""
    parser.add_argument(
        "-o", "--output", metavar="DIR", type=Path, default=Path("mobius-demo"), help="default: %(default)s"
    )


def run(options: argparse.Namespace) -> int:
    """Run the demo and return the exit status."""
    from ..demo import run as run_demo

    return run_demo(options.output)
