"""Under which name a carried layer is written, so that nothing of the person's own is replaced without a word."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...solver.surface.mesh import Booleans
from .carrier import Values
from .materials import MaterialAccess
from .settings import TransferSettings
from .table import NOUNS, Row


@dataclass(frozen=True, eq=False)
class Place:
    """Where a layer can be written on the target.

    Attributes
    ----------
    name : str
        Under its own name, or what has that name if something else has.
    there : Values or None
        What bears the name now, None if nothing does.
    earlier : bool
        Whether that is what an earlier transfer wrote, and nobody has edited it since.
    before : str or None
        Another name, under which an earlier transfer wrote this layer, and nobody has edited it since.
    beside : str or None
        A name that is free; None where a mesh cannot have two.
    """

    name: str
    there: Values | None = None
    earlier: bool = False
    before: str | None = None
    beside: str | None = None

    def chosen(self, replaces: bool) -> str:
        """Return the name to write under, and whether that may replace what is there."""
        if replaces or self.earlier or self.beside is None:
            return self.name
        return self.before or self.beside


def joins(row: Row, settings: TransferSettings) -> bool:
    """Return whether values are to join those that are there, which are then changed on the person's word."""
    mixed = row.mixes and (settings.mix != "replace" or settings.mix_factor != 1)
    return mixed or settings.target_mask.by != "none"


def holds_nothing(row: Row, there: Values | None) -> bool:
    """Return whether there is nothing to lose: no layer, or one that was made and never filled."""
    if there is None:
        return True
    if row.kind in ("vertex-groups", "shape-keys"):
        return not there.any()
    return (row.kind == "uv" or row.marks) and bool((there == there[:1]).all())


def is_same(row: Row, values: Values, covered: Booleans, there: Values | None, about: object) -> bool:
    """Return whether values, where they are covered, (n,), are those that are there."""
    if there is None:
        return False
    if isinstance(row.access, MaterialAccess):
        assert isinstance(about, Sequence)
        values = row.access.describe(values, about)
    new, old = values[covered], there[covered]
    if row.kind == "vertex-groups":
        new = np.clip(new, 0, 1)
    if new.dtype == object or old.dtype.kind != "f":
        return bool((new.astype(old.dtype) == old).all())
    scale = max(float(np.abs(old[np.isfinite(old)]).max(initial=0)), 1e-3)
    # normals are kept in 16 bits
    return bool((np.abs(new - old) <= (1e-3 if row.kind == "normals" else 1e-6) * scale).all())


def kept_notes(target: str, kept: Iterable[tuple[str, str, str]]) -> list[str]:
    """Return a sentence for each kind of layers that the target keeps: kind, its name, and the carried one's name."""
    by_kind: dict[str, list[tuple[str, str]]] = {}
    for kind, own, carried in kept:
        by_kind.setdefault(kind, []).append((own, carried))
    return [
        f"'{target}' keeps its own {_noun(kind, len(pairs))} ({_listed([own for own, _ in pairs])}): carried as "
        f"{_listed([carried for _, carried in pairs])}"
        for kind, pairs in by_kind.items()
    ]


def replaced_notes(target: str, kinds: Iterable[str]) -> list[str]:
    """Return a sentence about kinds of data of the target's own that a mesh has once, if any are replaced."""
    nouns = [NOUNS[kind] for kind in dict.fromkeys(kinds)]
    if not nouns:
        return []
    return [f"'{target}' had other {', '.join(nouns)}, which a mesh has once: they are replaced"]


def _noun(kind: str, number: int) -> str:
    return NOUNS[kind] if number > 1 else NOUNS[kind].removesuffix("s")


def _listed(names: list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names[:6]) + (", ..." if len(names) > 6 else "")
