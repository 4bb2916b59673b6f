"""The ways to carry displacements that are compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver import Correspondence, TriangleMesh
from solver.carry.contacts import brought_together
from solver.carry.frames import local_similarities
from solver.carry.gradients import GradientTransfer
from solver.surface.barycentric import interpolated
from solver.surface.nearest import SurfacePoints
from solver.surface.superimposing import superimposing
from tests.bench.heads.people import Head
from tests.bench.heads.targets import Target

Way = Callable[[np.ndarray], np.ndarray]
"""Displacements of the target's vertices, (n, 3), for those of the source's, (n_source, 3)."""


@dataclass(frozen=True, eq=False)
class Carried:
    """One displacement as our ways carry it, before and after what meets is brought together.

    Attributes
    ----------
    frames, gradients, contacts : (n, 3) float64
    """

    frames: np.ndarray
    gradients: np.ndarray
    contacts: np.ndarray


def by_map(found: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Callable[[np.ndarray], Carried]:
    """Return what carries displacements through a map in each of our ways."""
    transfer = GradientTransfer.of(found, source, target)
    rotation, scale = local_similarities(found, source, target)

    def carry(displacements: np.ndarray) -> Carried:
        moved = transfer.moved_places(displacements)
        frames = np.einsum("nij,nj->ni", rotation, moved) * scale[:, None]
        gradients = transfer(displacements)
        return Carried(frames, gradients, brought_together(transfer, gradients, moved))

    return carry


def true_map(head: Head, target: Target) -> Correspondence:
    """Return the map that the target, of the same template, should have."""
    on = np.ones(len(target.part), bool)
    return Correspondence(
        target.face,
        target.barycentric,
        on,
        on.astype(float),
        head.mesh.faces,
        len(head.vertices),
        target.part,
        head.part,
        np.full(len(on), -1),
    )


def nearest_point(head: Head, target: Target, places: np.ndarray, known: np.ndarray) -> Way:
    """Return how Blender's tools do it: by nearest points, in the best pose there is.

    Parameters
    ----------
    head : Head
    target : Target
    places : (k, 3) float64
        Where the target's vertices belong on the source: the pose is fitted to these.
    known : (n,) bool
        Which vertices these are.
    """
    pose = superimposing(target.mesh.vertices[known], places, scaled=True)
    there = pose(target.mesh.vertices)
    normals = TriangleMesh(there, target.mesh.faces).vertex_normals()
    face, barycentric = SurfacePoints(head.mesh, (), 0.0).nearest_point(there, normals)
    back = pose.turn.T / pose.scale

    def carry(displacements: np.ndarray) -> np.ndarray:
        return interpolated(displacements, head.mesh.faces[face], barycentric) @ back

    return carry
