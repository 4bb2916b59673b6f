"""Whole heads through the command line without a flag, and the table of what arrived.

    uv run --no-sync python -m tests.bench.heads -o FOLDER [--pairs ict_1:ict_2,mpfb_woman:mpfb_man] [--parts]

The target of each pair is another person's head: triangulated, decimated to 60 %, turned, scaled and moved. It is done
twice, with all parts and with the largest alone, for the time and the skin's error. With `--parts` a row for each part.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "solver")]

from solver import load_map  # noqa: E402
from tests.bench.paper.data import DATA, absent  # noqa: E402

from .people import Head, read_head  # noqa: E402
from .scenes import read_result, save_source, save_target  # noqa: E402
from .scores import Score, errors, scores  # noqa: E402
from .targets import Target, target_of  # noqa: E402

PAIRS = "ict_1:ict_2,mpfb_woman:mpfb_man"


def run(folder: Path, name: str, *flags: str) -> tuple[dict, float]:
    """Transfer between the files of a pair and return the report and the processor's seconds."""
    made = [folder / f"{name}.{kind}" for kind in ("blend", "npz", "json")]
    command = [sys.executable, str(ROOT), "transfer", str(folder / "source.blend"), str(folder / "target.blend")]
    command += ["-o", str(made[0]), "--map", str(made[1]), "--report", str(made[2]), "--overwrite", *flags]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, env=os.environ, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    (folder / f"{name}.log").write_text(done.stdout + done.stderr)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr}")
    return json.loads(made[2].read_text()), took


def right_pairs(head: Head, other: Head, target: Target, report: dict) -> tuple[int, int]:
    """Return how many parts have the counterpart that they should have, and how many should have one."""
    right = 0
    for row in report["parts"] or ():
        if row["source"] and row["target"]:
            right += head.part[row["source"]["vertex"]] == target.part[row["target"]["vertex"]]
    return int(right), min(int(head.part.max()), int(other.part.max())) + 1


def one(source: str, target: str, folder: Path, every_part: bool) -> None:
    """Run a pair and print its row."""
    folder.mkdir(parents=True, exist_ok=True)
    head, other = (read_head(DATA / "heads", name) for name in (source, target))
    made = target_of(other)
    save_source(head, folder / "source.blend")
    save_target(made, folder / "target.blend")
    whole, seconds = run(folder, "whole")
    alone, seconds_alone = run(folder, "skin", "--parts", "main")
    took, took_alone = (sum(x["seconds"].values()) for x in (whole, alone))
    processor, clock = (f"{a / b:.2f} ({a:.0f} s)" for a, b in ((seconds, seconds_alone), (took, took_alone)))
    time_ratio = f"{processor} of the processor, align {clock} by the clock"
    if head.template != other.template:
        paired = sum(bool(x["source"] and x["target"]) for x in whole["parts"])
        print(f"{source:>11} {target:<11} {paired} pairs of parts; time ratio {time_ratio}")
        for row in whole["parts"] if every_part else ():
            print(
                "   ", *(row[role] and f"part {row[role]['part']}" for role in ("source", "target")), row["certainty"]
            )
        return
    error, skin = (errors(head, made, load_map(folder / f"{name}.npz")) for name in ("whole", "skin"))
    rows = scores(head, made, error, read_result(folder / "whole.blend"))
    right, total = right_pairs(head, other, made, whole)
    on_skin = made.part == 0
    print(
        f"{source:>11} {target:<11} parts {right}/{total}  skin {np.nanmean(error[on_skin]):.3f} "
        f"(alone {np.nanmean(skin[on_skin]):.3f})  time ratio {time_ratio}"
    )
    print(f"{'':>8}{'part':>10} {'error':>7} {'groups':>7} {'UV':>7} {'material':>8} {'keys':>6}")
    _print("skin", rows[0])
    if len(rows) > 1:
        _print(
            "others", Score(*(float(np.nanmean(x)) for x in zip(*(vars(r).values() for r in rows[1:]), strict=True)))
        )
        _print("worst", _worst(rows[1:]))
    for number, row in enumerate(rows if every_part else ()):
        _print(str(number), row)


def _worst(rows: list[Score]) -> Score:
    most = [max, min, min, min, max]
    columns = zip(*(vars(row).values() for row in rows), strict=True)
    return Score(*(pick([x for x in column if x == x]) for pick, column in zip(most, columns, strict=True)))


def _print(name: str, row: Score) -> None:
    print(
        f"{'':>8}{name:>10} {row.error:>7.3f} {row.weights:>7.1%} {row.uv:>7.1%} {row.material:>8.1%} {row.keys:>6.3f}"
    )


def main() -> None:
    """Run the pairs that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    parser.add_argument("--pairs", default=PAIRS)
    parser.add_argument("--parts", action="store_true")
    options = parser.parse_args()
    if reason := absent("heads"):
        raise SystemExit(reason)
    for pair in options.pairs.split(","):
        source, target = pair.split(":")
        one(source, target, options.folder.resolve() / f"{source}-{target}", options.parts)


if __name__ == "__main__":
    main()
