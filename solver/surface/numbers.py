"""What the numbers of a mesh can carry: how fine its coordinates are, and where arithmetic would lose them.

Far from the origin coordinates of a file in single precision lie on a coarse lattice, and extreme sizes overflow once
they are squared. The first can only be said; the second is mended by moving and scaling for the computation.
"""

from __future__ import annotations

import numpy as np

from .mesh import MeshError, TriangleMesh

FAR = 1e4
"""Distance from the origin, in diagonals, from which on a mesh is moved there."""

LARGEST, SMALLEST = 1e9, 1e-9
"""Diagonals, in any unit, beyond which a mesh is scaled."""

COARSE = 0.05
"""Steps of the coordinates, in lengths of the usual edge, that are worth a word: directions are off by degrees."""

LOST = 0.5
"""Steps of the coordinates, in lengths of the usual edge, that leave no shape."""

FLAT = 1e-10
"""Area, in squares of the diagonal, below which there is none."""


def computable(mesh: TriangleMesh) -> tuple[TriangleMesh, tuple[str, ...]]:
    """Return the mesh itself, or moved and scaled if arithmetic needs it, and what was done or is to be said.

    Scaling is by a power of two, which changes no digit.

    Raises
    ------
    MeshError
        There is no surface, or its coordinates are too coarse for its details.
    """
    largest = float(np.abs(mesh.vertices[mesh.used]).max())
    if largest == 0:
        raise MeshError(f"'{mesh.name}' has all its faces in one point: there is no surface")
    notes: list[str] = []
    result, exponent = mesh, 0
    if not 1e-100 < largest < 1e100:  # or differences and squares overflow below
        result, exponent = _scaled(mesh, largest)
    if (diagonal := result.diagonal) == 0:
        raise MeshError(f"'{mesh.name}' has all its faces in one point: there is no surface")
    if exponent or not SMALLEST < diagonal < LARGEST:
        result, further = _scaled(result, diagonal)
        exponent += further
        notes.append("of extreme size, scaled")
    corner = result.vertices[result.used]
    middle, diagonal = (corner.min(axis=0) + corner.max(axis=0)) / 2, result.diagonal
    if float(np.abs(middle).max()) > FAR * diagonal:
        result = result.moved(result.vertices - middle)
        notes.append("far from the origin, moved there")
    low, high = result.edges.T
    length = np.sqrt(((result.vertices[low] - result.vertices[high]) ** 2).sum(axis=1))
    edge = float(np.median(length[length > 0]))
    step = float(np.ldexp(_step(mesh), exponent))
    own_edge, own_step = np.ldexp(edge, -exponent), np.ldexp(step, -exponent)
    if step > LOST * edge:
        raise MeshError(
            f"'{mesh.name}' lies so far from the origin that its coordinates have steps of {own_step:.2g}, "
            f"at edges of {own_edge:.2g}: move it to the origin before it is written in single precision"
        )
    if result.area <= FLAT * diagonal**2:
        raise MeshError(f"'{mesh.name}' has only faces without area: there is no surface")
    if step > COARSE * edge:
        notes.append(
            f"coordinates in steps of {own_step:.2g} at edges of {own_edge:.2g}, as far from the origin in single "
            "precision: no finer than that"
        )
    return result, tuple(notes)


def _scaled(mesh: TriangleMesh, size: float) -> tuple[TriangleMesh, int]:
    """Return the mesh times the power of two that brings `size` near one, and its exponent."""
    exponent = -int(np.frexp(size)[1])
    with np.errstate(over="ignore"):  # vertices in no face may lie anywhere
        vertices = np.where(mesh.used[:, None], np.ldexp(mesh.vertices, exponent), 0.0)
    return mesh.moved(vertices), exponent


def _step(mesh: TriangleMesh) -> float:
    """Return the step between neighbouring coordinates where these are largest, in the precision that they came in."""
    vertices = mesh.vertices[mesh.used]
    largest = np.abs(vertices).max()
    with np.errstate(over="ignore"):
        single = vertices.astype(np.float32)
    if (single == vertices).all():
        return float(np.spacing(np.float32(largest)))
    return float(np.spacing(largest))
