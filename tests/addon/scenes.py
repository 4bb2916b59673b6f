"""Objects to try the extension on, and what there is to see on them afterwards."""

from collections.abc import Callable
from typing import Any

import numpy as np

QUICK = {"samples": 50, "targets": 200, "reflect": "never", "refine": "none"}
"""Settings of an alignment that takes a tenth of a second."""

Height = Callable[[np.ndarray, np.ndarray], np.ndarray]


def bumps(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A surface without symmetry, so that only one correspondence is right."""
    return 0.3 * np.exp(-8 * ((x - 0.3) ** 2 + (y - 0.2) ** 2)) + 0.2 * np.exp(-12 * ((x + 0.4) ** 2 + (y + 0.3) ** 2))


def make_object(name: str, vertices: Any, polygons: Any, edges: Any = ()) -> Any:
    """An object in the scene, active and selected alone."""
    import bpy

    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, edges, polygons)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    for other in bpy.context.scene.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return obj


def make_sheet(name: str, n: int, height: Height = bumps, keep: Callable[[int, int], bool] | None = None) -> Any:
    """A square sheet over [-1, 1] squared of n x n vertices in quads; `keep(i, j)` chooses the quads."""
    side = np.linspace(-1, 1, n)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    quads = [
        (i * n + j, i * n + j + 1, (i + 1) * n + j + 1, (i + 1) * n + j)
        for i in range(n - 1)
        for j in range(n - 1)
        if keep is None or keep(i, j)
    ]
    return make_object(name, np.stack([x, y, height(x, y)], axis=1).tolist(), quads)


def positions(obj: Any) -> np.ndarray:
    """Vertex positions of an object, (n, 3), in its own space."""
    return np.array([vertex.co[:] for vertex in obj.data.vertices])


def weights(obj: Any, name: str) -> np.ndarray:
    """Weight of each vertex in a group, (n,); 0 where it is no member."""
    index = obj.vertex_groups[name].index
    return np.array([sum(g.weight for g in v.groups if g.group == index) for v in obj.data.vertices])


def corner_values(obj: Any, name: str) -> np.ndarray:
    """UV of each face corner, (c, 2)."""
    return np.array([value.vector[:] for value in obj.data.uv_layers[name].uv])


def everything(obj: Any) -> dict[str, Any]:
    """All that an operator could have changed on an object, to compare before and after."""
    mesh = obj.data
    return {
        "positions": positions(obj).tolist(),
        "groups": [(group.name, weights(obj, group.name).tolist()) for group in obj.vertex_groups],
        "attributes": sorted((a.name, a.data_type, a.domain) for a in mesh.attributes if not a.name.startswith(".")),
        "uv": {layer.name: corner_values(obj, layer.name).tolist() for layer in mesh.uv_layers},
        "colors": {c.name: [value.color[:] for value in c.data] for c in mesh.color_attributes},
        "selected": [vertex.select for vertex in mesh.vertices],
        "aligned": mesh.mobius_alignment.target_fingerprint,
    }
