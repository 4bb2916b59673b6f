"""`wrap`: the source wrapped onto the target, or the target with the source's shape as a shape key."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..streams import DONE, say
from .align_options import add_pair_options, align_settings
from .output_files import add_output_options, is_input, orders, require_writable, warn, write_report
from .pair import matched_pair, opened_pair, read_pair, require_something_to_write

HELP = (
    "Wrap the source onto the target: a new object with the source's triangles, UV maps, groups, materials and shape "
    "keys, in the target's shape and place. What is unmatched is filled smoothly."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `wrap` takes."""
    add_pair_options(parser)
    add_output_options(parser, "mesh file to write; a .blend holds the target's scene and the new object")
    parser.add_argument("--use-map", metavar="MAP.npz", type=Path, help="wrap by this map instead of aligning")
    parser.add_argument(
        "--shape-key",
        action="store_true",
        help="instead, a copy of the target with the source's shape as a shape key",
    )


def run(options: argparse.Namespace) -> int:
    """Align two meshes, write the fitted one, and return the exit status."""
    from ...solver import report, save_map
    from ...solver.carry.fitted import in_shape_of, wrapped
    from ..files import outputs, write_mesh
    from ..files.gifti import lies_where
    from ..fitting import reshaped_object, wrapped_object
    from ..mesh_data import Refusal
    from ..operators.wrap import remarks

    settings = align_settings(options)
    require_something_to_write(options)
    require_writable(
        [options.output],
        [options.map, options.report],
        inputs=[options.source, options.target, options.landmarks, options.pairs, options.use_map],
        overwrite=options.overwrite,
    )
    with opened_pair(options, write=True) as (source, target, notes):
        surfaces = read_pair(options, source, target)
        alignment, correspondence = matched_pair(options, (source, target), surfaces, settings)
        fit, make, own = (wrapped, wrapped_object, 0) if not options.shape_key else (in_shape_of, reshaped_object, 1)
        try:
            fitted = fit(correspondence, surfaces[0].mesh, surfaces[1].mesh)
        except ValueError as error:
            raise Refusal(f"'{options.source}' and '{options.target}' cannot be fitted: {error}") from error
        made = make(source.obj, target.obj, surfaces[own], fitted)
        lies_where(made.data, target.obj.data)
        order = orders(options.map, (source, target))
    with outputs() as written:
        lost = write_mesh(
            made, options.output, written, backup=is_input(options.output, [options.source, options.target])
        )
        if alignment and options.map:
            save_map(written.path(options.map), alignment, correspondence, *(x.rest for x in surfaces))
        if alignment and options.report:
            figures = {"matched": float(fitted.matched.mean()), "folded": fitted.folded}
            write_report(written.path(options.report), report(alignment, correspondence) | {"fitted": figures})
    warn([*notes, *remarks(str(options.output), fitted), *lost, *order])
    say(f"{options.output}: {fitted.matched.mean():.0%} of the vertices lie where the map says, the others are filled")
    return DONE
