"""The one table: for one type of data on one domain, who chooses it, who reads and writes it, how its values travel.

A further type is a further row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...solver.surface.mesh import Booleans
from .access import FACE_SETS, SCULPT_MASK, SEAMS, SHARPNESS, SMOOTHNESS, Access, AttributeAccess
from .carrier import Carrier, Values
from .materials import MaterialAccess
from .normals import NormalAccess
from .shape_keys import ShapeKeyAccess
from .vertex_groups import VertexGroupAccess


@dataclass(frozen=True)
class Kind:
    """What a person chooses to carry."""

    identifier: str
    label: str
    description: str
    standard: bool = True
    """Whether it is carried unless something else is said."""

    @property
    def noun(self) -> str:
        """The label within a sentence, in the plural."""
        return self.label.lower().replace("uv", "UV")


KINDS = (
    Kind("vertex-groups", "Vertex Groups", "Weights of every vertex group; locked groups of the target are left alone"),
    Kind("shape-keys", "Shape Keys", "Every shape key, turned and scaled with the surface; with slider and driver"),
    Kind("colors", "Color Attributes", "Colors on points and on face corners"),
    Kind("uv", "UV Maps", "UV maps, face corner by face corner; no face is stretched across a seam"),
    Kind("seams", "UV Seams", "Edges marked as seams, each from the edge that runs along it"),
    Kind("materials", "Materials", "The material of each face; materials that are missing are added as slots"),
    Kind("sharpness", "Edge Marks", "Sharp edges, creases and bevel weights"),
    Kind("smoothness", "Smooth Flags", "Whether faces are shaded smooth or flat"),
    Kind("normals", "Custom Normals", "Normals of face corners, turned with the surface"),
    Kind("face-sets", "Face Sets", "Sculpt Mode's face sets"),
    Kind("mask", "Sculpt Masks", "Sculpt Mode's mask"),
    Kind(
        "attributes",
        "Attributes",
        "Other attributes: numbers with fractions are interpolated on points and face corners, anything else "
        "comes from the nearest element",
    ),
    Kind(
        "textures",
        "Textures",
        "Pictures of the source's materials, drawn anew for the target's UV map, in a material of their own",
        standard=False,
    ),
)

NOUNS = {kind.identifier: kind.noun for kind in KINDS}
"""What kinds are called within a sentence, by identifier."""

Carry = Callable[[Carrier, Values], tuple[Values, Booleans]]


@dataclass(frozen=True)
class Row:
    """One type of data on one domain: the kind that chooses it, who reads and writes it, and how it is carried.

    `mixes` says whether values can be mixed with those that are there; any others are replaced or not.
    """

    kind: str
    access: Access
    carry: Carry
    mixes: bool = False

    @property
    def marks(self) -> bool:
        """Whether this is something that a mesh has once under a name of Blender's own, as seams and masks."""
        return isinstance(self.access, AttributeAccess) and bool(self.access.only)

    @property
    def once(self) -> bool:
        """Whether a mesh cannot have two of it."""
        return self.marks or isinstance(self.access, MaterialAccess | NormalAccess)


# data type: what foreach_get calls it, numbers per element, numpy's type, how it is carried on points and on corners
_TYPES = {
    "FLOAT": ("value", 1, "float32", Carrier.points, Carrier.corners),
    "FLOAT2": ("vector", 2, "float32", Carrier.points, Carrier.corners),
    "FLOAT_VECTOR": ("vector", 3, "float32", Carrier.points, Carrier.corners),
    "FLOAT4": ("vector", 4, "float32", Carrier.points, Carrier.corners),
    "FLOAT_COLOR": ("color", 4, "float32", Carrier.points, Carrier.corners),
    "BYTE_COLOR": ("color", 4, "float32", Carrier.points, Carrier.corners),
    "QUATERNION": ("value", 4, "float32", Carrier.turned_points, Carrier.nearest_corners),
    "FLOAT4X4": ("value", 16, "float32", Carrier.nearest_points, Carrier.nearest_corners),
    "BOOLEAN": ("value", 1, "bool", Carrier.majority_of_points, Carrier.nearest_corners),
    "INT": ("value", 1, "int32", Carrier.nearest_points, Carrier.nearest_corners),
    "INT8": ("value", 1, "int32", Carrier.nearest_points, Carrier.nearest_corners),
    "INT16_2D": ("value", 2, "int32", Carrier.nearest_points, Carrier.nearest_corners),
    "INT32_2D": ("value", 2, "int32", Carrier.nearest_points, Carrier.nearest_corners),
    "STRING": ("value", 1, "object", Carrier.nearest_points, Carrier.nearest_corners),
}
_SPECIAL_KIND = {
    ("FLOAT2", "CORNER"): "uv",
    **{(color, domain): "colors" for color in ("FLOAT_COLOR", "BYTE_COLOR") for domain in ("POINT", "CORNER")},
}


def _row(kind: str, data_type: str, domain: str, only: frozenset[str] = frozenset()) -> Row:
    prop, width, dtype, on_points, on_corners = _TYPES[data_type]
    carry = {"POINT": on_points, "EDGE": Carrier.edges, "FACE": Carrier.faces, "CORNER": on_corners}[domain]
    mixes = kind != "uv" and carry in (Carrier.points, Carrier.corners)
    return Row(kind, AttributeAccess(data_type, domain, prop, width, dtype, only), carry, mixes)


ROWS = (
    Row("vertex-groups", VertexGroupAccess(), Carrier.points, mixes=True),
    Row("shape-keys", ShapeKeyAccess(), Carrier.displacements, mixes=True),
    Row("materials", MaterialAccess(), Carrier.faces),
    _row("seams", "BOOLEAN", "EDGE", SEAMS),
    _row("sharpness", "BOOLEAN", "EDGE", SHARPNESS),
    _row("sharpness", "FLOAT", "EDGE", SHARPNESS),
    _row("sharpness", "FLOAT", "POINT", SHARPNESS),
    _row("smoothness", "BOOLEAN", "FACE", SMOOTHNESS),
    _row("face-sets", "INT", "FACE", FACE_SETS),
    _row("mask", "FLOAT", "POINT", SCULPT_MASK),
    *(
        _row(_SPECIAL_KIND.get((data_type, domain), "attributes"), data_type, domain)
        for data_type in _TYPES
        for domain in ("POINT", "EDGE", "FACE", "CORNER")
    ),
    # last, since sharp edges and flat faces decide what normals can be
    Row("normals", NormalAccess(), Carrier.normals),
)
