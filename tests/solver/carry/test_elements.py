import numpy as np
import pytest
from correspondences import on_itself, planar_correspondence, sheet

from solver.carry.elements import edges_in_reach, source_of_corners, source_of_edges, source_of_faces


def test_faces_corners_and_edges_of_an_identical_mesh_are_their_own_source():
    mesh, quad = sheet(17)
    found = on_itself(mesh, 3)
    assert (source_of_faces(found, mesh.vertices, mesh.faces, quad) // 2 == np.arange(256)).all()
    alone = np.arange(len(mesh.faces))
    assert (source_of_faces(found, mesh.vertices, mesh.faces, alone) == alone).all()
    corner = source_of_corners(found, mesh.vertices, mesh.faces, quad)
    assert (mesh.faces.ravel()[corner] == mesh.faces.ravel()).all()
    assert (quad[corner // 3] == np.repeat(quad, 3)).all()
    edges = np.unique(
        np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])), axis=0
    )
    assert (source_of_edges(found, mesh.vertices, edges, edges) == np.arange(len(edges))).all()


def test_a_target_edge_takes_the_source_edge_that_runs_along_it(pair):
    source, _ = sheet(41)
    target, _ = sheet(14, 13)
    edges = [np.unique(np.sort(m.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0) for m in (source, target)]
    found = source_of_edges(planar_correspondence(source, target), source.vertices, *edges)
    run = [m.vertices[e[:, 1]] - m.vertices[e[:, 0]] for m, e in zip((source, target), edges, strict=True)]
    middle = [m.vertices[e].mean(axis=1) for m, e in zip((source, target), edges, strict=True)]
    cosine = np.abs((run[0][found] * run[1]).sum(axis=1)) / np.prod(
        [np.linalg.norm(x, axis=1) for x in (run[0][found], run[1])], axis=0
    )
    assert cosine.min() > 0.99
    assert np.linalg.norm(middle[0][found] - middle[1], axis=1).max() < 0.06


@pytest.mark.parametrize("sizes", [(41, 30), (14, 30), (30, 7)])
def test_no_edge_out_of_reach_comes_from_a_marked_one(sizes):
    rng = np.random.default_rng(0)
    source, target = sheet(sizes[0])[0], sheet(sizes[1], sizes[1] + 2)[0]
    edges = [m.edges for m in (source, target)]
    marked = rng.random(len(edges[0])) < 0.01
    found = planar_correspondence(source, target)
    origin = source_of_edges(found, source.vertices, *edges)
    near = edges_in_reach(found, source.vertices, edges[0], marked, edges[1])
    assert not marked[origin[~near]].any()
    if sizes[0] > 20 and sizes[1] > 20:
        assert near.mean() < 0.9
    assert not edges_in_reach(found, source.vertices, edges[0], 0 * marked > 0, edges[1]).any()
