"""What a mesh is: parts, boundary loops, Euler characteristic, and everything that keeps it from being a disc."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from .mesh import Booleans, Integers, MeshError, TriangleMesh, directed_edges, edges_of_sides, plural, twin_sides


@dataclass(frozen=True)
class Topology:
    """The topology of a mesh, as `topology` finds it.

    Attributes
    ----------
    vertices : int
        Vertices in use.
    parts : int
        Connected components (faces that share a vertex are connected).
    boundary_loops : tuple of (k,) int arrays
        Vertex indices in the order of the surface's boundary orientation, most edges first.
    loop_lengths : tuple of float
        Length of each loop, in the mesh's length unit.
    euler_characteristic : int
        Vertices in use - edges + faces; 1 for a disc.
    non_manifold_edges : (k, 2) int
        Edges of three or more faces.
    non_manifold_vertices : (k,) int
        Vertices whose faces form more than one fan.
    degenerate_faces : (k,) int
        Faces that name a vertex twice.
    zero_area_faces : (k,) int
        Other faces without area; they are no obstacle.
    duplicate_faces : (k,) int
        Faces on the same three vertices as an earlier one.
    unused_vertices : (k,) int
        Vertices in no face; they are no obstacle.
    inconsistent_edges : (k, 2) int
        Edges that both of their faces run through in the same direction.
    """

    vertices: int
    parts: int
    boundary_loops: tuple[Integers, ...]
    loop_lengths: tuple[float, ...]
    euler_characteristic: int
    non_manifold_edges: Integers
    non_manifold_vertices: Integers
    degenerate_faces: Integers
    zero_area_faces: Integers
    duplicate_faces: Integers
    unused_vertices: Integers
    inconsistent_edges: Integers

    @property
    def is_disc(self) -> bool:
        """Whether the mesh is a triangulated disc: nothing in `problems`."""
        return not self.problems()

    @property
    def is_sphere(self) -> bool:
        """Whether the mesh is a triangulated sphere."""
        return not self.problems(closed=True)

    def problems(self, *, fill_holes: bool = False, closed: bool = False) -> tuple[str, ...]:
        """Return what keeps the mesh from being a disc, each as the rest of a sentence, with what to do about it.

        With `fill_holes` the disc may have openings: one boundary loop is its rim, the others will be closed. With
        `closed`, what keeps it from being a sphere.
        """
        found: list[str] = []
        if n := len(self.degenerate_faces):
            found.append(f"has {plural(n, 'face')} with a vertex used twice: merge by distance or delete them")
        if n := len(self.duplicate_faces):
            found.append(f"has {plural(n, 'duplicate face')}: delete them")
        if n := len(self.non_manifold_edges):
            found.append(f"has {plural(n, 'edge')} in three or more faces: delete the extra faces")
        if n := len(self.inconsistent_edges):
            found.append(f"has faces that disagree about the outside ({plural(n, 'edge')}): recalculate the normals")
        if n := len(self.non_manifold_vertices):
            found.append(f"has {plural(n, 'vertex')} where parts touch in a point only: split them")
        if self.parts > 1:
            found.append(f"has {self.parts:,} separate parts: keep one (Separate by Loose Parts)")
        if found:
            return tuple(found)
        loops = len(self.boundary_loops)
        if closed:
            if loops:
                found.append(f"has {plural(loops, 'boundary loop')} where a closed surface is needed: fill them")
        elif loops == 0:
            found.append("is closed (it has no boundary): delete some faces to open it into a disc")
        elif loops > 1 and not fill_holes:
            edges = [f"{len(loop):,}" for loop in self.boundary_loops]
            listed = f"{', '.join(edges[:-1])} and {edges[-1]}" if loops <= 6 else f"{', '.join(edges[:5])}, ..."
            found.append(f"has {loops:,} boundary loops ({listed} edges): fill all but the outer one")
        if self.handles:
            found.append(f"has {plural(self.handles, 'handle')} like a torus: cut through and fill")
        return tuple(found)

    @property
    def is_closed(self) -> bool:
        """Whether all that keeps the mesh from being a disc is that it has no boundary."""
        return not self.boundary_loops and len(self.problems()) == 1 and not self.handles and self.parts == 1

    @property
    def handles(self) -> int:
        """Genus of an orientable manifold mesh in one part; 0 for discs and spheres."""
        return (2 * self.parts - len(self.boundary_loops) - self.euler_characteristic) // 2

    def describe(self) -> str:
        """Return one line that says what the mesh is."""
        problems = self.problems()
        if problems:
            return "not a disc: it " + "; it ".join(problems)
        text = f"disc, {self.vertices:,} vertices, boundary of {len(self.boundary_loops[0]):,} edges"
        if n := len(self.unused_vertices):
            text += f", {plural(n, 'loose vertex')}"
        if n := len(self.zero_area_faces):
            text += f", {plural(n, 'face')} without area"
        return text


def topology(mesh: TriangleMesh) -> Topology:
    """Return what `mesh` is. Nothing is assumed of the mesh.

    >>> topology(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).describe()
    'disc, 3 vertices, boundary of 3 edges'
    """
    n, faces = len(mesh.vertices), mesh.faces
    a, b, c = faces.T
    degenerate = (a == b) | (b == c) | (c == a)
    duplicate = np.zeros(len(faces), bool)
    if _may_have_duplicates(mesh):
        duplicate[:] = True
        duplicate[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]] = False
    proper = ~degenerate & ~duplicate
    flat = proper & (mesh.face_areas <= 1e-12 * np.maximum.reduce(mesh.edge_lengths.T) ** 2)

    simple = faces[proper]
    edges, edge_of_side = (mesh.edges, mesh.edge_of_side) if proper.all() else edges_of_sides(simple, n)
    sides = directed_edges(simple)
    ascending = sides[:, 0] < sides[:, 1]
    side_count = np.bincount(edge_of_side, minlength=len(edges))
    forward = np.bincount(edge_of_side, ascending, minlength=len(edges))

    in_proper = np.zeros(n, bool)
    in_proper[simple] = True
    starts = np.concatenate([[0], np.cumsum(np.bincount(edges[:, 0], minlength=n))])
    joined = csr_array((np.ones(len(edges), np.int8), edges[:, 1], starts), shape=(n, n))
    parts = connected_components(joined, directed=False)[0] - int((~in_proper).sum())

    twins = mesh.twins if proper.all() else twin_sides(edge_of_side)
    fan_of_corner = _fans(edge_of_side, ascending, None if (side_count > 2).any() else twins)
    vertex_of_fan = np.zeros(fan_of_corner.max(initial=-1) + 1, np.intp)
    vertex_of_fan[fan_of_corner] = simple.ravel()
    fans = np.bincount(vertex_of_fan, minlength=n)

    loops = _boundary_loops(simple, fan_of_corner, np.flatnonzero(side_count[edge_of_side] == 1))
    lengths = [float(np.linalg.norm(mesh.vertices[x] - mesh.vertices[np.roll(x, -1)], axis=1).sum()) for x in loops]
    ranked = sorted(range(len(loops)), key=lambda k: (-len(loops[k]), -lengths[k]))
    return Topology(
        vertices=int(mesh.used.sum()),
        parts=parts,
        boundary_loops=tuple(loops[k] for k in ranked),
        loop_lengths=tuple(lengths[k] for k in ranked),
        euler_characteristic=int(in_proper.sum()) - len(edges) + len(simple),
        non_manifold_edges=edges[side_count > 2],
        non_manifold_vertices=np.flatnonzero(fans > 1),
        degenerate_faces=np.flatnonzero(degenerate),
        zero_area_faces=np.flatnonzero(flat),
        duplicate_faces=np.flatnonzero(duplicate & ~degenerate),
        unused_vertices=np.flatnonzero(~mesh.used),
        inconsistent_edges=edges[(side_count == 2) & (forward != 1)],
    )


def require_disc(mesh: TriangleMesh, *, fill_holes: bool = False) -> Topology:
    """Return the topology of a mesh that must be a disc or, with `fill_holes`, a disc with openings.

    Raises
    ------
    MeshError
        It is none; the text names the mesh and everything that is in the way.
    """
    found = topology(mesh)
    if problems := found.problems(fill_holes=fill_holes):
        raise MeshError(f"'{mesh.name}' " + "; it ".join(problems))
    return found


def require_sphere(mesh: TriangleMesh) -> Topology:
    """Return the topology of a mesh that must be a closed surface without handles.

    Raises
    ------
    MeshError
        It is none; the text names the mesh and everything that is in the way.
    """
    found = topology(mesh)
    if problems := found.problems(closed=True):
        raise MeshError(f"'{mesh.name}' " + "; it ".join(problems))
    return found


def _may_have_duplicates(mesh: TriangleMesh) -> bool:
    """Return False only if no two faces have the same vertices: at no edge are two faces with one vertex opposite."""
    paired = mesh.twins >= 0
    opposite = mesh.faces.ravel()
    several = np.bincount(mesh.edge_of_side).max() > 2
    return bool(several or (opposite[mesh.twins[paired]] == opposite[paired]).any())


def _fans(edge_of_side: Integers, ascending: Booleans, twins: Integers | None) -> Integers:
    """Label each corner, (3 m,), so that corners of one vertex agree if edges of two or more faces connect them.

    `twins` are the other sides of edges of two sides, None where some edge has more.
    """
    if twins is None:
        order = np.argsort(edge_of_side, kind="stable")
        shared = edge_of_side[order[1:]] == edge_of_side[order[:-1]]
        left, right = order[:-1][shared], order[1:][shared]
    else:
        left = np.flatnonzero(twins > np.arange(len(twins)))
        right = twins[left]
    # side 3 f + k runs from corner k + 1 to corner k + 2
    corners = np.arange(len(edge_of_side), dtype=np.int32).reshape(-1, 3)
    start, stop = corners[:, [1, 2, 0]].ravel(), corners[:, [2, 0, 1]].ravel()
    same = ascending[left] == ascending[right]
    begin, end = start[right], stop[right]
    links = (
        np.concatenate([start[left], stop[left]]),
        np.concatenate([np.where(same, begin, end), np.where(same, end, begin)]),
    )
    graph = coo_array((np.ones(len(links[0]), np.int8), links), shape=(corners.size, corners.size))
    return connected_components(graph, directed=False)[1].astype(np.intp)


def _boundary_loops(faces: Integers, fan_of_corner: Integers, boundary_sides: Integers) -> list[Integers]:
    """Chain boundary sides into loops of vertex indices; a vertex in two fans is passed once per fan."""
    corner = np.arange(faces.size).reshape(-1, 3)
    start = fan_of_corner[np.roll(corner, -1, axis=1).ravel()[boundary_sides]]
    stop = fan_of_corner[np.roll(corner, -2, axis=1).ravel()[boundary_sides]]
    vertex = {int(f): int(v) for f, v in zip(start, np.roll(faces, -1, axis=1).ravel()[boundary_sides], strict=True)}
    vertex |= {int(f): int(v) for f, v in zip(stop, np.roll(faces, -2, axis=1).ravel()[boundary_sides], strict=True)}
    # neighbours in side direction first, so that a consistently oriented boundary keeps its direction
    neighbours: dict[int, list[int]] = {f: [] for f in vertex}
    for a, b in zip(start.tolist(), stop.tolist(), strict=True):
        neighbours[a].insert(0, b)
        neighbours[b].append(a)
    seen: set[int] = set()
    loops: list[Integers] = []
    for first in neighbours:
        if first in seen:
            continue
        loop, here = [first], first
        seen.add(first)
        while (ahead := next((f for f in neighbours[here] if f not in seen), None)) is not None:
            loop.append(ahead)
            seen.add(ahead)
            here = ahead
        loops.append(np.array([vertex[f] for f in loop], dtype=np.intp))
    return loops
