"""How far a correspondence is from the ground truth, measured on the target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...solver import Correspondence
from ...solver.surface.barycentric import weighted
from ...solver.surface.mesh import Floats
from ...solver.surface.superimposing import superimposing
from ..mesh_data import Surface
from .scans import POSE, GroundTruth, deform


@dataclass(frozen=True)
class Spread:
    """Errors over the target's vertices, in percent of the target's bounding box diagonal.

    Attributes
    ----------
    mean, median, most : float
        `most` is what 95 % of the vertices stay below.
    """

    mean: float
    median: float
    most: float

    @staticmethod
    def of(distances: Floats, target: Surface) -> Spread:
        """Summarise distances, (n,), in the target's length unit."""
        percent = 100 * distances / target.mesh.diagonal
        return Spread(float(percent.mean()), float(np.median(percent)), float(np.percentile(percent, 95)))

    def describe(self) -> str:
        """Return the three figures in words."""
        return f"mean {self.mean:.2f} %, median {self.median:.2f} %, 95 % of the vertices below {self.most:.2f} %"

    def figures(self) -> dict[str, float]:
        """Return the three figures as JSON-ready data."""
        return {"mean": self.mean, "median": self.median, "percentile_95": self.most}


def transfer_error(correspondence: Correspondence, source: Surface, target: Surface) -> Spread:
    """Measure how far from each target vertex the point lies that its counterpart really belongs to.

    The counterpart on the source is put through the very deformation and pose that made the target. Vertices without a
    counterpart do not count.
    """
    found = correspondence.face >= 0
    corners = source.mesh.vertices[correspondence.source_triangles[correspondence.face[found]]]
    counterparts = weighted(corners, correspondence.barycentric[found])
    landed = POSE(deform(counterparts))
    return Spread.of(np.linalg.norm(landed - target.mesh.vertices[found], axis=1), target)


def best_rigid_error(truth: GroundTruth, source: Surface, target: Surface) -> Spread:
    """Measure what the best rotation, scale and translation leaves, fitted to the true correspondence."""
    from_points, to_points = truth.positions(source.mesh.vertices), target.mesh.vertices
    pose = superimposing(from_points, to_points, scaled=True)
    return Spread.of(np.linalg.norm(pose(from_points) - to_points, axis=1), target)
