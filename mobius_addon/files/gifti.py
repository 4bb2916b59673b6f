"""Surfaces of brains in .gii files (GIFTI), by nibabel, which the command line's environment has.

What a file says of its surface, which half of the brain it is and in which space, is kept with the mesh and written.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...solver.surface.mesh import Floats, Integers
from ..mesh_data import foreach, in_world, is_mirrored
from .polygons import Polygons, put_into_scene
from .unreadable import Unreadable

PROPERTY = "_gifti"
"""Custom property of a mesh that came out of such a file: what that says of it, as JSON."""

STRUCTURE = "AnatomicalStructurePrimary"
"""Which half of the brain: Connectome Workbench refuses files that do not say it of the surface that they belong to."""


def nibabel_gifti(path: str | Path, what: str = "read") -> Any:
    """Return nibabel's module for such files; raises `Unreadable` where it is not installed."""
    try:
        from nibabel import gifti
    except ImportError as error:
        raise Unreadable(
            f"'{path}' is {what} by the Python package 'nibabel', which is not installed here: "
            "run 'uv run python .' from the sources, or use .ply or .vtk instead"
        ) from error
    return gifti


def read(path: str) -> None:
    """Put the surface of a GIFTI file into the scene, in its own coordinates.

    Raises
    ------
    Unreadable
        nibabel is not there, or the file holds no surface.
    """
    image = nibabel_gifti(path).GiftiImage.from_filename(path)
    points = image.get_arrays_from_intent("NIFTI_INTENT_POINTSET")
    triangles = image.get_arrays_from_intent("NIFTI_INTENT_TRIANGLE")
    if not points or not triangles:
        raise Unreadable(f"'{path}' holds no surface, but values on one: name the .surf.gii that they belong to")
    vertices, faces = np.asarray(points[0].data), np.asarray(triangles[0].data)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise Unreadable(f"'{path}' is damaged: its points or triangles are not three numbers each")
    corners = faces.astype(np.intp).ravel()
    mesh = put_into_scene(Polygons(vertices.astype(np.float64), corners, np.full(len(faces), 3)), Path(path))
    space = points[0].coordsys
    said: dict[str, Any] = {
        "file": dict(image.meta),
        "points": dict(points[0].meta),
        "triangles": dict(triangles[0].meta),
    }
    if space is not None:
        said["space"] = [space.dataspace, space.xformspace, np.asarray(space.xform, float).tolist()]
    mesh[PROPERTY] = json.dumps(said)


def write(path: str) -> None:
    """Write the triangles of the active object, as it stands in the world; raises `Unreadable` without nibabel."""
    gifti = nibabel_gifti(path, "written")
    obj = bpy.context.view_layer.objects.active
    vertices, faces = _triangles(obj)
    said = said_of(obj.data)
    about = {name: gifti.GiftiMetaData(said.get(name, {})) for name in ("file", "points", "triangles")}
    space = gifti.GiftiCoordSystem(*said["space"]) if "space" in said else gifti.GiftiCoordSystem()
    points = gifti.GiftiDataArray(vertices.astype(np.float32), "pointset", coordsys=space, meta=about["points"])
    triangles = gifti.GiftiDataArray(faces.astype(np.int32), "triangle", meta=about["triangles"])
    gifti.GiftiImage(meta=about["file"], darrays=[points, triangles]).to_filename(path)


def said_of(mesh: bpy.types.Mesh) -> dict[str, Any]:
    """Return what the file that a mesh came from says of it; nothing if it came from another kind."""
    return json.loads(mesh.get(PROPERTY, "{}"))


def structure_of(mesh: bpy.types.Mesh) -> str | None:
    """Return which half of the brain a mesh is, if its file says it."""
    said = said_of(mesh)
    return said.get("points", {}).get(STRUCTURE) or said.get("file", {}).get(STRUCTURE)


def is_sphere(mesh: bpy.types.Mesh) -> None:
    """Say of a mesh that came out of such a file that it lies on a sphere now."""
    if PROPERTY in mesh:
        said = said_of(mesh)
        mesh[PROPERTY] = json.dumps(said | {"points": said.get("points", {}) | {"GeometricType": "Spherical"}})


def lies_where(mesh: bpy.types.Mesh, other: bpy.types.Mesh) -> None:
    """Say of a mesh what is said of another one, in whose shape and place it is."""
    mesh.pop(PROPERTY, None)
    if PROPERTY in other:
        mesh[PROPERTY] = other[PROPERTY]


def _triangles(obj: bpy.types.Object) -> tuple[Floats, Integers]:
    """Return an object's vertices, (n, 3), in the world, and its triangles, (m, 3), counter-clockwise from outside."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    faces = foreach(mesh.loop_triangles, "vertices", 3, np.int32).astype(np.intp)
    if is_mirrored(obj):
        faces = faces[:, ::-1]
    return in_world(obj), faces
