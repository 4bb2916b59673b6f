"""Scans of which one is cut less far: a strip along its edge is missing, wider on one side than on the other."""

from collections.abc import Iterator

import numpy as np
from scipy.sparse.csgraph import dijkstra

from solver import TriangleMesh, topology
from solver.surface.sampling import edge_graph
from tests.bench.paper.data import absent

from .pairs import BRAIN, ICT, SIMPOP, Pair, brain, ict, pair, piece, simpop
from .store import Store

SHARES = (0.03, 0.08)
"""Shares of the area in the strip, in turns: too little to be found by the samples, and nearly enough."""

SURFACES = tuple((shape, *names) for shape, pairs in ((simpop, SIMPOP), (ict, ICT), (brain, BRAIN)) for names in pairs)


def trimmed(store: Store, count: int | None) -> Iterator[Pair]:
    """Yield pairs of which first the target, then the source is trimmed along its edge."""
    if reason := absent("faces_ict/ict_ground_truth.json"):
        print(f"trimmed skipped: {reason}")
        return
    for k, (shape, a, b) in enumerate(SURFACES[:count]):
        source, target, share = shape(a), shape(b), SHARES[k % len(SHARES)]
        rng = np.random.default_rng(k)
        yield pair("trimmed", source, target, True, k, store, target_part=_trimmed(target.mesh, share, rng))
        yield pair("trimmed", source, target, True, k, store, source_part=_trimmed(source.mesh, share, rng))


def _trimmed(mesh: TriangleMesh, share: float, rng: np.random.Generator) -> TriangleMesh:
    """Return the mesh without the `share` of its area nearest to its edge, up to nine times as wide on one side."""
    rim = np.concatenate(topology(mesh).boundary_loops)
    inside = dijkstra(edge_graph(mesh), indices=rim, min_only=True)
    outward = mesh.vertices - mesh.vertices[rim].mean(axis=0)
    along = outward @ rng.normal(size=3)
    depth = (inside / (1 + 0.8 * along / np.abs(along[rim]).max()).clip(0.2))[mesh.faces].min(axis=1)
    order = np.argsort(depth, kind="stable")
    stays = np.ones(len(order), bool)
    stays[order[np.cumsum(mesh.face_areas[order]) < share * mesh.area]] = False
    return piece(mesh, stays, f"{mesh.name} trimmed by {100 * share:.0f} %")
