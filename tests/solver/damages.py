"""What happens to scans on their way: flaws put into a clean mesh, each with the clean vertex of every vertex."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from solver import AlignSettings, MeshError, TriangleMesh, align, correspond, prepare
from solver.surface.sampling import edge_graph

SAME = 0.3
"""Distance from the clean map, in % of the diagonal, up to which a map is the same."""


@dataclass(frozen=True, eq=False)
class Damaged:
    """A mesh with flaws.

    Attributes
    ----------
    mesh : TriangleMesh
    clean : (n,) int
        The vertex of the clean mesh that each vertex is; -1 for vertices that were added.
    keys : (n, d) float64 or None
        As for `solver.prepare`.
    """

    mesh: TriangleMesh
    clean: np.ndarray
    keys: np.ndarray | None = None


Damage = Callable[[Damaged, np.random.Generator], Damaged]


def undamaged(mesh: TriangleMesh) -> Damaged:
    """The mesh as it is."""
    return Damaged(mesh, np.arange(len(mesh.vertices)))


def _with(old: Damaged, faces: np.ndarray, extra: np.ndarray | None = None, clean: np.ndarray | None = None) -> Damaged:
    """Other faces, and further vertices, which are the `clean` ones."""
    if extra is None or clean is None:
        return Damaged(TriangleMesh(old.mesh.vertices, faces, old.mesh.name), old.clean, old.keys)
    vertices = np.concatenate([old.mesh.vertices, extra])
    keys = None
    if old.keys is not None:
        keys = np.concatenate([old.keys, np.zeros((len(extra), old.keys.shape[1]))])
    return Damaged(TriangleMesh(vertices, faces, old.mesh.name), np.concatenate([old.clean, clean]), keys)


def _moved(old: Damaged, vertices: np.ndarray) -> Damaged:
    return Damaged(TriangleMesh(vertices, old.mesh.faces, old.mesh.name), old.clean, old.keys)


def _inside(mesh: TriangleMesh) -> np.ndarray:
    """Vertices in use that are not on the boundary."""
    rim = mesh.edges[np.bincount(mesh.edge_of_side, minlength=len(mesh.edges)) == 1]
    return np.setdiff1d(np.unique(mesh.faces), rim)


def _split(old: Damaged, apart: np.ndarray) -> Damaged:
    """Let the faces `apart` have vertices of their own along the edges to others."""
    mine, others = np.unique(old.mesh.faces[apart]), np.unique(old.mesh.faces[~apart])
    shared = np.intersect1d(mine, others)
    place = np.arange(len(old.mesh.vertices))
    place[shared] = len(place) + np.arange(len(shared))
    faces = old.mesh.faces.copy()
    faces[apart] = place[faces[apart]]
    return _with(old, faces, old.mesh.vertices[shared], old.clean[shared])


def loose_triangles(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Every triangle with vertices of its own, as in an .stl."""
    corner = old.mesh.faces.ravel()
    mesh = TriangleMesh(old.mesh.vertices[corner], np.arange(len(corner)).reshape(-1, 3), old.mesh.name)
    return Damaged(mesh, old.clean[corner], None if old.keys is None else old.keys[corner])


def mirror_halves(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Two halves that touch, one of them turned round."""
    centre = old.mesh.vertices[old.mesh.faces].mean(axis=1)
    axis = int(rng.integers(3))
    half = centre[:, axis] < np.median(centre[:, axis])
    new = _split(old, half)
    faces = new.mesh.faces.copy()
    faces[half] = faces[half][:, [0, 2, 1]]
    return _with(new, faces)


def islands(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Cut along the borders of islands, as along UV seams."""
    centre = old.mesh.vertices[old.mesh.faces].mean(axis=1)
    seeds = centre[rng.choice(len(centre), 4)]
    nearest = np.linalg.norm(centre[:, None] - seeds, axis=2).argmin(axis=1)
    for k in range(1, len(seeds)):
        if 0 < (nearest == k).sum() < len(centre):
            old = _split(old, nearest == k)
    return old


def _path(mesh: TriangleMesh, rng: np.random.Generator, most: int = 25) -> np.ndarray:
    """Vertices inside, in order, along a shortest way."""
    inside = _inside(mesh)
    if not inside.size:
        return inside
    begin = int(rng.choice(inside))
    distance, before = dijkstra(edge_graph(mesh), indices=begin, return_predecessors=True)
    reached = inside[np.isfinite(distance[inside])]
    way = [int(reached[np.argsort(distance[reached])[int(rng.uniform(0.3, 0.7) * (len(reached) - 1))]])]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    way = [v for v in way if v in set(inside.tolist())]
    return np.array(way[:most])


def _slit(old: Damaged, way: np.ndarray) -> Damaged:
    """Cut along a path of vertices, the ends of which stay."""
    faces = old.mesh.faces
    on_way = {(int(a), int(b)) for a, b in itertools.pairwise(way)}
    left: set[int] = set()
    for k, face in enumerate(faces.tolist()):
        if any((face[i], face[(i + 1) % 3]) in on_way for i in range(3)):
            left.add(k)
    # the whole fan on the left of the way at each inner vertex
    new_faces, extra = faces.copy(), []
    steps = {frozenset(pair) for pair in on_way}
    for v in way[1:-1].tolist():
        around = np.flatnonzero((faces == v).any(axis=1)).tolist()
        fan = {f for f in around if f in left and (faces[f] == v).any()}
        grown = True
        while grown:
            grown = False
            for f in around:
                if f in fan:
                    continue
                for g in list(fan):
                    common = set(faces[f].tolist()) & set(faces[g].tolist())
                    if len(common) == 2 and v in common and frozenset(common) not in steps:
                        fan.add(f)
                        grown = True
        if len(fan) == len(around):
            continue
        name = len(old.mesh.vertices) + len(extra)
        extra.append(v)
        for f in fan:
            new_faces[f][faces[f] == v] = name
    if not extra:
        return old
    return _with(old, new_faces, old.mesh.vertices[extra], old.clean[extra])


def slit(old: Damaged, rng: np.random.Generator) -> Damaged:
    """A cut inside, the sides of which touch."""
    way = _path(old.mesh, rng)
    return _slit(old, way) if len(way) > 3 else old


def closed_lips(old: Damaged, rng: np.random.Generator) -> Damaged:
    """A cut inside that a shape key opens."""
    way = _path(old.mesh, rng, 12)
    if len(way) <= 3:
        return old
    new = _slit(old, way)
    count = len(old.mesh.vertices)
    keys = np.zeros((len(new.mesh.vertices), 3)) if new.keys is None else new.keys.copy()
    keys[count:, 0] = 0.1 * old.mesh.diagonal
    return Damaged(new.mesh, new.clean, keys)


def two_sides(old: Damaged, rng: np.random.Generator) -> Damaged:
    """A second sheet in the same place, turned round, as of cloth; smaller by a corner, so that it is known which."""
    n, faces = len(old.mesh.vertices), old.mesh.faces
    back = faces[:, [0, 2, 1]][: int(0.9 * len(faces))] + n
    return _with(old, np.concatenate([faces, back]), old.mesh.vertices, np.full(n, -1))


def pinholes(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Single faces that are missing."""
    gone = rng.choice(len(old.mesh.faces), max(1, len(old.mesh.faces) // 300), replace=False)
    return _with(old, np.delete(old.mesh.faces, gone, axis=0))


def bow_ties(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Two faces missing that touch in one vertex."""
    faces = old.mesh.faces
    if not (inside := _inside(old.mesh)).size:
        return old
    for _ in range(3):
        v = int(rng.choice(inside))
        around = np.flatnonzero((faces == v).any(axis=1))
        for f in around[1:]:
            if len(np.intersect1d(faces[f], faces[around[0]])) == 1:
                return _with(old, np.delete(faces, [around[0], f], axis=0))
    return old


def handle(old: Damaged, rng: np.random.Generator) -> Damaged:
    """A thin tube between two faces that are near each other."""
    faces, centre = old.mesh.faces, old.mesh.vertices[old.mesh.faces].mean(axis=1)
    away = np.setdiff1d(np.arange(len(faces)), np.flatnonzero(~np.isin(faces, _inside(old.mesh)).all(axis=1)))
    if not away.size:
        return old
    one = int(rng.choice(away))
    around = np.unique(faces[np.isin(faces, faces[one]).any(axis=1)])
    free = away[~np.isin(faces[away], around).any(axis=1)]
    if len(free) < 4:
        return old
    two = int(free[np.argsort(np.linalg.norm(centre[free] - centre[one], axis=1))[3]])
    a, b = faces[one], faces[two][[0, 2, 1]]
    b = np.roll(b, -int(np.argmin(np.linalg.norm(old.mesh.vertices[b] - old.mesh.vertices[a[0]], axis=1))))
    tube = [[a[i], a[(i + 1) % 3], b[(i + 1) % 3]] for i in range(3)] + [[a[i], b[(i + 1) % 3], b[i]] for i in range(3)]
    return _with(old, np.concatenate([np.delete(faces, [one, two], axis=0), np.array(tube)]))


def edges_without_length(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Edges cut in two beside one end, at no distance from it."""
    faces, n = old.mesh.faces.copy(), len(old.mesh.vertices)
    mesh = old.mesh
    inner = np.flatnonzero(mesh.twins > np.arange(len(mesh.twins)))
    if not inner.size:
        return old
    extra, more, touched = [], [], set()
    for side in rng.choice(inner, 6).tolist():
        f, g = side // 3, int(mesh.twins[side]) // 3
        if f in touched or g in touched:
            continue
        touched |= {f, g}
        k = side % 3
        a, b = int(faces[f][(k + 1) % 3]), int(faces[f][(k + 2) % 3])
        name = n + len(extra)
        extra.append(a)
        for face in (f, g):
            other = faces[face].copy()
            other[other == b] = name
            more.append(other)
            faces[face][faces[face] == a] = name
    return _with(old, np.concatenate([faces, np.array(more)]), mesh.vertices[extra], old.clean[extra])


def faces_without_area(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Faces folded flat onto one of their edges: two on each other beside it."""
    mesh, n = old.mesh, len(old.mesh.vertices)
    inner = np.flatnonzero(mesh.twins > np.arange(len(mesh.twins)))
    inner = inner[mesh.face_areas[inner // 3] > 0]  # others have no side on which a wall could stand
    if not inner.size:
        return old
    side = int(rng.choice(inner))
    f, k = divmod(side, 3)
    a, b = int(mesh.faces[f][(k + 1) % 3]), int(mesh.faces[f][(k + 2) % 3])
    faces = mesh.faces.copy()
    c = int(faces[f][k])
    middle = (mesh.vertices[a] + mesh.vertices[b]) / 2
    faces[f] = [c, a, n]
    return _with(old, np.concatenate([faces, [[c, n, b], [a, b, n]]]), middle[None], np.array([-1]))


def duplicate_faces(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Some faces twice, some of those turned round, and a face that names a vertex twice."""
    again = old.mesh.faces[rng.choice(len(old.mesh.faces), 8)].copy()
    again[:4] = again[:4][:, [0, 2, 1]]
    return _with(old, np.concatenate([again, old.mesh.faces, [[again[0, 0], again[0, 0], again[0, 1]]]]))


def inner_faces(old: Damaged, rng: np.random.Generator) -> Damaged:
    """A wall that stands on inner edges."""
    mesh, n = old.mesh, len(old.mesh.vertices)
    inner = np.flatnonzero(mesh.twins > np.arange(len(mesh.twins)))
    inner = inner[mesh.face_areas[inner // 3] > 0]  # others have no side on which a wall could stand
    if not inner.size:
        return old
    side = int(rng.choice(inner))
    f, k = divmod(side, 3)
    a, b = int(mesh.faces[f][(k + 1) % 3]), int(mesh.faces[f][(k + 2) % 3])
    up = mesh.face_vectors[f] / np.linalg.norm(mesh.face_vectors[f])
    top = (mesh.vertices[a] + mesh.vertices[b]) / 2 - np.linalg.norm(mesh.vertices[a] - mesh.vertices[b]) * up
    return _with(old, np.concatenate([mesh.faces, [[a, b, n]]]), top[None], np.array([-1]))


def fins(old: Damaged, rng: np.random.Generator) -> Damaged:
    """A wall of faces along a way over the surface, with three faces at each of its edges."""
    way = _path(old.mesh, rng, 12)
    if len(way) < 2:
        return old
    n, count = len(old.mesh.vertices), len(way)
    up = np.linalg.norm(np.ptp(old.mesh.vertices[way], axis=0)) * 0.2 * rng.normal(size=3)
    i = np.arange(count - 1)
    wall = [np.stack([way[i], way[i + 1], n + i + 1], axis=1), np.stack([way[i], n + i + 1, n + i], axis=1)]
    return _with(old, np.concatenate([old.mesh.faces, *wall]), old.mesh.vertices[way] + up, np.full(count, -1))


def t_junctions(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Edges that are cut in two on one of their sides only."""
    mesh, faces = old.mesh, old.mesh.faces.copy()
    inner = np.flatnonzero(mesh.twins >= 0)
    if not inner.size:
        return old
    more, middle, touched = [], [], set()
    for side in rng.choice(inner, 12).tolist():
        f, k = divmod(side, 3)
        if f in touched or int(mesh.twins[side]) // 3 in touched:
            continue
        touched |= {f, int(mesh.twins[side]) // 3}
        a, b, c = (int(faces[f][(k + j) % 3]) for j in (1, 2, 0))
        name = len(mesh.vertices) + len(middle)
        middle.append((mesh.vertices[a] + mesh.vertices[b]) / 2)
        faces[f] = [c, a, name]
        more.append([c, name, b])
    return _with(old, np.concatenate([faces, np.array(more)]), np.array(middle), np.full(len(middle), -1))


def inside_out(old: Damaged, rng: np.random.Generator) -> Damaged:
    """All faces turned round."""
    return _with(old, old.mesh.faces[:, [0, 2, 1]])


def some_turned(old: Damaged, rng: np.random.Generator) -> Damaged:
    """A third of the faces turned round."""
    faces = old.mesh.faces.copy()
    turned = rng.uniform(size=len(faces)) < 0.33
    faces[turned] = faces[turned][:, [0, 2, 1]]
    return _with(old, faces)


def spikes(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Single vertices far off."""
    if (inside := _inside(old.mesh)).size < 2:
        return old
    chosen = rng.choice(inside, 2, replace=False)
    vertices = old.mesh.vertices.copy()
    vertices[chosen] += rng.uniform(0.5, 20, (2, 1)) * old.mesh.diagonal * rng.choice([-1, 1], (2, 3))
    return _moved(old, vertices)


def rim_spikes(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Single vertices of the boundary far off."""
    rim = np.setdiff1d(np.unique(old.mesh.faces), _inside(old.mesh))
    if rim.size < 2:
        return old
    chosen = rng.choice(rim, 2, replace=False)
    vertices = old.mesh.vertices.copy()
    vertices[chosen] += rng.uniform(2, 20, (2, 1)) * old.mesh.diagonal * rng.choice([-1, 1], (2, 3))
    return _moved(old, vertices)


def stray_vertices(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Vertices in no face, far away."""
    stray = old.mesh.vertices[:5] + 1e3 * old.mesh.diagonal
    return _with(old, old.mesh.faces, stray, np.full(len(stray), -1))


def debris(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Small pieces that fly about."""
    count = 12
    at = old.mesh.vertices[rng.choice(len(old.mesh.vertices), count)] + 0.2 * old.mesh.diagonal * rng.normal(
        size=(count, 3)
    )
    corners = (at[:, None] + 0.01 * old.mesh.diagonal * rng.normal(size=(count, 3, 3))).reshape(-1, 3)
    faces = len(old.mesh.vertices) + np.arange(3 * count).reshape(-1, 3)
    return _with(old, np.concatenate([old.mesh.faces, faces]), corners, np.full(3 * count, -1))


def far_away(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Far from the origin, in double precision."""
    return _moved(old, old.mesh.vertices + old.mesh.diagonal * 10 ** rng.uniform(4, 6) * rng.normal(size=3))


def coarse_numbers(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Far from the origin, in single precision."""
    far = old.mesh.vertices + old.mesh.diagonal * 10 ** rng.uniform(1, 7) * rng.normal(size=3)
    return _moved(old, far.astype(np.float32).astype(np.float64))


def extreme_size(old: Damaged, rng: np.random.Generator) -> Damaged:
    """Very small or very large."""
    return _moved(old, old.mesh.vertices * 10.0 ** rng.choice([-150, -100, -30, 30, 100, 150]))


DAMAGES: tuple[Damage, ...] = (
    loose_triangles,
    mirror_halves,
    islands,
    slit,
    closed_lips,
    two_sides,
    pinholes,
    bow_ties,
    handle,
    edges_without_length,
    faces_without_area,
    duplicate_faces,
    inner_faces,
    fins,
    t_junctions,
    inside_out,
    some_turned,
    spikes,
    rim_spikes,
    stray_vertices,
    debris,
    far_away,
    coarse_numbers,
    extreme_size,
)


@dataclass(frozen=True)
class Outcome:
    """What came of a damaged pair.

    Attributes
    ----------
    kind : str
        "same": the map of the clean pair; "refused": a sentence; "doubted": another map, but said to be doubtful;
        "silent": another map, and no word.
    error : float
        Mean distance from the clean pair's map, in % of the source's diagonal; nan where refused.
    text : str
        The refusal, or what was said.
    """

    kind: str
    error: float
    text: str


class Clean:
    """A clean pair and its map, to compare with what comes of damaged ones."""

    def __init__(self, source: TriangleMesh, target: TriangleMesh, settings: AlignSettings) -> None:
        self.source, self.target, self.settings = source, target, settings
        self.places = correspond(align(source, target, settings)).matrix() @ source.vertices

    def outcome(self, damages: Sequence[Damage], side: str, seed: int) -> Outcome:
        """Damage the source or the target, in the order given, and align."""
        rng = np.random.default_rng(seed)
        new = undamaged(self.source if side == "source" else self.target)
        try:
            for damage in damages:
                new = damage(new, rng)
            own = prepare(new.mesh, self.settings, keys=new.keys)
            pair = (own, self.target) if side == "source" else (self.source, own)
            alignment = align(*pair, self.settings)
        except MeshError as refusal:
            return Outcome("refused", float("nan"), str(refusal))
        found = correspond(alignment)
        corners = found.source_triangles[found.face]
        if side == "source":
            corners = new.clean[corners]
            which = np.arange(len(found.face))
        else:
            which = new.clean
        known = (found.face >= 0) & (which >= 0) & (corners >= 0).all(axis=1)
        places = np.einsum("qk,qkd->qd", found.barycentric[known], self.source.vertices[corners[known]])
        apart = np.linalg.norm(places - self.places[which[known]], axis=1)
        error = float(100 * apart.mean() / self.source.diagonal)
        said = "; ".join(alignment.warnings)
        if not known.any() or known.sum() < 0.5 * len(self.target.vertices):
            return Outcome("silent", float("nan"), "hardly anything is mapped; " + said)
        if error <= SAME:
            return Outcome("same", error, said)
        return Outcome("doubted" if "doubtful" in said else "silent", error, said)
