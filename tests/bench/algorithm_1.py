"""The baseline: the paper's Algorithm 1 as printed, compiled, with the stopping rule that proves.

Le, Chin and Suter (2016): the bound of eq. 15-32, every pair looked at in every cell, arcs stabbed by sorting and
sweeping, best first, U(z) at the centre of each cell. Numba, one thread, fastmath off. Neither clever nor careless.
"""

import heapq
import time

import numpy as np
from numba import njit

TURN = 2 * np.pi


@njit(cache=True)
def stab(start, stop, point, n, points):
    """The most points that one rotation stabs, arcs given by their ends in [0, 2 pi) and beyond."""
    theta = np.empty(4 * n)
    owner = np.empty(4 * n, np.int64)
    m = 0
    for i in range(n):
        a = start[i] % TURN
        b = a + (stop[i] - start[i])
        if b - a >= TURN:
            a, b = 0.0, TURN
        theta[m], owner[m] = a, point[i] + 1
        theta[m + 1], owner[m + 1] = min(b, TURN), -point[i] - 1
        m += 2
        if b > TURN:
            theta[m], owner[m] = 0.0, point[i] + 1
            theta[m + 1], owner[m + 1] = b - TURN, -point[i] - 1
            m += 2
    order = np.argsort(theta[:m])
    holds = np.zeros(points, np.int64)
    level, best, where = 0, 0, 0.0
    for i in order:
        if owner[i] > 0:
            j = owner[i] - 1
            holds[j] += 1
            if holds[j] == 1:
                level += 1
                if level > best:
                    best, where = level, theta[i]
        else:
            j = -owner[i] - 1
            holds[j] -= 1
            if holds[j] == 0:
                level -= 1
    return best, where


@njit(cache=True)
def bound(mx, my, bx, by, e, cx, cy, r, start, stop, point):
    """The paper's upper bound over the disc (c, r); with r = 0, U(c) itself."""
    n = 0
    for j in range(len(mx)):
        m, c = complex(mx[j], my[j]), complex(cx, cy)
        away, facing = m - c, 1 - m.conjugate() * c
        a, f, size = abs(away), abs(facing), abs(m)
        alpha = np.angle(away) + np.angle(facing)
        delta = np.pi
        if r < a and size * r < f:
            delta = np.arcsin(r / a) + np.arcsin(size * r / f)
        near, far = 0.0, 1.0
        span = f * f - size * size * r * r
        if size * r < f:
            middle = abs(m * r * r - away * facing.conjugate()) / span
            spread = r * (1 - size * size) / span
            near, far = max(middle - spread, 0.0), min(middle + spread, 1.0)
        for k in range(len(bx)):
            b = np.sqrt(bx[k] * bx[k] + by[k] * by[k])
            if near > b + e + 1e-12 or far < b - e - 1e-12:
                continue
            rho = min(max(np.sqrt(max(b * b - e * e, 0.0)), near), far)
            beta = np.pi
            if rho + b > e and rho * b > 0:
                beta = np.arccos(min(max((rho * rho + b * b - e * e) / (2 * rho * b), -1.0), 1.0))
            middle = np.arctan2(by[k], bx[k]) - alpha
            start[n], stop[n], point[n] = middle - delta - beta - 1e-12, middle + delta + beta + 1e-12, j
            n += 1
    return stab(start, stop, point, n, len(mx))


@njit(cache=True)
def run(mx, my, bx, by, e, z_max, time_limit_nodes):
    """Best-first branch and bound; returns value, bound, nodes."""
    room = len(mx) * len(bx)
    start, stop, point = np.empty(room), np.empty(room), np.empty(room, np.int64)
    value = -1
    heap = [(-len(mx), 1.0, 0.0, 0.0)]
    nodes = 0
    while len(heap) > 0 and -heap[0][0] > value and nodes < time_limit_nodes:
        parent, size, x, y = heapq.heappop(heap)
        half = size / 2
        for q in range(4):
            cx, cy = x + half * (2 * (q % 2) - 1), y + half * (2 * (q // 2) - 1)
            if max(abs(cx) - half, 0.0) ** 2 + max(abs(cy) - half, 0.0) ** 2 > z_max * z_max:
                continue
            nodes += 1
            upper = bound(mx, my, bx, by, e, cx, cy, half * np.sqrt(2.0), start, stop, point)[0]
            if upper <= value:
                continue
            if cx * cx + cy * cy <= z_max * z_max:
                value = max(value, bound(mx, my, bx, by, e, cx, cy, 0.0, start, stop, point)[0])
            heapq.heappush(heap, (max(-upper, parent), half, cx, cy))
    top = value
    if len(heap) > 0 and -heap[0][0] > value:
        top = -heap[0][0]
    return value, top, nodes


def algorithm_1(source, target, radius, z_max, most_nodes=1 << 62):
    """Return value, upper bound, nodes and seconds of the plain search (Euclidean discs, all weights 1)."""
    begun = time.perf_counter()
    value, upper, nodes = run(
        np.ascontiguousarray(source.real),
        np.ascontiguousarray(source.imag),
        np.ascontiguousarray(target.real),
        np.ascontiguousarray(target.imag),
        float(radius),
        z_max,
        most_nodes,
    )
    return value, upper, nodes, time.perf_counter() - begun
