"""How good a map from the target's vertices to points of the source is."""

from dataclasses import dataclass

import numpy as np

from solver.flatten.distortion import signed_areas
from solver.surface.barycentric import interpolated

from .pairs import Pair, Places


@dataclass(frozen=True, eq=False)
class Map:
    """Where each target vertex goes on the source.

    Attributes
    ----------
    face : (n,) int
    barycentric : (n, 3) float64
    confidence : (n,) float64 or None
        In [0, 1], if the method says.
    facts : dict
        What else the method says: seconds, certified, warnings, ...
    """

    face: np.ndarray
    barycentric: np.ndarray
    confidence: np.ndarray | None
    facts: dict

    def at(self, pair: Pair, values: np.ndarray) -> np.ndarray:
        """Return values at the source's vertices, (n_source, ...), carried to the target's."""
        return interpolated(values, pair.source.faces[self.face], self.barycentric)


@dataclass(frozen=True)
class Score:
    """Errors in % of the source's bounding box diagonal, the side on which they are distances.

    Attributes
    ----------
    mean, p95 : float
        Over points inside triangles, evenly spread over the target's area; over landmarks where no more is known.
    marks : int or None
        Landmark pairs that are mutually nearest.
    of : int or None
        Landmark pairs.
    folded : float
        Triangles of the target that are turned over or collapsed in the source's disc, in % of all, among those whose
        corners all have a counterpart (a confidence above 0; all, if the method has none). One that comes to lie with
        all corners on the source's edge has no area however good the map: it does not count, unless turned over.
    left_out : float
        Triangles of the target of which a corner has no counterpart, in %: they may lie on the source's edge.
    doubted : float or None
        Points that have a counterpart and a confidence below 1/2, in %; None if the method has no confidence.
    overlooked : float or None
        Points that have no counterpart and a confidence of 1/2 or more, in %; None if all have one.
    """

    mean: float
    p95: float
    marks: int | None
    of: int | None
    folded: float
    left_out: float
    doubted: float | None
    overlooked: float | None


def errors(pair: Pair, found: Map, places: Places) -> np.ndarray:
    """Return the errors at given places, (q,), in % of the source's diagonal."""
    position = places.carried(pair.target, found.at(pair, pair.source.vertices))
    return 100 * np.linalg.norm(position - places.truth, axis=1) / pair.source.diagonal


def score(pair: Pair, found: Map) -> Score:
    """Measure a map."""
    error = errors(pair, found, pair.known)
    marks = None if pair.landmarks is None else mutually_nearest(pair, found, pair.landmarks)
    source, faces = pair.flat[0], pair.target.faces
    areas = signed_areas(found.at(pair, source.disc), faces) * (-1 if pair.reflected else 1)
    rim = np.zeros(len(source.disc), bool)
    rim[np.concatenate([source.boundary, *source.holes])] = True
    on_rim = (rim[source.mesh.faces[found.face]] | (found.barycentric < 1e-9)).all(axis=1)[faces].all(axis=1)
    left_out = np.zeros(len(faces), bool) if found.confidence is None else (found.confidence[faces] == 0).any(axis=1)
    folded = np.where(on_rim, areas < -1e-12, areas <= 0) & ~left_out
    return Score(
        float(error.mean()),
        float(np.quantile(error, 0.95)),
        marks,
        None if pair.landmarks is None else len(pair.landmarks.face),
        100 * float(folded.mean()),
        100 * float(left_out.mean()),
        None if found.confidence is None else 100 - _trusted(pair, found, pair.known),
        None if found.confidence is None or pair.beyond is None else _trusted(pair, found, pair.beyond),
    )


def _trusted(pair: Pair, found: Map, places: Places) -> float:
    """Return how many of the points, in %, have a confidence of 1/2 or more."""
    return 100 * float((places.carried(pair.target, found.confidence) >= 0.5).mean())


def mutually_nearest(pair: Pair, found: Map, landmarks: Places) -> int:
    """Return how many landmarks, carried over, and their true places are each other's nearest."""
    position = landmarks.carried(pair.target, found.at(pair, pair.source.vertices))
    distance = np.linalg.norm(position[:, None] - landmarks.truth, axis=2)
    own = np.arange(len(distance))
    return int(((distance.argmin(axis=0) == own) & (distance.argmin(axis=1) == own)).sum())
