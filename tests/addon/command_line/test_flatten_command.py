"""`flatten`: the mesh that it writes."""

from pathlib import Path

import numpy as np
import pytest
from commands import run
from scenes import corner_values

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402


def test_flatten_writes_a_mesh_with_the_disc(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, "flatten", scans / "source.blend", "-o", scans / "flat.blend")
    assert (status, err) == (0, "")
    assert "UV map 'Mobius Disc', angles off by" in out
    obj = files.import_mesh(str(scans / "flat.blend")).obj
    radius = np.hypot(*(corner_values(obj, "Mobius Disc") - 0.5).T * 2)
    assert radius.max() == pytest.approx(1, abs=1e-6)
    assert obj.data.uv_layers.keys() == ["UVMap", "Mobius Disc"]


def test_flatten_into_an_obj_writes_the_disc_as_its_uv_map(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "flatten", scans / "target.obj", "-o", scans / "flat.obj")[0] == 0
    files.new_scene()
    (layer,) = files.import_mesh(str(scans / "flat.obj")).obj.data.uv_layers
    uv = np.array([value.vector[:] for value in layer.uv])
    assert np.hypot(*(uv - 0.5).T * 2).max() == pytest.approx(1, abs=1e-5)


def test_flatten_says_what_a_format_cannot_hold(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "flatten", scans / "target.obj", "-o", scans / "flat.stl")
    assert status == 0
    assert err == "mobius: warning: .stl files cannot hold UV maps: write a .blend to keep them\n"
