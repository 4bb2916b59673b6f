"""What a finished alignment says about itself, as plain data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from .align import Alignment
from .correspond import Correspondence


def report(alignment: Alignment, correspondence: Correspondence) -> dict[str, Any]:
    """Return the figures of an alignment as JSON-ready data: what was matched, what is proved, how long it took.

    `coverage` is the share of the target's area whose vertices are matched.
    """
    found, areas = alignment.search, alignment.target.mesh.vertex_areas
    return {
        "source": alignment.source.mesh.name,
        "target": alignment.target.mesh.name,
        "value": found.value,
        "upper_bound": found.upper_bound,
        "gap": found.gap,
        "certified": found.certified,
        "certified_for": f"|z| <= {alignment.settings.z_max:.4f}",
        "samples": len(alignment.source_samples),
        "targets": len(alignment.target_samples),
        "matches": len(found.matches),
        "nodes": found.nodes,
        "mobius": {
            "z": [alignment.mobius.z.real, alignment.mobius.z.imag],
            "theta": alignment.mobius.theta,
            "reflected": alignment.mobius.reflected,
        },
        "orientation_margin": alignment.margin,
        "coverage": float(areas[correspondence.matched].sum() / areas.sum()),
        "mean_confidence": float(areas @ correspondence.confidence / areas.sum()),
        "distortion": {"source": asdict(alignment.source.distortion), "target": asdict(alignment.target.distortion)},
        "seconds": dict(alignment.seconds),
        "settings": asdict(alignment.settings),
        "warnings": list(alignment.warnings),
    }
