"""Two surfaces made ready for pictures: for any texel of the target's layout the point of the source."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ...surface.mesh import Booleans, Floats, Integers, TriangleMesh
from ...surface.walking import faces_beyond
from ..correspond import Correspondence
from ..interpolate import places


@dataclass(frozen=True, eq=False)
class Carrying:
    """A correspondence between two surfaces, ready to be asked texel by texel.

    A texel lies in a triangle of the target. Between the triangle's corners the map is what it is between vertices: the
    point in between, in space, of the places that the corners have on the source, brought onto the source along its
    normals. It is found by walking over the source's faces, from where a corner is, so that it never jumps to what is
    near in space alone, as the other lip.

    Attributes
    ----------
    correspondence : Correspondence
    source, target : TriangleMesh
    """

    correspondence: Correspondence
    source: TriangleMesh
    target: TriangleMesh

    @property
    def at(self) -> Integers:
        """The source's face of each target vertex, (n,); -1: no counterpart."""
        return self.correspondence.face

    @cached_property
    def known(self) -> Booleans:
        """Which triangles of the target, (m,), have a counterpart at each corner."""
        return (self.at[self.target.faces] >= 0).all(axis=1)

    @cached_property
    def place(self) -> Floats:
        """Where each target vertex is on the source, (n, 3)."""
        return places(self.correspondence, self.source.vertices)[1]

    @cached_property
    def normal(self) -> Floats:
        """The source's normal there, (n, 3), interpolated."""
        return self.correspondence.matrix() @ self.source.vertex_normals()

    @cached_property
    def beyond(self) -> Integers:
        """The source's face across the side opposite each corner, (f, 3); -1: none. See `faces_beyond`."""
        return faces_beyond(self.source)
