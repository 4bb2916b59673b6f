"""Real heads of characters: every part finds its counterpart on another person, and the skin is none the worse."""

import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

ROOT = Path(__file__).resolve().parents[2]
for folder in (ROOT, ROOT / "tests" / "solver"):
    if str(folder) not in sys.path:
        sys.path.append(str(folder))

from solver import AlignSettings, align, correspond, prepare  # noqa: E402
from solver.align.surfaces.surface_file import load_surface, save_surface  # noqa: E402
from tests.bench.heads.people import read_head  # noqa: E402
from tests.bench.heads.scores import errors  # noqa: E402
from tests.bench.heads.targets import target_of  # noqa: E402
from tests.bench.paper.data import DATA, absent  # noqa: E402

SETTINGS = AlignSettings(reflect="never")


@pytest.mark.parametrize(("source", "target"), [("mpfb_woman", "mpfb_man"), ("ict_2", "ict_1")])
def test_every_part_of_a_head_finds_its_counterpart(source: str, target: str, tmp_path: Path) -> None:
    for name in (source, target):
        if reason := absent(f"heads/{name}.npz"):
            pytest.skip(reason)
    head, made = read_head(DATA / "heads", source), target_of(read_head(DATA / "heads", target))
    surface = prepare(head.mesh, SETTINGS)
    save_surface(tmp_path / "head.npz", surface)
    found = align(load_surface(tmp_path / "head.npz"), made.mesh, SETTINGS)
    assert found.whole is not None
    whole = found.whole
    own = {
        (
            int(head.part[whole.source.of_vertex == pair.source][0]),
            int(made.part[whole.target.of_vertex == pair.target][0]),
        )
        for pair in whole.pairs
        if pair.source is not None and pair.target is not None
    }
    assert own == {(k, k) for k in range(int(head.part.max()) + 1)}
    correspondence = correspond(found)
    error = errors(head, made, correspondence)
    by_part = np.array([np.nanmean(error[made.part == k]) for k in range(len(own))])
    assert by_part[0] < 1.5
    assert by_part[1:].max() < 0.4
    # no vertex of any part has its point on another
    on = head.part_of_triangle[correspondence.face]
    assert (on[correspondence.face >= 0] == made.part[correspondence.face >= 0]).all()
    assert found.seconds["parts"] < sum(found.seconds.values()) / 2
