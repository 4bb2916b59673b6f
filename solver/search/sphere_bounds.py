"""Arcs of rotations about an axis that match a pair on the sphere, for all axes of a cell.

A rotation is R = Rz(phi) S_c: the axis c is the point that R carries to the upper pole e3, S_c a rotation that does so,
phi the angle about it. For given c the pair (m, cap(b, rho)) is matched by an arc of angles, as in the disc; here are
arcs that hold those of all c in a cell of axes.

Notes
-----
*Cell.* Axes: a square |x - x0|, |y - y0| <= half on one of the six faces of the cube, c along (x, y, 1), turned there
by `FACES`. The angle between two such axes has the tangent |cross| / dot, (x, y, 1) x (x + s, y + t, 1) = (-t, s, x t -
y s), so that for |s|, |t| <= half it is at most atan2(half sqrt(2 + (|x| + |y|)^2), 1 + x^2 + y^2 - half (|x| + |y|)):
`axis_radius`, alpha.

*Axes.* M(c, c0) is the rotation that takes c to c0 by the shortest way. For any c, phi is free: the rotations of a cell
are written Rz(phi) S_{c0} M(c, c0): the same ones. M turns by at most alpha about an axis that is orthogonal to c0, so
every point moves by at most alpha; and its azimuth, seen from c0, changes at a rate of at most |cot a|, a its distance
from c0: the velocity is the cross product with a unit vector orthogonal to c0. So S_{c0} M(m) is within alpha of v =
S_{c0}(m). Where neither pole is that near, its azimuth is within alpha max |cot(a +- alpha)| of that of v, and within
asin(sin alpha / sin a): the smaller one is taken. Its polar angle lies in a +- alpha. Where that is not the case, any
azimuth is allowed.

*Caps.* With g = (1 - cos a) / 2, which rises with a, circles of polar angle a meet the cap of b (polar angle beta,
angular radius tol, cos tol = 1 - rho^2 / 2) in an arc of half-angle w, sin^2(w / 2) = (cos(a - beta) - cos tol) / (2
sin a sin beta). Its derivative by a has the sign of cos tol cos a - cos beta: if the cap holds no pole it grows up to
cos a = cos beta / cos tol, where sin w = sin tol / sin beta, and falls from there; if it holds the upper pole alone it
falls, if the lower alone it grows throughout; if both, the full circle is taken.

*Whole cells.* In a window of width 2 e, phi within e of its middle, Rz(phi) moves a point at polar angle a by at most
e sin a. So all images of m in the cell and the window are within d = alpha + e sin a of v turned by the middle, and the
pair is matched nowhere there unless the angle between that and b is at most tol + d: unless their dot product is at
least cos tol cos d - sin tol sin d (`surely_dead` in kernels.c).

*Windows.* A window of phi of a cell (c0) becomes one of a smaller cell (c1) in it. Rz(phi1 - phi0) = S_{c0} M(c, c0)
M(c1, c) S_{c1}^-1, which differs from S_{c0} M(c1, c0) S_{c1}^-1 by the turn of a vector that is carried around the
triangle c0, c1, c: its area, at most 2 asin(tan(p / 2) tan(q / 2)) for two sides p, q. For p, q <= 1/4 that is below
0.51 p q, for p, q <= 1.1 below 1.05 p q. S_c = M(c, n) up to `FACES`, n the middle of the face, so that the other part
is a turn by -2 atan2(n.(c0 x c1), 1 + n.c0 + c0.c1 + c1.n), the area of the triangle n, c0, c1.

*Rounding.* All quantities are below 8, and less than 60 operations are done: images are off by less than 2^-44 and |m|
by less than 2^-52 of 1; g is moved outward by `SLACK` = 2^-42, azimuths by 2^-40 / sin a. The series of sine and cosine
are cut off after terms whose remainder, below alpha^10 / 3000000 for alpha < 1.5, is added.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..mobius import SphereMobius
from ..surface.mesh import Floats
from .bounds import SLACK, Arcs
from .kernels.nodes import HALF, X, Y
from .kernels.sphere_nodes import FACE

FACES = np.array(
    [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
    ],
    np.float64,
)
"""The rotation that takes the middle of each face of the cube to the upper pole."""

_TURNS = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [1, 0, -1, 0], [1, 0, 1, 0], [1, 1, 0, 0], [1, -1, 0, 0]], np.float64)
"""The same as quaternions."""


def axis_radius(x: Floats, y: Floats, half: Floats) -> Floats:
    """Return an upper bound of the angle between the middle of a square of axes and any other of them, radians."""
    total = np.abs(x) + np.abs(y)
    angle = np.arctan2(half * np.sqrt(2 + total**2), 1 + x**2 + y**2 - half * total)
    return np.where(half > 0, angle * (1 + 2.0**-40) + 2.0**-50, 0.0)


def frames(nodes: Floats) -> Floats:
    """Return S_c of the middle of each cell, (C, 3, 3)."""
    c = np.stack([nodes[:, X], nodes[:, Y], np.ones(len(nodes))], axis=1)
    x, y, z = (c / np.linalg.norm(c, axis=1, keepdims=True)).T
    over = 1 / (1 + z)
    rows = [[1 - x * x * over, -x * y * over, -x], [-x * y * over, 1 - y * y * over, -y], [x, y, z]]
    return np.array(rows).transpose(2, 0, 1) @ FACES[nodes[:, FACE].astype(np.intp)]


def transformation(node: Floats, phi: float) -> SphereMobius:
    """Return what a cell's middle and an angle stand for."""
    axis = np.array([node[X], node[Y], 1.0])
    axis /= np.linalg.norm(axis)
    to_pole = np.array([1 + axis[2], axis[1], -axis[0], 0.0])  # 1 + c.e3 and c x e3
    about = np.array([np.cos(phi / 2), 0.0, 0.0, np.sin(phi / 2)])
    q = _product(about, _product(to_pole / np.linalg.norm(to_pole), _TURNS[int(node[FACE])]))
    return SphereMobius(rotation=tuple((q / np.linalg.norm(q)).tolist()))


def _product(p: Floats, q: Floats) -> Floats:
    """Return the product of two quaternions."""
    return np.concatenate([[p[0] * q[0] - p[1:] @ q[1:]], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])])


def images(source: Floats, nodes: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Enclose the image of every source point, (N1, 3), over cells, (C, 9).

    Returns
    -------
    alpha, delta : (C, N1) float64
        Its azimuth lies in alpha +- delta, radians; delta > pi: anywhere.
    near, far : (C, N1) float64
        Bounds of g, in [0, 1].
    """
    tilt = axis_radius(nodes[:, X], nodes[:, Y], nodes[:, HALF])[:, None]
    v = np.einsum("ik,cjk->cji", source, frames(nodes)).transpose(0, 2, 1)
    height, sine = v[:, :, 2], np.hypot(v[:, :, 0], v[:, :, 1])
    unknown = ~(tilt < 1.5)
    tilt = np.where(unknown, 0, tilt)
    rest = tilt**10 / 3000000
    c, s = np.cos(tilt), np.sin(tilt)
    low, high = height * c + sine * s, height * c - sine * s
    low_sine, high_sine = sine * c - height * s - rest - SLACK, sine * c + height * s - rest - SLACK
    top, bottom = ~(low_sine > 0), ~(high_sine > 0)
    near = np.where(unknown | top, 0, np.maximum(0.5 * (1 - low - rest) - SLACK, 0))
    far = np.where(unknown | bottom, 1, np.minimum(0.5 * (1 - high + rest) + SLACK, 1))
    seen = ~(unknown | top | bottom)
    with np.errstate(divide="ignore", invalid="ignore"):
        plain = np.arcsin(np.minimum((s + rest + SLACK) / sine, 1))
        steep = np.maximum((np.abs(low) + rest + SLACK) / low_sine, (np.abs(high) + rest + SLACK) / high_sine)
        angle = np.minimum(plain, tilt * steep * (1 + 2.0**-40) + SLACK / sine) + 2.0**-39 / sine
    return np.arctan2(v[:, :, 1], v[:, :, 0]), np.where(seen, angle, 2 * np.pi), near, far


def caps(centre: Floats, radius: Floats) -> Floats:
    """Return what is to be known of caps of chord radius, (N2,), about points of the sphere, (N2, 3): rows of 8.

    g of their nearest and farthest point, moved outward (-1 and 2 where a pole is in them), azimuth, the widest
    half-angle they are seen under from the axis, g of the circle where it is that (-1 if the upper pole is inside, 2 if
    the lower), all angles in turns; sin and cos of their polar angle; cos of their radius, -4 if both poles are in.
    """
    cosine, sine = centre[:, 2], np.hypot(centre[:, 0], centre[:, 1])
    cos_tol = 1 - radius**2 / 2
    sin_tol = radius * np.sqrt(np.maximum(1 - radius**2 / 4, 0))
    upper, lower = cosine >= cos_tol - 2.0**-40, -cosine >= cos_tol - 2.0**-40
    both = (upper & lower) | (~upper & ~lower & (cos_tol < 2.0**-16))
    ratio = np.divide(sin_tol, sine, out=np.ones_like(sine), where=sine > sin_tol)
    widest = np.where(ratio > 1 - 2.0**-20, 0.25, (np.arcsin(ratio) + 2.0**-40) / (2 * np.pi))
    inner = np.where(upper | both, -1, 0.5 * (1 - cosine * cos_tol - sine * sin_tol) - SLACK)
    outer = np.where(lower | both, 2, 0.5 * (1 - cosine * cos_tol + sine * sin_tol) + SLACK)
    at = 0.5 * (1 - np.clip(np.divide(cosine, cos_tol, out=np.zeros_like(cosine), where=cos_tol > 2.0**-16), -1, 1))
    tangent = np.where(upper | both, -1, np.where(lower, 2, at))
    widest = np.where(upper | lower | both, 1, widest)
    turn = np.arctan2(centre[:, 1], centre[:, 0]) / (2 * np.pi)
    return np.stack([inner, outer, turn, widest, tangent, sine, cosine, np.where(both, -4, cos_tol)], axis=1)


def widest_half_angle(near: Floats, far: Floats, cap: Floats) -> Floats:
    """Return an upper bound of half the angle that caps, rows (n, 8) of `caps`, cover of circles, g in [near, far]."""
    _, _, _, widest, tangent, sine, cosine, cos_tol = cap.T
    g = np.where((tangent >= 0) & (far < tangent), far, near)
    across = 2 * np.sqrt(g * (1 - g))
    above = (1 - 2 * g) * cosine + across * sine - cos_tol + 2.0**-48
    with np.errstate(divide="ignore", invalid="ignore"):
        square = above / (2 * across * sine) * (1 + 2.0**-46)
    angle = 2 * np.arcsin(np.sqrt(np.clip(square, 0, 1))) + 2 * SLACK
    angle = np.where(above > 0, np.where(square < 1, angle, 2 * np.pi), 0)
    return np.where((tangent >= 0) & (near <= tangent) & (tangent <= far), widest * 2 * np.pi, angle)


def enclosing_arcs(matching: Any, nodes: Floats) -> Arcs:
    """Return, for each cell, (C, 9), and each pair, an arc that holds every angle phi that matches it in the cell."""
    alpha, delta, near, far = images(matching.source, nodes)
    cap = caps(matching.centres, matching.radii)
    inner, outer = cap[matching.target, :2].T
    row, pair = np.nonzero((near[:, matching.point] <= outer) & (far[:, matching.point] >= inner))
    j, k = matching.point[pair], matching.target[pair]
    beta = widest_half_angle(near[row, j], far[row, j], cap[k])
    return row, pair, cap[k, 2] * 2 * np.pi - alpha[row, j], delta[row, j] + beta
