"""`transfer --data`: values on a brain's surface in files of their own, carried into files of the same names."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ...solver import Correspondence
    from ..attributes import Transfer, TransferSettings
    from ..attributes.carrier import Carrier
    from ..attributes.unmatched import Unmatched
    from ..files import Imported, Outputs
    from ..mesh_data import Surface


def add_data_option(group: argparse._ArgumentGroup) -> None:
    """Add which files of values are carried."""
    group.add_argument(
        "--data",
        metavar="FILE.gii",
        type=Path,
        nargs="+",
        default=[],
        help="carry the values on the source in these files too (.shape.gii, .func.gii, .label.gii) into files of the "
        "same names in the folder OUT_data",
    )


def data_outputs(options: argparse.Namespace) -> list[Path]:
    """Return where the values go, one for each file.

    Raises
    ------
    Unreadable
        nibabel is not there, two files have the same name, or the folder's name is taken.
    """
    from ..files import Unreadable
    from ..files.gifti import nibabel_gifti

    if not options.data:
        return []
    nibabel_gifti(options.data[0])
    stem = options.output.stem.removesuffix(".surf")
    folder = options.output.with_name(f"{stem}_data")
    if folder.exists() and not folder.is_dir():
        raise Unreadable(f"'{folder}', the folder for --data, is a file: name another OUT")
    names = [path.name for path in options.data]
    if twin := next((name for name in names if names.count(name) > 1), None):
        raise Unreadable(f"two files of --data are called '{twin}', and so would two in '{folder}'")
    return [folder / name for name in names]


def read_data(options: argparse.Namespace, source: Surface) -> list[Any]:
    """Return the values of all files; raises `Unreadable`."""
    from ..files.gifti_values import read_values

    return [read_values(path, len(source.mesh.vertices), options.source) for path in options.data]


def carrier_of_data(
    source: Imported, surfaces: tuple[Surface, Surface], correspondence: Correspondence, settings: TransferSettings
) -> tuple[Carrier, Unmatched]:
    """Return who carries values on the source's vertices, and what becomes of vertices without a counterpart."""
    from ..attributes.masks import mask_weights
    from ..attributes.unmatched import carrier_between

    gives = mask_weights(source.obj, settings.source_mask)
    return carrier_between(correspondence, *surfaces, settings.unmatched, gives)


def plan_of_data(unmatched: Unmatched) -> Transfer:
    """Return the transfer of nothing but values in files."""
    from ..attributes import Transfer

    return Transfer((), None, None, None, (), unmatched)


def write_data(
    images: list[Any], carrier: Carrier, options: argparse.Namespace, target: Imported, written: Outputs
) -> None:
    """Carry the values and write them."""
    from ..files.gifti import structure_of
    from ..files.gifti_values import write_values

    structure = structure_of(target.obj.data)
    for image, final in zip(images, data_outputs(options), strict=True):
        write_values(image, carrier, structure, written.path(final))
