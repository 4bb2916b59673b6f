"""The extension on Blender's Python module: registered once for all tests, and unregistered at their end."""

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import make_sheet

ROOT = Path(__file__).resolve().parents[2]

# loads the extension as `python .` does, under the name mobius_extension
_spec = importlib.util.spec_from_file_location("mobius_command", ROOT / "__main__.py")
assert _spec is not None
assert _spec.loader is not None
command = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(command)
command.load_extension()


@pytest.fixture(scope="session", autouse=True)
def registered() -> Iterator[None]:
    """Blender 4.2 and 4.5 do not survive their exit with a class still registered: unregister in any case."""
    pytest.importorskip("bpy", reason="Blender's module bpy is not installed")
    import mobius_extension

    mobius_extension.register()
    yield
    mobius_extension.unregister()


@pytest.fixture(autouse=True)
def empty_scene(registered: None) -> Any:
    """An empty scene for each test."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    # the first push of undo is what later steps go back to
    bpy.ops.ed.undo_push(message="empty")
    return bpy.context.scene


@pytest.fixture
def pair(empty_scene: Any) -> tuple[Any, Any]:
    """Two sheets of one surface in different resolutions, chosen as source and target; the source carries data."""
    import bpy

    source, target = make_sheet("Source", 21), make_sheet("Target", 16)
    group = source.vertex_groups.new(name="Right")
    for vertex in source.data.vertices:
        group.add((vertex.index,), (vertex.co.x + 1) / 2, "REPLACE")
    source.data.uv_layers.new(name="UVMap")
    flat = np.array([source.data.vertices[loop.vertex_index].co[:2] for loop in source.data.loops])
    source.data.uv_layers["UVMap"].uv.foreach_set("vector", (flat / 2 + 0.5).ravel())
    bpy.context.scene.mobius.source = source
    bpy.context.scene.mobius.target = target
    return source, target
