"""Carry what is on one mesh to many others, several at a time; what is done already is not done again.

    uv run python docs/headless/batch.py TEMPLATE SCAN... -o FOLDER [--jobs N] [-- options of `python . transfer`]

Writes FOLDER/SCAN.blend and FOLDER/SCAN.json for each scan and one line per scan to FOLDER/batch.csv. A scan that
cannot be aligned does not stop the others. Exit status: 0 all done; 1 some could not be done; 2 wrong usage.
"""

import argparse
import csv
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def name_of(scan: str) -> str:
    """Return what the outputs of a scan are called: as its file, and the object in it where one is named."""
    file, _, name = scan.partition(".blend:")
    return f"{Path(file).name}-{name}" if name else Path(file).stem


def transfer(template: str, scan: str, folder: Path, options: list[str]) -> tuple[int, str]:
    """Carry to one scan in a process of its own, and return its exit status and what it said about errors."""
    outputs = ["-o", folder / f"{name_of(scan)}.blend", "--report", folder / f"{name_of(scan)}.json"]
    command = [sys.executable, ROOT, "transfer", template, scan, *outputs, *options]
    # one thread each: the scans are what runs side by side
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    done = subprocess.run(
        [str(part) for part in command], env=os.environ | threads, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stderr.strip()


def figures(report: Path) -> list[object]:
    """Return what is worth a column of the table."""
    found = json.loads(report.read_text(encoding="utf-8"))
    return [found[name] for name in ("value", "upper_bound", "certified", "coverage")]


def main() -> int:
    """Run the batch."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("template", metavar="TEMPLATE")
    parser.add_argument("scans", metavar="SCAN", nargs="+")
    parser.add_argument("-o", "--output", metavar="FOLDER", type=Path, required=True)
    parser.add_argument("--jobs", metavar="N", type=int, default=os.cpu_count() or 1)
    arguments = sys.argv[1:]
    cut = arguments.index("--") if "--" in arguments else len(arguments)
    options, rest = parser.parse_args(arguments[:cut]), arguments[cut + 1 :]
    if len({name_of(scan) for scan in options.scans}) < len(options.scans):
        parser.error("two scans have the same name")
    options.output.mkdir(parents=True, exist_ok=True)
    failed = 0
    with (options.output / "batch.csv").open("w", newline="", encoding="utf-8") as table:
        rows = csv.writer(table)
        rows.writerow(["scan", "status", "value", "upper_bound", "certified", "coverage", "errors"])
        with ThreadPoolExecutor(options.jobs) as pool:

            def one(scan: str) -> tuple[str, int, str]:
                if (options.output / f"{name_of(scan)}.json").exists():
                    return scan, 0, "done before"
                return scan, *transfer(options.template, scan, options.output, rest)

            for scan, status, said in pool.map(one, options.scans):
                report = options.output / f"{name_of(scan)}.json"
                rows.writerow([scan, status, *(figures(report) if status == 0 else [""] * 4), said])
                table.flush()
                sys.stdout.write(f"{scan}: {'done' if status == 0 else said}\n")
                sys.stdout.flush()
                failed += status != 0
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
