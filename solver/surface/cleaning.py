"""A scan put in order for the computation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .gluing import Glue, glue_of, shape_of, sides_to_turn, turned_glue, vertices_of_glue
from .handles import MOST, cut_handles
from .joining import coinciding
from .kept import kept
from .mesh import Booleans, Floats, Integers, MeshError, TriangleMesh, edges_of_sides, plural, twin_sides
from .numbers import computable
from .sheets import drawn_together, inner_walls
from .spikes import without_spikes
from .tidy import Cleaned
from .topology import topology

TINY = 1e-9
"""Length, in diagonals, up to which an edge has none."""

CUT_OPEN = 0.4
"""Share of a closed surface's area from which on a part that was cut out of it along its edges is taken as it is."""


def cleaned(
    mesh: TriangleMesh, *, largest_part: bool = False, fill_holes: bool = False, keys: Floats | None = None
) -> Cleaned:
    """Put a mesh in order for the computation: whatever can be told from the surface itself.

    It is moved and scaled where arithmetic needs that. Faces that use a vertex twice, duplicates, inner walls and edges
    without length go. Boundary edges that coincide are joined; vertices in which parts touch are split; all faces face
    one side. On request the largest part is kept alone, and handles are cut. Spikes are put back.

    Parameters
    ----------
    mesh : TriangleMesh
        Any mesh.
    largest_part : bool
        Keep the part of largest area, where faces that share an edge are connected.
    fill_holes : bool
        Openings will be closed, so that handles may be cut, which leaves two of each.
    keys : (n, d) float64, optional
        Further coordinates of the vertices, as by shape keys: what does not stay together there is not joined.

    Raises
    ------
    MeshError
        There is no surface, the coordinates are too coarse, or the faces cannot agree about the outside.

    Examples
    --------
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> result = cleaned(TriangleMesh(square, [[0, 1, 2], [0, 1, 1], [0, 3, 2]], "Scan"))
    >>> result.mesh.faces.tolist(), result.changes
    ([[0, 1, 2], [0, 2, 3]], ('1 face with a vertex used twice left out', '1 face turned over'))
    """
    found, moved = _cleaned(mesh, largest_part, fill_holes, keys)
    belong, where = _across(found, moved)
    if len(belong):
        positions, others = mesh.vertices.copy(), None if keys is None else keys.copy()
        for values in (positions, others):
            if values is not None:
                values[belong] = values[where]
        again = TriangleMesh(positions, mesh.faces, mesh.name)
        found, further = _cleaned(again, largest_part, fill_holes, others)
        found = replace(found, changes=tuple(said for said in found.changes if not said.endswith(PUT_BACK)))
        found = _with_word(found, len(belong) + len(further))
    return found.without_pinholes() if fill_holes else found


def _cleaned(mesh: TriangleMesh, largest_part: bool, fill_holes: bool, keys: Floats | None) -> tuple[Cleaned, Integers]:
    """Return the mesh in order but for pinholes, and which of its vertices were spikes."""
    work = _Work(mesh, largest_part)
    if work.in_order_but_for_sides(keys):
        return work.result()
    work.leave_out_faces()
    glue = work.glue_sides(keys)
    if largest_part:
        glue = work.keep_largest_part(glue)
    glue = work.turn(glue)
    work.name_vertices(glue)
    if fill_holes:
        work.cut_handles(glue)
    return work.result()


PUT_BACK = "far off the surface put back"
"""How what is said of spikes ends."""


def _with_word(tidy: Cleaned, spikes: int) -> Cleaned:
    return replace(tidy, changes=(*tidy.changes, f"{plural(spikes, 'vertex')} {PUT_BACK}"))


def _across(tidy: Cleaned, moved: Integers) -> tuple[Integers, Integers]:
    """Return the original vertices that are spikes beside an opening of four edges, and those opposite there.

    Where a surface is cut open the one that was to lie on it tears the cut open: there it belongs.
    """
    if not moved.size:
        return moved, moved
    spike = np.zeros(len(tidy.mesh.vertices), bool)
    spike[moved] = True
    loops = np.array([loop for loop in topology(tidy.mesh).boundary_loops if len(loop) == 4], np.intp).reshape(-1, 4)
    loops = loops[spike[loops].sum(axis=1) == 1]
    at = spike[loops].argmax(axis=1)
    row = np.arange(len(loops))
    return tidy.origin[loops[row, at]], tidy.origin[loops[row, (at + 2) % 4]]


LEFT_OUT = ("smaller part left out", "smaller parts left out", "other part left out", "other parts left out")
"""How what is said of other parts ends."""


class _Work:
    """A mesh while it is put in order."""

    def __init__(self, original: TriangleMesh, largest_part: bool) -> None:
        self.original = original
        degenerate = (original.faces == original.faces[:, [1, 2, 0]]).any(axis=1)
        if degenerate.all():
            raise MeshError(f"'{original.name}' has only faces that use a vertex twice: the file is damaged")
        self.mesh, notes = computable(original)
        self.changes = list(notes)
        if n := int(degenerate.sum()):
            self.changes.append(f"{plural(n, 'face')} with a vertex used twice left out")
        self.largest_part = largest_part
        # original faces, their vertices as they are now, and whether their second and third corners changed places
        self.kept = np.flatnonzero(~degenerate)
        self.faces = original.faces[self.kept]
        self.turned = np.zeros(len(self.kept), bool)
        self.origin = np.arange(len(original.vertices))
        self.vertex_of = np.where(original.used, self.origin, -1)

    def in_order_but_for_sides(self, keys: Floats | None) -> bool:
        """Return whether nothing is to be done about faces and vertices; then the mesh's own glue is right."""
        found = topology(self.mesh)
        flaws = (found.degenerate_faces, found.duplicate_faces, found.non_manifold_edges, found.non_manifold_vertices)
        several = found.parts > 1 and self.largest_part
        if any(len(x) for x in (*flaws, found.inconsistent_edges)) or several or found.handles:
            return False
        glue = glue_of(self.mesh.faces, self.mesh.twins)
        if (self.mesh.edge_lengths <= TINY * self.mesh.diagonal).any():
            return False
        return not coinciding(self.mesh.vertices, self.faces, glue, keys).left.size

    @property
    def areas(self) -> Floats:
        return self.calm.face_areas[self.kept]

    @kept
    def calm(self) -> TriangleMesh:
        """The mesh without spikes, the faces of which would outweigh all others."""
        return without_spikes(self.mesh)[0]

    def _keep(self, chosen: Booleans) -> None:
        self.kept, self.faces, self.turned = self.kept[chosen], self.faces[chosen], self.turned[chosen]

    def leave_out_faces(self) -> None:
        """Leave out what is no surface of its own: edges without length, duplicates, inner walls."""
        size, name = len(self.origin), self.original.name
        become = drawn_together(self.mesh.vertices, self.faces, TINY * self.mesh.diagonal)
        if n := int((become != self.origin).sum()):
            self.changes.append(f"{plural(n, 'edge')} without length drawn together")
            self.vertex_of = np.where(self.vertex_of >= 0, become, -1)
            self.faces = become[self.faces]
            self._keep(~(self.faces == self.faces[:, [1, 2, 0]]).any(axis=1))
            if not len(self.faces):
                raise MeshError(f"'{name}' has only faces without area: there is no surface")
        _, first = np.unique(np.sort(self.faces, axis=1), axis=0, return_index=True)
        if n := len(self.faces) - len(first):
            self.changes.append(f"{plural(n, 'duplicate face')} left out")
            single = np.zeros(len(self.faces), bool)
            single[first] = True
            self._keep(single)
        walls = inner_walls(self.faces, self.areas, size)
        if n := int(walls.sum()):
            self.changes.append(f"{plural(n, 'inner face')} left out")
            self._keep(~walls)

    def glue_sides(self, keys: Floats | None) -> Glue:
        """Return which sides are one edge, those included that coincide."""
        edge = edges_of_sides(self.faces, len(self.origin))[1]
        self._require_manifold(edge)
        # each part to one side first, so that sides that run against each other can be told
        apart = self._turned_to(glue_of(self.faces, twin_sides(edge)))
        joints = coinciding(self.mesh.vertices, self.faces, apart, keys)
        if not joints.left.size or self._closed_by(joints, apart):
            return apart
        joined, glue = len(joints.left), apart.with_others(joints)
        while not joints.opposed.all():  # parts that now face one side may touch along more
            glue = self._turned_to(glue)
            joints = coinciding(self.mesh.vertices, self.faces, glue, keys)
            joined, glue = joined + len(joints.left), glue.with_others(joints)
        self.changes.append(f"{plural(joined, 'edge')} joined along which it is cut open")
        return glue

    def _require_manifold(self, edge: Integers) -> None:
        """Raise if edges of three or more faces are left in what will be kept."""
        side_count = np.bincount(edge)
        crowded = np.flatnonzero(side_count > 2)
        if not crowded.size:
            return
        order = np.argsort(edge, kind="stable")
        same = edge[order[1:]] == edge[order[:-1]]
        all_sides = Glue(order[1:][same], order[:-1][same], np.ones(int(same.sum()), bool))
        part = all_sides.parts(len(self.faces))
        main = int(np.argmax(np.bincount(part, self.areas)))
        if n := len(np.intersect1d(crowded, edge.reshape(-1, 3)[part == main] if self.largest_part else edge)):
            raise MeshError(
                f"'{self.original.name}' has {plural(n, 'edge')} in three or more faces: delete the extra faces"
            )

    def _closed_by(self, joints: Glue, apart: Glue) -> bool:
        """Return whether joining closes a surface that someone has cut open, or makes a handle of one with itself.

        A handle that is there once islands are joined to each other is one of the surface.
        """
        m, areas = len(self.faces), self.areas
        whole = apart.with_others(joints)
        part, before = whole.parts(m), apart.parts(m)
        largest = part == np.argmax(np.bincount(part, areas))
        main = before == np.argmax(np.bincount(before, areas * largest))
        if areas[main].sum() < CUT_OPEN * areas[largest].sum():
            return False
        loops, _ = shape_of(int(largest.sum()), whole.among(largest))
        own_loops, own_handles = shape_of(int(main.sum()), apart.among(main))
        handles = shape_of(int(main.sum()), whole.among(main))[1]
        return (loops == 0 or handles > own_handles) and own_loops > 0

    def keep_largest_part(self, glue: Glue) -> Glue:
        """Leave out all parts but the one of largest area."""
        part = glue.parts(len(self.faces))
        area = np.bincount(part, self.areas)
        if len(area) == 1:
            return glue
        self.changes.append(f"{plural(len(area) - 1, 'smaller part')} left out")
        chosen = part == np.argmax(area)
        self._keep(chosen)
        return glue.among(chosen)

    def turn(self, glue: Glue) -> Glue:
        """Turn faces so that neighbours agree about the outside."""
        glue = self._turned_to(glue)
        if not glue.opposed.all():
            raise MeshError(f"'{self.original.name}' has one side only, like a Möbius strip: cut it open")
        if n := int(self.turned.sum()):
            self.changes.append(f"{plural(n, 'face')} turned over")
        return glue

    def _turned_to(self, glue: Glue) -> Glue:
        """Turn faces, in each part those with less area, where that makes all of it face one side."""
        # as they came, or a part turned round as a whole would count as in order
        turned = sides_to_turn(turned_glue(glue, self.turned), self.areas) ^ self.turned
        if not turned.any():
            return glue
        self.faces = self.faces.copy()
        self.faces[turned] = self.faces[turned][:, [0, 2, 1]]
        self.turned = self.turned ^ turned
        return turned_glue(glue, turned)

    def name_vertices(self, glue: Glue) -> None:
        """Let the vertices be those that the glue makes."""
        size = len(self.origin)
        faces, vertex_of, origin = vertices_of_glue(self.faces, glue, size)
        if n := len(origin) - size:
            self.changes.append(f"{plural(n, 'vertex')} split in which parts touch in a point only")
        self._name(faces, vertex_of, origin)

    def _name(self, faces: Integers, vertex_of: Integers, origin: Integers) -> None:
        self.faces, self.origin = faces, self.origin[origin]
        self.vertex_of = np.where(self.vertex_of >= 0, vertex_of[self.vertex_of], -1)

    def cut_handles(self, glue: Glue) -> None:
        """Cut handles along loops that are short."""
        m = len(self.faces)
        if glue.parts(m).any():
            return
        handles = shape_of(m, glue)[1]
        if not 0 < handles <= MOST:
            return
        mesh = TriangleMesh(self.mesh.vertices[self.origin], self.faces)
        lengths, *named = cut_handles(mesh, glue, handles)
        if lengths:
            self.changes.append(f"{plural(len(lengths), 'handle')} cut through")
            self._name(*named)

    def result(self) -> tuple[Cleaned, Integers]:
        """Return the mesh in order, and which of its vertices were spikes."""
        name = self.original.name
        positions = self.mesh.vertices
        if not self.changes:
            return self._without_spikes(Cleaned.unchanged(self.original))
        mesh = TriangleMesh(positions[self.origin], self.faces, name)
        tidy = (self.kept, self.turned, tuple(self.changes), self.original.faces, self.vertex_of, self.origin)
        return self._without_spikes(Cleaned(mesh, *tidy))

    def _without_spikes(self, tidy: Cleaned) -> tuple[Cleaned, Integers]:
        mesh, moved = without_spikes(tidy.mesh)
        return (_with_word(replace(tidy, mesh=mesh), len(moved)) if moved.size else tidy), moved
