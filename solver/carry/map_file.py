"""Correspondences on disk: one .npz of plain arrays."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..align.alignment import Alignment
from .correspond import Correspondence


def save_map(path: Path | str, alignment: Alignment, correspondence: Correspondence) -> None:
    """Write a correspondence and the discs and transformation it came from.

    Arrays: face (n_target,) int, barycentric (n_target, 3), matched (n_target,) bool, confidence (n_target,),
    source_triangles (m, 3) int, source_size, source_disc and target_disc complex, z complex, theta, reflected.
    """
    source_disc, target_disc = (
        flattening.disc if tidy is None else tidy.at_vertices(flattening.disc, np.nan)
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
            source_disc=source_disc,
            target_disc=target_disc,
            z=alignment.mobius.z,
            theta=alignment.mobius.theta,
            reflected=alignment.mobius.reflected,
        )


def load_map(path: Path | str) -> Correspondence:
    """Read the correspondence of a file that `save_map` wrote.

    Raises
    ------
    OSError
        The file cannot be read.
    ValueError
        It is not such a file, or its arrays do not fit each other.
    """
    try:
        with np.load(Path(path), allow_pickle=False) as stored:
            found = Correspondence(
                face=stored["face"].astype(np.intp),
                barycentric=stored["barycentric"].astype(np.float64),
                matched=stored["matched"].astype(bool),
                confidence=stored["confidence"].astype(np.float64),
                source_triangles=stored["source_triangles"].astype(np.intp),
                source_size=int(stored["source_size"]),
            )
    except (KeyError, ValueError, EOFError) as error:
        raise ValueError(f"'{path}' is not a map that this program wrote") from error
    n, m = len(found.face), len(found.source_triangles)
    fits = (
        found.barycentric.shape == (n, 3)
        and found.matched.shape == found.confidence.shape == (n,)
        and found.source_triangles.shape == (m, 3)
        and (n == 0 or (found.face.min() >= -1 and found.face.max() < m))
        and (m == 0 or (found.source_triangles.min() >= 0 and found.source_triangles.max() < found.source_size))
    )
    if not fits:
        raise ValueError(f"'{path}' is damaged: its arrays do not fit each other")
    return found
