"""Normal maps between surfaces whose normals are known."""

import numpy as np
import pytest
from correspondences import planar_correspondence, sheet

from solver import Correspondence, TriangleMesh
from solver.carry.frames import local_similarities
from solver.carry.textures import Carrying, FromCorners, InLayout, TangentFrames, TurnedNormals, Turns, Wanted, resample


def frames(mesh: TriangleMesh, uv: np.ndarray, normals: np.ndarray) -> TangentFrames:
    """Frames of a layout that is an affine map of the sheet's plane: along u, at right angles to the normals."""
    corners = mesh.vertices[mesh.faces]
    sides, plane = (np.stack([x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]], axis=1) for x in (corners, uv))
    slope = np.linalg.inv(plane) @ sides  # change of position along u and v
    normal = normals[mesh.faces]
    tangent = slope[:, None, 0] - (slope[:, None, 0] * normal).sum(axis=2, keepdims=True) * normal
    # one at each vertex, as MikkTSpace has it within an island
    total = np.zeros_like(mesh.vertices)
    np.add.at(total, mesh.faces.ravel(), tangent.reshape(-1, 3))
    tangent = (total / np.linalg.norm(total, axis=1, keepdims=True))[mesh.faces]
    turned = (np.cross(normal, tangent) * slope[:, None, 1]).sum(axis=2)
    return TangentFrames(normal, tangent, np.sign(turned))


def object_normals(
    pixels: np.ndarray, known: np.ndarray, at: TangentFrames, carrying: Carrying, uv: np.ndarray
) -> np.ndarray:
    """A normal map decoded into the target's space, texel by texel."""
    finder = InLayout.of(carrying, uv, known.shape)
    texels = finder.texels(0, len(known))[0][known]
    normal, tangent, bitangent = at.at(texels["triangle"], texels["corner"])
    given = 2 * pixels[known] - 1
    result = given[:, :1] * tangent + given[:, 1:2] * bitangent + given[:, 2:] * normal
    return result / np.linalg.norm(result, axis=1, keepdims=True)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("turn", [0.0, 0.9])
def test_a_normal_map_shows_the_same_normals_on_another_triangulation_layout_and_pose(
    mirrored: bool, turn: float
) -> None:
    """A cylinder with grooves: what the map says on the source, turned and mirrored as the target is."""
    plane = sheet(41)[0], sheet(29, 37)[0]
    rng = np.random.default_rng(3)
    pose = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    pose *= np.sign(np.linalg.det(pose)) * (np.array([-1, 1, 1])[:, None] if mirrored else 1)

    def around(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, y = points[:, 0], points[:, 1]
        normal = np.stack([np.sin(x), np.zeros_like(x), np.cos(x)], axis=1)
        return np.stack([np.sin(x), y, np.cos(x)], axis=1), normal

    def wanted(points: np.ndarray) -> np.ndarray:
        """Normals of grooves askew, in the source's space."""
        x, y = points[:, 0], points[:, 1]
        along = np.stack([np.cos(x), np.zeros_like(x), -np.sin(x)], axis=1)
        depth = 0.4 * np.sin(4 * x + 3 * y)[:, None]
        normal = around(points)[1] + depth * along + 0.5 * depth * np.array([0, 1, 0])
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)

    places = [around(mesh.vertices) for mesh in plane]
    source = TriangleMesh(places[0][0], plane[0].faces)
    flip = plane[1].faces[:, ::-1] if mirrored else plane[1].faces
    target = TriangleMesh(places[1][0] @ pose.T * 2.5 + 7, flip)
    flat = planar_correspondence(*plane)
    found = Correspondence(
        flat.face, flat.barycentric, flat.matched, flat.confidence, flat.source_triangles, flat.source_size
    )
    carrying = Carrying(found, source, target)
    spin = np.exp(1j * turn) * (plane[1].vertices[:, 0] + 1j * plane[1].vertices[:, 1]) * 0.34
    own = np.stack([spin.real + 0.5, spin.imag + 0.5], axis=1)[target.faces]
    source_uv = (plane[0].vertices[:, :2] * [0.4, -0.45] + 0.5)[source.faces]  # mirrored, and not square
    normals = places[0][1], places[1][1] @ pose.T
    there = frames(source, source_uv, normals[0]), frames(target, own, normals[1])
    # what a picture of the source would hold, at its corners
    flat_corner = plane[0].vertices[source.faces].reshape(-1, 3)
    normal, tangent, sign = (x.reshape(-1, *x.shape[2:]) for x in (there[0].normal, there[0].tangent, there[0].sign))
    bitangent = sign[:, None] * np.cross(normal, tangent)
    truth = wanted(flat_corner)
    held = np.stack([(truth * axis).sum(axis=1) for axis in (tangent, bitangent, normal)], axis=1)
    paint = FromCorners((held / 2 + 0.5).reshape(-1, 3, 3))
    rotation = local_similarities(found, source, target)[0]
    size = (200, 200)
    turned = TurnedNormals(paint, Turns(carrying, there[0], there[1], rotation))
    got = resample(InLayout.of(carrying, own, size), size, [Wanted(turned, np.asarray)])
    shown = object_normals(got.pixels[0], got.known, there[1], carrying, own)
    position = FromCorners(np.broadcast_to(plane[0].vertices[source.faces], (*source.faces.shape, 3)))
    where = resample(InLayout.of(carrying, own, size), size, [Wanted(position, np.asarray)]).pixels[0][got.known]
    expected = wanted(where.astype(float)) @ pose.T
    angle = np.degrees(np.arccos(np.clip((shown * expected).sum(axis=1), -1, 1)))
    assert got.known.mean() > 0.4
    assert angle.mean() < 1.0
    assert np.percentile(angle, 99) < 4.0


def test_what_is_flat_stays_flat() -> None:
    source, target = sheet(12)[0], sheet(9)[0]
    bent = TriangleMesh(
        target.vertices + np.random.default_rng(0).normal(scale=0.03, size=target.vertices.shape), target.faces
    )
    carrying = Carrying(planar_correspondence(source, target), source, bent)
    uv = [(mesh.vertices[:, :2] / 2 + 0.5)[mesh.faces] for mesh in (source, target)]
    there = [frames(mesh, x, mesh.vertex_normals()) for mesh, x in zip((source, bent), uv, strict=True)]
    paint = FromCorners(np.tile([0.5, 0.5, 1.0], (len(source.faces), 3, 1)))
    rotation = local_similarities(carrying.correspondence, source, bent)[0]
    turned = TurnedNormals(paint, Turns(carrying, there[0], there[1], rotation))
    found = resample(InLayout.of(carrying, uv[1], (50, 50)), (50, 50), [Wanted(turned, np.asarray)])
    assert np.abs(found.pixels[0][found.known] - [0.5, 0.5, 1]).max() < 1e-5
