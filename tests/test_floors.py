"""The solver is a house with floors: a folder imports only from those below it."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOLVER = ROOT / "solver"
FLOORS = ("surface", "stages", "mobius", "flatten", "search", "bend", "align", "carry", "collection")
"""From the ground up: folders, and the two modules that stand between them."""
ROOMS = ("surfaces", "result", "maps", "doubt", "cut", "parts")
"""The same within `align`, whose modules outside of folders stand above them."""


def modules() -> list[Path]:
    return sorted(path for path in SOLVER.rglob("*.py") if "build" not in path.relative_to(SOLVER).parts)


def imported(path: Path) -> set[tuple[str, ...]]:
    """Return what a module of the solver imports: parts of the names below `solver`; others begin with ''."""
    here = path.relative_to(SOLVER).parts[:-1]
    found: set[tuple[str, ...]] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {("", *alias.name.split(".")) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            if node.level == 0:
                found.add(("", *(node.module or "").split(".")))
                continue
            assert node.level <= len(here) + 1, f"{path} imports from outside the solver"
            base = (*here[: len(here) - node.level + 1], *(node.module or "").split("."))
            base = tuple(part for part in base if part)
            # a name of a package may be a module of it
            found |= {(*base, alias.name) if _is_package(base) else base for alias in node.names}
    return found


def _is_package(parts: tuple[str, ...]) -> bool:
    return (SOLVER.joinpath(*parts) / "__init__.py").is_file()


def test_every_module_stands_on_a_floor() -> None:
    for path in modules():
        top = path.relative_to(SOLVER).parts[0].removesuffix(".py")
        assert top in (*FLOORS, "__init__"), f"{path} is on no floor"


@pytest.mark.parametrize("floor", FLOORS)
def test_a_floor_imports_only_from_those_below(floor: str) -> None:
    allowed = FLOORS[: FLOORS.index(floor) + 1]
    for path in modules():
        if path.relative_to(SOLVER).parts[0].removesuffix(".py") != floor:
            continue
        for name in imported(path):
            assert name[:1] != ("solver",), f"{path} imports the solver as a whole"
            if name[0] != "":
                assert name[0] in allowed, f"{path} imports {'.'.join(name)}, which is not below it"


@pytest.mark.parametrize("room", ROOMS)
def test_a_folder_of_align_imports_only_from_those_below(room: str) -> None:
    assert {path.parent.name for path in SOLVER.glob("align/*/*.py")} == set(ROOMS)
    allowed = ROOMS[: ROOMS.index(room) + 1]
    for path in SOLVER.glob(f"align/{room}/*.py"):
        for name in imported(path):
            assert name[0] != "align" or name[1] in allowed, f"{path} imports {'.'.join(name)}, which is not below it"


def test_no_circle_among_modules() -> None:
    """Within a floor too: modules can be put in an order in which each imports only those before it."""
    graph: dict[tuple[str, ...], set[tuple[str, ...]]] = {}
    for path in modules():
        if path.name == "__init__.py":
            continue
        parts = path.relative_to(SOLVER).with_suffix("").parts
        graph[parts] = set()
        for name in imported(path):
            target = name
            while target and not SOLVER.joinpath(*target).with_suffix(".py").is_file():
                target = target[:-1]
            if target:
                graph[parts].add(target)
    while graph:
        free = {module for module, needs in graph.items() if not needs & graph.keys() - {module}}
        assert free, f"these import each other in a circle: {sorted('.'.join(module) for module in graph)}"
        graph = {module: needs for module, needs in graph.items() if module not in free}


def test_the_solver_imports_nothing_but_numpy_scipy_and_the_standard_library() -> None:
    import sys

    others = {
        name[1] for path in modules() if path.name != "build_wheel.py" for name in imported(path) if name[0] == ""
    }
    assert others - set(sys.stdlib_module_names) <= {"numpy", "scipy", "threadpoolctl", "mobius_kernels"}


def test_the_check_finds_what_it_looks_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("surface", "search"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "__init__.py").write_text("")
    (tmp_path / "search" / "bounds.py").write_text("")
    upward = tmp_path / "surface" / "mesh.py"
    upward.write_text("def late():\n    from ..search import bounds\n")
    monkeypatch.setattr("test_floors.SOLVER", tmp_path)
    assert imported(upward) == {("search", "bounds")}
    with pytest.raises(AssertionError, match="not below it"):
        test_a_floor_imports_only_from_those_below("surface")
