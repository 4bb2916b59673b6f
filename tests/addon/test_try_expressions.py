"""Try Expressions: keys come and go, and afterwards everything is as it was, however it ended."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes import make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.operators.try_expressions import (  # noqa: E402
    PlayOperator,
    playable,
    why_not_played,
)
from mobius_extension.mobius_addon.playing import Play, stop  # noqa: E402

KEYS = ("eyeBlinkLeft", "jawOpen", "mouthSmile")


class Window:
    """What an operator needs of a window's context, noting what was done to it."""

    def __init__(self) -> None:
        self.timers, self.status = 0, []
        self.window, self.windows = None, []
        self.window_manager = self.workspace = self
        self.scene = bpy.context.scene

    def event_timer_add(self, _seconds: float, *, window: Any) -> str:
        self.timers += 1
        return "timer"

    def event_timer_remove(self, timer: str) -> None:
        assert timer == "timer"
        self.timers -= 1

    def modal_handler_add(self, _operator: Any) -> None:
        pass

    def status_text_set(self, text: str | None) -> None:
        self.status.append(text)


def event(kind: str, value: str = "PRESS") -> Any:
    return SimpleNamespace(type=kind, value=value)


TICK = event("TIMER", "NOTHING")


def with_keys(name: str, names: tuple[str, ...] = KEYS) -> Any:
    obj = make_sheet(name, 6)
    obj.shape_key_add(name="Basis")
    for number, own in enumerate(names):
        key = obj.shape_key_add(name=own)
        key.slider_min, key.value = -1.0, 0.1 * number
        for point in key.data:
            point.co.z += 1.0
    return obj


@pytest.fixture
def pair() -> tuple[Any, Any]:
    source, target = with_keys("Source"), with_keys("Target", (*KEYS, "mine"))
    target.data.shape_keys.key_blocks["mine"].value = 0.7
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    return source, target


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr("mobius_extension.mobius_addon.operators.try_expressions.time.monotonic", lambda: now[0])
    return now


def values(obj: Any) -> dict[str, float]:
    return {key.name: key.value for key in obj.data.shape_keys.key_blocks}


def play() -> tuple[PlayOperator, Window]:
    operator, window = PlayOperator(), Window()
    assert operator.begin(window) == {"RUNNING_MODAL"}
    return operator, window


@pytest.mark.parametrize("seconds", [0.05, 3.0])  # a window that draws slowly skips none
def test_each_key_comes_and_goes_on_both_and_all_is_as_before(
    seconds: float, pair: tuple[Any, Any], clock: list[float]
) -> None:
    before = [values(obj) for obj in pair]
    operator, window = play()
    most: dict[str, float] = {}
    result: set[str] = set()
    for _ in range(1000):
        clock[0] += seconds
        result = operator.modal(window, TICK)
        if "FINISHED" in result:
            break
        shown = [values(obj) for obj in pair]
        # the reference key's own value, which does nothing, is 1 from Blender 5.2 on
        assert sum(value > 0 for name, value in shown[1].items() if name != "Basis") <= 1
        assert {name: shown[1][name] for name in KEYS} == {name: shown[0][name] for name in KEYS}
        most = {name: max(value, most.get(name, 0)) for name, value in shown[1].items()}
    assert "FINISHED" in result
    assert all(most[name] > 0.99 for name in (*KEYS, "mine"))
    assert [values(obj) for obj in pair] == before
    assert window.timers == 0
    assert window.status[-1] is None
    assert any("jawOpen (2 " in text for text in window.status if text)
    assert Play.current is None


@pytest.mark.parametrize("end", ["ESC", "LEFTMOUSE", "Z", "cancel", "stop", "save_pre", "undo_pre", "load_pre"])
def test_whatever_ends_it_puts_all_back(pair: tuple[Any, Any], clock: list[float], end: str) -> None:
    before = [values(obj) for obj in pair]
    operator, window = play()
    clock[0] += 0.5
    operator.modal(window, TICK)
    assert [values(obj) for obj in pair] != before
    if end == "cancel":
        operator.cancel(window)
    elif end == "stop":
        stop()
    elif end.endswith("_pre"):
        assert stop in getattr(bpy.app.handlers, end)
        stop(None, None)
    else:
        result = operator.modal(window, event(end))
        assert result == ({"FINISHED", "PASS_THROUGH"} if end == "Z" else {"FINISHED"})
    assert [values(obj) for obj in pair] == before
    assert window.timers == 0
    # what still arrives finds that it is over
    assert "FINISHED" in operator.modal(window, TICK)
    operator.cancel(window)
    assert window.timers == 0


def test_looking_around_goes_on_and_arrows_choose(pair: tuple[Any, Any], clock: list[float]) -> None:
    operator, window = play()
    for kind in ("MIDDLEMOUSE", "WHEELUPMOUSE", "NUMPAD_5", "LEFT_SHIFT", "MOUSEMOVE"):
        assert operator.modal(window, event(kind)) == {"PASS_THROUGH"}
    assert operator.modal(window, event("A", "RELEASE")) == {"PASS_THROUGH"}
    assert Play.current is not None
    for kind, number in (
        ("RIGHT_ARROW", 1),
        ("RIGHT_ARROW", 2),
        ("LEFT_ARROW", 1),
        ("LEFT_ARROW", 0),
        ("LEFT_ARROW", 0),
    ):
        assert operator.modal(window, event(kind)) == {"RUNNING_MODAL"}
        assert Play.current.number == number
    for _ in range(3):
        assert "RUNNING_MODAL" in operator.modal(window, event("RIGHT_ARROW"))
    assert operator.modal(window, event("RIGHT_ARROW")) == {"FINISHED"}


def test_driven_keys_are_played_and_their_drivers_work_afterwards(pair: tuple[Any, Any], clock: list[float]) -> None:
    _, target = pair
    keys = target.data.shape_keys
    for name in ("jawOpen", "mine"):
        keys.key_blocks[name].driver_add("value").driver.expression = "0.25"
    muted = next(x for x in keys.animation_data.drivers if "mine" in x.data_path)
    muted.mute = True
    operator, window = play()
    for _ in range(6):
        clock[0] += 0.9 * 0.25
        operator.modal(window, TICK)
    bpy.context.view_layer.update()
    assert keys.key_blocks["jawOpen"].value == pytest.approx(1)
    operator.modal(window, event("ESC"))
    bpy.context.view_layer.update()
    assert keys.key_blocks["jawOpen"].value == pytest.approx(0.25)
    assert {x.data_path: x.mute for x in keys.animation_data.drivers} == {
        'key_blocks["jawOpen"].value': False,
        'key_blocks["mine"].value': True,
    }


def test_objects_that_go_while_it_plays_are_left_alone(pair: tuple[Any, Any], clock: list[float]) -> None:
    source, target = pair
    before = values(target)
    operator, window = play()
    bpy.data.meshes.remove(source.data)
    target.shape_key_remove(target.data.shape_keys.key_blocks["jawOpen"])
    target.name = "Renamed"
    clock[0] += 0.5
    assert operator.modal(window, TICK) == {"PASS_THROUGH"}
    bpy.data.meshes.remove(target.data)
    assert "FINISHED" in operator.modal(window, TICK)
    assert window.timers == 0
    assert before


def test_what_the_transfer_wrote_is_played_beside_what_it_came_from(pair: tuple[Any, Any]) -> None:
    source, target = pair
    assert [name for name, _ in playable(target, source)] == [*KEYS, "mine"]
    assert playable(target, None)[0] == (KEYS[0], None)
    target.data.mobius_transferred = (
        '{"source": "Source", "layers": [["shape-keys", "jawOpen", "mine", 1.0], ["uv", "a", "b", 1.0], '
        '["shape-keys", "gone", "mouthSmile", 1.0]], "warnings": [], "uncertain": 0.0}'
    )
    assert playable(target, source) == [("mine", "jawOpen"), ("mouthSmile", None)]
    target.data.shape_keys.key_blocks["mine"].mute = True
    assert playable(target, source) == [("mouthSmile", None)]


def test_what_cannot_be_played_is_said(pair: tuple[Any, Any]) -> None:
    _, target = pair
    assert why_not_played(bpy.context) is None
    with pytest.raises(RuntimeError, match="without a window"):
        bpy.ops.mobius.try_expressions()
    target.data.shape_keys.use_relative = False
    assert "absolute" in str(why_not_played(bpy.context))
    target.shape_key_clear()
    assert "transfer some first" in str(why_not_played(bpy.context))
    bpy.context.scene.mobius.target = None
    assert "Choose a target mesh first" in str(why_not_played(bpy.context))
    with pytest.raises(RuntimeError, match="poll"):
        bpy.ops.mobius.try_expressions()


def test_nothing_is_in_undo(pair: tuple[Any, Any], clock: list[float]) -> None:
    _, target = pair
    bpy.ops.ed.undo_push(message="before")
    before = values(target)
    operator, window = play()
    clock[0] += 0.5
    operator.modal(window, TICK)
    operator.modal(window, event("ESC"))
    target.data.shape_keys.key_blocks["jawOpen"].value = 0.9
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert values(bpy.data.objects["Target"]) == before
    assert np.isfinite(list(before.values())).all()
