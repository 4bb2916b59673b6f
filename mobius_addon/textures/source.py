"""What the materials of a source show: its pictures, and where its faces lie in them."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...solver.carry.textures import (
    EXTEND,
    FromCorners,
    FromPictures,
    Paint,
    Picture,
    Together,
    encoded,
    island_numbers,
)
from ...solver.carry.textures.layout import plane_areas
from ...solver.carry.textures.picture import Pixels
from ...solver.surface.mesh import Floats, Integers
from ..attributes.carrier import Carrier
from ..mesh_data import Refusal, foreach
from .images import FIRST_TILE, read_tiles
from .layouts import corner_uv, rendered_uv
from .made import DATA, LINEAR, ChannelPlan
from .nodes import CHANNELS, Channel, Found, found_in, own_colors, shader_of, value_of


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
        opaque = None
        if found.part == "RGB" and pixels.shape[2] == 4 and self._shows_alpha(found.image):
            alpha = pixels[:, :, 3]
            if pixels.dtype == np.uint8:
                opaque = alpha
            else:
                opaque = encoded(alpha.reshape(-1, 1), srgb=False).reshape(alpha.shape)
                if space != DATA and found.image.alpha_mode in ("STRAIGHT", "PREMUL"):
                    # Blender has read the colors of floats times alpha
                    pixels = pixels / np.where(alpha > 0, alpha, 1)[:, :, None]
        return Picture.of(_part(pixels, found.part, width), srgb=srgb, wrap=wrap, opaque=opaque)

    def _shows_alpha(self, image: Any) -> bool:
        """Return whether the picture says where a material that shows it is transparent."""
        alpha = next(channel for channel in CHANNELS if channel.identifier == "alpha")
        seen = [found_in(x, alpha) for x in self.materials.values() if x is not None]
        return any(x is not None and x.image == image and x.part == "A" for x in seen)

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
            name = own_colors(self.obj)  # a scan that has colors and no material
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
