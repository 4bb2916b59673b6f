"""Where scipy cannot be loaded the extension says so in its place in Blender, and registers nothing else."""

import sys
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from test_registration import traces

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

import mobius_extension  # noqa: E402
from mobius_extension.mobius_addon import absent  # noqa: E402


@pytest.fixture
def without_scipy(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The extension, registered anew while a part of scipy cannot be loaded."""
    mobius_extension.unregister()
    monkeypatch.setitem(sys.modules, "scipy.spatial.transform", None)
    mobius_extension.register()
    yield
    mobius_extension.unregister()
    monkeypatch.undo()
    mobius_extension.register()


class Labels:
    """A layout that keeps what a panel writes."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def column(self, **_: Any) -> "Labels":
        return self

    def label(self, text: str, **_: Any) -> None:
        self.lines.append(text)


def test_nothing_is_absent_here() -> None:
    assert absent.reasons() == []


def test_a_panel_says_so_and_nothing_else_is_registered(without_scipy: None) -> None:
    assert traces() == {"MOBIUS_PT_absent"}
    mobius_extension.unregister()
    assert traces() == set()
    mobius_extension.register()
    layout = Labels()
    system = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    context = SimpleNamespace(region=SimpleNamespace(width=240), preferences=system)
    absent.MOBIUS_PT_absent.draw(SimpleNamespace(layout=layout), context)
    assert layout.lines[0] == "Möbius cannot work here"
    assert "'scipy' cannot be loaded" in " ".join(layout.lines)
    assert "install the zip that is made for this system" in " ".join(layout.lines)
    assert max(map(len, layout.lines)) <= 30


def test_another_python_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.linalg", None)
    monkeypatch.setattr(absent, "BROUGHT", ())
    version = ".".join(map(str, sys.version_info[:2]))
    assert absent.reasons()[1].endswith(f"not for {version}")


def test_the_command_says_so(without_scipy: None, capsys: pytest.CaptureFixture[str]) -> None:
    assert absent.refuse(["check", "x.obj"]) == 2
    assert capsys.readouterr().err.startswith("mobius: 'scipy' cannot be loaded: ")
