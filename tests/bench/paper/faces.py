"""Section 5.4: faces of several people and expressions, 13 landmarks, mid-edge maps, curvature extrema as samples."""

import json
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay

from solver import TriangleMesh, flatten
from solver.surface.descriptors import diffused_curvatures
from solver.surface.sampling import extrema, farthest_points

from .data import DATA, absent, read
from .surfaces import Pair, Side, moved
from .surfaces import run as run_pairs

ICT = (("M_neutral", "M_happy_level4"), ("M_sad_level2", "M_happy_level1"), ("F_neutral", "M_neutral"))
SIMPOP = (("01", "02"), ("10", "15"), ("20", "30"))
SAMPLES = 200
KEPT = 0.7
NOTE = (
    "ICT faces (one face with expressions, and a second person) and SIMPOP faces (different people), mid-edge maps.\n"
    f"The source keeps {100 * KEPT:.0f} % of its vertices, triangulated anew. Samples: the 25 strongest extrema of\n"
    "the diffused mean curvature, then farthest points. 13 landmarks: the data set's (ICT), farthest points (SIMPOP).\n"
    "The source's disc goes through a random Möbius transformation, |z| <= 0.7."
)


def side(mesh: TriangleMesh, landmarks: np.ndarray) -> Side:
    """Flatten and sample a face."""
    flat = flatten(mesh, "mid-edge")
    inside = np.isfinite(flat.disc.real) & (np.abs(flat.disc) < 1 - 1e-6)
    inside[flat.boundary] = False
    curvature = diffused_curvatures(mesh)[:, 1]
    strongest = extrema(mesh, curvature, inside)[: SAMPLES // 8]
    return Side(mesh, flat.disc, farthest_points(mesh, SAMPLES, strongest, inside), landmarks)


def thinned(mesh: TriangleMesh, landmarks: np.ndarray, seed: int) -> tuple[TriangleMesh, np.ndarray]:
    """Return a mesh of `KEPT` of the vertices, triangulated anew in the disc, and its landmarks.

    Two faces of one data set share a triangulation, which flatters every method.
    """
    rng = np.random.default_rng(seed)
    flat = flatten(mesh)
    free = np.setdiff1d(np.flatnonzero(np.isfinite(flat.disc.real)), np.concatenate([flat.boundary, landmarks]))
    kept = np.concatenate([landmarks, flat.boundary[::2], rng.permutation(free)[: round(KEPT * len(free))]])
    disc = flat.disc[kept]
    faces = Delaunay(np.column_stack([disc.real, disc.imag])).simplices.astype(int)
    a, b, c = disc[faces].T
    turned = np.imag(np.conj(b - a) * (c - a))
    faces = np.where((turned < 0)[:, None], faces[:, ::-1], faces)[np.abs(turned) > 1e-9]
    return TriangleMesh(mesh.vertices[kept], faces, mesh.name), np.arange(len(landmarks))


def run(folder: Path, sizes: list[int], jobs: int) -> None:
    """Write the experiment's tables and figures, or say why it cannot run."""
    pairs = []
    if reason := absent("faces_ict/ict_ground_truth.json"):
        print(f"ICT faces skipped: {reason}")
    else:
        facts = json.loads((DATA / "faces_ict/ict_ground_truth.json").read_text(encoding="utf-8"))
        named = np.array(facts["eval13"])
        for a, b in ICT:
            source = thinned(read(f"faces_ict/ict_{a}.obj"), named, len(pairs))
            target = read(f"faces_ict/ict_{b}.obj"), named
            pairs.append(Pair(f"{a}-{b}", moved(side(*source), len(pairs)), side(*target)))
    if reason := absent("faces_simpop/SIMPOP_01.obj"):
        print(f"SIMPOP faces skipped: {reason}")
    else:
        for a, b in SIMPOP:
            whole = read(f"faces_simpop/SIMPOP_{a}.obj")
            spread = farthest_points(whole, 13, np.empty(0, np.intp), _away_from_rim(whole))
            source = thinned(whole, spread, len(pairs))
            target = read(f"faces_simpop/SIMPOP_{b}.obj"), spread
            pairs.append(Pair(f"SIMPOP {a}-{b}", moved(side(*source), len(pairs)), side(*target)))
    if pairs:
        run_pairs("faces", pairs, NOTE, folder, sizes, jobs)


def _away_from_rim(mesh: TriangleMesh) -> np.ndarray:
    """Return which vertices, (n,), lie in the inner part of the disc."""
    return np.abs(flatten(mesh).disc) < 0.9
