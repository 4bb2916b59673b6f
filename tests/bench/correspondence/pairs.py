"""The pairs: two surfaces whose true correspondence is known, the target in another pose, scale and triangulation."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from solver import Flattening, TriangleMesh, flatten, topology
from solver.surface.barycentric import interpolated
from solver.surface.nearest import SurfacePoints
from tests.bench.paper.data import DATA, absent, read
from tests.solver.scans import posed

from .bent import bent_pieces, piece
from .decimation import decimated, moved
from .store import Store, digest

KEPT = 0.7
"""Share of the target's triangles that stay."""

POINTS = 20_000
"""Points of the target at which the map is measured, spread evenly over its area."""


@dataclass(frozen=True, eq=False)
class Places:
    """Points inside triangles of the target, and where on the source they truly belong.

    Attributes
    ----------
    face : (q,) int
    barycentric : (q, 3) float64
    truth : (q, 3) float64
    """

    face: np.ndarray
    barycentric: np.ndarray
    truth: np.ndarray

    def carried(self, target: TriangleMesh, values: np.ndarray) -> np.ndarray:
        """Return values at the target's vertices, (n, ...), linear in each triangle, at the points, (q, ...)."""
        return interpolated(values, target.faces[self.face], self.barycentric)


@dataclass(frozen=True, eq=False)
class Pair:
    """A source and a posed, decimated target.

    Attributes
    ----------
    kind : str
        The set it belongs to.
    name : str
        "source > target".
    source, target : TriangleMesh
    surface : Places or None
        Points all over the target; None where only landmarks are known.
    landmarks : Places or None
        Named points.
    reflected : bool
        Whether the true map turns orientation round.
    openings : bool
        Whether the surfaces have openings.
    beyond : Places or None
        Points of the target that the source has no counterpart of; their truth lies beyond its edge.
    """

    kind: str
    name: str
    source: TriangleMesh
    target: TriangleMesh
    surface: Places | None
    landmarks: Places | None
    reflected: bool = False
    openings: bool = False
    beyond: Places | None = None

    @property
    def known(self) -> Places:
        """What is known all over the surface, else the landmarks."""
        places = self.surface or self.landmarks
        assert places is not None
        return places

    @cached_property
    def digest(self) -> str:
        """What the pair consists of, as a short text."""
        parts = [self.source.vertices, self.source.faces, self.target.vertices, self.target.faces]
        known = self.known
        return digest(*parts, known.face, known.barycentric, known.truth, self.reflected, self.openings)

    @cached_property
    def flat(self) -> tuple[Flattening, Flattening]:
        """Source and target, flattened."""
        source, target = (flatten(mesh, fill_holes=self.openings) for mesh in (self.source, self.target))
        return source, target

    @cached_property
    def onto(self) -> SurfacePoints:
        """The source, prepared for nearest points."""
        return surface_points(self.source)


def surface_points(mesh: TriangleMesh) -> SurfacePoints:
    """Prepare a mesh for nearest points; normals matter enough to tell the two sides of a fold."""
    return SurfacePoints(mesh, topology(mesh).boundary_loops, 0.01 * np.sqrt(mesh.area))


def nearest(onto: SurfacePoints, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the face, (q,), and barycentric coordinates, (q, 3), of the nearest point of a surface."""
    return onto.nearest_point(points, normals)


@dataclass(frozen=True, eq=False)
class Shape:
    """A surface with what is known of it.

    Attributes
    ----------
    mesh : TriangleMesh
        Vertex i is vertex i of the other shapes of its kind, unless only landmarks are known.
    landmarks : (l,) int or None
    known : (m,) bool or None
        Faces whose correspondence means something; all if None.
    handedness : int
        +1 or -1; shapes of different handedness are mirror images.
    openings : bool
    """

    mesh: TriangleMesh
    landmarks: np.ndarray | None = None
    known: np.ndarray | None = None
    handedness: int = 1
    openings: bool = False


CLOSE_TO_EDGE = 0.02
"""Share of the diagonal: points that belong so little beyond the source's edge count neither as on it nor as beyond."""


def pair(
    kind: str,
    source: Shape,
    target: Shape,
    dense: bool,
    seed: int,
    store: Store,
    *,
    source_part: TriangleMesh | None = None,
    target_part: TriangleMesh | None = None,
    elsewhere: bool = False,
) -> Pair:
    """Decimate and pose the target and carry the truth along; its vertices are moved `elsewhere` if wanted.

    A point of the decimated surface means the nearest one of the surface it was decimated from, and so the point in
    the same place of the same triangle of the source. Of either side a part may be all that is shown.
    """
    whole, part, shown = target.mesh, target_part or target.mesh, source_part or source.mesh
    few = store.kept(
        f"decimated {part.name} {digest(part.vertices, part.faces, KEPT)}",
        lambda: dict(zip(("vertices", "faces"), _arrays(decimated(part, KEPT)), strict=True)),
    )
    small = TriangleMesh(few["vertices"], few["faces"], part.name)
    if elsewhere:
        small = moved(small, seed)
    on_whole = surface_points(whole)
    surface = landmarks = beyond = None
    if dense:
        rng = np.random.default_rng(seed)
        face = rng.choice(len(small.faces), POINTS, p=small.face_areas / small.area)
        barycentric = rng.dirichlet(np.ones(3), POINTS)
        position = interpolated(small.vertices, small.faces[face], barycentric)
        normal = small.face_vectors[face] / np.maximum(2 * small.face_areas[face, None], 1e-300)
        there, weights = nearest(on_whole, position, normal)
        truth = interpolated(source.mesh.vertices, source.mesh.faces[there], weights)
        good = np.ones(POINTS, bool) if target.known is None else target.known[there]
        if source_part is not None:
            gap = _distance(shown, truth) / source.mesh.diagonal
            far = good & (gap > CLOSE_TO_EDGE)
            beyond = Places(face[far], barycentric[far], truth[far]) if far.any() else None
            good &= gap < 1e-6
        surface = Places(face[good], barycentric[good], truth[good])
    if source.landmarks is not None and target.landmarks is not None:
        normals = whole.vertex_normals()[target.landmarks]
        there, weights = nearest(surface_points(small), whole.vertices[target.landmarks], normals)
        landmarks = Places(there, weights, source.mesh.vertices[source.landmarks])
    return Pair(
        kind,
        f"{shown.name} > {part.name}",
        shown,
        posed(small, seed),
        surface,
        landmarks,
        source.handedness != target.handedness,
        source.openings,
        beyond,
    )


def _distance(mesh: TriangleMesh, points: np.ndarray) -> np.ndarray:
    """Return how far points, (q, 3), lie from a mesh, (q,)."""
    onto = SurfacePoints(mesh, topology(mesh).boundary_loops, 0.0)
    face, weights = nearest(onto, points, np.zeros_like(points))
    return np.linalg.norm(interpolated(mesh.vertices, mesh.faces[face], weights) - points, axis=1)


def _arrays(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    return mesh.vertices, mesh.faces


# -- the shapes --------------------------------------------------------------------------------------------------------


@cache
def simpop(name: str) -> Shape:
    return Shape(_named(read(f"faces_simpop/SIMPOP_{name}.obj"), name))


@cache
def ict(name: str) -> Shape:
    """A face with its openings closed by cones, whose insides mean nothing."""
    mesh, facts = read(f"faces_ict/ict_{name}.obj"), _ict_facts()
    filled = _filling(facts)
    return Shape(_named(mesh, name), np.array(facts["eval13"]), ~filled[mesh.faces].any(axis=1))


@cache
def ict_open(name: str) -> Shape:
    """The same face with the filling left out: mouth and eyes are open."""
    closed = ict(name)
    faces = closed.mesh.faces[closed.known]
    used, inverse = np.unique(faces, return_inverse=True)
    mesh = TriangleMesh(closed.mesh.vertices[used], inverse.reshape(-1, 3), name)
    return Shape(mesh, np.searchsorted(used, closed.landmarks), openings=True)


def _ict_facts() -> dict:
    return json.loads((DATA / "faces_ict/ict_ground_truth.json").read_text(encoding="utf-8"))


def _filling(facts: dict) -> np.ndarray:
    row = np.array(facts["ict_vertex_of_row"])
    return (row < 0) | (row >= 9409)


@cache
def tooth(name: str) -> Shape:
    facts = json.loads((DATA / "teeth/landmarks.json").read_text(encoding="utf-8"))[name]
    mesh = _named(read(f"teeth/{name}.obj"), name)
    return Shape(mesh, np.array(facts["landmark_vertex"]), handedness=facts["handedness"])


@cache
def brain(side: str) -> Shape:
    file = {"left": "conte69_L_cortex", "right": "conte69_R_cortex_mirrored"}[side]
    return Shape(_named(read(f"brain/{file}.obj"), side))


def _named(mesh: TriangleMesh, name: str) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces, name)


SIMPOP = (("01", "10"), ("02", "15"), ("20", "30"), ("01", "02"), ("10", "15"), ("02", "30"))
ICT = (
    ("M_neutral", "M_happy_level4"),
    ("M_neutral", "F_neutral"),
    ("M_sad_level2", "M_happy_level1"),
    ("F_disgust_level2", "M_sad_level1"),
)
TEETH = (("K04", "K05"), ("i14", "i15"), ("H10", "H19"), ("P31", "P35"))
HARD_TEETH = (("x07", "x17"), ("U02", "U08"), ("x02", "x17"), ("x17", "T14"))
BRAIN = (("left", "right"),)


def of_kind(
    kind: str,
    names: tuple[tuple[str, str], ...],
    shape: Callable[[str], Shape],
    dense: bool,
    file: str,
    elsewhere: bool = False,
):
    def made(store: Store, count: int | None) -> Iterator[Pair]:
        if reason := absent(file):
            print(f"{kind} skipped: {reason}")
            return
        for k, (a, b) in enumerate(names[:count]):
            yield pair(kind, shape(a), shape(b), dense, 2 * k, store, elsewhere=elsewhere)
            yield pair(kind, shape(b), shape(a), dense, 2 * k + 1, store, elsewhere=elsewhere)

    return made


def bent(store: Store, count: int | None) -> Iterator[Pair]:
    pieces = list(bent_pieces(store))[:count]
    for k, (rest, bent) in enumerate(pieces):
        yield pair("bent", Shape(rest), Shape(bent), True, 2 * k, store)
        yield pair("bent", Shape(bent), Shape(rest), True, 2 * k + 1, store)


PARTIAL = (
    (simpop, "01", "10", (0, -1, 0), 0.15),
    (simpop, "02", "15", (1, 0, 0), 0.15),
    (simpop, "20", "30", (0, 1, 0), 0.15),
    (simpop, "10", "01", (0, -1, 0), 0.3),
    (ict, "M_neutral", "F_neutral", (0, -1, 0), 0.15),
    (ict, "M_sad_level2", "M_happy_level1", (-1, 0, 0), 0.3),
    (brain, "left", "right", (0, 1, 0), 0.15),
)
"""Shape, source, target, the direction in which one side is cut short, and the share of its area that goes."""

CROPPED = 40
"""Pairs of faces of which both are cut short."""

CROPPED_SHARE = 0.3
"""Share of its area that each of them lacks."""


def partial(store: Store, count: int | None) -> Iterator[Pair]:
    """Yield pairs of which first the source, then the target is cut short."""
    for k, (shape, a, b, direction, share) in enumerate(PARTIAL[:count]):
        source, target = shape(a), shape(b)
        cut = _cut(source.mesh, np.array(direction, float), share)
        yield pair("partial", source, target, True, 2 * k, store, source_part=cut)
        yield pair("partial", target, source, True, 2 * k + 1, store, target_part=cut)


def cropped(store: Store, count: int | None) -> Iterator[Pair]:
    """Yield pairs of faces of which each is cut short on a side of its own, chosen at random."""
    if reason := absent("faces_ict/ict_ground_truth.json") or absent("faces_simpop/SIMPOP_01.obj"):
        print(f"cropped skipped: {reason}")
        return
    rng = np.random.default_rng(30)
    faces = [(simpop, pair) for pair in SIMPOP] + [(ict, pair) for pair in ICT]
    for k in range(CROPPED if count is None else min(count, CROPPED)):
        shape, pair_of_names = faces[rng.integers(len(faces))]
        source, target = (shape(name) for name in rng.permutation(pair_of_names))
        angles = rng.uniform(0, 2 * np.pi, 2)
        parts = [
            _cut(side.mesh, np.array([np.cos(angle), np.sin(angle), 0.1]), CROPPED_SHARE)
            for side, angle in zip((source, target), angles, strict=True)
        ]
        yield pair("cropped", source, target, True, k, store, source_part=parts[0], target_part=parts[1])


def one_open(store: Store, count: int | None) -> Iterator[Pair]:
    """Yield pairs of faces of which first the source alone, then the target alone has its mouth and eyes open."""
    if reason := absent("faces_ict/ict_ground_truth.json"):
        print(f"one-open skipped: {reason}")
        return
    for k, (a, b) in enumerate(ICT[:count]):
        source, target, part = replace(ict(a), openings=True), replace(ict(b), openings=True), ict_open(a).mesh
        yield pair("one-open", source, target, True, 2 * k, store, source_part=part)
        yield pair("one-open", target, source, True, 2 * k + 1, store, target_part=part)


def _cut(mesh: TriangleMesh, direction: np.ndarray, share: float) -> TriangleMesh:
    """Return the mesh without the `share` of its area that lies farthest in a direction."""
    height = mesh.vertices[mesh.faces].mean(axis=1) @ direction
    order = np.argsort(-height)
    stays = np.ones(len(height), bool)
    stays[order[np.cumsum(mesh.face_areas[order]) < share * mesh.area]] = False
    return piece(mesh, stays, f"{mesh.name} less {100 * share:.0f} %")
