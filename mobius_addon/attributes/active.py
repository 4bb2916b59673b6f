"""Which layers of a mesh are the active ones, and which were before our own took their place."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields

import bpy

from .access import OWN_NAMES


@dataclass(frozen=True)
class ActiveLayers:
    """Names of the layers of a mesh that Blender marks; empty where there is none.

    Attributes
    ----------
    uv, uv_render, uv_clone, uv_stencil : str
        UV maps: the one that is edited, is rendered, is cloned from and masks what is painted.
    color, color_render : str
        Color attributes: the one that is painted on, and is rendered.
    attribute : str
        What the list of attributes has active.
    group : str
        The vertex group that is painted on.
    """

    uv: str = ""
    uv_render: str = ""
    uv_clone: str = ""
    uv_stencil: str = ""
    color: str = ""
    color_render: str = ""
    attribute: str = ""
    group: str = ""

    @staticmethod
    def of(obj: bpy.types.Object) -> ActiveLayers:
        """Read them from a mesh object."""
        mesh, maps, attributes = obj.data, obj.data.uv_layers, obj.data.attributes

        def name(layer: bpy.types.bpy_struct | None) -> str:
            return "" if layer is None else layer.name

        return ActiveLayers(
            uv=name(maps.active),
            uv_render=next((x.name for x in maps if x.active_render), ""),
            uv_clone=next((x.name for x in maps if x.active_clone), ""),
            uv_stencil=name(mesh.uv_layer_stencil),
            color=attributes.active_color_name or "",
            color_render=attributes.default_color_name or "",
            attribute=name(attributes.active),
            group=name(obj.vertex_groups.active),
        )

    def put_back(self, obj: bpy.types.Object) -> None:
        """Make these the active ones, where they are still there."""
        mesh, maps, attributes, groups = obj.data, obj.data.uv_layers, obj.data.attributes, obj.vertex_groups
        if self.attribute in attributes:  # first: Blender takes it for the active color too
            attributes.active = attributes[self.attribute]
        if self.uv in maps:
            maps.active = maps[self.uv]
        if self.uv_render in maps:
            maps[self.uv_render].active_render = True
        if self.uv_clone in maps:
            maps[self.uv_clone].active_clone = True
        if self.uv_stencil in maps:
            mesh.uv_layer_stencil = maps[self.uv_stencil]
        for prop, name in (("active_color_name", self.color), ("default_color_name", self.color_render)):
            names = [x.name for x in mesh.color_attributes]
            if name in names:
                setattr(attributes, prop, name)
            elif getattr(attributes, prop) not in names:  # from Blender 5 on the name of a removed one stays
                setattr(attributes, prop, next(iter(names), ""))
        if self.group in groups:
            groups.active = groups[self.group]


def persons_own(obj: bpy.types.Object) -> ActiveLayers:
    """Return the active layers, and in place of our own those that were active before; see `note`."""
    now, before = asdict(ActiveLayers.of(obj)), asdict(_noted(obj.data))
    return ActiveLayers(**{x: before[x] if not name or name in OWN_NAMES else name for x, name in now.items()})


def note(obj: bpy.types.Object) -> None:
    """Remember on the mesh which layers are active, our own aside: to be called before one of ours becomes active."""
    if hasattr(obj.data, "mobius_before"):  # where the extension is registered
        obj.data.mobius_before = json.dumps(asdict(persons_own(obj)))


def _noted(mesh: bpy.types.Mesh) -> ActiveLayers:
    try:
        found = json.loads(getattr(mesh, "mobius_before", "") or "{}")
        return ActiveLayers(**{x.name: str(found.get(x.name, "")) for x in fields(ActiveLayers)})
    except (ValueError, AttributeError):  # damaged
        return ActiveLayers()
