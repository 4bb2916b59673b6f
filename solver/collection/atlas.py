"""The charts of many specimens and the maps between them, read when they are asked for, a few at a time in memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np

from ..align.surface_file import load_surface
from ..surface.mesh import Complexes
from .chart import Chart, DiscMap
from .cycles import Edge
from .folder import Folder
from .pair import Figures

KEPT = 64
"""Charts, and dense maps, that are kept in memory: a chart of 10,000 triangles is 2.5 MB (`tests/bench/growth.py`)."""


class Atlas(Mapping[Edge, DiscMap]):
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

    def __getitem__(self, edge: Edge) -> DiscMap:
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

    def _read(self, edge: Edge) -> DiscMap:
        known = self.figures[edge]
        source, target = self.chart(edge[0]), self.chart(edge[1])
        carried = self._carried(edge, target) if known.dense else None
        return DiscMap(source, target, known.mobius, carried)

    def _carried(self, edge: Edge, target: Chart) -> Complexes:
        """Return where the target's vertices go in the source's disc, from the file of the dense map."""
        with np.load(self.folder.dense_map(*(self.names[k] for k in edge)), allow_pickle=False) as file:
            face, weights = file["face"], file["barycentric"]
            corners = file["source_triangles"][np.maximum(face, 0)]
            # where no weight is, there may be a vertex without a place
            places = np.where(weights > 0, file["source_disc"][corners], 0)
        carried = np.where(face >= 0, (weights * places).sum(axis=1), complex(np.nan, np.nan))
        return carried[target.cleaned.origin] if target.cleaned.changes else carried
