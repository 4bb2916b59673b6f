"""What a finished alignment says about itself, as plain data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from .align import Alignment
from .correspond import Correspondence
from .mobius import Mobius


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
        "mobius": _plain(alignment.mobius),
        "orientation_margin": alignment.margin,
        "rival": None
        if alignment.rival is None
        else {"value": alignment.rival.value, "mobius": _plain(alignment.rival.mobius)},
        "rival_margin": alignment.rival_margin,
        "vertices_unfolded": None if alignment.bending is None else alignment.bending.repaired,
        "coverage": float(areas[correspondence.matched].sum() / areas.sum()),
        "mean_confidence": float(areas @ correspondence.confidence / areas.sum()),
        "distortion": {"source": asdict(alignment.source.distortion), "target": asdict(alignment.target.distortion)},
        "flips_repaired": {"source": alignment.source.flips_repaired, "target": alignment.target.flips_repaired},
        "seconds": dict(alignment.seconds),
        "settings": asdict(alignment.settings),
        "warnings": list(alignment.warnings),
    }


def _plain(mobius: Mobius) -> dict[str, Any]:
    return {"z": [mobius.z.real, mobius.z.imag], "theta": mobius.theta, "reflected": mobius.reflected}
