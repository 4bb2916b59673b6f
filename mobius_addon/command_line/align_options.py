"""What commands that align are told: the pair, where its map and report go, and the solver's settings."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from .mesh_options import MESH_HELP, OUTER_HELP, add_repair_options

if TYPE_CHECKING:
    from ...solver import AlignSettings


def add_pair_options(parser: argparse.ArgumentParser, several_targets: bool = False) -> None:
    """Add source and target, or several targets, and all about aligning them."""
    parser.add_argument("source", metavar="SOURCE", help=MESH_HELP)
    parser.add_argument("target", metavar="TARGET", nargs="+" if several_targets else None, help=MESH_HELP)
    parser.add_argument("--map", metavar="MAP.npz", type=Path, help="write the correspondence, array by array")
    parser.add_argument("--report", metavar="REPORT.json", type=Path, help="write what was found and proved")
    repair = parser.add_argument_group("scans")
    add_repair_options(repair)
    repair.add_argument("--source-outer", type=int, metavar="VERTEX", help=f"of the source: {OUTER_HELP}")
    repair.add_argument("--target-outer", type=int, metavar="VERTEX", help="the same of the target")
    cut = (
        "vertex group or attribute around the piece that is matched, such as a head; 'selection': selected; 'seams': "
        "cut open along marked seams"
    )
    repair.add_argument("--source-cut", metavar="NAME", default="", help=f"of the source: {cut}")
    repair.add_argument("--target-cut", metavar="NAME", default="", help="the same of the target")
    repair.add_argument(
        "--keep-whole",
        dest="cut",
        action="store_false",
        default=True,
        help="refuse a body that is too deep for a disc; by default the piece that fits the other mesh is cut out",
    )
    _add_align_options(parser.add_argument_group("alignment"))


def _add_align_options(group: argparse._ArgumentGroup) -> None:
    group.add_argument("--reflect", choices=("auto", "never", "always"), help="is one the mirror image of the other?")
    group.add_argument("--refine", choices=("dense", "mobius", "none"), help="what follows the proven map")
    group.add_argument(
        "--parts",
        choices=("all", "main"),
        help="of meshes with several: all of them, each from its counterpart (default), or the largest ones alone",
    )
    group.add_argument(
        "--take-rival", action="store_true", default=None, help="of an ambiguous pair, the best map but one"
    )
    group.add_argument(
        "--landmarks",
        metavar="FILE",
        type=Path,
        help="known pairs, one on each line: two vertex numbers, or x y z on the source and x y z on the target in the "
        "axes and units of their files",
    )
    group.add_argument(
        "--pairs",
        metavar="FILE",
        type=Path,
        help="corrections, as --landmarks has them: the finished map is bent through them, but for those that "
        "contradict a map that is sure of itself",
    )
    group.add_argument(
        "--follow-all", action="store_true", help="with --pairs: bend through those that contradict the map, too"
    )
    group.add_argument("--samples", type=int, metavar="N", help="source points of the search")
    group.add_argument("--targets", type=int, metavar="N", help="target points of the search")
    group.add_argument("--radius", type=float, metavar="R", help="hyperbolic match radius, in (0, 1)")
    group.add_argument("--z-max", type=float, metavar="Z", help="how far apart the discs' centres may lie, in (0, 1)")
    group.add_argument("--time-limit", type=float, metavar="SECONDS", help="of each search; 0: none")


def align_settings(options: argparse.Namespace) -> AlignSettings:
    """Return the solver's settings with the given options in place of its defaults."""
    from ...solver import AlignSettings
    from ..files import Unreadable

    if options.follow_all and options.pairs is None:
        raise Unreadable("--follow-all is about --pairs: give them")
    names = ("reflect", "refine", "take_rival", "samples", "targets", "radius", "z_max", "time_limit")
    names += ("parts", "fill_holes", "cut", "source_outer", "target_outer")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    if "time_limit" in given:
        given["time_limit"] = given["time_limit"] or None
    try:
        return AlignSettings(**given)
    except ValueError as error:
        raise Unreadable(str(error)) from error
