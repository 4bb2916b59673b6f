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
