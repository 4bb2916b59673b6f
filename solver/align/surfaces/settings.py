"""What `align` can be told."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AlignSettings:
    """What `align` can be told; the defaults suit scans of one kind of object.

    Attributes
    ----------
    samples : int
        Source points of the search.
    targets : int
        Target points of the search; the match discs around them cover the target.
    radius : float, optional
        Hyperbolic radius of the match discs, in (0, 1). Default: each point's distance to its second nearest neighbour.
    z_max : float
        Bound on |z|, in (0, 1): how far the centres of the two discs may lie apart.
    h_max : float
        Bound on |h| for closed surfaces, in [0, 0.9]; both spheres are centred by area, and right maps of cortices,
        heads and inflated surfaces have |h| below 0.15. 0: rotations alone.
    compatible : float
        Share of the target that a source point may match, in (0, 1]: what is most like it. On 7 sets of pairs 87 to
        98 % of the counterparts are within 0.2, and beyond they are no likelier than chance (`tests/bench/ranks.py`).
    reflect : str
        "never", "always" or "auto": both orientations are searched; the reflected one is taken where it wins clearly
        and, with dense refinement, no map that is not reflected fits.
    reflect_margin : float
        Share of the samples by which a reflection has to win, and below which an orientation, or a rival that maps
        everything elsewhere, is called ambiguous. On 8 pairs of nearly mirror symmetric faces the orientations
        differ by at most 0.02, on 8 pairs of teeth the right one wins by at least 0.10; rivals lie 0.14 or more below
        the winner on all 16, at most 0.013 on sheets with a rotational symmetry.
    take_rival : bool
        Continue with the best rival in place of the winner, where the winner is the wrong one of an ambiguous pair.
    time_limit : float, optional
        Seconds for each search.
    most_nodes : int, optional
        Cells for each search: a limit that gives the same on every machine, however busy it is.
    gap : float
        Share of its value within which a search in discs ends that is not proved after 100,000 cells, which is said. 0:
        not before it is proved, or time is up.
    thorough : bool
        Search the orientation that loses, and for a rival, beyond what decides whether they come within
        `reflect_margin`: then their values are the best there are. Dense refinement, which may go on with one of them,
        does so whatever this says.
    threads : int, optional
        Of each search, which finds the same with any number; by default one for each processor. Source and target, if
        large, are prepared at the same time unless it is 1.
    refine : str
        "none": the search's transformation; "mobius": improved on all vertices; "dense": then the target is bent onto
        the source, smoothly and without folds.
    parts : str
        "all": the smaller parts of the meshes, too, are paired and aligned, each with its counterpart; "main": only
        the largest ones.
    fill_holes : bool
        Allow meshes with openings and handles: all boundary loops but the outer one are closed for the computation, and
        small handles cut and closed. Without it such a mesh is refused.
    cut : bool
        Of a surface that no disc carries as a whole, as of a body, take the piece that fits the other one.
    source_outer, target_outer : int, optional
        A vertex on the loop that is to be the outer one; by default the longest loop is.
    """

    samples: int = 100
    targets: int = 1000
    radius: float | None = None
    z_max: float = 0.8337  # tanh(1.2)
    h_max: float = 0.2
    compatible: float = 0.2
    reflect: str = "auto"
    reflect_margin: float = 0.06
    take_rival: bool = False
    time_limit: float | None = 60.0
    most_nodes: int | None = None
    gap: float = 0.005
    thorough: bool = True
    threads: int | None = None
    refine: str = "dense"
    parts: str = "all"
    fill_holes: bool = True
    cut: bool = True
    source_outer: int | None = None
    target_outer: int | None = None

    def __post_init__(self) -> None:
        for name, allowed in (
            ("reflect", ("never", "always", "auto")),
            ("refine", ("none", "mobius", "dense")),
            ("parts", ("all", "main")),
        ):
            if getattr(self, name) not in allowed:
                raise ValueError(f"{name} must be one of {', '.join(allowed)}, not '{getattr(self, name)}'")
        if self.samples < 3 or self.targets < 3:
            raise ValueError("samples and targets must be at least 3: a Möbius transformation has three parameters")
        if not 0 < self.z_max < 1:
            raise ValueError(f"z_max must lie between 0 and 1, not {self.z_max}")
        if not 0 <= self.h_max <= 0.9:
            raise ValueError(f"h_max must lie between 0 and 0.9, not {self.h_max}")
        if self.radius is not None and not 0 < self.radius < 1:
            raise ValueError(f"radius must lie between 0 and 1, not {self.radius}")
        if self.time_limit is not None and not self.time_limit >= 0:
            raise ValueError(f"time_limit must be a number of seconds, not {self.time_limit}")
        if self.most_nodes is not None and self.most_nodes < 1:
            raise ValueError(f"most_nodes must be at least 1, not {self.most_nodes}")
        if not self.gap >= 0:
            raise ValueError(f"gap must be a share of the value, 0 or more, not {self.gap}")
        if self.threads is not None and self.threads < 1:
            raise ValueError(f"threads must be at least 1, not {self.threads}")
        if not 0 < self.compatible <= 1:
            raise ValueError(f"compatible must be a share above 0 and at most 1, not {self.compatible}")
