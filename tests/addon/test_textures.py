"""Pictures of materials, carried to another mesh and read from what Blender then has."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import QUICK, corner_values, make_sheet

bpy: Any = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.attributes import Carrier, TransferSettings, plan_transfer  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import Refusal, read_surface  # noqa: E402
from mobius_extension.mobius_addon.textures.by_map import textures_by_map  # noqa: E402
from mobius_extension.mobius_addon.textures.images import new_image, read_tiles  # noqa: E402
from mobius_extension.mobius_addon.textures.nodes import picture_count  # noqa: E402
from mobius_extension.mobius_addon.textures.reading import read_textures  # noqa: E402
from mobius_extension.mobius_addon.textures.settings import TextureSettings  # noqa: E402
from mobius_extension.solver import Correspondence  # noqa: E402
from mobius_extension.solver.carry.textures import png_bytes  # noqa: E402
from mobius_extension.solver.flatten.locate import TriangulatedDisc  # noqa: E402

SIZE = 128


def flat_uv(obj: Any, scale: float = 0.5, offset: float = 0.5, name: str = "UVMap") -> None:
    layer = obj.data.uv_layers.get(name) or obj.data.uv_layers.new(name=name)
    flat = np.array([obj.data.vertices[loop.vertex_index].co[:2] for loop in obj.data.loops])
    layer.uv.foreach_set("vector", (flat * scale + offset).astype(np.float32).ravel())


def smooth(channels: int = 3, seed: int = 0, size: int = SIZE) -> np.ndarray:
    """Bytes of waves of which the shortest has 16 texels."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:size, :size] / size
    waves = [
        sum(np.sin(2 * np.pi * (a * x + b * y) + c) for a, b, c in rng.uniform(-5, 5, (4, 3))) for _ in range(channels)
    ]
    values = np.stack(waves, axis=2)
    return ((values - values.min()) / np.ptp(values) * 255).astype(np.uint8)


def material(name: str, **pictures: Any) -> Any:
    """A material whose shader's sockets read pictures: (image, output) or image."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    for socket, image in pictures.items():
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        end = shader.inputs[socket.replace("_", " ")]
        if socket == "Normal":
            between = tree.nodes.new("ShaderNodeNormalMap")
            tree.links.new(between.outputs["Normal"], end)
            end = between.inputs["Color"]
        tree.links.new(node.outputs["Color"], end)
    return made


def carrier(source: Any, target: Any, **options: Any) -> Carrier:
    surfaces = read_surface(source), read_surface(target)
    plane = [surface.mesh.vertices[:, 0] + 1j * surface.mesh.vertices[:, 1] for surface in surfaces]
    face, place = TriangulatedDisc.of(plane[0], surfaces[0].mesh.faces).locate(plane[1])
    lost = options.pop("lost", np.zeros(len(face), bool))
    face = np.where(lost, -1, face)
    found = Correspondence(
        face, np.where(lost[:, None], 0, place), ~lost, (~lost).astype(float), surfaces[0].mesh.faces, len(plane[0])
    )
    return Carrier(found, *surfaces, **options)


def carry(source: Any, target: Any, way: Carrier | None = None, **chosen: Any) -> Any:
    settings = TransferSettings(kinds=("textures",), textures=TextureSettings(**chosen))
    plan = plan_transfer(source, target, way or carrier(source, target), settings)
    plan.write(target)
    return plan


def shown(target: Any, label: str) -> np.ndarray:
    """The pixels of the picture that the target's new material reads for a channel."""
    found = next(
        slot.material for slot in target.material_slots if slot.material and "mobius_textures" in slot.material
    )
    node = next(node for node in found.node_tree.nodes if node.label == label)
    tiles = read_tiles(node.image)
    return next(iter(tiles.values())) if list(tiles) == [1001] else tiles  # type: ignore[return-value]


@pytest.fixture
def sheets(empty_scene: Any) -> tuple[Any, Any]:
    source, target = make_sheet("Source", 21), make_sheet("Target", 16)
    flat_uv(source)
    flat_uv(target, -0.5)  # turned by half
    return source, target


def close(found: np.ndarray, wanted: np.ndarray, most: float = 4.0) -> None:
    # a target of other triangles reads places a fraction of a texel off
    assert np.abs(found.astype(float) - wanted).mean() < most / 4
    assert np.percentile(np.abs(found.astype(float) - wanted), 99) < most


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_blender_reads_the_bytes_that_are_written(empty_scene: Any, channels: int) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (131, 70, channels)).astype(np.uint8)
    pixels[:, :, 3:] = np.maximum(pixels[:, :, 3:], 1)
    found = read_tiles(new_image("Any", {1001: pixels}, "Non-Color"))[1001]
    if channels == 4:
        assert (found == pixels).all()
    else:
        assert (found[:, :, :3] == pixels).all()


def test_base_color_arrives_turned_as_the_layout_is(sheets: tuple[Any, Any]) -> None:
    source, target = sheets
    picture = smooth()
    source.data.materials.append(material("Skin", Base_Color=new_image("Skin", {1001: picture}, "sRGB")))
    plan = carry(source, target, size=SIZE)
    assert plan.counts() == {"textures": 1}
    assert plan.warnings == ()
    close(shown(target, "Base Color")[:, :, :3], picture[::-1, ::-1])
    made = target.material_slots[0].material
    assert made.name == "Target Textures"
    node = next(node for node in made.node_tree.nodes if node.type == "TEX_IMAGE")
    assert node.image.colorspace_settings.name == "sRGB"
    assert node.image.packed_file is not None
    assert node.inputs["Vector"].links[0].from_node.uv_map == "UVMap"
    # carried again, the first material and picture are gone
    carry(source, target)
    assert [slot.material.name for slot in target.material_slots] == ["Target Textures.001"]
    assert len([x for x in bpy.data.images if "mobius_textures" in x]) == 1


def test_every_channel_with_its_color_space_and_depth(sheets: tuple[Any, Any]) -> None:
    source, target = sheets
    names = {"Base Color": "sRGB", "Roughness": "Non-Color", "Metallic": "Non-Color", "Emission Color": "sRGB"}
    pictures = {name: smooth(3, seed) for seed, name in enumerate(names)}
    floats = (smooth(3, 9) / 100.0).astype(np.float32)  # beyond 1
    images = {name: new_image(name, {1001: pictures[name]}, names[name]) for name in names}
    images["Emission Color"] = new_image("Glow", {1001: floats}, "Linear Rec.709")
    source.data.materials.append(material("All", **{name.replace(" ", "_"): images[name] for name in names}))
    assert carry(source, target, size=SIZE).counts() == {"textures": 4}
    for label in ("Base Color", "Roughness", "Metallic"):
        close(shown(target, label)[:, :, :3], pictures[label][::-1, ::-1])
    glow = shown(target, "Emission")
    assert glow.dtype == np.float32
    close(100 * glow[:, :, :3], 100 * floats[::-1, ::-1])


def test_packed_channels_and_alpha(sheets: tuple[Any, Any]) -> None:
    """Occlusion, roughness and metallic in one picture, as glTF has them, and a color with alpha."""
    source, target = sheets
    color, packed = smooth(4, 1), smooth(3, 2)
    made = material("Packed", Base_Color=new_image("Color", {1001: color}, "sRGB"))
    tree = made.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    read, split = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeSeparateColor")
    read.image = new_image("Packed", {1001: packed}, "Non-Color")
    tree.links.new(read.outputs["Color"], split.inputs["Color"])
    tree.links.new(split.outputs["Green"], shader.inputs["Roughness"])
    tree.links.new(split.outputs["Blue"], shader.inputs["Metallic"])
    first = next(node for node in tree.nodes if node.type == "TEX_IMAGE" and node.image.name == "Color")
    tree.links.new(first.outputs["Alpha"], shader.inputs["Alpha"])
    source.data.materials.append(made)
    plan = carry(source, target, size=SIZE)
    assert plan.warnings == ()
    close(shown(target, "Base Color"), color[::-1, ::-1])
    close(shown(target, "Roughness")[:, :, 0], packed[::-1, ::-1, 1])
    close(shown(target, "Metallic")[:, :, 0], packed[::-1, ::-1, 2])
    new = target.material_slots[0].material.node_tree
    assert (
        next(n for n in new.nodes if n.type == "BSDF_PRINCIPLED").inputs["Alpha"].links[0].from_socket.name == "Alpha"
    )


@pytest.mark.parametrize("floats", [False, True])
def test_transparent_texels_give_no_color_to_those_beside_them(sheets: tuple[Any, Any], floats: bool) -> None:
    """Cards of hair: white lines of one texel on black that cannot be seen."""
    source, target = sheets
    hair = np.zeros((SIZE, SIZE, 4), np.float32)
    hair[:, ::4] = 1
    if floats:
        image = new_image("Hair", {1001: hair}, "Linear Rec.709")
        image.alpha_mode = "PREMUL"
    else:
        image = new_image("Hair", {1001: (255 * hair).astype(np.uint8)}, "sRGB")
    made = material("Hair", Base_Color=image)
    tree = made.node_tree
    node = next(node for node in tree.nodes if node.type == "TEX_IMAGE")
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])
    source.data.materials.append(made)
    carry(source, target, size=96)
    found = shown(target, "Base Color")
    scale = 1 if floats else 255
    seen = found[:, :, 3] > 0.03 * scale
    assert 0.3 < seen.mean() < 0.8
    assert found[:, :, 3][seen].min() < 0.5 * scale
    assert found[:, :, :3][seen].min() > 0.95 * scale


@pytest.mark.parametrize("by", ["BUMP", "DISPLACEMENT"])
def test_height_arrives_with_what_reads_it(sheets: tuple[Any, Any], by: str) -> None:
    source, target = sheets
    picture = smooth(1, 5)
    made = material("Bumpy")
    tree = made.node_tree
    read = tree.nodes.new("ShaderNodeTexImage")
    read.image = new_image("Height", {1001: picture}, "Non-Color")
    if by == "BUMP":
        node = tree.nodes.new("ShaderNodeBump")
        values = {"Strength": 0.3, "Distance": 0.07}
        tree.links.new(
            node.outputs["Normal"], next(x for x in tree.nodes if x.type == "BSDF_PRINCIPLED").inputs["Normal"]
        )
    else:
        node = tree.nodes.new("ShaderNodeDisplacement")
        values = {"Midlevel": 0.4, "Scale": 0.02}
        output = next(x for x in tree.nodes if x.type == "OUTPUT_MATERIAL")
        tree.links.new(node.outputs["Displacement"], output.inputs["Displacement"])
    for name, value in values.items():
        node.inputs[name].default_value = value
    tree.links.new(read.outputs["Color"], node.inputs["Height"])
    source.data.materials.append(made)
    assert carry(source, target, size=SIZE).counts() == {"textures": 1}
    close(shown(target, "Height")[:, :, 0], picture[::-1, ::-1, 0])
    new = next(x for x in target.material_slots[0].material.node_tree.nodes if x.type == by)
    assert {name: new.inputs[name].default_value for name in values} == pytest.approx(values)
    assert new.inputs["Height"].links[0].from_node.label == "Height"
    assert new.outputs[0].links[0].to_socket.name == ("Normal" if by == "BUMP" else "Displacement")


def test_pictures_and_tiles_on_disk_are_read_as_packed_ones_are(sheets: tuple[Any, Any], tmp_path: Path) -> None:
    """And the sentence where one of the tiles is gone."""
    source, target = sheets
    left, right = smooth(3, 3), smooth(3, 4)
    for number, pixels in ((1001, left), (1002, right)):
        (tmp_path / f"skin.{number}.png").write_bytes(png_bytes(pixels))
    image = bpy.data.images.load(str(tmp_path / "skin.1001.png"))
    image.source, image.filepath = "TILED", str(tmp_path / "skin.<UDIM>.png")
    if 1002 not in {tile.number for tile in image.tiles}:
        image.tiles.new(1002)
    source.data.materials.append(material("Skin", Base_Color=image))
    uv = source.data.uv_layers["UVMap"].uv
    for polygon in source.data.polygons:
        if polygon.center.x > 0:
            for k in polygon.loop_indices:
                uv[k].vector.x += 1
    carry(source, target, size=SIZE)
    found = shown(target, "Base Color")[::-1, ::-1, :3]
    close(found[:, : SIZE // 2 - 1], left[:, : SIZE // 2 - 1])
    close(found[:, SIZE // 2 + 1 :], right[:, SIZE // 2 + 1 :])
    (tmp_path / "skin.1002.png").unlink()
    with pytest.raises(Refusal, match=r"The tile 1002 of the picture .* is missing"):
        carry(source, target)


def tiled(*colors: Any) -> Any:
    """A picture with tiles that is made in Blender and not saved, a color each; None leaves one empty."""
    image = bpy.data.images.new("Painted", 32, 32, tiled=True)
    for number, color in enumerate(colors, 1001):
        if number > 1001:
            image.tiles.new(number)
        if color is not None:
            fill(image, number, color)
    return image


def fill(image: Any, number: int, color: Any) -> None:
    image.tiles.active_index = [tile.number for tile in image.tiles].index(number)
    with bpy.context.temp_override(edit_image=image):
        bpy.ops.image.tile_fill(color=color, width=32, height=32, float=False, alpha=True)


RED, GREEN, BLUE = (1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 1)


def color_of(pixels: np.ndarray) -> tuple[int, ...]:
    assert (pixels == pixels[0, 0]).all()
    return tuple(round(value / 255) for value in pixels[0, 0].tolist())


def test_tiles_that_were_never_saved_are_read(empty_scene: Any) -> None:
    image = tiled(RED, GREEN)
    assert {number: color_of(pixels) for number, pixels in read_tiles(image).items()} == {1001: RED, 1002: GREEN}
    assert image.filepath == ""
    image.pack()
    assert {number: color_of(pixels) for number, pixels in read_tiles(image).items()} == {1001: RED, 1002: GREEN}
    with pytest.raises(Refusal, match=r"The tile 1002 of the picture .* is empty: fill it"):
        read_tiles(tiled(RED, None))


@pytest.mark.parametrize("packed", [False, True])
def test_what_was_painted_on_tiles_and_not_saved_is_read_and_stays_unsaved(
    empty_scene: Any, tmp_path: Path, packed: bool
) -> None:
    for number in (1001, 1002):
        (tmp_path / f"skin.{number}.png").write_bytes(png_bytes(np.full((32, 32, 4), 255, np.uint8)))
    image = bpy.data.images.load(str(tmp_path / "skin.1001.png"))
    image.source, image.filepath = "TILED", str(tmp_path / "skin.<UDIM>.png")
    if 1002 not in {tile.number for tile in image.tiles}:
        image.tiles.new(1002)
    if packed:
        image.pack()
    image.pixels.foreach_set(np.tile(np.array(BLUE, np.float32), 32 * 32))  # of the first tile
    assert image.is_dirty
    found = {number: color_of(pixels) for number, pixels in read_tiles(image).items()}
    assert found == {1001: BLUE, 1002: (1, 1, 1, 1)}
    assert (image.packed_file is not None) == packed
    assert image.is_dirty  # so that Blender asks before it quits
    assert image.filepath == str(tmp_path / "skin.<UDIM>.png")
    assert (tmp_path / "skin.1001.png").read_bytes() == png_bytes(np.full((32, 32, 4), 255, np.uint8))


def test_a_transfer_map_of_several_tiles_draws_what_the_transfer_drew(sheets: tuple[Any, Any]) -> None:
    source, _ = sheets
    color, slopes = smooth(4, 6), smooth(3, 7) // 4 + 96
    made = material("Skin", Base_Color=new_image("Color", {1001: color}, "sRGB"))
    tree = made.node_tree
    node = next(x for x in tree.nodes if x.type == "TEX_IMAGE")
    tree.links.new(node.outputs["Alpha"], next(x for x in tree.nodes if x.type == "BSDF_PRINCIPLED").inputs["Alpha"])
    read, bumps = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    read.image = new_image("Slopes", {1001: slopes}, "Non-Color")
    tree.links.new(read.outputs["Color"], bumps.inputs["Color"])
    tree.links.new(bumps.outputs["Normal"], next(x for x in tree.nodes if x.type == "BSDF_PRINCIPLED").inputs["Normal"])
    source.data.materials.append(made)
    target = make_sheet("Wide", 17)
    flat_uv(target, -1.0, 1.0)  # four tiles, turned
    way = carrier(source, target)
    settings = TextureSettings(size=SIZE, margin=0)
    reading = read_textures(source, target, way, settings, keeps_map=True)
    assert reading is not None
    drawn = reading.carry()
    assert drawn.transfer_map is not None
    assert drawn.turns is not None
    again = textures_by_map(source, target, (way.source, way.target), drawn.transfer_map, drawn.turns, settings)
    assert again.notes == ()
    assert again.alpha
    assert (
        [x.channel.identifier for x in again.made]
        == [x.channel.identifier for x in drawn.made]
        == ["base_color", "normal"]
    )
    for first, second in zip(drawn.made, again.made, strict=True):
        assert sorted(first.tiles) == sorted(second.tiles) == [1001, 1002, 1011, 1012]
        for number, pixels in first.tiles.items():
            # at the border of a tile the neighbour that tells how wide a texel is may be missing
            apart = np.abs(pixels.astype(int) - second.tiles[number])[2:-2, 2:-2]
            assert np.percentile(apart, 99) <= 2
            assert np.ptp(pixels[:, :, 0]) > 20
    kept = {k: x for k, x in drawn.transfer_map.items() if k != 1002}
    with pytest.raises(Refusal, match="the transfer map has no tile 1002"):
        textures_by_map(source, target, (way.source, way.target), kept, drawn.turns, settings)


def test_several_materials_and_tiles_become_one(sheets: tuple[Any, Any]) -> None:
    source, target = sheets
    left, right = smooth(3, 3), smooth(3, 4)
    source.data.materials.append(material("Left", Base_Color=new_image("L", {1001: left}, "sRGB")))
    source.data.materials.append(material("Right", Base_Color=new_image("R", {1001: left, 1002: right}, "sRGB")))
    uv = source.data.uv_layers["UVMap"].uv
    for polygon in source.data.polygons:
        if polygon.center.x > 0:
            polygon.material_index = 1
            for k in polygon.loop_indices:
                uv[k].vector.x += 1
    carry(source, target, size=SIZE)
    found = shown(target, "Base Color")[::-1, ::-1, :3]
    close(found[:, : SIZE // 2 - 1], left[:, : SIZE // 2 - 1])
    close(found[:, SIZE // 2 + 1 :], right[:, SIZE // 2 + 1 :])


def test_tiles_of_the_target(sheets: tuple[Any, Any]) -> None:
    source, target = sheets
    picture = smooth()
    source.data.materials.append(material("Skin", Base_Color=new_image("Skin", {1001: picture}, "sRGB")))
    target = make_sheet("Wide", 17)
    flat_uv(target, 1.0, 1.0)  # four tiles
    carry(source, target, size=SIZE)
    tiles: Any = shown(target, "Base Color")
    assert sorted(tiles) == [1001, 1002, 1011, 1012]
    large = np.repeat(np.repeat(picture[:64, 64:], 2, axis=0), 2, axis=1)
    close(tiles[1002][2:-2, 2:-2, :3], large[2:-2, 2:-2], 24.0)  # twice as large, smoothly


@pytest.mark.parametrize("layout", ["carried", "disc"])
def test_a_target_without_a_layout_gets_one(sheets: tuple[Any, Any], layout: str) -> None:
    source, target = sheets
    picture = smooth()
    source.data.materials.append(material("Skin", Base_Color=new_image("Skin", {1001: picture}, "sRGB")))
    if layout == "disc":
        assert carry(source, target, layout=layout).textures.layout.name == "Disc"
        assert [x.name for x in target.data.uv_layers] == ["UVMap", "Disc"]
    target.data.uv_layers.remove(target.data.uv_layers["UVMap"])
    if layout == "carried":
        carry(source, target, size=SIZE)
        close(shown(target, "Base Color")[:, :, :3], picture)
    name = "UVMap" if layout == "carried" else "Disc"
    uv = corner_values(target, name)
    found = shown(target, "Base Color")
    size = len(found)
    inside = (uv * size).astype(int).clip(0, size - 1)
    places = np.array([target.data.vertices[loop.vertex_index].co[:2] for loop in target.data.loops])
    there = ((places / 2 + 0.5) * SIZE).astype(int).clip(0, SIZE - 1)
    error = found[inside[:, 1], inside[:, 0], :3].astype(float) - picture[there[:, 1], there[:, 0]]
    assert np.abs(error).mean() < 12  # places rounded to texels, on waves of 16 texels


def test_a_scan_with_colors_and_no_material_gets_a_picture_and_back(sheets: tuple[Any, Any]) -> None:
    source, target = sheets
    layer = source.data.color_attributes.new("Col", "FLOAT_COLOR", "POINT")
    place = np.array([vertex.co[:] for vertex in source.data.vertices])
    color = np.ones((len(place), 4), np.float32)
    color[:, :3] = (place + 1) / 2
    layer.data.foreach_set("color", color.ravel())
    source.data.attributes.default_color_name = "Col"
    carry(source, target, size=SIZE)
    found = shown(target, "Base Color")[:, :, 0] / 255
    linear = np.where(found <= 0.04045, found / 12.92, ((found + 0.055) / 1.055) ** 2.4)
    assert np.abs(linear - (1 - (np.arange(SIZE) + 0.5) / SIZE)).max() < 0.01
    # and the picture as colors of a third mesh
    third = make_sheet("Third", 12)
    carry(target, third, carrier(target, third), result="attributes")
    values = np.array([x.color[0] for x in third.data.color_attributes["Base Color"].data])
    expected = [(third.data.vertices[loop.vertex_index].co.x + 1) / 2 for loop in third.data.loops]
    assert np.abs(values - expected).max() < 0.02


def test_flat_normals_stay_flat_and_mirrored_ones_are_mirrored(sheets: tuple[Any, Any]) -> None:
    """A normal map of slopes along x: on a target whose layout is turned and mirrored they still point along x."""
    source, target = sheets
    tilt = np.zeros((SIZE, SIZE, 3), np.uint8)
    tilt[:] = np.round(255 * (np.array([0.6, 0, 0.8]) / 2 + 0.5))
    source.data.materials.append(material("Bumps", Normal=new_image("N", {1001: tilt}, "Non-Color")))
    uv = target.data.uv_layers["UVMap"].uv
    for (scale_x, scale_y), swap, wanted in (
        ((0.5, 0.5), False, (0.6, 0)),
        ((-0.5, -0.5), False, (-0.6, 0)),
        ((-0.5, 0.5), False, (-0.6, 0)),
        ((0.5, -0.5), True, (0, -0.6)),
    ):
        flat = np.array([target.data.vertices[loop.vertex_index].co[:2] for loop in target.data.loops])
        flat = flat[:, ::-1] if swap else flat
        uv.foreach_set("vector", (flat * [scale_x, scale_y] + 0.5).astype(np.float32).ravel())
        carry(source, target, size=SIZE)
        found = 2 * (shown(target, "Normal")[:, :, :3].astype(float) / 255) - 1
        # tangents follow the bumps of the sheet
        assert np.abs(found[..., :2].mean(axis=(0, 1)) - wanted).max() < 0.03
        assert np.abs(found[..., 2] - 0.8).max() < 0.02
        node = next(n for n in target.material_slots[0].material.node_tree.nodes if n.type == "NORMAL_MAP")
        assert node.uv_map == "UVMap"


@pytest.mark.parametrize("gap", ["leave", "nearest", "fill"])
def test_what_has_no_counterpart(sheets: tuple[Any, Any], gap: Any) -> None:
    source, target = sheets
    white = np.full((SIZE, SIZE, 3), 255, np.uint8)
    source.data.materials.append(material("White", Base_Color=new_image("W", {1001: white}, "sRGB")))
    lost = np.array([vertex.co.x > 0.5 for vertex in target.data.vertices])
    carry(source, target, carrier(source, target, lost=lost, gap=gap), size=SIZE, mask=True)
    found = shown(target, "Base Color")
    mask = next(iter(read_tiles(bpy.data.images["Target Unmatched"]).values()))[:, :, 0]
    assert mask[:, :20].min() == 255  # the layout is turned
    assert mask[:, 40:].max() == 0
    if gap == "leave":
        assert found[:, :20, 3].max() == 0
        assert found[:, 40:, 3].min() == 255
    else:
        assert found[:, :, :3].min() >= 254


def test_bad_input_is_a_sentence(sheets: tuple[Any, Any], tmp_path: Path) -> None:
    source, target = sheets
    with pytest.raises(Refusal, match="'Source' has no textures to transfer"):
        carry(source, target)
    made = material("Skin", Base_Color=new_image("Skin", {1001: smooth()}, "sRGB"))
    source.data.materials.append(made)
    flat_uv(target, 1.0)
    with pytest.raises(Refusal, match=r"The UV map 'UVMap' of 'Target' has .* faces across the border of a tile"):
        carry(source, target)
    flat_uv(target, 0.5, -0.5)
    with pytest.raises(Refusal, match="outside of all tiles"):
        carry(source, target)
    flat_uv(target)
    for polygon in target.data.polygons:
        for k in polygon.loop_indices:
            uv = target.data.uv_layers["UVMap"].uv[k].vector
            uv.x = abs(uv.x - 0.5)
    assert any("overlap in its UV map" in warning for warning in carry(source, target).warnings)
    node = next(node for node in made.node_tree.nodes if node.type == "TEX_IMAGE")
    node.image = bpy.data.images.new("Gone", 4, 4)
    node.image.source = "FILE"
    node.image.filepath = str(tmp_path / "gone.png")
    with pytest.raises(Refusal, match="The picture 'Gone' is missing or cannot be read"):
        carry(source, target)
    source.data.uv_layers.remove(source.data.uv_layers["UVMap"])
    with pytest.raises(Refusal, match="'Source' has no UV map, which the picture 'Gone'"):
        carry(source, target)


def test_a_failure_leaves_nothing_behind(sheets: tuple[Any, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    source, target = sheets
    source.data.materials.append(material("Skin", Base_Color=new_image("Skin", {1001: smooth()}, "sRGB")))
    target.data.uv_layers.remove(target.data.uv_layers["UVMap"])
    before = len(bpy.data.images), len(bpy.data.materials)
    from mobius_extension.mobius_addon.textures import writing

    def fail(*_: object) -> None:
        raise RuntimeError("disk full")

    monkeypatch.setattr(writing, "_assign", fail)
    with pytest.raises(RuntimeError, match="disk full"):
        carry(source, target)
    assert (len(bpy.data.images), len(bpy.data.materials)) == before
    assert not target.data.uv_layers
    assert not target.material_slots


def test_the_operator_carries_pictures(pair: tuple[Any, Any]) -> None:
    source, target = pair
    source.data.materials.append(material("Skin", Base_Color=new_image("Skin", {1001: smooth()}, "sRGB")))
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    assert bpy.ops.mobius.transfer(kinds={"TEXTURES"}) == {"FINISHED"}
    assert shown(target, "Base Color").shape[2] == 4
    assert [x.name for x in target.data.uv_layers if x.active_render] == ["UVMap"]


def test_side_by_side_previews_the_pictures_before_they_are_transferred(pair: tuple[Any, Any], tmp_path: Path) -> None:
    """On a copy with a mesh of its own: the target stays as it was, and the end takes everything away."""
    source, target = pair
    picture = smooth()
    source.data.materials.append(material("Skin", Base_Color=new_image("Skin", {1001: picture}, "sRGB")))
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    settings = bpy.context.scene.mobius

    def counts() -> tuple[int, ...]:
        return tuple(len(x) for x in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.images))

    before = counts()
    settings.kinds = {"UV"}
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    assert bpy.data.collections["Mobius Side by Side"].objects[1].data == target.data
    settings.kinds = {"UV", "TEXTURES"}
    uv_maps = [x.name for x in target.data.uv_layers]
    for _ in range(2):
        assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
        copy = bpy.data.collections["Mobius Side by Side"].objects[1]
        assert copy.data != target.data
        seen = shown(copy, "Base Color")
        assert seen.shape[:2] == (1024, 1024)
        assert not target.material_slots
        assert [x.name for x in target.data.uv_layers] == uv_maps
        assert counts() == (before[0] + 2, *(x + 1 for x in before[1:]))
    # a file that is saved meanwhile has nothing of it, but for what a person took for themselves
    for taken in (False, True):
        path = str(tmp_path / "saved.blend")
        source.material_slots[0].link = "OBJECT"
        source.material_slots[0].material = copy.data.materials[0] if taken else None
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
        with bpy.data.libraries.load(path) as (held, _):
            assert len(held.objects) == before[0]
            assert len(held.meshes) == before[1]
            assert len(held.materials) == before[2] + taken
            assert len(held.images) == before[3] + taken
    source.material_slots[0].material = None
    source.material_slots[0].link = "DATA"
    # what is transferred shows the same, in another size
    settings.texture_size = 512
    assert bpy.ops.mobius.transfer(kinds={"TEXTURES"}, texture_size=512) == {"FINISHED"}
    given = shown(target, "Base Color")
    assert np.abs(seen.reshape(512, 2, 512, 2, 4).mean(axis=(1, 3)) - given)[given[:, :, 3] > 0].mean() < 4
    assert bpy.ops.mobius.end_side_by_side() == {"FINISHED"}
    assert counts() == (before[0], before[1], before[2] + 1, before[3] + 1)
    # and Clear ends it too
    for block in (target.data.materials[0], next(x for x in bpy.data.images if "mobius_textures" in x)):
        (bpy.data.materials if isinstance(block, bpy.types.Material) else bpy.data.images).remove(block)
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    assert counts()[1] == before[1] + 1
    bpy.context.view_layer.objects.active = target
    assert bpy.ops.mobius.clear() == {"FINISHED"}
    assert counts()[1:] == before[1:]


def test_a_preview_that_cannot_be_is_a_warning(pair: tuple[Any, Any], tmp_path: Path) -> None:
    source, target = pair
    gone = bpy.data.images.new("Gone", 4, 4)
    gone.source, gone.filepath = "FILE", str(tmp_path / "gone.png")
    source.data.materials.append(material("Skin", Base_Color=gone))
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    bpy.context.scene.mobius.kinds = {"TEXTURES"}
    meshes = len(bpy.data.meshes)
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    assert bpy.data.collections["Mobius Side by Side"].objects[1].data == target.data
    assert len(bpy.data.meshes) == meshes


def test_the_panel_counts_the_pictures(sheets: tuple[Any, Any]) -> None:
    source, _ = sheets
    assert picture_count(source) == 0
    source.data.color_attributes.new("Mobius Pattern", "FLOAT_COLOR", "POINT")
    source.data.attributes.default_color_name = "Mobius Pattern"
    assert picture_count(source) == 0  # what Side by Side paints is nobody's texture
    layer = source.data.color_attributes.new("Col", "FLOAT_COLOR", "POINT")
    source.data.attributes.default_color_name = layer.name
    assert picture_count(source) == 1
    first = new_image("One", {1001: smooth()}, "sRGB")
    source.data.materials.append(material("Skin", Base_Color=first, Emission_Color=first))
    assert picture_count(source) == 1
    group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    group.nodes.new("ShaderNodeTexImage").image = new_image("Two", {1001: smooth()}, "sRGB")
    made = material("Other")
    made.node_tree.nodes.new("ShaderNodeGroup").node_tree = group
    source.data.materials.append(made)
    assert picture_count(source) == 2
