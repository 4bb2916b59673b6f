"""Long things that people have: sleeves, trouser legs, socks, belts, scarfs; worn in one way and in another."""

from collections.abc import Callable

import numpy as np

from solver import TriangleMesh

Form = Callable[[np.ndarray, np.ndarray, float], np.ndarray]
"""Places (n, 3) of points at `around` or `across`, in [0, 1], and at `along`, in [0, 1], bent by an angle."""


def _bent(along: np.ndarray, aside: np.ndarray, out: np.ndarray, length: float, angle: float) -> np.ndarray:
    """Points beside an axis that is bent in its middle half, by an angle in all."""
    turn = angle * np.clip(2 * along - 0.5, 0, 1)
    steps = np.linspace(0, 1, 2001)
    course = angle * np.clip(2 * steps - 0.5, 0, 1)
    x = length * np.concatenate([[0], np.cumsum(np.cos(course[:-1]) * np.diff(steps))])
    z = length * np.concatenate([[0], np.cumsum(np.sin(course[:-1]) * np.diff(steps))])
    return np.stack(
        [
            np.interp(along, steps, x) - np.sin(turn) * out,
            aside,
            np.interp(along, steps, z) + np.cos(turn) * out,
        ],
        axis=1,
    )


def _folds(around: np.ndarray, along: np.ndarray, length: float, seed: int) -> np.ndarray:
    """Hills and dents in the cloth, in radii, wrapped around."""
    rng = np.random.default_rng(seed)
    height = np.zeros(len(around))
    for _ in range(round(3 * length)):
        centre, place, size = rng.random(), rng.random(), rng.uniform(0.25, 0.6)
        turn = 2 * np.pi * (np.mod(around - centre + 0.5, 1) - 0.5)
        away = turn**2 + (length * (along - place)) ** 2
        height += rng.choice([-1, 1]) * rng.uniform(0.1, 0.25) * np.exp(-away / (2 * size**2))
    return height


def tube_form(length: float, narrows: float = 0.6, seed: int = 0, closed: bool = False) -> Form:
    """A sleeve or a trouser leg, `length` radii long; a sock, if its end is closed."""

    def form(around: np.ndarray, along: np.ndarray, angle: float) -> np.ndarray:
        radius = (1 - (1 - narrows) * along) * (1 + _folds(around, along, length, seed))
        if closed:  # half a ball at the end
            toe = np.clip((along - 1) * length / narrows + 1, 0, 1)
            radius = radius * np.sqrt(np.maximum(1 - toe**2, 0))
        turn = 2 * np.pi * around
        return _bent(along, radius * np.cos(turn), radius * np.sin(turn), length, angle)

    return form


def _hills(across: np.ndarray, along: np.ndarray, length: float, seed: int, *, ring: bool) -> np.ndarray:
    """Hills and dents of a band, in its widths; of a ring they go on where it closes."""
    rng = np.random.default_rng(seed)
    height = np.zeros(len(across))
    for _ in range(round(6 * length)):
        centre, place, size = rng.random(), rng.random(), rng.uniform(0.1, 0.3)
        apart = np.mod(along - place + 0.5, 1) - 0.5 if ring else along - place
        away = (across - centre) ** 2 + (length * apart) ** 2
        height += rng.choice([-1, 1]) * rng.uniform(0.05, 0.12) * np.exp(-away / (2 * size**2))
    return height


def band_form(length: float, seed: int = 0) -> Form:
    """A scarf, `length` times as long as wide."""

    def form(across: np.ndarray, along: np.ndarray, angle: float) -> np.ndarray:
        return _bent(along, across, _hills(across, along, length, seed, ring=False), length, angle)

    return form


def ring_form(length: float, seed: int = 0) -> Form:
    """A buckled belt: a ring, `length` times as long as wide; an angle makes it oval."""

    def form(along: np.ndarray, across: np.ndarray, angle: float) -> np.ndarray:
        out = length / (2 * np.pi) + _hills(across, along, length, seed, ring=True)
        turn = 2 * np.pi * along
        return np.stack(
            [(1 + 0.3 * angle) * out * np.cos(turn), (1 - 0.2 * angle) * out * np.sin(turn), across], axis=1
        )

    return form


def woven(
    form: Form, rows: int, columns: int, angle: float, seed: int, *, tube: bool
) -> tuple[TriangleMesh, np.ndarray]:
    """Triangles of a form, `rows` along it and `columns` around or across, moved at random; and their parameters.

    The parameters, (n, 2), tell where the same point is on another mesh of the form.
    """
    rng = np.random.default_rng(seed)
    step = np.arange(columns) / (columns if tube else columns - 1)
    one, two = (a.ravel() for a in np.meshgrid(step, np.linspace(0, 1, rows)))
    inner = (two > 0) & (two < 1)
    move = np.full(len(one), True) if tube else (one > 0) & (one < 1)
    one = one + np.where(move, rng.uniform(-0.25, 0.25, len(one)) / columns, 0)
    two = two + np.where(inner, rng.uniform(-0.25, 0.25, len(two)) / rows, 0)
    i, j = (a.ravel() for a in np.mgrid[: rows - 1, : columns if tube else columns - 1])
    k = (j + 1) % columns
    a, b, c, d = i * columns + j, i * columns + k, (i + 1) * columns + k, (i + 1) * columns + j
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return TriangleMesh(form(one, two, angle), faces, "Cloth"), np.stack([one, two], axis=1)
