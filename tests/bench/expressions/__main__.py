"""Expressions from one head to another, of the same template or another, beside the target's own.

    uv run --no-sync python -m tests.bench.expressions -o FOLDER [--pairs ict_1:ict_2] [--kept 1,0.6,0.3] [--keys]
    uv run --no-sync python -m tests.bench.expressions -o FOLDER --pairs ict_1:mpfb_woman --kept 1 --sheet PICTURE.png
    uv run --no-sync python -m tests.bench.expressions -o FOLDER --pairs ict_1:mpfb_woman --kept 0.6 --limits

The target is another person's head: triangulated, decimated, turned, scaled and moved. Its own expressions, through the
same, are what ought to arrive. Between heads of one template these are the same displacements on another face, which no
method that fits them to that face gets exactly: the row "true map" says how far off a perfect map leaves them. Between
families they are another artist's; what counts there is how alike they are.

"nearest point" is what Blender's own tools do, in the best pose there is: fitted to the truth, or between families to
our map. Maps are kept in FOLDER and made once.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "addon"), str(ROOT / "tests" / "solver")]

import bpy  # noqa: E402
import conftest  # noqa: E402, F401  (loads the extension)
from mobius_extension.mobius_addon.attributes.expression_names import renamed  # noqa: E402

from solver import AlignSettings, Correspondence, align, correspond, load_map, prepare, save_map  # noqa: E402
from solver.carry.fitted import is_reflected  # noqa: E402
from solver.carry.gradients import GradientTransfer  # noqa: E402
from tests.bench.heads.__main__ import run  # noqa: E402
from tests.bench.heads.people import Head, read_head  # noqa: E402
from tests.bench.heads.scenes import save_source, save_target  # noqa: E402
from tests.bench.heads.targets import Target, target_of  # noqa: E402
from tests.bench.paper.data import DATA, absent  # noqa: E402

from .carrying import by_map, nearest_point, true_map  # noqa: E402
from .limits import apart, fitted, lines  # noqa: E402
from .measures import Judge, Score  # noqa: E402

PEOPLE = ("ict_1", "ict_2", "mpfb_woman", "mpfb_man")
FIGURES = ("whole", "skin", "parts", "like", "far", "gap", "through", "wrong")
WAYS = ("ours", "without contacts", "frames", "nearest point", "true map")


def keys_of(head: Head, mirrored: bool = False) -> dict[str, np.ndarray]:
    """Return a head's displacements by ARKit's names, by those of the other side where the map mirrors."""
    found = renamed(head.keys, "arkit", bpy.utils.flip_name if mirrored else None)
    return {name: np.sum([head.keys[one] for one in halves], axis=0) for name, halves in found.items()}


def mapped(head: Head, target: Target, path: Path) -> tuple[Correspondence, dict[str, object]]:
    """Return the map between two heads, made or as it was made, and what is known of it."""
    said = path.with_suffix(".json")
    if path.exists() and said.exists():
        return load_map(path), json.loads(said.read_text())
    rng = np.random.default_rng(0)
    mixed = [np.tensordot(rng.uniform(0.5, 1.5, len(head.keys)), np.stack([*head.keys.values()]), 1) for _ in "ab"]
    started = time.process_time()
    settings = AlignSettings()
    found = align(prepare(head.mesh, settings, keys=np.hstack(mixed)), target.mesh, settings)
    result = correspond(found)
    known = {
        "seconds": time.process_time() - started,
        "certified": found.certified,
        "confidence": found.mean_confidence,
        "parts": found.whole.counts() if found.whole else None,
        "warnings": found.warnings,
    }
    save_map(path, found, result, head.mesh, target.mesh)
    said.write_text(json.dumps(known, indent=1))
    return result, known


def one(head: Head, other: Head, kept: float, folder: Path) -> dict[str, dict[str, Score]]:
    """Carry a head's expressions to another and return each one's score in each way."""
    target = target_of(other, kept)
    found, known = mapped(head, target, folder / f"{head.name}-{other.name}-{kept:g}.npz")
    related = head.template == other.template
    ways = by_map(found, head.mesh, target.mesh)
    own = keys_of(other)
    mirrored = is_reflected(found, head.mesh, target.mesh)
    chosen = {name: moved for name, moved in keys_of(head, mirrored).items() if name in own and np.abs(moved).max() > 0}
    on = found.face >= 0 if not related else np.ones(len(target.part), bool)
    truth = true_map(head, target) if related else None
    places = ((truth or found).matrix() @ head.vertices)[on]
    nearest = nearest_point(head, target, places, on)
    perfect = None if truth is None else by_map(truth, head.mesh, target.mesh)
    rows: dict[str, dict[str, Score]] = {}
    seconds = 0.0
    for name, moved in chosen.items():
        judge = Judge(target, target.own(other, own[name]), name == "jawOpen")
        started = time.process_time()
        ours = ways(moved)
        seconds += time.process_time() - started
        got = {
            "ours": ours.contacts,
            "without contacts": ours.gradients,
            "frames": ours.frames,
            "nearest point": nearest(moved),
        }
        if perfect is not None:
            got["true map"] = perfect(moved).contacts
        rows[name] = {way: judge.score(values) for way, values in got.items()}
    print(
        f"{head.name} > {other.name}, {kept:.0%}, {len(target.mesh.faces):,} faces: {len(rows)} keys, confidence "
        f"{known['confidence']:.2f}, {known['parts'][0] if known['parts'] else 1} parts paired, aligned in "
        f"{known['seconds']:.0f} s, carried in {seconds:.1f} s of the processor{', mirrored' * mirrored}",
        flush=True,
    )
    return rows


def limits(head: Head, other: Head, kept: float, folder: Path) -> None:
    """Print what keeps the expressions of one head from those of another's own artist."""
    target = target_of(other, kept)
    found, _ = mapped(head, target, folder / f"{head.name}-{other.name}-{kept:g}.npz")
    mirrored = is_reflected(found, head.mesh, target.mesh)
    own, keys = keys_of(other), keys_of(head, mirrored)
    names = [name for name in keys if name in own and np.abs(keys[name]).max() > 0]
    places = GradientTransfer.of(found, head.mesh, target.mesh)
    skin, on = target.part == 0, head.part == 0
    wanted = {name: target.own(other, own[name]) * skin[:, None] for name in names}
    got = np.stack([places(keys[name])[skin] for name in names])
    print(f"{head.name} > {other.name}, {kept:.0%}: {len(names)} keys{', mirrored' * mirrored}", flush=True)
    for way, figure in fitted(np.stack([wanted[name][skin] for name in names]), got).items():
        print(f"    {way:36} {figure:.3f}")
    met = lines(target.mesh.vertices, target.mesh.faces[skin[target.mesh.faces].all(axis=1)], wanted)
    theirs = lines(
        head.vertices, head.mesh.faces[head.part_of_triangle == 0], {k: v * on[:, None] for k, v in keys.items()}
    )
    print("    off, of the distance of the eyes:", apart(head.vertices, theirs, places.places, met), flush=True)


def draw(pair: str, kept: float, folder: Path, picture: Path) -> None:
    """Draw a pair by the command that people use."""
    head, other = (read_head(DATA / "heads", name) for name in pair.split(":"))
    save_source(head, folder / "source.blend")
    bpy.data.objects["Head"].rotation_euler.x = np.pi / 2  # in the data y is up
    bpy.ops.wm.save_mainfile()
    save_target(target_of(other, kept), folder / "target.blend")
    run(folder, "sheet", "--only", "shape-keys", "--sheet", str(picture.resolve()))


def medians(rows: dict[str, dict[str, Score]], way: str) -> dict[str, float]:
    """Return the median of each figure over the expressions of which there is one."""
    result = {}
    for figure in FIGURES:
        values = [v for row in rows.values() if (v := getattr(row[way], figure)) == getattr(row[way], figure)]
        result[figure] = float(np.median(values)) if values else np.nan
    return result


def _print(name: str, figures: dict[str, float], more: str = "") -> None:
    print(f"    {name:18}" + "".join(f" {figures[figure]:>8.3f}" for figure in FIGURES) + more, flush=True)


def main() -> None:
    """Run the pairs that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    every = [f"{a}:{b}" for a in PEOPLE for b in PEOPLE if a != b]
    parser.add_argument("--pairs", default=",".join(every))
    parser.add_argument("--kept", default="1,0.6,0.3")
    parser.add_argument("--sheet", type=Path, metavar="PICTURE.png", help="draw the first pair, at the first ratio")
    parser.add_argument("--keys", action="store_true", help="a row for each expression, too")
    parser.add_argument("--limits", action="store_true", help="instead: what a fit to the target's own leaves")
    options = parser.parse_args()
    if reason := absent("heads"):
        raise SystemExit(reason)
    options.folder.mkdir(parents=True, exist_ok=True)
    if options.sheet is not None:
        draw(options.pairs.split(",")[0], float(options.kept.split(",")[0]), options.folder, options.sheet)
        return
    for pair in options.pairs.split(","):
        head, other = (read_head(DATA / "heads", name) for name in pair.split(":"))
        for kept in map(float, options.kept.split(",")):
            if options.limits:
                limits(head, other, kept, options.folder)
                continue
            rows = one(head, other, kept, options.folder)
            print(f"    {'':18}" + "".join(f" {figure:>8}" for figure in FIGURES))
            for way in WAYS:
                if way in next(iter(rows.values())):
                    _print(way, medians(rows, way))
            for name, row in rows.items() if options.keys else ():
                floor = f"   true map: skin {row['true map'].skin:.3f}" if "true map" in row else ""
                _print(name, vars(row["ours"]), floor)


if __name__ == "__main__":
    main()
