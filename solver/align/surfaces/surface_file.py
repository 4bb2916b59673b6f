"""Prepared surfaces on disk: one .npz of plain arrays, checked when it is read."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

import numpy as np

from ...flatten.flatten import Flattening
from ...flatten.sphere import Flat, SphereFlattening
from ...surface.mesh import MeshError, TriangleMesh
from ...surface.tidy import Piece
from .prepared import Surface

_KIND = "mobius surface 1"
"""What the file is, and of which version: another layout gets another number."""


def save_surface(path: Path | str, surface: Surface) -> None:
    """Write a surface with all that has been computed of it, and its flattening in any case.

    Arrays: kind and fingerprint, text; name, text; vertices (n, 3), faces (m, 3) as they came, keys (n, d), within
    (n,) or (k, 2); fill_holes, largest_part, outer_vertex (-1: none); computed (q, 3), the vertices as they are
    computed with; disc (q,) complex; boundary, holes one after another and hole_sizes; flips_repaired, rim_lost;
    descriptors (q, d); and source_COUNT and target_COUNT, the points chosen for each count. What is put in order is put
    in order again when the file is read.
    """
    flat = surface.flattening
    chosen = {f"{role}_{count}": points for role, counts in surface.points.items() for count, points in counts.items()}
    with Path(path).open("wb") as file:
        np.savez_compressed(
            file,
            kind=_KIND,
            fingerprint=surface.original.fingerprint,
            name=surface.original.name,
            vertices=surface.original.vertices,
            faces=surface.original.faces,
            **({} if surface.keys is None else {"keys": surface.keys}),
            **({} if surface.within is None else {"within": surface.within}),
            fill_holes=surface.fill_holes,
            largest_part=surface.largest_part,
            outer_vertex=-1 if surface.outer_vertex is None else surface.outer_vertex,
            computed=flat.mesh.vertices,
            disc=flat.places,
            boundary=flat.boundary,
            holes=np.concatenate([np.empty(0, np.intp), *flat.holes]),
            hole_sizes=np.array([len(loop) for loop in flat.holes], np.intp),
            flips_repaired=flat.flips_repaired,
            rim_lost=flat.rim_lost,
            **({} if surface.measured is None else {"descriptors": surface.measured}),
            **chosen,
        )


def load_surface(path: Path | str) -> Surface:
    """Read a surface that `save_surface` wrote.

    Raises
    ------
    OSError
        The file cannot be read.
    ValueError
        It is not such a file, is damaged, or its arrays do not fit each other.
    """
    try:
        with np.load(Path(path), allow_pickle=False) as file:
            stored = {name: file[name] for name in file.files}
        if str(stored["kind"]) != _KIND:
            raise ValueError(f"of another kind: {stored['kind']}")
        return _checked(stored)
    except (KeyError, ValueError, TypeError, IndexError, EOFError, zipfile.BadZipFile, zlib.error, MeshError) as error:
        raise ValueError(f"'{path}' is no prepared surface of this version, or is damaged ({error})") from error


def _checked(stored: dict[str, np.ndarray]) -> Surface:
    """Return the surface of a file's arrays; raises one of several errors where they do not fit."""
    original = TriangleMesh(stored["vertices"], stored["faces"], str(stored["name"]))
    _require(original.fingerprint == str(stored["fingerprint"]), "the mesh is not the one that was prepared")
    keys = stored["keys"].astype(np.float64, casting="safe") if "keys" in stored else None
    _require(keys is None or (keys.ndim == 2 and len(keys) == len(original.vertices)), "keys")
    within = _piece(stored["within"], len(original.vertices)) if "within" in stored else None
    outer = int(stored["outer_vertex"])
    surface = Surface(
        original,
        fill_holes=bool(stored["fill_holes"]),
        outer_vertex=None if outer < 0 else outer,
        largest_part=bool(stored["largest_part"]),
        keys=keys,
        within=within,
    )
    mesh = surface.cleaned.mesh
    size, computed = len(mesh.vertices), stored["computed"]
    _require(computed.shape == mesh.vertices.shape, "the vertices as they are computed with")
    exact = None
    if not np.array_equal(computed, mesh.vertices):
        exact = mesh.vertices
        mesh = TriangleMesh(computed, mesh.faces, mesh.name)
    if stored["disc"].ndim == 2:
        sphere = stored["disc"].astype(np.float64, casting="safe")
        _require(sphere.shape == (size, 3) and bool((np.isfinite(sphere).all(axis=1) == mesh.used).all()), "the sphere")
        _require(bool((np.abs(np.linalg.norm(sphere[mesh.used], axis=1) - 1) < 1e-12).all()), "the sphere")
        return _filled(surface, SphereFlattening(mesh, sphere, int(stored["flips_repaired"]), exact), stored)
    disc = stored["disc"].astype(np.complex128, casting="safe")
    _require(disc.shape == (size,) and (np.isfinite(disc) == mesh.used).all(), "the disc")
    _require(bool((np.abs(disc[mesh.used]) <= 1 + 1e-12).all()), "the disc")
    ends = np.cumsum(stored["hole_sizes"].astype(np.intp, casting="safe"))
    holes = _indices(stored["holes"], size)
    _require(len(holes) == (ends[-1] if len(ends) else 0), "openings")
    flat = Flattening(
        mesh,
        disc,
        _indices(stored["boundary"], size),
        tuple(np.split(holes, ends[:-1])) if len(ends) else (),
        int(stored["flips_repaired"]),
        float(stored["rim_lost"]),
        exact,
    )
    return _filled(surface, flat, stored)


def _filled(surface: Surface, flat: Flat, stored: dict[str, np.ndarray]) -> Surface:
    """Return a surface with what a file holds of it beside the mesh."""
    size = len(flat.mesh.vertices)
    surface.known(flat)
    if "descriptors" in stored:
        surface.measured = stored["descriptors"].astype(np.float64, casting="safe")
        _require(len(surface.measured) == size and surface.measured.ndim == 2, "descriptors")
        _require(bool(np.isfinite(surface.measured).all()), "descriptors")
    for role, counts in surface.points.items():
        for name in stored:
            if name.startswith(f"{role}_") and name.removeprefix(f"{role}_").isdecimal():
                counts[int(name.removeprefix(f"{role}_"))] = _indices(stored[name], size)
    return surface


def _piece(within: np.ndarray, size: int) -> Piece:
    """Return what is used of a mesh of so many vertices, after a look at it."""
    if within.dtype == np.bool_:
        _require(within.shape == (size,), "within")
        return within
    _require(within.ndim == 2 and within.shape[1] == 2, "within")
    return _indices(within.ravel(), size).reshape(-1, 2)


def _indices(values: np.ndarray, size: int) -> np.ndarray:
    """Return whole numbers, (k,), each at least 0 and below `size`."""
    result = values.astype(np.intp, casting="safe")
    _require(result.ndim == 1 and bool(((result >= 0) & (result < size)).all()), "numbers of vertices or faces")
    return result


def _require(fits: bool, what: str) -> None:
    if not fits:
        raise ValueError(f"what does not fit: {what}")
