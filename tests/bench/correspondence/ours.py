"""What this project finds, after each stage, and what its parts would find by other objectives."""

import json
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import KDTree

from solver import Alignment, AlignSettings, Mobius, align, correspond, search
from solver.align.surfaces.objective import source_points
from solver.flatten.locate import TriangulatedDisc
from solver.search.fit import algebraic_fit, fitted
from solver.surface.barycentric import interpolated
from solver.surface.descriptors import diffused_curvatures
from solver.surface.statistics import standardised

from .pairs import Pair, nearest
from .score import Map
from .store import Store, code, digest

STAGES = ("none", "mobius", "dense")


def stages(pair: Pair, wanted: list[str], store: Store) -> dict[str, Map]:
    """Return the maps after the wanted stages of `align`, with its default settings."""
    if not any(name in wanted for name in STAGES):
        return {}
    # the dense stage is the slow one: without it the others are found without it, and do not change with its code
    refine, left_out = (
        ("dense", ())
        if "dense" in wanted
        else (
            "mobius",
            ("bend", "plate", "pose", "rotations", "unfold", "nearest", "overlap", "pieces", "dense", "reconsider"),
        )
    )
    key = f"{pair.kind} {refine} {pair.digest} {code('report', 'baselines', *left_out)}"
    kept = store.kept(key, lambda: _aligned(pair, refine))
    return {name: _unpacked(kept, name) for name in STAGES if name in wanted}


def _aligned(pair: Pair, refine: str) -> dict[str, np.ndarray]:
    found = align(pair.source, pair.target, AlignSettings(refine=refine, fill_holes=pair.openings))
    bending = found.bending if found.overlap is None else found.overlap.alignment.bending
    facts = {
        "seconds": found.seconds,
        "value": found.search.value,
        "samples": len(found.source_samples),
        "certified": found.search.certified,
        "nodes": found.search.nodes,
        "reflected": found.mobius.reflected,
        "margin": found.margin,
        "rival_margin": found.rival_margin,
        "warnings": list(found.warnings),
        "z": [found.mobius.z.real, found.mobius.z.imag],
        "theta": found.mobius.theta,
        "unfolded": 0.0 if bending is None else bending.repaired / len(pair.target.vertices),
        "overlap": None if found.overlap is None else found.overlap.target_share,
    }
    whole = replace(found, bending=None, overlap=None, counterpart=None)
    result = _packed("none", replace(whole, mobius=found.search.mobius), facts) | _packed("mobius", whole, facts)
    return result | _packed("dense", found, facts) if refine == "dense" else result


def _packed(name: str, alignment: Alignment, facts: dict) -> dict[str, np.ndarray]:
    found = correspond(alignment)
    return {
        f"{name}_face": found.face,
        f"{name}_barycentric": found.barycentric,
        f"{name}_confidence": found.confidence,
        f"{name}_facts": np.array(json.dumps(facts)),
    }


def _unpacked(kept: dict[str, np.ndarray], name: str) -> Map:
    face, barycentric, confidence = (kept[f"{name}_{part}"] for part in ("face", "barycentric", "confidence"))
    return Map(face, barycentric, confidence, json.loads(str(kept[f"{name}_facts"])))


def through(pair: Pair, mobius: Mobius, **facts: object) -> Map:
    """Return the map that a transformation from the source's disc to the target's makes."""
    source, target = pair.flat
    face, barycentric = TriangulatedDisc.of(source.disc, source.mesh.faces).locate(mobius.inverse()(target.disc))
    return Map(face, barycentric, None, dict(facts))


def best_mobius(pair: Pair, store: Store) -> Map:
    """Return the map of the Möbius transformation with the least mean error: fitted to the truth, the stage's floor."""
    source, target = pair.flat
    known = pair.known
    some = np.linspace(0, len(known.face) - 1, min(len(known.face), 2000)).astype(int)
    places = replace(known, face=known.face[some], barycentric=known.barycentric[some], truth=known.truth[some])
    there = places.carried(pair.target, target.disc)
    normals = _normals_at(pair, places.truth)
    face, weights = nearest(pair.onto, places.truth, normals)
    here = (weights * source.disc[source.mesh.faces[face]]).sum(axis=1)
    here = np.conj(here) if pair.reflected else here
    disc = TriangulatedDisc.of(source.disc, source.mesh.faces)

    def error(x: np.ndarray) -> float:
        back = _mobius(x).inverse()(there)
        face, weights = disc.locate(np.conj(back) if pair.reflected else back)
        position = interpolated(pair.source.vertices, pair.source.faces[face], weights)
        return float(np.linalg.norm(position - places.truth, axis=1).mean()) / pair.source.diagonal

    def made() -> dict[str, np.ndarray]:
        even = np.ones(len(here))
        start = fitted(
            here,
            there,
            even,
            algebraic_fit(here, there, even),
            metric="hyperbolic",
            z_max=0.999,
            loss="soft_l1",
            scale=0.1,
        )
        x = np.array([start.z.real, start.z.imag, start.theta])
        return {"x": minimize(error, x, method="Nelder-Mead", options={"xatol": 1e-4, "fatol": 1e-6}).x}

    x = store.kept(f"{pair.kind} best-mobius {digest(here, there, places.truth, disc.points)}", made)["x"]
    return through(pair, replace(_mobius(x), reflected=pair.reflected))


def _mobius(x: np.ndarray) -> Mobius:
    z = complex(x[0], x[1])
    return Mobius(z * min(1, 0.999 / max(abs(z), 1e-12)), float(x[2]))


def _normals_at(pair: Pair, points: np.ndarray) -> np.ndarray:
    """Return the source's normals at points on it, (q, 3)."""
    return pair.source.vertex_normals()[KDTree(pair.source.vertices).query(points)[1]]


PAPER_SAMPLES, PAPER_RADIUS = 100, 0.04
"""The paper uses some hundred points and leaves its radius open; 0.04 is about their spacing's half."""


def paper(pair: Pair, store: Store) -> Map:
    """Return the map of the paper's objective, eq. 3: how many points come near any point, nothing else.

    The points are those that ours are chosen as, 100 on each side; the orientation is given.
    """
    source, target = pair.flat
    x, y = (
        flat.disc[
            source_points(flat, standardised(diffused_curvatures(flat.mesh), flat.mesh.vertex_areas), PAPER_SAMPLES)
        ]
        for flat in (source, target)
    )
    x = np.conj(x) if pair.reflected else x

    def made() -> dict[str, np.ndarray]:
        found = search(x, y, PAPER_RADIUS, metric="euclidean", z_max=0.9999, time_limit=30.0, threads=1)
        return {
            "x": np.array([found.mobius.z.real, found.mobius.z.imag, found.mobius.theta]),
            "value": np.array([found.value, found.certified, found.seconds]),
        }

    kept = store.kept(f"{pair.kind} paper {digest(x, y, PAPER_RADIUS)}", made)
    z, (value, certified, seconds) = complex(kept["x"][0], kept["x"][1]), kept["value"]
    mobius = Mobius(z, float(kept["x"][2]), pair.reflected)
    return through(pair, mobius, value=value, certified=bool(certified), seconds={"search": seconds})


def oracle_nearest(pair: Pair) -> Map:
    """Return the nearest point after the best similarity, fitted to the truth: the best case for Data Transfer."""
    known = pair.known
    here = known.carried(pair.target, pair.target.vertices)
    middle, other = here.mean(axis=0), known.truth.mean(axis=0)
    u, size, v = np.linalg.svd((here - middle).T @ (known.truth - other))
    sign = np.ones(3)
    sign[2] = np.linalg.det(u @ v) * (-1 if pair.reflected else 1)
    turn = (u * sign) @ v
    scale = (size * sign).sum() / ((here - middle) ** 2).sum()
    normals = pair.target.vertex_normals() @ turn
    face, barycentric = nearest(pair.onto, scale * (pair.target.vertices - middle) @ turn + other, normals)
    return Map(face, barycentric, None, {})
