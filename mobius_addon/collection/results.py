"""What a collection leaves behind for other programs: tables, meshes, landmarks, a .blend and a page of pictures."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...solver.collection import Collection
from ...solver.collection.shapes import Shapes, marks, shapes
from ...solver.collection.tasks import whole_file
from ...solver.surface.mesh import Booleans, Floats, Integers
from ..files import new_scene
from ..mesh_data import foreach
from ..streams import quiet
from .landmark_tables import write_csv, write_markups, write_morphologika, write_tps
from .page import page

NOTICED = 0.01
"""Share of the template that a specimen may lack without a word, as the last row of triangles along a rim is."""


def write_results(collection: Collection, landmarks: tuple[str, list[str], Floats] | None) -> list[str]:
    """Write everything beside the collection's own files, each file whole, and return sentences about it.

    Parameters
    ----------
    collection : Collection
    landmarks : (str, list of str, (l, 3) float64) or None
        The specimen that they were placed on, their labels and places.
    """
    root = collection.folder.root
    notes: list[str] = []
    _write_distances(root / "distances.csv", collection)
    _write_pairs(root / "pairs.csv", collection)
    common = shapes(collection)
    _write_specimens(root / "specimens.csv", collection, common)
    (root / "meshes").mkdir(exist_ok=True)
    for number, name in enumerate(common.names):
        mesh = common.mesh(number)
        with whole_file(root / "meshes" / f"{name}.ply") as path:
            write_ply(path, mesh.vertices, mesh.faces, common.known[number])
    notes += _lacking(common)
    mean, _ = common.superimposed
    with whole_file(root / "mean.ply") as path:
        write_ply(path, mean, common.faces)
    _write_blend(root / "collection.blend", common)
    if landmarks is not None:
        notes += _write_landmarks(root, collection, landmarks)
    with whole_file(root / "page.html") as path:
        path.write_text(page(collection, common), encoding="utf-8")
    return notes


@contextmanager
def _table(path: Path) -> Iterator[Any]:
    with whole_file(path) as unfinished, unfinished.open("w", newline="", encoding="utf-8") as file:
        yield csv.writer(file)


def _write_distances(path: Path, collection: Collection) -> None:
    with _table(path) as rows:
        rows.writerow(["", *collection.names])
        for name, row in zip(collection.names, collection.distances(), strict=True):
            rows.writerow([name, *(f"{x:.6g}" if np.isfinite(x) else "" for x in row)])


def _write_pairs(path: Path, collection: Collection) -> None:
    with _table(path) as rows:
        told = ["distance", "dense", "cycle_error", "suspect", "seconds", "warnings"]
        proved = ["verdict", "value", "upper_bound", "certified", "samples", "reflected", "mean_confidence", "coverage"]
        rows.writerow(["source", "target", *proved, *told])
        for (a, b), known, error, bad in zip(
            collection.edges, collection.figures, collection.errors, collection.suspects, strict=True
        ):
            rows.writerow(
                [
                    collection.names[a],
                    collection.names[b],
                    known.judgement.level,
                    f"{known.value:.6g}",
                    f"{known.upper_bound:.6g}",
                    int(known.certified),
                    known.samples,
                    int(known.mobius.reflected),
                    f"{known.mean_confidence:.4f}",
                    f"{known.coverage:.4f}",
                    f"{known.distance:.6g}",
                    int(known.dense),
                    f"{error:.4f}" if np.isfinite(error) else "",
                    int(bad),
                    f"{known.seconds:.2f}",
                    "; ".join(known.warnings),
                ]
            )


def _write_specimens(path: Path, collection: Collection, common: Shapes) -> None:
    certainty = dict(zip(common.names, common.certainty, strict=True))
    missing = dict(zip(common.names, common.missing, strict=True))
    turned = dict(zip(common.names, common.mirrored, strict=True))
    with _table(path) as rows:
        rows.writerow(
            ["specimen", "vertices", "faces", "cycle_error", "path", "mirrored", "missing", "certainty", "notes"]
        )
        for number, (name, error) in enumerate(zip(collection.names, collection.specimen_errors, strict=True)):
            known = collection.folder.specimens[name]
            route = [collection.names[k] for k in collection.routes.get(number, [])]
            rows.writerow(
                [
                    name,
                    known["vertices"],
                    known["faces"],
                    f"{error:.4f}" if np.isfinite(error) else "",
                    " > ".join(route),
                    int(turned[name]) if name in turned else "",
                    f"{missing[name]:.4f}" if name in missing else "",
                    f"{certainty[name]:.4f}" if name in certainty else "",
                    "; ".join(known["notes"]),
                ]
            )
        rows.writerows([name, "", "", "", "", "", "", "", why] for name, why in collection.failures.items())


def _lacking(common: Shapes) -> list[str]:
    """Return a sentence about specimens that lack more of the template than one notices, if there are any."""
    order = [int(k) for k in np.argsort(-common.missing) if common.missing[k] > NOTICED]
    if not order:
        return []
    told = ", ".join(f"'{common.names[k]}' {common.missing[k]:.0%}" for k in order[:3])
    more = f" and {len(order) - 3:,} more" if len(order) > 3 else ""
    return [
        f"no counterpart for a part of '{common.names[0]}' on {told}{more}: completed by its shape, and marked so "
        "(specimens.csv, counterpart in meshes/, attributes in collection.blend)"
    ]


def write_ply(path: Path, vertices: Floats, faces: Integers, counterpart: Booleans | None = None) -> None:
    """Write a triangle mesh as a binary .ply in doubles; with which vertices, (n,), have a counterpart, if given."""
    marked = "" if counterpart is None else "property uchar counterpart\n"
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\n"
        f"property double z\n{marked}element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    points = np.empty(len(vertices), np.dtype([("place", "<f8", 3), *([("marked", "u1")] if marked else [])]))
    points["place"] = vertices
    if counterpart is not None:
        points["marked"] = counterpart
    rows = np.empty(len(faces), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    rows["count"], rows["corners"] = 3, faces
    with path.open("wb") as file:
        file.write(header.encode("ascii"))
        file.write(points.tobytes())
        file.write(rows.tobytes())


def _write_blend(path: Path, common: Shapes) -> None:
    """Write one object in the shape of the mean, with a shape key for each specimen, in the mean's pose and size.

    With an attribute "completed NAME" for each specimen that lacks a part: which of its vertices have no counterpart.
    """
    mean, poses = common.superimposed
    new_scene()
    mesh = bpy.data.meshes.new("Collection")
    mesh.vertices.add(len(mean))
    mesh.vertices.foreach_set("co", mean.astype(np.float32).ravel())
    mesh.loops.add(common.faces.size)
    mesh.loops.foreach_set("vertex_index", common.faces.astype(np.int32).ravel())
    mesh.polygons.add(len(common.faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, common.faces.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    obj = bpy.data.objects.new("Collection", mesh)
    bpy.context.scene.collection.objects.link(obj)
    obj.shape_key_add(name="Mean", from_mix=False)
    for name, pose, vertices in zip(common.names, poses, common.vertices, strict=True):
        key = obj.shape_key_add(name=name, from_mix=False)
        key.data.foreach_set("co", pose(vertices).astype(np.float32).ravel())
        key.value = 0.0
    for name, known in zip(common.names, common.known, strict=True):
        if not known.all():
            mesh.attributes.new(f"completed {name}", "BOOLEAN", "POINT").data.foreach_set("value", ~known)
    assert len(foreach(mesh.vertices, "co", 3, np.float32)) == len(mean)
    unfinished = path.with_name(f".{path.stem}.{os.getpid()}.unfinished.blend")
    try:
        with quiet():
            bpy.ops.wm.save_as_mainfile(filepath=str(unfinished.resolve()), copy=True, check_existing=False)
        unfinished.replace(path)
    except RuntimeError as error:  # Blender's word for what could not be written
        raise OSError(f"'{path.name}' could not be saved") from error
    finally:
        unfinished.unlink(missing_ok=True)


def _write_landmarks(root: Path, collection: Collection, landmarks: tuple[str, list[str], Floats]) -> list[str]:
    start, labels, given = landmarks
    placed = marks(collection, collection.names.index(start), labels, given)
    (root / "landmarks").mkdir(exist_ok=True)
    for name, places, known in zip(placed.names, placed.places, placed.known, strict=True):
        with whole_file(root / "landmarks" / f"{name}.mrk.json") as path:
            write_markups(path, placed.labels, places, known)
    for name, write in (
        ("landmarks.csv", write_csv),
        ("landmarks.tps", write_tps),
        ("landmarks-morphologika.txt", write_morphologika),
    ):
        with whole_file(root / name) as path:
            write(path, placed)
    far = [f"'{label}' ({off:.0%})" for label, off in zip(labels, placed.off, strict=True) if off > 0.02]
    said = [f"landmarks off '{start}', by how much of its diagonal: {', '.join(far)}; the nearest points are taken"]
    lost = [f"'{label}' ({n:,})" for label, n in zip(labels, (~placed.known).sum(axis=0), strict=True) if n]
    gone = [f"landmarks without a counterpart, on how many specimens: {', '.join(lost)}; written as missing there"]
    return (said if far else []) + (gone if lost else [])
