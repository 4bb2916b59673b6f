"""Everything that can be carried from one mesh to another: how each kind of data is read, carried and written.

`ROWS` is the one table. A row says for one type of data on one domain which option chooses it, who reads and writes it,
and how its values travel through a correspondence. A further type is a further row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Set
from dataclasses import dataclass
from itertools import count
from typing import Protocol

import bpy
import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from ..solver import Correspondence, interpolate, interpolate_corners
from ..solver.mesh import Booleans, Floats
from .mesh_data import Refusal, Surface, foreach

DISC_LAYOUT = "Mobius Disc"
SHARED_LAYOUT = "Mobius"
SHARED_COLOR = "Mobius Color"
MATCHED_GROUP = "Mobius Matched"
OWN_NAMES = frozenset({DISC_LAYOUT, SHARED_LAYOUT, SHARED_COLOR, MATCHED_GROUP})
"""Names of what flatten and align write themselves; they are no content to carry."""

MAX_UV_MAPS = 8


@dataclass(frozen=True, eq=False)
class Carrier:
    """A correspondence with the two surfaces it connects."""

    correspondence: Correspondence
    source: Surface
    target: Surface

    def points(self, values: Floats) -> tuple[Floats, Booleans]:
        """Carry values per vertex, (n_source, ...), linearly.

        Returns
        -------
        (n_target, ...) float64
            The values on the target's vertices.
        (n_target,) bool
            Where there is a value: the other vertices have no counterpart.
        """
        return interpolate(self.correspondence, values), self.correspondence.face >= 0

    def corners(self, values: Floats) -> tuple[Floats, Booleans]:
        """Carry values per face corner, (c_source, ...), never mixing the two sides of a seam; returns as `points`."""
        on_triangles = values[self.source.triangle_corners.ravel()]
        carried = interpolate_corners(
            self.correspondence,
            self.source.mesh.vertices,
            on_triangles,
            self.target.mesh.faces,
            self.target.corner_polygon[self.target.triangle_corners[:, 0]],
        )
        carried = carried.reshape(len(carried), *values.shape[1:])
        corners = self.target.triangle_corners.ravel()
        total = len(self.target.corner_vertex)
        result = np.zeros((total, *carried.shape[1:]))
        result[corners] = carried
        # a polygon is carried as a whole or not at all
        bare = self.correspondence.face[self.target.corner_vertex] < 0
        polygon = self.target.corner_polygon
        return result, (np.bincount(polygon, bare) == 0)[polygon]


@dataclass(frozen=True, eq=False)
class Layer:
    """One named piece of data of a mesh, with its values per element of its domain."""

    name: str
    values: Floats


class Access(Protocol):
    """How one type of data is found on an object, read and written."""

    def layers(self, obj: bpy.types.Object) -> Iterator[Layer]:
        """Read every layer of this type, except those that are not the person's own content."""
        ...

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str]) -> str | None:
        """Return the name under which `write` will store a layer, or None where the person has locked it.

        `reserved` are the names that other layers of the same transfer take.
        """
        ...

    def write(self, obj: bpy.types.Object, name: str, values: Floats, covered: Booleans) -> None:
        """Create the layer or replace its values, leaving what is there where `covered` is False."""
        ...


@dataclass(frozen=True)
class AttributeAccess:
    """Attributes of one Blender data type on one domain; UV maps and color attributes are such attributes.

    Parameters
    ----------
    data_type, domain : str
        As in `bpy.types.Attribute`.
    prop : str
        What `foreach_get` calls the value. Byte colors are read as linear values, in which they can be interpolated;
        writing the same values back restores the stored bytes.
    width : int
        Numbers per element.
    excluded : frozenset of str
        Names that have a meaning of their own to Blender.
    """

    data_type: str
    domain: str
    prop: str
    width: int
    excluded: frozenset[str] = frozenset({"position", "custom_normal"})

    def layers(self, obj: bpy.types.Object) -> Iterator[Layer]:
        """Read every attribute of this type and domain."""
        for name in [a.name for a in obj.data.attributes if self._is_own_kind(a)]:
            if name not in self.excluded and name not in OWN_NAMES and not name.startswith("."):
                yield Layer(name, foreach(obj.data.attributes[name].data, self.prop, self.width, np.float32))

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str]) -> str:
        """Return `name`, or Blender's way of numbering it if something else bears it."""
        attributes = obj.data.attributes
        groups = {group.name for group in obj.vertex_groups}
        for candidate in numbered(name):
            taken = attributes.get(candidate)
            free = candidate not in groups if taken is None else self._is_own_kind(taken)
            if free and candidate not in reserved:
                return candidate
        raise AssertionError("numbers do not end")

    def write(self, obj: bpy.types.Object, name: str, values: Floats, covered: Booleans) -> None:
        """Create the attribute or replace its values."""
        attributes = obj.data.attributes
        if name not in attributes:
            made = attributes.new(name, self.data_type, self.domain)
            if made is None:
                raise Refusal(f"'{obj.name}' cannot hold an attribute named '{name}': rename it on the source")
            name = made.name
        # fetched by name: up to Blender 5.0 references do not survive a new attribute
        data = attributes[name].data
        stored = values.astype(np.float32)
        if not covered.all():
            stored[~covered] = foreach(data, self.prop, self.width, np.float32)[~covered]
        data.foreach_set(self.prop, stored.ravel())
        obj.data.update()

    def _is_own_kind(self, attribute: bpy.types.Attribute) -> bool:
        return attribute.data_type == self.data_type and attribute.domain == self.domain


class VertexGroupAccess:
    """Vertex groups: weights in [0, 1] by name; a vertex of weight 0 is not a member."""

    def layers(self, obj: bpy.types.Object) -> Iterator[Layer]:
        """Read every vertex group as a dense column of weights."""
        names = [group.name for group in obj.vertex_groups]
        if not names:
            return
        vertices: list[int] = []
        groups: list[int] = []
        weights: list[float] = []
        for index, vertex in enumerate(obj.data.vertices):
            for element in vertex.groups:
                vertices.append(index)
                groups.append(element.group)
                weights.append(element.weight)
        known = np.array(groups, dtype=np.intp) < len(names)  # a damaged file can name groups that do not exist
        table = csc_array(
            (np.array(weights)[known], (np.array(vertices, np.intp)[known], np.array(groups, np.intp)[known])),
            shape=(len(obj.data.vertices), len(names)),
        )
        for index, name in enumerate(names):
            if name not in OWN_NAMES:
                yield Layer(name, table[:, [index]].toarray().ravel())

    def place(self, obj: bpy.types.Object, name: str, reserved: Set[str]) -> str | None:
        """Return `name`, or None if a locked group bears it."""
        group = obj.vertex_groups.get(name)
        return None if group is not None and group.lock_weight else name

    def write(self, obj: bpy.types.Object, name: str, values: Floats, covered: Booleans) -> None:
        """Create the group or replace its weights."""
        group = obj.vertex_groups.get(name)
        weights = np.clip(values, 0, 1).astype(np.float32)
        if group is None:
            weights[~covered] = 0
            _new_group(obj, name, weights)
            return
        group.remove(np.flatnonzero(covered).tolist())
        members = np.flatnonzero(covered & (weights > 0))
        levels, level_of = np.unique(weights[members], return_inverse=True)
        order = np.argsort(level_of, kind="stable")
        ends = np.searchsorted(level_of[order], np.arange(1, len(levels)))
        for weight, indices in zip(levels.tolist(), np.split(members[order], ends), strict=True):
            group.add(indices.tolist(), weight, "REPLACE")
        obj.data.update()


def _new_group(obj: bpy.types.Object, name: str, weights: npt.NDArray[np.float32]) -> None:
    """Make a vertex group of the positive weights.

    An attribute is converted, which takes a tenth of the time of `VertexGroup.add` for each vertex.
    """
    mesh = obj.data
    active = mesh.attributes.active.name if mesh.attributes.active else None
    temporary = mesh.attributes.new(name, "FLOAT", "POINT").name
    mesh.attributes[temporary].data.foreach_set("value", weights)
    mesh.attributes.active = mesh.attributes[temporary]
    with bpy.context.temp_override(object=obj, active_object=obj):
        bpy.ops.geometry.attribute_convert(mode="VERTEX_GROUP")
    obj.vertex_groups[-1].name = name
    if active is not None:
        mesh.attributes.active = mesh.attributes[active]


def numbered(name: str) -> Iterator[str]:
    """Yield a name and then Blender's numbered forms of it."""
    yield name
    stem = name.encode()[:59].decode(errors="ignore")  # Blender cuts names to 63 bytes
    for number in count(1):
        yield f"{stem}.{number:03d}"


@dataclass(frozen=True)
class Kind:
    """What a person chooses to carry."""

    identifier: str
    label: str
    description: str

    @property
    def noun(self) -> str:
        """The label within a sentence, in the plural."""
        return self.label.lower().replace("uv", "UV")


KINDS = (
    Kind("vertex-groups", "Vertex Groups", "Weights of every vertex group; locked groups of the target are left alone"),
    Kind("colors", "Color Attributes", "Colors on points and on face corners"),
    Kind("uv", "UV Maps", "UV maps, face corner by face corner; no face is stretched across a seam"),
    Kind("attributes", "Attributes", "Float, 2D vector and vector attributes on points and face corners"),
)

Carry = Callable[[Carrier, Floats], tuple[Floats, Booleans]]


@dataclass(frozen=True)
class Row:
    """One type of data on one domain: the kind that chooses it, who reads and writes it, and how it is carried."""

    kind: str
    access: Access
    carry: Carry


def _attribute(kind: str, data_type: str, domain: str, prop: str, width: int, carry: Carry) -> Row:
    return Row(kind, AttributeAccess(data_type, domain, prop, width), carry)


ROWS = (
    Row("vertex-groups", VertexGroupAccess(), Carrier.points),
    _attribute("colors", "FLOAT_COLOR", "POINT", "color", 4, Carrier.points),
    _attribute("colors", "FLOAT_COLOR", "CORNER", "color", 4, Carrier.corners),
    _attribute("colors", "BYTE_COLOR", "POINT", "color", 4, Carrier.points),
    _attribute("colors", "BYTE_COLOR", "CORNER", "color", 4, Carrier.corners),
    _attribute("uv", "FLOAT2", "CORNER", "vector", 2, Carrier.corners),
    _attribute("attributes", "FLOAT", "POINT", "value", 1, Carrier.points),
    _attribute("attributes", "FLOAT", "CORNER", "value", 1, Carrier.corners),
    _attribute("attributes", "FLOAT2", "POINT", "vector", 2, Carrier.points),
    _attribute("attributes", "FLOAT_VECTOR", "POINT", "vector", 3, Carrier.points),
    _attribute("attributes", "FLOAT_VECTOR", "CORNER", "vector", 3, Carrier.corners),
)


@dataclass(frozen=True, eq=False)
class Carried:
    """A layer on its way: computed for the target, not yet written."""

    row: Row
    source_name: str
    name: str
    values: Floats
    covered: Booleans


@dataclass(frozen=True, eq=False)
class Transfer:
    """Everything that a transfer will write, computed before anything is written.

    Attributes
    ----------
    layers : tuple of Carried
        What will be written.
    shown_uv, shown_color : str or None
        UV map and color attribute to render with: the source's, where the target had none of its own.
    warnings : tuple of str
        Sentences about what will not be written, or not under its own name.
    """

    layers: tuple[Carried, ...]
    shown_uv: str | None
    shown_color: str | None
    warnings: tuple[str, ...]

    def write(self, obj: bpy.types.Object) -> None:
        """Write every layer on the target."""
        for layer in self.layers:
            layer.row.access.write(obj, layer.name, layer.values, layer.covered)
        mesh = obj.data
        if self.shown_uv is not None:
            mesh.uv_layers.active = mesh.uv_layers[self.shown_uv]
            mesh.uv_layers[self.shown_uv].active_render = True
        if self.shown_color is not None:
            mesh.attributes.active_color_name = mesh.attributes.default_color_name = self.shown_color

    def counts(self) -> dict[str, int]:
        """Return how many layers of each kind are written, kinds with none left out."""
        found = {kind.identifier: sum(x.row.kind == kind.identifier for x in self.layers) for kind in KINDS}
        return {kind: number for kind, number in found.items() if number}


def plan_transfer(
    source: bpy.types.Object, target: bpy.types.Object, carrier: Carrier, kinds: Iterable[str]
) -> Transfer:
    """Carry everything of the chosen kinds from source to target, without writing yet.

    Parameters
    ----------
    source, target : bpy.types.Object
        Mesh objects in Object Mode.
    carrier : Carrier
        The correspondence between them.
    kinds : iterable of str
        Identifiers of `KINDS`.

    Raises
    ------
    Refusal
        Nothing to carry, or more UV maps than Blender allows.
    """
    chosen = set(kinds)
    layers: list[Carried] = []
    warnings: list[str] = []
    for row in ROWS:
        if row.kind not in chosen:
            continue
        for layer in row.access.layers(source):
            name = row.access.place(target, layer.name, {x.name for x in layers})
            if name is None:
                warnings.append(f"'{layer.name}' is locked on '{target.name}' and left as it is")
                continue
            if name != layer.name:
                warnings.append(f"'{target.name}' has something else named '{layer.name}': it becomes '{name}'")
            layers.append(Carried(row, layer.name, name, *row.carry(carrier, layer.values)))
    if not layers:
        wanted = " or ".join(kind.noun for kind in KINDS if kind.identifier in chosen)
        locked = f" ({'; '.join(warnings)})" if warnings else ""
        raise Refusal(f"'{source.name}' has no {wanted} to transfer{locked}")
    maps = {x.name for x in layers if x.row.kind == "uv"} | {x.name for x in target.data.uv_layers}
    if len(maps) > MAX_UV_MAPS:
        raise Refusal(
            f"'{target.name}' would have {len(maps)} UV maps and Blender allows {MAX_UV_MAPS}: delete some first"
        )
    if bare := int((carrier.correspondence.face < 0).sum()):
        warnings.append(f"{bare:,} vertices of '{target.name}' have no counterpart and are left as they were")
    shown_uv = next((x.name for x in source.data.uv_layers if x.active_render), "")
    return Transfer(
        tuple(layers),
        _shown(layers, "uv", shown_uv, target.data.uv_layers),
        _shown(layers, "colors", source.data.attributes.default_color_name, target.data.color_attributes),
        tuple(warnings),
    )


def _shown(
    layers: list[Carried], kind: str, shown_on_source: str, on_target: Iterable[bpy.types.Attribute]
) -> str | None:
    """Return which carried layer to render with, or None if the target has one of its own."""
    if any(x.name not in OWN_NAMES for x in on_target):
        return None
    names = {x.source_name: x.name for x in layers if x.row.kind == kind}
    return names.get(shown_on_source, next(iter(names.values()), None))
