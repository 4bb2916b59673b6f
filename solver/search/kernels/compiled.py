"""kernels.c through ctypes. The calls let go of Python's lock, so that threads run them side by side."""

from __future__ import annotations

import copy
import ctypes
import importlib
import logging
import threading
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np

from ...surface.mesh import Floats, Integers, Places
from ..bounds import reaches, tangents
from ..matching import Matching
from ..watch import Halt, look
from .layout import one_row, own_rows, sector_grid, sectors
from .nodes import BOUND, new_nodes

INTERFACE = 13
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
    for prefix, centres in (("mobius", 2), ("sphere", 1)):
        declared: tuple[tuple[str, type | None, list[type]], ...] = (
            ("work_bytes", _I64, [_I64, _I64]),
            ("bounds", None, [_POINTER, _POINTER, _I64, ctypes.c_int32, _POINTER, _I64]),
            ("raster_bytes", _I64, [_I64]),
            ("raster", None, [_POINTER]),
            ("own_raster", None, [_POINTER]),
            ("rotations", None, [*[_POINTER] * (5 + centres), _I64, _F64, _POINTER, _I64]),
            ("expand", _I64, [_POINTER, _POINTER, _I64, _F64, _I64, _POINTER, _I64, *[_POINTER] * 2, _I64]),
        )
        for name, result, arguments in declared:
            function = getattr(loaded, f"{prefix}_{name}")
            function.restype, function.argtypes = result, arguments
    loaded.mobius_images.restype = loaded.sphere_images_of.restype = None
    loaded.mobius_images.argtypes = [_I64, _POINTER, _POINTER, _F64, _F64, _F64, _F64, _F64, *[_POINTER] * 4]
    loaded.sphere_images_of.argtypes = [_I64, *[_POINTER] * 8]
    loaded.boxes_bounds.restype, loaded.boxes_expand.restype = None, _I64
    loaded.boxes_bounds.argtypes = [_POINTER, _POINTER, _I64, _F64, _POINTER]
    expansion = [_POINTER, _POINTER, _I64, _I64, _F64, _F64, _I64, _POINTER, _I64, _POINTER, _POINTER, _I64]
    loaded.boxes_expand.argtypes = expansion
    return loaded


class CompiledKernels:
    """The kernels for one matching, in C; see `ReferenceKernels` for the same in numpy.

    Weights and bounds are whole numbers of `Matching.unit` on the other side.
    """

    name = "compiled"
    prefix = "mobius"
    structure: type[_Problem] = _Problem

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
        call = self._function
        self.unit = problem.unit
        self.points = len(problem.source)
        self.halt = np.zeros(1, np.int32) if halt is None else halt
        # about one target point in two of its sectors
        rings = int(np.clip(2 ** np.round(0.5 * np.log2(max(problem.count // self.points, 1))), 8, MOST_RINGS))
        discs, b = self._discs(problem)
        inner, outer, turn, widest = discs[:, :4].T
        row = one_row(problem)
        shared = row is not None
        arrays: dict[str, np.ndarray | None] = {**self._source(problem), "halt": self.halt}
        if shared:
            row = row[np.argsort(sectors(b[row], turn[row], rings), kind="stable")]
            b, turn, inner, outer, widest = (x[row] for x in (b, turn, inner, outer, widest))
            arrays |= {
                "start": np.zeros(self.points, np.int64),
                "stop": np.full(self.points, len(row), np.int64),
                "discs": discs[row],
                **self._places(problem, row),
            }
            typical = float(np.median(widest)) if len(row) else 1.0
        else:
            disc, reach, units, typical = own_rows(problem, inner, outer, widest, self._check)
            starts = problem.starts
            arrays |= {"start": starts[:-1], "stop": starts[1:], "discs": discs, "disc": disc, "reach": reach}
            arrays |= self._places(problem, np.arange(len(discs)))
            arrays |= {"weight": units}
        finest = 1
        levels = int(np.clip(np.ceil(np.log2(1 / (SHARPNESS * typical * ANGLES))) + 1, 1, MOST_LEVELS))
        if shared:
            arrays["raster"] = np.empty(call("raster_bytes")(levels) // 8, np.uint64)
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
        self._problem = self.structure(
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
            call("raster")(ctypes.addressof(self._problem))
        elif "own" in arrays:
            call("own_raster")(ctypes.addressof(self._problem))
        self._check()

    def _function(self, name: str) -> Any:
        """Return a function of the library."""
        return getattr(self._library, f"{self.prefix}_{name}")

    def _source(self, problem: Any) -> dict[str, np.ndarray | None]:
        """Return the coordinates of the source points, by their names in kernels.c."""
        return {"mx": problem.source.real, "my": problem.source.imag}

    def _discs(self, problem: Any) -> tuple[Floats, Floats]:
        """Return what kernels.c wants to know of the match discs, (N2, 8), and the modulus of their centres, (N2,)."""
        inner, outer = reaches(problem.centres, problem.radii)
        tangent, wide = tangents(problem.centres, problem.radii)
        b, turn = np.abs(problem.centres), np.angle(problem.centres) / (2 * np.pi)
        wide /= 2 * np.pi
        widest = np.where(tangent < 0, 1, wide)
        return np.stack([inner, outer, turn, widest, tangent, wide, b, problem.radii], axis=1), b

    def _places(self, problem: Any, row: Integers) -> dict[str, np.ndarray | None]:
        """Return what else kernels.c wants to know of the discs, in the order of `row`."""
        del problem, row
        return {}

    def _rows(self, count: int) -> Floats:
        """Return empty nodes."""
        return new_nodes(count)

    def reflected(self) -> Self:
        """Return the kernels for the conjugated source: discs and rasters are the same ones."""
        other = copy.copy(self)
        my = self._arrays["my"]
        assert my is not None
        conjugated = -my
        other._arrays = self._arrays | {"my": conjugated}
        other._problem = self.structure.from_buffer_copy(self._problem)
        other._problem.my = conjugated.ctypes.data
        return other

    def _check(self) -> None:
        """Raise Halted if there is no time to go on: what was begun is not to be used."""
        look(self.halt)

    def _work(self) -> int:
        """Return the address of this thread's working memory."""
        if not hasattr(self._local, "memory"):
            self._local.memory = np.empty(self._function("work_bytes")(self.points, ARENA), np.uint8)
            self._local.left = self._rows(2 * STACK)
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
        self._function("bounds")(
            ctypes.addressof(self._problem), nodes.ctypes.data, len(nodes), raster, self._work(), ARENA
        )
        nodes[:, BOUND] *= self.unit
        return nodes

    def _centres(self, z: Any) -> tuple[np.ndarray, ...]:
        """Return where rotations are asked for, as arrays for kernels.c."""
        return np.ascontiguousarray(z.real), np.ascontiguousarray(z.imag)

    def rotations(self, z: Places, value: float = -1.0, windows: Floats | None = None) -> tuple[Floats, Floats]:
        """Return, for each z, (C,), what a good theta is worth at most, and that theta.

        Worth 0: not above `value`, or not above the z before it.

        windows: (C, 2), the first rotation to look at and how many from there on, in turns; default: all.
        """
        windows = np.tile([0.0, 1.0], (len(z), 1)) if windows is None else windows
        start, width = np.ascontiguousarray(windows[:, 0]), np.ascontiguousarray(windows[:, 1])
        centres = self._centres(z)
        turns, bounds = np.zeros(len(z)), np.zeros(len(z))
        self._function("rotations")(
            ctypes.addressof(self._problem),
            *(x.ctypes.data for x in centres),
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
            done = self._function("expand")(
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
        left = np.concatenate(parts) if parts else self._rows(0)
        left[:, BOUND] *= self.unit
        return left, spent
