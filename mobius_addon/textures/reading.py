"""Pictures that are prepared: everything read first, then carried, where only arrays are touched."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import bpy
import numpy as np

from ...solver import TriangleMesh
from ...solver.carry.frames import local_similarities
from ...solver.carry.in_place import settled
from ...solver.carry.textures import (
    EXTEND,
    FLAT,
    Carrying,
    FromCorners,
    FromPictures,
    InLayout,
    MapPaint,
    OnTarget,
    Paint,
    Picture,
    Resampled,
    Stacked,
    Together,
    TurnedNormals,
    Wanted,
    at_vertices,
    encoded,
    island_numbers,
    picture_size,
    resample,
)
from ...solver.carry.textures.layout import plane_areas
from ...solver.carry.textures.margins import Margin
from ...solver.carry.textures.picture import Pixels
from ...solver.surface.mesh import Floats, Integers, plural
from ..attributes.carrier import Carrier
from ..mesh_data import Refusal, foreach, mirrored
from .images import FIRST_TILE, read_tiles
from .layouts import TargetLayout, corner_uv, rendered_uv, tangent_frames, target_layout
from .nodes import CHANNELS, Channel, Found, found_in, shader_of, value_of
from .settings import TextureSettings

DATA = "Non-Color"
"""Blender's color space of numbers that are no colors."""

LINEAR = "Linear Rec.709"
"""Blender's color space of the floats that it has read."""


@dataclass(frozen=True, eq=False)
class ChannelPlan:
    """One picture to be made.

    Attributes
    ----------
    channel : Channel
    paint : Paint
    space : str
        Its color space.
    floats : bool
        Whether it keeps floats, else bytes.
    settings : tuple of (str, float)
        Inputs of the node that will read it.
    """

    channel: Channel
    paint: Paint
    space: str
    floats: bool
    settings: tuple[tuple[str, float], ...] = ()

    @property
    def srgb(self) -> bool:
        """Whether its bytes are sRGB."""
        return self.space == "sRGB"

    def stored(self, values: Any) -> Pixels:
        """Return values as the picture keeps them."""
        return np.asarray(values, np.float32) if self.floats else encoded(values, srgb=self.srgb)


@dataclass(frozen=True, eq=False)
class Made:
    """A picture that was made: its tiles by UDIM number."""

    channel: Channel
    tiles: dict[int, Pixels]
    space: str
    settings: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False)
class Textures:
    """Pictures for a target, computed and not yet in Blender.

    Attributes
    ----------
    made : tuple of Made
    mask : dict of int to pixels, or None
        White where there is no certain counterpart.
    transfer_map : dict of int to pixels, or None
        u, v, number of the material and confidence.
    layout : TargetLayout
    material : str
        Name of the source's material that shows most of it, for what has no picture.
    polygons : (p,) bool
        The target's polygons that show the pictures.
    colors : dict of str to (c, 4) float64
        Linear colors at the target's face corners in place of pictures.
    alpha : bool
        Whether the base color says where the target is transparent.
    notes : tuple of str
    """

    made: tuple[Made, ...]
    mask: dict[int, Pixels] | None
    transfer_map: dict[int, Pixels] | None
    layout: TargetLayout
    material: str
    polygons: Any
    colors: dict[str, Floats]
    alpha: bool
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class TextureReading:
    """Everything that carrying pictures needs, as arrays: `carry` may run in a thread of its own."""

    plans: tuple[ChannelPlan, ...]
    carrier: Carrier
    carrying: Carrying
    layout: TargetLayout
    size: int
    settings: TextureSettings
    map_paint: MapPaint
    certain: Floats
    material: str
    names: tuple[str, str]
    alpha: bool
    keeps_map: bool
    notes: tuple[str, ...]

    def carry(self, progress: Callable[[float], None] | None = None) -> Textures:
        """Make the pictures; `progress` is called with the share of the work done and may raise to end it."""
        if self.settings.result == "attributes":
            return self._result((), None, None, self._colors(), ())
        wanted = [Wanted(plan.paint, plan.stored, self._gaps(plan)) for plan in self.plans]
        if self.settings.mask:
            bare = OnTarget(1 - self.certain[:, :, None])
            wanted.append(Wanted(bare, partial(encoded, srgb=False), bare.values))
        if self.keeps_map:
            nowhere = np.tile([0.0, 0.0, -1.0, 0.0], (len(self.certain), 3, 1))
            wanted.append(Wanted(self.map_paint, np.asarray, nowhere))
        tiles = [number for number in np.unique(self.layout.tile).tolist() if number]
        margin = self.size // 256 if self.settings.margin < 0 else self.settings.margin
        found: list[Resampled] = []
        for number, tile in enumerate(tiles):
            finder = InLayout.of(self.carrying, self.layout.in_tile(tile), (self.size, self.size))

            def tell(share: float, number: int = number) -> None:
                if progress is not None:
                    progress((number + share) / len(tiles))

            found.append(resample(finder, (self.size, self.size), wanted, progress=tell))
            self._finish(found[-1], margin)
        by_tile = [dict(zip(tiles, x, strict=True)) for x in zip(*(one.pixels for one in found), strict=True)]
        made = tuple(
            Made(plan.channel, pixels, plan.space, plan.settings)
            for plan, pixels in zip(self.plans, by_tile, strict=False)
        )
        others = by_tile[len(self.plans) :]
        mask = others.pop(0) if self.settings.mask else None
        notes = []
        if overlaps := sum(one.overlaps for one in found):
            notes.append(
                f"faces of '{self.names[1]}' overlap in its UV map '{self.layout.name}', in "
                f"{plural(overlaps, 'texel')}: there one of them is shown"
            )
        return self._result(made, mask, others[0] if self.keeps_map else None, {}, notes)

    def _result(self, made: Any, mask: Any, transfer_map: Any, colors: Any, notes: Any) -> Textures:
        surface = self.carrier.target
        shown = self.carrying.known if self.carrier.gap == "leave" and not self._transparent else self.layout.tile > 0
        polygon = surface.corner_polygon[surface.triangle_corners[:, 0]]
        polygons = np.bincount(polygon, shown, int(surface.corner_polygon.max()) + 1) > 0
        alpha = self.alpha or self._transparent
        return Textures(
            made, mask, transfer_map, self.layout, self.material, polygons, colors, alpha, (*self.notes, *notes)
        )

    @property
    def _transparent(self) -> bool:
        """Whether texels without a counterpart are to be seen through."""
        return self.carrier.gap == "leave" and not self.carrying.known.all() and self._color is not None

    @property
    def _color(self) -> int | None:
        return next((k for k, plan in enumerate(self.plans) if plan.channel.identifier == "base_color"), None)

    def _finish(self, found: Resampled, margin: int) -> None:
        """Add the margin, and make transparent what has no counterpart, if it is to be."""
        around = Margin.of(found.covered, margin)
        for pixels in found.pixels[: len(self.plans) + self.settings.mask]:
            around.fill(pixels)
        if self._transparent and self._color is not None:
            pixels = found.pixels[self._color]
            pixels[found.bare, 3] = 0

    def _gaps(self, plan: ChannelPlan) -> Floats | None:
        """Return what triangles without a counterpart get at their corners; None: nothing."""
        if self.carrier.gap == "leave" or self.carrying.known.all():
            return None
        faces = self.carrying.target.faces
        if plan.channel.identifier == "normal":
            return np.tile(np.array(FLAT), (len(faces), 3, 1))
        values = self.carrier.filled(at_vertices(self.carrying, plan.paint))[0]
        return values[faces]

    def _colors(self) -> dict[str, Floats]:
        """Return what the pictures show at the target's vertices, as colors at its face corners."""
        surface = self.carrier.target
        result = {}
        for plan in self.plans:
            if plan.channel.identifier == "normal":
                continue
            values = self.carrier.filled(at_vertices(self.carrying, plan.paint))[0]
            color = np.ones((len(values), 4))
            color[:, : max(values.shape[1], 3)] = values
            result[plan.channel.label] = color[surface.corner_vertex]
        return result


def read_textures(
    source: bpy.types.Object,
    target: bpy.types.Object,
    carrier: Carrier,
    settings: TextureSettings,
    *,
    shown: bpy.types.Object | None = None,
    keeps_map: bool = False,
) -> TextureReading | None:
    """Read the pictures of a source and the layout of a target; None: the source shows no picture.

    Parameters
    ----------
    source, target : bpy.types.Object
    carrier : Carrier
    settings : TextureSettings
    shown : bpy.types.Object, optional
        What is evaluated of the source.
    keeps_map : bool
        A transfer map is made too.

    Raises
    ------
    Refusal
        A picture is missing, or a layout cannot be used.
    """
    obj = shown or source
    reader = TextureReader(obj, carrier)
    plans = reader.plans()
    if not plans and not keeps_map:
        return None
    layout = target_layout(obj, target, carrier, settings)
    meshes = (_in_world(obj, carrier.source.mesh), _in_world(target, carrier.target.mesh))
    carrier = replace(carrier, correspondence=settled(carrier.correspondence, *meshes))
    carrying = Carrying(carrier.correspondence, carrier.source.mesh, carrier.target.mesh)
    size = settings.size or _size(reader, carrying, layout)
    found = carrier.correspondence
    certain = (found.matched & (found.face >= 0)).astype(np.float64)[carrying.target.faces]
    normals = [k for k, plan in enumerate(plans) if plan.channel.identifier == "normal"]
    if normals:
        uv = layout.new if layout.new is not None else corner_uv(target.data, layout.name)
        frames = tangent_frames(target, carrier.target, uv), tangent_frames(obj, carrier.source, reader.normal_uv())
        rotation = local_similarities(found, carrier.source.rest, carrier.target.rest)[0]
        for k in normals:
            paint = TurnedNormals(plans[k].paint, carrying, frames[1], frames[0], rotation)
            plans[k] = ChannelPlan(plans[k].channel, paint, plans[k].space, plans[k].floats, plans[k].settings)
    alpha = next((plan for plan in plans if plan.channel.identifier == "alpha"), None)
    color = next((k for k, plan in enumerate(plans) if plan.channel.identifier == "base_color"), None)
    transparent = carrier.gap == "leave" and not carrying.known.all()
    if color is not None and (alpha is not None or transparent):
        opaque = FromCorners(np.ones((len(carrying.source.faces), 3, 1)))
        both = Stacked((plans[color].paint, alpha.paint if alpha is not None else opaque))
        plans[color] = ChannelPlan(plans[color].channel, both, plans[color].space, plans[color].floats)
        plans = [plan for plan in plans if plan is not alpha]
    uv = reader.uv(rendered_uv(obj.data))
    return TextureReading(
        tuple(plans),
        carrier,
        carrying,
        layout,
        size,
        settings,
        MapPaint(uv, reader.slot, found.confidence[carrying.target.faces]),
        certain,
        reader.main_material(),
        (source.name, target.name),
        alpha is not None,
        keeps_map,
        tuple(reader.notes),
    )


def _size(reader: TextureReader, carrying: Carrying, layout: TargetLayout) -> int:
    """Return the side of pictures in which the target has as many texels as the part of the source that it shows."""
    place = carrying.place[carrying.target.faces[carrying.known]]
    shown = 0.5 * np.linalg.norm(np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]), axis=1).sum()
    density = reader.texels() / max(carrying.source.area, 1e-300)
    return picture_size(density * shown, layout.corners[layout.tile > 0])


def _in_world(obj: bpy.types.Object, mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh where its object is in the world."""
    matrix = np.array(obj.matrix_world)
    return TriangleMesh(mirrored(obj, mesh.vertices) @ matrix[:3, :3].T + matrix[:3, 3], mesh.faces, mesh.name)


class TextureReader:
    """Reads what a source shows, each picture once."""

    def __init__(self, obj: bpy.types.Object, carrier: Carrier) -> None:
        surface = carrier.source
        self.obj, self.surface = obj, surface
        self.notes: list[str] = []
        self._tiles: dict[Any, dict[int, Pixels]] = {}
        polygon = surface.corner_polygon[surface.triangle_corners[:, 0]]
        index = foreach(obj.data.polygons, "material_index", 1, np.int32)
        slots = [slot.material for slot in obj.material_slots]
        self.slot: Integers = np.minimum(index, max(len(slots) - 1, 0))[polygon].astype(np.intp)
        self.materials = {k: slots[k] if slots else None for k in np.unique(self.slot).tolist()}
        self._found: dict[tuple[int, str], Found] = {}

    def uv(self, name: str) -> Floats:
        """Return a UV map at the corners of triangles, (f, 3, 2); zeros where there is none."""
        mesh = self.obj.data
        if name not in mesh.uv_layers:
            return np.zeros((*self.surface.triangle_corners.shape, 2))
        return corner_uv(mesh, name)[self.surface.triangle_corners]

    def main_material(self) -> str:
        """Return the name of the material that shows most of the source."""
        areas = np.bincount(self.slot, self.surface.mesh.face_areas)
        best = self.materials[int(areas.argmax())]
        return "" if best is None else best.name

    def plans(self) -> list[ChannelPlan]:
        """Return the pictures to be made: those that any material shows."""
        return [plan for channel in CHANNELS if (plan := self._plan(channel)) is not None]

    @property
    def pages(self) -> dict[tuple[int, int], int]:
        """Number of the page of each material in each tile, for a transfer map; see `by_page`."""
        tiles = sorted({FIRST_TILE, *(number for tiles in self._tiles.values() for number in tiles)})
        return {key: k for k, key in enumerate((slot, tile) for slot in self.materials for tile in tiles)}

    def by_page(self, channel: Channel, width: int, space: str) -> Paint:
        """Return the paint of a channel for the texels of a transfer map, whose faces are `pages`.

        Raises
        ------
        Refusal
            What is shown lies in another UV map than the one that is rendered.
        """
        pictures: list[Picture | Floats] = []
        corners: list[Floats] = []
        pages = self.pages
        unit = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        for slot, number in pages:
            found = self._found.get((slot, channel.identifier))
            if found is None:
                pictures.append(np.resize(value_of(self.materials[slot], channel), width))
                corners.append(np.zeros((0, 3, 2)))
                continue
            if found.image is None or found.uv_map not in ("", rendered_uv(self.obj.data)):
                raise Refusal(
                    f"{channel.label} of '{self.obj.name}' does not lie in its UV map '{rendered_uv(self.obj.data)}', "
                    "which a transfer map is for: carry it without one"
                )
            tiles = self._tiles[found.image]
            tile = number if found.image.source == "TILED" else FIRST_TILE
            if tile not in tiles:
                pictures.append(np.resize(np.array(channel.value), width))
                corners.append(np.zeros((0, 3, 2)))
                continue
            pictures.append(self._picture(found, tiles[tile], width, space, found.wrap))
            origin = np.array(divmod(number - FIRST_TILE, 10)[::-1])
            there = (unit + origin) @ found.matrix[:, :2].T + found.matrix[:, 2]
            corners.append(np.repeat((there - origin)[None], len(pages), axis=0))
        every = np.zeros(len(pages), np.uint16)
        return FromPictures.of(pictures, corners, np.arange(len(pages)), [every] * len(pages), width)

    def _picture(self, found: Found, pixels: Pixels, width: int, space: str, wrap: int) -> Picture:
        decoded = space in ("sRGB", LINEAR) and found.part != "A"
        srgb = decoded and found.image.colorspace_settings.name == "sRGB"
        return Picture.of(_part(pixels, found.part, width), srgb=srgb, wrap=wrap)

    def texels(self) -> float:
        """Return the number of texels that the source has on its surface, of its largest picture."""
        most = 0.0
        for channel in CHANNELS:
            number = 0.0
            for slot in self.materials:
                found = self._found.get((slot, channel.identifier))
                if found is not None and found.image in self._tiles:
                    height, width = next(iter(self._tiles[found.image].values())).shape[:2]
                    areas = plane_areas(self._mapped(found)[self.slot == slot])
                    number += float(areas.sum()) * height * width
            most = max(most, number)
        return most or 4.0 * len(self.surface.mesh.vertices)  # colors at vertices: two texels to the edge

    def normal_uv(self) -> Floats:
        """Return the UV map, (c, 2), that the source's normal maps lie in."""
        names = [x.uv_map for (_, channel), x in self._found.items() if channel == "normal"]
        name = next((name for name in names if name in self.obj.data.uv_layers), rendered_uv(self.obj.data))
        return corner_uv(self.obj.data, name)

    def _plan(self, channel: Channel) -> ChannelPlan | None:
        shown: dict[int, Found] = {}
        for slot, material in self.materials.items():
            found = self._shown(material, channel)
            if found is not None:
                shown[slot] = self._found[slot, channel.identifier] = found
                self._note(material, channel, found)
        if not shown:
            return None
        images = [x.image for x in shown.values() if x.image is not None]
        for image in images:
            if image not in self._tiles:
                self._tiles[image] = read_tiles(image)
        width = 3 if channel.color or any(x.part == "RGB" for x in shown.values()) else 1
        floats = any(self._tiles[image][min(self._tiles[image])].dtype != np.uint8 for image in images)
        # alpha is a number whatever the color space of its picture
        space = DATA if all(x.part == "A" for x in shown.values()) else self._space(channel, images, floats)
        return ChannelPlan(
            channel, self._paint(channel, shown, width, space), space, floats, next(iter(shown.values())).settings
        )

    def _shown(self, material: Any, channel: Channel) -> Found | None:
        found = None if material is None else found_in(material, channel)
        if found is None and channel.identifier == "base_color" and (material is None or shader_of(material) is None):
            name = self.obj.data.attributes.default_color_name  # a scan that has colors and no material
            if name:
                return Found(None, name, "RGB", "", np.eye(2, 3), 1)
        if found is not None and found.attribute is not None:
            there = self.obj.data.color_attributes.get(found.attribute or self.obj.data.attributes.default_color_name)
            return found if there is not None else None
        if found is not None and material is not None:
            name = found.uv_map or rendered_uv(self.obj.data)
            if name not in self.obj.data.uv_layers:
                what = f"no UV map '{found.uv_map}'" if found.uv_map else "no UV map"
                raise Refusal(
                    f"'{self.obj.name}' has {what}, which the picture '{found.image.name}' of its material "
                    f"'{material.name}' needs"
                )
        return found

    def _note(self, material: Any, channel: Channel, found: Found) -> None:
        if found.passed:
            nodes = ", ".join(f"'{name}'" for name in dict.fromkeys(found.passed))
            self.notes.append(
                f"{channel.label} of material '{material.name}' is carried without the effect of {nodes} in its nodes"
            )

    def _space(self, channel: Channel, images: list[Any], floats: bool) -> str:
        if not images:
            return "sRGB" if channel.color else DATA
        spaces = list(dict.fromkeys(image.colorspace_settings.name for image in images))
        if len(spaces) > 1:
            self.notes.append(
                f"{channel.label}: pictures of several color spaces ({', '.join(spaces)}) become one of "
                f"{'sRGB' if channel.color else DATA}"
            )
            return "sRGB" if channel.color and not floats else LINEAR if channel.color else DATA
        if floats:
            return DATA if spaces[0] == DATA else LINEAR
        return spaces[0]

    def _mapped(self, found: Found) -> Floats:
        corners = self.uv(found.uv_map or rendered_uv(self.obj.data))
        return corners @ found.matrix[:, :2].T + found.matrix[:, 2]

    def _paint(self, channel: Channel, shown: dict[int, Found], width: int, space: str) -> Paint:
        page = np.full(len(self.slot), -1)
        pictures: list[Picture | Floats] = []
        corners: list[Floats] = []
        islands: list[Any] = []
        others: list[Paint] = []
        for slot, material in self.materials.items():
            faces = self.slot == slot
            found = shown.get(slot)
            if found is None:
                value = value_of(material, channel)
                page[faces] = len(pictures)
                pictures.append(np.resize(value, width))
                corners.append(np.zeros((0, 3, 2)))
                islands.append(np.zeros(0, np.uint16))
                continue
            if found.image is None:
                others.append(FromCorners(self._attribute(found, width), faces))
                continue
            uv = self._mapped(found)
            numbers = island_numbers(self.surface.mesh.faces, uv)
            tiles = self._tiles[found.image]
            column, row = np.floor(uv.mean(axis=1)).astype(np.intp).T
            tile = FIRST_TILE + column + 10 * row if found.image.source == "TILED" else np.full(len(uv), FIRST_TILE)
            for number, pixels in tiles.items():
                own = faces & (tile == number)
                if not own.any():
                    continue
                page[own] = len(pictures)
                there = uv - np.array(divmod(number - FIRST_TILE, 10)[::-1])
                # what lies within the picture alone does not go on at its other side
                within = bool((np.abs(there[own] - 0.5) < 0.5 + 1e-6).all())
                wrap = EXTEND if within else found.wrap
                pictures.append(self._picture(found, pixels, width, space, wrap))
                corners.append(there)
                islands.append(numbers)
        return Together((FromPictures.of(pictures, corners, page, islands, width), *others))

    def _attribute(self, found: Found, width: int) -> Floats:
        """Return a color attribute at the corners of triangles, (f, 3, width), linear."""
        colors = self.obj.data.color_attributes
        layer = colors.get(found.attribute or self.obj.data.attributes.default_color_name)
        values = foreach(layer.data, "color", 4, np.float32).astype(np.float64)
        if layer.domain == "POINT":
            values = values[self.surface.corner_vertex]
        values = values[self.surface.triangle_corners]
        return values[:, :, 3:] if found.part == "A" else values[:, :, :width]


def _part(pixels: Pixels, part: str, width: int) -> Pixels:
    """Return the channels of a picture that are meant, (height, width, 1 or 3)."""
    count = pixels.shape[2]
    if part == "RGB":
        return np.ascontiguousarray(pixels[:, :, :3] if count >= 3 else pixels[:, :, [0, 0, 0]])
    if part == "A":
        one = pixels[:, :, count - 1] if count in (2, 4) else np.full_like(pixels[:, :, 0], 255)
    else:
        one = pixels[:, :, min("RGB".index(part), count - 1)]
    return np.repeat(one[:, :, None], width, axis=2)
