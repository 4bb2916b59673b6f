import numpy as np
from surfaces import planar, rings

from solver.carry.charts import value_islands


def test_islands_are_those_of_a_walk_over_equal_sides():
    mesh = planar(rings(4))
    uv = np.random.default_rng(0).integers(0, 2, (3 * len(mesh.faces), 1)).astype(float)
    label = value_islands(mesh.faces, uv)
    values = uv.reshape(-1, 3)
    for f in range(len(mesh.faces)):
        for g in range(f):
            shared = set(mesh.faces[f]) & set(mesh.faces[g])
            if len(shared) == 2 and all(
                values[f][list(mesh.faces[f]).index(v)] == values[g][list(mesh.faces[g]).index(v)] for v in shared
            ):
                assert label[f] == label[g]
