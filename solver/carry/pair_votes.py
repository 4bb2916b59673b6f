"""Which pairs of points a map is bent through: those that contradict it beyond its confidence are outvoted.

A map that is right with probability c within `BOUND` is taken to err by more than x with probability
(1 - c)^(x / BOUND), an exponential tail through the one value that is known. A pair that asks for a longer move than
that leaves a chance of `WRONG` is more likely a wrong click than right, and k pairs that ask for the same are k wrong
clicks: their chance is `WRONG`^k. So a pair alone bends a certain map a little, an uncertain one far, and several that
agree bend any map.
"""

from __future__ import annotations

import numpy as np

from ..align.result.confidence import BOUND
from ..surface.mesh import Booleans, Floats, Integers
from ..surface.statistics import weighted_median

WRONG = 0.01
"""Chance that a pair is wrong before the map is asked: a person's slip. Chosen, not measured; at a confidence of 0.99,
the highest that there is, one pair moves the map by 2 % of the diagonal, at 0.9 by 4 %, at one half by 13 %."""

SUREST = 0.99
"""No map is surer: the confidence of a vertex against which nothing speaks (`confidence.DENSE`)."""

NEIGHBOURS = 2
"""Other pairs near by that have to agree to outvote one: between two that contradict each other nothing decides."""

BESIDE = 0.2
"""Nearness from which on the moves of two pairs are compared: half a reach apart."""


def limits(confidence: Floats, count: int | Floats = 1) -> Floats:
    """Return by how much, (l,), in diagonals, so many pairs that agree move a map of that confidence, (l,), at most."""
    with np.errstate(divide="ignore"):
        return BOUND * count * np.log(WRONG) / np.log1p(-np.clip(confidence, 0, SUREST))


def outvoted(moves: Floats, confidence: Floats, nearness: Floats) -> Booleans:
    """Return which pairs, (l,), are left out.

    Parameters
    ----------
    moves : (l, 3) float64
        How far each pair asks its point of the map to move, in diagonals of the source.
    confidence : (l,) float64
        Of the map there.
    nearness : (l, l) float64
        How much of a move of either the other makes, in [0, 1], symmetric; 1 on the diagonal.
    """
    length, among = np.linalg.norm(moves, axis=1), np.arange(len(moves))
    alone = limits(confidence)
    # two support each other where either, followed alone, leaves of the other what the map may err by
    left = np.linalg.norm(moves[:, None] - nearness[:, :, None] * moves[None], axis=2)
    supports = left <= np.minimum(alone, length)[:, None]
    agreeing = (supports & supports.T & (nearness > 0)).sum(axis=1)  # itself among them
    followed = length <= limits(confidence, np.maximum(agreeing, 1))
    while followed.any():  # what the others explain
        rest = np.array([_left(i, moves, nearness, among[followed & (among != i)]) for i in among])
        more = ~followed & (rest <= alone)
        if not more.any():
            break
        followed |= more
    while (worst := _contradicted(moves, confidence, nearness, followed)) is not None:
        followed[worst] = False
    return ~followed


def _left(i: int, moves: Floats, nearness: Floats, by: Integers) -> float:
    """Return how much of a pair's move is left once the map is bent through others."""
    if not len(by):
        return float(np.linalg.norm(moves[i]))
    bent = np.linalg.lstsq(nearness[np.ix_(by, by)], moves[by], rcond=1e-3)[0]
    return float(np.linalg.norm(moves[i] - nearness[i, by] @ bent))


def _contradicted(moves: Floats, confidence: Floats, nearness: Floats, followed: Booleans) -> int | None:
    """Return the pair that those around it contradict most, None if they contradict none.

    Near pairs that agree the map is surer than by itself: each vouches by its nearness.
    """
    worst, most, among = None, 1.0, np.arange(len(moves))
    for i in np.flatnonzero(followed):
        others = among[followed & (among != i)]
        near = others[nearness[i, others] > BESIDE]
        if len(near) < NEIGHBOURS:
            continue
        usual = np.array([weighted_median(axis, nearness[i, near]) for axis in moves[near].T])
        apart = float(np.linalg.norm(moves[i] - usual))
        agree = near[np.linalg.norm(moves[near] - usual, axis=1) < apart / 2]
        if len(agree) < NEIGHBOURS or 2 * len(agree) <= len(near):
            continue
        surer = 1 - (1 - confidence[i]) * float(np.prod(1 - nearness[i, agree]))
        beyond = apart / float(limits(np.array([surer]))[0])
        if beyond > most:
            worst, most = int(i), beyond
    return worst
