"""What keeps expressions carried between families from those of the target's own artist: the map, or the artists.

Of each key the cosine to the target's own on the skin, after a fit to that very answer: a turn of each vertex, one for
all keys; each vertex turned as it likes in each key; each key a mix of all that were carried. What is missing then no
method finds that has no look at the answer. The map is judged by lips and lids alone, which meet in an open jaw that
closes and in a blink: found in the source's own keys, and in the target's own, and compared through the map.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial import KDTree

from solver.carry.contacts import find_contacts
from solver.carry.frames import nearest_orthogonal

from .measures import likeness, meeting_lips

Keys = Mapping[str, np.ndarray]
LINES = ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight")


def fitted(wanted: np.ndarray, got: np.ndarray) -> dict[str, float]:
    """Return the median cosine of keys, (k, n, 3) each, to those wanted, as they are and fitted to them."""
    turn = nearest_orthogonal(np.einsum("knd,kne->nde", wanted, got))
    sizes = [np.linalg.norm(values, axis=2) for values in (wanted, got)]
    columns = [values.reshape(len(values), -1).T for values in (wanted, got)]
    mixed = (columns[1] @ np.linalg.lstsq(columns[1], columns[0], rcond=None)[0]).T.reshape(wanted.shape)
    ways = {
        "as carried": [likeness(a, b) for a, b in zip(wanted, got, strict=True)],
        "vertices turned, alike in all keys": [
            likeness(a, np.einsum("nij,nj->ni", turn, b)) for a, b in zip(wanted, got, strict=True)
        ],
        "vertices turned, in each key": [likeness(a[:, None], b[:, None]) for a, b in zip(*sizes, strict=True)],
        "mixed of all keys": [likeness(a, b) for a, b in zip(wanted, mixed, strict=True)],
    }
    return {way: float(np.nanmedian(values)) for way, values in ways.items()}


def lines(places: np.ndarray, faces: np.ndarray, keys: Keys) -> dict[str, np.ndarray]:
    """Return the vertices of lips and lids, by the key that tells them: those that meet in it."""
    found = {name: find_contacts(places, keys[name], faces) for name in LINES[1:]}
    found[LINES[0]] = meeting_lips(places, keys[LINES[0]], faces)
    return {name: np.unique(contacts.vertex) for name, contacts in found.items() if len(contacts.vertex)}


def apart(source: np.ndarray, own: Mapping[str, np.ndarray], there: np.ndarray, met: Mapping[str, np.ndarray]) -> str:
    """Return how far lips and lids of the target, at `there` on the source, (n, 3), are from the source's.

    Parameters
    ----------
    source : (n_source, 3) float64
    own : dict of str to (k,) int
        The source's, as `lines` finds them.
    there : (n, 3) float64
    met : dict of str to (q,) int
        The target's.
    """
    eyes = [source[own[name]].mean(axis=0) for name in LINES[1:] if name in own]
    if len(eyes) < 2:
        return "no lids meet"
    unit = float(np.linalg.norm(eyes[0] - eyes[1]))
    rows = {name: KDTree(source[own[name]]).query(there[met[name]])[0] / unit for name in own if name in met}
    return ", ".join(f"{k} {np.median(far):.1%} (nine of ten {np.quantile(far, 0.9):.1%})" for k, far in rows.items())
