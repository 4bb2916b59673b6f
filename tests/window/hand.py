"""Hand and eye of a person at Blender's window: keys, clicks, and what the mouse is over.

`region`, `click` and `shot` are the driver's, which `clicks.py` hands on.
"""

import math
import os
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy

SHOTS = Path(os.environ["MOBIUS_SHOTS"])
STEP = 12
"""Pixels between places where a button is looked for; a row is twenty high."""

DRAWN = 0.4
"""Seconds after which the window is drawn again."""

Wait = Iterator[float]

region: Callable[[str], Any]
click: Callable[[int, int], None]
shot: Callable[[str], None]


def until(happened: Any, every: float = 0.1) -> Wait:
    """Wait for something, two minutes at most."""
    end = time.monotonic() + 120
    while not happened():
        assert time.monotonic() < end, "nothing happened in two minutes"
        yield every


def picture(name: str, wait: float = 1.2) -> Wait:
    """Take a picture after so many seconds, in which the window is drawn several times: panels unfold step by step."""
    for _ in range(math.ceil(wait / DRAWN)):
        yield min(wait, DRAWN)
    shot(str(SHOTS / f"{name}.png"))


def pointer(*arguments: object) -> None:
    subprocess.run(["xdotool", *map(str, arguments)], check=True)


def escape() -> None:
    pointer("key", "Escape")


def undo() -> None:
    over_the_viewport()
    pointer("key", "ctrl+z")


def redo() -> None:
    over_the_viewport()
    pointer("key", "ctrl+shift+z")


def over_the_viewport() -> None:
    part = region("WINDOW")
    pointer("mousemove", part.x + part.width // 3, screen_height() - part.y - 40)


def turn_view() -> Wait:
    """Turn the view with the middle button of the mouse, as one looks around."""
    turned = lambda: tuple(round(x, 3) for x in bpy.context.space_data.region_3d.view_rotation)  # noqa: E731
    before, part = turned(), region("WINDOW")
    x, y = part.x + part.width // 3, screen_height() - part.y - part.height // 2
    # a turn for Blender after each: those that come together are one to it
    for step in (("mousemove", x, y), ("mousedown", 2), *(("mousemove", x + 15 * k, y) for k in range(1, 7))):
        pointer(*step)
        yield 0.3
    pointer("mouseup", 2)
    yield 1.0
    assert turned() != before, "the view could not be turned"


def screen_height() -> int:
    return bpy.context.window.height


def click_on(place: tuple[int, int]) -> Wait:
    click(*place)
    yield 0.3
    over_the_viewport()


def find(command: str, keys: str = "ctrl+c", *, upwards: bool = False, across: float = 0.5) -> Any:
    """Return where the sidebar's button of a command is: move the mouse along and ask at each place.

    `across` says where in the rows, from 0 at their left to 1.
    """
    sidebar = region("UI")
    x = sidebar.x + int((sidebar.width - 24) * across)
    top = screen_height() - (sidebar.y + sidebar.height)
    places = range(top + 30, top + sidebar.height - 5, STEP)
    for y in reversed(places) if upwards else places:
        if (yield from copied((x, y), keys)).startswith(command):
            print(f"[clicks] {command} is at {x}, {y}", flush=True)
            return x, y
    raise AssertionError(f"the sidebar shows nothing of {command}")


def copied(place: tuple[int, int], keys: str = "ctrl+c") -> Any:
    """Return what Blender copies of the button at a place when the mouse is moved there and these keys are pressed.

    Blender has a turn after each move: those that come together are one to it, and it takes one to leave a menu and
    another to come to what is beside it.
    """
    bpy.context.window_manager.clipboard = ""
    for beside in (-2, 0):
        pointer("mousemove", place[0] + beside, place[1])
        yield 0.04
    pointer("key", keys)
    yield 0.1
    return bpy.context.window_manager.clipboard


def choose(role: str, obj: Any) -> Wait:
    """Choose an object in a picker: click on it, type the name, confirm."""
    place = yield from find(f'bpy.data.scenes["Scene"].mobius.{role}', "ctrl+alt+shift+c")
    click(*place)
    yield 0.8
    pointer("type", "--delay", "40", obj.name)
    yield 0.8
    pointer("key", "Return")
    yield 0.8
    over_the_viewport()
