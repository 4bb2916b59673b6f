"""The commands without a window: `python . COMMAND` and, installed, `blender --command mobius COMMAND`.

Blender is imported when a command runs, not before, so that help and wrong usage need nothing.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..solver import Alignment, AlignSettings, Correspondence, TriangleMesh
    from ..solver.surface.mesh import Integers
    from .attributes import Transfer, TransferSettings
    from .files import Imported
    from .mesh_data import Surface

DONE, NOT_ALIGNED, UNUSABLE = 0, 1, 2
"""Exit statuses: done; could not do it with these meshes; wrong usage or unreadable input."""


class _Usage(Exception):  # noqa: N818  (carries argparse's own exit)
    def __init__(self, status: int) -> None:
        super().__init__(status)
        self.status = status


class _Parser(argparse.ArgumentParser):
    """A parser that does not end Blender."""

    def exit(self, status: int = 0, message: str | None = None) -> Any:
        if message:
            say_error(message.rstrip())
        raise _Usage(status)


def say(text: str) -> None:
    """Write a line of a command's result."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def say_error(text: str) -> None:
    """Write a line about what went wrong."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


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
        0 done; 1 could not be done with these meshes, the reason is on stderr; 2 wrong usage or unreadable input.
    """
    try:
        options = _parser(prog).parse_args(arguments)
    except _Usage as usage:
        return usage.status

    from ..solver import MeshError
    from .files import Unreadable
    from .mesh_data import Refusal

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
    _take_streams()
    return main(arguments, prog)


def _take_streams() -> None:
    """Leave Blender, which writes past Python to the file descriptors, without an audience.

    They are not given back: what Blender holds in its buffers comes out when the process ends.
    """
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        getattr(sys, name).flush()
        setattr(sys, name, os.fdopen(os.dup(descriptor), "w", encoding="utf-8", errors="replace", buffering=1))
        os.dup2(nowhere, descriptor)
    os.close(nowhere)


def _parser(prog: str) -> argparse.ArgumentParser:
    parser = _Parser(prog=prog, description="Certified conformal correspondence between two surfaces, and transfer.")
    if prog == "python .":
        parser.epilog = "'python . build' makes the extension's zips, from the sources only."
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=_Parser)
    mesh_help = "any file Blender imports (.blend .obj .ply .stl .glb .gltf .fbx .usd); FILE:OBJECT names an object"

    def command(name: str, run: Callable[[argparse.Namespace], int], text: str) -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(run=run)
        return added

    demo = command("demo", _demo, "Build two scans, align and transfer, and leave pictures, a .blend and a report.")
    demo.add_argument(
        "-o", "--output", metavar="DIR", type=Path, default=Path("mobius-demo"), help="default: %(default)s"
    )

    check = command("check", _check, "Say what each mesh is, and what would make it a disc.")
    check.add_argument("meshes", metavar="MESH", nargs="+", help=mesh_help)

    flatten = command("flatten", _flatten, "Write a mesh with its map to the unit disc as UV map.")
    flatten.add_argument("mesh", metavar="MESH", help=mesh_help)
    flatten.add_argument("-o", "--output", metavar="OUT", type=Path, required=True, help="mesh file to write")
    flatten.add_argument(
        "--report", metavar="REPORT.json", type=Path, help="write the distortion and what was repaired"
    )
    flatten.add_argument(
        "--method", choices=("harmonic", "mid-edge"), default="harmonic", help="how to flatten; default: %(default)s"
    )
    flatten.add_argument(
        "--distortion",
        choices=("dilatation", "factor"),
        help="write this as the color attribute 'Mobius Disc Angles' or 'Mobius Disc Sizes'",
    )
    repair = flatten.add_argument_group("scans")
    _add_repair_options(repair)
    repair.add_argument("--outer", type=int, metavar="VERTEX", help=_OUTER_HELP)

    align = command("align", _align, "Find the certified correspondence between two meshes.")
    transfer = command(
        "transfer",
        _transfer,
        "Carry what is on the source over to the target, or to each of several. With several, -o, --map and --report "
        "name folders, for a NAME.blend, NAME.npz and NAME.json of each target; one that cannot be done is named, the "
        "others are done, and the exit status is 1.",
    )
    for added in (align, transfer):
        added.add_argument("source", metavar="SOURCE", help=mesh_help)
        added.add_argument("target", metavar="TARGET", nargs="+" if added is transfer else None, help=mesh_help)
        added.add_argument("--map", metavar="MAP.npz", type=Path, help="write the correspondence, array by array")
        added.add_argument("--report", metavar="REPORT.json", type=Path, help="write what was found and proved")
        repair = added.add_argument_group("scans")
        _add_repair_options(repair)
        repair.add_argument("--source-outer", type=int, metavar="VERTEX", help=f"of the source: {_OUTER_HELP}")
        repair.add_argument("--target-outer", type=int, metavar="VERTEX", help="the same of the target")
        _add_align_options(added.add_argument_group("alignment"))
    transfer.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        type=Path,
        required=True,
        help="mesh file to write; for several targets a folder",
    )
    transfer.add_argument("--use-map", metavar="MAP.npz", type=Path, help="carry through this map instead of aligning")
    _add_transfer_options(transfer.add_argument_group("transfer"))
    return parser


_OUTER_HELP = "number, from 0, of a vertex on the outer boundary, for --fill-holes; default: the longest boundary"


def _add_repair_options(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--fill-holes", action="store_true", help="close all boundaries but the outer one for the computation"
    )
    group.add_argument(
        "--largest-part", action="store_true", help="leave all separate parts but the one of largest area out of it"
    )


def _require_outer(vertex: int | None, options: argparse.Namespace, role: str, surface: Surface) -> None:
    """Raise `Unreadable` if a vertex that was named for the outer boundary cannot be on one."""
    from .files import Unreadable

    if vertex is None:
        return
    if not options.fill_holes:
        raise Unreadable(f"{role} chooses among the boundaries that --fill-holes finds: give both")
    count = len(surface.mesh.vertices)
    if not 0 <= vertex < count:
        raise Unreadable(f"{role} {vertex}: '{surface.mesh.name}' has the vertices 0 to {count - 1:,}")


def _add_align_options(group: argparse._ArgumentGroup) -> None:
    group.add_argument("--reflect", choices=("auto", "never", "always"), help="is one the mirror image of the other?")
    group.add_argument("--refine", choices=("dense", "mobius", "none"), help="what follows the proven map")
    group.add_argument(
        "--take-rival", action="store_true", default=None, help="of an ambiguous pair, the best map but one"
    )
    group.add_argument(
        "--landmarks",
        metavar="FILE",
        type=Path,
        help="known pairs, one on each line: two vertex numbers, or x y z on the source and x y z on the target",
    )
    group.add_argument("--samples", type=int, metavar="N", help="source points of the search")
    group.add_argument("--targets", type=int, metavar="N", help="target points of the search")
    group.add_argument("--radius", type=float, metavar="R", help="hyperbolic match radius, in (0, 1)")
    group.add_argument("--z-max", type=float, metavar="Z", help="how far apart the discs' centres may lie, in (0, 1)")
    group.add_argument("--time-limit", type=float, metavar="SECONDS", help="of each search; 0: none")


def _add_transfer_options(group: argparse._ArgumentGroup) -> None:
    """Add the choices of `attributes.TransferSettings`, whose defaults hold where none is given."""
    group.add_argument("--only", metavar="KIND,...", help="carry these only; one unknown lists all")
    which = group.add_mutually_exclusive_group()
    which.add_argument("--names", metavar="NAME,...", help="carry layers of these names only; * and ? stand for any")
    which.add_argument("--active", action="store_true", help="carry the active layer of each kind only")
    group.add_argument(
        "--deform-only", action="store_true", help="of the vertex groups, those of an armature's deforming bones"
    )
    group.add_argument(
        "--collisions", choices=("replace", "number"), help="what a layer does whose name is taken; default: replace"
    )
    group.add_argument(
        "--mix", choices=("replace", "add", "subtract", "multiply"), help="with values that are there; default: replace"
    )
    group.add_argument("--mix-factor", type=float, metavar="F", help="how far to go to the result, in [0, 1]")
    group.add_argument("--limit", type=int, metavar="N", help="keep the strongest N vertex groups of a vertex; 0: all")
    group.add_argument("--normalize", action="store_true", help="scale the weights of each vertex to the sum 1")
    group.add_argument("--smallest-weight", type=float, metavar="W", help="smaller weights are left out")
    for side, verb in (("source", "gives"), ("target", "receives")):
        group.add_argument(
            f"--{side}-mask", metavar="NAME", help=f"vertex group or attribute of what {verb}; 'selection': selected"
        )
        group.add_argument(f"--invert-{side}-mask", action="store_true", help=f"all but that part {verb}")
    group.add_argument(
        "--unmatched",
        choices=("carry", "leave", "nearest", "fill"),
        help="what vertices get without a certain counterpart: what the map says all the same (default), nothing, the "
        "nearest matched value, a smooth fill",
    )
    group.add_argument(
        "--evaluated", action="store_true", help="the source as its modifiers and the mix of its shape keys show it"
    )


def _transfer_settings(options: argparse.Namespace) -> TransferSettings:
    """Return the choices of a transfer with the given options in place of the defaults."""
    from .attributes import Mask, TransferSettings, split_names
    from .files import Unreadable

    given = {"kinds": tuple(_kinds(options.only)), "evaluated": options.evaluated, "normalize": options.normalize}
    given |= {"deform_only": options.deform_only}
    if options.names is not None:
        given |= {"layers": "named", "names": split_names(options.names)}
    elif options.active:
        given["layers"] = "active"
    for name in ("collisions", "mix", "mix_factor", "limit", "smallest_weight", "unmatched"):
        if getattr(options, name) is not None:
            given[name] = getattr(options, name)
    for side in ("source", "target"):
        name, invert = getattr(options, f"{side}_mask"), getattr(options, f"invert_{side}_mask")
        if name is not None:
            by = "selected" if name == "selection" else "named"
            given[f"{side}_mask"] = Mask(by, "" if by == "selected" else name, invert)
        elif invert:
            raise Unreadable(f"--invert-{side}-mask inverts --{side}-mask: give both")
    try:
        return TransferSettings(**given)
    except ValueError as error:
        raise Unreadable(str(error)) from error


def _align_settings(options: argparse.Namespace) -> AlignSettings:
    """Return the solver's settings with the given options in place of its defaults."""
    from ..solver import AlignSettings
    from .files import Unreadable

    names = ("reflect", "refine", "take_rival", "samples", "targets", "radius", "z_max", "time_limit")
    names += ("fill_holes", "source_outer", "target_outer")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    if "time_limit" in given:
        given["time_limit"] = given["time_limit"] or None
    try:
        return AlignSettings(**given)
    except ValueError as error:
        raise Unreadable(str(error)) from error


def _demo(options: argparse.Namespace) -> int:
    from .demo import run

    return run(options.output)


def _check(options: argparse.Namespace) -> int:
    from ..solver import MeshError, topology
    from .files import Unreadable, import_meshes, new_scene, split_object_name
    from .mesh_data import read_surface

    status = DONE
    for argument in options.meshes:
        path, wanted = split_object_name(argument)
        new_scene()
        try:
            found = import_meshes(path)
            chosen = [x for x in found if wanted in (None, x.name)]
            if not chosen:
                raise Unreadable(f"'{path}' has no mesh object named '{wanted}'")
        except Unreadable as error:
            say_error(f"mobius: {error}")
            status = UNUSABLE
            continue
        for imported in chosen:
            name = argument if len(chosen) == 1 else f"{path}:{imported.name}"
            try:
                what = topology(read_surface(imported.obj, name).mesh)
                line, is_disc = what.describe(), what.is_disc
            except MeshError as error:
                line, is_disc = "not a disc: it " + str(error).removeprefix(f"'{name}' "), False
            say(f"{name}: {line}")
            if not is_disc:
                status = max(status, NOT_ALIGNED)
    return status


def _flatten(options: argparse.Namespace) -> int:
    from dataclasses import asdict

    from .attributes import DISC_LAYOUT
    from .computation import Repair, flattened
    from .files import export_mesh, import_mesh, new_scene, outputs
    from .heat_maps import DISC_MEASURES, measure
    from .mesh_data import read_surface
    from .results import require_room, write_color, write_layout

    _require_writable(meshes=[options.output], others=[options.report])
    new_scene()
    obj = import_mesh(options.mesh).obj
    surface = read_surface(obj, options.mesh)
    shown = measure(options.distortion, DISC_MEASURES) if options.distortion else None
    require_room(obj, [DISC_LAYOUT], [shown.attribute] if shown else [])
    _require_outer(options.outer, options, "--outer", surface)
    repair = Repair(options.fill_holes, options.largest_part)
    flattening, notes = flattened(surface.mesh, options.method, repair, outer=options.outer)
    write_layout(obj, DISC_LAYOUT, flattening.disc, surface)
    if shown:
        write_color(obj, shown.attribute, *shown.color(flattening))
    found = flattening.distortion
    with outputs() as written:
        export_mesh(obj, written.path(options.output))
        if options.report:
            figures = {
                "mesh": options.mesh,
                "method": options.method,
                "distortion": asdict(found),
                "flips_repaired": flattening.flips_repaired,
                "holes": [len(loop) for loop in flattening.holes],
                "warnings": list(notes),
            }
            _write_report(written.path(options.report), figures)
    for note in notes:
        say_error(f"mobius: warning: {note}")
    _warn_of_losses(options.output, ["uv", "colors"] if shown else ["uv"])
    say(
        f"{options.output}: UV map '{DISC_LAYOUT}', angles off by {found.mean_angle_error:.2f}° on average "
        f"(median {found.median_angle_error:.2f}°, 99 % {found.percentile_99_angle_error:.1f}°, "
        f"most {found.max_angle_error:.1f}°), "
        f"dilatation {found.mean_dilatation:.3f} (most {found.max_dilatation:.2f}), "
        f"{found.flips} triangles turned over"
    )
    return DONE


def _align(options: argparse.Namespace) -> int:
    from ..solver import report, save_map
    from .files import new_scene, outputs

    settings = _align_settings(options)
    _require_writable(others=[options.map, options.report])
    new_scene()
    source, target = _import_pair(options)
    alignment, correspondence = _aligned(options, _surfaces(options, source, target), settings)
    with outputs() as written:
        if options.map:
            save_map(written.path(options.map), alignment, correspondence)
        if options.report:
            _write_report(written.path(options.report), report(alignment, correspondence))
    _warn_of_order(options.map, (source, target))
    return DONE


def _transfer(options: argparse.Namespace) -> int:
    from ..solver import MeshError
    from .files import Unreadable
    from .mesh_data import Refusal

    targets = options.target
    if len(targets) == 1:
        _transfer_to(argparse.Namespace(**{**vars(options), "target": targets[0]}))
        return DONE
    status = DONE
    for one in _one_by_one(options):
        try:
            _transfer_to(one)
        except (Unreadable, MeshError, Refusal) as error:
            say_error(f"mobius: {one.target}: {error}")
            status = NOT_ALIGNED
    return status


def _one_by_one(options: argparse.Namespace) -> list[argparse.Namespace]:
    """Return the options of a transfer to each of several targets, whose results go into folders.

    Raises
    ------
    Unreadable
        Something is said that can be meant of one target only, or there is no such folder, or two names are the same.
    """
    from .files import Unreadable, split_object_name

    for name in ("use_map", "landmarks", "target_outer"):
        if getattr(options, name) is not None:
            raise Unreadable(f"--{name.replace('_', '-')} is about one target: give one, not {len(options.target)}")
    suffixes = {"output": ".blend", "map": ".npz", "report": ".json"}
    folders = {name: getattr(options, name) for name in suffixes if getattr(options, name) is not None}
    for name, folder in folders.items():
        if not folder.is_dir():
            flag = "-o" if name == "output" else f"--{name}"
            raise Unreadable(f"{flag} '{folder}' is no folder, which several targets need: make it first")
    result: list[argparse.Namespace] = []
    for target in options.target:
        path, wanted = split_object_name(target)
        name = path.stem if wanted is None else f"{path.stem} {wanted}"
        paths = {key: folder / f"{name}{suffixes[key]}" for key, folder in folders.items()}
        if twin := next((x for x in result if x.output == paths["output"]), None):
            raise Unreadable(f"'{twin.target}' and '{target}' would both be written to '{twin.output}'")
        result.append(argparse.Namespace(**{**vars(options), "target": target, **paths}))
    return result


def _transfer_to(options: argparse.Namespace) -> None:
    """Carry what is on the source over to one target."""
    from dataclasses import asdict

    from ..solver import load_map, report, save_map
    from .files import Unreadable, export_mesh, new_scene, outputs
    from .operators.transfer import describe_counts, read_through

    choices = _transfer_settings(options)
    settings = _align_settings(options)
    if options.use_map and (options.map or options.report):
        raise Unreadable("--use-map aligns nothing, so there is no --map or --report to write")
    _require_writable(meshes=[options.output], others=[options.map, options.report])
    new_scene()
    source, target = _import_pair(options)
    surfaces = _surfaces(options, source, target)
    alignment = None
    if options.use_map:
        correspondence = _fitting_map(load_map, options, surfaces)
    else:
        alignment, correspondence = _aligned(options, surfaces, settings)
    plan = read_through(source.obj, target.obj, surfaces, correspondence, choices).carry()
    plan.write(target.obj)
    with outputs() as written:
        export_mesh(target.obj, written.path(options.output))
        if alignment and options.map:
            save_map(written.path(options.map), alignment, correspondence)
        if alignment and options.report:
            figures = report(alignment, correspondence) | {
                "transferred": _listed(plan),
                "unmatched": asdict(plan.unmatched),
            }
            _write_report(written.path(options.report), figures)
    for warning in plan.warnings:
        say_error(f"mobius: warning: {warning}")
    _warn_of_losses(options.output, plan.counts())
    _warn_of_order(options.map, (source, target))
    say(f"{options.output}: {describe_counts(plan.counts())} from {options.source}{plan.unmatched.remark()}")


def _kinds(only: str | None) -> list[str]:
    """Return the kinds of data that --only names; all of them without it."""
    from .attributes import KINDS
    from .files import Unreadable

    known = [kind.identifier for kind in KINDS]
    if only is None:
        return known
    wanted = [name.strip() for name in only.split(",") if name.strip()]
    if unknown := [name for name in wanted if name not in known]:
        raise Unreadable(f"--only does not know '{unknown[0]}': it takes {', '.join(known)}")
    if not wanted:
        raise Unreadable(f"--only names nothing: it takes {', '.join(known)}")
    return wanted


def _require_writable(meshes: Iterable[Path] = (), others: Iterable[Path | None] = ()) -> None:
    """Raise `Unreadable` before any work if an output cannot be written."""
    from .files import Unreadable, format_of

    meshes, others = list(meshes), [path for path in others if path is not None]
    for path in meshes:
        format_of(path)
    for path in [*meshes, *others]:
        if path.is_dir():
            raise Unreadable(f"'{path}' is a folder: name a file to write")
        if not path.resolve().parent.is_dir():
            raise Unreadable(f"there is no folder '{path.parent}' to write '{path.name}' in")
    if len({path.resolve() for path in [*meshes, *others]}) < len(meshes) + len(others):
        raise Unreadable("two outputs have the same name")


def _import_pair(options: argparse.Namespace) -> tuple[Imported, Imported]:
    """Return source and target."""
    from .files import import_mesh
    from .mesh_data import Refusal

    if _same_mesh(options.source, options.target):
        raise Refusal(f"'{options.source}' is both source and target: give two meshes")
    target = import_mesh(options.target)  # first, so that its materials and images keep their names
    return import_mesh(options.source), target


def _surfaces(options: argparse.Namespace, source: Imported, target: Imported) -> tuple[Surface, Surface]:
    """Return source and target as arrays, named as on the command line."""
    from .mesh_data import read_surface

    return read_surface(source.obj, options.source), read_surface(target.obj, options.target)


def _same_mesh(source: str, target: str) -> bool:
    from .files import split_object_name

    (source_path, source_name), (target_path, target_name) = split_object_name(source), split_object_name(target)
    return source_path.resolve() == target_path.resolve() and source_name == target_name


def _aligned(
    options: argparse.Namespace, surfaces: tuple[Surface, Surface], settings: AlignSettings
) -> tuple[Alignment, Correspondence]:
    """Align two surfaces and say what was found."""
    from .computation import aligned
    from .operators.align import summary

    source, target = surfaces
    _require_outer(settings.source_outer, options, "--source-outer", source)
    _require_outer(settings.target_outer, options, "--target-outer", target)
    pairs = _landmarks(options, (source.mesh, target.mesh))
    alignment, correspondence = aligned(
        source.mesh, target.mesh, settings, largest_part=options.largest_part, landmarks=pairs
    )
    for warning in alignment.warnings:
        say_error(f"mobius: warning: {warning}")
    say(summary(options.source, options.target, alignment, correspondence))
    say(", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in alignment.seconds.items()))
    return alignment, correspondence


def _landmarks(options: argparse.Namespace, meshes: tuple[TriangleMesh, TriangleMesh]) -> Integers | None:
    """Return the pairs of the file that was given, if any."""
    from .files import Unreadable
    from .landmarks import from_file

    if options.landmarks is None:
        return None
    try:
        return from_file(options.landmarks, meshes)
    except OSError as error:
        raise Unreadable(f"'{options.landmarks}' cannot be read: {error.strerror}") from error


def _fitting_map(
    load_map: Callable[[Path], Correspondence], options: argparse.Namespace, surfaces: tuple[Surface, Surface]
) -> Correspondence:
    """Load a map and make sure that it is one between these two meshes."""
    import numpy as np

    from .files import Unreadable

    path = options.use_map
    if not path.is_file():
        raise Unreadable(f"there is no file '{path}'")
    try:
        correspondence = load_map(path)
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise Unreadable(f"'{path}' is not a map that this program wrote") from error
    source, target = surfaces
    if not np.array_equal(correspondence.source_triangles, source.mesh.faces):
        raise Unreadable(f"'{path}' was made for another source than '{options.source}'")
    if len(correspondence.face) != len(target.mesh.vertices):
        raise Unreadable(
            f"'{path}' was made for a target of {len(correspondence.face):,} vertices, "
            f"but '{options.target}' has {len(target.mesh.vertices):,}"
        )
    return correspondence


def _listed(plan: Transfer) -> list[dict[str, str]]:
    return [{"kind": layer.row.kind, "source": layer.source_name, "target": layer.name} for layer in plan.layers]


def _write_report(path: Path, figures: dict[str, Any]) -> None:
    path.write_text(json.dumps(figures, indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def _warn_of_losses(path: Path, kinds: Iterable[str]) -> None:
    """Say what a file of this kind cannot hold."""
    from .attributes import KINDS
    from .files import format_of

    nouns = {kind.identifier: kind.noun for kind in KINDS}
    lost = [nouns[kind] for kind in kinds if kind not in format_of(path).keeps]
    if lost:
        say_error(f"mobius: warning: {path.suffix} files cannot hold {', '.join(lost)}: write a .blend to keep them")


def _warn_of_order(map_path: Path | None, meshes: Iterable[Imported]) -> None:
    """Say where the map that was written does not count a file's vertices as the file does."""
    for imported in meshes if map_path else ():
        if reason := imported.order_change():
            say_error(f"mobius: warning: the map counts the vertices of '{imported.path}' otherwise: {reason}")


_handle: Any = None


def register() -> None:
    """Register the commands as `blender --command mobius`."""
    import bpy

    global _handle
    _handle = bpy.utils.register_cli_command(
        "mobius", lambda arguments: main_quietly(list(arguments), "blender --command mobius")
    )


def unregister() -> None:
    """Undo `register`."""
    import bpy

    bpy.utils.unregister_cli_command(_handle)
