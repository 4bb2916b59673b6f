"""Normal maps: decoded in the source's tangent frames, turned with the surface, encoded in the target's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...surface.mesh import Floats
from .carrying import Carrying
from .paints import Paint, Texels, Values, at_corners
from .picture import Pixels


@dataclass(frozen=True, eq=False)
class TangentFrames:
    """Tangent frames at the corners of triangles, as of MikkTSpace: the bitangent is sign * (normal x tangent).

    Attributes
    ----------
    normal, tangent : (m, 3, 3) float64
    sign : (m, 3) float64
        1 or -1.
    """

    normal: Floats
    tangent: Floats
    sign: Floats

    def at(self, triangle: np.ndarray, place: Values) -> tuple[Values, Values, Values]:
        """Return unit normals, tangents and bitangents, (k, 3) each, at places in triangles; see `at_corners`."""
        normal = _unit(at_corners(self.normal, triangle, place))
        tangent = at_corners(self.tangent, triangle, place)
        tangent = _unit(tangent - _dot(tangent, normal) * normal)
        sign = self.sign[:, 0].astype(np.float32)[triangle, None]  # one for a triangle: its UVs are mirrored or not
        return normal, tangent, sign * np.cross(normal, tangent)


@dataclass(frozen=True, eq=False)
class Turns:
    """How what a normal map says along the source's tangents lies along the target's: four numbers to a texel.

    What a normal map shows is the surface's detail, relative to its smooth normals. So the source's tangents are turned
    with the surface and laid into the target's tangent plane, and what is flat on the source is flat on the target,
    whatever their shapes. Where the map mirrors, the detail is mirrored.

    Attributes
    ----------
    carrying : Carrying
    source, target : TangentFrames
    rotation : (n, 3, 3) float64
        What turns directions of the source into directions around each vertex of the target; see `local_similarities`.
    """

    carrying: Carrying
    source: TangentFrames
    target: TangentFrames
    rotation: Floats

    channels = 4

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write where the source's tangent and bitangent lie, each along the target's two; see `Paint`."""
        rows = np.flatnonzero(texels["face"] >= 0)
        texel = texels[rows]
        _, tangent, bitangent = self.source.at(texel["face"], texel["place"])
        vertex = self.carrying.target.faces[texel["triangle"]]
        corner = texel["corner"]
        turn = self.rotation.astype(np.float32)[vertex]
        one, two = turn[:, 1] - turn[:, 0], turn[:, 2] - turn[:, 0]
        turn = turn[:, 0] + corner[:, :1, None] * one + corner[:, 1:, None] * two
        own_normal, own_tangent, own_bitangent = self.target.at(texel["triangle"], corner)
        for k, axis in enumerate((tangent, bitangent)):
            laid = np.einsum("qij,qj->qi", turn, axis)
            laid = _unit(laid - _dot(laid, own_normal) * own_normal)
            out[rows, 2 * k], out[rows, 2 * k + 1] = _dot(laid, own_tangent)[:, 0], _dot(laid, own_bitangent)[:, 0]


@dataclass(frozen=True, eq=False)
class KeptTurns:
    """`Turns` that were kept beside a transfer map, (height, width, 4) float32, for the texels of that map."""

    pixels: Pixels

    channels = 4

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write what was kept of each texel; see `Paint`."""
        out[:] = self.pixels.reshape(-1, 4)[texels["triangle"]]


@dataclass(frozen=True, eq=False)
class TurnedNormals:
    """Tangent space normals of the source as ones of the target, from -1 to 1.

    Attributes
    ----------
    paint : Paint
        Gives normals in the source's frames, as they are in the picture, from 0 to 1.
    turns : Paint
        `Turns` or `KeptTurns`.
    """

    paint: Paint
    turns: Paint

    channels = 3

    def __call__(self, texels: Texels, out: Values) -> None:
        """Write the normals, encoded from 0 to 1; see `Paint`."""
        found = np.zeros((len(texels), self.paint.channels), np.float32)
        self.paint(texels, found)
        turn = np.zeros((len(texels), 4), np.float32)
        self.turns(texels, turn)
        rows = np.flatnonzero(texels["face"] >= 0)
        given = 2 * found[rows, :3] - 1
        aside = np.einsum("qk,qkd->qd", given[:, :2], turn[rows].reshape(-1, 2, 2))
        result = np.concatenate([aside, given[:, 2:]], axis=1)
        length = np.linalg.norm(result, axis=1, keepdims=True)
        result = np.divide(
            result, length, out=np.tile(np.array([0, 0, 1], np.float32), (len(result), 1)), where=length > 1e-6
        )
        out[rows] = 0.5 * result + 0.5


FLAT = (0.5, 0.5, 1.0)
"""A normal map's color where there is nothing on it."""


def _dot(a: Values, b: Values) -> Values:
    return np.einsum("qd,qd->q", a, b)[:, None]


def _unit(vectors: Values) -> Values:
    """Return vectors, (k, d), in unit length; zero ones stay."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), np.finfo(np.float32).tiny)
