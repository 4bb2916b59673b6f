"""`align`: the certified correspondence between two meshes, as a map and a report."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..streams import DONE, quiet
from .align_options import add_pair_options, align_settings
from .output_files import orders, require_writable, warn, write_report
from .pair import align_pair, opened_pair, read_pair

HELP = "Find the certified correspondence between two meshes."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `align` takes."""
    add_pair_options(parser)
    parser.add_argument(
        "--picture",
        metavar="PICTURE.png",
        type=Path,
        help="draw both surfaces in their discs, or on their spheres, with the matched points",
    )


def run(options: argparse.Namespace) -> int:
    """Align two meshes, write what is asked for, and return the exit status."""
    from ...solver import report, save_map
    from ..files import Unreadable, outputs
    from ..map_picture import render_map
    from ..studio.scene import require_cycles

    settings = align_settings(options)
    inputs = [options.source, options.target, options.landmarks, options.pairs]
    require_writable(others=[options.map, options.report, options.picture], inputs=inputs)
    if options.picture:
        if options.picture.suffix.lower() != ".png":
            raise Unreadable(f"'{options.picture}': a picture is a .png")
        require_cycles()
    with opened_pair(options, write=False) as (source, target, _):
        surfaces = read_pair(options, source, target)
        alignment, correspondence = align_pair(options, (source, target), surfaces, settings)
        notes = orders(options.map, (source, target))
    with outputs() as written:
        if options.map:
            save_map(written.path(options.map), alignment, correspondence, *(x.rest for x in surfaces))
        if options.report:
            write_report(written.path(options.report), report(alignment, correspondence))
        if options.picture:
            with quiet():
                render_map(alignment, written.path(options.picture))
    warn(notes)
    return DONE
