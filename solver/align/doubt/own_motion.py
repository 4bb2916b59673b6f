"""Whether the target fits as well elsewhere on the source, where that is alike: what a search in discs may not see.

Where two surfaces show different pieces their discs are those of what is found to be common, so that another common
part is not seen; and of what is long and round about an axis a disc or sphere has little room for the far end. The
source, moved onto itself as a rigid body, asks neither.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...bend.draft import facing, ready
from ...bend.pose import HELD, POSE_SETTLED
from ...surface.mesh import Booleans, Floats, Integers
from ...surface.sampling import spread
from ..result.agreement import descriptor_distance
from ..result.alignment import Alignment
from ..result.confidence import MATCHED, SURE
from ..surfaces.remark import Remark
from .decision import OPPOSITE
from .own_fit import FAR, OwnFit

ASKED, ROUGHLY_ASKED = 200, 100
"""Points of the target, about, that are moved: where a motion settles, and before that."""

PLACES, TURNS = 200, 36
"""Points of the source to which the middle one is moved, and turns there, 10 degrees from each other."""

MOTIONS = 8
"""Motions that are fitted, each another one than those before."""

ROUNDS, FIRST = 10, 3
"""Closest point rounds, at most, in which a motion settles, and those in which points count from twice as far."""

ELSEWHERE = 0.2
"""Mean distance, in roots of the area, by which points are moved if another motion is meant: some of those tried."""

BORNE_OUT = 0.75
"""Share of the moved points that lie on the source, of those not past its boundaries, from which on it may be alike
there. Of 18 partial pairs of faces none has any such motion."""

SHARE = OPPOSITE
"""Share that lies there, beside what is matched, from which on that is as likely: as of opposite sides."""

WRONG = 0.03
"""Share of the source's diagonal by which a map has to err to be called wrong."""


ALIKE = 0.05
"""Share of their spread by which descriptors may differ more where two places are called alike, beside chance: it is
0.05 or less on 15 of 18 pairs of cut sheets with 2 to 4 sides that are nearly alike, as a map is fitted to the side it
is on; 0.06 on a sheet with hills, of which 89 % fit elsewhere, and whose map is right."""


@dataclass(frozen=True)
class Motion:
    """Another place where the target fits.

    Attributes
    ----------
    moved : float
        How far on average, as a share of the source's diagonal.
    borne_out, share : float
        Share of the points that lie on the source: of those not past its boundaries, and beside those that match.
    worse : float
        By how much descriptors differ more there, on average, in their spread.
    chance : float
        Up to which `worse` may be by chance, one-sided, 95 %.
    """

    moved: float
    borne_out: float
    share: float
    worse: float
    chance: float


def with_motions_open(found: Alignment) -> Alignment:
    """Return a map, with a word if the target fits as well where the source, moved as a rigid body, lies on itself.

    Asked only of what is matched in part, and of closed surfaces.
    """
    partial = found.overlap is not None or any(one.kind == "partial" for one in found.remarks)
    if not (partial or found.source.domain.closed) or any(one.kind == "rival" for one in found.remarks):
        return found
    open_ = [one for one in motions(found) if one.worse <= max(one.chance, ALIKE)]
    if not open_:
        return found
    most = max(one.moved for one in open_)
    text = (
        f"ambiguous: the target fits as well where it is turned or moved by {100 * most:.0f} % of the source's "
        "diagonal; is the surface alike there?"
    )
    return found.annotated(remarks=(*found.remarks, Remark("rival", text)))


def motions(found: Alignment) -> Iterator[Motion]:
    """Yield other places where what is matched lies on the source."""
    used = np.flatnonzero(found.target.mesh.used)
    some = used[spread(found.target.mesh.vertices[used], ASKED)] if len(used) > ASKED else used
    matched = found.confidence[some] >= MATCHED
    if matched.sum() < 4:
        return
    own = OwnFit(ready(found.source))
    diagonal = own.onto.mesh.diagonal
    face, barycentric = found.located
    face, barycentric = face[some], barycentric[some]
    points, normals, _ = own.onto.at(face, barycentric)
    points[~matched], normals[~matched] = _carried(found, some, matched, points)
    wanted = found.target_descriptors[some]

    def unlike(at: tuple[Integers, Floats], rows: Booleans) -> Floats:
        return descriptor_distance(found.source, found.source_descriptors, wanted[rows], at[0][rows], at[1][rows])

    for turn, shift in _likely(own, points, normals):
        turn, shift = _settled(own, points, normals, turn, shift)
        there, up = points @ turn.T + shift, normals @ turn.T
        moved = np.linalg.norm(there - points, axis=1)
        borne_out, share = own.borne_out(there, up, np.ones(len(points), bool))
        if borne_out < BORNE_OUT or share < SHARE * matched.mean() or moved.mean() < WRONG * diagonal:
            continue
        both = own.lying(there, up, FAR)[1] & matched
        if both.sum() < 4:
            continue
        more = unlike(own.onto.nearest_point(there, up), both) - unlike((face, barycentric), both)
        yield Motion(
            float(moved.mean() / diagonal),
            borne_out,
            share / float(matched.mean()),
            float(more.mean() / np.sqrt(wanted.shape[1])),
            float(SURE * more.std() / np.sqrt(len(more) * wanted.shape[1])),
        )


def _carried(found: Alignment, some: Integers, matched: Booleans, places: Floats) -> tuple[Floats, Floats]:
    """Return where the points that are not matched lie, (q, 3), and their normals, (q, 3), as the others are moved."""
    whole, _ = facing(found.target.mesh, found.mobius.reflected)
    here, there = whole.vertices[some], places[matched]
    first, second = here[matched].mean(axis=0), there.mean(axis=0)
    turn = Rotation.align_vectors(there - second, here[matched] - first)[0]
    growth = np.linalg.norm(there - second) / np.linalg.norm(here[matched] - first)
    return turn.apply(here[~matched] - first) * growth + second, turn.apply(whole.vertex_normals()[some[~matched]])


def _likely(own: OwnFit, points: Floats, normals: Floats) -> Iterator[tuple[Floats, Floats]]:
    """Yield motions, each another one, that the cells bear out best: a rotation, (3, 3), and a shift, (3,), each."""
    middle = int(np.argmin(((points - points.mean(axis=0)) ** 2).sum(axis=1)))
    every = slice(None, None, -(-len(points) // ROUGHLY_ASKED))
    some, facing = points[every], normals[every]
    here = _frame(normals[middle])
    ends = slice(None, None, -(-len(own.points) // PLACES))
    spins = Rotation.from_rotvec(np.outer(2 * np.pi * np.arange(TURNS) / TURNS, [0.0, 0.0, 1.0])).as_matrix()
    turns, shifts, worths = [], [], []
    for end, up in zip(own.points[ends], own.normals[ends], strict=True):
        turn = _frame(up) @ spins @ here.T
        shift = end - points[middle] @ turn.transpose(0, 2, 1)
        moved = np.einsum("kij,qj->kqi", turn, some) + shift[:, None]
        lies, beyond = own.roughly(moved, np.einsum("kij,qj->kqi", turn, facing))
        lies &= ~beyond
        borne_out = lies.sum(axis=1) / np.maximum((~beyond).sum(axis=1), 1)
        elsewhere = np.linalg.norm(moved - some, axis=2).mean(axis=1) > ELSEWHERE
        worths.append(np.where(elsewhere, borne_out * lies.mean(axis=1), 0.0))
        turns.append(turn)
        shifts.append(shift)
    turn, shift, worth = np.concatenate(turns), np.concatenate(shifts), np.concatenate(worths)
    for _ in range(MOTIONS):
        first = int(np.argmax(worth))
        if worth[first] < BORNE_OUT**2 * SHARE:  # some degrees away from one that is borne out
            return
        yield turn[first], shift[first]
        moved = np.einsum("kij,qj->kqi", turn, some[::10]) + shift[:, None]
        worth[np.linalg.norm(moved - moved[first], axis=2).mean(axis=1) < ELSEWHERE / 2] = 0


def _frame(up: Floats) -> Floats:
    """Return a right-handed frame, (3, 3), in columns, the third of which is a unit vector."""
    side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(up, side), up], axis=1)


def _settled(own: OwnFit, points: Floats, normals: Floats, turn: Floats, shift: Floats) -> tuple[Floats, Floats]:
    """Return a motion fitted to the nearest points of the surface, in their tangent planes."""
    for k in range(ROUNDS):
        there, facing = points @ turn.T + shift, normals @ turn.T
        other, lies = own.lying(there, facing, FAR if k > FIRST else 2 * FAR)
        if lies.sum() < 6:
            break
        x, up = there[lies], facing[lies]
        arm = x - x.mean(axis=0)
        moves = np.concatenate([up, np.cross(arm, up)], axis=1)
        # held a little, so that what slides freely stays
        held = HELD * len(x) * np.eye(6)
        step = np.linalg.solve(moves.T @ moves + held, (up * (other[lies] - x)).sum(axis=1) @ moves)
        more = Rotation.from_rotvec(step[3:]).as_matrix()
        shift = (shift - x.mean(axis=0)) @ more.T + x.mean(axis=0) + step[:3]
        turn = more @ turn
        if k > FIRST and np.linalg.norm(step) < POSE_SETTLED:
            break
    return turn, shift
