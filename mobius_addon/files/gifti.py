"""Reading .gii files (surfaces of brains), by nibabel, which the command line's environment has."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .polygons import Polygons, put_into_scene
from .unreadable import Unreadable


def read(path: str) -> None:
    """Put the surface of a GIFTI file into the scene, in its own coordinates.

    Raises
    ------
    Unreadable
        nibabel is not there, or the file holds no surface.
    """
    try:
        from nibabel.gifti.gifti import GiftiImage
    except ImportError as error:
        raise Unreadable(
            f"'{path}' is read by the Python package 'nibabel', which is not installed here: "
            "run 'uv run python .' from the sources, or save the surface as .ply or .vtk first"
        ) from error

    image = GiftiImage.from_filename(path)
    points = image.get_arrays_from_intent("NIFTI_INTENT_POINTSET")
    triangles = image.get_arrays_from_intent("NIFTI_INTENT_TRIANGLE")
    if not points or not triangles:
        raise Unreadable(f"'{path}' holds no surface, but values on one: name the .surf.gii that they belong to")
    vertices, faces = np.asarray(points[0].data), np.asarray(triangles[0].data)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise Unreadable(f"'{path}' is damaged: its points or triangles are not three numbers each")
    corners = faces.astype(np.intp).ravel()
    put_into_scene(Polygons(vertices.astype(np.float64), corners, np.full(len(faces), 3)), Path(path))
