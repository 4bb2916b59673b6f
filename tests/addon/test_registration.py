"""Registering and unregistering: everything is there, and nothing stays behind."""

import importlib
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

import mobius_extension  # noqa: E402


def traces() -> set[str]:
    """Everything in Blender that bears our name."""
    found = {name for name in dir(bpy.types) if "MOBIUS" in name or name.startswith("Mobius")}
    found |= {f"ops.{name}" for name in dir(bpy.ops.mobius)}
    for owner in (bpy.types.Scene, bpy.types.Mesh, bpy.types.WindowManager, bpy.types.Object):
        found |= {f"{owner.__name__}.{name}" for name in dir(owner) if name.startswith("mobius")}
    for name in dir(bpy.app.handlers):
        handlers = getattr(bpy.app.handlers, name)
        if isinstance(handlers, list):
            found |= {f"{name}: {handler.__module__}" for handler in handlers if "mobius" in handler.__module__}
    return found


def test_nothing_stays_behind_and_all_of_it_comes_back() -> None:
    before = traces()
    assert {"ops.check", "ops.flatten", "ops.align", "ops.transfer"} <= before
    assert {"Scene.mobius", "Mesh.mobius_alignment", "MOBIUS_PT_main"} <= before
    mobius_extension.unregister()
    try:
        assert traces() == set()
    finally:
        mobius_extension.register()
    assert traces() == before


def test_a_failing_registration_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    before = traces()
    mobius_extension.unregister()
    panel = importlib.import_module("mobius_extension.mobius_addon.panel")

    def fail() -> None:
        raise RuntimeError("on purpose")

    try:
        with monkeypatch.context() as patched:
            patched.setattr(panel, "register", fail)
            with pytest.raises(RuntimeError, match="on purpose"):
                mobius_extension.register()
        assert traces() == set()
    finally:
        mobius_extension.register()
    assert traces() == before


def test_everything_that_can_be_set_or_pressed_has_a_tooltip() -> None:
    names = [name for name in dir(bpy.ops.mobius) if not name.endswith("preset_add")]
    assert {"swap", "heat_map", "side_by_side", "conformal_transfer", "stop"} <= set(names)
    owners = [getattr(bpy.ops.mobius, name).get_rna_type() for name in names]
    for rna in owners:
        assert rna.description, rna.identifier
        assert not rna.description.endswith("."), rna.identifier  # Blender sets a full stop itself
    owners += [x.bl_rna for x in (type(bpy.context.scene.mobius), type(bpy.context.window_manager.mobius_view))]
    silent = [
        f"{rna.identifier}.{p.identifier}"
        for rna in owners
        for p in rna.properties
        if p.identifier not in ("rna_type", "name") and not p.description
    ]
    assert silent == []


def test_operator_options_are_the_solvers_settings() -> None:
    from mobius_extension.mobius_addon.options import align_settings
    from mobius_extension.solver import AlignSettings

    settings: Any = bpy.context.scene.mobius
    expected = AlignSettings(fill_holes=True)  # the panel says what will be filled before anything is
    for name, value in vars(align_settings(settings, expected.time_limit or 0)).items():
        wanted = getattr(expected, name)
        assert value == (pytest.approx(wanted) if isinstance(wanted, float) else wanted)  # Blender's floats are short
