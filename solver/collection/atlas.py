"""The charts of many specimens and the maps between them, read when they are asked for, a few at a time in memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np

from ..align.surfaces.surface_file import load_surface
from ..carry.fill import nearest_known
from ..surface.mesh import TriangleMesh
from .chart import Carried, Chart, ChartMap
from .cycles import Edge
from .folder import Folder
from .pair import Figures

KEPT = 64
"""Charts, and dense maps, that are kept in memory: a chart of 10,000 triangles is 2.5 MB (`tests/bench/growth.py`)."""


class Atlas(Mapping[Edge, ChartMap]):
    """By the numbers of source and target, the maps of a collection.

    Parameters
    ----------
    folder : Folder
    names : sequence of str
        Of the specimens, in the order of their numbers.
    figures : mapping of (int, int) to Figures
        Of the pairs that were aligned.
    samples : int
        Points that stand for a specimen.
    """

    def __init__(self, folder: Folder, names: Sequence[str], figures: Mapping[Edge, Figures], samples: int) -> None:
        self.folder, self.names, self.figures, self.samples = folder, names, figures, samples
        self.chart = lru_cache(KEPT)(self._chart)
        self._map = lru_cache(KEPT)(self._read)

    def __getitem__(self, edge: Edge) -> ChartMap:
        """Return the map of a pair."""
        return self._map(edge)

    def __contains__(self, edge: object) -> bool:
        return edge in self.figures

    def __iter__(self) -> Iterator[Edge]:
        return iter(self.figures)

    def __len__(self) -> int:
        return len(self.figures)

    def _chart(self, number: int) -> Chart:
        return Chart.of(load_surface(self.folder.surface(self.names[number])), self.samples)

    def _read(self, edge: Edge) -> ChartMap:
        known = self.figures[edge]
        source, target = self.chart(edge[0]), self.chart(edge[1])
        if not known.written:
            return ChartMap(source, target, known.mobius)
        return ChartMap(source, target, known.mobius, *self._carried(edge, source, target))

    def _carried(self, edge: Edge, source: Chart, target: Chart) -> Carried:
        """Return where the target's vertices go in the source's domain, from the file of the dense map.

        The file's own domains may be those of pieces, or of surfaces joined at the lips: its triangles are the meshes'.
        """
        with np.load(self.folder.dense_map(*(self.names[k] for k in edge)), allow_pickle=False) as file:
            face, weights, sure = file["face"], file["barycentric"], file["confidence"] > 0
            corners = file["source_triangles"][np.maximum(face, 0)]
        if target.cleaned.changes:
            face, weights, sure, corners = (x[target.cleaned.origin] for x in (face, weights, sure, corners))
        there = source.cleaned.at_vertices(source.places, np.nan)
        held = np.isfinite(source.domain.coordinates(there)).all(axis=1)
        # where no weight is, there may be a vertex without a place
        located = (face >= 0) & (held[corners] | (weights <= 0)).all(axis=1)
        places = source.domain.nowhere(len(face))
        at = np.where(held if there.ndim == 1 else held[:, None], there, 0)
        places[located] = source.domain.mean(at, corners[located], weights[located])
        mesh = TriangleMesh(target.vertices, target.faces)
        paired = located & sure & mesh.used
        used = np.flatnonzero(mesh.used)
        if not paired.any():  # any place: none is a counterpart
            places[used] = source.places[source.samples[0]]
            return places, paired
        places[used] = places[nearest_known(mesh, paired)[used]]
        return places, paired
