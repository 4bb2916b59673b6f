"""What a mesh is and what will be done about it, in one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .cleaning import LEFT_OUT, cleaned
from .mesh import Floats, Integers, TriangleMesh, plural
from .necks import necks
from .tidy import Cleaned
from .topology import Topology, require_disc, topology


@dataclass(frozen=True, eq=False)
class Verdict:
    """A mesh that can be used.

    Attributes
    ----------
    tidy : Cleaned
        The mesh in order.
    topology : Topology
        Of that.
    hanging : tuple of float
        Of a closed surface the shares of the pieces that hang on it by a neck, of which one is cut out to be matched.
    """

    tidy: Cleaned
    topology: Topology
    hanging: tuple[float, ...] = ()

    @property
    def repairs(self) -> tuple[str, ...]:
        """What will be done for the computation, each as the rest of a sentence."""
        changes = [
            said.removesuffix("left out") + "aligned beside it" if said.endswith(LEFT_OUT) else said
            for said in self.tidy.changes
        ]
        if self.hanging:
            return (*changes, self._cutting())
        loops = list(self.topology.boundary_loops)
        if loops:
            del loops[int(np.argmax(self.topology.loop_lengths))]
        closed = closing(loops)
        return (*changes, closed) if closed else tuple(changes)

    def describe(self) -> str:
        """Return one line that says what the mesh is and what will be done about it."""
        found = self.topology
        if found.is_sphere:
            text = f"closed, {found.vertices:,} vertices: goes to the sphere, beside another closed one"
        elif self.hanging:
            text = f"closed, {found.vertices:,} vertices"
        else:
            rim = found.boundary_loops[int(np.argmax(found.loop_lengths))]
            text = f"disc, {found.vertices:,} vertices, boundary of {len(rim):,} edges"
        used = np.zeros(self.tidy.size, bool)
        used[self.tidy.original_faces] = True
        if n := int((~used).sum()):
            text += f", {plural(n, 'loose vertex')}"
        if n := len(found.zero_area_faces):
            text += f", {plural(n, 'face')} without area"
        return f"{text}; for the computation: {', '.join(self.repairs)}" if self.repairs else text

    def _cutting(self) -> str:
        """Say what will be cut out."""
        shares = ", ".join(f"{share:.1%}" for share in self.hanging[:6]) + (", ..." if len(self.hanging) > 6 else "")
        pieces = plural(len(self.hanging), "piece")
        beside = "beside an open surface " if self.topology.is_sphere else ""
        return (
            f"{beside}cut to what fits the other surface, of {pieces} that hang on it by a neck ({shares} of its area)"
        )


def verdict(
    mesh: TriangleMesh, *, largest_part: bool = True, fill_holes: bool = True, keys: Floats | None = None
) -> Verdict:
    """Return what a mesh is when it is put in order as asked; see `cleaned`.

    Raises
    ------
    MeshError
        It cannot be made a disc and is no sphere; the text says why and what to do.
    """
    tidy = cleaned(mesh, largest_part=largest_part, fill_holes=fill_holes, keys=keys)
    found = topology(tidy.mesh)
    if found.is_closed and (hanging := necks(tidy.mesh)):
        return Verdict(tidy, found, tuple(neck.share for neck in hanging))
    return Verdict(tidy, found if found.is_sphere else require_disc(tidy.mesh, fill_holes=fill_holes))


def closing(openings: Sequence[Integers]) -> str:
    """Say that these boundary loops will be closed; nothing if there is none."""
    if not openings:
        return ""
    edges = ", ".join(f"{len(loop):,}" for loop in openings[:6]) + (", ..." if len(openings) > 6 else "")
    return f"{plural(len(openings), 'opening')} ({edges} edges) closed"
