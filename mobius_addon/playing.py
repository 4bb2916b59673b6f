"""Shape keys shown one after the other, from 0 to full strength and back, and then as they were."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import bpy

from .handlers import unwatch, watch
from .usable import by_uid

SECONDS = 0.9
"""For each expression: long enough to see it come, stay and go."""

RISE = 0.35
"""Share of this in which it comes, and as much in which it goes."""

LONGEST = 0.25
"""Share of its time from one picture to the next at most: less than it stays at full strength, for slow windows."""


@dataclass(frozen=True)
class _Before:
    """Keys of a mesh as they were: their values, and which of the drivers that move them were at work."""

    values: dict[str, float]
    driven: tuple[str, ...]


class Play:
    """Expressions of a target, with those of the source that they come from, played by nothing but their sliders.

    Parameters
    ----------
    names : sequence of (str, str or None)
        The keys of the target and those of the source that are shown at the same time.
    target, source : bpy.types.Object
        Told by their numbers of the session from then on; the source may be None.

    Notes
    -----
    Values are set while it plays, and drivers of values muted; no undo step is made. `end` puts all of it back, and is
    called before anything else may happen to the file: it is saved, undone, or another one is loaded.
    """

    current: ClassVar[Play | None] = None
    """The one that is on."""

    def __init__(
        self,
        names: Sequence[tuple[str, str | None]],
        target: bpy.types.Object,
        source: bpy.types.Object | None,
        free: Callable[[], None],
    ) -> None:
        self.names = tuple(names)
        self.place = 0.0
        self._free = free
        self._meshes = tuple(None if obj is None else obj.data.session_uid for obj in (target, source))
        self._before = [_taken(self._keys(row), self._of(row)) for row in (0, 1)]
        Play.current = self

    @property
    def number(self) -> int:
        """Which of the names is shown; as many as there are once all were."""
        return int(self.place)

    def go_on(self, seconds: float) -> bool:
        """Show what is to be seen some seconds later; return whether there is anything to come."""
        self.place += min(seconds / SECONDS, LONGEST)
        return self._show()

    def step(self, by: int) -> bool:
        """Go to the beginning of another one; return whether there is one."""
        self.place = float(max(self.number + by, 0))
        return self._show()

    def end(self) -> None:
        """Put all back as it was."""
        if Play.current is self:
            Play.current = None
        for row in (0, 1):
            keys, before = self._keys(row), self._before[row]
            if keys is None:
                continue
            for name, value in before.values.items():
                if name in keys.key_blocks:
                    keys.key_blocks[name].value = value
            for driver in _drivers(keys, before.driven):
                driver.mute = False
        self._free()

    def _show(self) -> bool:
        if self.number >= len(self.names) or self._keys(0) is None:
            return False
        strength = strength_at(self.place - self.number)
        for row in (0, 1):
            blocks = {} if (keys := self._keys(row)) is None else keys.key_blocks
            for name in self._of(row):
                if (key := blocks.get(name)) is not None:
                    shown = strength if name == self.names[self.number][row] else 0.0
                    key.value = min(max(shown, key.slider_min), key.slider_max)
        return True

    def _of(self, row: int) -> list[str]:
        """Return the names of one of the two that are there."""
        return [name for names in self.names if (name := names[row]) is not None]

    def _keys(self, row: int) -> Any:
        mesh = by_uid(bpy.data.meshes, self._meshes[row]) if self._meshes[row] is not None else None
        return None if mesh is None else mesh.shape_keys


def strength_at(share: float) -> float:
    """Return how strong an expression is shown at a share, in [0, 1], of its time: it comes, stays and goes.

    >>> [strength_at(share) for share in (0.0, 0.175, 0.5, 1.0)]
    [0.0, 0.5, 1.0, 0.0]
    """
    way = min(max(min(share, 1 - share) / RISE, 0.0), 1.0)
    return way * way * (3 - 2 * way)


def stop(*_: object) -> None:
    """End what is playing, if anything is; as a handler of Blender's, too."""
    if Play.current is not None:
        Play.current.end()


def _taken(keys: Any, names: list[str]) -> _Before:
    """Return the keys' values, and the drivers that move them, which are muted from then on."""
    if keys is None:
        return _Before({}, ())
    values = {name: keys.key_blocks[name].value for name in names if name in keys.key_blocks}
    paths = {f'key_blocks["{bpy.utils.escape_identifier(name)}"].value' for name in values}
    driven = tuple(path for path in paths if any(not driver.mute for driver in _drivers(keys, (path,))))
    for driver in _drivers(keys, driven):
        driver.mute = True
    return _Before(values, driven)


def _drivers(keys: Any, paths: Sequence[str]) -> list[Any]:
    """Return the drivers of some properties of a set of keys."""
    found = keys.animation_data.drivers if keys.animation_data else ()
    return [driver for driver in found if driver.data_path in paths]


_HANDLERS = tuple((name, stop) for name in ("save_pre", "undo_pre", "redo_pre", "load_pre"))


def register() -> None:
    """Have what plays end before the file is saved, undone, redone or left."""
    watch(*_HANDLERS)


def unregister() -> None:
    """Undo `register`, and end what plays."""
    stop()
    unwatch(*_HANDLERS)
