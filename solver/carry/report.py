"""What a finished alignment says about itself, as plain data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from ..align.judgement import judge
from ..align.result.alignment import Alignment
from ..align.result.confidence import expected_error
from ..align.result.whole import Whole
from ..mobius import as_plain
from ..search.outcome import SphereSearchResult
from ..surface.mesh import Booleans
from ..surface.parts import Parts
from ..surface.tidy import Cleaned
from .correspond import Correspondence


def report(alignment: Alignment, correspondence: Correspondence) -> dict[str, Any]:
    """Return the figures of an alignment as JSON-ready data: what was matched, what is proved, how long it took.

    `coverage` is the share of the target's area whose vertices are matched, `cut_to` the shares that were aligned of
    surfaces of which a piece was cut out. `value` to `rival` are about the whole discs, `overlap` about the parts that
    both surfaces show, where these are less; `rival_margin` is the latter's then.
    `verdict` is "good", "check" or "doubtful" and why (`align.judgement`); `expected_error` the mean error to be
    expected where the target is matched, as a share of the source's diagonal; null if nothing is.
    `parts` has a row for each part of the meshes, if there are several: what it is on either side (null: no
    counterpart), how certain the pair is, and how far apart they remain, in diagonals of the source.
    """
    found, parts = alignment.search, alignment.overlap
    tidy = alignment.target_cleaned
    areas = alignment.target.mesh.vertex_areas if tidy is None else tidy.area_at_vertices()
    if alignment.whole is not None:
        areas = alignment.whole.target.mesh.vertex_areas
    decisive = alignment if parts is None else parts.alignment
    judgement, matched = judge(alignment), areas * correspondence.matched
    return {
        "source": alignment.source.mesh.name,
        "target": alignment.target.mesh.name,
        "verdict": judgement.level,
        "concerns": [{"kind": one.kind, "text": one.text} for one in judgement.concerns],
        "notes": list(judgement.notes),
        "expected_error": float(matched @ np.where(matched > 0, expected_error(correspondence.confidence), 0))
        / float(matched.sum())
        if matched.any()
        else None,
        "value": alignment.value,
        "upper_bound": found.upper_bound,
        "gap": found.upper_bound - alignment.value,
        "certified": alignment.certified,
        "rival_taken": alignment.taken is not None,
        "certified_for": f"|h| <= {found.h_max:.4f}"
        if isinstance(found, SphereSearchResult)
        else f"|z| <= {alignment.settings.z_max:.4f}",
        **(
            {
                "proved": found.proved,
                "rotation": {
                    "value": found.rotation_value,
                    "upper_bound": found.rotation_bound,
                    "certified": found.rotations_certified,
                },
            }
            if isinstance(found, SphereSearchResult)
            else {}
        ),
        "samples": len(alignment.source_samples),
        "targets": len(alignment.target_samples),
        "matches": len(alignment.matches),
        "nodes": found.nodes,
        "mobius": as_plain(alignment.mobius),
        "orientation_margin": alignment.margin,
        "rival": None
        if alignment.rival is None
        else {"value": alignment.rival.value, "mobius": as_plain(alignment.rival.mobius)},
        "rival_margin": decisive.rival_margin,
        "cut_to": {"source": _share(alignment.source_cleaned), "target": _share(tidy)},
        "overlap": None
        if parts is None
        else {
            "source_share": parts.source_share,
            "target_share": parts.target_share,
            "value": decisive.value,
            "upper_bound": decisive.search.upper_bound,
            "certified": decisive.certified,
            "samples": len(decisive.source_samples),
            "matches": len(decisive.matches),
        },
        "parts": _parts(alignment.whole, correspondence),
        "vertices_unfolded": None if decisive.bending is None else decisive.bending.repaired,
        "coverage": float(areas[correspondence.matched].sum() / areas.sum())
        * (1.0 if alignment.whole else _share(tidy)),
        "mean_confidence": float(areas @ correspondence.confidence / areas.sum()),
        "distortion": {"source": asdict(alignment.source.distortion), "target": asdict(alignment.target.distortion)},
        "flips_repaired": {"source": alignment.source.flips_repaired, "target": alignment.target.flips_repaired},
        "seconds": dict(alignment.seconds),
        "settings": asdict(alignment.settings),
        "warnings": list(alignment.warnings),
        "causes": list(alignment.causes),
    }


def _parts(whole: Whole | None, correspondence: Correspondence) -> list[dict[str, Any]] | None:
    if whole is None:
        return None
    return [
        {
            "source": _part(whole.source, pair.source),
            "target": _part(whole.target, pair.target),
            "certainty": pair.certainty,
            "offset": pair.offset,
            "matched": None if pair.target is None else _matched(correspondence, whole.target.of_vertex == pair.target),
        }
        for pair in whole.pairs
    ]


def _matched(correspondence: Correspondence, of_part: Booleans) -> float:
    """Return which share of a part's vertices is matched; 0 where all of them count as another part's."""
    return float(correspondence.matched[of_part].sum() / max(int(of_part.sum()), 1))


def _part(parts: Parts, number: int | None) -> dict[str, Any] | None:
    """Return which part it is, one of its vertices, how many it has, and its share of the area."""
    if number is None:
        return None
    own = np.flatnonzero(parts.of_vertex == number)
    return {
        "part": number,
        "vertex": int(own[0]) if len(own) else None,
        "vertices": len(own),
        "area": float(parts.area[number] / parts.area.sum()),
    }


def _share(tidy: Cleaned | None) -> float:
    """Return the share of the whole that was aligned, where that is a piece that was cut out."""
    return 1.0 if tidy is None else tidy.share
