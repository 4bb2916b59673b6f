"""kernels.c through ctypes. The calls let go of Python's lock, so that threads run them side by side."""

from __future__ import annotations

import copy
import ctypes
import importlib
import logging
import threading
from functools import cache
from pathlib import Path

import numpy as np

from ...surface.mesh import Complexes, Floats
from ..bounds import reaches, tangents
from ..matching import Matching
from ..watch import Halt, look
from .layout import one_row, own_rows, sector_grid, sectors
from .nodes import BOUND, new_nodes

INTERFACE = 8
"""Of kernels.c: a library that says another number is not used."""

ARENA = 1 << 20
"""Pairs that one thread can hold for the cells it has open, 8 bytes each; cells beyond look at all pairs again."""

MOST_RINGS = 128
"""Of the grid of target points: no more than the coarsest raster has."""

ANGLES, MOST_LEVELS, SHARPNESS = 512, 4, 0.15
"""Of the raster, as in kernels.c."""

OWN_RASTER, MOST_OWN = 64 * 256, 1 << 27
"""Bytes of the raster that each source point has where their pairs differ, and of all of them at most."""

COARSE = 4.0
"""Half side of the smallest cells that the raster is used for, over the length of its finest stretch."""

STACK = 2048
"""Open cells of one subtree at most, as in kernels.c."""

log = logging.getLogger(__name__)
_I64, _F64, _POINTER = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p


class _Problem(ctypes.Structure):
    _fields_ = [
        ("points", _I64),
        *((name, _POINTER) for name in ("mx", "my", "start", "stop", "discs", "disc", "reach", "weight", "raster")),
        ("levels", _I64),
        ("planes", _I64),
        ("own", _POINTER),
        ("step", _I64),
        ("density", _F64),
        ("typical", _F64),
        ("coarse", _F64),
        *((name, _POINTER) for name in ("grid", "nearest_ring", "farthest_ring", "ring_wide")),
        ("rings", _I64),
        ("z_max", _F64),
        ("smallest", _F64),
        ("halt", _POINTER),
    ]


@cache
def library() -> ctypes.CDLL | None:
    """Return the fastest library that runs here, or None, which the log explains in a sentence."""
    try:
        found = importlib.import_module("mobius_kernels").LIBRARIES
        plain = opened(found[0])
        if len(found) > 1 and plain.mobius_runs_v3():
            return opened(found[1])
    except (ImportError, OSError) as error:
        log.warning("No compiled kernels (%s): the search runs in numpy, many times slower.", error)
        return None
    return plain


def opened(path: Path) -> ctypes.CDLL:
    """Return a library with its functions declared, or raise ImportError if it is of another version."""
    loaded = ctypes.CDLL(str(path))
    if loaded.mobius_interface() != INTERFACE:
        raise ImportError(f"mobius_kernels has interface {loaded.mobius_interface()}, not {INTERFACE}")
    loaded.mobius_work_bytes.restype = _I64
    loaded.mobius_work_bytes.argtypes = [_I64, _I64]
    loaded.mobius_images.restype = None
    loaded.mobius_images.argtypes = [_I64, _POINTER, _POINTER, _F64, _F64, _F64, _F64, _F64, *[_POINTER] * 4]
    loaded.mobius_bounds.restype = None
    loaded.mobius_bounds.argtypes = [_POINTER, _POINTER, _I64, ctypes.c_int32, _POINTER, _I64]
    loaded.mobius_raster_bytes.restype = _I64
    loaded.mobius_raster_bytes.argtypes = [_I64]
    loaded.mobius_raster.restype = None
    loaded.mobius_raster.argtypes = [_POINTER]
    loaded.mobius_own_raster.restype = None
    loaded.mobius_own_raster.argtypes = [_POINTER]
    loaded.mobius_rotations.restype = None
    loaded.mobius_rotations.argtypes = [*[_POINTER] * 7, _I64, _F64, _POINTER, _I64]
    loaded.mobius_expand.restype = _I64
    loaded.mobius_expand.argtypes = [_POINTER, _POINTER, _I64, _F64, _I64, _POINTER, _I64, *[_POINTER] * 2, _I64]
    return loaded


class CompiledKernels:
    """The kernels for one matching, in C; see `ReferenceKernels` for the same in numpy.

    Weights and bounds are whole numbers of `Matching.unit` on the other side.
    """

    name = "compiled"

    def __init__(
        self,
        problem: Matching,
        z_max: float,
        smallest: float,
        halt: Halt | None = None,
    ) -> None:
        loaded = library()
        if loaded is None:
            raise ImportError("mobius_kernels is not installed")
        self._library = loaded
        self.unit = problem.unit
        self.points = len(problem.source)
        self.halt = np.zeros(1, np.int32) if halt is None else halt
        # about one target point in two of its sectors
        rings = int(np.clip(2 ** np.round(0.5 * np.log2(max(problem.count // self.points, 1))), 8, MOST_RINGS))
        inner, outer = reaches(problem.centres, problem.radii)
        tangent, wide = tangents(problem.centres, problem.radii)
        b, turn = np.abs(problem.centres), np.angle(problem.centres) / (2 * np.pi)
        wide /= 2 * np.pi
        widest = np.where(tangent < 0, 1, wide)
        discs = np.stack([inner, outer, turn, widest, tangent, wide, b, problem.radii], axis=1)
        row = one_row(problem)
        shared = row is not None
        arrays: dict[str, np.ndarray | None] = {
            "mx": problem.source.real,
            "my": problem.source.imag,
            "halt": self.halt,
        }
        if shared:
            row = row[np.argsort(sectors(b[row], turn[row], rings), kind="stable")]
            b, turn, inner, outer, widest = (x[row] for x in (b, turn, inner, outer, widest))
            arrays |= {
                "start": np.zeros(self.points, np.int64),
                "stop": np.full(self.points, len(row), np.int64),
                "discs": discs[row],
            }
            typical = float(np.median(widest)) if len(row) else 1.0
        else:
            disc, reach, units, typical = own_rows(problem, inner, outer, widest, self._check)
            starts = problem.starts
            arrays |= {"start": starts[:-1], "stop": starts[1:], "discs": discs, "disc": disc, "reach": reach}
            arrays |= {"weight": units}
        finest = 1
        levels = int(np.clip(np.ceil(np.log2(1 / (SHARPNESS * typical * ANGLES))) + 1, 1, MOST_LEVELS))
        if shared:
            arrays["raster"] = np.empty(loaded.mobius_raster_bytes(levels) // 8, np.uint64)
            finest = ANGLES << levels - 1
            arrays |= sector_grid(b, turn, inner, outer, widest, rings)
        elif self.points * OWN_RASTER <= MOST_OWN:
            arrays["own"] = np.empty(self.points * OWN_RASTER, np.uint8)
            finest = 256
        # kept, because the structure holds bare addresses
        self._arrays = {name: None if x is None else np.ascontiguousarray(x) for name, x in arrays.items()}
        addresses = {name: None if x is None else x.ctypes.data for name, x in self._arrays.items()}
        self.rasters = "shared" if shared else "own" if "own" in arrays else ""
        heaviest = arrays.get("weight")
        self._problem = _Problem(
            points=self.points,
            planes=max(3, self.points.bit_length()),
            levels=levels,
            typical=typical,
            step=max(-(-(1 if heaviest is None else int(heaviest.max(initial=0))) // 255), 1),
            coarse=COARSE / finest,
            density=4.0 * problem.count / self.points,
            rings=rings,
            z_max=z_max,
            smallest=smallest,
            **addresses,
        )
        self._local = threading.local()
        if shared:
            loaded.mobius_raster(ctypes.addressof(self._problem))
        elif "own" in arrays:
            loaded.mobius_own_raster(ctypes.addressof(self._problem))
        self._check()

    def reflected(self) -> CompiledKernels:
        """Return the kernels for the conjugated source: discs and rasters are the same ones."""
        other = copy.copy(self)
        my = self._arrays["my"]
        assert my is not None
        conjugated = -my
        other._arrays = self._arrays | {"my": conjugated}
        other._problem = _Problem.from_buffer_copy(self._problem)
        other._problem.my = conjugated.ctypes.data
        return other

    def _check(self) -> None:
        """Raise Halted if there is no time to go on: what was begun is not to be used."""
        look(self.halt)

    def _work(self) -> int:
        """Return the address of this thread's working memory."""
        if not hasattr(self._local, "memory"):
            self._local.memory = np.empty(self._library.mobius_work_bytes(self.points, ARENA), np.uint8)
            self._local.left = new_nodes(2 * STACK)
        return self._local.memory.ctypes.data

    def images(self, z: complex, half: float, kappa: complex) -> tuple[Floats, Floats, Floats, Floats]:
        """Return `bounds.images` of one cell, angles in turns."""
        alpha, delta, near, far = np.zeros((4, self.points))
        mx, my = self._problem.mx, self._problem.my
        addresses = [x.ctypes.data for x in (alpha, delta, near, far)]
        self._library.mobius_images(self.points, mx, my, z.real, z.imag, half, kappa.real, kappa.imag, *addresses)
        return alpha, delta, near, far

    def bounds(self, nodes: Floats, raster: bool = False) -> Floats:
        """Return `nodes` with their own bound and kappa filled in; `raster`: from the raster, where there is one."""
        nodes = np.array(nodes, dtype=np.float64, order="C")
        self._library.mobius_bounds(
            ctypes.addressof(self._problem), nodes.ctypes.data, len(nodes), raster, self._work(), ARENA
        )
        nodes[:, BOUND] *= self.unit
        return nodes

    def rotations(self, z: Complexes, value: float = -1.0, windows: Floats | None = None) -> tuple[Floats, Floats]:
        """Return, for each z, (C,), what a good theta is worth at most, and that theta.

        Worth 0: not above `value`, or not above the z before it.

        windows: (C, 2), the first rotation to look at and how many from there on, in turns; default: all.
        """
        windows = np.tile([0.0, 1.0], (len(z), 1)) if windows is None else windows
        start, width = np.ascontiguousarray(windows[:, 0]), np.ascontiguousarray(windows[:, 1])
        x, y = np.ascontiguousarray(z.real), np.ascontiguousarray(z.imag)
        turns, bounds = np.zeros(len(z)), np.zeros(len(z))
        self._library.mobius_rotations(
            ctypes.addressof(self._problem),
            x.ctypes.data,
            y.ctypes.data,
            start.ctypes.data,
            width.ctypes.data,
            turns.ctypes.data,
            bounds.ctypes.data,
            len(z),
            value / self.unit,
            self._work(),
            ARENA,
        )
        return bounds * self.unit, turns * (2 * np.pi)

    def expand(self, nodes: Floats, value: float, budget: int) -> tuple[Floats, int]:
        """Return what is left of cells after searching each, depth first, for `budget` bounds, and how many it took.

        If halted, the rest are left as they are.
        """
        given = np.array(nodes, dtype=np.float64, order="C")
        given[:, BOUND] /= self.unit
        counts = np.zeros(4, np.int64)
        parts, spent = [], 0
        while len(given):
            work, room = self._work(), self._local.left
            done = self._library.mobius_expand(
                ctypes.addressof(self._problem),
                given.ctypes.data,
                len(given),
                value / self.unit,
                budget,
                room.ctypes.data,
                len(room),
                counts.ctypes.data,
                work,
                ARENA,
            )
            given = np.ascontiguousarray(given[done:])
            parts.append(room[: counts[0]].copy())
            spent += int(counts[1])
            if self.halt[0]:
                parts.append(given)
                break
        left = np.concatenate(parts) if parts else new_nodes(0)
        left[:, BOUND] *= self.unit
        return left, spent
