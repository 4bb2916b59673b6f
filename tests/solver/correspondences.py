import numpy as np

from solver import Correspondence, TriangleMesh
from solver.flatten.locate import TriangulatedDisc


def planar_correspondence(source: TriangleMesh, target: TriangleMesh) -> Correspondence:
    """The correspondence of two triangulations of one plane region: each point to itself."""
    plane = [mesh.vertices[:, 0] + 1j * mesh.vertices[:, 1] for mesh in (source, target)]
    face, barycentric = TriangulatedDisc.of(plane[0], source.faces).locate(plane[1])
    everywhere = np.ones(len(face), bool)
    return Correspondence(face, barycentric, everywhere, everywhere.astype(float), source.faces, len(source.vertices))


def sheet(n: int, m: int | None = None) -> tuple[TriangleMesh, np.ndarray]:
    """A square sheet over [-1, 1] squared of n x m vertices, and the quad of each triangle."""
    m = m or n
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, m))
    at = np.arange(n * m).reshape(m, n)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(n * m)], axis=1)
    return TriangleMesh(vertices, triangles), np.repeat(np.arange(len(quads)), 2)


def on_itself(mesh: TriangleMesh, seed: int) -> Correspondence:
    """Each vertex at itself, located in any of the triangles around it: nothing prefers one side of a seam."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(mesh.faces.size)
    face = np.zeros(len(mesh.vertices), int)
    face[mesh.faces.ravel()[order]] = order // 3
    barycentric = (mesh.faces[face] == np.arange(len(mesh.vertices))[:, None]).astype(float)
    everywhere = np.ones(len(face), bool)
    return Correspondence(face, barycentric, everywhere, everywhere.astype(float), mesh.faces, len(mesh.vertices))
