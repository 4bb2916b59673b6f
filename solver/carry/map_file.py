"""Correspondences on disk: one .npz of plain arrays, checked when it is read."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..align.result.alignment import Alignment
from ..surface.mesh import TriangleMesh
from .correspond import Correspondence

_FIELDS = {
    "face": ("iu", ("n",)),
    "barycentric": ("f", ("n", 3)),
    "matched": ("b", ("n",)),
    "confidence": ("f", ("n",)),
    "source_triangles": ("iu", ("m", 3)),
    "source_size": ("iu", ()),
}
"""Kinds of numpy types and the shape of each array that is read; equal letters stand for equal lengths."""

_OF_PARTS = {"part": ("i", ("n",)), "source_part": ("i", ("k",)), "leader": ("i", ("n",))}
"""The same of what meshes of several parts have; all or none."""

_HEADER = 512
"""Bytes that hold the header of any of these arrays."""

_MOST_BYTES = 4 << 30
"""What no array of a map exceeds unpacked, whatever it says of itself."""


def save_map(
    path: Path | str,
    alignment: Alignment,
    correspondence: Correspondence,
    source: TriangleMesh | None = None,
    target: TriangleMesh | None = None,
) -> None:
    """Write a correspondence and the discs and transformation it came from.

    Arrays: face (n_target,) int, barycentric (n_target, 3), matched (n_target,) bool, confidence (n_target,),
    source_triangles (m, 3) int, source_size, source_fingerprint and target_fingerprint (text), source_disc and
    target_disc complex, z complex, theta, reflected; of closed surfaces the discs are spheres, (n, 3), and in place of
    z and theta there are h, (3,), and rotation, (4,), a quaternion; of meshes with several parts also part (n_target,),
    source_part (n_source,) and leader (n_target,) int, as of `Correspondence`. The discs are of the main parts.

    Parameters
    ----------
    path : Path or str
    alignment, correspondence : Alignment, Correspondence
    source, target : TriangleMesh, optional
        The meshes that the correspondence counts, which `load_map` is to know again; those aligned by default.
    """
    meshes = source or alignment.source.mesh, target or alignment.target.mesh
    source_disc, target_disc = (
        flattening.places if tidy is None else tidy.at_vertices(flattening.places, np.nan)
        for flattening, tidy in (
            (alignment.source, alignment.source_cleaned),
            (alignment.target, alignment.target_cleaned),
        )
    )
    with Path(path).open("wb") as file:
        np.savez_compressed(
            file,
            face=correspondence.face,
            barycentric=correspondence.barycentric,
            matched=correspondence.matched,
            confidence=correspondence.confidence,
            source_triangles=correspondence.source_triangles,
            source_size=correspondence.source_size,
            source_fingerprint=meshes[0].fingerprint,
            target_fingerprint=meshes[1].fingerprint,
            source_disc=source_disc,
            target_disc=target_disc,
            **vars(alignment.mobius),
            **{name: found for name in _OF_PARTS if (found := getattr(correspondence, name)) is not None},
        )


def load_map(
    path: Path | str, source: TriangleMesh | None = None, target: TriangleMesh | None = None
) -> Correspondence:
    """Read the correspondence of a file that `save_map` wrote.

    Parameters
    ----------
    path : Path or str
    source, target : TriangleMesh, optional
        Meshes whose positions and faces must be those that the map was made for.

    Raises
    ------
    OSError
        The file cannot be read.
    ValueError
        It is not such a file, it is damaged, it was made for other meshes, or, where meshes are given, it does not say
        for which it was made, as files of earlier versions.
    """
    with Path(path).open("rb") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                fields = _FIELDS | (_OF_PARTS if "part.npy" in archive.namelist() else {})
                _require_fitting(archive, fields, path, source, target)
                arrays = {name: _read(archive, name) for name in fields}
        except _UnfitError:
            raise
        except Exception as error:  # damage makes the decoders raise a dozen kinds
            raise ValueError(f"'{path}' is not a map that this program wrote, or it is damaged") from error
    if reason := _damage(arrays):
        raise ValueError(f"'{path}' is damaged: {reason}")
    return Correspondence(
        face=arrays["face"].astype(np.intp),
        barycentric=arrays["barycentric"].astype(np.float64),
        matched=arrays["matched"],
        confidence=arrays["confidence"].astype(np.float64),
        source_triangles=arrays["source_triangles"].astype(np.intp),
        source_size=int(arrays["source_size"]),
        **{name: arrays[name].astype(np.intp) for name in _OF_PARTS if name in arrays},
    )


class _UnfitError(ValueError):
    """The file is a map and cannot be taken; the text is a sentence."""


def _require_fitting(
    archive: zipfile.ZipFile,
    fields: dict[str, tuple[str, tuple[Any, ...]]],
    path: Path | str,
    source: TriangleMesh | None,
    target: TriangleMesh | None,
) -> None:
    """Refuse a map of wrong types or shapes, of any size that is not its own, or of other meshes; unpack nothing yet.

    Raises
    ------
    _UnfitError
    """
    lengths: dict[str, int] = {}
    for name, (kinds, shape) in fields.items():
        found, dtype, size = _header(archive, name)
        if dtype.kind not in kinds or len(found) != len(shape):
            raise _UnfitError(f"'{path}' is damaged: '{name}' is an array of {dtype} and shape {found}")
        for length, wanted in zip(found, shape, strict=True):
            if length != (lengths.setdefault(wanted, length) if isinstance(wanted, str) else wanted):
                raise _UnfitError(f"'{path}' is damaged: its arrays do not fit each other")
        if size > _MOST_BYTES or archive.getinfo(f"{name}.npy").file_size > size + _HEADER:
            raise _UnfitError(f"'{path}' is damaged: '{name}' unpacks to more than a map holds")
    for role, mesh, length in (("source", source, "m"), ("target", target, "n")):
        if mesh is None:
            continue
        if f"{role}_fingerprint.npy" not in archive.namelist():
            raise _UnfitError(
                f"'{path}' does not say which meshes it was made for, as those of earlier versions: align them again"
            )
        what, count = ("faces", len(mesh.faces)) if role == "source" else ("vertices", len(mesh.vertices))
        if lengths[length] != count:
            raise _UnfitError(
                f"'{path}' was made for a {role} of {lengths[length]:,} {what}, but '{mesh.name}' has {count:,}"
            )
        if _fingerprint(archive, role) != mesh.fingerprint:
            raise _UnfitError(
                f"'{path}' was made for another {role} than '{mesh.name}', or for this one before its vertices or "
                "faces were moved or put in another order: align again"
            )


def _header(archive: zipfile.ZipFile, name: str) -> tuple[tuple[int, ...], np.dtype[Any], int]:
    """Return shape, type and number of bytes that an array says it has."""
    with archive.open(f"{name}.npy") as member:
        file = io.BytesIO(member.read(_HEADER))
    read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    shape, _, dtype = read[np.lib.format.read_magic(file)](file)
    size = dtype.itemsize
    for length in shape:  # of Python's numbers, which do not overflow
        size *= length
    return shape, dtype, size


def _read(archive: zipfile.ZipFile, name: str) -> npt.NDArray[Any]:
    """Return an array whose member is read to its end, so that its check sum counts."""
    return np.lib.format.read_array(io.BytesIO(archive.read(f"{name}.npy")), allow_pickle=False)


def _fingerprint(archive: zipfile.ZipFile, role: str) -> str:
    if _header(archive, f"{role}_fingerprint")[2] > _HEADER:
        raise ValueError("no fingerprint is so long")
    return str(_read(archive, f"{role}_fingerprint"))


def _damage(arrays: dict[str, npt.NDArray[Any]]) -> str | None:
    """Return what is wrong with the numbers of a map, None if nothing is."""
    face, barycentric, confidence = (arrays[name] for name in ("face", "barycentric", "confidence"))
    triangles, size = arrays["source_triangles"], int(arrays["source_size"])
    if not len(face) or not len(triangles):
        return "it has no vertices or no triangles"
    if face.min() < -1 or face.max() >= len(triangles):
        return "a vertex lies in a triangle that is not there"
    if triangles.min() < 0 or triangles.max() >= size:
        return "a triangle has a vertex that is not there"
    located = face >= 0
    sums = barycentric[located].sum(axis=1)
    if not ((barycentric >= -1e-9).all() and (barycentric <= 1 + 1e-6).all()):  # also where they are no numbers
        return "barycentric coordinates outside 0 to 1"
    if (np.abs(sums - 1) > 1e-6).any() or barycentric[~located].any():
        return "barycentric coordinates whose sum is not 1"
    if not ((confidence >= 0) & (confidence <= 1)).all():
        return "a confidence outside 0 to 1"
    if (arrays["matched"] & ~located).any():
        return "a vertex is matched with no point"
    if "part" in arrays:
        if len(arrays["source_part"]) != size:
            return "its parts are of another source"
        if any(arrays[name].min(initial=0) < -1 for name in _OF_PARTS) or arrays["leader"].max() >= len(face):
            return "a vertex is in a part, or rides with a vertex, that is not there"
    return None
