"""A few nodes that stand for a surface."""

import numpy as np
from garments import tube_form, woven

from solver import cleaned, flatten
from solver.bend.coarse import coarse


def test_vertices_in_no_face_follow_nothing() -> None:
    """As those are that were drawn together at the toe of a sock, whose disc is so crowded that nodes have regions."""
    sock = cleaned(woven(tube_form(8, 0.8, closed=True), 80, 36, 0.0, 1, tube=True)[0], fill_holes=True).mesh
    assert not sock.used.all()
    few = coarse(flatten(sock), 1000, [0, 1, 2])
    assert len(few.nodes) < len(sock.vertices)
    assert sock.used[few.nodes].all()
    assert np.array_equal(few.vertices, np.flatnonzero(sock.used))
    places = np.einsum("vk,vkd->vd", few.weights, sock.vertices[few.nodes[few.leaders]])
    assert np.linalg.norm(places - sock.vertices[few.vertices], axis=1).max() < 0.05 * sock.diagonal
