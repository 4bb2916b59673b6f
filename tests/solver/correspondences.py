import numpy as np

from solver import Correspondence, TriangleMesh
from solver.flatten.locate import TriangulatedDisc


def planar_correspondence(source: TriangleMesh, target: TriangleMesh) -> Correspondence:
    """The correspondence of two triangulations of one plane region: each point to itself."""
    plane = [mesh.vertices[:, 0] + 1j * mesh.vertices[:, 1] for mesh in (source, target)]
    face, barycentric = TriangulatedDisc.of(plane[0], source.faces).locate(plane[1])
    everywhere = np.ones(len(face), bool)
    return Correspondence(face, barycentric, everywhere, everywhere.astype(float), source.faces, len(source.vertices))
