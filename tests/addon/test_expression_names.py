from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")
from mobius_extension.mobius_addon.attributes.expression_names import (
    MIDDLE,
    PAIRED,
    VISEMES,
    WHOLE,
    renamed,
    spelled,
    understood,
)


def test_there_are_52_and_every_spelling_of_each_is_understood() -> None:
    sided = [(base, side) for base in PAIRED for side in "LR"]
    assert len(sided) + len(WHOLE) + len(MIDDLE) == 52
    for base, side in [*sided, *((base, "") for base in (*WHOLE, *MIDDLE))]:
        for spelling in ("arkit", "underscore", "dot"):
            name = spelled(base, side, spelling)
            for written in (name, name[0].upper() + name[1:], f"blendShape1.{name}", name.replace("_", " ")):
                assert understood(written) == (base, side), written
    assert all(understood(f"viseme_{sound}") == (f"viseme_{sound}", "") for sound in VISEMES)


@pytest.mark.parametrize("name", ["Basis", "Key 1", "eyeBlink", "Eye_L_Look_R", "L", "", "leftover", "あ"])
def test_what_is_not_known_is_not_guessed(name: str) -> None:
    assert understood(name) is None


def test_names_are_never_lost_nor_double() -> None:
    names = ["eyeBlink_L", "EyeBlinkLeft", "browInnerUp_L", "browInnerUp_R", "Wink", "jawOpen", "JawOpen"]
    found = renamed(names, "arkit")
    assert sorted(part for parts in found.values() for part in parts) == sorted(names)
    assert found["browInnerUp"] == ("browInnerUp_L", "browInnerUp_R")
    assert found["eyeBlinkLeft"] == ("eyeBlink_L",)
    # one half alone stays a half
    assert renamed(["cheekPuff_L"], "arkit") == {"cheekPuffLeft": ("cheekPuff_L",)}


def test_where_the_map_mirrors_sides_change_places() -> None:
    import bpy

    names = ["hand_l", "hand_r", "Spine", "jawLeft", "mouthSmileRight"]
    found = renamed(names, "keep", bpy.utils.flip_name)
    assert found == {
        new: (old,) for old, new in zip(names, ["hand_r", "hand_l", "Spine", "jawRight", "mouthSmileLeft"], strict=True)
    }
    found = renamed(["eyeBlink_L", "eyeBlink_R", "jawLeft"], "dot", bpy.utils.flip_name)
    assert found == {"eyeBlink.R": ("eyeBlink_L",), "eyeBlink.L": ("eyeBlink_R",), "jawRight": ("jawLeft",)}


def test_halves_arrive_as_one_key_under_its_name() -> None:
    from mobius_extension.mobius_addon.attributes import TransferSettings, plan_transfer
    from scenes import make_sheet, positions
    from test_transfer_shape_keys import add_key, same_vertices, shape

    source, target = make_sheet("Source", 12), make_sheet("Target", 12)
    left, right = (np.tile([0.0, 0.0, height], (144, 1)) for height in (0.1, 0.2))
    add_key(source, "browInnerUp_L", left)
    add_key(source, "browInnerUp_R", right)
    settings = TransferSettings(kinds=("shape-keys",), spelling="arkit")
    plan_transfer(source, target, same_vertices(source, target), settings).write(target)
    assert target.data.shape_keys.key_blocks.keys() == ["Basis", "browInnerUp"]
    assert np.abs(shape(target, "browInnerUp") - positions(target) - left - right).max() < 1e-5


def test_one_key_for_both_sides_arrives_as_two_whose_sum_it_is() -> None:
    from mobius_extension.mobius_addon.attributes import TransferSettings, plan_transfer
    from scenes import make_sheet, positions
    from test_transfer_shape_keys import add_key, same_vertices, shape

    source, target = make_sheet("Source", 15), make_sheet("Target", 15)
    places = positions(source)
    up = np.tile([0.0, 0.0, 0.1], (225, 1))
    # which side is left is told by other expressions, here at -x
    for side, sign in (("L", -1), ("R", 1)):
        add_key(source, f"eyeBlink_{side}", up * (sign * places[:, :1] > 0.3))
    add_key(source, "browInnerUp", up)
    add_key(source, "Cheek_Puff", up)
    source.data.shape_keys.key_blocks["browInnerUp"].driver_add("value").driver.expression = "0.25"
    for spelling, names in (
        ("keep", ["browInnerUpLeft", "browInnerUpRight", "Cheek_Puff_L", "Cheek_Puff_R"]),
        ("arkit", ["browInnerUpLeft", "browInnerUpRight", "cheekPuffLeft", "cheekPuffRight"]),
        ("dot", ["browInnerUp.L", "browInnerUp.R", "cheekPuff.L", "cheekPuff.R"]),
    ):
        target = make_sheet(spelling, 15)
        settings = TransferSettings(kinds=("shape-keys",), spelling=spelling, halves=True)
        plan_transfer(source, target, same_vertices(source, target), settings).write(target)
        assert target.data.shape_keys.key_blocks.keys()[3:] == names
        left, right = (shape(target, name) - positions(target) for name in names[:2])
        assert np.abs(left + right - up).max() < 1e-6
        x = positions(target)[:, 0]
        assert left[:, 2][x < -0.31] == pytest.approx(0.1, abs=1e-6)
        assert left[:, 2][x > 0.31] == pytest.approx(0, abs=1e-6)
        assert left[:, 2][np.abs(x) < 1e-6] == pytest.approx(0.05, abs=1e-3)
        moved = {curve.data_path for curve in target.data.shape_keys.animation_data.drivers}
        assert moved == {f'key_blocks["{name}"].value' for name in names[:2]}
    # what has halves is left alone, and they stay two
    add_key(source, "browInnerUp_L", up)
    target = make_sheet("Other", 15)
    plan_transfer(source, target, same_vertices(source, target), settings).write(target)
    assert sum("browInnerUp" in name for name in list(target.data.shape_keys.key_blocks.keys())) == 2


def test_keys_that_are_nearly_symmetric_are_so_if_asked() -> None:
    from mobius_extension.mobius_addon.attributes import TransferSettings, plan_transfer
    from scenes import make_sheet, positions
    from test_transfer_shape_keys import add_key, same_vertices, shape

    def hollow(name: str) -> Any:
        """A sheet that is symmetric in x alone."""
        obj = make_sheet(name, 15)
        for vertex in obj.data.vertices:
            vertex.co.z = 0.3 * vertex.co.y**3 + 0.2 * vertex.co.x**2
            vertex.co.y *= 1.4
        return obj

    source = hollow("Source")
    places, rng = positions(source), np.random.default_rng(0)
    noise = 0.1 * rng.normal(size=(2, len(places), 3))
    x, y = places[:, :1], places[:, 1:2]
    add_key(source, "jawOpen", np.hstack([0 * x, 0 * x, np.exp(-4 * (x**2 + y**2))]) + 0.1 * noise[0])
    for side, sign in (("Left", 1), ("Right", -1)):
        smile = np.hstack([sign + 0 * x, 0 * x, 1 + 0 * x]) * np.exp(-4 * (x - sign * 0.5) ** 2)
        add_key(source, f"mouthSmile{side}", smile)
    add_key(source, "mouthLeft", np.hstack([1 + 0 * x, 0 * x, 0 * x]))
    add_key(source, "Wink.L", noise[1])
    plain = TransferSettings(kinds=("shape-keys",))
    mirrored = np.argmin(np.linalg.norm(places[:, None] * [-1, 1, 1] - places[None], axis=2), axis=1)

    def carried(settings: TransferSettings) -> dict[str, np.ndarray]:
        target = hollow("Target")
        plan_transfer(source, target, same_vertices(source, target), settings).write(target)
        names = target.data.shape_keys.key_blocks.keys()[1:]
        return {name: shape(target, name) - positions(target) for name in names}

    def image(moved: np.ndarray) -> np.ndarray:
        return moved[mirrored] * [-1, 1, 1]

    before, after = carried(plain), carried(replace(plain, symmetric=True))
    assert np.abs(before["jawOpen"] - image(before["jawOpen"])).max() > 0.01
    assert np.abs(after["jawOpen"] - image(after["jawOpen"])).max() < 1e-5
    assert np.abs(after["jawOpen"] - (before["jawOpen"] + image(before["jawOpen"])) / 2).max() < 1e-5
    assert np.abs(after["mouthSmileLeft"] - image(after["mouthSmileRight"])).max() < 1e-5
    # what is meant to be lopsided stays so
    for name in ("mouthLeft", "Wink.L"):
        assert np.abs(after[name] - before[name]).max() < 1e-6


def test_a_target_that_is_not_symmetric_is_named() -> None:
    from mobius_extension.mobius_addon.attributes import TransferSettings, plan_transfer
    from scenes import make_sheet
    from test_transfer_shape_keys import add_key, same_vertices

    source, target = make_sheet("Source", 9), make_sheet("Target", 9)
    rng = np.random.default_rng(1)
    for vertex in target.data.vertices:
        vertex.co = rng.normal(size=3).tolist()
    add_key(source, "jawOpen", np.ones((81, 3)))
    settings = TransferSettings(kinds=("shape-keys",), symmetric=True)
    plan = plan_transfer(source, target, same_vertices(source, target), settings)
    assert any("is not symmetric" in warning for warning in plan.warnings)
