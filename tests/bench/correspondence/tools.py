"""What people use today, from PyPI: open3d's global pose, meshmonk's non-rigid registration, functional maps.

Each is given the true orientation: where it is reflected, the target is mirrored for it beforehand.
"""

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from solver import TriangleMesh

from .pairs import Pair, nearest
from .score import Map
from .store import Store, digest

SEED = 0
FACE_DIAGONAL = 300.0
"""Meshmonk's defaults are for faces in millimetres: sources are scaled to a face's diagonal."""


def absent(*modules: str) -> str:
    """Return why a tool cannot run; empty if it can."""
    for name in modules:
        try:
            importlib.import_module(name)
        except ImportError as reason:
            return f"{name} cannot be imported ({reason}): uv sync --group compare"
    return ""


@dataclass(frozen=True, eq=False)
class _Seen:
    """A pair as the tools are given it: about its middle, of a face's size, the target mirrored where it has to be."""

    pair: Pair
    source: TriangleMesh
    target: TriangleMesh

    def onto_source(self, moved: np.ndarray, seconds: float) -> Map:
        """Return the map to the nearest points of the source from the target's vertices, moved there, (n, 3)."""
        back = moved * (self.pair.source.diagonal / FACE_DIAGONAL) + self.pair.source.vertices.mean(axis=0)
        normals = TriangleMesh(moved, self.target.faces).vertex_normals()
        face, barycentric = nearest(self.pair.onto, back, normals)
        return Map(face, barycentric, None, {"seconds": {"tool": seconds}})


def _seen(pair: Pair) -> _Seen:
    size = FACE_DIAGONAL / pair.source.diagonal
    own = size * np.sqrt(pair.source.area / pair.target.area)
    mirror, order = ([-1, 1, 1], [0, 2, 1]) if pair.reflected else ([1, 1, 1], [0, 1, 2])
    here, there = (x - x.mean(axis=0) for x in (pair.source.vertices, pair.target.vertices))
    return _Seen(
        pair,
        TriangleMesh(here * size, pair.source.faces),
        TriangleMesh(there * own * mirror, pair.target.faces[:, order]),
    )


def _kept(pair: Pair, name: str, store: Store, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    return store.kept(f"{pair.kind} {name} {pair.digest} {digest(SEED, FACE_DIAGONAL)}", make)


def pose(pair: Pair, store: Store) -> Map:
    """Return the map to the nearest point after open3d's pose: FPFH, RANSAC and closest points, with scale."""
    seen, kept = _seen(pair), _pose(pair, store)
    return seen.onto_source(_moved(seen.target.vertices, kept["pose"]), float(kept["seconds"]))


def _moved(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _pose(pair: Pair, store: Store) -> dict[str, Any]:
    seen = _seen(pair)

    def made() -> dict[str, Any]:
        o3d = importlib.import_module("open3d")
        registration = o3d.pipelines.registration
        o3d.utility.random.seed(SEED)
        started = time.perf_counter()
        voxel = FACE_DIAGONAL / 50
        clouds, features = [], []
        for mesh in (seen.target, seen.source):
            cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(mesh.vertices))
            cloud.normals = o3d.utility.Vector3dVector(mesh.vertex_normals())
            cloud = cloud.voxel_down_sample(voxel)
            clouds.append(cloud)
            near = o3d.geometry.KDTreeSearchParamHybrid(radius=5 * voxel, max_nn=100)
            features.append(registration.compute_fpfh_feature(cloud, near))
        reach = 1.5 * voxel
        similar = registration.TransformationEstimationPointToPoint(True)
        found = registration.registration_ransac_based_on_feature_matching(
            *clouds,
            *features,
            True,
            reach,
            similar,
            3,
            [
                registration.CorrespondenceCheckerBasedOnEdgeLength(0.8),
                registration.CorrespondenceCheckerBasedOnDistance(reach),
            ],
            registration.RANSACConvergenceCriteria(400_000, 0.999),
        ).transformation
        whole = [
            o3d.geometry.PointCloud(o3d.utility.Vector3dVector(mesh.vertices)) for mesh in (seen.target, seen.source)
        ]
        limit = registration.ICPConvergenceCriteria(max_iteration=100)
        found = registration.registration_icp(*whole, 2 * voxel, found, similar, limit).transformation
        return {"pose": np.array(found), "seconds": time.perf_counter() - started}

    return _kept(pair, "pose", store, made)


def meshmonk(pair: Pair, store: Store) -> Map:
    """Return the map to the nearest point after open3d's pose and meshmonk's pyramid of non-rigid registrations."""
    seen = _seen(pair)
    matrix = _pose(pair, store)["pose"]
    posed = _moved(seen.target.vertices, matrix)

    def made() -> dict[str, Any]:
        monk = importlib.import_module("meshmonk")
        started = time.perf_counter()
        shapes = [
            (np.float32(x), np.int32(mesh.faces))
            for x, mesh in ((posed, seen.target), (seen.source.vertices, seen.source))
        ]
        floating, fixed = (monk.features_from_vertices(*shape) for shape in shapes)
        result = monk.pyramid_register(
            floating_features=floating,
            target_features=fixed,
            floating_faces=shapes[0][1],
            target_faces=shapes[1][1],
            floating_flags=np.ones(len(floating), np.float32),
            target_flags=np.ones(len(fixed), np.float32),
        )
        return {"vertices": np.float64(result.aligned_vertices), "seconds": time.perf_counter() - started}

    kept = _kept(pair, "meshmonk", store, made)
    return seen.onto_source(kept["vertices"], float(kept["seconds"]))


BASIS, FIRST = 200, 30
"""Eigenfunctions that ZoomOut ends and begins with."""


def zoomout(pair: Pair, store: Store) -> Map:
    """Return the precise map of functional maps (wave kernel signatures), refined by ZoomOut."""
    seen = _seen(pair)

    def made() -> dict[str, Any]:
        functional = importlib.import_module("pyFM.functional")
        mesh_class = importlib.import_module("pyFM.mesh").TriMesh
        started = time.perf_counter()
        model = functional.FunctionalMapping(
            mesh_class(seen.source.vertices, seen.source.faces, area_normalize=True),
            mesh_class(seen.target.vertices, seen.target.faces, area_normalize=True),
        )
        model.preprocess(n_descr=100, descr_type="WKS", k_process=BASIS)
        model.fit(K=(FIRST, FIRST))
        refined = model.zoomout_refine(nit=(BASIS - FIRST) // 5, step=5)
        # in batches: the table of all distances would take gigabytes
        face, barycentric = model.get_precise_map(FM=refined, precompute_dmin=False, batch_size=500)
        return {"face": face, "barycentric": barycentric, "seconds": time.perf_counter() - started}

    kept = _kept(pair, "zoomout", store, made)
    return Map(kept["face"], kept["barycentric"], None, {"seconds": {"tool": float(kept["seconds"])}})
