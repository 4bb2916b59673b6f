"""Transfer against Blender's own Data Transfer, in accuracy and in time.

    uv run --group bench python tests/bench/transfer.py [--picture docs/transfer.png] [--time]

Accuracy: weights of twelve vertex groups and a fine pattern of color go from one face to another of which every vertex
is known: once the same face, decimated, lying in the same place; once with another expression, moved, turned and
scaled. Data Transfer ("Nearest Face Interpolated", its most accurate mapping) is also given what nobody has, the best
similarity fitted to the truth. Time: a million target vertices; beside each layer the time that Blender takes to copy
one like it within one mesh.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "addon")]

import bpy  # noqa: E402
import conftest  # noqa: E402,F401  (loads the extension)
import mobius_extension  # noqa: E402
from mobius_extension.mobius_addon.attributes import (  # noqa: E402
    Carrier,
    TransferSettings,
    VertexGroupAccess,
    read_transfer,
)
from mobius_extension.mobius_addon.attributes.vertex_groups import read_weights  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import foreach, read_surface  # noqa: E402
from mobius_extension.mobius_addon.operators.transfer import read_through  # noqa: E402
from mobius_extension.solver import Correspondence  # noqa: E402
from mobius_extension.solver.flatten.locate import TriangulatedDisc  # noqa: E402

from solver import (  # noqa: E402
    TriangleMesh,
    align,
    correspond,
    topology,
)
from solver.surface.barycentric import interpolated  # noqa: E402
from solver.surface.nearest import SurfacePoints  # noqa: E402
from tests.bench.correspondence.decimation import decimated  # noqa: E402
from tests.bench.paper.data import absent, read  # noqa: E402
from tests.solver.scans import posed  # noqa: E402

GROUPS = 12
KEPT = 0.7
PAINT = "Paint"


def make(name: str, mesh: TriangleMesh) -> Any:
    """An object of a mesh, in the scene."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(mesh.vertices.tolist(), [], mesh.faces.tolist())
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def fields(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """Weights, (n, GROUPS), that sum to 1, around points spread evenly; and a color, (n, 3), of fine stripes."""
    vertices = mesh.vertices / mesh.diagonal
    centres = [int(np.argmax(vertices[:, 1]))]
    distance = np.linalg.norm(vertices - vertices[centres[0]], axis=1)
    while len(centres) < GROUPS:
        centres.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(vertices - vertices[centres[-1]], axis=1))
    square = ((vertices[:, None] - vertices[centres]) ** 2).sum(axis=2)
    weights = np.exp(-square / (2 * 0.06**2))
    weights /= weights.sum(axis=1, keepdims=True)
    return weights, 0.5 + 0.5 * np.sin(2 * np.pi * vertices / 0.12)


def on_surface(mesh: TriangleMesh, values: np.ndarray, where: TriangleMesh) -> np.ndarray:
    """Values at the vertices of a mesh, at the vertices of another that lies on it."""
    points = SurfacePoints(mesh, topology(mesh).boundary_loops, 0.01 * mesh.diagonal)
    face, barycentric = points.nearest_point(where.vertices, where.vertex_normals())
    return interpolated(values, mesh.faces[face], barycentric)


@dataclass(frozen=True)
class Outcome:
    """What a method made of one case: errors per target vertex, of weights and of color."""

    case: str
    method: str
    weights: np.ndarray
    color: np.ndarray


def data_transfer(source: Any, target: Any) -> None:
    """Blender's Data Transfer, as a modifier that is applied."""
    modifier: Any = target.modifiers.new("transfer", "DATA_TRANSFER")
    modifier.object = source
    modifier.use_vert_data, modifier.data_types_verts = True, {"VGROUP_WEIGHTS", "COLOR_VERTEX"}
    modifier.vert_mapping = "POLYINTERP_NEAREST"
    modifier.layers_vgroup_select_src = modifier.layers_vcol_vert_select_src = "ALL"
    bpy.context.view_layer.objects.active = target
    with bpy.context.temp_override(object=target, active_object=target):
        bpy.ops.object.datalayout_transfer(modifier=modifier.name)
        bpy.ops.object.modifier_apply(modifier=modifier.name)


def ours(source: Any, target: Any) -> None:
    """Align and transfer."""
    surfaces = read_surface(source), read_surface(target)
    found = correspond(align(surfaces[0].mesh, surfaces[1].mesh))
    kinds = TransferSettings(kinds=("vertex-groups", "colors"), smallest_weight=0.0)
    read_through(source, target, surfaces, found, kinds).carry().write(target)


def fitted(moving: np.ndarray, still: np.ndarray) -> np.ndarray:
    """Points through the similarity that brings them nearest to others, pair by pair (Umeyama 1991)."""
    a, b = moving - moving.mean(axis=0), still - still.mean(axis=0)
    left, values, right = np.linalg.svd(b.T @ a)
    keep = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    turn = left @ keep @ right
    return (np.trace(np.diag(values) @ keep) / (a**2).sum()) * a @ turn.T + still.mean(axis=0)


def accuracy() -> tuple[list[Outcome], dict[str, TriangleMesh]]:
    """Run every method on every case; return the errors, and each case's target to draw them on."""
    neutral = read("faces_ict/ict_M_neutral.obj")
    smiling = read("faces_ict/ict_M_happy_level4.obj")
    weights, color = fields(neutral)
    outcomes = []
    cases = {
        "overlapping": (neutral, decimated(neutral, KEPT)),
        "moved, scaled, smiling": (smiling, decimated(smiling, KEPT)),
    }
    for case, (whole, target) in cases.items():
        truth = on_surface(whole, np.hstack([weights, color]), target)
        place = on_surface(whole, neutral.vertices, target)
        lying = target if whole is neutral else posed(target, 1)
        methods: dict[str, tuple[Callable[[Any, Any], None], TriangleMesh]] = {"Data Transfer": (data_transfer, lying)}
        if whole is not neutral:
            best = TriangleMesh(fitted(lying.vertices, place), lying.faces)
            methods["Data Transfer, best pose"] = (data_transfer, best)
        methods["Möbius"] = (ours, lying)
        for name, (method, mesh) in methods.items():
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            source, obj = make("Source", neutral), make("Target", mesh)
            for number, column in enumerate(weights.T):
                VertexGroupAccess().write(source, f"G{number}", column, np.ones(len(column), bool))
            layer = source.data.color_attributes.new(PAINT, "FLOAT_COLOR", "POINT")
            layer.data.foreach_set("color", np.hstack([color, np.ones((len(color), 1))]).astype(np.float32).ravel())
            method(source, obj)
            arrived = read_weights(obj, [f"G{number}" for number in range(GROUPS)])
            paint = foreach(obj.data.color_attributes[PAINT].data, "color", 4, np.float32)[:, :3]
            outcomes.append(
                Outcome(
                    case,
                    name,
                    0.5 * np.abs(arrived - truth[:, :GROUPS]).sum(axis=1),
                    np.abs(paint - truth[:, GROUPS:]).mean(axis=1),
                )
            )
    return outcomes, {case: target for case, (_, target) in cases.items()}


def tell(outcomes: list[Outcome]) -> None:
    """Print the table."""
    print("errors in %: of weights, how much of the sum 1 is at the wrong group; of color, mean over the channels")
    print(f"{'case':24} {'method':32} {'weights mean':>12} {'95 %':>7} {'color mean':>11} {'95 %':>7}")
    for x in outcomes:
        figures = [100 * f(e) for e in (x.weights, x.color) for f in (np.mean, lambda e: np.percentile(e, 95))]
        print(f"{x.case:24} {x.method:32} {figures[0]:12.2f} {figures[1]:7.2f} {figures[2]:11.2f} {figures[3]:7.2f}")


def picture(path: Path, outcomes: list[Outcome], targets: dict[str, TriangleMesh]) -> None:
    """Draw the target of each case, coloured by the error of its weights."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.collections import PolyCollection

    worst = 30.0
    figure, axes = plt.subplots(1, len(outcomes), figsize=(2.3 * len(outcomes), 3.5), layout="constrained")
    for ax, outcome in zip(axes, outcomes, strict=True):
        mesh = targets[outcome.case]
        corners = mesh.vertices[mesh.faces]
        normal = mesh.face_vectors / np.maximum(np.linalg.norm(mesh.face_vectors, axis=1, keepdims=True), 1e-30)
        light = 0.35 + 0.65 * np.abs(normal @ [0.3, 0.3, 0.9])
        error = 100 * outcome.weights[mesh.faces].mean(axis=1)
        shade = plt.get_cmap("YlOrRd")(np.clip(error / worst, 0, 1))[:, :3] * light[:, None]
        order = np.argsort(corners[:, :, 2].mean(axis=1))
        faces = PolyCollection(list(corners[order, :, :2]), facecolors=shade[order], linewidths=0, rasterized=True)
        faces.set_antialiased(False)
        ax.add_collection(faces)
        ax.autoscale()
        ax.set_aspect("equal")
        ax.axis("off")
        ax.set_title(f"{outcome.case}\n{outcome.method}\nmean {100 * outcome.weights.mean():.2f} %", fontsize=8)
    scale = mpl.cm.ScalarMappable(mpl.colors.Normalize(0, worst), "YlOrRd")
    figure.colorbar(scale, ax=axes, shrink=0.6, label="weight at the wrong group, %", extend="max")
    figure.savefig(path, dpi=110)


def big_sheet(name: str, n: int) -> Any:
    """A bumpy sheet of n x n vertices in quads."""
    side = np.linspace(-1, 1, n)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    z = 0.3 * np.exp(-8 * ((x - 0.3) ** 2 + (y - 0.2) ** 2))
    at = np.arange(n * n).reshape(n, n)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(n * n)
    mesh.vertices.foreach_set("co", np.stack([x, y, z], axis=1).astype(np.float32).ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.astype(np.int32).ravel())
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", 4 * np.arange(len(quads), dtype=np.int32))
    mesh.update(calc_edges=True)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


@contextmanager
def timed(into: dict[str, float], name: str) -> Iterator[None]:
    """Note how long the body took."""
    start = time.perf_counter()
    yield
    into[name] = time.perf_counter() - start


def times(source_side: int = 300, target_side: int = 1000, groups: int = 20) -> None:
    """Print how long a transfer takes per layer, and a copy of the same layer within one mesh."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    source, target = big_sheet("Source", source_side), big_sheet("Target", target_side)
    surfaces = read_surface(source), read_surface(target)
    plane = [s.mesh.vertices[:, 0] / 2 + 0.5j * s.mesh.vertices[:, 1] for s in surfaces]
    face, barycentric = TriangulatedDisc.of(plane[0], surfaces[0].mesh.faces).locate(plane[1])
    count = len(face)
    every = np.ones(count, bool)
    found = Correspondence(face, barycentric, every, every.astype(float), surfaces[0].mesh.faces, len(plane[0]))
    for number in range(groups):
        weight = np.clip(np.sin(6 * plane[0].real + number) * np.cos(4 * plane[0].imag), 0, 1)
        VertexGroupAccess().write(source, f"G{number}", weight, np.ones(len(weight), bool))
    corner = surfaces[0].mesh.vertices[surfaces[0].corner_vertex, :2]
    chart = np.floor(2 * corner.reshape(-1, 4, 2).mean(axis=1, keepdims=True) + 2).clip(0, 3)
    for number in range(2):  # sixteen islands
        uv = source.data.uv_layers.new(name=f"UV{number}").uv
        uv.foreach_set("vector", (corner.reshape(-1, 4, 2) * 0.9 + chart).astype(np.float32).ravel())
    source.data.color_attributes.new("Color", "FLOAT_COLOR", "POINT")
    source.data.attributes.new("Number", "FLOAT", "POINT").data.foreach_set("value", plane[0].real.astype(np.float32))
    source.shape_key_add(name="Basis")
    source.shape_key_add(name="Key")
    carrier = Carrier(found, *surfaces)
    seconds: dict[str, float] = {}
    layers = {"vertex-groups": groups, "uv": 2, "colors": 1, "attributes": 1, "shape-keys": 1}
    for kind in layers:
        with timed(seconds, kind):
            read_transfer(source, target, carrier, TransferSettings(kinds=(kind,))).carry().write(target)
    copies: dict[str, float] = {}
    mesh = target.data
    bpy.context.view_layer.objects.active = target
    target.select_set(True)
    target.vertex_groups.active_index = 0
    before = len(target.vertex_groups)
    with timed(copies, "vertex-groups"):
        bpy.ops.object.vertex_group_copy()
    assert len(target.vertex_groups) == before + 1
    with timed(copies, "uv"):
        bpy.ops.mesh.uv_texture_add()
    mesh.attributes.active_color = mesh.color_attributes["Color"]
    with timed(copies, "colors"):
        bpy.ops.geometry.color_attribute_duplicate()
    with timed(copies, "attributes"):
        values = foreach(mesh.attributes["Number"].data, "value", 1, np.float32)
        mesh.attributes.new("Copy", "FLOAT", "POINT").data.foreach_set("value", values)
    with timed(copies, "shape-keys"):
        target.shape_key_add(name="Copy", from_mix=True)
    print(f"{count:,} target vertices from {len(plane[0]):,}; seconds per layer, what all layers share included")
    print(f"{'kind':16} {'layers':>6} {'transfer':>9} {'copy':>8} {'ratio':>7}")
    for kind, number in layers.items():
        each = seconds[kind] / number
        print(f"{kind:16} {number:6} {each:9.3f} {copies[kind]:8.3f} {each / copies[kind]:7.1f}")


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, help="where to draw the errors")
    parser.add_argument("--time", action="store_true", help="only measure the time of a million vertices")
    options = parser.parse_args()
    mobius_extension.register()
    try:
        if options.time:
            times()
            return
        if reason := absent("faces_ict/ict_M_neutral.obj"):
            print(reason)
            return
        outcomes, targets = accuracy()
        tell(outcomes)
        if options.picture:
            picture(options.picture, outcomes, targets)
    finally:
        mobius_extension.unregister()


if __name__ == "__main__":
    main()
