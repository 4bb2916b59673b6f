"""A new object from a solver's `Fitted`: the source on the target, or the target with the source's shape as a key."""

from __future__ import annotations

import bpy
import numpy as np

from ..solver import TriangleMesh
from ..solver.carry.fitted import Fitted, frames_of
from ..solver.carry.frames import local_similarities
from ..solver.surface.mesh import Floats
from .attributes import forget_written
from .mesh_data import Surface, foreach, is_mirrored, mirrored
from .results import clear_results


def wrapped_object(
    source: bpy.types.Object, target: bpy.types.Object, surface: Surface, fitted: Fitted
) -> bpy.types.Object:
    """Return a new object beside the target: the source's mesh and all that is on it, in the shape of the target.

    Its shape keys move as the source's do, turned and scaled with the surface around each vertex. `surface` is the
    source's. Neither object is written on.
    """
    obj = _copy(source, target, f"{source.name} on {target.name}")
    mesh = obj.data
    turned = -1 if fitted.reflected else 1
    after = TriangleMesh(fitted.vertices, surface.mesh.faces[:, ::turned])
    rotation, scale = local_similarities(frames_of(surface.mesh), surface.mesh, after)

    def moved(places: Floats) -> Floats:
        """Return places of a shape of the source, in its own space, as they are on the new object."""
        apart = mirrored(source, places) - surface.mesh.vertices
        step = scale[:, None] * np.einsum("nab,nb->na", rotation, apart)
        return mirrored(target, fitted.vertices + step)

    keys = mesh.shape_keys
    mesh.vertices.foreach_set("co", moved(surface_rest(source, surface)).astype(np.float32).ravel())
    if keys is not None:
        for key in keys.key_blocks:
            places = moved(foreach(key.points, "co", 3, np.float32).astype(np.float64))
            key.points.foreach_set("co", places.astype(np.float32).ravel())
    if is_mirrored(source) ^ is_mirrored(target) ^ fitted.reflected:
        mesh.flip_normals()
    mesh.update()
    _shear(obj, target)
    return obj


def reshaped_object(
    source: bpy.types.Object, target: bpy.types.Object, surface: Surface, fitted: Fitted
) -> bpy.types.Object:
    """Return a copy of the target beside it, with the source's shape as a shape key that is turned on.

    `surface` is the target's. Neither object is written on.
    """
    obj = _copy(target, target, f"{target.name} as {source.name}")
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    key = obj.shape_key_add(name=source.name, from_mix=False)
    keys = key.id_data
    rest = foreach(keys.reference_key.points, "co", 3, np.float32)
    step = mirrored(target, fitted.vertices - surface.mesh.vertices)
    key.points.foreach_set("co", (rest + step).astype(np.float32).ravel())
    key.value = 1.0
    obj.active_shape_key_index = len(keys.key_blocks) - 1
    obj.data.update()
    _shear(obj, target)
    return obj


def sphere_object(obj: bpy.types.Object, places: Floats) -> bpy.types.Object:
    """Return a new object with all that is on a mesh, about the origin, its vertices at places on a sphere, (n, 3)."""
    made = _copy(obj, obj, f"{obj.name} on the sphere")
    made.shape_key_clear()
    made.data.vertices.foreach_set("co", places.astype(np.float32).ravel())
    made.matrix_world.identity()
    if is_mirrored(obj):
        made.data.flip_normals()
    made.data.update()
    return made


def surface_rest(source: bpy.types.Object, surface: Surface) -> Floats:
    """Return the vertices at rest, (n, 3), in the object's own space."""
    return mirrored(source, surface.rest.vertices)


def _shear(obj: bpy.types.Object, like: bpy.types.Object) -> None:
    """Give a new object's mesh the shear that another has by its parents' scales, which no object has by itself.

    None by a scale of 0 along an axis: the object has that too, and its mesh would lose what lies along it.
    """
    if np.linalg.matrix_rank(np.array(like.matrix_world, np.float32)[:3, :3]) < 3:
        return
    shear = obj.matrix_basis.inverted_safe() @ like.matrix_world
    if not np.allclose(shear, np.eye(4), atol=1e-5):  # some roundings of float32
        obj.data.transform(shear, shape_keys=True)
        obj.data.update()


def _copy(of: bpy.types.Object, beside: bpy.types.Object, name: str) -> bpy.types.Object:
    """Return a new object with a copy of an object's mesh, at another's place and in its collections.

    Modifiers, constraints and the parent stay behind: they are about the place and the shape that the object has.
    """
    mesh = of.data.copy()
    mesh.name = name
    obj = bpy.data.objects.new(name, mesh)
    for slot, own in zip(of.material_slots, obj.material_slots, strict=True):
        if slot.link == "OBJECT":
            own.link, own.material = "OBJECT", slot.material
    obj.matrix_world = beside.matrix_world
    collections = [x for x in beside.users_collection if x.is_editable] or [bpy.context.scene.collection]
    for collection in collections:
        collection.objects.link(obj)
    clear_results(obj)
    forget_written(mesh)
    return obj
