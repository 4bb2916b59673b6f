import numpy as np
from surfaces import spherical_cap

from solver import flatten
from solver.align.doubt.deep_inside import FELT, depths, difference, explained, felt_inside
from solver.surface.descriptors import diffused_curvatures


def test_a_ball_is_alike_everywhere_but_where_its_boundary_is_felt() -> None:
    """Its curvatures are the same all over: what says otherwise is the boundary, and only as near as is said."""
    cap = flatten(spherical_cap(24, 2.0, 0.2)[0])
    depth, measured = depths(cap, cap.mesh.vertices), diffused_curvatures(cap.mesh)[:, :4]
    rim = cap.mesh.vertices[cap.boundary]
    true = np.arccos(np.clip(cap.mesh.vertices @ rim.T, -1, 1)).min(axis=1)
    assert np.allclose(2 * np.sin(true / 2) / np.sqrt(cap.mesh.area), depth)
    inside = felt_inside(depth)[:, :4]
    off = np.abs(measured / np.median(np.where(inside, measured, np.nan)[inside[:, 3]], axis=0) - 1)
    for k in range(4):
        assert off[inside[:, k], k].max() < 0.2
        assert off[~inside[:, k], k].max() > 0.3  # beside a boundary up to half of what would diffuse in is missing


def test_what_differs_is_counted_where_it_tells_anything() -> None:
    """By hand: the root mean square of what tells; variance about the mean, column by column."""
    tells = np.array([[True, False], [True, True], [False, True], [True, True]])
    wanted = np.array([[1.0, 9.0], [2.0, 1.0], [9.0, 3.0], [6.0, 2.0]])
    unlike = np.array([[1.0, 7.0], [0.0, 1.0], [5.0, 0.0], [1.0, 1.0]])
    assert np.allclose(difference(unlike, tells), [1, np.sqrt(0.5), 0, 1])
    # columns 1, 2, 6 about 3: 14; 1, 3, 2 about 2: 2; left 1 + 0 + 1 and 1 + 0 + 1
    assert np.isclose(explained(wanted, unlike, tells), 1 - 4 / 16)
    assert explained(wanted, unlike, np.zeros_like(tells)) == 0


def test_what_has_no_boundary_tells_all() -> None:
    assert felt_inside(np.full(3, np.inf)).all()
    assert (felt_inside(FELT) == (FELT[:, None] > FELT)).all()


FACES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
