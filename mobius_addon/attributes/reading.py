"""Everything that a transfer needs is read of both objects, before anything is carried."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import bpy

from ...solver.surface.mesh import Floats
from ..comparison import users_of
from ..textures.reading import read_textures
from .carrier import Carrier, Values
from .chosen import chosen_layers
from .key_animation import left_behind
from .key_set import key_set
from .key_sides import with_halves
from .layer_names import named_layers
from .looks import looks_of
from .placing import Place, joins
from .plan import Transfer
from .prepared import NothingThere, Pending, Reading, nothing
from .record import Written, unedited
from .rig import read_rig
from .settings import TransferSettings
from .shape_keys import ShapeKeyAccess, limited
from .table import RIDING, ROWS, Row
from .unmatched import Unmatched
from .vertex_groups import read_weights


def read_transfer(
    source: bpy.types.Object,
    target: bpy.types.Object,
    carrier: Carrier,
    settings: TransferSettings,
    *,
    shown_source: bpy.types.Object | None = None,
    keys_carrier: Carrier | None = None,
    influence: Floats | None = None,
    unmatched: Unmatched | None = None,
    keeps_texture_map: bool = False,
) -> Reading:
    """Read everything of the chosen kinds from the source, and what matters to it of the target.

    Parameters
    ----------
    source, target : bpy.types.Object
        Mesh objects in Object Mode.
    carrier : Carrier
        The correspondence between them.
    settings : TransferSettings
    shown_source : bpy.types.Object, optional
        The evaluated source, to read layers from; shape keys are the source's own.
    keys_carrier : Carrier, optional
        The correspondence with the source's own mesh, for shape keys, if `carrier` is one with an evaluated mesh.
    influence : (n_target,) float, optional
        The target's mask, in [0, 1]; None: 1.
    unmatched : Unmatched, optional
        What is unmatched and what `carrier` does about it; by default what it says itself.
    keeps_texture_map : bool
        With textures, make a transfer map too.

    Raises
    ------
    NothingThere
        Nothing to carry.
    """
    read, warnings, locked = [], [], []
    along_keys = replace(keys_carrier or carrier, keys_by=settings.keys_by, contacts=settings.contacts)
    for row in ROWS:
        if row.kind in settings.kinds:
            keys = row.kind == "shape-keys"
            whence, way = (source, along_keys) if keys else (shown_source or source, carrier)
            way = way if row.kind in RIDING else way.own
            layers = list(row.access.layers(whence, chosen_layers(row.kind, source, target, settings)))
            if keys and not _groups_come_along(settings, shown_source):
                layers = [limited(layer) for layer in layers]
            origin: dict[str, str] = {}
            if keys and settings.halves:
                layers, origin = with_halves(layers, way.source.rest.vertices)
            mirrors = row.kind in ("vertex-groups", "shape-keys") and bool(layers) and carrier.mirrors
            named, notes = named_layers(row.kind, layers, settings.spelling, mirrors, join=not settings.halves)
            warnings += notes
            read.append((row, way, [(replace(x, name=origin.get(x.name, x.name)), name) for x, name in named]))
    pending: list[Pending] = []
    reserved = {name for _, _, layers in read for _, name in layers}
    earlier = unedited(target, settings.kinds)
    for row, way, layers in read:
        found = []
        for layer, wanted in layers:
            taken = {name for x in pending for name in (x.place.name, x.place.before or x.place.beside) if name}
            name = row.access.place(target, wanted, taken | {x[1] for x in found})
            if name is None:
                warnings.append(f"'{wanted}' is locked on '{target.name}' and left as it is")
                locked += [wanted] if row.kind == "vertex-groups" else []
                continue
            if name != wanted and not row.marks:
                warnings.append(f"'{target.name}' has something else named '{wanted}': it becomes '{name}'")
            found.append((layer, name, wanted))
        names = [name for _, name, _ in found]
        there = row.access.existing(target, names)
        if isinstance(row.access, ShapeKeyAccess) and joins(row, settings):
            there = row.access.shown(target, names)
        for layer, name, wanted in found:
            place = _place(row, target, layer.name, name, there.get(name), earlier, reserved, wanted)
            reserved |= {x for x in (place.before, place.beside) if x is not None}
            pending.append(Pending(row, way, layer, place))
    textures = None
    if "textures" in settings.kinds:
        textures = read_textures(
            source, target, carrier, settings.textures, shown=shown_source, keeps_map=keeps_texture_map
        )
    rig = None
    if settings.rig:
        rig, notes = read_rig(source, target, keys_carrier or carrier)
        warnings += notes
    if not pending and textures is None:
        raise NothingThere(nothing(source.name, settings, warnings))
    if users_of(target.data) > 1:
        warnings.append(f"'{target.name}' shares its mesh with other objects: they change with it")
    warnings += left_behind(source, target, [x.layer.name for x in pending if x.row.kind == "shape-keys"])
    fixed = None
    if locked and settings.normalize:
        fixed = read_weights(target, locked).sum(axis=1)
    return Reading(
        tuple(pending),
        carrier,
        settings,
        influence,
        fixed,
        looks_of(source, target),
        (key_set(source), key_set(target)),
        frozenset(layer.name for layer in target.data.uv_layers),
        tuple(warnings),
        (source.name, target.name),
        unmatched or Unmatched.of(carrier),
        textures,
        rig,
        {x.place.name: bpy.utils.flip_name(x.place.name) for x in pending} if settings.symmetric else None,
    )


def plan_transfer(
    source: bpy.types.Object, target: bpy.types.Object, carrier: Carrier, settings: TransferSettings | None = None
) -> Transfer:
    """Carry everything of the chosen kinds from source to target, without writing yet; see `read_transfer`."""
    return read_transfer(source, target, carrier, settings or TransferSettings()).carry()


def _groups_come_along(settings: TransferSettings, shown_source: bpy.types.Object | None) -> bool:
    """Return whether carried vertex groups are what limits shape keys on the source, or are changed on their way."""
    return (
        "vertex-groups" in settings.kinds
        and shown_source is None
        and settings.limit == 0
        and not settings.normalize
        and settings.target_mask.by == "none"
        and settings.mix == "replace"
        and settings.mix_factor == 1
    )


def _place(
    row: Row,
    target: bpy.types.Object,
    source_name: str,
    name: str,
    there: Values | None,
    earlier: Iterable[Written],
    reserved: set[str],
    wanted: str,
) -> Place:
    """Return where a layer can go: under a name that it is to have, and beside what has it."""
    ours = [x for x in earlier if x.kind == row.kind]
    is_ours = any(x.name == name for x in ours)
    if there is None or row.once or is_ours:
        return Place(name, there, is_ours)
    before = [x.name for x in ours if x.source_name == source_name and x.name not in reserved]
    beside = row.access.place(target, wanted, reserved, number=True)
    return Place(name, there, False, next(iter(before), None), beside)
