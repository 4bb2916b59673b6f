"""`flatten`: a mesh with its map to the unit disc as UV map."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..streams import DONE, say
from .mesh_options import MESH_HELP, OUTER_HELP, add_repair_options, require_outer
from .output_files import add_output_options, is_input, require_writable, warn, write_report

HELP = "Write a mesh with its map to the unit disc as UV map, or, closed, on a sphere."

RADIUS = 100.0
"""Of the sphere in a .gii, as FreeSurfer and Connectome Workbench have it; in other files 1."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `flatten` takes."""
    parser.add_argument("mesh", metavar="MESH", help=MESH_HELP)
    add_output_options(parser, "mesh file to write; a .blend holds all that the file of a MESH in a .blend does")
    parser.add_argument("--report", metavar="REPORT.json", type=Path, help="write the distortion and what was repaired")
    parser.add_argument(
        "--method", choices=("harmonic", "mid-edge"), default="harmonic", help="how to flatten; default: %(default)s"
    )
    parser.add_argument(
        "--distortion",
        choices=("dilatation", "factor"),
        help="write this as the color attribute 'Mobius Disc Angles' or 'Mobius Disc Sizes'",
    )
    parser.add_argument(
        "--sphere",
        action="store_true",
        help="of a closed mesh, write a copy whose vertices lie on the unit sphere (in a .gii of radius 100)",
    )
    repair = parser.add_argument_group("scans")
    add_repair_options(repair)
    repair.add_argument("--outer", type=int, metavar="VERTEX", help=OUTER_HELP)


def run(options: argparse.Namespace) -> int:
    """Flatten a mesh, write it, and return the exit status."""
    from dataclasses import asdict

    import numpy as np

    from ..attributes import DISC_LAYOUT
    from ..computation import Repair, flattened
    from ..files import opened, outputs, write_mesh
    from ..heat_maps import DISC_MEASURES, measure
    from ..mesh_data import read_surface
    from ..results import require_room, write_color, write_layout

    require_writable([options.output], [options.report], inputs=[options.mesh], overwrite=options.overwrite)
    if options.sphere:
        return _to_sphere(options)
    with opened(options.mesh) as file:
        obj = file.target.obj
        surface = read_surface(obj, options.mesh)
        shown = measure(options.distortion, DISC_MEASURES) if options.distortion else None
        require_room(obj, [DISC_LAYOUT], [shown.attribute] if shown else [])
        require_outer(options.outer, options, "--outer", surface)
        repair = Repair(options.fill_holes, options.largest_part)
        flat = flattened(surface.mesh, options.method, repair, outer=options.outer, keys=surface.keys)
        flattening = flat.flattening
        write_layout(obj, DISC_LAYOUT, flat.tidy.at_corners(flattening.disc, np.nan), surface)
        if shown:
            color, known = shown.color(flattening)
            write_color(obj, shown.attribute, flat.tidy.at_vertices(color, 0), flat.tidy.at_vertices(known, False))
    found = flattening.distortion
    with outputs() as written:
        backup = is_input(options.output, [options.mesh])
        lost = write_mesh(obj, options.output, written, backup=backup)
        if options.report:
            figures = {
                "mesh": options.mesh,
                "method": options.method,
                "distortion": asdict(found),
                "flips_repaired": flattening.flips_repaired,
                "holes": [len(loop) for loop in flattening.holes],
                "warnings": list(flat.notes),
            }
            write_report(written.path(options.report), figures)
    warn([*flat.notes, *lost])
    say(
        f"{options.output}: UV map '{DISC_LAYOUT}', angles off by {found.mean_angle_error:.2f}° on average "
        f"(median {found.median_angle_error:.2f}°, 99 % {found.percentile_99_angle_error:.1f}°, "
        f"most {found.max_angle_error:.1f}°), "
        f"dilatation {found.mean_dilatation:.3f} (most {found.max_dilatation:.2f}), "
        f"{found.flips} triangles turned over"
    )
    return DONE


def _to_sphere(options: argparse.Namespace) -> int:
    """Write a closed mesh on the sphere."""
    from dataclasses import asdict

    from ..computation import Repair, on_sphere
    from ..files import Unreadable, opened, outputs, write_mesh
    from ..files.gifti import is_sphere
    from ..fitting import sphere_object
    from ..mesh_data import read_surface

    if options.distortion or options.outer is not None or options.method != "harmonic":
        raise Unreadable("--sphere is for closed meshes, and --method, --distortion and --outer are about discs")
    radius = RADIUS if options.output.suffix.lower() == ".gii" else 1.0
    with opened(options.mesh) as file:
        surface = read_surface(file.target.obj, options.mesh)
        flat, tidy = on_sphere(surface.mesh, Repair(options.fill_holes, options.largest_part), surface.keys)
        made = sphere_object(file.target.obj, radius * tidy.at_vertices(flat.sphere, 0.0))
        is_sphere(made.data)
    found = flat.distortion
    with outputs() as written:
        lost = write_mesh(made, options.output, written, backup=is_input(options.output, [options.mesh]))
        if options.report:
            figures = {"mesh": options.mesh, "distortion": asdict(found), "flips_repaired": flat.flips_repaired}
            write_report(written.path(options.report), figures)
    warn(lost)
    say(
        f"{options.output}: on a sphere of radius {radius:g}, angles off by {found.mean_angle_error:.2f}° on average "
        f"(median {found.median_angle_error:.2f}°), dilatation {found.mean_dilatation:.3f}, {found.flips} triangles "
        "turned over"
    )
    return DONE
