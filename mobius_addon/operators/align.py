"""Find the certified correspondence between two meshes and show it on both."""

# no postponed annotations here: Blender reads the properties from them
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from scipy.spatial import KDTree

from ... import solver
from ...solver.align.judgement import judge
from ...solver.align.result.confidence import expected_error
from ...solver.surface.mesh import Booleans, Floats
from .. import landmarks, results, stored_alignment
from ..attributes import MATCHED_GROUP, SHARED_COLOR, SHARED_LAYOUT, piece_of, restored_on_failure
from ..computation import aligned
from ..job import Report, Work
from ..jobs import JobOperator, why_busy
from ..mesh_data import Refusal, Surface, read_surface, unseen_warning
from ..options import AlignOptions, ScanOptions, align_settings, outer_vertex
from ..preferences import preferences
from ..translation import told
from ..usable import by_uid, is_deleted, is_read_only, why_not_pair, written
from ..verdict import verdict_sentence
from . import side_by_side


@dataclass(frozen=True, eq=False)
class Aligned:
    """What an alignment's work returns."""

    alignment: solver.Alignment
    correspondence: solver.Correspondence


class AlignOperator(JobOperator, AlignOptions, ScanOptions):
    """Mixin for operators that align a source and a target; the last result is kept in case the same is asked again."""

    time_limit: bpy.props.FloatProperty(
        name="Time Limit",
        description="Seconds after which a search stops and reports its gap; 0: none. By default the add-on's",
        default=solver.AlignSettings().time_limit or 0.0,
        min=0.0,
        options={"SKIP_SAVE"},
    )
    take_rival: bpy.props.BoolProperty(
        name="Take the Rival",
        description="Continue with the second best map, which sends everything elsewhere, in place of the best: for "
        "surfaces with a symmetry, where the best may be the wrong one",
        default=False,
        options={"SKIP_SAVE"},
    )
    surfaces: tuple[Surface, Surface]

    def begin(self, context: bpy.types.Context, source: bpy.types.Object, target: bpy.types.Object) -> Work:
        """Read both meshes, and return the work that gives their `Aligned`."""
        self._names = source.name, target.name
        self.objects_read = source.session_uid, target.session_uid
        self.surfaces = surfaces = read_surface(source), read_surface(target)
        limit = self.time_limit
        if not self.properties.is_property_set("time_limit") and (kept := preferences(context)):
            limit = kept.time_limit
        meshes = surfaces[0].mesh, surfaces[1].mesh
        outer = outer_vertex(source, surfaces[0], self), outer_vertex(target, surfaces[1], self)
        options = replace(align_settings(self, limit, outer), take_rival=self.take_rival)
        largest_part = self.largest_part
        pairs = landmarks.from_scene(source, target, meshes, self.landmarks)
        keys = surfaces[0].keys, surfaces[1].keys
        moved = tuple(None if own is None else own.tobytes() for own in keys)
        within = piece_of(source, self.source_cut), piece_of(target, self.target_cut)
        pieces = tuple(None if piece is None else piece.tobytes() for piece in within)
        prints = meshes[0].fingerprint, meshes[1].fingerprint
        self._asked = *prints, moved, pieces, options, largest_part, pairs.tobytes()
        found, repeated = _last.get(self._asked), self.options.is_repeat

        def work(report: Report) -> Aligned:
            if found is not None:
                return found
            if repeated:  # the window would be frozen
                text = rpt_("The result of '{}' is not known any more: call it again")
                raise Refusal(text.format(rpt_(self.job_title)))
            asked_for = {"largest_part": largest_part, "keys": keys, "landmarks": pairs, "within": within}
            return Aligned(*aligned(*meshes, options, **asked_for, progress=report))

        return work

    def remember(self, done: Aligned) -> None:
        """Keep the result in case the same is asked again, as the redo panel does."""
        _last.clear()
        _last[self._asked] = done

    def objects(self) -> tuple[bpy.types.Object, bpy.types.Object]:
        """Return source and target, if they are still what was read.

        Raises
        ------
        Refusal
            They are not.
        """
        found = []
        for uid, name, surface in zip(self.objects_read, self._names, self.surfaces, strict=True):
            obj = as_read(uid, name, surface)
            found.append(obj)
        for obj in written(*found):
            results.require_room(obj, [SHARED_LAYOUT], [SHARED_COLOR])
        return found[0], found[1]

    def keep(self, source: bpy.types.Object, target: bpy.types.Object, done: Aligned) -> None:
        """Write an alignment on both meshes, or on the target alone; if that fails, both are as they were."""
        with restored_on_failure(*written(source, target)):
            write_alignment(source, target, done.alignment, done.correspondence, self.surfaces)
            stored_alignment.store(target, source, done.alignment, done.correspondence, self.surfaces)

    def announce(self, source: bpy.types.Object, target: bpy.types.Object, done: Aligned) -> None:
        """Report an alignment."""
        for warning in [unseen_warning(source), unseen_warning(target), *done.alignment.warnings]:
            if warning:
                self.report({"WARNING"}, told(warning))
        if sentence := only_read(source):
            self.report({"INFO"}, sentence)
        found = stored_alignment.figures(target)
        if found is not None:
            self.report({"INFO"}, verdict_sentence(bpy.context.scene, source, target, found))


# a cache, never the truth: it can be emptied at any time. By fingerprints of both meshes and all that was asked; arrays
# alone, nothing of Blender's
_last: dict[Any, Aligned] = {}


def forget_last() -> None:
    """Free the memory of the last result."""
    _last.clear()


class MOBIUS_OT_align(AlignOperator, bpy.types.Operator):
    """Match source and target: both get a shared UV map, corresponding colors and a group of matched points."""

    bl_idname = "mobius.align"
    bl_label = "Align"
    # no REGISTER: turning knobs in the redo panel would search for seconds each time, with a frozen window
    bl_options = {"UNDO"}
    job_title = "Align"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Allow for two meshes in Object Mode of which the target can be written."""
        reason = why_not_pair(context, writes_source=False) or why_busy()
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def prepare(self, context: bpy.types.Context) -> Work:
        """Read both meshes."""
        settings = context.scene.mobius
        for obj in written(settings.source, settings.target):
            results.require_room(obj, [SHARED_LAYOUT], [SHARED_COLOR])
        return self.begin(context, settings.source, settings.target)

    def finish(self, context: bpy.types.Context, result: Aligned) -> None:
        """Write on both meshes, if they are still what was read."""
        self.remember(result)
        pair = self.objects()
        self.keep(*pair, result)
        self.announce(*pair, result)
        if self.is_persons:
            with suppress(Refusal, solver.MeshError):  # as where there is no room for one more color attribute
                side_by_side.show_after(context, *pair)


def as_read(uid: int, name: str, surface: Surface) -> bpy.types.Object:
    """Return an object, if it is still what was read.

    Raises
    ------
    Refusal
        It is not.
    """
    obj = by_uid(bpy.data.objects, uid)
    if obj is None or is_deleted(obj) or obj.type != "MESH" or obj.mode != "OBJECT":
        raise Refusal(rpt_("'{}' was removed or is being edited since the alignment began: align again").format(name))
    if read_surface(obj).mesh.fingerprint != surface.mesh.fingerprint:
        raise Refusal(rpt_("'{}' was edited during the alignment: align again").format(name))
    return obj


def only_read(source: bpy.types.Object) -> str | None:
    """Return the sentence about a source that nothing is written on, None if it can be written."""
    if not is_read_only(source):
        return None
    text = rpt_("'{}' is linked from another file and only read: the shared layout and colors are on the target alone")
    return text.format(source.name)


def write_alignment(
    source: bpy.types.Object,
    target: bpy.types.Object,
    alignment: solver.Alignment,
    correspondence: solver.Correspondence,
    surfaces: Any,
    frame: solver.Mobius | solver.SphereMobius | None = None,
) -> None:
    """Write the shared UV layout, the colors and the groups of matched points on both meshes.

    A source of another file, which cannot be written, stays as it is. `frame` carries the
    source's disc to where the layout shows it; by default to the target's.
    """
    shown: Any = frame or alignment.mobius
    carried: Any = shown(alignment.source.places)
    still: Any = shown(alignment.carried)
    here, there = (
        tidy or solver.Cleaned.unchanged(surface.mesh)
        for tidy, surface in zip((alignment.source_cleaned, alignment.target_cleaned), surfaces, strict=True)
    )
    if alignment.source.domain.closed:  # no layout without a seam: the colors are where points lie on the sphere
        places = here.at_vertices(carried, np.nan)
        used = np.isfinite(places).all(axis=1)
        color = np.column_stack([0.5 + 0.5 * np.nan_to_num(places), np.ones(len(places))])
    else:
        if not is_read_only(source):
            results.write_layout(source, SHARED_LAYOUT, here.at_corners(carried, np.nan), surfaces[0])
        results.write_layout(target, SHARED_LAYOUT, there.at_corners(still, np.nan), surfaces[1])
        carried = here.at_vertices(carried, np.nan)
        used = np.isfinite(carried)
        color = results.disc_color(np.where(used, carried, 0))
    results.write_color(target, SHARED_COLOR, solver.interpolate(correspondence, color), correspondence.face >= 0)
    matched = np.where(correspondence.matched, correspondence.confidence, 0.0)
    results.write_group(target, MATCHED_GROUP, matched)
    if is_read_only(source):
        return
    results.write_color(source, SHARED_COLOR, color, used)
    used = here.vertex_of >= 0
    if (whole := alignment.whole) is not None:
        used |= np.isin(whole.source.of_vertex, [x.source for x in whole.pairs if x.source and x.target is not None])
    group = on_source(surfaces[0].mesh, used, correspondence, matched)
    results.write_group(source, MATCHED_GROUP, group)


def on_source(
    mesh: solver.TriangleMesh, used: Booleans, correspondence: solver.Correspondence, values: Floats
) -> Floats:
    """Return values per target vertex, (n_target,), carried to source vertices: each takes the nearest that arrives.

    `used`, (n_source,), says which source vertices the map is about; 0 at others.
    """
    found = np.flatnonzero(correspondence.face >= 0)
    places = (correspondence.matrix() @ mesh.vertices)[found]
    on_vertices = np.zeros(len(mesh.vertices))
    on_vertices[used] = values[found[KDTree(places).query(mesh.vertices[used])[1]]]
    return on_vertices


def summary(source: str, target: str, alignment: solver.Alignment, correspondence: solver.Correspondence) -> str:
    """Return one sentence about an alignment: what matched, and what is proved about it."""
    mirrored = ", mirrored" if alignment.mobius.reflected else ""
    margin = ""
    if (ahead := alignment.margin) is not None:
        margin = f", {abs(ahead):.1%} {'ahead of' if ahead >= 0 else 'behind'} the other orientation"
    share = ""
    if (overlap := alignment.overlap) is not None:
        proven = _proof(overlap.alignment)
        share = f"; in the {overlap.target_share:.0%} of the target that the source shows too {proven}"
    parts = ""
    if alignment.whole is not None:
        paired, bare, _ = alignment.whole.counts()
        parts = f"; {paired:,} of {paired + bare:,} parts have a counterpart"
    level = judge(alignment).level.title()
    return (
        f"{level}: '{source}' on '{target}'{mirrored}: {_proof(alignment)}{margin}{share}{parts}; "
        f"{correspondence.matched.mean():.0%} of the vertices matched{_error(correspondence)}"
    )


def _error(correspondence: solver.Correspondence) -> str:
    """Say how far off the matched points are to be expected."""
    if not correspondence.matched.any():
        return ""
    error = float(expected_error(correspondence.confidence[correspondence.matched]).mean())
    return f", a mean error of about {error:.1%} of the source's diagonal expected"


def _proof(alignment: solver.Alignment) -> str:
    """Say what a search found and proved."""
    search = alignment.search
    if isinstance(search, solver.SphereSearchResult) and alignment.taken is None:
        also = search.rotations_certified and search.h_max > 0
        proof = f"proved: {search.proved}" + ("; no rotation matches more" if also else "")
    elif alignment.certified:
        # the other orientation's best may be ahead
        among = " in this orientation" if alignment.margin is not None and alignment.margin < 0 else ""
        proof = f"certified: no Möbius map with |z| <= {alignment.settings.z_max:.2f} matches more{among}"
    elif alignment.taken is not None:
        proof = f"not the best match: another map has {search.value:.2f}"
    else:
        proof = f"not certified: the proven bound is {search.upper_bound:.2f}, a gap of {search.gap:.2f}"
    return f"matched value {alignment.value:.2f} of at most {len(alignment.source_samples)}, {proof}"
