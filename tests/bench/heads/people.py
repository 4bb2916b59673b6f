"""The heads of MOBIUS_DATA as arrays: polygons, parts, UVs, shape keys and vertex groups."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from solver import TriangleMesh


@dataclass(frozen=True, eq=False)
class Head:
    """A head in polygons.

    Attributes
    ----------
    name : str
    template : str
        Heads of one template have the same polygons: vertex i is vertex i.
    vertices : (n, 3) float64
    sides : (p,) int
        Corners of each polygon.
    corner : (c,) int
        The vertex of each corner.
    uv : (c, 2) float64
    keys : dict of str to (n, 3) float64
        Displacements.
    groups : dict of str to (n,) float64
    """

    name: str
    template: str
    vertices: np.ndarray
    sides: np.ndarray
    corner: np.ndarray
    uv: np.ndarray
    keys: dict[str, np.ndarray]
    groups: dict[str, np.ndarray]

    @cached_property
    def first(self) -> np.ndarray:
        """The first corner of each polygon, (p,)."""
        return np.cumsum(self.sides) - self.sides

    @cached_property
    def polygon_of_corner(self) -> np.ndarray:
        """(c,)."""
        return np.repeat(np.arange(len(self.sides)), self.sides)

    @cached_property
    def triangle_corners(self) -> np.ndarray:
        """The corners of the triangles of a fan in each polygon, (m, 3)."""
        place = np.arange(len(self.corner)) - self.first[self.polygon_of_corner]
        last = np.flatnonzero(place >= 2)
        return np.stack([self.first[self.polygon_of_corner[last]], last - 1, last], axis=1)

    @cached_property
    def mesh(self) -> TriangleMesh:
        """In triangles."""
        return TriangleMesh(self.vertices, self.corner[self.triangle_corners], self.name)

    @cached_property
    def part(self) -> np.ndarray:
        """The part that each vertex hangs together with, (n,): 0 is the one of most vertices."""
        following = np.arange(1, len(self.corner) + 1)
        following[np.cumsum(self.sides) - 1] = self.first
        size = len(self.vertices)
        links = (self.corner, self.corner[following])
        label = connected_components(coo_array((np.ones(len(self.corner)), links), shape=(size, size)))[1]
        order = np.argsort(-np.bincount(label), kind="stable")
        return np.argsort(order)[label]

    @property
    def part_of_polygon(self) -> np.ndarray:
        """(p,)."""
        return self.part[self.corner[self.first]]

    @property
    def part_of_triangle(self) -> np.ndarray:
        """(m,)."""
        return self.part[self.mesh.faces[:, 0]]


def read_head(folder: Path, name: str) -> Head:
    """Read one of the heads in a folder."""
    with np.load(folder / f"{name}.npz", allow_pickle=False) as file:
        stored = {key: file[key] for key in file.files}
    size = len(stored["vertices"])

    def sparse(kind: str, values: str, width: int) -> dict[str, np.ndarray]:
        found = {}
        for k, own in enumerate(stored.get(f"{kind}_names", ())):
            rows = slice(*stored[f"{kind}_start"][k : k + 2].astype(int))
            dense = np.zeros((size, width))
            dense[stored[f"{kind}_vertex"][rows].astype(int)] = stored[f"{kind}_{values}"][rows].reshape(-1, width)
            found[str(own)] = dense
        return found

    return Head(
        name,
        str(stored["template"]),
        stored["vertices"].astype(float),
        stored["sides"].astype(int),
        stored["corner"].astype(int),
        stored["uv"].astype(float),
        sparse("key", "offset", 3),
        {own: weights[:, 0] for own, weights in sparse("group", "weight", 1).items()},
    )
