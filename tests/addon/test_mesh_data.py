"""Meshes as arrays: what Blender draws, and the way back."""

from typing import Any

import numpy as np
import pytest
from scenes import make_object, make_sheet

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.mesh_data import read_surface, scale_warning, unseen_warning  # noqa: E402
from mobius_extension.solver import MeshError, topology  # noqa: E402


def test_polygons_of_any_size_become_the_triangles_that_blender_draws() -> None:
    corners = [(np.cos(a), np.sin(a), 0) for a in np.linspace(0, 2 * np.pi, 5, endpoint=False)]
    obj = make_object("Mixed", [*corners, (2, 0, 0), (2, 1, 0)], [(0, 1, 2, 3, 4), (0, 5, 6, 1)])
    surface = read_surface(obj)
    assert len(surface.mesh.faces) == 3 + 2
    assert surface.corner_polygon.tolist() == [0] * 5 + [1] * 4
    assert (surface.corner_vertex[surface.triangle_corners] == surface.mesh.faces).all()
    obj.data.calc_loop_triangles()
    assert [list(triangle.vertices) for triangle in obj.data.loop_triangles] == surface.mesh.faces.tolist()
    # each triangle stays inside its polygon
    polygons = surface.corner_polygon[surface.triangle_corners]
    assert (polygons == polygons[:, :1]).all()


def test_loose_vertices_are_kept_in_their_places() -> None:
    obj = make_object("Loose", [(9, 9, 9), (0, 0, 0), (1, 0, 0), (0, 1, 0)], [(1, 2, 3)])
    found = topology(read_surface(obj).mesh)
    assert found.is_disc
    assert found.unused_vertices.tolist() == [0]


def test_a_mirrored_object_is_read_as_the_person_sees_it() -> None:
    obj = make_sheet("Sheet", 5)
    plain = read_surface(obj)
    obj.scale.y = -1
    bpy.context.view_layer.update()
    mirrored = read_surface(obj)
    # the mirror image, with the outside still outside: the normals' z keeps its sign while x is negated
    assert (mirrored.mesh.vertices == plain.mesh.vertices * (-1, 1, 1)).all()
    assert np.allclose(mirrored.mesh.face_vectors[:, 2], plain.mesh.face_vectors[:, 2])
    assert (mirrored.corner_vertex[mirrored.triangle_corners] == mirrored.mesh.faces).all()


def test_pose_and_size_do_not_matter_but_a_stretch_is_pointed_out() -> None:
    obj = make_sheet("Sheet", 4)
    plain = read_surface(obj).mesh.fingerprint
    obj.location, obj.rotation_euler, obj.scale = (1, 2, 3), (0.1, 0.2, 0.3), (7, 7, 7)
    bpy.context.view_layer.update()
    assert read_surface(obj).mesh.fingerprint == plain
    assert scale_warning(obj) is None
    obj.scale.z = 8
    bpy.context.view_layer.update()
    assert "'Sheet' has different scales" in str(scale_warning(obj))


def test_the_fingerprint_tells_every_edit_of_the_shape() -> None:
    obj = make_sheet("Sheet", 4)
    seen = {read_surface(obj).mesh.fingerprint}
    obj.data.vertices[3].co.z += 1e-4
    seen.add(read_surface(obj).mesh.fingerprint)
    obj.data.flip_normals()
    seen.add(read_surface(obj).mesh.fingerprint)
    assert len(seen) == 3
    obj.data.uv_layers.new(name="UV")
    obj.vertex_groups.new(name="Group")
    seen.add(read_surface(obj).mesh.fingerprint)
    assert len(seen) == 3


@pytest.mark.parametrize(
    ("vertices", "polygons", "reason"),
    [
        ([], [], "'Bad' has no vertices"),
        ([(0, 0, 0), (1, 0, 0)], [], "'Bad' has no faces"),
        (
            [(0, 0, 0), (1, 0, 0), (0, float("nan"), 0)],
            [(0, 1, 2)],
            "'Bad' has 1 vertex whose position is not a finite",
        ),
    ],
)
def test_what_is_no_surface_is_refused_by_name(vertices: list, polygons: list, reason: str) -> None:
    with pytest.raises(MeshError, match=reason):
        read_surface(make_object("Bad", vertices, polygons))


# what is seen


def bent(obj: Any) -> np.ndarray:
    return np.array([v.co[:] for v in obj.data.vertices]) + np.random.default_rng(0).normal(
        size=(len(obj.data.vertices), 3)
    ).astype(np.float32)


def evaluated(obj: Any) -> np.ndarray:
    bpy.context.view_layer.update()
    shown = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([v.co[:] for v in shown.data.vertices])


def keyed(name: str = "Sheet") -> Any:
    obj = make_sheet(name, 4)
    obj.shape_key_add(name="Basis", from_mix=False)
    key = obj.shape_key_add(name="Bent", from_mix=False)
    key.points.foreach_set("co", bent(obj).ravel())
    key.value = 0
    return obj


def test_vertices_out_of_step_with_the_first_key_are_read_where_blender_shows_them() -> None:
    obj = keyed()
    right = evaluated(obj)
    obj.data.vertices.foreach_set("co", bent(obj).ravel())
    assert np.allclose(evaluated(obj), right)
    surface = read_surface(obj)
    assert np.allclose(surface.mesh.vertices, right)
    assert surface.rest is surface.mesh


@pytest.mark.parametrize("mute", [False, True])
@pytest.mark.parametrize("group", ["", "Half", "absent"])
@pytest.mark.parametrize("relative", [True, False])
def test_the_shape_that_is_pinned_is_read(mute: bool, group: str, relative: bool) -> None:
    obj = keyed()
    obj.vertex_groups.new(name="Half").add((0, 1, 2, 3), 0.5, "REPLACE")
    plain = read_surface(obj)
    obj.active_shape_key_index, obj.show_only_shape_key = 1, True
    obj.active_shape_key.mute, obj.active_shape_key.vertex_group = mute, group
    obj.data.shape_keys.use_relative = relative
    surface = read_surface(obj)
    assert np.allclose(surface.mesh.vertices, evaluated(obj), atol=1e-6)
    assert (surface.rest.vertices == plain.mesh.vertices).all()
    # it is still the mesh that was aligned, whatever is pinned since
    assert surface.rest.fingerprint == plain.rest.fingerprint


def test_sliders_that_show_another_shape_are_pointed_out() -> None:
    obj = keyed()
    assert unseen_warning(obj) is None
    obj.data.shape_keys.key_blocks["Bent"].value = 0.5
    assert unseen_warning(obj) == (
        "'Sheet' counts in the shape of 'Basis', without 'Bent': to align it in another one, pin that shape key"
    )
    obj.active_shape_key_index, obj.show_only_shape_key = 1, True
    assert unseen_warning(obj) is None
    obj.show_only_shape_key = False
    obj.active_shape_key.mute = True
    assert unseen_warning(obj) is None


def grid_nodes() -> Any:
    """Nodes that put another mesh in the place of the one that comes in."""
    group = bpy.data.node_groups.new("Grid", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    group.nodes.new("NodeGroupInput")
    grid, end = group.nodes.new("GeometryNodeMeshGrid"), group.nodes.new("NodeGroupOutput")
    group.links.new(grid.outputs["Mesh"], end.inputs[0])
    return group


@pytest.mark.parametrize("kind", ["MIRROR", "ARRAY", "MASK", "NODES"])
def test_modifiers_that_show_another_surface_are_named(kind: str) -> None:
    obj = make_sheet("Sheet", 5)
    obj.modifiers.new("Bend", "SIMPLE_DEFORM")
    obj.modifiers.new("Smooth", "SUBSURF")
    assert unseen_warning(obj) is None
    obj.modifiers.clear()
    found = obj.modifiers.new("Made", kind)
    if kind == "NODES":
        assert unseen_warning(obj) is None  # they do nothing yet
        found.node_group = grid_nodes()
        bpy.context.view_layer.update()
    assert unseen_warning(obj) == (
        "'Sheet' counts without what its modifiers 'Made' show: apply them if that should count"
    )
    found.show_viewport = False
    assert unseen_warning(obj) is None
