"""Second scans with ground truth: another pose, another scale, other vertices, another triangulation."""

import numpy as np
from scipy.spatial import Delaunay
from surfaces import planar, rings

from solver import Correspondence, TriangleMesh, flatten


def similarity(rng: np.random.Generator) -> tuple[float, np.ndarray, np.ndarray]:
    """A random scale in [0.2, 5], rotation (3, 3) and translation (3,)."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return float(rng.uniform(0.2, 5)), turn * np.sign(np.linalg.det(turn)), 10 * rng.normal(size=3)


def posed(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """The mesh through a random similarity."""
    scale, turn, shift = similarity(np.random.default_rng(seed))
    return TriangleMesh(scale * mesh.vertices @ turn + shift, mesh.faces, mesh.name)


def mirrored(mesh: TriangleMesh) -> TriangleMesh:
    """The mirror image of the mesh, its faces counter-clockwise from outside again."""
    return TriangleMesh(mesh.vertices * [-1, 1, 1], mesh.faces[:, ::-1], mesh.name)


def shuffled(mesh: TriangleMesh, seed: int) -> tuple[TriangleMesh, np.ndarray]:
    """The mesh with its vertices and faces in random order, and the old vertex of each new one."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(mesh.vertices))
    faces = rng.permutation(np.argsort(order)[mesh.faces])
    return TriangleMesh(mesh.vertices[order], faces, mesh.name), order


def remeshed(mesh: TriangleMesh, share: float, seed: int) -> tuple[TriangleMesh, np.ndarray]:
    """A random `share` of the vertices, triangulated anew, and the old vertex of each new one.

    The new edges are those of a Delaunay triangulation in the disc; every second vertex of the boundary stays.
    """
    rng = np.random.default_rng(seed)
    flattening = flatten(mesh)
    disc = flattening.disc
    inside = np.setdiff1d(np.unique(mesh.faces), flattening.boundary)
    kept = np.concatenate([rng.permutation(inside)[: round(share * len(inside))], flattening.boundary[::2]])
    triangles = Delaunay(np.column_stack([disc[kept].real, disc[kept].imag])).simplices.astype(int)
    a, b, c = disc[kept][triangles].T
    turned = np.imag(np.conj(b - a) * (c - a))
    triangles = np.where((turned < 0)[:, None], triangles[:, ::-1], triangles)
    # slivers between three neighbours on the circle are none of the surface
    return TriangleMesh(mesh.vertices[kept], triangles[np.abs(turned) > 1e-9], mesh.name), kept


def bumps(vertices: int, seed: int, folds: int = 1, bend: float = 0.0) -> TriangleMesh:
    """A round sheet with hills and dents, the same after a turn by 360 / `folds` degrees.

    Parameters
    ----------
    vertices : int
        About how many.
    seed : int
        Of the hills; the same ones with any number of vertices.
    folds : int
        1: no symmetry.
    bend : float
        Angle in radians by which the sheet is rolled up, an isometry.
    """
    count = round(np.sqrt(vertices / 3))
    flat = planar(rings(count, jitter=0.25, seed=count))
    x = flat.vertices[:, 0] + 1j * flat.vertices[:, 1]
    rng = np.random.default_rng(seed)
    height = np.zeros(len(x))
    for _ in range(12 // folds):
        centre = 0.75 * np.sqrt(rng.random()) * np.exp(2j * np.pi * rng.random())
        size, amount = rng.uniform(0.08, 0.2), rng.choice([-1, 1]) * rng.uniform(0.5, 1)
        for k in range(folds):
            turn = np.exp(2j * np.pi * k / folds)
            height += amount * size * np.exp(-(np.abs(x - centre * turn) ** 2) / (2 * size**2))
    if bend == 0:
        return TriangleMesh(np.column_stack([x.real, x.imag, height]), flat.faces, "bumps")
    angle, radius = bend * x.real / 2, 2 / bend + height
    return TriangleMesh(
        np.column_stack([radius * np.sin(angle), x.imag, radius * np.cos(angle) - 2 / bend]), flat.faces, "bumps"
    )


def places(correspondence: Correspondence, source: TriangleMesh) -> np.ndarray:
    """Where on the source each target vertex goes, (n_target, 3)."""
    return correspondence.matrix() @ source.vertices


def percent(found: np.ndarray, expected: np.ndarray, mesh: TriangleMesh) -> np.ndarray:
    """Distances of points in % of the mesh's diagonal, (n,)."""
    return 100 * np.linalg.norm(found - expected, axis=1) / mesh.diagonal


def mutual_pairs(found: np.ndarray, expected: np.ndarray) -> int:
    """How many points found are nearest to the one expected, which is nearest to them."""
    distance = np.linalg.norm(found[:, None] - expected, axis=2)
    nearest, back = distance.argmin(axis=1), distance.argmin(axis=0)
    return int(((nearest == np.arange(len(found))) & (back == np.arange(len(found)))).sum())
