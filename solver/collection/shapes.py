"""All specimens on one topology: the template's vertices, and landmarks, carried to each of them along its path.

What a specimen lacks is completed by the template, deformed smoothly, and told apart from what it has.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..carry.fill import HarmonicFill
from ..surface.barycentric import interpolated
from ..surface.mesh import Booleans, Floats, Integers, Places, TriangleMesh
from ..surface.nearest import SurfacePoints
from ..surface.superimposing import Pose, superimposing
from .chart import Chart, Step, carried_along, mirrored
from .collect import Collection
from .cycles import step
from .procrustes import generalised


@dataclass(frozen=True, eq=False)
class Shapes:
    """Specimens whose vertices correspond.

    Attributes
    ----------
    names : list of str
        The template's comes first.
    faces : (m, 3) int
        The template's, of its mesh in order.
    vertices : (k, n, 3) float64
        Of each, in its own pose and size; of the template those of its mesh.
    known : (k, n) bool
        Which of these have a counterpart; the others are completed (`completed`).
    mirrored : list of bool
        Which are mirror images of the template.
    areas : (n,) float64
        Around the template's vertices: their weights in means and poses.
    certainty : list of float
        Mean confidences of the maps along each path, multiplied.
    """

    names: list[str]
    faces: Integers
    vertices: Floats
    known: Booleans
    mirrored: list[bool]
    areas: Floats
    certainty: list[float]

    @cached_property
    def superimposed(self) -> tuple[Floats, list[Pose]]:
        """The mean shape, (n, 3), as the template lies, and the pose that brings each specimen onto it."""
        return generalised(self.vertices, self.areas, self.mirrored)

    @property
    def missing(self) -> Floats:
        """The share of the template's area, (k,), that each specimen lacks."""
        return ~self.known @ (self.areas / self.areas.sum())

    def mesh(self, number: int) -> TriangleMesh:
        """Return a specimen with the template's triangles, in its own pose, turned round where it is mirrored."""
        faces = self.faces[:, ::-1] if self.mirrored[number] else self.faces
        return TriangleMesh(self.vertices[number], faces, self.names[number])


def path_to(collection: Collection, start: int, end: int) -> list[Step]:
    """Return the maps that lead from one specimen to another, by the root's paths to both.

    Raises
    ------
    KeyError
        No path leads there.
    """
    here, there = collection.routes[start], collection.routes[end]
    common = 0
    while common < min(len(here), len(there)) and here[common] == there[common]:
        common += 1
    walked = [*here[: common - 1 : -1], *there[common - 1 :]] if common else []
    maps = collection.atlas
    return [step(maps, a, b) for a, b in pairwise(walked)]


def shapes(collection: Collection) -> Shapes:
    """Return all specimens that the root's paths reach, on the root's topology."""
    root = collection.root
    template = collection.atlas.chart(root)
    used = np.unique(template.faces)
    faces = np.searchsorted(used, template.faces)
    reached = [root, *(number for number in collection.routes if number != root)]
    vertices = np.empty((len(reached), len(used), 3))
    known = np.ones((len(reached), len(used)), bool)
    vertices[0] = template.vertices[used]
    mesh, areas = TriangleMesh(vertices[0], faces), template.areas[used]
    turned, certainty = [False], [1.0]
    confidence = {edge: one.mean_confidence for edge, one in zip(collection.edges, collection.figures, strict=True)}
    for row, number in enumerate(reached[1:], 1):
        path = path_to(collection, root, number)
        places, known[row] = carried_along(template.places[used], path)
        turned.append(mirrored(path))
        vertices[row] = completed(path[-1].end.positions(places), known[row], mesh, areas, mirrored=turned[-1])
        route = collection.routes[number]
        edges = [(min(a, b), max(a, b)) for a, b in pairwise(route)]
        certainty.append(float(np.prod([confidence[edge] for edge in edges])))
    names = [collection.names[number] for number in reached]
    return Shapes(names, faces, vertices, known, turned, areas, certainty)


def completed(places: Floats, known: Booleans, template: TriangleMesh, areas: Floats, *, mirrored: bool) -> Floats:
    """Return places of the template's vertices on a specimen, (n, 3), with those that are not known filled in.

    By the template in its pose and size, moved by the displacements of what is known, which are continued harmonically.
    """
    if known.all() or not known.any():
        return places
    pose = superimposing(template.vertices[known], places[known], areas[known], mirrored=mirrored, scaled=True)
    there = pose(template.vertices)
    filled = there + HarmonicFill.of(template, known)(np.where(known[:, None], places - there, 0.0))
    return np.where(known[:, None], places, filled)


@dataclass(frozen=True, eq=False)
class Marks:
    """Landmarks on every specimen.

    Attributes
    ----------
    labels : list of str
    names : list of str
        Of the specimens; first the one that they were placed on.
    places : (k, l, 3) float64
    known : (k, l) bool
        Which have a counterpart on the specimen; the others are at the nearest that there is.
    off : (l,) float64
        How far from the surface each was placed, in diagonals of the specimen.
    """

    labels: list[str]
    names: list[str]
    places: Floats
    known: Booleans
    off: Floats


def marks(collection: Collection, start: int, labels: list[str], given: Floats) -> Marks:
    """Carry landmarks, (l, 3), from the specimen that they were placed on to all that can be reached.

    Each stands for the nearest point of the surface.
    """
    chart = collection.atlas.chart(start)
    at, off = on_surface(chart, given)
    reached = [start, *(number for number in collection.routes if number != start)]
    places, known = [chart.positions(at)], [np.ones(len(at), bool)]
    for number in reached[1:]:
        path = path_to(collection, start, number)
        there, has = carried_along(at, path)
        places.append(path[-1].end.positions(there))
        known.append(has)
    names = [collection.names[number] for number in reached]
    return Marks(labels, names, np.stack(places), np.stack(known), off / chart.diagonal)


def on_surface(chart: Chart, points: Floats) -> tuple[Places, Floats]:
    """Return where in the domain the surface is nearest to points, (l,), and how far these are from it, (l,)."""
    mesh = TriangleMesh(chart.vertices, chart.faces)
    surface = SurfacePoints(mesh, (), 0.0)
    face, weights = surface.nearest_point(points, np.zeros_like(points), 16)
    corners = chart.faces[face]
    nearest = interpolated(chart.vertices, corners, weights)
    return chart.domain.mean(chart.places, corners, weights), np.linalg.norm(nearest - points, axis=1)
