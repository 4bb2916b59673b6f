"""Beyond Möbius: the target bent onto the source, smoothly, until the surfaces meet in position and normal.

The Möbius map says where everything goes, roughly but whatever the pose; the bending then finds the places more
accurately than a conformal map can. It is a non-rigid closest point method: distances to tangent planes let the
surfaces slide along each other, and the resistance of a thin plate, relaxed from stiff to soft, decides how they slide.

Lengths are in roots of the source's area. The constants were chosen by the mean errors over eleven pairs of faces and
teeth (tests/bench/correspondence measures more). Tried without gain: springs along the slopes of the descriptors, whose
differences between people say less than the surfaces do; springs back from the source; twice the rounds or nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.spatial import Delaunay, KDTree
from scipy.spatial.transform import Rotation

from .agreement import weighted_median
from .distortion import signed_areas
from .flatten import Flattening
from .harmonic import factorised
from .laplacian import laplacian
from .locate import TriangulatedDisc
from .mesh import Booleans, Complexes, Floats, Integers, TriangleMesh
from .mobius import Mobius
from .sampling import thinned
from .surface_points import SurfacePoints

NODES = 1500
"""Target vertices that are bent; all others follow them."""

FINE_NODES = 6000
"""Target vertices of the last rounds, which put right what depends on single triangles (folds fall to a half)."""

STIFFEST, SOFTEST, ROUNDS = 0.5, 0.005, 20
"""The wavelength below which the plate resists, from half the width of the surface to some edges of a scan."""

DRAFT_ROUNDS = 10
"""Rounds before boundaries attract each other; by then it is clear which of them correspond."""

FINE_STIFFNESS, FINE_ROUNDS = 0.01, 3
"""The wavelength at which the last rounds begin."""

NORMAL_WEIGHT = 0.03
"""A difference of 1 between unit normals counts like this length when points are paired."""

SLIP = 0.01
"""Resistance to sliding along a boundary, as a share of that to leaving it. There is none along the surface:
drawn to vertices, meshes of one template fit better and scans worse (the sets "-moved" of tests/bench)."""

OUTLIER = 2.385
"""Cauchy's weight at 95 % efficiency: residuals of this many standard deviations count half."""

RIM_REACH = 0.03
"""How far boundaries attract each other: the error that Möbius maps have, so that boundaries cut alike are found and
others leave each other alone. Without it errors are 15 to 50 % larger where boundaries correspond."""

BEND_LENGTH = 0.15
"""Width over which the rotations of the target's surroundings are averaged: half the radius of a sheet rolled
half around, which must remain possible, and wide enough not to follow the Möbius map's errors."""

NEAR_BEND_LENGTH = 0.05
"""The same where it starts from a draft, whose errors are a third of the Möbius map's."""

SHARPEST_BEND_LENGTH = BEND_LENGTH / 4
"""The least width that `BEND_LENGTH` is halved to, while the Möbius map's errors do not account for what averaging does
away with."""

MOBIUS_ERROR = RIM_REACH
"""Root of the mean squared distance up to which averaging may move a surface from where the Möbius map puts it: as
smooth as the error of what is smoothed allows (Morozov's discrepancy principle)."""

POSE_ROUNDS = 10
"""Closest point rounds that improve the pose before anything bends."""

SOLVER_STEPS = 12
"""Conjugate gradient steps per round; the next round begins where they end, so more change nothing."""


REPAIR_ROUNDS = 20
"""Attempts to unfold, each on patches one ring larger."""


@dataclass(frozen=True, eq=False)
class Bending:
    """The target bent onto the source.

    Attributes
    ----------
    carried : (n,) complex128
        Where each target vertex goes in the source's disc; nan at vertices in no face.
    offset : (n,) float64
        How far from the source the bent vertex remains, in roots of the source's area.
    repaired : int
        Vertices that were moved so that no triangle is folded.
    """

    carried: Complexes
    offset: Floats
    repaired: int


@dataclass(frozen=True, eq=False)
class Draft:
    """The target bent onto the source by the stiffer half of the rounds, its boundaries left alone.

    Attributes
    ----------
    onto : SurfacePoints
        The source about the middle of its boundary, in roots of its area.
    whole : TriangleMesh
        The target; mirrored, with its faces turned, where the Möbius transformation is reflected.
    conformal : (n,) complex128
        Where the Möbius transformation carries each target vertex in the source's disc; nan at vertices in no face.
    unbent : (n, 3) float64
        The target's vertices in the source's scale.
    nodes : (q,) int
        Target vertices that are bent.
    flat : TriangleMesh
        The nodes among `unbent`, with faces between them.
    rest, now : (q, 3) float64
        The nodes in the source's pose, and bent.
    """

    onto: SurfacePoints
    whole: TriangleMesh
    conformal: Complexes
    unbent: Floats
    nodes: Integers
    flat: TriangleMesh
    rest: Floats
    now: Floats

    def places(self, target: Flattening) -> Floats:
        """Return where all target vertices are, (n, 3), in the frame of `onto`; 0 at vertices in no face."""
        used = np.flatnonzero(np.isfinite(target.disc.real))
        places = np.zeros_like(self.unbent)
        places[used] = _following(self.nodes, self.flat, self.now, target.disc, self.unbent, used)
        return places

    def located(self, target: Flattening) -> tuple[Integers, Floats]:
        """Return the source's face nearest to each target vertex, (n,), and where in it, (n, 3).

        -1 and 0 at vertices in no face.
        """
        places = self.places(target)
        normals = TriangleMesh(places, self.whole.faces).vertex_normals()
        used = np.flatnonzero(np.isfinite(target.disc.real))
        face, barycentric = np.full(len(places), -1), np.zeros((len(places), 3))
        face[used], barycentric[used] = self.onto.nearest_point(places[used], normals[used])
        return face, barycentric


def drafted(
    mobius: Mobius,
    source: Flattening,
    target: Flattening,
    trust: Floats | None = None,
    start: Floats | None = None,
    rounds: int = DRAFT_ROUNDS,
    progress: Callable[[float], None] | None = None,
) -> Draft:
    """Bend the target onto the source with a stiff plate, beginning at the Möbius map.

    The target is first given the source's pose and coarse bend: an embedding with the lengths of the target whose
    surroundings are turned like their Möbius images (Sorkine and Alexa 2007, with rotations averaged over
    `BEND_LENGTH`, or less where that would undo a tighter bend: a coil would be flattened).

    Parameters
    ----------
    mobius : Mobius
        From the source's disc to the target's.
    source, target : Flattening
    trust : (n,) float64, optional
        How far the Möbius map is to be believed at each target vertex, in (0, 1]: scale, pose and coarse bend are taken
        from where it is. Default: everywhere.
    start : (n, 3) float64, optional
        Where target vertices are nearly, in the frame of `Draft.onto`: an earlier draft's `places`. Default: where the
        Möbius map puts them.
    rounds : int
        At most `ROUNDS`: how far the plate is relaxed.
    progress : callable, optional
        Called with the share of the work done, in [0, 1]; may raise to end it.
    """
    tell = progress or (lambda _: None)
    middle = source.mesh.vertices[source.boundary].mean(axis=0)
    onto = SurfacePoints(
        TriangleMesh((source.mesh.vertices - middle) / np.sqrt(source.mesh.area), source.mesh.faces),
        (source.boundary, *source.holes),
        NORMAL_WEIGHT,
    )
    used = np.flatnonzero(np.isfinite(target.disc.real))
    conformal = np.full(len(target.disc), complex(np.nan, np.nan))
    conformal[used] = mobius.inverse()(target.disc[used])
    # a mirrored target is mirrored back, and its faces turned, so that normals agree
    mirror, order = ([-1, 1, 1], [0, 2, 1]) if mobius.reflected else ([1, 1, 1], [0, 1, 2])
    whole = TriangleMesh(target.mesh.vertices * mirror, target.mesh.faces[:, order])

    tell(0.0)
    nodes, faces = _coarse(target, NODES, order)
    tell(0.0)
    places = _positions(conformal[nodes], source, onto) if start is None else start[nodes]
    believed = np.ones(len(nodes)) if trust is None else trust[nodes]
    unbent = whole.vertices * _growth(TriangleMesh(whole.vertices[nodes], faces), places, believed)
    flat = TriangleMesh(unbent[nodes], faces)
    rest = (
        _coarsely_bent(flat, places, believed)
        if start is None
        else _turned_like(flat, places, believed, NEAR_BEND_LENGTH)
    )
    tell(0.0)
    rest = _in_pose(TriangleMesh(rest, faces), onto)
    lengths = _lengths(STIFFEST, SOFTEST, ROUNDS)[:rounds]
    now = _relaxed(rest, rest, faces, onto, lengths, np.zeros(len(nodes), bool), tell)
    return Draft(onto, whole, conformal, unbent, nodes, flat, rest, now)


def finished(
    draft: Draft,
    source: Flattening,
    target: Flattening,
    alike: Booleans | None = None,
    progress: Callable[[float], None] | None = None,
) -> Bending:
    """Bend a draft the rest of the way.

    Parameters
    ----------
    draft : Draft
    source, target : Flattening
        As for `drafted`.
    alike : (n,) bool, optional
        Target vertices that are drawn to the source's boundaries where they are on a boundary themselves; not those
        along which the target alone was cut. Default: all.
    progress : callable, optional
        Called with the share of the work done, in [0, 1]; may raise to end it.

    Returns
    -------
    Bending
        Keeps the orientation of every triangle in the source's disc.
    """
    tell = progress or (lambda _: None)
    onto, unbent, flat, nodes, conformal = draft.onto, draft.unbent, draft.flat, draft.nodes, draft.conformal
    drawn = np.ones(len(target.disc), bool) if alike is None else alike
    used = np.flatnonzero(np.isfinite(target.disc.real))
    order = [0, 2, 1] if (draft.whole.faces != target.mesh.faces).any() else [0, 1, 2]
    lengths = _lengths(STIFFEST, SOFTEST, ROUNDS)[DRAFT_ROUNDS:]
    now = _relaxed(draft.rest, draft.now, flat.faces, onto, lengths, drawn[nodes], lambda share: tell(0.5 * share))

    tell(0.5)
    fine, fine_faces = _coarse(target, FINE_NODES, order)
    tell(0.5)
    followed = _following(nodes, flat, now, target.disc, unbent, fine)
    start = _following(nodes, flat, draft.rest, target.disc, unbent, fine)
    lengths = _lengths(FINE_STIFFNESS, SOFTEST, FINE_ROUNDS)
    settled = _relaxed(start, followed, fine_faces, onto, lengths, drawn[fine], lambda share: tell(0.5 + 0.3 * share))
    tell(0.8)
    all_places = np.zeros_like(unbent)
    all_places[used] = _following(fine, TriangleMesh(unbent[fine], fine_faces), settled, target.disc, unbent, used)
    all_places[fine] = settled
    normals = TriangleMesh(all_places, draft.whole.faces).vertex_normals()
    face, barycentric = onto.nearest_point(
        all_places[used], normals[used], progress=lambda share: tell(0.8 + 0.15 * share)
    )
    reached = np.einsum("qk,qkd->qd", barycentric, onto.mesh.vertices[source.mesh.faces[face]])
    offset = np.zeros(len(target.disc))
    offset[used] = np.linalg.norm(reached - all_places[used], axis=1)
    carried = conformal.copy()
    carried[used] = (source.disc[source.mesh.faces[face]] * barycentric).sum(axis=1)
    tell(0.95)
    carried, repaired = _injective(
        carried, conformal, target.mesh.faces[:, order], target.boundary, target.holes, lambda: tell(0.95)
    )
    return Bending(carried, offset, repaired)


def bent(
    mobius: Mobius,
    source: Flattening,
    target: Flattening,
    progress: Callable[[float], None] | None = None,
) -> Bending:
    """Bend the target onto the source, all of it: `drafted`, then `finished`."""
    tell = progress or (lambda _: None)
    draft = drafted(mobius, source, target, progress=lambda share: tell(0.4 * share))
    return finished(draft, source, target, progress=lambda share: tell(0.4 + 0.6 * share))


def _lengths(stiffest: float, softest: float, rounds: int) -> Floats:
    """Return the plate's wavelength in each round, (rounds,), falling by equal factors."""
    return np.geomspace(stiffest, softest, rounds)


def _positions(disc_points: Complexes, source: Flattening, onto: SurfacePoints) -> Floats:
    """Return where points of the source's disc lie on the scaled source, (q, 3)."""
    face, barycentric = TriangulatedDisc.of(source.disc, source.mesh.faces).locate(disc_points)
    return np.einsum("qk,qkd->qd", barycentric, onto.mesh.vertices[source.mesh.faces[face]])


def _growth(mesh: TriangleMesh, places: Floats, trust: Floats) -> float:
    """Return how much longer edges are in `places`, (n, 3), than in the mesh: the median ratio, by trust, (n,)."""
    i, j = mesh.edges.T
    own = np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1)
    there = np.linalg.norm(places[i] - places[j], axis=1)
    some = (own > 0) & (there > 0)
    if not some.any():
        return 1.0
    return weighted_median(there[some] / own[some], (trust[i] * trust[j])[some])


def _coarse(flattening: Flattening, count: int, order: list[int]) -> tuple[Integers, Integers]:
    """Return about `count` vertices spread over the surface and the faces, (m, 3), between them.

    The faces index the chosen vertices; they are Delaunay in the disc, with corners in the given order.
    """
    disc = flattening.disc
    inside = np.isfinite(disc.real)
    if inside.sum() <= count:
        nodes = np.flatnonzero(inside)
        place = np.zeros(len(disc), np.intp)
        place[nodes] = np.arange(len(nodes))
        return nodes, place[flattening.mesh.faces][:, order]
    inside[flattening.boundary] = False
    inner = np.flatnonzero(inside)
    # as dense along the boundary as inside, for a round surface
    rim = flattening.boundary[:: max(1, round(len(flattening.boundary) / (3.5 * np.sqrt(count))))]
    nodes = np.concatenate(
        [inner[thinned(flattening.mesh.vertices[inner], np.sqrt(0.53 * flattening.mesh.area / count))], rim]
    )
    faces = Delaunay(np.stack([disc[nodes].real, disc[nodes].imag], axis=1)).simplices.astype(np.intp)
    turned = signed_areas(disc[nodes], faces)
    faces = np.where((turned < 0)[:, None], faces[:, [0, 2, 1]], faces)[np.abs(turned) > 1e-12]
    # where the disc is crowded a node may have slivers alone
    held, place = np.unique(faces, return_inverse=True)
    return nodes[held], place.reshape(-1, 3)[:, order]


def _smooth_rotations(
    rest: TriangleMesh, now: Floats, trust: Floats | None = None, length: float = BEND_LENGTH
) -> Floats:
    """Return the rotation, (n, 3, 3), that carries the surroundings of each vertex of `rest` to those in `now`.

    Averaged over `length`, by trust, (n,).
    """
    stiffness = laplacian(rest)
    i, j = rest.edges.T
    trust = np.ones(len(now)) if trust is None else trust
    weight = np.maximum(-np.asarray(stiffness[i, j]).ravel(), 0) * np.sqrt(trust[i] * trust[j])
    products = weight[:, None, None] * (now[i] - now[j])[:, :, None] * (rest.vertices[i] - rest.vertices[j])[:, None, :]
    total = _summed(i, products, len(now)) + _summed(j, products, len(now))
    average = factorised(csc_array(diags_array(rest.vertex_areas * trust) + length**2 * stiffness))
    u, _, v = np.linalg.svd(average(total.reshape(-1, 9)).reshape(-1, 3, 3))
    u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
    return np.asarray(u @ v, np.float64)


def _turned_like(rest: TriangleMesh, places: Floats, trust: Floats, length: float, rounds: int = 3) -> Floats:
    """Return `rest` with its surroundings turned as in `places`, as far as these are trusted, and its own lengths."""
    stiffness, areas = laplacian(rest), rest.vertex_areas * trust
    i, j = rest.edges.T
    weight = -np.asarray(stiffness[i, j]).ravel()
    side = rest.vertices[i] - rest.vertices[j]
    # the places hold it only over lengths beyond the surface's width, which is 1
    solve = factorised(csc_array(stiffness + diags_array(areas)))
    now = places
    for _ in range(rounds):
        turn = _smooth_rotations(rest, now, trust, length)
        wanted = weight[:, None] * np.einsum("eij,ej->ei", (turn[i] + turn[j]) / 2, side)
        now = solve(_summed(i, wanted, len(now)) - _summed(j, wanted, len(now)) + areas[:, None] * places)
    return now


def _coarsely_bent(flat: TriangleMesh, places: Floats, trust: Floats) -> Floats:
    """Return the mesh bent like its Möbius image, `places`: as smoothly as the image's errors allow."""
    weight = flat.vertex_areas * trust
    length = BEND_LENGTH
    while True:
        bent_like = _turned_like(flat, places, trust, length)
        moved = weight @ ((bent_like - places) ** 2).sum(axis=1) / weight.sum()
        if moved <= MOBIUS_ERROR**2 or length <= SHARPEST_BEND_LENGTH:
            return bent_like
        length /= 2


def _summed(index: Integers, values: Floats, count: int) -> Floats:
    """Return the sums, (count, ...), of the values, (e, ...), that share an index."""
    flat = values.reshape(len(index), -1)
    sums = np.stack([np.bincount(index, column, count) for column in flat.T], axis=1)
    return sums.reshape(count, *values.shape[1:]).astype(np.float64, copy=False)


def _following(
    nodes: Integers, rest: TriangleMesh, now: Floats, disc: Complexes, unbent: Floats, vertices: Integers
) -> Floats:
    """Return where vertices, (q,), go when the nodes move from `rest` to `now`: each with its triangle's surroundings.

    Embedded deformation (Sumner et al. 2007): the mean, by barycentric coordinates in the disc, of what the three nodes
    around would do with it.
    """
    faces = rest.faces
    if signed_areas(disc[nodes], faces[:1])[0] < 0:
        faces = faces[:, [0, 2, 1]]
    face, barycentric = TriangulatedDisc.of(disc[nodes], faces).locate(disc[vertices])
    corners = faces[face]
    turn = _smooth_rotations(rest, now)[corners]
    from_node = unbent[vertices][:, None] - rest.vertices[corners]
    return np.einsum("qk,qkd->qd", barycentric, now[corners] + np.einsum("qkij,qkj->qki", turn, from_node))


def _pulls(x: Floats, faces: Integers, areas: Floats, onto: SurfacePoints, drawn: Booleans) -> tuple[Floats, Floats]:
    """Return how the source pulls at each vertex: stiffness, (n, 3, 3), and force, (n, 3), of a spring.

    Towards the tangent plane of the point that suits in position and normal; less if the normals differ or the distance
    is an outlier, not at all where that point is on the edge.
    Vertices on a boundary that are `drawn`, (n,), are pulled to the source's boundary too, if it is near.
    """
    mesh = TriangleMesh(x, faces)
    own = mesh.vertex_normals()
    point, normal, beyond = onto.at(*onto.most_alike(x, own))
    weight = np.where(beyond, 0.0, np.clip((own * normal).sum(axis=1), 0, 1) ** 2) * areas
    distance = ((point - x) * normal).sum(axis=1)
    deviation = np.sqrt(weight @ distance**2 / max(float(weight.sum()), 1e-12))
    weight /= 1 + (distance / max(OUTLIER * deviation, 1e-6)) ** 2
    stiffness, force = _along(normal, weight), (weight * distance)[:, None] * normal
    rim = np.unique(mesh.edges[np.bincount(mesh.edge_of_side, minlength=len(mesh.edges)) == 1])
    rim = rim[drawn[rim]]
    point, tangent = onto.nearest_on_boundary(x[rim])
    weight = areas[rim] * np.exp(-(((point - x[rim]) ** 2).sum(axis=1) / RIM_REACH**2) / 2)
    across = weight[:, None, None] * np.eye(3) - _along(tangent, weight * (1 - SLIP))
    stiffness[rim] += across
    force[rim] += np.einsum("nij,nj->ni", across, point - x[rim])
    return stiffness, force


def _in_pose(rest: TriangleMesh, onto: SurfacePoints) -> Floats:
    """Return the vertices of `rest` in the rigid pose nearest to the source's tangent planes.

    The scale stays: distances to planes fall when a surface merely shrinks.
    """
    areas, x = rest.vertex_areas / rest.area, rest.vertices
    for _ in range(POSE_ROUNDS):
        stiffness, force = _pulls(x, rest.faces, areas, onto, np.zeros(len(x), bool))
        middle = areas @ x
        arm = x - middle
        # columns: shift and turn
        moves = np.concatenate([np.broadcast_to(np.eye(3), (len(x), 3, 3)), _crossed(arm)], axis=2)
        square = np.einsum("nia,nij,njb->ab", moves, stiffness, moves, optimize=True)
        # a plane or a sphere slides along itself
        step = np.linalg.lstsq(square, np.einsum("nia,ni->a", moves, force), rcond=1e-9)[0]
        x = Rotation.from_rotvec(step[3:]).apply(arm) + middle + step[:3]
    return x


def _crossed(arm: Floats) -> Floats:
    """Return the matrices, (n, 3, 3), that carry a rotation vector to its cross product with each arm, (n, 3)."""
    return np.cross(np.eye(3), arm[:, None]).transpose(0, 2, 1)


def _relaxed(
    rest: Floats,
    now: Floats,
    faces: Integers,
    onto: SurfacePoints,
    lengths: Floats,
    drawn: Booleans,
    tell: Callable[[float], None],
) -> Floats:
    """Return the vertices, (n, 3), bent from `rest` onto the source, beginning at `now`.

    Each round minimises the energy of the springs (`_pulls`) plus l^4 times the integral of the squared Laplacian of
    the displacement from `rest`, for l in `lengths`. Boundary vertices that are `drawn` go to the source's boundaries.
    """
    mesh = TriangleMesh(rest, faces)
    stiffness, areas = laplacian(mesh), mesh.vertex_areas / mesh.area
    plate = csc_array(stiffness @ diags_array(1 / np.maximum(areas, 1e-3 * areas.mean())) @ stiffness)
    shift = now - rest
    for k, length in enumerate(lengths):
        tell(k / len(lengths))
        stiff = length**4
        pull, force = _pulls(rest + shift, faces, areas, onto, drawn)
        # the same system with the same pull in all directions, which one factorisation solves
        even = np.einsum("nii->n", pull) / 3 + 1e-4 * areas
        shift = _conjugate_gradients(
            lambda u, pull=pull, stiff=stiff: np.einsum("nij,nj->ni", pull, u) + stiff * (plate @ u),
            factorised(csc_array(diags_array(even) + stiff * plate)),
            force + np.einsum("nij,nj->ni", pull, shift),
            shift,
        )
    return rest + shift


def _along(direction: Floats, weight: Floats) -> Floats:
    """Return weight times the projection on each unit vector, (n, 3, 3)."""
    return weight[:, None, None] * direction[:, :, None] * direction[:, None, :]


def _conjugate_gradients(
    apply: Callable[[Floats], Floats], precondition: Callable[[Floats], Floats], right: Floats, x: Floats
) -> Floats:
    """Return x after `SOLVER_STEPS` steps towards apply(x) = right, for arrays of shape (n, 3)."""
    residual = right - apply(x)
    direction = better = precondition(residual)
    size = float((residual * better).sum())
    enough = 1e-3 * np.linalg.norm(right)
    for _ in range(SOLVER_STEPS):
        image = apply(direction)
        curvature = float((direction * image).sum())
        if curvature <= 0:
            break
        x = x + size / curvature * direction
        residual = residual - size / curvature * image
        if np.linalg.norm(residual) < enough:
            break
        better = precondition(residual)
        before, size = size, float((residual * better).sum())
        direction = better + size / before * direction
    return x


def _injective(
    carried: Complexes,
    conformal: Complexes,
    faces: Integers,
    boundary: Integers,
    holes: tuple[Integers, ...],
    tell: Callable[[], None] = lambda: None,
) -> tuple[Complexes, int]:
    """Return the map with no triangle turned over or collapsed, and how many vertices were moved for it.

    The boundary is put in order first, and the displacement from the Möbius map interpolated across patches around what
    is turned over (`_interpolated`). Where these do not come to an end, the displacement fades around them: by
    quarters, and over ever wider surroundings, until at last the Möbius map itself is left, which is injective.
    """
    ordered = carried.copy()
    ordered[boundary] = _in_order(carried[boundary], conformal[boundary])
    links = mean_value_weights(conformal, faces)
    result = _interpolated(ordered, conformal, faces, links, boundary, holes, tell)
    turned = _turned(result, faces)
    near = np.zeros(len(carried), bool)
    reach = 0.0
    while turned.any() and reach < 8:  # from 4 on nothing but the Möbius map is left
        near[faces[turned]] = True
        # steep enough fading would turn triangles over by itself
        reach = max(2 * reach, 4 * float(np.abs(ordered - conformal)[near].max()), 1e-3)
        distance = np.full(len(carried), np.inf)
        used = np.flatnonzero(np.isfinite(conformal.real))
        tree = KDTree(np.stack([conformal[near].real, conformal[near].imag], axis=1))
        distance[used] = tree.query(np.stack([conformal[used].real, conformal[used].imag], axis=1))[0]
        share = np.clip(2 - 2 * distance / reach, 0, 1)
        for quarters in range(1, 5):
            faded = ordered - quarters / 4 * share * (ordered - conformal)
            result = _interpolated(faded, conformal, faces, links, boundary, holes, tell)
            turned = _turned(result, faces)
            if not turned.any():
                break
    return result, int((np.abs(result - carried) > 0).sum())


def _interpolated(
    start: Complexes,
    conformal: Complexes,
    faces: Integers,
    links: csr_array,
    boundary: Integers,
    holes: tuple[Integers, ...],
    tell: Callable[[], None],
) -> Complexes:
    """Return the map with its displacement from the Möbius map interpolated across patches around turned triangles.

    Inside, vertices become those means of their neighbours that they are in the Möbius map; on the boundary the
    logarithm of the ratio to it is linear in the angle between the vertices that stay. Patches grow, a ring at a time,
    where they hold a turned triangle; one that is the whole disc holds none (Floater 2003), if there are no openings.
    """
    size = len(start)
    inside = np.zeros(size, bool)
    inside[faces] = True
    inside[np.concatenate([boundary, *holes])] = False
    result, free = start, np.zeros(size, bool)
    for _ in range(REPAIR_ROUNDS):
        tell()
        turned = _turned(result, faces)
        if not turned.any():
            break
        near = np.zeros(size, bool)
        near[faces[turned]] = True
        free |= near | (links @ (near & free) > 0)
        result = start.copy()
        result[boundary] = _along_boundary(start[boundary], conformal[boundary], free[boundary])
        patch = np.flatnonzero(free & inside)
        if patch.size:
            rows = links[patch]
            held = np.where(np.isfinite(result.real), result, 0)
            held[patch] = 0
            pulled = rows @ np.stack([held.real, held.imag], axis=1)
            mean = factorised(csc_array(diags_array(rows.sum(axis=1)) - rows[:, patch]))(pulled)
            result[patch] = mean[:, 0] + 1j * mean[:, 1]
    return result


def _along_boundary(places: Complexes, conformal: Complexes, free: Booleans) -> Complexes:
    """Return boundary places, (k,), the free ones' log ratio to the Möbius map's interpolated between the others'."""
    if not free.any():
        return places
    ratio = np.log(places / conformal)
    if free.all():
        return conformal * np.exp(ratio.mean())
    angle = np.abs(np.unwrap(np.angle(conformal / conformal[0])))
    held = np.flatnonzero(~free)
    filled = [np.interp(angle, angle[held], part[held], period=2 * np.pi) for part in (ratio.real, ratio.imag)]
    return np.where(free, conformal * np.exp(filled[0] + 1j * filled[1]), places)


def _in_order(carried: Complexes, conformal: Complexes) -> Complexes:
    """Return boundary places, (k,), whose angles run on like those of the Möbius map, by 1/20 of its steps or more.

    Least squares under that condition (isotonic regression); the distances from the centre stay.
    """
    # from the widest gap on, so that the seam is not where angles have to change
    gaps = np.angle(np.roll(conformal, -1) / conformal)
    way = -1.0 if gaps.sum() < 0 else 1.0
    first = (int(np.argmax(way * np.angle(np.roll(carried, -1) / carried))) + 1) % len(carried)
    order = np.roll(np.arange(len(carried)), -first)
    own = np.unwrap(way * np.angle(conformal[order]))
    moved = own + way * np.angle(carried[order] / conformal[order])
    low = 0.05 * own
    angle = isotonic_regression(moved - low).x + low
    result = carried.copy()
    far = np.abs(angle - moved) > 1e-12
    result[order[far]] = np.abs(carried[order[far]]) * np.exp(1j * way * angle[far])
    return result


def mean_value_weights(plane: Complexes, faces: Integers) -> csr_array:
    """Return positive weights, (n, n), with which each vertex inside is a mean of its neighbours in the plane.

    Floater, "Mean value coordinates" (2003); of a map without turned triangles.
    """
    corner = plane[faces]
    to_next, to_last = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    half = np.tan(np.abs(np.angle(to_last / to_next)) / 2)
    rows = np.concatenate([faces.ravel(), faces.ravel()])
    columns = np.concatenate([np.roll(faces, -1, axis=1).ravel(), np.roll(faces, 1, axis=1).ravel()])
    values = np.concatenate([(half / np.abs(to_next)).ravel(), (half / np.abs(to_last)).ravel()])
    return csr_array(coo_array((values, (rows, columns)), shape=(len(plane), len(plane))))


def _turned(disc: Complexes, faces: Integers) -> Booleans:
    """Return which faces, (m,), are turned over or collapsed in the disc."""
    return signed_areas(disc, faces) <= 0
