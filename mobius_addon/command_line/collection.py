"""`collection`: many scans compared with each other and put on one topology."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ..streams import DONE, NOT_ALIGNED, say, say_error
from .output_files import warn

if TYPE_CHECKING:
    from ...solver.collection import Collection
    from ...solver.collection.engine import Open
    from ...solver.surface.mesh import Floats

HELP = "Compare many scans with each other and put all of them on one topology."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what `collection` takes."""
    parser.add_argument("meshes", metavar="FILE|FOLDER", nargs="+", help="mesh files, and folders of them")
    parser.add_argument(
        "-o", "--output", metavar="OUT", type=Path, required=True,
        help="folder for all results; what is there of an earlier run is not done again",
    )  # fmt: skip
    parser.add_argument(
        "--pairs",
        choices=("all", "star", "tree"),
        default="tree",
        help="all: each with each, by Möbius maps. star: a template with each. tree: each with each by Möbius maps, "
        "then densely along the minimum spanning tree. Default: %(default)s",
    )
    parser.add_argument("--template", metavar="NAME", help="whose topology all get; default: the most typical one")
    parser.add_argument(
        "--refine", choices=("dense", "mobius"), help="what follows the proven maps; default: dense, of all mobius"
    )
    parser.add_argument("--reflect", choices=("auto", "never", "always"), help="are some mirror images of others?")
    parser.add_argument("--samples", type=int, metavar="N", help="source points of the search")
    parser.add_argument("--targets", type=int, metavar="N", help="target points of the search")
    parser.add_argument(
        "--no-check", dest="check", action="store_false",
        help="of a star with a template: do not align the others with each other to test its maps",
    )  # fmt: skip
    parser.add_argument(
        "--landmarks", metavar="FILE", type=Path,
        help="placed on one specimen, to be carried to all: .mrk.json, or x y z on each line, with or without a label",
    )  # fmt: skip
    parser.add_argument(
        "--landmarks-on", metavar="NAME", help="which specimen; default: that whose name FILE begins with"
    )
    engine = parser.add_argument_group("engine")
    engine.add_argument("--jobs", metavar="N", type=int, help="processes of this machine; default: one per processor")
    engine.add_argument("--dask", metavar="ADDRESS", help="a running Dask cluster, in place of processes")


def run(options: argparse.Namespace) -> int:
    """Collect, write the results, and return the exit status."""
    from dataclasses import replace

    from ...solver import AlignSettings
    from ...solver.collection import Plan, collect
    from ..collection.progress import Progress
    from ..collection.results import write_results
    from ..collection.specimens import specimens
    from ..files import Unreadable
    from ..mesh_data import Refusal

    found = specimens(options.meshes, options.output)
    if options.jobs is not None and options.jobs < 1:
        raise Unreadable(f"--jobs must be at least 1, not {options.jobs}")
    landmarks = _landmarks(options, [specimen.name for specimen in found])
    settings = AlignSettings(refine=options.refine or ("mobius" if options.pairs == "all" else "dense"))
    given = {name: getattr(options, name) for name in ("reflect", "samples", "targets")}
    try:
        settings = replace(settings, **{name: value for name, value in given.items() if value is not None})
        plan = Plan(options.pairs, options.template, options.check)
        opened, at_a_time, close = _engine(options)
    except ValueError as error:
        raise Unreadable(str(error)) from error
    progress = Progress()
    try:
        done = collect(found, options.output, opened, plan=plan, settings=settings, at_a_time=at_a_time, tell=progress)
        warn(write_results(done, landmarks))
    except ValueError as error:
        raise Refusal(str(error)) from error
    except OSError as error:
        why = f"cannot write in '{options.output}': {error.strerror or error}"
        raise Refusal(f"{why}; once that is mended, the same command goes on from here") from error
    except KeyboardInterrupt as stop:
        raise KeyboardInterrupt("the same command goes on from here") from stop
    finally:
        progress.end()
        close()
    _say(done, options.output, progress.named)
    return NOT_ALIGNED if done.failures else DONE


def _engine(options: argparse.Namespace) -> tuple[Open, int, Callable[[], object]]:
    """Return what begins the executor, how many tasks it works on at a time, and what closes it."""
    from ...solver.collection.engine import processes, processors

    if options.dask is None:
        jobs = options.jobs or processors()
        return processes(jobs), jobs, lambda: None
    from ...solver.collection.cluster import Cluster

    cluster = Cluster(options.dask)
    return cluster.opened, cluster.threads(), cluster.close


def _landmarks(options: argparse.Namespace, names: list[str]) -> tuple[str, list[str], Floats] | None:
    from ..collection.landmark_tables import read_marks
    from ..files import Unreadable

    if options.landmarks is None:
        return None
    labels, places = read_marks(options.landmarks)
    start = options.landmarks_on
    if start is None:
        fitting = [name for name in names if options.landmarks.name.startswith(name)]
        start = max(fitting, key=len) if fitting else options.template
    if start not in names:
        raise Unreadable(f"on which specimen are the landmarks of '{options.landmarks}'? Say --landmarks-on NAME")
    return start, labels, places


def _say(done: Collection, output: Path, named: set[str]) -> None:
    """Say what was found; failures that are not `named` yet are of an earlier run."""
    for name, why in done.failures.items():
        if name not in named:
            say_error(f"mobius: {name}: {why}")
    for (a, b), error, bad in zip(done.edges, done.errors, done.suspects, strict=True):
        if bad:
            say_error(f"mobius: warning: suspect: {done.names[a]} to {done.names[b]}, off by {error:.0%} in cycles")
    certified = sum(known.certified for known in done.figures)
    failed = f", {len(done.failures):,} failed" if done.failures else ""
    say(
        f"{output}: {len(done.names):,} specimens, {len(done.edges):,} pairs, {certified:,} certified, "
        f"{int(done.suspects.sum()):,} suspect{failed}; all on the topology of '{done.names[done.root]}'"
    )
