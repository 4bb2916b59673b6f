"""Why a map is doubtful, where that can be found, and what to do about it."""

from __future__ import annotations

from .cut.cutting import MUCH, shrunk
from .doubt.reconsider import UNLIKE
from .result.alignment import Alignment
from .result.confidence import FITTED
from .surfaces.prepared import LITTLE, Surface
from .surfaces.remark import Kind, Remark

FEW = FITTED // 2
"""Source points below which a surface is called too coarse: of 8 sheets with 30 vertices inside 3 were claimed where
most of it was wrong, of 8 with 60 none."""

CROPPED = 0.3
"""Share of either surface without a counterpart from which on the map may well be wrong: up to 30 % cut from one scan
all maps come out right, with 30 % cut from both 2 of 40 do not."""

MENDED: dict[str, tuple[Kind, str]] = {
    "edge joined along which": ("slit", "is cut open along edges: see whether they belong together and merge them"),
    "edges joined along which": ("slit", "is cut open along edges: see whether they belong together and merge them"),
    "far off the surface put back": ("spike", "has vertices far off the surface: smooth or delete them"),
    "cut through": ("handle", "has handles, as a cup has: cut through them and fill"),
}
"""What `surface.cleaned` says it has done, what kind of cause that is, and how it is told."""


def coarse(found: Alignment) -> Remark | None:
    """Return that the source is too coarse, if it is."""
    count = len(found.source_samples)
    if count >= min(FEW, found.settings.samples):
        return None
    name = found.source.mesh.name
    return Remark("coarse", f"'{name}' is coarse, with {count} vertices inside to tell its shape: subdivide it")


def deep(surface: Surface) -> Remark | None:
    """Return that much of a surface shrinks to nothing in its disc or on its sphere, if it does."""
    share = shrunk(surface.flattening)
    if share <= MUCH:
        return None
    where = "on a sphere" if surface.flattening.domain.closed else "in a disc"
    said = f"'{surface.original.name}' is deep, {share:.0%} of it has hardly any room {where}"
    return Remark("deep", f"{said}: cut out what is to be matched")


def causes(found: Alignment, source: Surface, target: Surface) -> tuple[Remark, ...]:
    """Return what may be the reason that a map is doubtful, the likeliest first; nothing where none is known.

    Each says after a colon what to do about it.
    """
    result: list[Remark] = []
    if (cause := coarse(found)) is not None:
        result.append(cause)
    for surface in (source, target):
        result += _of_surface(surface)
    if found.settings.reflect != "auto":
        way = "mirrored" if found.settings.reflect == "never" else "not mirrored"
        result.append(Remark("one way", f"only one orientation was searched: try {way} too"))
    if found.counterpart is not None:
        missing = 1 - float(found.target.mesh.vertex_areas @ found.counterpart) / found.target.mesh.area
        if found.overlap is not None:
            missing = max(missing, 1 - found.overlap.source_share)
        if missing > CROPPED:
            text = (
                f"the surfaces have little in common, {missing:.0%} of one is missing on the other: crop both to that"
            )
            result.append(Remark("cropped", text))
    if (apart := difference(found)) > UNLIKE:
        text = f"curvatures differ by {apart:.1f} of their spread where the map is best: are these two of one kind?"
        result.append(Remark("unlike", text))
    return tuple(result)


def difference(found: Alignment) -> float:
    """Return by how much descriptors differ on average between points that the map brings together, in their spread."""
    inner = found if found.overlap is None else found.overlap.alignment
    used = inner.target.mesh.used
    areas = inner.target.mesh.vertex_areas[used]
    return float(inner.evidence[:, 1] @ areas / areas.sum())


def _of_surface(surface: Surface) -> list[Remark]:
    name, result = surface.original.name, list[Remark]()
    if any(said.startswith("coordinates in steps") for said in surface.cleaned.changes):
        text = f"'{name}' has coordinates too coarse for its details: move it to the origin before it is exported"
        result.append(Remark("steps", text))
    for done, (kind, text) in MENDED.items():
        if any(done in said for said in surface.cleaned.changes):
            result.append(Remark(kind, f"'{name}' {text}"))
    if surface.flattening.rim_lost > LITTLE:
        result.append(Remark("narrow", f"'{name}' is long and narrow: cut it into shorter pieces"))
    elif (cause := deep(surface)) is not None:
        result.append(cause)
    if surface.mesh is not surface.cleaned.mesh:
        result.append(Remark("rough", f"'{name}' is rough or noisy: smooth or remesh it"))
    return result
