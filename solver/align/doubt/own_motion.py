"""Whether the target fits as well elsewhere on the source, where that is alike: what a search in discs may not see.

Where two surfaces show different pieces their discs are those of what is found to be common, so that another common
part is not seen; of what is long or deep, and round about an axis, a disc or sphere has little room for the far end;
and of something that is alike all around two pieces may be cut so that they fit each other wholly, though they are
others. The source, moved onto itself as a rigid body, asks none of that.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...bend.draft import facing, ready
from ...bend.pose import HELD, POSE_SETTLED
from ...flatten.sphere import Flat
from ...surface.barycentric import interpolated
from ...surface.mesh import Booleans, Floats, Integers
from ...surface.sampling import spread
from ...surface.superimposing import superimposing
from ..result.alignment import Alignment
from ..result.confidence import MATCHED, SURE
from ..surfaces.remark import Remark
from .decision import OPPOSITE
from .deep_inside import depths, difference, explained, felt_inside
from .likely_motion import BORNE_OUT, ELSEWHERE, LEAST, Likely
from .own_fit import FAR, OwnFit

ASKED = 200
"""Points of the target, about, that are moved."""

ROUNDS, FIRST = 10, 3
"""Closest point rounds, at most, in which a motion settles, and those in which points count from twice as far."""

SHARE = OPPOSITE
"""Share that lies there, beside what is matched, from which on that is as likely: as of opposite sides."""

ALIKE = 0.05
"""Share of their spread by which descriptors may differ more where two places are called alike, beside chance: it is
0.05 or less on 15 of 18 pairs of cut sheets with 2 to 4 sides that are nearly alike, as a map is fitted to the side it
is on; 0.06 on a sheet with hills, of which 89 % fit elsewhere, and whose map is right."""

EXACTLY = 0.93
"""Share of the moved points on the source, of those not past its boundaries, from which on less than `SHARE` of the
target speaks for a motion: what is asked of a plane of symmetry (`own_mirror.BORNE_OUT`)."""

AGAIN = 0.5
"""Share of the variance of the descriptors that has to be found again there besides: more of it than not, as small
smooth pieces of anything lie on others. Where motions are borne out `EXACTLY` it is 0.54 or more for sheets with three
and four like sides that are cut alike, as far as they are `ALIKE` there, and 0.46 or less on 98 pairs of faces and
brains, whose maps are right."""


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
    again : float
        Share of the variance of the descriptors that is found again there.
    """

    moved: float
    borne_out: float
    share: float
    worse: float
    chance: float
    again: float

    @property
    def open(self) -> bool:
        """Whether the target may be there as well."""
        told = self.share >= SHARE or (self.borne_out >= EXACTLY and self.again >= AGAIN)
        return told and self.worse <= max(self.chance, ALIKE)


def with_motions_open(found: Alignment) -> Alignment:
    """Return a map, with a word if the target fits as well where the source, moved as a rigid body, lies on itself."""
    if any(one.kind == "rival" for one in found.remarks):
        return found
    open_ = [one for one in motions(found) if one.open]
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
    source = found.source
    own = OwnFit(ready(source))
    diagonal = own.onto.mesh.diagonal
    face, barycentric = found.located[0][some], found.located[1][some]
    here = source.mesh.faces[face], barycentric
    points, normals, _ = own.onto.at(face, barycentric)
    points[~matched], normals[~matched] = _carried(found, some, matched, points)
    descriptors, wanted = found.source_descriptors, found.target_descriptors[some]
    depth = depths(found.target, found.target.mesh.vertices[some])
    depth = np.minimum(depth, depths(source, interpolated(source.mesh.vertices, *here)))
    unlike_here = wanted - interpolated(descriptors, *here)
    likely = Likely(own, points, normals, (wanted, depth), (descriptors, _known_depths(source, own)))
    for turn, shift in likely.motions(SHARE):
        turn, shift = _settled(own, points, normals, turn, shift)
        there, up = points @ turn.T + shift, normals @ turn.T
        moved = np.linalg.norm(there - points, axis=1)
        borne_out, share = own.borne_out(there, up, np.ones(len(points), bool))
        back = moved.mean() < ELSEWHERE / 2  # slid to where it was, as smooth things do
        if back or borne_out < BORNE_OUT or share < LEAST * matched.mean():
            continue
        both = own.lying(there, up, FAR)[1] & matched
        face, barycentric = own.onto.nearest_point(there, up)
        elsewhere = source.mesh.faces[face], barycentric
        deep = depths(source, interpolated(source.mesh.vertices, *elsewhere))
        tells = felt_inside(np.minimum(depth, deep)) & both[:, None]
        unlike_there = wanted - interpolated(descriptors, *elsewhere)
        more = difference(unlike_there, tells) - difference(unlike_here, tells)
        more = more[tells.any(axis=1)]
        if len(more) < 4:
            continue
        yield Motion(
            float(moved.mean() / diagonal),
            borne_out,
            share / float(matched.mean()),
            float(more.mean()),
            float(SURE * more.std() / np.sqrt(len(more))),
            float(explained(wanted, unlike_there, tells)),
        )


def _known_depths(source: Flat, own: OwnFit) -> Floats:
    """Return how far vertices are from the next boundary, (n,), in roots of the area; 0 at those nobody asks for."""
    deep = np.zeros(len(source.mesh.vertices))
    deep[own.known] = depths(source, source.mesh.vertices[own.known])
    return deep


def _carried(found: Alignment, some: Integers, matched: Booleans, places: Floats) -> tuple[Floats, Floats]:
    """Return where the points that are not matched lie, (q, 3), and their normals, (q, 3), as the others are moved."""
    whole, _ = facing(found.target.mesh, found.mobius.reflected)
    here = whole.vertices[some]
    pose = superimposing(here[matched], places[matched], scaled=True)
    return pose(here[~matched]), whole.vertex_normals()[some[~matched]] @ pose.turn


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
