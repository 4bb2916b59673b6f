"""Section 5.3: molars, with the maps, sample points and landmarks of Boyer et al. (2011), on which the paper builds."""

import json
from pathlib import Path

import numpy as np

from .data import DATA, absent, read
from .surfaces import Pair, Side, centred, moved
from .surfaces import run as run_pairs

PAIRS = (("K04", "K05"), ("i14", "i15"), ("H10", "H19"), ("P31", "P35"), ("x07", "x17"), ("U02", "U08"), ("x02", "x17"))
NOTE = (
    "Second lower molars of Boyer et al. (2011): their mid-edge maps, their sample points (extrema of the Gauss\n"
    "curvature, then farthest points), their 18 landmarks. Where two differ in handedness the source is mirrored.\n"
    "The target's disc is centred, the source's then goes through a random Möbius transformation, |z| <= 0.7."
)


def side(name: str, mirrored: bool) -> Side:
    """Read a tooth as its authors flattened and sampled it."""
    facts = json.loads((DATA / "teeth/landmarks.json").read_text(encoding="utf-8"))[name]
    mesh = read(f"teeth/{name}.obj")
    x, y = np.load(DATA / f"teeth/{name}_disc.npy").reshape(len(mesh.vertices), 2).T
    disc = x + 1j * y
    disc = centred(disc / np.maximum(1, np.abs(disc)), mesh)
    samples = np.array(facts["sample_vertex"])
    samples = samples[np.abs(disc[samples]) < 1 - 1e-6]
    return Side(mesh, np.conj(disc) if mirrored else disc, samples, np.array(facts["landmark_vertex"]))


def run(folder: Path, sizes: list[int], jobs: int) -> None:
    """Write the experiment's tables and figures, or say why it cannot run."""
    if reason := absent("teeth/landmarks.json"):
        print(f"Skipped: {reason}")
        return
    hands = {
        name: facts["handedness"]
        for name, facts in json.loads((DATA / "teeth/landmarks.json").read_text(encoding="utf-8")).items()
    }
    pairs = [
        Pair(f"{a}-{b}", moved(side(a, hands[a] != hands[b]), k), side(b, False)) for k, (a, b) in enumerate(PAIRS)
    ]
    run_pairs("teeth", pairs, NOTE, folder, sizes, jobs)
