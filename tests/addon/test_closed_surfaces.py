"""Two closed surfaces in Blender: aligned on the sphere, colored, carried; nothing is written that needs a disc."""

from typing import Any

import numpy as np
import pytest
from scenes import make_object, positions, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import proof, stored_alignment  # noqa: E402
from mobius_extension.mobius_addon.attributes import SHARED_COLOR, SHARED_LAYOUT  # noqa: E402
from mobius_extension.mobius_addon.computation import Repair  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.mobius_addon.topology_cache import line_of  # noqa: E402

FEW = {"samples": 40, "targets": 200, "reflect": "never"}


def make_ball(name: str, rings: int, around: int, turn: float = 0.0) -> Any:
    """A sphere with hills and no symmetry, its vertices on rings about z and two poles."""
    latitude = np.pi * np.arange(1, rings) / rings
    longitude = 2 * np.pi * np.arange(around) / around + turn
    up, east = (each.ravel() for each in np.meshgrid(latitude, longitude, indexing="ij"))
    points = np.stack([np.sin(up) * np.cos(east), np.sin(up) * np.sin(east), np.cos(up)], axis=1)
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]])
    hills = np.array([[0.8, 0.6, 0.0], [-0.6, 0.0, 0.8], [0.0, -0.96, 0.28], [0.1, 0.3, -0.95]])
    height = np.exp((points @ hills.T - 1) / 0.15) @ [0.5, -0.3, 0.4, 0.3]
    last = (rings - 1) * around
    faces = [
        (ring + k, ring + around + k, ring + around + (k + 1) % around, ring + (k + 1) % around)
        for ring in range(0, last - around, around)
        for k in range(around)
    ]
    faces += [(last, k, (k + 1) % around) for k in range(around)]
    faces += [(last + 1, last - around + (k + 1) % around, last - around + k) for k in range(around)]
    return make_object(name, points * (1 + height)[:, None], faces)


def test_closed_surfaces_are_aligned_and_shown() -> None:
    source, target = make_ball("Ball", 20, 32), make_ball("Other", 18, 28, turn=0.07)
    assert line_of(source, Repair()).rows == ("closed, 610 vertices",)
    settings = bpy.context.scene.mobius
    settings.source, settings.target = source, target
    assert bpy.ops.mobius.align(**FEW) == {"FINISHED"}
    figures = stored_alignment.figures(target)
    assert figures["certified_for"].startswith("|h| <= 0.2")
    assert figures["rotation"]["upper_bound"] == figures["rotation"]["value"]
    surfaces = read_surface(source), read_surface(target)
    found = stored_alignment.load(target, source, surfaces)
    apart = np.linalg.norm(found.matrix() @ surfaces[0].mesh.vertices - surfaces[1].mesh.vertices, axis=1)
    assert apart.mean() < 0.01 * surfaces[0].mesh.diagonal
    for obj in (source, target):
        assert SHARED_COLOR in obj.data.attributes
        assert SHARED_LAYOUT not in obj.data.uv_layers
    assert figures["rotation"]["certified"]
    assert proof.shown(target, "certificate").startswith("no rotation matches more, no map with |h| <= 0.2")
    assert bpy.ops.mobius.side_by_side() == {"FINISHED"}
    assert bpy.ops.mobius.end_side_by_side() == {"FINISHED"}
    north = source.vertex_groups.new(name="North")
    height = positions(source)[:, 2]
    for index, share in enumerate((height - height.min()) / np.ptp(height)):
        north.add([index], float(share), "REPLACE")
    assert bpy.ops.mobius.transfer() == {"FINISHED"}
    expected = (positions(target)[:, 2] - height.min()) / np.ptp(height)
    assert np.abs(weights(target, "North") - expected).mean() < 0.01
