"""Collections, done by threads and by processes: nothing twice, what fails is named, and what is killed goes on."""

import importlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from families import grown, specimen

from solver import AlignSettings, MeshError, TriangleMesh, load_map
from solver.collection import Plan, Specimen, Told, collect, processes
from solver.collection.engine import AHEAD, completed
from solver.collection.tasks import Compare
from solver.collection.work import Work
from solver.collection.worker import Elsewhere

collecting = importlib.import_module("solver.collection.collect")  # `solver.collection.collect` is the function
ROOT = Path(__file__).resolve().parents[3]
ROUGH = AlignSettings(refine="mobius", samples=40, targets=200)
DENSE = AlignSettings(samples=40, targets=200)
Family = Callable[[int], list[Specimen]]


class Counting(ThreadPoolExecutor):
    """Threads that note what they are given."""

    def __init__(self) -> None:
        super().__init__(2)
        self.tasks: list[dict] = []

    def submit(self, fn, /, *given, **named) -> Future:
        self.tasks.append(given[0])
        return super().submit(fn, *given, **named)


def counted(family: list[Specimen], root: Path, **given):
    pools: list[Counting] = []

    def opened() -> Executor:
        pools.append(Counting())
        return pools[-1]

    found = collect(family, root, opened, at_a_time=2, **given)
    return found, [task for pool in pools for task in pool.tasks]


def test_all_pairs_are_right_and_none_is_done_twice(family: Family, tmp_path: Path) -> None:
    specimens = family(5)
    found, tasks = counted(specimens, tmp_path, settings=ROUGH)
    assert len(tasks) == 5 + 10
    assert len(found.figures) == 10
    assert not found.failures
    assert all(known.certified for known in found.figures)
    # every third is mirrored
    for (a, b), known in zip(found.edges, found.figures, strict=True):
        assert known.mobius.reflected == ((a % 3 == 2) != (b % 3 == 2))
    assert not found.suspects.any()
    assert len(found.cycles[0]) == 10
    distances = found.distances()
    assert np.isfinite(distances).all()
    np.testing.assert_array_equal(distances, distances.T)

    again, tasks = counted(specimens, tmp_path, settings=ROUGH)
    assert tasks == []
    assert again.figures == found.figures
    np.testing.assert_array_equal(again.errors, found.errors)

    # one that has changed, and one more: their pairs alone
    other = [specimens[0], *family(6)[4:], *specimens[1:3]]
    changed = Specimen("sheet-3", "new", lambda: (family(7)[6].read()[0], None))
    _, tasks = counted([*other, changed], tmp_path, settings=ROUGH)
    assert [task["kind"] for task in tasks].count("prepare") == 2
    assert len(tasks) == 2 + 5 + 4

    # other settings: all pairs, and no specimen
    _, tasks = counted(specimens[:3], tmp_path, settings=AlignSettings(refine="none", samples=40, targets=200))
    assert [task["kind"] for task in tasks] == ["compare"] * 3


def test_a_star_and_a_tree_have_dense_maps(tmp_path: Path) -> None:
    specimens = [specimen(f"sheet-{k}", grown(k, 300)) for k in range(3)]
    star, tasks = counted(specimens, tmp_path / "a", settings=DENSE, plan=Plan("star", "sheet-1"))
    # to each of the others, and the ring of the others, which closes triangles
    assert [task["kind"] for task in tasks] == ["prepare"] * 3 + ["compare"] * 3 + ["compare"] * 2
    assert star.routes == {0: [1, 0], 1: [1], 2: [1, 2]}
    assert sum(known.dense for known in star.figures) == 2
    assert np.isfinite(star.errors).all()
    tree, tasks = counted(specimens, tmp_path / "b", settings=DENSE, plan=Plan("tree"))
    assert len(tasks) == 3 + 3 + 2
    assert sum(known.dense for known in tree.figures) == 2
    # the file of a dense map is one as any other
    source, target = (tree.names[k] for k in next(e for e, x in zip(tree.edges, tree.figures, strict=True) if x.dense))
    meshes = [specimen.read()[0] for name in (source, target) for specimen in specimens if specimen.name == name]
    assert load_map(tree.folder.dense_map(source, target), *meshes).confidence.mean() > 0.5
    # and if it is lost, it is made again, and no other
    tree.folder.dense_map(source, target).unlink()
    _, tasks = counted(specimens, tmp_path / "b", settings=DENSE, plan=Plan("tree"))
    assert len(tasks) == 1


def test_paths_are_laid_anew_round_dense_maps_that_turn_out_suspect(
    family: Family, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The dense maps here are Möbius maps that say they are dense, and the first of them is said to be wrong."""
    aligned, stages, wrong = Work.aligned, [], []

    def dense(work, stage, names, edges, settings):
        stages.append((stage, len(edges)))
        found = aligned(work, stage, names, edges, ROUGH)
        return {edge: replace(known, dense=stage == "dense maps") for edge, known in found.items()}

    def accusing(folder, names, found, edges, settings):
        wrong[:] = wrong or [edge for edge in edges if found[edge].dense][:1]
        return np.array([float(edge in wrong) for edge in edges]), (np.zeros((0, 3), int), np.zeros(0))

    monkeypatch.setattr(Work, "aligned", dense)
    monkeypatch.setattr(collecting, "_checked", accusing)
    found, _ = counted(family(3), tmp_path, settings=DENSE, plan=Plan("tree"))
    assert stages == [("pairs", 3), ("dense maps", 2), ("dense maps", 1)]
    # of three maps two were enough at first; the third replaces the one that is wrong, and is as dense as they are
    assert [known.dense for known in found.figures] == [True] * 3
    assert found.suspects.tolist() == [edge in wrong for edge in found.edges]
    walked = {(min(a, b), max(a, b)) for path in found.routes.values() for a, b in pairwise(path)}
    assert walked == {edge for edge, bad in zip(found.edges, found.suspects, strict=True) if not bad}


def test_searches_end_by_cells_not_by_the_clock(family: Family, tmp_path: Path) -> None:
    hurried = AlignSettings(refine="mobius", samples=40, targets=200, time_limit=0.0)
    found, _ = counted(family(2), tmp_path / "a", settings=hurried)
    assert found.figures[0].certified
    found, _ = counted(family(2), tmp_path / "b", settings=replace(hurried, most_nodes=1))
    assert not found.figures[0].certified
    assert found.figures[0].upper_bound > found.figures[0].value
    assert "with the work given" in " ".join(found.figures[0].warnings)


def test_what_fails_is_named_and_the_others_go_on(family: Family, tmp_path: Path) -> None:
    def unreadable() -> tuple[TriangleMesh, None]:
        raise OSError("the file is damaged")

    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    specimens = [*family(3), Specimen("gone", "x", unreadable), Specimen("tiny", "y", lambda: (flat, None))]
    told: list[Told] = []
    found, _ = counted(specimens, tmp_path, settings=ROUGH, tell=told.append)
    assert found.names == ["sheet-0", "sheet-1", "sheet-2"]
    assert set(found.failures) == {"gone", "tiny"}
    assert found.failures["gone"] == "the file is damaged"
    assert "subdivide" in found.failures["tiny"]
    assert {x.name for x in told if x.error} == {"gone", "tiny"}
    assert (told[-1].stage, told[-1].done, told[-1].total) == ("pairs", 3, 3)
    # a surface that is lost after it was prepared: its pairs fail, each by name
    (tmp_path / "surfaces" / "sheet-1.npz").write_bytes(b"no surface")
    (tmp_path / "pairs.jsonl").unlink()
    found, _ = counted(family(3), tmp_path, settings=ROUGH)
    assert set(found.failures) == {"sheet-0 to sheet-1", "sheet-1 to sheet-2"}
    assert "damaged" in found.failures["sheet-0 to sheet-1"]
    assert len(found.figures) == 1


def test_wrong_use_is_a_sentence(family: Family, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="two specimens are called 'sheet-0'"):
        counted([*family(2), *family(1)], tmp_path)
    with pytest.raises(ValueError, match="the template 'x' is none"):
        counted(family(2), tmp_path, plan=Plan("star", "x"))
    with pytest.raises(ValueError, match="fewer than two"):
        counted(family(1), tmp_path)
    with pytest.raises(ValueError, match="not 'some'"):
        Plan("some")


def test_half_a_line_at_the_end_is_no_line(family: Family, tmp_path: Path) -> None:
    counted(family(3), tmp_path, settings=ROUGH)
    path = tmp_path / "pairs.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole[:-30])
    found, tasks = counted(family(3), tmp_path, settings=ROUGH)
    assert [task["kind"] for task in tasks] == ["compare"]
    assert len(found.figures) == 3
    assert all(json.loads(line)["certified"] for line in path.read_text().splitlines())
    assert len(path.read_text().splitlines()) == 3


# -- processes ---------------------------------------------------------------------------------------------------------


def test_processes_find_the_same_as_threads(family: Family, tmp_path: Path) -> None:
    here, _ = counted(family(3), tmp_path / "a", settings=ROUGH)
    there = collect(family(3), tmp_path / "b", processes(2), settings=ROUGH, at_a_time=2)
    for one, other in zip(here.figures, there.figures, strict=True):
        assert (one.value, one.mobius, one.distance) == (other.value, other.mobius, other.distance)


def test_a_function_is_found_by_its_folder() -> None:
    """Pickled, it says nothing of this package's name."""
    import pickle

    sent = pickle.dumps(Elsewhere("run"))
    assert b"solver.collection.worker" not in sent
    assert pickle.loads(sent)({"kind": "compare", "given": {}})["error"]


def test_the_task_that_ends_its_process_is_found_and_the_others_are_done(tmp_path: Path) -> None:
    """Unpickling the task ends the process, as a lack of memory might."""
    done = dict(completed(iter(_deadly(tmp_path)), processes(2), 2))
    assert set(done) == set(range(8))
    assert "the process that worked on it ended" in done[3]["error"]
    assert all("no such file" in done[k]["error"].lower() for k in done if k != 3)


def _deadly(tmp_path: Path) -> list:
    fatal = Fatal("x", "y", {}, "")
    return [(k, fatal if k == 3 else Compare(str(tmp_path / "none"), "", {}, "")) for k in range(8)]


class Fatal(Compare):
    """Ends the process that it is unpickled in."""

    def __init__(self, *given) -> None:
        super().__init__(*given)
        object.__setattr__(self, "settings", _Mine())


class _Mine:
    def __reduce__(self):
        return os._exit, (9,)


SCRIPT = """
import sys
sys.path[:0] = [{root!r}, {root!r} + "/tests/solver"]
from pathlib import Path
from families import grown, specimen
from solver.collection import collect, processes
from solver import AlignSettings

if __name__ == "__main__":
    many = [specimen(f"sheet-{{k}}", grown(k)) for k in range(6)]
    settings = AlignSettings(refine="mobius", samples=40, targets=200)
    found = collect(many, Path({out!r}), processes(2), settings=settings, at_a_time=2)
    print(len(found.figures))
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system does not kill so")
def test_killed_and_begun_again(tmp_path: Path) -> None:
    """Nothing is lost but what was under way, nothing is done twice, and no process stays behind."""
    script, out = tmp_path / "script.py", tmp_path / "out"
    script.write_text(SCRIPT.format(root=str(ROOT), out=str(out)))
    lines = out / "pairs.jsonl"
    process = subprocess.Popen([sys.executable, str(script)])
    while process.poll() is None and (not lines.exists() or lines.read_bytes().count(b"\n") < 3):
        time.sleep(0.02)
    children = _children(process.pid)
    process.kill()
    process.wait()
    before = lines.read_bytes()
    whole = before[: before.rfind(b"\n") + 1]
    done = whole.count(b"\n")
    assert 3 <= done < 15
    deadline = time.time() + 30
    while any(_runs(child) for child in children) and time.time() < deadline:
        time.sleep(0.1)
    assert len(children) >= 2
    assert not any(_runs(child) for child in children)
    ended = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == "15"
    after = lines.read_bytes()
    assert after.startswith(whole)  # what was there is as it was
    assert after.count(b"\n") == 15
    pairs = [(line["source"], line["target"]) for line in map(json.loads, after.splitlines())]
    assert len(set(pairs)) == 15
    assert (out / "specimens.jsonl").read_bytes().count(b"\n") == 6


def _children(parent: int) -> list[int]:
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == parent:
            found.append(int(status.parent.name))
    return found


def _runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_no_more_tasks_wait_than_are_needed() -> None:
    """So that neither memory nor a cluster's scheduler grows with the number of pairs."""
    begun: list[int] = []

    def tasks():
        for k in range(200):
            begun.append(k)
            yield k, Compare("none", "none", {}, "")

    ahead = []
    for number, _ in enumerate(completed(tasks(), lambda: ThreadPoolExecutor(2), 2)):
        ahead.append(len(begun) - number)
    assert len(begun) == 200
    assert max(ahead) <= AHEAD * 2 + 2


def test_a_mesh_error_is_what_the_person_reads(tmp_path: Path) -> None:
    def strange() -> tuple[TriangleMesh, None]:
        raise MeshError("'x' has no faces")

    with pytest.raises(ValueError, match="'x' has no faces"):
        counted([Specimen("a", "1", strange), Specimen("b", "2", strange)], tmp_path)
