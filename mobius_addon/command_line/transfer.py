"""`transfer`: what is on the source, carried to one target or to each of several."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..streams import DONE, NOT_ALIGNED, quiet, say, say_error
from .align_options import add_pair_options, align_settings
from .output_files import add_output_options, is_input, orders, require_writable, warn, write_report
from .pair import matched_pair, opened_pair, read_pair, require_something_to_write
from .several_targets import one_by_one
from .surface_data import (
    add_data_option,
    carrier_of_data,
    data_outputs,
    plan_of_data,
    read_data,
    write_data,
)
from .transfer_options import add_texture_options, add_transfer_options, transfer_settings

if TYPE_CHECKING:
    from ..attributes import Transfer, TransferSettings
    from ..files import Imported

HELP = (
    "Carry what is on the source over to the target, or to each of several. With several, -o, --map and --report "
    "name folders, for a NAME.blend, NAME.npz and NAME.json of each target; one that cannot be done is named, the "
    "others are done, and the exit status is 1."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `transfer` takes."""
    add_pair_options(parser, several_targets=True)
    add_output_options(
        parser,
        "mesh file to write; a .blend holds all that the target's .blend does; for several targets a folder",
    )
    parser.add_argument("--use-map", metavar="MAP.npz", type=Path, help="carry through this map instead of aligning")
    parser.add_argument(
        "--sheet",
        metavar="PICTURE.png",
        type=Path,
        help="draw source and target below each other with six of the shape keys",
    )
    transfer = parser.add_argument_group("transfer")
    add_transfer_options(transfer)
    add_data_option(transfer)
    add_texture_options(parser.add_argument_group("textures"))


def run(options: argparse.Namespace) -> int:
    """Carry to each target and return the exit status: 1 if one of several could not be done."""
    from ...solver import MeshError
    from ..files import Unreadable
    from ..mesh_data import Refusal

    targets = options.target
    if len(targets) == 1:
        _transfer_to(argparse.Namespace(**{**vars(options), "target": targets[0]}))
        return DONE
    status = DONE
    several = one_by_one(options)
    for one in several:
        _require_writable(one)
    for one in several:
        try:
            _transfer_to(one)
        except (Unreadable, MeshError, Refusal) as error:
            say_error(f"mobius: {one.target}: {error}")
            status = NOT_ALIGNED
    return status


def _transfer_to(options: argparse.Namespace) -> None:
    """Carry what is on the source over to one target."""
    from dataclasses import asdict

    from ...solver import report, save_map
    from ..attributes.prepared import NothingThere
    from ..attributes.shares import write_shares
    from ..files import Unreadable, outputs, require_room, write_mesh
    from ..files.pictures_beside import write_map, write_pictures
    from ..last_transfer import describe_counts
    from ..operators.transfer import read_through
    from ..sheet import render_sheet
    from ..studio.scene import require_cycles

    choices = transfer_settings(options)
    settings = align_settings(options)
    require_something_to_write(options)
    if options.texture_map and "textures" not in choices.kinds:
        raise Unreadable("--texture-map is made with textures: say --only textures")
    if options.sheet and "shape-keys" not in choices.kinds:
        raise Unreadable("--sheet shows shape keys: carry them too")
    _require_writable(options)
    if options.sheet:
        if options.sheet.suffix.lower() != ".png":
            raise Unreadable(f"'{options.sheet}': a sheet is a .png")
        require_cycles()
    if options.use_texture_map:
        _through_texture_map(options, choices)
        return
    with outputs() as written:
        with opened_pair(options, write=True) as (source, target, notes):
            _require_single(choices, source, target)
            require_room(len(target.objects), options.output)
            surfaces = read_pair(options, source, target)
            data = read_data(options, surfaces[0])
            alignment, correspondence = matched_pair(options, (source, target), surfaces, settings)
            keeps = options.texture_map is not None
            carrier, unmatched = carrier_of_data(source, surfaces, correspondence, choices)
            try:
                reading = read_through(
                    source.obj, target.obj, surfaces, correspondence, choices, keeps_texture_map=keeps
                )
                plan = reading.carry()
            except NothingThere:
                if not data:
                    raise
                plan = plan_of_data(unmatched)
            write_data(data, carrier, options, target, written)
            if target.members:
                write_shares(plan, target.members, source.members, correspondence)
            if options.sheet or not target.members:
                plan.write(target.obj)
            if options.sheet:
                keys = [(x.source_name, x.name) for x in plan.layers if x.row.kind == "shape-keys"]
                sheet = written.path(options.sheet)
                with quiet():
                    render_sheet((source.obj, target.obj), surfaces, correspondence, keys, sheet)
            order = orders(options.map, (source, target))
        backup = is_input(options.output, [options.source, options.target])
        if options.texture_map:
            write_map(plan.textures, options.texture_map, written)
        if plan.textures is not None and not options.pack_textures:
            write_pictures(target.obj, options.output, written)
        first, *others = target.objects
        lost = write_mesh(first, options.output, written, backup=backup, others=others)
        if alignment and options.map:
            save_map(written.path(options.map), alignment, correspondence, *(x.rest for x in surfaces))
        if alignment and options.report:
            figures = report(alignment, correspondence) | {
                "transferred": _listed(plan),
                "unmatched": asdict(plan.unmatched),
            }
            write_report(written.path(options.report), figures)
    warn([*notes, *plan.warnings, *lost, *order])
    counts = describe_counts(plan.counts() | ({"data": len(data)} if data else {}))
    less = ", but for what the file is without" if lost and options.output.suffix.lower() != ".blend" else ""
    say(f"{options.output}: {counts} from {options.source}{less}{plan.unmatched.remark()}")


def _through_texture_map(options: argparse.Namespace, choices: TransferSettings) -> None:
    """Carry the source's pictures through a transfer map."""
    from ..attributes import restored_on_failure
    from ..files import Unreadable, outputs, write_mesh
    from ..files.pictures_beside import write_pictures
    from ..last_transfer import describe_counts
    from ..textures.by_map import read_map, read_turns, textures_by_map
    from ..textures.writing import made_or_removed, write_textures

    if choices.kinds != ("textures",) or options.map or options.report or options.use_map or options.texture_map:
        raise Unreadable("--use-texture-map carries pictures and aligns nothing: say --only textures, and no other map")
    with opened_pair(options, write=True) as (source, target, notes):
        _require_single(choices, source, target)
        surfaces = read_pair(options, source, target)
        tiles = read_map(options.use_texture_map)
        turns = read_turns(options.use_texture_map, tiles)
        found = textures_by_map(source.obj, target.obj, surfaces, tiles, turns, choices.textures)
        with made_or_removed() as made, restored_on_failure(target.obj):
            write_textures(target.obj, found, made)
    with outputs() as written:
        if not options.pack_textures:
            write_pictures(target.obj, options.output, written)
        backup = is_input(options.output, [options.source, options.target])
        lost = write_mesh(target.obj, options.output, written, backup=backup)
    warn([*notes, *found.notes, *lost])
    say(f"{options.output}: {describe_counts({'textures': len(found.made)})} from {options.source}")


def _require_single(choices: TransferSettings, source: Imported, target: Imported) -> None:
    """Raise `Refusal` where several objects of a file cannot count as one."""
    from ..mesh_data import Refusal

    flag = "--only textures" if "textures" in choices.kinds else "--evaluated"
    sides = (source, target) if "textures" in choices.kinds else (source,) if choices.evaluated else ()
    for imported in sides:
        if imported.members:
            raise Refusal(
                f"'{imported.path}' has {len(imported.members)} mesh objects, and {flag} takes one: name it as "
                f"{imported.path}:NAME, or join what belongs together in Blender (Ctrl J)"
            )


def _require_writable(options: argparse.Namespace) -> None:
    from ..textures.images import turns_beside

    inputs = [
        options.source,
        options.target,
        options.use_map,
        options.landmarks,
        options.pairs,
        options.use_texture_map,
    ]
    beside = turns_beside(options.texture_map) if options.texture_map else None
    others = [options.map, options.report, options.texture_map, beside, options.sheet]
    data = data_outputs(options)
    # a folder of them that is not there yet is made
    others += [path for path in data if path.parent.is_dir()]
    require_writable([options.output], others, inputs=[*inputs, *options.data], overwrite=options.overwrite)


def _listed(plan: Transfer) -> list[dict[str, str]]:
    listed = [{"kind": layer.row.kind, "source": layer.source_name, "target": layer.name} for layer in plan.layers]
    made = () if plan.textures is None else plan.textures.made
    return listed + [{"kind": "textures", "source": x.channel.label, "target": x.channel.label} for x in made]
