"""The picture of the solver's floors, from its imports as they are.

uv run --group bench python -m tests.bench.floors docs/floors.png
"""

import ast
import sys
from collections import Counter
from pathlib import Path
from textwrap import wrap

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

SOLVER = Path(__file__).resolve().parents[2] / "solver"
FLOORS = ("surface", "flatten", "search", "bend", "align", "carry", "collection")
BETWEEN = ("mobius", "stages")
WIDE = 105
"""Letters of a line of names."""


def modules(folder: str) -> list[str]:
    """Return the modules of a folder, and its folders with a slash."""
    inside = [p for p in (SOLVER / folder).iterdir() if not p.name.startswith("_")]
    names = [p.stem for p in inside if p.suffix == ".py"] + [
        f"{p.name}/" for p in inside if (p / "__init__.py").exists()
    ]
    return sorted(names)


def imports() -> Counter[tuple[str, str]]:
    """Return how many modules of one floor import from another."""
    result: Counter[tuple[str, str]] = Counter()
    for path in SOLVER.rglob("*.py"):
        parts = path.relative_to(SOLVER).parts
        if len(parts) < 2 or path.name == "__init__.py":
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        seen = {
            (node.module or "").split(".")[0]
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and node.level == len(parts)
        }
        result.update((parts[0], floor) for floor in seen & {*FLOORS, *BETWEEN} if floor != parts[0])
    return result


def main(output: str) -> None:
    figure, axes = plt.subplots(figsize=(14, 7.6), dpi=120)
    axes.set(xlim=(0, 14), ylim=(-0.15, len(FLOORS) + 0.35))
    axes.axis("off")
    colors = plt.get_cmap("viridis")
    levels, top = {floor: level for level, floor in enumerate(FLOORS)}, len(FLOORS) - 1
    for floor, level in levels.items():
        box = FancyBboxPatch(
            (0.1, level + 0.08),
            11.1,
            0.78,
            boxstyle="round,pad=0.04",
            lw=0,
            fc=(*colors(level / top)[:3], 0.25),
        )
        axes.add_patch(box)
        axes.text(0.25, level + 0.47, f"{floor}/", weight="bold", size=13, va="center")
        rows = wrap("   ".join(modules(floor)), WIDE, break_on_hyphens=False)
        for row, text in enumerate(rows):
            height = 0.47 + min(0.25, 0.62 / len(rows)) * ((len(rows) - 1) / 2 - row)
            axes.text(1.75, level + height, text, size=8.5 if len(rows) < 4 else 7.5, va="center", family="monospace")
    arrows = imports()
    for (above, below), count in arrows.items():
        if below in BETWEEN:
            continue
        x = 11.4 + 0.42 * (levels[above] - levels[below] - 1)
        arrow = FancyArrowPatch(
            (x, levels[above] + 0.3), (x, levels[below] + 0.7), arrowstyle="-|>", mutation_scale=9,
            lw=0.6 + 0.25 * count, color=colors(levels[above] / top), alpha=0.7, connectionstyle="arc3,rad=-0.12",
        )  # fmt: skip
        axes.add_patch(arrow)
    text = (
        "an arrow points to what is imported, thicker where more modules do;\n"
        "mobius and stages stand beside the stairs, for whoever needs them"
    )
    axes.text(0.1, len(FLOORS) + 0.2, text, size=9, va="center", color="0.3")
    figure.savefig(output, bbox_inches="tight")


if __name__ == "__main__":
    main(sys.argv[1])
