"""A collection's folder: one run at a time, damaged lines, names of every length, and what is done again."""

import json
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from solver import AlignSettings
from solver.collection import Collection, Plan, Specimen, collect
from solver.collection.folder import LONGEST, Folder, free_name

ROOT = Path(__file__).resolve().parents[3]


def test_two_runs_in_one_folder_are_refused_and_a_killed_one_leaves_it_free(tmp_path: Path) -> None:
    script = f"""
import sys, time
sys.path.insert(0, {str(ROOT)!r})
from pathlib import Path
from solver.collection.folder import Folder
folder = Folder(Path({str(tmp_path)!r}))
print("there", flush=True)
time.sleep(60)
"""
    other = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None
    assert other.stdout.readline() == "there\n"
    with pytest.raises(ValueError, match="another run is at work in"):
        Folder(tmp_path)
    other.kill()
    other.wait()
    other.stdout.close()
    Folder(tmp_path).close()
    Folder(tmp_path).close()


def test_a_damaged_line_is_no_line(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    folder.add_specimen("a", "1", "x", {"fingerprint": "f"})
    folder.add_specimen("b", "2", "x", {"fingerprint": "g"})
    folder.close()
    path = tmp_path / "specimens.jsonl"
    first, second = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"\0" * 40 + b"\n" + first + b"{half\n" + second)
    again = Folder(tmp_path)
    assert set(again.specimens) == {"a", "b"}
    again.close()


def test_a_long_name_is_cut_and_told_apart() -> None:
    assert free_name('a<b>:"c"') == "a_b___c_"
    assert free_name(b"na\xefve".decode(errors="surrogateescape")) == "na_ve"
    long = ["歯" * 80 + end for end in "ab"]
    cut = [free_name(name) for name in long]
    assert cut[0] != cut[1]
    assert all(len(name.encode()) <= LONGEST and name.startswith("歯歯") for name in cut)
    assert free_name("x" * LONGEST) == "x" * LONGEST


def test_what_is_no_fault_of_the_surfaces_is_done_again(
    family: Callable[[int], list[Specimen]], tmp_path: Path
) -> None:
    rough = AlignSettings(refine="mobius", samples=40, targets=200)

    def go() -> Collection:
        return collect(family(3), tmp_path, lambda: ThreadPoolExecutor(1), plan=Plan("all"), settings=rough)

    assert not go().failures
    path = tmp_path / "pairs.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    kept = ("source", "target", "digest", "source_fingerprint", "target_fingerprint")
    lost = [{**{name: line[name] for name in kept}, "error": "why"} for line in lines]
    path.write_text("".join(json.dumps(x) + "\n" for x in (lines[0], {**lost[1], "again": True}, lost[2])))
    found = go()
    # the third is the surfaces' own fault: it would fail as it did
    assert list(found.failures.values()) == ["why"]
    assert len(found.figures) == 2
