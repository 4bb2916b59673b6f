"""What a transfer is told: what to carry, where, and how it mixes with what is there."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..attributes import TransferSettings


def add_transfer_options(group: argparse._ArgumentGroup) -> None:
    """Add the choices of `attributes.TransferSettings`, whose defaults hold where none is given."""
    group.add_argument(
        "--only", metavar="KIND,...", help="carry these only; one unknown lists all; textures only where named"
    )
    which = group.add_mutually_exclusive_group()
    which.add_argument("--names", metavar="NAME,...", help="carry layers of these names only; * and ? stand for any")
    which.add_argument("--active", action="store_true", help="carry the active layer of each kind only")
    group.add_argument(
        "--deform-only", action="store_true", help="of the vertex groups, those of an armature's deforming bones"
    )
    group.add_argument(
        "--collisions",
        choices=("replace", "number"),
        help="what a layer does whose name another one of the target's own has: it takes its place or stands beside it "
        "with a number (default)",
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
        "--shape-keys-by",
        dest="keys_by",
        choices=("gradients", "frames"),
        help="how shape keys get the target's directions and proportions: by the gradients of the whole deformation "
        "(default), or vertex by vertex by the frames of the surface",
    )
    group.add_argument(
        "--no-contacts",
        dest="contacts",
        action="store_false",
        default=None,
        help="leave open what shape keys close on the source, as lids and lips, where the carried shape does not",
    )
    group.add_argument(
        "--rig",
        action="store_true",
        help="a copy of the armature that moves the source too, its joints where they belong in the target",
    )
    group.add_argument(
        "--rename",
        dest="spelling",
        choices=("keep", "arkit", "underscore", "dot"),
        help="how known expressions are called: as on the source (default), eyeBlinkLeft, eyeBlink_L or eyeBlink.L",
    )
    group.add_argument(
        "--split",
        dest="halves",
        action="store_true",
        help="expressions that are one for both sides, as browInnerUp, become two, left and right",
    )
    group.add_argument(
        "--symmetric",
        action="store_true",
        help="shape keys that are nearly symmetric, or nearly mirror images of each other, are so exactly",
    )
    group.add_argument(
        "--evaluated", action="store_true", help="the source as its modifiers and the mix of its shape keys show it"
    )


def add_texture_options(group: argparse._ArgumentGroup) -> None:
    """Add the choices of `textures.settings.TextureSettings`."""
    group.add_argument(
        "--texture-size", type=int, metavar="N", help="side in texels; default: as many texels as the source has there"
    )
    group.add_argument(
        "--texture-layout",
        choices=("auto", "own", "carried", "disc"),
        help="the target's own UV map, the source's carried, or the conformal disc; default: the first there is",
    )
    group.add_argument("--texture-margin", type=int, metavar="N", help="texels around islands; default: size / 256")
    group.add_argument(
        "--texture-result",
        choices=("pictures", "attributes"),
        help="pictures in a new material (default), or color attributes of what the pictures show",
    )
    group.add_argument(
        "--texture-mask", action="store_true", help="a further picture: white where there is no certain counterpart"
    )
    group.add_argument(
        "--texture-map",
        metavar="MAP.exr",
        type=Path,
        help="write where each texel lies on the source: u, v, number of the material, confidence",
    )
    group.add_argument(
        "--use-texture-map",
        metavar="MAP.exr",
        type=Path,
        help="carry the source's pictures through this map, which was made for this target, and align nothing",
    )
    group.add_argument(
        "--pack-textures", action="store_true", help="into the .blend, instead of into a folder OUT_textures beside it"
    )


def transfer_settings(options: argparse.Namespace) -> TransferSettings:
    """Return the choices of a transfer with the given options in place of the defaults."""
    from ..attributes import Mask, TransferSettings, split_names
    from ..files import Unreadable
    from ..textures.settings import TextureSettings

    given = {"kinds": tuple(_kinds(options.only)), "evaluated": options.evaluated, "normalize": options.normalize}
    given |= {"deform_only": options.deform_only, "rig": options.rig}
    given |= {"halves": options.halves, "symmetric": options.symmetric}
    if options.names is not None:
        given |= {"layers": "named", "names": split_names(options.names)}
    elif options.active:
        given["layers"] = "active"
    for name in (
        "collisions",
        "mix",
        "mix_factor",
        "limit",
        "smallest_weight",
        "unmatched",
        "keys_by",
        "contacts",
        "spelling",
    ):
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
        names = ("size", "layout", "margin", "result", "mask")
        chosen = {name: getattr(options, f"texture_{name}") for name in names}
        given["textures"] = TextureSettings(**{name: x for name, x in chosen.items() if x is not None})
        return TransferSettings(**given)
    except ValueError as error:
        raise Unreadable(str(error)) from error


def _kinds(only: str | None) -> list[str]:
    """Return the kinds of data that --only names; all of them without it."""
    from ..attributes import KINDS
    from ..files import Unreadable

    known = [kind.identifier for kind in KINDS]
    if only is None:
        return [kind.identifier for kind in KINDS if kind.standard]
    wanted = [name.strip() for name in only.split(",") if name.strip()]
    if unknown := [name for name in wanted if name not in known]:
        raise Unreadable(f"--only does not know '{unknown[0]}': it takes {', '.join(known)}")
    if not wanted:
        raise Unreadable(f"--only names nothing: it takes {', '.join(known)}")
    return wanted
