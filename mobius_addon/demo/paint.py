"""What the source scan wears: a mandrill's face as a color attribute, weights, a UV map, and a smile as a shape key."""

from __future__ import annotations

import bpy
import numpy as np

from ...solver.surface.mesh import Floats
from ..mesh_data import foreach, read_vertices

FACE_PAINT = "Face paint"
GRID_UV = "Grid"
SMILE = "Smile"

# Linear RGB; each region is painted over the ones before it.
CROWN = (0.030, 0.130, 0.070)
BAND = (0.250, 0.420, 0.110)
FUR = (0.640, 0.400, 0.160)
NAPE = (0.250, 0.090, 0.130)
BEARD = (0.900, 0.450, 0.050)
EAR = (0.800, 0.180, 0.140)
CHEEK = (0.040, 0.190, 0.700)
STRIPE = (0.330, 0.640, 0.960)
NOSE = (0.760, 0.020, 0.030)
EYELID = (0.900, 0.840, 0.680)
IRIS = (0.020, 0.420, 0.330)
PUPIL = (0.006, 0.006, 0.008)
LIPS = (0.380, 0.030, 0.080)


def paint_source(source: bpy.types.Object) -> None:
    """Give the source scan everything that the demo carries over."""
    mesh = source.data
    vertices = read_vertices(mesh)
    colors = mesh.color_attributes.new(FACE_PAINT, "FLOAT_COLOR", "POINT")
    rgba = np.ones((len(vertices), 4), dtype=np.float32)
    rgba[:, :3] = face_paint(vertices)
    colors.data.foreach_set("color", rgba.ravel())
    mesh.color_attributes.active_color_name = FACE_PAINT
    grid = front_view(vertices)[foreach(mesh.loops, "vertex_index", 1, np.int32)]
    mesh.uv_layers.new(name=GRID_UV).uv.foreach_set("vector", grid.astype(np.float32).ravel())
    for name, values in weights(vertices).items():
        group = source.vertex_groups.new(name=name)
        for index in np.flatnonzero(values):
            group.add([int(index)], float(values[index]), "REPLACE")
    source.shape_key_add(name="Basis", from_mix=False)
    smiling = source.shape_key_add(name=SMILE, from_mix=False)
    smiling.value = 0.0  # Blender 5.2 gives new shape keys the value 1
    smiling.points.foreach_set("co", smile(vertices).astype(np.float32).ravel())


def face_paint(vertices: Floats) -> Floats:
    """Return a color per vertex, (n, 3) linear RGB: a function of the place on the head, (n, 3)."""
    x, y, z = vertices.T
    across, front = np.abs(x), -y
    color = np.tile(FUR, (len(vertices), 1))

    def cover(shade: tuple[float, float, float], amount: Floats) -> None:
        color[:] += np.clip(amount, 0, 1)[:, None] * (np.asarray(shade) - color)

    cover(NAPE, step(front, 0.02, -0.10))
    crown = step(z - 0.25 * y, 0.53, 0.65)
    cover(CROWN, crown)
    cover(BAND, crown * step(np.cos(19 * (z - 0.25 * y - 0.55)), 0.6, -0.6))
    cover(BEARD, step(z, -0.36, -0.46) * step(front, -0.1, 0.1))
    cover(EAR, step(across, 0.82, 0.92))
    cover(FUR, step(across, 1.22, 1.27))
    cheek = blob(across, 0.30, 0.26) * blob(z, -0.20, 0.30) * step(front, 0.25, 0.40)
    cover(CHEEK, sharpen(cheek))
    cover(STRIPE, sharpen(cheek) * step(np.cos(22 * (z - 0.7 * across) + 1), 0.15, 0.65))
    ridge = 0.085 + 0.05 * step(z, -0.1, -0.3)
    cover(
        NOSE,
        step(across, ridge + 0.02, ridge - 0.02) * step(z, 0.42, 0.36) * step(z, -0.42, -0.37) * step(front, 0.4, 0.5),
    )
    eye = np.hypot(across - 0.36, z - 0.245)
    facing = step(front, 0.45, 0.55)
    cover(EYELID, facing * step(np.hypot((across - 0.36) / 1.25, z - 0.245), 0.235, 0.205))
    cover(IRIS, facing * step(eye, 0.145, 0.12))
    cover(PUPIL, facing * step(eye, 0.075, 0.05))
    cover(LIPS, facing * step(np.hypot(x / 1.7, z + 0.80), 0.125, 0.095))
    return color


def front_view(vertices: Floats) -> Floats:
    """Return UV coordinates, (n, 2) in [0, 1]: the head seen from the front, so that squares stay squares there."""
    return vertices[:, [0, 2]] / 3 + 0.5


def weights(vertices: Floats) -> dict[str, Floats]:
    """Return smooth weights of parts that a rig would move, name to (n,) in [0, 1]."""
    x, y, z = vertices.T
    brow = blob(z, 0.45, 0.18) * step(-y, 0.3, 0.6)
    return {
        "Jaw": step(z, -0.3, -0.6),
        "Brow.L": brow * step(x, 0.05, 0.3),
        "Brow.R": brow * step(x, -0.05, -0.3),
        "Ear.L": step(x, 0.7, 1.0),
        "Ear.R": step(x, -0.7, -1.0),
    }


def smile(vertices: Floats) -> Floats:
    """Return the vertices of a smiling head, (n, 3): broad cheeks, raised brows, pricked ears."""
    x, _, z = vertices.T
    part = weights(vertices)
    moved = vertices.copy()
    moved[:, 0] += 0.25 * x * blob(z, -0.55, 0.25) * blob(x, 0.0, 0.6)
    moved[:, 2] += 0.12 * (part["Brow.L"] + part["Brow.R"]) + 0.10 * (part["Ear.L"] + part["Ear.R"])
    return moved


def step(values: Floats, start: Floats | float, end: Floats | float) -> Floats:
    """Rise smoothly from 0 at `start` to 1 at `end`, whichever is larger."""
    t = np.clip((values - start) / (np.asarray(end) - start), 0, 1)
    return t * t * (3 - 2 * t)


def blob(values: Floats, centre: float, width: float) -> Floats:
    """Return 1 at `centre`, falling smoothly to 0 at a distance of `width`."""
    return step(np.abs(values - centre), width, 0.0)


def sharpen(amount: Floats) -> Floats:
    """Turn a soft mask into one with a crisp rim."""
    return step(amount, 0.08, 0.22)
