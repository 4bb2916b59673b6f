"""Pairs of closed surfaces whose true correspondence is known, of every kind there is data of."""

import importlib.util
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from solver import TriangleMesh, topology
from solver.surface.barycentric import interpolated
from tests.bench.correspondence.pairs import Pair, Places, Shape, pair, tooth
from tests.bench.correspondence.store import Store
from tests.bench.heads.people import read_head
from tests.bench.paper.data import DATA, absent, read
from tests.solver.scans import mirrored, posed

RINGS = 3
"""Rings of triangles that close an opening."""

AMPLITUDE, WAVES = 0.03, 6.0
"""Of the smooth bend, in roots of the surface's area: the middle of a face moves by 1 to 2 % of the diagonal."""

BONES = ("capitate", "hamate", "lunate", "scaphoid", "trapezium", "trapezoid", "triquetrum", "1mc", "2mc", "3mc")
"""Of a hand: seven of the wrist, and the long ones of thumb, index and middle finger; spheres without repair."""

TEETH = (("K04", "K05"), ("i14", "i15"), ("H10", "H19"), ("x02", "x17"))


def capped(mesh: TriangleMesh) -> tuple[TriangleMesh, np.ndarray]:
    """Return a disc closed by rings of triangles around the middle of its rim, and which faces are its own, (m,) bool.

    Two discs with the same faces are closed alike.
    """
    (loop,) = topology(mesh).boundary_loops
    rim, middle = mesh.vertices[loop], mesh.vertices[loop].mean(axis=0)
    size, count = len(loop), len(mesh.vertices)
    inner = [middle + (rim - middle) * (1 - k / RINGS) for k in range(1, RINGS)]
    names = [loop, *(count + size * k + np.arange(size) for k in range(RINGS - 1))]
    last = count + size * (RINGS - 1)
    faces = [mesh.faces]
    for outer, ring in pairwise(names):
        a, b, c, d = outer, np.roll(outer, -1), np.roll(ring, -1), ring
        faces += [np.stack([b, a, d], axis=1), np.stack([b, d, c], axis=1)]
    faces.append(np.stack([np.roll(names[-1], -1), names[-1], np.full(size, last)], axis=1))
    vertices = np.concatenate([mesh.vertices, *inner, middle[None]])
    closed = TriangleMesh(vertices, np.concatenate(faces), mesh.name)
    if not topology(closed).is_sphere:
        raise ValueError(f"'{mesh.name}' is no sphere when it is closed")
    return closed, np.arange(len(closed.faces)) < len(mesh.faces)


def bent(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """Return the mesh bent smoothly; vertex i is vertex i."""
    middle, size = mesh.vertices[mesh.used].mean(axis=0), np.sqrt(mesh.area)
    x = (mesh.vertices - middle) / size
    x = x + AMPLITUDE * np.sin(WAVES * x[:, [1, 2, 0]] + np.random.default_rng(seed).uniform(0, 6, 3))
    return TriangleMesh(middle + size * x, mesh.faces, mesh.name)


def _both_ways(kind: str, one: Shape, other: Shape, store: Store, seed: int, moved: bool = True) -> Iterator[Pair]:
    """Yield both directions, the target decimated to 70 %, its vertices moved along the surface, posed at random."""
    yield pair(kind, one, other, one.landmarks is None, seed, store, elsewhere=moved)
    yield pair(kind, other, one, one.landmarks is None, seed + 1, store, elsewhere=moved)


def cortex(store: Store) -> Iterator[Pair]:
    """Left and mirrored right: as they come, and meshed anew."""
    left, right = (read(f"closed/conte69_{side}.ply") for side in ("L", "R_mirrored"))
    left, right = _called(left, "left"), _called(right, "right, mirrored")
    rng = np.random.default_rng(0)
    for source, target in ((left, right), (right, left)):
        face = rng.choice(len(target.faces), 20_000, p=target.face_areas / target.area)
        share = rng.dirichlet(np.ones(3), len(face))
        truth = interpolated(source.vertices, source.faces[face], share)
        yield Pair("cortex", f"{source.name} > {target.name}", source, target, Places(face, share, truth), None)
    yield from _both_ways("cortex, meshed anew", Shape(left), Shape(right), store, 0)


def layers(store: Store) -> Iterator[Pair]:
    """The surfaces of one cortex: grey matter on white, and white matter blown up until no furrow is left."""
    if (folder := _package("nilearn", "datasets/data/fsaverage5")) is None:
        return
    white, pial, inflated = (Shape(_gifti(folder / f"{name}_left.gii.gz")) for name in ("white", "pial", "infl"))
    yield from _both_ways("pial, white", pial, white, store, 10)
    yield from _both_ways("white, inflated", white, inflated, store, 12)


def statues(store: Store) -> Iterator[Pair]:
    """David's head and a brain, bent."""
    for k, name in enumerate(("david", "brain")):
        mesh = _called(read(f"closed/{name}.ply"), name)
        yield from _both_ways("bent", Shape(mesh), Shape(_called(bent(mesh, k), f"{name}, bent")), store, 20 + 2 * k)


def heads(store: Store) -> Iterator[Pair]:
    """Skins of two people each, with mouth bag and sockets, closed at the neck."""
    for k, (one, other) in enumerate((("mpfb_woman", "mpfb_man"), ("ict_1", "ict_2"))):
        yield from _both_ways("heads", _skin(one), _skin(other), store, 30 + 2 * k)


def bones(store: Store) -> Iterator[Pair]:
    """Bones of a hand, bent; every third one of the other hand."""
    if (folder := _package("myo_sim", "models/meshes")) is None:
        return
    for k, name in enumerate(BONES):
        mesh = _stl(folder / f"{name}.stl")
        found = next(_both_ways("bones", Shape(mesh), Shape(_called(bent(mesh, k), f"{name}, bent")), store, 40 + k))
        yield _of_the_other_hand(found) if k % 3 == 2 else found


def _of_the_other_hand(given: Pair) -> Pair:
    """Return the pair with the target mirrored; its faces, and with them the corners of places, run the other way."""
    known = given.known
    places = Places(known.face, known.barycentric[:, ::-1], known.truth)
    return replace(given, target=mirrored(given.target), surface=places, reflected=True)


def teeth(store: Store) -> Iterator[Pair]:
    """Molars of one genus each, closed at the root; landmarks."""
    for k, (one, other) in enumerate(TEETH):
        yield from _both_ways("teeth", *(_closed_tooth(name) for name in (one, other)), store, 60 + 2 * k, moved=False)


def limbs(store: Store) -> Iterator[Pair]:
    """Hands, feet and heads of different people, closed where they were cut off; one of each kind mirrored."""
    del store
    for fact in json.loads((DATA / "bodyparts/pairs.json").read_text(encoding="utf-8")):
        if fact["kind"] == "ear" or fact["extra"]:
            continue
        with np.load(DATA / "bodyparts" / fact["truth"]) as truth:
            if "face" not in truth.files or not len(truth["face"]):
                continue
            known = Places(truth["face"], truth["barycentric"], truth["truth"])
        source, target = (capped(read(f"bodyparts/{fact[side]}"))[0] for side in ("source", "target"))
        yield Pair(fact["kind"], fact["name"], source, target, known, None, fact["reflected"])


KINDS: dict[str, Callable[[Store], Iterator[Pair]]] = {
    "cortex": cortex,
    "layers": layers,
    "bent": statues,
    "heads": heads,
    "bones": bones,
    "teeth": teeth,
    "limbs": limbs,
}


def pairs_of(kind: str, store: Store) -> Iterator[Pair]:
    """Yield the pairs of a kind; nothing, and says why, where its data is missing."""
    if reason := absent("closed/conte69_L.ply"):
        print(f"{kind} skipped: {reason}")
        return
    yield from KINDS[kind](store)


def bodies() -> tuple[TriangleMesh, TriangleMesh]:
    """Return the skins of two whole people, closed, one of them in another pose and size: no sphere holds them."""
    one, other = (_skin_of(name) for name in ("mpfb_woman_body", "mpfb_man_body"))
    return one, posed(other, 3)


def _called(mesh: TriangleMesh, name: str) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces, name)


def _skin_of(name: str) -> TriangleMesh:
    head = read_head(DATA / "heads", name)
    return _compact(head.mesh.faces[head.part_of_triangle == 0], head.mesh.vertices, name)


def _skin(name: str) -> Shape:
    mesh, own = capped(_skin_of(name))
    return Shape(mesh, known=own)


def _closed_tooth(name: str) -> Shape:
    shape = tooth(name)
    return replace(shape, mesh=capped(shape.mesh)[0])


def _compact(faces: np.ndarray, vertices: np.ndarray, name: str) -> TriangleMesh:
    used, inverse = np.unique(faces, return_inverse=True)
    return TriangleMesh(vertices[used], inverse.reshape(-1, 3), name)


def _package(name: str, inside: str) -> Path | None:
    """Return a folder of a package that ships surfaces, without importing it; None, and says so, if it is not there."""
    found = importlib.util.find_spec(name)
    if found is None or not found.submodule_search_locations:
        print(f"skipped: the package '{name}' is not installed: uv sync --group anatomy")
        return None
    return Path(found.submodule_search_locations[0]) / inside


def _gifti(path: Path) -> TriangleMesh:
    import nibabel

    points, triangles = nibabel.load(path).agg_data(("pointset", "triangle"))
    return TriangleMesh(np.float64(points), np.int64(triangles), path.name.split("_")[0])


def _stl(path: Path) -> TriangleMesh:
    data = path.read_bytes()
    record = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("more", "<u2")])
    corners = np.frombuffer(data, record, int.from_bytes(data[80:84], "little"), 84)["corner"].reshape(-1, 3)
    vertices, inverse = np.unique(corners.astype(float), axis=0, return_inverse=True)
    return TriangleMesh(vertices, inverse.reshape(-1, 3), path.stem)
