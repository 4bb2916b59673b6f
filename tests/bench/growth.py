"""How a collection grows with its specimens: time, files and memory, up to thousands on a Dask cluster.

    uv run --group bench --group cluster python -m tests.bench.growth -o FOLDER [--counts 10,100] [--many 1000]

The specimens are sheets of one family, each bent in a way of its own, every third mirrored, and coarse, so that what
grows is the collection. First what a process keeps in memory of a specimen of 10,000 triangles; then each plan with
processes of this machine; then a star of `--many` on a LocalCluster of two workers, its scheduler a process of its own.
"""

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import psutil

from solver import AlignSettings, TriangleMesh
from solver.align.surfaces.surface_file import load_surface
from solver.collection import Collection, Plan, Specimen, Told, collect, processes
from solver.collection.chart import Chart
from solver.collection.cluster import Cluster
from solver.collection.engine import Open

sys.path.append(str(Path(__file__).resolve().parents[1] / "solver"))  # as pytest does: `families` imports `scans`
from tests.solver.families import grown

ROUGH = AlignSettings(samples=40, targets=200)
WORKERS = 2

SCHEDULER = """
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=int(sys.argv[1]), threads_per_worker=1, dashboard_address=None,
                      local_directory=sys.argv[2]) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""


def specimens(count: int, size: int) -> list[Specimen]:
    def read(number: int) -> tuple[TriangleMesh, None]:
        return grown(number, size), None

    return [Specimen(f"sheet-{k:04}", f"{k} {size}", partial(read, k)) for k in range(count)]


def megabytes(number: float) -> float:
    return number / 2**20


def resident(process: psutil.Process) -> float:
    """Return the memory of a process in MB, shared libraries left out; 0 if it has ended."""
    try:
        found = process.memory_info()
    except psutil.Error:
        return 0.0
    return megabytes(found.rss - getattr(found, "shared", 0))


def on_disk(folder: Path) -> float:
    return megabytes(sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()))


class Memory:
    """Looks at the memory of processes while a collection is worked on."""

    def __init__(self, groups: dict[str, Callable[[], list[psutil.Process]]]) -> None:
        self.groups = groups
        self.seen: list[tuple[Told, dict[str, float]]] = []
        self.spent = 0.0
        self.stages: dict[str, list[float]] = {}

    def __call__(self, told: Told) -> None:
        self.stages.setdefault(told.stage, []).append(time.perf_counter())
        if told.error is not None:
            print(f"  {told.name}: {told.error}")
        if told.done % max(told.total // 40, 1) and told.done != told.total:
            return
        found = {name: max(map(resident, members()), default=0.0) for name, members in self.groups.items()}
        self.seen.append((told, found))
        if told.total >= 500 and told.done % (told.total // 10) < told.total // 40:
            said = ", ".join(f"{name} {x:.0f} MB" for name, x in found.items())
            print(f"  {told.stage}: {told.done:,} of {told.total:,}: {said}", flush=True)

    def most(self, name: str) -> float:
        return max(found[name] for _, found in self.seen)

    def slope(self, name: str) -> tuple[float, int]:
        """Return the growth in MB per 1,000 tasks of the longest stage, its first quarter left out, and its tasks."""
        longest = max(self.stages, key=lambda stage: len(self.stages[stage]))
        late = [
            (told.done, found[name])
            for told, found in self.seen
            if told.stage == longest and 4 * told.done >= told.total
        ]
        done, held = np.array(late).T
        return float(1000 * np.polyfit(done, held, 1)[0]), int(done[-1])


def workers_here() -> list[psutil.Process]:
    """Return the processes that this one has begun; the one that watches over shared memory is small."""
    return psutil.Process().children(recursive=True)


def run(count: int, size: int, plan: Plan, refine: str, out: Path, opened: Open, memory: Memory) -> Collection:
    settings = replace(ROUGH, refine=refine)
    return collect(specimens(count, size), out, opened, plan=plan, settings=settings, at_a_time=WORKERS, tell=memory)


def growth(counts: list[int], size: int, root: Path) -> None:
    print("| plan | specimens | pairs | wall s | s per pair | dense | MB on disk | kB each | MB here | MB per worker |")
    print("|" + 10 * "---|")
    for count in counts:
        shutil.rmtree(root / str(count), ignore_errors=True)
        # in one folder: of the tree the dense maps alone are new
        for plan, refine in (
            (Plan("star", "sheet-0000"), "mobius"),
            (Plan("star", "sheet-0000"), "dense"),
            (Plan("all"), "mobius"),
            (Plan("tree"), "dense"),
        ):
            memory = Memory({"here": lambda: [psutil.Process()], "worker": workers_here})
            begun = time.perf_counter()
            found = run(count, size, plan, refine, root / str(count), processes(WORKERS), memory)
            wall, pairs = time.perf_counter() - begun, len(found.edges)
            lines, each = (found.folder.root / "pairs.jsonl").stat().st_size / 1024, [x.seconds for x in found.figures]
            dense = [x.seconds for x in found.figures if x.dense]
            bent = f"{np.median(dense):.3f} of {len(dense)}" if dense else ""
            print(
                f"| {plan.pairs}, {refine} | {count} | {pairs:,} | {wall:.0f} | {np.median(each):.3f} | {bent} | "
                f"{on_disk(found.folder.root):.1f} | {lines / pairs:.1f} | {memory.most('here'):.0f} | "
                f"{memory.most('worker'):.0f} |",
                flush=True,
            )


def many(count: int, size: int, root: Path) -> None:
    """A star of many on a cluster, by Möbius maps."""
    shutil.rmtree(root / "many", ignore_errors=True)
    (root / "dask").mkdir(parents=True, exist_ok=True)
    script = root / "scheduler.py"
    script.write_text(SCHEDULER, encoding="utf-8")
    server = subprocess.Popen(
        [sys.executable, str(script), str(WORKERS), str(root / "dask")],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert server.stdin is not None
    assert server.stdout is not None
    cluster = Cluster(server.stdout.readline().strip())
    numbers = [int(worker["pid"]) for worker in cluster.client.run(lambda: {"pid": __import__("os").getpid()}).values()]
    memory = Memory({
        "here": lambda: [psutil.Process()],
        "scheduler": lambda: [psutil.Process(server.pid)],
        "worker": lambda: [psutil.Process(number) for number in numbers if psutil.pid_exists(number)],
    })  # fmt: skip
    begun = time.perf_counter()
    try:
        found = run(count, size, Plan("star", "sheet-0000"), "mobius", root / "many", cluster.opened, memory)
    finally:
        cluster.close()
        server.stdin.close()
        server.wait(60)
    print(
        f"{count:,} specimens, {len(found.edges):,} pairs, {int(found.suspects.sum()):,} suspect, "
        f"{len(found.failures):,} failed: {time.perf_counter() - begun:.0f} s, "
        f"{on_disk(found.folder.root):.0f} MB on disk"
    )
    for name in memory.groups:
        grown_by, tasks = memory.slope(name)
        print(f"{name}: at most {memory.most(name):.0f} MB, {grown_by:+.1f} MB per 1,000 tasks over {tasks:,}")


def kept(root: Path, vertices: int = 5000, count: int = 12) -> None:
    """What a process has in memory of each specimen and each map that it keeps."""
    from solver.collection.tasks import Compare, Prepare, run, write_mesh

    folder = root / "kept"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "surfaces").mkdir(parents=True)
    paths = [folder / "surfaces" / f"{k}.npz" for k in range(count)]
    meshes = [grown(5 * k, vertices) for k in range(count)]
    for k, (mesh, path) in enumerate(zip(meshes, paths, strict=True)):
        write_mesh(folder / "mesh", mesh, None)
        task = Prepare(str(k), str(folder / "mesh"), {}, True, str(path))
        assert "error" not in run({"kind": "prepare", "given": vars(task)})
    here, held = psutil.Process(), []
    for first, second in pairwise(paths):
        task = Compare(str(first), str(second), {"refine": "mobius", "samples": 40, "targets": 200})
        result = run({"kind": "compare", "given": vars(task)})
        assert "error" not in result, result
        held.append(resident(here))
    each = np.polyfit(np.arange(len(held) - 2), held[2:], 1)[0]
    print(f"a worker keeps {each:.1f} MB of each prepared surface of {len(meshes[0].faces):,} triangles", flush=True)
    held, charts = [], []
    for path in paths:
        charts.append(Chart.of(load_surface(path), 40))
        charts[-1].positions(charts[-1].places[:100])
        held.append(resident(here))
    each = np.polyfit(np.arange(len(held) - 2), held[2:], 1)[0]
    print(f"an atlas keeps {each:.1f} MB of each")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--counts", default="10,100", help="specimens of each plan")
    parser.add_argument("--many", type=int, default=1000, help="specimens on the cluster; 0: none")
    parser.add_argument("--size", type=int, default=200, help="vertices of a specimen")
    options = parser.parse_args()
    kept(options.output)
    growth([int(x) for x in options.counts.split(",") if x], options.size, options.output)
    if options.many:
        many(options.many, options.size, options.output)


if __name__ == "__main__":
    main()
