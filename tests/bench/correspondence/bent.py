"""Thin pieces of surfaces, rolled and twisted nearly without stretch: no pose brings them together again."""

from collections.abc import Iterator
from functools import cache

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import csc_array, diags_array
from scipy.sparse.csgraph import connected_components, dijkstra

from solver import TriangleMesh, silhouette_mesh, topology
from solver.flatten.harmonic import factorised
from solver.surface.laplacian import laplacian
from solver.surface.mesh import face_neighbours
from solver.surface.sampling import edge_graph
from tests.bench.paper.data import DATA, read
from tests.solver.gif import read_gif

from .store import Store, digest

ROUNDS = 30
"""Rounds that take the stretch out again; the strain has settled by then."""

BENDS = {
    "rolled 90": (0.0, 90.0),
    "rolled 180": (0.0, 180.0),
    "twisted 180": (90.0, 180.0),
    "coiled 180": (40.0, 180.0),
}
"""Direction of the axis of rotation in degrees, from the width (rolled) to the length (twisted), and the angle."""


def bent(mesh: TriangleMesh, along: np.ndarray, axis: np.ndarray, degrees: float) -> np.ndarray:
    """Return the vertices of the mesh bent round an axis, (n, 3).

    The surroundings of each vertex are turned by its share of the angle; the surface that fits these best follows from
    its gradients (Yu et al. 2004). Then as rigid as possible (Sorkine and Alexa 2007): stretch goes, the bend remains,
    because only what is local changes in a few rounds.

    Parameters
    ----------
    along : (n,) float64
        0 at one end, 1 at the other.
    axis : (3,) float64
    degrees : float
        By how much the ends are turned against each other.
    """
    stiffness = laplacian(mesh)
    i, j = mesh.edges.T
    weight = np.maximum(-np.asarray(stiffness[i, j]).ravel(), 1e-3)
    n, size = len(mesh.vertices), mesh.area
    side = mesh.vertices[i] - mesh.vertices[j]
    rows = np.concatenate([i, j])
    graph = csc_array((np.tile(weight, 2), (rows, np.concatenate([j, i]))), shape=(n, n))
    degree = np.asarray(graph.sum(axis=1)).ravel()
    solve = factorised(csc_array(diags_array(degree) - graph + diags_array(1e-9 * mesh.vertex_areas / size)))
    turn = _turns(axis, np.radians(degrees) * (along - 0.5))
    for _ in range(ROUNDS):
        wanted = weight[:, None] * np.einsum("eij,ej->ei", (turn[i] + turn[j]) / 2, side)
        right = np.zeros((n, 3))
        np.add.at(right, i, wanted)
        np.add.at(right, j, -wanted)
        now = solve(right)
        products = weight[:, None, None] * (now[i] - now[j])[:, :, None] * side[:, None, :]
        total = np.zeros((n, 3, 3))
        np.add.at(total, i, products)
        np.add.at(total, j, products)
        u, _, v = np.linalg.svd(total)
        u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
        turn = u @ v
    return now - now.mean(axis=0)


def _turns(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the rotations by angles, (n,), round an axis, (n, 3, 3)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + sine * cross + (1 - cosine) * cross @ cross


def strain(rest: TriangleMesh, now: np.ndarray) -> tuple[float, float]:
    """Return by how much edges are longer or shorter, in %: the mean and the 95th percentile, by length."""
    i, j = rest.edges.T
    before = np.linalg.norm(rest.vertices[i] - rest.vertices[j], axis=1)
    after = np.linalg.norm(now[i] - now[j], axis=1)
    change = 100 * np.abs(np.log(after / before))
    order = np.argsort(change)
    share = np.cumsum(before[order]) / before.sum()
    return float(change @ before / before.sum()), float(change[order][np.searchsorted(share, 0.95)])


# -- the pieces --------------------------------------------------------------------------------------------------------


def bent_pieces(store: Store) -> Iterator[tuple[TriangleMesh, TriangleMesh]]:
    """Return pieces at rest and bent; vertex i is vertex i. Prints how far the bending is from an isometry."""
    for piece, bends in (
        (car, ("rolled 180", "coiled 180")),
        (lion, ("rolled 90", "coiled 180")),
        (cortex, ("rolled 180", "twisted 180")),
    ):
        rest, along = piece()
        length = np.linalg.lstsq(rest.vertices - rest.vertices.mean(axis=0), along - along.mean(), rcond=None)[0]
        length /= np.linalg.norm(length)
        normal = (rest.vertex_normals() * rest.vertex_areas[:, None]).sum(axis=0)
        normal -= normal @ length * length
        width = np.cross(normal / np.linalg.norm(normal), length)
        for name in bends:
            direction, degrees = BENDS[name]
            axis = np.cos(np.radians(direction)) * width + np.sin(np.radians(direction)) * length
            key = f"bent {rest.name} {name} {digest(rest.vertices, rest.faces, along, axis, degrees, ROUNDS)}"
            now = store.kept(key, lambda r=rest, s=along, a=axis, d=degrees: {"vertices": bent(r, s, a, d)})["vertices"]
            mean, most = strain(rest, now)
            print(f"{rest.name} {name}: lengths change by {mean:.2f} % on average, 95 % by less than {most:.2f} %")
            yield rest, TriangleMesh(now, rest.faces, f"{rest.name} {name}")


@cache
def car() -> tuple[TriangleMesh, np.ndarray]:
    """The silhouette of a car as a sheet that rises where its outline is convex and sinks where it is concave."""
    flat = silhouette_mesh(read_gif(DATA / "silhouettes/car-01.gif") > 0, 6000, "car")
    loop = topology(flat).boundary_loops[0]
    place = flat.vertices[loop, 0] + 1j * flat.vertices[loop, 1]
    side = np.roll(place, -1) - place
    turning, length = np.angle(side / np.roll(side, 1)), (np.abs(side) + np.abs(np.roll(side, 1))) / 2
    inner = np.setdiff1d(np.arange(len(flat.vertices)), loop)
    stiffness = laplacian(flat)
    within = factorised(csc_array(stiffness[inner][:, inner]))
    height = np.zeros(len(flat.vertices))
    for width in (0.01, 0.03):  # shares of the outline, which is a staircase of the lattice, over which it is smoothed
        spread = width * length.sum() / length.mean()
        curvature = gaussian_filter1d(turning, spread, mode="wrap") / gaussian_filter1d(length, spread, mode="wrap")
        layer = np.zeros(len(flat.vertices))
        layer[loop] = curvature - curvature.mean()
        layer[inner] = within(-(stiffness[inner][:, loop] @ layer[loop]))
        height += layer / np.abs(layer).max() * width * length.sum()
    rest = TriangleMesh(flat.vertices + height[:, None] * [0, 0, 1], flat.faces, "car")
    return rest, _unit(flat.vertices[:, 0])


@cache
def lion() -> tuple[TriangleMesh, np.ndarray]:
    """A relief of a lion's head."""
    mesh = read("scans/chinese_lion.obj")
    rest = TriangleMesh(mesh.vertices, mesh.faces, "lion")
    middle = rest.vertices - rest.vertices.mean(axis=0)
    axes = np.linalg.eigh((middle * rest.vertex_areas[:, None]).T @ middle)[1]
    return rest, _unit(middle @ axes[:, 2])


BAND_WIDTH = 0.09
"""Half the width of the band, in roots of the area of the cortex."""


@cache
def cortex() -> tuple[TriangleMesh, np.ndarray]:
    """A band of the cortex along the shortest way from its front to its back."""
    whole = read("brain/conte69_L_cortex.obj")
    front, back = int(np.argmax(whole.vertices[:, 1])), int(np.argmin(whole.vertices[:, 1]))
    graph = edge_graph(whole)
    _, before = dijkstra(graph, indices=front, return_predecessors=True)
    way = [back]
    while way[-1] != front:
        way.append(int(before[way[-1]]))
    near = dijkstra(graph, indices=way, min_only=True) < BAND_WIDTH * np.sqrt(whole.area)
    rest = piece(whole, near[whole.faces].all(axis=1), "cortex")
    start = int(np.linalg.norm(rest.vertices - whole.vertices[front], axis=1).argmin())
    gone = dijkstra(edge_graph(rest), indices=start)
    areas = rest.vertex_areas
    smooth = factorised(csc_array(diags_array(areas) + 0.02 * rest.area * laplacian(rest)))
    return rest, _unit(smooth(areas * gone))


def _unit(values: np.ndarray) -> np.ndarray:
    return (values - values.min()) / np.ptp(values)


def piece(mesh: TriangleMesh, chosen: np.ndarray, name: str) -> TriangleMesh:
    """Return the largest part of the chosen faces, (m,), with what it encloses: a disc."""
    faces, count = mesh.faces, len(mesh.vertices)
    beside = face_neighbours(faces, count)
    while True:
        chosen = _largest_part(chosen, beside)
        chosen = ~_largest_part(~chosen, beside)
        used, inverse = np.unique(faces[chosen], return_inverse=True)
        part = TriangleMesh(mesh.vertices[used], inverse.reshape(-1, 3), name)
        pinched = used[topology(part).non_manifold_vertices]
        if not pinched.size:
            return part
        chosen = chosen | np.isin(faces, pinched).any(axis=1)


def _largest_part(chosen: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Return the largest set of chosen faces, (m,) bool, that hang together across sides."""
    face, side = np.nonzero((beside >= 0) & chosen[:, None] & chosen[beside])
    size = len(beside)
    links = csc_array((np.ones(len(face)), (face, beside[face, side])), shape=(size, size))
    part = connected_components(links, directed=False)[1]
    sizes = np.bincount(part, weights=chosen, minlength=part.max() + 1)
    return chosen & (part == np.argmax(sizes))
