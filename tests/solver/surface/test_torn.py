"""A spike that tears a cut open, along which the surface would be joined."""

import numpy as np
import pytest
from damages import Damage, Damaged, islands, loose_triangles, mirror_halves, undamaged
from scans import bumps

from solver import cleaned
from solver.surface.mesh import TriangleMesh


def torn(old: Damaged, sheet: TriangleMesh, rng: np.random.Generator) -> tuple[Damaged, np.ndarray]:
    """Two vertices on a cut put far off, away from the rim, from where cuts meet, and from each other."""
    faces, times = old.mesh.faces, np.bincount(old.clean)
    rim = np.unique(sheet.edges[np.bincount(sheet.edge_of_side) == 1])
    fits, taken, chosen = (times[old.clean] > 1) & (old.mesh.used), set(), []
    for vertex in rng.permutation(np.flatnonzero(fits)).tolist():
        around = np.unique(sheet.faces[(sheet.faces == old.clean[vertex]).any(axis=1)])
        meet = (times[around] > 2).any() and len(faces) * 3 != len(old.clean)
        if not (meet or np.isin(around, rim).any() or set(around.tolist()) & taken):
            taken |= set(around.tolist())
            chosen.append(vertex)
    chosen = np.array(chosen[:2])
    vertices = old.mesh.vertices.copy()
    vertices[chosen] += rng.uniform(2, 20, (2, 1)) * old.mesh.diagonal
    return Damaged(TriangleMesh(vertices, faces, old.mesh.name), old.clean), chosen


@pytest.mark.parametrize("cut", [loose_triangles, islands, mirror_halves], ids=lambda cut: cut.__name__)
@pytest.mark.parametrize("seed", [2, 3])
def test_a_spike_on_a_cut_is_put_where_the_other_side_is(cut: Damage, seed: int) -> None:
    rng = np.random.default_rng(seed)
    sheet = bumps(600, seed=2)
    new, chosen = torn(cut(undamaged(sheet), rng), sheet, rng)
    tidy = cleaned(new.mesh, largest_part=True, fill_holes=True)
    assert [said for said in tidy.changes if "far off" in said] == ["2 vertices far off the surface put back"]
    assert np.allclose(tidy.mesh.vertices[tidy.vertex_of[chosen]], sheet.vertices[new.clean[chosen]])
    assert len(tidy.mesh.faces) == len(sheet.faces)
    assert (tidy.mesh.twins < 0).sum() == (sheet.twins < 0).sum()
