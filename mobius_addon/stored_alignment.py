"""The result of an alignment, kept on the target's mesh: saved with it, undone with it, refused once it is stale."""

from __future__ import annotations

import io
import json
import zipfile
from functools import lru_cache
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ..solver import Alignment, Correspondence, report
from ..solver.carry.inverse import inverse_figures
from . import earlier_version
from .fingerprints import fingerprint_of, is_other
from .mesh_data import Refusal, Surface
from .topology_cache import MAX_POLYGONS


def store(
    target: bpy.types.Object,
    source: bpy.types.Object,
    alignment: Alignment,
    correspondence: Correspondence,
    surfaces: tuple[Surface, Surface],
) -> None:
    """Keep an alignment on the target's mesh.

    Parameters
    ----------
    target, source : bpy.types.Object
        The aligned objects.
    alignment, correspondence : Alignment, Correspondence
        The solver's results.
    surfaces : (Surface, Surface)
        Source and target as they were aligned.
    """
    kept = target.data.mobius_alignment
    kept.property_unset("source")  # of an earlier version
    kept.source_name, kept.source_size = source.name, len(surfaces[0].mesh.vertices)
    kept.source_fingerprint, kept.target_fingerprint = (surface.rest.fingerprint for surface in surfaces)
    kept.value = alignment.value
    kept.upper_bound = alignment.search.upper_bound
    kept.certified = alignment.certified
    kept.reflected = alignment.mobius.reflected
    about = report(alignment, correspondence)
    kept.coverage = about["coverage"]
    kept.seconds = sum(alignment.seconds.values())
    kept.report = json.dumps(about)
    kept.packed = _packed(correspondence)
    kept.property_unset("unbent")
    kept.property_unset("pairs")


def store_inverse(
    source: bpy.types.Object, target: bpy.types.Object, back: Correspondence, surfaces: tuple[Surface, Surface]
) -> None:
    """Keep the inverse of what the target's mesh keeps on the source's mesh, with what was proved of it.

    `back` is that map, `surfaces` are source and target.
    """
    there, kept = target.data.mobius_alignment, source.data.mobius_alignment
    areas = surfaces[0].mesh.vertex_areas
    coverage = float(areas[back.matched].sum() / areas.sum())
    kept.property_unset("source")
    kept.source_name, kept.source_size = target.name, len(surfaces[1].mesh.vertices)
    kept.source_fingerprint, kept.target_fingerprint = there.target_fingerprint, there.source_fingerprint
    for name in ("value", "upper_bound", "certified", "reflected", "seconds"):
        setattr(kept, name, getattr(there, name))
    kept.coverage = coverage
    figures = _parsed(there.report)
    if figures is not None:
        kept.report = json.dumps(inverse_figures(figures, coverage, float(areas @ back.confidence / areas.sum())))
    kept.packed = _packed(back)
    kept.property_unset("unbent")
    kept.property_unset("pairs")


def keep_bent(target: bpy.types.Object, correspondence: Correspondence, pairs: str | None) -> None:
    """Keep a map that was bent through point pairs, beside that from before; None: it is that from before again."""
    kept = target.data.mobius_alignment
    if pairs is None:
        kept.packed = kept.unbent or kept.packed
        kept.property_unset("unbent")
        kept.property_unset("pairs")
        return
    kept.unbent = kept.unbent or kept.packed
    kept.packed, kept.pairs = _packed(correspondence), pairs


def _packed(correspondence: Correspondence) -> bytes:
    packed = io.BytesIO()
    np.savez(
        packed,
        face=correspondence.face.astype(np.int32),
        barycentric=correspondence.barycentric,
        matched=correspondence.matched,
        confidence=correspondence.confidence.astype(np.float32),
        **{
            name: found.astype(np.int32)
            for name in ("part", "source_part", "leader")
            if (found := getattr(correspondence, name)) is not None
        },
    )
    return packed.getvalue()


def exists(target: bpy.types.Object, source: bpy.types.Object) -> bool:
    """Return whether the target's mesh keeps an alignment with this source, by its name (stale or not) or its shape."""
    kept = target.data.mobius_alignment
    if not kept.target_fingerprint:
        return False
    if kept.source is not None:  # in a linked mesh of an earlier version, which cannot be written
        return kept.source == source
    if kept.source_name == source.name:
        return True
    return kept.source_size == len(source.data.vertices) and kept.source_fingerprint == fingerprint_of(source)


def pair(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object] | None:
    """Return the chosen source and target if they are aligned."""
    settings = context.scene.mobius
    source, target = settings.source, settings.target
    if source is None or target is None or source.type != "MESH" or target.type != "MESH":
        return None
    return (source, target) if exists(target, source) else None


def missing(target: bpy.types.Object, source: bpy.types.Object) -> str:
    """Return the sentence for a pair without an alignment."""
    return rpt_("'{}' has not been aligned with '{}' yet: press Align first").format(target.name, source.name)


def figures(target: bpy.types.Object) -> dict[str, Any] | None:
    """Return the `solver.report` of the alignment that the target's mesh keeps, None if it cannot be read."""
    return _parsed(target.data.mobius_alignment.report)


@lru_cache(maxsize=64)  # the panel lists many
def _parsed(report: str) -> dict[str, Any] | None:
    try:
        return json.loads(report)
    except ValueError:
        return None


def why_stale(target: bpy.types.Object, source: bpy.types.Object) -> str | None:
    """Return why the alignment that the target's mesh keeps with this source is of no use any more, or None if it is.

    Cheap enough to be asked at every redraw; in other modes than Object Mode nothing is known.
    """
    kept = target.data.mobius_alignment
    for obj, fingerprint in ((source, kept.source_fingerprint), (target, kept.target_fingerprint)):
        small = obj.mode == "OBJECT" and len(obj.data.polygons) <= MAX_POLYGONS
        if small and is_other(obj, fingerprint):
            return edited(obj.name)
    return None


def edited(name: str) -> str:
    """Return the sentence for a mesh that is not what was aligned any more."""
    return rpt_("'{}' has been edited since it was aligned: press Align again").format(name)


def load(
    target: bpy.types.Object, source: bpy.types.Object, surfaces: tuple[Surface, Surface], *, unbent: bool = False
) -> Correspondence:
    """Return the correspondence that the target's mesh keeps; `surfaces` are source and target as they are now.

    `unbent`: as it was before it was bent through point pairs.

    Raises
    ------
    Refusal
        There is none with this source, or one of the meshes has changed since.
    """
    if not exists(target, source):
        raise Refusal(missing(target, source))
    kept, (source_surface, target_surface) = target.data.mobius_alignment, surfaces
    for obj, surface, fingerprint in (
        (source, source_surface, kept.source_fingerprint),
        (target, target_surface, kept.target_fingerprint),
    ):
        if surface.rest.fingerprint != fingerprint and earlier_version.fingerprint(surface.rest) != fingerprint:
            raise Refusal(edited(obj.name))
    arrays = _unpack((unbent and kept.unbent) or kept.packed, target.name)
    return Correspondence(
        face=arrays["face"].astype(np.intp),
        barycentric=arrays["barycentric"],
        matched=arrays["matched"],
        confidence=arrays["confidence"].astype(np.float64),
        source_triangles=source_surface.mesh.faces,
        source_size=len(source_surface.mesh.vertices),
        **{name: arrays[name].astype(np.intp) for name in ("part", "source_part", "leader") if name in arrays},
    )


def _unpack(packed: bytes, name: str) -> dict[str, Any]:
    try:
        with np.load(io.BytesIO(packed), allow_pickle=False) as arrays:
            return dict(arrays)
    except (zipfile.BadZipFile, ValueError, OSError, EOFError, KeyError) as error:
        raise Refusal(rpt_("'{}' keeps an alignment that is damaged: press Align again").format(name)) from error
