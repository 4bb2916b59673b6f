"""The demo: two scans of Blender's monkey, painted, aligned and transferred, with the truth known at every vertex."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler
from scipy.spatial.transform import Rotation

from ... import solver
from .. import stored_alignment
from ..attributes import Carrier, plan_transfer
from ..files import Unreadable, new_scene, outputs, require_folder, require_place
from ..last_transfer import describe_counts
from ..mesh_data import Refusal, Surface, read_surface
from ..operators.align import summary, write_alignment
from ..streams import DONE, quiet, say, say_error
from ..studio.scene import require_cycles
from ..studio.shapes import hues
from .accuracy import best_rigid_error, transfer_error
from .paint import FACE_PAINT, GRID_UV, paint_source
from .pictures import Disc, Sitter, clay_material, paint_material, render_discs, render_heads
from .scans import POSE, GroundTruth, build_scans

FILES = ("correspondence.png", "discs.png", "demo.blend", "REPORT.json")

# The second scan is known not to be mirrored, and a face is too nearly its own mirror image to ask.
SETTINGS = replace(solver.AlignSettings(), reflect="never")


def run(output_dir: Path) -> int:
    """Build, paint, align and transfer; leave a .blend, a report and two pictures.

    Parameters
    ----------
    output_dir : Path
        Folder for the files; made if it is not there. Files of the same names are replaced, all of them at the end.

    Returns
    -------
    int
        Exit status 0.

    Raises
    ------
    Unreadable
        The folder cannot be made or written to.
    Refusal, MeshError
        Something failed on the way, or a person is at work in this Blender; nothing is left behind.
    """
    if not bpy.app.background:
        raise Refusal("the demo begins with an empty file, which would close yours: run it from the command line")
    seconds: dict[str, float] = {}
    with writable_folder(output_dir), outputs() as written:
        require_cycles()
        new_scene()
        with timed(seconds, "build the scans"):
            source, target, truth = build_objects(bpy.context.scene)
            surfaces = read_surface(source), read_surface(target)
        for surface in surfaces:
            say(f"'{surface.mesh.name}': {solver.topology(surface.mesh).describe()}")

        with timed(seconds, "align"):
            alignment = solver.align(surfaces[0].mesh, surfaces[1].mesh, SETTINGS)
        with timed(seconds, "correspond"):
            correspondence = solver.correspond(alignment)
        with timed(seconds, "transfer"):
            plan = plan_transfer(source, target, Carrier(correspondence, *surfaces))
            plan.write(target)
            write_alignment(source, target, alignment, correspondence, surfaces)
        for warning in (*alignment.warnings, *plan.warnings):
            say_error(f"mobius: warning: {warning}")
        say(summary(source.name, target.name, alignment, correspondence))
        say(f"'{target.name}' has {describe_counts(plan.counts())} from '{source.name}'")

        error = transfer_error(correspondence, *surfaces)
        rigid = best_rigid_error(truth, *surfaces)
        say(f"error: {error.describe()} of the target's bounding box diagonal")
        say(f"the best rigid pose and scale, found from the truth itself: {rigid.describe()}")

        with timed(seconds, "pictures"):
            worn = paint_material(FACE_PAINT, GRID_UV)
            render_heads(heads(source, target, worn), written.path(output_dir / "correspondence.png"))
            render_discs(discs(alignment, source, target), written.path(output_dir / "discs.png"))
        dress(source, target, worn)
        keep_for_the_panel(source, target, alignment, correspondence, surfaces)
        figures = solver.report(alignment, correspondence) | {
            "ground_truth": {"error_percent": error.figures(), "best_rigid_error_percent": rigid.figures()},
            "transferred": plan.counts(),
            "demo_seconds": seconds,
            "blender": bpy.app.version_string,
        }
        save_blend(written.path(output_dir / "demo.blend"))
        written.path(output_dir / "REPORT.json").write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    say("seconds: " + ", ".join(f"{stage} {spent:.1f}" for stage, spent in seconds.items()))
    for name in FILES:
        say(str(output_dir / name))
    return DONE


@contextmanager
def writable_folder(path: Path) -> Iterator[None]:
    """Make sure that `path` is a folder to write in; one that was made here goes again if the work inside fails.

    Raises
    ------
    Unreadable
        It cannot be made, or nothing can be written there.
    """
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise Unreadable(f"nothing can be written in the folder '{path}' ({error.strerror})") from error
        require_folder(path)
        for name in FILES:
            require_place(path / name)
        yield
    except BaseException:
        for folder in missing:
            with suppress(OSError):
                folder.rmdir()
        raise


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Note the wall-clock time of the work inside."""
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start


def build_objects(scene: bpy.types.Scene) -> tuple[bpy.types.Object, bpy.types.Object, GroundTruth]:
    """Put the painted source and the bare target into the scene."""
    scans = build_scans()
    source = bpy.data.objects.new(scans.source.name, scans.source)
    target = bpy.data.objects.new(scans.target.name, scans.target)
    for obj in (source, target):
        scene.collection.objects.link(obj)
    paint_source(source)
    return source, target, scans.truth


def heads(source: bpy.types.Object, target: bpy.types.Object, worn: bpy.types.Material) -> Sequence[Sitter]:
    """Return what the picture of the heads shows, from left to right."""
    as_it_is = Rotation.identity()
    return (
        Sitter(source.data, worn, as_it_is, "source scan"),
        Sitter(target.data, clay_material(), as_it_is, "target scan: bent, remeshed, scaled, turned"),
        Sitter(target.data, worn, POSE.rotation.inv(), "target scan, after the transfer"),
    )


def discs(alignment: solver.Alignment, source: bpy.types.Object, target: bpy.types.Object) -> Sequence[Disc]:
    """Return what the picture of the discs shows: the source's disc carried to the target's, and that one."""
    painted = paint_material(FACE_PAINT, GRID_UV, lit=False)
    surface = alignment.source.mesh
    carried, still = alignment.mobius(alignment.source.places), alignment.target.places
    # both turned alike, so that the source's face looks out of its disc upright
    seen = surface.vertices[:, 0] + 1j * surface.vertices[:, 2]
    turn = np.exp(1j * np.angle(np.sum(surface.vertex_areas * seen * np.conj(carried))))
    ends = zip((alignment.source_samples, alignment.target_samples), alignment.matches.T, strict=True)
    from_samples, to_samples = (samples[pairs] for samples, pairs in ends)
    colors = hues(still[to_samples])
    return (
        Disc(source.data, painted, turn * carried, turn * carried[from_samples], colors, "source disc, carried by f"),
        Disc(target.data, painted, turn * still, turn * still[to_samples], colors, "target disc"),
    )


def dress(source: bpy.types.Object, target: bpy.types.Object, worn: bpy.types.Material) -> None:
    """Show the paint on both objects, and let the file's own windows look at them from the front."""
    for obj in (source, target):
        obj.data.materials.clear()
        obj.data.materials.append(worn)
    corners = np.concatenate([np.array(obj.bound_box) for obj in (source, target)])
    for screen in bpy.data.screens:
        for area in screen.areas:
            if area.type == "VIEW_3D":
                space = area.spaces.active
                space.shading.type = "MATERIAL"
                space.region_3d.view_location = (corners.min(axis=0) + corners.max(axis=0)) / 2
                space.region_3d.view_rotation = Euler((math.radians(80), 0, 0)).to_quaternion()
                space.region_3d.view_distance = 1.2 * float(np.ptp(corners, axis=0).max())


def keep_for_the_panel(
    source: bpy.types.Object,
    target: bpy.types.Object,
    alignment: solver.Alignment,
    correspondence: solver.Correspondence,
    surfaces: tuple[Surface, Surface],
) -> None:
    """Choose the two scans in the panel and keep their alignment, where the extension is installed."""
    settings = getattr(bpy.context.scene, "mobius", None)
    if settings is not None:
        settings.source, settings.target = source, target
        stored_alignment.store(target, source, alignment, correspondence, surfaces)


def save_blend(path: Path) -> None:
    """Write the open scene to a .blend file.

    Raises
    ------
    Refusal
        Blender cannot write it.
    """
    bpy.data.orphans_purge(do_recursive=True)
    try:
        with quiet():
            bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=True, check_existing=False)
    except RuntimeError as error:
        raise Refusal(f"'{path.name}' could not be written: {error}") from error
