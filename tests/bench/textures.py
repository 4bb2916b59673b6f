"""Textures against Cycles' bake (Selected to Active), in accuracy and in time.

    uv run --group bench python tests/bench/textures.py [--picture docs/textures.png] [--time]

A face wears a picture of soft stripes in space, so that the color of every point is known, in a layout of many islands
that Blender makes. It goes to a decimated copy with another layout: of three faces in the same place; of one with
another expression, moved, turned and scaled, where the bake is also given what nobody has, the best similarity fitted
to the truth. PSNR in dB at texels whose place on the source is known. There and back is through one map and its
inverse.
"""

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "addon"), str(ROOT / "tests" / "bench")]

import transfer as scene  # noqa: E402  (loads the extension)

import bpy  # noqa: E402  # isort: skip
import mobius_extension  # noqa: E402
from mobius_extension.mobius_addon.attributes import Carrier, TransferSettings, read_transfer  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.mobius_addon.textures.images import new_image, read_tiles  # noqa: E402
from mobius_extension.mobius_addon.textures.layouts import corner_uv  # noqa: E402
from mobius_extension.mobius_addon.textures.settings import TextureSettings  # noqa: E402
from mobius_extension.solver import Correspondence as AddonCorrespondence  # noqa: E402

from solver import Correspondence, TriangleMesh, align, correspond, topology  # noqa: E402
from solver.carry.interpolate import places  # noqa: E402
from solver.carry.textures import Carrying, FromCorners, InLayout, Wanted, encoded, resample  # noqa: E402
from solver.surface.barycentric import interpolated, weighted  # noqa: E402
from solver.surface.nearest import SurfacePoints  # noqa: E402
from tests.bench.correspondence.decimation import decimated  # noqa: E402
from tests.bench.paper.data import absent, read  # noqa: E402
from tests.solver.scans import posed  # noqa: E402

SIZE, FINE = 1024, 4096
TEXELS = 400_000
REACHES = (0.001, 0.003, 0.01, 0.03)
"""Cage extrusions, as shares of the diagonal: the bake is given the best of them."""

WAVE = 0.06
"""Of the stripes, as a share of the diagonal: some 30 texels of the picture of 1024."""


FACE, OTHERS = "faces_ict/ict_M_neutral.obj", ("faces_ict/ict_F_neutral.obj", "faces_simpop/SIMPOP_01.obj")

CASES = (
    ("in place", FACE, FACE),
    *((f"in place, {Path(name).stem}", name, name) for name in OTHERS),
    ("moved, scaled, smiling", FACE, "faces_ict/ict_M_happy_level4.obj"),
)
"""What it is called, who wears the picture, and of whom the target is a decimated copy."""


def field(points: np.ndarray, diagonal: float) -> np.ndarray:
    """Linear color, (n, 3), of points of the source; nowhere so dark that its sRGB has an edge."""
    x = points / (WAVE * diagonal)
    waves = np.sin(2 * np.pi * x) * np.cos(np.pi * np.roll(x, 1, axis=1))
    return 0.4 + 0.25 * waves + 0.1 * np.sign(waves) * waves**2


def on_itself(mesh: TriangleMesh) -> Correspondence:
    """Each vertex at itself."""
    face = np.empty(len(mesh.vertices), int)
    face[mesh.faces.ravel()] = np.arange(mesh.faces.size) // 3
    place = (mesh.faces[face] == np.arange(len(mesh.vertices))[:, None]).astype(float)
    every = np.ones(len(face), bool)
    return Correspondence(face, place, every, every.astype(float), mesh.faces, len(mesh.vertices))


def inverse(found: Correspondence, source: TriangleMesh, target: TriangleMesh) -> Correspondence:
    """Where the source's vertices are on the target: on its triangles where these are on the source."""
    there = TriangleMesh(places(found, source.vertices)[1], target.faces)
    points = SurfacePoints(there, topology(there).boundary_loops, 0.01 * there.diagonal)
    face, place = points.nearest_point(source.vertices, source.vertex_normals())
    every = np.ones(len(face), bool)
    return Correspondence(face, place, every, every.astype(float), target.faces, len(target.vertices))


def unwrapped(obj: Any, angle: float) -> np.ndarray:
    """Unwrap an object into islands that bend by less than an angle, and return its layout, (m, 3, 2)."""
    for other in bpy.context.scene.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(angle_limit=np.radians(angle), island_margin=0.005)
    bpy.ops.object.mode_set(mode="OBJECT")
    return corner_uv(obj.data, obj.data.uv_layers[0].name)[read_surface(obj).triangle_corners]


def painted(mesh: TriangleMesh, uv: np.ndarray, size: int) -> np.ndarray:
    """The picture of the field in a layout, (size, size, 3) bytes."""
    finder = InLayout.of(Carrying(on_itself(mesh), mesh, mesh), uv, (size, size))
    values = resample(finder, (size, size), [Wanted(FromCorners(mesh.vertices[mesh.faces]), np.asarray)], margin=8)
    color = field(values.pixels[0].reshape(-1, 3).astype(float), mesh.diagonal)
    return encoded(color.astype(np.float32), srgb=True).reshape(size, size, 3)


def wear(obj: Any, pixels: np.ndarray) -> None:
    """Show a picture by a material that gives its light, for both ways."""
    made: Any = bpy.data.materials.new("Skin")
    if made.node_tree is None:
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output, light, node = (tree.nodes.new(f"ShaderNode{x}") for x in ("OutputMaterial", "Emission", "TexImage"))
    node.image = new_image("Skin", {1001: pixels}, "sRGB")
    tree.links.new(node.outputs["Color"], light.inputs["Color"])
    tree.links.new(light.outputs["Emission"], output.inputs["Surface"])
    obj.data.materials.append(made)


def bake(source: Any, target: Any, size: int, reach: float) -> np.ndarray:
    """Cycles' bake from selected to active, (size, size, 3) bytes."""
    render = bpy.context.scene
    render.render.engine = "CYCLES"
    render.cycles.samples = 1
    made: Any = bpy.data.materials.new("Bake")
    if made.node_tree is None:
        made.use_nodes = True
    node = made.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Bake", size, size)
    made.node_tree.nodes.active = node
    target.data.materials.clear()
    target.data.materials.append(made)
    for obj in render.objects:
        obj.select_set(obj in (source, target))
    bpy.context.view_layer.objects.active = target
    bpy.ops.object.bake(
        type="EMIT", use_selected_to_active=True, cage_extrusion=reach, max_ray_distance=2 * reach, margin=size // 256
    )
    return read_tiles(node.image)[1001][:, :, :3]


def ours(source: Any, target: Any, found: Correspondence, size: int, seconds: dict[str, float]) -> np.ndarray:
    """The pictures of the source, carried, (size, size, 3) bytes."""
    alike = AddonCorrespondence(*(getattr(found, name) for name in AddonCorrespondence.__dataclass_fields__))
    carrier = Carrier(alike, read_surface(source), read_surface(target))
    settings = TransferSettings(kinds=("textures",), textures=TextureSettings(size=size))
    stages = {}
    begun = time.perf_counter()
    reading = read_transfer(source, target, carrier, settings)
    stages["read"] = time.perf_counter()
    plan = reading.carry()
    stages["carry"] = time.perf_counter()
    plan.write(target)
    stages["write"] = time.perf_counter()
    for name, ended in stages.items():
        seconds[name], begun = ended - begun, ended
    return plan.textures.made[0].tiles[1001]


@dataclass(frozen=True)
class Outcome:
    """What a method made of one case."""

    case: str
    method: str
    psnr: float
    wrong: float
    seconds: float
    picture: np.ndarray


def seen(pixels: np.ndarray, uv: np.ndarray, mesh: TriangleMesh, side: int = 360) -> np.ndarray:
    """A surface that wears a picture, from the front, (side, side, 3) bytes: its texels, the nearest on top."""
    size = len(pixels)
    finder = InLayout.of(Carrying(on_itself(mesh), mesh, mesh), uv, (size, size))
    found = resample(finder, (size, size), [Wanted(FromCorners(mesh.vertices[mesh.faces]), np.asarray)])
    place = found.pixels[0][found.known]
    order = np.argsort(place[:, 2])
    low, extent = mesh.vertices.min(axis=0), np.ptp(mesh.vertices[:, :2], axis=0).max()
    column, row = ((place[order, :2] - low[:2]) / extent * (side - 1)).astype(int).T
    result = np.full((side, side, 3), 255, np.uint8)
    result[row, column] = pixels[found.known][order][:, :3]
    return result


def judged(pixels: np.ndarray, uv: np.ndarray, target: TriangleMesh, whole: TriangleMesh, neutral: TriangleMesh) -> Any:
    """PSNR in dB, and how many of the texels are off by more than a quarter of the range, in %."""
    rng = np.random.default_rng(0)
    face = rng.choice(len(uv), TEXELS, p=target.face_areas / target.area)
    weights = rng.dirichlet((1, 1, 1), TEXELS)
    # at the middle of the texel that the point lies in, if that is in the triangle too
    size = len(pixels)
    at = (np.floor(weighted(uv[face], weights) * size) + 0.5) / size
    a, b = (uv[face, k] - uv[face, 0] for k in (1, 2))
    square = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    p = at - uv[face, 0]
    v, w = (p[:, 0] * b[:, 1] - p[:, 1] * b[:, 0]) / square, (a[:, 0] * p[:, 1] - a[:, 1] * p[:, 0]) / square
    inside = (v > 0) & (w > 0) & (v + w < 1)
    weights, face, at = np.stack([1 - v - w, v, w], axis=1)[inside], face[inside], at[inside]
    place = interpolated(target.vertices, target.faces[face], weights)
    points = SurfacePoints(whole, topology(whole).boundary_loops, 0.01 * whole.diagonal)
    normal = target.face_vectors[face] / np.linalg.norm(target.face_vectors[face], axis=1, keepdims=True)
    there, share = points.nearest_point(place, normal)
    truth = field(interpolated(neutral.vertices, neutral.faces[there], share), neutral.diagonal)
    truth = encoded(truth.astype(np.float32), srgb=True) / 255
    column, row = (at * size).astype(int).T
    error = np.abs(pixels[row, column, :3] / 255 - truth)
    return -10 * np.log10((error**2).mean()), 100 * (error.max(axis=1) > 0.25).mean()


def accuracy() -> list[Outcome]:
    """Run both on every case."""
    outcomes = []
    for case, worn, wanted in CASES:
        neutral = read(worn)
        whole = neutral if wanted == worn else read(wanted)
        target = decimated(whole, scene.KEPT)
        lying = target if whole is neutral else posed(target, 1)
        ways = {"Möbius": lying, "Cycles' bake": lying}
        if whole is not neutral:
            truth = scene.on_surface(whole, neutral.vertices, target)
            ways["Cycles' bake, best pose"] = TriangleMesh(scene.fitted(lying.vertices, truth), lying.faces)
        for method, mesh in ways.items():
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            source, obj = scene.make("Source", neutral), scene.make("Target", mesh)
            source_uv, uv = unwrapped(source, 66), unwrapped(obj, 50)
            wear(source, painted(neutral, source_uv, SIZE))
            if method == "Möbius":
                found = correspond(align(read_surface(source).mesh, read_surface(obj).mesh))
                begun = time.perf_counter()
                pixels = ours(source, obj, found, SIZE, {})
                spent = time.perf_counter() - begun
            else:
                tries = []
                for reach in REACHES:
                    begun = time.perf_counter()
                    pixels = bake(source, obj, SIZE, reach * neutral.diagonal)
                    spent = time.perf_counter() - begun
                    tries.append((judged(pixels, uv, target, whole, neutral)[0], spent, pixels))
                _, spent, pixels = max(tries, key=lambda x: x[0])
            drawn = seen(pixels, uv, target)
            outcomes.append(Outcome(case, method, *judged(pixels, uv, target, whole, neutral), spent, drawn))
            x = outcomes[-1]
            print(f"{x.case:24} {x.method:26} {x.psnr:7.1f} dB {x.wrong:7.2f} % wrong {x.seconds:7.2f} s", flush=True)
            if method == "Möbius":
                there_and_back(found, source, obj, pixels, source_uv)
    return outcomes


def there_and_back(found: Correspondence, source: Any, target: Any, pixels: np.ndarray, source_uv: np.ndarray) -> None:
    """Print how the picture comes back through the inverse of a map."""
    first = painted(read_surface(source).mesh, source_uv, SIZE)
    meshes = read_surface(source).mesh, read_surface(target).mesh
    back = inverse(found, *meshes)
    again = ours(target, source, back, SIZE, {})
    size = (SIZE, SIZE)
    known = resample(InLayout.of(Carrying(back, meshes[1], meshes[0]), source_uv, size), size, []).known
    error = (again[:, :, :3].astype(float) - first)[known] / 255
    print(f"{'':24} {'there and back':26} {-10 * np.log10((error**2).mean()):7.1f} dB")


def times() -> None:
    """Print the time of a fine picture, stage by stage, beside the bake's."""
    neutral, smiling = read(FACE), read("faces_ict/ict_M_happy_level4.obj")
    source, obj = scene.make("Source", neutral), scene.make("Target", smiling)
    uv = unwrapped(source, 66)
    unwrapped(obj, 50)
    wear(source, painted(neutral, uv, FINE))
    every = on_itself(neutral)
    seconds: dict[str, float] = {}
    processor = time.process_time()
    ours(source, obj, every, FINE, seconds)
    processor = time.process_time() - processor
    stages = ", ".join(f"{name} {spent:.2f} s" for name, spent in seconds.items())
    print(f"{FINE} x {FINE}, {len(neutral.faces):,} to {len(smiling.faces):,} faces: {stages}, "
          f"together {sum(seconds.values()):.2f} s ({processor:.2f} s of processors)")  # fmt: skip
    begun, processor = time.perf_counter(), time.process_time()
    bake(source, obj, FINE, 0.03 * neutral.diagonal)
    spent, processor = time.perf_counter() - begun, time.process_time() - processor
    print(f"Cycles' bake {spent:.2f} s ({processor:.2f} s of processors)")


def picture(path: Path, outcomes: list[Outcome]) -> None:
    """Draw the target with the picture that each method made."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, len(outcomes), figsize=(2.2 * len(outcomes), 3.1), layout="constrained")
    for ax, x in zip(axes, outcomes, strict=True):
        ax.imshow(x.picture, origin="lower", interpolation="nearest")
        ax.axis("off")
        ax.set_title(f"{x.case}\n{x.method}\n{x.psnr:.1f} dB", fontsize=8)
    figure.savefig(path, dpi=90)


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, help="where to draw the faces")
    parser.add_argument("--time", action="store_true", help="only measure the time of a fine picture")
    options = parser.parse_args()
    if reason := absent(FACE):
        print(reason)
        return
    mobius_extension.register()
    try:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        if options.time:
            times()
            return
        outcomes = accuracy()
        if options.picture:
            picture(options.picture, [x for x in outcomes if not x.case.startswith("in place,")])
    finally:
        mobius_extension.unregister()


if __name__ == "__main__":
    main()
