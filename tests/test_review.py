"""What reviewers of extensions look at, in the sources that the zip holds: no code or data of a kind they refuse."""

import ast
import re
import struct
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))

OPENS_FILES = {
    # what a command is told to read or write, and the null device beside Blender's own output
    "mobius_addon/files",
    "mobius_addon/streams.py",
    # specimens, results and pictures in folders of their own
    "mobius_addon/collection",
    "mobius_addon/textures/images.py",
    "solver/collection/folder.py",
    "solver/collection/lock.py",
    "solver/collection/tasks.py",
    "solver/collection/work.py",
}
WORKER = "solver/collection/worker.py"  # in processes of its own, which have to find the extension
KNOWS_ITS_PLACE = {"mobius_addon/preset_menus.py", "mobius_addon/operators/example.py"}  # presets, the guide
NETWORK = {"http", "urllib.request", "urllib3", "requests", "socket", "ssl", "ftplib", "smtplib", "webbrowser"}
OTHERS = {"subprocess", "ctypes.util", "pip", "importlib.reload", "ensurepip"}
JARGON = re.compile(r"conformal|certif|homeo|diffeo|möbius map|isometr|barycent|laplac", re.IGNORECASE)


def packed() -> list[str]:
    """The Python files of the zip, without the paper's comparisons and what builds."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files"], capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    kernels = "solver/search/kernels"
    left_out = ("solver/search/baselines/", f"{kernels}/build_wheel.py", f"{kernels}/pyproject.toml")
    return [
        name
        for name in listed.stdout.split()
        if name.startswith(("solver/", "mobius_addon/", "__init__.py")) and not name.startswith(left_out)
    ]


def trees() -> Iterator[tuple[str, ast.AST]]:
    for name in packed():
        if name.endswith(".py"):
            yield name, ast.parse((ROOT / name).read_text(encoding="utf-8"))


def may(name: str, allowed: set[str]) -> bool:
    return any(name == place or name.startswith(f"{place}/") for place in allowed)


def test_files_are_opened_where_files_are_the_subject() -> None:
    def opens(node: ast.AST) -> bool:
        if isinstance(node, ast.Call):
            return "open" in (getattr(node.func, "id", ""), getattr(node.func, "attr", ""))
        if not isinstance(node, ast.Attribute) or node.attr not in ("write_text", "write_bytes", "unlink", "rmtree"):
            return False
        # objects are taken out of collections, which Blender calls unlink too
        return getattr(node.value, "attr", "") not in ("objects", "children")

    found = {name for name, tree in trees() if any(map(opens, ast.walk(tree)))}
    stray = {name for name in found if not may(name, OPENS_FILES | {"mobius_addon/command_line/output_files.py"})}
    assert stray <= {
        "mobius_addon/demo/__init__.py",
        "solver/carry/map_file.py",
        "solver/align/surfaces/surface_file.py",
    }
    assert found, "the test sees nothing"


def test_nothing_reaches_for_the_network_other_programs_or_the_import_system() -> None:
    found = []
    for name, tree in trees():
        for node in () if name == WORKER else ast.walk(tree):
            if isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                modules = [node.module or "", *(f"{node.module}.{alias.name}" for alias in node.names)]
            else:
                modules = []
            found += [(name, x) for x in modules if x in NETWORK | OTHERS or x.split(".")[0] in NETWORK | OTHERS]
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "sys":
                found += [(name, f"sys.{node.attr}")] if node.attr in ("path", "modules", "meta_path") else []
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("exec", "eval", "__import__"):
                found.append((name, node.func.id))  # type: ignore[attr-defined]
            if isinstance(node, ast.Name) and node.id == "__file__" and name not in KNOWS_ITS_PLACE:
                found.append((name, "__file__"))
    # read, to keep its own modules to the interpreter's end
    assert [one for one in found if one != ("mobius_addon/__init__.py", "sys.modules")] == []


def test_nobody_prints() -> None:
    found = [
        name
        for name, tree in trees()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "print"
    ]
    assert found == []


def test_the_manifest_says_what_it_is_in_a_persons_words() -> None:
    tagline = MANIFEST["tagline"]
    assert len(tagline) <= 64
    assert re.search(r"[\w)\]}]$", tagline)
    assert not JARGON.search(tagline)
    # people who type no umlaut find it
    assert "mobius" in (MANIFEST["name"] + tagline).lower()
    assert "blender" not in (MANIFEST["name"] + MANIFEST["id"]).lower()
    assert MANIFEST["license"] == ["SPDX:GPL-3.0-or-later"]
    assert re.fullmatch(r"\d+\.\d+\.\d+", MANIFEST["version"])
    assert all(re.match(r"\d{4}(-\d{4})? \S", line) for line in MANIFEST["copyright"])
    assert "blender_version_max" not in MANIFEST


def test_only_files_are_asked_for_and_the_reason_fits() -> None:
    assert set(MANIFEST["permissions"]) == {"files"}
    assert all(len(text) <= 64 and text[-1].isalnum() for text in MANIFEST["permissions"].values())


def test_the_wheels_are_for_pythons_that_blender_comes_with() -> None:
    # the last for Linux distributions alone: without it their Blender does not install the extension
    pythons = {Path(wheel).name.split("-")[2] for wheel in MANIFEST["wheels"]}
    assert pythons == {"py3", "cp311", "cp313", "cp314"}
    assert all("manylinux" in wheel for wheel in MANIFEST["wheels"] if "-cp314-" in wheel)


def test_no_file_is_large_or_of_a_kind_that_nobody_can_read() -> None:
    sizes = {name: (ROOT / name).stat().st_size for name in packed()}
    assert max(sizes.values()) < 200_000, max(sizes, key=lambda name: sizes[name])
    assert sum(sizes.values()) < 3_000_000
    assert {Path(name).suffix for name in sizes} <= {".py", ".c", ".html", ".png"}


def test_the_icon_is_what_the_platform_takes_and_stays_out_of_the_zip() -> None:
    """It is uploaded beside the zip: a square PNG of 256 texels, transparent around. `release.icon` draws it."""
    data = (ROOT / "docs/icon.png").read_bytes()
    kind, width, height, bits, color = struct.unpack(">4sIIBB", data[12:26])
    assert (data[:8], kind, width, height, bits, color) == (b"\x89PNG\r\n\x1a\n", b"IHDR", 256, 256, 8, 6)
    assert "/docs/*" in MANIFEST["build"]["paths_exclude_pattern"]
    assert "!/docs/icon.png" not in MANIFEST["build"]["paths_exclude_pattern"]
