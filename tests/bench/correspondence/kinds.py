"""Kinds of surface that are hard: parts of bodies, noise, depth scans, coarse meshes."""

import json
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from solver import TriangleMesh, cleaned, topology
from solver.surface.barycentric import interpolated
from tests.bench.paper.data import DATA, absent, read
from tests.solver.scans import bumps, posed

from .pairs import ICT, SIMPOP, Pair, Places, ict, nearest, pair, simpop, surface_points
from .store import Store

FACES = tuple((simpop, *names) for names in SIMPOP) + tuple((ict, *names) for names in ICT)

NOISE = (0.001, 0.003)
"""Standard deviations of the noise, as shares of the diagonal: of a good and of a cheap scanner."""

RAYS = 160
"""Rays across the width of a face, as of a depth camera at arm's length."""


def bodyparts(store: Store, count: int | None) -> Iterator[Pair]:
    """Yield hands, feet, ears and heads of different people; one of each kind mirrored. The third head has no truth."""
    del store
    if reason := absent("bodyparts/pairs.json"):
        print(f"bodyparts skipped: {reason}")
        return
    facts = json.loads((DATA / "bodyparts/pairs.json").read_text(encoding="utf-8"))
    for fact in facts[:count]:
        source, target = (read(f"bodyparts/{fact[side]}") for side in ("source", "target"))
        with np.load(DATA / "bodyparts" / fact["truth"]) as truth:
            if "face" not in truth.files or not len(truth["face"]):
                continue
            known = Places(truth["face"], truth["barycentric"], truth["truth"])
        name = fact["name"].removesuffix(" mirrored")
        yield Pair(fact["kind"], name, source, target, known, None, fact["reflected"], bool(fact["extra"]))


def noisy(store: Store, count: int | None) -> Iterator[Pair]:
    """Yield faces with noise on both sides, independent in every coordinate of every vertex."""
    if reason := absent("faces_ict/ict_ground_truth.json"):
        print(f"noise skipped: {reason}")
        return
    for k, (shape, a, b) in enumerate(FACES[:count]):
        for amount in NOISE:
            kind = f"noise {100 * amount:.1f} %"
            clean = pair(kind, shape(a), shape(b), True, 2 * k, store)
            rng = np.random.default_rng(k)
            source, target = (_with_noise(mesh, amount, rng) for mesh in (clean.source, clean.target))
            known = _on_source(clean, source)
            yield replace(clean, source=source, target=target, surface=known, landmarks=None)


def _with_noise(mesh: TriangleMesh, amount: float, rng: np.random.Generator) -> TriangleMesh:
    shift = rng.normal(scale=amount * mesh.diagonal, size=mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + shift, mesh.faces, mesh.name)


def _on_source(clean: Pair, source: TriangleMesh) -> Places:
    """Return the pair's points with their truth on another surface with the source's faces."""
    assert clean.surface is not None
    normals = clean.source.vertex_normals()
    guess = normals[clean.source.faces].mean(axis=1)
    face, weights = nearest(clean.onto, clean.surface.truth, guess[_nearest_faces(clean, clean.surface.truth)])
    return replace(clean.surface, truth=interpolated(source.vertices, source.faces[face], weights))


def _nearest_faces(clean: Pair, points: np.ndarray) -> np.ndarray:
    face, _ = nearest(clean.onto, points, np.zeros_like(points))
    return face


def depth_scans(store: Store, count: int | None) -> Iterator[Pair]:
    """Yield faces against what a depth camera sees of another one from up to 25 degrees to the side."""
    if reason := absent("faces_ict/ict_ground_truth.json"):
        print(f"depth skipped: {reason}")
        return
    for k, (shape, a, b) in enumerate(FACES[:count]):
        source, target = shape(a), shape(b)
        rng = np.random.default_rng(k)
        kept = store.kept(f"depth {b} {k} {RAYS}", lambda target=target, rng=rng: _seen(target.mesh, rng))
        scan = TriangleMesh(kept["vertices"], kept["faces"], f"{target.mesh.name} seen")
        face = rng.choice(len(scan.faces), 20_000, p=scan.face_areas / scan.area)
        barycentric = rng.dirichlet(np.ones(3), len(face))
        position = interpolated(scan.vertices, scan.faces[face], barycentric)
        there, weights = nearest(surface_points(target.mesh), position, scan.face_vectors[face])
        truth = interpolated(source.mesh.vertices, source.mesh.faces[there], weights)
        good = np.ones(len(face), bool) if target.known is None else target.known[there]
        known = Places(face[good], barycentric[good], truth[good])
        # what the mouth and the nose hide from the camera leaves openings
        openings = len(topology(scan).boundary_loops) > 1
        name = f"{source.mesh.name} > {scan.name}"
        yield Pair("depth", name, source.mesh, posed(scan, k), known, None, False, openings)


def _seen(mesh: TriangleMesh, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Return what a camera in front of a face sees on a grid of rays, cut where the depth jumps, less small pieces."""
    import bpy  # noqa: F401  (mathutils is there once it is)
    from mathutils.bvhtree import BVHTree

    # faces look along the axis in which their rim, flat around the face, is thinnest
    rim = mesh.vertices[topology(mesh).boundary_loops[0]]
    front = np.linalg.svd(rim - rim.mean(axis=0))[2][2]
    front *= np.sign((mesh.vertices.mean(axis=0) - rim.mean(axis=0)) @ front)
    aside = np.cross(front, rng.normal(size=3))
    aside /= np.linalg.norm(aside)
    angle = np.radians(rng.uniform(0, 25))
    view = np.cos(angle) * front + np.sin(angle) * aside
    right = np.cross(view, np.eye(3)[np.argmin(np.abs(view))])
    right /= np.linalg.norm(right)
    up = np.cross(view, right)
    across = mesh.vertices @ np.stack([right, up, view], axis=1)
    low, high = across.min(axis=0), across.max(axis=0)
    step = (high[0] - low[0]) / RAYS
    x, y = np.arange(low[0], high[0], step), np.arange(low[1], high[1], step)
    tree = BVHTree.FromPolygons(mesh.vertices.tolist(), mesh.faces.tolist())
    points = np.full((len(x), len(y), 3), np.nan)
    for i, horizontal in enumerate(x):
        for j, vertical in enumerate(y):
            begin = horizontal * right + vertical * up + (high[2] + 1) * view
            hit = tree.ray_cast(begin.tolist(), (-view).tolist())[0]
            if hit is not None:
                points[i, j] = hit
    number = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    flat = points.reshape(-1, 3)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    corner = flat[faces]
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    faces = faces[longest < 6 * step]  # nan compares false
    while True:
        used, place = np.unique(faces, return_inverse=True)
        whole = cleaned(TriangleMesh(flat[used], place.reshape(-1, 3), "seen"), largest_part=True).mesh
        pinched = np.isin(whole.faces, topology(whole).non_manifold_vertices).any(axis=1)
        if not pinched.any():
            break
        faces = used[whole.faces[~pinched]]
    used, place = np.unique(whole.faces, return_inverse=True)
    return {"vertices": whole.vertices[used], "faces": place.reshape(-1, 3)}


def coarse(store: Store, count: int | None) -> Iterator[Pair]:
    """Yield sheets against much coarser ones of the same relief, and the other way."""
    del store
    for seed in range(6 if count is None else count):
        fine, few = bumps(2000, seed=seed), bumps(120, seed=seed)
        rng = np.random.default_rng(seed)
        for k, (source, target) in enumerate(((few, fine), (fine, few))):
            face = rng.choice(len(target.faces), 5000, p=target.face_areas / target.area)
            barycentric = rng.dirichlet(np.ones(3), len(face))
            position = interpolated(target.vertices, target.faces[face], barycentric)
            there, weights = nearest(surface_points(source), position, target.face_vectors[face])
            truth = interpolated(source.vertices, source.faces[there], weights)
            known = Places(face, barycentric, truth)
            name = f"{len(source.faces)} > {len(target.faces)} triangles, {seed}"
            yield Pair("coarse", name, source, posed(target, 2 * seed + k), known, None)
