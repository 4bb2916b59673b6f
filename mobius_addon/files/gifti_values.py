"""Values on surfaces in .gii files beside them: thickness, activity, parcellations.

Connectome Workbench keeps them apart from the surface: numbers as .shape.gii or .func.gii, which are the same kind of
file, and labels as .label.gii.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...solver.surface.mesh import Floats
from ..attributes.carrier import Carrier
from .gifti import STRUCTURE, nibabel_gifti
from .unreadable import Unreadable

_SURFACE = ("NIFTI_INTENT_POINTSET", "NIFTI_INTENT_TRIANGLE")
_LABEL, _SPARSE = "NIFTI_INTENT_LABEL", "NIFTI_INTENT_NODE_INDEX"


def read_values(path: Path, vertices: int, of: str) -> Any:
    """Return the image of a file of values, without the surface that other programs keep in the same file.

    Parameters
    ----------
    path : Path
    vertices : int
        How many the surface has, which is called `of`.

    Raises
    ------
    Unreadable
        nibabel is not there, or the file holds no values, or not as many.
    """
    if path.suffix.lower() != ".gii":
        raise Unreadable(f"'{path}' is no .gii file: values are read from .shape.gii, .func.gii and .label.gii")
    gifti = nibabel_gifti(path)
    if not path.is_file():
        raise Unreadable(f"there is no file '{path}'")
    try:
        image = gifti.GiftiImage.from_filename(str(path))
    except Exception as error:  # whatever its reader meets in a damaged file
        raise Unreadable(f"'{path}' could not be read: {error or type(error).__name__}") from error
    names = {array.intent: _name(array.intent) for array in image.darrays}
    if _SPARSE in names.values():
        raise Unreadable(
            f"'{path}' lists values of some vertices only, by number: write it with a value for each first"
        )
    kept = [array for array in image.darrays if names[array.intent] not in _SURFACE]
    if not kept:
        raise Unreadable(f"'{path}' holds no values")
    for array in kept:
        if array.data is None or np.ndim(array.data) < 1 or len(array.data) != vertices:
            count = 0 if array.data is None or np.ndim(array.data) < 1 else len(array.data)
            raise Unreadable(f"'{path}' has {count:,} values, but '{of}' has {vertices:,} vertices")
    return gifti.GiftiImage(meta=image.meta, labeltable=image.labeltable, darrays=kept)


def write_values(image: Any, carrier: Carrier, structure: str | None, path: Path) -> None:
    """Write values, carried over, to a file of the same kind.

    Labels, and whatever else are whole numbers, come from the nearest vertex, all else is linear between vertices. A
    vertex without a counterpart has no number (nan), and the label 0.

    Parameters
    ----------
    image : GiftiImage
        Of `read_values`.
    carrier : Carrier
    structure : str or None
        Which half of the brain the target is; None: nobody knows, and the file does not say what the source is.
    path : Path
    """
    gifti = nibabel_gifti(path, "written")
    arrays = []
    for array in image.darrays:
        data = np.asarray(array.data)
        whole = _name(array.intent) == _LABEL or np.issubdtype(data.dtype, np.integer)
        values = _nearest(data, carrier) if whole else _between(data, carrier)
        arrays.append(
            gifti.GiftiDataArray(
                values,
                array.intent,
                datatype=array.datatype,
                meta=_meta(gifti, array.meta, None if STRUCTURE not in array.meta else structure),
            )
        )
    meta = _meta(gifti, image.meta, structure)
    gifti.GiftiImage(meta=meta, labeltable=image.labeltable, darrays=arrays).to_filename(str(path))


def _nearest(values: np.ndarray, carrier: Carrier) -> np.ndarray:
    carried, covered = carrier.nearest_points(values)
    carried[~covered] = 0
    return carried


def _between(values: np.ndarray, carrier: Carrier) -> np.ndarray:
    """Return numbers carried linearly; a place most of which has none gets none."""
    number = np.isfinite(values)
    weight: Floats = carrier.points(number)[0]
    carried, covered = carrier.points(np.where(number, values, 0))
    enough = weight > 0.5 - 1e-9
    result = np.divide(carried, weight, out=np.full(carried.shape, np.nan), where=enough)
    result[~covered] = np.nan
    return result.astype(values.dtype)


def _name(intent: int | str) -> str:
    from nibabel.nifti1 import intent_codes

    return str(intent_codes.niistring[intent])


def _meta(gifti: Any, meta: Any, structure: str | None) -> Any:
    """Return what a file says of itself, with another half of the brain."""
    said = {key: value for key, value in dict(meta).items() if key != STRUCTURE}
    return gifti.GiftiMetaData(said if structure is None else said | {STRUCTURE: structure})
