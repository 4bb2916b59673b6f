"""A transfer that is prepared: what was read of both objects is carried, and given its names on the target."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...solver import Cancelled, Progress
from ...solver.surface.mesh import Floats
from ..mesh_data import Refusal
from ..textures.carrying import TextureReading
from .access import MAX_UV_MAPS, Layer
from .carrier import Carrier
from .key_set import KeyPlan, KeySet, planned
from .key_sides import symmetric
from .looks import Looks
from .missing import carried_without_missing, missing_warning
from .mixing import changes, mixed, over
from .placing import Place, holds_nothing, is_same, joins, kept_notes, replaced_notes
from .plan import Carried, Transfer
from .rig import RigReading
from .settings import TransferSettings
from .table import KINDS, Row
from .unmatched import Unmatched
from .weights import tidied

_LISTED = 3
"""So many kinds of data are named where the source has none of them."""

_LABELS = {kind.identifier: kind.label for kind in KINDS}


@dataclass(frozen=True, eq=False)
class Pending:
    """A layer that was read, who carries it, and where it can go."""

    row: Row
    carrier: Carrier
    layer: Layer
    place: Place


class NothingThere(Refusal):
    """The source has nothing of what is to be carried."""


@dataclass(frozen=True, eq=False)
class Reading:
    """Everything that a transfer needs of the two objects, as arrays: `carry` may run in a thread of its own."""

    pending: tuple[Pending, ...]
    carrier: Carrier
    settings: TransferSettings
    influence: Floats | None
    locked: Floats | None
    looks: Looks
    keys: tuple[KeySet | None, KeySet | None]
    maps: frozenset[str]
    warnings: tuple[str, ...]
    names: tuple[str, str]
    unmatched: Unmatched
    textures: TextureReading | None = None
    rig: RigReading | None = None
    twins: Mapping[str, str] | None = None

    def carry(self, progress: Callable[[Progress], bool | None] | None = None) -> Transfer:
        """Carry every layer.

        Raises
        ------
        Cancelled
            The progress callback returned False.
        NothingThere
            Nothing is left to write.
        Refusal
            There are more UV maps than Blender allows.
        """
        warnings = list(self.warnings)
        layers: list[tuple[Pending, Carried]] = []
        same = False
        # pictures take longer than everything else
        share = 1.0 if self.textures is None else 0.1
        for number, pending in enumerate(self.pending):
            row, name = pending.row, pending.layer.name
            step = Progress(f"{_LABELS[row.kind]} of '{self.names[1]}'", share * number / len(self.pending))
            if progress is not None and progress(step) is False:
                raise Cancelled
            carried, missing = self._carried(pending)
            if row.marks:
                # flags that most meshes have: no word about those that stay as they are
                if not changes(carried, pending.place.there):
                    same = True
                    continue
                if carried.name != name:
                    warnings.append(f"'{self.names[1]}' has an attribute of another type named '{name}': delete it")
                    continue
            if missing:
                warnings.append(missing_warning(row, name, self.names[0], missing))
            layers.append((pending, carried))
        if not layers and self.textures is None:
            if same and not warnings:
                raise NothingThere(
                    f"'{self.names[1]}' already has everything of the chosen kinds that is on '{self.names[0]}'"
                )
            raise NothingThere(nothing(self.names[0], self.settings, warnings))
        textures = None if self.textures is None else self.textures.carry(self._telling(progress, share))
        warnings += () if textures is None else textures.notes
        layers = self._tidied(layers)
        if self.twins is not None:
            carried_layers, more = symmetric([x for _, x in layers], self.twins, self.carrier.target.rest)
            layers = [(pending, x) for (pending, _), x in zip(layers, carried_layers, strict=True)]
            warnings += more
        placed, notes = self._placed(layers)
        settled, keys, more = self._settled(placed)
        maps = self.maps | {x.name for x in settled if x.row.kind == "uv"}
        if len(maps) > MAX_UV_MAPS:
            raise Refusal(
                f"'{self.names[1]}' would have {len(maps)} UV maps and Blender allows {MAX_UV_MAPS}: delete some first"
            )
        shown_uv, shown_color, others = self.looks.shown(settled, self.names)
        warnings += [*notes, *more, *others, *self.unmatched.warnings(self.names[1])]
        rig = None if self.rig is None else self.rig.carry()
        return Transfer(tuple(settled), keys, shown_uv, shown_color, tuple(warnings), self.unmatched, textures, rig)

    def _telling(
        self, progress: Callable[[Progress], bool | None] | None, begun: float
    ) -> Callable[[float], None] | None:
        """Return what turns shares of the work on pictures into progress; it raises `Cancelled`."""
        if progress is None:
            return None

        def tell(share: float) -> None:
            step = Progress(f"{_LABELS['textures']} of '{self.names[1]}'", begun + share * (1 - begun))
            if progress(step) is False:
                raise Cancelled

        return tell

    def _carried(self, pending: Pending) -> tuple[Carried, int]:
        """Return a carried layer, and how many elements of the source have no number for it."""
        row, settings, layer, place = pending.row, self.settings, pending.layer, pending.place
        values, covered, missing = carried_without_missing(row, pending.carrier, layer.values)
        share = np.ones(len(values))
        if self.influence is not None:
            share = self.carrier.at(row.access.domain, self.influence)
        if row.mixes:
            covered = covered & (share > 0)
            values = mixed(values, place.there, settings.mix, settings.mix_factor * share)
        else:
            covered = covered & (share >= 0.5)
        return Carried(row, layer.name, place.name, values, covered, layer.about), missing

    def _tidied(self, layers: list[tuple[Pending, Carried]]) -> list[tuple[Pending, Carried]]:
        groups = [x for _, x in layers if x.row.kind == "vertex-groups"]
        if not groups:
            return layers
        columns = tidied(
            np.clip(np.stack([np.where(x.covered, x.values, 0) for x in groups], axis=1), 0, 1),
            np.any([x.covered for x in groups], axis=0),
            smallest=self.settings.smallest_weight,
            limit=self.settings.limit,
            normalize=self.settings.normalize,
            locked=self.locked,
        )
        done = iter([replace(x, values=column) for x, column in zip(groups, columns.T, strict=True)])
        return [(pending, next(done) if x.row.kind == "vertex-groups" else x) for pending, x in layers]

    def _placed(self, layers: list[tuple[Pending, Carried]]) -> tuple[list[Carried], list[str]]:
        """Return the layers under the names that they get, and sentences about what is kept or replaced."""
        result, kept, lost = [], [], []
        for pending, carried in layers:
            row, place = pending.row, pending.place
            there = place.there
            same = is_same(row, carried.values, carried.covered, there, carried.about)
            free = same or holds_nothing(row, there)
            asked = self.settings.collisions == "replace" or joins(row, self.settings)
            name = place.chosen(asked or free)
            if row.once and not (asked or free or place.earlier):
                lost.append(row.kind)
            if name != place.name:
                kept.append((row.kind, place.name, name))
                assert there is not None
                carried = over(carried, there)
            own = same and not place.earlier and not holds_nothing(row, there)
            result.append(replace(carried, name=name, own=own))
        return result, [*kept_notes(self.names[1], kept), *replaced_notes(self.names[1], lost)]

    def _settled(self, layers: list[Carried]) -> tuple[list[Carried], KeyPlan | None, list[str]]:
        """Return the layers with shape keys that know their companions' names, and what becomes of all keys."""
        source = self.keys[0]
        if source is None or not any(x.row.kind == "shape-keys" for x in layers):
            return layers, None, []
        keys, groups = (
            {x.source_name: x.name for x in layers if x.row.kind == kind} for kind in ("shape-keys", "vertex-groups")
        )
        sliders = [(x.source_name, x.name, x.about.renamed(keys, groups)) for x in layers if x.row.kind == "shape-keys"]
        plan, notes = planned(source, self.keys[1], sliders, self.names[1])
        return (
            [replace(x, about=plan.sliders[x.name]) if x.row.kind == "shape-keys" else x for x in layers],
            plan,
            notes,
        )


def nothing(source: str, settings: TransferSettings, warnings: Iterable[str]) -> str:
    """Return the sentence that says that a source has nothing of what is to be carried, and why."""
    nouns = [kind.noun for kind in KINDS if kind.identifier in settings.kinds]
    wanted = " or ".join(nouns) if len(nouns) <= _LISTED else "layer of the chosen kinds"
    if settings.layers != "all":
        wanted = f"active {wanted}" if settings.layers == "active" else f"so named {wanted}"
    why = "; ".join(warnings)
    return f"'{source}' has no {wanted} to transfer ({why})" if why else f"'{source}' has no {wanted} to transfer"
