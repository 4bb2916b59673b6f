"""What a person can choose about a transfer, each with its default."""

from __future__ import annotations

from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Literal

from ..textures.settings import TextureSettings
from .expression_names import Spelling
from .table import KINDS

Outcome = Literal["carry", "leave", "nearest", "fill"]
"""What becomes of target vertices without a certain counterpart."""


@dataclass(frozen=True)
class Mask:
    """Which vertices of an object take part.

    Attributes
    ----------
    by : str
        "none": all of them; "selected": those selected in Edit Mode; "named": as a vertex group or attribute says.
    name : str
        Of that vertex group or attribute.
    invert : bool
        Take the others.
    """

    by: Literal["none", "selected", "named"] = "none"
    name: str = ""
    invert: bool = False


@dataclass(frozen=True)
class TransferSettings:
    """Choices of a transfer.

    Attributes
    ----------
    kinds : tuple of str
        Identifiers of `KINDS`.
    layers : str
        "all", the "active" one of each kind, or those that are "named" in `names`; materials, marks and whatever else a
        mesh has once count as always chosen.
    names : tuple of str
        Names, in which `*` and `?` stand for any characters.
    deform_only : bool
        Carry only vertex groups that belong to a deforming bone of an armature of the source or the target.
    mix : str
        How weights, shapes, colors, masks and other interpolated values join those that are there.
    mix_factor : float
        In [0, 1]: how far they go from what is there to the result.
    limit : int
        At most so many vertex groups per vertex, the strongest; 0: any number.
    normalize : bool
        Scale the weights of each vertex to the sum 1; groups that are locked count and stay.
    smallest_weight : float
        In [0, 1): vertices of a smaller weight are no members of a group.
    source_mask, target_mask : Mask
        Which of the source gives, which of the target receives.
    unmatched : str
        What vertices get that correspond to nothing with certainty: "carry" through the map all the same, "leave" what
        they have, the value of the "nearest" vertex that does, or a smooth "fill" between those.
    keys_by : str
        How shape keys get the target's directions and proportions, see `Carrier.keys_by`.
    contacts : bool
        Bring together what shape keys bring together on the source, see `Carrier.contacts`.
    rig : bool
        Carry the armature that moves the source too, fitted to the target; see `rig.RigReading`.
    spelling : str
        How carried expressions are called, see `expression_names.Spelling`.
    halves : bool
        Carry expressions that are one for both sides as two, see `key_sides.with_halves`; never join two.
    symmetric : bool
        Make carried shape keys symmetric that nearly are, see `key_sides.symmetric`.
    evaluated : bool
        Read the source as its modifiers and shape keys show it.
    collisions : str
        Whether a layer whose name is taken by another of the person's own will "replace" that one or get Blender's
        "number"; what an earlier transfer wrote and nobody has edited is always replaced. Where `mix` or `target_mask`
        say how values join those that are there, they join them.
    textures : TextureSettings
        Choices about pictures.

    Raises
    ------
    ValueError
        A number or word is outside its range.
    """

    kinds: tuple[str, ...] = tuple(kind.identifier for kind in KINDS if kind.standard)
    layers: Literal["all", "active", "named"] = "all"
    names: tuple[str, ...] = ()
    deform_only: bool = False
    mix: Literal["replace", "add", "subtract", "multiply"] = "replace"
    mix_factor: float = 1.0
    limit: int = 0
    normalize: bool = False
    smallest_weight: float = 1e-4
    source_mask: Mask = field(default_factory=Mask)
    target_mask: Mask = field(default_factory=Mask)
    unmatched: Outcome = "carry"
    keys_by: Literal["gradients", "frames"] = "gradients"
    contacts: bool = True
    rig: bool = False
    spelling: Spelling = "keep"
    halves: bool = False
    symmetric: bool = False
    evaluated: bool = False
    collisions: Literal["replace", "number"] = "number"
    textures: TextureSettings = field(default_factory=TextureSettings)

    def __post_init__(self) -> None:
        if not 0 <= self.mix_factor <= 1:
            raise ValueError("the mix factor lies from 0 to 1")
        if not 0 <= self.smallest_weight < 1:
            raise ValueError("the smallest weight lies from 0 to below 1")
        if self.limit < 0:
            raise ValueError("the limit of groups per vertex is 0 (none) or more")

    def names_layer(self, name: str) -> bool:
        """Return whether a name is among `names`."""
        return any(fnmatchcase(name, pattern) for pattern in self.names)


def split_names(text: str) -> tuple[str, ...]:
    """Return names that a person wrote with commas between.

    >>> split_names("Jaw, Eye.*")
    ('Jaw', 'Eye.*')
    """
    return tuple(name for part in text.split(",") if (name := part.strip()))
